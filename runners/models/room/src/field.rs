//! What points between the walls of a room see, and the radiosity of stretches of wall: the numbers of a picture.

use web_time::Instant;

use fredholm_core::{At, Equation as _, Goal, LastStep, Real, Value as _};
use fredholm_model::{
    Beside, Discretisation, Error, Model as _, Region, Spot, SpotWalks, WalkOptions, WriteSpot,
    channels, in_channels, in_scalar, spots,
};
use fredholm_rayon::Observer;
use fredholm_room::{Enclosure, Room, STEFAN_BOLTZMANN, Seen, Tint, Wide};

use crate::RoomModel;
use crate::starts::Start;
use crate::system::{Follow, plain};

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
    /// What is wanted beside it.
    pub beside: Beside,
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
        let system = self.cut(discretisation)?.system()?;
        let lights = self.lights(request.walk.last_step);
        in_scalar!(discretisation.scalar, F => {
            let tables = system.cut.tables::<F>();
            in_channels!(tables.tables.room().with_lights(lights)?, &tables.colours, equation => {
                let vectors = system.vectors(equation, request.walk)?;
                let follow = &vectors.follow(equation)?;
                walking();
                let walker = Walker { request, watch, model: self, equation, follow, beside: None };
                let field = walker.field(start, request.walk.walks)?;
                let follow = &plain(equation);
                let plain = Walker { follow, beside: Some(&field), ..walker };
                let one = || Ok(plain.field(Instant::now(), 1)?.seconds);
                let walks = request.beside.walks(field.seconds, one)?;
                let beside = walks.map(|walks| plain.field(Instant::now(), walks)).transpose()?;
                Ok((field, beside))
            })
        })
    }
}

/// Whether a point is in the room that sees walls in this share of all directions.
pub(crate) fn is_inside(share: f64, closed: bool, epsilon: f64) -> bool {
    let smallest = epsilon.sqrt();
    // In a closed room a point sees walls all around, or only backs.
    if closed {
        (share - 1.0).abs() < smallest
    } else {
        share > smallest
    }
}

/// Walks of one kind.
struct Walker<'w, 'a, F: Real, C: Tint<F>> {
    request: &'w FieldRequest<'w>,
    watch: &'w dyn Observer,
    model: &'w RoomModel,
    equation: &'w Room<'a, F, C>,
    follow: &'w Follow<'w, F, C::Value>,
    /// The picture beside which plain walks make theirs.
    beside: Option<&'w Field>,
}

impl<F: Real, C: Tint<F>> Walker<'_, '_, F, C> {
    /// All estimates from so many walks for a position.
    fn field(&self, start: Instant, walks: u64) -> Result<Field, Error> {
        let (positions, stretches) = (self.request.positions, self.request.stretches);
        let (air, of_air) = self.spots(positions.len(), &|number, to| {
            let seen = Seen {
                room: self.equation,
                position: self.model.folded(positions[number]).map(F::from_f64),
            };
            if !self.is_inside(number, &seen) {
                return Ok(());
            }
            let start = Start::Air(seen);
            let at = Region::Point(positions[number].to_vec());
            self.walk(number, walks, &at, start, to)
        })?;
        let (walls, of_walls) = self.spots(stretches.len(), &|number, to| {
            let stretch = stretches[number];
            let point = self.equation.on_wall(stretch.wall, stretch.middle)?;
            let seeds = positions.len() + number;
            let walks = walks * stretch.weight;
            self.walk(seeds, walks, &Region::Whole, Start::Point(At(point)), to)
        })?;
        Ok(Field {
            air,
            walls,
            channels: [of_air, of_walls],
            walks,
            seconds: start.elapsed().as_secs_f64(),
        })
    }

    /// Whether a position is in the room.
    fn is_inside(&self, number: usize, seen: &Seen<'_, '_, F, C>) -> bool {
        if let Some(field) = self.beside {
            return field
                .air
                .get(number)
                .is_some_and(|spot| !spot.value.is_nan());
        }
        let mut share = 0.0;
        seen.cells(|_, angle| share += angle.to_f64() / core::f64::consts::TAU);
        let closed = self.model.scene.enclosure() == Enclosure::Closed;
        is_inside(share, closed, F::EPSILON.to_f64())
    }

    /// The last mean of so many spots, and all others.
    fn spots(
        &self,
        count: usize,
        write: &WriteSpot<'_>,
    ) -> Result<(Vec<Spot>, Vec<Vec<Spot>>), Error> {
        let colours = self.model.colours();
        let means = colours.map_or(1, |colours| colours.names.shared().len());
        spots(count, means, write)
    }

    /// A few walks from one start.
    fn walk(
        &self,
        number: usize,
        walks: u64,
        region: &Region,
        start: Start<'_, '_, F, C>,
        to: &mut [Spot],
    ) -> Result<(), Error> {
        let (mean, is_exact) = self.mean(&start, region)?;
        let goal = Goal {
            known: self.model.known(self.equation, &start, region)?,
            control_mean: is_exact.then_some(mean),
            functional: start,
        };
        let walker = SpotWalks {
            equation: &LastStep(self.equation),
            neighbour: &*self.follow.neighbour,
            walk: self.request.walk,
            weights: self.model.weights(),
            is_plain: self.follow.v.is_none(),
            watch: self.watch,
        };
        walker.walk(&goal, number as u64, walks, to)?;
        self.watch.walked(walks);
        Ok(())
    }

    /// (v, Φ) of a start if it is exact: in the air of a room with lights every walk looks for itself, which a sum over panels of
    /// directions for every pixel would take longer than.
    fn mean(
        &self,
        start: &Start<'_, '_, F, C>,
        region: &Region,
    ) -> Result<(Wide<F, C>, bool), Error> {
        if matches!(start, Start::Air(_)) && self.follow.has_light {
            let nothing = Wide::<F, C>::splat(self.equation.channels(), 0.0);
            return Ok((nothing, false));
        }
        self.model
            .mean_of_v(self.equation, start, region, self.follow)
    }
}
