//! Which parts of a source the last step leads to.

use alloc::vec::Vec;

use crate::Real;

/// A part of the space on which source and reflectance are constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SourcePart {
    /// The measure of the part.
    pub measure: f64,
    /// F on it.
    pub source: f64,
    /// ∫ K(x, y) dμ(y) from it: the share of what arrives that it sends on.
    pub reflectance: f64,
}

/// The parts of a source to which a last step pays, by their numbers, which grow. What is left of the source is scored where
/// walks meet it. `time` is that of one light in a last step, over the time of a step.
///
/// With the light that a step meets on a part by chance, and a the part's measure over that of all, its score has about the
/// variance Σ F² a − (Σ F a)² over what is no light. All else varies about as much as the square of the light that was
/// reflected. The brightest for their size become lights, as many as make variance times time least: a small lamp is one,
/// and of walls that all are warm none.
///
/// ```
/// use fredholm_core::{SourcePart, best_lights};
///
/// let part = |measure, source| SourcePart { measure, source, reflectance: 0.5 };
/// assert_eq!(best_lights(&[part(1.0, 0.0), part(0.01, 5.0), part(1.0, 0.01)], 0.5), [1]);
/// assert!(best_lights(&[part(1.0, 1.0), part(1.0, 1.1)], 0.5).is_empty());
/// ```
#[must_use]
pub fn best_lights(parts: &[SourcePart], time: f64) -> Vec<u32> {
    let all: f64 = parts.iter().map(|part| part.measure).sum();
    let mean = |of: &dyn Fn(&SourcePart) -> f64| {
        let sum: f64 = parts.iter().map(|part| part.measure * of(part)).sum();
        sum / all
    };
    let reflectance = mean(&|part| part.reflectance);
    let (mut first, mut second) = (
        mean(&|part| part.source),
        mean(&|part| part.source * part.source),
    );
    let reflected = reflectance * mean(&|part| part.source.abs()) / (1.0 - reflectance);
    let least = reflected * reflected;
    let size = |number: u32| {
        parts
            .get(number as usize)
            .map_or(0.0, |part| part.measure * part.source * part.source)
    };
    let mut order: Vec<u32> = (0..parts.len() as u32).filter(|&n| size(n) > 0.0).collect();
    // The sort is stable, so that equal ones stay in their order.
    order.sort_by(|&a, &b| size(b).total_cmp(&size(a)));
    let work = |first: f64, second: f64, number: usize| {
        let variance = least + Real::max(second - first * first, 0.0);
        variance * (1.0 + time * number as f64)
    };
    let (mut best, mut taken) = (work(first, second, 0), 0);
    for (number, &light) in (1..).zip(&order) {
        if let Some(part) = parts.get(light as usize) {
            first -= part.measure * part.source / all;
            second -= size(light) / all;
        }
        let now = work(first, second, number);
        if now < best {
            (best, taken) = (now, number);
        }
    }
    order.truncate(taken);
    order.sort_unstable();
    order
}
