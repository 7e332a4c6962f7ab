//! Starts of global estimates: sums over all states of a closed scene, and over the starts of an open one, against exact answers.

use fredholm_core::global::{
    BasisScores, GlobalJob, GlobalTask, Replicate, ReplicateCounts, over_replicates,
};
use fredholm_core::sampled::{Sampled, StepControl};
use fredholm_scene::SkyLight;

use super::*;

const REPLICATES: usize = 64;

/// Means over the cells of a furnace of u = 1, and over all, from plain walks: nothing but the density of states makes them right.
/// Student's t of 63 degrees of freedom is above 5.6 in one of 82 values with a probability of 5·10⁻⁵.
fn check_in<F: Real>(scene: &Scene) {
    const MOST: f64 = 5.6;
    let place = Place::<F>::new(scene, 40);
    let radiosity = place.radiosity();
    let mean = place.mean();
    let (last, scores) = (LastStep(&radiosity), BasisScores::<_, 1>(&radiosity));
    let options = WalkOptions {
        absorption: ENDS[1],
        ..WalkOptions::default()
    };
    // v = 0 of a neighbour equation that knows cells.
    let cells = radiosity.cells();
    let zeros = vec![F::from_f64(0.0); 3 * cells];
    let tables = StepControl {
        v: &zeros[..cells],
        control: &zeros,
        integral: &zeros[..cells],
        per_axis: 1,
        events: &[],
        of_events: &[],
    };
    let nothing = Sampled::<_, 2, 1>::new(&last, tables, NonZeroU32::MIN).unwrap();
    let task = GlobalTask::new(&last, &mean, &nothing, &scores, options);
    let measure = |cell| radiosity.measure(cell);
    let rows = (0..REPLICATES).map(|number| {
        let (mut sums, mut means) = (vec![0.0; cells], vec![0.0; cells]);
        let counts = ReplicateCounts::default();
        let mut replicate = Replicate::new(number as u64, REPLICATES as u64, counts, &mut sums);
        task.run(&mut replicate, 400).unwrap();
        task.normalisation().fill(&sums, 400, measure, &mut means);
        means
    });
    let rows: Vec<Vec<f64>> = rows.collect();
    let mut over_all = [0.0; REPLICATES];
    for cell in (0..cells).filter(|&cell| radiosity.corners(cell).is_some()) {
        let known = radiosity.known(&radiosity.point(cell, &[0.3, 0.3]));
        let means: Vec<f64> = rows.iter().map(|row| known.to_f64() + row[cell]).collect();
        for (sum, mean) in over_all.iter_mut().zip(&means) {
            *sum += measure(cell) / place.mean().area().to_f64() * mean;
        }
        let mean = over_replicates(&means);
        let off = (mean.mean - 1.0).abs();
        assert!(off <= MOST * mean.std_error + 1e-5, "{cell}: {mean:?}");
    }
    let mean = over_replicates(&over_all);
    assert!((mean.mean - 1.0).abs() <= MOST * mean.std_error, "{mean:?}");
    assert!(mean.std_error < 0.01);
}

#[test]
fn states_have_the_density_of_starts() {
    let material = |s: usize| {
        let reflectance = [0.8, 0.3, 0.5, 0.1, 0.9, 0.6, 0.2][s % 7];
        Material {
            reflectance,
            emission: 1.0 - reflectance,
        }
    };
    let (_, surfaces) = closed_scenes().swap_remove(1);
    check_in::<f64>(&scene::<f64>(&surfaces, material));
    check_in::<f32>(&scene::<f32>(&surfaces, material));
    let court = scene_with::<f64>(&skylight::court(), material, Enclosure::Open).unwrap();
    check_in::<f64>(&court.with_sky(SkyLight::uniform(1.0).unwrap()).unwrap());
}
