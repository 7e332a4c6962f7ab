//! What pilots are predicted to take, and what they tell.

use crate::room::{Material, Surfaces};
use crate::{CubeModel, Pairs, Region, RoomModel, Scalar, Settings, Tolerance};
use fredholm_model::{Ask, Target};

use super::super::family::Prediction;
use super::super::setting::Setting;
use super::{CONFIRM, FIRST, Search};

/// What a pilot tells of the first setting that is such.
fn piloted(
    search: &mut Search<'_>,
    pilots: &[u64],
    is_such: impl Fn(&Setting) -> bool,
) -> [Prediction; 2] {
    let all = search.candidates(None);
    let mut all = all.into_iter().filter(|of| is_such(&of.setting));
    let before = all.next().expect("a candidate");
    for &walks in pilots {
        search.try_out(&before, walks);
    }
    let of = |found: &&Prediction| found.setting == before.setting;
    let after = search.found().find(of).expect("a prediction");
    [before, *after]
}

fn at(x: &[f64]) -> [Target; 1] {
    [Target {
        name: "t".to_owned(),
        ask: Ask::One(Region::Point(x.to_vec())),
    }]
}

/// Boxes of rays are most of a set-up, and the system keeps them. Every further pilot was told to make them again, and so was the answer:
/// what seemed to save less than that was not tried.
#[test]
fn rays_are_set_up_once() {
    let material = |reflectance, emission| Material {
        reflectance,
        emission,
    };
    let walls = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
    let surfaces = Surfaces::default()
        .with("floor", &walls[..2], material(0.5, 1.0))
        .with(
            "rest",
            &[walls[1], walls[2], walls[3], walls[0]],
            material(0.4, 0.0),
        );
    let model = RoomModel::new(surfaces, Scalar::F64).unwrap();
    let targets = [Target {
        name: "t".to_owned(),
        ask: Ask::One(Region::Whole),
    }];
    let settings = Settings::default();
    let tolerance = Tolerance::Absolute(1e-8);
    let mut search = Search::new(&model, &targets, &settings, tolerance, &()).unwrap();
    let is_such =
        |of: &Setting| of.pairs == Pairs::Rays && of.degree == 2 && !of.last_step && !of.plain;
    let [before, after] = piloted(&mut search, &[FIRST], is_such);
    assert!(before.kept > 0.5 * before.setup, "{before:?}");
    let again = search.seconds_of(&after, CONFIRM);
    assert!(again < 0.2 * after.kept, "{again} {after:?}");
    // Walks with other pairs have not made them.
    let other = Prediction {
        setting: Setting {
            last_step: true,
            ..after.setting
        },
        ..after
    };
    assert!(search.seconds_of(&other, CONFIRM) > after.kept);
}

/// Walks are made in whole stages, so that many settings take as many: the one that leaves the least variance has the smallest error then.
#[test]
fn of_settings_with_as_many_walks_the_one_that_leaves_least_is_taken() {
    let model = CubeModel::from_fn::<1>(|x, y| 0.5 * f64::cos(x[0] - y[0]), |x| x[0]);
    let (targets, settings) = (at(&[0.37]), Settings::default());
    let tolerance = Tolerance::Absolute(1e-4);
    let search = Search::new(&model, &targets, &settings, tolerance, &()).unwrap();
    let [first, other, ..] = search.candidates(None)[..] else {
        panic!("no two candidates");
    };
    let of = |found: Prediction, setup, needed| Prediction {
        setup,
        careful: 1.0,
        needed,
        ..found
    };
    let best = |all: &[Prediction]| search.best_of(all.iter()).unwrap().needed;
    assert_eq!(best(&[of(first, 0.5, 400.0), of(other, 0.5, 300.0)]), 300.0);
    // Not if it takes longer.
    assert_eq!(best(&[of(first, 0.5, 400.0), of(other, 0.6, 300.0)]), 400.0);
}
