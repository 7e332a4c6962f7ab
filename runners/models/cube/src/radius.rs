//! Spectral radii, on which it depends whether variances are finite.

use fredholm_core::galerkin::buffer;
use fredholm_cube::{Cube, CubeRule, KernelFactors as _, KernelFn as _};
use fredholm_model::finite::radius_above;
use fredholm_model::numbers::dot;
use fredholm_model::{Error, Partitioned as _, singular, spikes};

use super::CubePartition;
use super::functions::with_values;
use super::table::{Table, fill};

/// Seconds that are spent in looking at K², about.
const LOOK_SECONDS: f64 = 1.0;
/// Cells of a factor's K².
const FACTOR_CELLS: usize = 200;

/// The spectral radius of n Σ_ab K'_(ia)(jb)², the means over X_i of ∫_Xj h² p dy, of a table with n cells of so many functions.
fn of_squares(entries: &[f64], cells: usize, functions: usize) -> f64 {
    let mut squares = vec![0.0; cells * cells];
    let width = cells * functions;
    for (row, entries) in entries.chunks_exact(width).enumerate() {
        let i = row / functions;
        let sums = squares.iter_mut().skip(i * cells);
        for (sum, block) in sums.zip(entries.chunks_exact(functions)) {
            *sum += cells as f64 * dot(block, block);
        }
    }
    radius_above(cells, &squares)
}

impl<const D: usize> Table<'_, D> {
    /// An estimate from above of the spectral radius of T_h²p with all pairs in S (Heinrich 1995, Proposition 2). It depends
    /// on K' and not on K: a rule of few points in large cells may make K' larger than K is. That of a product is the product of those of
    /// the factors, and a little more with functions of degree p > 0, which leave out products of more than the degree p in all.
    pub(super) fn second_moment_radius(&self, per_axis: usize) -> f64 {
        match self {
            Self::Dense {
                entries,
                cells,
                functions,
            } => of_squares(entries, *cells, *functions),
            Self::Product(tables) => {
                let entries = tables.entries();
                let of_axis = entries.len() / D;
                let width = of_axis.isqrt();
                let axes = entries.chunks_exact(of_axis);
                axes.map(|axis| of_squares(axis, per_axis, width / per_axis))
                    .product()
            }
        }
    }
}

impl CubePartition<'_> {
    /// The spectral radius of T_k²p, estimated on a coarse partition. That of T_h²p is
    /// looked at when K' is known: it is smaller if K' is exact.
    pub(super) fn squared_radius_in<const D: usize>(&self) -> Result<f64, Error> {
        with_values::<f64, _>(self.functions(), |values| {
            let kernel = values.kernel();
            let exponent = self.model.exponent();
            if self.functions().is_product() {
                let of_axis = |axis: usize| -> Result<f64, Error> {
                    let square = |x: &[f64; 1], y: &[f64; 1]| {
                        let factor = kernel.factor(axis, x[0], y[0]);
                        factor * factor
                    };
                    let cube = Cube::new(square, |_: &[f64; 1]| 0.0, FACTOR_CELLS)?;
                    let table = CubeRule::new(&cube, 0, 2)?.table(&square)?;
                    Ok(radius_above(FACTOR_CELLS, &table))
                };
                return (0..D).map(of_axis).product();
            }
            if exponent > 0.0 {
                let at = |x: f64, y: f64| kernel.kernel(&[x; D], &[y; D]);
                return singular::squared_radius(&at, exponent);
            }
            // Cells of an axis, points in them, and the fewest cells, which tell the radius of smooth kernels to some digits.
            let (per_axis, points, fewest): (usize, usize, usize) = [
                (200, 2, 20),
                (14, 2, 6),
                (6, 2, 3),
                (4, 1, 3),
                (3, 1, 2),
                (2, 1, 2),
            ][D - 1];
            let [seconds, ..] = self.functions().seconds();
            let all = (per_axis * points).pow(2 * D as u32) as f64;
            // Where a value takes so long that looking would take seconds, fewer are looked at.
            let part = (LOOK_SECONDS / (all * seconds)).min(1.0);
            let fewer = (per_axis as f64 * part.powf(0.5 / D as f64)) as usize;
            let square = |x: &[f64; D], y: &[f64; D]| {
                let k = kernel.kernel(x, y);
                k * k
            };
            let cube = Cube::new(square, |_: &[f64; D]| 0.0, fewer.max(fewest))?;
            let rule = CubeRule::new(&cube, 0, points)?;
            let n = rule.cells();
            let mut entries = buffer(n * n)?;
            fill(&mut entries, n, &|i, row| rule.fill_row(&square, i, row))?;
            Ok(radius_above(n, &entries).max(spikes::squared_radius(square, part)))
        })
    }

    /// Refuses a neighbour equation unless the spectral radius of T_h²p, over 1 − q0, is below 1.
    pub(super) fn check_second_moment<const D: usize>(
        &self,
        table: &Table<'_, D>,
        absorption: fredholm_core::Absorption,
    ) -> Result<f64, Error> {
        let radius = table.second_moment_radius(self.per_axis);
        let radius = radius / (1.0 - absorption.probability().unwrap_or(0.0));
        if radius < 1.0 {
            return Ok(radius);
        }
        Err(Error::InfiniteNeighbour {
            cells: self.cells(),
            points: self.points(),
            radius,
        })
    }
}
