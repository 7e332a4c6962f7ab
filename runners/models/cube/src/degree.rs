//! What takes the number of functions on a cell as a constant.

use std::borrow::Cow;

use fredholm_core::galerkin::{
    self, AllPointwise, Basis as _, DiagonalRule, PairTable, Partition, Piecewise, Rounded,
    Solution,
};
use fredholm_core::{Functional, Located, Real};
use fredholm_cube::{Cube, ExactSource, Mean, Product, ProductTables, Weighted, empty_table};

use super::exact::Moments;

use super::functions::{ModelCube, Watched, WeightOf, Which};
use super::system::{Boxed, Kinds, Solved, Use, WeightedStart};
use super::table::{Table, fill};
use super::{CubePartition, SWEEPS, TOLERANCE};
use fredholm_model::{Error, WalkOptions};

/// Functions on a cell of a cube, whose number the steps of walks take as a constant. It is object safe, so that all
/// else is compiled once for all degrees.
pub(super) trait Degree<F, const D: usize>: Sync {
    /// Hands out the neighbour equation with these pairs.
    fn with_neighbour(
        &self,
        of: &Of<'_, F, D>,
        kinds: &Kinds,
        then: &mut Use<'_, F, D>,
    ) -> Result<(), Error>;

    /// The mean of v.
    fn mean(&self, v: &[F]) -> f64;

    /// A weighted mean, by the weight and its means over the cells.
    fn weighted<'a>(
        &self,
        cut: &CubePartition<'_>,
        values: &'a Watched<'a, F>,
        weight: WeightOf<'a>,
        means: &'a [F],
        v: &[F],
    ) -> Result<WeightedStart<'a, F, D>, Error>;
}

/// What a neighbour equation is made of, besides its pairs.
pub(super) struct Of<'a, F, const D: usize> {
    pub(super) cut: &'a CubePartition<'a>,
    pub(super) values: &'a Watched<'a, F>,
    pub(super) absorption: f64,
    pub(super) table: &'a Table<'a, D>,
    pub(super) solution: &'a Solution,
    /// The moments of F, if the source is F itself.
    pub(super) moments: Option<&'a Moments>,
    pub(super) v: &'a [F],
}

/// Functions on a cell for walks in both scalars, and for what is computed in f64 alone.
pub(super) trait AnyDegree<const D: usize>: Degree<f32, D> + Degree<f64, D> {
    /// The coefficients and the Galerkin solution, on all threads.
    fn solve(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        absorption: f64,
    ) -> Result<Solved<'static, D>, Error>;

    /// The table of coefficients that were computed before.
    fn table<'a>(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        entries: Cow<'a, [f64]>,
    ) -> Result<Table<'a, D>, Error>;

    /// The moments of F for these walks, and the Galerkin solution of them.
    fn moments(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        table: &Table<'_, D>,
        walk: &WalkOptions,
    ) -> Result<(Moments, Solution), Error>;

    /// The value at a point of [0, 1]^D of a function on cells.
    fn value(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        v: &[f64],
        x: &[f64; D],
    ) -> Result<f64, Error>;

    /// Numbers near the means over the cells of a weight times the functions there.
    fn weight_means(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        weight: WeightOf<'_>,
    ) -> Result<Vec<f64>, Error>;

    /// The spectral radius of T_h²p with all pairs in S, estimated.
    fn neighbour_second_moment_radius(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        table: &Table<'_, D>,
        absorption: f64,
    ) -> Result<f64, Error>;
}

/// Piecewise constants, with pairs of any kind.
#[derive(Debug)]
pub(super) struct Constants;

/// Polynomials of B functions on a cell, without pointwise pairs.
#[derive(Debug)]
pub(super) struct Smooth<const B: usize>;

impl<F: Real, const D: usize, const B: usize> Degree<F, D> for Smooth<B> {
    fn with_neighbour(
        &self,
        of: &Of<'_, F, D>,
        kinds: &Kinds,
        then: &mut Use<'_, F, D>,
    ) -> Result<(), Error> {
        let Kinds::Diagonal(pairs) = *kinds else {
            return Err(Error::Internal(
                "pointwise pairs are of piecewise constants",
            ));
        };
        let (table, solution) = (of.table, of.solution);
        let cube = of.values.cube::<D>(of.cut.per_axis, of.absorption)?;
        let cube = cube.with_functions::<B>();
        let narrow = Rounded::new(table);
        let Some(moments) = of.moments else {
            let g = solution.source(table, &pairs)?;
            return then(&Piecewise::new(&cube, &narrow, pairs, of.v, &g)?);
        };
        let [w, r] = exact::<F, D>(table, solution, moments, &pairs)?;
        let rest: &Boxed<'_, F, D> = &Piecewise::new(&cube, &narrow, pairs, &w, &r)?;
        then(&ExactSource {
            rest,
            source: cube.right_hand_side(),
        })
    }

    fn mean(&self, v: &[F]) -> f64 {
        Mean::of_blocks::<F, B>(v)
    }

    fn weighted<'a>(
        &self,
        cut: &CubePartition<'_>,
        values: &'a Watched<'a, F>,
        weight: WeightOf<'a>,
        means: &'a [F],
        v: &[F],
    ) -> Result<WeightedStart<'a, F, D>, Error> {
        let cube = values.cube::<D>(cut.per_axis, ANY)?.with_functions::<B>();
        let weight = values.function(Which::Weight(weight));
        let weighted = Weighted::new(&cube, weight, means, v)?;
        Ok(WeightedStart {
            weight,
            of_means: weighted.of_means(),
            control_estimate: Box::new(move |x0, phi, v| {
                Functional::<ModelCube<'_, F, D, B>>::control_estimate(&weighted, x0, phi, v)
            }),
        })
    }
}

impl<const D: usize, const B: usize> AnyDegree<D> for Smooth<B> {
    fn solve(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        absorption: f64,
    ) -> Result<Solved<'static, D>, Error> {
        let rule = cut.rule()?;
        let cube = values.cube::<D>(cut.per_axis, absorption)?;
        let cube = cube.with_functions::<B>();
        let table = if cut.functions().is_product() {
            let source = *cube.right_hand_side();
            let kernel = Product(values.kernel());
            let product = Cube::<f64, D, _, _>::new(kernel, source, cut.per_axis, absorption)?;
            Table::Product(ProductTables::new(&product.with_functions::<B>(), rule)?)
        } else {
            let unknowns = cube.cells() * B;
            let mut entries = empty_table(unknowns)?;
            let kernel = values.kernel();
            let rows = |i, rows: &mut [f64]| {
                if cut.has_integrals() {
                    cut.fill_by_integral(&kernel, i, rows);
                    return Ok(());
                }
                cube.fill_row(rule, i, rows)
            };
            fill(&mut entries, unknowns * B, &rows)?;
            Table::Dense {
                entries: entries.into(),
                cells: cube.cells(),
                functions: B,
            }
        };
        let solution = cube.solve(&table, rule, TOLERANCE, SWEEPS)?;
        Ok(Solved { table, solution })
    }

    fn table<'a>(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        entries: Cow<'a, [f64]>,
    ) -> Result<Table<'a, D>, Error> {
        let cube = values.cube::<D>(cut.per_axis, ANY)?.with_functions::<B>();
        if cut.functions().is_product() {
            let entries = entries.into_owned();
            return Ok(Table::Product(ProductTables::from_entries(&cube, entries)?));
        }
        Ok(Table::Dense {
            entries,
            cells: cube.cells(),
            functions: B,
        })
    }

    fn moments(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        table: &Table<'_, D>,
        walk: &WalkOptions,
    ) -> Result<(Moments, Solution), Error> {
        let cube = values.cube::<D>(cut.per_axis, ANY)?.with_functions::<B>();
        let mut near = vec![0.0; cube.cells() * B];
        cube.source_means(cut.rule()?, &mut near)?;
        let sample = |i: usize, threshold, out: &mut [f64]| {
            let near = &near[i * B..(i + 1) * B];
            cube.sample_source(i, near, threshold, walk.seed, out)
        };
        Moments::new(table, &near, cut.enough(walk.moments_tolerance()), &sample)
    }

    fn value(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        v: &[f64],
        x: &[f64; D],
    ) -> Result<f64, Error> {
        let cube = values.cube::<D>(cut.per_axis, ANY)?.with_functions::<B>();
        let at = Located {
            point: *x,
            cell: cube.locate(x),
        };
        let block = v.iter().skip(at.cell * B);
        let products = block.zip(cube.basis(&at)).map(|(v, psi)| v * psi);
        Ok(products.sum())
    }

    fn weight_means(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        weight: WeightOf<'_>,
    ) -> Result<Vec<f64>, Error> {
        let cube = values.cube::<D>(cut.per_axis, ANY)?.with_functions::<B>();
        let mut means = vec![0.0; cube.cells() * B];
        cube.means(
            &values.function(Which::Weight(weight)),
            cut.rule()?,
            &mut means,
        )?;
        Ok(means)
    }

    fn neighbour_second_moment_radius(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        table: &Table<'_, D>,
        absorption: f64,
    ) -> Result<f64, Error> {
        let cube = values.cube::<D>(cut.per_axis, absorption)?;
        Ok(cube
            .with_functions::<B>()
            .neighbour_second_moment_radius(table)?)
    }
}

/// A q0 for what does not depend on it.
const ANY: f64 = 0.5;

impl<F: Real, const D: usize> Degree<F, D> for Constants {
    fn with_neighbour(
        &self,
        of: &Of<'_, F, D>,
        kinds: &Kinds,
        then: &mut Use<'_, F, D>,
    ) -> Result<(), Error> {
        match kinds {
            Kinds::AllPointwise => with_pairs(AllPointwise, of, then),
            Kinds::Diagonal(pairs) if pairs.diagonal == galerkin::PairKind::Galerkin => {
                Smooth::<1>.with_neighbour(of, kinds, then)
            }
            Kinds::Diagonal(pairs) => with_pairs(*pairs, of, then),
            Kinds::Band(band) => with_pairs(*band, of, then),
            Kinds::Table(table) => with_pairs(PairTable::new(table, of.cut.all_cells())?, of, then),
        }
    }

    fn mean(&self, v: &[F]) -> f64 {
        Degree::<F, D>::mean(&Smooth::<1>, v)
    }

    fn weighted<'a>(
        &self,
        cut: &CubePartition<'_>,
        values: &'a Watched<'a, F>,
        weight: WeightOf<'a>,
        means: &'a [F],
        v: &[F],
    ) -> Result<WeightedStart<'a, F, D>, Error> {
        Smooth::<1>.weighted(cut, values, weight, means, v)
    }
}

impl<const D: usize> AnyDegree<D> for Constants {
    fn solve(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        absorption: f64,
    ) -> Result<Solved<'static, D>, Error> {
        AnyDegree::<D>::solve(&Smooth::<1>, cut, values, absorption)
    }

    fn table<'a>(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        entries: Cow<'a, [f64]>,
    ) -> Result<Table<'a, D>, Error> {
        Smooth::<1>.table(cut, values, entries)
    }

    fn moments(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        table: &Table<'_, D>,
        walk: &WalkOptions,
    ) -> Result<(Moments, Solution), Error> {
        Smooth::<1>.moments(cut, values, table, walk)
    }

    fn value(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        v: &[f64],
        x: &[f64; D],
    ) -> Result<f64, Error> {
        Smooth::<1>.value(cut, values, v, x)
    }

    fn weight_means(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        weight: WeightOf<'_>,
    ) -> Result<Vec<f64>, Error> {
        AnyDegree::<D>::weight_means(&Smooth::<1>, cut, values, weight)
    }

    fn neighbour_second_moment_radius(
        &self,
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        table: &Table<'_, D>,
        absorption: f64,
    ) -> Result<f64, Error> {
        Smooth::<1>.neighbour_second_moment_radius(cut, values, table, absorption)
    }
}

/// w = V − F″ in the scalar of walks, and R = G_V − F″ for the V that is F″ + w then.
fn exact<F: Real, const D: usize>(
    table: &Table<'_, D>,
    solution: &Solution,
    moments: &Moments,
    pairs: &DiagonalRule,
) -> Result<[Vec<F>; 2], Error> {
    let rest = |of: &[f64]| -> Vec<F> { moments.rest(of).map(F::from_f64).collect() };
    let w = rest(&solution.v);
    let through = w.iter().zip(&moments.means);
    let through = Solution {
        v: through.map(|(w, mean)| w.to_f64() + mean).collect(),
        ..solution.clone()
    };
    let r = rest(&through.source::<f64>(table, pairs)?);
    Ok([w, r])
}

fn with_pairs<F: Real, const D: usize>(
    pairs: impl galerkin::Pairs + Copy + Sync,
    of: &Of<'_, F, D>,
    then: &mut Use<'_, F, D>,
) -> Result<(), Error> {
    let (table, solution) = (of.table, of.solution);
    let cube = of.values.cube::<D>(of.cut.per_axis, of.absorption)?;
    let narrow = Rounded::new(table);
    let g = solution.source(table, &pairs)?;
    then(&Piecewise::with_pointwise(&cube, &narrow, pairs, of.v, &g)?)
}
