//! Where walks start that go from sources to receivers.

use alloc::vec::Vec;

use fredholm_core::channels::ChannelFunctional;
use fredholm_core::{Real, Sampler, Uniforms};
use num_traits::{one, zero};

use crate::beam::Beam;
use crate::coloured::Coloured;
use crate::means::on_face;
use crate::radiosity::{Point, Radiosity};
use crate::scene::Scene;
use crate::vector::Vector;

/// The functional of the way back: the power that the sources of a scene send out, as what arrives from it at receivers.
///
/// Light goes both ways: with K(x, y) = ρ(x) G(x, y) and G symmetric,
///
/// ```text
/// (u, Φ) = (F, Φ) + ∫ F(y) ∫ G(y, x) s(x) dA(x) dA(y),    s = ρ φ + ρ ∫ G s dA,
/// ```
///
/// where φ is the density of Φ: s is the radiosity of the same scene if receivers send out ρ φ and nothing else sends out
/// anything. So walks from the sources go through s of all receivers at once, which are the channels of a [`Coloured`]
/// scene. A source is chosen by its power Σ F A or 4π I; from a face the first ray is cosine-distributed, and φ(x0) is the power of
/// all sources where it arrives.
///
/// What receivers get from a face directly is scored by a last step in the point of the face, as in all other states.
#[derive(Clone, Debug)]
pub struct Sources<F> {
    /// The faces that emit, and the lamps at points behind them.
    origins: Vec<Origin<F>>,
    /// The power of each with all before it.
    ends: Vec<F>,
}

/// The place that was drawn of a source.
enum From<F> {
    Face(Point<F>),
    Lamp(Vector<F>),
}

/// A source.
#[derive(Clone, Copy, Debug)]
enum Origin<F> {
    Face(u32),
    Lamp(Vector<F>),
}

impl<F> Sources<F> {
    /// The rays from sources by which a walk estimates (v, Φ). They take about as long as a walk.
    pub const LOOKS: u32 = 16;
}

impl<F: Real> Sources<F> {
    /// The sources of a scene: its faces that emit, and its lamps at points. `None`: there is none, one takes light away, or there
    /// is light that no walk starts from, of the sun or of the sky.
    #[must_use]
    pub fn new(scene: &Scene) -> Option<Self> {
        let mut all = Self {
            origins: Vec::new(),
            ends: Vec::new(),
        };
        if scene.sky().is_some() {
            return None;
        }
        let mut sum = 0.0;
        for (number, face) in (0..).zip(scene.faces()) {
            if face.emission < 0.0 {
                return None;
            }
            if face.emission > 0.0 {
                sum += face.emission * face.area;
                all.origins.push(Origin::Face(number));
                all.ends.push(F::from_f64(sum));
            }
        }
        for beam in scene.beams() {
            let Beam::Point { at, intensity } = *beam else {
                return None;
            };
            sum += 4.0 * core::f64::consts::PI * intensity;
            all.origins.push(Origin::Lamp(at.map(F::from_f64)));
            all.ends.push(F::from_f64(sum));
        }
        (sum > 0.0).then_some(all)
    }

    /// The power of all sources, in the unit of u times that of an area.
    #[must_use]
    pub fn power(&self) -> F {
        self.ends.last().copied().unwrap_or(F::NAN)
    }

    /// A point of a face that emits, or the lamp that is chosen.
    fn draw<U: Uniforms<F>>(&self, radiosity: &Radiosity<'_, F>, uniforms: &mut U) -> From<F> {
        let numbers = [uniforms.uniform(), uniforms.uniform()];
        let at = uniforms.uniform() * self.power();
        // Rounding may lead behind the last.
        let place = self.ends.partition_point(|&end| end <= at);
        let place = place.min(self.ends.len().saturating_sub(1));
        let before = place.checked_sub(1).and_then(|i| self.ends.get(i)).copied();
        match self.origins.get(place) {
            Some(&Origin::Lamp(at)) => From::Lamp(at),
            Some(&Origin::Face(number)) => {
                let face = radiosity.geometry().faces().get(number as usize);
                let end = self.ends.get(place).copied().unwrap_or(F::NAN);
                let before = before.unwrap_or(zero());
                let position = face.map_or([F::NAN; 3], |face| {
                    on_face(face, (at - before) / (end - before), numbers)
                });
                From::Face(Point {
                    face: number,
                    position,
                })
            }
            None => From::Lamp([F::NAN; 3]),
        }
    }
}

/// A direction that is uniform on the sphere.
fn anywhere<F: Real, U: Uniforms<F>>(uniforms: &mut U) -> Vector<F> {
    let z: F = uniforms.uniform();
    let z = z + z - one();
    let angle = (F::PI + F::PI) * uniforms.uniform();
    let wide = (one::<F>() - z * z).max(zero()).sqrt();
    [wide * angle.cos(), wide * angle.sin(), z]
}

impl<'c, F: Real> ChannelFunctional<Coloured<'c, F>> for Sources<F> {
    fn start<U: Uniforms<F>>(
        &self,
        coloured: &Coloured<'c, F>,
        uniforms: &mut U,
        known: &mut [F],
    ) -> (Point<F>, F) {
        known.fill(zero());
        match self.draw(coloured.radiosity(), uniforms) {
            From::Face(y) => {
                coloured.direct(&y, uniforms, known);
                match coloured.step(&y, uniforms) {
                    Some(x) => (x, self.power()),
                    None => left(y, self.power(), known),
                }
            }
            From::Lamp(at) => {
                let (x, phi) = self.lit(coloured, at, uniforms);
                coloured.known(&x, known);
                (x, phi)
            }
        }
    }

    /// A place at which light of the sources arrives.
    fn look<U: Uniforms<F>>(&self, coloured: &Coloured<'c, F>, uniforms: &mut U) -> (Point<F>, F) {
        match self.draw(coloured.radiosity(), uniforms) {
            From::Face(y) => match coloured.step(&y, uniforms) {
                Some(x) => (x, self.power()),
                None => (y, zero()),
            },
            From::Lamp(at) => self.lit(coloured, at, uniforms),
        }
    }

    fn looks(&self) -> u32 {
        Self::LOOKS
    }
}

impl<F: Real> Sources<F> {
    /// What a ray from a lamp meets, and φ.
    fn lit<U: Uniforms<F>>(
        &self,
        coloured: &Coloured<'_, F>,
        lamp: Vector<F>,
        uniforms: &mut U,
    ) -> (Point<F>, F) {
        let radiosity = coloured.radiosity();
        match radiosity.seen(lamp, anywhere(uniforms)) {
            Some((start, _)) => (start.point, self.power()),
            None => {
                let (start, phi) = radiosity.nowhere();
                (start.point, phi)
            }
        }
    }
}

/// The start of a walk that has left the scene with its first ray: next to what is known its score is nothing.
fn left<F: Real>(y: Point<F>, power: F, known: &mut [F]) -> (Point<F>, F) {
    let left = F::from_f64(crate::starts::LEFT);
    known.iter_mut().for_each(|known| *known /= left);
    (y, power * left)
}
