//! A neighbour equation of many cells without a matrix, whose v comes from stages of walks.
//!
//! K'_ij is K at the middles of both cells over n, computed where a walk or a product asks for it. In a stage walks estimate
//! the means ê of e = u − v over cells, from uniform starts and in every state, with the v so far as their control. Then
//!
//! ```text
//! v ← P(F + T_K(v + ê)),
//! ```
//!
//! which takes a product with K', as does the G of the next walks: memory is that of a few vectors. T_K smooths the noise of
//! ê, so that an error that v does not share with all functions on these cells falls by a large factor in a stage. G is made of v
//! whatever that is: walks that follow are unbiased given the stages, as their numbers are not those of any stage.

use std::fmt;
use std::sync::Mutex;

use fredholm_core::galerkin::{
    Coefficients, DiagonalRule, GalerkinMatrix, PairKind, Piecewise, Rounded, Solution,
};
use fredholm_core::whole::{WHOLE, WholeTask};
use fredholm_core::{Estimator, WalkOptions, WalkSeeds};
use fredholm_cube::CubeScores;
use fredholm_model::{Error, NO_ITERATION, Subject};
use fredholm_rayon::{Replicates, fill_rows};

use super::domain::Domain;
use super::functions::{CubeFunctions, Watched};
use super::system::{Boxed, Solved};
use super::table::Table;
use super::{CubeModel, CubePartition};

/// Walks of a stage for every cell: enough that ê of most cells is more than noise.
const WALKS_PER_CELL: u64 = 10;
/// Sums of a stage that are kept apart, by as many threads at most.
const REPLICATES: usize = 8;
/// Rows of K' that tell the size of all.
const ROWS: usize = 64;

/// K' of piecewise constants, computed where it is asked for.
pub(super) struct Middles<'a, const D: usize> {
    functions: &'a dyn CubeFunctions,
    domain: Domain<f64>,
    per_axis: usize,
    /// The last v, and K'v.
    product: Mutex<[Vec<f64>; 2]>,
}

impl<const D: usize> fmt::Debug for Middles<'_, D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Middles")
            .field("per_axis", &self.per_axis)
            .finish_non_exhaustive()
    }
}

impl<'a, const D: usize> Middles<'a, D> {
    fn new(functions: &'a dyn CubeFunctions, per_axis: usize) -> Self {
        Self {
            functions,
            domain: Domain::new(functions.domain()),
            per_axis,
            product: Mutex::default(),
        }
    }

    /// The middle of a cell. The last axis runs fastest.
    fn middle(&self, cell: usize) -> [f64; D] {
        let (mut rest, mut x) = (cell, [0.0; D]);
        for x in x.iter_mut().rev() {
            *x = ((rest % self.per_axis) as f64 + 0.5) / self.per_axis as f64;
            rest /= self.per_axis;
        }
        self.domain.point(&x)
    }

    /// Σ_j of what is made of K'_ij and j, over some cells j.
    fn sum(
        &self,
        i: usize,
        cells: impl Iterator<Item = usize>,
        of: impl Fn(f64, usize) -> f64,
    ) -> f64 {
        let (x, mut sum) = (self.middle(i), 0.0);
        let share = self
            .domain
            .times_volume(1.0 / GalerkinMatrix::cells(self) as f64);
        let mut cells = Some(cells);
        self.functions.with_f64(&mut |values| {
            for j in cells.take().into_iter().flatten() {
                sum += of(share * values.kernel(&x, &self.middle(j)), j);
            }
        });
        sum
    }

    /// The sums over all cells of every row, on all threads.
    fn all_sums(&self, out: &mut [f64], of: impl Fn(f64, usize) -> f64 + Sync) {
        let cells = GalerkinMatrix::cells(self);
        let rows = fill_rows(out, 1, |i, out| {
            out[0] = self.sum(i, 0..cells, &of);
            Ok::<(), Error>(())
        });
        if rows.is_err() {
            out.fill(f64::NAN);
        }
    }

    /// The largest of some rows' sums of absolute values, at most just below 1: for what rounding leaves.
    fn size(&self) -> f64 {
        let cells = GalerkinMatrix::cells(self);
        let some = (0..cells).step_by(cells.div_ceil(ROWS));
        let sums = some.map(|i| self.row_sum(i));
        sums.fold(0.0, f64::max).min(0.999)
    }
}

impl<const D: usize> GalerkinMatrix for Middles<'_, D> {
    type Scalar = f64;

    fn cells(&self) -> usize {
        self.per_axis.pow(D as u32)
    }

    fn functions(&self) -> usize {
        1
    }

    fn entry(&self, [i, _]: [usize; 2], [j, _]: [usize; 2]) -> f64 {
        self.sum(i, core::iter::once(j), |k, _| k)
    }

    fn row_sum(&self, i: usize) -> f64 {
        self.sum(i, 0..GalerkinMatrix::cells(self), |k, _| k.abs())
    }

    fn apply(&self, v: &[f64], out: &mut [f64]) {
        // Whoever prepares walks asks for the product that the last stage ended with.
        let Ok(mut last) = self.product.lock() else {
            out.fill(f64::NAN);
            return;
        };
        let [of, product] = &mut *last;
        if of != v {
            *of = v.to_vec();
            product.resize(v.len(), 0.0);
            self.all_sums(product, |k, j| k * v.get(j).copied().unwrap_or(f64::NAN));
        }
        out.copy_from_slice(product);
    }

    fn apply_absolute(&self, w: &[f64], out: &mut [f64]) {
        self.all_sums(out, |k, j| k.abs() * w.get(j).copied().unwrap_or(f64::NAN));
    }
}

impl<const D: usize, const B: usize> Coefficients<B> for Middles<'_, D> {
    fn left_times_block(&self, i: usize, j: usize, left: &[f64; B]) -> [f64; B] {
        // Piecewise constants alone: of more functions nothing is known.
        core::array::from_fn(|b| match b {
            0 if B == 1 => left[0] * self.mean(i, j),
            _ => f64::NAN,
        })
    }
}

/// All pairs in S.
const IN_S: DiagonalRule = DiagonalRule {
    diagonal: PairKind::Galerkin,
};

impl CubeModel {
    /// Solves systems by so many stages of walks in place of a matrix: of 10⁵ cells and more a matrix fits into no memory, and
    /// stages take that of a few vectors. Piecewise constants, all pairs in S. Every stage takes two times n² values of the
    /// kernel, and ten walks a cell.
    ///
    /// ```
    /// use fredholm::{CubeModel, Solver};
    ///
    /// // u = 6x/5.
    /// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]).with_stages(2);
    /// let report = Solver::new(&u).at(0.505).cells(100).walks(1000).solve()?;
    /// assert!((report.goals[0].galerkin - 0.606).abs() < 1e-4);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    #[must_use]
    pub fn with_stages(mut self, stages: u32) -> Self {
        self.stages = Some(stages);
        self
    }

    /// Refuses stages where there is a better way, or none.
    pub(super) fn check_stages(&self, degree: usize) -> Result<(), Error> {
        let refuse = |message: &str| {
            Err(Error::Option {
                subject: Subject::Problem,
                message: message.to_owned(),
            })
        };
        if self.stages.is_none() {
            return Ok(());
        }
        if self.functions.is_product() {
            return refuse(
                "the tables of a product kernel fit for any number of cells: leave `stages` out",
            );
        }
        if self.is_singular() {
            return refuse(
                "`stages` take the kernel at x = y, where it is singular: leave them out",
            );
        }
        if degree > 0 {
            return refuse("`stages` are of piecewise constants, `degree = 0`");
        }
        Ok(())
    }
}

impl<'m> CubePartition<'m> {
    /// v of some stages, without a matrix.
    pub(super) fn staged<const D: usize>(
        &self,
        values: &Watched<'_, f64>,
        (source, stages): (&[f64], u32),
        absorption: f64,
    ) -> Result<Solved<'m, D>, Error> {
        let table = Table::Middles(Middles::<'m, D>::new(self.functions(), self.per_axis));
        let cells = self.all_cells();
        let [mut v, mut product, mut more] = [(); 3].map(|()| vec![0.0; cells]);
        for stage in 0..stages {
            let e = self.errors(values, &table, [&v, &product], (stage, absorption))?;
            table.apply(&e, &mut more);
            let terms = source.iter().zip(&product).zip(&more);
            for (v, ((source, product), more)) in v.iter_mut().zip(terms) {
                *v = source + product + more;
            }
            table.apply(&v, &mut product);
        }
        let Table::Middles(middles) = &table else {
            return Err(Error::Internal("stages without their coefficients"));
        };
        if v.iter().chain(&product).any(|value| !value.is_finite()) {
            return Err(Error::NotFinite {
                what: "the kernel or the source is not finite in the middle of a cell".to_owned(),
            });
        }
        let radius_bound = middles.size();
        Ok(Solved {
            solution: Solution {
                v,
                convergence: NO_ITERATION,
                radius_bound,
            },
            table,
        })
    }

    /// The means of u − v over cells, estimated by the walks of a stage, with K'v at hand.
    fn errors<const D: usize>(
        &self,
        values: &Watched<'_, f64>,
        table: &Table<'_, D>,
        [v, product]: [&[f64]; 2],
        (stage, absorption): (u32, f64),
    ) -> Result<Vec<f64>, Error> {
        let cube = values.cube::<D>(self.per_axis, absorption)?;
        let g: Vec<f64> = v
            .iter()
            .zip(product)
            .map(|(v, product)| v - product)
            .collect();
        let narrow = Rounded::new(table);
        let neighbour: &Boxed<'_, f64, D> = &Piecewise::new(&cube, &narrow, IN_S, v, &g)?;
        let scores = CubeScores::new(&cube, 0);
        let scores = scores.ok_or(Error::Internal("constants have no scores"))?;
        let options = WalkOptions {
            estimator: Estimator::Collision,
            ..WalkOptions::default()
        };
        let mut task = WholeTask::new(&cube, &cube, neighbour, &scores, options);
        // No other walks draw the numbers of these.
        task.seeds = WalkSeeds::new(u64::from(stage), WHOLE - 1);
        let mut replicates = Replicates::new(&task, REPLICATES);
        let cells = self.all_cells();
        let walks = (WALKS_PER_CELL * cells as u64).div_ceil(REPLICATES as u64);
        replicates.run(&task, walks, &())?;
        let all = replicates.coefficients(&task, &|_| 1.0 / cells as f64);
        let mut mean = vec![0.0; cells];
        for one in all.chunks_exact(cells) {
            mean.iter_mut()
                .zip(one)
                .for_each(|(mean, e)| *mean += e / REPLICATES as f64);
        }
        Ok(mean)
    }
}
