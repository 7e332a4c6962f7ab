//! What surfaces and points of a room receive: irradiance, net fluxes, directions.

use fredholm_core::{At, Estimator, Goal, NoNeighbour, Real, WalkOptions};
use fredholm_room::{Grading, Irradiance, Material, MeanOver, Seen};
use fredholm_tests::check::{STANDARD_ERRORS, long, means};
use fredholm_tests::room::{Drawing, Setup, WAYS, Way, assert_ok, block, furnace, glowing, scenes};
use fredholm_tests::{absorbed, run};

#[test]
fn irradiance_needs_no_reflectance() {
    // All is 1 where F = 1 − ρ: also what falls on a wall with ρ = 0.
    let drawing = glowing(&block());
    let drawing = Drawing {
        surfaces: (0..)
            .zip(drawing.surfaces)
            .map(|(s, (points, mut materials))| {
                if s == 0 {
                    materials = vec![Material {
                        reflectance: 0.0,
                        emission: 1.0,
                    }];
                }
                (points, materials)
            })
            .collect(),
        ..drawing
    };
    let setup = Setup::new::<f64>(&drawing, 100, Grading::default()).unwrap();
    setup.with::<f64, _>(Way::Rays, |room, neighbour, v| {
        let x = room.on_wall(0, 0.37).unwrap();
        let value = room.irradiance_of::<f64, 1>(&x, v);
        let point = Goal::new(Irradiance { room, of: At(x) }, Some(value));
        let options = absorbed(Estimator::Collision, 1);
        let statistics = run(room, neighbour, &point, options, 20_000);
        assert_ok(&drawing, "irradiance", means(&statistics, Some(1.0), 1e-13));
        let mean = Goal::new(
            Irradiance {
                room,
                of: MeanOver::new(room, 0..1).unwrap(),
            },
            None,
        );
        let statistics = run(room, neighbour, &mean, WalkOptions::default(), 20_000);
        let outcome = means(&statistics, Some(1.0), 1e-13);
        assert_ok(&drawing, "mean irradiance", outcome);
    });
}

/// A black plate above a lamp of radiosity 1 in empty space: what falls on a point is the form
/// factor, and walks leave.
#[test]
fn an_open_scene_loses_light() {
    let mut drawing = Drawing::new("plates")
        .line(&[[0.0, 0.0], [1.0, 0.0]], 0.0, 0.0)
        .line(&[[1.0, 0.5], [0.0, 0.5]], 0.5, 1.0);
    drawing.open = true;
    let setup = Setup::new::<f64>(&drawing, 50, Grading::default()).unwrap();
    let sine = |d: f64| d / (d * d + 0.25).sqrt();
    let exact = 0.5 * (sine(0.7) + sine(0.3));
    for way in WAYS {
        setup.with::<f64, _>(way, |room, neighbour, v| {
            let x = room.on_wall(0, 0.3).unwrap();
            let value = room.irradiance_of::<f64, 1>(&x, v);
            // The lamp gets nothing back from black: v is exact.
            assert!((value - exact).abs() < 1e-14);
            let point = Goal::new(Irradiance { room, of: At(x) }, Some(value));
            let options = absorbed(Estimator::Collision, 1);
            let statistics = run(room, neighbour, &point, options, 20_000);
            assert_ok(&drawing, "plates", means(&statistics, Some(exact), 1e-14));
            assert!(statistics.terminations().left > 1000);
        });
    }
}

/// What walls gain and lose in a furnace sums to nothing: the mean of u is that of H.
#[test]
fn the_energy_of_a_furnace_is_balanced() {
    let drawing = furnace();
    let setup = Setup::new::<f64>(&drawing, 400, Grading::default()).unwrap();
    setup.with::<f64, _>(Way::Rays, |room, neighbour, v| {
        let mean = MeanOver::everything(room);
        let out = Goal::new(mean.clone(), Some(mean.of(v)));
        let into = Goal::new(Irradiance { room, of: mean }, None);
        let (options, walks) = (WalkOptions::default(), 100_000);
        let out = run(room, neighbour, &out, options, walks).preconditioned();
        let options = WalkOptions { seed: 2, ..options };
        let into = run(room, neighbour, &into, options, walks).preconditioned();
        let [a, b] = [out, into].map(|e| e.std_error.unwrap());
        println!("u {} ± {a}, H {} ± {b} W/m²", out.estimate, into.estimate);
        assert!((out.estimate - into.estimate).abs() < STANDARD_ERRORS * (a * a + b * b).sqrt());
        assert!(a < 1e-3 * out.estimate && b < 1e-2 * into.estimate);
    });
    // And surface by surface, deterministically: the flux of a grey body is ε(σT⁴ − H).
    let grey = Material::grey(0.6, 1200.0);
    let black_body = fredholm_room::STEFAN_BOLTZMANN * 1200.0_f64.powi(4);
    assert!((grey.net_flux(1e5) - 0.6 * (black_body - 1e5)).abs() < 1e-9);
    // σ 1000⁴, CODATA 2018: 56,703.744 19 W m⁻².
    assert!((Material::grey(1.0, 1000.0).emission - 56_703.744_19).abs() < 1e-8);
}

/// Between two parallel plates, one of radiosity 1 and one black, a point sees the former in the
/// angle that it fills.
#[test]
fn a_point_between_walls_sees_them() {
    let mut drawing = Drawing::new("plates")
        .line(&[[0.0, 0.0], [1.0, 0.0]], 0.0, 0.0)
        .line(&[[1.0, 0.5], [0.0, 0.5]], 0.5, 1.0);
    drawing.open = true;
    let setup = Setup::new::<f64>(&drawing, 50, Grading::default()).unwrap();
    setup.with::<f64, _>(Way::Rays, |room, _, _| {
        let seen = |position| {
            let goal = Goal::new(Seen { room, position }, None);
            let none = NoNeighbour::new(room);
            run(room, &none, &goal, WalkOptions::default(), 50_000).plain()
        };
        let inside = seen([0.3, 0.2]);
        let angle = f64::atan2(0.7, 0.3) + f64::atan2(0.3, 0.3);
        let exact = angle / core::f64::consts::TAU;
        let off = (inside.estimate - exact).abs();
        assert!(off < STANDARD_ERRORS * inside.std_error.unwrap(), "{off}");
        // Above the lamp only its back is seen.
        assert_eq!(seen([0.3, 0.7]).estimate, 0.0);
        // The angles themselves, with 1 for v on the lamp, 0 on the other plate: rounding only.
        let lamp = |cell| f64::from(u8::from(room.partition().wall(cell) == Some(1)));
        let v: Vec<f64> = (0..room.partition().len()).map(lamp).collect();
        let of = |position| Seen { room, position }.of(&v);
        let [value, share] = of([0.3, 0.2]);
        let floor = (f64::atan2(0.3, 0.2) + f64::atan2(0.7, 0.2)) / core::f64::consts::TAU;
        assert!((value - exact).abs() < 1e-14, "{value} {exact}");
        assert!((share - exact - floor).abs() < 1e-14, "{share}");
        assert_eq!(of([0.3, 0.7]), [0.0, 0.0]);
    });
}

/// What hides the lamp hides it exactly: a baffle of half the room's height, seen from its shadow.
#[test]
fn a_baffle_takes_its_angle_from_the_lamp() {
    let drawing = Drawing::new("baffle")
        .line(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]], 0.0, 0.0)
        .line(&[[2.0, 1.0], [0.0, 1.0]], 0.0, 0.0)
        .line(&[[0.0, 1.0], [0.0, 0.0]], 0.0, 1.0)
        .line(&[[1.0, 0.5], [1.0, 0.0]], 0.0, 0.0)
        .line(&[[1.0, 0.0], [1.0, 0.5]], 0.0, 0.0);
    let setup = Setup::new::<f64>(&drawing, 60, Grading::default()).unwrap();
    setup.with::<f64, _>(Way::Exact, |room, _, v| {
        // The line from (1.5, y) over the baffle's top meets the lamp at 1.5 − 2y.
        for (y, lowest) in [(0.1, 1.3), (0.25, 1.0), (0.4, 0.7), (0.75, 0.0), (0.9, 0.0)] {
            let position = [1.5, y];
            let [value, share] = Seen { room, position }.of(v);
            let exact = if lowest < 1.0 {
                f64::atan2(1.0 - y, 1.5) - f64::atan2(lowest - y, 1.5)
            } else {
                0.0
            };
            let exact = exact / core::f64::consts::TAU;
            assert!((value - exact).abs() < 1e-14, "{y}: {value} {exact}");
            assert!((share - 1.0).abs() < 1e-14, "{y}: {share}");
        }
    });
}

/// In every scene: from a point in the room walls fill all directions, from one behind the walls
/// none; and walks of the neighbour equation agree with (v, Φ).
#[test]
fn walls_fill_all_directions_in_the_room_and_none_outside() {
    fn in_scalar<F: Real>(first: usize) {
        let (points, step) = if long() { (1500_u32, 1) } else { (750, 2) };
        let closed = scenes().into_iter().filter(|drawing| !drawing.open);
        for drawing in closed.skip(first).step_by(step) {
            let setup = Setup::new::<F>(&drawing, 100, Grading::default()).unwrap();
            setup.with::<F, _>(Way::Exact, |room, neighbour, v| {
                let ends = || room.geometry().walls().iter().flat_map(|wall| wall.ends);
                let at = |k: usize| ends().map(move |end| end[k].to_f64());
                let [low, high] = [
                    [0, 1].map(|k| at(k).fold(f64::INFINITY, f64::min)),
                    [0, 1].map(|k| at(k).fold(f64::NEG_INFINITY, f64::max)),
                ];
                let mut counts = [0_u32; 2];
                for i in 0..points {
                    // Kronecker's points, over a little more than the scene.
                    let place = [0, 1].map(|k: usize| {
                        let step = [0.754_877_666_246_692_7, 0.569_840_290_998_053_3][k];
                        let part = 1.2 * (f64::from(i) * step).fract() - 0.1;
                        F::from_f64(low[k] + part * (high[k] - low[k]))
                    });
                    let seen = Seen {
                        room,
                        position: place,
                    };
                    let [value, share] = seen.of(v);
                    // As many roundings as pieces of directions; all angles are below 2π.
                    let rounding = 1000.0 * F::EPSILON.to_f64();
                    let inside = share > 0.5;
                    counts[usize::from(inside)] += 1;
                    let expected = f64::from(u8::from(inside));
                    let off = (share - expected).abs();
                    assert!(off < rounding, "{} {place:?} {share}", drawing.name);
                    if inside && i % 100 == 0 {
                        let goal = Goal::new(seen, Some(value));
                        let options = absorbed(Estimator::Absorption, u64::from(i));
                        let control = run(room, neighbour, &goal, options, 4000).control();
                        let sigma = control.std_error.unwrap();
                        assert!(
                            control.estimate.abs() < STANDARD_ERRORS * sigma,
                            "{} {place:?} {control:?}",
                            drawing.name
                        );
                    }
                }
                assert!(
                    counts.iter().all(|&n| n > points / 15),
                    "{} {counts:?}",
                    drawing.name
                );
            });
        }
    }
    // By day every scene in one of both.
    in_scalar::<f64>(0);
    in_scalar::<f32>(usize::from(!long()));
}
