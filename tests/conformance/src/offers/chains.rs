//! Offers of chains.

use fredholm_core::whole::Starts;

use super::Offers;
use crate::check;
use crate::description::Description;

impl<D: Description<B>, const B: usize> Offers<'_, D, B> {
    /// Offers starts of a known density, and the chain as one that preserves it if they say so: most often the equation
    /// itself.
    pub fn starts<C>(&mut self, chain: &C)
    where
        C: Starts<D::Equation>,
    {
        let preserved = check::preserved(self.description, chain, self.seed);
        self.push("preserved density", "chain", preserved);
        let states = check::states(self.description, chain, self.seed);
        self.push("suffix starts", "chain", states);
    }
}
