//! Neighbour equations whose source is F itself: their moments, and the errors of these.

use fredholm_core::galerkin::{GalerkinMatrix, Solution, StoppingRule, gauss_seidel};
use fredholm_cube::{CubeError, CubeSetup, Mean, REPLICATES};

use super::functions::{Watched, WeightOf, with_values};
use super::setup::ANY;
use super::system::CubeSystem;
use super::table::{Table, fill};
use super::{SWEEPS, TOLERANCE};
use fredholm_core::Tolerance;
use fredholm_model::{Error, Goal, Region, Request};

/// The factor by which the threshold of boxes falls until there are enough.
const FALLS: f64 = 4.0;
/// How many times as many boxes as at a jump along a plane there may be, until the error is small enough.
const MORE: f64 = 8.0;
/// The relative residual of the errors' solutions: their size alone matters.
const ROUGHLY: f64 = 1e-3;

/// The moments of F that a neighbour equation with the source F has, and errors like theirs.
#[derive(Debug)]
pub(super) struct Moments {
    /// F″_ia.
    pub(super) means: Vec<f64>,
    errors: Vec<Replicate>,
}

/// When moments are fine enough.
#[derive(Clone, Copy, Debug)]
pub(super) struct Enough {
    /// The error of the mean over the space.
    pub(super) error: f64,
    /// The fewest boxes.
    pub(super) boxes: f64,
    /// The size of F.
    pub(super) size: f64,
}

/// What an error Δ of the moments does to the solution.
#[derive(Debug)]
struct Replicate {
    /// Z = (I − K')⁻¹ Δ.
    solution: Vec<f64>,
    /// Z − Δ.
    rest: Vec<f64>,
}

/// What fills the sample of a cell, by its number and a threshold.
pub(super) type SampleCell<'a> =
    dyn Fn(usize, f64, &mut [f64]) -> Result<(), CubeError> + Sync + 'a;

impl Moments {
    /// The moments of a source, from samples of the numbers [`Cube::SAMPLE`](fredholm_cube::Cube::SAMPLE) in every cell, and
    /// the Galerkin solution of them. `near` are the moments by quadrature.
    pub(super) fn new(
        matrix: &dyn GalerkinMatrix<Scalar = f64>,
        near: &[f64],
        enough: Enough,
        sample: &SampleCell<'_>,
    ) -> Result<(Self, Solution), Error> {
        let (functions, cells) = (matrix.functions(), matrix.cells());
        let width = (1 + REPLICATES) * functions + 1;
        let largest = near.iter().fold(enough.size, |most, f| most.max(f.abs()));
        // A threshold of 0 would halve boxes without an end.
        let scale = if largest > 0.0 { largest } else { 1.0 };
        let mut all = vec![0.0; width * cells];
        let mut threshold = scale;
        loop {
            fill(&mut all, width, &|i, out| sample(i, threshold, out))?;
            let sum = |number: usize| {
                let numbers = all.chunks_exact(width).filter_map(|of| of.get(number));
                numbers.sum::<f64>()
            };
            let squares = (1..=REPLICATES).map(|error| sum(error * functions).powi(2));
            let error = (squares.sum::<f64>() / REPLICATES as f64).sqrt() / cells as f64;
            // A jump that no box has met yet has no error.
            let is_fine = sum(width - 1) > enough.boxes && error <= enough.error;
            threshold /= FALLS;
            if is_fine || sum(width - 1) > MORE * enough.boxes || threshold <= f64::EPSILON * scale
            {
                break;
            }
        }
        let vector = |number: usize| -> Vec<f64> {
            let samples = all.chunks_exact(width);
            let of = samples.flat_map(|sample| &sample[number * functions..][..functions]);
            of.copied().collect()
        };
        let means = vector(0);
        let solution = Solution::new(matrix, means.clone(), TOLERANCE, SWEEPS)?;
        let mut scratch = vec![0.0; matrix.scratch()];
        let mut errors = Vec::new();
        for number in 1..=REPLICATES {
            let error = vector(number);
            let largest = error.iter().fold(0.0, |most: f64, e| most.max(e.abs()));
            let stop = StoppingRule::UntilResidual {
                residual: ROUGHLY * largest,
                at_most: SWEEPS,
            };
            let mut z = error.clone();
            gauss_seidel(matrix, &error, &mut z, &mut scratch, stop)?;
            let rest = z.iter().zip(&error).map(|(z, error)| z - error).collect();
            errors.push(Replicate { solution: z, rest });
        }
        Ok((Self { means, errors }, solution))
    }
}

impl Moments {
    /// The numbers less the moments.
    pub(super) fn rest<'a>(&'a self, of: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        of.iter().zip(&self.means).map(|(of, mean)| of - mean)
    }
}

impl<const D: usize> CubeSystem<'_, D> {
    /// The moments of F and their solution, if walks follow a neighbour equation with the source F itself. They are refined until the error of
    /// (v, Φ) takes no more than half of the tolerance of any goal: a part of u may be much less than the same part of F.
    pub(super) fn moments(
        &self,
        request: &Request<'_>,
    ) -> Result<Option<(Moments, Solution)>, Error> {
        let walk = request.walk;
        if !walk.exact_source {
            return Ok(None);
        }
        let weights = self.weight_means::<f64>(request)?;
        let moments = with_values::<f64, _>(self.cut.functions(), |values| {
            let mut enough = self.cut.enough(walk.moments_tolerance());
            loop {
                let found = self.sample_moments(values, &self.solved.table, (enough, walk.seed))?;
                let Some(tolerance) = walk.tolerance else {
                    return Ok(found);
                };
                let (moments, solution) = &found;
                let errors = self.errors_of(moments, request, values, &weights)?;
                let of = self.functionals((&solution.v, &solution.v), request, values, &weights)?;
                let bounds = of.into_iter().map(|of| match tolerance {
                    Tolerance::Absolute(bound) => bound,
                    Tolerance::Relative(part) => part * of.abs(),
                });
                let times = errors
                    .iter()
                    .zip(bounds)
                    .map(|(error, bound)| 2.0 * error / bound);
                let worst = times.fold(0.0, f64::max);
                if worst <= 1.0 {
                    return Ok(found);
                }
                let Some(finer) = self.cut.finer(&enough, worst) else {
                    return Ok(found);
                };
                enough = finer;
            }
        });
        moments.map(Some)
    }

    fn sample_moments(
        &self,
        values: &Watched<'_, f64>,
        table: &Table<'_, D>,
        (enough, seed): (Enough, u64),
    ) -> Result<(Moments, Solution), Error> {
        let cube = values.cube::<D>(self.cut.per_axis, ANY)?;
        let functions = self.degree.functions();
        let near = CubeSetup::new(&cube, functions).source_means(self.cut.rule()?)?;
        let sample = |i: usize, threshold, out: &mut [f64]| {
            let count = functions.count();
            let near = &near[i * count..(i + 1) * count];
            let setup = CubeSetup::new(&cube, functions);
            setup.sample_source(i, near, threshold, seed, out)
        };
        Moments::new(table, &near, enough, &sample)
    }

    /// The moments and their solution, or the system's own solution.
    pub(super) fn own<'a>(
        &'a self,
        moments: Option<&'a (Moments, Solution)>,
    ) -> (Option<&'a Moments>, &'a Solution) {
        match moments {
            Some((moments, solution)) => (Some(moments), solution),
            None => (None, &self.solved.solution),
        }
    }

    /// The standard error of (v, Φ) of every goal; none if they are known.
    pub(super) fn control_errors(
        &self,
        moments: Option<&(Moments, Solution)>,
        request: &Request<'_>,
    ) -> Result<Vec<f64>, Error> {
        match moments {
            None => Ok(Vec::new()),
            Some((moments, _)) => {
                let weights = self.weight_means::<f64>(request)?;
                with_values::<f64, _>(self.cut.functions(), |values| {
                    self.errors_of(moments, request, values, &weights)
                })
            }
        }
    }

    fn errors_of(
        &self,
        moments: &Moments,
        request: &Request<'_>,
        values: &Watched<'_, f64>,
        weights: &[(WeightOf<'_>, Vec<f64>)],
    ) -> Result<Vec<f64>, Error> {
        let mut squares = vec![0.0; request.goals.len()];
        for Replicate { solution, rest } in &moments.errors {
            let of = self.functionals((solution, rest), request, values, weights)?;
            for (square, error) in squares.iter_mut().zip(of) {
                *square += error * error;
            }
        }
        let error = |square: f64| (square / REPLICATES as f64).sqrt();
        Ok(squares.into_iter().map(error).collect())
    }

    /// What every goal is of a piecewise polynomial: in a point that of the second one.
    fn functionals(
        &self,
        (polynomial, in_points): (&[f64], &[f64]),
        request: &Request<'_>,
        values: &Watched<'_, f64>,
        weights: &[(WeightOf<'_>, Vec<f64>)],
    ) -> Result<Vec<f64>, Error> {
        let mut weights = weights.iter();
        let cube = values.cube::<D>(self.cut.per_axis, ANY)?;
        let functions = self.degree.functions();
        let setup = CubeSetup::new(&cube, functions);
        let of = |goal: &Goal| {
            let weight = match &goal.region {
                Region::Weight(_) | Region::Function(_) => weights.next(),
                _ => None,
            };
            match (&goal.region, weight) {
                (Region::Point(x), _) => setup.value(in_points, &values.domain().unit::<D>(x)),
                (_, Some((_, means))) => {
                    let products = means.iter().zip(polynomial).map(|(w, z)| w * z);
                    products.sum::<f64>() / self.cut.all_cells() as f64
                }
                _ => Mean::of_functions(polynomial, functions.count()),
            }
        };
        Ok(request.goals.iter().map(of).collect())
    }
}
