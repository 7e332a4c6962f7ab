//! Quadrature on the cube, to predict variances with.

use alloc::vec::Vec;
use fredholm_core::array::from_fn;

use fredholm_core::StateSpace;
use fredholm_core::galerkin::{GalerkinError, reserve};
use fredholm_variance::{AllowedKinds, Quadrature, Step, gauss};

use crate::Cube;
use crate::mesh::Mesh;

/// Sites of equal boxes: cells, or equal parts of them where there are few cells.
/// The nodes of a site are those of a tensor Gauss rule of p + 2 points an axis.
#[derive(Clone, Debug)]
pub struct CubeQuadrature<const D: usize> {
    mesh: Mesh<D>,
    /// 1 − q0.
    survival: f64,
    /// The rule of a site: places in [0, 1]^D and weights that sum to 1.
    rule: Vec<([f64; D], f64)>,
    /// The nodes of all sites.
    nodes: Vec<([f64; D], f64)>,
}

impl<const D: usize> CubeQuadrature<D> {
    /// The quadrature for these cells and a neighbour equation of this degree: sites are cells, or
    /// parts of them as long as there are at most `nodes` nodes.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn new<K, S, const B: usize>(
        cube: &Cube<f64, D, K, S, B>,
        nodes: usize,
        degree: usize,
    ) -> Result<Self, GalerkinError> {
        let rule = tensor(degree + 2)?;
        let cells = cube.per_axis();
        let mut per_axis = cells;
        let fits = |per_axis: usize| u32::try_from(D).ok().and_then(|d| per_axis.checked_pow(d));
        while fits(per_axis + cells).is_some_and(|count| count.saturating_mul(rule.len()) <= nodes)
        {
            per_axis += cells;
        }
        let mesh = Mesh::new(per_axis).map_err(|_| GalerkinError::Memory { bytes: None })?;
        let count = mesh.cells().checked_mul(rule.len());
        let mut all = reserve(count.unwrap_or(usize::MAX))?;
        let (scale, volume) = (1.0 / per_axis as f64, 1.0 / mesh.cells() as f64);
        for site in 0..mesh.cells() {
            let corner = mesh.places(site);
            all.extend(rule.iter().map(|(place, weight)| {
                let at = |a: usize| (f64::from(corner[a]) + place[a]) * scale;
                (from_fn(at), volume * weight)
            }));
        }
        Ok(Self {
            mesh,
            survival: cube.survival(),
            rule,
            nodes: all,
        })
    }

    /// The kinds that a pair of cells may have: all, if there are exact integrals. Such a one costs 0.8 to 1.2 of a
    /// state for kernels that are cheap (`cargo bench -p fredholm-benches --bench pairs`), where it is two to eight
    /// values of a primitive beside one of the kernel.
    #[must_use]
    pub fn allowed_kinds(&self, integrals: bool) -> AllowedKinds {
        AllowedKinds {
            galerkin: true,
            pointwise: integrals.then_some(1.0),
            left_out: true,
        }
    }

    fn of_site(&self, site: usize) -> &[([f64; D], f64)] {
        let points = self.rule.len();
        self.nodes
            .get(site * points..(site + 1) * points)
            .unwrap_or(&[])
    }
}

fn tensor<const D: usize>(points: usize) -> Result<Vec<([f64; D], f64)>, GalerkinError> {
    let axis = gauss(points)?;
    let count = u32::try_from(D).ok().and_then(|d| points.checked_pow(d));
    let mut rule = reserve(count.unwrap_or(usize::MAX))?;
    for mut number in 0..count.unwrap_or(0) {
        let mut weight = 1.0;
        let place = from_fn(|_| {
            let (t, w) = axis.get(number % points).copied().unwrap_or_default();
            number /= points;
            weight *= 0.5 * w;
            0.5 * (1.0 + t)
        });
        rule.push((place, weight));
    }
    Ok(rule)
}

impl<const D: usize> StateSpace for CubeQuadrature<D> {
    type Scalar = f64;
    type Point = [f64; D];
}

impl<const D: usize> Quadrature for CubeQuadrature<D> {
    fn sites(&self) -> usize {
        self.mesh.cells()
    }

    fn locate(&self, x: &[f64; D]) -> usize {
        self.mesh.locate(x, f64::from(self.mesh.per_axis()))
    }

    fn nodes(&self, site: usize, mut visit: impl FnMut([f64; D], f64)) {
        for &(point, weight) in self.of_site(site) {
            visit(point, weight);
        }
    }

    fn steps(&self, _: &[f64; D], site: usize, mut visit: impl FnMut(Step<[f64; D]>)) {
        for (node, &(point, weight)) in self.of_site(site).iter().enumerate() {
            visit(Step {
                point,
                weight: self.survival * weight,
                node: Some(node),
            });
        }
    }
}
