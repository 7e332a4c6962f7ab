//! Values along the surfaces of a room.

use kuva::plot::annotations::ReferenceLine;
use kuva::prelude::{LinePlot, Plot};
use kuva::render::render::{Primitive, Scene, TextAnchor, render_multiple};

use crate::curves::{COLOURS, layout};
use crate::{Error, raster};

/// Values against length along all surfaces, with bands of ±2 standard errors.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfilePlot {
    /// The title, above the axes.
    pub title: String,
    /// The label of the ordinate.
    pub label: String,
    /// Length along all surfaces, value and standard error, in pieces that have no jump.
    pub pieces: Vec<Vec<(f64, f64, f64)>>,
    /// The name of every surface, and the length at which it begins.
    pub surfaces: Vec<(String, f64)>,
    /// The length of all surfaces.
    pub length: f64,
}

const WIDTH: f64 = 1000.0;
const HEIGHT: f64 = 560.0;
const LEFT: f64 = 90.0;
const RIGHT: f64 = 60.0;
const TOP: f64 = 125.0;
const BOTTOM: f64 = 60.0;

impl ProfilePlot {
    /// The text of an SVG file.
    pub fn svg(&self) -> Result<String, Error> {
        raster::svg(&[], self.scene()?)
    }

    /// A PNG file.
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        raster::png(&[], self.scene()?)
    }

    fn scene(&self) -> Result<Scene, Error> {
        let plots: Vec<Plot> = self.pieces.iter().filter_map(|piece| line(piece)).collect();
        if plots.is_empty() {
            return Err(Error::NothingToDraw);
        }
        let mut layout = layout(
            &plots,
            &self.title,
            "length along all surfaces",
            &self.label,
        )
        .with_width(WIDTH)
        .with_height(HEIGHT)
        .with_force_margins(LEFT, RIGHT)
        .with_force_margins_y(TOP, BOTTOM)
        .with_x_axis_min(0.0)
        .with_x_axis_max(self.length);
        for (_, start) in self.surfaces.iter().skip(1) {
            let line = ReferenceLine::vertical(*start).with_color("#999999");
            layout = layout.with_reference_line(line);
        }
        let mut scene = render_multiple(plots, layout);
        self.name_surfaces(&mut scene);
        Ok(scene)
    }

    /// The names of the surfaces, above the middle of each.
    fn name_surfaces(&self, scene: &mut Scene) {
        let ends = self.surfaces.iter().skip(1).map(|(_, start)| *start);
        let ends = ends.chain([self.length]);
        let mut last = f64::NEG_INFINITY;
        for ((name, start), end) in self.surfaces.iter().zip(ends) {
            let middle = 0.5 * (start + end) / self.length;
            // Names of short surfaces stand side by side.
            let x = (LEFT + middle * (WIDTH - LEFT - RIGHT)).max(last + 13.0);
            last = x;
            scene.elements.push(Primitive::Text {
                x: x + 4.0,
                y: TOP - 8.0,
                content: name.clone(),
                size: 12,
                anchor: TextAnchor::Start,
                rotate: Some(-60.0),
                bold: false,
                color: None,
            });
        }
    }
}

/// A line with its band, if any of its values is finite.
fn line(piece: &[(f64, f64, f64)]) -> Option<Plot> {
    let finite = piece.iter().filter(|(_, u, _)| u.is_finite());
    finite.clone().next()?;
    let at = |sign: f64| {
        let error = |e: f64| if e.is_finite() { e } else { 0.0 };
        finite
            .clone()
            .map(move |&(_, u, e)| u + sign * 2.0 * error(e))
    };
    let line = LinePlot::new()
        .with_data(finite.clone().map(|&(s, u, _)| (s, u)))
        .with_band(at(-1.0), at(1.0))
        .with_color(COLOURS[1])
        .with_stroke_width(1.4);
    Some(Plot::Line(line))
}
