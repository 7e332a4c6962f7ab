//! Predictions of variances, by draws from parts of the walls.

use fredholm_core::galerkin::Cells as _;
use fredholm_core::{At, LastStep};
use fredholm_model::drawn::{Sites, wanted_sites};
use fredholm_model::heat::only_radiosities;
use fredholm_model::{Error, Examined, Request};
use fredholm_room::{Grading, Mesh, Point, Seen, Tables};
use fredholm_variance::{Density, DrawnModel, DrawnStart, Walked};

use crate::starts::{PANEL, Start};
use crate::system::RoomSystem;

impl RoomSystem<'_> {
    /// Draws from about `nodes`/4 sites, and from the points in which walks of one channel start, and hands on what they tell.
    pub(crate) fn examine_walks(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        only_radiosities(request.goals)?;
        let model = self.cut.model;
        let tables = self.cut.tables::<f64>();
        let room = tables.tables.room();
        let room = &room.with_lights(model.lights(request.walk.last_step))?;
        let wanted = wanted_sites(nodes);
        let mesh = Mesh::new::<f64>(&model.scene, wanted, Grading::default())?;
        let of_sites = Tables::<f64>::new(&model.scene, &mesh);
        let map = &of_sites.room();
        let (there, here) = (
            |x: &Point<f64>| room.found(x),
            |x: &Point<f64>| map.found(x),
        );
        let wall = |cell| mesh.cells().wall(cell);
        let sites = Sites::new(map, mesh.len(), wall, [&there, &here]);
        let (mut starts, mut known) = (Vec::new(), Vec::new());
        for goal in request.goals {
            let start = model.start(room, &goal.region)?;
            known.push(model.known(room, &start, &goal.region)?);
            starts.push(start);
        }
        let mut begin = 0.0;
        let pieces = (0..mesh.len()).map(|cell| {
            let (wall, own) = (wall(cell).unwrap_or(0), map.measure(cell));
            if cell > 0 && mesh.cells().wall(cell - 1) != Some(wall) {
                begin = 0.0;
            }
            let length = model.scene.geometry().walls()[wall].length;
            let from = begin / length;
            begin += own;
            (wall, [from, f64::min(begin / length, 1.0)], own)
        });
        let pieces: Vec<_> = pieces.collect();
        let vectors = self.vectors(room, request.walk)?;
        let follow = vectors.follow(room)?;
        let neighbour = &*follow.neighbour;
        let walked = Walked {
            equation: &LastStep(room),
            neighbour,
            absorption: request.walk.absorption,
        };
        let mut drawn = Vec::new();
        for (number, (start, goal)) in (0..).zip(starts.iter().zip(request.goals)) {
            drawn.push(match start {
                Start::Point(At(x)) => sites.start(&walked, *x, number)?,
                Start::Air(Seen { position, .. }) => {
                    let seen = Seen {
                        room: map,
                        position: *position,
                    };
                    let mut shares = vec![0.0; mesh.len()];
                    seen.moments(1, &mut shares);
                    // With lights every walk looks at v by itself.
                    let value = |y: &Point<f64>| match follow.has_light {
                        true => neighbour.value(&neighbour.locate(room.found(y))),
                        false => 0.0,
                    };
                    let mut mean = 0.0;
                    if follow.has_light {
                        seen.points(PANEL, |y, weight| mean += weight * value(&y));
                    }
                    let densities: Vec<Density> = (0..mesh.len())
                        .map(|cell| Density {
                            fluctuation: value(&map.point(cell, &[0.5])) - mean,
                            ..Density::uniform(map.measure(cell) / shares[cell])
                        })
                        .collect();
                    DrawnStart::Density(Box::new(move |site| densities[site]))
                }
                _ => {
                    let walls = model.walls(&goal.region)?;
                    let own = walls.iter().cloned().flatten();
                    let own = own.filter_map(|wall| model.scene.geometry().walls().get(wall));
                    let density = Density::uniform(own.map(|wall| wall.length).sum());
                    let mesh = &mesh;
                    DrawnStart::Density(Box::new(move |site| {
                        let wall = mesh.cells().wall(site);
                        match walls
                            .iter()
                            .any(|own| wall.is_some_and(|w| own.contains(&w)))
                        {
                            true => density,
                            false => Density::nothing(),
                        }
                    }))
                }
            });
        }
        then(&Examined {
            model: &DrawnModel {
                starts: drawn,
                sites: sites.drawn(&walked)?,
            },
            coefficients: None,
            pieces: Some(&pieces),
            goals: request.goals,
            known: &known,
            place: &|site| {
                let place = wall(site).and_then(|wall| model.scene.place(wall));
                let name = place.and_then(|place| model.surfaces.names.get(place.surface));
                name.map_or_else(|| format!("site {site}"), Clone::clone)
            },
        })
    }
}
