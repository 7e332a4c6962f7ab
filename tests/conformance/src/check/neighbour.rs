//! Checks of Galerkin coefficients, pairs and neighbour equations.

use std::collections::BTreeMap;

use fredholm_core::galerkin::{
    Basis, Cells, GalerkinMatrix, PairIntegral, PairKind, Pairs, TransitionMoments,
};
use fredholm_core::{
    DefaultGenerator, Density, Equation, Located, Neighbour, NeighbourOf, Real, RngUniforms,
    Uniforms, Value, WalkSeeds,
};

use super::chain::{integral, noise};
use super::{ROUNDING, UNITS, corners, different_cells, grid, samples};
use crate::description::{Description, PointOf, ScalarOf, epsilon};
use crate::galerkin::{System, normalised};
use crate::outcome::{Outcome, Sum, Worst};
use crate::quadrature::gauss_legendre;

/// How many points a check looks at.
const POINTS: usize = 24;

/// **The neighbour equation holds pointwise**: v(x) − (T_hp v)(x) − G(x) = 0, (50) of Heinrich
/// 1995, by quadrature at random x, in every channel. This is what makes the estimate unbiased. Of a G that is drawn it is the mean of
/// many samples that counts, within 4.9 of its standard errors.
#[must_use]
pub fn neighbour_equation<D, N, const B: usize>(
    description: &D,
    neighbour: &N,
    seed: u64,
) -> Outcome
where
    D: Description<B, Equation: Density>,
    N: NeighbourOf<D::Equation> + ?Sized,
{
    let mut worst = Worst::new(UNITS, ROUNDING);
    let mut sizes = BTreeMap::new();
    let channels = description.equation().channels();
    for x in samples(description, seed, POINTS) {
        let x = neighbour.locate(x.point);
        let integrals = integrals(description, neighbour, &x);
        // A polynomial is computed to ε of its size on the cell, not of its value at x.
        let on_cell = || {
            let at = corners::<D, B>().chain(grid::<D, B>(&[0.5]));
            let located = at.map(|t| Located {
                point: description.equation().point(x.cell, &t),
                cell: x.cell,
            });
            let sizes: Vec<Vec<f64>> = located.map(|x| terms(description, neighbour, &x)).collect();
            let largest = |c: usize| sizes.iter().map(|sizes| sizes[c]).fold(0.0, f64::max);
            (0..channels).map(largest).collect::<Vec<f64>>()
        };
        let on_cell = (B > 1).then(|| sizes.entry(x.cell).or_insert_with(on_cell).clone());
        let sources = mean_source(neighbour, &x, seed, SOURCE_SAMPLES);
        for (channel, (integral, source)) in integrals.into_iter().zip(sources).enumerate() {
            let mut sum = integral.sum;
            sum.add(source.mean);
            let value = neighbour.value(&x).get(channel).to_f64();
            let on_cell = on_cell.as_ref().map_or(0.0, |sizes| sizes[channel]);
            let size = (sum.size() + value.abs()).max(on_cell);
            // A mean of samples may be 4.9 standard errors off.
            let noise = 4.9 * source.std_error / ROUNDING;
            let unit = epsilon::<D, B>() * (size + integral.moved) + noise;
            worst.compare(value, sum.value(), unit, || {
                let Located { point, cell } = &x;
                format!("(T_hp v + G)(x) at x = {point:?} in cell {cell}, channel {channel}")
            });
        }
    }
    worst.outcome()
}

/// (T_hp v)(x) of a channel, and what the rounding of points does to it.
#[derive(Clone, Copy, Default)]
struct Integral {
    sum: Sum,
    moved: f64,
}

/// (T_hp v)(x) of every channel.
fn integrals<D, N, const B: usize>(
    description: &D,
    neighbour: &N,
    x: &Located<PointOf<D, B>>,
) -> Vec<Integral>
where
    D: Description<B, Equation: Density>,
    N: NeighbourOf<D::Equation> + ?Sized,
{
    let equation = description.equation();
    let mut all = vec![Integral::default(); equation.channels()];
    let mut largest = vec![0.0_f64; all.len()];
    for j in 0..equation.cells() {
        largest.fill(0.0);
        for (y, weight) in description.nodes(&x.point, j) {
            let y = neighbour.locate(y);
            let k = equation.kernel(&x.point, &y.point);
            let p = equation.density(&x.point, &y.point).to_f64();
            let hv = neighbour.kernel(x, &y, &k).times(&neighbour.value(&y));
            for (channel, (all, largest)) in all.iter_mut().zip(&mut largest).enumerate() {
                let hv = hv.get(channel).to_f64();
                *largest = largest.max(hv.abs());
                all.sum.add(weight * p * hv);
            }
        }
        let sensitivity = description.sensitivity(&x.point, j);
        for (all, largest) in all.iter_mut().zip(&largest) {
            all.moved += largest * sensitivity;
        }
    }
    all
}

/// The sum of the absolute values of v(x), G(x) and what (T_hp v)(x) is made of, of every channel.
fn terms<D, N, const B: usize>(
    description: &D,
    neighbour: &N,
    x: &Located<PointOf<D, B>>,
) -> Vec<f64>
where
    D: Description<B, Equation: Density>,
    N: NeighbourOf<D::Equation> + ?Sized,
{
    let sources = mean_source(neighbour, x, 1, SOURCE_SAMPLES);
    let all = integrals(description, neighbour, x)
        .into_iter()
        .zip(sources);
    let size = |(channel, (integral, source)): (usize, (Integral, Mean))| {
        let value = neighbour.value(x).get(channel).to_f64();
        integral.sum.size() + source.mean.abs() + value.abs()
    };
    all.enumerate().map(size).collect()
}

/// A mean of samples, by Welford's sums.
#[derive(Clone, Copy, Default)]
pub(super) struct Mean {
    pub(super) mean: f64,
    /// 0 where nothing is drawn.
    pub(super) std_error: f64,
    count: f64,
    squares: f64,
}

impl Mean {
    /// Adds a sample of every channel.
    pub(super) fn add_to_all(means: &mut [Self], samples: &[f64]) {
        for (mean, sample) in means.iter_mut().zip(samples) {
            mean.count += 1.0;
            let from = sample - mean.mean;
            mean.mean += from / mean.count;
            mean.squares += from * (sample - mean.mean);
        }
    }

    /// Computes the standard error.
    pub(super) fn finish(&mut self) {
        self.std_error = (self.squares / (self.count - 1.0) / self.count).sqrt();
    }
}

/// How many samples of a G that draws are taken. Of a G that varies by a hundredth of v this shows an error of 10⁻³ v.
const SOURCE_SAMPLES: u32 = 4096;

/// Numbers of a generator, counted.
struct Counted {
    draws: RngUniforms<DefaultGenerator>,
    count: u64,
}

impl<F: Real> Uniforms<F> for Counted {
    fn uniform(&mut self) -> F {
        self.count += 1;
        self.draws.uniform()
    }
}

/// The mean of G(x) of every channel, of so many samples if it is random.
pub(super) fn mean_source<N: Neighbour + ?Sized>(
    neighbour: &N,
    x: &Located<N::Point>,
    seed: u64,
    samples: u32,
) -> Vec<Mean> {
    let mut draws = Counted {
        draws: RngUniforms(WalkSeeds::<DefaultGenerator>::new(seed, 0).generator(0)),
        count: 0,
    };
    let source = |draws: &mut Counted| -> Vec<f64> {
        let source = neighbour.source(x, draws);
        (0..source.channels())
            .map(|c| source.get(c).to_f64())
            .collect()
    };
    let first = source(&mut draws);
    let mut means = vec![Mean::default(); first.len()];
    Mean::add_to_all(&mut means, &first);
    if draws.count > 0 {
        for _ in 1..samples {
            Mean::add_to_all(&mut means, &source(&mut draws));
        }
        means.iter_mut().for_each(Mean::finish);
    }
    means
}

/// **Integrals of pointwise pairs are exact**: ∫_Xj K(x,y) ψ_jb(y) dμ(y) by quadrature at random x, in every channel.
#[must_use]
pub fn pair_integrals<D, const B: usize>(description: &D, seed: u64) -> Outcome
where
    D: Description<B, Equation: Density + PairIntegral<B>>,
{
    let equation = description.equation();
    let mut worst = Worst::new(UNITS, ROUNDING);
    for x in samples(description, seed, POINTS) {
        for j in 0..equation.cells() {
            let nodes = description.nodes(&x.point, j).into_iter();
            let nodes: Vec<_> = nodes
                .map(|(point, weight)| {
                    let p = equation.density(&x.point, &point).to_f64();
                    let psi = equation.basis(&Located { point, cell: j });
                    (weight, p, equation.kernel(&x.point, &point), psi)
                })
                .collect();
            let found = equation.pair_integral(&x, j);
            for (channel, b) in (0..equation.channels()).flat_map(|c| (0..B).map(move |b| (c, b))) {
                let of_k = nodes.iter().map(|(weight, p, k, psi)| {
                    let k = k.get(channel).to_f64() * psi[b].to_f64();
                    (*weight, *p, k)
                });
                let largest = of_k.clone().fold(0.0, |m: f64, (_, _, k)| m.max(k.abs()));
                let terms = of_k.map(|(weight, p, k)| (weight, p * k));
                // As for moments: nodes are stored to ε of the size of X.
                let [expected, size] = integral(terms, noise(description));
                let moved = largest * description.sensitivity(&x.point, j);
                let unit = epsilon::<D, B>() * (size + moved);
                worst.compare(expected, found[b].get(channel).to_f64(), unit, || {
                    format!("the pair integral {b} from {:?} to cell {j}", x.point)
                });
            }
        }
    }
    worst.outcome()
}

/// **The lists of pairs are those of their kinds**: `pointwise(i, n)` and `outside(i, n)` name
/// every pair of their kinds once, and no other. A disagreement is a bias that no error bar shows.
#[must_use]
pub fn pair_lists<S: Pairs>(pairs: &S, cells: usize) -> Outcome {
    let mut worst = Worst::new("wrong entries", 0.0);
    let mut compare =
        |what: &str, i: usize, mut listed: Vec<usize>, of: &dyn Fn(PairKind) -> bool| {
            listed.sort_unstable();
            let kinds: Vec<usize> = (0..cells).filter(|&j| of(pairs.kind(i, j))).collect();
            let wrong = kinds.iter().filter(|j| !listed.contains(j)).count()
                + listed.iter().filter(|j| !kinds.contains(j)).count()
                + listed.windows(2).filter(|pair| pair[0] == pair[1]).count();
            let (expected, found) = (kinds.len() as f64, listed.len() as f64);
            worst.add(expected, found, wrong as f64, || {
                format!("the length of {what}({i}, {cells}), which lists {listed:?} for {kinds:?}")
            });
        };
    for i in 0..cells {
        let mut outside = Vec::new();
        pairs.outside(i, cells, &mut |j| outside.push(j));
        compare(
            "pointwise",
            i,
            pairs.pointwise(i, cells).collect(),
            &|kind| kind == PairKind::Pointwise,
        );
        compare("outside", i, outside, &|kind| kind != PairKind::Galerkin);
    }
    worst.outcome()
}

/// **On S no mass collapses**: r = p_j(x)/(its mean over the cell of x) is above min_mass_ratio = ¼ at the
/// ends, corners and edges of cells, not only inside. Where it collapses the variance of ζ is
/// infinite, and no short run shows it. At degree > 0 the smallest eigenvalue of M_j(x) takes the
/// place of p_j(x), and min_mass_ratio shrinks as it may: a density that vanishes linearly at the end of X_j, as on
/// the neighbours of a cell of the circle, has the eigenvalues 1 − t_b, t_b the nodes of the Gauss rule of B
/// points. `None` where no pair is in S.
#[must_use]
pub fn collapse<D, S: Pairs, const B: usize>(
    description: &D,
    pairs: &S,
    seed: u64,
) -> Option<Outcome>
where
    D: Description<B, Equation: TransitionMoments<B>>,
{
    let equation = description.equation();
    // min_mass_ratio/r ≤ 1.
    let mut worst = Worst::new("times min_mass_ratio/r", 1.0);
    let nodes = gauss_legendre(B);
    // Nodes on [0, 1], the first nearest to 0: 1 − t = 2 node.
    let min_mass_ratio = MIN_MASS_RATIO * nodes.iter().map(|(t, _)| 2.0 * t).fold(1.0, f64::min);
    let mut in_s = false;
    for i in different_cells(description, seed, 64) {
        let located = |t: Vec<f64>| Located {
            point: equation.point(i, &t),
            cell: i,
        };
        let inside: Vec<_> = normalised(description, i).collect();
        let all: Vec<_> = grid::<D, B>(&[0.5])
            .chain(corners::<D, B>())
            .chain(grid::<D, B>(&[1e-6, 0.5, 1.0 - 1e-6]))
            .map(located)
            .collect();
        for j in (0..equation.cells()).filter(|&j| pairs.kind(i, j) == PairKind::Galerkin) {
            let mass = |x: &Located<PointOf<D, B>>| {
                smallest_eigenvalue(equation.moments(x, j).map(|row| row.map(Real::to_f64)))
            };
            let mean: f64 = inside.iter().map(|(x, weight)| weight * mass(x)).sum();
            // Where no step leads there is no pair.
            if mean == 0.0 && all.iter().all(|x| mass(x) == 0.0) {
                continue;
            }
            in_s = true;
            for x in &all {
                let ratio = mass(x) / mean;
                // A negative or vanishing ratio is infinitely bad.
                let distance = if ratio > 0.0 {
                    min_mass_ratio / ratio
                } else {
                    f64::INFINITY
                };
                worst.add(min_mass_ratio, ratio, distance, || {
                    format!("r_ij at {:?} in cell {i}, j = {j}", x.point)
                });
            }
        }
    }
    in_s.then(|| worst.outcome())
}

/// min_mass_ratio of [`collapse`] at degree 0.
const MIN_MASS_RATIO: f64 = 0.25;

/// The smallest eigenvalue of a symmetric matrix, by Jacobi's rotations.
// Rows and columns of one matrix read best by index.
#[allow(clippy::needless_range_loop)]
fn smallest_eigenvalue<const B: usize>(mut m: [[f64; B]; B]) -> f64 {
    // Each round squares what is left off the diagonal.
    for _ in 0..10 * B {
        let mut turned = false;
        for p in 0..B {
            for q in p + 1..B {
                if m[p][q].abs() <= 1e-17 * (m[p][p].abs() + m[q][q].abs()) {
                    continue;
                }
                turned = true;
                let angle = 0.5 * (2.0 * m[p][q]).atan2(m[p][p] - m[q][q]);
                let (sin, cos) = angle.sin_cos();
                for row in &mut m {
                    (row[p], row[q]) = (cos * row[p] + sin * row[q], cos * row[q] - sin * row[p]);
                }
                for k in 0..B {
                    (m[p][k], m[q][k]) =
                        (cos * m[p][k] + sin * m[q][k], cos * m[q][k] - sin * m[p][k]);
                }
            }
        }
        if !turned {
            break;
        }
    }
    (0..B).map(|b| m[b][b]).fold(f64::INFINITY, f64::min)
}

/// **Coefficients are near the integrals**: K'_(ia)(jb) of a channel against those by quadrature over both cells
/// ([`crate::galerkin::matrix`]), within
/// `relative` of Σ_j ∫∫|K| over the row, or [`ROUNDING`] units of it where that is more, and what
/// [`Description::sensitivity`] says besides. As
/// approximate coefficients cost variance only, a problem says itself what it claims.
#[must_use]
pub fn coefficients<D: Description<B>, F: Real, const B: usize>(
    description: &D,
    expected: &[f64],
    coefficients: &dyn GalerkinMatrix<Scalar = F>,
    relative: f64,
) -> Outcome {
    let n = description.equation().cells();
    let mut worst = Worst::new("of what is claimed", 1.0);
    let rounding = ROUNDING * F::EPSILON.to_f64().max(epsilon::<D, B>());
    for i in 0..n {
        let row = |a: usize| &expected[(i * B + a) * n * B..][..n * B];
        let size = row(0).iter().map(|k| k.abs()).sum::<f64>();
        for j in 0..n {
            let moved = rounding * mean_sensitivity(description, i, j);
            let mut block = [[F::zero(); B]; B];
            coefficients.block(i, j, block.as_flattened_mut());
            for (a, found) in block.iter().enumerate() {
                for (b, found) in found.iter().enumerate() {
                    let found = found.to_f64();
                    let allowed = relative.max(rounding) * size + moved;
                    worst.compare(row(a)[j * B + b], found, allowed, || {
                        format!("K'_(i{a})(j{b}) for i = {i}, j = {j}")
                    });
                }
            }
        }
    }
    worst.outcome()
}

/// The mean over x in cell i of what the rounding of points does to ∫_Xj K(x,y) dμ(y).
fn mean_sensitivity<D: Description<B>, const B: usize>(description: &D, i: usize, j: usize) -> f64 {
    let equation = description.equation();
    let at = |(x, weight): (Located<PointOf<D, B>>, f64)| {
        let sensitivity = description.sensitivity(&x.point, j);
        if sensitivity == 0.0 {
            return 0.0;
        }
        let nodes = description.nodes(&x.point, j);
        let kernels = nodes.iter().map(|(y, _)| equation.kernel(&x.point, y));
        let largest = kernels.fold(0.0, |m: f64, k| m.max(k.largest().to_f64()));
        weight * largest * sensitivity
    };
    normalised(description, i).map(at).sum()
}

/// **F' is near the integrals**: (40) of the first channel by quadrature, within `relative` of the largest |F'|, or
/// [`ROUNDING`] units of it where that is more.
#[must_use]
pub fn source_means<D: Description<B>, const B: usize>(
    description: &D,
    means: &[f64],
    relative: f64,
) -> Outcome {
    let expected = crate::galerkin::right_hand_side(description, 0);
    vectors_agree::<D, B>("F'", &expected, means, relative)
}

/// **A vector of unknowns is another**, within `relative` of its largest entry.
pub(crate) fn vectors_agree<D: Description<B>, const B: usize>(
    what: &str,
    expected: &[f64],
    found: &[f64],
    relative: f64,
) -> Outcome {
    let mut worst = Worst::new("of what is claimed", 1.0);
    let size = expected.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let allowed = relative.max(ROUNDING * epsilon::<D, B>()) * size;
    worst.add(
        expected.len() as f64,
        found.len() as f64,
        if expected.len() == found.len() {
            0.0
        } else {
            f64::INFINITY
        },
        || format!("the number of unknowns of {what}"),
    );
    for (unknown, (&expected, &found)) in expected.iter().zip(found).enumerate() {
        worst.compare(expected, found, allowed, || {
            format!("{what} of cell {}, function {}", unknown / B, unknown % B)
        });
    }
    worst.outcome()
}

/// **A constant solution comes out constant**: with exact coefficients v = Σ v_ia ψ_ia is the
/// constant c, within rounding units of c/(1 − ‖K'‖), in every channel. `None` where the solution is not constant.
#[must_use]
pub fn constant<D: Description<B>, const B: usize>(
    description: &D,
    system: &System<ScalarOf<D, B>>,
) -> Option<Outcome> {
    let constants = description.constant()?;
    let mut worst = Worst::new(UNITS, ROUNDING);
    for (channel, exact) in system.exact.iter().enumerate() {
        let c = constants.get(channel);
        let unit = epsilon::<D, B>() * c.abs() / (1.0 - exact.radius_bound);
        for (unknown, &v) in exact.v.iter().enumerate() {
            let expected = if unknown % B == 0 { c } else { 0.0 };
            worst.compare(expected, v, unit, || {
                format!("v of cell {}, function {}", unknown / B, unknown % B)
            });
        }
    }
    Some(worst.outcome())
}

#[cfg(test)]
mod tests {
    use super::smallest_eigenvalue;

    #[test]
    fn eigenvalues_of_small_matrices() {
        assert_eq!(smallest_eigenvalue([[3.0]]), 3.0);
        assert!((smallest_eigenvalue([[2.0, 1.0], [1.0, 2.0]]) - 1.0).abs() < 1e-15);
        // 2 − √2, 2, 2 + √2
        let m = [[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]];
        assert!((smallest_eigenvalue(m) - (2.0 - 2.0_f64.sqrt())).abs() < 1e-14);
    }
}
