//! What is kept of a site.

use alloc::vec::Vec;
use core::ops::AddAssign;

use crate::Transition;

/// Integrals over steps from a node, or in the mean over a site, into another site, each with p(x,y) dμ(y). D = k − h.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moments {
    /// ∫ p.
    pub(crate) mass: f64,
    /// ∫ k p.
    pub(crate) k: f64,
    /// ∫ k² p.
    pub(crate) kk: f64,
    /// ∫ of what stands for k² in the second moment of the next step.
    pub(crate) next: f64,
    /// ∫ of what stands for it in those of all later states.
    pub(crate) later: f64,
    /// ∫ k h p.
    pub(crate) kh: f64,
    /// ∫ h² p.
    pub(crate) hh: f64,
    /// ∫ h D p.
    pub(crate) hd: f64,
}

impl Moments {
    /// The moments of one step, where all that the quadrature has there counts so much.
    #[inline]
    pub(crate) fn of(weight: f64, step: &Transition) -> Self {
        let (k, h) = (step.kernel, step.neighbour);
        let noisier = weight * step.noisier();
        Self {
            mass: weight,
            k: weight * k,
            kk: weight * k * k,
            next: weight * step.next,
            later: weight * step.later,
            kh: noisier * k * h,
            hh: noisier * h * h,
            hd: noisier * h * (k - h),
        }
    }

    #[inline]
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self {
            mass: factor * self.mass,
            k: factor * self.k,
            kk: factor * self.kk,
            next: factor * self.next,
            later: factor * self.later,
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
        self.next += other.next;
        self.later += other.later;
        self.kh += other.kh;
        self.hh += other.hh;
        self.hd += other.hd;
    }
}

/// The values at a node x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// The number of x in the model.
    pub(crate) point: usize,
    /// The number of its cell.
    pub(crate) cell: usize,
    /// The weight of the quadrature.
    pub(crate) weight: f64,
    /// q(x).
    pub(crate) absorption: f64,
    /// F(x).
    pub(crate) source: f64,
    /// G(x).
    pub(crate) neighbour_source: f64,
    /// The variance of what is drawn for F(x).
    pub(crate) source_noise: f64,
    /// The variance of what is drawn for F(x) − G(x).
    pub(crate) noise: f64,
    /// v(x).
    pub(crate) value: f64,
    /// r(x) = F − G + T_Dp v.
    pub(crate) residual: f64,
    /// ∫ |D| p, whose supremum is δ(k,h), (20).
    pub(crate) delta: f64,
    /// ∫ D² p over all y, whose supremum is ε(k,h)², (21), in and outside S.
    pub(crate) squares: [f64; 2],
    /// e(x).
    pub(crate) error: f64,
    /// s(x).
    pub(crate) second: f64,
    /// c(x).
    pub(crate) mixed: f64,
    /// The parts of what a walk in x adds to w: by the difference of the sources, by T_D²p s + 2
    /// T_kDp c in S, and by the same outside.
    pub(crate) parts: [f64; 3],
    /// The parts of E η(k,f)² and w(x) that the step from x makes, with what the next state scores; NaN where infinite.
    pub(crate) next: [f64; 2],
    /// The parts that all later states make.
    pub(crate) later: [f64; 2],
}

impl Node {
    /// F(x) − G(x).
    #[inline]
    pub(crate) fn difference(&self) -> f64 {
        self.source - self.neighbour_source
    }
}

/// A site, with what it contributes to the equations of the variance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Site {
    /// The nodes of the site.
    pub nodes: Vec<Node>,
    /// In the mean over the site, for every site that a step may lead to.
    pub(crate) row: Vec<Moments>,
    /// In the mean over the site: what steps into every site add to w.
    pub(crate) pairs: Vec<f64>,
    /// The largest |k|, |h| and |k − h| at the nodes.
    pub(crate) largest: [f64; 3],
    /// μ of the site.
    pub(crate) measure: f64,
}

impl Site {
    /// The mean of a function of the nodes.
    pub(crate) fn mean(&self, function: impl Fn(&Node) -> f64) -> f64 {
        let sum: f64 = self.nodes.iter().map(|x| x.weight * function(x)).sum();
        sum / self.measure
    }
}
