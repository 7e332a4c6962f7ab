//! Where walks start that go from sources to receivers.

use alloc::vec::Vec;

use fredholm_core::{Functional, LastStep, Lights as _, Real, StartOf, Uniforms};

use crate::beam::Beam;
use crate::means::{chosen, on_face};
use crate::radiosity::Radiosity;
use crate::scene::Scene;
use crate::starts::anywhere;
use crate::vector::Vector;
use fredholm_surfaces::Tint;

/// The functional of the adjoint: the power that the sources of a scene send out, as what arrives from it at receivers.
///
/// Light goes both ways: with K(x, y) = ρ(x) G(x, y) and G symmetric,
///
/// ```text
/// (u, Φ) = (F, Φ) + ∫ F(y) ∫ G(y, x) s(x) dA(x) dA(y),    s = ρ φ + ρ ∫ G s dA,
/// ```
///
/// where φ is the density of Φ: s is the radiosity of the same scene if receivers send out ρ φ and nothing else sends out
/// anything. So walks from the sources go through s of all receivers at once, which are the channels of a [`Coloured`](crate::Coloured)
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

/// A source.
#[derive(Clone, Copy, Debug)]
enum Origin<F> {
    Face(u32),
    Lamp(Vector<F>),
}

/// The rays from sources by which a walk estimates (v, Φ). They take about as long as a walk.
const LOOKS: u32 = 16;

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
                // A mirror sends out (1 − ρ_s) F of what it has here.
                sum += face.emission * face.area * (1.0 - scene.specular(number as usize));
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
}

impl<F: Real, C: Tint<F>> Functional<LastStep<'_, Radiosity<'_, F, C>>> for Sources<F> {
    fn start<U: Uniforms<F>>(
        &self,
        equation: &LastStep<'_, Radiosity<'_, F, C>>,
        uniforms: &mut U,
    ) -> StartOf<Radiosity<'_, F, C>> {
        let radiosity = equation.0;
        let numbers = [uniforms.uniform(), uniforms.uniform()];
        let (place, share) = chosen(&self.ends, uniforms.uniform() * self.power());
        match self.origins.get(place) {
            Some(&Origin::Face(face)) => {
                let y = on_face(radiosity.geometry(), face, share, numbers);
                radiosity.arriving_lit(&y, uniforms).scaled(self.power())
            }
            Some(&Origin::Lamp(at)) => {
                radiosity.start_at(radiosity.seen(at, anywhere(numbers)), self.power())
            }
            None => radiosity.start_at(None, self.power()),
        }
    }

    fn looks(&self) -> u32 {
        LOOKS
    }
}
