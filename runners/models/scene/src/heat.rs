//! What of a scene tells its irradiances and net fluxes.

use fredholm_core::Statistics;
use fredholm_model::channels::Exchange;
use fredholm_model::heat::{Optics, RadiativeExchange};
use fredholm_model::{Derived, Goal, Region};
use fredholm_scene::{Enclosure, Face, Material};

use crate::places::Place;
use crate::{Colours, SceneModel};

impl SceneModel {
    fn faces(&self, surface: usize) -> &[Face<f64>] {
        let own = self.scene.faces_of(surface).ok();
        own.and_then(|own| self.scene.faces().get(own))
            .unwrap_or(&[])
    }

    /// The surfaces of a region: of a point the first on which it is.
    fn surfaces_of(&self, region: &Region) -> Vec<usize> {
        match region {
            Region::Spot(surface, _) | Region::Part(surface) => vec![*surface],
            Region::Parts(surfaces) => surfaces.clone(),
            Region::Whole => (0..self.names.len()).collect(),
            Region::Point(_) => match Place::new(&self.scene, region) {
                Ok(Place::Point(face, _)) => {
                    let place = self.scene.place(face as usize);
                    place.map(|place| place.surface).into_iter().collect()
                }
                _ => Vec::new(),
            },
            _ => Vec::new(),
        }
    }

    /// What several channels say besides u.
    pub(crate) fn of_channels(
        &self,
        colours: &Colours,
        goals: &[Goal],
        statistics: &[Statistics],
    ) -> Derived {
        let materials = |region: &Region| match region {
            Region::Whole if self.is_closed() => Some(Exchange::Arrives),
            Region::Facing { .. } => Some(Exchange::Arrives),
            region if self.is_in_air(region) => None,
            region => {
                let surfaces = self.surfaces_of(region).into_iter();
                let own = common(surfaces.map(|surface| colours.materials.get(surface)))??;
                Some(Exchange::Through(own.iter().map(optics).collect()))
            }
        };
        colours.names.derived(goals, statistics, &materials)
    }
}

fn optics(material: &Material) -> Optics {
    Optics {
        reflectance: material.reflectance,
        emission: material.emission,
    }
}

/// What all of some things have in common.
fn common<T: PartialEq>(mut all: impl Iterator<Item = T>) -> Option<T> {
    let first = all.next()?;
    all.all(|other| other == first).then_some(first)
}

impl RadiativeExchange for SceneModel {
    fn is_heat(&self) -> bool {
        self.heat().is_some()
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

    fn optics(&self, region: &Region) -> Option<Optics> {
        let surfaces = self.surfaces_of(region);
        let faces = surfaces.iter().flat_map(|&surface| self.faces(surface));
        common(faces.map(|face| Optics {
            reflectance: face.reflectance,
            emission: face.emission,
        }))
    }

    fn emissivity(&self, region: &Region) -> Option<f64> {
        let own = &self.heat()?.emissivities;
        let surfaces = self.surfaces_of(region);
        let known = surfaces
            .iter()
            .map(|&surface| own.get(surface).copied().flatten());
        common(known).flatten()
    }

    /// All, with temperatures, unless they are left out.
    fn flux_surfaces(&self) -> Vec<usize> {
        let wanted = self.heat().is_some_and(|heat| heat.net_fluxes);
        (0..if wanted { self.names.len() } else { 0 }).collect()
    }

    fn is_flux_given(&self, surface: usize) -> bool {
        self.faces(surface)
            .iter()
            .all(|face| face.reflectance >= 1.0)
    }

    fn given_flux(&self, surface: usize) -> Option<f64> {
        let faces = self.faces(surface).iter();
        Some(faces.map(|face| face.area * face.emission).sum())
    }

    fn name(&self, surface: usize) -> &str {
        self.names.get(surface).map_or("", String::as_str)
    }

    fn size(&self, surface: usize) -> Option<f64> {
        self.scene.area(surface).ok()
    }
}
