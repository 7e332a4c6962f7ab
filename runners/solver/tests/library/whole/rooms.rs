//! Rooms and spheres.

use fredholm::room::{Beside, FieldRequest, Material, Outside, Spot, Stretch, Surfaces};
use fredholm::{
    Estimator, Form, GlobalEstimate, GlobalValue, Model, Pairs, Region, RoomModel, Scalar, Solver,
    SphereModel,
};

use crate::common::is_long;

use super::{fewest, refused, threads_change_no_bit_of};

/// A room with a lit wall, a black one, and a box that hides walls from each other; its ceiling may be missing.
fn room(open: bool) -> RoomModel {
    let material = |reflectance, emission| Material {
        reflectance,
        emission,
    };
    let mut surfaces = Surfaces {
        open,
        ..Surfaces::default()
    };
    surfaces = surfaces
        .with("floor", &[[0.0, 0.0], [2.0, 0.0]], material(0.5, 0.0))
        .with("black", &[[2.0, 0.0], [2.0, 1.0]], material(0.0, 0.1))
        .with("left", &[[0.0, 1.0], [0.0, 0.0]], material(0.3, 1.0))
        .with(
            "box",
            &[[0.9, 0.4], [0.9, 0.6], [1.1, 0.6], [1.1, 0.4], [0.9, 0.4]],
            material(0.6, 0.0),
        );
    if !open {
        surfaces = surfaces.with("ceiling", &[[2.0, 1.0], [0.0, 1.0]], material(0.7, 0.0));
    }
    RoomModel::new(surfaces, Scalar::F64).unwrap()
}

const FLOOR: usize = 0;
const BLACK: usize = 1;

/// Points on all walls, points in the air, and means.
fn regions(model: &RoomModel) -> Vec<Region> {
    let mut all = model.spread(40.0);
    for at in [[0.1, 0.5], [1.0, 0.2], [1.9, 0.9], [1.3, 0.05]] {
        all.push(Region::Point(at.to_vec()));
    }
    all.extend([FLOOR, BLACK, 3].map(Region::Part));
    all.extend([Region::Parts(vec![FLOOR, 2]), Region::Whole]);
    all
}

/// F + T_K v on many cells of degree 3: an error that walks on few cells do not see.
fn fine(model: &RoomModel) -> GlobalEstimate<'_> {
    let cells = if is_long() { 400 } else { 160 };
    let solver = Solver::new(model).cells(cells).degree(3);
    solver.walks(1).whole().unwrap()
}

/// **Unbiased**: u at points and in means, what points in the air see, irradiances and net fluxes, with both estimators and
/// forms, in a closed room and in one where starts alone are scored. Student's t of 63 degrees of freedom: of some 500
/// values none is above 5.6 but with probability 500 · 5·10⁻⁷ < 10⁻³. What the projection of e and the fine solution lose is
/// below a twentieth of the smallest standard error, which the long form has on more cells and a higher degree.
#[test]
fn values_are_those_of_a_fine_solution() {
    const MOST: f64 = 5.6;
    let (cells, walks) = if is_long() {
        (120, [1 << 24, 1 << 20])
    } else {
        (40, [1 << 14; 2])
    };
    let scores = [
        (Estimator::Absorption, Form::Product, Pairs::Default, 0.2),
        (Estimator::Collision, Form::Residual, Pairs::Pointwise, 0.3),
    ];
    for open in [false, true] {
        let model = room(open);
        let (fine, regions) = (fine(&model), regions(&model));
        for ((estimator, form, pairs, absorption), walks) in scores.into_iter().zip(walks) {
            let solver = Solver::new(&model).cells(cells).degree(0).walks(walks);
            let solver = solver.pairs(pairs).absorption(absorption);
            let solver = solver.estimator(estimator).form(form).score_degree(4);
            let whole = solver.whole().unwrap();
            let summary = whole.summary();
            let error = summary.largest_std_error.unwrap();
            assert!(summary.truncation < 0.5 * error, "{summary:?}");
            let mut largest = 0.0_f64;
            let mut compare = |name: &str, region: &Region, found: GlobalValue, exact: f64| {
                let bar = found.std_error.unwrap().max(1e-12);
                let z = (found.estimate - exact) / bar;
                assert!(
                    z.abs() < MOST,
                    "open: {open}, {name} {region:?}: {z}, {found:?}, {exact}"
                );
                largest = largest.max(z.abs());
            };
            let both = whole.values(&regions).unwrap().into_iter();
            for ((region, found), exact) in
                regions.iter().zip(both).zip(fine.values(&regions).unwrap())
            {
                compare("u", region, found, exact.iterate);
                if !matches!(region, Region::Point(_)) {
                    let of = |whole: &GlobalEstimate<'_>| {
                        [
                            whole.irradiance(region).unwrap(),
                            whole.net_flux(region).unwrap(),
                        ]
                    };
                    for ((found, exact), name) in
                        of(&whole).into_iter().zip(of(&fine)).zip(["H", "q"])
                    {
                        compare(name, region, found, exact.iterate);
                    }
                }
            }
            println!(
                "open: {open}, {estimator:?}, {form:?}: {} states, |z| <= {largest:.2}",
                summary.states
            );
        }
    }
}

/// What is known without any walks: u of a black wall, net fluxes that sum to 0 in a closed room, and irradiances that
/// follow from u.
#[test]
fn light_is_in_balance() {
    let model = room(false);
    let whole = Solver::new(&model)
        .cells(60)
        .walks(1 << 14)
        .whole()
        .unwrap();
    let black = whole.functional(&Region::On(BLACK, 0.3)).unwrap();
    assert_eq!((black.estimate, black.std_error), (0.1, Some(0.0)));
    let all = whole.net_flux(&Region::Whole).unwrap();
    assert!(all.estimate.abs() < 4.5 * all.std_error.unwrap(), "{all:?}");
    let parts = (0..5).map(|part| whole.net_flux(&Region::Part(part)).unwrap().estimate);
    assert!((parts.sum::<f64>() - all.estimate).abs() < 1e-12);
    let (u, h) = (
        whole.functional(&Region::Part(FLOOR)),
        whole.irradiance(&Region::Part(FLOOR)),
    );
    let (u, h) = (u.unwrap(), h.unwrap());
    assert!((u.estimate - 0.5 * h.estimate).abs() < 1e-14);
    // Halving has found all edges of shadows: a kink is left of 10⁻⁸ of a cell.
    assert!(u.quadrature_error < 1e-8, "{u:?}");
}

/// What a sun gives to a floor past a black shelf, in closed form, wherever the shadow's edges lie in their cells: also next to an end, where no
/// point of a rule of Gauss sees them.
#[test]
fn shadows_of_a_sun_are_whole() {
    let grey = Material {
        reflectance: 0.7,
        emission: 0.0,
    };
    let length = 2.25;
    let towards = [-0.24, 1.0].map(|c: f64| c / 0.24_f64.hypot(1.0));
    for k in 0..12 {
        let [from, to] = [[0.55 + 0.013 * f64::from(k), 1.3], [1.3, 1.6]];
        let mut surfaces = Surfaces::default()
            .with("floor", &[[0.0, 0.0], [length, 0.0]], grey)
            .with("below", &[to, from], Material::BLACK)
            .with("above", &[from, to], Material::BLACK);
        surfaces.open = true;
        surfaces.outside = vec![Outside::Sun {
            towards,
            irradiance: 2.0,
        }];
        let model = RoomModel::new(surfaces, Scalar::F64).unwrap();
        let foot = |[x, y]: [f64; 2]| x - towards[0] / towards[1] * y;
        let exact = 2.0 * towards[1] * (1.0 - (foot(to) - foot(from)) / length);
        for cells in [20, 90, 400] {
            let solver = Solver::new(&model).cells(cells).degree(0).walks(4096);
            let found = solver.whole().unwrap().irradiance(&Region::Part(0));
            let off = found.unwrap().estimate - exact;
            assert!(off.abs() < 1e-8, "{k} {cells}: {off}");
        }
    }
}

/// Pixels and stretches of walls are what the global estimate says there.
#[test]
fn pictures_are_those_of_a_fine_solution() {
    let model = room(false);
    let fine = fine(&model);
    let positions: Vec<[f64; 2]> = (0..60)
        .map(|i| {
            [
                0.017 + 0.0333 * f64::from(i),
                (0.03 + 0.377 * f64::from(i)) % 1.0,
            ]
        })
        .collect();
    let stretches = [0.1, 0.5, 0.9].map(|middle| Stretch {
        wall: 0,
        middle,
        weight: 1,
    });
    let settings = fredholm::Settings {
        degree: Some(0),
        cells: Some(60),
        walks: Some(1 << 14),
        pairs: Some(Pairs::Pointwise),
        ..fredholm::Settings::default()
    };
    let request = FieldRequest {
        positions: &positions,
        stretches: &stretches,
        walk: &settings.walk_options(),
        beside: Beside::Nothing,
    };
    let field = model
        .whole_field(&settings.discretisation(), &request, &(), &|| ())
        .unwrap();
    let mut compared = 0;
    let mut compare = |spot: &Spot, region: Region| {
        if spot.value.is_nan() {
            // Within the box.
            assert!(fine.functional(&region).is_err());
            return;
        }
        let exact = fine.functional(&region).unwrap().iterate;
        // Student's t of 15 degrees of freedom is above 8 with a probability of 10⁻⁶, and quadrature leaves some 10⁻⁵.
        let off = (spot.value - exact).abs();
        assert!(off < 8.0 * spot.error + 5e-5, "{region:?} {spot:?} {exact}");
        compared += 1;
    };
    for (spot, at) in field.air.iter().zip(&positions) {
        compare(spot, Region::Point(at.to_vec()));
    }
    for (spot, stretch) in field.walls.iter().zip(stretches) {
        compare(spot, Region::On(FLOOR, stretch.middle));
    }
    assert!(compared > 55, "{compared}");
    assert_eq!(field.walks, 1 << 14);
    // Error bars, which take one point in three of a pixel's integral, are those of other walks as many: 16 replicates and 64 know a number of that kind to a fifth,
    // and all pixels of a few shapes of functions hardly better together.
    let whole = Solver::with(&model, settings, Vec::new()).whole().unwrap();
    let squares = field
        .air
        .iter()
        .zip(&positions)
        .filter(|(spot, _)| !spot.value.is_nan());
    let squares = squares.map(|(spot, at)| {
        let other = whole.functional(&Region::Point(at.to_vec())).unwrap();
        [spot.error.powi(2), other.std_error.unwrap().powi(2)]
    });
    let [own, other] = squares.fold([0.0; 2], |sums, of| [sums[0] + of[0], sums[1] + of[1]]);
    let ratio = f64::sqrt(own / other);
    println!("{ratio}");
    assert!((0.7..1.4).contains(&ratio), "{ratio}");
}

/// **Bands cover** the room everywhere at once, and the sphere; by day twelve seeds of each, in the long form 1,000.
#[test]
fn bands_cover() {
    let seeds = if is_long() { 1000 } else { 12 };
    let model = room(false);
    let fine = fine(&model);
    let walls = model.spread(60.0);
    let exact: Vec<f64> = fine
        .values(&walls)
        .unwrap()
        .iter()
        .map(|u| u.iterate)
        .collect();
    let sphere = sphere();
    let points = sphere.spread(80.0);
    let of = |region: &Region| sphere.exact(region).unwrap().unwrap();
    let on_sphere: Vec<f64> = points.iter().map(of).collect();
    let cases: [(&dyn Model, _, _, _); 2] = [
        (&model, 40, &walls, &exact),
        (&sphere, 50, &points, &on_sphere),
    ];
    for (model, cells, points, exact) in cases {
        let mut found = 0;
        for seed in 1..=seeds {
            let solver = Solver::new(model)
                .cells(cells)
                .degree(0)
                .seed(u64::from(seed))
                .walks(4096);
            let values = solver.whole().unwrap().values(points).unwrap();
            let within = |(value, exact): (&GlobalValue, &f64)| {
                (value.estimate - exact).abs() <= value.band.unwrap()
            };
            found += u32::from(values.iter().zip(exact).all(within));
        }
        let (kind, least) = (
            model.about().kind,
            fewest(seeds, GlobalEstimate::BAND_LEVEL, 1e-4),
        );
        println!("{kind}: {found} everywhere of {seeds}");
        assert!(found >= least, "{kind}: {found} of {seeds}");
    }
}

fn sphere() -> SphereModel {
    SphereModel::new(fredholm::sphere::Parameters {
        albedo: 0.6,
        asymmetry: 0.3,
        emission: [1.0, 0.2, 0.1, 0.5],
        forward: 0.2,
    })
}

/// Means and points of a sphere against the solution; with the
/// finest cells F + T_K v is u but for the error of the coefficients.
#[test]
fn a_sphere_has_its_solution() {
    let model = sphere();
    let (cells, spread) = if is_long() { (72, 100.0) } else { (32, 30.0) };
    let mut regions = model.spread(spread);
    regions.push(Region::Whole);
    for (estimator, absorption) in [(Estimator::Absorption, 0.2), (Estimator::Collision, 0.3)] {
        let walks = if is_long() { 1 << 24 } else { 1 << 15 };
        let solver = Solver::new(&model)
            .cells(cells)
            .walks(walks)
            .absorption(absorption);
        let whole = solver.estimator(estimator).score_degree(5).whole().unwrap();
        let summary = whole.summary();
        assert!(
            summary.truncation < 0.1 * summary.largest_std_error.unwrap(),
            "{summary:?}"
        );
        for (region, value) in regions.iter().zip(whole.values(&regions).unwrap()) {
            let exact = model.exact(region).unwrap().unwrap();
            let z = (value.estimate - exact) / value.std_error.unwrap();
            assert!(z.abs() < 5.6, "{region:?} {value:?} {exact}");
        }
    }
    // The mean has the square of the work of a point.
    regions.pop();
    let cells = if is_long() { 1800 } else { 800 };
    let fine = Solver::new(&model).cells(cells).walks(1).whole().unwrap();
    for (region, value) in regions.iter().zip(fine.values(&regions).unwrap()) {
        let exact = model.exact(region).unwrap().unwrap();
        assert!(
            (value.iterate - exact).abs() < 2e-3,
            "{region:?} {value:?} {exact}"
        );
    }
}

#[test]
fn threads_change_no_bit() {
    let model = room(false);
    threads_change_no_bit_of(&|| {
        let whole = Solver::new(&model).cells(30).walks(2000).whole().unwrap();
        whole.values(&regions(&model)).unwrap()
    });
}

#[test]
fn what_cannot_be_is_refused() {
    let model = room(false);
    let solver = Solver::new(&model).cells(20);
    refused(solver.clone().degree(4), "a `degree` of at most 3");
    let whole = solver.walks(1024).whole().unwrap();
    let air = Region::Point(vec![0.5, 0.5]);
    assert!(whole.functional(&air).unwrap().band.is_none());
    let message = whole.irradiance(&air).unwrap_err().to_string();
    assert!(message.contains("walls of a room"), "{message}");
    assert!(whole.net_flux(&Region::Weight(0)).is_err());
}
