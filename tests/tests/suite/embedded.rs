//! The runner for devices: the bits of the others, saved states, tables.

use core::cell::Cell;

use fredholm_circle::{Cells, Circle, CircleError, Harmonic};
use fredholm_core::galerkin::DiagonalRule;
use fredholm_core::{
    At, DefaultGenerator, Estimator, Form, Goal, Goals, Length, Neighbour, NoNeighbour, Real,
    RunOptions, RunOptionsError, Sampler, Statistics, StopReason, Task, Tolerance, WalkOptions,
    WalkSeeds,
};
use fredholm_embedded::{
    Driver, State, StateError, Table, TableBuilder, TableError, zerocopy::IntoBytes,
};
use fredholm_tests::circle::{DEFAULT, LIGHT, OnCircle, RHO, with_piecewise};
use fredholm_tests::device::{With, lines};
use proptest::prelude::*;
use rand::rngs::ChaCha8Rng;

type Lit<'a, F> = Circle<'a, F, Harmonic>;
type Lights<'a, F> = OnCircle<'a, F, Harmonic, DiagonalRule>;
type OnDevice<'a, F> =
    Driver<'a, Lit<'a, F>, Lights<'a, F>, At<fredholm_circle::Point<F>>, DefaultGenerator>;

#[test]
fn the_firmwares_cases_have_the_same_bits_from_every_runner() {
    let embedded = lines(With::Embedded(u64::MAX));
    // Thirty-six of problem, degree, start and scalar; two estimators.
    assert_eq!(embedded.lines().count(), 72);
    for name in ["circle/", "cube/", "room ", "room/", "scene ", "scene/"] {
        assert!(embedded.lines().any(|line| line.starts_with(name)));
    }
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

/// Any generator of `rand_core` serves, and is part of what the bits depend on.
#[test]
fn another_generator_has_the_same_bits_from_either_runner() {
    scene::<f64, _>(|circle, neighbour, start| {
        let default = task(circle, neighbour, start, Estimator::Absorption);
        let goals = [Goal {
            functional: *start,
            control_mean: default.control_mean,
        }];
        let options = WalkOptions {
            seed: 5,
            ..WalkOptions::default()
        };
        let job = Goals::new(circle, neighbour, &goals, options).with_generator::<ChaCha8Rng>();
        let outcome = fredholm_rayon::run(&job, &RunOptions::new(1000), None, &()).unwrap();
        let mut chacha = Driver::new(
            Task {
                equation: circle,
                neighbour,
                functional: start,
                control_mean: default.control_mean,
                estimator: default.estimator,
                form: Form::Product,
                seeds: WalkSeeds::<ChaCha8Rng>::new(5, 0),
                length: default.length,
            },
            RunOptions::new(1000),
        )
        .unwrap();
        chacha.poll(u64::MAX).unwrap();
        assert_eq!(chacha.statistics(), outcome.statistics[0]);
    });
}

/// A task for u(0.3) on 20 cells.
fn task<'a, F: Real>(
    circle: &'a Lit<'a, F>,
    neighbour: &'a Lights<'a, F>,
    start: &'a At<fredholm_circle::Point<F>>,
    estimator: Estimator,
) -> Task<'a, Lit<'a, F>, Lights<'a, F>, At<fredholm_circle::Point<F>>, DefaultGenerator> {
    let v0 = neighbour.value(&neighbour.locate(start.0)).to_f64();
    Task {
        equation: circle,
        neighbour,
        functional: start,
        control_mean: Some(v0),
        estimator,
        form: Form::Product,
        seeds: WalkSeeds::new(5, 2),
        length: Length::default(),
    }
}

fn run_options(tolerance: Option<Tolerance>) -> RunOptions {
    RunOptions {
        walks: 5000,
        batch: 100,
        tolerance,
    }
}

/// Calls back with a circle of `F`, its neighbour equation and a start.
fn scene<F: Real, R>(
    then: impl FnOnce(&Lit<'_, F>, &Lights<'_, F>, &At<fredholm_circle::Point<F>>) -> R,
) -> R {
    with_piecewise::<F, _, _, _>(&RHO, 20, LIGHT, DEFAULT, |circle, neighbour, _| {
        then(circle, neighbour, &At(circle.point(0.3)))
    })
}

/// Power fails at all of `cuts`: bytes are saved, everything else is lost.
fn interrupted<F: Real>(
    estimator: Estimator,
    run_options: RunOptions,
    cuts: &[u64],
    through: impl Fn(State) -> State,
) -> (Statistics, Option<StopReason>) {
    scene::<F, _>(|circle, neighbour, start| {
        let fresh = || task(circle, neighbour, start, estimator);
        let mut driver = Driver::new(fresh(), run_options).unwrap();
        for &walks in cuts {
            driver.poll(walks).unwrap();
            let before = (driver.statistics(), driver.stop());
            let state = through(driver.save());
            driver = Driver::restore(fresh(), run_options, &state).unwrap();
            // Walks that were lost and run again would end with the same bits, too.
            assert_eq!((driver.statistics(), driver.stop()), before);
        }
        driver.poll(u64::MAX).unwrap();
        (driver.statistics(), driver.stop())
    })
}

fn through_bytes(state: State) -> State {
    let bytes = state.to_bytes();
    assert_eq!(bytes.len(), State::BYTES);
    State::from_bytes(&bytes).unwrap()
}

fn through_json(state: State) -> State {
    let text = serde_json::to_string(&state).unwrap();
    serde_json::from_str(&text).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    /// Up to five resets at any walks, at ends of batches and stages too, and behind the end.
    #[test]
    fn a_run_saved_and_restored_anywhere_ends_with_the_same_bits(
        cuts in prop::collection::vec(prop_oneof![0_u64..1700, (0_u64..17).prop_map(|k| 100 * k)], 1..6),
        collision in any::<bool>(),
        error in prop_oneof![
            Just(None),
            Just(Some(Tolerance::Absolute(5e-3))),
            Just(Some(Tolerance::Relative(1e-9))),
        ],
    ) {
        let estimator = if collision { Estimator::Collision } else { Estimator::Absorption };
        let run_options = run_options(error);
        let whole = interrupted::<f64>(estimator, run_options, &[], through_bytes);
        prop_assert_eq!(interrupted::<f64>(estimator, run_options, &cuts, through_bytes), whole);
        prop_assert_eq!(interrupted::<f64>(estimator, run_options, &cuts, through_json), whole);
        let whole = interrupted::<f32>(estimator, run_options, &[], through_bytes);
        prop_assert_eq!(interrupted::<f32>(estimator, run_options, &cuts, through_bytes), whole);
    }
}

#[test]
fn a_run_ends_as_the_plan_says() {
    let run =
        |run_options| interrupted::<f64>(Estimator::Collision, run_options, &[], through_bytes);
    let (all, stop) = run(run_options(None));
    assert_eq!((all.walks(), stop), (5000, Some(StopReason::Done)));
    // The standard deviation of a walk is 0.24: 2200 walks, and the stage that ends at 3200.
    let (some, stop) = run(run_options(Some(Tolerance::Absolute(5e-3))));
    assert_eq!(stop, Some(StopReason::Done));
    assert!(some.walks() == 3200 && some.preconditioned().std_error.unwrap() <= 5e-3);
    let (none, stop) = run(run_options(Some(Tolerance::Absolute(1e-9))));
    assert_eq!((none, stop), (all, Some(StopReason::ToleranceNotReached)));
}

#[test]
fn polls_are_bounded_and_tell_where_the_run_stands() {
    scene::<f64, _>(|circle, neighbour, start| {
        let task = task(circle, neighbour, start, Estimator::Absorption);
        let mut driver = Driver::new(task, run_options(None)).unwrap();
        assert_eq!(driver.poll(0).unwrap().walks, 0);
        let mut walks = 0;
        loop {
            let progress = driver.poll(70).unwrap();
            walks = (walks + 70).min(5000);
            assert_eq!(progress.walks, walks);
            assert_eq!(progress.estimate, driver.statistics().preconditioned());
            assert_eq!(progress.stop, (walks == 5000).then_some(StopReason::Done));
            if progress.stop.is_some() {
                break;
            }
        }
        assert_eq!(driver.poll(70).unwrap().walks, 5000);
    });
}

#[test]
fn impossible_plans_are_refused() {
    scene::<f64, _>(|circle, neighbour, start| {
        let refused = |run_options: RunOptions| {
            let task = || task(circle, neighbour, start, Estimator::Absorption);
            let state = Driver::new(task(), RunOptions::new(1)).unwrap().save();
            let error = Driver::new(task(), run_options).unwrap_err();
            let restored = Driver::restore(task(), run_options, &state).unwrap_err();
            assert_eq!(restored, StateError::Options(error));
            error
        };
        assert_eq!(refused(RunOptions::new(0)), RunOptionsError::NoWalks);
        let mut run_options = RunOptions::new(10);
        run_options.batch = 0;
        assert_eq!(refused(run_options), RunOptionsError::NoWalks);
        for bound in [0.0, -1.0, f64::NAN] {
            let mut run_options = RunOptions::new(10);
            run_options.tolerance = Some(Tolerance::Relative(bound));
            assert_eq!(refused(run_options), RunOptionsError::Tolerance);
        }
    });
}

/// A state after 250 of 5000 walks.
fn some_state() -> State {
    scene::<f64, _>(|circle, neighbour, start| {
        let task = task(circle, neighbour, start, Estimator::Absorption);
        let mut driver: OnDevice<'_, f64> = Driver::new(task, run_options(None)).unwrap();
        driver.poll(250).unwrap();
        driver.save()
    })
}

#[test]
fn a_damaged_state_is_refused() {
    let bytes = some_state().to_bytes();
    assert_eq!(State::from_bytes(&bytes), Ok(some_state()));
    for length in 0..bytes.len() {
        let found = State::from_bytes(&bytes[..length]);
        assert_eq!(found, Err(StateError::Length { found: length }));
    }
    // Every bit counts.
    for bit in 0..8 * bytes.len() {
        let mut spoilt = bytes;
        spoilt[bit / 8] ^= 1 << (bit % 8);
        let expected = match bit / 8 {
            0..4 => StateError::Foreign,
            4..6 => StateError::Version {
                found: u16::from_le_bytes([spoilt[4], spoilt[5]]),
            },
            _ => StateError::Checksum,
        };
        assert_eq!(State::from_bytes(&spoilt), Err(expected), "bit {bit}");
    }
    assert_eq!(
        State::from_bytes(&[0; State::BYTES]),
        Err(StateError::Foreign)
    );
}

#[test]
fn a_state_of_something_else_is_refused() {
    let state = some_state();
    scene::<f64, _>(|circle, neighbour, start| {
        let same = || task(circle, neighbour, start, Estimator::Absorption);
        let restored = |task, run_options| Driver::restore(task, run_options, &state).err();
        assert_eq!(restored(same(), run_options(None)), None);

        let mut other = same();
        other.estimator = Estimator::Collision;
        assert_eq!(
            restored(other, run_options(None)),
            Some(StateError::OtherOptions)
        );
        let mut other = same();
        other.length.step_limit -= 1;
        assert_eq!(
            restored(other, run_options(None)),
            Some(StateError::OtherOptions)
        );
        for change in [
            |run_options: &mut RunOptions| run_options.walks += 1,
            |run_options: &mut RunOptions| run_options.batch += 1,
            |run_options: &mut RunOptions| run_options.tolerance = Some(Tolerance::Absolute(1.0)),
        ] {
            let mut other = run_options(None);
            change(&mut other);
            assert_eq!(restored(same(), other), Some(StateError::OtherOptions));
        }

        for seeds in [WalkSeeds::new(6, 2), WalkSeeds::new(5, 3)] {
            let mut other = same();
            other.seeds = seeds;
            assert_eq!(
                restored(other, run_options(None)),
                Some(StateError::OtherDraws)
            );
        }

        let mut other = same();
        other.control_mean = None;
        assert_eq!(
            restored(other, run_options(None)),
            Some(StateError::OtherEquation)
        );
        let elsewhere = At(circle.point(0.31));
        let mut other = same();
        other.functional = &elsewhere;
        assert_eq!(
            restored(other, run_options(None)),
            Some(StateError::OtherEquation)
        );
    });
    // Another scalar, another neighbour equation.
    scene::<f32, _>(|circle, neighbour, start| {
        let mut other = task(circle, neighbour, start, Estimator::Absorption);
        other.control_mean = None;
        let refused = Driver::restore(other, run_options(None), &state).err();
        assert_eq!(refused, Some(StateError::OtherEquation));
    });
    scene::<f64, _>(|circle, neighbour, start| {
        let same = task(circle, neighbour, start, Estimator::Absorption);
        let other = Task {
            neighbour: &NoNeighbour::<Lit<'_, f64>>::new(),
            equation: same.equation,
            functional: same.functional,
            control_mean: same.control_mean,
            estimator: same.estimator,
            form: Form::Product,
            seeds: same.seeds,
            length: same.length,
        };
        let refused = Driver::restore(other, run_options(None), &state).err();
        assert_eq!(refused, Some(StateError::OtherEquation));
    });
}

/// What serde reads has no checksum: contradictions must not panic.
#[test]
fn a_contradictory_state_is_refused() {
    let state = serde_json::to_value(some_state()).unwrap();
    // A stage has ended, nothing is begun, and there is no reason to stop.
    let mut ended = state.clone();
    ended["stage_end"] = 2.into();
    ended["batch"] = serde_json::to_value(Statistics::default()).unwrap();
    let edits: [(&str, Option<&str>, u64); 8] = [
        ("stage_end", None, 1),
        ("stage_end", None, 2),
        ("stage_end", None, 51),
        ("merged", Some("walks"), 250),
        ("merged", Some("left"), 300),
        ("batch", Some("walks"), 100),
        ("batch", Some("walks"), u64::MAX),
        ("merged", Some("walks"), u64::MAX),
    ];
    scene::<f64, _>(|circle, neighbour, start| {
        let ended: State = serde_json::from_value(ended).unwrap();
        let task = || task(circle, neighbour, start, Estimator::Absorption);
        let refused = Driver::restore(task(), run_options(None), &ended).err();
        assert_eq!(refused, Some(StateError::Contradiction));
        for (field, inner, value) in edits {
            let mut edited = state.clone();
            match inner {
                Some(inner) => edited[field][inner] = value.into(),
                None => edited[field] = value.into(),
            }
            let edited: State = serde_json::from_value(edited).unwrap();
            let refused = Driver::restore(task(), run_options(None), &edited).err();
            assert_eq!(
                refused,
                Some(StateError::Contradiction),
                "{field} {inner:?} {value}"
            );
        }
    });
}

/// A walk that is not finite is an error that can be met again, and leaves the state as it was.
#[test]
fn a_score_that_is_not_finite_names_its_walk() {
    struct Bad(Cell<bool>);
    impl fredholm_core::StateSpace for Bad {
        type Scalar = f64;
        type Point = f64;
    }
    impl Sampler for Bad {
        fn absorption(&self, _: &f64) -> f64 {
            0.5
        }
        fn step<U: fredholm_core::Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
            Some(uniforms.uniform())
        }
    }
    impl fredholm_core::Kernel for Bad {
        fn kernel(&self, _: &f64, y: &f64) -> f64 {
            if *y > 0.99 && self.0.get() {
                f64::NAN
            } else {
                0.5
            }
        }
    }
    impl fredholm_core::Source for Bad {
        fn source(&self, _: &f64) -> f64 {
            1.0
        }
    }
    let bad = Bad(Cell::new(true));
    let none = NoNeighbour::<Bad>::new();
    let task = || Task {
        equation: &bad,
        neighbour: &none,
        functional: &At(0.5),
        control_mean: Some(0.0),
        estimator: Estimator::Collision,
        form: Form::Product,
        seeds: <WalkSeeds>::new(1, 0),
        length: Length::default(),
    };
    let mut driver = Driver::new(task(), run_options(None)).unwrap();
    let error = driver.poll(5000).unwrap_err();
    assert!(error.walk > 0);
    assert_eq!(driver.statistics().walks(), error.walk);
    assert_eq!(driver.poll(1), Err(error));
    let mut again = Driver::restore(task(), run_options(None), &driver.save()).unwrap();
    assert_eq!(again.poll(1), Err(error));
    bad.0.set(false);
    assert_eq!(again.poll(1).unwrap().walks, error.walk + 1);
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
    Table::read(&place[..bytes.len()], "circle").map(|_| ())
}

fn small_table() -> TableBuilder {
    let mut builder = TableBuilder::new("circle");
    builder.numbers("v", &[1.0_f32, -2.5, 3.0]);
    builder.numbers("absorb", &[0.2_f64]);
    builder.numbers("eightlet", &[7_u32, 8]);
    builder
}

#[test]
fn a_table_is_read_as_it_was_written() {
    let words = aligned(&small_table().to_bytes());
    let table = Table::read(words.as_bytes(), "circle").unwrap();
    assert_eq!(table.slice::<f32>("v"), Ok(&[1.0, -2.5, 3.0][..]));
    assert_eq!(table.one::<f64>("absorb"), Ok(0.2));
    assert_eq!(table.slice::<u32>("eightlet"), Ok(&[7, 8][..]));
    assert!(table.has("v") && !table.has("w"));
    assert_eq!(
        table.slice::<f32>("w"),
        Err(TableError::Missing { name: "w" })
    );
    let element = TableError::Element {
        name: "v",
        found: 4,
    };
    assert_eq!(table.slice::<f64>("v"), Err(element));
    assert_eq!(table.one::<f32>("v"), Err(TableError::NotOne { name: "v" }));
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
    nothing.records("v", "()", 0, [(Vec::new(), String::new())]);
    assert_eq!(
        read(&nothing.to_bytes()),
        Err(TableError::Directory { array: 0 })
    );
    // Whatever lies at odd places.
    let mut words = aligned(&[&[0; 4], &bytes[..]].concat());
    words.push(0);
    let place = words.as_bytes();
    assert_eq!(
        Table::read(&place[4..4 + bytes.len()], "circle").err(),
        Some(TableError::Alignment)
    );
}

#[test]
fn tables_of_no_circle_are_refused() {
    use fredholm_circle::{Cell, Slot, Tables};
    let tables = Tables::<f64>::new(&RHO, 10).unwrap();
    let (cells, slots) = tables.cells().tables();
    assert!(Cells::new(cells, slots).is_ok());
    let length = CircleError::Length {
        expected: 20,
        found: 19,
    };
    assert_eq!(Cells::new(cells, &slots[1..]).err(), Some(length));
    assert_eq!(Cells::<f64>::new(&[], &[]).err(), Some(CircleError::Cells));
    let mut white = cells.to_vec();
    let [cos, sin, cos_low, sin_low, _] = white[3].parts();
    for rho in [1.0, -0.1, f64::NAN] {
        white[3] = Cell::new([cos, sin, cos_low, sin_low, rho]);
        let error = CircleError::Reflectance { arc: 3 };
        assert_eq!(Cells::new(&white, slots).err(), Some(error));
    }
    // Behind the last cell: at once, or by the one that `locate` adds.
    for (end, cell) in [(0.5, 10), (0.5, 9), (f64::NAN, 2)] {
        let mut astray = slots.to_vec();
        astray[7] = Slot::new(end, cell);
        let error = CircleError::Slot { slot: 7 };
        assert_eq!(Cells::new(cells, &astray).err(), Some(error));
    }
}

#[test]
fn the_readmes_program_is_the_one_that_is_built() {
    let readme = include_str!("../../../runners/embedded/README.md");
    assert!(readme.contains(include_str!(
        "../../../runners/embedded/firmware/src/bin/minimal.rs"
    )));
}
