//! Error bars of scenes are honest: how many intervals of 1.96 standard errors contain the exact value.
//!
//! `FREDHOLM_LONG=1`: 1,000 seeds on 120 cells; else 12 on 60. `--nocapture` prints the shares.

use crate::is_long;
use fredholm_core::{Absorption, Batch, Estimate, Estimator};
use fredholm_model::{Goal, Model, Request, Scalar, Settings, WalkOptions, Wanted};
use fredholm_scene_model::{Enclosure, Material, NamedSurface, SceneModel, shapes};

const RHO: f64 = 0.6;
const LIGHT: f64 = 20.0;
const WALKS: u64 = 2000;

/// Surfaces of one reflectance, of which some are lamps: the mean of u over all is that of F over 1 − ρ, whatever hides what.
fn scene(shape: shapes::Shape, lamps: &[usize]) -> (SceneModel, f64) {
    let (mut area, mut light) = (0.0, 0.0);
    let surfaces = shape.surfaces.into_iter().enumerate();
    let surfaces = surfaces.map(|(number, polygons)| {
        let emission = if lamps.contains(&number) { LIGHT } else { 0.0 };
        NamedSurface {
            name: number.to_string(),
            polygons,
            material: Material {
                reflectance: RHO,
                emission,
            },
        }
    });
    let surfaces: Vec<NamedSurface> = surfaces.collect();
    let model = SceneModel::new(surfaces, Enclosure::Closed, Scalar::F64).unwrap();
    for face in model.scene().faces() {
        area += face.area;
        light += face.area * face.emission;
    }
    (model, light / area / (1.0 - RHO))
}

fn is_covered(estimate: Estimate, exact: f64) -> bool {
    (estimate.estimate - exact).abs() <= 1.96 * estimate.std_error.unwrap()
}

#[test]
fn intervals_contain_the_exact_value() {
    let (seeds, cells) = if is_long() { (1000, 120) } else { (12, 60) };
    let room = || shapes::room([0.0; 3], [1.0; 3]);
    let blocks = shapes::block([0.15, 0.15, 0.02], [0.45, 0.45, 0.6])
        .and(shapes::block([0.55, 0.5, 0.02], [0.85, 0.8, 0.3]));
    let lamp = shapes::block([0.4, 0.4, 0.97], [0.6, 0.6, 0.99]);
    // The lamp's underside is the first of its surfaces.
    let scenes = [
        ("cube", scene(room(), &[1])),
        ("blocks", scene(room().and(lamp).and(blocks), &[6])),
    ];
    for (name, (model, exact)) in &scenes {
        let settings = Settings {
            cells: Some(cells),
            degree: Some(1),
            ..Settings::default()
        };
        let cells = model.partition(&settings.discretisation()).unwrap();
        let system = cells.solve().unwrap();
        let goals = [Goal::new("all", model.whole())];
        let constant = |estimator| Absorption::Constant {
            probability: 0.25,
            estimator,
        };
        for absorption in [
            Absorption::Roulette,
            constant(Estimator::Absorption),
            constant(Estimator::Collision),
        ] {
            let mut covered = [0; 2];
            for seed in 1..=seeds {
                let walk = WalkOptions {
                    seed,
                    absorption,
                    ..settings.walk_options()
                };
                let request = Request {
                    goals: &goals,
                    walk: &walk,
                    wanted: Wanted::U,
                };
                system
                    .job(&request, &mut |prepared| {
                        let mut batches = [Batch::new(0, WALKS, WALKS)];
                        prepared.job.run(0, &mut batches, WALKS).unwrap();
                        let statistics = batches[0].statistics();
                        let both = [statistics.plain(), statistics.preconditioned()];
                        for (count, estimate) in covered.iter_mut().zip(both) {
                            *count += u64::from(is_covered(estimate, *exact));
                        }
                        Ok(())
                    })
                    .unwrap();
            }
            let n = seeds as f64;
            for (kind, count) in ["plain", "preconditioned"].into_iter().zip(covered) {
                let share = count as f64 / n;
                println!(
                    "{name:8} {absorption:?} {kind:15} {:.1} % of {seeds}",
                    100.0 * share
                );
                // Of twelve shares none is 3.5 standard deviations off in 994 of 1,000 files like this; few walks of skewed
                // scores cost up to half a per cent of coverage.
                let allowed = 3.5 * (0.95 * 0.05 / n).sqrt() + 0.005;
                assert!((share - 0.95).abs() < allowed, "{share}");
            }
        }
    }
}
