//! Offers of chains.

use fredholm_core::whole::Stationary;

use super::Offers;
use crate::check;
use crate::description::{Description, PointOf, ScalarOf};

impl<D: Description<B>, const B: usize> Offers<'_, D, B> {
    /// Offers a chain as one that preserves a density: most often the equation itself.
    pub fn stationary<C>(&mut self, chain: &C)
    where
        C: Stationary<Scalar = ScalarOf<D, B>, Point = PointOf<D, B>>,
    {
        let preserved = check::preserved(self.description, chain, self.seed);
        self.push("preserved density", "chain", preserved);
        let states = check::states(self.description, chain, self.seed);
        self.push("suffix starts", "chain", states);
    }
}
