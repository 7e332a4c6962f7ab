//! Moments between sites as matrices, and functions on sites and their nodes as vectors.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::array::Each;
use fredholm_core::galerkin::{
    Dense, GalerkinError, GalerkinMatrix, StoppingRule, buffer, gauss_seidel, reserve,
};

use crate::site::Moments;
use crate::{Node, Site, VarianceError};

/// The largest power of an operator that is looked at.
pub(crate) const POWERS: u32 = 1000;
/// The equations of the variance are solved to this share of their largest source.
const TOLERANCE: f64 = 1e-12;
const SWEEPS: u32 = 10_000;

/// A power whose norm is below 1, as (13) of Heinrich 1995 asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Power {
    /// n0: the smallest one.
    pub exponent: u32,
    /// γ: the norm of that power in L∞.
    pub norm: f64,
}

/// Values in all nodes, and in the mean over sites.
pub(crate) struct Nodal<'a, T> {
    pub(crate) means: &'a [T],
    first: Vec<usize>,
    nodes: Vec<T>,
}

impl<'a, T: Copy + Default> Nodal<'a, T> {
    pub(crate) fn new(
        sites: &[Site],
        means: &'a [T],
        value: impl Fn(&Node) -> T,
    ) -> Result<Self, GalerkinError> {
        let count = sites.iter().map(|site| site.nodes.len()).sum();
        let (mut first, mut nodes) = (buffer(sites.len())?, reserve(count)?);
        for (first, site) in first.iter_mut().zip(sites) {
            *first = nodes.len();
            nodes.extend(site.nodes.iter().map(&value));
        }
        Ok(Self {
            means,
            first,
            nodes,
        })
    }

    #[inline]
    pub(crate) fn at(&self, site: usize, node: Option<usize>) -> Option<T> {
        let of_node = node.and_then(|node| self.nodes.get(self.first.get(site)? + node));
        of_node.or_else(|| self.means.get(site)).copied()
    }
}

/// One of the moments between sites as a matrix.
pub(crate) struct Matrix<'a, M> {
    sites: &'a [Site],
    moment: M,
    transposed: bool,
}

impl<M: Fn(&Moments) -> f64> GalerkinMatrix for Matrix<'_, M> {
    type Scalar = f64;

    fn cells(&self) -> usize {
        self.sites.len()
    }

    fn functions(&self) -> usize {
        1
    }

    #[inline]
    fn entry(&self, [i, _]: [usize; 2], [j, _]: [usize; 2]) -> f64 {
        let (i, j) = if self.transposed { (j, i) } else { (i, j) };
        let moments = self.sites.get(i).and_then(|site| site.row.get(j));
        moments.map_or(f64::NAN, &self.moment)
    }
}

impl<'a, M: Fn(&Moments) -> f64> Matrix<'a, M> {
    pub(crate) const fn new(sites: &'a [Site], moment: M) -> Self {
        Self {
            sites,
            moment,
            transposed: false,
        }
    }

    /// The matrix of the adjoint operator, acting on masses of sites.
    pub(crate) const fn adjoint(sites: &'a [Site], moment: M) -> Self {
        Self {
            sites,
            moment,
            transposed: true,
        }
    }

    /// The solution of x = Ax + b.
    pub(crate) fn resolve(&self, source: &[f64]) -> Result<Vec<f64>, GalerkinError> {
        let largest = source.iter().fold(0.0, |m: f64, b| Real::max(m, b.abs()));
        let mut x = buffer(source.len())?;
        x.copy_from_slice(source);
        let sweeps = StoppingRule::UntilResidual {
            residual: TOLERANCE * largest,
            at_most: SWEEPS,
        };
        let entries = self.entries()?;
        let table = Dense::new(&entries, self.cells(), 1);
        let table = table.ok_or(GalerkinError::Memory { bytes: None })?;
        gauss_seidel(&table, source, &mut x, &mut [0.0; 2], sweeps)?;
        Ok(x)
    }

    /// The entries row by row: sweeps go over them some tens of times, and every one of them is far from the next in the sites.
    fn entries(&self) -> Result<Vec<f64>, GalerkinError> {
        let n = self.cells();
        let mut entries: Vec<f64> = buffer(n.saturating_mul(n))?;
        for (i, site) in self.sites.iter().enumerate() {
            if self.transposed {
                let column = entries.iter_mut().skip(i).step_by(n);
                for (entry, moments) in column.zip(&site.row) {
                    *entry = (self.moment)(moments);
                }
            } else if let Some(row) = entries.get_mut(i * n..(i + 1) * n) {
                for (entry, moments) in row.iter_mut().zip(&site.row) {
                    *entry = (self.moment)(moments);
                }
            }
        }
        Ok(entries)
    }

    /// The smallest power whose norm is below 1: ‖A^m‖ = max A^m 1, where A has no negative entries.
    ///
    /// None has, and the search ends, once A w ≥ w for a w ≥ 0 that is not 0: then ρ(A) ≥ 1 (Collatz 1942).
    pub(crate) fn contracting_power(&self) -> Result<Option<Power>, GalerkinError> {
        let (mut w, mut next) = (buffer(self.sites.len())?, buffer(self.sites.len())?);
        w.fill(1.0);
        for exponent in 1..=POWERS {
            self.apply(&w, &mut next);
            let norm = next.iter().fold(0.0, |m: f64, x| Real::max(m, *x));
            if norm < 1.0 {
                return Ok(Some(Power { exponent, norm }));
            }
            // More than the rounding of a row's sum.
            let grows = |(next, w): (&f64, &f64)| *next >= (1.0 + 1e-9) * w;
            if !(norm < 1e100) || next.iter().zip(&w).all(grows) {
                break;
            }
            core::mem::swap(&mut w, &mut next);
        }
        Ok(None)
    }
}

/// Σ_j of a moment times a vector.
pub(crate) fn against(row: &[Moments], moment: impl Fn(&Moments) -> f64, x: &[f64]) -> f64 {
    row.iter().zip(x).map(|(m, x)| moment(m) * x).sum()
}

/// Masses of sites after a step: Σ_i of a mass times a moment.
pub(crate) fn along(
    sites: &[Site],
    masses: &[f64],
    moment: impl Fn(&Moments) -> f64,
) -> Result<Vec<f64>, GalerkinError> {
    let mut out = buffer(sites.len())?;
    for (site, mass) in sites.iter().zip(masses) {
        for (out, moments) in out.iter_mut().zip(&site.row) {
            *out += mass * moment(moments);
        }
    }
    Ok(out)
}

/// The means over sites of two functions of the nodes.
pub(crate) fn means(
    sites: &[Site],
    of: impl Fn(&Node) -> [f64; 2],
) -> Result<Vec<[f64; 2]>, GalerkinError> {
    let mut out = reserve(sites.len())?;
    out.extend(
        sites
            .iter()
            .map(|site| [0, 1].each(|k| site.mean(|x| of(x)[k]))),
    );
    Ok(out)
}

/// Collects a number of every site.
pub(crate) fn collect(
    sites: &[Site],
    of: impl Fn(&Site) -> f64,
) -> Result<Vec<f64>, VarianceError> {
    let mut out = buffer(sites.len())?;
    for (i, (out, site)) in out.iter_mut().zip(sites).enumerate() {
        *out = of(site);
        if !out.is_finite() {
            return Err(VarianceError::NotFinite { site: i });
        }
    }
    Ok(out)
}

pub(crate) fn check(sites: &[Site], sound: impl Fn(&Site) -> bool) -> Result<(), VarianceError> {
    match sites.iter().position(|site| !sound(site)) {
        Some(site) => Err(VarianceError::NotFinite { site }),
        None => Ok(()),
    }
}
