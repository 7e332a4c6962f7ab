//! Quadrature on the sphere, to predict variances with.

use alloc::vec::Vec;
use fredholm_core::array::Each;

use fredholm_core::galerkin::{GalerkinError, Partition, reserve};
use fredholm_core::{Real, StateSpace, TransitionDensity};
use fredholm_variance::{Quadrature, Step};

use crate::{Point, Sphere};

/// Nodes of a site, two an axis.
const NODES: usize = 4;
/// 1/√3, the nodes of the Gauss rule of two points.
const NODE: f64 = 0.577_350_269_189_625_8;

/// Sites of equal bands and sectors: parts of cells where there are few cells, groups of them where there are many, of
/// which the one in the middle stands for all others, except for steps within the group.
#[derive(Clone, Debug)]
pub struct SphereQuadrature {
    /// The sphere with the sites for cells.
    sites: Sphere<f64>,
    /// The sphere with what has nodes for cells: parts of cells, or cells.
    pieces: Sphere<f64>,
    /// Pieces of a site: bands and sectors.
    group: [u32; 2],
    /// The nodes of all sites: point and weight.
    nodes: Vec<(Point<f64>, f64)>,
}

impl SphereQuadrature {
    /// The quadrature with about `nodes` nodes at most.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn new(sphere: &Sphere<f64>, nodes: usize) -> Result<Self, GalerkinError> {
        let [bands, sectors] = [sphere.bands(), sphere.sectors()];
        let (cells, most) = (sphere.cells(), (nodes / NODES).max(1));
        let (split, group) = if most >= cells {
            (split(most / cells), [1, 1])
        } else {
            ([1, 1], grouped([bands, sectors], cells.div_ceil(most)))
        };
        let pieces = sphere.with_cells(bands * split[0], sectors * split[1]);
        let sites = sphere.with_cells(pieces.bands() / group[0], pieces.sectors() / group[1]);
        let mut quadrature = Self {
            sites,
            pieces,
            group,
            nodes: reserve(sites.cells().saturating_mul(NODES))?,
        };
        let pieces_of_site = f64::from(group[0]) * f64::from(group[1]);
        for site in 0..sites.cells() {
            let [band, sector] = quadrature.first_piece(site);
            let nodes = quadrature.rule(band + group[0] / 2, sector + group[1] / 2);
            let weighted = nodes.each(|(x, weight)| (x, pieces_of_site * weight));
            quadrature.nodes.extend(weighted);
        }
        Ok(quadrature)
    }

    /// Height and azimuth of the middle of a site.
    #[must_use]
    pub fn middle(&self, site: usize) -> [f64; 2] {
        let (band, sector) = self.sites.band_and_sector(site);
        let turn = (f64::from(sector) + 0.5) / f64::from(self.sites.sectors());
        let azimuth = core::f64::consts::TAU * turn - core::f64::consts::PI;
        [self.sites.mean_height(band), azimuth]
    }

    /// Band and sector of the first piece of a site.
    fn first_piece(&self, site: usize) -> [u32; 2] {
        let (band, sector) = self.sites.band_and_sector(site);
        [band * self.group[0], sector * self.group[1]]
    }

    /// The nodes of a piece, in height and azimuth, with weights that sum to its area.
    fn rule(&self, band: u32, sector: u32) -> [(Point<f64>, f64); NODES] {
        let [bands, sectors] = [self.pieces.bands(), self.pieces.sectors()].each(f64::from);
        let middle = self.pieces.mean_height(band);
        let weight = core::f64::consts::PI / (bands * sectors);
        [[-NODE, -NODE], [-NODE, NODE], [NODE, -NODE], [NODE, NODE]].each(|[t, s]| {
            let height = middle + t / bands;
            let radius = Real::sqrt((1.0 - height) * (1.0 + height));
            let turn = (f64::from(sector) + 0.5 + 0.5 * s) / sectors;
            let azimuth = core::f64::consts::TAU * turn - core::f64::consts::PI;
            let x = [
                radius * Real::cos(azimuth),
                radius * Real::sin(azimuth),
                height,
            ];
            (x, weight)
        })
    }

    fn of_site(&self, site: usize) -> &[(Point<f64>, f64)] {
        let first = site.saturating_mul(NODES);
        self.nodes.get(first..first + NODES).unwrap_or(&[])
    }
}

/// The bands and sectors of at most this many parts of a cell.
fn split(parts: usize) -> [u32; 2] {
    let parts = u32::try_from(parts).unwrap_or(u32::MAX);
    let bands = parts.isqrt().max(1);
    [bands, (parts / bands).max(1)]
}

/// The least group of at least this many cells, as bands and sectors: these divide all bands and all sectors.
fn grouped([bands, sectors]: [u32; 2], least: usize) -> [u32; 2] {
    let mut best = [bands, sectors];
    let size = |[bands, sectors]: [u32; 2]| bands as usize * sectors as usize;
    for of_bands in (1..=bands).filter(|of| bands.is_multiple_of(*of)) {
        let first = least.div_ceil(of_bands as usize);
        let first = u32::try_from(first).unwrap_or(u32::MAX);
        let mut fitting = (first..=sectors).filter(|of| sectors.is_multiple_of(*of));
        let Some(of_sectors) = fitting.next() else {
            continue;
        };
        let found = [of_bands, of_sectors];
        // Of two that are as large the rounder.
        let rounder = of_bands.max(of_sectors) < best[0].max(best[1]);
        if size(found) < size(best) || (size(found) == size(best) && rounder) {
            best = found;
        }
    }
    best
}

impl StateSpace for SphereQuadrature {
    type Scalar = f64;
    type Point = Point<f64>;
}

impl Quadrature for SphereQuadrature {
    fn sites(&self) -> usize {
        self.sites.cells()
    }

    fn locate(&self, x: &Point<f64>) -> usize {
        self.sites.locate(x)
    }

    fn nodes(&self, site: usize, mut visit: impl FnMut(Point<f64>, f64)) {
        for &(point, weight) in self.of_site(site) {
            visit(point, weight);
        }
    }

    fn steps(&self, x: &Point<f64>, site: usize, mut visit: impl FnMut(Step<Point<f64>>)) {
        let mut step = |(point, weight): (Point<f64>, f64), node| {
            visit(Step {
                point,
                weight: weight * self.sites.density(x, &point),
                node,
            });
        };
        if self.group == [1, 1] || self.sites.locate(x) != site {
            for (node, &of) in self.of_site(site).iter().enumerate() {
                step(of, Some(node));
            }
            return;
        }
        let [first_band, first_sector] = self.first_piece(site);
        for band in first_band..first_band + self.group[0] {
            for sector in first_sector..first_sector + self.group[1] {
                for of in self.rule(band, sector) {
                    step(of, None);
                }
            }
        }
    }
}
