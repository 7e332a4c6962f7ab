//! Which batches of a run a part has.

use core::fmt;
use core::ops::Range;
use core::str::FromStr;

use fredholm_core::RunOptions;
use serde::{Deserialize, Serialize};

/// The most parts of a run.
const MOST: u64 = 1_000_000;

/// The share k/n of the batches of a run: consecutive ones, as many as the others have or one more.
///
/// ```
/// use fredholm_core::RunOptions;
/// use fredholm_file::parts::Share;
///
/// let share: Share = "2/3".parse()?;
/// let mut options = RunOptions::new(100_000);
/// options.batch = 10_000;
/// assert_eq!(share.batches(&options), 3..6);
/// // Walks before the 40,000th are in other parts.
/// let rest = Share { after: 40_000, ..share };
/// assert_eq!(rest.batches(&options), 6..8);
/// assert!("4/3".parse::<Share>().is_err());
/// # Ok::<(), fredholm_file::parts::ShareError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Share {
    /// n, the number of parts.
    pub of: u64,
    /// Walks of each goal that other parts have: the batches behind these are shared out.
    pub after: u64,
    /// k, the number of the part, from 1.
    pub part: u64,
}

/// Why a text is no share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShareError;

impl fmt::Display for ShareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a part is k/n, its number and how many there are: 1/64, 2/64, … 64/64; at most a million")
    }
}

impl core::error::Error for ShareError {}

impl FromStr for Share {
    type Err = ShareError;

    fn from_str(text: &str) -> Result<Self, ShareError> {
        let (part, of) = text.split_once('/').ok_or(ShareError)?;
        let number = |text: &str| text.trim().parse::<u64>().map_err(|_| ShareError);
        let (part, of) = (number(part)?, number(of)?);
        let is_there = (1..=of).contains(&part) && of <= MOST;
        let after = 0;
        is_there
            .then_some(Self { of, after, part })
            .ok_or(ShareError)
    }
}

impl fmt::Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.part, self.of)
    }
}

impl Share {
    /// The batches of a run that are this share, of every goal.
    #[must_use]
    pub fn batches(&self, options: &RunOptions) -> Range<u64> {
        let all = options.batches();
        let first = (self.after / options.batch.max(1)).min(all);
        let before = |part: u64| {
            let share = u128::from(all - first) * u128::from(part) / u128::from(self.of.max(1));
            // At most `all`.
            first + (share as u64).min(all - first)
        };
        before(self.part.saturating_sub(1))..before(self.part)
    }
}
