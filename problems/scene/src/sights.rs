//! What every face sees of every other.

use alloc::vec::Vec;

use crate::clear::{self, Sheet};
use crate::clip::keep;
use crate::occluders::Occluders;
use crate::partial;
use crate::rules::{Rules, area};
use crate::scene::Scene;
use crate::shaft::{Between, Shaft};
use crate::vector::{Vector, dot, sub};
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
            },
            Sheet {
                points: second,
                normal: b.normal,
            },
        );
        let fronts = self.scene.enclosure() == Enclosure::Closed;
        shaft.enclose(pair.0, pair.1, slack);
        match shaft.between(&self.occluders, None, pair, fronts, found) {
            Between::Hidden => 0.0,
            Between::Nothing => clear::exchange(pair.0, pair.1, self.clear_error(), &self.rules),
            Between::Some => {
                let smaller = a.area.min(b.area);
                let amount = partial::exchange(
                    pair,
                    (&self.occluders, found),
                    fronts,
                    self.error * smaller,
                    shaft,
                    &self.rules,
                );
                row.partial += 1;
                row.error = fredholm_core::Real::max(row.error, amount.error / smaller);
                amount.value
            }
        }
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
