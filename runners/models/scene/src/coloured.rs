//! A solved scene in several channels, and its walks.

use std::sync::Arc;

use fredholm_core::channels::{ChannelFunctional, ChannelGoal, ChannelGoals, NothingKnown};
use fredholm_core::{NoNeighbour, Real, Uniforms};
use fredholm_embedded::TableBuilder;
use fredholm_model::channels::refuse_device_tables;
use fredholm_model::{
    Error, Examined, Pairs, Prepared, Request, System, Then, WalkOptions, in_scalar,
};
use fredholm_scene::{Air, Coloured, Point};

use crate::channels::{Boxed, FaceTables, PerFace, Solved, with_neighbours};
use crate::partition::{Cut, NO_PAIRS, ScenePartition, WalkTables, no_prediction};
use crate::radius::{check_plain_variance, radius};
use crate::regions::{On, Place};
use crate::{Colours, SceneModel};

/// v and c of a scene in every channel.
pub(crate) struct ColouredSystem<'m> {
    pub(crate) model: &'m SceneModel,
    pub(crate) colours: &'m Colours,
    pub(crate) cut: Arc<Cut>,
    pub(crate) per_face: PerFace,
    pub(crate) solved: Solved,
    radius_bound: f64,
}

impl<'m> ScenePartition<'m> {
    pub(crate) fn coloured_system(
        &self,
        colours: &'m Colours,
        absorption: f64,
    ) -> Result<ColouredSystem<'m>, Error> {
        let per_face = colours.per_face(self.model.scene());
        Ok(ColouredSystem {
            model: self.model,
            colours,
            cut: Arc::clone(&self.cut),
            solved: self.solve_channels(&per_face, absorption)?,
            per_face,
            radius_bound: radius(self.model.scene())?,
        })
    }

    pub(crate) fn plain_colours<F: Real>(
        &self,
        colours: &Colours,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error> {
        let tables = WalkTables::<F>::new(self.model.scene(), &self.cut)?;
        let radiosity = tables.radiosity(&self.cut, request.walk.absorption)?;
        let faces = FaceTables::new(&colours.per_face(self.model.scene()));
        let coloured = faces.of(radiosity)?;
        let none = NoNeighbour::<Coloured<'_, F>>::new();
        let zeros = vec![0.0; request.goals.len()];
        let means = |_: &Place| Ok(Some(vec![0.0; colours.channels()]));
        let walks = ColouredWalks {
            model: self.model,
            colours,
            coloured: &coloured,
            neighbours: &none,
        };
        walks.with_job(request, &means, &mut |job, _| {
            then(&Prepared::plain(job, &zeros))
        })
    }
}

/// Where walks start in all channels: on faces, or at what a point between them sees.
#[derive(Clone, Copy)]
enum Start<'a, F> {
    On(On<'a, F>),
    Air(Air<'a, F>),
}

impl<'c, F: Real> ChannelFunctional<Coloured<'c, F>> for Start<'_, F> {
    #[inline]
    fn start<U: Uniforms<F>>(
        &self,
        coloured: &Coloured<'c, F>,
        uniforms: &mut U,
        known: &mut [F],
    ) -> (Point<F>, F) {
        match self {
            Self::On(on) => NothingKnown(*on).start(coloured, uniforms, known),
            Self::Air(air) => {
                let (start, phi) = air.draw(uniforms);
                coloured.known(&start.point, known);
                (start.point, phi)
            }
        }
    }
}

/// Walks of all channels.
struct ColouredWalks<'a, F> {
    model: &'a SceneModel,
    colours: &'a Colours,
    coloured: &'a Coloured<'a, F>,
    neighbours: &'a Boxed<'a, F>,
}

/// (v_c, Φ) of a place in every channel, if they are known.
type Means<'a> = dyn Fn(&Place) -> Result<Option<Vec<f64>>, Error> + 'a;

/// A function that is called with a job and what is known of every place.
type WithJob<'a> = dyn FnMut(&dyn fredholm_core::Job, &[Vec<f64>]) -> Result<(), Error> + 'a;

impl<F: Real> ColouredWalks<'_, F> {
    /// Prepares the walks of all goals, of which those of one place follow each other.
    fn with_job(
        &self,
        request: &Request<'_>,
        means: &Means<'_>,
        then: &mut WithJob<'_>,
    ) -> Result<(), Error> {
        let targets = self.colours.names().targets(request.goals)?;
        let radiosity = self.coloured.radiosity();
        let places = targets
            .map(|goal| Place::new(self.model.scene(), &goal.region))
            .collect::<Result<Vec<Place>, Error>>()?;
        let ends = places
            .iter()
            .map(|place| place.areas(radiosity))
            .collect::<Result<Vec<Vec<F>>, Error>>()?;
        let known: Vec<Vec<f64>> = places.iter().map(|place| self.known(place)).collect();
        let means = places
            .iter()
            .map(means)
            .collect::<Result<Vec<_>, Error>>()?;
        let mut goals = Vec::with_capacity(places.len());
        for (((place, ends), known), means) in places.iter().zip(&ends).zip(&known).zip(&means) {
            let of_start = match place {
                Place::Air(position) => Start::Air(Air {
                    radiosity,
                    position: position.map(F::from_f64),
                }),
                place => Start::On(place.on(radiosity, ends)?),
            };
            goals.push(ChannelGoal {
                functional: of_start,
                control_means: means.as_deref(),
                // Of a point in the air every walk knows its own.
                known,
            });
        }
        let job = ChannelGoals {
            equations: self.coloured,
            neighbours: self.neighbours,
            goals: &goals,
            weights: self.colours.weights(),
            options: request.walk.for_core(),
        };
        then(&job, &known)
    }

    /// (F_c, Φ) of lights, to which the last step leads, in every channel; of a point in the air every walk knows its own.
    fn known(&self, place: &Place) -> Vec<f64> {
        let channels = self.colours.channels();
        let radiosity = self.coloured.radiosity();
        let mut own = vec![F::from_f64(0.0); channels];
        let mut of_face = |face: u32| -> Vec<f64> {
            // It is the same on all of a face.
            let position = [F::NAN; 3];
            self.coloured.known(&Point { face, position }, &mut own);
            own.iter().map(|x| x.to_f64()).collect()
        };
        match place {
            Place::Point(face, _) => of_face(*face),
            Place::Air(_) | Place::Facing(..) => vec![0.0; channels],
            Place::Faces(numbers) => {
                let (mut sums, mut areas) = (vec![0.0; channels], 0.0);
                for &number in numbers {
                    let face = radiosity.geometry().faces().get(number as usize);
                    let area = face.map_or(f64::NAN, |face| face.area.to_f64());
                    for (sum, own) in sums.iter_mut().zip(of_face(number)) {
                        *sum += area * own;
                    }
                    areas += area;
                }
                sums.iter().map(|sum| sum / areas).collect()
            }
        }
    }
}

impl ColouredSystem<'_> {
    fn job_in<F: Real>(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let tables = WalkTables::<F>::new(self.model.scene(), &self.cut)?;
        let radiosity = tables.radiosity(&self.cut, request.walk.absorption)?;
        let faces = FaceTables::new(&self.per_face);
        let coloured = faces.of(radiosity)?;
        let channels = self.colours.channels();
        let v = self.solved.v::<F>();
        let wide = self.cut.radiosity(request.walk.absorption)?;
        let of_channels = self.solved.tables::<F>(self.cut.degree)?;
        let to = (&coloured, self.colours.weights());
        with_neighbours(self.cut.degree, &of_channels, to, &mut |neighbours| {
            let walks = ColouredWalks {
                model: self.model,
                colours: self.colours,
                coloured: &coloured,
                neighbours,
            };
            let values = |point: Point<F>| -> Vec<f64> {
                let mut own = vec![F::from_f64(0.0); channels];
                neighbours.values(&neighbours.locate(point), &mut own);
                own.iter().map(|v| v.to_f64()).collect()
            };
            let means = |place: &Place| {
                Ok(match *place {
                    Place::Point(face, position) => Some(values(radiosity.at(face, position)?)),
                    Place::Faces(ref faces) => {
                        let own = v.iter().map(|v| crate::system::mean(&wide, faces, v));
                        Some(own.collect())
                    }
                    Place::Air(_) | Place::Facing(..) => None,
                })
            };
            walks.with_job(request, &means, &mut |job, known| {
                let galerkin = self.galerkin(&walks, request, &means, known)?;
                then(&Prepared {
                    job,
                    galerkin: &galerkin,
                    largest: v
                        .iter()
                        .map(|v| fredholm_model::numbers::largest(v))
                        .fold(0.0, f64::max),
                    radius_bound: self.radius_bound,
                    convergence: self.solved.convergence,
                    pointwise: NO_PAIRS,
                    neighbour_second_moment_radius: None,
                    pair_counts: None,
                })
            })
        })
    }

    /// (v_c, Φ) of every goal: of a point in the air that of rays in many directions.
    fn galerkin<F: Real>(
        &self,
        walks: &ColouredWalks<'_, F>,
        request: &Request<'_>,
        means: &Means<'_>,
        known: &[Vec<f64>],
    ) -> Result<Vec<f64>, Error> {
        let names = self.colours.names();
        let mut all = Vec::with_capacity(request.goals.len());
        for (goal, known) in names.targets(request.goals)?.zip(known) {
            let place = Place::new(self.model.scene(), &goal.region)?;
            let own: Vec<f64> = match (means(&place)?, &place) {
                (Some(means), _) => means
                    .iter()
                    .zip(known)
                    .map(|(v, known)| v + known)
                    .collect(),
                (None, Place::Air(position)) => walks.seen_of(*position),
                (None, _) => vec![f64::NAN; names.channels()],
            };
            all.extend(names.with_sum(own));
        }
        Ok(all)
    }
}

impl<F: Real> ColouredWalks<'_, F> {
    /// (v_c, Φ) of a point in the air, about: what rays in many directions meet.
    fn seen_of(&self, position: [f64; 3]) -> Vec<f64> {
        let air = Air {
            radiosity: self.coloured.radiosity(),
            position: position.map(F::from_f64),
        };
        let channels = self.colours.channels();
        let mut sums = vec![0.0; channels];
        let mut own = vec![F::from_f64(0.0); channels];
        crate::system::look_around(&air, &mut |point, phi| {
            self.neighbours
                .values(&self.neighbours.locate(point), &mut own);
            for (sum, v) in sums.iter_mut().zip(&own) {
                *sum += phi * v.to_f64();
            }
            self.coloured.known(&point, &mut own);
            for (sum, known) in sums.iter_mut().zip(&own) {
                *sum += phi * known.to_f64();
            }
        });
        sums
    }
}

impl System for ColouredSystem<'_> {
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        check_plain_variance(self.model.scene(), walk.absorption)
    }

    fn job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        in_scalar!(self.cut.scalar, F => self.job_in::<F>(request, then))
    }

    fn examine(
        &self,
        _: &Request<'_>,
        _: usize,
        _: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        Err(no_prediction())
    }

    fn tables(&self, _: Pairs, _: f64) -> Result<TableBuilder, Error> {
        refuse_device_tables()
    }
}
