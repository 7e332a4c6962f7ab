//! Small places in which a kernel is so large that walks have an infinite variance.

use core::array::from_fn;

use fredholm_core::resolvent::kronecker_point;

/// The number of points x = y in which the kernel is looked at: in one dimension neighbours are 10⁻⁴ apart at most.
const POINTS: u32 = 16_384;
/// The number of points of a small cube.
const FEW: u32 = 16;
/// The number of points of a cube that look for the middle of a spike.
const LOOKS: u32 = 64;
/// The number of halvings of its side: finer ones have no digits.
const HALVINGS: i32 = 40;

/// A point of [0, 1]^D.
fn point<const D: usize>(number: u32) -> [f64; D] {
    let all = kronecker_point(number);
    from_fn(|axis| all[axis])
}

/// The spectral radius of w ↦ ∫ K²(x, y) w(y) dy from below, by small cubes around the point x = y in which K² is the
/// largest: that of a part is at most that of all, and at least the least integral over it. `part`: of all points and halvings, where
/// a value takes long.
#[must_use]
pub fn squared_radius<const D: usize>(
    square: impl Fn(&[f64; D], &[f64; D]) -> f64,
    part: f64,
) -> f64 {
    let [points, halvings] =
        [f64::from(POINTS), f64::from(HALVINGS)].map(|all| (part * all).ceil());
    let at = |number| {
        let x = point(number);
        (square(&x, &x), x)
    };
    let all = (0..points as u32)
        .map(at)
        .filter(|(square, _)| square.is_finite());
    let Some((largest, top)) = all.max_by(|a, b| a.0.total_cmp(&b.0)) else {
        return 0.0;
    };
    let mut middle = top;
    let mut within = |halvings: i32| {
        let side = 0.5_f64.powi(halvings);
        let cube = |middle: [f64; D], number| {
            let within: [f64; D] = point(number);
            from_fn(|axis| {
                let low = (middle[axis] - 0.5 * side).clamp(0.0, 1.0 - side);
                low + side * within[axis]
            })
        };
        // The point that was found may be near the spike's edge: smaller cubes are in the middle of what is high in larger ones.
        let looks = (0..LOOKS).map(|number| cube(middle, number));
        let high: Vec<[f64; D]> = looks.filter(|x| square(x, x) >= 0.5 * largest).collect();
        if !high.is_empty() {
            let count = high.len() as f64;
            middle = from_fn(|axis| high.iter().map(|x| x[axis]).sum::<f64>() / count);
        }
        let points: Vec<[f64; D]> = (0..FEW).map(|number| cube(middle, number)).collect();
        // Without K(x, x), which may be the value of an integrable singularity.
        let sum = |(i, x)| {
            let others = points.iter().enumerate().filter(|&(j, _)| j != i);
            others.map(|(_, y)| square(x, y)).sum::<f64>()
        };
        let least = points
            .iter()
            .enumerate()
            .map(sum)
            .fold(f64::INFINITY, f64::min);
        // Where K is no number this tells nothing: that is found when coefficients are computed.
        let least = if least.is_finite() { least } else { 0.0 };
        least * side.powi(D as i32) / f64::from(FEW)
    };
    (1..=halvings as i32).map(&mut within).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::squared_radius;

    #[test]
    fn a_spike_has_a_large_radius_and_an_integrable_singularity_has_none() {
        let spike = |x: &[f64; 1], y: &[f64; 1]| {
            let is_near = |at: f64| (at - 0.5).abs() < 1e-4;
            if is_near(x[0]) && is_near(y[0]) {
                1e6
            } else {
                0.01
            }
        };
        // 10⁶ over a length of 2 · 10⁻⁴ is 200; halvings of the side tell half of it at least.
        let radius = squared_radius(spike, 1.0);
        assert!((100.0..=200.0).contains(&radius), "{radius}");
        let root = |x: &[f64; 1], y: &[f64; 1]| (x[0] - y[0]).abs().max(1e-12).powf(-0.6);
        let radius = squared_radius(root, 1.0);
        assert!(radius < 2.0, "{radius}");
        let hole = |_: &[f64; 1], y: &[f64; 1]| if y[0] > 0.999 { f64::NAN } else { y[0] };
        assert!(squared_radius(hole, 1.0) < 1.0);
        let constant = squared_radius(|_: &[f64; 3], _: &[f64; 3]| 0.9, 1.0);
        assert!((0.05..0.9).contains(&constant), "{constant}");
    }
}
