//! Solved systems that are kept, so that many processes need one set-up.

use web_time::Instant;

pub use fredholm_model::{SavedSystem, SystemOf};

use crate::answer::Solved;
use crate::{Discretisation, Error, Partitioned, Settings, Subject, System};

/// How the space of a kept system is cut.
///
/// ```
/// use fredholm::systems::KeptCut;
///
/// let cut = KeptCut { cells: 40, degree: 2 };
/// assert_eq!((cut.cells, cut.degree), (40, 2));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeptCut {
    /// The number of cells as [`Settings`] count them.
    pub cells: usize,
    /// The degree of the polynomials on the cells.
    pub degree: usize,
}

/// Whoever keeps solved systems: in a file, for instance, that all processes of a node map.
///
/// ```
/// use std::sync::OnceLock;
///
/// use fredholm::systems::{SavedSystem, SystemOf, SystemStore};
/// use fredholm::{CubeModel, Error, Solver, System};
///
/// /// One system, in memory.
/// #[derive(Default)]
/// struct One(OnceLock<(SystemOf, SavedSystem<'static>)>);
/// impl SystemStore for One {
///     fn find(&self, of: &SystemOf) -> Result<Option<SavedSystem<'_>>, Error> {
///         let kept = self.0.get().filter(|(kept, _)| kept == of);
///         Ok(kept.map(|(_, saved)| saved.clone()))
///     }
///     fn keep(&self, of: &SystemOf, system: &dyn System) -> Result<Option<SavedSystem<'_>>, Error> {
///         let saved = system.saved().expect("cubes have numbers");
///         let _ = self.0.set((*of, saved.into_owned()));
///         self.find(of)
///     }
/// }
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let one = One::default();
/// let solve = |seed| Solver::new(&u).mean().cells(4).walks(5000).seed(seed).systems(&one).solve();
/// let (first, second) = (solve(1)?, solve(2)?);
/// // Set up once, for both.
/// assert_eq!(first.goals[0].galerkin, second.goals[0].galerkin);
/// assert!(one.0.get().is_some());
/// # Ok::<(), fredholm::SolveError>(())
/// ```
pub trait SystemStore: Sync {
    /// The cells and the degree of the system that is there, for settings that leave them open. `None`: there is none yet, or they are not known.
    ///
    /// # Errors
    /// [`Error::Kept`]: what is there cannot be read.
    fn cut(&self) -> Result<Option<KeptCut>, Error> {
        Ok(None)
    }

    /// The system with these numbers. `None`: there is none yet, so that it is solved, for [`keep`](Self::keep).
    ///
    /// # Errors
    /// [`Error::Kept`]: what is there is another system, or cannot be read.
    fn find(&self, of: &SystemOf) -> Result<Option<SavedSystem<'_>>, Error>;

    /// Keeps a system that was not there. What is returned takes the place of it: the numbers that other processes have, too.
    ///
    /// # Errors
    /// [`Error::Kept`]: it cannot be kept.
    fn keep(&self, of: &SystemOf, system: &dyn System) -> Result<Option<SavedSystem<'_>>, Error>;
}

/// Where systems come from: they are solved, unless somebody keeps them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Systems<'m>(pub(crate) Option<&'m dyn SystemStore>);

impl<'m> Systems<'m> {
    /// Refuses cells that are still open where an error is asked for: then plain walks are the fastest way to it, or nothing is chosen.
    pub(crate) fn check(self, settings: &Settings) -> Result<(), Error> {
        if self.0.is_none() || settings.cells.is_some() || settings.tolerance.is_none() {
            return Ok(());
        }
        Err(Error::Option {
            subject: Subject::Cells,
            message: "no system is set up to reach this error: give `cells`, if one is to be kept"
                .to_owned(),
        })
    }

    /// The system of these cells that is kept, if there is one.
    pub(crate) fn kept(
        self,
        cells: &(dyn Partitioned<'m> + 'm),
        settings: &Settings,
    ) -> Result<Option<Solved<'m>>, Error> {
        let start = Instant::now();
        let of = system_of(cells, settings.discretisation());
        let found = self.0.map(|store| store.find(&of)).transpose()?.flatten();
        let system = found.map(|saved| cells.restore(saved)).transpose()?;
        Ok(system.map(|system| Solved {
            system,
            seconds: start.elapsed().as_secs_f64(),
        }))
    }

    /// The system of these cells, timed, and lifted if that is asked for.
    pub(crate) fn solved(
        self,
        cells: &(dyn Partitioned<'m> + 'm),
        settings: &Settings,
    ) -> Result<Solved<'m>, Error> {
        let start = Instant::now();
        let solved = Solved {
            system: self.solve(cells, settings.discretisation())?,
            seconds: start.elapsed().as_secs_f64(),
        };
        solved.lifted(settings.lifted())
    }

    /// The system of these cells.
    fn solve(
        self,
        cells: &(dyn Partitioned<'m> + 'm),
        cut: Discretisation,
    ) -> Result<Box<dyn System + 'm>, Error> {
        let Some(store) = self.0 else {
            return cells.solve();
        };
        let of = system_of(cells, cut);
        if let Some(saved) = store.find(&of)? {
            return cells.restore(saved);
        }
        let system = cells.solve()?;
        match store.keep(&of, &*system)? {
            None => Ok(system),
            Some(saved) => {
                // Not both at a time.
                drop(system);
                cells.restore(saved)
            }
        }
    }
}

/// What a system of these cells depends on besides its equation.
fn system_of(cells: &dyn Partitioned<'_>, cut: Discretisation) -> SystemOf {
    SystemOf {
        cut,
        cells: cells.cells(),
        unknowns: cells.unknowns(),
    }
}
