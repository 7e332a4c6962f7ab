//! What a check found: the worst of its comparisons.

use core::fmt;

/// The worst comparison of a check: what was expected, what came, and how far apart they are in the
/// unit that belongs to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// What was compared, and where.
    pub what: String,
    /// The value that theory gives.
    pub expected: f64,
    /// The value that came.
    pub found: f64,
    /// Their distance in units of `unit`.
    pub distance: f64,
    /// The largest distance that passes.
    pub allowed: f64,
    /// "rounding units", "standard errors", …
    pub unit: &'static str,
    /// How many comparisons it is the worst of.
    pub comparisons: u64,
}

impl Outcome {
    /// A failure that leaves nothing to compare.
    #[must_use]
    pub fn refused(what: String) -> Self {
        let mut worst = Worst::new("of anything", 0.0);
        worst.add(f64::NAN, f64::NAN, f64::NAN, || what);
        worst.outcome()
    }

    /// Whether the worst comparison is within what is allowed; NaN is not.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.distance <= self.allowed
    }

    /// The outcome as a result.
    ///
    /// # Errors
    /// The outcome itself, where it has not passed.
    pub fn ok(self) -> Result<Self, Self> {
        if self.passed() { Ok(self) } else { Err(self) }
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            what,
            expected,
            found,
            unit,
            allowed,
            ..
        } = self;
        if expected.is_nan() && found.is_nan() {
            return write!(f, "{what}");
        }
        write!(f, "{what}: expected {expected:e}, found {found:e}, ")?;
        if self.distance < 1e4 {
            write!(f, "{:.1}", self.distance)?;
        } else {
            write!(f, "{:.1e}", self.distance)?;
        }
        write!(f, " {unit} apart where {allowed} are allowed")
    }
}

impl core::error::Error for Outcome {}

/// Collects comparisons of one kind and keeps the worst.
#[derive(Clone, Debug)]
pub struct Worst {
    outcome: Outcome,
}

impl Worst {
    /// Comparisons in this unit, of which so many may lie between the two numbers.
    #[must_use]
    pub fn new(unit: &'static str, allowed: f64) -> Self {
        Self {
            outcome: Outcome {
                what: "nothing was compared".into(),
                expected: f64::NAN,
                found: f64::NAN,
                distance: f64::NAN,
                allowed,
                unit,
                comparisons: 0,
            },
        }
    }

    /// Compares two numbers; `size` is the size of one unit. A distance that is not a number is
    /// worse than any other.
    pub fn compare(&mut self, expected: f64, found: f64, size: f64, what: impl FnOnce() -> String) {
        let difference = (found - expected).abs();
        // 0/0 where both are exactly as they should be.
        let distance = if difference == 0.0 {
            0.0
        } else {
            difference / size
        };
        self.add(expected, found, distance, what);
    }

    /// Adds a comparison whose distance is known.
    pub fn add(&mut self, expected: f64, found: f64, distance: f64, what: impl FnOnce() -> String) {
        // Every check compares with words of its own: what they share is compiled once.
        if self.count(distance) {
            self.keep([expected, found, distance], what());
        }
    }

    /// Counts a comparison. Whether it is the worst so far.
    fn count(&mut self, distance: f64) -> bool {
        let first = self.outcome.comparisons == 0;
        self.outcome.comparisons += 1;
        let worse = distance > self.outcome.distance
            || (distance.is_nan() && !self.outcome.distance.is_nan());
        first || worse
    }

    fn keep(&mut self, [expected, found, distance]: [f64; 3], what: String) {
        self.outcome = Outcome {
            what,
            expected,
            found,
            distance,
            ..self.outcome
        };
    }

    /// The worst; a failure where nothing was compared.
    #[must_use]
    pub fn outcome(self) -> Outcome {
        self.outcome
    }
}

/// Σ x, compensated (Neumaier 1974): its error is that of its terms, however many there are.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sum {
    sum: f64,
    low: f64,
    size: f64,
}

impl Sum {
    /// Adds `x`.
    pub fn add(&mut self, x: f64) {
        let total = self.sum + x;
        self.low += if self.sum.abs() >= x.abs() {
            (self.sum - total) + x
        } else {
            (x - total) + self.sum
        };
        self.sum = total;
        self.size += x.abs();
    }

    /// Σ x.
    #[must_use]
    pub fn value(&self) -> f64 {
        self.sum + self.low
    }

    /// Σ |x|.
    #[must_use]
    pub fn size(&self) -> f64 {
        self.size
    }
}

impl FromIterator<f64> for Sum {
    fn from_iter<T: IntoIterator<Item = f64>>(terms: T) -> Self {
        let mut sum = Self::default();
        terms.into_iter().for_each(|x| sum.add(x));
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::{Sum, Worst};

    #[test]
    fn a_sum_keeps_what_cancels() {
        let sum: Sum = [1.0, 1e100, 1.0, -1e100].into_iter().collect();
        assert_eq!(sum.value(), 2.0);
        assert_eq!(sum.size(), 2e100);
    }

    #[test]
    fn a_check_that_compares_nothing_or_nan_fails() {
        assert!(!Worst::new("units", 1.0).outcome().passed());
        let mut worst = Worst::new("units", 1.0);
        worst.compare(1.0, 1.0, 0.0, || "equal".into());
        assert!(worst.clone().outcome().passed());
        worst.compare(1.0, f64::NAN, 1.0, || "NaN".into());
        worst.compare(1.0, 2.0, 0.1, || "far".into());
        let outcome = worst.outcome();
        assert!(!outcome.passed());
        assert_eq!((outcome.what.as_str(), outcome.comparisons), ("NaN", 3));
    }
}
