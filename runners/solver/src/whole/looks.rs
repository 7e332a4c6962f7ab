//! The regions at which error bars are looked at while walks of a global estimate go on.

use fredholm_core::global::over_replicates;
use fredholm_model::{GlobalField, GlobalQuantity, IMAGE_HEAD};

use super::{PROBES, REPLICATES, split};
use crate::{Error, Goal, Model, Region, Tolerance};

/// The part of a tolerance that no error bar sees, at most: what scores of one degree less would move, which is many times what
/// is lost.
const UNSEEN: f64 = 0.5;
/// The part of a standard error that is noise of that, before walks tell more.
const NOISE: f64 = 0.25;
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
        for image in images.chunks_exact(width) {
            all.add(image, tolerance);
        }
        Ok(all)
    }
}

impl Look {
    /// Looks at an image: F + T_K v and how far it moved, replicates, and the part of the highest degree, if it has that.
    fn add(&mut self, image: &[f64], tolerance: Tolerance) {
        let ([iterate, moved], replicates) = split(image, REPLICATES);
        let correction = over_replicates(replicates);
        let error = correction.std_error;
        let bound = match tolerance {
            Tolerance::Absolute(bound) => bound,
            Tolerance::Relative(bound) => bound * (iterate + correction.mean).abs(),
        };
        self.bound = self.bound.max(bound);
        // Where all replicates say the same there is nothing to divide, whatever the bound.
        if error != 0.0 {
            self.error = self.error.max(error / bound);
        }
        let highest = image.get(IMAGE_HEAD + REPLICATES).copied();
        let highest = highest.unwrap_or(0.0).abs();
        let seen = (UNSEEN * bound).max(NOISE * error);
        let has_moved = moved > MOVED * bound.max(error);
        self.is_biased |= highest > seen || has_moved;
        self.is_nearly_biased |= highest > 0.5 * seen || has_moved;
    }
}
