//! One channel, several, the way back, global estimates and pictures answer the same questions alike.

use crate::is_long;
use fredholm_core::global::{Replicate, ReplicateCounts, over_replicates};
use fredholm_core::{Absorption, Batch, Estimate, Estimator};
use fredholm_model::channels::ChannelNames;
use fredholm_model::{
    GlobalQuantity, GlobalRequest, Goal, IMAGE_HEAD, Model, Region, Request, Scalar, Settings,
    System, WalkOptions, Wanted, WholeValues,
};
use fredholm_rayon::Observer;
use fredholm_scene_model::{
    Beside, Camera, Colours, Enclosure, Material, NamedSurface, SceneModel, ViewRequest, shapes,
};

/// Walks of each estimate: with `FREDHOLM_LONG` 16,000.
fn walks() -> u64 {
    if is_long() { 16_000 } else { 8000 }
}

/// A room with a block and a small lamp on the ceiling, and its floor black: every reflectance times a number.
fn room(times: f64, scalar: Scalar) -> SceneModel {
    let shape = shapes::room([0.0; 3], [1.0; 3])
        .and(shapes::block([0.2, 0.2, 0.02], [0.5, 0.5, 0.5]))
        .and(shapes::block([0.4, 0.4, 0.97], [0.6, 0.6, 0.99]));
    let surfaces = shape.surfaces.into_iter().enumerate();
    let surfaces = surfaces.map(|(number, polygons)| NamedSurface {
        name: number.to_string(),
        polygons,
        material: material(number, times),
    });
    SceneModel::new(surfaces.collect(), Enclosure::Closed, scalar).unwrap()
}

fn material(number: usize, times: f64) -> Material {
    let reflectance = [0.0, 0.8, 0.5, 0.4, 0.7, 0.3];
    Material {
        reflectance: times * reflectance.get(number).unwrap_or(&0.6),
        // The first surface of the lamp is its underside.
        emission: if number == 12 { 30.0 } else { 0.01 },
    }
}

/// The room in so many channels, of which that of number c has reflectances times 1/(1 + c).
fn coloured(channels: usize) -> SceneModel {
    let model = room(1.0, Scalar::F64);
    let of = |number| {
        let all = (0..channels).map(|c| material(number, 1.0 / (1 + c) as f64));
        vec![all.collect()]
    };
    let materials = (0..model.names().len()).map(of).collect();
    let names = ChannelNames::new((0..channels).map(|c| c.to_string()).collect());
    model.with_colours(Colours { names, materials }).unwrap()
}

fn settings() -> Settings {
    Settings {
        cells: Some(if is_long() { 150 } else { 40 }),
        degree: Some(1),
        ..Settings::default()
    }
}

/// What may be asked of a scene.
fn regions() -> Vec<Region> {
    vec![
        Region::Whole,
        Region::Part(3),
        Region::Parts(vec![4, 2]),
        Region::Point(vec![1.0, 0.3, 0.6]),
        Region::Point(vec![0.7, 0.3, 0.6]),
        Region::Facing {
            at: [0.7, 0.3, 0.6],
            direction: [0.1, 0.0, 1.0],
        },
    ]
}

/// The estimates of all functionals of a request, and (v, Φ) of its goals.
fn solved(
    system: &dyn System,
    goals: &[Goal],
    absorption: Absorption,
) -> (Vec<Estimate>, Vec<f64>) {
    let walk = WalkOptions {
        absorption,
        ..settings().walk_options()
    };
    let request = Request {
        goals,
        walk: &walk,
        wanted: Wanted::All,
    };
    let (mut all, mut galerkin) = (Vec::new(), Vec::new());
    system
        .job(&request, &mut |prepared| {
            let shared = prepared.job.shared();
            for first in (0..prepared.job.goals()).step_by(shared) {
                let mut batches = vec![Batch::new(0, walks(), walks()); shared];
                prepared.job.run(first, &mut batches, walks()).unwrap();
                all.extend(
                    batches
                        .iter()
                        .map(|batch| batch.statistics().preconditioned()),
                );
            }
            galerkin = prepared.galerkin.to_vec();
            Ok(())
        })
        .unwrap();
    (all, galerkin)
}

fn of_channels(region: &Region, channels: usize) -> impl Iterator<Item = Goal> {
    let goal = Goal::new("goal", region.clone());
    (0..=channels).map(move |c| Goal {
        channel: Some(c),
        ..goal.clone()
    })
}

fn agree(a: &Estimate, b: &Estimate, what: &str) {
    let error = a.std_error.unwrap().hypot(b.std_error.unwrap());
    let off = (a.estimate - b.estimate).abs();
    assert!(
        off <= 5.0 * error + 1e-6 * a.estimate,
        "{what}: {a:?} {b:?}"
    );
    // A tenth of it with 16,000 walks.
    let most = 0.1 * (16_000.0 / walks() as f64).sqrt();
    assert!(error < most * a.estimate, "{what}: {a:?} {b:?}");
}

#[test]
fn channels_are_scenes_of_their_own() {
    let alone = [0, 1].map(|c| {
        let alone = room(1.0 / (1 + c) as f64, Scalar::F64);
        let goals: Vec<Goal> = regions()
            .iter()
            .map(|region| Goal::new("goal", region.clone()))
            .collect();
        let cells = alone.partition(&settings().discretisation()).unwrap();
        solved(&*cells.solve().unwrap(), &goals, Absorption::Roulette)
    });
    for channels in [2, 5] {
        let model = coloured(channels);
        let goals: Vec<Goal> = regions()
            .iter()
            .flat_map(|region| of_channels(region, channels))
            .collect();
        model.check_goals(&goals).unwrap();
        let cells = model.partition(&settings().discretisation()).unwrap();
        let system = cells.solve().unwrap();
        let (all, galerkin) = solved(&*system, &goals, Absorption::Roulette);
        assert_eq!((all.len(), galerkin.len()), (goals.len(), goals.len()));
        for (c, (own, of_v)) in alone.iter().enumerate() {
            for (number, own) in own.iter().take(of_v.len()).enumerate() {
                let place = number * (channels + 1) + c;
                agree(
                    own,
                    &all[place],
                    &format!("{channels} channels, {c} of {number}"),
                );
                let near = |v: f64| (v / own.estimate - 1.0).abs() < 0.1;
                assert!(
                    near(of_v[number]) && near(galerkin[place]),
                    "{number} {own:?} {of_v:?} {galerkin:?}"
                );
            }
        }
        let again = cells.restore(system.saved().unwrap().into_owned()).unwrap();
        assert_eq!(
            solved(&*again, &goals, Absorption::Roulette),
            (all, galerkin)
        );
    }
}

#[test]
fn the_way_back_has_the_same_means_and_irradiances() {
    for scalar in [Scalar::F32, Scalar::F64] {
        let model = room(1.0, scalar);
        // The floor is black: what arrives there takes walks of its own.
        let goals: Vec<Goal> = [Region::Part(0), Region::Part(3), Region::Whole]
            .map(|region| Goal::new("goal", region))
            .into();
        let settings = Settings {
            scalar,
            ..settings()
        };
        let cells = model.partition(&settings.discretisation()).unwrap();
        let (there, _) = solved(&*cells.solve().unwrap(), &goals, Absorption::Roulette);
        let adjoint = model.adjoint(&goals).unwrap();
        let cells = adjoint.partition(&settings.discretisation()).unwrap();
        let system = cells.solve().unwrap();
        let (back, galerkin) = solved(&*system, &goals, Absorption::Roulette);
        assert_eq!(
            (there.len(), back.len(), adjoint.shared(), galerkin.len()),
            (4, 4, 4, 3)
        );
        assert!(system.saved().is_none() && adjoint.about().whole == WholeValues::None);
        for (number, (there, back)) in there.iter().zip(&back).enumerate() {
            agree(there, back, &number.to_string());
        }
    }
}

#[test]
fn plain_walks_and_constant_absorption_agree() {
    let model = room(1.0, Scalar::F64);
    let goals: Vec<Goal> = regions()
        .iter()
        .map(|region| Goal::new("goal", region.clone()))
        .collect();
    let cells = model.partition(&settings().discretisation()).unwrap();
    let system = cells.solve().unwrap();
    let (roulette, _) = solved(&*system, &goals, Absorption::Roulette);
    let constant = Absorption::Constant {
        probability: 0.3,
        estimator: Estimator::Collision,
    };
    let (other, _) = solved(&*system, &goals, constant);
    for (number, (one, other)) in roulette.iter().zip(&other).enumerate() {
        agree(one, other, &number.to_string());
    }
    let walk = settings().walk_options();
    let request = Request {
        goals: &goals,
        walk: &walk,
        wanted: Wanted::U,
    };
    cells
        .plain_job(&request, &mut |prepared| {
            for (number, one) in roulette.iter().take(goals.len()).enumerate() {
                let mut batches = [Batch::new(0, 4 * walks(), 4 * walks())];
                prepared.job.run(number, &mut batches, u64::MAX).unwrap();
                agree(one, &batches[0].statistics().plain(), &number.to_string());
            }
            Ok(())
        })
        .unwrap();
}

#[test]
fn global_estimates_have_the_same_means() {
    const REPLICATES: u64 = 16;
    let model = room(1.0, Scalar::F64);
    let regions = [Region::Whole, Region::Part(3), Region::Part(7)];
    let goals = regions.clone().map(|region| Goal::new("goal", region));
    let cells = model.partition(&settings().discretisation()).unwrap();
    let system = cells.solve().unwrap();
    let (own, _) = solved(&*system, &goals, Absorption::Roulette);
    let system = system.whole().unwrap();
    let walk = WalkOptions {
        absorption: Absorption::Constant {
            probability: 0.3,
            estimator: Estimator::Collision,
        },
        ..settings().walk_options()
    };
    let request = GlobalRequest {
        walk: &walk,
        degree: 0,
        knows_first: false,
    };
    let mut rows = Vec::new();
    system
        .walks(&request, &mut |job| {
            for r in 0..REPLICATES {
                let (mut sums, mut out) = (vec![0.0; job.unknowns()], vec![0.0; job.unknowns()]);
                let mut replicate =
                    Replicate::new(r, REPLICATES, ReplicateCounts::default(), &mut sums);
                job.run(&mut replicate, 2000).unwrap();
                job.normalisation()
                    .fill(&sums, 2000, |cell| system.measure(cell), &mut out);
                rows.extend(out);
            }
            Ok(())
        })
        .unwrap();
    let field = system.field(&request, rows).unwrap();
    let width = IMAGE_HEAD + REPLICATES as usize;
    let images = field.images(GlobalQuantity::U, &regions).unwrap();
    for (own, image) in own.iter().zip(images.chunks_exact(width)) {
        let found = over_replicates(&image[IMAGE_HEAD..]);
        let all = Estimate {
            estimate: image[0] + found.mean,
            std_error: Some(found.std_error),
            std_dev: None,
        };
        agree(own, &all, "global");
    }
    assert_eq!(field.mesh().len() * width, field.mesh_images().len());
}

struct Nobody;
impl Observer for Nobody {}

#[test]
fn pictures_agree_with_plain_ones() {
    let camera = Camera {
        from: [0.9, 0.1, 0.6],
        towards: [0.3, 0.7, 0.3],
        angle: 60.0,
        size: [12, 9],
    };
    let walk = WalkOptions {
        walks: 30,
        ..settings().walk_options()
    };
    let request = ViewRequest {
        camera: &camera,
        walk: &walk,
        beside: Beside::Plain {
            walks: if is_long() { 2000 } else { 500 },
        },
    };
    for model in [room(1.0, Scalar::F64), coloured(2)] {
        let cut = settings().discretisation();
        let (view, plain) = model.view(&cut, &request, &Nobody, &|| ()).unwrap();
        let plain = plain.unwrap();
        let mut chi = 0.0;
        for (one, other) in view.pixels.iter().zip(&plain.pixels) {
            // Black pixels have no error.
            let errors = [one, other].map(|spot| spot.error.max(1e-6));
            let off = one.value - other.value;
            chi += off * off / (errors[0].powi(2) + errors[1].powi(2)) / 108.0;
        }
        // χ² of 108 degrees of freedom over that number, with errors that are estimates themselves.
        assert!(chi > 0.5 && chi < 2.0, "{chi}");
        let channels = model.channels().len().saturating_sub(1);
        assert_eq!(view.channels.len(), channels);
    }
}
