//! What points between the walls of a room see, and the radiosity of stretches of wall: the numbers of a picture.

use std::time::Instant;

use fredholm_core::{At, Batch, NoNeighbour, NotFinite, Real};
use fredholm_model::channels;
use fredholm_model::{BLANK, Request, Spot};
use fredholm_model::{Discretisation, Error, Goal, Model as _, Region, WalkOptions, in_scalar};
use fredholm_rayon::{Observer, fill_rows};
use fredholm_room::{Enclosure, Room, STEFAN_BOLTZMANN, Seen};

use super::RoomModel;
use super::coloured::ColouredSystem;
use super::spots::{AllChannels, OneChannel, SpotWalks};
use super::system::RoomSystem;

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
    /// (1/2π) ∫ u dω at every position; of several channels that of their weighted sum.
    pub air: Vec<Spot>,
    /// u in the middle of every stretch, or that sum.
    pub walls: Vec<Spot>,
    /// Both in every channel, if there are several.
    pub channels: [Vec<Vec<Spot>>; 2],
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
            channels: [Vec::new(), Vec::new()],
            ..*self
        }
    }

    /// The value and the standard error of a position, in every channel and then for their sum if there are several; NaN where there
    /// is no room.
    #[must_use]
    pub fn numbers(&self, position: usize) -> Vec<f64> {
        channels::numbers(&self.channels[0], &self.air, position)
    }

    /// Red, green and blue of every position and of every stretch, if these are the channels of the room.
    #[must_use]
    pub fn colours(&self, room: &RoomModel) -> Option<[[Vec<f64>; 3]; 2]> {
        let [air, walls] = &self.channels;
        let of = |own| channels::colours(room.channels(), own);
        Some([of(air)?, of(walls)?])
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
        let cells = self.cut(discretisation)?;
        if let Some(colours) = self.colours() {
            let system = cells.coloured_system(colours)?;
            return in_scalar!(
                discretisation.scalar,
                F => system.field::<F>(request, (watch, walking), start)
            );
        }
        let system = cells.system()?;
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
            let walks = OneChannel {
                room: &room,
                neighbour,
                walk: request.walk,
                has_light: setup.has_light(),
                inside: &|seen, _| inside(seen, &setup.v, closed),
                is_plain: false,
            };
            let walker = Walker {
                request,
                watch,
                room: &room,
                walks: &walks,
            };
            let field = walker.field(start, request.walk.walks)?;
            let plain = beside(&walker, &field, &mut |inside, then| {
                let inside = &|_: &Seen<'_, '_, F>, number| inside(number).then_some(0.0);
                then(&OneChannel {
                    neighbour: &NoNeighbour::<Room<'_, F>>::new(),
                    has_light: false,
                    inside,
                    is_plain: true,
                    ..walks
                })
            })?;
            fields = Some((field, plain));
            Ok(())
        })?;
        fields.ok_or(Error::Internal("no neighbour equation was made"))
    }
}

impl ColouredSystem<'_> {
    fn field<F: Real>(
        &self,
        request: &FieldRequest<'_>,
        (watch, walking): (&dyn Observer, &dyn Fn()),
        start: Instant,
    ) -> Result<(Field, Option<Field>), Error> {
        let closed = self.cut.model.scene.enclosure() == Enclosure::Closed;
        let mut fields = None;
        self.with_walks::<F>(request.walk, &mut |walks, plain| {
            walking();
            let v = walks.v.unwrap_or_default();
            let all = AllChannels {
                walks,
                walk: request.walk,
                inside: &|seen, _| v.iter().map(|v| inside(seen, v, closed)).collect(),
            };
            let walker = Walker {
                request,
                watch,
                room: walks.coloured.room(),
                walks: &all,
            };
            let field = walker.field(start, request.walk.walks)?;
            let zeros = vec![0.0; v.len()];
            let beside = beside(&walker, &field, &mut |inside, then| {
                then(&AllChannels {
                    walks: plain,
                    walk: request.walk,
                    inside: &|_, number| inside(number).then(|| zeros.clone()),
                })
            })?;
            fields = Some((field, beside));
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

/// A function that writes all means of a spot by its number.
type WriteSpot<'a> = dyn Fn(usize, &mut [Spot]) -> Result<(), Error> + Sync + 'a;

/// Hands on plain walks of the positions for which a function holds.
type WithPlain<'a, 'r, F> = dyn FnMut(
        &(dyn Fn(usize) -> bool + Sync),
        &mut dyn FnMut(&dyn SpotWalks<'r, F>) -> Result<(), Error>,
    ) -> Result<(), Error>
    + 'a;

/// The numbers by plain walks that take as long, if they are wanted.
fn beside<'r, F: Real>(
    walker: &Walker<'_, 'r, F>,
    field: &Field,
    with_plain: &mut WithPlain<'_, 'r, F>,
) -> Result<Option<Field>, Error> {
    if !walker.request.beside_plain {
        return Ok(None);
    }
    let is_inside = |position: usize| {
        let spot = field.air.get(position);
        spot.is_some_and(|spot| !spot.value.is_nan())
    };
    let mut plain = None;
    with_plain(&is_inside, &mut |walks| {
        let walker = Walker { walks, ..*walker };
        let one = walker.field(Instant::now(), 1)?;
        let walks = (field.seconds / one.seconds).round().max(1.0) as u64;
        plain = Some(walker.field(Instant::now(), walks)?);
        Ok(())
    })?;
    Ok(plain)
}

/// Walks of one kind.
struct Walker<'w, 'r, F> {
    request: &'w FieldRequest<'w>,
    watch: &'w dyn Observer,
    room: &'w Room<'r, F>,
    walks: &'w dyn SpotWalks<'r, F>,
}

/// Positions whose estimates one thread makes in one go.
const ROW: usize = 64;

impl<'r, F: Real> Walker<'_, 'r, F> {
    /// All estimates from so many walks for a position.
    fn field(&self, start: Instant, walks: u64) -> Result<Field, Error> {
        let (positions, stretches) = (self.request.positions, self.request.stretches);
        let (air, of_air) = self.spots(positions.len(), &|number, to| {
            let seen = Seen {
                room: self.room,
                position: positions[number].map(F::from_f64),
            };
            match self.walks.inside(&seen, number) {
                Some(values) => self.walk(number, walks, to, &|batches| {
                    self.walks.run_air((seen, &values), number as u64, batches)
                }),
                None => Ok(()),
            }
        })?;
        let (walls, of_walls) = self.spots(stretches.len(), &|number, to| {
            let stretch = stretches[number];
            let at = At(self.room.point(stretch.wall, stretch.middle)?);
            let seeds = positions.len() + number;
            self.walk(seeds, walks * stretch.weight, to, &|batches| {
                self.walks.run_wall(at, seeds as u64, batches)
            })
        })?;
        Ok(Field {
            air,
            walls,
            channels: [of_air, of_walls],
            walks,
            seconds: start.elapsed().as_secs_f64(),
        })
    }

    /// The last mean of so many spots, and all others; blank where nothing is written.
    fn spots(
        &self,
        count: usize,
        write: &WriteSpot<'_>,
    ) -> Result<(Vec<Spot>, Vec<Vec<Spot>>), Error> {
        let means = self.walks.means();
        let mut spots = vec![BLANK; count * means];
        fill_rows(&mut spots, ROW * means, |row, spots| {
            for (i, to) in spots.chunks_mut(means).enumerate() {
                write(row * ROW + i, to)?;
            }
            Ok::<(), Error>(())
        })?;
        let of = |mean: usize| spots.iter().skip(mean).step_by(means).copied().collect();
        // The sum of several channels comes last.
        Ok((of(means - 1), (0..means - 1).map(of).collect()))
    }

    /// A few walks from one start.
    fn walk(
        &self,
        number: usize,
        walks: u64,
        to: &mut [Spot],
        run: &dyn Fn(&mut [Batch]) -> Result<(), NotFinite>,
    ) -> Result<(), Error> {
        if self.watch.cancelled() {
            return Err(Error::Cancelled);
        }
        let mut batches = vec![Batch::new(0, walks, walks); to.len()];
        run(&mut batches)
            .map_err(|error| Error::Picture(format!("pixel or piece {number}: {error}")))?;
        for (batch, to) in batches.iter().zip(to) {
            let statistics = batch.statistics();
            if statistics.terminations().step_limit > 0 {
                let why = "a walk met the step limit, so that a picture would be biased: use a larger \
                           `absorption`";
                return Err(Error::Picture(why.to_owned()));
            }
            *to = match self.walks.is_plain() {
                true => statistics.plain().into(),
                false => statistics.preconditioned().into(),
            };
        }
        self.watch.walked(walks);
        Ok(())
    }
}
