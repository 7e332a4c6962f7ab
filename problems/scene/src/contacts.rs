//! Faces that touch: cut where others lie on them, stand on them or go through them, so that what nobody sees can leave the scene.
//!
//! People draw a cupboard on a floor that goes on below it, houses in a row each with all of its walls, walls that end below the
//! floor. A part of a face on which a solid stands looks into the solid: rays from it meet backs. So faces are cut along the edges
//! that lie in them, and each part is judged by rays. In an open scene a part leaves if all that it sees are backs, and parts that leave,
//! and what these see together are backs often enough; in a closed one
//! if it sees backs or nothing at all, and the rest must be closed. What lies face to face with a part that leaves, leaves with it.
//! Of two polygons on the same side of one plane, such as a window that is drawn on a wall, the surface with less area there stays.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::array::from_fn;
use fredholm_surfaces::{Enclosure, Forest};

use crate::geometry::{Face, Node};
use crate::radiosity::Radiosity;
use crate::ray::Backs;
use crate::scene::Scene;
use crate::vector::{Vector, along, centroid, cross, dot, least_axis, norm, ring, sub, turn, unit};

/// The sum of the areas of a surface that others cover, which leaves the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covered {
    /// The number of the surface.
    pub surface: usize,
    /// The number of the surface that covers it.
    pub by: usize,
    /// The area that is covered, in the square of the scene's unit of length.
    pub area: f64,
}

/// A line within a face along which another one meets it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seam {
    pub(crate) face: u32,
    pub(crate) ends: [Vector<f64>; 2],
}

/// How faces touch.
#[derive(Clone, Debug, Default)]
pub(crate) struct Contacts {
    pub(crate) seams: Vec<Seam>,
    /// Pairs that overlap in one plane and face opposite sides.
    pub(crate) opposite: Vec<[u32; 2]>,
    /// Pairs that overlap in one plane and face the same side.
    pub(crate) same: Vec<[u32; 2]>,
    /// Whether a face goes through another.
    pub(crate) cross: bool,
    /// Whether a face is there twice.
    pub(crate) has_twins: bool,
}

impl Contacts {
    /// Whether there is nothing to cut, or nobody knows what.
    pub(crate) const fn is_none(&self) -> bool {
        self.has_twins
            || (self.seams.is_empty() && self.opposite.is_empty() && self.same.is_empty())
    }

    /// Adds what two faces of one plane that overlap have to do with each other.
    pub(crate) fn lie(&mut self, [f, g]: [u32; 2], faces: [&Face<f64>; 2], touch: f64) {
        let pair = [f, g];
        if dot(faces[0].normal, faces[1].normal) < 0.0 {
            self.opposite.push(pair);
        } else {
            self.same.push(pair);
        }
        for (own, other) in [(0, 1), (1, 0)] {
            for ends in ring(faces[other].polygon()) {
                self.add(pair[own], faces[own], ends, touch);
            }
        }
    }

    /// Adds what two faces of different planes have in common.
    pub(crate) fn meet(&mut self, pair: [u32; 2], faces: [&Face<f64>; 2], touch: f64) {
        for (own, other) in [(0, 1), (1, 0)] {
            if let Some(line) = chord(faces[other], faces[own], touch) {
                self.add(pair[own], faces[own], line, touch);
            }
        }
    }

    /// Adds the part of a line that is inside of a face, and not along its outline.
    fn add(&mut self, number: u32, face: &Face<f64>, line: [Vector<f64>; 2], touch: f64) {
        let (points, normal) = (face.polygon(), face.normal);
        let inside = within(points, normal, line, touch);
        if inside.is_some_and(|[a, b]| norm(sub(b, a)) > touch)
            && let Some(ends) = within(points, normal, line, 0.0)
        {
            self.seams.push(Seam { face: number, ends });
        }
    }
}

/// Where a face meets the plane of another.
fn chord(face: &Face<f64>, plane: &Face<f64>, touch: f64) -> Option<[Vector<f64>; 2]> {
    let height = |p: Vector<f64>| {
        let h = plane.height(p);
        if h.abs() <= touch { 0.0 } else { h }
    };
    let mut found: Option<[Vector<f64>; 2]> = None;
    let mut add = |p: Vector<f64>| {
        found = Some(match found {
            None => [p, p],
            // The two that are furthest apart.
            Some([a, b]) => {
                let length = norm(sub(b, a));
                if norm(sub(p, a)) > length && norm(sub(p, a)) >= norm(sub(p, b)) {
                    [a, p]
                } else if norm(sub(p, b)) > length {
                    [p, b]
                } else {
                    [a, b]
                }
            }
        });
    };
    for [a, b] in ring(face.polygon()) {
        let (from, to) = (height(a), height(b));
        if from == 0.0 {
            add(a);
        } else if (from > 0.0 && to < 0.0) || (from < 0.0 && to > 0.0) {
            add(along(a, from / (from - to), sub(b, a)));
        }
    }
    found.filter(|[a, b]| norm(sub(*b, *a)) > touch)
}

/// The part of a line that is in a convex polygon, and further than `inset` from its outline.
fn within(
    polygon: &[Vector<f64>],
    normal: Vector<f64>,
    [from, to]: [Vector<f64>; 2],
    inset: f64,
) -> Option<[Vector<f64>; 2]> {
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for [a, b] in ring(polygon) {
        let inward = unit(cross(normal, sub(b, a)));
        let low = dot(inward, sub(from, a)) - inset;
        let high = dot(inward, sub(to, a)) - inset;
        if low <= 0.0 && high <= 0.0 {
            return None;
        }
        let t = low / (low - high);
        if low < 0.0 {
            enter = Real::max(enter, t);
        } else if high < 0.0 {
            leave = leave.min(t);
        }
    }
    let at = |t: f64| match t {
        0.0 => from,
        1.0 => to,
        _ => along(from, t, sub(to, from)),
    };
    (enter < leave).then(|| [at(enter), at(leave)])
}

/// A convex part of a face.
#[derive(Clone, Debug)]
struct Part {
    points: Vec<Vector<f64>>,
    /// The surface that covers it.
    by: Option<usize>,
}

/// A face in parts.
#[derive(Clone, Debug)]
struct Cut {
    face: u32,
    parts: Vec<Part>,
}

/// A polygon of a scene that was cut: those of a face that is whole are its own.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub(crate) face: u32,
    pub(crate) points: Vec<Vector<f64>>,
}

/// A scene in pieces, and what has left it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pieces {
    /// The polygons of faces that were cut, in ascending order of faces; a face that is covered wholly has none.
    pub(crate) cut: Vec<Piece>,
    /// Which faces are as they were.
    pub(crate) is_whole: Vec<bool>,
    pub(crate) covered: Vec<Covered>,
}

/// Cuts the faces that others touch, and leaves out what nobody sees; `None` if everything can stay as it is.
pub(crate) fn cut(scene: &Scene, contacts: &Contacts, touch: f64) -> Option<Pieces> {
    let mut own: Vec<u32> = contacts.seams.iter().map(|seam| seam.face).collect();
    let pairs = contacts.opposite.iter().chain(&contacts.same);
    own.extend(pairs.flatten());
    own.sort_unstable();
    own.dedup();
    let mut seams = contacts.seams.clone();
    seams.sort_by_key(|seam| seam.face);
    let mut cuts: Vec<Cut> = Vec::with_capacity(own.len());
    for face in own {
        let from = seams.partition_point(|seam| seam.face < face);
        let to = seams.partition_point(|seam| seam.face <= face);
        let lines = seams.get(from..to).unwrap_or(&[]);
        let own = scene.faces.get(face as usize)?;
        cuts.push(Cut {
            face,
            parts: parts(own, lines, touch),
        });
    }
    judge(scene, &mut cuts, touch);
    leave_together(scene, &mut cuts, &contacts.opposite);
    follow(scene, &mut cuts, touch);
    let is_drawn_over = draw_over(scene, &mut cuts, &contacts.same, touch);
    let mut covered: Vec<Covered> = Vec::new();
    let mut pieces = Pieces {
        is_whole: alloc::vec![true; scene.faces.len()],
        ..Pieces::default()
    };
    for cut in &cuts {
        let surface = scene.place_of(cut.face).surface;
        for part in &cut.parts {
            if let Some(by) = part.by {
                let area = area(&part.points);
                covered.push(Covered { surface, by, area });
            }
        }
        let is_changed = cut.parts.iter().any(|part| part.by.is_some());
        let has_lines = cut.parts.len() > 1;
        if is_changed || (has_lines && contacts.cross) {
            pieces.is_whole[cut.face as usize] = false;
            let left = cut.parts.iter().filter(|part| part.by.is_none());
            for part in left {
                for points in convex(scene, &part.points, touch) {
                    let face = cut.face;
                    pieces.cut.push(Piece { face, points });
                }
            }
        }
    }
    covered.sort_by_key(|own| (own.surface, own.by));
    for own in covered {
        match pieces.covered.last_mut() {
            Some(last) if (last.surface, last.by) == (own.surface, own.by) => last.area += own.area,
            _ => pieces.covered.push(own),
        }
    }
    let is_changed = !pieces.covered.is_empty() || contacts.cross;
    (is_changed && is_drawn_over).then_some(pieces)
}

/// The convex parts into which lines cut a face: each cuts those parts that it passes through.
fn parts(face: &Face<f64>, lines: &[Seam], touch: f64) -> Vec<Part> {
    let mut all = Vec::from([face.polygon().to_vec()]);
    let mut next: Vec<Vec<Vector<f64>>> = Vec::new();
    for seam in lines {
        let [a, b] = seam.ends;
        let aside = unit(cross(face.normal, sub(b, a)));
        let distance = |p: Vector<f64>| {
            let d = dot(aside, sub(p, a));
            if d.abs() <= touch { 0.0 } else { d }
        };
        for part in all.drain(..) {
            let passes = within(&part, face.normal, seam.ends, touch)
                .is_some_and(|[from, to]| norm(sub(to, from)) > touch);
            let (mut left, mut right) = (Vec::new(), Vec::new());
            if passes {
                for [p, q] in ring(&part) {
                    let (from, to) = (distance(p), distance(q));
                    if from >= 0.0 {
                        left.push(p);
                    }
                    if from <= 0.0 {
                        right.push(p);
                    }
                    if (from > 0.0 && to < 0.0) || (from < 0.0 && to > 0.0) {
                        let at = along(p, from / (from - to), sub(q, p));
                        // Where the line ends, or near it, its end is the vertex.
                        let end = seam
                            .ends
                            .into_iter()
                            .find(|&e| norm(sub(e, at)) <= 4.0 * touch);
                        left.push(end.unwrap_or(at));
                        right.push(end.unwrap_or(at));
                    }
                }
            }
            if left.len() >= 3 && right.len() >= 3 {
                next.extend([left, right]);
            } else {
                next.push(part);
            }
        }
        core::mem::swap(&mut all, &mut next);
    }
    let part = |points| Part { points, by: None };
    all.into_iter().map(part).collect()
}

fn area(points: &[Vector<f64>]) -> f64 {
    let Some((&hub, rest)) = points.split_first() else {
        return 0.0;
    };
    let double = rest.windows(2).fold([0.0; 3], |sum: Vector<f64>, pair| {
        let own = turn(hub, pair[0], pair[1]);
        from_fn(|k| sum[k] + own[k])
    });
    0.5 * norm(double)
}

/// The triangles and quadrilaterals that make up a convex part, without those that are thinner than what touches.
fn convex(scene: &Scene, points: &[Vector<f64>], touch: f64) -> Vec<Vec<Vector<f64>>> {
    let mut own = points.to_vec();
    // Vertices on straight edges are found again where faces are joined.
    let mut k = 0;
    while own.len() > 3 && k < own.len() {
        let n = own.len();
        let [a, b, c] = [own[(k + n - 1) % n], own[k], own[(k + 1) % n]];
        if norm(turn(a, b, c)) <= touch * norm(sub(c, a)) {
            own.remove(k);
        } else {
            k += 1;
        }
    }
    // Four vertices are in a plane if they are not off it by the precision of what was read.
    let most = if 2.0 * scene.flat > scene.smallest {
        1
    } else {
        2
    };
    let mut all = Vec::new();
    let mut at = 1;
    while at + 1 < own.len() {
        let to = (at + most).min(own.len() - 1);
        let mut piece = Vec::from([own[0]]);
        piece.extend_from_slice(own.get(at..=to).unwrap_or(&[]));
        let longest = ring(&piece).fold(0.0, |m: f64, [a, b]| Real::max(m, norm(sub(b, a))));
        if area(&piece) > 4.0 * touch * longest {
            all.push(piece);
        }
        at = to;
    }
    all
}

/// The number of rays from each of the points at which a part is judged.
const RAYS: u32 = 24;

/// In a closed scene a part is no part of the room if more than this share of its rays meets a back or nothing.
const STRAY: f64 = 0.05;

/// In an open scene parts that see nothing but each other and backs are in a solid if more than this share of their rays meets backs.
const BACKS: f64 = 0.02;

/// The number of a part's rays that may pass through the cracks between vertices that were rounded.
const LEAKS: usize = 1;

/// What rays from a part of a face meet.
#[derive(Clone, Debug, Default)]
struct View {
    rays: usize,
    /// The surfaces of backs.
    backs: Vec<usize>,
    misses: usize,
    /// Faces that are met from the front, and where.
    fronts: Vec<(u32, Vector<f64>)>,
}

impl View {
    fn of(scene: &Scene, number: u32, points: &[Vector<f64>]) -> Self {
        let mut view = Self::default();
        let Some(face) = scene.faces.get(number as usize) else {
            return view;
        };
        let geometry = scene.geometry();
        let middle = centroid(points);
        let origins = points.iter().map(|&p| along(middle, 0.5, sub(p, middle)));
        let x = unit(cross(face.normal, least_axis(face.normal)));
        let y = cross(face.normal, x);
        for (k, from) in (0..).zip(core::iter::once(middle).chain(origins)) {
            for ray in 0..RAYS {
                let numbers = spread(k * RAYS + ray);
                let direction = Radiosity::<f64>::direction([x, y], face.normal, numbers);
                view.rays += 1;
                match geometry.nearest(Some(face), from, direction, Backs::Block) {
                    None => view.misses += 1,
                    Some(hit) if hit.back => view.backs.push(scene.place_of(hit.face).surface),
                    Some(hit) => view.fronts.push((hit.face, hit.point)),
                }
            }
        }
        view.backs.sort_unstable();
        view
    }

    /// Whether a part of a closed scene is no part of the room.
    fn is_astray(&self) -> bool {
        (self.backs.len() + self.misses) as f64 > STRAY * self.rays as f64
    }

    /// Whether what has this view leaves with the parts of `cuts` that do.
    fn is_covered(&self, scene: &Scene, cuts: &[Cut], touch: f64) -> bool {
        match scene.enclosure() {
            Enclosure::Closed => self.is_astray(),
            Enclosure::Open => {
                self.has_backs()
                    && self.leaks(|face, at| leaves(scene, cuts, face, at, touch)) <= LEAKS
            }
        }
    }

    /// The number of rays that meet nothing, or fronts that stay.
    fn leaks(&self, leaves: impl Fn(u32, Vector<f64>) -> bool) -> usize {
        let stay = self.fronts.iter().filter(|&&(face, at)| !leaves(face, at));
        self.misses + stay.count()
    }

    /// Whether nothing of it is far away.
    const fn is_inside(&self) -> bool {
        self.misses <= LEAKS
    }

    /// Whether nothing of it is far away, and something of it is a back: where solids crowd each other most of it are fronts.
    const fn has_backs(&self) -> bool {
        self.is_inside() && !self.backs.is_empty()
    }

    /// The surface most of whose backs are seen.
    fn covering(&self) -> Option<usize> {
        let runs = self.backs.chunk_by(|a, b| a == b);
        let most = runs.max_by_key(|run| run.len());
        most.and_then(|run| run.first().copied())
    }
}

/// Adds whole faces that parts see which may be covered, if they may be covered themselves: those of a solid that is in another one are
/// touched by none.
fn look_inside(scene: &Scene, cuts: &mut Vec<Cut>, views: &mut Vec<Vec<View>>) {
    let mut is_known = alloc::vec![false; scene.faces.len()];
    for cut in cuts.iter() {
        is_known[cut.face as usize] = true;
    }
    let seen = |view: &View| -> Vec<u32> {
        let fronts = view.fronts.iter().filter(|_| view.has_backs());
        fronts.map(|front| front.0).collect()
    };
    let mut next: Vec<u32> = views.iter().flatten().flat_map(seen).collect();
    while let Some(number) = next.pop() {
        let (Some(face), Some(known)) = (
            scene.faces.get(number as usize),
            is_known.get_mut(number as usize),
        ) else {
            continue;
        };
        if core::mem::replace(known, true) {
            continue;
        }
        let points = face.polygon().to_vec();
        let view = View::of(scene, number, &points);
        if view.has_backs() {
            next.extend(seen(&view));
            let at = cuts.partition_point(|cut| cut.face < number);
            let parts = Vec::from([Part { points, by: None }]);
            cuts.insert(
                at,
                Cut {
                    face: number,
                    parts,
                },
            );
            views.insert(at, Vec::from([view]));
        }
    }
}

/// Says which parts are covered. In an open scene that is what sees nothing but backs and parts that are covered as well: the largest
/// such set, as houses in a row see each other's walls, without those that hardly see a back.
fn judge(scene: &Scene, cuts: &mut Vec<Cut>, touch: f64) {
    let mut views: Vec<Vec<View>> = Vec::with_capacity(cuts.len());
    for cut in cuts.iter() {
        let parts = cut.parts.iter();
        views.push(
            parts
                .map(|part| View::of(scene, cut.face, &part.points))
                .collect(),
        );
    }
    if scene.enclosure() == Enclosure::Open {
        look_inside(scene, cuts, &mut views);
    }
    let mut open: Vec<[usize; 2]> = Vec::new();
    for (c, parts) in views.iter().enumerate() {
        for (p, view) in parts.iter().enumerate() {
            let is_covered = match scene.enclosure() {
                Enclosure::Closed => view.is_astray(),
                Enclosure::Open => view.is_inside(),
            };
            if is_covered {
                let own = scene.place_of(cuts[c].face).surface;
                cuts[c].parts[p].by = Some(view.covering().unwrap_or(own));
                open.push([c, p]);
            }
        }
    }
    if scene.enclosure() == Enclosure::Closed {
        return;
    }
    loop {
        let before = open.len();
        let is_seeing = |&[c, p]: &[usize; 2]| {
            views[c][p].leaks(|face, at| leaves(scene, cuts, face, at, touch)) > LEAKS
        };
        let (seeing, rest) = open.iter().partition(|own| is_seeing(own));
        let seeing: Vec<[usize; 2]> = seeing;
        open = rest;
        for [c, p] in seeing {
            cuts[c].parts[p].by = None;
        }
        if open.len() == before {
            break;
        }
    }
    // Those that see each other, but for leaks.
    let mut rooms = Forest::new(open.len());
    for (k, &[c, p]) in (0..).zip(&open) {
        let met = views[c][p].fronts.iter();
        let met = met.filter_map(|&(face, at)| part_at(scene, cuts, face, at));
        let mut met: Vec<u32> = met
            .filter_map(|part| open.binary_search(&part).ok())
            .map(|at| at as u32)
            .collect();
        met.sort_unstable();
        for run in met.chunk_by(|a, b| a == b).filter(|run| run.len() > LEAKS) {
            rooms.unite(k, run[0]);
        }
    }
    let mut rays = alloc::vec![[0, 0]; open.len()];
    for (k, &[c, p]) in (0..).zip(&open) {
        let sums = &mut rays[rooms.root(k) as usize];
        let view = &views[c][p];
        *sums = [sums[0] + view.backs.len(), sums[1] + view.rays];
    }
    for (k, &[c, p]) in (0..).zip(&open) {
        let [backs, all] = rays[rooms.root(k) as usize];
        if backs as f64 <= BACKS * all as f64 {
            cuts[c].parts[p].by = None;
        }
    }
}

/// Numbers from 0 to 1 that are spread evenly: multiples of irrational numbers (Weyl 1916).
fn spread(k: u32) -> [f64; 2] {
    let fraction = |a: f64| {
        let multiple = (f64::from(k) + 0.5) * a;
        multiple - (multiple as u64) as f64
    };
    // The plastic number's powers.
    [
        fraction(0.754_877_666_246_692_7),
        fraction(0.569_840_290_998_053_3),
    ]
}

/// Whether a point of its plane is in a convex polygon.
fn holds(points: &[Vector<f64>], normal: Vector<f64>, at: Vector<f64>) -> bool {
    ring(points).all(|[a, b]| dot(cross(normal, sub(b, a)), sub(at, a)) >= 0.0)
}

/// The parts of a face, by numbers of cuts and parts, and how far inside of each a point is.
fn depths(
    scene: &Scene,
    cuts: &[Cut],
    number: u32,
    at: Vector<f64>,
) -> impl Iterator<Item = ([usize; 2], f64)> {
    let cut = cuts.binary_search_by_key(&number, |cut| cut.face).ok();
    let found = cut.and_then(|k| Some((k, cuts.get(k)?, scene.faces.get(number as usize)?.normal)));
    found.into_iter().flat_map(move |(k, cut, normal)| {
        cut.parts.iter().enumerate().map(move |(p, part)| {
            let depths =
                ring(&part.points).map(|[a, b]| dot(unit(cross(normal, sub(b, a))), sub(at, a)));
            (
                [k, p],
                depths.fold(f64::INFINITY, |least: f64, d| least.min(d)),
            )
        })
    })
}

/// The part of a face in which a point is, or to which it is nearest.
fn part_at(scene: &Scene, cuts: &[Cut], number: u32, at: Vector<f64>) -> Option<[usize; 2]> {
    let nearest = depths(scene, cuts, number, at).max_by(|a, b| a.1.total_cmp(&b.1));
    nearest.map(|(part, _)| part)
}

/// Whether a point of a face is in a part that leaves, or on the outline of one.
fn leaves(scene: &Scene, cuts: &[Cut], number: u32, at: Vector<f64>, touch: f64) -> bool {
    let mut parts = depths(scene, cuts, number, at).filter(|(_, depth)| *depth >= -touch);
    parts.any(|([c, p], _)| cuts[c].parts[p].by.is_some())
}

/// Faces that are covered wholly and have an edge in common with what leaves, leave as well: the bottom of a box that reaches through a
/// floor.
fn follow(scene: &Scene, cuts: &mut Vec<Cut>, touch: f64) {
    let leaving = |cut: &Cut| -> Vec<Vec<Vector<f64>>> {
        let parts = cut.parts.iter().filter(|part| part.by.is_some());
        parts.map(|part| part.points.clone()).collect()
    };
    let mut open: Vec<Vec<Vector<f64>>> = cuts.iter().flat_map(leaving).collect();
    let mut is_judged = alloc::vec![false; scene.faces.len()];
    for cut in cuts.iter() {
        is_judged[cut.face as usize] = true;
    }
    while let Some(points) = open.pop() {
        for [a, b] in ring(&points) {
            let middle = along(a, 0.5, sub(b, a));
            let off = |node: &Node<f64>| {
                (0..3).any(|k| middle[k] < node.low[k] - touch || middle[k] > node.high[k] + touch)
            };
            for triangle in scene.geometry().but(off) {
                let number = triangle.face;
                let (Some(face), Some(done)) = (
                    scene.faces.get(number as usize),
                    is_judged.get_mut(number as usize),
                ) else {
                    continue;
                };
                let is_near = |[p, q]: [Vector<f64>; 2]| {
                    let span = sub(q, p);
                    let t = (dot(span, sub(middle, p)) / dot(span, span)).clamp(0.0, 1.0);
                    norm(sub(middle, along(p, t, span))) <= touch
                };
                if *done || !ring(face.polygon()).any(is_near) {
                    continue;
                }
                *done = true;
                let points = face.polygon().to_vec();
                let view = View::of(scene, number, &points);
                if view.is_covered(scene, cuts, touch) {
                    open.push(points.clone());
                    let own = scene.place_of(number).surface;
                    let by = Some(view.covering().unwrap_or(own));
                    let parts = Vec::from([Part { points, by }]);
                    let face = number;
                    let at = cuts.partition_point(|cut| cut.face < face);
                    cuts.insert(at, Cut { face, parts });
                }
            }
        }
    }
}

/// What lies face to face with a part that leaves, leaves with it.
fn leave_together(scene: &Scene, cuts: &mut [Cut], opposite: &[[u32; 2]]) {
    let mut leaving: Vec<([usize; 2], usize)> = Vec::new();
    for &[f, g] in opposite {
        for [own, other] in [[f, g], [g, f]] {
            let Ok(at) = cuts.binary_search_by_key(&own, |cut| cut.face) else {
                continue;
            };
            let by = scene.place_of(other).surface;
            for (k, part) in cuts[at].parts.iter().enumerate() {
                let middle = centroid(&part.points);
                let lies = scene
                    .faces
                    .get(other as usize)
                    .is_some_and(|face| holds(face.polygon(), face.normal, middle));
                let twin = part_at(scene, cuts, other, middle).filter(|_| lies);
                let leaves = twin.is_some_and(|[c, p]| cuts[c].parts[p].by.is_some());
                if part.by.is_none() && leaves {
                    leaving.push(([at, k], by));
                }
            }
        }
    }
    for ([cut, part], by) in leaving {
        cuts[cut].parts[part].by = Some(by);
    }
}

/// Leaves out, where polygons face the same side of one plane and are both there, those of the larger surface. Says whether each of the
/// smaller one lies on it wholly: else nobody knows which one is meant.
fn draw_over(scene: &Scene, cuts: &mut [Cut], same: &[[u32; 2]], touch: f64) -> bool {
    let surface = |f: u32| scene.place_of(f).surface;
    let face = |f: u32| scene.faces.get(f as usize);
    // The area of the surface in the face's plane.
    let size = |f: u32| -> f64 {
        let own = scene.faces_of(surface(f)).unwrap_or(0..0);
        let plane = face(f).map_or(u32::MAX, |face| face.plane);
        let faces = own.filter_map(|g| scene.faces.get(g));
        faces.filter(|g| g.plane == plane).map(|g| g.area).sum()
    };
    let has_left = |cuts: &[Cut], own: u32, other: u32| {
        let (Some(over), Ok(at)) = (face(other), cuts.binary_search_by_key(&own, |cut| cut.face))
        else {
            return false;
        };
        let mut parts = cuts[at].parts.iter().filter(|part| part.by.is_none());
        parts.all(|part| !holds(over.polygon(), over.normal, centroid(&part.points)))
    };
    let mut over: Vec<(u32, f64)> = Vec::new();
    for &[f, g] in same {
        // Bottoms of solids that reach into each other.
        if has_left(cuts, f, g) || has_left(cuts, g, f) {
            continue;
        }
        let (a, b) = (size(f), size(g));
        if surface(f) == surface(g) || a == b {
            return false;
        }
        let (small, large) = if a < b { (f, g) } else { (g, f) };
        let (Some(upper), Ok(at)) = (
            face(small),
            cuts.binary_search_by_key(&large, |cut| cut.face),
        ) else {
            return false;
        };
        let mut hidden = 0.0;
        for part in &mut cuts[at].parts {
            if holds(upper.polygon(), upper.normal, centroid(&part.points)) {
                part.by = Some(surface(small));
                hidden += area(&part.points);
            }
        }
        over.push((small, hidden));
    }
    over.sort_by_key(|own| own.0);
    over.chunk_by(|a, b| a.0 == b.0).all(|own| {
        let hidden: f64 = own.iter().map(|o| o.1).sum();
        let Some(face) = own.first().and_then(|o| face(o.0)) else {
            return false;
        };
        let around: f64 = ring(face.polygon()).map(|[a, b]| norm(sub(b, a))).sum();
        (hidden - face.area).abs() <= 4.0 * touch * around + 1e-9 * face.area
    })
}
