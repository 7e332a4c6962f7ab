//! Least squares: of v on a cell, and of c on the boxes of its steps and on events.

use alloc::vec::Vec;

use super::control::{box_of, power};
use crate::galerkin::{GalerkinError, buffer, reserve, solve_in_place};

/// The weight, in steps, with which coefficients of c but the constants are held to 0: a box with fewer steps than
/// coefficients has a fit, too.
const RIDGE: f64 = 0.1;

/// The least share of the variance that an event must take away: about what its probability adds to the time of a score.
const WORTH: f64 = 0.05;

/// The inverse of a symmetric positive definite matrix; not finite where it is singular.
pub(super) fn inverse<const B: usize>(matrix: [[f64; B]; B]) -> [[f64; B]; B] {
    let mut columns = [[0.0; B]; B];
    for (b, column) in columns.iter_mut().enumerate() {
        column[b] = 1.0;
        let mut copy = matrix;
        solve_in_place(copy.as_flattened_mut(), column);
    }
    columns
}

/// The number of an event in a table of numbers where there is none.
pub(super) const NO_EVENT: f64 = -1.0;

/// A step as the fit has it.
pub(super) struct Step<'s, const D: usize, const B: usize> {
    pub(super) psi: &'s [f64; B],
    pub(super) omega: &'s [f64; D],
    /// κ v(y) of everything that is fitted.
    pub(super) values: &'s [f64],
    /// The events that occur, a bit each.
    pub(super) occurring: u32,
}

/// The normal equations of c on a cell: a block for each box, one for all events, and what joins them.
///
/// A row of `joint` has the sums of products of one coefficient of a box with those of all events, B of each, and with κ v. Where
/// several v are fitted, their controls have the same events: those that serve the last one.
pub(super) struct Fit<'e> {
    events: &'e [u32],
    per_axis: u32,
    functions: usize,
    /// The number of what is fitted.
    fitted: usize,
    /// B + D.
    coefficients: usize,
    matrices: Vec<f64>,
    joint: Vec<f64>,
    /// Sums of products of the events' functions with each other, and with κ v.
    of_events: Vec<f64>,
    /// Σ ψ of steps with an event, then Σ κ v.
    sums: Vec<f64>,
    /// Σ (κ v)² of the last v.
    square: f64,
    count: u32,
    /// The regressors of a step.
    terms: Vec<f64>,
}

impl<'e> Fit<'e> {
    pub(super) fn new<const D: usize, const B: usize>(
        per_axis: u32,
        events: &'e [u32],
        fitted: usize,
    ) -> Result<Self, GalerkinError> {
        let coefficients = B + D;
        let boxes = power::<D>(per_axis);
        let rows = events.len() * B;
        let columns = rows + fitted;
        Ok(Self {
            events,
            per_axis,
            functions: B,
            fitted,
            coefficients,
            matrices: buffer(boxes * coefficients * coefficients)?,
            joint: buffer(boxes * coefficients * columns)?,
            of_events: buffer(rows * columns)?,
            sums: buffer(columns)?,
            square: 0.0,
            count: 0,
            terms: buffer(coefficients)?,
        })
    }

    /// The numbers of a row: of all events, and of κ v.
    fn columns(&self) -> usize {
        self.rows() + self.fitted
    }

    /// The numbers of all events.
    fn rows(&self) -> usize {
        self.events.len() * self.functions
    }

    pub(super) fn add<const D: usize, const B: usize>(&mut self, step: &Step<'_, D, B>) {
        let (number, place) = box_of(step.omega, self.per_axis);
        let all = step.psi.iter().chain(&place);
        for (term, &value) in self.terms.iter_mut().zip(all) {
            *term = value;
        }
        let (n, columns) = (self.coefficients, self.columns());
        let matrix = self.matrices.chunks_exact_mut(n * n).nth(number);
        let joint = self.joint.chunks_exact_mut(n * columns).nth(number);
        if let (Some(matrix), Some(joint)) = (matrix, joint) {
            let rows = matrix.chunks_exact_mut(n);
            let rows = rows.zip(joint.chunks_exact_mut(columns));
            for ((row, joint), &a) in rows.zip(&self.terms) {
                for (entry, &b) in row.iter_mut().zip(&self.terms) {
                    *entry += a * b;
                }
                add_events(joint, a, step);
            }
        }
        let mut left = step.occurring;
        while left != 0 {
            let event = left.trailing_zeros() as usize;
            let own = self.of_events.chunks_exact_mut(columns).skip(event * B);
            for (row, &a) in own.zip(step.psi) {
                add_events(row, a, step);
            }
            left &= left - 1;
        }
        add_events(&mut self.sums, 1.0, step);
        self.square += step.values.last().map_or(0.0, |value| value * value);
        self.count += 1;
    }

    /// Writes c of the cell for each of the first v: B + D coefficients for every box, and of each of the events that are worth
    /// their time its number and B coefficients.
    pub(super) fn solve(&mut self, controls: &mut [Vec<f64>]) -> Result<(), GalerkinError> {
        let boxes = self.matrices.len() / (self.coefficients * self.coefficients);
        let of_boxes = boxes * self.coefficients;
        self.eliminate_boxes()?;
        let slots = controls.first().map_or(0, |control| {
            control.len().saturating_sub(of_boxes) / (1 + self.functions)
        });
        let mut chosen: Vec<usize> = reserve(slots)?;
        self.choose(slots, &mut chosen)?;
        for (place, control) in controls.iter_mut().enumerate() {
            let of_events = self.solve_events(&chosen, place)?;
            let end = of_boxes.min(control.len());
            let (to_boxes, to_slots) = control.split_at_mut(end);
            self.write_events(&chosen, &of_events, to_slots);
            self.write_boxes(&of_events, place, to_boxes);
        }
        Ok(())
    }

    /// Writes the chosen events and their coefficients.
    fn write_events(&self, chosen: &[usize], of_events: &[f64], to: &mut [f64]) {
        let slots = to.chunks_exact_mut(1 + self.functions);
        for (k, slot) in slots.enumerate() {
            slot.fill(0.0);
            let event = chosen.get(k).and_then(|&e| Some((e, *self.events.get(e)?)));
            if let (Some((place, event)), Some((number, own))) = (event, slot.split_first_mut()) {
                *number = f64::from(event);
                let from = of_events.get(place * self.functions..).unwrap_or(&[]);
                for (own, &c) in own.iter_mut().zip(from) {
                    *own = c;
                }
            } else if let Some(number) = slot.first_mut() {
                *number = NO_EVENT;
            }
        }
    }

    /// Writes the coefficients of boxes, from those of events.
    fn write_boxes(&self, of_events: &[f64], place: usize, to: &mut [f64]) {
        let (n, columns, rows) = (self.coefficients, self.columns(), self.rows());
        let without_events = |row: &[f64]| {
            let value = row.get(rows + place).copied().unwrap_or(f64::NAN);
            let products = row.iter().zip(of_events).map(|(a, c)| a * c);
            value - products.sum::<f64>()
        };
        let mean = without_events(&self.sums) / f64::from(self.count.max(1));
        for (c, row) in to.iter_mut().zip(self.joint.chunks_exact(columns)) {
            *c = without_events(row);
        }
        let matrices = self.matrices.chunks_exact(n * n);
        for (own, matrix) in to.chunks_exact_mut(n).zip(matrices) {
            let is_empty = matrix.first().is_none_or(|&count| count == 0.0);
            if is_empty || own.iter().any(|c| !c.is_finite()) {
                own.fill(0.0);
                if let Some(first) = own.first_mut() {
                    *first = mean;
                }
            }
        }
    }

    /// Takes the boxes out of the events' equations, which become those of a Schur complement, and leaves in `joint` the
    /// boxes' matrices' inverses times its rows.
    fn eliminate_boxes(&mut self) -> Result<(), GalerkinError> {
        let (n, columns) = (self.coefficients, self.columns());
        let (mut copy, mut column) = (buffer(n * n)?, buffer(n)?);
        let mut solved: Vec<f64> = buffer(n * columns)?;
        let boxes = self.matrices.chunks_exact_mut(n * n);
        for (matrix, joint) in boxes.zip(self.joint.chunks_exact_mut(n * columns)) {
            if matrix.first().is_none_or(|&count| count == 0.0) {
                continue;
            }
            for entry in matrix.iter_mut().step_by(n + 1).skip(1) {
                *entry += RIDGE;
            }
            solved.fill(0.0);
            for k in 0..columns {
                for (to, from) in column.iter_mut().zip(joint.iter().skip(k).step_by(columns)) {
                    *to = *from;
                }
                if column.iter().all(|&c| c == 0.0) {
                    continue;
                }
                copy.copy_from_slice(matrix);
                solve_in_place(&mut copy, &mut column);
                for (to, from) in solved.iter_mut().skip(k).step_by(columns).zip(&column) {
                    *to = *from;
                }
            }
            for (joint, solved) in joint
                .chunks_exact(columns)
                .zip(solved.chunks_exact(columns))
            {
                let rows = self.of_events.chunks_exact_mut(columns).zip(joint);
                for (row, &a) in rows.filter(|&(_, &a)| a != 0.0) {
                    for (entry, &b) in row.iter_mut().zip(solved) {
                        *entry -= a * b;
                    }
                }
                let both = joint.last().zip(solved.last());
                self.square -= both.map_or(0.0, |(a, b)| a * b);
            }
            joint.copy_from_slice(&solved);
        }
        for entry in self.of_events.iter_mut().step_by(columns + 1) {
            *entry += RIDGE;
        }
        Ok(())
    }

    /// Chooses events one after the other, the one next that takes away most of the variance.
    fn choose(&self, most: usize, chosen: &mut Vec<usize>) -> Result<(), GalerkinError> {
        let (b, columns) = (self.functions, self.columns());
        let mut left: Vec<f64> = reserve(self.of_events.len())?;
        left.extend(&self.of_events);
        let mut rest = self.square;
        let mut best: Vec<f64> = buffer(b * columns)?;
        let mut own: Vec<f64> = buffer(b * columns)?;
        while chosen.len() < most {
            let mut greatest = (0.0, None);
            for event in (0..self.events.len()).filter(|e| !chosen.contains(e)) {
                let gain = pivot(&left, columns, [event * b, b], &mut own)?;
                if gain > greatest.0 {
                    greatest = (gain, Some(event));
                    best.copy_from_slice(&own);
                }
            }
            let (gain, Some(event)) = greatest else { break };
            // Written so that NaN ends it.
            if !(gain > WORTH * rest) {
                break;
            }
            rest -= gain;
            chosen.push(event);
            for row in left.chunks_exact_mut(columns) {
                // A row of `best` has 1 in its own place, and 0 in those of the others of the block.
                for (k, times) in best.chunks_exact(columns).enumerate() {
                    let factor = row.get(event * b + k).copied().unwrap_or(0.0);
                    for (entry, &a) in row.iter_mut().zip(times) {
                        *entry -= factor * a;
                    }
                }
            }
        }
        Ok(())
    }

    /// The B coefficients of all events for one v: of those not chosen 0.
    fn solve_events(&self, chosen: &[usize], place: usize) -> Result<Vec<f64>, GalerkinError> {
        let (b, columns, rows) = (self.functions, self.columns(), self.rows());
        let places = || chosen.iter().flat_map(|&e| e * b..(e + 1) * b);
        let size = chosen.len() * b;
        let (mut matrix, mut right): (Vec<f64>, Vec<f64>) = (reserve(size * size)?, reserve(size)?);
        for row in places().filter_map(|i| self.of_events.get(i * columns..(i + 1) * columns)) {
            matrix.extend(places().filter_map(|j| row.get(j)));
            right.extend(row.get(rows + place));
        }
        solve_in_place(&mut matrix, &mut right);
        let mut all: Vec<f64> = buffer(rows)?;
        if right.iter().all(|c| c.is_finite()) {
            for (place, c) in places().zip(right) {
                all.get_mut(place).into_iter().for_each(|to| *to = c);
            }
        }
        Ok(all)
    }
}

/// Adds a times the numbers of a step to a row of events and κ v.
fn add_events<const D: usize, const B: usize>(row: &mut [f64], a: f64, step: &Step<'_, D, B>) {
    let mut left = step.occurring;
    while left != 0 {
        let event = left.trailing_zeros() as usize;
        for (entry, &psi) in row.iter_mut().skip(event * B).zip(step.psi) {
            *entry += a * psi;
        }
        left &= left - 1;
    }
    let from = row.len().saturating_sub(step.values.len());
    for (entry, &value) in row.iter_mut().skip(from).zip(step.values) {
        *entry += a * value;
    }
}

/// A block's own inverse times its rows, and what it takes away from the sum of squares.
fn pivot(
    matrix: &[f64],
    columns: usize,
    [from, size]: [usize; 2],
    solved: &mut [f64],
) -> Result<f64, GalerkinError> {
    let rows = || matrix.chunks_exact(columns).skip(from).take(size);
    let (mut copy, mut column): (Vec<f64>, Vec<f64>) = (buffer(size * size)?, buffer(size)?);
    for k in 0..columns {
        for (own, row) in copy.chunks_exact_mut(size).zip(rows()) {
            own.iter_mut()
                .zip(row.iter().skip(from))
                .for_each(|(to, a)| *to = *a);
        }
        for (to, row) in column.iter_mut().zip(rows()) {
            *to = row.get(k).copied().unwrap_or(f64::NAN);
        }
        solve_in_place(&mut copy, &mut column);
        for (to, from) in solved.iter_mut().skip(k).step_by(columns).zip(&column) {
            *to = *from;
        }
    }
    let last = solved.iter().skip(columns - 1).step_by(columns);
    let right = rows().filter_map(|row| row.last());
    Ok(right.zip(last).map(|(a, b)| a * b).sum())
}
