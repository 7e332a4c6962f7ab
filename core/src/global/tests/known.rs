//! What is known of F − G beforehand, and what walks score of the rest.

use super::*;

/// Coefficients of F − G, by two Gauss points a cell: F − G = x is of degree 1.
fn first(task: &ToyTask<'_, 32>) -> [f64; 6] {
    let mut known = [0.0; 6];
    for cell in 0..2 {
        for t in [-1.0, 1.0].map(|sign| sign / 3.0_f64.sqrt()) {
            let (x, first) = task.first(0.5 * (f64::from(cell) + 0.5 * (1.0 + t)));
            assert!(x.cell == cell as usize && (first - x.point).abs() < 1e-15);
            SCORES.add(&x, 0.5 * first, &mut known);
        }
    }
    known
}

/// The coefficients of R replicates of so many walks, with what is known.
fn all<const KEPT: usize, G: Generators>(task: &ToyTask<'_, KEPT, G>, walks: u64) -> Vec<[f64; 6]> {
    let mut all = coefficients(task, walks);
    for (out, known) in all
        .iter_mut()
        .flat_map(|out| out.iter_mut().zip(task.known()))
    {
        *out += known;
    }
    all
}

/// Whatever is known, coefficients are those of the error: the very F − G, and what is far from it. Of 6 · 8 · 6 = 288 values of t none is
/// beyond 4.9 but with probability 0.8 %.
#[test]
fn coefficients_are_those_of_the_error_whatever_is_known() {
    let far = [2.0, -1.0, 0.5, 0.0, 3.0, 1.0];
    for scores in ALL_SCORES {
        let task = task::<32>(&EVEN, scores);
        let near = first(&task);
        let mut starts = self::task::<1>(&EVEN, scores);
        starts.options.forced_steps = 2;
        for known in [near, far] {
            let (kept, one) = (task.with_known(&known), starts.with_known(&known));
            let (few, sobol) = (
                self::task::<2>(&EVEN, scores),
                one.with_generators(Sequence::Sobol),
            );
            for all in [
                all(&kept, 4000),
                all(&few.with_known(&known), 4000),
                all(&one, 4000),
                all(&sobol, 4096),
            ] {
                let z = largest_z_of(&all);
                assert!(z < 4.9, "{scores:?} {known:?} {z}");
            }
        }
    }
}
