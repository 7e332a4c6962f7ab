//! The way back: walks from the sources of a scene to receivers.
//!
//! Light goes both ways, so that the radiosity s of the same scene in which receivers send out ρ φ, and nothing else does, tells
//! what the sources give them: see [`Sources`]. Receivers are channels of one scene, and one set of walks from the sources
//! serves all.

use fredholm_core::{Functional, MOST_CHANNELS};
use fredholm_model::heat::RadiativeExchange as _;
use fredholm_model::{Error, GlobalQuantity, Goal, Region, Subject};
use fredholm_scene::{ColourTables, Grey, Scene, Sources, share};

use crate::SceneModel;
use crate::partition::Walked;
use crate::places::Place;

/// The receivers of walks from the sources, for goals that are means over surfaces.
#[derive(Clone, Debug)]
pub(crate) struct Adjoint {
    /// The scene in which the receivers send out light, and nothing else.
    pub(crate) scene: Scene,
    /// The receivers: radiosities of all goals, and then the irradiances that take walks.
    pub(crate) channels: ColourTables<f64>,
    /// (F, Φ) of every receiver, which takes no walks.
    pub(crate) known: Vec<f64>,
    pub(crate) goals: Vec<Goal>,
    /// The power of all sources.
    pub(crate) power: f64,
    /// The rays from sources by which a walk estimates (v, Φ).
    pub(crate) looks: f64,
}

fn refuse<T>(message: String) -> Result<T, Error> {
    Err(Error::Option {
        subject: Subject::Adjoint,
        message,
    })
}

impl Adjoint {
    pub(crate) fn new(forward: &SceneModel, goals: &[Goal]) -> Result<Self, Error> {
        let scene = &forward.scene;
        if scene.has_sunlight() {
            return refuse(
                "where sunlight is told apart from heat walks go from the targets: leave `adjoint` out"
                    .to_owned(),
            );
        }
        if forward.colours().is_some() {
            return refuse(
                "walks from the sources serve many receivers in one channel: leave `adjoint` out"
                    .to_owned(),
            );
        }
        let Some(sources) = Sources::<f64>::new(scene) else {
            return refuse(
                "walks from the sources start on surfaces that emit and at lamps, and there must be one: not in the sun or the \
                 sky, nor where light is taken away; leave `adjoint` out"
                    .to_owned(),
            );
        };
        let is_flux = |goal: &Goal| {
            let asked = &goal.region;
            matches!(
                asked,
                Region::NetFlux(_) | Region::Temperature(_) | Region::Transmission(_)
            )
        };
        if goals.iter().any(is_flux) {
            return refuse(
                "walks from the sources serve radiosities and irradiances: leave `adjoint` out, or `ask`"
                    .to_owned(),
            );
        }
        let regions = forward.regions(goals, false);
        let is_u = |region: &Region| region.asked().0 == GlobalQuantity::U;
        let radiosities = regions.iter().map(|region| (region, is_u(region)));
        // What is not reflected has an irradiance of its own.
        let walked = regions
            .iter()
            .filter(|region| forward.takes_walks(region, false));
        let receivers: Vec<(&Region, bool)> = radiosities
            .chain(walked.map(|region| (region, false)))
            .collect();
        let channels = receivers.len();
        if channels > MOST_CHANNELS {
            return refuse(format!(
                "walks from the sources serve {MOST_CHANNELS} receivers at most, not {channels}: leave `adjoint` out"
            ));
        }
        let faces = scene.faces();
        let mut emissions = vec![0.0; faces.len() * channels];
        let mut known = Vec::with_capacity(channels);
        for (channel, (region, is_radiosity)) in receivers.into_iter().enumerate() {
            let Place::Faces(numbers) = Place::new(scene, region)? else {
                return refuse(
                    "walks from the sources serve means over surfaces, which they may meet: leave `adjoint` out, or the points"
                        .to_owned(),
                );
            };
            let own = || {
                numbers
                    .iter()
                    .map(|&face| (face as usize, &faces[face as usize]))
            };
            let area: f64 = own().map(|(_, face)| face.area).sum();
            for (number, face) in own() {
                let density = if is_radiosity { face.reflectance } else { 1.0 };
                // What arrives at a mirror counts in full, and its cells by 1 − ρ_s.
                let share = 1.0 - scene.specular(number);
                emissions[number * channels + channel] = density / (share * area);
            }
            let emitted: f64 = own().map(|(_, face)| face.area * face.emission).sum();
            known.push(if is_radiosity { emitted / area } else { 0.0 });
        }
        let of_faces = emissions.chunks_exact_mut(channels.max(1));
        let largest = of_faces.map(|own| {
            let largest = own.iter().copied().fold(0.0, f64::max);
            own.iter_mut().for_each(|own| *own = share(*own, largest));
            largest
        });
        let largest: Vec<f64> = largest.collect();
        Ok(Self {
            scene: scene.clone().with_emissions(&largest)?,
            channels: ColourTables {
                channels,
                reflectances: vec![1.0; emissions.len()],
                emissions,
            },
            known,
            goals: goals.to_vec(),
            power: sources.power(),
            looks: f64::from(Functional::<Walked<'_, f64, Grey>>::looks(&sources)),
        })
    }
}
