//! Quadrature rules for descriptions.

/// Nodes and weights of the Gauss–Legendre rule of `degree` points on [0, 1].
///
/// # Panics
/// If `degree` is 0.
#[must_use]
pub fn gauss_legendre(degree: usize) -> Vec<(f64, f64)> {
    assert!(degree > 0, "a rule has at least one point");
    let rule = fredholm_variance::gauss(degree).expect("memory for a rule");
    rule.into_iter()
        .map(|(node, weight)| (0.5 + 0.5 * node, 0.5 * weight))
        .collect()
}

/// A rule on [0, 1] as one on [`from`, `to`], split at those of the `kinks` that lie inside.
#[must_use]
pub fn split(rule: &[(f64, f64)], from: f64, to: f64, kinks: &[f64]) -> Vec<(f64, f64)> {
    let mut ends: Vec<f64> = kinks
        .iter()
        .copied()
        .filter(|k| from < *k && *k < to)
        .collect();
    ends.extend([from, to]);
    ends.sort_by(f64::total_cmp);
    let parts = ends.windows(2).flat_map(|ends| {
        let (left, width) = (ends[0], ends[1] - ends[0]);
        rule.iter()
            .map(move |&(t, w)| (left + t * width, w * width))
    });
    parts.collect()
}

/// The tensor product of a rule for every axis.
#[must_use]
pub fn tensor<const D: usize>(axes: &[Vec<(f64, f64)>; D]) -> Vec<([f64; D], f64)> {
    let mut nodes = vec![([0.0; D], 1.0)];
    for (a, axis) in axes.iter().enumerate() {
        let longer = |&(mut point, weight): &([f64; D], f64)| {
            axis.iter()
                .map(|&(t, w)| {
                    point[a] = t;
                    (point, weight * w)
                })
                .collect::<Vec<_>>()
        };
        nodes = nodes.iter().flat_map(longer).collect();
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::{gauss_legendre, split, tensor};

    #[test]
    fn a_split_rule_integrates_a_kink() {
        let rule = split(&gauss_legendre(2), 1.0, 3.0, &[1.5, 0.5, 3.5]);
        assert_eq!(rule.len(), 4);
        let sum: f64 = rule.iter().map(|(t, w)| w * (t - 1.5_f64).abs()).sum();
        assert!((sum - 1.25).abs() < 1e-15);
    }

    #[test]
    fn a_tensor_rule_integrates_products() {
        let axis = gauss_legendre(2);
        let rule = tensor(&[axis.clone(), axis]);
        let sum: f64 = rule.iter().map(|([x, y], w)| w * x * x * y).sum();
        assert!((sum - 1.0 / 6.0).abs() < 1e-15);
    }
}
