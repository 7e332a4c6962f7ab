//! The choice between walks from the targets and the way back.
//!
//! Both have pilots, which end where they take more than the other way is predicted to. The faster one is walked; if its walks
//! show that they take longer than predicted, and more than twice as long as the other way from the beginning, the other
//! way takes over.

use super::search::Search;
use super::{Chosen, Found, begin, chosen_for, solve_either};
use crate::answer::SolveObserver;
use crate::execute::Execute;
use crate::{Goal, Model, Settings, SolveError};
use fredholm_model::Target;

/// How often walks turn round at most. Walks of both ways have corrected their pilots by then.
const MOST_TURNS: usize = 2;

/// Solves as [`solve_either`] does, by the first of two models with the same answer, or by the second where that is faster; whether it
/// is the second.
///
/// # Errors
/// As [`solve_either`].
pub(crate) fn solve_by_faster<'m>(
    models: [&'m dyn Model; 2],
    targets: &[Target],
    goals: &[Goal],
    settings: &'m Settings,
    (watch, execute): (&'m dyn SolveObserver, &dyn Execute),
    may_be_joint: bool,
) -> Result<(bool, Option<(Chosen<'m>, Found<'m>)>), SolveError> {
    let solve = |is_second: bool, begun: Option<Search<'m>>| {
        let model = models[usize::from(is_second)];
        let begun = (begun, may_be_joint);
        solve_either(model, targets, goals, settings, (watch, execute), begun)
    };
    let walks = chosen_for(settings, execute);
    let [first, second] = models.map(|model| begin(model, targets, settings, (walks, watch)));
    let Some(mut now) = first? else {
        return Ok((false, solve(false, None)?));
    };
    let Ok(Some(mut other)) = second else {
        return Ok((false, solve(false, Some(now))?));
    };
    let mut is_second = is_faster(&mut other, &mut now);
    if is_second {
        core::mem::swap(&mut now, &mut other);
    }
    let mut turns = 0;
    loop {
        let mut rival = other.as_other_way();
        if turns == MOST_TURNS {
            rival.price = f64::INFINITY;
        }
        now.compete_with(rival);
        match solve(is_second, Some(now))? {
            Some((_, Found::OtherWay(search))) => {
                (now, other) = (other, *search);
                is_second = !is_second;
                turns += 1;
            }
            found => return Ok((is_second, found)),
        }
    }
}

/// Makes pilots of both ways, and tells whether the one takes less than the other.
fn is_faster(one: &mut Search<'_>, other: &mut Search<'_>) -> bool {
    let _ = other.begin();
    one.compete_with(other.as_other_way());
    one.run();
    other.compete_with(one.as_other_way());
    other.run();
    one.as_other_way().price < other.as_other_way().price
}
