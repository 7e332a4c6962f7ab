//! Values with their error bands: on a grid of one axis, and along the surfaces of a room.

use core::f64::consts::TAU;
use std::sync::Arc;

use kuva::plot::annotations::ReferenceLine;
use kuva::prelude::{LinePlot, Plot, TickFormat};
use kuva::render::render::{Primitive, TextAnchor, render_multiple};

use crate::curves::{COLOURS, layout};
use crate::{Curve, Error, Figure, Style};

/// A value on a grid of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridPoint {
    /// The abscissa of the point.
    pub at: f64,
    /// The value at the point.
    pub value: f64,
    /// The standard error of the value.
    pub std_error: f64,
    /// What is known of the value without walks; NaN if nothing is.
    pub known: f64,
    /// The exact value, if there is one.
    pub exact: Option<f64>,
}

/// The abscissa of a [`GridCurve`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Axis {
    /// An angle s from 0 to 2π.
    Angle,
    /// x from the least to the largest.
    Coordinate,
    /// The part t, 0 to 1, of a surface's length.
    Surface,
}

/// Values on a grid of one axis, with their band.
#[derive(Clone, Debug)]
pub struct GridCurve<'a> {
    /// The name of the grid.
    pub name: &'a str,
    /// The abscissa.
    pub axis: Axis,
    /// The points, in the order of their abscissas.
    pub points: Vec<GridPoint>,
    /// What the values are of, in the legend.
    pub values: &'a str,
    /// What the band is, in the title.
    pub band: &'a str,
    /// The name of what is known without walks.
    pub known: &'a str,
}

/// Abscissa, value and standard error.
type Point = (f64, f64, f64);

/// The part of the height of a figure below which a band is invisible: two pixels.
const INVISIBLE: f64 = 0.005;

impl GridCurve<'_> {
    /// The values with their band, and below them, if that is nowhere wider than a line, what walks add to what is known. Points
    /// that are not finite are left out.
    ///
    /// ```
    /// use fredholm_plot::{Axis, GridCurve, GridPoint};
    ///
    /// let point = |i: u32| GridPoint {
    ///     at: f64::from(i),
    ///     value: f64::from(i * i),
    ///     std_error: 1e-6,
    ///     known: f64::from(i * i) + 1e-5,
    ///     exact: None,
    /// };
    /// let curve = GridCurve {
    ///     name: "square",
    ///     axis: Axis::Coordinate,
    ///     points: (0..9).map(point).collect(),
    ///     values: "walks",
    ///     band: "band",
    ///     known: "v",
    /// };
    /// assert!(curve.draw()?.svg()?.contains("what walks add to v"));
    /// # Ok::<(), fredholm_plot::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::NothingToDraw`]: no value is finite.
    pub fn draw(&self) -> Result<Figure, Error> {
        let (name, band, known) = (self.name, self.band, self.known);
        let title = format!("{name}: the solution with its 95 % {band}");
        let values = self.figure(&title, None, |_| 0.0)?;
        if !self.has_invisible_band() || self.points.iter().any(|point| point.known.is_nan()) {
            return Ok(values);
        }
        let title = format!("{name}: what walks add to {known}, with the same band");
        let added = self.figure(&title, Some("difference"), |point| point.known)?;
        Ok(Figure::stacked(vec![values, added]))
    }

    /// The values alone with their band, where they are differences from something: the ordinate has their name.
    ///
    /// # Errors
    /// [`Error::NothingToDraw`], where no point is finite.
    pub fn draw_differences(&self) -> Result<Figure, Error> {
        self.figure(self.name, Some(self.values), |_| 0.0)
    }

    /// Whether the band is nowhere wider than the line of the values.
    fn has_invisible_band(&self) -> bool {
        let points = finite(self.points.iter().map(|p| (p.at, p.value, p.std_error)));
        let [low, high] = ends(points.iter().map(|point| point.1));
        let errors = points.iter().map(|(_, _, error)| 2.0 * 1.96 * error);
        errors.fold(0.0, f64::max) < INVISIBLE * (high - low)
    }

    /// The values less what `of` says.
    fn figure(
        &self,
        title: &str,
        label: Option<&str>,
        of: fn(&GridPoint) -> f64,
    ) -> Result<Figure, Error> {
        let all = self.points.iter();
        let values = all.clone().map(|p| (p.at, p.value - of(p), p.std_error));
        let points = finite(values);
        if points.is_empty() {
            return Err(Error::NothingToDraw);
        }
        let mut plots = Vec::new();
        for piece in pieces(&points) {
            let line = band(piece, 1.96, 1.8);
            plots.push(Plot::Line(match plots.is_empty() {
                true => line.with_legend(format!("{}, 95 % band", self.values)),
                false => line,
            }));
        }
        let exact = all.filter_map(|p| Some((p.at, p.exact? - of(p), 0.0)));
        for (number, piece) in pieces(&exact.collect::<Vec<_>>()).into_iter().enumerate() {
            let name = if number == 0 { "exact solution" } else { "" };
            let points = piece.iter().map(|&(x, u, _)| (x, u));
            plots.extend(Curve::new(name, Style::dashed(0), points).plots());
        }
        let [least, largest] = ends(points.iter().map(|point| point.0));
        let (x_label, y_label, [low, high]) = match self.axis {
            Axis::Angle => ("angle s in radians", "u(s)", [0.0, TAU]),
            Axis::Surface => ("t along the surface", "u(t)", [0.0, 1.0]),
            Axis::Coordinate => ("x", "u(x)", [least, largest]),
        };
        let mut layout = layout(&plots, title, x_label, label.unwrap_or(y_label))
            .with_x_axis_min(low)
            .with_x_axis_max(high);
        if self.axis == Axis::Angle {
            let quarters = TickFormat::Custom(Arc::new(quarter_turn));
            layout = layout
                .with_x_tick_step(TAU / 4.0)
                .with_x_tick_format(quarters);
        }
        Ok(render_multiple(plots, layout).into())
    }
}

/// A line with so many standard errors around it.
fn band(points: &[Point], errors: f64, width: f64) -> LinePlot {
    let at = |sign: f64| points.iter().map(move |(_, u, e)| u + sign * errors * e);
    LinePlot::new()
        .with_data(points.iter().map(|&(x, u, _)| (x, u)))
        .with_band(at(-1.0), at(1.0))
        .with_color(COLOURS[1])
        .with_stroke_width(width)
}

fn finite(points: impl Iterator<Item = Point>) -> Vec<Point> {
    points.filter(|(x, u, e)| (x + u + e).is_finite()).collect()
}

/// The least and the largest.
fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
        [low.min(x), high.max(x)]
    })
}

/// The points between jumps, which no line joins. From point to point a curve rises by about as much as just before and
/// after, where it is neither noise nor rounding.
fn pieces(points: &[Point]) -> Vec<&[Point]> {
    /// A step so many times as large as those beside it is none of a curve that points follow.
    const JUMP: f64 = 5.0;
    /// The number of standard errors that a step may be by chance.
    const NOISE: f64 = 6.0;
    let [low, high] = ends(points.iter().map(|point| point.1));
    let step = |i: usize| match points.get(i..i + 2) {
        Some([a, b]) => (b.1 - a.1).abs(),
        _ => 0.0,
    };
    // Of the first and the last step, which have one beside them, nothing is known.
    let is_jump = |i: usize| {
        let beside = step(i - 1).max(step(i + 1));
        let noise = NOISE * points[i].2.hypot(points[i + 1].2);
        step(i) > JUMP * beside && step(i) > noise && step(i) > INVISIBLE * (high - low)
    };
    let inner = 1..points.len().saturating_sub(2);
    let mut ends: Vec<usize> = inner.filter(|&i| is_jump(i)).map(|i| i + 1).collect();
    ends.push(points.len());
    let mut from = 0;
    ends.into_iter()
        .map(|to| &points[core::mem::replace(&mut from, to)..to])
        .collect()
}

/// A quarter of a turn, or several, in radians.
fn quarter_turn(angle: f64) -> String {
    let names = ["0", "π/2", "π", "3π/2", "2π"];
    let quarters = (4.0 * angle / TAU).round().clamp(0.0, 4.0);
    names[quarters as usize].to_owned()
}

/// Values against length along all surfaces of a room, with bands of ±2 standard errors.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfilePlot {
    /// The title, above the axes.
    pub title: String,
    /// The label of the ordinate.
    pub label: String,
    /// Length along all surfaces, value and standard error, in pieces that have no jump.
    pub pieces: Vec<Vec<(f64, f64, f64)>>,
    /// The name of every surface, and the length at which it begins.
    pub surfaces: Vec<(String, f64)>,
    /// The length of all surfaces.
    pub length: f64,
}

/// The size of a profile, and its margins.
const SIZE: [f64; 2] = [1000.0, 560.0];
const SIDES: [f64; 2] = [90.0, 60.0];
const ENDS: [f64; 2] = [125.0, 60.0];

impl ProfilePlot {
    /// The figure.
    ///
    /// # Errors
    /// [`Error::NothingToDraw`]: no value is finite.
    pub fn draw(&self) -> Result<Figure, Error> {
        let line = |piece: &Vec<Point>| {
            // An error that is not known has no band.
            let error = |e: f64| if e.is_finite() { e } else { 0.0 };
            let points = finite(piece.iter().map(|&(s, u, e)| (s, u, error(e))));
            (!points.is_empty()).then(|| Plot::Line(band(&points, 2.0, 1.4)))
        };
        let plots: Vec<Plot> = self.pieces.iter().filter_map(line).collect();
        if plots.is_empty() {
            return Err(Error::NothingToDraw);
        }
        let x_label = "length along all surfaces";
        let mut layout = layout(&plots, &self.title, x_label, &self.label)
            .with_width(SIZE[0])
            .with_height(SIZE[1])
            .with_force_margins(SIDES[0], SIDES[1])
            .with_force_margins_y(ENDS[0], ENDS[1])
            .with_x_axis_min(0.0)
            .with_x_axis_max(self.length);
        for (_, start) in self.surfaces.iter().skip(1) {
            let line = ReferenceLine::vertical(*start).with_color("#999999");
            layout = layout.with_reference_line(line);
        }
        let mut scene = render_multiple(plots, layout);
        let ends = self.surfaces.iter().skip(1).map(|(_, start)| *start);
        let mut last = f64::NEG_INFINITY;
        for ((name, start), end) in self.surfaces.iter().zip(ends.chain([self.length])) {
            let middle = 0.5 * (start + end) / self.length;
            // Above the middle of each; names of short surfaces stand side by side.
            last = (SIDES[0] + middle * (SIZE[0] - SIDES[0] - SIDES[1])).max(last + 13.0);
            scene.add(Primitive::Text {
                x: last + 4.0,
                y: ENDS[0] - 8.0,
                content: name.clone(),
                size: 12,
                anchor: TextAnchor::Start,
                rotate: Some(-60.0),
                bold: false,
                color: None,
            });
        }
        Ok(scene.into())
    }
}

#[cfg(test)]
mod tests {
    use super::{Axis, GridCurve, GridPoint, pieces};
    use crate::{Error, Figure};

    #[test]
    fn a_band_of_any_number_of_points() {
        let curve = |points: &[(f64, f64, f64)]| {
            let point = |&(at, value, std_error): &(f64, f64, f64)| GridPoint {
                at,
                value,
                std_error,
                known: f64::NAN,
                exact: None,
            };
            GridCurve {
                name: "profile",
                axis: Axis::Angle,
                points: points.iter().map(point).collect(),
                values: "walks",
                band: "band",
                known: "v",
            }
        };
        let wide = curve(&[(0.0, 1.0, 0.1), (3.0, 2.0, 0.0), (1.0, f64::NAN, 0.1)]);
        assert!(!wide.has_invisible_band());
        let svg = wide.draw().unwrap().svg().unwrap();
        assert!(
            svg.contains("3π/2") && svg.contains("walks, 95 % band") && !svg.contains("NaN"),
            "{svg}"
        );
        let both = Figure::stacked(vec![wide.draw().unwrap(), wide.draw().unwrap()]);
        let both = both.svg().unwrap();
        assert_eq!(both.matches("3π/2").count(), 2);
        assert!(
            both.contains("height=\"1000\"") && both.contains("translate(0,500)"),
            "{both}"
        );
        let mut thin = curve(&[(0.0, 1.0, 1e-4), (1.0, 1.5, 1e-4)]);
        assert!(thin.has_invisible_band());
        thin.points.truncate(1);
        assert!(thin.draw().is_ok());
        thin.points.clear();
        assert_eq!(thin.draw().map(|_| ()), Err(Error::NothingToDraw));
    }

    #[test]
    fn no_line_joins_what_jumps() {
        let of = |u: &dyn Fn(f64) -> f64, error: f64| {
            let at = |i: u32| f64::from(i) / 40.0;
            let points: Vec<_> = (0..=40).map(|i| (at(i), u(at(i)), error)).collect();
            let all = pieces(&points);
            assert_eq!(all.concat(), points);
            all.iter().map(|piece| piece.len()).collect::<Vec<_>>()
        };
        let jump = |x: f64| if x < 0.51 { x } else { 2.0 - x };
        assert_eq!(of(&jump, 0.0), [21, 20]);
        // Hidden by noise, or a curve, however steep at an end; a peak is no jump.
        assert_eq!(of(&jump, 1.0), [41]);
        assert_eq!(of(&f64::sqrt, 0.0), [41]);
        assert_eq!(of(&|x: f64| (8.0 * x).exp(), 0.0), [41]);
        assert_eq!(of(&|x: f64| (20.0 * x).sin(), 0.0), [41]);
        assert_eq!(of(&|x: f64| if x == 0.5 { 1.0 } else { 0.0 }, 0.0), [41]);
        assert_eq!(of(&|_| 1.0, 0.0), [41]);
        assert_eq!(pieces(&[]), [&[]]);
    }
}
