//! The walks of a scene: what is asked for, and what is known of it beforehand.

use fredholm_core::{
    At, Dependence, Equation as _, Goal, Goals, Job, Lights as _, NoDraws, Real, Scaled,
    Sensitivities, Value,
};
use fredholm_model::channels::{self, with_sum};
use fredholm_model::cost::PointwisePairs;
use fredholm_model::heat::{Asked, RadiativeExchange as _, asked, certain};
use fredholm_model::numbers::largest;
use fredholm_model::{Error, Prepared, Region, Request, Then, Wanted, seen_from};
use fredholm_scene::{Point, Sources, Tint, Wide};

use crate::partition::{Cut, Walked};
use crate::places::{Origin, Place};
use crate::system::{AnyNeighbour, SceneSystem};

/// A neighbour equation, and its solution.
type Followed<'a, F, V> = (&'a AnyNeighbour<'a, F, V>, &'a [F]);

/// Where walks start, a number of times.
pub(crate) type Starts<'a, F> = Scaled<Origin<'a, F>, F>;

impl Cut<'_> {
    /// The goal of what is asked for where walks start: in a point of faces, or all over these. `v`: the neighbour equation and its
    /// solution.
    pub(crate) fn goal<'o, F: Real, C: Tint<F>>(
        &self,
        equation: &Walked<'_, F, C>,
        v: Option<Followed<'_, F, C::Value>>,
        (origin, faces): (&'o Origin<'o, F>, &[u32]),
        asked: &Asked,
    ) -> Goal<Starts<'o, F>, Wide<F, C>> {
        let channels = equation.channels();
        let plain = match asked.is_arriving {
            true => Origin::Arriving(origin),
            false => *origin,
        };
        let start = match asked.sunlight == 0.0 {
            true => plain,
            false => Origin::Sunlit {
                of: origin,
                is_arriving: asked.is_arriving,
                share: F::from_f64(asked.sunlight / asked.factor),
            },
        };
        let mean = match (v, &plain) {
            (None, _) => Some(Wide::<F, C>::splat(channels, 0.0)),
            (Some((neighbour, _)), Origin::Point(At(x))) => {
                Some(neighbour.value(&neighbour.locate(*x)).wide())
            }
            (Some((_, v)), Origin::Mean(_)) => Some(self.mean(faces, v)),
            _ => None,
        };
        let constant = Wide::<F, C>::splat(channels, asked.constant);
        Goal {
            functional: Scaled {
                of: start,
                factor: F::from_f64(asked.factor),
            },
            control_mean: mean.map(|own| own.scaled(asked.factor)),
            known: plain.known(equation.0).scaled(asked.factor).plus(&constant),
        }
    }

    /// Prepares walks, of plain Monte Carlo if nothing is solved, and hands them on.
    pub(crate) fn job<F: Real, C: Tint<F>>(
        &self,
        equation: &Walked<'_, F, C>,
        solved: Option<&SceneSystem<'_>>,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error> {
        let model = self.model;
        let tables = solved.map(|system| system.solution.for_walks::<F>());
        let tables = tables.transpose()?;
        let neighbour = self.neighbour(tables.as_ref(), equation)?;
        let regions = self.regions(request)?;
        let places = self.places(&regions)?;
        let geometry = equation.0.geometry();
        let ends = places.iter().map(|place| place.ends(geometry));
        let ends = ends.collect::<Result<Vec<Vec<F>>, Error>>()?;
        let sources = Sources::new(&model.scene);
        let origins = places.iter().zip(&ends);
        let origins = origins.map(|(place, ends)| place.origin(equation.0, ends, sources.as_ref()));
        let origins = origins.collect::<Result<Vec<Origin<'_, F>>, Error>>()?;
        let nothing = Wide::<F, C>::splat(equation.channels(), 0.0);
        // Plain walks for u may end where they start.
        let is_alone = request.wanted == Wanted::Derivatives || solved.is_none();
        let asked: Vec<Asked> = match &model.adjoint {
            Some(_) => vec![Asked::U],
            None => (regions.iter().map(|region| asked(model, region, is_alone))).collect(),
        };
        let v = tables.as_ref().map(|tables| (&*neighbour, tables.v()));
        let (mut goals, mut galerkin) = (Vec::new(), Vec::new());
        for ((place, origin), asked) in places.iter().zip(&origins).zip(&asked) {
            let mut goal = self.goal(equation, v, (origin, place.faces()), asked);
            if let Some(adjoint) = &model.adjoint {
                goal.known = Wide::<F, C>::from_fn(adjoint.known.len(), |c| adjoint.known[c]);
            }
            if v.is_some() && galerkin.len() < request.goals.len() {
                let own = goal
                    .control_mean
                    .unwrap_or_else(|| seen_from(&goal.functional, equation, &*neighbour));
                galerkin.extend(with_sum(&own.plus(&goal.known), model.weights()));
            }
            goals.push(goal);
        }
        let others = model.scene.sky().is_some() || !model.scene.beams().is_empty();
        let mut known = certain(model, model.colours().filter(|_| !others), request.goals);
        known.resize(known.len().max(goals.len()), false);
        let is_dark = |place: &Place| !others && model.is_dark(place.faces());
        for ((known, asked), place) in known.iter_mut().zip(&asked).zip(&places) {
            *known |= asked.is_arriving && is_dark(place);
        }
        for ((region, origin), place) in regions.iter().zip(&origins).zip(&places) {
            if model.colours().is_none() && model.takes_walks(region, request.wanted == Wanted::U) {
                goals.push(Goal {
                    functional: Scaled {
                        of: Origin::Arriving(origin),
                        factor: F::from_f64(1.0),
                    },
                    control_mean: None,
                    known: nothing,
                });
                known.push(is_dark(place));
            }
        }
        // Of plain walks nothing is known, and irradiances of receivers are no goals.
        galerkin.resize(request.goals.len(), 0.0);
        let job = Goals::new(equation, &*neighbour, &goals, request.walk.for_core());
        let job = job.with_sum(model.weights()).with_certain(&known);
        let is_asked = request.wanted == Wanted::Derivatives;
        let dependent = is_asked.then(|| model.surface_quantities());
        // Walks are of w = u − F_s: see `LastStep`.
        let of = |_: Option<&Point<F>>, x: &Point<F>, each: &mut dyn FnMut(usize, Dependence)| {
            let Some(dependent) = &dependent else { return };
            let channels = 0..equation.channels();
            let mut of_light = |light: usize, value: C::Value| {
                let quantity = dependent.of_surfaces + light;
                for channel in channels.clone() {
                    let on = Dependence {
                        source: value.wide().get(channel),
                        ..Dependence::on(quantity)
                    };
                    each(channel, on);
                }
            };
            let Some(place) = model.scene.place(x.face as usize) else {
                return of_light(0, equation.0.source(x, &mut NoDraws));
            };
            let first = usize::from(model.scene.sky().is_some());
            equation
                .0
                .reflected_of_beams(x, &mut |beam, light| of_light(first + beam, light));
            let known = equation.0.known(x).wide();
            for channel in channels {
                let own = dependent.of_part(channel, place.surface, 0);
                own.iter()
                    .for_each(|on| each(channel, on.knowing(known.get(channel))));
            }
        };
        let quantities = dependent.as_ref().map_or(0, |own| own.quantities.len());
        let mut direct = Vec::new();
        if let Some(dependent) = &dependent {
            let first = dependent.of_surfaces + usize::from(model.scene.sky().is_some());
            for ((region, asked), origin) in regions.iter().zip(&asked).zip(&origins) {
                let mut own = dependent.direct(model, region, asked);
                // What beams give to what faces in a direction comes by no state.
                if let Origin::Facing(facing) = origin {
                    facing.each_beam(equation.0, &mut |beam, irradiance: F| {
                        own[first + beam].known = irradiance.to_f64();
                    });
                }
                direct.append(&mut own);
            }
        }
        let with_derivatives = Sensitivities::new(&job, quantities, &of).with_direct(&direct);
        let job: &dyn Job = match dependent {
            Some(_) => &with_derivatives,
            None => &job,
        };
        let (Some(system), Some(tables)) = (solved, &tables) else {
            return then(&Prepared::plain(job, &galerkin));
        };
        let power = model.adjoint.as_ref().map_or(1.0, |adjoint| adjoint.power);
        then(&Prepared {
            job,
            galerkin: &galerkin,
            largest: largest(tables.v()) * power,
            radius_bound: system.radius_bound,
            convergence: system.solution.convergence(),
            pointwise: PointwisePairs::default(),
            neighbour_second_moment_radius: None,
        })
    }

    /// The regions of a request's goals, then those of surfaces whose net fluxes take walks. None of the way back, whose goals are
    /// channels.
    fn regions(&self, request: &Request<'_>) -> Result<Vec<Region>, Error> {
        if let Some(adjoint) = &self.model.adjoint {
            return match request.goals == adjoint.goals {
                true => Ok(Vec::new()),
                false => Err(Error::Internal("walks back for other receivers")),
            };
        }
        channels::regions(self.model, self.model.colours(), request)
    }

    /// The places of these regions, or the sources.
    pub(crate) fn places(&self, regions: &[Region]) -> Result<Vec<Place>, Error> {
        if self.model.adjoint.is_some() {
            return Ok(vec![Place::Sources]);
        }
        let place = |region| Place::new(&self.model.scene, region);
        regions.iter().map(place).collect()
    }

    /// The mean of v over faces: ψ_0 = 1, and the other functions have the mean 0.
    pub(crate) fn mean<F: Real, W: Value<f64>>(&self, faces: &[u32], v: &[F]) -> W {
        let (channels, functions) = (self.channels(), self.functions());
        let (mut sum, mut area) = (W::splat(channels, 0.0), 0.0);
        for &face in faces {
            let first = self.faces.partition_point(|own| own.face < face);
            let own = self.faces.get(first..).unwrap_or(&[]).iter();
            let own = own.take_while(|own| own.face == face);
            for (cell, own) in (first..).zip(own) {
                let v = |c| {
                    v.get((cell * channels + c) * functions)
                        .map_or(f64::NAN, |v: &F| v.to_f64())
                };
                let of = |c| own.area * v(c);
                sum = sum.plus(&W::from_fn(channels, of));
                area += own.area;
            }
        }
        sum.scaled(1.0 / area)
    }
}
