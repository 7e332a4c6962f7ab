//! Lines, words and images on a page, and the files of it.

use kuva::backend::raster::RasterBackend;
use kuva::backend::svg::SvgBackend;
use kuva::render::color::Color;
use kuva::render::render::{PathData, Primitive, Scene, TextAnchor};
use png::{BitDepth, ColorType, Compression, Decoder, Encoder};

use crate::Error;

/// A place in pixels from the upper left.
pub(crate) type Place = [f64; 2];

/// The colour of words and lines.
pub(crate) const INK: Color = Color::Rgb(34, 34, 34);
pub(crate) const WHITE: Color = Color::Rgb(255, 255, 255);

/// The width of a character over the size of its font, on the safe side.
const CHARACTER: f64 = 0.62;

/// Samples of a pixel along either axis: what draws polygons does not smooth their edges.
const SAMPLES: usize = 4;

/// The width of a text of this size, on the safe side.
pub(crate) fn width_of(text: &str, size: f64) -> f64 {
    CHARACTER * size * text.chars().count() as f64
}

/// What is on a page, from the back to the front.
#[derive(Debug, Default)]
pub(crate) struct Page {
    elements: Vec<Primitive>,
    images: Vec<Image>,
}

/// Pixels of a picture, some of them blank.
#[derive(Debug)]
pub(crate) struct Image {
    /// The place of the first pixel.
    pub(crate) at: [usize; 2],
    pub(crate) width: usize,
    /// Row by row.
    pub(crate) pixels: Vec<Option<[u8; 3]>>,
}

impl Page {
    /// Images lie behind all else.
    pub(crate) fn image(&mut self, image: Image) {
        self.images.push(image);
    }

    pub(crate) fn line(&mut self, [x1, y1]: Place, [x2, y2]: Place, stroke: Color, width: f64) {
        self.elements.push(Primitive::Line {
            x1,
            y1,
            x2,
            y2,
            stroke,
            stroke_width: width,
            stroke_dasharray: None,
        });
    }

    /// A thin line in ink.
    pub(crate) fn tick(&mut self, from: Place, to: Place) {
        self.line(from, to, INK, 1.0);
    }

    pub(crate) fn text(&mut self, content: &str, at: Place, size: f64, anchor: TextAnchor) {
        self.label(content, at, size, anchor, INK, None);
    }

    /// A text in a colour, turned by so many degrees.
    pub(crate) fn label(
        &mut self,
        content: &str,
        [x, y]: Place,
        size: f64,
        anchor: TextAnchor,
        color: Color,
        rotate: Option<f64>,
    ) {
        self.elements.push(Primitive::Text {
            x,
            y,
            content: content.to_owned(),
            size: size.round() as u32,
            anchor,
            rotate,
            bold: false,
            color: Some(color),
        });
    }

    /// A box from its upper left to its lower right corner.
    pub(crate) fn rectangle(&mut self, [from, to]: [Place; 2], fill: Color, opacity: f64) {
        self.elements.push(Primitive::Rect {
            x: from[0],
            y: from[1],
            width: to[0] - from[0],
            height: to[1] - from[1],
            fill,
            stroke: None,
            stroke_width: None,
            opacity: (opacity < 1.0).then_some(opacity),
        });
    }

    /// A dot that is seen on light and on dark.
    pub(crate) fn dot(&mut self, [cx, cy]: Place, r: f64) {
        self.elements.push(Primitive::Circle {
            cx,
            cy,
            r,
            fill: WHITE,
            fill_opacity: None,
            stroke: Some(INK),
            stroke_width: Some(1.0),
        });
    }

    /// A polygon with an outline of this width, in ink if it has one.
    pub(crate) fn polygon(&mut self, corners: &[Place], fill: Color, opacity: f64, outline: f64) {
        let point = |[x, y]: &Place| format!("{x:.2} {y:.2}");
        let points: Vec<String> = corners.iter().map(point).collect();
        self.path(PathData {
            d: format!("M{}Z", points.join("L")),
            fill: Some(fill),
            stroke: if outline > 0.0 { INK } else { Color::None },
            stroke_width: outline,
            opacity: (opacity < 1.0).then_some(opacity),
            stroke_dasharray: None,
        });
    }

    pub(crate) fn path(&mut self, path: PathData) {
        self.elements.push(Primitive::Path(Box::new(path)));
    }

    /// The page of this size.
    pub(crate) fn figure(self, [width, height]: Place) -> Figure {
        let mut scene = Scene::new(width, height);
        scene.elements = self.elements;
        let images = self.images;
        Figure { images, scene }
    }
}

/// A figure that is laid out.
///
/// ```
/// use fredholm_plot::{Curve, LogLogPlot};
///
/// let plot = LogLogPlot {
///     title: "a power".to_owned(),
///     x_label: "x".to_owned(),
///     y_label: "y".to_owned(),
///     curves: vec![Curve::power_law("x^2", 2.0, (1.0, 1.0), 100.0)],
/// };
/// assert!(plot.draw()?.svg()?.contains("a power"));
/// assert!(plot.draw()?.png()?.starts_with(b"\x89PNG"));
/// # Ok::<(), fredholm_plot::Error>(())
/// ```
#[derive(Debug)]
pub struct Figure {
    pub(crate) images: Vec<Image>,
    scene: Scene,
}

impl From<Scene> for Figure {
    fn from(scene: Scene) -> Self {
        let images = Vec::new();
        Self { images, scene }
    }
}

impl Figure {
    /// Figures one below the other.
    #[must_use]
    pub fn stacked(figures: Vec<Self>) -> Self {
        let mut all = Self::from(Scene::new(0.0, 0.0));
        for figure in figures {
            let top = all.scene.height;
            all.images.extend(figure.images.into_iter().map(|image| {
                let [x, y] = image.at;
                let at = [x, y + top as usize];
                Image { at, ..image }
            }));
            let Scene {
                width,
                height,
                elements,
                defs,
                ..
            } = figure.scene;
            let group = Primitive::GroupStart {
                transform: Some(format!("translate(0,{top})")),
                title: None,
                extra_attrs: None,
            };
            let is_moved = top > 0.0;
            all.scene.elements.extend(is_moved.then_some(group));
            all.scene.elements.extend(elements);
            let end = is_moved.then_some(Primitive::GroupEnd);
            all.scene.elements.extend(end);
            all.scene.defs.extend(defs);
            all.scene.width = all.scene.width.max(width);
            all.scene.height += height.ceil();
        }
        all
    }

    /// The place of the first pixel of the first image, from the upper left corner.
    #[must_use]
    pub fn origin(&self) -> Option<[usize; 2]> {
        self.images.first().map(|image| image.at)
    }

    /// The text of an SVG file.
    ///
    /// # Errors
    /// [`Error::Backend`]: an image could not be encoded.
    pub fn svg(mut self) -> Result<String, Error> {
        self.scene.background_color = None;
        self.scene.font_family = Some("DejaVu Sans, Verdana, Arial, sans-serif".to_owned());
        let text = SvgBackend::new()
            .with_pretty(true)
            .render_scene(&self.scene);
        let Some((head, rest)) = text.split_once('>') else {
            return Err(Error::backend("an SVG has no first tag"));
        };
        let mut out = format!("{head}>\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n");
        for image in &self.images {
            let pixel = |pixel: &Option<[u8; 3]>| match pixel {
                Some([r, g, b]) => [*r, *g, *b, 255],
                None => [0; 4],
            };
            let pixels: Vec<u8> = image.pixels.iter().flat_map(pixel).collect();
            let ([x, y], width) = (image.at, image.width);
            let height = image.pixels.len() / width.max(1);
            let png = base64(&encode([width, height], ColorType::Rgba, &pixels)?);
            out += &format!(
                "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" href=\"data:image/png;base64,{png}\"/>\n"
            );
        }
        Ok(out + rest.trim_start())
    }

    /// The bytes of a PNG file.
    ///
    /// # Errors
    /// [`Error::Backend`], [`Error::TooLarge`]: the figure has more pixels than memory.
    pub fn png(mut self) -> Result<Vec<u8>, Error> {
        let over = core::mem::take(&mut self.scene.elements);
        self.scene.elements = self.images.iter().map(squares).collect();
        self.scene.elements.extend(over);
        let backend = RasterBackend::new().with_scale(SAMPLES as f32);
        let fine = backend.render_scene(&self.scene).map_err(Error::backend)?;
        let mut reader = Decoder::new(std::io::Cursor::new(fine))
            .read_info()
            .map_err(Error::backend)?;
        let mut samples = vec![0; reader.output_buffer_size().ok_or(Error::TooLarge)?];
        let info = reader.next_frame(&mut samples).map_err(Error::backend)?;
        let size = [info.width, info.height].map(|samples| samples as usize / SAMPLES);
        let mut pixels = Vec::with_capacity(3 * size[0] * size[1]);
        for (y, x) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (y, x))) {
            for channel in 0..3 {
                let row = |row: usize| {
                    let first = (y * SAMPLES + row) * info.width as usize + x * SAMPLES;
                    let own = samples[4 * first..4 * (first + SAMPLES)].iter();
                    own.skip(channel).step_by(4)
                };
                let sum = (0..SAMPLES).flat_map(row).map(|&sample| u32::from(sample));
                let count = (SAMPLES * SAMPLES) as u32;
                pixels.push(((sum.sum::<u32>() + count / 2) / count) as u8);
            }
        }
        encode(size, ColorType::Rgb, &pixels)
    }
}

fn encode(size: [usize; 2], color: ColorType, pixels: &[u8]) -> Result<Vec<u8>, Error> {
    let mut out = Vec::new();
    let [width, height] = size.map(|size| u32::try_from(size).unwrap_or(u32::MAX));
    let mut encoder = Encoder::new(&mut out, width, height);
    encoder.set_color(color);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::High);
    encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(pixels))
        .map_err(Error::backend)?;
    Ok(out)
}

/// An image as primitives: runs of one colour.
fn squares(image: &Image) -> Primitive {
    let (mut x, mut y, mut w, mut h, mut fills) = (vec![], vec![], vec![], vec![], vec![]);
    for (row, pixels) in image.pixels.chunks(image.width.max(1)).enumerate() {
        let mut column = 0;
        for run in pixels.chunk_by(|a, b| a == b) {
            if let Some([r, g, b]) = run[0] {
                x.push((image.at[0] + column) as f64);
                y.push((image.at[1] + row) as f64);
                w.push(run.len() as f64);
                h.push(1.0);
                fills.push(Color::Rgb(r, g, b));
            }
            column += run.len();
        }
    }
    Primitive::RectBatch { x, y, w, h, fills }
}

/// Base64 with padding (RFC 4648, section 4): files of text hold bytes so.
pub(crate) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let byte = |i: usize| group.get(i).map_or(0, |&byte| u32::from(byte));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        // One byte gives two digits, two bytes give three.
        text.extend((0..4).map(|digit| match digit <= group.len() {
            true => char::from(DIGITS[(bits >> (18 - 6 * digit)) as usize & 63]),
            false => '=',
        }));
    }
    text
}

#[cfg(test)]
mod tests {
    /// Test vectors of RFC 4648, section 10, and all digits in their order.
    #[test]
    fn base64_is_that_of_the_rfc() {
        let digits: Vec<u8> = (0..16_u32)
            .flat_map(|k| {
                let [a, b, c, d] = [0, 1, 2, 3].map(|i| 4 * k + i);
                let bits = a << 18 | b << 12 | c << 6 | d;
                bits.to_be_bytes().into_iter().skip(1)
            })
            .collect();
        let all = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        for (bytes, text) in [
            (&b""[..], ""),
            (b"f", "Zg=="),
            (b"fo", "Zm8="),
            (b"foo", "Zm9v"),
            (b"foobar", "Zm9vYmFy"),
            (&digits, all),
        ] {
            assert_eq!(super::base64(bytes), text);
        }
    }
}
