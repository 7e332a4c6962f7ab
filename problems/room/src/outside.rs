//! Light from outside an open room: a known part of the source.

#[cfg(feature = "alloc")]
use alloc::vec::Vec;

use fredholm_core::Real;
#[cfg(feature = "alloc")]
use fredholm_core::array::Each;
use num_traits::zero;

use crate::geometry::{Backs, Wall, factor, nobody};
use crate::vector::{Vector, cross, dot, sub};
use crate::visible::in_front;
#[cfg(feature = "alloc")]
use crate::{Enclosure, RoomError, Scene};
use crate::{Point, Room};

/// Light that comes into an open room from far away. What it gives directly is a known function of the place, so that it belongs
/// to F: the source of u is F(x) + ρ(x) E(x), with the irradiance E that follows, in the unit of u, in all channels the same.
///
/// ```
/// use fredholm_room::{Enclosure, Grading, Material, Mesh, Outside, Scene, Surface, Tables};
///
/// // A street as wide as its houses are high, under a sky of 1: its middle sees the roofs at twice the slope.
/// let grey = [Material { reflectance: 0.5, emission: 0.0 }];
/// let points = [[0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
/// let street = [Surface { points: &points, materials: &grey }];
/// let sky = Outside::sky(&[0.0, 90.0], &[[1.0, 1.0]]);
/// let scene = Scene::new::<f64>(&street, Enclosure::Open)?.with_outside(sky)?;
/// let mesh = Mesh::new::<f64>(&scene, 3, Grading::default())?;
/// let tables = Tables::<f64>::new(&scene, &mesh);
/// let room = tables.room();
/// let seen = room.from_outside(&room.on_wall(1, 0.5)?);
/// assert!((seen - 1.0 / 5f64.sqrt()).abs() < 1e-15);
/// # Ok::<(), fredholm_room::RoomError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outside<F> {
    /// A part of the sky: E = L times the form factor from the point to what it sees of the part, in closed form.
    Sky {
        /// The unit vectors between which it lies, from right to left, less than half a turn apart.
        between: [[F; 2]; 2],
        /// L: what it gives to a wall that sees nothing else.
        emission: F,
    },
    /// The sun: E = E_0 cos θ where it is seen.
    Sun {
        /// The direction towards the sun, a unit vector.
        towards: [F; 2],
        /// E_0, the irradiance of a wall that faces the sun.
        irradiance: F,
    },
}

impl<F: Real> Outside<F> {
    /// The directions at which it begins or ends.
    #[cfg(feature = "alloc")]
    pub(crate) fn ends(&self) -> &[Vector<F>] {
        match self {
            Self::Sky { between, .. } => between,
            Self::Sun { towards, .. } => core::slice::from_ref(towards),
        }
    }
}

#[cfg(feature = "alloc")]
impl Outside<f64> {
    /// The sky above the horizon y = 0, in bands between ascending altitudes in degrees, with L of each to the right, where x grows,
    /// and to the left.
    #[must_use]
    pub fn sky(altitudes: &[f64], emissions: &[[f64; 2]]) -> Vec<Self> {
        let direction = |altitude: f64| {
            let angle = altitude.to_radians();
            // The zenith has no rounding.
            let flat = if altitude < 90.0 {
                Real::cos(angle)
            } else {
                0.0
            };
            [flat, Real::sin(angle)]
        };
        let bands = altitudes.windows(2).zip(emissions);
        let parts = bands.flat_map(|(ends, &[right, left])| {
            let [low, high] = [direction(ends[0]), direction(ends[1])];
            let mirrored = |[x, y]: [f64; 2]| [-x, y];
            let sky = |between, emission| Self::Sky { between, emission };
            [
                sky([low, high], right),
                sky([mirrored(high), mirrored(low)], left),
            ]
        });
        parts.collect()
    }

    /// What is below the horizon, which is dark: for form factors.
    #[must_use]
    pub fn below() -> [Self; 2] {
        let sky = |between| Self::Sky {
            between,
            emission: 0.0,
        };
        [
            sky([[-1.0, 0.0], [0.0, -1.0]]),
            sky([[0.0, -1.0], [1.0, 0.0]]),
        ]
    }

    /// Whether its numbers are possible.
    fn is_good(&self) -> bool {
        let (Self::Sky { emission: size, .. }
        | Self::Sun {
            irradiance: size, ..
        }) = *self;
        let is_unit = |d: &Vector<f64>| (dot(*d, *d) - 1.0).abs() < 1e-12;
        let is_less = match self {
            Self::Sky {
                between: [a, b], ..
            } => cross(*a, *b) > 0.0,
            Self::Sun { .. } => true,
        };
        // Written so that NaN fails.
        (0.0..f64::INFINITY).contains(&size) && is_less && self.ends().iter().all(is_unit)
    }

    /// In the scalar of walks.
    pub(crate) fn rounded<F: Real>(&self) -> Outside<F> {
        let pair = |d: Vector<f64>| d.each(F::from_f64);
        match *self {
            Self::Sky { between, emission } => Outside::Sky {
                between: between.each(pair),
                emission: F::from_f64(emission),
            },
            Self::Sun {
                towards,
                irradiance,
            } => Outside::Sun {
                towards: pair(towards),
                irradiance: F::from_f64(irradiance),
            },
        }
    }
}

#[cfg(feature = "alloc")]
impl Scene {
    /// An open room with light from outside.
    ///
    /// # Errors
    /// [`RoomError::Outside`]: the room is closed, or a number of the light is negative or not finite, a direction is no unit
    /// vector, or a part of the sky is wider than half a turn.
    pub fn with_outside(mut self, outside: Vec<Outside<f64>>) -> Result<Self, RoomError> {
        let is_closed = self.enclosure() == Enclosure::Closed;
        let wrong = outside.iter().position(|own| is_closed || !own.is_good());
        match wrong {
            Some(number) => Err(RoomError::Outside { number }),
            None => {
                self.outside = outside;
                Ok(self)
            }
        }
    }

    /// The light from outside.
    #[must_use]
    pub fn outside(&self) -> &[Outside<f64>] {
        &self.outside
    }
}

/// The directions, from right to left, that are in both of two intervals in front of one wall.
fn common<F: Real>(
    [right, left]: [Vector<F>; 2],
    [from, to]: [Vector<F>; 2],
) -> Option<[Vector<F>; 2]> {
    let right = if cross(right, from) > zero() {
        from
    } else {
        right
    };
    let left = if cross(to, left) > zero() { to } else { left };
    (cross(right, left) > zero()).then_some([right, left])
}

impl<F: Real, C> Room<'_, F, C> {
    /// E, the irradiance of a point by the light from outside directly: exact, with what hides it.
    // Not inline: walks without such light have nothing of this in their loop.
    #[inline(never)]
    #[must_use]
    pub fn from_outside(&self, x: &Point<F>) -> F {
        let viewer = x.viewer();
        let Some(own) = self.geometry().wall(viewer.wall) else {
            return F::NAN;
        };
        let (normal, [tx, ty]) = (own.normal(), own.tangent);
        let mut sum: F = zero();
        for light in self.outside {
            if let Outside::Sun {
                towards,
                irradiance,
            } = *light
            {
                let cosine = dot(normal, towards);
                if cosine > zero() && !self.hides(own, viewer.wall, viewer.position, towards) {
                    sum += irradiance * cosine;
                }
            }
        }
        let is_sky = |own: &Outside<F>| matches!(own, Outside::Sky { .. });
        if !self.outside.iter().any(is_sky) {
            return sum;
        }
        // One look at each half of what is in front, however many parts the sky has.
        for half in [[[tx, ty], normal], [normal, [-tx, -ty]]] {
            let half = self.before_corners(own, viewer.position, half);
            let geometry = self.geometry();
            geometry.open_pieces(own, &viewer, half, |right, left| {
                for light in self.outside {
                    let Outside::Sky { between, emission } = *light else {
                        continue;
                    };
                    if let Some(between) = in_front(own, between)
                        && let Some([right, left]) = common([right, left], between)
                    {
                        sum += emission * factor(normal, right, left, cross(right, left));
                    }
                }
            });
        }
        sum
    }

    /// (1/2π) ∫ L dω over the directions in which a place between the walls sees the sky.
    pub(crate) fn sky_around(&self, position: Vector<F>) -> F {
        let nobody = nobody(position);
        let viewer = crate::visible::Viewer {
            wall: u32::MAX,
            position,
        };
        let mut sum: F = zero();
        for light in self.outside {
            if let Outside::Sky { between, emission } = *light {
                let geometry = self.geometry();
                geometry.open_pieces(&nobody, &viewer, between, |right, left| {
                    sum += emission * cross(right, left).atan2(dot(right, left));
                });
            }
        }
        sum / (F::PI + F::PI)
    }

    /// Whether something is in the way of a ray from a point.
    fn hides(&self, own: &Wall<F>, wall: u32, position: Vector<F>, direction: Vector<F>) -> bool {
        let hit = self
            .geometry()
            .nearest(own, wall, position, direction, Backs::Block);
        hit.is_some()
    }

    /// Directions from a point, less those that a wall hides which rises from the end of the point's own where it is.
    fn before_corners(
        &self,
        own: &Wall<F>,
        position: Vector<F>,
        [mut right, mut left]: [Vector<F>; 2],
    ) -> [Vector<F>; 2] {
        let [start, end] = own.ends;
        let [first, last] = own.vertices;
        let (vertex, is_end) = if position == start {
            (first, false)
        } else if position == end {
            (last, true)
        } else {
            return [right, left];
        };
        for other in self.geometry().all() {
            let ([a, b], [from, to]) = (other.vertices, other.ends);
            let far = if a == vertex {
                to
            } else if b == vertex {
                from
            } else {
                continue;
            };
            let to = sub(far, position);
            if dot(own.normal(), to) > zero() {
                let side = if is_end { &mut right } else { &mut left };
                if (cross(*side, to) > zero()) == is_end {
                    *side = to;
                }
            }
        }
        [right, left]
    }
}

#[cfg(all(test, feature = "alloc"))]
mod tests {
    use alloc::vec;
    use alloc::vec::Vec;

    use fredholm_core::{Equation as _, NoDraws};

    use super::{Outside, Real};
    use crate::{Enclosure, Grading, Material, Mesh, Scene, Seen, Surface, Tables, exchanges};

    /// A street of period 4 with a slanted roof, an obstacle on its ground and a tilted screen of two sides in it.
    const STREET: [&[[f64; 2]]; 3] = [
        &[[0.0, 2.5], [0.0, 0.0], [3.0, 0.0], [3.0, 1.5], [4.0, 2.5]],
        &[[0.7, 0.0], [0.7, 0.8], [1.2, 0.8], [1.2, 0.0]],
        &[[1.6, 0.6], [2.5, 1.1], [1.6, 0.6]],
    ];
    fn scene(lines: &[Vec<[f64; 2]>], period: Option<f64>, reflectance: f64) -> Scene {
        let emission = 1.0 - reflectance;
        let material = [Material {
            reflectance,
            emission,
        }];
        let surfaces = lines.iter().map(|points| Surface {
            points,
            materials: &material,
        });
        let surfaces: Vec<_> = surfaces.collect();
        match period {
            Some(period) => Scene::periodic::<f64>(&surfaces, period).unwrap(),
            None => Scene::new::<f64>(&surfaces, Enclosure::Open).unwrap(),
        }
    }

    /// Where walls have F = 1 − ρ and the sky is 1, all is 1: what any point sees of walls and of the sky, in a street by itself and in
    /// one that repeats.
    #[test]
    fn a_furnace_under_the_sky() {
        let bands = Outside::sky(&[0.0, 20.0, 90.0], &[[1.0; 2]; 2]);
        let pit = vec![vec![[0.0, 2.0], [0.0, 0.0], [1.5, 0.3], [1.5, 2.0]]];
        let street = STREET.map(<[_]>::to_vec).into();
        for (lines, period) in [(street, Some(4.0)), (pit, None)] {
            let scene = scene(&lines, period, 0.4)
                .with_outside(bands.clone())
                .unwrap();
            assert_eq!(scene.lost(), 0.0);
            let mesh = Mesh::new::<f64>(&scene, 60, Grading::of_degree(1)).unwrap();
            let tables = Tables::<f64>::new(&scene, &mesh);
            let room = tables.room();
            let ones = vec![1.0; mesh.len()];
            for cell in 0..mesh.len() {
                for t in [0.03, 0.5, 0.9] {
                    let x = room.inside(cell, t).unwrap();
                    let walls: f64 = room.irradiance_of::<f64, 1>(&x, &ones);
                    let u = room.source(&x, &mut NoDraws) + 0.4 * walls;
                    assert!((u - 1.0).abs() < 1e-12, "{x:?} {u}");
                }
            }
            for position in [[0.3, 0.4], [1.4, 0.95], [0.8, 0.9]] {
                let seen = Seen {
                    room: &room,
                    position: scene.folded(position).unwrap(),
                };
                let sum = seen.of(&ones)[0] + seen.sky();
                assert!((sum - 1.0).abs() < 1e-12, "{position:?} {sum}");
            }
            // So are form factors, with parts of the sky that begin in any direction as walls see it.
            let walls: Vec<u32> = (0..room.geometry().walls().len() as u32).collect();
            let mut sums = vec![0.0; walls.len()];
            exchanges(&scene, &walls, |wall, _, exchange| {
                sums[wall as usize] += exchange;
            });
            for (wall, sum) in room.geometry().walls().iter().zip(sums) {
                assert!((sum - wall.length).abs() < 1e-12, "{wall:?} {sum}");
            }
        }
    }

    /// A street as wide as its houses are high times 1/h: its ground sees √(1 + h²) − h of the sky, its walls half of the rest over h; rows
    /// sum to 1, and what a sun at 60° gives to the ground is the part that the houses leave.
    #[test]
    fn a_street_in_closed_form() {
        let (h, width) = (0.7, 1.0);
        let lines = vec![
            vec![[0.0, h], [0.0, 0.0]],
            vec![[0.0, 0.0], [width, 0.0]],
            vec![[width, 0.0], [width, h]],
            vec![[width, h], [2.5, h]],
        ];
        let mut outside = Outside::sky(&[0.0, 20.0, 90.0], &[[1.0; 2]; 2]);
        outside.extend(Outside::below());
        let slope = 3f64.sqrt();
        outside.push(Outside::Sun {
            towards: [0.5, 0.5 * slope],
            irradiance: 2.0,
        });
        let scene = scene(&lines, Some(2.5), 0.0).with_outside(outside).unwrap();
        let mut rows = vec![[0.0; 10]; 4];
        exchanges(&scene, &[0, 1, 2, 3], |wall, seen, exchange| {
            rows[wall as usize][seen as usize] += exchange;
        });
        let ground = Real::sqrt(1.0 + h * h) - h;
        let exact = [0.5 * (1.0 - ground), ground, 0.5 * (1.0 - ground), 1.5];
        for (row, exact) in rows.iter().zip(exact) {
            let sky: f64 = row[4..8].iter().sum();
            assert!((sky - exact).abs() < 1e-14, "{row:?} {exact}");
            assert_eq!(row[8..], [0.0; 2]);
        }
        // The roofs see all of a band.
        let low = 0.75 * (1.0 - Real::cos(20f64.to_radians()));
        assert!((rows[3][4] - low).abs() < 1e-14 && (rows[3][5] - low).abs() < 1e-14);
        let lengths = [h, width, h, 1.5];
        for (row, length) in rows.iter().zip(lengths) {
            assert!((row.iter().sum::<f64>() - length).abs() < 1e-14);
        }
        // Cells end at the edge of the shadow, in which there is the sky alone.
        let mesh = Mesh::new::<f64>(&scene, 4, Grading::of_degree(1)).unwrap();
        let tables = Tables::<f64>::new(&scene, &mesh);
        let room = tables.room();
        let edge = width - h / slope;
        let cells = mesh.cells().range(1).map(|cell| mesh.cells().length(cell));
        let mut sum = 0.0;
        assert!(cells.into_iter().any(|length| {
            sum += length;
            (sum - edge).abs() < 1e-12
        }));
        for x in [0.1, edge - 1e-6, edge + 1e-6, 0.99] {
            let point = room.on_wall(1, x).unwrap();
            let sine = |to: f64| to / Real::sqrt(to * to + h * h);
            let sky = 0.5 * (sine(x) + sine(1.0 - x));
            let sun = if x < edge { slope } else { 0.0 };
            let found = room.from_outside(&point);
            assert!((found - sky - sun).abs() < 1e-12, "{x} {found}");
        }
        // In the corner itself the wall fills a quarter, with a house behind it or without.
        let corner = room.from_outside(&room.on_wall(1, 0.0).unwrap());
        let sky = 0.5 / Real::sqrt(1.0 + h * h);
        assert!((corner - sky - slope).abs() < 1e-12, "{corner}");
        let single = super::tests::scene(&lines[..3], None, 0.0);
        let single = single.with_outside(scene.outside.clone()).unwrap();
        let tables = Tables::<f64>::new(
            &single,
            &Mesh::new::<f64>(&single, 4, Grading::of_degree(1)).unwrap(),
        );
        let room = tables.room();
        for (place, sun) in [(0.0, slope), (1.0, 0.0)] {
            let corner = room.from_outside(&room.on_wall(1, place).unwrap());
            assert!((corner - sky - sun).abs() < 1e-12, "{corner}");
        }
    }

    /// Screens that hang free, period 1 and height ½: rays pass under them, as a bound says, and what they see is off by less.
    #[test]
    fn what_passes_all_copies_is_bounded() {
        let ground = vec![[0.0, 0.0], [1.0, 0.0]];
        let screen = vec![[0.5, 0.2], [0.5, 0.5], [0.5, 0.2]];
        let scene = scene(&[ground, screen], Some(1.0), 0.4);
        let sky = Outside::sky(&[0.0, 90.0], &[[1.0; 2]]);
        let scene = scene.with_outside(sky).unwrap();
        let lost = scene.lost();
        assert!(lost > 0.0 && lost < 0.01, "{lost}");
        let mesh = Mesh::new::<f64>(&scene, 12, Grading::default()).unwrap();
        let tables = Tables::<f64>::new(&scene, &mesh);
        let room = tables.room();
        let ones = vec![1.0; mesh.len()];
        for cell in 0..mesh.len() {
            let x = room.inside(cell, 0.4).unwrap();
            let walls: f64 = room.irradiance_of::<f64, 1>(&x, &ones);
            let off = walls + room.from_outside(&x) - 1.0;
            assert!(off.abs() < lost, "{x:?} {off}");
        }
        assert!(
            scene
                .folded([7.3, 0.3])
                .is_some_and(|[x, _]| (x - 0.3).abs() < 1e-12)
        );
        assert_eq!(scene.folded([0.3, 0.6]), None);
    }

    #[test]
    fn what_is_no_light_is_refused() {
        let scene = scene(&STREET.map(<[_]>::to_vec), Some(4.0), 0.4);
        let sun = |towards, irradiance| {
            scene.clone().with_outside(vec![Outside::Sun {
                towards,
                irradiance,
            }])
        };
        assert!(sun([0.6, 0.8], 1.0).is_ok());
        assert!(sun([0.6, 0.9], 1.0).is_err());
        assert!(sun([0.6, 0.8], -1.0).is_err());
        assert!(sun([0.6, f64::NAN], 1.0).is_err());
        let material = [Material::BLACK];
        let own = [Surface {
            points: STREET[0],
            materials: &material,
        }];
        for period in [0.0, -1.0, f64::NAN, 1e-3, f64::INFINITY] {
            assert!(Scene::periodic::<f64>(&own, period).is_err(), "{period}");
        }
    }
}
