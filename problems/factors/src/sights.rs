//! What every face sees of every other.

use alloc::vec::Vec;
use core::f64::consts::PI;

use fredholm_core::Real;
use fredholm_scene::{Face, Scene, form_factor_from_origin};
use fredholm_surfaces::Enclosure;
use fredholm_surfaces::space::{Vector, centroid, cross, dot, norm, ring, sub, unit};

use crate::FactorsError;
use crate::clear::{self, Amount, PARALLEL, Sheet};
use crate::clip::{cut, keep};
use crate::occluders::{Occluder, Occluders};
use crate::partial::{self, Wanted};
use crate::points::Buffers;
use crate::rules::{Rules, area, radius};
use crate::segments;
use crate::shaft::{Between, Hides, Shaft};
use crate::sky::Sky;

/// How many times a form factor is smaller than what bounds it from afar, by chance.
const BOUND: f64 = 8.0;

/// The number of polygons that may hide something from which on a few lines take less than to find those between two faces.
const CROWD: usize = 256;

/// The most halves that are cut off of a cone of directions: of ground to the horizon a four-thousandth is left then.
const CUTS: usize = 12;

/// The inputs of form factors: a scene, the polygons that may hide something, and the error
/// that is allowed.
///
/// Rows are independent of each other: threads share one of these, and
/// [`Factors::new`](crate::Factors::new) puts the rows together.
#[derive(Clone, Debug)]
pub struct Sights<'a> {
    scene: &'a Scene,
    /// The faces, of which those in one plane have its normal.
    faces: Vec<Face<f64>>,
    occluders: Occluders,
    rules: Rules,
    error: f64,
    /// The middle of each face, and its largest distance from a vertex.
    balls: Vec<(Vector<f64>, f64)>,
    /// What is nearer than this to a plane is in it.
    slack: f64,
    /// How far vertices may be from where they were meant to be, if that is more than rounding errors of double precision.
    blur: f64,
}

/// The exchange of one face with those after it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// The numbers of faces, ascending, and A_i F_ij, in the unit of area.
    pub entries: Vec<(u32, f64)>,
    /// The largest estimated error of a form factor F_ij or F_ji.
    pub error: f64,
    /// The number of pairs that see each other in part.
    pub partial: usize,
}

/// What a face exchanges with the patches of a sky.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SkyRow {
    /// A_i F_ik of every patch k and, last, of all directions below the horizon, in the unit of area.
    pub exchange: Vec<f64>,
    /// The largest estimated error of a form factor.
    pub error: f64,
}

impl<'a> Sights<'a> {
    /// Prepares a scene: faces of one plane are made into few large polygons, which hide the same.
    /// Where something hides a part, form factors are computed to `error`, in F.
    ///
    /// # Errors
    /// [`FactorsError::Tolerance`]; [`FactorsError::Repeats`].
    pub fn new(scene: &'a Scene, error: f64) -> Result<Self, FactorsError> {
        if scene.period().is_some() {
            return Err(FactorsError::Repeats);
        }
        if !(1e-13..=0.1).contains(&error) {
            return Err(FactorsError::Tolerance);
        }
        let mut faces = scene.faces().to_vec();
        let (mut slack, mut blur) = (scene.smallest_distance(), 0.0);
        // Faces whose vertices are off their plane by more than what is one place have normals of their own, which are off, too.
        if 2.0 * scene.flatness() > slack {
            slack = 2.0 * scene.flatness();
            blur = scene.precision().distance;
            share_normals(&mut faces);
        }
        let ball = |face: &Face<f64>| {
            let middle = centroid(face.polygon());
            (middle, radius(face.polygon(), middle))
        };
        Ok(Self {
            scene,
            balls: faces.iter().map(ball).collect(),
            occluders: Occluders::new(scene, &faces, slack),
            faces,
            rules: Rules::new(if blur > 0.0 { slack } else { 0.0 }),
            error,
            slack,
            blur,
        })
    }

    /// The number of polygons that may hide something.
    #[must_use]
    pub const fn occluders(&self) -> usize {
        self.occluders.len()
    }

    /// The exchange of a face with those after it.
    #[must_use]
    pub fn row(&self, face: usize) -> Row {
        self.row_from(face, face + 1)
    }

    /// The exchange of a face with all others: what a row takes that is wanted alone.
    #[must_use]
    pub fn whole_row(&self, face: usize) -> Row {
        self.row_from(face, 0)
    }

    fn row_from(&self, face: usize, first: usize) -> Row {
        let mut row = Row::default();
        let Some(own) = self.faces.get(face) else {
            return row;
        };
        let (mut shaft, mut buffers) = (Shaft::default(), Buffers::default());
        for (number, other) in self.faces.iter().enumerate().skip(first) {
            // Rounding must not make more of a face than all.
            let pair = [(face, own), (number, other)];
            let amount = self.pair(pair, &mut row, &mut shaft, &mut buffers);
            let amount = amount.min(own.area).min(other.area);
            if amount > 0.0 {
                row.entries.push((number as u32, amount));
            }
        }
        row
    }

    /// What the exchange of a face with all others takes, in form factors from a point past one obstacle, of which a second has about a
    /// million: a forecast, the same on every machine.
    #[must_use]
    pub fn work(&self, face: usize) -> f64 {
        let Some(own) = self.faces.get(face) else {
            return 0.0;
        };
        let fronts = self.scene.enclosure() == Enclosure::Closed;
        let mut shaft = Shaft::default();
        let mut sum = 0.0;
        for other in self.faces.iter().filter(|other| other.plane != own.plane) {
            let (mut a, mut b) = (Vec::new(), Vec::new());
            let (Some(first), Some(second)) = (
                in_front(own, other, self.slack, &mut a),
                in_front(other, own, self.slack, &mut b),
            ) else {
                continue;
            };
            shaft.enclose(first, second, self.slack);
            sum += 1.0;
            if let Between::Some(found) = shaft.between(&self.occluders, (first, second), fronts) {
                let apart = sub(own.corners[0], other.corners[0]);
                // Below what a disc of this area at this distance would have.
                let clear = (other.area / (other.area + dot(apart, apart))).min(1.0);
                sum += partial::work(found.len(), clear, self.error);
            }
        }
        sum
    }

    /// What the exchange of a face with the patches of a sky takes, in the unit of [`Sights::work`].
    #[must_use]
    pub fn sky_work(&self, face: usize, sky: &Sky) -> f64 {
        let Some(own) = self.faces.get(face) else {
            return 0.0;
        };
        let sheet = Sheet {
            points: own.polygon(),
            normal: own.normal,
            far: false,
        };
        let mut shaft = Shaft::default();
        let mut sum = 0.0;
        for piece in sky.pieces() {
            sum += 1.0;
            if let Some(Seen { cone, found }) = self.seen(sheet, &piece.corners, &mut shaft) {
                let clear = form_factor_from_origin(own.normal, &cone);
                sum += partial::work(found.len(), clear, self.error * piece.share);
            }
        }
        sum
    }

    /// The exchange of a face with the patches of a sky. Those that nothing hides are exact but for rounding, others to
    /// the error of form factors.
    ///
    /// ```
    /// use fredholm_factors::{Sights, Sky};
    /// use fredholm_scene::{Enclosure, Material, Polygon, Scene, Surface};
    ///
    /// // A square on the ground sees of a band between two altitudes the difference of the squares of their sines.
    /// let square = [Polygon::Quad([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])];
    /// let surface = Surface { polygons: &square, materials: &[Material::BLACK] };
    /// let scene = Scene::new::<f64>(&[surface], Enclosure::Open)?;
    /// let sky = Sky::bands(&[0.0, 45.0, 90.0], &[1, 1])?;
    /// let row = Sights::new(&scene, 1e-9)?.sky(0, &sky)?;
    /// // But for arcs of great circles instead of circles of altitude.
    /// assert!((row.exchange[1] - 0.5).abs() < 0.01);
    /// assert!((row.exchange[0] + row.exchange[1] - 1.0).abs() < 1e-15);
    /// assert_eq!(row.exchange[2], 0.0);
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`FactorsError::Face`] for a face that is none, [`FactorsError::NoSky`] if the scene is closed.
    pub fn sky(&self, face: usize, sky: &Sky) -> Result<SkyRow, FactorsError> {
        let own = self.faces.get(face).ok_or(FactorsError::Face { face })?;
        if self.scene.enclosure() == Enclosure::Closed {
            return Err(FactorsError::NoSky);
        }
        let sheet = Sheet {
            points: own.polygon(),
            normal: own.normal,
            far: false,
        };
        let mut row = SkyRow {
            exchange: alloc::vec![0.0; sky.patches().len() + 1],
            error: 0.0,
        };
        let mut errors = row.exchange.clone();
        let (mut shaft, mut buffers) = (Shaft::default(), Buffers::default());
        for piece in sky.pieces() {
            let error = self.error * own.area * piece.share;
            let amount = self.piece(sheet, &piece.corners, error, &mut shaft, &mut buffers);
            let sums = [&mut row.exchange, &mut errors].map(|list| list.get_mut(piece.patch));
            if let [Some(sum), Some(error)] = sums {
                *sum += amount.value;
                *error += amount.error / own.area;
            }
        }
        row.error = errors.into_iter().fold(0.0, |m: f64, e| Real::max(m, e));
        Ok(row)
    }

    const fn wanted(&self, error: f64) -> Wanted<'_> {
        Wanted {
            error,
            occluders: &self.occluders,
            rules: &self.rules,
        }
    }

    /// What a face exchanges with a cone of directions.
    fn piece(
        &self,
        own: Sheet<'_>,
        cone: &[Vector<f64>],
        error: f64,
        shaft: &mut Shaft,
        buffers: &mut Buffers,
    ) -> Amount {
        let Some(Seen { cone, found }) = self.seen(own, cone, shaft) else {
            return Amount::default();
        };
        let pair = (own, own.directions(&cone));
        if found.is_empty() {
            clear::exchange(pair.0, pair.1, 0.0, &self.rules)
        } else {
            partial::exchange(pair, &found, false, self.wanted(error), shaft, buffers)
        }
    }

    /// What a face may see of a cone of directions, and its shaft; `None` if that is nothing.
    fn seen(&self, own: Sheet<'_>, cone: &[Vector<f64>], shaft: &mut Shaft) -> Option<Seen<'_>> {
        let mut cone = keep(cone, |d| dot(own.normal, d), PARALLEL);
        if cone.len() < 3 {
            return None;
        }
        let found = self.between(own, &cone, shaft)?;
        self.trim(own, &mut cone, &found, shaft);
        let found = self.between(own, &cone, shaft)?;
        Some(Seen { cone, found })
    }

    /// What may be between a face and a cone of directions; `None` if one polygon hides all.
    fn between(
        &self,
        own: Sheet<'_>,
        cone: &[Vector<f64>],
        shaft: &mut Shaft,
    ) -> Option<Vec<&Occluder>> {
        let pair = (own, own.directions(cone));
        shaft.enclose(pair.0, pair.1, self.slack);
        match shaft.between(&self.occluders, pair, false) {
            Between::Hidden => None,
            Between::Some(found) => Some(found),
        }
    }

    /// Cuts off of a cone of directions what one polygon hides from all of a face, as long as that is half of all on from an edge; ground
    /// hides most of what is below the horizon.
    fn trim(
        &self,
        own: Sheet<'_>,
        cone: &mut Vec<Vector<f64>>,
        found: &[&Occluder],
        shaft: &mut Shaft,
    ) {
        let (mut cuts, mut edge) = (0, 0);
        while edge < cone.len() && cuts < CUTS {
            let Some([near, off]) = split(cone, edge) else {
                edge += 1;
                continue;
            };
            shaft.enclose(own, own.directions(&off), self.slack);
            let hides = |o: &&Occluder| {
                matches!(
                    shaft.of_one(o, own, own.directions(&off), false),
                    Hides::All
                )
            };
            if found.iter().any(hides) {
                *cone = near;
                cuts += 1;
            } else {
                edge += 1;
            }
        }
    }

    /// A_i F_ij of two faces.
    fn pair(
        &self,
        [(i, a), (j, b)]: [(usize, &Face<f64>); 2],
        row: &mut Row,
        shaft: &mut Shaft,
        buffers: &mut Buffers,
    ) -> f64 {
        if a.plane == b.plane {
            return 0.0;
        }
        let slack = self.slack;
        let (mut own, mut other) = (Vec::new(), Vec::new());
        let (Some(first), Some(second)) = (
            in_front(a, b, slack, &mut own),
            in_front(b, a, slack, &mut other),
        ) else {
            return 0.0;
        };
        let pair = (first, second);
        let fronts = self.scene.enclosure() == Enclosure::Closed;
        let smaller = a.area.min(b.area);
        // Lines come before what may be between where that takes longer.
        let is_crowded = self.occluders.len() > CROWD;
        if is_crowded && let Some(amount) = self.left([i, j], pair, smaller, row) {
            return amount;
        }
        shaft.enclose(first, second, slack);
        let amount = match shaft.between(&self.occluders, pair, fronts) {
            Between::Hidden => return 0.0,
            Between::Some(found) if found.is_empty() => {
                // What a form factor with nothing between may be wrong by: such are cheap.
                clear::exchange(first, second, 1e-4 * self.error, &self.rules)
            }
            Between::Some(found) => {
                if !is_crowded && let Some(amount) = self.left([i, j], pair, smaller, row) {
                    return amount;
                }
                row.partial += 1;
                let error = self.error * smaller;
                partial::exchange(pair, &found, fronts, self.wanted(error), shaft, buffers)
            }
        };
        // A face whose edges move by the blur changes by this share.
        let share = |face: &Face<f64>| {
            let around: f64 = ring(face.polygon()).map(|[p, q]| norm(sub(q, p))).sum();
            self.blur * around / face.area
        };
        let blur = amount.value * Real::max(share(a), share(b)).min(1.0);
        row.error = Real::max(row.error, (amount.error + blur) / smaller);
        amount.value
    }

    /// A_i F_ij of two faces from their parts in front of each other, if lines between them tell.
    fn left(
        &self,
        [i, j]: [usize; 2],
        (first, second): (Sheet<'_>, Sheet<'_>),
        smaller: f64,
        row: &mut Row,
    ) -> Option<f64> {
        let most = segments::largest(self.error);
        let [(p, r), (q, s)] = [*self.balls.get(i)?, *self.balls.get(j)?];
        let apart = sub(p, q);
        let gap = Real::sqrt(dot(apart, apart)) - r - s;
        // No cosine is larger than the greatest height in this distance.
        let rise = |own: Sheet<'_>, other: Sheet<'_>| {
            let at = own.points.first().copied().unwrap_or_default();
            let heights = other.points.iter().map(|&p| dot(own.normal, sub(p, at)));
            heights.fold(0.0, |m: f64, h| Real::max(m, h)).min(gap)
        };
        let larger = Real::max(area(first.points), area(second.points));
        let cosines = rise(first, second) * rise(second, first);
        if !(gap > 0.0 && larger * cosines <= BOUND * most * PI * gap * gap * gap * gap) {
            return None;
        }
        let clear = clear::exchange(first, second, 1e-4 * self.error, &self.rules);
        let factor = clear.value / smaller;
        if factor > most {
            return None;
        }
        let (numbers, sheets) = if i < j {
            ([i, j], [first, second])
        } else {
            ([j, i], [second, first])
        };
        let geometry = self.scene.geometry();
        let [share, off] = segments::left(&geometry, numbers, sheets, factor, self.error)?;
        row.partial += usize::from(0.0 < share && share < 1.0);
        row.error = Real::max(row.error, off * factor);
        Some(share * clear.value)
    }
}

/// What a face may see of a cone of directions, and what may hide some of it.
#[derive(Debug)]
struct Seen<'o> {
    cone: Vec<Vector<f64>>,
    found: Vec<&'o Occluder>,
}

/// A convex cone of directions in two: what is nearer to an edge of it than half of the furthest, and the rest.
fn split(cone: &[Vector<f64>], edge: usize) -> Option<[Vec<Vector<f64>>; 2]> {
    let (&a, &b) = (cone.get(edge)?, cone.get((edge + 1) % cone.len())?);
    let middle = centroid(cone);
    let inward = cross(b, a);
    let share = |d: Vector<f64>| dot(inward, d) / dot(middle, d);
    let most = cone.iter().map(|&d| share(d)).fold(0.0, Real::max);
    let [mut near, mut off] = [Vec::new(), Vec::new()];
    cut(
        cone,
        |d| 0.5 * most * dot(middle, d) - dot(inward, d),
        &mut near,
        &mut off,
    );
    (near.len() >= 3 && off.len() >= 3).then_some([near, off])
}

/// Gives faces of one plane the normal of all of them.
fn share_normals(faces: &mut [Face<f64>]) {
    let mut sums = alloc::vec![[0.0; 3]; faces.len()];
    let side = |face: &Face<f64>| {
        let first = faces.get(face.plane as usize).unwrap_or(face);
        if dot(first.normal, face.normal) < 0.0 {
            -1.0
        } else {
            1.0
        }
    };
    let sides: Vec<f64> = faces.iter().map(side).collect();
    for (face, side) in faces.iter().zip(&sides) {
        if let Some(sum) = sums.get_mut(face.plane as usize) {
            for (sum, x) in sum.iter_mut().zip(face.normal) {
                *sum += side * face.area * x;
            }
        }
    }
    for (face, side) in faces.iter_mut().zip(sides) {
        let sum = sums
            .get(face.plane as usize)
            .copied()
            .unwrap_or(face.normal);
        face.normal = unit(sum.map(|x| side * x));
    }
}

/// The part of a face in front of another; `None` if there is none.
fn in_front<'p>(
    face: &'p Face<f64>,
    other: &Face<f64>,
    slack: f64,
    kept: &'p mut Vec<Vector<f64>>,
) -> Option<Sheet<'p>> {
    let height = |p: Vector<f64>| dot(other.normal, sub(p, other.corners[0]));
    let (mut above, mut below) = (false, false);
    for &p in face.polygon() {
        let h = height(p);
        above |= h > slack;
        below |= h < -slack;
    }
    let points = if !above {
        return None;
    } else if below {
        *kept = keep(face.polygon(), height, slack);
        (kept.len() >= 3 && area(kept) > 0.0).then_some(kept.as_slice())?
    } else {
        face.polygon()
    };
    Some(Sheet {
        points,
        normal: face.normal,
        far: false,
    })
}
