//! The numbers of a picture: what every pixel sees, and the radiosity of every piece of wall.

use std::time::Instant;

use fredholm_core::galerkin::Rounded;
use fredholm_core::{
    At, Batch, DefaultGenerator, Equation, Estimator, Functional, Neighbour, NoNeighbour, Real,
    STEP_LIMIT, Statistics, Stream, Task,
};
use fredholm_plot::{Canvas, Piece};
use fredholm_rayon::{Observer, fill_rows};
use fredholm_room::{Enclosure, Point, Polynomials, Room, Scene, Seen};

use crate::failure::Failure;
use crate::progress::{Progress, begin_walking};
use crate::room::{Boxed, SetUp};

/// A value and its standard error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spot {
    /// NaN where there is no room.
    pub(crate) value: f64,
    /// NaN where it is not known.
    pub(crate) error: f64,
}

/// Nothing is there.
const BLANK: Spot = Spot {
    value: f64::NAN,
    error: f64::NAN,
};

/// What is to be estimated, and how.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted<'a> {
    pub(crate) scene: &'a Scene,
    /// `None`: walls only.
    pub(crate) canvas: Option<&'a Canvas>,
    pub(crate) pieces: &'a [Piece],
    pub(crate) walks: u64,
    pub(crate) seed: u64,
    pub(crate) estimator: Estimator,
    pub(crate) progress: &'a Progress,
}

/// The estimates.
#[derive(Debug)]
pub(crate) struct Field {
    /// (1/2π) ∫ u dω at every pixel, row by row.
    pub(crate) air: Vec<Spot>,
    /// u in the middle of every piece.
    pub(crate) walls: Vec<Spot>,
    /// Walks for a pixel.
    pub(crate) walks: u64,
    /// The time that it took, set-up included.
    pub(crate) seconds: f64,
}

impl Field {
    /// The root mean square of the pixels' standard errors.
    pub(crate) fn noise(&self) -> Option<f64> {
        root_mean_square(self.air.iter().map(|spot| spot.error))
    }
}

/// Of those that are numbers.
pub(crate) fn root_mean_square(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values
        .filter(|value| value.is_finite())
        .fold((0_u64, 0.0), |(n, sum), x| (n + 1, sum + x * x));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

/// Why there is no picture.
#[derive(Debug)]
pub(crate) enum Cut {
    /// Ctrl-C.
    Interrupted,
    /// Something failed.
    Failed(Failure),
}

impl From<Failure> for Cut {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

/// The preconditioned estimates and, if asked for, plain ones that take as long.
pub(crate) fn estimate<F: Real, const B: usize>(
    wanted: &Wanted<'_>,
    set_up: impl FnOnce() -> Result<SetUp<F, B>, Failure>,
    beside_plain: bool,
) -> Result<(Field, Option<Field>), Cut> {
    let start = Instant::now();
    let setup = set_up()?;
    let room = setup.room()?;
    let dense = setup.coefficients();
    let coefficients = Rounded::new(&dense);
    let polynomials = Polynomials::new(&room);
    let neighbour = setup.neighbour(&polynomials, &coefficients)?;
    let neighbour: &Boxed<'_, F> = &*neighbour;
    begin_walking();
    let closed = wanted.scene.enclosure() == Enclosure::Closed;
    let smallest = F::EPSILON.to_f64().sqrt();
    let walker = Walker {
        wanted,
        room: &room,
        neighbour,
        score: |statistics| statistics.preconditioned().into(),
    };
    let field = walker.field(start, wanted.walks, |seen, _| {
        let [value, share] = seen.of(&setup.v);
        // In a closed room a point sees walls all around, or only backs.
        let inside = if closed {
            (share - 1.0).abs() < smallest
        } else {
            share > smallest
        };
        inside.then_some(value)
    })?;
    if !beside_plain {
        return Ok((field, None));
    }
    let no_neighbour = NoNeighbour::<Room<'_, F>>::new();
    let walker = Walker {
        wanted,
        room: &room,
        neighbour: &no_neighbour,
        score: |statistics| statistics.plain().into(),
    };
    let inside = |_: &Seen<'_, '_, F>, pixel: usize| {
        let inside = field
            .air
            .get(pixel)
            .is_some_and(|spot| !spot.value.is_nan());
        inside.then_some(0.0)
    };
    let one = walker.field(Instant::now(), 1, inside)?;
    let walks = (field.seconds / one.seconds).round().max(1.0) as u64;
    let plain = walker.field(Instant::now(), walks, inside)?;
    Ok((field, Some(plain)))
}

impl From<fredholm_core::Estimate> for Spot {
    fn from(estimate: fredholm_core::Estimate) -> Self {
        Self {
            value: estimate.estimate,
            error: estimate.std_error.unwrap_or(f64::NAN),
        }
    }
}

/// Walks of one kind.
struct Walker<'w, 'r, F, N: ?Sized> {
    wanted: &'w Wanted<'w>,
    room: &'w Room<'r, F>,
    neighbour: &'w N,
    score: fn(&Statistics) -> Spot,
}

impl<'r, F: Real, N> Walker<'_, 'r, F, N>
where
    N: Neighbour<Scalar = F, Point = Point<F>> + Sync + ?Sized,
{
    /// All estimates from so many walks for a pixel. `value` gives (v, Φ) of a pixel, or `None`
    /// where there is no room.
    fn field(
        &self,
        start: Instant,
        walks: u64,
        value: impl Fn(&Seen<'_, 'r, F>, usize) -> Option<f64> + Sync,
    ) -> Result<Field, Cut> {
        let (canvas, pieces) = (self.wanted.canvas, self.wanted.pieces);
        let (width, height) = canvas.map_or((0, 0), |canvas| (canvas.width(), canvas.height()));
        let mut air = vec![BLANK; width * height];
        let pixel = |number: usize| {
            let Some(canvas) = canvas else {
                return Ok(BLANK);
            };
            let position = canvas.middle(number).map(F::from_f64);
            let seen = Seen {
                room: self.room,
                position,
            };
            match value(&seen, number) {
                Some(value) => self.walk(&seen, value, number, walks),
                None => Ok(BLANK),
            }
        };
        self.fill(&mut air, width, pixel)?;
        let mut walls = vec![BLANK; pieces.len()];
        let wall = |number: usize| {
            let Some(piece) = pieces.get(number) else {
                return Ok(BLANK);
            };
            let point = self.room.point(piece.wall, piece.middle());
            let at = At(point.map_err(Failure::run)?);
            let value = self.neighbour.value(&self.neighbour.locate(at.0)).to_f64();
            let stream = width * height + number;
            self.walk(&at, value, stream, walks * piece.pixels)
        };
        self.fill(&mut walls, 16, wall)?;
        Ok(Field {
            air,
            walls,
            walks,
            seconds: start.elapsed().as_secs_f64(),
        })
    }

    fn fill(
        &self,
        spots: &mut [Spot],
        width: usize,
        spot: impl Fn(usize) -> Result<Spot, Cut> + Sync,
    ) -> Result<(), Cut> {
        fill_rows(spots, width, |row, spots| {
            for (i, to) in spots.iter_mut().enumerate() {
                *to = spot(row * width + i)?;
            }
            Ok(())
        })
    }

    /// A few walks from one start.
    fn walk<T>(&self, functional: &T, value: f64, number: usize, walks: u64) -> Result<Spot, Cut>
    where
        T: Functional<Room<'r, F>>,
        Room<'r, F>: Equation<Scalar = F, Point = Point<F>>,
    {
        if self.wanted.progress.cancelled() {
            return Err(Cut::Interrupted);
        }
        let task = Task {
            equation: self.room,
            neighbour: self.neighbour,
            functional,
            neighbour_value: Some(value),
            estimator: self.wanted.estimator,
            stream: Stream::<DefaultGenerator>::new(self.wanted.seed, number as u64),
            step_limit: STEP_LIMIT,
        };
        let mut batch = Batch::new(0, walks, walks);
        batch
            .run(&task, walks)
            .map_err(|error| Failure::run(format_args!("pixel or piece {number}: {error}")))?;
        if batch.statistics().endings().step_limit > 0 {
            let why = "a walk met the step limit, so that a picture would be biased: use a larger \
                       `absorption`";
            return Err(Failure::run(why).into());
        }
        self.wanted.progress.walked(walks);
        Ok((self.score)(batch.statistics()))
    }
}
