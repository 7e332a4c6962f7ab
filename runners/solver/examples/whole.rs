//! Prints what the global estimate gains over separate walks at equal error, and how its largest error compares with its
//! band: processor time of one thread, on Linux.
//!
//! ```text
//! RAYON_NUM_THREADS=1 cargo run --profile dist -p fredholm --features measure --example whole
//! RAYON_NUM_THREADS=1 cargo run --profile dist -p fredholm --features measure --example whole -- circle
//! RAYON_NUM_THREADS=1 cargo run --profile dist -p fredholm --features measure --example whole -- images
//! ```
//!
//! With a word: of equations whose names have it. `images` compares scores on polynomials with scores on K(x, ·) of every x.

use fredholm::circle::{Emission, Harmonic};
use fredholm::room::{Material, Surfaces};
use fredholm::{
    CircleModel, CubeModel, Estimator, Model, Pairs, Region, RoomModel, Scalar, Solver, SphereModel,
};

/// Walks of the global estimate.
const WALKS: u64 = 1 << 18;
/// Points of which separate walks are measured, and walks of each.
const SEPARATE: usize = 16;
const SEPARATE_WALKS: u64 = 1 << 16;

/// Seconds of processor time of this process's threads so far; 0 where nobody tells.
fn seconds() -> f64 {
    let all = std::fs::read_dir("/proc/self/task").into_iter().flatten();
    let of_threads = all.flatten().filter_map(|thread| {
        let told = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        told.split(' ').next()?.parse::<f64>().ok()
    });
    1e-9 * of_threads.sum::<f64>()
}

/// The time of work that is short, by as often as makes it long.
fn time<R>(mut work: impl FnMut() -> R) -> (f64, R) {
    let start = seconds();
    let mut times = 0.0;
    loop {
        let result = work();
        times += 1.0;
        let took = seconds() - start;
        if took > 1.0 || times > 1e4 {
            return (took / times, result);
        }
    }
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), x| (sum + x * x, count + 1.0));
    f64::sqrt(sum / count)
}

/// K = ½ exp(−|x − y|²) and the solution 1 + Σ x_a², with F = u − T_K u by products of one-dimensional integrals.
fn gauss<const D: usize>() -> CubeModel {
    // ∫ y^k exp(−(x − y)²) dy over [0, 1] for k = 0 and 2, by 12 Gauss points: to 10⁻¹⁵.
    let rule = fredholm_variance::gauss(12).expect("a rule");
    let moment = move |x: f64, power: i32| {
        let at = |y: f64| y.powi(power) * (-(x - y).powi(2)).exp();
        rule.iter()
            .map(|(t, w)| 0.5 * w * at(0.5 * (1.0 + t)))
            .sum::<f64>()
    };
    let solution = |x: &[f64]| 1.0 + x.iter().map(|x| x * x).sum::<f64>();
    CubeModel::from_fn::<D>(
        |x, y| {
            let square: f64 = x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum();
            0.5 * (-square).exp()
        },
        move |x| {
            let zeroth = x.map(|x| moment(x, 0));
            let all: f64 = zeroth.iter().product();
            let with_square = (0..D).map(|a| all / zeroth[a] * moment(x[a], 2));
            solution(x) - 0.5 * (all + with_square.sum::<f64>())
        },
    )
    .with_solution(solution)
}

/// K = ½ exp(−|x − y|) and the solution 1 + x.
fn kink() -> CubeModel {
    CubeModel::from_fn::<1>(
        |x, y| 0.5 * (-(x[0] - y[0]).abs()).exp(),
        |x| 1.5 * (x[0] - 1.0).exp(),
    )
    .with_solution(|x| 1.0 + x[0])
}

/// A circle with five reflectances and the light 5 + sin 5θ.
fn arcs() -> CircleModel {
    let light = Harmonic {
        constant: 5.0,
        amplitude: 1.0,
        frequency: 5,
    };
    CircleModel::new(vec![0.3, 0.7, 0.0, 0.55, 0.74], Emission::Harmonic(light))
}

/// A lit wall opposite to three that reflect half of the light.
fn square() -> Surfaces {
    let half = Material {
        reflectance: 0.5,
        emission: 0.0,
    };
    let lit = Material {
        emission: 1.0,
        ..half
    };
    Surfaces::default()
        .with("lit", &[[0.0, 1.0], [0.0, 0.0]], lit)
        .with(
            "others",
            &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
            half,
        )
}

/// Two rooms with a door between them, a lamp in the left one.
fn doorway() -> Surfaces {
    let material = |reflectance, emission| Material {
        reflectance,
        emission,
    };
    Surfaces::default()
        .with("floor, left", &[[0.0, 0.0], [1.9, 0.0]], material(0.6, 0.0))
        .with(
            "sill",
            &[[1.9, 0.0], [1.9, 0.7], [2.1, 0.7], [2.1, 0.0]],
            material(0.5, 0.0),
        )
        .with(
            "right",
            &[[2.1, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]],
            material(0.6, 0.0),
        )
        .with("lamp", &[[0.0, 2.0], [0.0, 0.0]], material(0.4, 1.0))
}

/// The square with a box in it.
fn boxed() -> Surfaces {
    let dark = Material {
        reflectance: 0.2,
        emission: 0.0,
    };
    let around = [[0.4, 0.3], [0.4, 0.6], [0.6, 0.6], [0.6, 0.3], [0.4, 0.3]];
    square().with("box", &around, dark)
}

/// `count` points over the whole space, of a cube about so many, equally spaced.
fn points(model: &dyn Model, count: usize) -> Vec<Region> {
    let all = model.spread(count as f64);
    all.into_iter().cycle().take(count).collect()
}

/// The exact values of a model that knows them.
fn known(model: &dyn Model) -> impl Fn(&[Region]) -> Vec<f64> + '_ {
    let exact = |region: &Region| model.exact(region).ok().flatten().unwrap_or(f64::NAN);
    move |regions| regions.iter().map(exact).collect()
}

/// Whether the command line asks for this name.
fn is_wanted(name: &str) -> bool {
    std::env::args()
        .nth(1)
        .is_none_or(|word| name.contains(&word))
}

/// Time and root mean square error of points by both kinds of scores. Walks by polynomials serve all points; of the other ones
/// every point is asked for.
fn images_row(name: &str, model: &CubeModel, cells: usize, degree: usize) {
    let solver = Solver::new(model)
        .cells(cells)
        .degree(degree)
        .walks(1 << 16);
    for count in [1_u32, 10, 100] {
        let points: Vec<f64> = (0..count)
            .map(|i| (f64::from(i) + 0.4) / f64::from(count))
            .collect();
        let regions: Vec<Region> = points.iter().map(|x| Region::Point(vec![*x])).collect();
        let exact = known(model)(&regions);
        let off = |values: &[fredholm::GlobalValue]| {
            let all = values.iter().zip(&exact);
            root_mean_square(all.map(|(value, exact)| value.estimate - exact))
        };
        let error = |values: &[fredholm::GlobalValue]| {
            root_mean_square(values.iter().filter_map(|value| value.std_error))
        };
        let (took, values) = time(|| solver.values_at(&points).expect("values"));
        print!(
            "{name:<28} {count:>5} | {took:>9.1e} {:>9.1e} {:>9.1e}",
            error(&values),
            off(&values)
        );
        for more in [1, 2, 4] {
            let polynomials = solver.clone().score_degree(degree + more);
            let (took, values) = time(|| {
                let whole = polynomials.whole().expect("a global estimate");
                whole.values(&regions).expect("values")
            });
            print!(
                " | {took:>9.1e} {:>9.1e} {:>9.1e}",
                error(&values),
                off(&values)
            );
        }
        println!();
    }
}

/// Compares both kinds of scores where cells are few.
fn images() {
    println!(
        "{} walks; seconds of a processor with the set-up, standard error and distance from u, root mean squares over points: \
         of K(x, .), and of polynomials of 1, 2 and 4 degrees more than v",
        1 << 16
    );
    let (one, kink) = (gauss::<1>(), kink());
    images_row("cube d = 1, 2, p = 1", &one, 2, 1);
    images_row("cube d = 1, 16, p = 0", &one, 16, 0);
    images_row("kink d = 1, 2, p = 1", &kink, 2, 1);
    images_row("kink d = 1, 16, p = 0", &kink, 16, 0);
}

fn row(name: &str, model: &dyn Model, cells: usize, degree: usize) {
    row_of(
        name,
        model,
        (cells, degree),
        &[Pairs::Default],
        &known(model),
    );
}

/// A circle, by an estimator.
fn circle_row(name: &str, model: &CircleModel, cells: usize, degree: usize, by: Estimator) {
    let solver = Solver::new(model).cells(cells).degree(degree);
    let pairs = [Pairs::Default, Pairs::Pointwise];
    print_row(name, model, solver.estimator(by), &pairs, &known(model));
}

/// A room, whose errors are those from F + T_K v on 600 cells of degree 3. Separate walks have the pairs that serve them
/// best, as on circles.
fn room_row(name: &str, model: &RoomModel, cells: usize, degree: usize) {
    let fine = Solver::new(model).cells(600).degree(3).walks(1);
    let fine = fine.whole().expect("a global estimate");
    let exact = |regions: &[Region]| {
        let values = fine.values(regions).expect("values").into_iter();
        values.map(|value| value.iterate).collect()
    };
    let pairs = [Pairs::Rays, Pairs::Pointwise];
    row_of(name, model, (cells, degree), &pairs, &exact);
}

fn row_of(
    name: &str,
    model: &dyn Model,
    (cells, degree): (usize, usize),
    pairs: &[Pairs],
    exact: &dyn Fn(&[Region]) -> Vec<f64>,
) {
    let solver = Solver::new(model).cells(cells).degree(degree);
    print_row(name, model, solver, pairs, exact);
}

fn print_row(
    name: &str,
    model: &dyn Model,
    solver: Solver<'_>,
    pairs: &[Pairs],
    exact: &dyn Fn(&[Region]) -> Vec<f64>,
) {
    if !is_wanted(name) {
        return;
    }
    // Without walks there is the set-up, which both have.
    let (setup, _) = time(|| solver.clone().walks(1).mean().answer().expect("an answer"));
    let separate = |pairs: &Pairs| {
        let mut separate = solver.clone().walks(SEPARATE_WALKS).pairs(*pairs);
        for (i, region) in points(model, SEPARATE).into_iter().enumerate() {
            separate = separate.goal(&i.to_string(), region);
        }
        let (took, answer) = time(|| separate.answer().expect("an answer"));
        let per_walk = (took - setup) / (SEPARATE as u64 * SEPARATE_WALKS) as f64;
        let deviations = answer.outcome.statistics.iter();
        let deviation = root_mean_square(deviations.filter_map(|s| s.preconditioned().std_dev));
        (per_walk, deviation)
    };
    let work = |(seconds, deviation): &(f64, f64)| seconds * deviation * deviation;
    let all = pairs.iter().map(separate);
    let best = all.min_by(|a, b| work(a).total_cmp(&work(b)));
    let (per_walk, deviation) = best.expect("pairs");

    let whole = solver.clone().walks(WALKS);
    let (took, function) = time(|| whole.whole().expect("a global estimate"));
    let once = took - setup;
    let many = points(model, 1000);
    let (values_took, values) = time(|| function.values(&many).expect("values"));
    let error = root_mean_square(values.iter().filter_map(|value| value.std_error));
    let per_point = per_walk * (deviation / error).powi(2);
    let gain = |count: f64| per_point * count / (once + values_took * count / 1000.0);

    let exact = exact(&many);
    let off = |of: fn(&fredholm::GlobalValue) -> f64| {
        let all = exact.iter().zip(&values);
        all.map(|(exact, value)| (of(value) - exact).abs())
            .fold(0.0, f64::max)
    };
    let band = values
        .iter()
        .filter_map(|value| value.band)
        .fold(0.0, f64::max);
    println!(
        "{name:<28} {:>8.1e} {error:>8.1e} {:>7.0e} {:>7.0e} {:>7.0e} {:>4.1} | {:>7.1} {:>7.0} {:>7.0} {:>7.0} | {:>8.1e} {band:>8.1e} {:>8.1e}",
        deviation / (WALKS as f64).sqrt(),
        setup,
        once,
        values_took,
        once / (per_walk * WALKS as f64),
        gain(1.0),
        gain(10.0),
        gain(100.0),
        gain(1000.0),
        off(|value| value.estimate),
        off(|value| value.iterate),
    );
}

fn main() {
    if std::env::args().nth(1).as_deref() == Some("images") {
        images();
        return;
    }
    println!(
        "{WALKS} walks; sd/sqrt(walks) of a point, standard error of the global estimate (both root mean squares over points);"
    );
    println!(
        "seconds of the set-up, of walks and band, of 1000 values; walks and band in units of as many walks of a point; gain in time over separate walks at equal error for"
    );
    println!(
        "1, 10, 100, 1000 points, the set-up left out of both; largest error of 1000 points, widest band, error of F + T_K v"
    );
    println!();
    println!(
        "{:<28} {:>8} {:>8} {:>7} {:>7} {:>7} {:>4} | {:>7} {:>7} {:>7} {:>7} | {:>8} {:>8} {:>8}",
        "equation",
        "point",
        "whole",
        "set-up",
        "once",
        "values",
        "",
        "1",
        "10",
        "100",
        "1000",
        "error",
        "band",
        "F+T_K v"
    );
    let circle = arcs();
    let (once, always) = (Estimator::Absorption, Estimator::Collision);
    circle_row("circle, 100 cells, p = 0", &circle, 100, 0, once);
    circle_row("circle, 1000 cells, p = 0", &circle, 1000, 0, once);
    circle_row("circle, 50 cells, p = 3", &circle, 50, 3, once);
    circle_row("circle, 100, p = 0, collision", &circle, 100, 0, always);
    circle_row("circle, 50, p = 3, collision", &circle, 50, 3, always);
    let (one, two, three) = (gauss::<1>(), gauss::<2>(), gauss::<3>());
    row("cube d = 1, 100, p = 0", &one, 100, 0);
    row("cube d = 1, 16, p = 3", &one, 16, 3);
    row("cube d = 2, 30 x 30, p = 0", &two, 30, 0);
    row("cube d = 2, 6 x 6, p = 3", &two, 6, 3);
    row("cube d = 3, 9^3, p = 0", &three, 9, 0);
    row("cube d = 3, 3^3, p = 3", &three, 3, 3);
    for (name, surfaces) in [
        ("square", square()),
        ("doorway", doorway()),
        ("box", boxed()),
    ] {
        let room = RoomModel::new(surfaces, Scalar::F64).expect("a room");
        room_row(&format!("{name}, 100 cells, p = 0"), &room, 100, 0);
        room_row(&format!("{name}, 400 cells, p = 0"), &room, 400, 0);
        room_row(&format!("{name}, 100 cells, p = 2"), &room, 100, 2);
    }
    let sphere = SphereModel::new(fredholm::sphere::Parameters {
        albedo: 0.6,
        asymmetry: 0.3,
        emission: [1.0, 0.2, 0.1, 0.5],
        forward: 0.2,
    });
    row("sphere, 200 cells", &sphere, 200, 0);
    row("sphere, 1800 cells", &sphere, 1800, 0);
}
