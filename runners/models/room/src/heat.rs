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
pub(super) const fn is_in_air(region: &Region) -> bool {
    matches!(region, Region::Point(_))
}

impl RoomModel {
    /// The surfaces whose net fluxes are results: all, with temperatures, unless they are left out.
    pub(super) fn flux_surfaces(&self) -> impl Iterator<Item = usize> + '_ {
        let all = self.surfaces.heat && !self.surfaces.without_fluxes;
        let surfaces = 0..if all { self.surfaces.names.len() } else { 0 };
        surfaces.filter(|&surface| self.has_walls(surface))
    }

    /// The regions of the goals, then every surface whose net flux takes walks.
    pub(super) fn regions(&self, goals: &[Goal], only_u: bool) -> Vec<Region> {
        let mut regions: Vec<Region> = goals.iter().map(|goal| goal.region.clone()).collect();
        if !only_u {
            let walked = |surface: &usize| !self.surfaces.is_flux_given(*surface);
            let surfaces = self.flux_surfaces().filter(walked);
            regions.extend(surfaces.map(Region::Part));
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
        let (mut heat, mut walked_fluxes) = (Vec::new(), Vec::new());
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
            if i < goals.len() {
                heat.push(self.heat_of(region, u.preconditioned(), irradiance));
            } else {
                walked_fluxes.push((walked.map_or(0, Statistics::walks), irradiance));
            }
        }
        let mut walked_fluxes = walked_fluxes.into_iter();
        let fluxes = self.flux_surfaces().map(|surface| {
            let is_given = self.surfaces.is_flux_given(surface);
            let (walks, irradiance) = match is_given {
                true => (0, None),
                false => walked_fluxes.next().unwrap_or((0, None)),
            };
            Flux {
                name: self.surfaces.names[surface].clone(),
                walks,
                net_flux: if is_given {
                    self.given_flux(surface)
                } else {
                    // The flux of its length.
                    let length = self.scene.length(surface).ok();
                    length.and_then(|length| {
                        self.net_flux(&Region::Part(surface), irradiance, length)
                    })
                },
                is_given,
            }
        });
        let fluxes = fluxes.collect();
        Derived { heat, fluxes }
    }

    /// What follows from u of a region and from its irradiance, which follows from u where it is not given.
    pub(super) fn heat_of(
        &self,
        region: &Region,
        u: Estimate,
        irradiance: Option<Estimate>,
    ) -> Heat {
        let in_air = is_in_air(region).then(|| self.temperature(u));
        let through = || Some(self.through_radiosity(region)?.irradiance(u));
        let irradiance = irradiance.or_else(through);
        Heat {
            irradiance,
            net_flux: self.net_flux(region, irradiance, 1.0),
            is_flux_given: self.surfaces.heat && self.is_reflecting(region),
            temperature: self.wall_temperature(region, u),
            radiant_temperature: in_air.flatten(),
        }
    }

    /// The net flux out of a surface from which it is given, in W per metre of depth.
    fn given_flux(&self, surface: usize) -> Option<Estimate> {
        let walls = self.scene.walls_of(surface).ok()?;
        let walls = self.scene.geometry().walls().get(walls)?.iter();
        Some(Estimate {
            estimate: walls.map(|wall| wall.length * wall.emission).sum(),
            std_error: Some(0.0),
            std_dev: Some(0.0),
        })
    }

    /// Whether a region reflects all: whether its net flux is given.
    fn is_reflecting(&self, region: &Region) -> bool {
        let material = self.material(region);
        material.is_some_and(|material| material.reflectance >= 1.0)
    }

    /// The temperature in kelvin of walls from which the net flux q is given: εσT⁴ = u − (1 − ε)H = εu + (1 − ε)q.
    fn wall_temperature(&self, region: &Region, u: Estimate) -> Option<Estimate> {
        let q = self.material(region)?.emission;
        if !self.is_reflecting(region) {
            return None;
        }
        let hidden = match q == 0.0 {
            true => 0.0,
            false => q * (1.0 / self.emissivity(region)? - 1.0),
        };
        self.temperature(Estimate {
            estimate: u.estimate + hidden,
            ..u
        })
    }

    /// The one emissivity of a region from which the net flux is given, if it is known.
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

    /// The temperature in kelvin whose σT⁴ is this mean radiosity, if there are temperatures: in view, the mean radiant
    /// temperature.
    fn temperature(&self, u: Estimate) -> Option<Estimate> {
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
