//! What is around the picture of a room: axes, a scale bar, and the names of its surfaces.

use core::ops::Range;

use kuva::render::color::Color;
use kuva::render::render::{PathData, Primitive, TextAnchor};

use crate::picture::{CHARACTER, polygon, text, tick};
use crate::scale::ticks;
use crate::strips::Strip;
use crate::{Canvas, Wall};

/// Characters that are kept free for the labels of the colours, and for temperatures beside them.
const LABEL: f64 = 8.0;
const KELVIN: f64 = 5.0;
/// Fewer pixels are no picture.
const FEWEST: f64 = 60.0;

/// Places around the panels of a picture, in pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    /// The size of the text.
    pub(crate) size: f64,
    /// The room for the names of surfaces, on all sides of a panel.
    pub(crate) band: f64,
    /// From the left edge of the page to the first panel.
    pub(crate) left: f64,
    /// From one panel to the next.
    pub(crate) between: f64,
    /// From the last panel to the right edge of the page, at most.
    pub(crate) right: f64,
}

impl Layout {
    /// Text of this size beside axes whose labels have so many characters.
    pub(crate) fn new(size: f64, characters: usize, has_kelvin: bool) -> Self {
        let small = 0.85 * size;
        let wide = |characters: f64| characters * CHARACTER * small;
        let band = 1.5 * size;
        let kelvin = if has_kelvin {
            wide(KELVIN) + 0.5 * size
        } else {
            0.0
        };
        Self {
            size,
            band,
            left: (0.6 * size + wide(characters as f64) + 0.6 * size + band).round(),
            between: (2.0 * band + size).round(),
            right: (band + size + kelvin + 1.65 * size + wide(LABEL) + 0.3 * size).ceil(),
        }
    }
}

/// The size of the text of a picture of this width.
pub(crate) fn text_size(width: usize) -> f64 {
    (width as f64 / 60.0).clamp(11.0, 32.0)
}

/// The most characters of a label of the vertical axis.
pub(crate) fn characters(low: f64, high: f64) -> usize {
    let labels = ticks(low, high, false).into_iter();
    labels.map(|at| at.to_string().len()).max().unwrap_or(1)
}

/// The pixels that are left for every panel of a picture of this width, if they are enough.
pub fn panel_width(walls: &[Wall], width: usize, panels: usize, has_kelvin: bool) -> Option<usize> {
    let heights = || walls.iter().flat_map(|wall| wall.ends).map(|[_, y]| y);
    let (low, high) = (
        heights().fold(f64::INFINITY, f64::min),
        heights().fold(f64::NEG_INFINITY, f64::max),
    );
    let layout = Layout::new(text_size(width), characters(low, high), has_kelvin);
    let panels = panels.max(1) as f64;
    let own = width as f64 - layout.left - layout.right - (panels - 1.0) * layout.between;
    let own = (own / panels).floor();
    (own >= FEWEST).then_some(own as usize)
}

/// Draws axes around a panel, its first pixel at `at`, and the names of surfaces beside their walls.
pub(crate) struct Frame<'a> {
    pub(crate) canvas: &'a Canvas,
    pub(crate) layout: Layout,
    pub(crate) at: [f64; 2],
    /// The unit of lengths; `None` of what has none.
    pub(crate) unit: Option<&'a str>,
}

impl Frame<'_> {
    /// From coordinates to pixels of the page.
    fn place(&self, point: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.canvas.place(point);
        [x + self.at[0], y + self.at[1]]
    }

    /// The horizontal axis, and the vertical one of the first panel.
    pub(crate) fn axes(&self, is_first: bool, out: &mut Vec<Primitive>) {
        let [low, high] = self.canvas.extent();
        let (size, small) = (self.layout.size, 0.85 * self.layout.size);
        let bottom = self.at[1] + self.canvas.height() as f64 + self.layout.band;
        let left = self.at[0] - self.layout.band;
        let [from, to] = [low, high].map(|point| self.place(point));
        out.push(tick([from[0], bottom], [to[0], bottom]));
        let mut free = f64::NEG_INFINITY;
        for at in ticks(low[0], high[0], false) {
            let (x, label) = (self.place([at, low[1]])[0], at.to_string());
            out.push(tick([x, bottom], [x, bottom + 0.3 * size]));
            let half = 0.5 * CHARACTER * small * label.len() as f64;
            if x - half > free {
                let y = bottom + 0.4 * size + small;
                out.push(text(&label, [x, y], small, TextAnchor::Middle));
                free = x + half + 0.5 * size;
            }
        }
        if !is_first {
            return;
        }
        out.push(tick([left, from[1]], [left, to[1]]));
        let mut free = f64::INFINITY;
        for at in ticks(low[1], high[1], false) {
            let y = self.place([low[0], at])[1];
            out.push(tick([left - 0.3 * size, y], [left, y]));
            if y < free {
                let end = [left - 0.45 * size, y + 0.35 * small];
                out.push(text(&at.to_string(), end, small, TextAnchor::End));
                free = y - 1.1 * small;
            }
        }
        if let Some(unit) = self.unit {
            self.scale_bar(unit, bottom + 0.4 * size + 1.2 * small, out);
        }
    }

    /// A bar of a round length, at most a quarter of the room's width.
    fn scale_bar(&self, unit: &str, top: f64, out: &mut Vec<Primitive>) {
        let [low, high] = self.canvas.extent();
        let (size, small) = (self.layout.size, 0.85 * self.layout.size);
        let most = 0.25 * (high[0] - low[0]).max(high[1] - low[1]);
        let power = 10.0_f64.powf(most.log10().floor());
        let round = [5.0, 2.0, 1.0].map(|m| m * power);
        let Some(length) = round.into_iter().find(|&length| length <= most) else {
            return;
        };
        let [x, end] = [low[0], low[0] + length].map(|x| self.place([x, low[1]])[0]);
        let y = top + 0.5 * small;
        for [from, to] in [
            [[x, y], [end, y]],
            [[x, y - 0.25 * size], [x, y + 0.25 * size]],
            [[end, y - 0.25 * size], [end, y + 0.25 * size]],
        ] {
            out.push(Primitive::Line {
                x1: from[0],
                y1: from[1],
                x2: to[0],
                y2: to[1],
                stroke: Color::Rgb(34, 34, 34),
                stroke_width: 2.0,
                stroke_dasharray: None,
            });
        }
        // Of 0.1 as 0.1, and not 0.1000…1.
        let digits = (-power.log10().round()).max(0.0) as usize;
        let label = format!("{length:.digits$} {unit}");
        let at = [end + 0.5 * size, y + 0.35 * small];
        out.push(text(label.trim_end(), at, small, TextAnchor::Start));
    }

    /// Names behind the longest walls of surfaces, those of long walls first; one that would lie on another is left out. Returns
    /// the corners of their boxes.
    pub(crate) fn names(
        &self,
        names: &[(String, Range<usize>)],
        page: f64,
        out: &mut Vec<Primitive>,
    ) -> Vec<[[f64; 2]; 2]> {
        let longest = |(name, walls): &(String, Range<usize>)| {
            let strips = self.canvas.strips().get(walls.clone())?.iter();
            let strip = *strips.max_by(|a, b| a.length().total_cmp(&b.length()))?;
            Some((strip, name.clone()))
        };
        let mut all: Vec<(Strip, String)> = names.iter().filter_map(longest).collect();
        all.sort_by(|a, b| b.0.length().total_cmp(&a.0.length()));
        let small = 0.8 * self.layout.size;
        let mut taken: Vec<[[f64; 2]; 2]> = Vec::new();
        for (strip, name) in all {
            let [from, to, ..] = strip.corners(0.0, 1.0);
            let normal = strip.normal();
            let middle = |k: usize| 0.5 * (from[k] + to[k]) - 0.85 * small * normal[k] + self.at[k];
            let centre = [middle(0), middle(1)];
            // Read from the left, or upwards.
            let mut angle = (to[1] - from[1]).atan2(to[0] - from[0]);
            if angle.cos() < 1e-9 {
                angle += core::f64::consts::PI;
            }
            if (angle.cos().abs()) < 1e-6 {
                angle = -core::f64::consts::FRAC_PI_2;
            }
            let (sine, cosine) = angle.sin_cos();
            let half = [
                0.5 * CHARACTER * small * name.chars().count() as f64,
                0.6 * small,
            ];
            let corner = |a: f64, b: f64| {
                [
                    centre[0] + a * half[0] * cosine - b * half[1] * sine,
                    centre[1] + a * half[0] * sine + b * half[1] * cosine,
                ]
            };
            let corners = [
                corner(-1.0, -1.0),
                corner(1.0, -1.0),
                corner(1.0, 1.0),
                corner(-1.0, 1.0),
            ];
            let bound = |k: usize, f: fn(f64, f64) -> f64| {
                corners
                    .iter()
                    .map(|corner| corner[k])
                    .reduce(f)
                    .unwrap_or(f64::NAN)
            };
            let own = [
                [bound(0, f64::min), bound(1, f64::min)],
                [bound(0, f64::max), bound(1, f64::max)],
            ];
            let meets = |other: &[[f64; 2]; 2]| {
                (0..2).all(|k| own[0][k] < other[1][k] && other[0][k] < own[1][k])
            };
            if taken.iter().any(meets) || own[0][0] < 0.0 || own[1][0] > page {
                continue;
            }
            taken.push(own);
            // On light or dark it can be read.
            if let Primitive::Path(path) = polygon(&corners, Color::Rgb(255, 255, 255)) {
                let opacity = Some(0.75);
                out.push(Primitive::Path(Box::new(PathData { opacity, ..*path })));
            }
            let base = [
                centre[0] - 0.35 * small * sine,
                centre[1] + 0.35 * small * cosine,
            ];
            let mut label = text(&name, base, small, TextAnchor::Middle);
            if let Primitive::Text { rotate, .. } = &mut label {
                *rotate = (angle.abs() > 1e-6).then_some(angle.to_degrees());
            }
            out.push(label);
        }
        taken
    }

    /// Dots at places, and their names beside them, where no other mark's name is, and if there is such a place no `name` of a
    /// surface.
    pub(crate) fn marks(
        &self,
        marks: &[(String, [f64; 2])],
        names: &[[[f64; 2]; 2]],
        out: &mut Vec<Primitive>,
    ) {
        let small = 0.8 * self.layout.size;
        let radius = 0.25 * small;
        let dots: Vec<[f64; 2]> = marks.iter().map(|(_, at)| self.place(*at)).collect();
        for [cx, cy] in &dots {
            // Seen on light and on dark.
            out.push(Primitive::Circle {
                cx: *cx,
                cy: *cy,
                r: radius,
                fill: Color::Rgb(255, 255, 255),
                fill_opacity: None,
                stroke: Some(Color::Rgb(34, 34, 34)),
                stroke_width: Some(1.0),
            });
        }
        let mut taken: Vec<[[f64; 2]; 2]> = Vec::new();
        for ((name, _), [x, y]) in marks.iter().zip(dots) {
            if name.is_empty() {
                continue;
            }
            let wide = CHARACTER * small * name.chars().count() as f64;
            let away = radius + 0.3 * small;
            let [low, high] = [self.at[0], self.at[0] + self.canvas.width() as f64];
            let boxes = [
                [x + away, y - 0.6 * small],
                [x - away - wide, y - 0.6 * small],
                [x - 0.5 * wide, y - away - 1.2 * small],
                [x - 0.5 * wide, y + away],
            ]
            .map(|[left, top]| [[left, top], [left + wide, top + 1.2 * small]]);
            let is_free = |own: &[[f64; 2]; 2], others: &[[[f64; 2]; 2]]| {
                let meets = |other: &[[f64; 2]; 2]| {
                    (0..2).all(|k| own[0][k] < other[1][k] && other[0][k] < own[1][k])
                };
                own[0][0] >= low && own[1][0] <= high && !others.iter().any(meets)
            };
            let mut own = boxes.iter().filter(|own| is_free(own, &taken));
            let first = own.clone().next();
            let best = own.find(|own| is_free(own, names)).or(first);
            let Some(&[[left, top], [right, bottom]]) = best else {
                continue;
            };
            taken.push([[left, top], [right, bottom]]);
            out.push(Primitive::Rect {
                x: left,
                y: top,
                width: right - left,
                height: bottom - top,
                fill: Color::Rgb(255, 255, 255),
                stroke: None,
                stroke_width: None,
                opacity: Some(0.75),
            });
            let at = [0.5 * (left + right), top + 0.95 * small];
            out.push(text(name, at, small, TextAnchor::Middle));
        }
    }
}
