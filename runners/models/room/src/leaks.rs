//! Why a room is not closed, in the words of who drew it.

use super::Surfaces;
use fredholm_model::numbers::with_decimals;
use fredholm_surfaces::hull;

/// Points nearer to each other than this share of the room's size are one, as far as an explanation goes.
const SAME: f64 = 1e-9;
/// A gap this share of the room's size wide is one that nobody has drawn on purpose.
const SLIP: f64 = 0.02;

/// A point of the drawing.
type Point = [f64; 2];

fn distance(a: Point, b: Point) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// The share of a segment at which it is nearest to a point, and how near.
fn nearest([a, b]: [Point; 2], p: Point) -> (f64, f64) {
    let span = [b[0] - a[0], b[1] - a[1]];
    let along = (p[0] - a[0]) * span[0] + (p[1] - a[1]) * span[1];
    let t = (along / (span[0] * span[0] + span[1] * span[1])).clamp(0.0, 1.0);
    (t, distance(p, [a[0] + t * span[0], a[1] + t * span[1]]))
}

/// "(4, 0.5)": nine decimals at most, and no zero with a sign.
pub(super) fn point(point: Point) -> String {
    let [x, y] = point.map(|x| with_decimals(x, 9));
    format!("({x}, {y})")
}

/// "(0.707, -0.707)".
pub(super) fn direction(direction: Point) -> String {
    let rounded = direction.map(|x| (1000.0 * x).round() / 1000.0);
    point(rounded)
}

impl Surfaces {
    /// The larger side of the drawing.
    fn size(&self) -> f64 {
        let [low, high] = hull(&self.points.concat());
        f64::max(high[0] - low[0], high[1] - low[1])
    }

    fn name(&self, surface: usize) -> String {
        format!("{:?}", self.names.get(surface).map_or("?", String::as_str))
    }

    /// Whether a surface is one segment: its two ends are no gap.
    fn is_plate(&self, surface: usize) -> bool {
        self.points.get(surface).is_some_and(|all| all.len() == 2)
    }

    /// The narrowest gap between a loose end and another, or a surface that it all but meets; or else a plate that touches nothing,
    /// whose back light meets.
    pub(super) fn gap(&self) -> Option<String> {
        let size = self.size();
        let segments = || {
            let surfaces = self.points.iter().enumerate();
            surfaces.flat_map(|(surface, points)| {
                points
                    .windows(2)
                    .map(move |two| (surface, [two[0], two[1]]))
            })
        };
        let ends = self
            .points
            .iter()
            .enumerate()
            .flat_map(|(surface, points)| {
                let ends = [points.first(), points.last()].into_iter().flatten();
                ends.map(move |&end| (surface, end))
            });
        // A loose end is on no segment but the one that ends there.
        let loose = |&(_, end): &(usize, Point)| {
            let near = segments().filter(|(_, other)| nearest(*other, end).1 <= SAME * size);
            near.count() < 2
        };
        let loose: Vec<(usize, Point)> = ends.filter(loose).collect();
        // Plates that touch nothing, in a room of other surfaces: between them air is meant, and no wall.
        let free = |surface: usize| {
            let own = loose.iter().filter(|(of, _)| *of == surface);
            self.is_plate(surface) && own.count() == 2
        };
        let mut plates: Vec<usize> = (0..self.points.len()).filter(|&s| free(s)).collect();
        if plates.len() == self.points.len() {
            plates.clear();
        }
        let plates = &plates;
        let pairs = loose.iter().enumerate().flat_map(|(i, a)| {
            let others = loose.get(i + 1..).unwrap_or(&[]).iter();
            let others = others.filter(|b| a.0 != b.0 || !self.is_plate(a.0));
            let apart = others.map(move |b| (*a, *b, distance(a.1, b.1)));
            apart.filter(move |(a, b, apart)| {
                *apart < SLIP * size || [a, b].iter().any(|end| !plates.contains(&end.0))
            })
        });
        let slips = loose.iter().flat_map(|a| {
            segments().filter_map(move |(surface, ends)| {
                let (t, apart) = nearest(ends, a.1);
                let on = [0, 1].map(|k| (1.0 - t) * ends[0][k] + t * ends[1][k]);
                let is_other = apart > SAME * size && apart < SLIP * size && surface != a.0;
                is_other.then_some((*a, (surface, on), apart))
            })
        });
        // Two ends that are about as near are the likelier meant.
        let preferred = pairs
            .map(|pair| (pair, 0.99))
            .chain(slips.map(|slip| (slip, 1.0)));
        let narrowest = preferred.min_by(|(a, s), (b, t)| (s * a.2).total_cmp(&(t * b.2)));
        if let Some((((s, a), (t, b), apart), _)) = narrowest {
            return Some(format!(
                "there is a gap of {apart:.3e} between {} of {} and {} of {}: close it",
                point(a),
                self.name(s),
                point(b),
                self.name(t)
            ));
        }
        let names: Vec<String> = plates.iter().map(|&plate| self.name(plate)).collect();
        Some(match (&names[..], self.is_deck) {
            ([], _) => return None,
            ([name], true) => format!(
                "surface {name} touches no other, and its back is met: add a surface of the same vertices in the other order"
            ),
            ([name], false) => format!(
                "surface {name} touches no other, and its back is met: let its points go on, back to the first"
            ),
            (_, true) => format!(
                "surfaces {} touch no others, and their backs are met: add a surface of the same vertices in the other order for each",
                names.join(", ")
            ),
            (_, false) => format!(
                "surfaces {} touch no others, and their backs are met: let the points of each go on, back to the first",
                names.join(", ")
            ),
        })
    }
}
