//! Curves on log-log axes.

use std::sync::Arc;

use kuva::prelude::{Layout, LinePlot, MarkerShape, Plot, ScatterPlot, Theme, TickFormat};
use kuva::render::render::render_multiple;

use crate::{Error, Figure};

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
    /// A curve through these points.
    pub fn new(
        name: impl Into<String>,
        style: Style,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        Self {
            name: name.into(),
            points: points.into_iter().collect(),
            style,
        }
    }

    /// A reference line y ~ x^`exponent` through `from`, up to the abscissa `to`.
    pub fn power_law(name: &str, exponent: f64, from: (f64, f64), to: f64) -> Self {
        let end = from.1 * (to / from.0).powf(exponent);
        Self::new(name, Style::dashed(6), [from, (to, end)])
    }

    /// A line through the points, and markers on them.
    pub(crate) fn plots(&self) -> Vec<Plot> {
        if self.points.is_empty() {
            return Vec::new();
        }
        let colour = COLOURS[self.style.colour % COLOURS.len()];
        let mut line = LinePlot::new()
            .with_data(self.points.clone())
            .with_color(colour)
            .with_stroke_width(1.8);
        if !self.name.is_empty() {
            line = line.with_legend(self.name.clone());
        }
        if self.style.dashed {
            line = line.with_dashed();
        }
        let mut plots = vec![Plot::Line(line)];
        plots.extend(self.style.marker.map(|marker| {
            let markers = ScatterPlot::new()
                .with_data(self.points.clone())
                .with_color(colour)
                .with_size(4.5)
                .with_marker(MARKERS[marker % MARKERS.len()]);
            Plot::Scatter(markers)
        }));
        plots
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
    /// A line in this colour with this marker on its points.
    #[must_use]
    pub const fn marked(colour: usize, marker: usize) -> Self {
        Self {
            colour,
            marker: Some(marker),
            dashed: false,
        }
    }

    /// A dashed line in this colour.
    #[must_use]
    pub const fn dashed(colour: usize) -> Self {
        Self {
            colour,
            marker: None,
            dashed: true,
        }
    }
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
    /// The figure. Points that are not finite and positive have no place on the axes and are left out.
    ///
    /// # Errors
    /// [`Error::NothingToDraw`]: no point has a place.
    pub fn draw(&self) -> Result<Figure, Error> {
        let has_place = |&&(x, y): &&(f64, f64)| {
            let fits = |v: f64| v.is_finite() && v > 0.0;
            fits(x) && fits(y)
        };
        let points = || self.curves.iter().flat_map(|curve| &curve.points);
        let placed = || points().filter(has_place);
        let lift = lift(placed().map(|&(_, y)| y).fold(1.0, f64::min));
        let low = placed().map(|&(x, _)| x).fold(f64::INFINITY, f64::min);
        let high = placed().map(|&(x, _)| x).fold(0.0, f64::max);
        let curve = |curve: &Curve| {
            let points = curve.points.iter().filter(has_place);
            let lifted = points.map(|&(x, y)| (x, y * lift));
            Curve::new(&curve.name, curve.style, lifted).plots()
        };
        let plots: Vec<Plot> = self.curves.iter().flat_map(curve).collect();
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
        Ok(render_multiple(plots, layout).into())
    }
}

/// The power of ten by which ordinates are drawn too large, their ticks then telling what they are: the
/// library's logarithmic axes end at 10⁻¹⁰ and put on that line what is below.
fn lift(lowest: f64) -> f64 {
    10_f64.powf((-9.0 - lowest.log10().floor()).max(0.0))
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
        .with_width(760.0)
        .with_height(500.0)
}

/// 10 with its exponent above it; other numbers as they are.
fn power_of_ten(value: f64) -> String {
    let exponent = value.log10().round();
    if (value / 10_f64.powf(exponent) - 1.0).abs() > 1e-9 {
        return format!("{value}");
    }
    let raised = |c: char| match c.to_digit(10) {
        None => '⁻',
        Some(digit) => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize],
    };
    let exponent: String = format!("{exponent}").chars().map(raised).collect();
    format!("10{exponent}")
}

#[cfg(test)]
mod tests {
    use super::{Curve, LogLogPlot, Style, power_of_ten};
    use crate::Error;

    fn svg(points: impl IntoIterator<Item = (f64, f64)>) -> Result<String, Error> {
        let plot = LogLogPlot {
            title: "a < b & c".to_owned(),
            x_label: "walks".to_owned(),
            y_label: "error".to_owned(),
            curves: vec![Curve::new("plain", Style::marked(1, 2), points)],
        };
        plot.draw()?.svg()
    }

    #[test]
    fn a_figure_has_its_words() {
        let svg = svg([(10.0, 1.0), (1000.0, 0.01)]).unwrap();
        for word in ["a &lt; b &amp; c", "walks", "error", "plain", "10²", "10⁻¹"] {
            assert!(svg.contains(word), "{word} in {svg}");
        }
    }

    /// The library draws what is below 10⁻¹⁰ on that line.
    #[test]
    fn small_ordinates_have_places_of_their_own() {
        let small = (0..4).map(|i| (1.0 + f64::from(i), 10_f64.powi(-10 - 2 * i)));
        let svg = svg(small).unwrap();
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
        assert_eq!(svg(odd.clone()), Err(Error::NothingToDraw));
        let one = svg([odd, vec![(10.0, 1.0)]].concat()).unwrap();
        assert!(!one.contains("NaN") && !one.contains("inf"), "{one}");
    }

    #[test]
    fn powers_of_ten() {
        for (power, text) in [(1e-5, "10⁻⁵"), (1e12, "10¹²"), (1.0, "10⁰"), (0.5, "0.5")] {
            assert_eq!(power_of_ten(power), text);
        }
    }
}
