//! Whether the last step of walks leads to the light.

/// Which of a model's walks make their last step to the light.
///
/// ```
/// use fredholm::model::LastSteps;
/// use fredholm::{CubeModel, Model};
///
/// let u = CubeModel::from_fn::<1>(|_, _| 0.5, |_| 1.0);
/// assert_eq!(u.about().last_steps, LastSteps::Never);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LastSteps {
    /// None: nobody has written where its light comes from.
    Never,
    /// All, as far as it pays: the model sees to it by itself.
    Always,
    /// Walks that are asked to.
    Open {
        /// Whether an automatic choice looks at them: where nothing is small and bright they do not pay.
        pay: bool,
    },
}
