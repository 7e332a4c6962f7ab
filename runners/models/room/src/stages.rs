//! What a solved room offers, as the stage of a model.

use std::borrow::Cow;

use fredholm_core::galerkin::GalerkinMatrix as _;
use fredholm_embedded::TableBuilder;
use fredholm_model::{
    Error, Examined, Goal, Pairs, Request, SavedSystem, System, Then, WalkOptions, WholeSystem,
    in_scalar,
};
use fredholm_room::RoomQuadrature;
use fredholm_variance::{MeanCoefficients, Quadrature as _, VarianceSetup};

use super::system::RoomSystem;
use super::whole::RoomWhole;

impl System for RoomSystem<'_> {
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        self.cut.refuse_infinite(walk, Some(self))
    }

    fn rare_variance(&self, pairs: Pairs) -> Result<f64, Error> {
        self.cut.rare(pairs, self)
    }

    fn job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        in_scalar!(self.cut.cut.scalar, F => self.job_in::<F>(request, then))
    }

    fn examine(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let setup = self.set_up_for::<f64>(request)?;
        let room = setup.room()?;
        let degree = self.cut.cut.degree;
        let quadrature = RoomQuadrature::new(&room, nodes, degree)?;
        let cells = self.cut.mesh.len();
        // Of piecewise constants: the first function of a cell is all of it.
        let is_constant = degree == 0 && cells <= quadrature.sites();
        let dense = match is_constant {
            true => Some(self.matrix()?.coefficients()),
            false => None,
        };
        let coefficients = MeanCoefficients {
            cells,
            mean: &|i, j| dense.as_ref().map_or(f64::NAN, |dense| dense.mean(i, j)),
        };
        let place = |site: usize| {
            let mut wall = 0;
            quadrature.nodes(site, |x, _| wall = x.wall());
            let model = self.cut.model;
            let surface = model.scene.place(wall).map(|place| place.surface);
            surface
                .and_then(|surface| model.surfaces.names.get(surface))
                .map_or_else(|| format!("wall {wall}"), Clone::clone)
        };
        let pieces = self.pieces(&quadrature);
        let model = self.cut.model;
        let start = |goal: &Goal| {
            let start = model.start(&room, setup.tables.lengths(), &goal.region)?;
            model.known(&room, &start, &goal.region)
        };
        let known = request.goals.iter().map(start);
        let known = known.collect::<Result<Vec<f64>, Error>>()?;
        setup.with_neighbour(&room, &mut |neighbour, _| {
            let drawn = setup.has_light().then_some(neighbour);
            self.with_starts(request, &room, drawn, &mut |starts| {
                let setting = VarianceSetup {
                    equation: &room,
                    neighbour,
                    pairs: setup.pairs()?,
                    quadrature: &quadrature,
                    galerkin: None,
                };
                then(&Examined {
                    model: &setting.with_starts(starts)?,
                    coefficients: is_constant.then_some(coefficients),
                    hides: Some(&|from, into| self.hides(&quadrature, from, into)),
                    pieces: Some(&pieces),
                    goals: request.goals,
                    known: &known,
                    place: &place,
                })
            })
        })
    }

    fn tables(&self, pairs: Pairs, absorption: f64) -> Result<TableBuilder, Error> {
        in_scalar!(self.cut.cut.scalar, F => self.tables_in::<F>(pairs, absorption))
    }

    fn saved(&self) -> Option<SavedSystem<'_>> {
        let matrix = self.matrix().ok()?;
        Some(SavedSystem {
            views: Cow::Borrowed(matrix.views().table()),
            ..SavedSystem::new(&self.solution, matrix.entries())
        })
    }

    fn whole<'s>(self: Box<Self>) -> Result<Box<dyn WholeSystem<'s> + 's>, Error>
    where
        Self: 's,
    {
        Ok(Box::new(RoomWhole::new(*self)))
    }
}
