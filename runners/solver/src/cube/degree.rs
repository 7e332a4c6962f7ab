//! What takes the number of functions on a cell as a constant.

use fredholm_core::galerkin::{self, AllPointwise, PairTable, Partition, Piecewise, Rounded};
use fredholm_core::{Functional, Real};
use fredholm_cube::{Mean, Weighted};

use super::CubePartition;
use super::functions::{ModelCube, Watched};
use super::system::{Kinds, Solved, Use, WeightedStart};
use super::table::Table;
use crate::Error;

/// Functions on a cell of a cube: makes neighbour equations, whose steps take their number as a constant.
pub(super) trait Degree<const D: usize>: 'static {
    /// Hands out the neighbour equation with these pairs.
    fn with_neighbour<F: Real>(
        cut: &CubePartition<'_>,
        values: &Watched<'_, F>,
        absorption: f64,
        solved: &Solved<D>,
        kinds: &Kinds,
        v: &[F],
        then: &mut Use<'_, F, D>,
    ) -> Result<(), Error>;

    /// The mean of v.
    fn mean<F: Real>(v: &[F]) -> f64;

    /// Numbers near the means over the cells of a weight times the functions there.
    fn weight_means(
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        number: usize,
    ) -> Result<Vec<f64>, Error>;

    /// The weighted means that are asked for, by the number of the weight and its means.
    fn weighted<'a, F: Real>(
        cut: &CubePartition<'_>,
        values: &'a Watched<'a, F>,
        means: &'a [(usize, Vec<F>)],
        v: &[F],
    ) -> Result<Vec<WeightedStart<'a, F, D>>, Error>;

    /// The spectral radius of T_h²p with all pairs in S, estimated.
    fn neighbour_radius(
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        table: &Table<D>,
        absorption: f64,
    ) -> Result<f64, Error>;
}

/// Piecewise constants, with pairs of any kind.
#[derive(Debug)]
pub(super) struct Constants;

/// Polynomials of B functions on a cell, without pointwise pairs.
#[derive(Debug)]
pub(super) struct Smooth<const B: usize>;

impl<const D: usize, const B: usize> Degree<D> for Smooth<B> {
    fn with_neighbour<F: Real>(
        cut: &CubePartition<'_>,
        values: &Watched<'_, F>,
        absorption: f64,
        Solved { table, solution }: &Solved<D>,
        kinds: &Kinds,
        v: &[F],
        then: &mut Use<'_, F, D>,
    ) -> Result<(), Error> {
        let Kinds::Diagonal(pairs) = *kinds else {
            return Err(Error::Internal(
                "pointwise pairs are of piecewise constants",
            ));
        };
        let cube = values
            .cube::<D>(cut.per_axis, absorption)?
            .with_functions::<B>();
        let narrow = Rounded::new(table);
        let g = solution.source(table, &pairs)?;
        then(&Piecewise::new(&cube, &narrow, pairs, v, &g)?)
    }

    fn mean<F: Real>(v: &[F]) -> f64 {
        Mean::of_blocks::<F, B>(v)
    }

    fn weight_means(
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        number: usize,
    ) -> Result<Vec<f64>, Error> {
        let cube = values.cube::<D>(cut.per_axis, ANY)?.with_functions::<B>();
        let mut means = vec![0.0; cube.cells() * B];
        cube.means(&values.weight(number), cut.rule()?, &mut means)?;
        Ok(means)
    }

    fn weighted<'a, F: Real>(
        cut: &CubePartition<'_>,
        values: &'a Watched<'a, F>,
        means: &'a [(usize, Vec<F>)],
        v: &[F],
    ) -> Result<Vec<WeightedStart<'a, F, D>>, Error> {
        let cube = values.cube::<D>(cut.per_axis, ANY)?.with_functions::<B>();
        let mut all = Vec::new();
        for (number, means) in means {
            let weight = values.weight(*number);
            let weighted = Weighted::new(&cube, weight, means, v)?;
            all.push(WeightedStart {
                weight,
                of_means: weighted.of_means(),
                neighbour_value: Box::new(move |x0, phi, v| {
                    Functional::<ModelCube<'_, F, D, B>>::neighbour_value(&weighted, x0, phi, v)
                }),
            });
        }
        Ok(all)
    }

    fn neighbour_radius(
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        table: &Table<D>,
        absorption: f64,
    ) -> Result<f64, Error> {
        let cube = values.cube::<D>(cut.per_axis, absorption)?;
        Ok(cube.with_functions::<B>().neighbour_radius(table)?)
    }
}

/// A q0 for what does not depend on it.
const ANY: f64 = 0.5;

impl<const D: usize> Degree<D> for Constants {
    fn with_neighbour<F: Real>(
        cut: &CubePartition<'_>,
        values: &Watched<'_, F>,
        absorption: f64,
        solved: &Solved<D>,
        kinds: &Kinds,
        v: &[F],
        then: &mut Use<'_, F, D>,
    ) -> Result<(), Error> {
        let cube = values.cube::<D>(cut.per_axis, absorption)?;
        match kinds {
            Kinds::AllPointwise => with_pairs(AllPointwise, &cube, solved, v, then),
            Kinds::Diagonal(pairs) if pairs.diagonal == galerkin::PairKind::Galerkin => {
                Smooth::<1>::with_neighbour(cut, values, absorption, solved, kinds, v, then)
            }
            Kinds::Diagonal(pairs) => with_pairs(*pairs, &cube, solved, v, then),
            Kinds::Table(table) => {
                let pairs = PairTable::new(table, cube.cells())?;
                with_pairs(pairs, &cube, solved, v, then)
            }
        }
    }

    fn mean<F: Real>(v: &[F]) -> f64 {
        <Smooth<1> as Degree<D>>::mean(v)
    }

    fn weight_means(
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        number: usize,
    ) -> Result<Vec<f64>, Error> {
        <Smooth<1> as Degree<D>>::weight_means(cut, values, number)
    }

    fn weighted<'a, F: Real>(
        cut: &CubePartition<'_>,
        values: &'a Watched<'a, F>,
        means: &'a [(usize, Vec<F>)],
        v: &[F],
    ) -> Result<Vec<WeightedStart<'a, F, D>>, Error> {
        Smooth::<1>::weighted(cut, values, means, v)
    }

    fn neighbour_radius(
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        table: &Table<D>,
        absorption: f64,
    ) -> Result<f64, Error> {
        Smooth::<1>::neighbour_radius(cut, values, table, absorption)
    }
}

fn with_pairs<F: Real, const D: usize>(
    pairs: impl galerkin::Pairs + Copy + Sync,
    cube: &ModelCube<'_, F, D>,
    Solved { table, solution }: &Solved<D>,
    v: &[F],
    then: &mut Use<'_, F, D>,
) -> Result<(), Error> {
    let narrow = Rounded::new(table);
    let g = solution.source(table, &pairs)?;
    then(&Piecewise::with_pointwise(cube, &narrow, pairs, v, &g)?)
}
