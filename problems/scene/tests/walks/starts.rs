//! Starts of whole functions: sums over all states of a closed scene, and over the starts of an open one, against exact answers.

use fredholm_core::whole::{
    BasisScores, Replicate, ReplicateCounts, WholeJob, WholeTask, over_replicates,
};
use fredholm_core::{Neighbour, WalkOptions};
use fredholm_scene::{FaceStarts, SkyLight};

use super::*;

const REPLICATES: usize = 64;

/// A neighbour equation of v = 0 that knows cells.
struct Nothing<'a, F>(&'a Radiosity<'a, F>);

impl<F: Real> StateSpace for Nothing<'_, F> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real> Neighbour for Nothing<'_, F> {
    fn locate(&self, point: Point<F>) -> Located<Point<F>> {
        let cell = self.0.locate(&point);
        Located { point, cell }
    }

    fn kernel(&self, _: &Located<Point<F>>, _: &Located<Point<F>>, _: F) -> F {
        F::from_f64(0.0)
    }

    fn source(&self, _: &Located<Point<F>>, _: &mut dyn Uniforms<F>) -> F {
        F::from_f64(0.0)
    }

    fn value(&self, _: &Located<Point<F>>) -> F {
        F::from_f64(0.0)
    }
}

/// Means over the cells of a furnace of u = 1, and over all, from plain walks: nothing but the density of states makes them right.
/// Student's t of 63 degrees of freedom is above 5.6 in one of 82 values with a probability of 5·10⁻⁵.
fn check_in<F: Real>(scene: &Scene) {
    const MOST: f64 = 5.6;
    let (tables, cells) = (Tables::<F>::new(scene), Cells::new(scene, 40).unwrap());
    let radiosity = Radiosity::new(tables.geometry(), &cells, 0.3).unwrap();
    let all = Everywhere::<F>::new(scene);
    let starts = FaceStarts::new(&radiosity, &all.faces, &all.ends, scene.enclosure()).unwrap();
    let (last, scores) = (LastStep(&radiosity), BasisScores::<_, 1>(&radiosity));
    let options = WalkOptions {
        estimator: Estimator::Collision,
        ..WalkOptions::default()
    };
    let nothing = Nothing(&radiosity);
    let task = WholeTask::new(&last, &starts, &nothing, &scores, options);
    let measure = |cell| radiosity.measure(cell);
    let rows = (0..REPLICATES).map(|number| {
        let mut sums = vec![0.0; radiosity.cells()];
        let counts = ReplicateCounts::default();
        let mut replicate = Replicate::new(number as u64, REPLICATES as u64, counts, &mut sums);
        task.run(&mut replicate, 400).unwrap();
        let mut means = vec![0.0; radiosity.cells()];
        task.normalisation().fill(&sums, 400, measure, &mut means);
        means
    });
    let rows: Vec<Vec<f64>> = rows.collect();
    let mut over_all = [0.0; REPLICATES];
    for cell in 0..radiosity.cells() {
        let Some((face, _)) = radiosity.corners(cell) else {
            continue;
        };
        let known = radiosity.emission_of_light(face).to_f64();
        let means: Vec<f64> = rows.iter().map(|row| known + row[cell]).collect();
        for (sum, mean) in over_all.iter_mut().zip(&means) {
            *sum += measure(cell) / all.ends.last().unwrap().to_f64() * mean;
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
    let rho = [0.8, 0.3, 0.5, 0.1, 0.9, 0.6, 0.2];
    let material = grey(rho, rho.map(|rho| 1.0 - rho));
    let (_, surfaces) = closed_scenes().swap_remove(1);
    check_in::<f64>(&scene::<f64>(&surfaces, &material));
    check_in::<f32>(&scene::<f32>(&surfaces, &material));
    let mut court = shapes::room([0.0; 3], [1.0, 1.0, 0.6]).surfaces;
    court.remove(1);
    let court = scene_with::<f64>(&court, material, Enclosure::Open).unwrap();
    check_in::<f64>(&court.with_sky(SkyLight::uniform(1.0).unwrap()).unwrap());
}
