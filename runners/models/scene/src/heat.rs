//! What of a scene tells its irradiances and net fluxes.

use fredholm_model::Region;
use fredholm_model::heat::{Carried, Element, RadiativeExchange};
use fredholm_scene::Enclosure;

use crate::places::Place;
use crate::{Light, SceneModel};

impl SceneModel {
    /// What a face is made of.
    pub(crate) fn element(&self, face: u32) -> Option<Element> {
        let surface = self.scene.place(face as usize)?.surface;
        let own = self.scene.faces().get(face as usize)?;
        let share = 1.0 - self.scene.specular(face as usize);
        Some(Element {
            surface,
            part: 0,
            material: own.material(),
            emissivity: (self
                .heat()
                .and_then(|heat| heat.emissivities.get(surface).copied()))
            .flatten()
            .map(|emissivity| emissivity / share),
            share,
            absorptance: self.scene.absorptance(face as usize),
            size: own.area,
        })
    }
}

impl RadiativeExchange for SceneModel {
    fn carried(&self) -> Carried {
        match &self.light {
            Light::Heat(_) => Carried::Heat,
            Light::Gas(gas) => Carried::Gas {
                scale: gas.speed_of(1.0),
                inlet: gas.inlet,
            },
            _ => Carried::Light,
        }
    }

    fn is_closed(&self) -> bool {
        self.scene.enclosure() == Enclosure::Closed
    }

    fn is_in_air(&self, region: &Region) -> bool {
        match region {
            Region::Facing { .. } => true,
            Region::Point(_) => matches!(Place::new(&self.scene, region), Ok(Place::Air(_))),
            _ => false,
        }
    }

    /// At a point there is the first face on which it lies.
    fn elements(&self, region: &Region) -> Vec<Element> {
        let faces = match Place::new(&self.scene, region) {
            Ok(Place::Point(face, _)) => vec![face],
            Ok(Place::Faces(faces)) => faces,
            _ => Vec::new(),
        };
        let all = faces.into_iter();
        all.filter_map(|face| self.element(face)).collect()
    }

    /// All, with temperatures or of a gas, unless they are left out.
    fn flux_names(&self) -> &[String] {
        let of_gas = matches!(&self.light, Light::Gas(gas) if gas.throughputs);
        // Where sunlight is told apart they are asked for.
        let of_heat = self.heat().filter(|_| !self.scene.has_sunlight());
        match of_gas || of_heat.is_some_and(|heat| heat.net_fluxes) {
            true => &self.names,
            false => &[],
        }
    }
}
