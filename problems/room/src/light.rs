//! The last step of a walk, to the light.

#[cfg(feature = "alloc")]
use alloc::vec::Vec;

#[cfg(feature = "alloc")]
use fredholm_core::NoDraws;
#[cfg(feature = "alloc")]
use fredholm_core::galerkin::{Cells, buffer, legendre, reserve};
use fredholm_core::{Equation, Lights, Real, Start, StartOf, Uniforms, Value};
#[cfg(feature = "alloc")]
use fredholm_core::{SourcePart, best_lights};
use fredholm_surfaces::Tint;
use num_traits::zero;

use crate::{Point, Room, RoomError};
#[cfg(feature = "alloc")]
use crate::{Scene, Wall, factors::exchanges};

impl<'a, F: Real, C> Room<'a, F, C> {
    /// The room with some walls as lights, of which a [`LastStep`](fredholm_core::LastStep) knows what they emit: a small
    /// light is met by few walks, and a last step to it is made in every state that scores. The equation itself is the same.
    ///
    /// `lights` are numbers of walls that grow.
    ///
    /// # Errors
    /// [`RoomError::Lights`]: there is no such wall, or numbers do not grow.
    ///
    /// ```
    /// use fredholm_core::{Equation, LastStep, NoDraws};
    /// use fredholm_room::{
    ///     Enclosure, Grading, Material, Mesh, Scene, Surface, Tables,
    /// };
    ///
    /// let material = |emission| [Material { reflectance: 0.5, emission }];
    /// let (lamp, dark) = (material(1.0), material(0.0));
    /// let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
    /// let floor = Surface { points: &corners[..2], materials: &lamp };
    /// let rest = Surface { points: &corners[1..], materials: &dark };
    /// let scene = Scene::new::<f64>(&[floor, rest], Enclosure::Closed)?;
    /// let mesh = Mesh::new::<f64>(&scene, 4, Grading::default())?;
    /// let tables = Tables::<f64>::new(&scene, &mesh);
    /// let room = tables.room().with_lights(&[0])?;
    /// // The floor's emission is known; from the middle of the ceiling it is seen under twice the angle whose tangent is ½.
    /// let [floor, ceiling] = [room.on_wall(0, 0.5)?, room.on_wall(2, 0.5)?];
    /// assert_eq!(LastStep(&room).source(&floor, &mut NoDraws), 0.0);
    /// let source = LastStep(&room).source(&ceiling, &mut NoDraws);
    /// assert!((source - 0.5 / 5f64.sqrt()).abs() < 1e-15);
    /// # Ok::<(), fredholm_room::RoomError>(())
    /// ```
    pub fn with_lights(mut self, lights: &'a [u32]) -> Result<Self, RoomError> {
        let walls = self.geometry().walls().len();
        let lead = lights.iter().all(|&light| (light as usize) < walls);
        if !lead || !lights.is_sorted_by(|a, b| a < b) {
            return Err(RoomError::Lights);
        }
        self.lights = lights;
        Ok(self)
    }

    /// The numbers of the walls whose emission is F_s.
    #[must_use]
    pub const fn lights(&self) -> &'a [u32] {
        self.lights
    }
}

impl<F: Real, C: Tint<F>> Room<'_, F, C> {
    /// The irradiance that lights make at a point directly, Σ_l F_l F_x→l.
    // Not inline: walks without lights have nothing of this in their loop.
    #[inline(never)]
    #[must_use]
    pub fn direct(&self, x: &Point<F>) -> C::Value {
        let mut sum = self.white(zero());
        for &light in self.lights() {
            // There are such walls: `with_lights` has looked.
            for (w, wall) in self.geometry().copies(light as usize) {
                // Points of a wall do not see it, nor what is on its back, whatever rounding makes of their height.
                let [a, b] = x.position();
                let size = a.abs() + b.abs() + wall.length;
                if wall.height(x.position()) > F::from_f64(8.0) * F::EPSILON * size {
                    let [factor] = self.moments_of_part(x, &wall.part(w));
                    sum = sum.plus(&self.emission(light).scaled(factor));
                }
            }
        }
        sum
    }
}

/// F_s is the emission of [lights](Room::with_lights), and nothing has to be drawn for a last step to them: (T_K F_s)(x) is
/// ρ Σ_l F_l F_x→l with the form factors of what x sees of the lights, in closed form.
impl<F: Real, C: Tint<F>> Lights for Room<'_, F, C> {
    #[inline]
    fn light<U: Uniforms<F>>(&self, x: &Point<F>, _: &mut U) -> C::Value {
        if self.lights().is_empty() {
            return self.white(zero());
        }
        self.kernel(x, x).times(&self.direct(x))
    }

    #[inline]
    fn known(&self, x: &Point<F>) -> C::Value {
        match self.lights().binary_search(&(x.wall() as u32)) {
            Ok(_) => self.emission(x.wall() as u32),
            Err(_) => self.white(zero()),
        }
    }

    fn arriving_lit<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> StartOf<Self> {
        let start = self.arriving(x, uniforms);
        let known = start.known.plus(&self.direct(x));
        Start { known, ..start }
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
/// use fredholm_room::{DirectLight, Enclosure, Grey, Material, Scene, Surface};
///
/// let material = |emission| [Material { reflectance: 0.5, emission }];
/// let (lamp, dark) = (material(1.0), material(0.0));
/// let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
/// let floor = Surface { points: &corners[..2], materials: &lamp };
/// let rest = Surface { points: &corners[1..], materials: &dark };
/// let scene = Scene::new::<f64>(&[floor, rest], Enclosure::Closed)?;
/// let direct = &DirectLight::new(&scene, &[0], &Grey)?[0];
/// // The form factor of opposite sides of a square.
/// assert!((direct.irradiance(2..3) - (2f64.sqrt() - 1.0)).abs() < 1e-14);
/// assert_eq!((direct.emission(0..1), direct.emission(1..4)), (1.0, 0.0));
/// // All that the floor emits arrives somewhere, and half of it is reflected.
/// assert!((4.0 * direct.reflected(0..4) - 0.5).abs() < 1e-14);
/// # Ok::<(), fredholm_room::RoomError>(())
/// ```
#[cfg(feature = "alloc")]
#[derive(Clone, Debug)]
pub struct DirectLight(Vec<WallLight>);

/// Integrals over a wall.
#[cfg(feature = "alloc")]
#[derive(Clone, Copy, Debug, Default)]
struct WallLight {
    length: f64,
    emission: f64,
    irradiance: f64,
    reflected: f64,
}

#[cfg(feature = "alloc")]
impl DirectLight {
    /// The light of these walls in every channel of a scene. Takes as long as their rows of form factors.
    ///
    /// # Errors
    /// [`RoomError::Memory`].
    pub fn new(
        scene: &Scene,
        lights: &[u32],
        tint: &impl Tint<f64>,
    ) -> Result<Vec<Self>, RoomError> {
        let channels = tint.channels();
        let material = |wall, channel| {
            scene
                .geometry()
                .material(wall)
                .in_channel(tint, [wall, channel])
        };
        let mut all = reserve(channels)?;
        for channel in 0..channels {
            let mut walls: Vec<WallLight> = buffer(scene.own)?;
            for (own, wall) in walls.iter_mut().zip(&scene.walls) {
                own.length = wall.length;
            }
            for &light in lights {
                if let Some(own) = walls.get_mut(light as usize) {
                    own.emission = own.length * material(light as usize, channel).emission;
                }
            }
            all.push(Self(walls));
        }
        exchanges(scene, lights, &mut |light, wall, exchange| {
            for (channel, own) in all.iter_mut().enumerate() {
                if let Some(own) = own.0.get_mut(wall as usize) {
                    own.irradiance += material(light as usize, channel).emission * exchange;
                }
            }
        });
        for (channel, own) in all.iter_mut().enumerate() {
            for (wall, own) in own.0.iter_mut().enumerate() {
                own.reflected = material(wall, channel).reflectance * own.irradiance;
            }
        }
        Ok(all)
    }

    /// The mean of F_s over some walls, weighted by length.
    #[must_use]
    pub fn emission(&self, walls: impl IntoIterator<Item = usize>) -> f64 {
        self.mean(walls, |own| own.emission)
    }

    /// The mean of the irradiance that lights make directly, over some walls.
    #[must_use]
    pub fn irradiance(&self, walls: impl IntoIterator<Item = usize>) -> f64 {
        self.mean(walls, |own| own.irradiance)
    }

    /// The mean of T_K F_s over some walls.
    #[must_use]
    pub fn reflected(&self, walls: impl IntoIterator<Item = usize>) -> f64 {
        self.mean(walls, |own| own.reflected)
    }

    fn mean(&self, walls: impl IntoIterator<Item = usize>, of: fn(&WallLight) -> f64) -> f64 {
        let (mut sum, mut length) = (0.0, 0.0);
        for own in walls.into_iter().filter_map(|wall| self.0.get(wall)) {
            sum += of(own);
            length += own.length;
        }
        sum / length
    }
}

/// Four Gauss points in each of so many parts of a cell: of what they miss next to a light nothing but variance comes.
#[cfg(feature = "alloc")]
const PARTS: u32 = 4;

/// Takes what is known of lights from the coefficients of v on a cell, B of every channel: from v near u to the polynomials near
/// u − F_s − T_K F_s that a [`RayNeighbour`](crate::RayNeighbour) has in a room with lights.
#[cfg(feature = "alloc")]
pub fn subtract_lights<C: Tint<f64>, const B: usize>(
    room: &Room<'_, f64, C>,
    cell: usize,
    v: &mut [f64],
) {
    for part in 0..PARTS {
        for (place, weight) in crate::rays::GAUSS {
            let t = (f64::from(part) + place) / f64::from(PARTS);
            let psi: [f64; B] = legendre(t + t - 1.0);
            let x = room.point(cell, &[t]);
            let known = room.known(&x).plus(&room.light(&x, &mut NoDraws));
            for (channel, own) in v.chunks_exact_mut(B).enumerate() {
                let known = known.get(channel) * weight / f64::from(PARTS);
                for (own, psi) in own.iter_mut().zip(psi) {
                    *own -= known * psi;
                }
            }
        }
    }
}

#[cfg(all(test, feature = "alloc"))]
mod tests {
    use alloc::vec::Vec;

    use crate::{Enclosure, Grading, Material, Mesh, Scene, Surface, Tables};

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
        let all: Vec<u32> = (0..scene.walls.len() as u32).collect();
        let room = tables.room().with_lights(&all).unwrap();
        for wall in 0..all.len() {
            for place in 1..200 {
                let x = room.on_wall(wall, f64::from(place) / 200.0).unwrap();
                let direct = room.direct(&x);
                assert!((direct - 1.0).abs() < 1e-12, "{x:?} {direct}");
            }
        }
    }
}
