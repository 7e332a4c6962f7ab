//! Surfaces as they were drawn, with their names, to see what is wrong with them.

use kuva::render::color::Color;
use kuva::render::render::TextAnchor;

use crate::frame::{Behind, Frame, Layout, bounds};
use crate::page::{INK, Page, Place};
use crate::{Canvas, Error, Figure, Wall};

/// The surfaces of a room with their active sides, and the ray on which light leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// The name of every surface and the vertices of its parts, the active side on the left. What is between two parts is
    /// not drawn.
    pub surfaces: Vec<(String, Vec<Vec<[f64; 2]>>)>,
    /// The start and the direction of a ray that leaves, if one does.
    pub ray: Option<[[f64; 2]; 2]>,
    /// The unit of lengths; empty if it is not known.
    pub unit: String,
}

/// The longer side of what is drawn, in pixels.
const ACROSS: usize = 800;
/// The length of a normal, and the size of the text.
const NORMAL: f64 = 9.0;
const TEXT: f64 = 14.0;

/// The vermilion of Okabe and Ito.
const RAY: Color = Color::Rgb(213, 94, 0);
/// Their blue.
const SIDE: Color = Color::Rgb(0, 114, 178);

impl Drawing {
    /// The figure.
    ///
    /// # Errors
    /// [`Error::NothingToDraw`]: the surfaces have no extent.
    pub fn draw(&self) -> Result<Figure, Error> {
        let mut walls = Vec::new();
        let mut names = Vec::new();
        for (name, parts) in &self.surfaces {
            let first = walls.len();
            for two in parts.iter().flat_map(|points| points.windows(2)) {
                let (ends, number) = ([two[0], two[1]], 2 * walls.len() as u32);
                let vertices = [number, number + 1];
                if ends[0] != ends[1] {
                    walls.push(Wall { vertices, ends });
                }
            }
            names.push((name.clone(), first..walls.len()));
        }
        let canvas = Canvas::new(&walls, ACROSS, 0, 1.0)?;
        let ([width, height], [low, high]) = (canvas.size(), canvas.extent());
        let layout = Layout::new(1.2 * TEXT, [low[1], high[1]], false);
        let [left, top] = layout.origin(true).map(|x| x as f64);
        let page_size = [
            left + width as f64 + layout.band + TEXT,
            top + height as f64 + layout.band + 3.5 * TEXT,
        ];
        let frame = Frame {
            canvas: &canvas,
            layout,
            at: [left, top],
            unit: Some(&self.unit),
        };
        let mut page = Page::default();
        frame.axes(true, &mut page);
        for strip in canvas.strips() {
            let [from, to, ..] = strip.corners(0.0, 1.0);
            let [from, to] = [from, to].map(|[x, y]| [x + left, y + top]);
            page.line(from, to, INK, 2.0);
            let middle = [0, 1].map(|k| 0.5 * (from[k] + to[k]));
            let tip = [0, 1].map(|k| middle[k] + NORMAL * strip.normal()[k]);
            page.line(middle, tip, SIDE, 2.0);
        }
        for (strip, name) in frame.longest(&names) {
            Behind::new(strip, frame.at, TEXT, 1.2 * TEXT).write(name, SIDE, &mut page);
        }
        if let Some([from, direction]) = self.ray {
            leaving(frame.place(from), direction, page_size, &mut page);
        }
        Ok(page.figure(page_size.map(f64::ceil)))
    }
}

/// A ray as far as the page goes.
fn leaving([x, y]: Place, direction: [f64; 2], page_size: Place, page: &mut Page) {
    let length = direction[0].hypot(direction[1]);
    let [dx, dy] = [direction[0] / length, -direction[1] / length];
    let far = |at: f64, step: f64, end: f64| {
        let edge = if step > 0.0 { end } else { 0.0 };
        let steps = (edge - at) / step;
        if step == 0.0 { f64::INFINITY } else { steps }
    };
    let far = far(x, dx, page_size[0]).min(far(y, dy, page_size[1]));
    page.line([x, y], [x + far * dx, y + far * dy], RAY, 2.0);
    for slope in [-5.0, 5.0] {
        page.line([x - 5.0, y - slope], [x + 5.0, y + slope], RAY, 2.0);
    }
    let words = "light leaves here, or meets a wall from behind";
    let above = [0.5 * page_size[0], 1.2 * TEXT];
    page.label(words, above, TEXT, TextAnchor::Middle, RAY, None);
}

/// Planar polygons in space, seen from the front, the right and above.
///
/// ```
/// use fredholm_plot::SpaceDrawing;
///
/// let floor = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// let drawing = SpaceDrawing { surfaces: vec![("floor".to_owned(), vec![floor.to_vec()])] };
/// assert!(drawing.draw()?.svg()?.contains(">floor</text>"));
/// # Ok::<(), fredholm_plot::Error>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct SpaceDrawing {
    /// The name of each surface, and the vertices of its polygons, counterclockwise seen from the active side.
    pub surfaces: Vec<(String, Vec<Vec<[f64; 3]>>)>,
}

/// A polygon on the paper.
struct Drawn {
    points: Vec<[f64; 2]>,
    /// The largest is behind.
    depth: f64,
    surface: usize,
    /// Twice its area, above 0 if its active side is seen.
    area: f64,
}

impl Drawn {
    fn new(surface: usize, polygon: &[[f64; 3]]) -> Self {
        let points: Vec<_> = polygon.iter().map(|&point| project(point).0).collect();
        let depths = polygon.iter().map(|&point| project(point).1);
        let sides = points.iter().zip(points.iter().cycle().skip(1));
        Self {
            depth: depths.sum::<f64>() / polygon.len() as f64,
            surface,
            area: sides.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum(),
            points,
        }
    }
}

/// Where a point is on the paper, in the scene's unit, and how far away: from the front, the right and above.
fn project([x, y, z]: [f64; 3]) -> ([f64; 2], f64) {
    let (cosine, sine) = (0.866_025_403_784_438_6, 0.5);
    let (right, away) = (cosine * x + sine * y, cosine * y - sine * x);
    ([right, sine * away + cosine * z], cosine * away - sine * z)
}

impl SpaceDrawing {
    /// The figure. Active sides are pale, backs are grey and see-through.
    ///
    /// # Errors
    /// [`Error::NothingToDraw`]: the surfaces have no extent.
    pub fn draw(&self) -> Result<Figure, Error> {
        let mut all = Vec::new();
        for (surface, (_, polygons)) in self.surfaces.iter().enumerate() {
            all.extend(polygons.iter().map(|own| Drawn::new(surface, own)));
        }
        let points = all.iter().flat_map(|drawn| &drawn.points);
        let canvas = Canvas::over(bounds(points.copied()), ACROSS, 40)?;
        all.sort_by(|a, b| b.depth.total_cmp(&a.depth));
        let mut page = Page::default();
        for drawn in &all {
            let points: Vec<Place> = drawn.points.iter().map(|&at| canvas.place(at)).collect();
            let hue = 47 * drawn.surface % 360;
            let (fill, opacity) = match drawn.area > 0.0 {
                true => (format!("hsl({hue},60%,80%)").into(), 0.9),
                false => (Color::Rgb(153, 153, 153), 0.12),
            };
            page.polygon(&points, fill, opacity, 0.6);
        }
        for (surface, (name, _)) in self.surfaces.iter().enumerate() {
            let own = all.iter().filter(|drawn| drawn.surface == surface);
            let largest = own.max_by(|a, b| a.area.abs().total_cmp(&b.area.abs()));
            let Some(Drawn { points, .. }) = largest else {
                continue;
            };
            let middle = [0, 1].map(|k| {
                let sum: f64 = points.iter().map(|point| point[k]).sum();
                sum / points.len() as f64
            });
            page.text(name, canvas.place(middle), TEXT, TextAnchor::Middle);
        }
        Ok(page.figure(canvas.size().map(|pixels| pixels as f64)))
    }
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
            unit: "m".to_owned(),
        };
        let svg = |drawing: &Drawing| drawing.draw().and_then(|figure| figure.svg());
        let text = svg(&drawing).unwrap();
        for word in ["floor &lt;1&gt;", ">4<", ">1 m<", "light leaves here"] {
            assert!(text.contains(word), "{word} in {text}");
        }
        let closed = Drawing {
            ray: None,
            ..drawing
        };
        assert!(!svg(&closed).unwrap().contains("light leaves"));
        let nothing = Drawing {
            surfaces: vec![],
            ..closed
        };
        assert_eq!(svg(&nothing), Err(Error::NothingToDraw));
    }
}
