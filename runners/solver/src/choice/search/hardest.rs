//! The targets that take most walks, before any pilot.

use fredholm_core::{Statistics, Tolerance};

use super::super::aim::Aim;
use super::super::pilot::SURE;
use super::{FIRST, Search};
use fredholm_model::{Target, goals};

/// The fewest walks of a target that tell whether it is one of the hardest.
const LEAST: u64 = 16;

impl Search<'_> {
    /// The numbers of all targets, beginning with the one that takes most walks as far as few plain walks of each tell. Nothing, if pilots have
    /// all targets, or if the error that is asked for does not depend on u: there few targets do not take most of the walks.
    pub(super) fn hardest(&mut self, targets: &[Target]) -> Vec<usize> {
        let Aim::Error(tolerance) = self.aim else {
            return Vec::new();
        };
        let all = goals(self.model, targets).unwrap_or_default();
        let few = self.sample.goals.len();
        let channels = self.model.channels().len().max(1);
        let is_absolute = matches!(tolerance, Tolerance::Absolute(_));
        if is_absolute || all.len() == few || all.len() != targets.len() * channels {
            return Vec::new();
        }
        let each = (FIRST * few as u64 / all.len() as u64).max(LEAST);
        let Some(family) = self.families.iter().find(|family| family.first.plain) else {
            return Vec::new();
        };
        let Some(level) = family.levels.first() else {
            return Vec::new();
        };
        let plain = family.unknown(level, &vec![1.0; all.len()]);
        self.work += each as f64 * plain.targets * plain.seconds_per_walk;
        let few = core::mem::replace(&mut self.sample.goals, all);
        let mut settings = plain.setting.applied(self.settings);
        settings.sequence = None;
        let walked = self.walked((&plain.setting, None), settings, each);
        self.sample.goals = few;
        let Ok((answer, _)) = walked else {
            return Vec::new();
        };
        // By the largest |u| that these walks leave possible: noise makes no target hard.
        let needed = |of: &Statistics| {
            let found = of.preconditioned();
            let size = found.estimate.abs() + SURE * found.std_error.unwrap_or(f64::INFINITY);
            (found.std_dev.unwrap_or(0.0) / tolerance.error_at(size)).powi(2)
        };
        let needed = |number: usize| {
            let own = answer.outcome.statistics.chunks_exact(channels).nth(number);
            own.map_or(0.0, |own| own.iter().map(needed).fold(0.0, f64::max))
        };
        let mut numbers: Vec<(f64, usize)> = (0..targets.len()).map(|i| (needed(i), i)).collect();
        numbers.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        numbers.into_iter().map(|(_, number)| number).collect()
    }
}
