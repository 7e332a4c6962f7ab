//! Predictions of variances, by draws from parts of the surfaces.

use fredholm_core::galerkin::Cells as _;
use fredholm_core::{At, LastStep};
use fredholm_model::drawn::{Sites, wanted_sites};
use fredholm_model::heat::{RadiativeExchange as _, only_radiosities};
use fredholm_model::{Error, Examined, Request};
use fredholm_scene::{Cells, Grey, Point, Radiosity, Tables};
use fredholm_variance::{Density, DrawnModel, DrawnStart, Walked as Drawn};

use crate::partition::Walked;
use crate::places::{Origin, Place};
use crate::system::{AnyNeighbour, SceneSystem};

/// The equation and its neighbour, of which draws are made.
type Pair<'a> = Drawn<'a, Walked<'a, f64, Grey>, AnyNeighbour<'a, f64, f64>>;

impl SceneSystem<'_> {
    /// Draws from about `nodes`/4 sites, and from the points in which walks start, and hands on what they tell.
    pub(crate) fn examine_drawn(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let (cut, model) = (&self.cut, self.cut.model);
        let wanted = wanted_sites(nodes);
        let (tables, cells) = (Tables::new(&model.scene), Cells::new(&model.scene, wanted)?);
        let map = Radiosity::new(tables.geometry(), &cells)?;
        let face = |cell| map.point(cell, &[0.5, 0.25]).face;
        let surface = |cell| {
            let place = model.scene.place(face(cell) as usize);
            place.map(|place| place.surface)
        };
        let same = |x: &Point<f64>| *x;
        let sites = Sites::new(&map, wanted, surface, [&same, &same]);
        let radiosity = cut.wide.radiosity()?;
        let equation = LastStep(&radiosity);
        let vectors = self.solution.for_walks::<f64>()?;
        let neighbour = cut.neighbour(Some(&vectors), &equation)?;
        let pair = Pair {
            equation: &equation,
            neighbour: &*neighbour,
            absorption: request.walk.absorption,
        };
        only_radiosities(request.goals)?;
        let places = cut.places(&model.regions(request.goals, true))?;
        let (mut starts, mut known) = (Vec::new(), Vec::new());
        for (number, place) in (0..).zip(&places) {
            let ends = place.ends(radiosity.geometry())?;
            let origin = place.origin(&radiosity, &ends, None)?;
            known.push(origin.known(&radiosity));
            starts.push(match (place, &origin) {
                (_, &Origin::Point(At(x))) => sites.start(&pair, x, number)?,
                (Place::Faces(faces), Origin::Mean(mean)) => {
                    let density = Density::uniform(mean.area());
                    // A site is on one surface, and a mean over whole surfaces.
                    let (sites, face) = (&sites, &face);
                    DrawnStart::Density(Box::new(move |site| {
                        let cell = sites.all.get(site).map(|site| site.cells.start);
                        match cell.map(|cell| faces.binary_search(&face(cell))) {
                            Some(Ok(_)) => density,
                            _ => Density::nothing(),
                        }
                    }))
                }
                _ => {
                    return Err(Error::Region {
                        message: "variances of walks that start between the surfaces are not predicted: ask for points on surfaces, \
                                  and for means over them"
                            .to_owned(),
                    });
                }
            });
        }
        then(&Examined {
            model: &DrawnModel {
                starts,
                sites: sites.drawn(&pair)?,
            },
            coefficients: None,
            goals: request.goals,
            known: &known,
            place: &|site| {
                let surface = sites.all.get(site).and_then(|site| site.part);
                let name = surface.and_then(|surface| model.names.get(surface));
                name.map_or_else(|| "the sky".to_owned(), Clone::clone)
            },
            pieces: None,
        })
    }
}
