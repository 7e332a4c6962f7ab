//! What of a room tells its irradiances and net fluxes.

use fredholm_model::Region;
use fredholm_model::heat::{Carried, Element, RadiativeExchange};
use fredholm_room::Enclosure;

use super::RoomModel;

impl RadiativeExchange for RoomModel {
    fn carried(&self) -> Carried {
        match self.surfaces.heat {
            true => Carried::Heat,
            false => Carried::Light,
        }
    }

    fn is_closed(&self) -> bool {
        self.scene.enclosure() == Enclosure::Closed
    }

    fn is_in_air(&self, region: &Region) -> bool {
        matches!(region.place(), Region::Point(_))
    }

    /// None of all: different walls have no irradiance in common.
    fn elements(&self, region: &Region) -> Vec<Element> {
        let region = region.place();
        let walls = match region {
            Region::On(surface, t) => {
                let at = self.scene.along(*surface, *t);
                at.map(|(wall, _)| wall..wall + 1).into_iter().collect()
            }
            Region::Part(_) | Region::Parts(_) => self.walls(region).unwrap_or_default(),
            _ => Vec::new(),
        };
        let element = |wall| {
            let place = self.scene.place(wall)?;
            let geometry = self.scene.geometry();
            Some(Element {
                share: 1.0,
                absorptance: None,
                surface: place.surface,
                part: place.vertex,
                material: geometry.material(wall),
                emissivity: self.surfaces.emissivity(place),
                size: geometry.walls().get(wall)?.length,
            })
        };
        walls.into_iter().flatten().filter_map(element).collect()
    }

    /// All, with temperatures, unless they are left out.
    fn flux_names(&self) -> &[String] {
        match self.surfaces.heat && !self.surfaces.without_fluxes {
            true => &self.surfaces.names,
            false => &[],
        }
    }
}
