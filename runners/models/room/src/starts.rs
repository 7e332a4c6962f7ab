//! Where walks start, and what v gives there.

use fredholm_core::{At, Functional, Goals, Real, Shifted, Uniforms};
use fredholm_model::heat::RadiativeExchange as _;
use fredholm_model::{Error, Region, Request, WithJob};
use fredholm_room::{Irradiance, Point, Room, Seen};
use fredholm_variance::Density;

use super::RoomModel;
use super::means::Means;
use super::system::Boxed;

/// What v gives where walks start.
pub(super) struct Solutions<'s, 'a, F> {
    /// The mean of the control variate.
    pub(super) mean: &'s dyn Fn(&Means<'_, 'a, F>) -> f64,
    /// What a point between the walls sees of it.
    pub(super) air: &'s dyn Fn(&Seen<'_, 'a, F>) -> f64,
    /// The irradiance that it makes.
    pub(super) irradiance: &'s dyn Fn(&Point<F>) -> f64,
    /// Whether the neighbour equation has what lights give to walls besides, of which points and means are known.
    pub(super) have_light: bool,
}

/// Radians of the panels of directions in which a point in the air looks at what lights give to walls.
pub(super) const PANEL: f64 = 0.02;

/// Prepares the walks of all goals, and of what a room needs besides; hands on their job, and (v, Φ) of each goal.
pub(super) fn with_job<'a, F: Real>(
    model: &RoomModel,
    room: &Room<'a, F>,
    lengths: &'a [f64],
    neighbour: &Boxed<'_, F>,
    solutions: &Solutions<'_, 'a, F>,
    request: &Request<'_>,
    then: &mut WithJob<'_>,
) -> Result<(), Error> {
    let mut goals = Vec::new();
    let mut galerkins = Vec::new();
    let regions = model.regions(request.goals, request.only_u);
    for region in &regions {
        let start = model.start(room, lengths, region)?;
        let known = model.known(room, &start, region)?;
        let (galerkin, is_exact) = match &start {
            Start::Point(At(x)) => (neighbour.value(&neighbour.locate(*x)).to_f64(), true),
            Start::Mean(mean) if solutions.have_light => {
                let walls = model.walls(region)?.into_iter().flatten();
                let reflected = model.direct()?.reflected(walls);
                ((solutions.mean)(mean) + reflected, true)
            }
            Start::Mean(mean) => ((solutions.mean)(mean), true),
            Start::Air(seen) if solutions.have_light => {
                let mut light = 0.0;
                seen.points(PANEL, |x, weight| {
                    light += weight * room.reflected_light(&x).to_f64();
                });
                ((solutions.air)(seen) + light, false)
            }
            Start::Air(seen) => ((solutions.air)(seen), true),
            Start::Light(_) | Start::LightMean(_) => (f64::NAN, false),
        };
        galerkins.push(known + galerkin);
        goals.push(fredholm_core::Goal {
            functional: Shifted {
                functional: start,
                known,
            },
            control_mean: is_exact.then_some(galerkin),
        });
    }
    // Where irradiance does not follow from u it takes walks of its own.
    for region in &regions {
        if model.takes_walks(region, request.only_u) {
            let (functional, control_mean) = match model.start(room, lengths, region)? {
                Start::Point(at) => {
                    let mean = (!solutions.have_light).then(|| (solutions.irradiance)(&at.0));
                    (Start::Light(Irradiance { room, of: at }), mean)
                }
                Start::Mean(mean) => (Start::LightMean(Irradiance { room, of: mean }), None),
                other => (other, None),
            };
            let known = model.known(room, &functional, region)?;
            goals.push(fredholm_core::Goal {
                functional: Shifted { functional, known },
                control_mean,
            });
        }
    }
    galerkins.truncate(request.goals.len());
    let options = request.walk.for_core();
    then(&Goals::new(room, neighbour, &goals, options), &galerkins)
}

impl RoomModel {
    /// Where the walks of a goal start.
    pub(super) fn start<'r, 'a, F: Real>(
        &self,
        room: &'r Room<'a, F>,
        lengths: &'a [f64],
        region: &Region,
    ) -> Result<Start<'r, 'a, F>, Error> {
        Ok(match region {
            Region::On(surface, t) => {
                let (wall, fraction) = self.scene.along(*surface, *t)?;
                Start::Point(At(room.point(wall, fraction)?))
            }
            Region::Point(x) => Start::Air(seen(room, x)),
            region => Start::Mean(Means::new(room, lengths, self.walls(region)?)?),
        })
    }
}

/// What a point in the air sees.
pub(super) fn seen<'r, 'a, F: Real>(room: &'r Room<'a, F>, x: &[f64]) -> Seen<'r, 'a, F> {
    Seen {
        room,
        position: [0, 1].map(|k| F::from_f64(x.get(k).copied().unwrap_or(f64::NAN))),
    }
}

/// Walks that start with this density, φ = 1.
pub(super) const fn in_view(density: f64) -> Density {
    Density {
        functional: density,
        square: density,
        initial: density,
        fluctuation: 0.0,
        known: 0.0,
    }
}

/// Where the walks of a goal start.
pub(super) enum Start<'r, 'a, F> {
    Point(At<Point<F>>),
    Mean(Means<'r, 'a, F>),
    Air(Seen<'r, 'a, F>),
    Light(Irradiance<'r, 'a, F, At<Point<F>>>),
    LightMean(Irradiance<'r, 'a, F, Means<'r, 'a, F>>),
}

impl<'a, F: Real> Functional<Room<'a, F>> for Start<'_, 'a, F> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Point<F>, F) {
        match self {
            Self::Point(At(x)) => (*x, F::one()),
            Self::Mean(mean) => mean.start(uniforms),
            Self::Air(seen) => seen.start(uniforms),
            Self::Light(light) => light.start(uniforms),
            Self::LightMean(light) => light.start(uniforms),
        }
    }
}
