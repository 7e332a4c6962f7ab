//! A picture of polygons in space: seen from above at an angle, with the names of the surfaces.

use core::fmt::Write;

/// Planar polygons in space, seen from the front, the right and above.
///
/// ```
/// use fredholm_plot::SpaceDrawing;
///
/// let floor = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// let drawing = SpaceDrawing { surfaces: vec![("floor".to_owned(), vec![floor.to_vec()])] };
/// assert!(drawing.svg().contains(">floor</text>"));
/// ```
#[derive(Clone, Debug, Default)]
pub struct SpaceDrawing {
    /// The name of each surface, and the vertices of its polygons, counterclockwise seen from the active side.
    pub surfaces: Vec<(String, Vec<Vec<[f64; 3]>>)>,
}

/// The width of the picture.
const WIDTH: f64 = 900.0;
/// Around the scene.
const MARGIN: f64 = 40.0;

/// A polygon on the paper.
struct Drawn {
    points: Vec<[f64; 2]>,
    /// The largest is behind.
    depth: f64,
    surface: usize,
    /// Whether its active side is seen.
    front: bool,
}

/// Where a point is on the paper, in the scene's unit, and how far away: from the front, the right and above.
fn project([x, y, z]: [f64; 3]) -> ([f64; 2], f64) {
    let (c, s) = (0.866_025_403_784_438_6, 0.5);
    let (right, away) = (c * x + s * y, c * y - s * x);
    let (low, high) = (0.5, 0.866_025_403_784_438_6);
    ([right, -(low * away + high * z)], high * away - low * z)
}

impl SpaceDrawing {
    /// The picture as SVG. Active sides are pale, backs are grey and see-through.
    #[must_use]
    pub fn svg(&self) -> String {
        let mut all: Vec<Drawn> = Vec::new();
        let [mut low, mut high] = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for (surface, (_, polygons)) in self.surfaces.iter().enumerate() {
            for polygon in polygons {
                let placed: Vec<_> = polygon.iter().map(|&p| project(p)).collect();
                for (p, _) in &placed {
                    for k in 0..2 {
                        low[k] = low[k].min(p[k]);
                        high[k] = high[k].max(p[k]);
                    }
                }
                let depth = placed.iter().map(|p| p.1).sum::<f64>() / placed.len() as f64;
                let points: Vec<[f64; 2]> = placed.into_iter().map(|p| p.0).collect();
                let double = area(&points);
                all.push(Drawn {
                    points,
                    depth,
                    surface,
                    // Down is positive on paper.
                    front: double < 0.0,
                });
            }
        }
        all.sort_by(|a, b| b.depth.total_cmp(&a.depth));
        let extent = (high[0] - low[0])
            .max(high[1] - low[1])
            .max(f64::MIN_POSITIVE);
        let scale = (WIDTH - 2.0 * MARGIN) / extent;
        let at = |p: [f64; 2]| {
            [
                MARGIN + scale * (p[0] - low[0]),
                MARGIN + scale * (p[1] - low[1]),
            ]
        };
        let height = 2.0 * MARGIN + scale * (high[1] - low[1]);
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height:.1}\" font-family=\"sans-serif\" \
         font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        // Writing to a string does not fail.
        for drawn in &all {
            let points: Vec<String> = drawn
                .points
                .iter()
                .map(|&p| at(p))
                .map(|[x, y]| format!("{x:.1},{y:.1}"))
                .collect();
            let hue = 47 * drawn.surface % 360;
            let (fill, opacity) = if drawn.front {
                (format!("hsl({hue},60%,80%)"), 0.9)
            } else {
                ("#999".to_owned(), 0.12)
            };
            let _ = writeln!(
                text,
                "<polygon points=\"{}\" fill=\"{fill}\" fill-opacity=\"{opacity}\" stroke=\"#333\" stroke-width=\"0.6\"/>",
                points.join(" ")
            );
        }
        for (surface, (name, _)) in self.surfaces.iter().enumerate() {
            let largest = all.iter().filter(|drawn| drawn.surface == surface);
            let largest =
                largest.max_by(|a, b| area(&a.points).abs().total_cmp(&area(&b.points).abs()));
            if let Some(drawn) = largest {
                let count = drawn.points.len() as f64;
                let sum = drawn
                    .points
                    .iter()
                    .fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
                let [x, y] = at([sum[0] / count, sum[1] / count]);
                let name = name.replace('&', "&amp;").replace('<', "&lt;");
                let _ = writeln!(
                    text,
                    "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{name}</text>"
                );
            }
        }
        text + "</svg>\n"
    }
}

/// Twice the signed area.
fn area(points: &[[f64; 2]]) -> f64 {
    let next = points.iter().cycle().skip(1);
    points
        .iter()
        .zip(next)
        .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
        .sum()
}
