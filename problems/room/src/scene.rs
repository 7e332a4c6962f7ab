//! Scenes: what a user gives, validated and made watertight.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;
use core::cell::Cell;
use fredholm_core::array::Each;

use fredholm_core::Real;
use fredholm_surfaces::{Enclosure, Forest, Limits, Material, MaterialFault, hull, margin};
use robust::{Coord, orient2d};

use crate::RoomError;
use crate::covered::{self, Covered};
use crate::error::Place;
use crate::geometry::{Backs, Geometry, Node, Strip, Wall};
use crate::hierarchy;
use crate::outside::Outside;
use crate::vector::{Vector, along, cross, dot, norm, sub};

/// A surface: a polyline, its active side on the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface<'a> {
    /// The vertices of the surface, at least two. A closed outline repeats its first vertex at the end.
    pub points: &'a [[f64; 2]],
    /// One material, or one for every segment.
    pub materials: &'a [Material],
}

/// A validated room, in f64, with coordinates that the walk's scalar has exactly.
///
/// Where walls meet they have a vertex in common: vertices nearer to each other than the scene's
/// smallest distance, 2⁻⁴⁰ of its width (2⁻¹⁶ for f32), are one, and a wall on which the end of
/// another lies is split there. So a room that is closed on paper is closed for rays, in spite of
/// rounding.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Pieces of segments, in the order of surfaces and, within one, in its direction; behind them copies of all.
    pub(crate) walls: Vec<Wall<f64>>,
    /// The number of walls without copies.
    pub(crate) own: usize,
    /// The period, if there is one.
    period: Option<Period>,
    /// The segment of each wall.
    places: Vec<Place>,
    pub(crate) strips: Vec<Strip<f64>>,
    pub(crate) nodes: Vec<Node<f64>>,
    /// The first wall of every surface, and their number.
    first: Vec<u32>,
    /// The coordinates of vertices; those that nothing uses any more are left in.
    pub(crate) vertices: Vec<Vector<f64>>,
    enclosure: Enclosure,
    covered: Vec<Covered>,
    /// The light from outside.
    pub(crate) outside: Vec<Outside<f64>>,
    /// The scene's smallest distance.
    pub(crate) smallest: f64,
}

fn limits<F: Real>() -> Limits {
    Limits::of::<F>([1e12, 1e100], [1e-6, 1e-100])
}

/// What repeats to the right and to the left without end.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Period {
    length: f64,
    /// The sine of the altitude below which rays may pass all copies.
    lost: f64,
    /// The middle of the room.
    centre: f64,
    /// Between which heights the walls are.
    heights: [f64; 2],
}

/// The most copies on a side where rays may pass them all, the least, and about the most walls of them.
const MOST_COPIES: usize = 64;
const LEAST_COPIES: usize = 8;
const COPIED_WALLS: usize = 4096;

impl Scene {
    /// Checks the surfaces and builds what rays need. F is the scalar of the walks; coordinates are
    /// rounded to it first.
    ///
    /// O(n log n) for n segments of ordinary scenes.
    ///
    /// # Errors
    /// All of [`RoomError`] that name a place or a surface.
    pub fn new<F: Real>(surfaces: &[Surface<'_>], enclosure: Enclosure) -> Result<Self, RoomError> {
        Self::made::<F>(surfaces, enclosure, None)
    }

    /// An open room that repeats with a period, to the right and to the left without end: rows of modules, streets. What leaves a
    /// period on the right enters the next one on the left.
    ///
    /// Rays meet copies of the walls, as many as can be met if walls that are connected reach from the lowest to the highest: nothing
    /// passes under or over these without leaving for good. Where there are none as many as there is room for, and
    /// [`lost`](Self::lost) says what may pass them.
    ///
    /// ```
    /// use fredholm_room::{Grading, Material, Mesh, Outside, Scene, Surface, Tables};
    ///
    /// // Modules of length 1, tilted by 30°, a row every 2: what their lower ends see of the sky.
    /// let black = [Material { reflectance: 0.0, emission: 0.0 }];
    /// let points = [[0.0, 0.0], [0.75f64.sqrt(), 0.5]];
    /// let modules = [Surface { points: &points, materials: &black }];
    /// let scene = Scene::periodic::<f64>(&modules, 2.0)?;
    /// let scene = scene.with_outside(Outside::sky(&[0.0, 90.0], &[[1.0; 2]]))?;
    /// let mesh = Mesh::new::<f64>(&scene, 1, Grading::default())?;
    /// let tables = Tables::<f64>::new(&scene, &mesh);
    /// let room = tables.room();
    /// let seen = room.from_outside(&room.on_wall(0, 0.0)?);
    /// assert!((seen - 0.795_345_247_3).abs() < 1e-10 && scene.lost() == 0.0);
    /// # Ok::<(), fredholm_room::RoomError>(())
    /// ```
    ///
    /// # Errors
    /// As [`new`](Self::new), and [`RoomError::Period`].
    pub fn periodic<F: Real>(surfaces: &[Surface<'_>], period: f64) -> Result<Self, RoomError> {
        Self::made::<F>(surfaces, Enclosure::Open, Some(period))
    }

    /// The largest share of what leaves any point evenly that may pass all copies of a room with a period, and is lost or counts as
    /// the sky's; 0 where none can.
    #[must_use]
    pub fn lost(&self) -> f64 {
        self.period.map_or(0.0, |own| own.lost)
    }

    /// A place in the period around which there are as many copies on either side. `None`: it is above or below all walls of a room
    /// with a period.
    #[must_use]
    pub fn folded(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let Some(own) = &self.period else {
            return Some([x, y]);
        };
        let [low, high] = own.heights;
        let turns = (x - own.centre) / own.length + 0.5;
        let cut = turns as i64 as f64;
        let turns = if cut > turns { cut - 1.0 } else { cut };
        (low..=high)
            .contains(&y)
            .then_some([x - turns * own.length, y])
    }

    fn made<F: Real>(
        surfaces: &[Surface<'_>],
        enclosure: Enclosure,
        period: Option<f64>,
    ) -> Result<Self, RoomError> {
        let mut scene = Self::read::<F>(surfaces, enclosure)?;
        scene.smallest = limits::<F>().smallest * scene.extent::<F>()?;
        let epsilon = F::EPSILON.to_f64();
        let is_short = |wall: &Wall<f64>| wall.length <= scene.smallest;
        if let Some(short) = scene.walls.iter().position(is_short) {
            return Err(RoomError::ZeroLength(scene.places[short]));
        }
        match period {
            None => scene.join()?,
            Some(length) => scene.repeat_without_end::<F>(length)?,
        }
        scene.check_overlap()?;
        scene.index(surfaces.len(), epsilon);
        scene.check_crossings()?;
        scene.leave_out_covered();
        if !scene.covered.is_empty() {
            scene.index(surfaces.len(), epsilon);
        }
        if enclosure == Enclosure::Closed {
            // In the scalar of the walks, to which nearly 1 may be 1.
            let absorbs = |wall: &Wall<f64>| F::from_f64(wall.reflectance) < F::one();
            crate::closed::check(&scene, &absorbs)?;
        }
        Ok(scene)
    }

    /// Builds what finds walls.
    fn index(&mut self, surfaces: usize, epsilon: f64) {
        self.first.clear();
        for (w, place) in (0..).zip(&self.places) {
            while self.first.len() <= place.surface {
                self.first.push(w);
            }
        }
        self.first.resize(surfaces + 1, self.own as u32);
        let margin = rounding(&self.walls, epsilon);
        (self.strips, self.nodes) = hierarchy::build(&self.walls, margin);
    }

    /// Leaves out the parts of walls on which obstacles stand.
    fn leave_out_covered(&mut self) {
        let covered = covered::find(self, self.enclosure == Enclosure::Open);
        let mut keep = alloc::vec![true; self.own];
        for (w, by) in covered.into_iter().filter(|(w, _)| *w < self.own) {
            self.covered.push(Covered {
                place: self.places[w],
                ends: self.walls[w].ends,
                by,
            });
            keep[w] = false;
        }
        let mut kept = keep.iter().cycle();
        self.walls.retain(|_| kept.next() == Some(&true));
        let mut kept = keep.iter();
        self.places.retain(|_| kept.next() == Some(&true));
        self.own = self.places.len();
    }

    /// Adds copies of the walls without end, as far as rays go.
    fn repeat_without_end<F: Real>(&mut self, length: f64) -> Result<(), RoomError> {
        let [low, high] = hull(&self.vertices);
        let width = (high[0] - low[0]) / length;
        // Written so that NaN fails.
        if !(length > self.smallest && length.is_finite() && width <= 100.0) {
            return Err(RoomError::Period);
        }
        // Copies as far as these lie over the room, and split its walls.
        let mut near = 1;
        while (near as f64) < width - 1e-9 {
            near += 1;
        }
        self.repeat::<F>(length, near);
        self.join()?;
        self.walls.truncate(self.own);
        self.places.truncate(self.own);
        let is_barred = self.is_barred([low[1], high[1]]);
        let room = (COPIED_WALLS / self.own.max(1)).clamp(LEAST_COPIES, MOST_COPIES);
        let copies = if is_barred {
            2 * near - 1
        } else {
            room.max(2 * near)
        };
        let rise = (high[1] - low[1]) / (length * (copies - near) as f64);
        self.period = Some(Period {
            length,
            lost: if is_barred {
                0.0
            } else {
                rise / Real::sqrt(1.0 + rise * rise)
            },
            centre: 0.5 * (low[0] + high[0]),
            heights: [low[1], high[1]],
        });
        self.repeat::<F>(length, copies);
        self.join()?;
        self.places.truncate(self.own);
        Ok(())
    }

    /// Whether connected walls reach from one height to another.
    fn is_barred(&self, [low, high]: [f64; 2]) -> bool {
        let mut sets = Forest::new(self.vertices.len());
        for wall in &self.walls {
            sets.unite(wall.vertices[0], wall.vertices[1]);
        }
        let mut heights: BTreeMap<u32, [f64; 2]> = BTreeMap::new();
        for wall in &self.walls {
            for (vertex, [_, y]) in wall.vertices.into_iter().zip(wall.ends) {
                let own = heights.entry(sets.root(vertex)).or_insert([y; 2]);
                *own = [own[0].min(y), own[1].max(y)];
            }
        }
        let reaches =
            |own: &[f64; 2]| own[0] <= low + self.smallest && own[1] >= high - self.smallest;
        heights.values().any(reaches)
    }

    /// Adds so many copies of all walls on either side.
    fn repeat<F: Real>(&mut self, length: f64, copies: usize) {
        let round = |x: f64| F::from_f64(x).to_f64();
        let own = self.walls.clone();
        let places = self.places.clone();
        for turn in (1..=copies).flat_map(|k| [k as f64, -(k as f64)]) {
            for raw in &own {
                let number = self.vertices.len() as u32;
                let moved = raw.ends.each(|[x, y]| [round(x + turn * length), y]);
                self.vertices.extend(moved);
                let material = Material {
                    reflectance: raw.reflectance,
                    emission: raw.emission,
                };
                let wall = wall([number, number + 1], &self.vertices, material);
                self.walls.push(wall);
            }
            self.places.extend_from_slice(&places);
        }
    }

    /// The parts of surfaces that lie under others, as an obstacle covers a part of the wall on which it stands. They are
    /// no walls: surfaces are shorter by them, and one that is covered wholly has no walls.
    #[must_use]
    pub fn covered(&self) -> &[Covered] {
        &self.covered
    }

    /// The number of surfaces.
    #[must_use]
    pub fn surfaces(&self) -> usize {
        self.first.len() - 1
    }

    /// The walls of a surface, in its direction.
    ///
    /// # Errors
    /// [`RoomError::Surface`].
    pub fn walls_of(&self, surface: usize) -> Result<core::ops::Range<usize>, RoomError> {
        match (self.first.get(surface), self.first.get(surface + 1)) {
            (Some(&from), Some(&to)) => Ok(from as usize..to as usize),
            _ => Err(RoomError::Surface { surface }),
        }
    }

    /// The surface, and the vertex of it where the segment begins, to which a wall belongs.
    #[must_use]
    pub fn place(&self, wall: usize) -> Option<Place> {
        let is_wall = wall < self.walls.len();
        let place = self.places.get(wall % self.own.max(1));
        place.filter(|_| is_wall).copied()
    }

    /// The wall, and the fraction of it, at the fraction `t` of a surface's length, without what is covered of it.
    ///
    /// # Errors
    /// [`RoomError::Surface`], also for a surface that is covered wholly; [`RoomError::Fraction`] for t outside [0, 1].
    pub fn along(&self, surface: usize, t: f64) -> Result<(usize, f64), RoomError> {
        let range = self.walls_of(surface)?;
        if !(0.0..=1.0).contains(&t) {
            return Err(RoomError::Fraction);
        }
        if range.is_empty() {
            return Err(RoomError::Surface { surface });
        }
        let last = range.end - 1;
        let mut rest = t * self.length(surface)?;
        for (w, wall) in range.clone().zip(self.walls.get(range).unwrap_or(&[])) {
            if rest < wall.length || w == last {
                return Ok((w, (rest / wall.length).min(1.0)));
            }
            rest -= wall.length;
        }
        Ok((last, 1.0))
    }

    /// The length of a surface, without what is covered of it.
    ///
    /// # Errors
    /// [`RoomError::Surface`].
    pub fn length(&self, surface: usize) -> Result<f64, RoomError> {
        let walls = self.walls.get(self.walls_of(surface)?).unwrap_or(&[]);
        // From 0: the sum of none is −0, over which a length is −∞.
        Ok(walls.iter().fold(0.0, |all, wall| all + wall.length))
    }

    /// Whether light may leave.
    #[must_use]
    pub const fn enclosure(&self) -> Enclosure {
        self.enclosure
    }

    /// The geometry in f64: for deterministic work. For walks see [`Tables`](crate::Tables).
    #[must_use]
    pub fn geometry(&self) -> Geometry<'_, f64> {
        Geometry::made(
            &self.walls,
            &self.strips,
            &self.nodes,
            self.enclosure == Enclosure::Open,
        )
        .with_copies(self.own)
    }

    /// No two walls may lie on each other and face the same side.
    fn check_overlap(&self) -> Result<(), RoomError> {
        let mut seen = BTreeMap::new();
        let places = self.places.iter().cycle();
        for (wall, &second) in self.walls.iter().zip(places) {
            if let Some(first) = seen.insert(wall.vertices, second) {
                return Err(RoomError::Overlap { first, second });
            }
        }
        Ok(())
    }

    /// No two walls may cross or touch but in a vertex that they share: by exact signs (Shewchuk
    /// 1997).
    fn check_crossings(&self) -> Result<(), RoomError> {
        let found = Cell::new(None);
        for (w, wall) in self.walls.iter().enumerate() {
            self.geometry().visit(
                |node| found.get().is_some() || passes(node, wall),
                |other| {
                    if (other.wall as usize) < w
                        && !wall.vertices.iter().any(|v| other.vertices.contains(v))
                        && touch(wall.ends, other.ends)
                    {
                        found.set(Some((w, other.wall as usize)));
                    }
                },
            );
            if let Some((second, first)) = found.get() {
                let (Some(first), Some(second)) = (self.place(first), self.place(second)) else {
                    break;
                };
                return Err(RoomError::Crossing { first, second });
            }
        }
        Ok(())
    }

    /// The first wall that a ray from the middle of a wall meets, backs included.
    pub(crate) fn probe(
        &self,
        from: usize,
        origin: Vector<f64>,
        direction: Vector<f64>,
    ) -> Option<crate::Hit<f64>> {
        let wall = self.walls.get(from)?;
        let geometry = self.geometry();
        geometry.nearest(wall, from as u32, origin, direction, Backs::Block)
    }
}

/// What the tests of boxes may be wrong by.
pub(crate) fn rounding(walls: &[Wall<f64>], epsilon: f64) -> f64 {
    let ends = walls.iter().flat_map(|wall| wall.ends);
    margin(ends.flatten(), epsilon)
}

/// The wall between two vertices.
fn wall(vertices: [u32; 2], points: &[Vector<f64>], material: Material) -> Wall<f64> {
    let at = |v: u32| points.get(v as usize).copied().unwrap_or_default();
    let ends = vertices.each(at);
    let span = sub(ends[1], ends[0]);
    let length = norm(span);
    Wall {
        ends,
        vertices,
        tangent: [span[0] / length, span[1] / length],
        length,
        reflectance: material.reflectance,
        emission: material.emission,
    }
}

impl Scene {
    /// The segments of surfaces, of which each has vertices of its own.
    fn read<F: Real>(surfaces: &[Surface<'_>], enclosure: Enclosure) -> Result<Self, RoomError> {
        let mut scene = Self {
            walls: Vec::new(),
            own: 0,
            period: None,
            places: Vec::new(),
            strips: Vec::new(),
            nodes: Vec::new(),
            first: Vec::new(),
            vertices: Vec::new(),
            enclosure,
            covered: Vec::new(),
            outside: Vec::new(),
            smallest: 0.0,
        };
        let round = |x: f64| F::from_f64(x).to_f64();
        let largest = limits::<F>().largest;
        for (s, surface) in surfaces.iter().enumerate() {
            let count = surface.points.len().saturating_sub(1);
            if count == 0 {
                return Err(RoomError::Vertices { surface: s });
            }
            if surface.materials.len() != 1 && surface.materials.len() != count {
                return Err(RoomError::Materials { surface: s });
            }
            let place = |vertex| Place { surface: s, vertex };
            let base = scene.vertices.len();
            for (v, &[x, y]) in surface.points.iter().enumerate() {
                // Written so that NaN fails.
                if !(x.abs() <= largest && y.abs() <= largest) {
                    return Err(RoomError::Coordinate(place(v)));
                }
                scene.vertices.push([round(x), round(y)]);
            }
            for (v, &material) in (0..count).zip(surface.materials.iter().cycle()) {
                material.check::<F>().map_err(|fault| match fault {
                    MaterialFault::Reflectance => RoomError::Reflectance(place(v)),
                    MaterialFault::Emission => RoomError::Emission(place(v)),
                })?;
                let number = u32::try_from(base + v).map_err(|_| RoomError::Cells)?;
                let wall = wall([number, number + 1], &scene.vertices, material);
                scene.walls.push(wall);
                scene.places.push(place(v));
            }
        }
        scene.own = scene.walls.len();
        Ok(scene)
    }

    /// The larger side of the bounding box.
    fn extent<F: Real>(&self) -> Result<f64, RoomError> {
        let &first = self.places.first().ok_or(RoomError::Empty)?;
        let [low, high] = hull(&self.vertices);
        let size = (high[0] - low[0]).max(high[1] - low[1]);
        if size >= limits::<F>().narrowest {
            Ok(size)
        } else if size == 0.0 {
            Err(RoomError::ZeroLength(first))
        } else {
            Err(RoomError::Coordinate(first))
        }
    }

    /// Makes vertices that are one into one, and splits walls where the ends of others lie on them.
    fn join(&mut self) -> Result<(), RoomError> {
        let smallest = self.smallest;
        (self.strips, self.nodes) = hierarchy::build(&self.walls, smallest);
        let mut parts = Forest::new(self.vertices.len());
        // Wall, distance along it, vertex.
        let mut splits: Vec<(u32, f64, u32)> = Vec::new();
        for (v, &point) in (0..).zip(&self.vertices) {
            let outside = |node: &Node<f64>| {
                let [x, y] = sub(point, node.centre);
                x.abs() > node.half[0] || y.abs() > node.half[1]
            };
            self.geometry().visit(outside, |segment| {
                let mut at_end = false;
                for (&end, other) in segment.ends.iter().zip(segment.vertices) {
                    if norm(sub(point, end)) <= smallest {
                        at_end = true;
                        parts.unite(v, other);
                    }
                }
                let span = sub(segment.ends[1], segment.ends[0]);
                let length = norm(span);
                let to = sub(point, segment.ends[0]);
                let (ahead, aside) = (dot(span, to) / length, cross(span, to) / length);
                if !at_end && aside.abs() <= smallest && ahead > 0.0 && ahead < length {
                    splits.push((segment.wall, ahead, v));
                }
            });
        }
        splits.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut splits = splits.into_iter().peekable();
        let count = self.walls.len();
        let walls = core::mem::take(&mut self.walls).into_iter();
        let places = core::mem::take(&mut self.places);
        let own = self.own;
        for ((w, raw), place) in (0..).zip(walls).zip(places) {
            if w as usize == own {
                self.own = self.walls.len();
            }
            let material = Material {
                reflectance: raw.reflectance,
                emission: raw.emission,
            };
            let mut push = |from: u32, to: u32| {
                let wall = wall([from, to], &self.vertices, material);
                self.walls.push(wall);
                self.places.push(place);
            };
            let [start, end] = raw.vertices.each(|v| parts.root(v));
            let mut from = start;
            while let Some((_, _, v)) = splits.next_if(|split| split.0 == w) {
                let v = parts.root(v);
                if v != from && v != start && v != end {
                    push(from, v);
                    from = v;
                }
            }
            if from == end {
                return Err(RoomError::ZeroLength(place));
            }
            push(from, end);
        }
        if own >= count {
            self.own = self.walls.len();
        }
        if u32::try_from(self.walls.len()).is_err() {
            return Err(RoomError::Cells);
        }
        Ok(())
    }
}

/// Whether the box is off the wall.
fn passes(node: &Node<f64>, wall: &Wall<f64>) -> bool {
    let [low, high] = hull(&wall.ends);
    let apart = |k: usize| {
        node.centre[k] + node.half[k] < low[k] || node.centre[k] - node.half[k] > high[k]
    };
    let [tx, ty] = wall.tangent;
    let size = tx.abs() * node.half[1] + ty.abs() * node.half[0];
    apart(0) || apart(1) || wall.height(node.centre).abs() > size
}

/// Whether two segments have a point in common.
fn touch(a: [Vector<f64>; 2], b: [Vector<f64>; 2]) -> bool {
    let apart = |s: [Vector<f64>; 2], t: [Vector<f64>; 2]| {
        let signs = t.each(|p| turn(s[0], s[1], p));
        (signs[0] > 0.0 && signs[1] > 0.0) || (signs[0] < 0.0 && signs[1] < 0.0)
    };
    let [la, ha] = hull(&a);
    let [lb, hb] = hull(&b);
    let boxes = (0..2).any(|k| ha[k] < lb[k] || hb[k] < la[k]);
    !(boxes || apart(a, b) || apart(b, a))
}

/// The sign of the turn a → b → c, exact: positive to the left.
pub(crate) fn turn(a: Vector<f64>, b: Vector<f64>, c: Vector<f64>) -> f64 {
    let [a, b, c] = [a, b, c].each(|[x, y]| Coord { x, y });
    orient2d(a, b, c)
}

/// The middle of a wall.
pub(crate) fn middle(wall: &Wall<f64>) -> Vector<f64> {
    along(wall.ends[0], 0.5 * wall.length, wall.tangent)
}
