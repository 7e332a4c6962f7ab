//! Three stages of a solution: a model, its cells, its solved system. All are object safe.

use fredholm_core::galerkin::Convergence;
use fredholm_core::{Job, Statistics};
use fredholm_embedded::TableBuilder;
use serde::Serialize;

use crate::examined::Examined;
use crate::heat::RadiativeExchange;
use crate::quantity::Quantity;
use crate::question::{ResolventFound, ResolventQuestion};

use crate::cost::{Cost, PointwisePairs};
use crate::{
    About, Derived, Discretisation, Error, Field, GlobalField, GlobalSystem, Goal, Pairs, Region,
    SavedSystem, WalkOptions,
};

/// An equation whose size is chosen at run time.
///
/// ```
/// use fredholm::{CubeModel, Model};
///
/// // Code that takes any equation.
/// fn kind(model: &dyn Model) -> (&'static str, usize) {
///     (model.about().kind, model.about().most_degree)
/// }
/// let u = CubeModel::from_fn::<1>(|_, _| 0.5, |_| 1.0);
/// assert_eq!(kind(&u), ("cube", 4));
/// ```
pub trait Model: Send + Sync {
    /// The properties of the model.
    fn about(&self) -> About;

    /// The name of the part of this number: of a surface, say.
    fn part(&self, number: usize) -> Option<&str> {
        let _ = number;
        None
    }

    /// The text of the weight of this number.
    fn weight(&self, number: usize) -> Option<&str> {
        let _ = number;
        None
    }

    /// The names of what shares the walks of every target: the channels of the equation, such as colours, and last their
    /// weighted sum, if it is wanted. None: u has one channel.
    fn channels(&self) -> &[String] {
        &[]
    }

    /// The number of functionals that share the walks of a target.
    fn shared(&self) -> usize {
        self.channels().len().max(1)
    }

    /// The model of the way back, for goals that it serves: its walks go from all sources and score at all receivers, as u of
    /// symmetric exchange allows. It has the same goals, with the same (u, Φ).
    ///
    /// # Errors
    /// [`Error::Option`]: the kind has none, or not for these goals, and why.
    fn adjoint(&self, goals: &[Goal]) -> Result<Box<dyn Model + '_>, Error> {
        let _ = goals;
        Err(Error::Option {
            subject: crate::Subject::Adjoint,
            message:
                "this equation has no walks from the sources to the receivers: leave `adjoint` out"
                    .to_owned(),
        })
    }

    /// The place of a point in the drawing, where a region says it otherwise: in metres, of a room.
    fn position(&self, region: &Region) -> Option<Vec<f64>> {
        let _ = region;
        None
    }

    /// The place in space of a point, for pictures and meshes; `None`: a region is no point, or has no place in three
    /// dimensions. Where angles are coordinates, it is on the circle or the sphere of radius 1.
    fn place(&self, region: &Region) -> Option<[f64; 3]> {
        let drawn = self.position(region);
        let coordinates = match (region, &drawn) {
            (_, Some(drawn)) => drawn,
            (Region::Point(x), None) => x,
            _ => return None,
        };
        let mut place = [0.0; 3];
        let axes = place.get_mut(..coordinates.len())?;
        axes.copy_from_slice(coordinates);
        Some(place)
    }

    /// What a user should know of the equation before its results: which walls an obstacle covers, say.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }

    /// Refuses goals of regions that it does not have.
    ///
    /// # Errors
    /// [`Error::Region`].
    fn check_goals(&self, goals: &[Goal]) -> Result<(), Error>;

    /// The regions of a number of points, equally spaced over the space or along the part of this number.
    fn grid(&self, points: usize, part: Option<usize>) -> Vec<Region>;

    /// The region of the mean over the whole space.
    fn whole(&self) -> Region {
        Region::Whole
    }

    /// Answers goals by resolvent walks.
    ///
    /// # Errors
    /// [`Error`]; [`Error::Option`]: the equation is not given by kernel and source.
    fn by_resolvent(&self, question: &ResolventQuestion<'_>) -> Result<ResolventFound<'_>, Error> {
        let _ = question;
        Err(Error::Option {
            subject: crate::Subject::Problem,
            message: "resolvent walks are of equations whose kernel is a function on pairs of points: leave `method` out"
                .to_owned(),
        })
    }

    /// About so many points of the space, spread over all of it: where the error bars of a global estimate are looked at.
    fn spread(&self, points: f64) -> Vec<Region> {
        let dimension = self.about().dimension.unwrap_or(1) as f64;
        // Of 256 these are 256, 16, 6, 4, 3 or 2.
        let per_axis = (points.powf(1.0 / dimension) + 1e-9).floor();
        self.grid(per_axis as usize, None)
    }

    /// Whether a region is a point of the space, where u is: what a room has in the air is none.
    fn is_in_space(&self, region: &Region) -> bool {
        matches!(region, Region::Point(_) | Region::On(..) | Region::Spot(..))
    }

    /// The surfaces between which light or heat goes, if there are some: they have irradiances and net fluxes.
    fn exchange(&self) -> Option<&dyn RadiativeExchange> {
        None
    }

    /// (u, Φ), if it is known.
    ///
    /// # Errors
    /// [`Error::NotFinite`].
    fn exact(&self, region: &Region) -> Result<Option<f64>, Error> {
        let _ = region;
        Ok(None)
    }

    /// (u, Φ) in the channel of a goal, if it is known.
    ///
    /// # Errors
    /// [`Error::NotFinite`].
    fn exact_of(&self, goal: &Goal) -> Result<Option<f64>, Error> {
        self.exact(&goal.region)
    }

    /// (f, Φ) of a function of the coordinates that a point of this equation has; in rooms and scenes they are those of its place. `None`:
    /// that is not known, or two rules do not agree on it to twelve digits.
    ///
    /// # Errors
    /// [`Error`].
    fn integral(&self, region: &Region, function: &Field) -> Result<Option<f64>, Error> {
        let at = match region {
            Region::Point(x) => Some(x.clone()),
            _ => self
                .position(region)
                .or_else(|| self.place(region).map(|at| at.to_vec())),
        };
        Ok(at.map(|at| function(&at)))
    }

    /// Refuses combinations that it does not take.
    ///
    /// # Errors
    /// [`Error::Option`].
    fn check(&self, discretisation: &Discretisation, pairs: Pairs) -> Result<(), Error>;

    /// Cuts the space into cells.
    ///
    /// # Errors
    /// [`Error`].
    fn partition<'m>(
        &'m self,
        discretisation: &Discretisation,
    ) -> Result<Box<dyn Partitioned<'m> + 'm>, Error>;

    /// Cells for a sweep, from few to as many as take a second or so.
    fn levels(&self, discretisation: &Discretisation) -> Vec<usize>;

    /// Fewer cells than those, which are too few for a sweep and cheap to try.
    fn coarse_levels(&self, discretisation: &Discretisation) -> Vec<usize> {
        let _ = discretisation;
        Vec::new()
    }

    /// The exponent r of √Var ~ n^−r that theory has with these pairs.
    fn order(&self, discretisation: &Discretisation, pairs: Pairs) -> f64 {
        let _ = pairs;
        self.smooth_order(discretisation.degree)
    }

    /// The exponent r where nothing but the degree limits it.
    fn smooth_order(&self, degree: usize) -> f64 {
        (degree + 1) as f64 / self.about().dimension.unwrap_or(1) as f64
    }

    /// The quantities on which u depends, such as the reflectance of every surface, of which walks tell the derivatives of goals.
    fn quantities(&self) -> Vec<Quantity> {
        Vec::new()
    }

    /// This equation as one together with those of its derivatives by all [quantities](Self::quantities), and the targets there that are the
    /// derivatives of those of these goals: of each target those by all quantities. `None`: walks of the equation itself tell them
    /// ([`Wanted::Derivatives`]).
    ///
    /// # Errors
    /// [`Error::Option`]: something has no derivative.
    fn with_derivatives(&self, goals: &[Goal]) -> Result<Option<Differentiated>, Error> {
        let _ = goals;
        Ok(None)
    }

    /// What was wrong with the functions of the equation, if that caused this error of a run that has just ended.
    fn explain(&self, error: Error) -> Error {
        error
    }

    /// Deterministic solutions to compare with, if there are some.
    ///
    /// # Errors
    /// [`Error`].
    fn nystrom(&self) -> Result<Vec<Deterministic>, Error> {
        Ok(Vec::new())
    }

    /// What the statistics of a job say besides u: irradiances and net fluxes. They are those of the goals, and then of
    /// what [`Model::besides`] counts.
    fn derive(&self, goals: &[Goal], statistics: &[Statistics]) -> Derived {
        self.exchange().map_or_else(Derived::default, |surfaces| {
            surfaces.derived(goals, statistics)
        })
    }

    /// The number of functionals that a job has besides its goals.
    fn besides(&self, goals: &[Goal]) -> usize {
        self.exchange()
            .map_or(0, |surfaces| surfaces.besides(goals))
    }
}

/// An equation together with those of its derivatives, and targets that are derivatives.
pub type Differentiated = (Box<dyn Model>, Vec<Goal>);

/// A deterministic solution.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Deterministic {
    /// The number of nodes.
    pub nodes: usize,
    /// Kernel evaluations.
    pub evaluations: f64,
    /// The mean that it gives.
    pub mean: f64,
    /// The error of the deterministic solution; null if it is not known well enough.
    pub error: Option<f64>,
}

/// Cells cut, nothing solved.
///
/// ```
/// use fredholm::{CubeModel, Model, Partitioned, Settings};
///
/// let u = CubeModel::from_fn::<2>(|_, _| 0.5, |_| 1.0);
/// let settings = Settings { cells: Some(10), degree: Some(1), ..Settings::default() };
/// let cells = u.partition(&settings.discretisation())?;
/// assert_eq!((cells.cells(), cells.unknowns()), (10, 300));
/// // K² has the radius ¼, so that walks have a finite variance.
/// assert!((cells.plain_radius()? - 0.25).abs() < 1e-9);
/// # Ok::<(), fredholm::Error>(())
/// ```
pub trait Partitioned<'m>: Send + Sync {
    /// Cells as they are counted in [`Discretisation::cells`].
    fn cells(&self) -> usize;

    /// The number of unknowns in all: of cells, at degree 0.
    fn unknowns(&self) -> usize;

    /// The number of cells for people: "100", "10 per axis, 1000 in all".
    fn cells_text(&self) -> String {
        self.cells().to_string()
    }

    /// Bytes of all tables at their largest.
    fn memory(&self, goals: &[Goal], pairs: Pairs) -> usize;

    /// What work takes.
    fn cost(&self, pairs: Pairs) -> Cost;

    /// What a solution that is lifted to this degree takes, and walks that follow it. `None`: that is not known, so that nothing chooses it.
    fn lift_cost(&self, degree: usize) -> Option<Cost> {
        let _ = degree;
        None
    }

    /// Pointwise pairs of a row; if that takes a set-up, estimated on few cells.
    ///
    /// # Errors
    /// [`Error`].
    fn pointwise_pairs(&self, pairs: Pairs) -> Result<PointwisePairs, Error> {
        let _ = pairs;
        Ok(PointwisePairs::default())
    }

    /// Kernel evaluations of a set-up whose iteration took so many sweeps.
    fn evaluations(&self, sweeps: u32) -> f64;

    /// The spectral radius of T_k²p, estimated: below 1 if walks have a finite variance, and below 1 − q0 if they are absorbed with
    /// that probability.
    ///
    /// # Errors
    /// [`Error`].
    fn plain_radius(&self) -> Result<f64, Error>;

    /// Refuses walks whose error bars would mean nothing, as far as that can be seen without a solved system.
    ///
    /// # Errors
    /// [`Error::InfiniteVariance`].
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error>;

    /// The least number of points of an examination ([`System::examine`]) on these cells, whatever is asked for.
    ///
    /// # Errors
    /// [`Error`]: there is none.
    fn examined_points(&self) -> Result<usize, Error> {
        Ok(0)
    }

    /// Solves the Galerkin system.
    ///
    /// # Errors
    /// [`Error`].
    fn solve(&self) -> Result<Box<dyn System + 'm>, Error>;

    /// Makes a system of what [`System::saved`] gave of one on the same cells: to the bit the same, in a fraction of the time.
    ///
    /// # Errors
    /// [`Error::Kept`]: it does not fit these cells. [`Error::Internal`]: this kind saves no systems.
    fn restore(&self, saved: SavedSystem<'m>) -> Result<Box<dyn System + 'm>, Error> {
        let _ = saved;
        Err(Error::Internal("a system of a kind that saves none"))
    }

    /// Prepares walks that follow no neighbour equation, and hands them on.
    ///
    /// # Errors
    /// [`Error`], or what `then` says.
    fn plain_job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error>;
}

/// A solved Galerkin system. It serves all pairs and absorptions.
///
/// ```
/// use fredholm::{CubeModel, Model, Partitioned, Settings, System};
///
/// let u = CubeModel::from_fn::<1>(|_, _| 0.5, |_| 1.0);
/// let settings = Settings { cells: Some(10), ..Settings::default() };
/// let system = u.partition(&settings.discretisation())?.solve()?;
/// assert!(system.check_variance(&settings.walk_options()).is_ok());
/// # Ok::<(), fredholm::Error>(())
/// ```
pub trait System: Send + Sync {
    /// Refuses walks whose error bars would mean nothing.
    ///
    /// # Errors
    /// [`Error::InfiniteVariance`].
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error>;

    /// Prepares walks that both equations follow, and hands them on.
    ///
    /// # Errors
    /// [`Error`], or what `then` says.
    fn job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error>;

    /// Prepares a prediction of variances with integrals in about so many points, and hands it on.
    ///
    /// # Errors
    /// [`Error`], or what `then` says.
    fn examine(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error>;

    /// The neighbour equation as tables for a device.
    ///
    /// # Errors
    /// [`Error`].
    fn tables(&self, pairs: Pairs) -> Result<TableBuilder, Error>;

    /// What takes long to compute of the system, as plain numbers. `None`: this kind saves no systems.
    fn saved(&self) -> Option<SavedSystem<'_>> {
        None
    }

    /// The system with a solution of a higher degree in the place of its own: v', the projection of F + T_K v on polynomials
    /// of this degree. Its neighbour equation has h = k and G = v' − T_K v', so that walks need no matrix of that degree:
    /// all pairs are pointwise.
    ///
    /// # Errors
    /// [`Error::Internal`]: the kind has none ([`About::most_lift`](crate::About::most_lift)); [`Error`].
    fn lift<'s>(self: Box<Self>, degree: usize) -> Result<Box<dyn System + 's>, Error>
    where
        Self: 's,
    {
        let _ = degree;
        Err(Error::Internal("a system without a lift"))
    }

    /// The system as one that has its global estimate from one set of walks. A kind whose chain preserves no density that
    /// is known, or whose T_K nobody has written, has none: [`About::whole`](crate::About::whole).
    ///
    /// # Errors
    /// [`Error::Internal`]: it has none.
    fn whole<'s>(self: Box<Self>) -> Result<Box<dyn GlobalSystem<'s> + 's>, Error>
    where
        Self: 's,
    {
        Err(Error::Internal("a system without a global estimate"))
    }
}

/// What a [`Model`] has in common with one of the same space, which its method of this name gives: methods of an `impl Model`.
///
/// ```
/// use fredholm_model::{About, Discretisation, Error, Goal, Model, Pairs, Partitioned};
///
/// /// A model under another name.
/// struct Named<'a>(&'a dyn Model);
///
/// impl Named<'_> {
///     fn inner(&self) -> &dyn Model {
///         self.0
///     }
/// }
///
/// impl Model for Named<'_> {
///     fredholm_model::of_space!(inner);
///
///     fn about(&self) -> About {
///         About { kind: "mine", ..self.0.about() }
///     }
///     fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
///         self.0.check_goals(goals)
///     }
///     fn check(&self, cut: &Discretisation, pairs: Pairs) -> Result<(), Error> {
///         self.0.check(cut, pairs)
///     }
///     fn partition<'m>(&'m self, cut: &Discretisation) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
///         self.0.partition(cut)
///     }
/// }
/// ```
#[macro_export]
macro_rules! of_space {
    ($inner:ident) => {
        fn part(&self, number: usize) -> Option<&str> {
            self.$inner().part(number)
        }

        fn weight(&self, number: usize) -> Option<&str> {
            self.$inner().weight(number)
        }

        fn place(&self, region: &$crate::Region) -> Option<[f64; 3]> {
            self.$inner().place(region)
        }

        fn grid(&self, points: usize, part: Option<usize>) -> Vec<$crate::Region> {
            self.$inner().grid(points, part)
        }

        fn spread(&self, points: f64) -> Vec<$crate::Region> {
            self.$inner().spread(points)
        }

        fn integral(
            &self,
            region: &$crate::Region,
            function: &$crate::Field,
        ) -> Result<Option<f64>, $crate::Error> {
            self.$inner().integral(region, function)
        }

        fn levels(&self, discretisation: &$crate::Discretisation) -> Vec<usize> {
            self.$inner().levels(discretisation)
        }

        fn smooth_order(&self, degree: usize) -> f64 {
            self.$inner().smooth_order(degree)
        }
    };
}

/// `Debug` of objects of a trait, by its name.
///
/// ```
/// trait Anything {}
/// fredholm_model::debug_by_name!("Anything": dyn Anything + '_);
/// ```
#[macro_export]
macro_rules! debug_by_name {
    ($($name:literal: $object:ty),*) => {
        $(impl core::fmt::Debug for $object {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.write_str($name)
            }
        })*
    };
}
debug_by_name!("Model": dyn Model + '_, "System": dyn System + '_, "GlobalField": dyn GlobalField + '_);

/// The goals and options of walks.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// The goals.
    pub goals: &'a [Goal],
    /// How walks are made.
    pub walk: &'a WalkOptions,
    /// What of the goals is wanted.
    pub wanted: Wanted,
}

/// What of goals is wanted.
///
/// ```
/// use fredholm_model::Wanted;
///
/// assert_eq!(Wanted::default(), Wanted::All);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wanted {
    /// u, and irradiances and net fluxes where there are some.
    #[default]
    All,
    /// u alone.
    U,
    /// All, and the derivatives with respect to the [quantities](Model::quantities).
    Derivatives,
}

/// A function that is called with prepared walks.
pub type Then<'a> = dyn FnMut(&Prepared<'_>) -> Result<(), Error> + 'a;

/// Callback that gets a job, and (v, Φ) of each goal.
pub type WithJob<'a> = dyn FnMut(&dyn Job, &[f64]) -> Result<(), Error> + 'a;

/// Walks that are ready to run.
#[derive(Clone, Copy)]
pub struct Prepared<'a> {
    /// The walks of the goals, and of what is wanted besides.
    pub job: &'a dyn Job,
    /// (v, Φ) of each goal, or what is known of it.
    pub galerkin: &'a [f64],
    /// ‖v‖∞, for what rounding leaves.
    pub largest: f64,
    /// A bound below 1 of the spectral radius of |K'|: the largest row sum or, if that is not below 1, by powers.
    pub radius_bound: f64,
    /// How the iteration for v went.
    pub convergence: Convergence<f64>,
    /// Pointwise pairs of a row.
    pub pointwise: PointwisePairs,
    /// The spectral radius of T_h²p, or a bound of it, if it was looked at.
    pub neighbour_second_moment_radius: Option<f64>,
}

impl core::fmt::Debug for Prepared<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Prepared")
            .field("goals", &self.job.goals())
            .field("pointwise", &self.pointwise)
            .finish_non_exhaustive()
    }
}

/// No iteration.
pub const NO_ITERATION: Convergence<f64> = Convergence {
    sweeps: 0,
    residual: 0.0,
};

impl<'a> Prepared<'a> {
    /// Walks that follow no neighbour equation.
    pub fn plain(job: &'a dyn Job, zeros: &'a [f64]) -> Self {
        Self {
            job,
            galerkin: zeros,
            largest: 0.0,
            radius_bound: 0.0,
            convergence: NO_ITERATION,
            pointwise: PointwisePairs::default(),
            neighbour_second_moment_radius: None,
        }
    }
}
