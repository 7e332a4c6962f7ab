//! From numbers to colours.

use colorous::INFERNO;

/// A scale from numbers to colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    low: f64,
    high: f64,
    log: bool,
    /// Whether colours are greys, as bright as the numbers are large.
    grey: bool,
}

/// The decades of a logarithmic scale at most.
const DECADES: i32 = 4;

impl Scale {
    /// A scale from 0 to the largest of the `seen` numbers: a lamp on the `walls` may be brighter, and
    /// would leave the rest in the dark. A logarithmic scale begins at the smallest of all numbers but
    /// for a thousandth of them, which may be dots of noise. NaN does not count.
    pub fn new(
        seen: impl Iterator<Item = f64> + Clone,
        walls: impl Iterator<Item = f64>,
        log: bool,
    ) -> Self {
        let largest = seen.clone().fold(0.0, f64::max);
        let high = if largest > 0.0 { largest } else { 1.0 };
        let mut low = 0.0;
        if log {
            let lowest = |all: Vec<f64>| all.get(all.len() / 1000).copied().unwrap_or(high);
            let of_seen = lowest(sorted(seen.filter(|&value| value > 0.0)));
            let of_walls = lowest(sorted(walls.filter(|&value| value > 0.0)));
            let least = high * 10_f64.powi(-DECADES);
            low = of_seen.min(of_walls).max(least).min(0.5 * high);
        }
        let grey = false;
        Self {
            low,
            high,
            log,
            grey,
        }
    }

    /// A scale from the least to the largest of the `seen` numbers but for a fiftieth of them at either end: dots of
    /// noise, and what is right beside a lamp. NaN does not count. `None` if the ends differ by less than `noise`, or
    /// by a thousandth of the largest: there is one colour to show, and no picture of rounding.
    #[must_use]
    pub fn within(seen: impl Iterator<Item = f64>, noise: f64) -> Option<Self> {
        let all = sorted(seen);
        let end = |fiftieths: usize| all.get(all.len() * fiftieths / 50).copied();
        let (low, high) = (end(1)?, end(49)?);
        let is_even = high - low < noise || high - low < 1e-3 * high.abs();
        Self::between(low, high, false).filter(|_| !is_even)
    }

    /// The scale of a picture of these numbers: greys of light, colours of heat and of logarithms, between the ends of a `range` if
    /// there is one. White is what all but a fiftieth of the picture is darker than: of a lamp all that one sees is that it is
    /// bright. NaN does not count.
    #[must_use]
    pub fn of_view(seen: &[f64], range: Option<[f64; 2]>, is_heat: bool, log: bool) -> Self {
        let seen = || seen.iter().copied();
        let scale = match range {
            Some([low, high]) => Self::between(low, high, log),
            // A room's temperatures are near each other, far from 0.
            None if is_heat && !log => Self::within(seen(), 0.0),
            None => {
                let all = sorted(seen());
                let most = all.get(all.len() * 49 / 50).copied().unwrap_or(1.0);
                let darker = || seen().map(move |x| x.min(most));
                Some(Self::new(darker(), darker(), log))
            }
        };
        let scale = scale.unwrap_or_else(|| Self::new(seen(), [].into_iter(), log));
        if is_heat || log {
            scale
        } else {
            scale.in_greys()
        }
    }

    /// A scale from one number to another, which must be finite and more, and for a logarithmic one both above 0.
    #[must_use]
    pub fn between(low: f64, high: f64, log: bool) -> Option<Self> {
        let good = low < high && (high - low).is_finite() && (!log || low > 0.0);
        good.then_some(Self {
            low,
            high,
            log,
            grey: false,
        })
    }

    /// A scale in greys, as a photograph has them: what sends out twice the light shines twice as bright.
    #[must_use]
    pub const fn in_greys(self) -> Self {
        Self { grey: true, ..self }
    }

    /// The smallest number that has a colour of its own.
    pub const fn low(&self) -> f64 {
        self.low
    }

    /// The largest number that has a colour of its own.
    pub const fn high(&self) -> f64 {
        self.high
    }

    /// Where a number is between the two ends: 0 to 1, those beyond at the ends.
    pub(crate) fn part(&self, value: f64) -> f64 {
        let part = if self.log {
            (value.max(self.low) / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        part.clamp(0.0, 1.0)
    }

    /// The number at this part.
    pub(crate) fn at(&self, part: f64) -> f64 {
        if self.log {
            self.low * (self.high / self.low).powf(part)
        } else {
            self.low + part * (self.high - self.low)
        }
    }

    /// The colour of a number: perceptually uniform, and the table's 256 joined by lines; or its grey.
    pub(crate) fn colour(&self, value: f64) -> [u8; 3] {
        const LAST: usize = 255;
        if self.grey {
            return [self.grey_level(value); 3];
        }
        let place = self.part(value) * LAST as f64;
        let below = place.floor().min(LAST as f64 - 1.0);
        let [from, to] = [0, 1].map(|next| {
            let colour = INFERNO.eval_rational(below as usize + next, LAST + 1);
            [colour.r, colour.g, colour.b].map(f64::from)
        });
        [0, 1, 2].map(|k| (from[k] + (place - below) * (to[k] - from[k])).round() as u8)
    }

    /// How bright a number shines: the level of its grey, as sRGB encodes it.
    pub(crate) fn grey_level(&self, value: f64) -> u8 {
        (255.0 * encoded(self.part(value))).round() as u8
    }

    /// Whether it is logarithmic.
    pub(crate) const fn is_log(&self) -> bool {
        self.log
    }

    /// Round numbers along the scale.
    pub(crate) fn ticks(&self) -> Vec<f64> {
        ticks(self.low, self.high, self.log)
    }
}

/// The numbers from the least on, but for NaN.
pub(crate) fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
    all.sort_unstable_by(f64::total_cmp);
    all
}

/// The temperature of a black body with this radiosity, by Stefan and Boltzmann's constant σ.
pub(crate) fn kelvin(radiosity: f64, sigma: f64) -> f64 {
    (radiosity.max(0.0) / sigma).powf(0.25)
}

/// The number that makes a screen this bright, from 0 to 1 (IEC 61966-2-1, sRGB).
fn encoded(brightness: f64) -> f64 {
    if brightness <= 0.003_130_8 {
        12.92 * brightness
    } else {
        1.055 * brightness.powf(1.0 / 2.4) - 0.055
    }
}

/// Round numbers between two: multiples of 1, 2 or 5 powers of ten; on a logarithmic scale of more
/// than a decade 1, 2 and 5 times the powers.
pub(crate) fn ticks(low: f64, high: f64, log: bool) -> Vec<f64> {
    if log && high > 10.0 * low {
        let first = low.log10().floor() as i32;
        let last = high.log10().ceil() as i32;
        let all = (first..=last).flat_map(|k| [1.0, 2.0, 5.0].map(|m| round(m, k)));
        return all.filter(|&x| low <= x && x <= high).collect();
    }
    // A drawing may be flat.
    if !(high > low) {
        return vec![low];
    }
    let rough = (high - low) / 6.0;
    let power = rough.log10().floor() as i32;
    let steps = [1.0, 2.0, 5.0, 10.0].map(|m| round(m, power));
    let Some(step) = steps.into_iter().find(|&step| step >= rough) else {
        return Vec::new();
    };
    // Rounding may not lose a tick at an end: 0.6/0.05 is a little below 12.
    let off = 1e-9;
    let first = (low / step * (1.0 - off)).ceil() as i64;
    let last = (high / step * (1.0 + off)).floor() as i64;
    // Divided where the step is below 1, so that 0.3 is no 0.30000000000000004.
    let at = |k: i64| {
        if step < 1.0 {
            k as f64 / (1.0 / step).round()
        } else {
            k as f64 * step
        }
    };
    (first..=last.min(first + 20)).map(at).collect()
}

/// m·10^k.
fn round(m: f64, k: i32) -> f64 {
    if k < 0 {
        m / 10_f64.powi(-k)
    } else {
        m * 10_f64.powi(k)
    }
}

#[cfg(test)]
mod tests {
    use super::{Scale, ticks};

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks(0.0, 0.55, false), [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]);
        assert_eq!(ticks(0.0, 1.0, false), [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]);
        assert_eq!(
            ticks(0.0, 230_000.0, false),
            [0.0, 50_000.0, 100_000.0, 150_000.0, 200_000.0]
        );
        assert_eq!(ticks(2.0, 2.0, false), [2.0]);
        assert_eq!(ticks(0.03, 0.6, true), [0.05, 0.1, 0.2, 0.5]);
        assert_eq!(
            ticks(0.3, 0.6, true),
            [0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6]
        );
    }

    #[test]
    fn a_scale_is_of_what_is_seen_but_for_specks() {
        // 280 to 299.4, a dot of noise, a pixel beside a lamp, and one behind a wall.
        let mut seen: Vec<f64> = (0..98).map(|k| 280.0 + 0.2 * f64::from(k)).collect();
        seen.extend([-40.0, 5000.0, f64::NAN]);
        let scale = Scale::within(seen.iter().copied(), 1.0).unwrap();
        assert_eq!((scale.low(), scale.high()), (280.2, 280.0 + 0.2 * 97.0));
        // Less than noise tells apart, less than colours tell apart, nothing, and darkness.
        assert_eq!(Scale::within(seen.iter().copied(), 20.0), None);
        assert_eq!(Scale::within([1.0, 1.0005].into_iter(), 0.0), None);
        assert_eq!(Scale::within([f64::NAN].into_iter(), 0.0), None);
        assert_eq!(Scale::within([0.0, 0.0].into_iter(), 0.0), None);
    }

    #[test]
    fn colours_begin_and_end_with_the_scale_and_do_not_jump() {
        let values = [0.1, f64::NAN, 0.8];
        let none = core::iter::empty;
        let scale = Scale::new(values.into_iter(), none(), false);
        assert_eq!(scale.colour(0.0), [0, 0, 4]);
        assert_eq!(scale.colour(0.8), scale.colour(7.0));
        assert_ne!(scale.colour(0.8), scale.colour(0.79));
        let log = Scale::new(values.into_iter(), none(), true);
        assert_eq!(log.colour(0.1), [0, 0, 4]);
        for scale in [scale, log] {
            let mut last = scale.colour(scale.at(0.0));
            for i in 1..=2000 {
                let next = scale.colour(scale.at(f64::from(i) / 2000.0));
                assert!((0..3).all(|k| next[k].abs_diff(last[k]) <= 1), "{i}");
                last = next;
            }
        }
        // Nothing but darkness has a scale too.
        let dark = Scale::new([0.0].into_iter(), none(), true);
        assert_eq!(dark.colour(0.0), [0, 0, 4]);
    }

    /// A fifth of white is a mid grey on a screen.
    #[test]
    fn greys_are_as_bright_as_numbers_are_large() {
        let scale = Scale::between(0.0, 10.0, false).unwrap().in_greys();
        let levels = [0.0, 2.0, 10.0, 20.0].map(|x| scale.colour(x)[0]);
        assert_eq!(levels, [0, 124, 255, 255]);
    }
}
