//! Doubts: how far few walks may be from the true variance, and where it is infinite.

use super::super::pilot::Doubt;
use super::super::setting::Setting;
use super::Search;
use crate::{Error, Pairs};

/// The spectral radius of T_k²p from which on the variance is almost infinite, which few walks do not show.
const SAFE_RADIUS: f64 = 0.85;
/// The least q0 that is tried if its variance is far from infinite.
const USUAL: f64 = 0.1;
/// How many values of q0 are tried if none of the usual ones has a variance far from infinite: from the shortest walks
/// of a finite variance to those of a fifth of that q0 or less.
const BRIGHT: usize = 3;
/// The rounding of values of q0 to those that are tried.
const NEARLY: f64 = 1.1;
/// How rare large scores are with bounded kernels.
const BOUNDED: f64 = 3.0;
/// How rare large scores are with singular kernels.
const SINGULAR: f64 = 14.0;
/// The spectral radius of T_k²p if it is not known.
const ASSUMED_RADIUS: f64 = 0.55;
/// The least distance of the spectral radius from 1.
const LEAST_GAP: f64 = 0.01;
/// The part of the rare variance that is counted if the variance of η is almost infinite: weights are rare then as
/// well. With 100 cells of degree 3 and with 200 of degree 4 of a square room 2²² walks show 14 % and 3 % of it, 2¹⁸
/// walks 4 % and ½ %.
const OBSERVED_RARE: f64 = 0.125;

impl Search<'_> {
    /// Drops values of q0 with an infinite variance of plain walks, before anything expensive is set up. The search then
    /// starts from a value whose variance is far from infinite, and otherwise from the smallest one.
    ///
    /// # Errors
    /// [`Error::InfiniteVariance`]: none is left.
    pub(super) fn drop_infinite_variances(&mut self) -> Result<(), Error> {
        if self.settings.allow_infinite_variance {
            return Ok(());
        }
        let base = self.plain_base();
        let cells = self.model.partition(&self.with_valid_cells(&base))?;
        let radius = cells.plain_radius(base.absorption)?;
        // k² p is K²/p, and p has the factor 1 − q0.
        let without = radius * (1.0 - base.absorption);
        self.second_moment = Some(without);
        let least = self.absorptions.last().copied();
        self.absorptions
            .retain(|&absorption| without / (1.0 - absorption) < 1.0);
        if self.absorptions.is_empty() {
            let absorption = least.unwrap_or(base.absorption);
            cells.check_variance(Pairs::Default, absorption)?;
        }
        let first = |of: &dyn Fn(f64) -> bool| {
            let mut all = self.absorptions.iter().copied();
            all.find(|&absorption| of(absorption))
        };
        // If K is a constant r, then without = r², and with q0 = 1 − r walks keep their weight.
        let keeps_weight = 1.0 - without.sqrt();
        let least = self.absorptions.last().copied();
        let safe = first(&|absorption| self.has_safe_variance(absorption));
        self.shortest = safe
            .or_else(|| first(&|absorption| absorption <= NEARLY * keeps_weight))
            .or(least);
        if safe.is_some_and(|absorption| absorption >= USUAL) {
            self.absorptions.retain(|&absorption| absorption >= USUAL);
        } else {
            self.absorptions.truncate(BRIGHT);
        }
        Ok(())
    }

    /// Whether the variance is far from infinite.
    pub(super) fn has_safe_variance(&self, absorption: f64) -> bool {
        self.radius(absorption) < SAFE_RADIUS
    }

    /// The spectral radius of T_k²p, or its assumed value.
    fn radius(&self, absorption: f64) -> f64 {
        let radius = self.second_moment.map(|radius| radius / (1.0 - absorption));
        radius.unwrap_or(ASSUMED_RADIUS)
    }

    /// Whether large scores may be so rare that the first pilots miss all of them.
    pub(super) const fn has_rare_scores(&self, setting: &Setting) -> bool {
        // Steps next to corners are the smallest part of plain walks.
        self.is_singular() || self.about.has_rare_scores && !setting.plain
    }

    /// Whether the kernel may have a singularity that no walk has shown: a kernel whose integral is given may.
    const fn is_singular(&self) -> bool {
        self.about.is_singular
    }

    /// How far few walks may be from the true variance: the farther, the nearer it is to infinite.
    pub(super) fn doubt(&self, absorption: f64) -> Doubt {
        let most = if self.is_singular() {
            SINGULAR
        } else {
            BOUNDED
        };
        let left = (1.0 - self.radius(absorption)).max(LEAST_GAP);
        let more = most / left.powf(1.25);
        // If the variance is almost infinite, all few walks show too little.
        let is_safe = self.has_safe_variance(absorption);
        let less = if is_safe { more } else { 0.0 };
        let observed_rare = if is_safe { 1.0 } else { OBSERVED_RARE };
        Doubt {
            more,
            less,
            observed_rare,
        }
    }
}
