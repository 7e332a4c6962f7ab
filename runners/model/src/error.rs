//! Why there is no result.

use core::fmt::{self, Display};
use std::sync::Arc;

use fredholm_circle::CircleError;
use fredholm_core::galerkin::GalerkinError;
use fredholm_cube::CubeError;
use fredholm_rayon::RunError;
use fredholm_room::RoomError;
use fredholm_scene::SceneError;
use fredholm_sphere::SphereError;
use fredholm_variance::VarianceError;

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
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// The Galerkin system has no solution that serves.
    Galerkin(GalerkinError),
    /// A circle is not as it must be.
    Circle(CircleError),
    /// A cube is not as it must be.
    Cube(CubeError),
    /// A room is not as it must be.
    Room(RoomError),
    /// A sphere is not as it must be.
    Sphere(SphereError),
    /// A scene in space is not as it must be.
    Space(SceneError),
    /// An equation of a crate of its own is not as it must be.
    Equation(EquationError),
    /// The variance cannot be predicted.
    Variance(VarianceError),
    /// The walks met an error.
    Run(RunError),
    /// The scene of a room is not as it must be.
    Scene {
        /// The message, with the names of surfaces.
        message: String,
        /// The surface and the vertex, where one is wrong.
        place: Option<fredholm_room::Place>,
    },
    /// A function has a value that is not finite.
    NotFinite {
        /// Which function, between backticks and first, which value, where.
        what: String,
    },
    /// The variance of a walk is infinite.
    InfiniteVariance {
        /// The operator, or the function on which it depends.
        of: String,
        /// The estimated spectral radius, with constant absorption over 1 − q0.
        radius: f64,
        /// q0; `None`: walks end by roulette.
        absorption: Option<f64>,
    },
    /// The neighbour equation's walks have no mean.
    NoMean,
    /// Resolvent walks do not serve the equation.
    Regular {
        /// The message: what was found, and what would help.
        message: String,
    },
    /// There is too little memory.
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
    Option {
        /// The option.
        subject: Subject,
        /// The message: what would be right.
        message: String,
    },
    /// The equation has no such point, part or weight.
    Region {
        /// The message: what would be right.
        message: String,
    },
    /// Two functionals have the same name.
    TwoGoals {
        /// The name.
        name: String,
    },
    /// No walk of any pilot scored, and the number of walks has no end.
    Dark,
    /// The best setting is predicted to take longer than anybody waits, and nothing else ends the walks.
    TooLong {
        /// Seconds on one thread.
        seconds: f64,
    },
    /// No setting has walks.
    NoSetting,
    /// More is asked for than takes a reasonable time.
    TooMuch {
        /// The message: what would be right.
        message: String,
    },
    /// The numbers of a picture cannot be estimated.
    Picture(String),
    /// The batches of walks cannot be kept, or those that were kept belong to something else.
    Kept {
        /// The message: what would help.
        message: String,
        /// Whether another file or other input would help.
        is_input: bool,
    },
    /// The observer cancelled before there was a result.
    Cancelled,
    /// Something that cannot be is.
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

/// Equal if they say the same.
impl PartialEq for EquationError {
    fn eq(&self, other: &Self) -> bool {
        self.to_string() == other.to_string()
    }
}

impl Display for EquationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl core::error::Error for EquationError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        Some(&*self.0)
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

impl Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Galerkin(error) => error.fmt(f),
            Self::Circle(error) => error.fmt(f),
            Self::Cube(error) => error.fmt(f),
            Self::Room(error) => error.fmt(f),
            Self::Sphere(error) => error.fmt(f),
            Self::Space(error) => error.fmt(f),
            Self::Equation(error) => error.fmt(f),
            Self::Variance(error) => error.fmt(f),
            Self::Run(error) => error.fmt(f),
            Self::Scene { message, .. }
            | Self::Option { message, .. }
            | Self::Region { message }
            | Self::TooMuch { message }
            | Self::Regular { message }
            | Self::Kept { message, .. }
            | Self::Picture(message) => f.write_str(message),
            Self::NotFinite { what } => write!(f, "{what}: a finite number is needed there"),
            Self::InfiniteVariance {
                of,
                radius,
                absorption,
            } => infinite(f, of, *radius, *absorption),
            Self::NoMean => f.write_str(
                "the walks of the neighbour equation have no mean: the absolute values of the Galerkin \
                 coefficients have an estimated spectral radius of 1 or more, and it must be below 1; if that \
                 of |K| is below 1, use more `cells` or `points`, otherwise a smaller kernel is needed",
            ),
            Self::Memory {
                what,
                needed,
                available,
                advice,
            } => write!(
                f,
                "{what} need {} of memory, and {} are free{advice}",
                crate::memory::bytes(*needed),
                crate::memory::bytes(*available)
            ),
            Self::TwoGoals { name } => write!(
                f,
                "two targets are named {name:?}, one of them a point of a grid: rename one"
            ),
            Self::Dark => f.write_str(
                "no walk of any pilot scored, and perhaps none ever does: u may be 0 at a target, if nothing emits \
                 or nothing of it comes there; give `walks`, after which to stop in any case",
            ),
            Self::TooLong { seconds } if !seconds.is_finite() => f.write_str(
                "no number of walks reaches this error: use a larger one, or say when to stop in any case, by `walks` or a time limit",
            ),
            Self::TooLong { seconds } => write!(
                f,
                "this error takes about {} s on one thread, by the best settings that were found, and a run of more than {} s \
                 starts only if you say when to stop: give `walks` or a time limit, or use a larger error",
                short(*seconds),
                short(MOST_SECONDS)
            ),
            Self::NoSetting => f.write_str("no setting of the file has walks"),
            Self::Cancelled => f.write_str("interrupted"),
            Self::Internal(what) => f.write_str(what),
        }
    }
}

/// The spectral radius is proportional to 1/(1 − q0).
fn infinite(
    f: &mut fmt::Formatter<'_>,
    of: &str,
    radius: f64,
    absorption: Option<f64>,
) -> fmt::Result {
    let walks = match absorption {
        Some(q) => format!("with `absorption` = {q}"),
        None => "whatever ends it".to_owned(),
    };
    write!(
        f,
        "the variance of a walk is infinite {walks}: {of} has an estimated spectral radius of {}, and it must be below 1; ",
        short(radius)
    )?;
    // Over 1 − q0.
    let own = radius * (1.0 - absorption.unwrap_or(0.0));
    if own < 1.0 {
        write!(
            f,
            "leave `absorption` out, or use one below {:.2e}",
            1.0 - own
        )?;
    } else {
        f.write_str(
            "it takes a chain of its own, whose density resembles |K|, in a program of your own (see the library)",
        )?;
    }
    f.write_str(" (or --allow-infinite-variance: error bars then mean nothing)")
}

impl core::error::Error for Error {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Galerkin(error) => Some(error),
            Self::Circle(error) => Some(error),
            Self::Cube(error) => Some(error),
            Self::Room(error) => Some(error),
            Self::Sphere(error) => Some(error),
            Self::Space(error) => Some(error),
            Self::Equation(error) => error.source(),
            Self::Variance(error) => Some(error),
            Self::Run(error) => Some(error),
            _ => None,
        }
    }
}

/// Conversions from the errors of other crates.
macro_rules! from {
    ($($variant:ident($error:ty)),*) => {
        $(impl From<$error> for Error {
            fn from(error: $error) -> Self {
                Self::$variant(error)
            }
        })*
    };
}
from!(
    Circle(CircleError),
    Room(RoomError),
    Sphere(SphereError),
    Space(SceneError),
    Variance(VarianceError),
    Run(RunError)
);

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
