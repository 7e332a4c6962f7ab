//! The formulas of a cube as functions.

use crate::formula::Formulas;

use super::{Cube, KernelText};
use crate::Placed;

/// The formulas of a cube, and of the weights of its targets; validation has checked them.
pub(super) fn formulas(cube: &Cube, weights: Vec<String>) -> Formulas {
    let list = |text: &KernelText| match text {
        KernelText::General(text) => vec![text.value.clone()],
        KernelText::Factors(texts) => texts.value.iter().map(|text| text.value.clone()).collect(),
    };
    let text = |text: &Placed<String>| text.value.clone();
    Formulas {
        dimension: cube.space.dimension.value,
        domain: cube.space.ends(),
        is_product: matches!(cube.kernel, KernelText::Factors(_)),
        kernel: list(&cube.kernel),
        source: text(&cube.source),
        solution: cube.solution.as_ref().map(text),
        weights,
        parameters: cube.space.parameters.value.clone(),
    }
}
