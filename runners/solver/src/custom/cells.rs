//! Quadrature over cells and draws from them, for any equation whose cells are images of a cube.

use fredholm_core::galerkin::{Cells, GalerkinError, reserve};
use fredholm_core::{Located, Real, Space, Uniforms};
use fredholm_model::numbers::sum;
use fredholm_variance::gauss;

use crate::Error;

pub(super) use fredholm_core::galerkin::MOST_DIMENSIONS;

/// Parameters in [0, 1]^d with their shares of the whole, which sum to 1: the tensor product of a Gauss rule.
pub(super) fn tensor(
    dimension: usize,
    points: usize,
) -> Result<Vec<(Vec<f64>, f64)>, GalerkinError> {
    let axis = gauss(points)?;
    let count = points.saturating_pow(dimension as u32);
    let mut rule = reserve(count)?;
    for number in 0..count {
        let (mut rest, mut share) = (number, 1.0);
        let place = (0..dimension).map(|_| {
            let (t, weight) = axis[rest % points];
            rest /= points;
            share *= 0.5 * weight;
            0.5 * (1.0 + t)
        });
        rule.push((place.collect(), share));
    }
    Ok(rule)
}

/// Quadrature points of all cells.
pub(crate) struct Nodes<P> {
    /// The points of cell 0, then those of cell 1, and so on.
    points: Vec<P>,
    /// The share of its cell that each of a cell's points stands for.
    shares: Vec<f64>,
    /// μ(X_j).
    measures: Vec<f64>,
}

impl<P: Copy> Nodes<P> {
    /// The points of a Gauss rule, as many for every axis of a cell.
    pub(crate) fn new<E: Cells<Point = P>>(equation: &E, points: usize) -> Result<Self, Error> {
        Self::of_parts(equation, 1, points)
    }

    /// The nodes of all parts of cells, of as many equal parts for every axis: a part in place of a cell.
    pub(super) fn of_parts<E: Cells<Point = P>>(
        equation: &E,
        parts: usize,
        points: usize,
    ) -> Result<Self, Error> {
        let rule = tensor(E::DIMENSION, points.max(1))?;
        let boxes = parts.pow(E::DIMENSION as u32);
        let count = equation.cells().saturating_mul(boxes);
        let mut all = reserve(count.saturating_mul(rule.len()))?;
        for number in 0..count {
            all.extend(rule.iter().map(|(t, _)| {
                let mut part = number % boxes;
                let place: Vec<f64> = t
                    .iter()
                    .map(|t| {
                        let first = part % parts;
                        part /= parts;
                        (first as f64 + t) / parts as f64
                    })
                    .collect();
                equation.point(number / boxes, &place)
            }));
        }
        let measure = |number| equation.measure(number / boxes) / boxes as f64;
        Ok(Self {
            points: all,
            shares: rule.into_iter().map(|(_, share)| share).collect(),
            measures: (0..count).map(measure).collect(),
        })
    }

    /// The points of a cell, with shares that sum to 1.
    pub(super) fn shares(&self, cell: usize) -> impl Iterator<Item = (P, f64)> {
        let count = self.shares.len();
        let points = self.points[cell * count..(cell + 1) * count].iter();
        points.copied().zip(self.shares.iter().copied())
    }

    /// The points of a cell, with weights that sum to its measure.
    pub(super) fn weighted(&self, cell: usize) -> impl Iterator<Item = (P, f64)> {
        let measure = self.measures[cell];
        self.shares(cell)
            .map(move |(x, share)| (x, measure * share))
    }

    /// The number of cells.
    pub(super) const fn cells(&self) -> usize {
        self.measures.len()
    }

    /// μ of every cell.
    pub(super) fn measures(&self) -> &[f64] {
        &self.measures
    }

    /// ∫ f dμ over the whole space.
    pub(super) fn integral(&self, f: impl Fn(&P) -> f64) -> f64 {
        let cell = |j| self.weighted(j).map(|(x, weight)| weight * f(&x));
        sum((0..self.cells()).flat_map(cell))
    }
}

/// The shares of the cells, by which points are drawn that are uniform on the space.
#[derive(Clone, Debug)]
pub(super) struct Shares {
    /// The share of the space up to every cell and with it.
    up_to: Vec<f64>,
    /// μ(X).
    pub(super) measure: f64,
}

impl Shares {
    pub(super) fn new<E: Cells>(equation: &E) -> Self {
        let measures = (0..equation.cells()).map(|cell| equation.measure(cell));
        let measure: f64 = measures.clone().sum();
        let mut sum = 0.0;
        let up_to = measures.map(|one| {
            sum += one;
            sum / measure
        });
        Self {
            up_to: up_to.collect(),
            measure,
        }
    }

    #[inline]
    pub(super) fn draw<E: Cells, U: Uniforms<E::Scalar>>(
        &self,
        equation: &E,
        uniforms: &mut U,
    ) -> E::Point {
        const {
            assert!(
                E::DIMENSION <= MOST_DIMENSIONS,
                "cells have at most 6 dimensions"
            );
        }
        // One cell takes no number to find.
        let cell = match self.up_to.len() {
            1 => 0,
            cells => {
                let place = uniforms.uniform().to_f64();
                let cell = self.up_to.partition_point(|&up_to| up_to <= place);
                cell.min(cells.saturating_sub(1))
            }
        };
        let mut t = [0.0; MOST_DIMENSIONS];
        for t in t.iter_mut().take(E::DIMENSION) {
            *t = uniforms.uniform().to_f64();
        }
        equation.point(cell, &t[..E::DIMENSION])
    }
}

/// Draws points that are uniform on the space.
pub(super) struct Uniform<'a, E: Space> {
    equation: &'a E,
    shares: Shares,
    /// μ(X).
    pub(super) measure: f64,
    /// How the equation itself draws such points, if it does: from as many numbers as there are dimensions, of which points that fill
    /// the cube evenly make the most.
    own: Option<DrawFn<E>>,
}

/// Draws a point of an equation.
pub(super) type DrawFn<E> = fn(&E, &mut dyn Uniforms<<E as Space>::Scalar>) -> <E as Space>::Point;

impl<'a, E: Cells> Uniform<'a, E> {
    pub(super) fn new(equation: &'a E, own: Option<DrawFn<E>>) -> Self {
        let shares = Shares::new(equation);
        Self {
            measure: shares.measure,
            shares,
            equation,
            own,
        }
    }

    pub(super) const fn equation(&self) -> &'a E {
        self.equation
    }

    /// The share of the space before a point, of one dimension whose cells lie in its order.
    pub(super) fn before(&self, x: &E::Point) -> f64 {
        let cell = self.equation.locate(x);
        let mut t = [E::Scalar::from_f64(0.0); 1];
        self.equation
            .parameters(&Located { point: *x, cell }, &mut t);
        let up_to = |cell: usize| self.shares.up_to.get(cell).copied().unwrap_or(1.0);
        let from = cell.checked_sub(1).map_or(0.0, up_to);
        from + (up_to(cell) - from) * t[0].to_f64()
    }

    /// The mean of a function of so many coefficients on every cell, of which the first is its mean there.
    pub(super) fn mean(&self, functions: usize, coefficients: &[E::Scalar]) -> f64 {
        let mut before = 0.0;
        let cells = self.shares.up_to.iter().zip(coefficients.chunks(functions));
        let terms = cells.map(|(&up_to, own)| {
            let share = up_to - before;
            before = up_to;
            share * own.first().map_or(f64::NAN, |mean| mean.to_f64())
        });
        sum(terms)
    }

    #[inline]
    pub(super) fn draw<U: Uniforms<E::Scalar>>(&self, uniforms: &mut U) -> E::Point {
        match self.own {
            Some(own) => own(self.equation, uniforms),
            None => self.shares.draw(self.equation, uniforms),
        }
    }
}
