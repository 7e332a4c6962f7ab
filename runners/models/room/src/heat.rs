//! What of a room tells its irradiances and net fluxes.

use fredholm_core::Statistics;
use fredholm_model::channels::Exchange;
use fredholm_model::heat::{Optics, RadiativeExchange};
use fredholm_model::{Derived, Goal, Region};
use fredholm_room::{Enclosure, Material};

use super::{Colours, RoomModel};

impl RoomModel {
    /// The one material of a region, if it has one.
    fn material(&self, region: &Region) -> Option<Material> {
        match region {
            Region::On(surface, t) => {
                let (wall, _) = self.scene.along(*surface, *t).ok()?;
                let vertex = self.scene.place(wall)?.vertex;
                let own = self.surfaces.materials.get(*surface)?;
                own.get(vertex).or(own.first()).copied()
            }
            Region::Part(surface) => self.surfaces.material(*surface),
            Region::Parts(surfaces) => {
                let own = |surface: &usize| self.surfaces.material(*surface);
                let first = own(surfaces.first()?)?;
                let same = surfaces.iter().all(|surface| own(surface) == Some(first));
                same.then_some(first)
            }
            _ => None,
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
            Region::On(surface, t) => {
                let (wall, _) = self.scene.along(*surface, *t).ok()?;
                let vertex = self.scene.place(wall)?.vertex;
                colours.of_segment(*surface, vertex).map(Exchange::Through)
            }
            Region::Part(surface) => colours.common(&[*surface]).map(Exchange::Through),
            Region::Parts(surfaces) => colours.common(surfaces).map(Exchange::Through),
            _ => None,
        };
        colours.names().derived(goals, statistics, &materials)
    }
}

impl RadiativeExchange for RoomModel {
    fn is_heat(&self) -> bool {
        self.surfaces.heat
    }

    fn is_closed(&self) -> bool {
        self.scene.enclosure() == Enclosure::Closed
    }

    fn is_in_air(&self, region: &Region) -> bool {
        matches!(region, Region::Point(_))
    }

    fn optics(&self, region: &Region) -> Option<Optics> {
        self.material(region).map(|material| Optics {
            reflectance: material.reflectance,
            emission: material.emission,
        })
    }

    fn emissivity(&self, region: &Region) -> Option<f64> {
        let of = |surface: usize| self.scene.walls_of(surface).ok();
        let walls: Vec<usize> = match region {
            Region::On(surface, t) => vec![self.scene.along(*surface, *t).ok()?.0],
            Region::Part(surface) => of(*surface)?.collect(),
            Region::Parts(surfaces) => surfaces.iter().copied().filter_map(of).flatten().collect(),
            _ => return None,
        };
        let own = |wall: &usize| self.surfaces.emissivity(self.scene.place(*wall)?);
        let first = own(walls.first()?)?;
        let same = walls.iter().all(|wall| own(wall) == Some(first));
        same.then_some(first)
    }

    /// All, with temperatures, unless they are left out.
    fn flux_surfaces(&self) -> Vec<usize> {
        let all = self.surfaces.heat && !self.surfaces.without_fluxes;
        let surfaces = 0..if all { self.surfaces.names.len() } else { 0 };
        surfaces
            .filter(|&surface| self.has_walls(surface))
            .collect()
    }

    fn is_flux_given(&self, surface: usize) -> bool {
        self.surfaces.is_flux_given(surface)
    }

    fn given_flux(&self, surface: usize) -> Option<f64> {
        let walls = self.scene.walls_of(surface).ok()?;
        let walls = self.scene.geometry().walls().get(walls)?.iter();
        Some(walls.map(|wall| wall.length * wall.emission).sum())
    }

    fn name(&self, surface: usize) -> &str {
        self.surfaces.names.get(surface).map_or("", String::as_str)
    }

    fn size(&self, surface: usize) -> Option<f64> {
        self.scene.length(surface).ok()
    }
}
