//! Lines through measured points.

/// The slope of the least squares line through points (x, y).
///
/// ```
/// // By hand: the residuals 1/3, −2/3, 1/3 of y = x + 2/3 are orthogonal to 1 and x.
/// let slope = fredholm_tests::fit::slope(&[(0.0, 1.0), (1.0, 1.0), (2.0, 3.0)]);
/// assert!((slope - 1.0).abs() < 1e-15);
/// ```
#[must_use]
pub fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let products = points.iter().map(|p| (p.0 - x) * (p.1 - y));
    products.sum::<f64>() / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}
