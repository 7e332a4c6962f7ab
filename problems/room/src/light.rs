//! The last step of a walk, to the light.

#[cfg(feature = "alloc")]
use alloc::vec::Vec;

use fredholm_core::Real;
#[cfg(feature = "alloc")]
use fredholm_core::channels::MOST_CHANNELS;
#[cfg(feature = "alloc")]
use fredholm_core::galerkin::{buffer, legendre, reserve};
#[cfg(feature = "alloc")]
use fredholm_core::{SourcePart, best_lights};
use num_traits::zero;

#[cfg(feature = "alloc")]
use crate::factors::exchanges;
#[cfg(feature = "alloc")]
use crate::{ColouredRoom, PolynomialRoom, RoomError, Scene, WallColours};
use crate::{Point, Room, Wall};

impl<F: Real> Room<'_, F> {
    /// F_s on a wall: its emission if it is a light, and 0 otherwise.
    #[must_use]
    pub fn emission_of_light(&self, wall: usize) -> F {
        let is_light = u32::try_from(wall).is_ok_and(|wall| self.is_light(wall));
        let found = self.geometry().walls().get(wall).filter(|_| is_light);
        found.map_or(zero(), |wall| wall.emission)
    }

    #[inline]
    pub(crate) fn is_light(&self, wall: u32) -> bool {
        self.lights().binary_search(&wall).is_ok()
    }

    /// The irradiance that lights make at a point directly, Σ_l F_l F_x→l.
    #[must_use]
    pub fn direct(&self, x: &Point<F>) -> F {
        let mut sum = zero::<F>();
        self.seen_lights(x, |_, wall, factor| sum += wall.emission * factor);
        sum
    }

    /// Calls `each` with the number of every light before a point, its wall, and the form factor to what the point sees of it.
    #[inline(always)]
    pub(crate) fn seen_lights(&self, x: &Point<F>, mut each: impl FnMut(usize, &Wall<F>, F)) {
        for &light in self.lights() {
            // There are such walls: `with_lights` has looked.
            let Some(wall) = self.geometry().wall(light) else {
                continue;
            };
            // Points of a wall do not see it, nor what is on its back, whatever rounding makes of their height.
            let [a, b] = x.position();
            let size = a.abs() + b.abs() + wall.length;
            if wall.height(x.position()) > F::from_f64(8.0) * F::EPSILON * size {
                let light = light as usize;
                each(light, wall, self.form_factor_of_wall(x, light));
            }
        }
    }

    /// (T_K F_s)(x): what a wall reflects of the lights.
    #[inline]
    #[must_use]
    pub fn reflected_light(&self, x: &Point<F>) -> F {
        if self.lights().is_empty() {
            return zero();
        }
        self.reflectance(x) * self.direct(x)
    }

    /// T_K F_s + F − F_s.
    // Not inline: walks without lights have their emission in their loop, and nothing of this.
    #[inline(never)]
    pub(crate) fn source_of_lights(&self, x: &Point<F>) -> F {
        let Some(wall) = self.geometry().walls().get(x.wall()) else {
            return F::NAN;
        };
        let rest = if self.is_light(x.wall() as u32) {
            zero()
        } else {
            wall.emission
        };
        rest + wall.reflectance * self.direct(x)
    }
}

/// Time of the form factor of what a point sees of a light, over that of a step.
#[cfg(feature = "alloc")]
const TIME_OF_LIGHT: f64 = 1.0;

#[cfg(feature = "alloc")]
impl Scene {
    /// The walls to which a last step pays: see [`best_lights`]. There may be none.
    #[must_use]
    pub fn best_lights(&self) -> Vec<u32> {
        let walls = self.geometry().walls().iter();
        let part = |wall: &Wall<f64>| SourcePart {
            measure: wall.length,
            source: wall.emission,
            reflectance: wall.reflectance,
        };
        best_lights(&walls.map(part).collect::<Vec<_>>(), TIME_OF_LIGHT)
    }
}

/// What lights give to walls directly, in the mean over walls: exact, with what hides them.
///
/// ```
/// use fredholm_room::{DirectLight, Enclosure, Material, Scene, Surface};
///
/// let material = |emission| [Material { reflectance: 0.5, emission }];
/// let (lamp, dark) = (material(1.0), material(0.0));
/// let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
/// let floor = Surface { points: &corners[..2], materials: &lamp };
/// let rest = Surface { points: &corners[1..], materials: &dark };
/// let scene = Scene::new::<f64>(&[floor, rest], Enclosure::Closed)?;
/// let direct = DirectLight::new(&scene, &[0])?;
/// // The form factor of opposite sides of a square.
/// assert!((direct.irradiance(2..3) - (2f64.sqrt() - 1.0)).abs() < 1e-14);
/// assert_eq!((direct.emission(0..1), direct.emission(1..4)), (1.0, 0.0));
/// // All that the floor emits arrives somewhere, and half of it is reflected.
/// assert!((4.0 * direct.reflected(0..4) - 0.5).abs() < 1e-14);
/// # Ok::<(), fredholm_room::RoomError>(())
/// ```
#[cfg(feature = "alloc")]
#[derive(Clone, Debug)]
pub struct DirectLight {
    /// The length of every wall, and the integrals of F_s, of the direct irradiance and of T_K F_s over it.
    walls: Vec<[f64; 4]>,
}

#[cfg(feature = "alloc")]
impl DirectLight {
    /// The light of these walls of a scene. Takes as long as their rows of form factors.
    ///
    /// # Errors
    /// [`RoomError::Memory`].
    pub fn new(scene: &Scene, lights: &[u32]) -> Result<Self, RoomError> {
        let walls = scene.geometry();
        let mut all = Self::of(scene, lights, 1, &|wall, _| {
            let own = walls.walls().get(wall);
            own.map_or([f64::NAN; 2], |own| [own.reflectance, own.emission])
        })?;
        all.pop().ok_or(RoomError::Memory { bytes: None })
    }

    /// The light of these walls in every channel of a scene, from the same rows.
    ///
    /// # Errors
    /// [`RoomError::Memory`].
    pub fn of_channels(
        scene: &Scene,
        lights: &[u32],
        colours: &WallColours<'_, f64>,
    ) -> Result<Vec<Self>, RoomError> {
        Self::of(scene, lights, colours.channels(), &|wall, channel| {
            let [reflectances, emissions] = [colours.reflectances(wall), colours.emissions(wall)];
            [reflectances, emissions].map(|own| own.get(channel).copied().unwrap_or(f64::NAN))
        })
    }

    /// The light in so many channels, of reflectances and emissions of walls in each.
    fn of(
        scene: &Scene,
        lights: &[u32],
        channels: usize,
        material: &dyn Fn(usize, usize) -> [f64; 2],
    ) -> Result<Vec<Self>, RoomError> {
        let geometry = scene.geometry();
        let mut all = reserve(channels)?;
        for channel in 0..channels {
            let mut walls: Vec<[f64; 4]> = buffer(geometry.walls().len())?;
            for ([length, ..], wall) in walls.iter_mut().zip(geometry.walls()) {
                *length = wall.length;
            }
            for &light in lights {
                if let Some([length, emitted, ..]) = walls.get_mut(light as usize) {
                    *emitted = *length * material(light as usize, channel)[1];
                }
            }
            all.push(Self { walls });
        }
        exchanges(scene, lights, &mut |light, wall, exchange| {
            for (channel, own) in all.iter_mut().enumerate() {
                if let Some([.., irradiance, _]) = own.walls.get_mut(wall as usize) {
                    *irradiance += material(light as usize, channel)[1] * exchange;
                }
            }
        });
        for (channel, own) in all.iter_mut().enumerate() {
            for (wall, [.., irradiance, reflected]) in own.walls.iter_mut().enumerate() {
                *reflected = material(wall, channel)[0] * *irradiance;
            }
        }
        Ok(all)
    }

    /// The mean of F_s over some walls, weighted by length.
    #[must_use]
    pub fn emission(&self, walls: impl IntoIterator<Item = usize>) -> f64 {
        self.mean(walls, |&[_, emission, ..]| emission)
    }

    /// The mean of the irradiance that lights make directly, over some walls.
    #[must_use]
    pub fn irradiance(&self, walls: impl IntoIterator<Item = usize>) -> f64 {
        self.mean(walls, |&[.., irradiance, _]| irradiance)
    }

    /// The mean of T_K F_s over some walls.
    #[must_use]
    pub fn reflected(&self, walls: impl IntoIterator<Item = usize>) -> f64 {
        self.mean(walls, |&[.., reflected]| reflected)
    }

    fn mean(&self, walls: impl IntoIterator<Item = usize>, of: impl Fn(&[f64; 4]) -> f64) -> f64 {
        let (mut sum, mut all) = (0.0, 0.0);
        for own in walls.into_iter().filter_map(|wall| self.walls.get(wall)) {
            sum += of(own);
            all += own[0];
        }
        sum / all
    }
}

/// Four Gauss points in each of so many parts of a cell: of what they miss next to a light nothing but variance comes.
#[cfg(feature = "alloc")]
const PARTS: u32 = 4;

#[cfg(feature = "alloc")]
impl<const B: usize> PolynomialRoom<'_, '_, f64, B> {
    /// The coefficients of T_K F_s on a cell, by Gauss points.
    #[must_use]
    pub fn project_light(&self, cell: usize) -> [f64; B] {
        let mut sum = [0.0; B];
        self.light_points(cell, &mut |x, weight, psi| {
            let light = x.map_or(f64::NAN, |x| self.room().reflected_light(&x));
            for (sum, psi) in sum.iter_mut().zip(psi) {
                *sum += weight * light * psi;
            }
        });
        sum
    }

    /// Takes the coefficients of T_Kc F_s,c on a cell from those of every channel, B numbers for each.
    pub fn subtract_light(
        &self,
        coloured: &ColouredRoom<'_, '_, f64>,
        cell: usize,
        from: &mut [f64],
    ) {
        let mut light = [f64::NAN; MOST_CHANNELS];
        let channels = coloured.colours().channels();
        let light = light.get_mut(..channels).unwrap_or_default();
        self.light_points(cell, &mut |x, weight, psi| {
            if let Some(x) = x {
                coloured.reflected_light(&x, light);
            }
            for (from, light) in from.chunks_exact_mut(B).zip(&*light) {
                for (from, psi) in from.iter_mut().zip(psi) {
                    *from -= weight * light * psi;
                }
            }
        });
    }

    /// Calls `each` with Gauss points of a cell, their weights, and the functions there.
    pub(crate) fn light_points(
        &self,
        cell: usize,
        each: &mut dyn FnMut(Option<Point<f64>>, f64, [f64; B]),
    ) {
        for part in 0..PARTS {
            for (place, weight) in crate::rays::GAUSS {
                let t = (f64::from(part) + place) / f64::from(PARTS);
                let psi = legendre(t + t - 1.0);
                each(self.room().inside(cell, t), weight / f64::from(PARTS), psi);
            }
        }
    }
}

#[cfg(all(test, feature = "alloc"))]
mod tests {
    use alloc::vec::Vec;

    use crate::{
        Enclosure, Grading, Material, Mesh, Room, Scene, Surface, Tables, VisibilityTable,
    };

    /// Where all walls are lights of emission 1, a point is given 1 directly, wherever it is and whatever hides what.
    #[test]
    fn all_walls_give_one() {
        let material = [Material {
            reflectance: 0.5,
            emission: 1.0,
        }];
        let lines: [&[[f64; 2]]; 3] = [
            &[
                [0.0, 0.0],
                [3.0, 0.0],
                [3.1, 2.0],
                [1.1, 2.1],
                [1.0, 2.1],
                [0.0, 2.0],
                [0.0, 0.0],
            ],
            &[[2.0, 0.6], [1.7, 1.5]],
            &[[1.7, 1.5], [2.0, 0.6]],
        ];
        let surfaces = lines.map(|points| Surface {
            points,
            materials: &material,
        });
        let scene = Scene::new::<f64>(&surfaces, Enclosure::Closed).unwrap();
        let mesh = Mesh::new::<f64>(&scene, 40, Grading::default()).unwrap();
        let tables = Tables::<f64>::new(&scene, &mesh);
        let (geometry, cells) = (tables.geometry(), tables.cells());
        let room = Room::new(geometry, cells, VisibilityTable::none(), 0.5).unwrap();
        let all: Vec<u32> = (0..geometry.walls().len() as u32).collect();
        let room = room.with_lights(&all).unwrap();
        for wall in 0..all.len() {
            for place in 1..200 {
                let x = room.point(wall, f64::from(place) / 200.0).unwrap();
                let direct = room.direct(&x);
                assert!((direct - 1.0).abs() < 1e-12, "{x:?} {direct}");
            }
        }
    }
}
