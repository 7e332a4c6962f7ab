//! What every face sees of every other.

use alloc::vec::Vec;

use fredholm_core::Real;

use crate::clear::{self, Amount, PARALLEL, Sheet};
use crate::clip::keep;
use crate::occluders::Occluders;
use crate::partial;
use crate::rules::{Rules, area};
use crate::scene::Scene;
use crate::shaft::{Between, Shaft};
use crate::sky::{Sky, SkyRow};
use crate::vector::{Vector, dot, sub};
use crate::visible::Clipper;
use crate::{Enclosure, SceneError};

/// The inputs of form factors: a scene, the polygons that may hide something, and the error
/// that is allowed.
///
/// Rows are independent of each other: threads share one of these, and
/// [`Factors::new`](crate::Factors::new) puts the rows together.
#[derive(Clone, Debug)]
pub struct Sights<'a> {
    scene: &'a Scene,
    occluders: Occluders,
    rules: Rules,
    error: f64,
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

/// Buffers, kept from pair to pair.
#[derive(Debug, Default)]
struct Buffers {
    shaft: Shaft,
    found: Vec<u32>,
    own: Vec<Vector<f64>>,
    other: Vec<Vector<f64>>,
}

impl<'a> Sights<'a> {
    /// Prepares a scene: faces of one plane are made into few large polygons, which hide the same.
    /// Where something hides a part, form factors are computed to `error`, in F.
    ///
    /// # Errors
    /// [`SceneError::Tolerance`].
    pub fn new(scene: &'a Scene, error: f64) -> Result<Self, SceneError> {
        if !(1e-13..=0.1).contains(&error) {
            return Err(SceneError::Tolerance);
        }
        Ok(Self {
            scene,
            occluders: Occluders::new(scene),
            rules: Rules::new(),
            error,
        })
    }

    /// The scene.
    #[must_use]
    pub const fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// The number of polygons that may hide something.
    #[must_use]
    pub fn occluders(&self) -> usize {
        self.occluders.all.len()
    }

    /// The exchange of a face with those after it.
    #[must_use]
    pub fn row(&self, face: usize) -> Row {
        let mut row = Row::default();
        let mut buffers = Buffers::default();
        for other in face + 1..self.scene.faces.len() {
            let amount = self.pair(face, other, &mut row, &mut buffers);
            // Rounding must not make more of a face than all.
            let most = |f: usize| self.scene.faces.get(f).map_or(0.0, |face| face.area);
            let amount = amount.min(most(face)).min(most(other));
            if amount > 0.0 {
                row.entries.push((other as u32, amount));
            }
        }
        row
    }

    /// The exchange of a face with the patches of a sky. Those that nothing hides are exact but for rounding, others to
    /// the error of form factors.
    ///
    /// ```
    /// use fredholm_scene::{Enclosure, Material, Polygon, Scene, Sights, Sky, Surface};
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
    /// # Ok::<(), fredholm_scene::SceneError>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::Face`] for a face that is none, [`SceneError::NoSky`] if the scene is closed.
    pub fn sky(&self, face: usize, sky: &Sky) -> Result<SkyRow, SceneError> {
        let own = self.scene.faces.get(face);
        let own = own.ok_or(SceneError::Face { face })?;
        if self.scene.enclosure() == Enclosure::Closed {
            return Err(SceneError::NoSky);
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
        let mut buffers = Buffers::default();
        for piece in sky.pieces() {
            let error = self.error * own.area * piece.share;
            let amount = self.piece(sheet, &piece.corners, error, &mut buffers);
            let sums = [&mut row.exchange, &mut errors].map(|list| list.get_mut(piece.patch));
            if let [Some(sum), Some(error)] = sums {
                *sum += amount.value;
                *error += amount.error / own.area;
            }
        }
        row.error = errors.into_iter().fold(0.0, |m: f64, e| Real::max(m, e));
        Ok(row)
    }

    /// What a face exchanges with a cone of directions.
    fn piece(
        &self,
        own: Sheet<'_>,
        cone: &[Vector<f64>],
        error: f64,
        buffers: &mut Buffers,
    ) -> Amount {
        let Buffers {
            shaft,
            found,
            other,
            ..
        } = buffers;
        let above = |d: Vector<f64>| dot(own.normal, d);
        keep(cone, &above, PARALLEL, other);
        if other.len() < 3 {
            return Amount::default();
        }
        let cone = Sheet {
            points: other,
            normal: own.normal,
            far: true,
        };
        let pair = (own, cone);
        shaft.enclose(own, cone, self.scene.smallest);
        match shaft.between(&self.occluders, None, pair, false, found) {
            Between::Hidden => Amount::default(),
            Between::Nothing => clear::exchange(own, cone, 0.0, &self.rules),
            Between::Some => {
                let between = (&self.occluders, found.as_slice());
                partial::exchange(pair, between, false, error, shaft, &self.rules)
            }
        }
    }

    /// The form factors from a point of a face to the patches of a sky and, last, to what is below the horizon: the part
    /// that is visible is cut out by planes, exact but for rounding.
    ///
    /// ```
    /// use fredholm_scene::{Enclosure, Scene, Sights, Sky, shapes};
    ///
    /// // A block's lid sees the whole sky.
    /// let block = Scene::new::<f64>(&shapes::block([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Open)?;
    /// let sights = Sights::new(&block, 1e-9)?;
    /// let f = sights.sky_of_point(1, [0.3, 0.4, 1.0], &Sky::uniform())?;
    /// assert!((f[0] - 1.0).abs() < 1e-15 && f[1] == 0.0);
    /// // A side sees one half of it.
    /// let f = sights.sky_of_point(2, [0.3, 0.0, 0.4], &Sky::uniform())?;
    /// assert!((f[0] - 0.5).abs() < 1e-15 && (f[1] - 0.5).abs() < 1e-15);
    /// # Ok::<(), fredholm_scene::SceneError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Sights::sky`].
    pub fn sky_of_point(
        &self,
        face: usize,
        point: [f64; 3],
        sky: &Sky,
    ) -> Result<Vec<f64>, SceneError> {
        let own = self.scene.faces.get(face);
        let own = own.ok_or(SceneError::Face { face })?;
        if self.scene.enclosure() == Enclosure::Closed {
            return Err(SceneError::NoSky);
        }
        let points = [point];
        let sheet = Sheet {
            points: &points,
            normal: own.normal,
            far: false,
        };
        let mut sums = alloc::vec![0.0; sky.patches().len() + 1];
        let (mut buffers, mut clipper) = (Buffers::default(), Clipper::default());
        for piece in sky.pieces() {
            if let Some(sum) = sums.get_mut(piece.patch) {
                *sum += self.piece_of_point(sheet, &piece.corners, &mut buffers, &mut clipper);
            }
        }
        Ok(sums)
    }

    fn piece_of_point(
        &self,
        own: Sheet<'_>,
        cone: &[Vector<f64>],
        buffers: &mut Buffers,
        clipper: &mut Clipper,
    ) -> f64 {
        let Buffers {
            shaft,
            found,
            other,
            ..
        } = buffers;
        let slack = self.scene.smallest;
        keep(cone, &|d| dot(own.normal, d), PARALLEL, other);
        if other.len() < 3 {
            return 0.0;
        }
        let cone = Sheet {
            points: other,
            normal: own.normal,
            far: true,
        };
        shaft.enclose(own, cone, slack);
        let between = shaft.between(&self.occluders, None, (own, cone), false, found);
        if between == Between::Hidden {
            return 0.0;
        }
        let origin = own.points.first().copied().unwrap_or_default();
        let mut screens: Vec<(Vec<Vector<f64>>, f64)> = Vec::new();
        for occluder in found
            .iter()
            .filter_map(|&o| self.occluders.all.get(o as usize))
        {
            let relative: Vec<Vector<f64>> =
                occluder.points.iter().map(|&p| sub(p, origin)).collect();
            let mut kept = Vec::new();
            keep(&relative, &|p| dot(own.normal, p), slack, &mut kept);
            let height = occluder.height(origin);
            if kept.len() >= 3 && height.abs() > slack {
                screens.push((kept, height));
            }
        }
        let screens = screens
            .iter()
            .map(|(points, height)| (points.as_slice(), *height));
        clipper.factor(own.normal, cone.points, screens)
    }

    /// A_i F_ij of two faces.
    fn pair(&self, i: usize, j: usize, row: &mut Row, buffers: &mut Buffers) -> f64 {
        let (Some(a), Some(b)) = (self.scene.faces.get(i), self.scene.faces.get(j)) else {
            return 0.0;
        };
        if a.plane == b.plane {
            return 0.0;
        }
        // The parts in front of each other.
        let slack = self.scene.smallest;
        let Buffers {
            shaft,
            found,
            own,
            other,
        } = buffers;
        let Some(first) = in_front(a.polygon(), (b.normal, b.corners[0]), slack, own) else {
            return 0.0;
        };
        let Some(second) = in_front(b.polygon(), (a.normal, a.corners[0]), slack, other) else {
            return 0.0;
        };
        let pair = (
            Sheet {
                points: first,
                normal: a.normal,
                far: false,
            },
            Sheet {
                points: second,
                normal: b.normal,
                far: false,
            },
        );
        let fronts = self.scene.enclosure() == Enclosure::Closed;
        shaft.enclose(pair.0, pair.1, slack);
        let smaller = a.area.min(b.area);
        let amount = match shaft.between(&self.occluders, None, pair, fronts, found) {
            Between::Hidden => return 0.0,
            Between::Nothing => clear::exchange(pair.0, pair.1, self.clear_error(), &self.rules),
            Between::Some => {
                row.partial += 1;
                partial::exchange(
                    pair,
                    (&self.occluders, found),
                    fronts,
                    self.error * smaller,
                    shaft,
                    &self.rules,
                )
            }
        };
        row.error = Real::max(row.error, amount.error / smaller);
        amount.value
    }

    /// What a form factor with nothing between may be wrong by: such are cheap.
    fn clear_error(&self) -> f64 {
        1e-4 * self.error
    }
}

/// The part of a polygon in front of a plane; `None` if there is none.
fn in_front<'p>(
    polygon: &'p [Vector<f64>],
    (normal, point): (Vector<f64>, Vector<f64>),
    slack: f64,
    kept: &'p mut Vec<Vector<f64>>,
) -> Option<&'p [Vector<f64>]> {
    let height = |p: Vector<f64>| dot(normal, sub(p, point));
    let (mut above, mut below) = (false, false);
    for &p in polygon {
        let h = height(p);
        above |= h > slack;
        below |= h < -slack;
    }
    if !above {
        return None;
    }
    if !below {
        return Some(polygon);
    }
    keep(polygon, &height, slack, kept);
    (kept.len() >= 3 && area(kept) > 0.0).then_some(kept.as_slice())
}
