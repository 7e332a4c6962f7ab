//! Where walks start, and what is known there.

use fredholm_core::{
    At, Dependence, Direct, Equation, Functional, Goal, Goals, LastStep, Lights as _, NoDraws,
    Real, Scaled, Sensitivities, StartOf, Uniforms, Value,
};
use fredholm_model::channels::{self, with_sum};
use fredholm_model::heat::{Asked, RadiativeExchange as _, asked, certain};
use fredholm_model::{Error, Region, Request, Wanted, WithJob, seen_from};
use fredholm_room::{Grey, Irradiance, Point, Room, Seen, Tint, Wide};

use crate::RoomModel;
use crate::means::Means;
use crate::system::Follow;

/// Radians of the panels of directions in which a point in the air looks at what lights give to walls.
pub(crate) const PANEL: f64 = 0.02;

impl RoomModel {
    /// Prepares the walks of all goals, and of what a room needs besides; hands on their job, and (v, Φ) of each goal.
    pub(crate) fn with_job<F: Real, C: Tint<F>>(
        &self,
        equation: &Room<'_, F, C>,
        follow: &Follow<'_, F, C::Value>,
        request: &Request<'_>,
        then: &mut WithJob<'_>,
    ) -> Result<(), Error> {
        let regions = channels::regions(self, self.colours(), request)?;
        let weights = self.weights();
        let (mut goals, mut galerkin) = (Vec::new(), Vec::new());
        let channels = equation.channels();
        let mut add = |region: &Region, asked: &Asked| {
            let start = match (self.start(equation, region)?, asked.is_arriving) {
                (Start::Point(of), true) => Start::Light(Irradiance { room: equation, of }),
                (Start::Mean(of), true) => Start::LightMean(Irradiance { room: equation, of }),
                (other, _) => other,
            };
            let constant = Wide::<F, C>::splat(channels, asked.constant);
            let of = |own: Wide<F, C>| own.scaled(asked.factor).plus(&constant);
            let known = self.known(equation, &start, region)?;
            let (mean, is_exact) = self.mean_of_v(equation, &start, region, follow)?;
            if galerkin.len() < request.goals.len() {
                let is_seen = asked.is_arriving && follow.v.is_some();
                let about = match is_seen {
                    true => seen_from(&start, &LastStep(equation), &*follow.neighbour),
                    false => mean,
                };
                galerkin.extend(with_sum(&of(about.plus(&known)), weights));
            }
            goals.push(Goal {
                functional: Scaled {
                    of: start,
                    factor: F::from_f64(asked.factor),
                },
                control_mean: is_exact.then(|| mean.scaled(asked.factor)),
                known: of(known),
            });
            Ok::<(), Error>(())
        };
        // Plain walks for u may end where they start.
        let is_alone = request.wanted == Wanted::Derivatives || follow.v.is_none();
        let asked: Vec<Asked> = regions
            .iter()
            .map(|region| asked(self, region, is_alone))
            .collect();
        for (region, asked) in regions.iter().zip(&asked) {
            add(region.place(), asked)?;
        }
        // Where irradiance does not follow from u it takes walks of its own.
        for region in &regions {
            if weights.is_empty() && self.takes_walks(region, request.wanted == Wanted::U) {
                let arriving = Asked {
                    is_arriving: true,
                    ..Asked::U
                };
                add(region, &arriving)?;
            }
        }
        galerkin.truncate(request.goals.len());
        let walked = LastStep(equation);
        let job = Goals::new(&walked, &*follow.neighbour, &goals, request.walk.for_core());
        let known = certain(self, self.colours(), request.goals);
        let job = job.with_sum(weights).with_certain(&known);
        if request.wanted != Wanted::Derivatives {
            return then(&job, &galerkin);
        }
        let dependent = self.surface_quantities();
        let has_light = !equation.lights().is_empty();
        let of = |_: Option<&Point<F>>, x: &Point<F>, each: &mut dyn FnMut(usize, Dependence)| {
            let Some(place) = self.scene.place(x.wall()) else {
                return;
            };
            let known = has_light.then(|| equation.known(x).wide());
            for channel in 0..equation.channels() {
                let known = known.map_or(0.0, |known| known.get(channel));
                let own = dependent.of_part(channel, place.surface, place.vertex);
                own.iter().for_each(|on| each(channel, on.knowing(known)));
            }
        };
        let direct: Vec<Direct> = regions
            .iter()
            .zip(&asked)
            .flat_map(|(region, asked)| dependent.direct(self, region, asked))
            .collect();
        let job = Sensitivities::new(&job, dependent.quantities.len(), &of);
        then(&job.with_direct(&direct), &galerkin)
    }

    /// Where the walks of a goal start.
    pub(crate) fn start<'r, 'a, F: Real, C>(
        &self,
        room: &'r Room<'a, F, C>,
        region: &Region,
    ) -> Result<Start<'r, 'a, F, C>, Error> {
        Ok(match region {
            Region::On(surface, t) => {
                let (wall, fraction) = self.scene.along(*surface, *t)?;
                Start::Point(At(room.on_wall(wall, fraction)?))
            }
            Region::Point(x) => {
                let position = [0, 1].map(|k| x.get(k).copied().unwrap_or(f64::NAN));
                let position = self.folded(position).map(F::from_f64);
                Start::Air(Seen { room, position })
            }
            region => Start::Mean(Means::new(room, self.walls(region)?)?),
        })
    }

    /// (F_s, Φ): what is known besides what walks estimate.
    pub(crate) fn known<F: Real, C: Tint<F>>(
        &self,
        equation: &Room<'_, F, C>,
        start: &Start<'_, '_, F, C>,
        region: &Region,
    ) -> Result<Wide<F, C>, Error> {
        let channels = equation.channels();
        Ok(match start {
            Start::Air(seen) => light_at(equation, seen),
            _ if equation.lights().is_empty() => Wide::<F, C>::splat(channels, 0.0),
            Start::Point(At(x)) => equation.known(x).wide(),
            Start::Light(Irradiance { of: At(x), .. }) => equation.direct(x).wide(),
            Start::Mean(_) | Start::LightMean(_) => {
                let (direct, walls) = (self.direct()?, self.walls(region)?);
                Wide::<F, C>::from_fn(channels, |channel| {
                    let walls = walls.iter().cloned().flatten();
                    direct.get(channel).map_or(f64::NAN, |direct| match start {
                        Start::Mean(_) => direct.emission(walls),
                        _ => direct.irradiance(walls),
                    })
                })
            }
        })
    }

    /// (v, Φ), and whether it is exact: what lights give to the walls that a point sees has no closed integral.
    pub(crate) fn mean_of_v<F: Real, C: Tint<F>>(
        &self,
        equation: &Room<'_, F, C>,
        start: &Start<'_, '_, F, C>,
        region: &Region,
        follow: &Follow<'_, F, C::Value>,
    ) -> Result<(Wide<F, C>, bool), Error> {
        let channels = equation.channels();
        Ok(match start {
            Start::Point(At(x)) => {
                let v = &follow.neighbour;
                (v.value(&v.locate(*x)).wide(), true)
            }
            Start::Mean(mean) => {
                let mut value = follow.of_channels(channels, &|v| mean.of(v));
                if follow.has_light {
                    let (direct, walls) = (self.direct()?, self.walls(region)?);
                    value = value.plus(&Wide::<F, C>::from_fn(channels, |channel| {
                        let walls = walls.iter().cloned().flatten();
                        direct
                            .get(channel)
                            .map_or(f64::NAN, |direct| direct.reflected(walls))
                    }));
                }
                (value, true)
            }
            Start::Air(seen) => {
                let mut value = follow.of_channels(channels, &|v| seen.of(v)[0]);
                if follow.has_light {
                    seen.points(PANEL, |x, weight| {
                        let light = equation.light(&x, &mut NoDraws).wide();
                        value = value.plus(&light.scaled(weight));
                    });
                }
                (value, !follow.has_light)
            }
            Start::Light(_) | Start::LightMean(_) => {
                let nothing = Wide::<F, C>::splat(channels, 0.0);
                (nothing, follow.v.is_none())
            }
        })
    }
}

/// (F_s, Φ) of a point between the walls, and what it sees of the sky.
pub(crate) fn light_at<F: Real, C: Tint<F>>(
    equation: &Room<'_, F, C>,
    seen: &Seen<'_, '_, F, C>,
) -> Wide<F, C> {
    let mut sum = Wide::<F, C>::splat(equation.channels(), seen.sky().to_f64());
    if equation.lights().is_empty() {
        return sum;
    }
    seen.cells(|cell, angle| {
        if let Some(x) = equation.inside(cell, F::from_f64(0.5)) {
            let share = angle.to_f64() / core::f64::consts::TAU;
            sum = sum.plus(&equation.known(&x).wide().scaled(share));
        }
    });
    sum
}

/// Where the walks of a goal start.
pub(crate) enum Start<'r, 'a, F, C = Grey> {
    Point(At<Point<F>>),
    Mean(Means<'r, 'a, F, C>),
    Air(Seen<'r, 'a, F, C>),
    Light(Irradiance<'r, 'a, F, At<Point<F>>, C>),
    LightMean(Irradiance<'r, 'a, F, Means<'r, 'a, F, C>, C>),
}

impl<F: Real, C, E: Equation<Scalar = F, Point = Point<F>>> Functional<E> for Start<'_, '_, F, C> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, equation: &E, uniforms: &mut U) -> StartOf<E> {
        match self {
            Self::Point(at) => at.start(equation, uniforms),
            Self::Mean(mean) => mean.start(equation, uniforms),
            Self::Air(seen) => seen.start(equation, uniforms),
            Self::Light(light) => light.start(equation, uniforms),
            Self::LightMean(light) => light.start(equation, uniforms),
        }
    }
}
