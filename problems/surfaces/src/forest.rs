//! Things that are united to sets.

use alloc::vec::Vec;

/// Disjoint sets of numbers. The root of a set is its smallest number.
///
/// ```
/// let mut sets = fredholm_surfaces::Forest::new(4);
/// sets.unite(3, 1);
/// assert_eq!([0, 1, 2, 3].map(|v| sets.root(v)), [0, 1, 2, 1]);
/// ```
#[derive(Clone, Debug)]
pub struct Forest {
    /// A number of the same set that is not larger.
    parent: Vec<u32>,
}

impl Forest {
    /// Every number below `count` in a set of its own.
    #[must_use]
    pub fn new(count: usize) -> Self {
        Self {
            parent: (0..count as u32).collect(),
        }
    }

    /// The smallest number of a set.
    #[must_use]
    pub fn root(&mut self, mut v: u32) -> u32 {
        while let Some(&up) = self.parent.get(v as usize) {
            if up == v {
                break;
            }
            let over = self.parent.get(up as usize).copied().unwrap_or(up);
            if let Some(place) = self.parent.get_mut(v as usize) {
                *place = over;
            }
            v = over;
        }
        v
    }

    /// Makes two sets one.
    pub fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        if let Some(place) = self.parent.get_mut(a.max(b) as usize) {
            *place = a.min(b);
        }
    }
}
