//! The regions at which error bars are looked at while walks of a global estimate go on.

use fredholm_core::global::over_replicates;
use fredholm_model::{GlobalField, GlobalQuantity, IMAGE_HEAD};

use super::{PROBES, REPLICATES, split};
use crate::{Error, Goal, Model, Region, Tolerance};

/// The part of a tolerance that no error bar sees, at most: what scores of one degree less would move, which is many times what
/// is lost.
const UNSEEN: f64 = 0.5;
/// Standard errors of what the highest degree is worth that are no sign of it: some of many places are two off.
const SIGNIFICANT: f64 = 3.0;
/// The part of a standard error below which it does not matter, before walks tell more.
const SMALL: f64 = 0.25;
/// The part of a tolerance by which quadrature may be off.
pub(super) const MOVED: f64 = 0.1;

/// Regions, at which u is looked at; if there is none, all cells of the field's mesh.
#[derive(Debug)]
pub(crate) struct Looks(Vec<Region>);

/// What error bars are, in units of the tolerance.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Look {
    /// The largest of them.
    pub(crate) error: f64,
    /// The largest tolerance.
    pub(crate) bound: f64,
    /// The largest part of the highest degree, in the unit of u: many times what scores lose.
    pub(crate) highest: f64,
    /// Whether there is a bias beside them.
    pub(crate) is_biased: bool,
    /// Whether one of half that size would be.
    pub(crate) is_nearly_biased: bool,
}

impl Looks {
    /// u at some points, spread over the space, or on all cells where it has no values at points.
    pub(crate) fn of_points(model: &dyn Model) -> Self {
        Self(model.spread(PROBES))
    }

    /// u of these goals, for which a tolerance is: as with separate walks, not for irradiances and net fluxes.
    pub(crate) fn of_goals(goals: &[Goal]) -> Self {
        Self(goals.iter().map(|goal| goal.region.clone()).collect())
    }

    /// The number of regions that are points of the space, and that of all others.
    pub(crate) fn counts(&self, model: &dyn Model) -> [usize; 2] {
        let all = self.0.iter();
        let points = all.filter(|region| model.is_in_space(region)).count();
        [points, self.0.len() - points]
    }

    /// A few of the points of the space.
    pub(crate) fn some_points(&self, model: &dyn Model, few: usize) -> Vec<Region> {
        let all = || self.0.iter().filter(|region| model.is_in_space(region));
        let step = all().count().div_ceil(few).max(1);
        all().step_by(step).cloned().collect()
    }

    /// What a field says of them.
    pub(crate) fn look(
        &self,
        field: &dyn GlobalField,
        tolerance: Tolerance,
    ) -> Result<Look, Error> {
        let width = IMAGE_HEAD + field.rows();
        let mut all = Look::default();
        let images = match self.0.is_empty() {
            true => field.mesh_images(),
            false => field.images(GlobalQuantity::U, &self.0)?,
        };
        let images = images.chunks_exact(width);
        for (image, highest) in images.clone().zip(highest_parts(images)) {
            all.add(image, highest, tolerance);
        }
        Ok(all)
    }
}

/// What the highest degree is worth at each of these images, and 0 where that may be its noise, which the halves of the replicates tell.
pub(super) fn highest_parts<'a>(images: impl Iterator<Item = &'a [f64]>) -> Vec<f64> {
    let parts = images.map(|image| match image.get(IMAGE_HEAD + REPLICATES..) {
        Some(&[one, other]) => [one, other].map(|half| 0.5 * half),
        _ => [0.0; 2],
    });
    let parts: Vec<[f64; 2]> = parts.collect();
    let squares = parts.iter().map(|[one, other]| (one - other).powi(2));
    let noise = (squares.sum::<f64>() / parts.len().max(1) as f64).sqrt();
    let worth = parts.iter().map(|[one, other]| (one + other).abs());
    let worth = worth.map(|worth| {
        if worth > SIGNIFICANT * noise {
            worth
        } else {
            0.0
        }
    });
    worth.collect()
}

impl Look {
    /// Looks at an image: F + T_K v and how far it moved, and replicates. `highest` is what the highest degree is worth there.
    fn add(&mut self, image: &[f64], highest: f64, tolerance: Tolerance) {
        let ([iterate, moved], replicates) = split(image, REPLICATES);
        let correction = over_replicates(replicates);
        let error = correction.std_error;
        let bound = tolerance.error_at(iterate + correction.mean);
        self.bound = self.bound.max(bound);
        self.highest = self.highest.max(highest);
        // Where all replicates say the same there is nothing to divide, whatever the bound.
        if error != 0.0 {
            self.error = self.error.max(error / bound);
        }
        let seen = (UNSEEN * bound).max(SMALL * error);
        let has_moved = moved > MOVED * bound.max(error);
        self.is_biased |= highest > seen || has_moved;
        self.is_nearly_biased |= highest > 0.5 * seen || has_moved;
    }
}
