//! Figures as SVG: curves on log-log axes, and a profile with its error band.
//!
//! The drawing library sets the frame, grid and tick labels; what it has no rule for is
//! decided here: where the decades are, how wide the legend is, where long text breaks.
//! Logarithms are taken before the library sees a value: its own logarithmic axis reaches
//! its ticks by repeated multiplication and loses the first or last decade to rounding.

use core::error::Error;
use core::f64::consts::{FRAC_PI_2, PI, TAU};
use core::fmt;
use core::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::element::DashedPathElement;
use plotters::prelude::{
    Cartesian2d, ChartBuilder, ChartContext, Color, DrawingArea, DrawingAreaErrorKind,
    FontTransform, IntoDrawingArea, IntoFont, PathElement, Polygon, RGBColor, SVGBackend,
    ShapeStyle, TextStyle, WHITE,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// A curve of a figure
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    /// What the legend calls it; an empty name keeps it out of the legend
    pub(crate) name: String,
    /// The points, joined in this order
    pub(crate) points: Vec<(f64, f64)>,
    /// How it is drawn
    pub(crate) style: Style,
}

impl Curve {
    /// The power law through `from` up to the abscissa `to`: a straight line of slope
    /// `exponent` on log-log axes, drawn as a reference
    pub(crate) fn power_law(
        name: impl Into<String>,
        exponent: f64,
        from: (f64, f64),
        to: f64,
    ) -> Self {
        let end = from.1 * (to / from.0).powf(exponent);
        Self {
            name: name.into(),
            points: vec![from, (to, end)],
            style: Style::REFERENCE,
        }
    }
}

/// How a curve is drawn
#[derive(Clone, Copy, Debug)]
pub(crate) struct Style {
    /// Which colour of the palette: black, blue, vermillion, green, purple, orange, sky
    /// blue, grey, and around again
    pub(crate) colour: usize,
    /// Which marker sits on the points: disc, square, triangle, diamond, triangle on its
    /// tip, and around again
    pub(crate) marker: Option<usize>,
    /// Whether the line is dashed
    pub(crate) dashed: bool,
}

impl Style {
    /// Grey dashes: what is there to compare with, not a result
    pub(crate) const REFERENCE: Self = Self {
        colour: 7,
        marker: None,
        dashed: true,
    };
}

/// A figure with logarithmic axes
#[derive(Clone, Debug)]
pub(crate) struct Figure {
    /// What stands above it
    pub(crate) title: String,
    /// What runs to the right, with its unit if it has one
    pub(crate) x_label: String,
    /// What runs upwards, with its unit if it has one
    pub(crate) y_label: String,
    /// The curves; later ones lie on top of earlier ones
    pub(crate) curves: Vec<Curve>,
}

/// A profile with its error band, on linear axes
#[derive(Clone, Debug)]
pub(crate) struct Band {
    /// What stands above it
    pub(crate) title: String,
    /// What runs to the right, with its unit if it has one
    pub(crate) x_label: String,
    /// What runs upwards, with its unit if it has one
    pub(crate) y_label: String,
    /// What the legend calls the profile
    pub(crate) name: String,
    /// Abscissa, value and standard error, in any order
    pub(crate) points: Vec<(f64, f64, f64)>,
    /// Lines to compare with, such as the exact solution
    pub(crate) curves: Vec<Curve>,
    /// Whether the abscissa is an angle in radians, with ticks at quarter turns
    pub(crate) x_is_angle: bool,
}

/// Why there is no figure
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum FigureError {
    /// No point can be drawn on these axes
    NothingToDraw,
    /// The drawing library refused
    Drawing(String),
}

impl fmt::Display for FigureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NothingToDraw => f.write_str("the figure has no point that can be drawn"),
            Self::Drawing(reason) => write!(f, "the figure could not be drawn: {reason}"),
        }
    }
}

impl Error for FigureError {}

impl<E: Error + Send + Sync> From<DrawingAreaErrorKind<E>> for FigureError {
    fn from(error: DrawingAreaErrorKind<E>) -> Self {
        Self::Drawing(error.to_string())
    }
}

/// The text of an SVG file with the curves of `figure` on log-log axes
///
/// A point with a coordinate that is not finite or not positive has no place on such axes
/// and is skipped; a curve with no other points is left out, of the legend too.
pub(crate) fn log_log_svg(figure: &Figure) -> Result<String, FigureError> {
    let traces = traces(&figure.curves, |(x, y)| {
        let drawable = x.is_finite() && y.is_finite() && x > 0.0 && y > 0.0;
        drawable.then(|| (x.log10(), y.log10()))
    });
    let xs = traces.iter().flat_map(|t| &t.points).map(|p| p.0);
    let ys = traces.iter().flat_map(|t| &t.points).map(|p| p.1);
    let (x, y) = (log_axis(xs)?, log_axis(ys)?);
    draw(&Sheet {
        title: &figure.title,
        x_label: &figure.x_label,
        y_label: &figure.y_label,
        x,
        y,
        areas: Vec::new(),
        traces,
    })
}

/// The text of an SVG file with a profile and its 95 % error band on linear axes
///
/// A point with a coordinate or standard error that is not finite, or a negative standard
/// error, is skipped.
pub(crate) fn band_svg(band: &Band) -> Result<String, FigureError> {
    let mut points: Vec<_> = band
        .points
        .iter()
        .copied()
        .filter(|&(x, u, error)| fits(x) && fits(u) && fits(error) && error >= 0.0)
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    if points.is_empty() {
        return Err(FigureError::NothingToDraw);
    }
    let below = points.iter().map(|&(x, u, error)| (x, u - Z_95 * error));
    let above = points.iter().map(|&(x, u, error)| (x, u + Z_95 * error));
    let outline: Vec<_> = below.chain(above.rev()).collect();

    let mut traces = traces(&band.curves, |(x, y)| {
        (fits(x) && fits(y)).then_some((x, y))
    });
    // Beneath the lines it is compared with: dashes on a line show, a line on dashes hides them.
    traces.insert(
        0,
        Trace {
            name: &band.name,
            points: points.iter().map(|&(x, u, _)| (x, u)).collect(),
            style: Style {
                colour: BAND_COLOUR,
                marker: None,
                dashed: false,
            },
        },
    );
    let all = || outline.iter().chain(traces.iter().flat_map(|t| &t.points));
    let x = linear_axis(all().map(|p| p.0), 0.02, 6.0, band.x_is_angle)?;
    let y = linear_axis(all().map(|p| p.1), 0.05, 8.0, false)?;
    draw(&Sheet {
        title: &band.title,
        x_label: &band.x_label,
        y_label: &band.y_label,
        x,
        y,
        areas: vec![Area {
            name: "95 % error band",
            outline: outline.clone(),
            colour: BAND_COLOUR,
        }],
        traces,
    })
}

/// Half the width of the 95 % band in standard errors
const Z_95: f64 = 1.96;

/// The colour of a profile and its band
const BAND_COLOUR: usize = 1;

/// Width of the figure in pixels
const WIDTH: f64 = 860.0;

/// Least height of the figure in pixels; a long legend makes it taller
const HEIGHT: f64 = 560.0;

/// Drawing units per pixel: the library places everything on whole units, and whole pixels
/// would make steps of a smooth curve
const SCALE: f64 = 10.0;

/// Size of the title in pixels
const TITLE: f64 = 18.0;

/// Size of the axis labels in pixels
const LABEL: f64 = 14.0;

/// Size of tick labels and legend in pixels
const SMALL: f64 = 13.0;

/// From one line of text to the next, in sizes
const LEADING: f64 = 1.35;

/// Width of a letter in sizes, on the wide side: the reader's font is not known here
const LETTER: f64 = 0.6;

/// Letters in a line of the legend
const LEGEND_LETTERS: usize = 26;

/// Most lines of one text: without a limit, a very long one would leave the axes no room
const MOST_LINES: usize = 4;

/// From one entry of the legend to the next, in pixels
const ENTRY_GAP: f64 = 6.0;

/// Length of a line sample in the legend, in pixels
const SAMPLE: f64 = 30.0;

/// Most labelled decades on an axis
const MOST_DECADES: f64 = 10.0;

/// Text and axes
const INK: RGBColor = RGBColor(34, 34, 34);

/// The grid
const GRID: RGBColor = RGBColor(225, 225, 225);

/// The colours of Okabe and Ito, told apart by colour-blind readers too, but for their
/// yellow, which is too faint for a line on white; and a grey
const PALETTE: [RGBColor; 8] = [
    RGBColor(0, 0, 0),
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(120, 120, 120),
];

/// Markers as regular polygons: corners, angle of the first corner, radius in pixels such
/// that they look equally large
const MARKERS: [(u8, f64, f64); 5] = [
    (32, 0.0, 4.2),
    (4, TAU / 8.0, 5.2),
    (3, -TAU / 4.0, 5.8),
    (4, 0.0, 5.4),
    (3, TAU / 4.0, 5.8),
];

/// The whole drawing
type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The part of it between the axes, which `'b` borrows
type Axes<'a, 'b> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<&'b Axis, &'b Axis>>;

/// A place on the canvas, in drawing units
type Place = (i32, i32);

/// An axis in its own coordinate: the value, or its decimal logarithm
#[derive(Debug)]
struct Axis {
    /// Where it begins
    low: f64,
    /// Where it ends
    high: f64,
    /// Where a grid line crosses it, with what is written there
    ticks: Vec<(f64, String)>,
    /// Where it has a small mark only
    marks: Vec<f64>,
}

impl Ranged for &Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        RangedCoordf64::from(self.range()).map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        // The library asks again for a finer grid, which there is none of.
        if hint.weight().allow_light_points() {
            return Vec::new();
        }
        self.ticks.iter().map(|tick| tick.0).collect()
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for &Axis {
    fn format_ext(&self, value: &f64) -> String {
        let tick = self.ticks.iter().find(|tick| tick.0 == *value);
        tick.map_or_else(String::new, |tick| tick.1.clone())
    }
}

/// What is left of a curve, in the coordinates of the axes
#[derive(Debug)]
struct Trace<'a> {
    /// What the legend calls it
    name: &'a str,
    /// The points
    points: Vec<(f64, f64)>,
    /// How it is drawn
    style: Style,
}

/// A shaded region, in the coordinates of the axes
#[derive(Debug)]
struct Area<'a> {
    /// What the legend calls it
    name: &'a str,
    /// Its corners
    outline: Vec<(f64, f64)>,
    /// Which colour of the palette
    colour: usize,
}

/// All that is drawn
#[derive(Debug)]
struct Sheet<'a> {
    /// What stands above it
    title: &'a str,
    /// What runs to the right
    x_label: &'a str,
    /// What runs upwards
    y_label: &'a str,
    /// The axis to the right
    x: Axis,
    /// The axis upwards
    y: Axis,
    /// What is shaded, beneath the lines
    areas: Vec<Area<'a>>,
    /// The lines
    traces: Vec<Trace<'a>>,
}

/// The curves with `place` applied to their points, without those it has no place for and
/// without curves that have none left
fn traces(curves: &[Curve], place: impl Fn((f64, f64)) -> Option<(f64, f64)>) -> Vec<Trace<'_>> {
    curves
        .iter()
        .map(|curve| Trace {
            name: &curve.name,
            points: curve.points.iter().copied().filter_map(&place).collect(),
            style: curve.style,
        })
        .filter(|trace| !trace.points.is_empty())
        .collect()
}

/// Whether a linear axis has room for `value`: the ends of an axis may be twice as far apart
/// and padded, which must not overflow
fn fits(value: f64) -> bool {
    value.abs() < 1e300
}

/// The least and the greatest value, if there is one
fn extent(values: impl Iterator<Item = f64>) -> Result<(f64, f64), FigureError> {
    values
        .fold(None, |range: Option<(f64, f64)>, v| {
            Some(range.map_or((v, v), |(low, high)| (low.min(v), high.max(v))))
        })
        .ok_or(FigureError::NothingToDraw)
}

/// The axis of decimal logarithms `values`, with a tick at each decade or every few of them
fn log_axis(values: impl Iterator<Item = f64>) -> Result<Axis, FigureError> {
    let (low, high) = extent(values)?;
    // Room for the markers; a tenth of a decade where all values are one.
    let pad = ((high - low) * 0.04).max(0.1);
    let (mut low, mut high) = (low - pad, high + pad);
    if high.floor() - low.ceil() < 1.0 {
        // One label says nothing about the scale: go out to the decades around.
        (low, high) = (low.floor(), high.ceil());
    }
    let step = round_step((high - low) / MOST_DECADES).max(1.0);
    let ticks = multiples(low, high, step)
        .map(|k| (k * step, power_of_ten(k * step)))
        .collect();
    // With decades left out, marks between them would be read as belonging to one decade.
    let marks = if step > 1.0 {
        Vec::new()
    } else {
        multiples(low.floor(), high, 1.0)
            .flat_map(|decade| (2..10).map(move |digit| decade + f64::from(digit).log10()))
            .filter(|mark| (low..=high).contains(mark))
            .collect()
    };
    Ok(Axis {
        low,
        high,
        ticks,
        marks,
    })
}

/// The axis of `values` themselves, padded by the fraction `pad` on either side, with about
/// `most` ticks at round numbers or, of an angle, at quarter turns
fn linear_axis(
    values: impl Iterator<Item = f64>,
    pad: f64,
    most: f64,
    angle: bool,
) -> Result<Axis, FigureError> {
    let (mut low, mut high) = extent(values)?;
    if angle && high - low > PI {
        // Points around a circle stop one step before the full turn; the axis need not.
        low = (low / FRAC_PI_2 + 1e-6).floor() * FRAC_PI_2;
        high = (high / FRAC_PI_2 - 1e-6).ceil() * FRAC_PI_2;
    }
    let size = low.abs().max(high.abs());
    // Values that agree to the last digits leave nothing to scale by.
    let pad = if high - low > size * 1e-9 {
        (high - low) * pad
    } else if size > 0.0 {
        size * 0.1
    } else {
        1.0
    };
    let (low, high) = (low - pad, high + pad);

    let quarters: Vec<_> = multiples(low, high, FRAC_PI_2).collect();
    let ticks = if angle && (2..=9).contains(&quarters.len()) {
        let label = |k: f64| (k * FRAC_PI_2, quarter_turns(k));
        quarters.into_iter().map(label).collect()
    } else {
        let step = round_step((high - low) / most);
        multiples(low, high, step)
            .map(|k| (k * step, decimal(k * step, step)))
            .collect()
    };
    Ok(Axis {
        low,
        high,
        ticks,
        marks: Vec::new(),
    })
}

/// The factors that `step` has between `low` and `high`, at most as many as an axis can show
fn multiples(low: f64, high: f64, step: f64) -> impl Iterator<Item = f64> {
    let first = (low / step).ceil();
    let last = (high / step).floor();
    // Adding zero makes a tick at minus zero one at zero.
    (0..=20)
        .map(move |i| first + f64::from(i) + 0.0)
        .take_while(move |&k| k <= last)
}

/// The 1, 2 or 5 times a power of ten that is at least `rough`
fn round_step(rough: f64) -> f64 {
    let decade = 10_f64.powf(rough.log10().floor());
    let lead = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|lead| lead * decade >= rough);
    lead.unwrap_or(10.0) * decade
}

/// A tick's number with the digits that tell it from its neighbours at `step`
fn decimal(value: f64, step: f64) -> String {
    let digit = (step.log10() + 1e-9).floor();
    let text = if value == 0.0 {
        "0".to_owned()
    } else if (-4.0..6.0).contains(&digit) && value.abs() < 1e7 {
        format!("{value:.*}", (-digit).max(0.0) as usize)
    } else {
        let lead = (value.abs().log10() + 1e-9).floor();
        format!("{value:.*e}", (lead - digit).clamp(0.0, 16.0) as usize)
    };
    text.replace('-', "\u{2212}")
}

/// `10` with `exponent` above it
fn power_of_ten(exponent: f64) -> String {
    let raised = |c| match c {
        '-' => '⁻',
        '0' => '⁰',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        '9' => '⁹',
        other => other,
    };
    let exponent: String = format!("{exponent:.0}").chars().map(raised).collect();
    format!("10{exponent}")
}

/// `quarters` quarter turns in radians
fn quarter_turns(quarters: f64) -> String {
    let (count, over) = if quarters % 2.0 == 0.0 {
        (quarters / 2.0, "")
    } else {
        (quarters, "/2")
    };
    let text = if count == 0.0 {
        "0".to_owned()
    } else if count.abs() == 1.0 {
        format!("{}π{over}", if count < 0.0 { "-" } else { "" })
    } else {
        format!("{count:.0}π{over}")
    };
    text.replace('-', "\u{2212}")
}

/// `text` in lines of at most `letters`, broken at spaces where there are any, cut after
/// [`MOST_LINES`], and without the characters that XML forbids
fn lines(text: &str, letters: usize) -> Vec<String> {
    let letters = letters.max(1);
    let forbidden = |c: char| c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}');
    let mut lines = Vec::new();
    let mut line = String::new();
    let mut room = letters;
    for word in text.split(|c: char| c == ' ' || forbidden(c)) {
        let length = word.chars().count();
        if !line.is_empty() {
            if length < room {
                line.push(' ');
                room -= 1;
            } else {
                lines.push(core::mem::take(&mut line));
                room = letters;
            }
        }
        for letter in word.chars() {
            if room == 0 {
                lines.push(core::mem::take(&mut line));
                room = letters;
            }
            line.push(letter);
            room -= 1;
        }
    }
    if !line.is_empty() {
        lines.push(line);
    }
    if lines.len() > MOST_LINES {
        lines.truncate(MOST_LINES);
        if let Some(last) = lines.last_mut() {
            last.push('…');
        }
    }
    lines
}

/// How many letters of `size` go into `length` pixels
fn letters_in(length: f64, size: f64) -> usize {
    (length / (size * LETTER)).max(1.0) as usize
}

/// How wide the widest of `texts` of `size` may be, in pixels
fn widest<'a>(texts: impl Iterator<Item = &'a String>, size: f64) -> f64 {
    let letters = texts.map(|text| text.chars().count()).max().unwrap_or(0);
    letters as f64 * size * LETTER
}

/// How high `lines` of `size` stand, in pixels
fn height_of(lines: &[String], size: f64) -> f64 {
    lines.len() as f64 * size * LEADING
}

/// Pixels in drawing units
fn units(pixels: f64) -> i32 {
    (pixels * SCALE).round() as i32
}

/// A stroke of this many pixels
fn stroke(colour: RGBColor, pixels: f64) -> ShapeStyle {
    ShapeStyle::from(colour).stroke_width(units(pixels).unsigned_abs())
}

/// The colour of this index, around again after the last
fn colour(index: usize) -> RGBColor {
    PALETTE[index % PALETTE.len()]
}

/// Text of this size and anchor
fn text_style(size: f64, h_pos: HPos, v_pos: VPos) -> TextStyle<'static> {
    // The backend divides by 1.24 what it is given.
    let size = size * SCALE * 1.24;
    TextStyle::from(("sans-serif", size).into_font())
        .color(&INK)
        .pos(Pos::new(h_pos, v_pos))
}

/// The whole figure
fn draw(sheet: &Sheet<'_>) -> Result<String, FigureError> {
    // What the legend needs is set aside first, the axes get the rest.
    let legend: Vec<Vec<String>> = sheet
        .traces
        .iter()
        .map(|trace| trace.name)
        .chain(sheet.areas.iter().map(|area| area.name))
        .map(|name| lines(name, LEGEND_LETTERS))
        .collect();
    let names = widest(legend.iter().flatten(), SMALL);
    let legend_width = if names > 0.0 {
        16.0 + SAMPLE + 8.0 + names
    } else {
        0.0
    };
    let legend_height: f64 = legend
        .iter()
        .map(|entry| height_of(entry, SMALL) + ENTRY_GAP)
        .sum();

    let right = WIDTH - 18.0 - legend_width;
    let title = lines(sheet.title, letters_in(right - 40.0, TITLE));
    let top = 14.0 + height_of(&title, TITLE) + 10.0;
    let x_label = lines(sheet.x_label, letters_in(right - 90.0, LABEL));
    let under = 12.0 + SMALL * LEADING + 4.0 + height_of(&x_label, LABEL) + 12.0;
    let height = HEIGHT.max(top + legend_height + under).ceil();
    let bottom = height - under;
    let y_label = lines(sheet.y_label, letters_in(bottom - top, LABEL));
    let ticks = widest(sheet.y.ticks.iter().map(|tick| &tick.1), SMALL);
    let left = 12.0 + height_of(&y_label, LABEL) + 4.0 + ticks + 12.0;

    let size = (units(WIDTH).unsigned_abs(), units(height).unsigned_abs());
    let mut svg = String::new();
    {
        let canvas = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        canvas.fill(&WHITE)?;

        let middle = (left + right) / 2.0;
        let style = text_style(TITLE, HPos::Center, VPos::Top);
        draw_lines(&canvas, &title, TITLE, &style, (middle, 14.0))?;
        let style = text_style(LABEL, HPos::Center, VPos::Top);
        let below = bottom + 12.0 + SMALL * LEADING + 4.0;
        draw_lines(&canvas, &x_label, LABEL, &style, (middle, below))?;
        let style = style.transform(FontTransform::Rotate270);
        for (i, line) in y_label.iter().enumerate() {
            let x = 12.0 + i as f64 * LABEL * LEADING;
            canvas.draw_text(line, &style, (units(x), units((top + bottom) / 2.0)))?;
        }

        let axes = draw_axes(&canvas, sheet, [left, right, top, bottom])?;
        let place = |point: &(f64, f64)| axes.plotting_area().map_coordinate(point);
        for area in &sheet.areas {
            let outline: Vec<_> = area.outline.iter().map(&place).collect();
            draw_area(&canvas, &outline, area.colour)?;
        }
        for trace in &sheet.traces {
            let points: Vec<_> = trace.points.iter().map(&place).collect();
            draw_trace(&canvas, &points, &points, trace.style)?;
        }

        draw_legend(&canvas, sheet, &legend, (right + 16.0, top))?;
        canvas.present()?;
    }

    // The drawing units are finer than pixels; the figure is to appear in its own size.
    let header = format!("<svg width=\"{}\" height=\"{}\"", size.0, size.1);
    Ok(match svg.strip_prefix(&header) {
        Some(rest) => format!("<svg width=\"{WIDTH}\" height=\"{height}\"{rest}"),
        None => svg,
    })
}

/// Grid, frame, ticks and their labels between `left`, `right`, `top` and `bottom`
fn draw_axes<'a, 'b>(
    canvas: &Canvas<'a>,
    sheet: &'b Sheet<'_>,
    [left, right, top, bottom]: [f64; 4],
) -> Result<Axes<'a, 'b>, FigureError> {
    let (width, height) = canvas.dim_in_pixel();
    let mut chart = ChartBuilder::on(canvas)
        .margin_top(units(top))
        .margin_right(width as i32 - units(right))
        .x_label_area_size(height as i32 - units(bottom))
        .y_label_area_size(units(left))
        .build_cartesian_2d(&sheet.x, &sheet.y)?;

    chart
        .configure_mesh()
        .bold_line_style(stroke(GRID, 0.8))
        .axis_style(stroke(INK, 1.0))
        .label_style(text_style(SMALL, HPos::Center, VPos::Center))
        .set_all_tick_mark_size(units(5.0))
        .draw()?;

    let area = chart.plotting_area();
    let mark = units(3.0);
    for &at in &sheet.x.marks {
        let (x, y) = area.map_coordinate(&(at, sheet.y.low));
        canvas.draw(&PathElement::new([(x, y), (x, y + mark)], stroke(INK, 0.8)))?;
    }
    for &at in &sheet.y.marks {
        let (x, y) = area.map_coordinate(&(sheet.x.low, at));
        canvas.draw(&PathElement::new([(x, y), (x - mark, y)], stroke(INK, 0.8)))?;
    }
    Ok(chart)
}

/// A sample of each trace and area with its name in lines, from `at` downwards, in pixels
fn draw_legend(
    canvas: &Canvas<'_>,
    sheet: &Sheet<'_>,
    entries: &[Vec<String>],
    at: (f64, f64),
) -> Result<(), FigureError> {
    let style = text_style(SMALL, HPos::Left, VPos::Center);
    let (x, mut y) = at;
    for (i, entry) in entries.iter().enumerate() {
        if entry.is_empty() {
            continue;
        }
        // The sample stands beside the first of an entry's lines.
        let row = y + SMALL * LEADING / 2.0;
        let (from, to) = ((units(x), units(row)), (units(x + SAMPLE), units(row)));
        if let Some(trace) = sheet.traces.get(i) {
            let middle = ((from.0 + to.0) / 2, from.1);
            draw_trace(canvas, &[from, to], &[middle], trace.style)?;
        } else if let Some(area) = sheet.areas.get(i - sheet.traces.len()) {
            let (up, down) = (units(row - 5.0), units(row + 5.0));
            let outline = vec![(from.0, up), (to.0, up), (to.0, down), (from.0, down)];
            draw_area(canvas, &outline, area.colour)?;
        }
        draw_lines(canvas, entry, SMALL, &style, (x + SAMPLE + 8.0, row))?;
        y += height_of(entry, SMALL) + ENTRY_GAP;
    }
    Ok(())
}

/// `lines` of `size` below one another from `at`, in pixels
fn draw_lines(
    canvas: &Canvas<'_>,
    lines: &[String],
    size: f64,
    style: &TextStyle<'_>,
    at: (f64, f64),
) -> Result<(), FigureError> {
    for (i, line) in lines.iter().enumerate() {
        let y = at.1 + i as f64 * size * LEADING;
        canvas.draw_text(line, style, (units(at.0), units(y)))?;
    }
    Ok(())
}

/// A line through `points` with markers on `marked`
fn draw_trace(
    canvas: &Canvas<'_>,
    points: &[Place],
    marked: &[Place],
    style: Style,
) -> Result<(), FigureError> {
    let ink = colour(style.colour);
    if style.dashed {
        let (dash, gap) = (units(7.0), units(4.5));
        let points = points.iter().copied();
        canvas.draw(&DashedPathElement::new(points, dash, gap, stroke(ink, 1.5)))?;
    } else {
        canvas.draw(&PathElement::new(points, stroke(ink, 1.8)))?;
    }
    // A single point without a marker would not be seen at all.
    let lone = (points.len() == 1).then_some(0);
    if let Some(marker) = style.marker.or(lone) {
        for &centre in marked {
            // A white rim keeps markers apart that lie on one another.
            canvas.draw(&Polygon::new(
                marker_outline(marker, centre, 1.0),
                WHITE.filled(),
            ))?;
            canvas.draw(&Polygon::new(
                marker_outline(marker, centre, 0.0),
                ink.filled(),
            ))?;
        }
    }
    Ok(())
}

/// A shaded region
fn draw_area(canvas: &Canvas<'_>, outline: &[Place], index: usize) -> Result<(), FigureError> {
    let ink = colour(index);
    canvas.draw(&Polygon::new(outline, ink.mix(0.2).filled()))?;
    // The edge is all that shows of a region without width, such as the band of one point.
    let edge = outline.iter().chain(outline.first()).copied();
    let width = units(0.8).unsigned_abs();
    let style = ShapeStyle::from(ink.mix(0.4)).stroke_width(width);
    canvas.draw(&PathElement::new(edge.collect::<Vec<_>>(), style))?;
    Ok(())
}

/// The corners of a marker around `centre`, by `rim` pixels larger than it is
fn marker_outline(index: usize, centre: Place, rim: f64) -> Vec<Place> {
    let (corners, first, radius) = MARKERS[index % MARKERS.len()];
    (0..corners)
        .map(|corner| {
            let angle = first + TAU * f64::from(corner) / f64::from(corners);
            let (sin, cos) = angle.sin_cos();
            let radius = radius + rim;
            (
                centre.0 + units(radius * cos),
                centre.1 + units(radius * sin),
            )
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(name: &str, points: &[(f64, f64)]) -> Curve {
        Curve {
            name: name.to_owned(),
            points: points.to_vec(),
            style: Style {
                colour: 1,
                marker: Some(0),
                dashed: false,
            },
        }
    }

    fn figure(curves: Vec<Curve>) -> Figure {
        Figure {
            title: "Error against walks".to_owned(),
            x_label: "walks N".to_owned(),
            y_label: "mean absolute error".to_owned(),
            curves,
        }
    }

    fn band(points: &[(f64, f64, f64)]) -> Band {
        Band {
            title: "Profile".to_owned(),
            x_label: "angle s (rad)".to_owned(),
            y_label: "u(s)".to_owned(),
            name: "estimate".to_owned(),
            points: points.to_vec(),
            curves: vec![curve("exact solution", &[(0.0, 1.0), (6.0, 1.0)])],
            x_is_angle: true,
        }
    }

    /// The texts between the tags, in order
    fn texts(svg: &str) -> Vec<&str> {
        svg.lines().filter(|line| !line.starts_with('<')).collect()
    }

    /// How many filled markers there are of the colour of `curve`
    fn markers(svg: &str) -> usize {
        svg.matches("<polygon opacity=\"1\" fill=\"#0072B2\"")
            .count()
    }

    #[test]
    fn everything_named_is_there() {
        let reference = Curve::power_law("slope -1/2", -0.5, (10.0, 1.0), 1e6);
        let curves = vec![curve("plain", &[(10.0, 1.26), (1e6, 0.0072)]), reference];
        let svg = log_log_svg(&figure(curves)).unwrap();
        let texts = texts(&svg);
        for text in [
            "Error against walks",
            "walks N",
            "mean absolute error",
            "plain",
            "slope -1/2",
            "10¹",
            "10⁶",
            "10⁻²",
            "10⁰",
        ] {
            assert!(texts.contains(&text), "{text} is not in {texts:?}");
        }
        assert!(svg.starts_with("<svg width=\"860\" height=\"560\" viewBox=\"0 0 8600 5600\""));
        assert!(svg.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn same_figure_same_bytes() {
        let figure = figure(vec![curve("a", &[(1.0, 2.0), (3.0, 0.04)])]);
        assert_eq!(log_log_svg(&figure), log_log_svg(&figure));
        let band = band(&[(0.0, 1.0, 0.1), (3.0, 2.0, 0.1)]);
        assert_eq!(band_svg(&band), band_svg(&band));
    }

    #[test]
    fn nothing_to_draw_is_an_error() {
        let none: [&[(f64, f64)]; 3] = [&[], &[(0.0, 1.0)], &[(1.0, f64::NAN), (-1.0, 1.0)]];
        assert_eq!(
            log_log_svg(&figure(vec![])),
            Err(FigureError::NothingToDraw)
        );
        for points in none {
            let figure = figure(vec![curve("a", points)]);
            assert_eq!(log_log_svg(&figure), Err(FigureError::NothingToDraw));
        }
        for points in [
            vec![],
            vec![(1.0, f64::INFINITY, 0.1), (1.0, 1.0, f64::NAN)],
        ] {
            assert_eq!(band_svg(&band(&points)), Err(FigureError::NothingToDraw));
        }
        let text = FigureError::NothingToDraw.to_string();
        assert_eq!(text, "the figure has no point that can be drawn");
    }

    #[test]
    fn what_has_no_logarithm_is_skipped() {
        let good = [(1.0, 2.0), (10.0, 0.3)];
        let bad = [
            (0.0, 1.0),
            (1.0, 0.0),
            (1.0, -2.0),
            (f64::NAN, 1.0),
            (2.0, f64::NAN),
            (f64::INFINITY, 1.0),
            (3.0, f64::NEG_INFINITY),
        ];
        let mixed = [&good[..1], &bad, &good[1..]].concat();
        let clean = log_log_svg(&figure(vec![curve("a", &good)])).unwrap();
        let svg = log_log_svg(&figure(vec![curve("a", &mixed), curve("lost", &bad)])).unwrap();
        assert_eq!(svg, clean);
        // Two points and the sample in the legend.
        assert_eq!(markers(&svg), 3);
    }

    #[test]
    fn profile_skips_what_is_not_finite_and_sorts() {
        let clean = band_svg(&band(&[(0.0, 1.0, 0.1), (3.0, 2.0, 0.1)])).unwrap();
        let mixed = band(&[
            (3.0, 2.0, 0.1),
            (1.0, f64::NAN, 0.1),
            (2.0, 1.0, -0.1),
            (0.0, 1.0, 0.1),
        ]);
        assert_eq!(band_svg(&mixed).unwrap(), clean);
        let texts = texts(&clean);
        for text in [
            "Profile",
            "angle s (rad)",
            "u(s)",
            "estimate",
            "95 % error band",
            "exact solution",
            "0",
            "π/2",
            "π",
            "3π/2",
            "2π",
        ] {
            assert!(texts.contains(&text), "{text} is not in {texts:?}");
        }
    }

    #[test]
    fn ranges_without_width_and_huge_ones_are_drawn() {
        let cases: [&[(f64, f64)]; 5] = [
            &[(1.0, 1.0)],
            &[(7.0, 0.3)],
            &[(10.0, 0.25), (1000.0, 0.25)],
            &[(5e-324, 5e-324), (f64::MAX, f64::MAX)],
            &[(5e-324, 5e-324)],
        ];
        for points in cases {
            let svg = log_log_svg(&figure(vec![curve("a", points)])).unwrap();
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{points:?}");
            assert_eq!(markers(&svg), points.len() + 1, "{points:?}");
            assert!(texts(&svg).iter().filter(|t| t.starts_with("10")).count() >= 4);
        }
        let profiles: [&[(f64, f64, f64)]; 5] = [
            &[(0.0, 0.0, 0.0)],
            &[(1.0, 1e-200, 1e-203)],
            &[(0.0, -9e299, 9e299), (1.0, 9e299, 9e299)],
            &[(0.0, 5e-324, 0.0)],
            &[(0.0, 1.0, 0.0), (1.0, 1.0 + 1e-15, 0.0)],
        ];
        for points in profiles {
            let mut band = band(points);
            band.curves.clear();
            let svg = band_svg(&band).unwrap();
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{points:?}");
        }
    }

    #[test]
    fn text_is_escaped_and_kept_to_what_xml_allows() {
        let mut figure = figure(vec![curve("a < b", &[(1.0, 1.0)])]);
        figure.title = "R&D \u{1}<script>".to_owned();
        let svg = log_log_svg(&figure).unwrap();
        let texts = texts(&svg);
        assert!(texts.contains(&"a &lt; b"));
        assert!(texts.contains(&"R&amp;D  &lt;script&gt;"), "{texts:?}");
        assert!(!svg.contains('\u{1}') && !svg.contains("<script"));
    }

    #[test]
    fn long_text_breaks_and_a_long_legend_makes_room() {
        assert_eq!(lines("one two three", 7), ["one two", "three"]);
        assert_eq!(lines("abcdefgh ij", 3), ["abc", "def", "gh", "ij"]);
        assert_eq!(lines("a b c d e f", 1), ["a", "b", "c", "d…"]);
        assert!(lines("", 5).is_empty());
        let curves = (0..60).map(|i| curve(&format!("curve {i}"), &[(1.0, 2.0)]));
        let svg = log_log_svg(&figure(curves.collect())).unwrap();
        assert!(texts(&svg).contains(&"curve 59"));
        assert!(!svg.starts_with("<svg width=\"860\" height=\"560\""));
    }

    #[test]
    fn tick_labels() {
        assert_eq!(power_of_ten(-12.0), "10⁻¹²");
        let turns = [-1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0].map(quarter_turns);
        assert_eq!(
            turns,
            ["\u{2212}π/2", "0", "π/2", "π", "3π/2", "2π", "5π/2"]
        );
        assert_eq!(decimal(3.0 * 0.1, 0.1), "0.3");
        assert_eq!(decimal(-40.0, 20.0), "\u{2212}40");
        assert_eq!(decimal(1.5e-7, 5e-8), "1.5e\u{2212}7");
        assert_eq!(decimal(2e9, 1e9), "2e9");
        let steps = [0.012, 0.3, 5.0, 70.0].map(round_step);
        assert_eq!(steps, [0.02, 0.5, 5.0, 100.0]);
    }
}
