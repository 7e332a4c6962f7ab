//! Lines of equal temperature between the walls of a room.

use kuva::render::render::{PathData, TextAnchor};

use crate::page::{INK, Page, Place, WHITE, width_of};
use crate::scale::{kelvin, ticks};

/// The most pixels of a line's piece that is left out: noise has islands of that size.
const ISLAND: usize = 24;

/// Isotherms of radiosities in pixels, row by row, NaN where there is no room.
pub(crate) struct Isotherms<'a> {
    pub(crate) values: &'a [f64],
    pub(crate) width: usize,
    /// σ: a black body at T emits σT⁴.
    pub(crate) stefan_boltzmann: f64,
    /// The size of the labels.
    pub(crate) size: f64,
    /// The place of the first pixel on the page.
    pub(crate) at: Place,
}

impl Isotherms<'_> {
    /// Draws a line with its label for every round temperature that there is.
    pub(crate) fn draw(&self, page: &mut Page) {
        let smooth = smoothed(self.values, self.width);
        let known = || smooth.iter().copied().filter(|value| !value.is_nan());
        let low = kelvin(known().fold(f64::INFINITY, f64::min), self.stefan_boltzmann);
        let high = kelvin(
            known().fold(f64::NEG_INFINITY, f64::max),
            self.stefan_boltzmann,
        );
        if low >= high {
            return;
        }
        let end = [self.width, smooth.len() / self.width].map(|pixels| pixels as f64);
        let [x, y] = self.at;
        let mut labels: Vec<Place> = Vec::new();
        for t in ticks(low, high, false) {
            let all = segments(&smooth, self.width, self.stefan_boltzmann * t.powi(4));
            if all.len() < ISLAND {
                continue;
            }
            let line = |[a, b]: &[Place; 2]| {
                let [a, b] = [a, b].map(|[s, t]| format!("{:.1} {:.1}", s + x, t + y));
                format!("M{a}L{b}")
            };
            let d: String = all.iter().map(line).collect();
            // Dark on a light line, so that it is seen on any colour.
            for (stroke, stroke_width) in [(WHITE, 2.4), (INK, 1.0)] {
                page.path(PathData {
                    d: d.clone(),
                    fill: None,
                    stroke,
                    stroke_width,
                    opacity: Some(0.7),
                    stroke_dasharray: None,
                });
            }
            let label = format!("{t} K");
            let half = [0.5 * width_of(&label, self.size), 0.6 * self.size];
            let is_free = |at: &Place| {
                let is_apart =
                    |other: &Place| (0..2).any(|k| (at[k] - other[k]).abs() > 2.0 * half[k]);
                (0..2).all(|k| at[k] > half[k] && at[k] < end[k] - half[k])
                    && labels.iter().all(is_apart)
            };
            // As near to the middle of the line as there is a place.
            let (before, after) = all.split_at(all.len() / 2);
            let mut places = after.iter().chain(before.iter().rev()).map(|[at, _]| *at);
            if let Some(at) = places.find(is_free) {
                labels.push(at);
                let [x, y] = [x + at[0], y + at[1]];
                let corner = |sign: f64| [x + sign * half[0], y + sign * half[1]];
                page.rectangle([corner(-1.0), corner(1.0)], WHITE, 0.75);
                let base = [x, y + 0.35 * self.size];
                page.text(&label, base, self.size, TextAnchor::Middle);
            }
        }
    }
}

/// The mean of every pixel and those around it, as far as there is a room: pixels are of few walks.
fn smoothed(values: &[f64], width: usize) -> Vec<f64> {
    const AROUND: usize = 2;
    let rows = values.len() / width.max(1);
    let mean = |place: usize| {
        if values[place].is_nan() {
            return f64::NAN;
        }
        let around = |at: usize, end: usize| at.saturating_sub(AROUND)..(at + AROUND + 1).min(end);
        let (columns, rows) = (around(place % width, width), around(place / width, rows));
        let near = rows.flat_map(|y| values[y * width..][columns.clone()].iter());
        let known = near.filter(|value| !value.is_nan());
        let (sum, count) = known.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
        sum / count
    };
    (0..rows * width).map(mean).collect()
}

/// The pieces of the lines on which values between the middles of pixels are this level, in pixels from the upper left.
fn segments(values: &[f64], width: usize, level: f64) -> Vec<[Place; 2]> {
    let corner = |x: usize, y: usize| ([x as f64 + 0.5, y as f64 + 0.5], values[y * width + x]);
    let crossing = |&((p, u), (q, v)): &((Place, f64), (Place, f64))| {
        // Of a NaN neither is true.
        let crosses = (u < level && v >= level) || (v < level && u >= level);
        let part = (level - u) / (v - u);
        crosses.then(|| [0, 1].map(|k| p[k] + part * (q[k] - p[k])))
    };
    let mut all = Vec::new();
    for y in 1..values.len() / width.max(1) {
        for x in 1..width {
            let [a, b] = [corner(x - 1, y - 1), corner(x, y)];
            for c in [corner(x, y - 1), corner(x - 1, y)] {
                let sides = [(a, b), (b, c), (c, a)];
                let mut cut = sides.iter().filter_map(crossing);
                if let (Some(from), Some(to)) = (cut.next(), cut.next()) {
                    all.push([from, to]);
                }
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::{Isotherms, segments};
    use crate::page::Page;

    /// A plane's line of a level is straight, and ends where the room ends.
    #[test]
    fn a_line_is_where_the_values_are_its_level() {
        let (width, rows) = (9, 6);
        let value = |k: usize| {
            let (x, y) = (k % width, k / width);
            if y < 2 {
                f64::NAN
            } else {
                2.0 * x as f64 + y as f64
            }
        };
        let values: Vec<f64> = (0..width * rows).map(value).collect();
        let all = segments(&values, width, 8.25);
        let length = |[[a, b], [c, d]]: &[[f64; 2]; 2]| (a - c).hypot(b - d);
        for [x, y] in all.iter().flatten() {
            assert!((2.0 * (x - 0.5) + (y - 0.5) - 8.25).abs() < 1e-12);
        }
        // Over three of y, and half as many of x.
        let sum: f64 = all.iter().map(length).sum();
        assert!((sum - 3.0_f64.hypot(1.5)).abs() < 1e-12, "{sum}");
    }

    /// From 300 K on the left to 350 K on the right.
    #[test]
    fn every_round_temperature_has_a_line_with_its_name() {
        let (width, rows) = (100, 60);
        let kelvin = |x: usize| 300.0 + 50.0 * x as f64 / 99.0;
        let values: Vec<f64> = (0..width * rows)
            .map(|k| 5.67e-8 * kelvin(k % width).powi(4))
            .collect();
        let mut page = Page::default();
        let isotherms = Isotherms {
            values: &values,
            width,
            stefan_boltzmann: 5.67e-8,
            size: 10.0,
            at: [7.0, 3.0],
        };
        isotherms.draw(&mut page);
        let svg = page.figure([120.0, 80.0]).svg().unwrap();
        let label = svg.lines().find(|line| line.contains(">320 K<")).unwrap();
        let x = label.split('"').nth(1).unwrap().parse::<f64>().unwrap();
        assert!((x - 7.5 - 99.0 * 0.4).abs() < 1.0, "{label}");
    }
}
