//! Equations in several channels, each of which is an equation of its own.

use fredholm::channels::ChannelModels;
use fredholm::circle::{Emission, Harmonic};
use fredholm::sphere::Parameters;
use fredholm::tube::Parameters as TubeParameters;
use fredholm::{
    CircleModel, CubeModel, CustomModel, Error, Method, Model, Pairs, Region, Report, Scalar,
    Sequence, SolveError, Solver, SphereModel, TubeModel,
};

use crate::common::Line;

/// A circle whose solution is this constant and a wave.
fn circle(constant: f64) -> CircleModel {
    let wave = Harmonic {
        constant,
        amplitude: 1.0,
        frequency: 2,
    };
    CircleModel::new(vec![0.3, 0.7], Emission::Harmonic(wave))
}

fn cube(size: f64) -> CubeModel {
    CubeModel::on_interval([0.0, 1.0], move |x, y| size * x * y, |x| x)
}

fn sphere(albedo: f64, asymmetry: f64) -> SphereModel {
    SphereModel::new(Parameters {
        albedo,
        asymmetry,
        emission: [1.0, 0.2, 0.1, 0.5],
        forward: 0.2,
    })
}

fn tube(reflectance: f64) -> TubeModel {
    TubeModel::new(TubeParameters {
        length: 2.0,
        reflectance,
        emission: 0.0,
        ends: [1.0, 0.0],
    })
}

fn own(size: f64) -> impl Model {
    CustomModel::from_kernel(Line::new(move |x: f64, y: f64| size * x * y, |x: f64| x, 1))
}

/// An equation alone, and one of two channels whose first is that.
type Pair = [Box<dyn Model>; 2];

fn pair<M: Model + 'static>(of: impl Fn(bool) -> M) -> Pair {
    let channels = ChannelModels::new(["a", "b"], [of(true), of(false)]).unwrap();
    [Box::new(of(true)), Box::new(channels)]
}

fn pairs() -> [Pair; 5] {
    let choose = |first: bool, numbers: [f64; 2]| numbers[usize::from(!first)];
    [
        pair(|first| circle(choose(first, [5.0, 2.0]))),
        pair(|first| cube(choose(first, [0.5, -0.8]))),
        // Their chains differ, too.
        pair(|first| sphere(choose(first, [0.6, 0.8]), choose(first, [0.3, 0.1]))),
        pair(|first| tube(choose(first, [0.8, 0.4]))),
        pair(|first| own(choose(first, [0.5, -0.8]))),
    ]
}

/// A mean and a point by walks of the chain.
fn by_walks(model: &dyn Model) -> Solver<'_> {
    let settings = fredholm::Settings::default().discretisation();
    let cells = model.levels(&settings).into_iter().nth(2).unwrap();
    let points = model.spread(9.0);
    Solver::new(model)
        .method(Method::Walks)
        .mean()
        .goal("u", points[points.len() / 2].clone())
        .cells(cells)
        .walks(3000)
}

fn estimates(report: &Report) -> Vec<[f64; 2]> {
    let of = |goal: &fredholm::report::GoalReport| {
        let own = goal.preconditioned;
        [own.estimate.unwrap(), own.std_error.unwrap()]
    };
    report.goals.iter().map(of).collect()
}

/// Looks at one equation in one way, and at the first of two channels, of which it is told the same bits.
fn check(alone: &dyn Model, channels: &dyn Model, with: fn(Solver<'_>) -> Solver<'_>) {
    let kind = alone.about().kind;
    let alone = with(by_walks(alone)).solve().unwrap();
    let report = with(by_walks(channels)).solve().unwrap();
    let names: Vec<_> = report.goals.iter().map(|goal| &*goal.name).collect();
    assert_eq!(
        names,
        ["mean a", "mean b", "mean sum", "u a", "u b", "u sum"]
    );
    let (alone, all) = (estimates(&alone), estimates(&report));
    for (own, all) in alone.iter().zip(all.chunks(3)) {
        assert_eq!(*own, all[0], "{kind}");
        let [[a, of_a], [b, of_b], [sum, error]] = [all[0], all[1], all[2]];
        assert!((sum - a - b).abs() <= 1e-14 * (a.abs() + b.abs()), "{kind}");
        // Batches are merged with the distances of their means, whose products have the mean 0.
        let ratio = error / of_a.hypot(of_b);
        assert!(
            (ratio - 1.0).abs() < 0.2 || error < 1e-14,
            "{kind}: {ratio}"
        );
        assert_ne!([a, of_a], [b, of_b], "{kind}");
    }
}

#[test]
fn a_channel_is_its_equation_alone() {
    for [alone, channels] in &pairs() {
        check(&**alone, &**channels, |solver| solver);
        check(&**alone, &**channels, |solver| {
            solver.sequence(Sequence::Sobol).absorption(0.3)
        });
    }
}

#[test]
fn channels_have_single_precision_lifts_and_last_steps() {
    // Of several channels something else may be chosen than of one.
    fn fixed(solver: Solver<'_>) -> Solver<'_> {
        solver.degree(0).pairs(Pairs::Default)
    }
    let [circles, _, spheres, tubes, _] = &pairs();
    for [alone, channels] in [circles, spheres, tubes] {
        check(&**alone, &**channels, |solver| {
            fixed(solver).scalar(Scalar::F32)
        });
    }
    check(&*circles[0], &*circles[1], |solver| solver.lift(2));
    let lit = |first: bool| {
        let lamp = if first { 1.0 } else { 0.2 };
        CircleModel::new(vec![0.5], Emission::Arcs(vec![lamp, 0.0]))
    };
    let [alone, channels] = pair(lit);
    check(&*alone, &*channels, |solver| fixed(solver).last_step(true));
}

/// Intervals of known solutions hold as often as they say, those of the sum among them: 300 runs, and 4.9 standard deviations.
#[test]
fn error_bars_hold() {
    let channels = ChannelModels::new(
        ["red", "green", "blue"],
        [circle(5.0), circle(2.0), circle(1.0)],
    );
    let channels = channels.unwrap();
    let mut squares = [0.0; 4];
    let runs = 300;
    for seed in 0..runs {
        let solver = Solver::new(&channels).at(0.3).cells(16).degree(0);
        let solver = solver.pairs(Pairs::Default).walks(200).seed(seed);
        let report = solver.solve().unwrap();
        for (sum, goal) in squares.iter_mut().zip(&report.goals) {
            sum.add_assign_square(goal.z.unwrap());
        }
    }
    // Σ z² of n walks with n − 1 degrees of freedom has about the variance 2 a run.
    let runs = f64::from(runs as u32);
    for sum in squares {
        assert!(
            (sum - runs).abs() < 4.9 * (2.0 * runs).sqrt(),
            "{squares:?}"
        );
    }
}

trait AddSquare {
    fn add_assign_square(&mut self, x: f64);
}

impl AddSquare for f64 {
    fn add_assign_square(&mut self, x: f64) {
        *self += x * x;
    }
}

#[test]
fn what_is_open_is_chosen_and_resolvent_walks_serve() {
    const ERROR: f64 = 1e-3;
    for [alone, channels] in &pairs() {
        let kind = alone.about().kind;
        let own = Solver::new(&**alone).mean().solve_to(ERROR).unwrap();
        let report = Solver::new(&**channels).mean().solve_to(ERROR).unwrap();
        let all = estimates(&report);
        let [value, error] = estimates(&own)[0];
        assert!(all.iter().all(|own| own[1] <= ERROR), "{kind}: {all:?}");
        let distance = (value - all[0][0]).abs() / error.hypot(all[0][1]).max(1e-12);
        assert!(distance < 4.9, "{kind}: {distance}");
        assert!((all[2][0] - all[0][0] - all[1][0]).abs() < 1e-12, "{kind}");
    }
    let grid = pairs();
    let report = Solver::new(&*grid[1][1]).grid(11).solve_to(1e-9).unwrap();
    assert!(report.resolvent.is_some() && report.goals.len() == 33);
}

/// The relative error of a sum in which channels cancel is not that of the channels, and a run does not say that it is.
#[test]
fn sums_that_cancel_are_not_said_to_be_reached() {
    let of =
        |sign: f64| CubeModel::on_interval([0.0, 1.0], |x, y| 0.5 * (-x * y).exp(), move |_| sign);
    let channels = ChannelModels::new(["up", "down"], [of(1.0), of(-1.0)]).unwrap();
    let solver = || Solver::new(&channels).mean();
    match solver().solve_to_relative(1e-4) {
        Err(SolveError::NotReached(report)) => {
            let reason = report.reason.unwrap();
            assert!(reason.contains("cancel in their sum"), "{reason}");
        }
        other => panic!("{other:?}"),
    }
    assert!(solver().solve_to(1e-6).unwrap()[2].std_error() <= 1e-6);
}

/// The systems of both channels, saved and made again, give the same bits.
#[test]
fn systems_of_all_channels_are_saved() {
    for [_, channels] in &pairs() {
        let cut = fredholm::Settings::default().discretisation();
        let levels = channels.levels(&cut);
        let cells = channels.partition(&cut.on(levels[2])).unwrap();
        let solved = cells.solve().unwrap();
        let saved = solved.saved().unwrap().into_owned();
        let again = cells.restore(saved.clone()).unwrap();
        let again = again.saved().unwrap();
        assert_eq!(saved.solution.v, again.solution.v);
        assert_eq!(saved.coefficients, again.coefficients);
        assert!(solved.tables(Pairs::Default).is_err());
    }
}

#[test]
fn wrong_channels_are_refused() {
    let message = |error: Error| error.to_string();
    let of = |names: &[&str], models: Vec<CircleModel>| {
        message(ChannelModels::new(names.iter().copied(), models).unwrap_err())
    };
    assert!(of(&[], Vec::new()).contains("1 to 128 channels, not 0"));
    assert!(of(&["a", "a"], vec![circle(1.0), circle(1.0)]).contains("must differ"));
    assert!(of(&["a", " "], vec![circle(1.0), circle(1.0)]).contains("must differ"));
    assert!(of(&["a", "b"], vec![circle(1.0)]).contains("a name and an equation"));
    let mixed: Vec<Box<dyn Model>> = vec![Box::new(circle(1.0)), Box::new(cube(0.5))];
    let names = ["a", "b"].map(str::to_owned).to_vec();
    let mixed = ChannelModels::from_boxed(names, mixed).unwrap_err();
    assert!(message(mixed).contains("of one kind"));
    let longer = |high: f64| CubeModel::on_interval([0.0, high], |_, _| 0.1, |_| 1.0);
    let spaces = ChannelModels::new(["a", "b"], [longer(1.0), longer(2.0)]).unwrap_err();
    assert!(message(spaces).contains("one space"));
    // A channel of which no walk has a finite variance.
    let large = ChannelModels::new(["a", "b"], [cube(0.5), cube(6.0)]).unwrap();
    assert!(by_walks(&large).solve().is_err());
    let one = ChannelModels::new(["a"], [circle(1.0)]).unwrap();
    assert!(
        Solver::new(&one)
            .goal("u", Region::Point(vec![9.0]))
            .solve()
            .is_err()
    );
    let whole = Solver::new(&one).mean().whole().unwrap_err().to_string();
    assert!(whole.contains("has one channel"), "{whole}");
    let back = Solver::new(&one).mean().adjoint(true).solve().unwrap_err();
    assert!(back.to_string().contains("`adjoint`"), "{back}");
}
