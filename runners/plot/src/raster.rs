//! Scenes of primitives as PNG and SVG.

use kuva::backend::raster::RasterBackend;
use kuva::backend::svg::SvgBackend;
use kuva::render::render::{Primitive, Scene};
use png::{BitDepth, ColorType, Compression, Decoder, Encoder};

use crate::{Error, base64};

/// Samples of a pixel along either axis: what draws polygons does not smooth their edges.
const SAMPLES: usize = 4;

/// Pixels of a picture within it, some of them blank.
#[derive(Debug)]
pub(crate) struct Image {
    /// The left edge of the block, in pixels.
    pub(crate) x: usize,
    pub(crate) y: usize,
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Row by row.
    pub(crate) pixels: Vec<Option<[u8; 3]>>,
}

/// A PNG file of the images with the scene over them, in pixels of the scene's unit.
pub(crate) fn png(images: &[Image], mut scene: Scene) -> Result<Vec<u8>, Error> {
    let over = core::mem::take(&mut scene.elements);
    scene.elements = images.iter().map(squares).collect();
    scene.elements.extend(over);
    let backend = RasterBackend::new().with_scale(SAMPLES as f32);
    let fine = backend.render_scene(&scene).map_err(Error::backend)?;
    let mut reader = Decoder::new(std::io::Cursor::new(fine))
        .read_info()
        .map_err(Error::backend)?;
    let size = reader.output_buffer_size().ok_or(Error::TooLarge)?;
    let mut samples = vec![0; size];
    let info = reader.next_frame(&mut samples).map_err(Error::backend)?;
    let (width, height) = (
        info.width as usize / SAMPLES,
        info.height as usize / SAMPLES,
    );
    let mut pixels = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        for x in 0..width {
            for channel in 0..3 {
                let mut sum = 0;
                for row in 0..SAMPLES {
                    let first = ((y * SAMPLES + row) * info.width as usize + x * SAMPLES) * 4;
                    let own = samples.get(first..first + 4 * SAMPLES).unwrap_or(&[]);
                    let own = own.iter().skip(channel).step_by(4);
                    sum += own.map(|&sample| usize::from(sample)).sum::<usize>();
                }
                let count = SAMPLES * SAMPLES;
                pixels.push(((sum + count / 2) / count) as u8);
            }
        }
    }
    encode(width, height, ColorType::Rgb, &pixels)
}

/// An SVG file of the same.
pub(crate) fn svg(images: &[Image], mut scene: Scene) -> Result<String, Error> {
    scene.background_color = None;
    scene.font_family = Some("DejaVu Sans, Verdana, Arial, sans-serif".to_owned());
    let text = SvgBackend::new().with_pretty(true).render_scene(&scene);
    let Some((head, rest)) = text.split_once('>') else {
        return Err(Error::backend("an SVG has no first tag"));
    };
    let mut out = format!("{head}>\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n");
    for image in images {
        let mut pixels = Vec::with_capacity(4 * image.pixels.len());
        for pixel in &image.pixels {
            let [r, g, b] = pixel.unwrap_or_default();
            pixels.extend([r, g, b, if pixel.is_some() { 255 } else { 0 }]);
        }
        let png = encode(image.width, image.height, ColorType::Rgba, &pixels)?;
        out.push_str(&format!(
            "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" \
             href=\"data:image/png;base64,{}\"/>\n",
            image.x,
            image.y,
            image.width,
            image.height,
            base64::encode(&png)
        ));
    }
    out.push_str(rest.trim_start());
    Ok(out)
}

fn encode(width: usize, height: usize, color: ColorType, pixels: &[u8]) -> Result<Vec<u8>, Error> {
    let mut out = Vec::new();
    let [w, h] = [width, height].map(|size| u32::try_from(size).unwrap_or(u32::MAX));
    let mut encoder = Encoder::new(&mut out, w, h);
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
            if let Some(Some([r, g, b])) = run.first() {
                x.push((image.x + column) as f64);
                y.push((image.y + row) as f64);
                w.push(run.len() as f64);
                h.push(1.0);
                fills.push(kuva::render::color::Color::Rgb(*r, *g, *b));
            }
            column += run.len();
        }
    }
    Primitive::RectBatch { x, y, w, h, fills }
}
