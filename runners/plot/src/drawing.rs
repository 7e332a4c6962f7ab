//! The surfaces of a room as they were drawn, to see what is wrong with them.

use kuva::render::color::Color;
use kuva::render::render::{Primitive, Scene, TextAnchor};

use crate::scale::ticks;
use crate::{Error, raster};

/// Surfaces with their names, their active sides, and the ray on which light leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// The name of every surface and the vertices of its parts, the active side on the left. What is between two parts is
    /// not drawn.
    pub surfaces: Vec<(String, Vec<Vec<[f64; 2]>>)>,
    /// The start and the direction of a ray that leaves, if one does.
    pub ray: Option<[[f64; 2]; 2]>,
    /// The label of both axes.
    pub label: String,
}

/// The longer side of the room, and what is around it, in pixels.
const ACROSS: f64 = 800.0;
const MARGIN: f64 = 90.0;
/// The length of a normal, and the size of the text.
const NORMAL: f64 = 12.0;
const TEXT: u32 = 13;

const INK: Color = Color::Rgb(34, 34, 34);
const FAINT: Color = Color::Rgb(150, 150, 150);
/// The vermilion of Okabe and Ito.
const RAY: Color = Color::Rgb(213, 94, 0);
/// Their blue.
const SIDE: Color = Color::Rgb(0, 114, 178);

/// From coordinates to pixels.
struct View {
    low: [f64; 2],
    high: [f64; 2],
    scale: f64,
}

impl View {
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            MARGIN + (x - self.low[0]) * self.scale,
            MARGIN + (self.high[1] - y) * self.scale,
        ]
    }

    /// The width or the height of the page.
    fn page(&self, axis: usize) -> f64 {
        (self.high[axis] - self.low[axis]) * self.scale + 2.0 * MARGIN
    }
}

impl Drawing {
    /// The text of an SVG file.
    ///
    /// # Errors
    /// [`Error::NothingToDraw`] if the surfaces have no extent.
    pub fn svg(&self) -> Result<String, Error> {
        let view = self.view()?;
        let mut out = Vec::new();
        self.axes(&view, &mut out);
        for (name, parts) in &self.surfaces {
            surface(name, parts, &view, &mut out);
        }
        if let Some(ray) = self.ray {
            leaving(ray, &view, &mut out);
        }
        let mut scene = Scene::new(view.page(0).ceil(), view.page(1).ceil());
        scene.elements = out;
        raster::svg(&[], scene)
    }

    fn view(&self) -> Result<View, Error> {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in self.surfaces.iter().flat_map(|(_, parts)| parts).flatten() {
            for axis in [0, 1] {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        let size = (high[0] - low[0]).max(high[1] - low[1]);
        if !(size > 0.0 && size.is_finite()) {
            return Err(Error::NothingToDraw);
        }
        let scale = ACROSS / size;
        Ok(View { low, high, scale })
    }

    /// Round coordinates below and on the left.
    fn axes(&self, view: &View, out: &mut Vec<Primitive>) {
        let bottom = view.page(1) - 0.5 * MARGIN;
        let left = 0.5 * MARGIN;
        for axis in [0, 1] {
            for at in ticks(view.low[axis], view.high[axis], false) {
                let mut point = view.low;
                point[axis] = at;
                let [x, y] = view.place(point);
                let label = format!("{at}");
                if axis == 0 {
                    line([x, bottom], [x, bottom + 5.0], FAINT, 1.0, out);
                    text(&label, [x, bottom + 20.0], TextAnchor::Middle, INK, out);
                } else {
                    line([left - 5.0, y], [left, y], FAINT, 1.0, out);
                    text(&label, [left - 8.0, y + 4.0], TextAnchor::End, INK, out);
                }
            }
        }
        let [from, to] = [view.low, [view.high[0], view.low[1]]].map(|point| view.place(point)[0]);
        line([from, bottom], [to, bottom], FAINT, 1.0, out);
        let [from, to] = [view.low, [view.low[0], view.high[1]]].map(|point| view.place(point)[1]);
        line([left, from], [left, to], FAINT, 1.0, out);
        let end = [view.page(0) - 0.5 * MARGIN, bottom + 20.0];
        text(&self.label, end, TextAnchor::Middle, INK, out);
    }
}

/// A surface with a normal on the active side of every segment, and its name behind the longest.
fn surface(name: &str, parts: &[Vec<[f64; 2]>], view: &View, out: &mut Vec<Primitive>) {
    let mut longest = (0.0, None);
    for two in parts.iter().flat_map(|points| points.windows(2)) {
        let [a, b] = [two[0], two[1]].map(|point| view.place(point));
        line(a, b, INK, 2.0, out);
        let span = [b[0] - a[0], b[1] - a[1]];
        let length = span[0].hypot(span[1]);
        if !(length > 0.0) {
            continue;
        }
        let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        // On the page y goes down: the left is where it is less on the way to the right.
        let left = [span[1] / length, -span[0] / length];
        let tip = [middle[0] + NORMAL * left[0], middle[1] + NORMAL * left[1]];
        line(middle, tip, SIDE, 2.0, out);
        if length > longest.0 {
            longest = (length, Some((middle, left)));
        }
    }
    if let (_, Some(([x, y], left))) = longest {
        let at = [x - 1.4 * NORMAL * left[0], y - 1.4 * NORMAL * left[1] + 4.0];
        let anchor = match left[0] {
            across if across > 0.5 => TextAnchor::End,
            across if across < -0.5 => TextAnchor::Start,
            _ => TextAnchor::Middle,
        };
        text(name, at, anchor, SIDE, out);
    }
}

/// The ray as far as the page goes.
fn leaving([from, direction]: [[f64; 2]; 2], view: &View, out: &mut Vec<Primitive>) {
    let [x, y] = view.place(from);
    let length = direction[0].hypot(direction[1]);
    let [dx, dy] = [direction[0] / length, -direction[1] / length];
    let room = |at: f64, step: f64, page: f64| {
        if step > 0.0 {
            (page - at) / step
        } else if step < 0.0 {
            -at / step
        } else {
            f64::INFINITY
        }
    };
    let far = room(x, dx, view.page(0)).min(room(y, dy, view.page(1)));
    line([x, y], [x + far * dx, y + far * dy], RAY, 2.0, out);
    line([x - 5.0, y - 5.0], [x + 5.0, y + 5.0], RAY, 2.0, out);
    line([x - 5.0, y + 5.0], [x + 5.0, y - 5.0], RAY, 2.0, out);
    let words = "light leaves here, or meets a wall from behind";
    text(
        words,
        [0.5 * view.page(0), 24.0],
        TextAnchor::Middle,
        RAY,
        out,
    );
}

fn line(
    [x1, y1]: [f64; 2],
    [x2, y2]: [f64; 2],
    stroke: Color,
    width: f64,
    out: &mut Vec<Primitive>,
) {
    out.push(Primitive::Line {
        x1,
        y1,
        x2,
        y2,
        stroke,
        stroke_width: width,
        stroke_dasharray: None,
    });
}

fn text(
    content: &str,
    [x, y]: [f64; 2],
    anchor: TextAnchor,
    color: Color,
    out: &mut Vec<Primitive>,
) {
    out.push(Primitive::Text {
        x,
        y,
        content: content.to_owned(),
        size: TEXT,
        anchor,
        rotate: None,
        bold: false,
        color: Some(color),
    });
}

#[cfg(test)]
mod tests {
    use super::Drawing;
    use crate::Error;

    #[test]
    fn a_drawing_has_names_axes_and_the_ray() {
        let drawing = Drawing {
            surfaces: vec![("floor <1>".to_owned(), vec![vec![[0.0, 0.0], [4.0, 0.0]]])],
            ray: Some([[2.0, 0.0], [0.0, 1.0]]),
            label: "m".to_owned(),
        };
        let svg = drawing.svg().unwrap();
        for word in ["floor &lt;1&gt;", ">4<", ">m<", "light leaves here"] {
            assert!(svg.contains(word), "{word} in {svg}");
        }
        let closed = Drawing {
            ray: None,
            ..drawing
        };
        assert!(!closed.svg().unwrap().contains("light leaves"));
        let nothing = Drawing {
            surfaces: vec![],
            ..closed
        };
        assert_eq!(nothing.svg(), Err(Error::NothingToDraw));
    }
}
