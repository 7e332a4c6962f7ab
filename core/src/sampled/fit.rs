//! Least squares: of v on a cell, and of c on the boxes of its steps.

use alloc::vec::Vec;

use super::control::{box_of, power};
use crate::galerkin::{GalerkinError, buffer, solve_in_place};

/// The weight, in steps, with which slopes of c are held to 0: a box with fewer steps than coefficients has a fit, too.
const RIDGE: f64 = 0.1;

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

/// The normal equations of c in all boxes of a cell, one after the other.
pub(super) struct Fit {
    per_axis: u32,
    /// B + D.
    coefficients: usize,
    matrices: Vec<f64>,
    right: Vec<f64>,
    /// The regressors of one step.
    terms: Vec<f64>,
    sum: f64,
    count: u32,
}

impl Fit {
    pub(super) fn new<const D: usize>(
        per_axis: u32,
        functions: usize,
    ) -> Result<Self, GalerkinError> {
        let coefficients = functions + D;
        let boxes = power::<D>(per_axis);
        Ok(Self {
            per_axis,
            coefficients,
            matrices: buffer(boxes * coefficients * coefficients)?,
            right: buffer(boxes * coefficients)?,
            terms: buffer(coefficients)?,
            sum: 0.0,
            count: 0,
        })
    }

    /// A step with ψ(x), ω and κ v(y).
    pub(super) fn add<const D: usize, const B: usize>(
        &mut self,
        psi: &[f64; B],
        omega: &[f64; D],
        value: f64,
    ) {
        let (number, place) = box_of(omega, self.per_axis);
        let all = psi.iter().chain(&place);
        for (term, &value) in self.terms.iter_mut().zip(all) {
            *term = value;
        }
        let n = self.coefficients;
        let matrix = self.matrices.chunks_exact_mut(n * n).nth(number);
        let right = self.right.chunks_exact_mut(n).nth(number);
        if let (Some(matrix), Some(right)) = (matrix, right) {
            let rows = matrix.chunks_exact_mut(n).zip(right);
            for ((row, right), &a) in rows.zip(&self.terms) {
                for (entry, &b) in row.iter_mut().zip(&self.terms) {
                    *entry += a * b;
                }
                *right += a * value;
            }
        }
        self.sum += value;
        self.count += 1;
    }

    /// Writes c of the cell: B + D coefficients for every box.
    pub(super) fn solve(&mut self, control: &mut [f64]) {
        let n = self.coefficients;
        let mean = self.sum / f64::from(self.count.max(1));
        let boxes = self.matrices.chunks_exact_mut(n * n);
        let boxes = boxes.zip(self.right.chunks_exact_mut(n));
        for ((matrix, right), out) in boxes.zip(control.chunks_exact_mut(n)) {
            for (k, entry) in matrix.iter_mut().step_by(n + 1).enumerate() {
                *entry += if k == 0 { 0.0 } else { RIDGE };
            }
            let is_empty = matrix.first().is_none_or(|&count| count == 0.0);
            if !is_empty {
                solve_in_place(matrix, right);
            }
            if is_empty || right.iter().any(|c| !c.is_finite()) {
                right.fill(0.0);
                if let Some(first) = right.first_mut() {
                    *first = mean;
                }
            }
            out.copy_from_slice(right);
        }
    }
}
