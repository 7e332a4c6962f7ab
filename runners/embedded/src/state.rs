//! A run's state, saved and restored.

use core::fmt;

use fredholm_core::{
    Absorption, Batch, Equation, Estimator, Form, Functional, Generators, Goals, Job, NeighbourOf,
    Real, RunOptions, Schedule, Statistics, Termination, Tolerance, Value, WalkOptions, WideOf,
};

use crate::checksum::Checksum;
use crate::driver::{Driver, DriverError, Position};

/// Walks whose scores tell jobs apart.
const WITNESSES: u64 = 4;

/// The state that a run has to keep through a reset: restored and continued, it ends with the same
/// bits. The layout of [`write`](Self::write) is in the crate's documentation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<const S: usize = 1> {
    /// The options of walks and of the run, hashed.
    options: u32,
    /// Scalar, (v, Φ), and the scores of the first walks: equation, neighbour equation, goal and generator.
    walks: u32,
    stage_end: u64,
    merged: [Statistics; S],
    batches: [Statistics; S],
}

/// Why a state is not one to go on from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StateError {
    /// There are not as many bytes as a state has, or it says so itself.
    Length {
        /// The bytes that a state has.
        expected: usize,
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
    /// The state was saved with another number of walks, batch size, tolerance, seed, absorption, form or step limit.
    OtherOptions,
    /// The state was saved with another equation, neighbour equation, goal, (v, Φ), scalar or generator.
    OtherWalks,
    /// The numbers of walks and batches contradict each other or the options, or nobody can have run
    /// so many.
    Contradiction,
    /// There is no such run.
    Driver(DriverError),
}

impl fmt::Display for StateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { expected, found } => {
                write!(f, "a saved state has {expected} bytes, not {found}")
            }
            Self::Foreign => f.write_str("this is no saved state: its first bytes are others"),
            Self::Version { found } => {
                write!(f, "a saved state of version {VERSION} is needed, not {found}")
            }
            Self::Checksum => f.write_str("the saved state is damaged: its checksum is wrong"),
            Self::OtherOptions => f.write_str(
                "the state was saved with another number of walks, batch size, tolerance, seed, absorption, form or \
                 step limit: restore it with those, or begin anew",
            ),
            Self::OtherWalks => f.write_str(
                "the state was saved with another equation, neighbour equation, goal, scalar or generator: restore it \
                 with those, or begin anew",
            ),
            Self::Contradiction => {
                f.write_str("the saved state's numbers of walks and batches cannot be")
            }
            Self::Driver(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for StateError {}

const MAGIC: [u8; 4] = *b"FHST";
const VERSION: u16 = 2;
/// Bytes before the checksum.
const HEAD: usize = 24;

impl<const S: usize> State<S> {
    /// The number of bytes of a state.
    pub const BYTES: usize = HEAD + 4 + 2 * S * Statistics::BYTES;

    /// Writes the state as bytes, with version and checksum.
    ///
    /// # Errors
    /// [`StateError::Length`]: there are not [`BYTES`](Self::BYTES) of them.
    pub fn write(&self, bytes: &mut [u8]) -> Result<(), StateError> {
        let (head, stored, rest) = parts_mut::<S>(bytes)?;
        let [m0, m1, m2, m3] = MAGIC;
        let [v0, v1] = VERSION.to_le_bytes();
        let [b0, b1] = (Self::BYTES as u16).to_le_bytes();
        let words = [self.options, self.walks].map(u32::to_le_bytes);
        let begin = [m0, m1, m2, m3, v0, v1, b0, b1];
        let words = words.as_flattened().iter().copied();
        let fields = begin.into_iter().chain(words);
        let fields = fields.chain(self.stage_end.to_le_bytes());
        for (to, from) in head.iter_mut().zip(fields) {
            *to = from;
        }
        let statistics = self.merged.iter().chain(&self.batches);
        for (to, from) in rest.chunks_exact_mut(Statistics::BYTES).zip(statistics) {
            for (to, from) in to.iter_mut().zip(from.to_bytes()) {
                *to = from;
            }
        }
        *stored = checksum(head, rest).to_le_bytes();
        Ok(())
    }

    /// Reads the bytes that [`write`](Self::write) wrote.
    ///
    /// # Errors
    /// [`StateError::Length`], [`StateError::Foreign`], [`StateError::Version`],
    /// [`StateError::Checksum`], [`StateError::Contradiction`].
    pub fn read(bytes: &[u8]) -> Result<Self, StateError> {
        let length = |found| StateError::Length {
            expected: Self::BYTES,
            found,
        };
        let whole = length(bytes.len());
        if bytes.len() != Self::BYTES {
            return Err(whole);
        }
        let (head, rest) = bytes.split_first_chunk::<HEAD>().ok_or(whole)?;
        let (stored, rest) = rest.split_first_chunk::<4>().ok_or(whole)?;
        let [m0, m1, m2, m3, v0, v1, b0, b1, words @ ..] = *head;
        if [m0, m1, m2, m3] != MAGIC {
            return Err(StateError::Foreign);
        }
        let found = u16::from_le_bytes([v0, v1]);
        if found != VERSION {
            return Err(StateError::Version { found });
        }
        if checksum(head, rest) != u32::from_le_bytes(*stored) {
            return Err(StateError::Checksum);
        }
        let found = usize::from(u16::from_le_bytes([b0, b1]));
        if found != Self::BYTES {
            return Err(length(found));
        }
        let (words, _) = words.as_chunks::<4>();
        let mut words = words.iter().map(|bytes| u32::from_le_bytes(*bytes));
        let mut next = || words.next().unwrap_or(0);
        let [options, walks, low, high] = core::array::from_fn(|_| next());
        let mut state = Self {
            options,
            walks,
            stage_end: u64::from(high) << 32 | u64::from(low),
            merged: [Statistics::default(); S],
            batches: [Statistics::default(); S],
        };
        let (chunks, _) = rest.as_chunks::<{ Statistics::BYTES }>();
        let statistics = state.merged.iter_mut().chain(&mut state.batches);
        for (to, from) in statistics.zip(chunks) {
            *to = Statistics::from_bytes(from).ok_or(StateError::Contradiction)?;
        }
        Ok(state)
    }

    /// The position with these options.
    fn position(&self, options: &RunOptions) -> Option<Position<S>> {
        let (all, part) = (self.merged.first()?, self.batches.first()?);
        // Goals that share their walks have as many of them.
        let is_equal = |of: &[Statistics; S], one: &Statistics| {
            of.iter().all(|other| other.walks() == one.walks())
        };
        let index = options.batches_of(all.walks());
        let whole = index.saturating_mul(options.batch).min(options.walks);
        let mut batches = [Batch::new(index, options.batch, options.walks); S];
        for (batch, part) in batches.iter_mut().zip(&self.batches) {
            *batch = Batch::resume(index, options.batch, options.walks, *part)?;
        }
        let position = Position {
            merged: self.merged,
            batches,
            schedule: Schedule::resume(*options, index..self.stage_end)?,
        };
        let ended = position.has_ended();
        let fits = all.walks() == whole
            && is_equal(&self.merged, all)
            && is_equal(&self.batches, part)
            // What has ended has a reason, and nothing behind its end.
            && (!ended || part.walks() == 0 && position.stop().is_some())
            // A batch that is done is merged.
            && (ended || !batches.first()?.is_done());
        fits.then_some(position)
    }
}

type Parts<'b> = (&'b mut [u8; HEAD], &'b mut [u8; 4], &'b mut [u8]);

/// What is before the checksum, the checksum, and what is behind it.
fn parts_mut<const S: usize>(bytes: &mut [u8]) -> Result<Parts<'_>, StateError> {
    let length = StateError::Length {
        expected: State::<S>::BYTES,
        found: bytes.len(),
    };
    if bytes.len() != State::<S>::BYTES {
        return Err(length);
    }
    let (head, rest) = bytes.split_first_chunk_mut().ok_or(length)?;
    let (stored, rest) = rest.split_first_chunk_mut().ok_or(length)?;
    Ok((head, stored, rest))
}

/// The checksum of all bytes but its own.
fn checksum(head: &[u8; HEAD], rest: &[u8]) -> u32 {
    Checksum::new().bytes(head).bytes(rest).finish()
}

impl<'g, E, N, T, G, const S: usize> Driver<Goals<'g, E, N, T, G>, S>
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Generators,
    Goals<'g, E, N, T, G>: Job,
{
    /// The state to keep through a reset. Runs the first four walks again, whose scores tell at
    /// [`restore`](Self::restore) whether everything is as it was.
    #[must_use]
    pub fn save(&self, job: &Goals<'g, E, N, T, G>) -> State<S> {
        let position = self.position();
        State {
            options: options_sum(position.schedule.options(), &job.options),
            walks: walks_sum(job, self.first() / S.max(1)),
            stage_end: position.schedule.stage().end,
            merged: position.merged,
            batches: position.batches.map(|batch| *batch.dense()),
        }
    }

    /// Goes on where a run with the same job, goals and options was saved.
    ///
    /// # Errors
    /// [`StateError::OtherOptions`], [`StateError::OtherWalks`], [`StateError::Contradiction`], [`StateError::Driver`].
    pub fn restore(
        job: &Goals<'g, E, N, T, G>,
        first: usize,
        options: RunOptions,
        state: &State<S>,
    ) -> Result<Self, StateError> {
        let impossible = |error| StateError::Driver(DriverError::Options(error));
        options.validate().map_err(impossible)?;
        Self::check(job, first).map_err(StateError::Driver)?;
        if state.options != options_sum(&options, &job.options) {
            return Err(StateError::OtherOptions);
        }
        if state.walks != walks_sum(job, first / S.max(1)) {
            return Err(StateError::OtherWalks);
        }
        let position = state.position(&options).ok_or(StateError::Contradiction)?;
        Ok(Self::at(first, position))
    }
}

fn options_sum(options: &RunOptions, walks: &WalkOptions) -> u32 {
    let (kind, bound) = match options.tolerance {
        None => (0, 0.0),
        Some(Tolerance::Absolute(bound)) => (1, bound),
        Some(Tolerance::Relative(bound)) => (2, bound),
        Some(Tolerance::FourthRoot(bound)) => (3, bound),
    };
    let (ends, probability) = match walks.absorption {
        Absorption::Roulette => (0, 0.0),
        Absorption::Constant {
            probability,
            estimator: Estimator::Absorption,
        } => (1, probability),
        Absorption::Constant { probability, .. } => (2, probability),
    };
    let form = match walks.form {
        Form::Product => 0,
        Form::Residual => 1,
    };
    Checksum::new()
        .word(options.walks)
        .word(options.batch)
        .word(kind)
        .word(bound.to_bits())
        .word(walks.seed)
        .word(ends)
        .word(probability.to_bits())
        .word(form)
        .word(u64::from(walks.step_limit))
        .word(u64::from(walks.forced_steps))
        .finish()
}

fn walks_sum<E, N, T, G>(job: &Goals<'_, E, N, T, G>, goal: usize) -> u32
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Generators,
{
    let mut sum = Checksum::new().word(E::Scalar::EPSILON.to_f64().to_bits());
    if let Some(goal) = job.goals.get(goal) {
        sum = of_value(
            sum.word(u64::from(goal.control_mean.is_some())),
            &goal.known,
        );
        sum = goal
            .control_mean
            .iter()
            .fold(sum, of_value::<WideOf<E>, f64>);
    }
    sum = job
        .weights
        .iter()
        .fold(sum, |sum, weight| sum.word(weight.to_bits()));
    for walk in (0..WITNESSES).filter_map(|walk| job.replay(goal, walk)) {
        // The sign of a NaN is the machine's.
        if walk.termination != Termination::NotFinite {
            sum = sum.word(u64::from(walk.states));
            sum = of_value(of_value(sum, &walk.plain), &walk.control);
        }
    }
    sum.finish()
}

/// The checksum with the numbers of all channels.
fn of_value<V: Value<F>, F: Real>(sum: Checksum, value: &V) -> Checksum {
    (0..value.channels()).fold(sum, |sum, c| sum.word(value.get(c).to_f64().to_bits()))
}
