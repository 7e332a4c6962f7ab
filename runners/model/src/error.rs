//! Why there is no result.

use std::sync::Arc;

use fredholm_circle::CircleError;
use fredholm_core::galerkin::GalerkinError;
use fredholm_cube::CubeError;
use fredholm_rayon::RunError;
use fredholm_room::RoomError;
use fredholm_scene::SceneError;
use fredholm_sphere::SphereError;
use fredholm_variance::VarianceError;

use crate::memory::bytes;
use crate::numbers::short;

/// Seconds that are not begun if nothing but the error ends them.
pub const MOST_SECONDS: f64 = 3600.0;

/// Why there is no result. [`subject`](Self::subject) says which part of the input it is about.
///
/// ```
/// use fredholm::{CubeModel, Error, SolveError, Solver, Subject};
///
/// let u = CubeModel::from_fn::<1>(|_, _| 0.5, |_| 1.0);
/// let Err(SolveError::Failed(error)) = Solver::new(&u).mean().absorption(1.5).solve() else {
///     panic!("q0 is a probability");
/// };
/// assert_eq!(error.subject(), Some(Subject::Absorption));
/// assert_eq!(error.to_string(), "an absorption of 1.5: it must be between 0 and 1");
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The Galerkin system has no solution that serves.
    #[error("{0}")]
    Galerkin(#[source] GalerkinError),
    /// A circle is not as it must be.
    #[error("{0}")]
    Circle(#[from] CircleError),
    /// A cube is not as it must be.
    #[error("{0}")]
    Cube(#[source] CubeError),
    /// A room is not as it must be.
    #[error("{0}")]
    Room(#[from] RoomError),
    /// A sphere is not as it must be.
    #[error("{0}")]
    Sphere(#[from] SphereError),
    /// A scene in space is not as it must be.
    #[error("{0}")]
    Space(#[from] SceneError),
    /// An equation of a crate of its own is not as it must be.
    #[error(transparent)]
    Equation(EquationError),
    /// The variance cannot be predicted.
    #[error("{0}")]
    Variance(#[from] VarianceError),
    /// The walks met an error.
    #[error("{0}")]
    Run(#[from] RunError),
    /// The scene of a room is not as it must be.
    #[error("{message}")]
    Scene {
        /// The message, with the names of surfaces.
        message: String,
        /// The surface and the vertex, where one is wrong.
        place: Option<fredholm_room::Place>,
    },
    /// A function has a value that is not finite.
    #[error("{what}: a finite number is needed there")]
    NotFinite {
        /// Which function, between backticks and first, which value, where.
        what: String,
    },
    /// The variance of a walk is infinite.
    #[error("{}", infinite(of, *radius, *absorption))]
    InfiniteVariance {
        /// The operator, or the function on which it depends.
        of: String,
        /// The estimated spectral radius, with constant absorption over 1 − q0.
        radius: f64,
        /// q0; `None`: walks end by roulette.
        absorption: Option<f64>,
    },
    /// The neighbour equation's walks have no mean.
    #[error(
        "the walks of the neighbour equation have no mean: the absolute values of the Galerkin \
         coefficients have an estimated spectral radius of 1 or more, and it must be below 1; if that \
         of |K| is below 1, use more `cells` or `points`, otherwise a smaller kernel is needed"
    )]
    NoMean,
    /// Resolvent walks do not serve the equation.
    #[error("{message}")]
    Regular {
        /// The message: what was found, and what would help.
        message: String,
    },
    /// There is too little memory.
    #[error("{what} need {} of memory, and {} are free{advice}", bytes(*needed), bytes(*available))]
    Memory {
        /// The thing that needs the memory.
        what: String,
        /// Bytes that it needs.
        needed: u64,
        /// Bytes that are free.
        available: u64,
        /// Advice on what needs less memory.
        advice: &'static str,
    },
    /// An option does not go with the problem, or with other options.
    #[error("{message}")]
    Option {
        /// The option.
        subject: Subject,
        /// The message: what would be right.
        message: String,
    },
    /// The equation has no such point, part or weight.
    #[error("{message}")]
    Region {
        /// The message: what would be right.
        message: String,
    },
    /// Two functionals have the same name.
    #[error("two targets are named {name:?}, one of them a point of a grid: rename one")]
    TwoGoals {
        /// The name.
        name: String,
    },
    /// No walk of any pilot scored, and the number of walks has no end.
    #[error(
        "no walk of any pilot scored, and perhaps none ever does: u may be 0 at a target, if nothing emits \
         or nothing of it comes there; give `walks`, after which to stop in any case"
    )]
    Dark,
    /// The best setting is predicted to take longer than anybody waits, and nothing else ends the walks.
    #[error("{}", too_long(*seconds))]
    TooLong {
        /// Seconds on one thread.
        seconds: f64,
    },
    /// No setting has walks.
    #[error("no setting of the file has walks")]
    NoSetting,
    /// More is asked for than takes a reasonable time.
    #[error("{message}")]
    TooMuch {
        /// The message: what would be right.
        message: String,
    },
    /// The numbers of a picture cannot be estimated.
    #[error("{0}")]
    Picture(String),
    /// The batches of walks cannot be kept, or those that were kept belong to something else.
    #[error("{message}")]
    Kept {
        /// The message: what would help.
        message: String,
        /// Whether another file or other input would help.
        is_input: bool,
    },
    /// The observer cancelled before there was a result.
    #[error("interrupted")]
    Cancelled,
    /// Something that cannot be is.
    #[error("{0}")]
    Internal(&'static str),
}

/// Error that a crate of its own says of its equation.
///
/// ```
/// use fredholm::EquationError;
///
/// let error = EquationError::new("x".parse::<f64>().unwrap_err());
/// assert_eq!(error.to_string(), "invalid float literal");
/// ```
#[derive(Clone, Debug)]
pub struct EquationError(Arc<dyn core::error::Error + Send + Sync>);

impl EquationError {
    /// The error of an equation.
    pub fn new(error: impl core::error::Error + Send + Sync + 'static) -> Self {
        Self(Arc::new(error))
    }
}

impl core::fmt::Display for EquationError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.0.fmt(f)
    }
}

/// The source is the error itself, and not the pointer to it, so that callers can ask for its type.
impl core::error::Error for EquationError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        Some(&*self.0)
    }
}

/// Equal if they say the same.
impl PartialEq for EquationError {
    fn eq(&self, other: &Self) -> bool {
        self.to_string() == other.to_string()
    }
}

/// A part of the input.
///
/// ```
/// use fredholm::{Error, Subject};
///
/// let error = Error::TooLong { seconds: 1e5 };
/// assert_eq!(error.subject(), Some(Subject::Tolerance));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Subject {
    /// The number of cells.
    Cells,
    /// The degree.
    Degree,
    /// The choice of pairs.
    Pairs,
    /// The absorption probability.
    Absorption,
    /// The numbers that walks draw.
    Sequence,
    /// The last step.
    LastStep,
    /// The way back.
    Adjoint,
    /// The sensitivities.
    Sensitivities,
    /// The degree of a lift.
    Lift,
    /// The tolerance.
    Tolerance,
    /// A surface's vertex.
    Vertex(fredholm_room::Place),
    /// The whole problem.
    Problem,
}

impl Error {
    /// Which part of the input it is about, if it is about one.
    #[must_use]
    pub const fn subject(&self) -> Option<Subject> {
        match self {
            Self::InfiniteVariance { .. } => Some(Subject::Absorption),
            Self::Memory { .. } => Some(Subject::Cells),
            Self::Option { subject, .. } => Some(*subject),
            Self::Dark | Self::TooLong { .. } => Some(Subject::Tolerance),
            Self::Scene {
                place: Some(place), ..
            } => Some(Subject::Vertex(*place)),
            Self::Scene { place: None, .. } => Some(Subject::Problem),
            _ => None,
        }
    }

    /// Whether a value of a function that is no number causes such errors.
    #[must_use]
    pub const fn is_of_values(&self) -> bool {
        matches!(
            self,
            Self::Cube(CubeError::Kernel { .. } | CubeError::Source { .. })
                | Self::Galerkin(_)
                | Self::Run(RunError::NotFinite { .. } | RunError::Replicate { .. })
                | Self::Variance(_)
                | Self::InfiniteVariance { .. }
                | Self::NoMean
                | Self::NotFinite { .. }
        )
    }

    /// Whether other input would help, rather than another machine or version.
    #[must_use]
    pub const fn is_of_input(&self) -> bool {
        !matches!(
            self,
            Self::Galerkin(_)
                | Self::Variance(_)
                | Self::Run(_)
                | Self::Picture(_)
                | Self::Internal(_)
                | Self::Kept {
                    is_input: false,
                    ..
                }
        )
    }
}

/// A run that would take too long to start it without being told when to stop.
fn too_long(seconds: f64) -> String {
    if !seconds.is_finite() {
        return "no number of walks reaches this error: use a larger one, or say when to stop in any case, by `walks` or a time limit"
            .to_owned();
    }
    format!(
        "this error takes about {} s on one thread, by the best settings that were found, and a run of more than {} s starts only if \
         you say when to stop: give `walks` or a time limit, or use a larger error",
        short(seconds),
        short(MOST_SECONDS)
    )
}

/// The spectral radius is proportional to 1/(1 − q0).
fn infinite(of: &str, radius: f64, absorption: Option<f64>) -> String {
    let walks = match absorption {
        Some(q) => format!("with `absorption` = {q}"),
        None => "whatever ends it".to_owned(),
    };
    // Over 1 − q0.
    let own = radius * (1.0 - absorption.unwrap_or(0.0));
    let advice = match own < 1.0 {
        true => format!("leave `absorption` out, or use one below {:.2e}", 1.0 - own),
        false => "it takes a chain of its own, whose density resembles |K|, in a program of your own (see the library)"
            .to_owned(),
    };
    format!(
        "the variance of a walk is infinite {walks}: {of} has an estimated spectral radius of {}, and it must be below 1; {advice} \
         (or --allow-infinite-variance: error bars then mean nothing)",
        short(radius)
    )
}

impl From<GalerkinError> for Error {
    fn from(error: GalerkinError) -> Self {
        match error {
            GalerkinError::Radius => Self::NoMean,
            error => Self::Galerkin(error),
        }
    }
}

impl From<CubeError> for Error {
    fn from(error: CubeError) -> Self {
        match error {
            CubeError::Galerkin(GalerkinError::Radius) => Self::NoMean,
            error => Self::Cube(error),
        }
    }
}
