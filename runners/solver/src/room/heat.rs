//! Irradiances and net fluxes: what a room says besides u.

use fredholm_core::{Estimate, Statistics};
use fredholm_room::{Enclosure, Material};

use super::RoomModel;
use crate::model::{Derived, Heat};
use crate::{Goal, Region};

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

impl RoomModel {
    /// The regions of the goals and, with temperatures, every surface: for its net flux.
    pub(super) fn regions(&self, goals: &[Goal], only_u: bool) -> Vec<Region> {
        let mut regions: Vec<Region> = goals.iter().map(|goal| goal.region.clone()).collect();
        if self.surfaces.heat && !only_u {
            regions.extend((0..self.surfaces.names.len()).map(Region::Part));
        }
        regions
    }

    /// Whether the irradiance of a region takes walks of its own.
    pub(super) fn takes_walks(&self, region: &Region, only_u: bool) -> bool {
        !only_u && self.through_radiosity(region).is_none()
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
        let mut heat: Vec<Heat> = Vec::new();
        for (region, u) in regions.iter().zip(radiosities) {
            let irradiance = match self.through_radiosity(region) {
                Some(through) => Some(through.irradiance(u.preconditioned())),
                None => own.next().map(Statistics::preconditioned),
            };
            heat.push(self.heat(region, irradiance));
        }
        let fluxes = heat.split_off(goals.len());
        let names = self.surfaces.names.iter().cloned();
        Derived {
            heat,
            fluxes: names
                .zip(fluxes.into_iter().map(|heat| heat.net_flux))
                .collect(),
        }
    }

    /// Irradiance, and with temperatures the net flux out of a wall: of a surface in W per metre of
    /// depth, at a point in W/m².
    fn heat(&self, region: &Region, irradiance: Option<Estimate>) -> Heat {
        let net_flux = irradiance.filter(|_| self.surfaces.heat).and_then(|h| {
            let material = self.material(region)?;
            let length = match region {
                Region::Part(surface) => self.scene.length(*surface).ok()?,
                _ => 1.0,
            };
            let scale = |x: Option<f64>| x.map(|x| (1.0 - material.reflectance) * length * x);
            Some(Estimate {
                estimate: length * material.net_flux(h.estimate),
                std_error: scale(h.std_error),
                std_dev: scale(h.std_dev),
            })
        });
        Heat {
            irradiance,
            net_flux,
        }
    }
}
