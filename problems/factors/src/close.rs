//! Rows of form factors that sum to 1.

use alloc::vec::Vec;

use fredholm_core::Real;

use crate::{Factors, FactorsError};

/// The largest difference of a row's sum from 1 that counts as none: rounding of a sum.
const CLOSED: f64 = 1e-15;

/// How many times at most factors are changed: once, and again where one would have been negative.
const PASSES: u32 = 8;

/// The most steps of conjugate gradients in a pass. For a matrix of which no row's diagonal is less than the sum of the
/// others, and few are equal, tens suffice.
const STEPS: u32 = 200;

impl Factors {
    /// Changes the form factors of a closed scene by the least that makes every row sum to 1, and says how far the
    /// sums were from 1 before.
    ///
    /// A_i F_ij becomes A_i F_ij (1 + λ_i + λ_j): of all symmetric changes that close the rows the one with the least sum of
    /// squares, each divided by the factor itself (Larsen and Howell 1986). It removes no error but that of the sums,
    /// which is what makes heat appear or vanish.
    ///
    /// ```
    /// use fredholm_factors::scene_factors;
    /// use fredholm_scene::{Enclosure, Scene, shapes};
    ///
    /// let both = shapes::room([0.0; 3], [1.0; 3]).and(shapes::block([0.25; 3], [0.75; 3]));
    /// let scene = Scene::new::<f64>(&both.surfaces(), Enclosure::Closed)?;
    /// let mut f = scene_factors(&scene, 1e-3)?;
    /// let off = f.close()?;
    /// assert!(off < 1e-3);
    /// assert!(f.row_sums().iter().all(|sum| (sum - 1.0).abs() < 1e-14));
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`FactorsError::Leaves`] if the scene is open.
    pub fn close(&mut self) -> Result<f64, FactorsError> {
        if self.is_open() {
            return Err(FactorsError::Leaves);
        }
        let before = self.gap();
        for _ in 0..PASSES {
            if self.gap() <= CLOSED {
                break;
            }
            let sums = self.times(&alloc::vec![1.0; self.areas().len()]);
            let rest = self.areas().iter().zip(&sums).map(|(a, s)| a - s);
            let lambda = multipliers(&|of| self.times(of), rest.collect());
            self.scale(&lambda);
        }
        Ok(before)
    }

    /// The largest difference of a row's sum from 1.
    fn gap(&self) -> f64 {
        let sums = self.row_sums();
        sums.iter()
            .fold(0.0, |m: f64, s| Real::max(m, (s - 1.0).abs()))
    }
}

/// λ with (D + G) λ = `rest`, where `times` is the product with a symmetric matrix G of numbers ≥ 0 and D has the sums of its rows: by conjugate
/// gradients, with D as preconditioner.
pub(crate) fn multipliers(times: &dyn Fn(&[f64]) -> Vec<f64>, mut rest: Vec<f64>) -> Vec<f64> {
    let n = rest.len();
    let sums = times(&alloc::vec![1.0; n]);
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
    let mut lambda = alloc::vec![0.0; n];
    let divided = |rest: &[f64]| -> Vec<f64> {
        let parts = rest.iter().zip(&sums);
        parts
            .map(|(r, s)| if *s > 0.0 { r / s } else { 0.0 })
            .collect()
    };
    let mut z = divided(&rest);
    let mut direction = z.clone();
    let mut size = dot(&rest, &z);
    let enough = 1e-32 * size;
    for _ in 0..STEPS {
        if !(size > enough) {
            break;
        }
        let mut image = times(&direction);
        for ((i, s), d) in image.iter_mut().zip(&sums).zip(&direction) {
            *i += s * d;
        }
        let step = size / dot(&direction, &image);
        for (((l, r), d), i) in lambda.iter_mut().zip(&mut rest).zip(&direction).zip(&image) {
            *l += step * d;
            *r -= step * i;
        }
        z = divided(&rest);
        let next = dot(&rest, &z);
        for (d, z) in direction.iter_mut().zip(&z) {
            *d = z + next / size * *d;
        }
        size = next;
    }
    lambda
}
