//! v and c of several channels of a scene.

use core::num::NonZeroU32;

use fredholm_core::channels::{ChannelNeighbours, Channels, MOST_CHANNELS};
use fredholm_core::galerkin::{Convergence, GalerkinError};
use fredholm_core::sampled::{
    CellSteps, ChannelTables, SampledChannels, SampledSolution, SampledTables, ScoreVariance,
};
use fredholm_core::{Located, Neighbour, RandomSource, Real, StateSpace, Uniforms};
use fredholm_model::Error;
use fredholm_rayon::fill_rows;
use fredholm_scene::{Coloured, Point, Radiosity};

use crate::of_degree;
use crate::partition::ScenePartition;
use crate::system::{REST, TRIAL};

/// The channels of a scene: for every face, and there for every channel, reflectance and emission over the scene's own.
#[derive(Clone, Debug)]
pub(crate) struct PerFace {
    pub(crate) channels: usize,
    pub(crate) factors: Vec<f64>,
    pub(crate) shares: Vec<f64>,
    /// The weights of a sum by which rays of a score are chosen.
    pub(crate) weights: Vec<f64>,
}

/// The tables of all faces in a scalar.
pub(crate) struct FaceTables<F> {
    channels: usize,
    factors: Vec<F>,
    shares: Vec<F>,
}

impl<F: Real> FaceTables<F> {
    pub(crate) fn new(per_face: &PerFace) -> Self {
        let rounded = |table: &[f64]| table.iter().map(|&x| F::from_f64(x)).collect();
        Self {
            channels: per_face.channels,
            factors: rounded(&per_face.factors),
            shares: rounded(&per_face.shares),
        }
    }

    pub(crate) fn of<'a>(&'a self, radiosity: Radiosity<'a, F>) -> Result<Coloured<'a, F>, Error> {
        let tables = (&*self.factors, &*self.shares);
        Ok(Coloured::new(radiosity, self.channels, tables)?)
    }
}

/// v and c of all channels.
pub(crate) struct Solved {
    pub(crate) solutions: Vec<SampledSolution>,
    /// How the longest iteration for a v went.
    pub(crate) convergence: Convergence<f64>,
}

impl Solved {
    /// The tables of all channels for walks.
    pub(crate) fn tables<F: Real>(&self, degree: usize) -> Result<ChannelTables<F>, Error> {
        let all = self
            .solutions
            .iter()
            .map(|solution| Ok(solution.for_walks::<F>()?))
            .collect::<Result<Vec<SampledTables<F>>, Error>>()?;
        let functions = of_degree!(degree, B => B);
        Ok(ChannelTables::new(&all, functions, 2)?)
    }

    /// v_ia of every channel, as walks have it.
    pub(crate) fn v<F: Real>(&self) -> Vec<Vec<f64>> {
        let rounded = |v: &f64| F::from_f64(*v).to_f64();
        let own = self.solutions.iter().map(SampledSolution::v);
        own.map(|v| v.iter().map(rounded).collect()).collect()
    }
}

/// The neighbour equations of all channels, of any degree.
pub(crate) type Boxed<'a, F> = dyn ChannelNeighbours<Scalar = F, Point = Point<F>> + Sync + 'a;

/// The weighted sum of what channels have, as one source or as one neighbour equation.
struct Sum<'a, T> {
    of: &'a T,
    weights: &'a [f64],
}

impl<T: StateSpace> StateSpace for Sum<'_, T> {
    type Scalar = T::Scalar;
    type Point = T::Point;
}

impl<T: StateSpace> Sum<'_, T> {
    fn of(&self, write: &mut dyn FnMut(&mut [T::Scalar])) -> T::Scalar {
        let mut all = [T::Scalar::from_f64(0.0); MOST_CHANNELS];
        let own = all.get_mut(..self.weights.len()).unwrap_or(&mut []);
        write(own);
        let terms = own.iter().zip(self.weights);
        terms.fold(T::Scalar::from_f64(0.0), |sum, (&x, &weight)| {
            sum + T::Scalar::from_f64(weight) * x
        })
    }
}

impl<E: Channels> RandomSource for Sum<'_, E> {
    fn sample_source<U: Uniforms<E::Scalar>>(&self, x: &E::Point, uniforms: &mut U) -> E::Scalar {
        self.of(&mut |to| self.of.sample_sources(x, uniforms, to))
    }
}

impl<N: ChannelNeighbours> Neighbour for Sum<'_, N> {
    fn locate(&self, x: N::Point) -> Located<N::Point> {
        self.of.locate(x)
    }

    fn kernel(&self, _: &Located<N::Point>, _: &Located<N::Point>, k: N::Scalar) -> N::Scalar {
        k
    }

    fn source(&self, x: &Located<N::Point>, draws: &mut dyn Uniforms<N::Scalar>) -> N::Scalar {
        self.of(&mut |to| self.of.sources(x, draws, to))
    }

    fn value(&self, x: &Located<N::Point>) -> N::Scalar {
        self.of(&mut |to| self.of.values(x, to))
    }
}

/// Hands out the neighbour equations from rays, with as many rays a score as have the least product of variance and time for
/// the sum of all channels.
pub(crate) fn with_neighbours<F: Real>(
    degree: usize,
    tables: &ChannelTables<F>,
    (coloured, weights): (&Coloured<'_, F>, &[f64]),
    then: &mut dyn FnMut(&Boxed<'_, F>) -> Result<(), Error>,
) -> Result<(), Error> {
    let radiosity = coloured.radiosity();
    of_degree!(degree, B => {
        let made = |rays: NonZeroU32| {
            SampledChannels::<_, _, _, 2, B>::new((coloured, radiosity), tables, rays)
                .map_err(|_| Error::Internal("tables of other cells"))
        };
        let trial = made(TRIAL)?;
        let neighbour = Sum { of: &trial, weights };
        let source = Sum { of: coloured, weights };
        let score = ScoreVariance::estimate(radiosity, &source, (&neighbour, TRIAL));
        then(&made(score.best_steps(REST))?)
    })
}

impl ScenePartition<'_> {
    /// v and c of every channel.
    pub(crate) fn solve_channels(
        &self,
        channels: &PerFace,
        absorption: f64,
    ) -> Result<Solved, Error> {
        let solutions =
            of_degree!(self.cut.degree, B => self.channels_in::<B>(channels, absorption)?);
        let sweeps = solutions.iter().map(SampledSolution::convergence);
        let worst = sweeps.max_by_key(|convergence| convergence.sweeps);
        Ok(Solved {
            convergence: worst.unwrap_or(fredholm_model::NO_ITERATION),
            solutions,
        })
    }

    /// v and c of every channel from the rays of one set-up.
    fn channels_in<const B: usize>(
        &self,
        channels: &PerFace,
        absorption: f64,
    ) -> Result<Vec<SampledSolution>, Error> {
        let radiosity = self.cut.radiosity(absorption)?;
        let faces = FaceTables::<f64>::new(channels);
        let coloured = faces.of(radiosity)?;
        // What is fitted for itself is the source of each channel.
        let dark = Dark(core::marker::PhantomData);
        let setup = self.setup_of::<_, B>(&radiosity, &dark);
        let cells = self.cut.number();
        let mut steps: Vec<Option<CellSteps<B>>> = vec![None; cells];
        fill_rows(&mut steps, 1, |cell, row| {
            row.fill(Some(setup.steps(cell)?));
            Ok::<(), GalerkinError>(())
        })?;
        let steps: Vec<CellSteps<B>> = steps.into_iter().flatten().collect();
        let mut rows: Vec<Vec<([f64; B], f64)>> = vec![Vec::new(); cells];
        fill_rows(&mut rows, 1, |cell, row| {
            row.fill(setup.channel_rows(cell, &coloured)?);
            Ok::<(), GalerkinError>(())
        })?;
        let solved = setup.solve_channels(&steps, &rows)?;
        let mut controls: Vec<Vec<Vec<f64>>> = vec![Vec::new(); cells];
        fill_rows(&mut controls, 1, |cell, row| {
            row.fill(setup.channel_controls(cell, &steps[cell], &solved)?);
            Ok::<(), GalerkinError>(())
        })?;
        Ok(setup.channel_solutions(solved, &controls)?)
    }
}

/// No source at all.
struct Dark<'a>(core::marker::PhantomData<&'a ()>);

impl StateSpace for Dark<'_> {
    type Scalar = f64;
    type Point = Point<f64>;
}

impl RandomSource for Dark<'_> {
    fn sample_source<U: Uniforms<f64>>(&self, _: &Point<f64>, _: &mut U) -> f64 {
        0.0
    }
}
