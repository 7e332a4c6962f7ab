//! The last step of a walk, to the light.

#[cfg(feature = "alloc")]
use alloc::vec::Vec;

#[cfg(feature = "alloc")]
use fredholm_core::galerkin::{Cells, buffer, legendre, reserve};
use fredholm_core::{Channels, Equation, Lights, NoDraws, Real, Uniforms, Value};
#[cfg(feature = "alloc")]
use fredholm_core::{SourcePart, best_lights};
use num_traits::zero;

use crate::{ColouredRoom, Point, Room, RoomError, Wall};
#[cfg(feature = "alloc")]
use crate::{Material, Scene, WallColours, factors::exchanges};

/// An equation of light in a room, of one channel or of several: a [`Room`] or a [`ColouredRoom`].
///
/// In a room [with lights](Room::with_lights) F_s is their emission, and nothing has to be drawn for a last step to them:
/// (T_K F_s)(x) is ρ Σ_l F_l F_x→l with the form factors of what x sees of the lights, in closed form.
pub trait RoomEquation<F: Real>: Lights<Scalar = F, Point = Point<F>> {
    /// The room.
    fn room(&self) -> &Room<'_, F>;

    /// The irradiance that lights make at a point directly, Σ_l F_l F_x→l.
    fn direct(&self, x: &Point<F>) -> Self::Value;
}

impl<'a, F: Real> Room<'a, F> {
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
    ///     Enclosure, Grading, Material, Mesh, Scene, Surface, Tables, VisibilityTable,
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
    /// let room = tables.room(VisibilityTable::none()).with_lights(&[0])?;
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

impl<F: Real> Room<'_, F> {
    /// Calls `each` with the number of every light before a point, its wall, and the form factor to what the point sees of it.
    #[inline(always)]
    fn seen_lights(&self, x: &Point<F>, mut each: impl FnMut(usize, &Wall<F>, F)) {
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
}

/// T_K F_s in a point.
#[inline]
fn reflected<F: Real, E: RoomEquation<F>>(equation: &E, x: &Point<F>) -> E::Value {
    if equation.room().lights().is_empty() {
        return E::Value::splat(equation.channels(), zero());
    }
    equation.kernel(x, x).times(&equation.direct(x))
}

/// F_s in a point.
#[inline]
fn emitted<F: Real, E: RoomEquation<F>>(equation: &E, x: &Point<F>) -> E::Value {
    let lights = equation.room().lights();
    match lights.binary_search(&(x.wall() as u32)) {
        Ok(_) => equation.source(x, &mut NoDraws),
        Err(_) => E::Value::splat(equation.channels(), zero()),
    }
}

impl<F: Real> RoomEquation<F> for Room<'_, F> {
    #[inline]
    fn room(&self) -> &Room<'_, F> {
        self
    }

    // Not inline: walks without lights have nothing of this in their loop.
    #[inline(never)]
    fn direct(&self, x: &Point<F>) -> F {
        let mut sum = zero::<F>();
        self.seen_lights(x, |_, wall, factor| sum += wall.emission * factor);
        sum
    }
}

impl<F: Real> Lights for Room<'_, F> {
    #[inline]
    fn light<U: Uniforms<F>>(&self, x: &Point<F>, _: &mut U) -> F {
        reflected(self, x)
    }

    fn known(&self, x: &Point<F>) -> F {
        emitted(self, x)
    }
}

impl<F: Real, const M: usize> RoomEquation<F> for ColouredRoom<'_, '_, F, M> {
    #[inline]
    fn room(&self) -> &Room<'_, F> {
        ColouredRoom::room(self)
    }

    #[inline(never)]
    fn direct(&self, x: &Point<F>) -> Channels<F, M> {
        let mut sum = Channels::splat(self.channels(), zero());
        ColouredRoom::room(self).seen_lights(x, |light, _, factor| {
            let emission = self.value(self.colours().emissions(light));
            sum = sum.plus(&emission.scaled(factor));
        });
        sum
    }
}

impl<F: Real, const M: usize> Lights for ColouredRoom<'_, '_, F, M> {
    #[inline]
    fn light<U: Uniforms<F>>(&self, x: &Point<F>, _: &mut U) -> Channels<F, M> {
        reflected(self, x)
    }

    fn known(&self, x: &Point<F>) -> Channels<F, M> {
        emitted(self, x)
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
    /// The light of these walls of a scene. Takes as long as their rows of form factors.
    ///
    /// # Errors
    /// [`RoomError::Memory`].
    pub fn new(scene: &Scene, lights: &[u32]) -> Result<Self, RoomError> {
        let mut all = Self::of(scene, lights, 1, &|wall, _| scene.material(wall))?;
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
            colours.material(wall, channel)
        })
    }

    /// The light in so many channels, of the materials of walls in each.
    fn of(
        scene: &Scene,
        lights: &[u32],
        channels: usize,
        material: &dyn Fn(usize, usize) -> Material,
    ) -> Result<Vec<Self>, RoomError> {
        let mut all = reserve(channels)?;
        for channel in 0..channels {
            let mut walls: Vec<WallLight> = buffer(scene.walls.len())?;
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
pub fn subtract_lights<E: RoomEquation<f64>, const B: usize>(
    equation: &E,
    cell: usize,
    v: &mut [f64],
) {
    for part in 0..PARTS {
        for (place, weight) in crate::rays::GAUSS {
            let t = (f64::from(part) + place) / f64::from(PARTS);
            let psi: [f64; B] = legendre(t + t - 1.0);
            let x = equation.room().point(cell, &[t]);
            let known = equation.known(&x).plus(&reflected(equation, &x));
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

    use crate::{
        Enclosure, Grading, Material, Mesh, RoomEquation, Scene, Surface, Tables, VisibilityTable,
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
        let all: Vec<u32> = (0..scene.walls.len() as u32).collect();
        let room = tables
            .room(VisibilityTable::none())
            .with_lights(&all)
            .unwrap();
        for wall in 0..all.len() {
            for place in 1..200 {
                let x = room.on_wall(wall, f64::from(place) / 200.0).unwrap();
                let direct = room.direct(&x);
                assert!((direct - 1.0).abs() < 1e-12, "{x:?} {direct}");
            }
        }
    }
}
