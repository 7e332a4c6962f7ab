//! The formulas of a cube as functions.

use fredholm_formula::Formulas;

use super::{Cube, KernelText, singular};
use crate::Placed;

/// The formulas of a cube, and of the weights of its targets; validation has checked them.
pub(super) fn formulas(cube: &Cube, weights: Vec<String>) -> Formulas {
    let list = |text: &KernelText| match text {
        KernelText::General(text) => vec![text.value.clone()],
        KernelText::Factors(texts) => texts.value.iter().map(|text| text.value.clone()).collect(),
    };
    let text = |text: &Placed<String>| text.value.clone();
    // That of a singularity which is written as such.
    let known = || match &cube.kernel {
        KernelText::General(text) if cube.dimension.value == 1 => singular::integral(&text.value),
        _ => None,
    };
    let integral = match &cube.integral {
        Some(given) => list(given),
        None => known().into_iter().collect(),
    };
    Formulas {
        dimension: cube.dimension.value,
        domain: cube.ends(),
        is_product: matches!(cube.kernel, KernelText::Factors(_)),
        kernel: list(&cube.kernel),
        integral,
        source: text(&cube.source),
        solution: cube.solution.as_ref().map(text),
        weights,
    }
}
