//! What a system gives to predict variances of.

use fredholm_rayon::fill_rows;
use fredholm_variance::{MeanCoefficients, Pass, VarianceModel};

use crate::Goal;

/// A prediction of variances, with what is asked of it.
pub struct Examined<'a> {
    /// The equation, its neighbour and the sites, by numbers.
    pub model: &'a dyn VarianceModel,
    /// K' of piecewise constants, for the quantities of section 4.
    pub coefficients: Option<MeanCoefficients<'a>>,
    /// The goals, in the order of the model's starts.
    pub goals: &'a [Goal],
    /// (F_s, Φ) of each goal: what is known besides what walks estimate. Empty: nothing is.
    pub known: &'a [f64],
    /// The name of the place of a site: contributions are summed over the sites of a place.
    pub place: &'a dyn Fn(usize) -> String,
    /// The wall of every site, where on it in fractions of it, and its length: for a picture.
    pub pieces: Option<&'a [(usize, [f64; 2], f64)]>,
}

impl core::fmt::Debug for Examined<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Examined")
            .field("sites", &self.model.sites())
            .field("goals", &self.goals)
            .finish_non_exhaustive()
    }
}

/// Does something to all of them on the threads of the pool.
pub fn in_parallel<T: Send>(all: &mut [T], pass: &Pass<'_, T>) {
    let each = |i: usize, one: &mut [T]| {
        one.iter_mut().for_each(|one| pass(i, one));
        Ok::<(), core::convert::Infallible>(())
    };
    match fill_rows(all, 1, each) {
        Ok(()) => {}
        Err(never) => match never {},
    }
}
