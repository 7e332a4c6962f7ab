//! Figures as SVG: curves on log-log axes, and a profile with its error band.

use core::f64::consts::TAU;
use core::fmt;
use std::sync::Arc;

use kuva::plot::annotations::ReferenceLine;
use kuva::prelude::{
    ColorMap, Heatmap, Layout, LinePlot, MarkerShape, Plot, ScatterPlot, Theme, TickFormat,
};
use kuva::render::render::{Primitive, Scene, TextAnchor, render_multiple};

/// A curve of a figure.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    /// What the legend calls it.
    pub(crate) name: String,
    /// Its points, joined in this order.
    pub(crate) points: Vec<(f64, f64)>,
    /// What it looks like.
    pub(crate) style: Style,
}

impl Curve {
    /// A reference line y ~ x^`exponent` through `from` up to the abscissa `to`.
    pub(crate) fn power_law(name: &str, exponent: f64, from: (f64, f64), to: f64) -> Self {
        let end = from.1 * (to / from.0).powf(exponent);
        Self {
            name: name.to_owned(),
            points: vec![from, (to, end)],
            style: Style::REFERENCE,
        }
    }
}

/// What a curve looks like.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Style {
    /// The number of its colour.
    pub(crate) colour: usize,
    /// The number of the marker on its points, if any.
    pub(crate) marker: Option<usize>,
    /// Dashed, not solid.
    pub(crate) dashed: bool,
}

impl Style {
    /// Of lines to compare with: grey and dashed.
    pub(crate) const REFERENCE: Self = Self {
        colour: 6,
        marker: None,
        dashed: true,
    };
}

/// Curves on log-log axes.
#[derive(Clone, Debug)]
pub(crate) struct Figure {
    /// Above it.
    pub(crate) title: String,
    /// What the abscissa is.
    pub(crate) x_label: String,
    /// What the ordinate is.
    pub(crate) y_label: String,
    /// The curves.
    pub(crate) curves: Vec<Curve>,
}

/// The abscissa of a profile.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Axis {
    /// An angle s from 0 to 2π.
    Angle,
    /// x from 0 to 1.
    Unit,
    /// A part t of a surface's length.
    Surface,
}

/// A profile with its error band, on linear axes.
#[derive(Clone, Debug)]
pub(crate) struct Band {
    /// Above it.
    pub(crate) title: String,
    /// The abscissa.
    pub(crate) axis: Axis,
    /// What the legend calls the profile.
    pub(crate) name: String,
    /// Abscissa, value, standard error.
    pub(crate) points: Vec<(f64, f64, f64)>,
    /// Curves to compare with.
    pub(crate) curves: Vec<Curve>,
}

/// Nothing in the figure can be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NothingToDraw;

impl fmt::Display for NothingToDraw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the figure has no point that can be drawn")
    }
}

impl core::error::Error for NothingToDraw {}

/// The colours of Okabe and Ito, told apart by colour-blind readers too, without their yellow, which
/// is too faint on white; and a grey.
const COLOURS: [&str; 7] = [
    "#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#777777",
];

const MARKERS: [MarkerShape; 4] = [
    MarkerShape::Circle,
    MarkerShape::Square,
    MarkerShape::Triangle,
    MarkerShape::Diamond,
];

/// The text of an SVG file with curves on log-log axes. Points that are not finite and positive have
/// no place on them and are left out.
pub(crate) fn log_log_svg(figure: &Figure) -> Result<String, NothingToDraw> {
    let has_place = |&&(x, y): &&(f64, f64)| {
        let fits = |v: f64| v.is_finite() && v > 0.0;
        fits(x) && fits(y)
    };
    let points = || figure.curves.iter().flat_map(|c| &c.points);
    let lowest = points().filter(has_place).map(|&(_, y)| y);
    let lift = lift(lowest.fold(1.0, f64::min));
    let mut plots = Vec::new();
    let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
    for curve in &figure.curves {
        let points = curve.points.iter().filter(has_place);
        let points: Vec<_> = points.map(|&(x, y)| (x, y * lift)).collect();
        for &(x, _) in &points {
            (low, high) = (low.min(x), high.max(x));
        }
        plots.extend(draw(curve, points));
    }
    if plots.is_empty() {
        return Err(NothingToDraw);
    }
    let layout = layout(&plots, &figure.title, &figure.x_label, &figure.y_label)
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

/// The power of ten by which ordinates are drawn too large, their ticks then telling what they are: the
/// library's logarithmic axes end at 10⁻¹⁰ and put on that line what is below.
fn lift(lowest: f64) -> f64 {
    10_f64.powf((-9.0 - lowest.log10().floor()).max(0.0))
}

/// The text of an SVG file with a profile and its 95 % error band. Points that are not finite are left
/// out.
pub(crate) fn band_svg(band: &Band) -> Result<String, NothingToDraw> {
    let finite = band.points.iter().copied();
    let finite = finite.filter(|(x, u, e)| (x + u + e).is_finite());
    let points: Vec<(f64, f64, f64)> = finite.collect();
    if points.is_empty() {
        return Err(NothingToDraw);
    }
    let at = |sign: f64| points.iter().map(move |(_, u, e)| u + sign * 1.96 * e);
    let profile = LinePlot::new()
        .with_data(points.iter().map(|&(s, u, _)| (s, u)))
        .with_band(at(-1.0), at(1.0))
        .with_color(COLOURS[1])
        .with_stroke_width(1.8)
        .with_legend(format!("{}, 95 % band", band.name));
    let mut plots = vec![Plot::Line(profile)];
    for curve in &band.curves {
        plots.extend(draw(curve, curve.points.clone()));
    }
    let layout = match band.axis {
        Axis::Angle => layout(&plots, &band.title, "angle s in radians", "u(s)")
            .with_x_axis_max(TAU)
            .with_x_tick_step(TAU / 4.0)
            .with_x_tick_format(TickFormat::Custom(Arc::new(quarter_turn))),
        Axis::Surface => {
            layout(&plots, &band.title, "t along the surface", "u(t)").with_x_axis_max(1.0)
        }
        Axis::Unit => layout(&plots, &band.title, "x", "u(x)").with_x_axis_max(1.0),
    };
    let layout = layout.with_x_axis_min(0.0);
    Ok(kuva::render_to_svg(plots, layout))
}

/// Shares of pairs of places as colours: rows are where a step starts, columns where it leads, the last of them
/// what is no step.
pub(crate) fn shares_svg(
    title: &str,
    names: &[String],
    shares: &[Vec<f64>],
) -> Result<String, NothingToDraw> {
    if shares.is_empty() {
        return Err(NothingToDraw);
    }
    let percent = |share: &f64| 100.0 * share.max(0.0);
    let rows = shares
        .iter()
        .rev()
        .map(|row| row.iter().map(percent).collect::<Vec<_>>());
    let heat = Heatmap::new()
        .with_data(rows.collect::<Vec<_>>())
        .with_color_map(ColorMap::Viridis)
        .with_legend("%");
    let plots = vec![Plot::Heatmap(heat)];
    let mut columns = names.to_vec();
    columns.push("source".to_owned());
    let layout = layout(&plots, title, "into", "from")
        .with_x_categories(columns)
        .with_y_categories(names.to_vec())
        .with_x_tick_rotate(-45.0);
    Ok(kuva::render_to_svg(plots, layout))
}

/// Profiles along the surfaces of a room, side by side.
#[derive(Clone, Debug)]
pub(crate) struct Along {
    /// Above it.
    pub(crate) title: String,
    /// What the ordinate is.
    pub(crate) label: String,
    /// What has no jump: length along all surfaces, value, standard error.
    pub(crate) pieces: Vec<Vec<(f64, f64, f64)>>,
    /// Names of the surfaces, and where they begin.
    pub(crate) surfaces: Vec<(String, f64)>,
    /// Of all surfaces.
    pub(crate) length: f64,
}

/// Values against length with bands of ±2 standard errors, and the surfaces' names above them.
pub(crate) fn along_scene(along: &Along) -> Result<Scene, NothingToDraw> {
    const WIDTH: f64 = 1000.0;
    const HEIGHT: f64 = 560.0;
    const LEFT: f64 = 90.0;
    const RIGHT: f64 = 60.0;
    const TOP: f64 = 125.0;
    const BOTTOM: f64 = 60.0;
    let mut plots = Vec::new();
    for piece in &along.pieces {
        let finite = piece.iter().filter(|(_, u, _)| u.is_finite());
        let at = |sign: f64| {
            let error = |e: f64| if e.is_finite() { e } else { 0.0 };
            finite
                .clone()
                .map(move |&(_, u, e)| u + sign * 2.0 * error(e))
        };
        let line = LinePlot::new()
            .with_data(finite.clone().map(|&(s, u, _)| (s, u)))
            .with_band(at(-1.0), at(1.0))
            .with_color(COLOURS[1])
            .with_stroke_width(1.4);
        if finite.clone().next().is_some() {
            plots.push(Plot::Line(line));
        }
    }
    if plots.is_empty() {
        return Err(NothingToDraw);
    }
    let mut layout = layout(
        &plots,
        &along.title,
        "length along all surfaces",
        &along.label,
    )
    .with_width(WIDTH)
    .with_height(HEIGHT)
    .with_force_margins(LEFT, RIGHT)
    .with_force_margins_y(TOP, BOTTOM)
    .with_x_axis_min(0.0)
    .with_x_axis_max(along.length);
    for (_, start) in along.surfaces.iter().skip(1) {
        let line = ReferenceLine::vertical(*start).with_color("#999999");
        layout = layout.with_reference_line(line);
    }
    let mut scene = render_multiple(plots, layout);
    let ends = along.surfaces.iter().skip(1).map(|(_, start)| *start);
    let ends = ends.chain([along.length]);
    let mut last = f64::NEG_INFINITY;
    for ((name, start), end) in along.surfaces.iter().zip(ends) {
        let middle = 0.5 * (start + end) / along.length;
        // Names of short surfaces stand side by side.
        let x = (LEFT + middle * (WIDTH - LEFT - RIGHT)).max(last + 13.0);
        last = x;
        scene.elements.push(Primitive::Text {
            x: x + 4.0,
            y: TOP - 8.0,
            content: name.clone(),
            size: 12,
            anchor: TextAnchor::Start,
            rotate: Some(-60.0),
            bold: false,
            color: None,
        });
    }
    Ok(scene)
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
        .with_stroke_width(1.8)
        .with_legend(curve.name.clone());
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

fn layout(plots: &[Plot], title: &str, x_label: &str, y_label: &str) -> Layout {
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
    use super::{
        Axis, Band, Curve, Figure, NothingToDraw, Style, band_svg, log_log_svg, power_of_ten,
    };

    fn figure(points: Vec<(f64, f64)>) -> Figure {
        Figure {
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
        let svg = log_log_svg(&figure).unwrap();
        for word in ["a &lt; b &amp; c", "walks", "error", "plain", "10²", "10⁻¹"] {
            assert!(svg.contains(word), "{word} in {svg}");
        }
    }

    /// The library draws what is below 10⁻¹⁰ on that line.
    #[test]
    fn small_ordinates_have_places_of_their_own() {
        let small = (0..4).map(|i| (1.0 + f64::from(i), 10_f64.powi(-10 - 2 * i)));
        let svg = log_log_svg(&figure(small.collect())).unwrap();
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
        assert_eq!(log_log_svg(&figure(odd.clone())), Err(NothingToDraw));
        let one = log_log_svg(&figure([odd, vec![(10.0, 1.0)]].concat())).unwrap();
        assert!(!one.contains("NaN") && !one.contains("inf"), "{one}");
    }

    #[test]
    fn a_band_of_any_number_of_points() {
        let mut band = Band {
            title: "profile".to_owned(),
            axis: Axis::Angle,
            name: "walks".to_owned(),
            points: vec![(0.0, 1.0, 0.1), (3.0, 2.0, 0.0), (1.0, f64::NAN, 0.1)],
            curves: Vec::new(),
        };
        let svg = band_svg(&band).unwrap();
        assert!(
            svg.contains("3π/2") && svg.contains("walks, 95 % band"),
            "{svg}"
        );
        assert!(!svg.contains("NaN"), "{svg}");
        band.points.truncate(1);
        assert!(band_svg(&band).is_ok());
        band.points.clear();
        assert_eq!(band_svg(&band), Err(NothingToDraw));
    }

    #[test]
    fn powers_of_ten() {
        assert_eq!(power_of_ten(1e-5), "10⁻⁵");
        assert_eq!(power_of_ten(1e12), "10¹²");
        assert_eq!(power_of_ten(1.0), "10⁰");
        assert_eq!(power_of_ten(0.5), "0.5");
    }
}
