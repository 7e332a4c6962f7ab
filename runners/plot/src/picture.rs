//! Numbers as the colours of pixels and of walls, with a legend and captions.

use core::ops::Range;

use kuva::render::color::Color;
use kuva::render::render::TextAnchor;

use crate::contours::Isotherms;
use crate::frame::{Frame, Layout, text_size};
use crate::legend::Legend;
use crate::page::{Figure, Image, Page, Place, width_of};
use crate::scale::Scale;
use crate::{Canvas, Error, Piece};

/// Numbers that are shown as colours.
#[derive(Clone, Debug, Default)]
pub struct Shades {
    /// The numbers; NaN where there is none.
    pub values: Vec<f64>,
    /// Red, green and blue of each in the unit of the scale, if they are to have the colours of their light: that of the primaries
    /// of sRGB, of which what is beyond the end of the scale is cut off.
    pub light: Option<[Vec<f64>; 3]>,
}

impl From<Vec<f64>> for Shades {
    fn from(values: Vec<f64>) -> Self {
        let light = None;
        Self { values, light }
    }
}

impl Shades {
    fn check(&self, slice: &'static str, expected: usize) -> Result<(), Error> {
        let light = self.light.iter().flatten();
        let mut lengths = light.chain([&self.values]).map(Vec::len);
        lengths.try_for_each(|found| Error::unless_equal(slice, expected, found))
    }

    /// The colours of all numbers that are there.
    fn colours(&self, scale: Scale) -> impl Iterator<Item = Option<[u8; 3]>> {
        self.values.iter().enumerate().map(move |(place, &value)| {
            let light = self.light.as_ref();
            let colour = || match light {
                Some(light) => light.each_ref().map(|own| scale.grey_level(own[place])),
                None => scale.colour(value),
            };
            (!value.is_nan()).then(colour)
        })
    }
}

/// The numbers of a picture, and the heading above them.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// The heading, if any.
    pub heading: Option<String>,
    /// The numbers of pixels, row by row.
    pub pixels: Shades,
    /// The numbers of the pieces of walls.
    pub walls: Shades,
}

/// What is drawn over the pixels of a room, and around them.
#[derive(Clone, Debug)]
pub struct Overlay<'a> {
    /// The place of the pixels and the walls.
    pub canvas: &'a Canvas,
    /// The pieces of the walls, wall by wall.
    pub pieces: &'a [Piece],
    /// The unit of lengths, beside the scale bar; empty if it is not known, and `None` without a bar, if axes are no lengths.
    pub unit: Option<&'a str>,
    /// The names of surfaces, and their walls.
    pub names: &'a [(String, Range<usize>)],
    /// Places that have a mark, with their names, which may be empty.
    pub marks: &'a [(String, [f64; 2])],
}

impl<'a> Overlay<'a> {
    /// Axes around a canvas, and nothing over it.
    #[must_use]
    pub const fn bare(canvas: &'a Canvas) -> Self {
        Self {
            canvas,
            pieces: &[],
            unit: None,
            names: &[],
            marks: &[],
        }
    }
}

/// A picture of a room, or of what a camera sees, with a legend and captions; or of several side by side.
#[derive(Clone, Debug)]
pub struct Picture<'a> {
    /// Pixels across a panel, and down.
    pub size: [usize; 2],
    /// What is drawn over the pixels of a room, and around them.
    pub overlay: Option<Overlay<'a>>,
    /// The colours of the numbers.
    pub scale: Scale,
    /// The quantity and unit of the numbers, above the scale.
    pub legend: &'a str,
    /// σ, if the numbers are radiosities of heat: beside the scale stands the temperature T of a black
    /// body with σT⁴ = u, and isotherms are drawn between the walls of a room.
    pub stefan_boltzmann: Option<f64>,
    /// The lines of text below the picture.
    pub captions: Vec<String>,
    /// The width of the picture in pixels, whose panels have [`panel_width`](crate::panel_width) at most; `None` for as many
    /// as it takes.
    pub width: Option<usize>,
}

impl<'a> Picture<'a> {
    /// A picture of pixels alone, as wide as it takes.
    #[must_use]
    pub const fn new(size: [usize; 2], scale: Scale, legend: &'a str) -> Self {
        Self {
            size,
            overlay: None,
            scale,
            legend,
            stefan_boltzmann: None,
            captions: Vec::new(),
            width: None,
        }
    }

    fn layout(&self, panels: usize) -> Layout {
        let Some(overlay) = &self.overlay else {
            return Layout::bare(text_size(self.size[0] * panels));
        };
        let longer = self.size[0].max(self.size[1]);
        let size = text_size(self.width.unwrap_or(longer));
        let [low, high] = overlay.canvas.extent();
        Layout::new(size, [low[1], high[1]], self.stefan_boltzmann.is_some())
    }

    /// The panels, side by side.
    ///
    /// # Errors
    /// [`Error::WrongLength`]: a panel of another size.
    pub fn draw(&self, panels: &[Panel]) -> Result<Figure, Error> {
        let [width, height] = self.size;
        let pieces = self
            .overlay
            .as_ref()
            .map_or(0, |overlay| overlay.pieces.len());
        let layout = self.layout(panels.len());
        let size = layout.size;
        let is_headed = panels.iter().any(|panel| panel.heading.is_some());
        let [mut left, top] = layout.origin(is_headed);
        let mut page = Page::default();
        for (number, panel) in panels.iter().enumerate() {
            panel.pixels.check("pixels", width * height)?;
            panel.walls.check("walls", pieces)?;
            page.image(Image {
                at: [left, top],
                width,
                pixels: panel.pixels.colours(self.scale).collect(),
            });
            let at = [left as f64, top as f64];
            if let Some(overlay) = &self.overlay {
                self.draw_overlay(overlay, panel, layout, at, number == 0, &mut page);
            }
            if let Some(heading) = &panel.heading {
                let middle = at[0] + (width / 2) as f64;
                let above = at[1] - layout.band - 0.8 * size;
                page.text(heading, [middle, above], size, TextAnchor::Middle);
            }
            left += width + layout.between as usize;
        }
        let after = (left - layout.between as usize) as f64 + layout.band + size;
        let legend = Legend {
            scale: self.scale,
            title: self.legend,
            stefan_boltzmann: self.stefan_boltzmann,
            size,
            height: height as f64,
        };
        let right = legend.draw([after, top as f64], &mut page);
        let across = match self.width {
            Some(width) => width as f64,
            None => (right + 0.5 * size).ceil(),
        };
        // Below the axis and the scale bar of a room.
        let below = match self.overlay {
            Some(_) => layout.band + 3.2 * size,
            None => size,
        };
        let mut bottom = (top + height) as f64 + below;
        let small = 0.85 * size;
        let fits = ((across - 2.0 * size) / width_of("x", small)) as usize;
        for line in self.captions.iter().flat_map(|text| wrap(text, fits)) {
            bottom += 0.3 * small;
            page.text(&line, [0.8 * size, bottom], small, TextAnchor::Start);
            bottom += small;
        }
        Ok(page.figure([across, (bottom + 0.2 * size).ceil()]))
    }

    /// What is over the first pixel at `at` and the others, and around them.
    fn draw_overlay(
        &self,
        overlay: &Overlay<'_>,
        panel: &Panel,
        layout: Layout,
        at: Place,
        is_first: bool,
        page: &mut Page,
    ) {
        if let Some(stefan_boltzmann) = self.stefan_boltzmann {
            let isotherms = Isotherms {
                values: &panel.pixels.values,
                width: self.size[0],
                stefan_boltzmann,
                size: 0.75 * layout.size,
                at,
            };
            isotherms.draw(page);
        }
        self.walls(overlay, panel, at, page);
        let frame = Frame {
            canvas: overlay.canvas,
            layout,
            at,
            unit: overlay.unit,
        };
        frame.axes(is_first, page);
        let across = self.width.map_or(f64::INFINITY, |width| width as f64);
        let names = frame.names(overlay.names, across, page);
        frame.marks(overlay.marks, &names, page);
    }

    /// Pieces of one colour as one, each a little into the next, so that no seam shows.
    fn walls(&self, overlay: &Overlay<'_>, panel: &Panel, [x, y]: Place, page: &mut Page) {
        let strips = overlay.canvas.strips();
        let colours = panel.walls.colours(self.scale);
        let pieces: Vec<_> = overlay.pieces.iter().zip(colours).collect();
        for run in pieces.chunk_by(|(a, first), (b, second)| a.wall == b.wall && first == second) {
            let ((first, colour), (last, _)) = (run[0], run[run.len() - 1]);
            let (Some(strip), Some([r, g, b])) = (strips.get(first.wall), colour) else {
                continue;
            };
            let to = (last.to + 0.7 / strip.length()).min(1.0);
            let corners = strip.corners(first.from, to).map(|[a, b]| [a + x, b + y]);
            page.polygon(&corners, Color::Rgb(r, g, b), 1.0, 0.0);
        }
        // Where a wall is, between its two sides or before what is outside.
        for strip in strips {
            let [from, to, ..] = strip.corners(0.0, 1.0).map(|[a, b]| [a + x, b + y]);
            page.line(from, to, Color::Rgb(110, 110, 110), 1.0);
        }
    }
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
    use super::{Overlay, Panel, Picture, Shades, wrap};
    use crate::{Canvas, Error, Scale, Wall};

    fn wrong<T>(slice: &'static str, expected: usize) -> Result<T, Error> {
        let found = expected - 1;
        Err(Error::WrongLength {
            slice,
            expected,
            found,
        })
    }

    /// The same of red light.
    fn red(values: &[f64]) -> Shades {
        Shades {
            values: values.to_vec(),
            light: Some([1.0, 0.0, 0.0].map(|level| vec![level; values.len()])),
        }
    }

    #[test]
    fn a_room_has_its_words_and_refuses_panels_of_another_size() {
        let floor = Wall {
            vertices: [0, 1],
            ends: [[0.0, 0.0], [4.0, 0.0]],
        };
        let canvas = Canvas::new(&[floor], 60, 4, 3.0).unwrap();
        let pieces = canvas.pieces();
        let pixels = vec![2.0; canvas.size()[0] * canvas.size()[1]];
        let walls = vec![1.0; pieces.len()];
        let overlay = Overlay {
            canvas: &canvas,
            pieces: &pieces,
            unit: Some("m"),
            names: &[("the floor".to_owned(), 0..1)],
            marks: &[
                ("a".to_owned(), [1.0, 0.0]),
                ("b".to_owned(), [1.0, 0.0]),
                (String::new(), [2.0, 0.0]),
            ],
        };
        let scale = Scale::new(pixels.iter().copied(), walls.iter().copied(), false);
        let picture = Picture {
            overlay: Some(overlay),
            stefan_boltzmann: Some(5.670_374_419e-8),
            captions: vec!["below <it>".to_owned()],
            ..Picture::new(canvas.size(), scale, "W/m²")
        };
        let panel = |pixels: &[f64], walls: &[f64]| Panel {
            heading: Some("above it".to_owned()),
            pixels: pixels.to_vec().into(),
            walls: walls.to_vec().into(),
        };
        let svg = |panel| picture.draw(&[panel]).and_then(|figure| figure.svg());
        let text = svg(panel(&pixels, &walls)).unwrap();
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
            assert!(text.contains(word), "{word} in {text}");
        }
        assert_eq!(text.matches("<circle").count(), 3, "{text}");
        let wrong_pixels = svg(panel(&pixels[1..], &walls));
        assert_eq!(wrong_pixels, wrong("pixels", pixels.len()));
        let wrong_walls = svg(panel(&pixels, &walls[1..]));
        assert_eq!(wrong_walls, wrong("walls", walls.len()));

        // In colours a wall has that of its light, and a list of another length is refused.
        let in_colours = |light: &[f64]| Panel {
            walls: Shades {
                values: walls.clone(),
                ..red(light)
            },
            ..panel(&pixels, &walls)
        };
        let greys = Picture {
            scale: Scale::between(0.0, 1.0, false).unwrap().in_greys(),
            ..picture.clone()
        };
        let text = greys.draw(&[in_colours(&walls)]).unwrap().svg().unwrap();
        assert!(text.contains("#ff0000"), "{text}");
        let wrong_light = greys.draw(&[in_colours(&walls[1..])]);
        assert_eq!(wrong_light.map(|_| ()), wrong("walls", walls.len()));
    }

    /// A pixel shows each of its colours as bright as a grey of that number.
    #[test]
    fn a_view_has_its_words_and_the_colours_of_its_light() {
        let values = vec![1.0; 80 * 60];
        let scale = Scale::between(0.0, 1.0, false).unwrap().in_greys();
        let picture = Picture {
            captions: vec!["below".to_owned()],
            ..Picture::new([80, 60], scale, "luminance")
        };
        let panel = |pixels| Panel {
            heading: Some("above".to_owned()),
            pixels,
            ..Panel::default()
        };
        let both = [panel(values.clone().into()), panel(red(&values))];
        let figure = picture.draw(&both).unwrap();
        assert_eq!(figure.images[0].pixels[7], Some([255, 255, 255]));
        assert_eq!(figure.images[1].pixels[7], Some([255, 0, 0]));
        let svg = figure.svg().unwrap();
        assert_eq!(svg.matches(">above<").count(), 2);
        assert!(svg.contains(">below<") && svg.contains("image/png"));
        let png = picture.draw(&both).unwrap().png().unwrap();
        assert!(png.starts_with(b"\x89PNG"));
        let short = picture.draw(&[panel(red(&values[1..]))]);
        assert_eq!(short.map(|_| ()), wrong("pixels", values.len()));
    }

    #[test]
    fn lines_break_between_words() {
        assert_eq!(wrap("one two three", 7), ["one two", "three"]);
        assert_eq!(wrap("overlong a", 3), ["overlong", "a"]);
    }
}
