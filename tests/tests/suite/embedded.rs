//! The runner for devices: the bits of the others, saved states, tables.

use core::sync::atomic::{AtomicBool, Ordering};
use std::fs;

use fredholm_circle::{BorrowedTables, Cell, CircleError, OwnedTables, Slot, Tables as _};
use fredholm_core::{
    Absorption, At, Chain, Equation, Estimator, Form, Functional, Goal, Goals, NeighbourOf,
    NoNeighbour, Real, RunOptions, RunOptionsError, Space, Statistics, StopReason, Tolerance,
    Uniforms, WalkOptions,
};
use fredholm_embedded::{
    Driver, DriverError, State, StateError, TableBuilder, TableError, Tables, zerocopy::IntoBytes,
};
use fredholm_tests::device::{With, lines};
use fredholm_tests::toy::{Coloured, Toy};
use fredholm_tests::{check, device_tables};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand::rngs::ChaCha8Rng;

/// The tables in the repository are those that a workstation makes: `FREDHOLM_WRITE=1` writes them.
#[test]
fn the_firmwares_tables_are_those_of_a_workstation() {
    let folder = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../runners/embedded/firmware/tables"
    );
    let tables = [
        ("circle_f32.bin", device_tables::circle::<f32>()),
        ("scene_f32.bin", device_tables::scene::<f32>()),
    ];
    for (name, tables) in tables {
        let path = format!("{folder}/{name}");
        if std::env::var_os("FREDHOLM_WRITE").is_some() {
            fs::write(&path, tables.to_bytes()).unwrap();
        }
        assert!(fs::read(&path).unwrap() == tables.to_bytes(), "{name}");
    }
}

#[test]
fn the_firmwares_cases_have_the_same_bits_from_every_runner() {
    let embedded = lines(With::Embedded(u64::MAX));
    // Five of problem, start and scalar, by three ends of walks.
    assert_eq!(embedded.lines().count(), 15);
    assert!(embedded.lines().any(|line| line.contains("walks 2048 ")));
    assert!(embedded.lines().any(|line| line.contains("walks 1000 ")));
    for with in [
        With::Embedded(1),
        With::Embedded(77),
        With::Resets(1),
        With::Rayon(1),
        With::Rayon(3),
    ] {
        assert_eq!(embedded, lines(with), "{with:?}");
    }
}

/// Walks of the toy from one point.
struct Walks<F: Real> {
    toy: Toy<F>,
    none: NoNeighbour<Toy<F>>,
    goals: [Goal<At<F>, f64>; 1],
    options: WalkOptions,
}

impl<F: Real> Walks<F> {
    fn new() -> Self {
        let toy = Toy::new(8);
        Self {
            none: NoNeighbour::new(&toy),
            toy,
            goals: [Goal::new(At(F::from_f64(0.3)), Some(0.0))],
            options: WalkOptions {
                seed: 5,
                ..WalkOptions::default()
            },
        }
    }

    fn job(&self) -> Goals<'_, Toy<F>, NoNeighbour<Toy<F>>, At<F>> {
        Goals::new(&self.toy, &self.none, &self.goals, self.options)
    }
}

fn run_options(tolerance: Option<Tolerance>) -> RunOptions {
    RunOptions {
        walks: 5000,
        batch: 100,
        tolerance,
    }
}

/// Any generator of `rand_core` serves, and is part of what the bits depend on.
#[test]
fn another_generator_has_the_same_bits_from_either_runner() {
    let walks = Walks::<f64>::new();
    let job = walks.job().with_generator::<ChaCha8Rng>();
    let outcome = fredholm_rayon::run(&job, &RunOptions::new(1000), None, &()).unwrap();
    let mut chacha = Driver::<_, 1>::new(&job, 0, RunOptions::new(1000)).unwrap();
    chacha.poll(&job, u64::MAX).unwrap();
    assert_eq!(chacha.statistics(), outcome.statistics[..]);
    assert_ne!(outcome.statistics, check::run(&walks.job(), 1000));
}

/// Power fails at all of `cuts`: bytes are saved, everything else is lost.
fn interrupted<E, N, T, const S: usize>(
    job: &Goals<'_, E, N, T>,
    run_options: RunOptions,
    cuts: &[u64],
) -> ([Statistics; S], Option<StopReason>)
where
    E: Equation + Sync,
    N: NeighbourOf<E> + Sync,
    T: Functional<E> + Sync,
{
    let mut driver = Driver::<_, S>::new(job, 0, run_options).unwrap();
    for &walks in cuts {
        driver.poll(job, walks).unwrap();
        let mut bytes = vec![0; State::<S>::BYTES];
        driver.save(job).write(&mut bytes).unwrap();
        let state = State::read(&bytes).unwrap();
        driver = Driver::restore(job, 0, run_options, &state).unwrap();
    }
    driver.poll(job, u64::MAX).unwrap();
    (driver.statistics(), driver.stop())
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 16,
        rng_seed: RngSeed::Fixed(1),
        ..Default::default()
    })]

    /// With power cuts anywhere, in both scalars, in one channel and in three with their sum.
    #[test]
    fn interrupted_runs_end_with_the_same_bits(
        cuts in prop::collection::vec(0_u64..1500, 0..6),
        tolerance in prop::sample::select(vec![None, Some(0.02), Some(1e-9)]),
    ) {
        let run_options = run_options(tolerance.map(Tolerance::Absolute));
        let (wide, narrow) = (Walks::<f64>::new(), Walks::<f32>::new());
        let (wide, narrow) = (wide.job(), narrow.job());
        let whole = interrupted::<_, _, _, 1>(&wide, run_options, &[]);
        prop_assert_eq!(interrupted(&wide, run_options, &cuts), whole);
        let whole = interrupted::<_, _, _, 1>(&narrow, run_options, &[]);
        prop_assert_eq!(interrupted(&narrow, run_options, &cuts), whole);

        let coloured = Coloured::<f64>::coloured(8);
        let none = NoNeighbour::new(&coloured);
        let nothing = fredholm_core::Value::splat(3, 0.0);
        let goals = [Goal { functional: At(0.3), control_mean: None, known: nothing }];
        let job: Goals<'_, _, _, _> = Goals::new(&coloured, &none, &goals, WalkOptions::default());
        let job = job.with_sum(&[1.0, 2.0, 3.0]);
        let whole = interrupted::<_, _, _, 4>(&job, run_options, &[]);
        prop_assert_eq!(interrupted(&job, run_options, &cuts), whole);
        let rayon = fredholm_rayon::run(&job, &run_options, None, &()).unwrap();
        prop_assert_eq!((&whole.0[..], whole.1), (&rayon.statistics[..], Some(rayon.stop)));
    }
}

#[test]
fn a_run_ends_as_the_options_say() {
    let walks = Walks::<f64>::new();
    let run = |run_options| interrupted::<_, _, _, 1>(&walks.job(), run_options, &[]);
    let ([all], stop) = run(run_options(None));
    assert_eq!((all.walks(), stop), (5000, Some(StopReason::Done)));
    // The standard deviation of a walk is 0.95: 2256 walks, and the stage that ends at 3200.
    let ([some], stop) = run(run_options(Some(Tolerance::Absolute(0.02))));
    assert_eq!(stop, Some(StopReason::Done));
    assert!(some.walks() == 3200 && some.preconditioned().std_error.unwrap() <= 0.02);
    let ([none], stop) = run(run_options(Some(Tolerance::Absolute(1e-9))));
    assert_eq!((none, stop), (all, Some(StopReason::ToleranceNotReached)));
}

#[test]
fn polls_are_bounded_and_tell_where_the_run_stands() {
    let walks = Walks::<f64>::new();
    let job = walks.job();
    let mut driver = Driver::<_, 1>::new(&job, 0, run_options(None)).unwrap();
    assert_eq!(driver.poll(&job, 0).unwrap().walks, 0);
    let mut walks = 0;
    while walks < 5000 {
        let progress = driver.poll(&job, 70).unwrap();
        walks = (walks + 70).min(5000);
        let [statistics] = driver.statistics();
        assert_eq!(progress.walks, walks);
        assert_eq!(progress.estimate, statistics.preconditioned());
        assert_eq!(progress.stop, (walks == 5000).then_some(StopReason::Done));
    }
    assert_eq!(driver.poll(&job, 70).unwrap().walks, 5000);
}

#[test]
fn impossible_runs_are_refused() {
    let walks = Walks::<f64>::new();
    let job = walks.job();
    let refused = |first, run_options: RunOptions| {
        let state = some_state();
        let error = Driver::<_, 1>::new(&job, first, run_options).unwrap_err();
        let restored = Driver::<_, 1>::restore(&job, first, run_options, &state).unwrap_err();
        assert_eq!(restored, StateError::Driver(error));
        error
    };
    let none = DriverError::Options(RunOptionsError::NoWalks);
    assert_eq!(refused(0, RunOptions::new(0)), none);
    let no_batch = RunOptions {
        batch: 0,
        ..RunOptions::new(10)
    };
    assert_eq!(refused(0, no_batch), none);
    for bound in [0.0, -1.0, f64::NAN] {
        let options = run_options(Some(Tolerance::Relative(bound)));
        let error = DriverError::Options(RunOptionsError::Tolerance);
        assert_eq!(refused(0, options), error);
    }
    assert_eq!(refused(1, run_options(None)), DriverError::Goal);
    let two = Driver::<_, 2>::new(&job, 0, run_options(None));
    assert_eq!(two.unwrap_err(), DriverError::Goal);
}

/// A state after 250 of 5000 walks.
fn some_state() -> State {
    let walks = Walks::<f64>::new();
    let job = walks.job();
    let mut driver = Driver::new(&job, 0, run_options(None)).unwrap();
    driver.poll(&job, 250).unwrap();
    driver.save(&job)
}

fn bytes_of(state: &State) -> Vec<u8> {
    let mut bytes = vec![0; State::<1>::BYTES];
    state.write(&mut bytes).unwrap();
    bytes
}

#[test]
fn a_damaged_state_is_refused() {
    let bytes = bytes_of(&some_state());
    assert_eq!(State::read(&bytes), Ok(some_state()));
    let expected = bytes.len();
    for found in 0..expected {
        let error = StateError::Length { expected, found };
        assert_eq!(State::<1>::read(&bytes[..found]), Err(error));
        assert_eq!(some_state().write(&mut vec![0; found]), Err(error));
    }
    // Every bit counts.
    for bit in 0..8 * bytes.len() {
        let mut spoilt = bytes.clone();
        spoilt[bit / 8] ^= 1 << (bit % 8);
        let expected = match bit / 8 {
            0..4 => StateError::Foreign,
            4..6 => StateError::Version {
                found: u16::from_le_bytes([spoilt[4], spoilt[5]]),
            },
            _ => StateError::Checksum,
        };
        assert_eq!(State::<1>::read(&spoilt), Err(expected), "bit {bit}");
    }
}

#[test]
fn a_state_of_something_else_is_refused() {
    let state = some_state();
    let restored = |walks: &Walks<f64>, run_options| {
        Driver::<_, 1>::restore(&walks.job(), 0, run_options, &state).err()
    };
    assert_eq!(restored(&Walks::new(), run_options(None)), None);

    let changes: [fn(&mut WalkOptions); 5] = [
        |options| options.seed += 1,
        |options| options.step_limit -= 1,
        |options| options.forced_steps += 1,
        |options| options.form = Form::Product,
        |options| {
            options.absorption = Absorption::Constant {
                probability: 0.2,
                estimator: Estimator::Collision,
            };
        },
    ];
    for change in changes {
        let mut other = Walks::new();
        change(&mut other.options);
        let refused = restored(&other, run_options(None));
        assert_eq!(refused, Some(StateError::OtherOptions));
    }
    let changes: [fn(&mut RunOptions); 3] = [
        |options| options.walks += 1,
        |options| options.batch += 1,
        |options| options.tolerance = Some(Tolerance::Absolute(1.0)),
    ];
    for change in changes {
        let mut other = run_options(None);
        change(&mut other);
        let refused = restored(&Walks::new(), other);
        assert_eq!(refused, Some(StateError::OtherOptions));
    }

    let changes: [fn(&mut Walks<f64>); 4] = [
        |walks| walks.goals[0].control_mean = None,
        |walks| walks.goals[0].known = 0.1,
        |walks| walks.goals[0].functional = At(0.31),
        |walks| walks.toy = Toy::new(8).constant(),
    ];
    for change in changes {
        let mut other = Walks::new();
        change(&mut other);
        let refused = restored(&other, run_options(None));
        assert_eq!(refused, Some(StateError::OtherWalks));
    }
    // Another scalar, another generator.
    let (narrow, wide) = (Walks::<f32>::new(), Walks::<f64>::new());
    let refused = Driver::<_, 1>::restore(&narrow.job(), 0, run_options(None), &state).err();
    assert_eq!(refused, Some(StateError::OtherWalks));
    let chacha = wide.job().with_generator::<ChaCha8Rng>();
    let refused = Driver::<_, 1>::restore(&chacha, 0, run_options(None), &state).err();
    assert_eq!(refused, Some(StateError::OtherWalks));
}

/// What is written with a right checksum may contradict itself: it must not panic.
#[test]
fn a_contradictory_state_is_refused() {
    const STAGE_END: usize = 16;
    const MERGED: usize = 28;
    const BATCH: usize = MERGED + Statistics::BYTES;
    let bytes = bytes_of(&some_state());
    let none = Statistics::default().to_bytes();
    let word = |word: u64| word.to_le_bytes().to_vec();
    // A stage that has ended, with nothing begun and no reason to stop, and other numbers that cannot be.
    let edits: [&[(usize, Vec<u8>)]; 8] = [
        &[(STAGE_END, word(2)), (BATCH, none.to_vec())],
        &[(STAGE_END, word(1))],
        &[(STAGE_END, word(2))],
        &[(STAGE_END, word(51))],
        &[(MERGED, word(250))],
        &[(MERGED + 16, word(300))],
        &[(BATCH, word(100))],
        &[(BATCH, word(u64::MAX))],
    ];
    let walks = Walks::<f64>::new();
    for (number, edit) in edits.into_iter().enumerate() {
        let mut edited = bytes.clone();
        for (from, word) in edit {
            edited[*from..from + word.len()].copy_from_slice(word);
        }
        // The checksum is found as that of all other bytes.
        let crc = crc(&[&edited[..24], &edited[28..]].concat());
        edited[24..28].copy_from_slice(&crc.to_le_bytes());
        let restored = State::<1>::read(&edited).and_then(|state| {
            Driver::restore(&walks.job(), 0, run_options(None), &state).map(|_| ())
        });
        assert_eq!(restored, Err(StateError::Contradiction), "{number}");
    }
}

/// CRC-32 of ISO 3309, by its definition.
fn crc(bytes: &[u8]) -> u32 {
    let bits = |sum: u32| {
        (0..8).fold(sum, |sum, _| {
            (sum >> 1) ^ (0xedb8_8320 & (sum & 1).wrapping_neg())
        })
    };
    !bytes
        .iter()
        .fold(u32::MAX, |sum, &byte| bits(sum ^ u32::from(byte)))
}

/// A walk that is not finite is an error that can be met again, and leaves the state as it was.
#[test]
fn a_score_that_is_not_finite_names_its_walk() {
    struct Bad(AtomicBool);
    impl Space for Bad {
        type Scalar = f64;
        type Point = f64;
    }
    impl Chain for Bad {
        fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
            Some(uniforms.uniform())
        }
    }
    impl Equation for Bad {
        type Value = f64;
        fn kernel(&self, _: &f64, y: &f64) -> f64 {
            let is_bad = *y > 0.99 && self.0.load(Ordering::Relaxed);
            if is_bad { f64::NAN } else { 0.5 }
        }
        fn source<U: Uniforms<f64>>(&self, _: &f64, _: &mut U) -> f64 {
            1.0
        }
    }
    let bad = Bad(AtomicBool::new(true));
    let (none, goals) = (NoNeighbour::new(&bad), [Goal::new(At(0.5), Some(0.0))]);
    let job: Goals<'_, _, _, _> = Goals::new(&bad, &none, &goals, WalkOptions::default());
    let mut driver = Driver::<_, 1>::new(&job, 0, run_options(None)).unwrap();
    let error = driver.poll(&job, 5000).unwrap_err();
    assert!(error.walk > 0);
    assert_eq!(driver.statistics()[0].walks(), error.walk);
    assert_eq!(driver.poll(&job, 1), Err(error));
    let mut again = Driver::restore(&job, 0, run_options(None), &driver.save(&job)).unwrap();
    assert_eq!(again.poll(&job, 1), Err(error));
    bad.0.store(false, Ordering::Relaxed);
    assert_eq!(again.poll(&job, 1).unwrap().walks, error.walk + 1);
}

/// The bytes at a multiple of 8.
fn aligned(bytes: &[u8]) -> Vec<u64> {
    let words = bytes.chunks(8).map(|chunk| {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        u64::from_ne_bytes(word)
    });
    words.collect()
}

fn read(bytes: &[u8]) -> Result<(), TableError> {
    let words = aligned(bytes);
    let place = words.as_bytes();
    Tables::read(&place[..bytes.len()], "circle").map(|_| ())
}

fn small_table() -> TableBuilder {
    let mut builder = TableBuilder::new("circle");
    builder.numbers("v", &[1.0_f32, -2.5, 3.0]);
    builder.numbers("light", &[0.2_f64]);
    builder.numbers("eightlet", &[7_u32, 8]);
    builder
}

#[test]
fn a_table_is_read_as_it_was_written() {
    let words = aligned(&small_table().to_bytes());
    let table = Tables::read(words.as_bytes(), "circle").unwrap();
    assert_eq!(table.get::<f32>("v"), Ok(&[1.0, -2.5, 3.0][..]));
    assert_eq!(table.one::<f64>("light"), Ok(&0.2));
    assert_eq!(table.get::<u32>("eightlet"), Ok(&[7, 8][..]));
    let missing = TableError::Missing { name: "w" };
    assert_eq!(table.get::<f32>("w"), Err(missing));
    let element = TableError::Element {
        name: "v",
        found: 4,
    };
    assert_eq!(table.get::<f64>("v"), Err(element));
    assert_eq!(
        table.one::<f32>("v"),
        Err(TableError::Elements { name: "v" })
    );
}

#[test]
fn a_damaged_or_foreign_table_is_refused() {
    let bytes = small_table().to_bytes();
    assert_eq!(read(&bytes), Ok(()));
    for length in 0..bytes.len() {
        let error = read(&bytes[..length]).unwrap_err();
        let expected = match length {
            0..4 => TableError::Foreign,
            4..24 => TableError::Length {
                expected: 24,
                found: length,
            },
            _ => TableError::Length {
                expected: bytes.len(),
                found: length,
            },
        };
        assert_eq!(error, expected, "{length} bytes");
    }
    for bit in 0..8 * bytes.len() {
        let mut spoilt = bytes.clone();
        spoilt[bit / 8] ^= 1 << (bit % 8);
        let error = read(&spoilt).unwrap_err();
        match bit / 8 {
            0..4 => assert_eq!(error, TableError::Foreign),
            4..6 => assert!(matches!(error, TableError::Version { .. })),
            8..12 => assert!(matches!(error, TableError::Length { .. })),
            _ => assert_eq!(error, TableError::Checksum, "bit {bit}"),
        }
    }
    assert_eq!(
        read(&TableBuilder::new("cube").to_bytes()),
        Err(TableError::Kind)
    );
    // A right checksum over arrays that cannot be: an element of 0 bytes.
    let mut nothing = TableBuilder::new("circle");
    nothing.records("v", &[()], |(), _| ());
    assert_eq!(
        read(&nothing.to_bytes()),
        Err(TableError::Directory { array: 0 })
    );
    // Whatever lies at odd places.
    let mut words = aligned(&[&[0; 4], &bytes[..]].concat());
    words.push(0);
    let place = words.as_bytes();
    assert_eq!(
        Tables::read(&place[4..4 + bytes.len()], "circle").err(),
        Some(TableError::Alignment)
    );
}

#[test]
fn tables_of_no_circle_are_refused() {
    let own = OwnedTables::<f64>::new(&[0.3, 0.7], 10).unwrap();
    let (cells, slots, constants) = (own.cells(), own.slots(), own.constants());
    let refused = |cells: &[Cell<f64>], slots: &[Slot<f64>]| {
        BorrowedTables::new(cells, slots, constants).err()
    };
    assert_eq!(refused(cells, slots), None);
    let length = CircleError::Length {
        expected: 20,
        found: 19,
    };
    assert_eq!(refused(cells, &slots[1..]), Some(length));
    assert_eq!(refused(&[], &[]), Some(CircleError::Cells));
    let mut white = cells.to_vec();
    for rho in [1.0, -0.1, f64::NAN] {
        white[3].reflectance = rho;
        let error = CircleError::Reflectance { arc: 3 };
        assert_eq!(refused(&white, slots), Some(error));
    }
    // Behind the last cell: at once, or by the one that `locate` adds.
    for (end, cell) in [(0.5, 10), (0.5, 9), (f64::NAN, 2)] {
        let mut astray = slots.to_vec();
        (astray[7].end, astray[7].cell) = (end, cell);
        let error = CircleError::Slot { slot: 7 };
        assert_eq!(refused(cells, &astray), Some(error));
    }
}

#[test]
fn the_readmes_program_is_the_one_that_is_built() {
    let readme = include_str!("../../../runners/embedded/README.md");
    assert!(readme.contains(include_str!(
        "../../../runners/embedded/firmware/src/bin/minimal.rs"
    )));
}
