//! A solved system as plain numbers, to be kept and used again.

use std::borrow::Cow;

use fredholm_core::galerkin::Solution;

use crate::{Discretisation, Error};

/// The part of a solved system that takes long to compute, as plain numbers: whoever has the same cells makes the system of
/// it again, to the bit. Geometry, functions and whatever else follows quickly from the model is no part of it.
///
/// Large tables may lie elsewhere, in a file that is mapped: a system borrows them.
///
/// ```
/// use fredholm::{CubeModel, Model, Settings};
///
/// let u = CubeModel::from_fn::<1>(|_, _| 0.5, |_| 1.0);
/// let settings = Settings { cells: Some(10), ..Settings::default() };
/// let cells = u.partition(&settings.discretisation())?;
/// let system = cells.solve()?;
/// let saved = system.saved().expect("a cube has numbers to save");
/// assert_eq!((saved.solution.v.len(), saved.coefficients.len()), (10, 100));
/// let again = cells.restore(saved.into_owned())?;
/// assert!(again.check_variance(&settings.walk_options()).is_ok());
/// # Ok::<(), fredholm::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct SavedSystem<'a> {
    /// The Galerkin solution.
    pub solution: Cow<'a, Solution>,
    /// The coefficients K', as the kind of model keeps them; empty where they are closed forms.
    pub coefficients: Cow<'a, [f64]>,
}

impl<'a> SavedSystem<'a> {
    /// The numbers of a system.
    #[must_use]
    pub const fn new(solution: &'a Solution, coefficients: &'a [f64]) -> Self {
        Self {
            solution: Cow::Borrowed(solution),
            coefficients: Cow::Borrowed(coefficients),
        }
    }

    /// Copies the numbers, so that they borrow nothing.
    #[must_use]
    pub fn into_owned(self) -> SavedSystem<'static> {
        SavedSystem {
            solution: Cow::Owned(self.solution.into_owned()),
            coefficients: Cow::Owned(self.coefficients.into_owned()),
        }
    }

    /// The Galerkin solution, if the numbers are those of so many unknowns, with this number of coefficients.
    ///
    /// # Errors
    /// [`Error::Kept`]: they are of other cells, or no finite numbers.
    pub fn fitting(&self, unknowns: usize, coefficients: Option<usize>) -> Result<Solution, Error> {
        let lengths = [self.solution.v.len(), self.coefficients.len()];
        let is_finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
        let bound = self.solution.radius_bound;
        let fits = [Some(unknowns), coefficients] == lengths.map(Some)
            && is_finite(&self.solution.v)
            && is_finite(&self.coefficients)
            // As for every solution: `Solution::new` refuses the others.
            && (0.0..1.0).contains(&bound);
        if fits {
            return Ok(self.solution.clone().into_owned());
        }
        Err(Error::Kept {
            message: "the numbers of the saved system do not fit these cells: make its file again"
                .to_owned(),
            is_input: true,
        })
    }
}

/// The numbers on which a solved system depends besides its equation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SystemOf {
    /// How the space is cut.
    pub cut: Discretisation,
    /// The number of cells, which may be open there.
    pub cells: usize,
    /// The number of unknowns.
    pub unknowns: usize,
}
