//! The picture of a scene as a camera sees it.

use kuva::render::render::{Scene, TextAnchor};

use crate::frame::text_size;
use crate::legend::Legend;
use crate::picture::{captions, text};
use crate::raster::{self, Image};
use crate::{Error, Scale};

/// A view, and the heading above it.
#[derive(Clone, Debug)]
pub struct ViewPanel<'a> {
    /// The heading, if any.
    pub heading: Option<String>,
    /// The value of every pixel, row by row; NaN where nothing is seen.
    pub values: &'a [f64],
    /// Red, green and blue of every pixel, in the unit of the scale, if it is to have its own colour: that of light of the
    /// primaries of sRGB, of which what is beyond the end of the scale is cut off.
    pub colours: Option<&'a [Vec<f64>; 3]>,
}

/// A picture of a scene as a camera sees it, or of several side by side, with a legend and captions.
#[derive(Clone, Debug)]
pub struct ViewPicture<'a> {
    /// Pixels across a view, and down.
    pub size: [usize; 2],
    /// The colours of the values.
    pub scale: Scale,
    /// The quantity and unit of the values, above the scale.
    pub legend: &'a str,
    /// σ, if the values are radiosities of heat: temperatures of black bodies stand beside the scale.
    pub stefan_boltzmann: Option<f64>,
    /// The lines of text below the picture.
    pub captions: Vec<String>,
}

impl ViewPicture<'_> {
    /// The text of an SVG file of the panels, side by side.
    ///
    /// # Errors
    /// [`Error::WrongLength`]: a panel of another size.
    pub fn svg(&self, panels: &[ViewPanel<'_>]) -> Result<String, Error> {
        let (images, scene) = self.draw(panels)?;
        raster::svg(&images, scene)
    }

    /// A PNG file of the panels, side by side.
    ///
    /// # Errors
    /// [`Error::WrongLength`]: a panel of another size.
    pub fn png(&self, panels: &[ViewPanel<'_>]) -> Result<Vec<u8>, Error> {
        let (images, scene) = self.draw(panels)?;
        raster::png(&images, scene)
    }

    /// The images and what is drawn beside them.
    fn draw(&self, panels: &[ViewPanel<'_>]) -> Result<(Vec<Image>, Scene), Error> {
        let [width, height] = self.size;
        let size = text_size(width * panels.len());
        let gap = size.round() as usize;
        let is_headed = panels.iter().any(|panel| panel.heading.is_some());
        let top = gap + if is_headed { 2 * gap } else { 0 };
        let mut left = gap;
        let (mut images, mut elements) = (Vec::new(), Vec::new());
        for panel in panels {
            let lengths = panel.colours.into_iter().flatten().map(Vec::len);
            let expected = width * height;
            for found in lengths.chain([panel.values.len()]) {
                if expected != found {
                    return Err(Error::WrongLength {
                        slice: "values",
                        expected,
                        found,
                    });
                }
            }
            let colour = |(place, &value): (usize, &f64)| {
                (!value.is_nan()).then(|| self.scale.shown(value, place, panel.colours))
            };
            images.push(Image {
                x: left,
                y: top,
                width,
                height,
                pixels: panel.values.iter().enumerate().map(colour).collect(),
            });
            if let Some(heading) = &panel.heading {
                let at = [(left + width / 2) as f64, top as f64 - 0.8 * size];
                elements.push(text(heading, at, size, TextAnchor::Middle));
            }
            left += width + gap;
        }
        let legend = Legend {
            scale: self.scale,
            title: self.legend,
            stefan_boltzmann: self.stefan_boltzmann,
            size,
            height,
        };
        let right = legend.draw([left as f64, top as f64], &mut elements);
        let page = (right + 0.5 * size).ceil();
        let below = (top + height) as f64 + size;
        let bottom = captions(&self.captions, size, [page, below], &mut elements);
        let mut scene = Scene::new(page, bottom);
        scene.elements = elements;
        Ok((images, scene))
    }
}

#[cfg(test)]
mod tests {
    use super::{ViewPanel, ViewPicture};
    use crate::{Error, Scale};

    #[test]
    fn a_view_has_its_words_and_refuses_panels_of_another_size() {
        let values = vec![1.0; 80 * 60];
        let picture = ViewPicture {
            size: [80, 60],
            scale: Scale::new(values.iter().copied(), [].into_iter(), false).in_greys(),
            legend: "u",
            stefan_boltzmann: None,
            captions: vec!["below".to_owned()],
        };
        let panel = |values| {
            let heading = Some("above".to_owned());
            let colours = None;
            ViewPanel {
                heading,
                values,
                colours,
            }
        };
        let svg = picture.svg(&[panel(&values), panel(&values)]).unwrap();
        assert_eq!(svg.matches(">above<").count(), 2);
        assert!(svg.contains(">below<") && svg.contains("image/png"));
        assert!(
            picture
                .png(&[panel(&values)])
                .unwrap()
                .starts_with(b"\x89PNG")
        );
        assert_eq!(
            picture.svg(&[panel(&values[1..])]),
            Err(Error::WrongLength {
                slice: "values",
                expected: 4800,
                found: 4799
            })
        );
    }

    /// A pixel shows each of its colours as bright as a grey of that number.
    #[test]
    fn pixels_have_the_colours_of_their_light() {
        let values = [1.0; 60 * 40];
        let [red, green, mut blue] = [1.0, 0.0, 0.0].map(|level| vec![level; 60 * 40]);
        let picture = ViewPicture {
            size: [60, 40],
            scale: Scale::between(0.0, 1.0, false).unwrap().in_greys(),
            legend: "luminance",
            stefan_boltzmann: None,
            captions: Vec::new(),
        };
        let panel = ViewPanel {
            heading: None,
            values: &values,
            colours: Some(&[red.clone(), green.clone(), blue.clone()]),
        };
        let (images, _) = picture.draw(&[panel]).unwrap();
        assert_eq!(images[0].pixels[7], Some([255, 0, 0]));
        blue.pop();
        let short = ViewPanel {
            heading: None,
            values: &values,
            colours: Some(&[red, green, blue]),
        };
        assert!(picture.png(&[short]).is_err());
    }

    /// A fifth of white is a mid grey on a screen.
    #[test]
    fn greys_are_as_bright_as_numbers_are_large() {
        let scale = Scale::between(0.0, 10.0, false).unwrap().in_greys();
        assert_eq!(
            [0.0, 2.0, 10.0, 20.0].map(|x| scale.colour(x)[0]),
            [0, 124, 255, 255]
        );
    }
}
