//! The Galerkin solution, and whether variances are finite.

use fredholm_core::galerkin::{GalerkinError, Partition, Solution, buffer};
use fredholm_variance::gauss;

use crate::{MeanTable, Sphere};

impl Sphere<f64> {
    /// The Galerkin solution: solves (41) by Gauss–Seidel sweeps until no residual is above `tolerance` times the
    /// largest |F'_i|, at most `at_most` sweeps. F' is exact.
    ///
    /// # Errors
    /// As [`Solution::new`].
    pub fn solve(
        &self,
        table: &MeanTable,
        tolerance: f64,
        at_most: u32,
    ) -> Result<Solution, GalerkinError> {
        let mut source = buffer(self.cells())?;
        for (i, source) in source.iter_mut().enumerate() {
            *source = self.source_mean(i);
        }
        Solution::new(table, source, tolerance, at_most)
    }

    /// The spectral radius of T_k²p, up to rounding. Plain walks have a finite variance if it is below 1, and so have
    /// preconditioned ones up to the quality of h.
    ///
    /// k²p depends on x·y and is not negative: it is largest for the constant functions, to which T_k²p gives
    /// (1 − q)⁻¹ ½ ∫ (4πK)²/(1 + b c) dc over c from −1 to 1.
    ///
    /// ```
    /// use fredholm_sphere::{Parameters, Sphere};
    ///
    /// let even = Parameters {
    ///     albedo: 0.6,
    ///     asymmetry: 0.0,
    ///     emission: [1.0, 0.0, 0.0, 0.0],
    ///     absorption: 0.25,
    ///     forward: 0.0,
    /// };
    /// let radius = Sphere::new(2, 4, &even)?.second_moment_radius()?;
    /// assert!((radius - 0.6 * 0.6 / 0.75).abs() < 1e-14);
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn second_moment_radius(&self) -> Result<f64, GalerkinError> {
        let [_, forward] = self.albedo_and_forward();
        // The nearest poles, for g and b up to ½, are at c = 5/4 and −2: each point gains a factor of 4.
        let rule = gauss(40)?;
        let integral = rule.iter().map(|&(cosine, weight)| {
            let phase = self.phase(cosine);
            weight * phase * phase / (1.0 + forward * cosine)
        });
        Ok(0.5 * integral.sum::<f64>() / self.survival())
    }
}
