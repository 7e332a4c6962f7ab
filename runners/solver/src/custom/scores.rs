//! Polynomials of any degree on the cells of an equation, and what T_K makes of them by quadrature.

use fredholm_core::galerkin::{Cells, legendre, reserve};
use fredholm_core::global::Scores;
use fredholm_core::{Located, NoDraws, Real};
use fredholm_variance::gauss;

use super::CustomEquation;
use super::cells::MOST_DIMENSIONS;
use crate::Error;

/// The largest total degree.
pub(super) const MOST_DEGREE: usize = 7;

/// Polynomials along an axis of a cell at one place.
type Axis = [f64; MOST_DEGREE + 1];

/// Products of Legendre polynomials in the parameters of a cell, of total degree ≤ p. As uniform parameters give uniform
/// points, they are orthonormal on the cell.
#[derive(Clone, Debug)]
pub(super) struct Polynomials {
    dimension: usize,
    /// The degree along every axis, of every function.
    degrees: Vec<[u8; MOST_DIMENSIONS]>,
}

impl Polynomials {
    /// Creates those in so many parameters, of total degree p or less. The first is the constant.
    pub(super) fn new(dimension: usize, degree: usize) -> Self {
        let mut degrees = vec![[0; MOST_DIMENSIONS]];
        for axis in 0..dimension {
            let more = |before: [u8; MOST_DIMENSIONS]| {
                let left = degree - total(&before);
                (0..=left as u8).map(move |own| {
                    let mut degrees = before;
                    degrees[axis] = own;
                    degrees
                })
            };
            degrees = degrees.into_iter().flat_map(more).collect();
        }
        Self { dimension, degrees }
    }

    /// B.
    pub(super) fn functions(&self) -> usize {
        self.degrees.len()
    }

    /// The total degree of every function.
    pub(super) fn totals(&self) -> impl Iterator<Item = usize> {
        self.degrees.iter().map(total)
    }

    /// Piecewise polynomials of a lower total degree as those of this one.
    pub(super) fn embed(&self, degree: usize, cells: usize, low: &[f64]) -> Vec<f64> {
        let mut low = low.iter().copied();
        let totals = (0..cells).flat_map(|_| self.totals());
        totals
            .map(|total| match total <= degree {
                true => low.next().unwrap_or(f64::NAN),
                false => 0.0,
            })
            .collect()
    }

    /// Adds `score` times every function at these parameters.
    fn add(&self, t: &[f64; MOST_DIMENSIONS], score: f64, sums: &mut [f64]) {
        for (sum, psi) in sums.iter_mut().zip(self.at(t)) {
            *sum += score * psi;
        }
    }

    /// Adds `score` times every polynomial at the parameters of a point.
    pub(super) fn add_at(&self, t: &[f64], score: f64, sums: &mut [f64]) {
        let mut all = [0.0; MOST_DIMENSIONS];
        for (to, from) in all.iter_mut().zip(t) {
            *to = *from;
        }
        self.add(&all, score, sums);
    }

    /// The sum of every polynomial times its coefficient.
    pub(super) fn value(&self, t: &[f64; MOST_DIMENSIONS], coefficients: &[f64]) -> f64 {
        let terms = coefficients.iter().zip(self.at(t));
        terms.map(|(c, psi)| c * psi).sum()
    }

    /// Every function at these parameters.
    fn at(&self, t: &[f64; MOST_DIMENSIONS]) -> impl Iterator<Item = f64> {
        let mut axes = [Axis::default(); MOST_DIMENSIONS];
        for (axis, t) in axes.iter_mut().zip(t).take(self.dimension) {
            *axis = legendre(2.0 * t - 1.0);
        }
        self.degrees.iter().map(move |degrees| {
            let own = axes.iter().zip(degrees).take(self.dimension);
            let factors = own.map(|(axis, &degree)| axis[usize::from(degree)]);
            factors.product::<f64>()
        })
    }
}

fn total(degrees: &[u8; MOST_DIMENSIONS]) -> usize {
    degrees.iter().copied().map(usize::from).sum()
}

/// The parameters of a point of a cell in f64, and zeros behind them.
pub(super) fn parameters<E: Cells>(equation: &E, x: &Located<E::Point>) -> [f64; MOST_DIMENSIONS] {
    let mut own = [num_traits::zero::<E::Scalar>(); MOST_DIMENSIONS];
    equation.parameters(x, &mut own[..E::DIMENSION]);
    own.map(Real::to_f64)
}

/// Polynomials on all cells of an equation, for scores of walks.
pub(super) struct CellScores<'a, E> {
    pub(super) equation: &'a E,
    pub(super) polynomials: &'a Polynomials,
}

impl<E: CustomEquation> Scores<E::Point> for CellScores<'_, E> {
    fn unknowns(&self) -> usize {
        self.equation.cells() * self.functions()
    }

    fn functions(&self) -> usize {
        self.polynomials.functions()
    }

    fn add(&self, x: &Located<E::Point>, score: f64, sums: &mut [f64]) {
        let start = x.cell * self.functions();
        if let Some(own) = sums.get_mut(start..start + self.functions()) {
            let t = parameters(self.equation, x);
            self.polynomials.add(&t, score, own);
        }
    }

    fn value(&self, x: &Located<E::Point>, coefficients: &[f64]) -> f64 {
        let start = x.cell * self.functions();
        let own = coefficients.get(start..start + self.functions());
        own.map_or(f64::NAN, |own| {
            self.polynomials.value(&parameters(self.equation, x), own)
        })
    }
}

/// What T_K makes of v and of the polynomials, by a Gauss rule on every cell.
pub(super) struct Integrals<'a, E: CustomEquation> {
    pub(super) equation: &'a E,
    pub(super) polynomials: &'a Polynomials,
    /// v at a point of a cell.
    pub(super) v: &'a (dyn Fn(&Located<E::Point>) -> f64 + Sync),
    /// The rule of an axis on [0, 1].
    rule: Vec<[f64; 2]>,
    /// Nodes of the rule in a cell, the last axis fastest: parameters, shares along every axis, and every function.
    nodes: Vec<([[f64; MOST_DIMENSIONS]; 2], Vec<f64>)>,
}

impl<'a, E: CustomEquation> Integrals<'a, E> {
    /// Prepares rules of so many points of a cell and axis.
    pub(super) fn new(
        (equation, polynomials): (&'a E, &'a Polynomials),
        v: &'a (dyn Fn(&Located<E::Point>) -> f64 + Sync),
        points: usize,
    ) -> Result<Self, Error> {
        let rule = gauss(points)?.into_iter();
        let rule: Vec<[f64; 2]> = rule.map(|(t, w)| [0.5 * (1.0 + t), 0.5 * w]).collect();
        let count = rule.len().pow(E::DIMENSION as u32);
        let mut nodes = reserve(count)?;
        nodes.extend((0..count).map(|number| {
            let (mut rest, mut node) = (number, [[0.0; MOST_DIMENSIONS]; 2]);
            for axis in (0..E::DIMENSION).rev() {
                [node[0][axis], node[1][axis]] = rule[rest % rule.len()];
                rest /= rule.len();
            }
            (node, polynomials.at(&node[0]).collect())
        }));
        Ok(Self {
            equation,
            polynomials,
            v,
            rule,
            nodes,
        })
    }

    /// (T_K v)(x).
    pub(super) fn image(&self, x: &E::Point) -> f64 {
        let mut image = 0.0;
        self.add_cells(x, 1.0, &mut image, &mut []);
        image
    }

    /// Adds `weight` times F(x), (T_K v)(x), and ∫_Xj K(x,y) ψ_jb(y) dμ(y) for all j and b.
    ///
    /// In the cell of x every axis is cut at x, where kernels have their kinks.
    pub(super) fn add(&self, x: &E::Point, weight: f64, out: &mut [f64]) {
        let [source, image, integrals @ ..] = out else {
            return;
        };
        *source += weight * self.equation.source(x, &mut NoDraws).to_f64();
        self.add_cells(x, weight, image, integrals);
    }

    /// Adds (T_K v)(x), and the integrals of K(x, ·) times every polynomial of every cell, if there is room for them.
    fn add_cells(&self, x: &E::Point, weight: f64, image: &mut f64, integrals: &mut [f64]) {
        let own = Located {
            point: *x,
            cell: self.equation.locate(x),
        };
        let cuts = parameters(self.equation, &own);
        let width = self.polynomials.functions();
        for cell in 0..self.equation.cells() {
            let share = weight * self.equation.measure(cell);
            let integrals = integrals.get_mut(cell * width..(cell + 1) * width);
            let integrals = integrals.unwrap_or(&mut []);
            if cell == own.cell {
                let mut at = Node {
                    t: [0.0; MOST_DIMENSIONS],
                    share,
                };
                self.add_cut(x, (cell, &cuts), 0, &mut at, (image, integrals));
                continue;
            }
            for ([t, shares], functions) in &self.nodes {
                let share = shares[..E::DIMENSION]
                    .iter()
                    .fold(share, |all, one| all * one);
                let score = self.score(x, cell, t, share, image);
                for (sum, psi) in integrals.iter_mut().zip(functions) {
                    *sum += score * psi;
                }
            }
        }
    }

    /// K(x, y) times the share of a node y of a cell; its part of (T_K v)(x) is added.
    fn score(
        &self,
        x: &E::Point,
        cell: usize,
        t: &[f64; MOST_DIMENSIONS],
        share: f64,
        image: &mut f64,
    ) -> f64 {
        let point = self.equation.point(cell, &t[..E::DIMENSION]);
        let k = self.equation.kernel(x, &point) * self.equation.density(x, &point);
        let score = share * k.to_f64();
        *image += score * (self.v)(&Located { point, cell });
        score
    }

    /// Adds the nodes of the cell of x whose first parameters are chosen.
    fn add_cut(
        &self,
        x: &E::Point,
        (cell, cuts): (usize, &[f64; MOST_DIMENSIONS]),
        axis: usize,
        at: &mut Node,
        (image, integrals): (&mut f64, &mut [f64]),
    ) {
        if axis == E::DIMENSION {
            let score = self.score(x, cell, &at.t, at.share, image);
            if !integrals.is_empty() {
                self.polynomials.add(&at.t, score, integrals);
            }
            return;
        }
        let cut = cuts[axis].clamp(0.0, 1.0);
        let before = at.share;
        for [from, to] in [[0.0, cut], [cut, 1.0]] {
            if from < to {
                for [t, share] in &self.rule {
                    at.t[axis] = from + (to - from) * t;
                    at.share = before * (to - from) * share;
                    self.add_cut(x, (cell, cuts), axis + 1, at, (image, integrals));
                }
            }
        }
        at.share = before;
    }
}

/// A node of a cell, of which the first parameters are chosen.
struct Node {
    t: [f64; MOST_DIMENSIONS],
    share: f64,
}
