//! What is around the picture of a room: axes, a scale bar, and the names of its surfaces.

use core::f64::consts::{FRAC_PI_2, PI};
use core::ops::Range;

use kuva::render::color::Color;
use kuva::render::render::TextAnchor;

use crate::page::{INK, Page, Place, WHITE, width_of};
use crate::scale::ticks;
use crate::strips::Strip;
use crate::{Canvas, Wall};

/// Characters that are kept free for the labels of the colours, and for temperatures beside them.
const LABEL: &str = "12345.78";
const KELVIN: &str = "123.5";
/// Fewer pixels are no picture.
const FEWEST: f64 = 60.0;

/// Places around the panels of a picture, in pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    /// The size of the text.
    pub(crate) size: f64,
    /// The room for the names of surfaces, on all sides of a panel.
    pub(crate) band: f64,
    /// From one panel to the next.
    pub(crate) between: f64,
    /// From the left and the upper edge of the page to the first panel, without headings.
    left: f64,
    top: f64,
    /// From the last panel to the right edge of the page, at most.
    right: f64,
}

impl Layout {
    /// Text of this size around panels, which have nothing but headings.
    pub(crate) fn bare(size: f64) -> Self {
        let gap = size.round();
        Self {
            size,
            band: 0.0,
            between: gap,
            left: gap,
            top: gap,
            right: gap,
        }
    }

    /// Text of this size around panels with axes over these heights.
    pub(crate) fn new(size: f64, [low, high]: [f64; 2], has_kelvin: bool) -> Self {
        let small = 0.85 * size;
        let labels = ticks(low, high, false).into_iter().map(|at| at.to_string());
        let wide = labels.map(|label| width_of(&label, small));
        let wide = wide.fold(width_of("0", small), f64::max);
        let band = 1.5 * size;
        let kelvin = match has_kelvin {
            true => width_of(KELVIN, small) + 0.5 * size,
            false => 0.0,
        };
        Self {
            size,
            band,
            between: (2.0 * band + size).round(),
            left: (1.2 * size + wide + band).round(),
            top: 0.4 * size.round() + band,
            right: (band + 2.95 * size + kelvin + width_of(LABEL, small)).ceil(),
        }
    }

    /// The place of the first pixel.
    pub(crate) fn origin(&self, is_headed: bool) -> [usize; 2] {
        let heading = if is_headed {
            2.0 * self.size.round()
        } else {
            0.0
        };
        [self.left, self.top + heading].map(|x| x.round() as usize)
    }
}

/// The size of the text of a picture of this width.
pub(crate) fn text_size(width: usize) -> f64 {
    (width as f64 / 60.0).clamp(11.0, 32.0)
}

/// The pixels that are left for every panel of a picture of this width, if they are enough.
pub fn panel_width(walls: &[Wall], width: usize, panels: usize, has_kelvin: bool) -> Option<usize> {
    let [low, high] = bounds(walls.iter().flat_map(|wall| wall.ends));
    let layout = Layout::new(text_size(width), [low[1], high[1]], has_kelvin);
    let panels = panels.max(1) as f64;
    let own = width as f64 - layout.left - layout.right - (panels - 1.0) * layout.between;
    let own = (own / panels).floor();
    (own >= FEWEST).then_some(own as usize)
}

/// The corners of the least box around places.
pub(crate) fn bounds(places: impl Iterator<Item = Place>) -> [Place; 2] {
    places.fold(
        [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]],
        |[low, high], at| {
            [
                [low[0].min(at[0]), low[1].min(at[1])],
                [high[0].max(at[0]), high[1].max(at[1])],
            ]
        },
    )
}

/// Whether two boxes have a place in common.
fn meet(a: &[Place; 2], b: &[Place; 2]) -> bool {
    (0..2).all(|k| a[0][k] < b[1][k] && b[0][k] < a[1][k])
}

/// Draws axes around a panel, its first pixel at `at`, and the names of surfaces beside their walls.
pub(crate) struct Frame<'a> {
    pub(crate) canvas: &'a Canvas,
    pub(crate) layout: Layout,
    pub(crate) at: Place,
    /// The unit of lengths; `None` of what has none.
    pub(crate) unit: Option<&'a str>,
}

impl Frame<'_> {
    /// From coordinates to pixels of the page.
    pub(crate) fn place(&self, point: [f64; 2]) -> Place {
        let [x, y] = self.canvas.place(point);
        [x + self.at[0], y + self.at[1]]
    }

    /// The horizontal axis, and the vertical one of the first panel.
    pub(crate) fn axes(&self, is_first: bool, page: &mut Page) {
        let [low, high] = self.canvas.extent();
        let (size, small) = (self.layout.size, 0.85 * self.layout.size);
        let bottom = self.at[1] + self.canvas.size()[1] as f64 + self.layout.band;
        let left = self.at[0] - self.layout.band;
        let [from, to] = [low, high].map(|point| self.place(point));
        page.tick([from[0], bottom], [to[0], bottom]);
        let mut free = f64::NEG_INFINITY;
        for at in ticks(low[0], high[0], false) {
            let (x, label) = (self.place([at, low[1]])[0], at.to_string());
            page.tick([x, bottom], [x, bottom + 0.3 * size]);
            let half = 0.5 * width_of(&label, small);
            if x - half > free {
                let y = bottom + 0.4 * size + small;
                page.text(&label, [x, y], small, TextAnchor::Middle);
                free = x + half + 0.5 * size;
            }
        }
        if !is_first {
            return;
        }
        page.tick([left, from[1]], [left, to[1]]);
        let mut free = f64::INFINITY;
        for at in ticks(low[1], high[1], false) {
            let y = self.place([low[0], at])[1];
            page.tick([left - 0.3 * size, y], [left, y]);
            if y < free {
                let end = [left - 0.45 * size, y + 0.35 * small];
                page.text(&at.to_string(), end, small, TextAnchor::End);
                free = y - 1.1 * small;
            }
        }
        if let Some(unit) = self.unit {
            self.scale_bar(unit, bottom + 0.4 * size + 1.7 * small, page);
        }
    }

    /// A bar of a round length, at most a quarter of the room's width.
    fn scale_bar(&self, unit: &str, y: f64, page: &mut Page) {
        let [low, high] = self.canvas.extent();
        let (size, small) = (self.layout.size, 0.85 * self.layout.size);
        let most = 0.25 * (high[0] - low[0]).max(high[1] - low[1]);
        let power = 10.0_f64.powf(most.log10().floor());
        let round = [5.0, 2.0, 1.0].map(|m| m * power);
        let Some(length) = round.into_iter().find(|&length| length <= most) else {
            return;
        };
        let [x, end] = [low[0], low[0] + length].map(|x| self.place([x, low[1]])[0]);
        page.line([x, y], [end, y], INK, 2.0);
        for x in [x, end] {
            page.line([x, y - 0.25 * size], [x, y + 0.25 * size], INK, 2.0);
        }
        // Of 0.1 as 0.1, and not 0.1000…1.
        let digits = (-power.log10().round()).max(0.0) as usize;
        let label = format!("{length:.digits$} {unit}");
        let at = [end + 0.5 * size, y + 0.35 * small];
        page.text(label.trim_end(), at, small, TextAnchor::Start);
    }

    /// The longest wall of every surface with its name.
    pub(crate) fn longest<'s>(
        &'s self,
        names: &'s [(String, Range<usize>)],
    ) -> impl Iterator<Item = (&'s Strip, &'s str)> {
        names.iter().filter_map(|(name, walls)| {
            let strips = self.canvas.strips().get(walls.clone())?.iter();
            let longest = strips.max_by(|a, b| a.length().total_cmp(&b.length()))?;
            Some((longest, name.as_str()))
        })
    }

    /// Names behind the longest walls of surfaces, those of long walls first; one that would lie on another is left out. Returns
    /// the corners of their boxes.
    pub(crate) fn names(
        &self,
        names: &[(String, Range<usize>)],
        across: f64,
        page: &mut Page,
    ) -> Vec<[Place; 2]> {
        let mut all: Vec<_> = self.longest(names).collect();
        all.sort_by(|a, b| b.0.length().total_cmp(&a.0.length()));
        let size = 0.8 * self.layout.size;
        let mut taken = Vec::new();
        for (strip, name) in all {
            let behind = Behind::new(strip, self.at, size, 0.85 * size);
            let (wide, high) = (0.5 * width_of(name, size), 0.6 * size);
            let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
            let corners = corners.map(|[a, b]| behind.place(a * wide, b * high));
            let own = bounds(corners.into_iter());
            let is_hidden = taken.iter().any(|other| meet(&own, other));
            if is_hidden || own[0][0] < 0.0 || own[1][0] > across {
                continue;
            }
            taken.push(own);
            // On light or dark it can be read.
            page.polygon(&corners, WHITE, 0.75, 0.0);
            behind.write(name, INK, page);
        }
        taken
    }

    /// Dots at places, and their names beside them, where no other mark's name is, and if there is such a place no `name` of a
    /// surface.
    pub(crate) fn marks(
        &self,
        marks: &[(String, [f64; 2])],
        names: &[[Place; 2]],
        page: &mut Page,
    ) {
        let small = 0.8 * self.layout.size;
        let radius = 0.25 * small;
        let [low, high] = [self.at[0], self.at[0] + self.canvas.size()[0] as f64];
        for (_, at) in marks {
            page.dot(self.place(*at), radius);
        }
        let mut taken: Vec<[Place; 2]> = Vec::new();
        for (name, at) in marks.iter().filter(|(name, _)| !name.is_empty()) {
            let [x, y] = self.place(*at);
            let wide = width_of(name, small);
            let away = radius + 0.3 * small;
            let boxes = [
                [x + away, y - 0.6 * small],
                [x - away - wide, y - 0.6 * small],
                [x - 0.5 * wide, y - away - 1.2 * small],
                [x - 0.5 * wide, y + away],
            ]
            .map(|[left, top]| [[left, top], [left + wide, top + 1.2 * small]]);
            let mut own = boxes.into_iter().filter(|own| {
                let is_hidden = taken.iter().any(|other| meet(own, other));
                own[0][0] >= low && own[1][0] <= high && !is_hidden
            });
            let first = own.clone().next();
            let is_free = |own: &[Place; 2]| !names.iter().any(|other| meet(own, other));
            let Some(best) = own.find(is_free).or(first) else {
                continue;
            };
            taken.push(best);
            page.rectangle(best, WHITE, 0.75);
            let at = [best[0][0] + 0.5 * wide, best[0][1] + 0.95 * small];
            page.text(name, at, small, TextAnchor::Middle);
        }
    }
}

/// The place for a text of this size behind the middle of a wall, so far off it.
pub(crate) struct Behind {
    middle: Place,
    /// The direction of the text: from the left, or upwards.
    angle: f64,
    size: f64,
}

impl Behind {
    pub(crate) fn new(strip: &Strip, at: Place, size: f64, off: f64) -> Self {
        let [from, to, ..] = strip.corners(0.0, 1.0);
        let normal = strip.normal();
        let mut angle = (to[1] - from[1]).atan2(to[0] - from[0]);
        if angle.cos() < 1e-9 {
            angle += PI;
        }
        if angle.cos().abs() < 1e-6 {
            angle = -FRAC_PI_2;
        }
        let middle = [0, 1].map(|k| 0.5 * (from[k] + to[k]) - off * normal[k] + at[k]);
        Self {
            middle,
            angle,
            size,
        }
    }

    /// So far along the text, and down.
    fn place(&self, along: f64, down: f64) -> Place {
        let (sine, cosine) = self.angle.sin_cos();
        [
            self.middle[0] + along * cosine - down * sine,
            self.middle[1] + along * sine + down * cosine,
        ]
    }

    pub(crate) fn write(&self, name: &str, color: Color, page: &mut Page) {
        let turn = (self.angle.abs() > 1e-6).then_some(self.angle.to_degrees());
        let base = self.place(0.0, 0.35 * self.size);
        page.label(name, base, self.size, TextAnchor::Middle, color, turn);
    }
}
