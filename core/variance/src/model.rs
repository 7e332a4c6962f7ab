//! The problem as the equations of the variance see it: numbers, no points.

use core::ops::Range;

use fredholm_core::galerkin::PairKind;

use crate::Density;

/// An equation with its neighbour as an analysis sees it, without a type for points. Points have
/// numbers: the nodes of all sites, site by site, and then the starts that are points. So the trait
/// is object safe, and all that is computed with it is compiled once.
///
/// [`VarianceSetup::with_starts`](crate::VarianceSetup::with_starts) makes one from an equation, its neighbour and a
/// [`Quadrature`](crate::Quadrature). What has no number in the model has no values: they are NaN, and no steps.
pub trait VarianceModel: Sync {
    /// The number of sites.
    fn sites(&self) -> usize;

    /// The numbers of the nodes of a site.
    fn nodes(&self, site: usize) -> Range<usize>;

    /// The cell and the weight of a point.
    fn position(&self, point: usize) -> Position;

    /// The functions in a point.
    fn values(&self, point: usize) -> Values;

    /// Σ weight f(y) ≈ ∫ f(y) p(x,y) dμ(y) over a site: calls `visit` for every place y to which a step from the point x
    /// may lead. What is not wanted is 0.
    fn steps(&self, point: usize, site: usize, wanted: Wanted, visit: &mut dyn FnMut(&Transition));

    /// The kind of the pair of cells (i, j).
    fn kind(&self, i: usize, j: usize) -> PairKind;

    /// Where walks of the start with this number begin, if there is one.
    fn start(&self, start: usize) -> Option<Origin>;

    /// The density of a start in a point.
    fn density(&self, start: usize, point: usize) -> Density;
}

/// The cell of a point, and its weight in integrals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// The number of its cell.
    pub cell: usize,
    /// The weight of the quadrature; 1 for a start.
    pub weight: f64,
}

/// The functions in a point x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Values {
    /// q(x).
    pub absorption: f64,
    /// F(x).
    pub source: f64,
    /// G(x).
    pub neighbour_source: f64,
    /// The variance of what is drawn for F(x); 0 where nothing is.
    pub source_noise: f64,
    /// The variance of what is drawn for F(x) − G(x); 0 where nothing is.
    pub noise: f64,
    /// v(x).
    pub value: f64,
}

impl Values {
    /// The values of a point that there is not: no number.
    pub(crate) const MISSING: Self = Self {
        absorption: f64::NAN,
        source: f64::NAN,
        neighbour_source: f64::NAN,
        source_noise: f64::NAN,
        noise: f64::NAN,
        value: f64::NAN,
    };
}

/// The values that an analysis needs of steps. From [`Kernel`](Self::Kernel) to
/// [`Value`](Self::Value) each includes those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Wanted {
    /// The weight, the node and k(x,y).
    Kernel,
    /// The cell of y.
    Cell,
    /// h(x,y).
    Neighbour,
    /// Whether the pair is outside of S.
    Kind,
    /// v(y).
    Value,
}

/// A step from x to a place y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition {
    /// The weight: that of the quadrature times p(x,y) and the probability to go on.
    pub weight: f64,
    /// Which node of its site y is, if it is one.
    pub node: Option<usize>,
    /// The cell of y.
    pub cell: usize,
    /// Whether the pair of cells has h = 0: neither in S nor pointwise.
    pub left_out: bool,
    /// k(x,y), over the probability to go on.
    pub kernel: f64,
    /// What stands for k² where the second moment of the step from y is meant, and of what the state after it scores. By roulette
    /// a small weight does not go on for its square.
    pub next: f64,
    /// What stands for k² in what all later states score.
    pub later: f64,
    /// h(x,y), over the probability to go on.
    pub neighbour: f64,
    /// v(y).
    pub value: f64,
}

impl Transition {
    /// How many times as large as their squares' the second moments of what h multiplies are, in the product form: those of the step
    /// from y are, with which all are counted.
    pub(crate) fn noisier(&self) -> f64 {
        let square = self.kernel * self.kernel;
        if square > 0.0 {
            self.next / square
        } else {
            1.0
        }
    }
}

/// The start of walks: a point or a density.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// In one point.
    Point {
        /// The number of the point.
        point: usize,
        /// The site in which it lies.
        site: usize,
    },
    /// Walks start with a density.
    Density,
}
