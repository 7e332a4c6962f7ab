//! Gauss–Legendre rules, and over polygons.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::array::from_fn;
use fredholm_surfaces::space::{Vector, cross, dot, norm, sub};

/// The most points of a rule.
pub(crate) const MOST: usize = 16;

/// Places in [0, 1] and weights with sum 1 of the rules with 1, 2, … points.
#[derive(Clone, Debug)]
pub(crate) struct Rules {
    all: Vec<Vec<(f64, f64)>>,
    /// What vertices are off by, in the scene's unit of length, if that is more than rounding errors of double precision.
    pub(crate) blur: f64,
}

impl Rules {
    pub(crate) fn new(blur: f64) -> Self {
        Self {
            all: (1..=MOST).map(legendre).collect(),
            blur,
        }
    }

    /// The rule with this many points.
    pub(crate) fn of(&self, points: usize) -> &[(f64, f64)] {
        let last = self.all.len() - 1;
        let rule = self.all.get(points.saturating_sub(1).min(last));
        rule.map_or(&[], Vec::as_slice)
    }

    /// Points of a convex polygon and their weights, whose sum is its area. A triangle's points are dense at its first vertex, a
    /// larger polygon is a fan around it, a quadrilateral is mapped from a square.
    pub(crate) fn polygon(
        &self,
        points: usize,
        polygon: &[Vector<f64>],
    ) -> Vec<(Vector<f64>, f64)> {
        let rule = self.of(points);
        let both = || {
            let pairs = rule.iter();
            pairs.flat_map(|&(s, ws)| rule.iter().map(move |&(t, wt)| (s, t, ws * wt)))
        };
        match polygon {
            [a, b, c, d] => both()
                .map(|(s, t, weight)| {
                    let at = from_fn(|k| {
                        (1.0 - t) * ((1.0 - s) * a[k] + s * b[k])
                            + t * ((1.0 - s) * d[k] + s * c[k])
                    });
                    let u = from_fn(|k| (1.0 - t) * (b[k] - a[k]) + t * (c[k] - d[k]));
                    let v = from_fn(|k| (1.0 - s) * (d[k] - a[k]) + s * (c[k] - b[k]));
                    (at, weight * norm(cross(u, v)))
                })
                .collect(),
            [hub, rest @ ..] => rest
                .windows(2)
                .flat_map(|pair| {
                    let (u, v) = (sub(pair[0], *hub), sub(pair[1], *hub));
                    let double = norm(cross(u, v));
                    both().map(move |(s, t, weight)| {
                        let at = from_fn(|k| hub[k] + s * ((1.0 - t) * u[k] + t * v[k]));
                        (at, weight * s * double)
                    })
                })
                .collect(),
            [] => Vec::new(),
        }
    }
}

/// The zeros of the Legendre polynomial by Newton's method, and the weights.
fn legendre(n: usize) -> Vec<(f64, f64)> {
    let count = n as f64;
    (0..n)
        .map(|k| {
            let mut x = -Real::cos(core::f64::consts::PI * (k as f64 + 0.75) / (count + 0.5));
            let mut slope = 1.0;
            for _ in 0..8 {
                let (mut before, mut at) = (1.0, x);
                for j in 2..=n {
                    let j = j as f64;
                    (before, at) = (at, ((2.0 * j - 1.0) * x * at - (j - 1.0) * before) / j);
                }
                if n == 1 {
                    slope = 1.0;
                } else {
                    slope = count * (x * at - before) / (x * x - 1.0);
                }
                x -= at / slope;
            }
            let weight = 1.0 / ((1.0 - x * x) * slope * slope);
            (0.5 * (1.0 + x), weight)
        })
        .collect()
}

/// The area of a planar convex polygon.
pub(crate) fn area(polygon: &[Vector<f64>]) -> f64 {
    0.5 * norm(double_area(polygon))
}

/// Twice the area vector.
pub(crate) fn double_area(polygon: &[Vector<f64>]) -> Vector<f64> {
    let Some((&hub, rest)) = polygon.split_first() else {
        return [0.0; 3];
    };
    rest.windows(2).fold([0.0; 3], |sum, pair| {
        let turn = cross(sub(pair[0], hub), sub(pair[1], hub));
        from_fn(|k| sum[k] + turn[k])
    })
}

/// The largest distance of a vertex from a point.
pub(crate) fn radius(polygon: &[Vector<f64>], from: Vector<f64>) -> f64 {
    let offsets = polygon.iter().map(|&p| sub(p, from));
    Real::sqrt(offsets.fold(0.0, |m: f64, d| Real::max(m, dot(d, d))))
}

#[cfg(test)]
mod tests {
    use super::{MOST, Rules};

    #[test]
    fn a_rule_of_n_points_integrates_powers_up_to_2n_less_1() {
        let rules = Rules::new(0.0);
        for n in 1..=MOST {
            assert_eq!(rules.of(n).len(), n);
            for power in 0..2 * n as i32 {
                let sum: f64 = rules.of(n).iter().map(|(x, w)| w * x.powi(power)).sum();
                let exact = 1.0 / f64::from(power + 1);
                // Every term is rounded, and the place it is taken at.
                let rounding = (4 + n) as f64 * f64::EPSILON;
                assert!((sum - exact).abs() < rounding, "{n} {power} {sum} {exact}");
            }
        }
    }
}
