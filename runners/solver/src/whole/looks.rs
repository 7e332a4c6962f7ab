//! The quantities whose error bars are looked at while walks of a whole function go on.

use fredholm_core::whole::over_replicates;
use fredholm_model::{IMAGE_HEAD, WholeField, WholeQuantity};

use super::{PROBES, REPLICATES, split};
use crate::{Error, Goal, Model, Region, Tolerance};

/// The part of a tolerance that no error bar sees, at most: what scores of one degree less would move, which is many times what
/// is lost.
const UNSEEN: f64 = 0.5;
/// The part of a standard error that is noise of that, before walks tell more.
const NOISE: f64 = 0.25;
/// The part of a tolerance by which quadrature in x may be off.
const MOVED: f64 = 0.1;

/// Quantities of regions.
#[derive(Debug)]
pub(crate) struct Looks(Vec<(WholeQuantity, Vec<Region>)>);

/// What error bars are, in units of the tolerance.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Look {
    /// The largest of them.
    pub(crate) error: f64,
    /// Whether there is a bias beside them.
    pub(crate) is_biased: bool,
}

impl Looks {
    /// u at some points, spread over the space.
    pub(super) fn of_points(model: &dyn Model) -> Self {
        Self(vec![(WholeQuantity::U, model.spread(PROBES))])
    }

    /// All that a report of these goals tells.
    pub(crate) fn of_goals(model: &dyn Model, goals: &[Goal]) -> Self {
        let regions = |of: &dyn Fn(&Region) -> bool| -> Vec<Region> {
            let all = goals.iter().map(|goal| &goal.region);
            all.filter(|region| of(region)).cloned().collect()
        };
        let lit = regions(&|region| model.has_own_irradiance(region));
        let fluxes = model.flux_parts().into_iter();
        let fluxes = fluxes.filter(|(_, is_given)| !is_given);
        let fluxes = fluxes.map(|(part, _)| Region::Part(part)).collect();
        let all = [
            (WholeQuantity::U, regions(&|_| true)),
            (WholeQuantity::Irradiance, lit),
            (WholeQuantity::NetFlux, fluxes),
        ];
        let all = all.into_iter().filter(|(_, regions)| !regions.is_empty());
        Self(all.collect())
    }

    /// The number of regions that are points of the space, and that of all others.
    pub(crate) fn counts(&self, model: &dyn Model) -> [usize; 2] {
        let all = || self.0.iter().flat_map(|(_, regions)| regions);
        let points = all().filter(|region| model.is_in_space(region)).count();
        [points, all().count() - points]
    }

    /// What a field says of them.
    pub(crate) fn look(&self, field: &dyn WholeField, tolerance: Tolerance) -> Result<Look, Error> {
        let width = IMAGE_HEAD + field.rows();
        let mut all = Look::default();
        for (quantity, regions) in &self.0 {
            let images = field.images(*quantity, regions)?;
            for image in images.chunks_exact(width) {
                all.add(image, tolerance);
            }
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
        // Where all replicates say the same there is nothing to divide, whatever the bound.
        if error != 0.0 {
            self.error = self.error.max(error / bound);
        }
        let highest = image.get(IMAGE_HEAD + REPLICATES).copied();
        let highest = highest.unwrap_or(0.0).abs();
        self.is_biased |=
            highest > (UNSEEN * bound).max(NOISE * error) || moved > MOVED * bound.max(error);
    }
}
