//! What is said of a solution: cells, pairs of cells, walks.

use fredholm_core::{Estimator, Form, Sequence};

use crate::{Error, Subject};

/// How the neighbour equation treats pairs of cells.
///
/// ```
/// use fredholm::{Choices, Pairs};
///
/// assert_eq!(Pairs::of_word("pointwise"), Some(Pairs::Pointwise));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pairs {
    /// Pairs as in Heinrich 1995: none is pointwise.
    Paper,
    /// Pairs in S, but for those on which the kernel or the density is not smooth: these are pointwise. In rooms, rays.
    Default,
    /// All pairs pointwise: the neighbour equation differs in its source only.
    Pointwise,
    /// No pairs: h = k everywhere, and G from one ray. In rooms.
    Rays,
}

/// The floating-point type of walks.
///
/// ```
/// use fredholm::{Choices, Scalar};
///
/// assert_eq!(Scalar::F32.word(), "f32");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    /// Single precision.
    F32,
    /// Double precision.
    F64,
}

/// The method of a solution.
///
/// ```
/// use fredholm::{Choices, Method};
///
/// assert_eq!(Method::of_word("resolvent"), Some(Method::Resolvent));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Walks of the equation's chain, with a neighbour equation as control variate.
    Walks,
    /// Walks of the equation's chain as in Heinrich 1995: constant absorption, pairs in S, the product form.
    Paper,
    /// Walks that know the resolvent of a neighbour equation: of equations by kernel and source.
    Resolvent,
}

/// The value of an expression for the floating-point type that a [`Scalar`] stands for.
///
/// ```
/// use fredholm_core::Real;
/// use fredholm_model::{Scalar, in_scalar};
///
/// let scalar = Scalar::F32;
/// assert_eq!(in_scalar!(scalar, F => F::EPSILON.to_f64()), f64::from(f32::EPSILON));
/// ```
#[macro_export]
macro_rules! in_scalar {
    ($scalar:expr, $name:ident => $then:expr) => {
        match $scalar {
            $crate::Scalar::F32 => {
                type $name = f32;
                $then
            }
            $crate::Scalar::F64 => {
                type $name = f64;
                $then
            }
        }
    };
}

/// One value of an option with a few values.
///
/// ```
/// use fredholm::{Choices, Scalar};
///
/// let words: Vec<&str> = Scalar::ALL.iter().map(|choice| choice.word).collect();
/// assert_eq!(words, ["f32", "f64"]);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Choice<T: 'static> {
    /// The value.
    pub value: T,
    /// The word for it in files, on command lines and in results.
    pub word: &'static str,
    /// The description of the choice, in a sentence or two without a full stop.
    pub help: &'static str,
}

/// An option with a few values, each of which has a word.
///
/// ```
/// use fredholm::{Choices, Pairs};
///
/// assert_eq!(Pairs::Rays.word(), "rays");
/// assert_eq!(Pairs::of_word("paper"), Some(Pairs::Paper));
/// assert_eq!(Pairs::of_word("papers"), None);
/// ```
pub trait Choices: Copy + PartialEq + 'static {
    /// All values.
    const ALL: &'static [Choice<Self>];

    /// The word for a value.
    fn word(self) -> &'static str {
        let found = Self::ALL.iter().find(|choice| choice.value == self);
        found.map_or("", |choice| choice.word)
    }

    /// The value that a word stands for.
    fn of_word(word: &str) -> Option<Self> {
        let found = Self::ALL.iter().find(|choice| choice.word == word);
        found.map(|choice| choice.value)
    }
}

impl Pairs {
    /// What models of no room say to pairs that are rays.
    ///
    /// # Errors
    /// [`Error::Option`]: they are.
    pub fn refuse_rays(self) -> Result<(), Error> {
        if self != Self::Rays {
            return Ok(());
        }
        Err(Error::Option {
            subject: Subject::Pairs,
            message: "\"rays\" are for rooms, where a step is a ray and vertices say where it jumps: use \"default\""
                .to_owned(),
        })
    }
}

impl Choices for Pairs {
    const ALL: &'static [Choice<Self>] = &[
        Choice {
            value: Self::Paper,
            word: "paper",
            help: "As in the paper: circle, the diagonal left out (section 5); cube, all pairs in S",
        },
        Choice {
            value: Self::Default,
            word: "default",
            help: "All pairs in S, but of equations with exact integrals over cells the diagonal pointwise; \
                   circle: all pointwise; room: rays",
        },
        Choice {
            value: Self::Pointwise,
            word: "pointwise",
            help: "All pairs pointwise: the neighbour equation differs in its source only",
        },
        Choice {
            value: Self::Rays,
            word: "rays",
            help: "Room: no pairs, and one ray a score in their place. A walk takes as long for many cells as for few",
        },
    ];
}

impl Choices for Scalar {
    const ALL: &'static [Choice<Self>] = &[
        Choice {
            value: Self::F32,
            word: "f32",
            help: "Single precision",
        },
        Choice {
            value: Self::F64,
            word: "f64",
            help: "Double precision",
        },
    ];
}

impl Choices for Method {
    const ALL: &'static [Choice<Self>] = &[
        Choice {
            value: Self::Walks,
            word: "walks",
            help: "walks of the equation's chain, which a neighbour equation follows: its variance must be finite",
        },
        Choice {
            value: Self::Paper,
            word: "paper",
            help: "these walks as in Heinrich 1995: an absorption of 0.2 unless another is given, pairs in S, the product form",
        },
        Choice {
            value: Self::Resolvent,
            word: "resolvent",
            help: "walks that know the resolvent of a neighbour equation: kernels of any norm, given as functions",
        },
    ];
}

impl Choices for Sequence {
    const ALL: &'static [Choice<Self>] = &[
        Choice {
            value: Self::Random,
            word: "random",
            help: "Pseudo-random numbers",
        },
        Choice {
            value: Self::Sobol,
            word: "sobol",
            help: "Scrambled Sobol' points for the first 32 draws of a walk, for circles and cubes: randomised quasi-Monte \
                   Carlo. A batch is one sample, and error bars come from the means of batches",
        },
    ];
}

impl Choices for Estimator {
    const ALL: &'static [Choice<Self>] = &[
        Choice {
            value: Self::Absorption,
            word: "absorption",
            help: "A walk with a constant absorption scores where it is absorbed",
        },
        Choice {
            value: Self::Collision,
            word: "collision",
            help: "A walk scores in every state",
        },
    ];
}

impl Choices for Form {
    const ALL: &'static [Choice<Self>] = &[
        Choice {
            value: Self::Product,
            word: "product",
            help: "As in the paper: a difference of the kernels multiplies what the walk scores from there on",
        },
        Choice {
            value: Self::Residual,
            word: "residual",
            help: "A difference of the kernels multiplies the mean of that, which is v: the standard error is seldom \
                   larger, and up to several times smaller where light sources are small",
        },
    ];
}
