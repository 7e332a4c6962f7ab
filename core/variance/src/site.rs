//! What is kept of a site.

use alloc::vec::Vec;
use core::ops::AddAssign;

/// Integrals over steps from a node, or in the mean over a site, into another site, each with p(x,y) dμ(y). D = k − h.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// ∫ p.
    pub mass: f64,
    /// ∫ k p.
    pub k: f64,
    /// ∫ k² p.
    pub kk: f64,
    /// ∫ k h p.
    pub kh: f64,
    /// ∫ h² p.
    pub hh: f64,
    /// ∫ h D p.
    pub hd: f64,
}

impl Moments {
    /// The moments of one step of this weight.
    #[inline]
    #[must_use]
    pub fn of(weight: f64, k: f64, h: f64) -> Self {
        Self {
            mass: weight,
            k: weight * k,
            kk: weight * k * k,
            kh: weight * k * h,
            hh: weight * h * h,
            hd: weight * h * (k - h),
        }
    }

    #[inline]
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self {
            mass: factor * self.mass,
            k: factor * self.k,
            kk: factor * self.kk,
            kh: factor * self.kh,
            hh: factor * self.hh,
            hd: factor * self.hd,
        }
    }
}

impl AddAssign for Moments {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.mass += other.mass;
        self.k += other.k;
        self.kk += other.kk;
        self.kh += other.kh;
        self.hh += other.hh;
        self.hd += other.hd;
    }
}

/// The values at a node x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// The number of x in the model.
    pub point: usize,
    /// The number of its cell.
    pub cell: usize,
    /// The weight of the quadrature.
    pub weight: f64,
    /// q(x).
    pub absorption: f64,
    /// F(x).
    pub source: f64,
    /// G(x).
    pub neighbour_source: f64,
    /// The variance of what is drawn for F(x).
    pub source_noise: f64,
    /// The variance of what is drawn for F(x) − G(x).
    pub noise: f64,
    /// v(x).
    pub value: f64,
    /// r(x) = F − G + T_Dp v.
    pub residual: f64,
    /// ∫ |D| p, whose supremum is δ(k,h), (20).
    pub delta: f64,
    /// ∫ D² p over all y, whose supremum is ε(k,h)², (21), in and outside S.
    pub squares: [f64; 2],
    /// e(x).
    pub error: f64,
    /// s(x).
    pub second: f64,
    /// c(x).
    pub mixed: f64,
    /// The parts of what a walk in x adds to w: by the difference of the sources, by T_D²p s + 2
    /// T_kDp c in S, and by the same outside.
    pub parts: [f64; 3],
    /// E η(k,f)² and w(x); NaN where infinite.
    pub totals: [f64; 2],
}

impl Node {
    /// F(x) − G(x).
    #[inline]
    pub(crate) fn difference(&self) -> f64 {
        self.source - self.neighbour_source
    }

    /// The source of w.
    #[inline]
    pub(crate) fn squared(&self) -> f64 {
        self.parts.iter().sum()
    }
}

/// A site, with what it contributes to the equations of the variance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Site {
    /// The nodes of the site.
    pub nodes: Vec<Node>,
    /// In the mean over the site, for every site that a step may lead to.
    pub row: Vec<Moments>,
    /// In the mean over the site: what steps into every site add to w.
    pub pairs: Vec<f64>,
    /// The largest |k|, |h| and |k − h| at the nodes.
    pub largest: [f64; 3],
    /// μ of the site.
    pub measure: f64,
}

impl Site {
    /// The mean of a function of the nodes.
    pub(crate) fn mean(&self, function: impl Fn(&Node) -> f64) -> f64 {
        let sum: f64 = self.nodes.iter().map(|x| x.weight * function(x)).sum();
        sum / self.measure
    }
}
