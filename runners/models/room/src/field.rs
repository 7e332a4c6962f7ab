//! What points between the walls of a room see, and the radiosity of stretches of wall: the numbers of a picture.

use std::time::Instant;

use fredholm_core::{
    At, Batch, DefaultGenerator, Functional, Length, Neighbour, NoNeighbour, Real, Shifted,
    Statistics, Task, WalkSeeds,
};
use fredholm_rayon::{Observer, fill_rows};
use fredholm_room::{Enclosure, Point, Room, STEFAN_BOLTZMANN, Seen};

use super::RoomModel;
use super::light::light_at;
use super::system::RoomSystem;
use fredholm_model::{BLANK, Request, Spot};
use fredholm_model::{Discretisation, Error, Goal, Model as _, Region, WalkOptions, in_scalar};

/// A stretch of a wall, of which u in the middle is wanted.
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    /// The number of the wall.
    pub wall: usize,
    /// The middle of the stretch, as a share of the wall's length.
    pub middle: f64,
    /// The walks of the stretch, as a multiple of those of a position.
    pub weight: u64,
}

/// Which numbers of a picture are wanted, and how.
#[derive(Clone, Copy, Debug)]
pub struct FieldRequest<'a> {
    /// Positions between the walls.
    pub positions: &'a [[f64; 2]],
    /// Stretches of walls.
    pub stretches: &'a [Stretch],
    /// How walks are made: `walks` of them for a position.
    pub walk: &'a WalkOptions,
    /// The goals for which pairs are chosen, if they come from the theory.
    pub goals: &'a [Goal],
    /// Whether plain walks that take as long are wanted, too.
    pub beside_plain: bool,
}

/// The numbers of a picture.
#[derive(Clone, Debug)]
pub struct Field {
    /// (1/2π) ∫ u dω at every position.
    pub air: Vec<Spot>,
    /// u in the middle of every stretch.
    pub walls: Vec<Spot>,
    /// Walks for a position.
    pub walks: u64,
    /// Seconds that it took, set-up included.
    pub seconds: f64,
}

impl Field {
    /// The temperatures (u/σ)^¼ in kelvin of radiosities u in W/m²: in the air the mean radiant temperature, and of walls
    /// that of a black body with their radiosity. What is below 0, by noise, has 0.
    #[must_use]
    pub fn temperatures(&self) -> Self {
        let kelvin = |spot: &Spot| {
            // NaN stays NaN.
            let value = if spot.value < 0.0 {
                0.0
            } else {
                Real::sqrt(Real::sqrt(spot.value / STEFAN_BOLTZMANN))
            };
            // dT/du = T/4u.
            let error = spot.error * value / (4.0 * spot.value);
            Spot { value, error }
        };
        Self {
            air: self.air.iter().map(kelvin).collect(),
            walls: self.walls.iter().map(kelvin).collect(),
            ..*self
        }
    }
}

impl RoomModel {
    /// The place of a point of a wall, or of the air, in the drawing. `None`: the region is none.
    #[must_use]
    pub fn in_drawing(&self, region: &Region) -> Option<[f64; 2]> {
        let place = match region {
            Region::Point(x) => x.clone(),
            region => self.position(region)?,
        };
        place.try_into().ok()
    }

    /// Estimates the numbers of a picture and, if they are wanted, by plain walks that take as long. `walking` is called
    /// when walks begin.
    ///
    /// # Errors
    /// [`Error`]; [`Error::Cancelled`].
    pub fn field(
        &self,
        discretisation: &Discretisation,
        request: &FieldRequest<'_>,
        watch: &dyn Observer,
        walking: &dyn Fn(),
    ) -> Result<(Field, Option<Field>), Error> {
        let start = Instant::now();
        let system = self.cut(discretisation)?.system()?;
        in_scalar!(discretisation.scalar, F => system.field::<F>(request, (watch, walking), start))
    }
}

impl RoomSystem<'_> {
    fn field<F: Real>(
        &self,
        request: &FieldRequest<'_>,
        (watch, walking): (&dyn Observer, &dyn Fn()),
        start: Instant,
    ) -> Result<(Field, Option<Field>), Error> {
        let setup = self.set_up_for::<F>(&Request {
            goals: request.goals,
            walk: request.walk,
            only_u: true,
        })?;
        let room = setup.room()?;
        let closed = self.cut.model.scene.enclosure() == Enclosure::Closed;
        let mut fields = None;
        setup.with_neighbour(&room, &mut |neighbour, _| {
            walking();
            let walker = Walker {
                request,
                watch,
                room: &room,
                neighbour,
                has_light: setup.has_light(),
                score: |statistics| statistics.preconditioned().into(),
            };
            let field = walker.field(start, request.walk.walks, &|seen, _| {
                inside(seen, &setup.v, closed)
            })?;
            let plain = if request.beside_plain {
                Some(beside(request, watch, &room, &field)?)
            } else {
                None
            };
            fields = Some((field, plain));
            Ok(())
        })?;
        fields.ok_or(Error::Internal("no neighbour equation was made"))
    }
}

/// What v gives at a position, or `None` where there is no room.
fn inside<F: Real>(seen: &Seen<'_, '_, F>, v: &[F], closed: bool) -> Option<f64> {
    let [value, share] = seen.of(v);
    is_inside(share, closed, F::EPSILON.to_f64()).then_some(value)
}

/// Whether a point is in the room that sees walls in this share of all directions.
pub(super) fn is_inside(share: f64, closed: bool, epsilon: f64) -> bool {
    let smallest = epsilon.sqrt();
    // In a closed room a point sees walls all around, or only backs.
    if closed {
        (share - 1.0).abs() < smallest
    } else {
        share > smallest
    }
}

/// The numbers by plain walks that take as long.
fn beside<F: Real>(
    request: &FieldRequest<'_>,
    watch: &dyn Observer,
    room: &Room<'_, F>,
    field: &Field,
) -> Result<Field, Error> {
    let none = NoNeighbour::<Room<'_, F>>::new();
    let walker = Walker {
        request,
        watch,
        room,
        neighbour: &none,
        has_light: false,
        score: |statistics| statistics.plain().into(),
    };
    let inside = |_: &Seen<'_, '_, F>, position: usize| {
        let inside = field
            .air
            .get(position)
            .is_some_and(|spot| !spot.value.is_nan());
        inside.then_some(0.0)
    };
    let one = walker.field(Instant::now(), 1, &inside)?;
    let walks = (field.seconds / one.seconds).round().max(1.0) as u64;
    walker.field(Instant::now(), walks, &inside)
}

/// Walks of one kind.
struct Walker<'w, 'r, F, N: ?Sized> {
    request: &'w FieldRequest<'w>,
    watch: &'w dyn Observer,
    room: &'w Room<'r, F>,
    neighbour: &'w N,
    /// Whether the neighbour equation has what lights give to walls.
    has_light: bool,
    score: fn(&Statistics) -> Spot,
}

/// Positions whose estimates one thread makes in one go.
const ROW: usize = 64;

/// (v, Φ) of a position, or `None` where there is no room.
type Value<'a, 'r, F> = dyn Fn(&Seen<'_, 'r, F>, usize) -> Option<f64> + Sync + 'a;

impl<'r, F: Real, N> Walker<'_, 'r, F, N>
where
    N: Neighbour<Scalar = F, Point = Point<F>> + Sync + ?Sized,
{
    /// All estimates from so many walks for a position.
    fn field(&self, start: Instant, walks: u64, value: &Value<'_, 'r, F>) -> Result<Field, Error> {
        let (positions, stretches) = (self.request.positions, self.request.stretches);
        let mut air = vec![BLANK; positions.len()];
        fill(&mut air, &|number| {
            let Some(position) = positions.get(number) else {
                return Ok(BLANK);
            };
            let seen = Seen {
                room: self.room,
                position: position.map(F::from_f64),
            };
            match value(&seen, number) {
                Some(value) => {
                    let known = light_at(&seen);
                    // What lights give to the walls that are seen has no closed integral.
                    let value = (!self.has_light).then_some(value);
                    self.walk((seen, known), value, number, walks)
                }
                None => Ok(BLANK),
            }
        })?;
        let mut walls = vec![BLANK; stretches.len()];
        fill(&mut walls, &|number| {
            let Some(stretch) = stretches.get(number) else {
                return Ok(BLANK);
            };
            let at = At(self.room.point(stretch.wall, stretch.middle)?);
            let value = self.neighbour.value(&self.neighbour.locate(at.0)).to_f64();
            let seeds = positions.len() + number;
            let known = self.room.emission_of_light(stretch.wall).to_f64();
            self.walk((at, known), Some(value), seeds, walks * stretch.weight)
        })?;
        Ok(Field {
            air,
            walls,
            walks,
            seconds: start.elapsed().as_secs_f64(),
        })
    }

    /// A few walks from one start.
    fn walk<T: Functional<Room<'r, F>>>(
        &self,
        (functional, known): (T, f64),
        value: Option<f64>,
        number: usize,
        walks: u64,
    ) -> Result<Spot, Error> {
        if self.watch.cancelled() {
            return Err(Error::Cancelled);
        }
        let task = Task {
            equation: self.room,
            neighbour: self.neighbour,
            functional: &Shifted { functional, known },
            control_mean: value,
            estimator: self.request.walk.estimator,
            form: fredholm_core::Form::Product,
            seeds: WalkSeeds::<DefaultGenerator>::new(self.request.walk.seed, number as u64),
            length: Length::default(),
        };
        let mut batch = Batch::new(0, walks, walks);
        batch
            .run(&task, walks)
            .map_err(|error| Error::Picture(format!("pixel or piece {number}: {error}")))?;
        if batch.statistics().terminations().step_limit > 0 {
            let why = "a walk met the step limit, so that a picture would be biased: use a larger \
                       `absorption`";
            return Err(Error::Picture(why.to_owned()));
        }
        self.watch.walked(walks);
        Ok((self.score)(batch.statistics()))
    }
}

/// Estimates all spots on the threads of the pool.
fn fill(
    spots: &mut [Spot],
    spot: &(dyn Fn(usize) -> Result<Spot, Error> + Sync),
) -> Result<(), Error> {
    fill_rows(spots, ROW, |row, spots| {
        for (i, to) in spots.iter_mut().enumerate() {
            *to = spot(row * ROW + i)?;
        }
        Ok(())
    })
}
