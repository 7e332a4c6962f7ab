//! Curves on log-log axes, and values with their error band.

use core::f64::consts::TAU;
use std::sync::Arc;

use kuva::prelude::{Layout, LinePlot, MarkerShape, Plot, ScatterPlot, Theme, TickFormat};

use crate::Error;

/// A curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// The name of the curve in the legend.
    pub name: String,
    /// The points of the curve, abscissa and ordinate, joined in this order.
    pub points: Vec<(f64, f64)>,
    /// The look of the curve.
    pub style: Style,
}

impl Curve {
    /// A reference line y ~ x^`exponent` through `from`, up to the abscissa `to`.
    pub fn power_law(name: &str, exponent: f64, from: (f64, f64), to: f64) -> Self {
        let end = from.1 * (to / from.0).powf(exponent);
        Self {
            name: name.to_owned(),
            points: vec![from, (to, end)],
            style: Style::REFERENCE,
        }
    }
}

/// The look of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style {
    /// The number of its colour: black, blue, vermilion, green, purple, orange, grey, and again.
    pub colour: usize,
    /// The number of the marker on its points, if any: circle, square, triangle, diamond, and again.
    pub marker: Option<usize>,
    /// Dashed instead of solid.
    pub dashed: bool,
}

impl Style {
    /// The style of reference lines: grey and dashed.
    pub const REFERENCE: Self = Self {
        colour: 6,
        marker: None,
        dashed: true,
    };
}

/// Curves on log-log axes.
#[derive(Clone, Debug, PartialEq)]
pub struct LogLogPlot {
    /// The title, above the axes.
    pub title: String,
    /// The label of the abscissa.
    pub x_label: String,
    /// The label of the ordinate.
    pub y_label: String,
    /// The curves.
    pub curves: Vec<Curve>,
}

/// The abscissa of a [`BandPlot`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Axis {
    /// An angle s from 0 to 2π.
    Angle,
    /// x from 0 to 1.
    Unit,
    /// x from the least to the largest.
    Coordinate,
    /// The part t, 0 to 1, of a surface's length.
    Surface,
}

/// Values with their 95 % error band, on linear axes.
#[derive(Clone, Debug, PartialEq)]
pub struct BandPlot {
    /// The title, above the axes.
    pub title: String,
    /// The abscissa.
    pub axis: Axis,
    /// The name of the values in the legend.
    pub name: String,
    /// Abscissa, value and standard error of every point.
    pub points: Vec<(f64, f64, f64)>,
    /// The label of the ordinate; u of the abscissa otherwise.
    pub label: Option<String>,
    /// Curves to compare with.
    pub curves: Vec<Curve>,
}

/// The colours of Okabe and Ito, told apart by colour-blind readers too, without their yellow, which
/// is too faint on white; and a grey.
pub(crate) const COLOURS: [&str; 7] = [
    "#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#777777",
];

const MARKERS: [MarkerShape; 4] = [
    MarkerShape::Circle,
    MarkerShape::Square,
    MarkerShape::Triangle,
    MarkerShape::Diamond,
];

impl LogLogPlot {
    /// The text of an SVG file. Points that are not finite and positive have no place on the axes and
    /// are left out.
    pub fn svg(&self) -> Result<String, Error> {
        let has_place = |&&(x, y): &&(f64, f64)| {
            let fits = |v: f64| v.is_finite() && v > 0.0;
            fits(x) && fits(y)
        };
        let points = || self.curves.iter().flat_map(|c| &c.points);
        let lowest = points().filter(has_place).map(|&(_, y)| y);
        let lift = lift(lowest.fold(1.0, f64::min));
        let mut plots = Vec::new();
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        for curve in &self.curves {
            let points = curve.points.iter().filter(has_place);
            let points: Vec<_> = points.map(|&(x, y)| (x, y * lift)).collect();
            for &(x, _) in &points {
                (low, high) = (low.min(x), high.max(x));
            }
            plots.extend(draw(curve, points));
        }
        if plots.is_empty() {
            return Err(Error::NothingToDraw);
        }
        let layout = layout(&plots, &self.title, &self.x_label, &self.y_label)
            .with_log_scale()
            // Room for the first and the last marker.
            .with_x_axis_min(low / 1.4)
            .with_x_axis_max(high * 1.4)
            .with_x_tick_format(TickFormat::Custom(Arc::new(power_of_ten)))
            .with_y_tick_format(TickFormat::Custom(Arc::new(move |y| {
                power_of_ten(y / lift)
            })));
        Ok(kuva::render_to_svg(plots, layout))
    }
}

/// The power of ten by which ordinates are drawn too large, their ticks then telling what they are: the
/// library's logarithmic axes end at 10⁻¹⁰ and put on that line what is below.
fn lift(lowest: f64) -> f64 {
    10_f64.powf((-9.0 - lowest.log10().floor()).max(0.0))
}

/// The width and the height of a figure.
const SIZE: [usize; 2] = [760, 500];
/// The part of the height of a figure below which a band is invisible: two pixels.
const INVISIBLE: f64 = 0.005;

/// Figures one below the other, in one SVG file.
#[must_use]
pub fn stacked(figures: &[String]) -> String {
    // A figure says its own size.
    let size = |figure: &String| {
        let number = |key: &str| {
            let (_, rest) = figure.split_once(key)?;
            rest.split('"').next()?.parse::<f64>().ok()
        };
        let [width, height] = SIZE.map(|side| side as f64);
        [
            number(" width=\"").unwrap_or(width),
            number(" height=\"").unwrap_or(height),
        ]
    };
    let sizes: Vec<[f64; 2]> = figures.iter().map(size).collect();
    let width = sizes
        .iter()
        .fold(0.0, |most: f64, [width, _]| most.max(*width));
    let all: f64 = sizes.iter().map(|[_, height]| height).sum();
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{all}\" viewBox=\"0 0 {width} {all}\">\n"
    );
    let mut top = 0.0;
    for (figure, [_, height]) in figures.iter().zip(&sizes) {
        // What comes before an element is no part of it.
        let from = figure.find("<svg").unwrap_or(0);
        let own = figure.get(from..).unwrap_or_default();
        text += &own.replacen("<svg", &format!("<svg y=\"{top}\""), 1);
        text.push('\n');
        top += height;
    }
    text + "</svg>\n"
}

impl BandPlot {
    /// Whether the band is nowhere wider than the line of the values.
    #[must_use]
    pub fn is_invisible(&self) -> bool {
        let (mut low, mut high, mut widest) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
        for (_, u, error) in self.points.iter().filter(|(_, u, e)| (u + e).is_finite()) {
            (low, high) = (low.min(*u), high.max(*u));
            widest = widest.max(2.0 * 1.96 * error);
        }
        widest < INVISIBLE * (high - low)
    }

    /// The text of an SVG file. Points that are not finite are left out.
    pub fn svg(&self) -> Result<String, Error> {
        let finite = self.points.iter().copied();
        let finite = finite.filter(|(x, u, e)| (x + u + e).is_finite());
        let points: Vec<(f64, f64, f64)> = finite.collect();
        if points.is_empty() {
            return Err(Error::NothingToDraw);
        }
        let (low, high) = (points.iter().map(|(x, ..)| *x))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
                (low.min(x), high.max(x))
            });
        let mut plots = Vec::new();
        for piece in pieces(&points) {
            let at = |sign: f64| piece.iter().map(move |(_, u, e)| u + sign * 1.96 * e);
            let line = LinePlot::new()
                .with_data(piece.iter().map(|&(s, u, _)| (s, u)))
                .with_band(at(-1.0), at(1.0))
                .with_color(COLOURS[1])
                .with_stroke_width(1.8);
            plots.push(Plot::Line(if plots.is_empty() {
                line.with_legend(format!("{}, 95 % band", self.name))
            } else {
                line
            }));
        }
        for curve in &self.curves {
            let exact: Vec<_> = curve.points.iter().map(|&(x, u)| (x, u, 0.0)).collect();
            for (number, piece) in pieces(&exact).into_iter().enumerate() {
                let own = Curve {
                    name: if number == 0 {
                        curve.name.clone()
                    } else {
                        String::new()
                    },
                    ..curve.clone()
                };
                plots.extend(draw(&own, piece.iter().map(|&(x, u, _)| (x, u)).collect()));
            }
        }
        let (x_label, y_label) = match self.axis {
            Axis::Angle => ("angle s in radians", "u(s)"),
            Axis::Surface => ("t along the surface", "u(t)"),
            Axis::Unit | Axis::Coordinate => ("x", "u(x)"),
        };
        let y_label = self.label.as_deref().unwrap_or(y_label);
        let layout = layout(&plots, &self.title, x_label, y_label);
        let layout = match self.axis {
            Axis::Angle => layout
                .with_x_axis_max(TAU)
                .with_x_tick_step(TAU / 4.0)
                .with_x_tick_format(TickFormat::Custom(Arc::new(quarter_turn))),
            Axis::Surface | Axis::Unit => layout.with_x_axis_max(1.0),
            Axis::Coordinate => layout.with_x_axis_max(high),
        };
        let layout = layout.with_x_axis_min(if self.axis == Axis::Coordinate {
            low
        } else {
            0.0
        });
        Ok(kuva::render_to_svg(plots, layout))
    }
}

/// The points between jumps, which no line joins. From point to point a curve rises by about as much as just before and
/// after, where it is neither noise nor rounding.
fn pieces(points: &[(f64, f64, f64)]) -> Vec<&[(f64, f64, f64)]> {
    /// A step so many times as large as those beside it is none of a curve that points follow.
    const JUMP: f64 = 5.0;
    /// The number of standard errors that a step may be by chance.
    const NOISE: f64 = 6.0;
    let (low, high) = points.iter().fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(low, high), (_, u, _)| (low.min(*u), high.max(*u)),
    );
    let step = |i: usize| match (points.get(i), points.get(i + 1)) {
        (Some(a), Some(b)) => (b.1 - a.1).abs(),
        _ => 0.0,
    };
    // Of the first and the last step, which have one beside them, nothing is known.
    let jumps = (1..points.len().saturating_sub(2)).filter(|&i| {
        let beside = step(i - 1).max(step(i + 1));
        let noise = NOISE * points[i].2.hypot(points[i + 1].2);
        step(i) > JUMP * beside && step(i) > noise && step(i) > INVISIBLE * (high - low)
    });
    let mut ends: Vec<usize> = jumps.map(|i| i + 1).collect();
    ends.push(points.len());
    let mut from = 0;
    ends.into_iter()
        .map(|to| &points[core::mem::replace(&mut from, to)..to])
        .collect()
}

/// A line through the points, and markers on them.
fn draw(curve: &Curve, points: Vec<(f64, f64)>) -> Vec<Plot> {
    if points.is_empty() {
        return Vec::new();
    }
    let Style {
        colour,
        marker,
        dashed,
    } = curve.style;
    let colour = COLOURS[colour % COLOURS.len()];
    let line = LinePlot::new()
        .with_data(points.clone())
        .with_color(colour)
        .with_stroke_width(1.8);
    let line = if curve.name.is_empty() {
        line
    } else {
        line.with_legend(curve.name.clone())
    };
    let mut plots = vec![Plot::Line(if dashed { line.with_dashed() } else { line })];
    if let Some(marker) = marker {
        plots.push(Plot::Scatter(
            ScatterPlot::new()
                .with_data(points)
                .with_color(colour)
                .with_size(4.5)
                .with_marker(MARKERS[marker % MARKERS.len()]),
        ));
    }
    plots
}

/// A layout with what all figures have in common.
pub(crate) fn layout(plots: &[Plot], title: &str, x_label: &str, y_label: &str) -> Layout {
    let theme = Theme {
        grid_color: "#dddddd".into(),
        legend_border: "#dddddd".into(),
        ..Theme::default()
    };
    Layout::auto_from_plots(plots)
        .with_theme(theme)
        .with_title(title)
        .with_x_label(x_label)
        .with_y_label(y_label)
        .with_width(SIZE[0] as f64)
        .with_height(SIZE[1] as f64)
}

/// 10 with its exponent above it; other numbers as they are.
fn power_of_ten(value: f64) -> String {
    let exponent = value.log10().round();
    if (value / 10_f64.powf(exponent) - 1.0).abs() > 1e-9 {
        return format!("{value}");
    }
    let raised = |c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => digit
            .to_digit(10)
            .and_then(|digit| char::from_u32(0x2070 + digit))
            .unwrap_or(digit),
    };
    let exponent: String = format!("{exponent}").chars().map(raised).collect();
    format!("10{exponent}")
}

/// A quarter of a turn, or several, in radians.
fn quarter_turn(angle: f64) -> String {
    let names = ["0", "π/2", "π", "3π/2", "2π"];
    let quarters = (4.0 * angle / TAU).round().clamp(0.0, 4.0);
    names[quarters as usize].to_owned()
}

#[cfg(test)]
mod tests {
    use super::{Axis, BandPlot, Curve, LogLogPlot, Style, pieces, power_of_ten, stacked};
    use crate::Error;

    fn figure(points: Vec<(f64, f64)>) -> LogLogPlot {
        LogLogPlot {
            title: "a < b & c".to_owned(),
            x_label: "walks".to_owned(),
            y_label: "error".to_owned(),
            curves: vec![Curve {
                name: "plain".to_owned(),
                points,
                style: Style {
                    colour: 1,
                    marker: Some(2),
                    dashed: false,
                },
            }],
        }
    }

    #[test]
    fn a_figure_has_its_words() {
        let figure = figure(vec![(10.0, 1.0), (1000.0, 0.01)]);
        let svg = figure.svg().unwrap();
        for word in ["a &lt; b &amp; c", "walks", "error", "plain", "10²", "10⁻¹"] {
            assert!(svg.contains(word), "{word} in {svg}");
        }
    }

    /// The library draws what is below 10⁻¹⁰ on that line.
    #[test]
    fn small_ordinates_have_places_of_their_own() {
        let small = (0..4).map(|i| (1.0 + f64::from(i), 10_f64.powi(-10 - 2 * i)));
        let svg = figure(small.collect()).svg().unwrap();
        for tick in ["10⁻¹⁰", "10⁻¹³", "10⁻¹⁶"] {
            assert!(svg.contains(tick), "{tick} in {svg}");
        }
        // Where they are drawn, with the lift of the lowest.
        assert!(!svg.contains("10⁻⁶"), "{svg}");
    }

    #[test]
    fn what_has_no_logarithm_is_left_out() {
        let odd = vec![
            (0.0, 1.0),
            (1.0, -1.0),
            (f64::NAN, 1.0),
            (1.0, f64::INFINITY),
        ];
        assert_eq!(figure(odd.clone()).svg(), Err(Error::NothingToDraw));
        let one = figure([odd, vec![(10.0, 1.0)]].concat()).svg().unwrap();
        assert!(!one.contains("NaN") && !one.contains("inf"), "{one}");
    }

    #[test]
    fn a_band_of_any_number_of_points() {
        let mut band = BandPlot {
            title: "profile".to_owned(),
            axis: Axis::Angle,
            name: "walks".to_owned(),
            points: vec![(0.0, 1.0, 0.1), (3.0, 2.0, 0.0), (1.0, f64::NAN, 0.1)],
            label: None,
            curves: Vec::new(),
        };
        let svg = band.svg().unwrap();
        assert!(
            svg.contains("3π/2") && svg.contains("walks, 95 % band"),
            "{svg}"
        );
        assert!(!svg.contains("NaN"), "{svg}");
        assert!(!band.is_invisible());
        let both = stacked(&[svg.clone(), svg]);
        assert_eq!(both.matches("</svg>").count(), 3);
        assert!(
            both.contains("height=\"1000\"") && both.contains("y=\"500\""),
            "{both}"
        );
        band.points = vec![(0.0, 1.0, 1e-4), (1.0, 1.5, 1e-4)];
        assert!(band.is_invisible());
        band.points.truncate(1);
        assert!(band.svg().is_ok());
        band.points.clear();
        assert_eq!(band.svg(), Err(Error::NothingToDraw));
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

    #[test]
    fn powers_of_ten() {
        assert_eq!(power_of_ten(1e-5), "10⁻⁵");
        assert_eq!(power_of_ten(1e12), "10¹²");
        assert_eq!(power_of_ten(1.0), "10⁰");
        assert_eq!(power_of_ten(0.5), "0.5");
    }
}
