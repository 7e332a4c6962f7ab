//! A run's state, saved and restored.

use core::fmt;

use fredholm_core::rand_core::{Rng, SeedableRng};
use fredholm_core::{
    Batch, Equation, Estimator, Form, Functional, NeighbourOf, Real, RunOptions, RunOptionsError,
    Schedule, Statistics, Task, Termination, Tolerance,
};

use crate::checksum::Checksum;
use crate::driver::{Driver, Position};

/// Walks whose scores tell equations apart.
const WITNESSES: u64 = 4;

/// The state that a run has to keep through a reset: restored and continued, it ends with the same
/// bits. The layout of [`to_bytes`](Self::to_bytes) is in the crate's documentation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct State {
    /// Walks, batch size, tolerance, estimator, form and step limit, hashed.
    options: u32,
    /// The first draws: seed, goal number and generator.
    draws: u32,
    /// Scalar, (v, Φ), and the scores of the first walks: equation, neighbour equation and start.
    equation: u32,
    stage_end: u64,
    merged: Statistics,
    batch: Statistics,
}

/// Why a state is not one to go on from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StateError {
    /// There are not as many bytes as a state has, or it says so itself.
    Length {
        /// The bytes that were there, or that it says.
        found: usize,
    },
    /// The bytes do not begin as a state does.
    Foreign,
    /// The state was written by another version of this crate.
    Version {
        /// The version that wrote the state.
        found: u16,
    },
    /// The checksum is wrong: a byte was lost or changed.
    Checksum,
    /// The state was saved with other walks, batch size, tolerance, estimator, form or step limit.
    OtherOptions,
    /// The state was saved with another seed, goal number or generator.
    OtherDraws,
    /// The state was saved with another equation, neighbour equation, start, (v, Φ) or scalar.
    OtherEquation,
    /// The numbers of walks and batches contradict each other or the options, or nobody can have run
    /// so many.
    Contradiction,
    /// The options are impossible.
    Options(RunOptionsError),
}

impl fmt::Display for StateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { found } => {
                write!(f, "a saved state has {} bytes, not {found}", State::BYTES)
            }
            Self::Foreign => f.write_str("this is no saved state: its first bytes are others"),
            Self::Version { found } => {
                let here = State::VERSION;
                write!(f, "a saved state of version {here} is needed, not {found}")
            }
            Self::Checksum => f.write_str("the saved state is damaged: its checksum is wrong"),
            Self::OtherOptions => f.write_str(
                "the state was saved with other walks, batch size, tolerance, estimator, form or step \
                 limit: restore it with those, or begin anew",
            ),
            Self::OtherDraws => f.write_str(
                "the state was saved with another seed, goal number or generator: restore it with \
                 those, or begin anew",
            ),
            Self::OtherEquation => f.write_str(
                "the state was saved with another equation, neighbour equation, start or scalar: \
                 restore it with those, or begin anew",
            ),
            Self::Contradiction => {
                f.write_str("the saved state's numbers of walks and batches cannot be")
            }
            Self::Options(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for StateError {}

impl State {
    /// The length of [`to_bytes`](Self::to_bytes).
    pub const BYTES: usize = 32 + 2 * Statistics::BYTES;
    const MAGIC: [u8; 4] = *b"FHST";
    const VERSION: u16 = 1;

    /// The state as bytes, with version and checksum.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut head = [0; 28];
        let [m0, m1, m2, m3] = Self::MAGIC;
        let [v0, v1] = Self::VERSION.to_le_bytes();
        let [b0, b1] = (Self::BYTES as u16).to_le_bytes();
        let words = [self.options, self.draws, self.equation].map(u32::to_le_bytes);
        let begin = [m0, m1, m2, m3, v0, v1, b0, b1];
        let words = words.as_flattened().iter().copied();
        let fields = begin.into_iter().chain(words);
        let fields = fields.chain(self.stage_end.to_le_bytes());
        for (to, from) in head.iter_mut().zip(fields) {
            *to = from;
        }
        let (merged, batch) = (self.merged.to_bytes(), self.batch.to_bytes());
        let checksum = checksum(&head, &merged, &batch).to_le_bytes();
        let mut bytes = [0; Self::BYTES];
        let parts = [&head[..], &checksum, &merged, &batch];
        for (to, from) in bytes.iter_mut().zip(parts.into_iter().flatten()) {
            *to = *from;
        }
        bytes
    }

    /// Reads the bytes that [`to_bytes`](Self::to_bytes) gave.
    ///
    /// # Errors
    /// [`StateError::Length`], [`StateError::Foreign`], [`StateError::Version`],
    /// [`StateError::Checksum`], [`StateError::Contradiction`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, StateError> {
        let length = || StateError::Length { found: bytes.len() };
        let whole: &[u8; Self::BYTES] = bytes.try_into().map_err(|_| length())?;
        let (head, rest) = whole.split_first_chunk::<28>().ok_or_else(length)?;
        let (stored, rest) = rest.split_first_chunk::<4>().ok_or_else(length)?;
        let (merged, rest) = rest.split_first_chunk().ok_or_else(length)?;
        let batch = rest.first_chunk().ok_or_else(length)?;
        let [m0, m1, m2, m3, v0, v1, b0, b1, words @ ..] = *head;
        if [m0, m1, m2, m3] != Self::MAGIC {
            return Err(StateError::Foreign);
        }
        let found = u16::from_le_bytes([v0, v1]);
        if found != Self::VERSION {
            return Err(StateError::Version { found });
        }
        if checksum(head, merged, batch) != u32::from_le_bytes(*stored) {
            return Err(StateError::Checksum);
        }
        let found = usize::from(u16::from_le_bytes([b0, b1]));
        if found != Self::BYTES {
            return Err(StateError::Length { found });
        }
        let (words, _) = words.as_chunks::<4>();
        let mut words = words.iter().map(|bytes| u32::from_le_bytes(*bytes));
        let mut next = || words.next().unwrap_or(0);
        let [options, draws, equation, low, high] = core::array::from_fn(|_| next());
        let statistics = |bytes| Statistics::from_bytes(bytes).ok_or(StateError::Contradiction);
        Ok(Self {
            options,
            draws,
            equation,
            stage_end: u64::from(high) << 32 | u64::from(low),
            merged: statistics(merged)?,
            batch: statistics(batch)?,
        })
    }

    /// The position in this options.
    fn position(&self, options: &RunOptions) -> Option<Position> {
        // What serde read has passed no check.
        let merged = Statistics::from_bytes(&self.merged.to_bytes())?;
        let part = Statistics::from_bytes(&self.batch.to_bytes())?;
        let index = options.batches_of(merged.walks());
        let whole = index.saturating_mul(options.batch).min(options.walks);
        let batch = Batch::resume(index, options.batch, options.walks, part)?;
        let schedule = Schedule::resume(*options, index..self.stage_end)?;
        let ended = schedule.stage().is_empty();
        let fits = merged.walks() == whole
            // What has ended has a reason, and nothing behind its end.
            && (!ended || part.walks() == 0 && schedule.stop(&merged).is_some())
            // A batch that is done has been merged.
            && (ended || !batch.is_done());
        fits.then_some(Position {
            merged,
            batch,
            schedule,
        })
    }
}

fn checksum(
    head: &[u8; 28],
    merged: &[u8; Statistics::BYTES],
    batch: &[u8; Statistics::BYTES],
) -> u32 {
    Checksum::new()
        .bytes(head)
        .bytes(merged)
        .bytes(batch)
        .finish()
}

impl<'a, E, N, T, G> Driver<'a, E, N, T, G>
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Rng + SeedableRng,
{
    /// The state to keep through a reset. Runs the first four walks again, whose scores tell at
    /// [`restore`](Self::restore) whether everything is as it was.
    #[must_use]
    pub fn save(&self) -> State {
        let position = self.position();
        State {
            options: options_sum(position.schedule.options(), self.task()),
            draws: draws_of(self.task()),
            equation: equation_of(self.task()),
            stage_end: position.schedule.stage().end,
            merged: position.merged,
            batch: *position.batch.statistics(),
        }
    }

    /// Goes on where a run with the same task and options was saved.
    ///
    /// # Errors
    /// [`StateError::OtherOptions`], [`StateError::OtherDraws`], [`StateError::OtherEquation`],
    /// [`StateError::Contradiction`], [`StateError::Options`].
    pub fn restore(
        task: Task<'a, E, N, T, G>,
        options: RunOptions,
        state: &State,
    ) -> Result<Self, StateError> {
        options.validate().map_err(StateError::Options)?;
        if state.options != options_sum(&options, &task) {
            return Err(StateError::OtherOptions);
        }
        if state.draws != draws_of(&task) {
            return Err(StateError::OtherDraws);
        }
        if state.equation != equation_of(&task) {
            return Err(StateError::OtherEquation);
        }
        let position = state.position(&options).ok_or(StateError::Contradiction)?;
        Ok(Self::at(task, position))
    }
}

fn options_sum<E, N: ?Sized, T, G>(options: &RunOptions, task: &Task<'_, E, N, T, G>) -> u32 {
    let (kind, bound) = match options.tolerance {
        None => (0, 0.0),
        Some(Tolerance::Absolute(bound)) => (1, bound),
        Some(Tolerance::Relative(bound)) => (2, bound),
    };
    let scores = match (task.estimator, task.form) {
        (Estimator::Absorption, Form::Product) => 0,
        (Estimator::Collision, Form::Product) => 1,
        (Estimator::Absorption, Form::Residual) => 2,
        (Estimator::Collision, Form::Residual) => 3,
    };
    Checksum::new()
        .word(options.walks)
        .word(options.batch)
        .word(kind)
        .word(bound.to_bits())
        .word(scores)
        .word(u64::from(task.length.step_limit))
        .word(u64::from(task.length.survivals))
        .finish()
}

fn draws_of<E, N: ?Sized, T, G: Rng + SeedableRng>(task: &Task<'_, E, N, T, G>) -> u32 {
    (0..WITNESSES)
        .fold(Checksum::new(), |sum, walk| {
            sum.word(task.seeds.generator(walk).next_u64())
        })
        .finish()
}

fn equation_of<E, N, T, G>(task: &Task<'_, E, N, T, G>) -> u32
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Rng + SeedableRng,
{
    let value = task.control_mean.map_or(0, f64::to_bits);
    let start = Checksum::new()
        .word(E::Scalar::EPSILON.to_f64().to_bits())
        .word(u64::from(task.control_mean.is_some()))
        .word(value);
    (0..WITNESSES)
        .map(|walk| task.replay(walk))
        // The sign of a NaN is the machine's.
        .filter(|walk| walk.termination != Termination::NotFinite)
        .fold(start, |sum, walk| {
            sum.word(u64::from(walk.states))
                .word(walk.plain.to_f64().to_bits())
                .word(walk.control.to_f64().to_bits())
        })
        .finish()
}
