//! Vertices that are meant to be one, and faces that are meant to meet: what programs write with few digits, or with corners of their own.
//!
//! A vertex moves to the first one that is nearer than the weld's distance. An edge on which a vertex then lies, but for that distance, gets
//! it, too, so that faces that meet have all vertices along the way in common, and light finds no way between them.

use std::collections::HashMap;

use super::SceneFile;
use super::outline::{self, is_thin};
use crate::InputError;

type Point = [f64; 3];

/// A polygon that is not cut yet.
#[derive(Clone, Debug)]
pub(super) struct Outline {
    pub(super) surface: usize,
    pub(super) points: Vec<Point>,
    pub(super) holes: Vec<Vec<Point>>,
    pub(super) place: (u32, u32),
}

/// Points by the boxes of a grid.
struct Grid {
    width: f64,
    boxes: HashMap<[i64; 3], Vec<u32>>,
}

impl Grid {
    fn key(&self, p: Point) -> [i64; 3] {
        p.map(|x| (x / self.width).floor() as i64)
    }

    /// The numbers in all boxes that a box with these ends meets.
    fn near(&self, low: Point, high: Point) -> impl Iterator<Item = u32> + '_ {
        let (low, high) = (self.key(low), self.key(high));
        let keys = (low[0]..=high[0]).flat_map(move |x| {
            (low[1]..=high[1]).flat_map(move |y| (low[2]..=high[2]).map(move |z| [x, y, z]))
        });
        keys.filter_map(|key| self.boxes.get(&key))
            .flatten()
            .copied()
    }

    fn add(&mut self, number: u32, p: Point) {
        self.boxes.entry(self.key(p)).or_default().push(number);
    }
}

fn distance(a: Point, b: Point) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// Where a point lies along an edge, in its length, and how far beside it.
fn along([a, b]: [Point; 2], p: Point) -> [f64; 2] {
    let length = distance(a, b);
    let ahead = (0..3).map(|k| (p[k] - a[k]) * (b[k] - a[k])).sum::<f64>() / length;
    let foot = [0, 1, 2].map(|k| a[k] + ahead * (b[k] - a[k]) / length);
    [ahead, distance(p, foot)]
}

impl SceneFile {
    /// Welds all polygons, and cuts them into triangles and quadrilaterals; tells what has moved.
    pub(super) fn weld(&mut self, near: f64) -> Result<(), InputError> {
        let mut outlines = core::mem::take(&mut self.outlines);
        let (mut moved, mut furthest) = (0_usize, 0.0_f64);
        // The first vertex of every cluster, and what each different point has become.
        let mut kept: Vec<Point> = Vec::new();
        let mut known: HashMap<[u64; 3], Point> = HashMap::new();
        let mut grid = Grid {
            width: near,
            boxes: HashMap::new(),
        };
        let mut join = |p: &mut Point| {
            let key = p.map(|x| (x + 0.0).to_bits());
            if let Some(&to) = known.get(&key) {
                *p = to;
                return;
            }
            let [low, high] = [-near, near].map(|by| p.map(|x| x + by));
            let of = |&number: &u32| distance(kept[number as usize], *p);
            let nearest = (grid.near(low, high)).filter(|number| of(number) <= near);
            let nearest = nearest.min_by(|a, b| of(a).total_cmp(&of(b)));
            let to = match nearest {
                Some(number) => {
                    let to = kept[number as usize];
                    moved += 1;
                    furthest = furthest.max(distance(to, *p));
                    to
                }
                None => {
                    grid.add(kept.len() as u32, *p);
                    kept.push(*p);
                    *p
                }
            };
            known.insert(key, to);
            *p = to;
        };
        for outline in &mut outlines {
            let holes = outline.holes.iter_mut().flatten();
            outline.points.iter_mut().chain(holes).for_each(&mut join);
        }
        let points = known.len();
        self.meet(&mut outlines, &kept, near);
        let into_planes = flatten(&mut outlines, furthest);
        self.moved = into_planes.left;
        let mut thin: Vec<String> = Vec::new();
        for own in outlines {
            let place = self.place_of(own.place);
            if is_thin(&own.points, near) {
                let name = self
                    .surfaces
                    .get(own.surface)
                    .map_or("", |s| s.name.as_str());
                thin.push(format!("{name:?}, {place}"));
                continue;
            }
            let cut = self.cut(own.surface, &own.points, &own.holes, own.place, near);
            cut.map_err(|message| {
                let error = InputError::new(format_args!("{place}: {message}"));
                let surface = self.surfaces.get(own.surface);
                error.of_surface(surface.map_or("", |own| &own.name))
            })?;
        }
        for at in 0..self.surfaces.len() {
            self.fill_back(at);
        }
        if moved > 0 {
            // Less than a thousandth is rounding.
            let off = into_planes.furthest;
            let into = match off > 1e-3 * furthest {
                true => format!(", and into planes by {off:.1e} at most"),
                false => String::new(),
            };
            self.remarks.push(format!(
                "weld: {moved} of {points} vertices moved, by {furthest:.1e} at most{into}"
            ));
        }
        if let Some(first) = thin.first() {
            self.remarks.push(format!(
                "weld: {} polygon{} thinner than {near} left out; the first is that of {first}",
                thin.len(),
                if thin.len() == 1 {
                    " that is"
                } else {
                    "s that are"
                }
            ));
        }
        Ok(())
    }

    /// Gives edges the vertices that lie on them.
    fn meet(&self, outlines: &mut [Outline], kept: &[Point], near: f64) {
        let low = [0, 1, 2].map(|k| kept.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min));
        let high = [0, 1, 2].map(|k| kept.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max));
        let width = distance(low, high) / (kept.len() as f64).cbrt().max(1.0);
        let mut grid = Grid {
            width: width.max(2.0 * near),
            boxes: HashMap::new(),
        };
        for (number, &p) in (0..).zip(kept) {
            grid.add(number, p);
        }
        let refine = |points: &mut Vec<Point>| {
            points.dedup();
            while points.len() > 1 && points.first() == points.last() {
                points.pop();
            }
            let own = points.clone();
            let mut all = Vec::with_capacity(own.len());
            for (k, &a) in own.iter().enumerate() {
                let b = own[(k + 1) % own.len()];
                all.push(a);
                let from = [0, 1, 2].map(|k| f64::min(a[k], b[k]) - near);
                let to = [0, 1, 2].map(|k| f64::max(a[k], b[k]) + near);
                let length = distance(a, b);
                let found = grid.near(from, to).filter_map(|number| {
                    let p = kept[number as usize];
                    let [ahead, aside] = along([a, b], p);
                    let is_on = aside <= near && ahead > 0.0 && ahead < length;
                    (is_on && !own.contains(&p)).then_some((ahead, p))
                });
                let mut found: Vec<(f64, Point)> = found.collect();
                found.sort_by(|a, b| a.0.total_cmp(&b.0));
                all.extend(found.into_iter().map(|(_, p)| p));
            }
            *points = all;
        };
        for outline in outlines {
            refine(&mut outline.points);
            outline.holes.iter_mut().for_each(refine);
        }
    }
}

/// A plane of polygons: a unit normal, and its distance from the origin.
#[derive(Clone, Copy)]
struct Plane {
    normal: Point,
    distance: f64,
}

impl Plane {
    /// The plane that fits some polygons, each of which counts by its area.
    fn of<'a>(all: impl Iterator<Item = &'a Outline>, side: Point) -> Option<Self> {
        let (mut vector, mut point, mut area) = ([0.0; 3], [0.0; 3], 0.0);
        for own in all {
            let double = outline::area_vector(&own.points);
            let size = distance(double, [0.0; 3]);
            let sign = size.copysign(outline::dot(double, side)) / size;
            let share = size / own.points.len() as f64;
            for k in 0..3 {
                vector[k] += sign * double[k];
                point[k] += share * own.points.iter().map(|p| p[k]).sum::<f64>();
            }
            area += size;
        }
        let length = distance(vector, [0.0; 3]);
        let normal = vector.map(|x| x / length);
        let distance = outline::dot(normal, point) / area;
        distance.is_finite().then_some(Self { normal, distance })
    }

    /// How far a point is before it.
    fn height(&self, p: Point) -> f64 {
        outline::dot(self.normal, p) - self.distance
    }

    /// Whether all vertices of a polygon are so near to it.
    fn holds(&self, own: &Outline, near: f64) -> bool {
        let mut points = own.points.iter();
        points.all(|&p| self.height(p).abs() <= near)
    }
}

/// How far vertices have moved into planes, and are still off them, at most.
struct Flattened {
    furthest: f64,
    left: f64,
}

/// How many times a plane is fitted again to the polygons that are in it.
const FITS: usize = 3;

/// Moves vertices into the planes of their polygons, and those of polygons that meet within a plane into the plane of all of them: where vertices
/// are off by 20 µm the narrow parts beside a window would each face another way.
///
/// The plane of the larger polygon comes first; one that would take a vertex further than it may be off is left out.
fn flatten(outlines: &mut [Outline], off: f64) -> Flattened {
    let mut found = Flattened {
        furthest: 0.0,
        left: 0.0,
    };
    if off == 0.0 {
        return found;
    }
    let near = 2.0 * off;
    let key = |p: &Point| p.map(|x| (x + 0.0).to_bits());
    let size = |own: &Outline| distance(outline::area_vector(&own.points), [0.0; 3]);
    let mut at_vertex: HashMap<[u64; 3], Vec<usize>> = HashMap::new();
    for (number, own) in outlines.iter().enumerate() {
        for p in own.points.iter().chain(own.holes.iter().flatten()) {
            let at = at_vertex.entry(key(p)).or_default();
            if at.last() != Some(&number) {
                at.push(number);
            }
        }
    }
    let mut order: Vec<usize> = (0..outlines.len()).collect();
    order.retain(|&own| !is_thin(&outlines[own].points, near));
    order.sort_by(|&a, &b| size(&outlines[b]).total_cmp(&size(&outlines[a])));
    // The planes, of the largest polygon first, and that of each polygon.
    let mut planes: Vec<Plane> = Vec::new();
    let mut of: Vec<Option<usize>> = vec![None; outlines.len()];
    for &seed in &order {
        if of[seed].is_some() {
            continue;
        }
        let side = outline::area_vector(&outlines[seed].points);
        let mut region = vec![seed];
        let number = planes.len();
        for _ in 0..FITS {
            let all = region.iter().map(|&own| &outlines[own]);
            let Some(plane) = Plane::of(all, side) else {
                break;
            };
            planes.truncate(number);
            planes.push(plane);
            for own in region.drain(..) {
                of[own] = None;
            }
            region.push(seed);
            of[seed] = Some(number);
            let mut next = 0;
            while let Some(&own) = region.get(next) {
                next += 1;
                let rings = outlines[own].points.iter();
                let rings = rings.chain(outlines[own].holes.iter().flatten());
                for &other in rings.filter_map(|p| at_vertex.get(&key(p))).flatten() {
                    let polygon = &outlines[other];
                    let is_free = of[other].is_none() && !is_thin(&polygon.points, near);
                    if is_free && plane.holds(polygon, near) {
                        of[other] = Some(number);
                        region.push(other);
                    }
                }
            }
        }
    }
    let mut moved: HashMap<[u64; 3], Point> = HashMap::new();
    for (from, polygons) in &at_vertex {
        let mut own: Vec<usize> = polygons.iter().filter_map(|&own| of[own]).collect();
        own.sort_unstable();
        own.dedup();
        let p = from.map(f64::from_bits);
        let to = into_planes(p, own.iter().map(|&own| &planes[own]), near);
        found.furthest = found.furthest.max(distance(to, p));
        moved.insert(*from, to);
    }
    for (own, plane) in outlines.iter_mut().zip(of) {
        for p in own.points.iter_mut().chain(own.holes.iter_mut().flatten()) {
            *p = moved.get(&key(p)).copied().unwrap_or(*p);
            let left = plane.map_or(off, |plane| planes[plane].height(*p).abs());
            found.left = found.left.max(left);
        }
    }
    found
}

/// The point moved into planes, one after the other, each time along those before.
fn into_planes<'a>(p: Point, planes: impl Iterator<Item = &'a Plane>, near: f64) -> Point {
    let mut to = p;
    let mut known: Vec<Point> = Vec::new();
    for plane in planes {
        let mut along = plane.normal;
        for own in &known {
            let part = outline::dot(*own, along);
            along = [0, 1, 2].map(|k| along[k] - part * own[k]);
        }
        let square = outline::dot(along, along);
        let step = plane.height(to) / square;
        let next = [0, 1, 2].map(|k| to[k] - step * along[k]);
        // Written so that NaN fails.
        if known.len() < 3 && distance(next, p) <= 2.0 * near {
            to = next;
            known.push(along.map(|x| x / square.sqrt()));
        }
    }
    to
}
