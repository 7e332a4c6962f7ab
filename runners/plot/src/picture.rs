//! The picture of a room: light between walls, walls, legend.

use kuva::render::color::Color;
use kuva::render::render::{PathData, Primitive, Scene, TextAnchor};

use core::ops::Range;

use crate::contours::Isotherms;
use crate::frame::{Frame, Layout, characters, text_size};
use crate::legend::Legend;
use crate::raster::{self, Image};
use crate::scale::Scale;
use crate::{Canvas, Error, Piece};

/// The light of a room, and the heading above it.
#[derive(Clone, Debug)]
pub struct Panel<'a> {
    /// The heading, if any.
    pub heading: Option<String>,
    /// The value of every pixel, row by row; NaN where there is no room.
    pub air: &'a [f64],
    /// The value of every piece of wall.
    pub walls: &'a [f64],
    /// Red, green and blue of every pixel and of every piece, in the unit of the scale, if they are to have the colour of their
    /// light: that of the primaries of sRGB, of which what is beyond the end of the scale is cut off.
    pub colours: Option<&'a [[Vec<f64>; 3]; 2]>,
}

/// A picture of a room, with a legend and captions.
#[derive(Clone, Debug)]
pub struct RoomPicture<'a> {
    /// The pixels and the walls.
    pub canvas: &'a Canvas,
    /// The pieces of the walls, wall by wall.
    pub pieces: &'a [Piece],
    /// The colours of the values.
    pub scale: Scale,
    /// The quantity and unit of the values, above the scale.
    pub legend: &'a str,
    /// σ, if the values are radiosities of heat: beside the scale stands the temperature T of a black
    /// body with σT⁴ = u, and isotherms are drawn between the walls.
    pub stefan_boltzmann: Option<f64>,
    /// The lines of text below the picture.
    pub captions: Vec<String>,
    /// The width of the picture in pixels, whose panels have [`panel_width`](crate::panel_width) at most; `None` for as many
    /// as it takes.
    pub width: Option<usize>,
    /// The unit of lengths, beside the scale bar; empty if it is not known, and `None` without a bar, if axes are no lengths.
    pub unit: Option<&'a str>,
    /// The names of surfaces, and their walls.
    pub names: &'a [(String, Range<usize>)],
    /// Places that have a mark, with their names, which may be empty.
    pub marks: &'a [(String, [f64; 2])],
}

/// The width of a character over the size of its font, on the safe side.
pub(crate) const CHARACTER: f64 = 0.62;

impl RoomPicture<'_> {
    /// The text of an SVG file of the panels, side by side.
    pub fn svg(&self, panels: &[Panel<'_>]) -> Result<String, Error> {
        let (images, scene) = self.draw(panels)?;
        raster::svg(&images, scene)
    }

    /// A PNG file of the panels, side by side.
    pub fn png(&self, panels: &[Panel<'_>]) -> Result<Vec<u8>, Error> {
        let (images, scene) = self.draw(panels)?;
        raster::png(&images, scene)
    }

    /// The size of the text.
    fn size(&self) -> f64 {
        let longer = self.canvas.width().max(self.canvas.height());
        text_size(self.width.unwrap_or(longer))
    }

    fn layout(&self) -> Layout {
        let [low, high] = self.canvas.extent();
        let characters = characters(low[1], high[1]);
        Layout::new(self.size(), characters, self.stefan_boltzmann.is_some())
    }

    /// The place of the first pixel of the first panel from the upper left corner of the page.
    #[must_use]
    pub fn origin(&self, is_headed: bool) -> [usize; 2] {
        let layout = self.layout();
        let gap = layout.size.round();
        let top = 0.4 * gap + layout.band + if is_headed { 2.0 * gap } else { 0.0 };
        [layout.left as usize, top.round() as usize]
    }

    /// The images and what is drawn over them.
    fn draw(&self, panels: &[Panel<'_>]) -> Result<(Vec<Image>, Scene), Error> {
        for panel in panels {
            self.check(panel)?;
        }
        let layout = self.layout();
        let size = layout.size;
        let is_headed = panels.iter().any(|panel| panel.heading.is_some());
        let [mut left, top] = self.origin(is_headed);
        let (width, height) = (self.canvas.width(), self.canvas.height());
        let pitch = width + layout.between as usize;
        let page = self.width.map_or(f64::INFINITY, |width| width as f64);
        let (mut images, mut elements) = (Vec::new(), Vec::new());
        for (number, panel) in panels.iter().enumerate() {
            images.push(Image {
                x: left,
                y: top,
                width,
                height,
                pixels: self.pixels(panel),
            });
            if let Some(stefan_boltzmann) = self.stefan_boltzmann {
                let isotherms = Isotherms {
                    values: panel.air,
                    width,
                    stefan_boltzmann,
                    size: 0.75 * size,
                    at: [left as f64, top as f64],
                };
                isotherms.draw(&mut elements);
            }
            self.walls(panel, [left as f64, top as f64], &mut elements);
            let frame = Frame {
                canvas: self.canvas,
                layout,
                at: [left as f64, top as f64],
                unit: self.unit,
            };
            frame.axes(number == 0, &mut elements);
            let names = frame.names(self.names, page, &mut elements);
            frame.marks(self.marks, &names, &mut elements);
            if let Some(heading) = &panel.heading {
                let at = [(left + width / 2) as f64, 1.6 * size];
                elements.push(text(heading, at, size, TextAnchor::Middle));
            }
            left += pitch;
        }
        let after = (left - layout.between as usize) as f64 + layout.band + size;
        let legend = Legend {
            scale: self.scale,
            title: self.legend,
            stefan_boltzmann: self.stefan_boltzmann,
            size,
            height,
        };
        let right = legend.draw([after, top as f64], &mut elements);
        let page = self
            .width
            .map_or((right + 0.5 * size).ceil(), |width| width as f64);
        // Below the axis and the scale bar.
        let below = (top + height) as f64 + layout.band + 3.2 * size;
        let bottom = captions(&self.captions, size, [page, below], &mut elements);
        let mut scene = Scene::new(page, bottom);
        scene.elements = elements;
        Ok((images, scene))
    }

    /// Refuses a panel of another size.
    fn check(&self, panel: &Panel<'_>) -> Result<(), Error> {
        let pixels = self.canvas.width() * self.canvas.height();
        let mut lengths = vec![
            ("air", pixels, panel.air.len()),
            ("walls", self.pieces.len(), panel.walls.len()),
        ];
        if let Some([air, walls]) = panel.colours {
            lengths.extend(air.iter().map(|own| ("air", pixels, own.len())));
            let of_walls = walls.iter();
            lengths.extend(of_walls.map(|own| ("walls", self.pieces.len(), own.len())));
        }
        for (slice, expected, found) in lengths {
            if expected != found {
                return Err(Error::WrongLength {
                    slice,
                    expected,
                    found,
                });
            }
        }
        Ok(())
    }

    fn pixels(&self, panel: &Panel<'_>) -> Vec<Option<[u8; 3]>> {
        let light = panel.colours.map(|[air, _]| air);
        let shown = |(place, &value): (usize, &f64)| {
            (!value.is_nan()).then(|| self.scale.shown(value, place, light))
        };
        panel.air.iter().enumerate().map(shown).collect()
    }

    /// Pieces of one colour as one, each a little into the next, so that no seam shows.
    fn walls(&self, panel: &Panel<'_>, [x, y]: [f64; 2], out: &mut Vec<Primitive>) {
        let light = panel.colours.map(|[_, walls]| walls);
        let values = self.pieces.iter().zip(panel.walls).enumerate();
        let coloured = |(place, (piece, &value)): (usize, (&Piece, &f64))| {
            (*piece, self.scale.shown(value, place, light))
        };
        let pieces: Vec<(Piece, [u8; 3])> = values.map(coloured).collect();
        for run in pieces.chunk_by(|(a, first), (b, second)| a.wall == b.wall && first == second) {
            let (Some((first, colour)), Some((last, _))) = (run.first(), run.last()) else {
                continue;
            };
            let Some(strip) = self.canvas.strips().get(first.wall) else {
                continue;
            };
            let to = (last.to + 0.7 / strip.length()).min(1.0);
            let corners = strip.corners(first.from, to).map(|[a, b]| [a + x, b + y]);
            let [r, g, b] = *colour;
            out.push(polygon(&corners, Color::Rgb(r, g, b)));
        }
        // Where a wall is, between its two sides or before what is outside.
        for strip in self.canvas.strips() {
            let [a, b, ..] = strip.corners(0.0, 1.0);
            out.push(Primitive::Line {
                x1: a[0] + x,
                y1: a[1] + y,
                x2: b[0] + x,
                y2: b[1] + y,
                stroke: Color::Rgb(110, 110, 110),
                stroke_width: 1.0,
                stroke_dasharray: None,
            });
        }
    }
}

/// Writes lines of text below a picture of this width, from this height on; returns where the page ends.
pub(crate) fn captions(
    lines: &[String],
    size: f64,
    [page, mut bottom]: [f64; 2],
    out: &mut Vec<Primitive>,
) -> f64 {
    let small = 0.85 * size;
    let fits = ((page - 2.0 * size) / (CHARACTER * small)) as usize;
    for line in lines.iter().flat_map(|text| wrap(text, fits)) {
        bottom += 0.3 * small;
        out.push(text_start(&line, [0.8 * size, bottom], small));
        bottom += small;
    }
    (bottom + 0.2 * size).ceil()
}

pub(crate) fn text(content: &str, [x, y]: [f64; 2], size: f64, anchor: TextAnchor) -> Primitive {
    Primitive::Text {
        x,
        y,
        content: content.to_owned(),
        size: size.round() as u32,
        anchor,
        rotate: None,
        bold: false,
        color: Some(Color::Rgb(34, 34, 34)),
    }
}

pub(crate) fn text_start(content: &str, at: [f64; 2], size: f64) -> Primitive {
    text(content, at, size, TextAnchor::Start)
}

pub(crate) fn tick([x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) -> Primitive {
    Primitive::Line {
        x1,
        y1,
        x2,
        y2,
        stroke: Color::Rgb(34, 34, 34),
        stroke_width: 1.0,
        stroke_dasharray: None,
    }
}

pub(crate) fn polygon(corners: &[[f64; 2]], fill: Color) -> Primitive {
    let mut d = String::new();
    for (i, [x, y]) in corners.iter().enumerate() {
        let command = if i == 0 { 'M' } else { 'L' };
        d.push_str(&format!("{command}{x:.2} {y:.2}"));
    }
    d.push('Z');
    Primitive::Path(Box::new(PathData {
        d,
        fill: Some(fill),
        stroke: Color::None,
        stroke_width: 0.0,
        opacity: None,
        stroke_dasharray: None,
    }))
}

/// Lines of about so many characters.
fn wrap(text: &str, characters: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let line = lines.len() - 1;
        let own = lines[line].chars().count();
        if own > 0 && own + 1 + word.chars().count() > characters {
            lines.push(word.to_owned());
        } else {
            if own > 0 {
                lines[line].push(' ');
            }
            lines[line].push_str(word);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::{Panel, RoomPicture, wrap};
    use crate::{Canvas, Error, Scale, Wall};

    #[test]
    fn a_picture_has_its_words_and_refuses_panels_of_another_size() {
        let ends = [[0.0, 0.0], [4.0, 0.0]];
        let floor = Wall {
            vertices: [0, 1],
            ends,
        };
        let canvas = Canvas::new(&[floor], 60, 4, 3.0).unwrap();
        let pieces = canvas.pieces();
        let air = vec![2.0; canvas.width() * canvas.height()];
        let walls = vec![1.0; pieces.len()];
        let picture = RoomPicture {
            canvas: &canvas,
            pieces: &pieces,
            scale: Scale::new(air.iter().copied(), walls.iter().copied(), false),
            legend: "W/m²",
            stefan_boltzmann: Some(5.670_374_419e-8),
            captions: vec!["below <it>".to_owned()],
            width: None,
            unit: Some("m"),
            names: &[("the floor".to_owned(), 0..1)],
            marks: &[
                ("a".to_owned(), [1.0, 0.0]),
                ("b".to_owned(), [1.0, 0.0]),
                (String::new(), [2.0, 0.0]),
            ],
        };
        let panel = |air, walls| {
            let heading = Some("above it".to_owned());
            [Panel {
                heading,
                air,
                walls,
                colours: None,
            }]
        };
        let svg = picture.svg(&panel(&air, &walls)).unwrap();
        for word in [
            "above it",
            ">a<",
            ">b<",
            ">the floor<",
            ">1 m<",
            ">4<",
            "below &lt;it&gt;",
            "W/m²",
            ">K<",
            "image/png",
        ] {
            assert!(svg.contains(word), "{word} in {svg}");
        }
        assert_eq!(svg.matches("<circle").count(), 3, "{svg}");
        let png = picture.png(&panel(&air, &walls)).unwrap();
        assert!(png.starts_with(b"\x89PNG"));
        let wrong = |slice, expected| {
            Err(Error::WrongLength {
                slice,
                expected,
                found: expected - 1,
            })
        };
        let short = picture.svg(&panel(&air[1..], &walls));
        assert_eq!(short, wrong("air", air.len()));
        let short = picture.svg(&panel(&air, &walls[1..]));
        assert_eq!(short, wrong("walls", walls.len()));

        // In colours a wall has that of its light, and a list of another length is refused.
        let light = |walls: usize| {
            let of = |size: usize| [1.0, 0.0, 0.0].map(|level| vec![level; size]);
            [of(air.len()), of(walls)]
        };
        let in_colours = |colours| Panel {
            heading: None,
            air: &air,
            walls: &walls,
            colours: Some(colours),
        };
        let greys = RoomPicture {
            scale: Scale::between(0.0, 1.0, false).unwrap().in_greys(),
            ..picture
        };
        let red = light(walls.len());
        let svg = greys.svg(&[in_colours(&red)]).unwrap();
        assert!(svg.contains("#ff0000"), "{svg}");
        let short = greys.svg(&[in_colours(&light(walls.len() - 1))]);
        assert_eq!(short, wrong("walls", walls.len()));
    }

    #[test]
    fn lines_break_between_words() {
        assert_eq!(wrap("one two three", 7), ["one two", "three"]);
        assert_eq!(wrap("overlong a", 3), ["overlong", "a"]);
    }
}
