//! Predictions of variances.

use fredholm_core::LastStep;
use fredholm_model::pairs::AnyPairs;
use fredholm_model::{Error, Examined, Goal, Region, Request, WithStarts};
use fredholm_room::{Point, Room, RoomQuadrature};
use fredholm_variance::{Density, Quadrature as _, Start as Begin, VarianceSetup};

use crate::starts::{PANEL, in_view, seen};
use crate::system::{AnyNeighbour, RoomSystem};

/// The density with which walks start.
type StartDensity<'a> = dyn Fn(&Point<f64>) -> Density + Sync + 'a;

impl RoomSystem<'_> {
    /// Prepares a prediction of walks in one channel.
    pub(crate) fn examine_walks(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let model = self.cut.model;
        let tables = self.cut.tables::<f64>();
        let room = tables.tables.room(self.views()?);
        let room = room.with_lights(model.lights(request.walk.last_step))?;
        let quadrature = RoomQuadrature::new(&room, nodes, self.cut.cut.degree)?;
        let place = |site: usize| {
            let mut wall = 0;
            quadrature.nodes(site, |x, _| wall = x.wall());
            let surface = model.scene.place(wall).map(|place| place.surface);
            surface
                .and_then(|surface| model.surfaces.names.get(surface))
                .map_or_else(|| format!("wall {wall}"), Clone::clone)
        };
        let pieces = self.pieces(&quadrature);
        let known = |goal: &Goal| {
            let start = model.start(&room, &goal.region)?;
            model.known(&room, &start, &goal.region)
        };
        let known = request.goals.iter().map(known);
        let known = known.collect::<Result<Vec<f64>, Error>>()?;
        self.with_neighbour(&room, request.walk, &mut |follow| {
            let drawn = follow.has_light.then_some(follow.neighbour);
            self.with_starts(request, &room, drawn, &mut |starts| {
                let setting = VarianceSetup {
                    equation: &LastStep(&room),
                    neighbour: follow.neighbour,
                    pairs: AnyPairs::AllPointwise,
                    quadrature: &quadrature,
                    absorption: request.walk.absorption,
                };
                then(&Examined {
                    model: &setting.with_starts(starts)?,
                    coefficients: None,
                    pieces: Some(&pieces),
                    goals: request.goals,
                    known: &known,
                    place: &place,
                })
            })
        })
    }

    /// Calls `then` with the starts of the walks of all goals. `drawn` is a neighbour equation whose (v, Φ) in the air is a number of
    /// every walk.
    fn with_starts(
        &self,
        request: &Request<'_>,
        room: &Room<'_, f64>,
        drawn: Option<&AnyNeighbour<'_, f64, f64>>,
        then: &mut WithStarts<'_, Point<f64>>,
    ) -> Result<(), Error> {
        let model = self.cut.model;
        let mut densities: Vec<Box<StartDensity<'_>>> = Vec::new();
        for goal in request.goals {
            if let Region::Point(x) = &goal.region {
                let seen = seen(room, x);
                let value = move |y: &Point<f64>| drawn.map_or(0.0, |v| v.value(&v.locate(*y)));
                let mut mean = 0.0;
                if drawn.is_some() {
                    seen.points(PANEL, |y, weight| mean += weight * value(&y));
                }
                let density = move |y: &Point<f64>| Density {
                    fluctuation: value(y) - mean,
                    known: 0.0,
                    ..in_view(seen.density(y))
                };
                densities.push(Box::new(density));
                continue;
            }
            let walls = model.walls(&goal.region)?;
            let own = model.scene.geometry();
            let own = walls
                .iter()
                .flat_map(|walls| own.walls().get(walls.clone()));
            let length = own.flatten().map(|wall| wall.length).sum();
            densities.push(Box::new(move |x: &Point<f64>| {
                if walls.iter().any(|walls| walls.contains(&x.wall())) {
                    Density::uniform(length)
                } else {
                    Density::nothing()
                }
            }));
        }
        let mut starts: Vec<Begin<'_, Point<f64>>> = Vec::new();
        for (goal, density) in request.goals.iter().zip(&densities) {
            starts.push(match &goal.region {
                Region::On(surface, t) => {
                    let (wall, fraction) = model.scene.along(*surface, *t)?;
                    Begin::At(room.on_wall(wall, fraction)?)
                }
                _ => Begin::Density(&**density),
            });
        }
        then(&starts)
    }

    /// The place of every site: its wall, where on it in fractions of it, and its length.
    fn pieces(&self, quadrature: &RoomQuadrature<'_, '_>) -> Vec<(usize, [f64; 2], f64)> {
        let geometry = self.cut.model.scene.geometry();
        let mut pieces = Vec::new();
        let (mut before, mut length, mut along) = (0, 0.0, 0.0);
        for site in 0..quadrature.sites() {
            let (mut wall, mut own) = (0, 0.0);
            quadrature.nodes(site, |x, weight| {
                wall = x.wall();
                own += weight;
            });
            if site == 0 || wall != before {
                length = geometry.walls().get(wall).map_or(f64::NAN, |w| w.length);
                along = 0.0;
            }
            before = wall;
            let to = (along + own) / length;
            pieces.push((wall, [along / length, f64::min(to, 1.0)], own));
            along += own;
        }
        pieces
    }
}
