//! Irradiances and net fluxes: what a room says besides u.

use fredholm_core::{Estimate, Statistics};
use fredholm_room::{Enclosure, Material, STEFAN_BOLTZMANN};

use super::RoomModel;
use fredholm_model::{Derived, Flux, Heat};
use fredholm_model::{Goal, Region};

/// H = (u − F)/ρ.
struct ThroughRadiosity {
    emission: f64,
    reflectance: f64,
}

impl ThroughRadiosity {
    fn irradiance(&self, u: Estimate) -> Estimate {
        let scale = |x: Option<f64>| x.map(|x| x / self.reflectance);
        Estimate {
            estimate: (u.estimate - self.emission) / self.reflectance,
            std_error: scale(u.std_error),
            std_dev: scale(u.std_dev),
        }
    }
}

/// Whether a region is a point between the walls.
const fn is_in_air(region: &Region) -> bool {
    matches!(region, Region::Point(_))
}

impl RoomModel {
    /// The regions of the goals and, with temperatures, every surface, for its net flux unless they are left out.
    pub(super) fn regions(&self, goals: &[Goal], only_u: bool) -> Vec<Region> {
        let mut regions: Vec<Region> = goals.iter().map(|goal| goal.region.clone()).collect();
        if self.surfaces.heat && !self.surfaces.without_fluxes && !only_u {
            regions.extend((0..self.surfaces.names.len()).map(Region::Part));
        }
        regions
    }

    /// Whether the irradiance of a region takes walks of its own.
    pub(super) fn takes_walks(&self, region: &Region, only_u: bool) -> bool {
        // In the air there is no wall on which light falls.
        !only_u && !is_in_air(region) && self.through_radiosity(region).is_none()
    }

    /// How the irradiance of a region follows from u there, if it does.
    fn through_radiosity(&self, region: &Region) -> Option<ThroughRadiosity> {
        match region {
            // All light that leaves walls of a closed room arrives at walls.
            Region::Whole if self.scene.enclosure() == Enclosure::Closed => {
                Some(ThroughRadiosity {
                    emission: 0.0,
                    reflectance: 1.0,
                })
            }
            region => self
                .material(region)
                .filter(|material| material.reflectance > 0.0)
                .map(|material| ThroughRadiosity {
                    emission: material.emission,
                    reflectance: material.reflectance,
                }),
        }
    }

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

    /// Irradiances and net fluxes from the statistics of all walks: those of the regions, then those of irradiances that
    /// take walks of their own.
    pub(super) fn derived(&self, goals: &[Goal], statistics: &[Statistics]) -> Derived {
        let regions = self.regions(goals, false);
        if statistics.len() < regions.len() {
            // Nothing but u was asked for.
            return Derived::default();
        }
        let (radiosities, own) = statistics.split_at(regions.len());
        let mut own = own.iter();
        let (mut heat, mut fluxes) = (Vec::new(), Vec::new());
        for (i, (region, u)) in regions.iter().zip(radiosities).enumerate() {
            let through = self.through_radiosity(region);
            let walked = match through {
                Some(_) => Some(u),
                None if is_in_air(region) => None,
                None => own.next(),
            };
            let estimate = walked.map(Statistics::preconditioned);
            let irradiance = match through {
                Some(through) => estimate.map(|u| through.irradiance(u)),
                None => estimate,
            };
            match i.checked_sub(goals.len()) {
                None => heat.push(Heat {
                    irradiance,
                    net_flux: self.net_flux(region, irradiance, 1.0),
                    radiant_temperature: is_in_air(region)
                        .then(|| self.radiant_temperature(u.preconditioned()))
                        .flatten(),
                }),
                // Then come all surfaces, of which the flux is that of their length.
                Some(surface) => fluxes.push(Flux {
                    name: self.surfaces.names[surface].clone(),
                    walks: walked.map_or(0, Statistics::walks),
                    net_flux: self
                        .scene
                        .length(surface)
                        .ok()
                        .and_then(|length| self.net_flux(region, irradiance, length)),
                }),
            }
        }
        Derived { heat, fluxes }
    }

    /// The mean radiant temperature in kelvin, if there are temperatures: σT⁴ is the mean radiosity in view.
    fn radiant_temperature(&self, u: Estimate) -> Option<Estimate> {
        let mean = Some(u.estimate).filter(|&mean| self.surfaces.heat && mean > 0.0)?;
        let temperature = (mean / STEFAN_BOLTZMANN).powf(0.25);
        let scale = |x: Option<f64>| x.map(|x| 0.25 * temperature / mean * x);
        Some(Estimate {
            estimate: temperature,
            std_error: scale(u.std_error),
            std_dev: scale(u.std_dev),
        })
    }

    /// The net flux out of this length of a wall, if there are temperatures.
    fn net_flux(
        &self,
        region: &Region,
        irradiance: Option<Estimate>,
        length: f64,
    ) -> Option<Estimate> {
        let h = irradiance.filter(|_| self.surfaces.heat)?;
        let material = self.material(region)?;
        let scale = |x: Option<f64>| x.map(|x| (1.0 - material.reflectance) * length * x);
        Some(Estimate {
            estimate: length * material.net_flux(h.estimate),
            std_error: scale(h.std_error),
            std_dev: scale(h.std_dev),
        })
    }
}
