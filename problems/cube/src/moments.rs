//! What T_K makes of piecewise polynomials, by quadrature.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::array::from_fn;
use fredholm_core::galerkin::{GalerkinError, legendre, reserve};
use fredholm_variance::gauss;

use crate::adaptive::integrals;
use crate::mesh::Mesh;
use crate::scores::{Axis, PER_AXIS, add_products};
use crate::{Cube, CubeError, CubeScores, KernelFactors, KernelFn, functions};

/// The integrals ∫_Xj K(x,y) ψ_jb(y) dy over all cells for a point x, with functions of any total degree ≤ p that is
/// known at run time, by Gauss rules of g points an axis on every cell.
///
/// Along every axis a cell is cut at y_a = x_a, where kernels have their kinks: |x_a − y_a| and what is smooth on both
/// sides of it loses no order. A rule of g points is exact for polynomials of degree 2g − 1 an axis.
///
/// A kernel that is singular there, like |x_a − y_a|^−a or its logarithm, is integrated in intervals that halve towards x_a:
/// see [`with_singularity`](Self::with_singularity). In one dimension jumps and kinks anywhere are found by cutting in two:
/// [`with_adaptive_rules`](Self::with_adaptive_rules).
///
/// ```
/// use fredholm_cube::{Cube, KernelMoments};
///
/// let kernel = |x: &[f64; 1], y: &[f64; 1]| (x[0] - y[0]).abs();
/// let cube = Cube::new(kernel, |_: &[f64; 1]| 1.0, 2, 0.2)?;
/// let moments = KernelMoments::new(&cube, 1, 2)?;
/// let mut out = [0.0; 4];
/// moments.fill(&kernel, &[0.25], &mut out)?;
/// // ∫|¼ − y| dy from 0 to ½, and from ½ to 1.
/// assert!((out[0] - 0.0625).abs() < 1e-15 && (out[2] - 0.25).abs() < 1e-15);
/// # Ok::<(), fredholm_cube::CubeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct KernelMoments<const D: usize> {
    mesh: Mesh<D>,
    degree: usize,
    functions: usize,
    /// Nodes in [−1, 1] and weights that sum to 2.
    rule: Vec<(f64, f64)>,
    /// The exponent a of a kernel like |x_a − y_a|^−a, if it is singular.
    exponent: Option<f64>,
    /// Whether cells are cut in two until the rules of both parts agree with that of the whole.
    adaptive: bool,
}

/// The distance from a singularity up to which the kernel is a power. Rounding of y moves a distance by a ten-thousandth
/// at most there, and the power has 10⁻⁶ of its integral on [0, 1] within it if a = ½.
const CLOSE: f64 = 1.0 / (1_u64 << 40) as f64;
/// The ratio of distances between which a rule is taken. What is like |x − y|^−a has its pole one such interval away.
const GRADING: f64 = 2.0;

/// A node of an axis: where it lies, its weight, and the polynomials of its cell there.
#[derive(Clone, Copy, Debug)]
struct Node {
    place: u32,
    y: f64,
    weight: f64,
    psi: Axis,
}

impl<const D: usize> KernelMoments<D> {
    /// The moments on the cells of a cube, of functions of this total degree or less, by g = `points` points.
    ///
    /// # Errors
    /// [`CubeError::Points`]: there is no point, or the degree is above [`CubeScores::MOST_DEGREE`];
    /// [`GalerkinError::Memory`] as [`CubeError::Galerkin`].
    pub fn new<K, S, const B: usize>(
        cube: &Cube<f64, D, K, S, B>,
        degree: usize,
        points: usize,
    ) -> Result<Self, CubeError> {
        if points == 0 || degree > CubeScores::<f64, D>::MOST_DEGREE {
            return Err(CubeError::Points);
        }
        Ok(Self {
            mesh: cube.mesh(),
            degree,
            functions: functions(D, degree),
            rule: gauss(points)?,
            exponent: None,
            adaptive: false,
        })
    }

    /// These moments of a kernel that is like |x_a − y_a|^−a along every axis where y comes near to x, with a < 1; a
    /// logarithm is like a small a. From a distance of 2⁻⁴⁰ on intervals double, so that the rules converge as fast as
    /// for smooth kernels. Nearer to x the kernel is taken for that power.
    ///
    /// ```
    /// use fredholm_cube::{Cube, KernelMoments};
    ///
    /// let kernel = |x: &[f64; 1], y: &[f64; 1]| (x[0] - y[0]).abs().powf(-0.25);
    /// let cube = Cube::new(kernel, |_: &[f64; 1]| 1.0, 1, 0.2)?;
    /// let moments = KernelMoments::new(&cube, 0, 8)?.with_singularity(0.25);
    /// let mut out = [0.0];
    /// moments.fill(&kernel, &[0.5], &mut out)?;
    /// let exact = 2.0 * 0.5_f64.powf(0.75) / 0.75;
    /// assert!((out[0] - exact).abs() < 1e-12);
    /// # Ok::<(), fredholm_cube::CubeError>(())
    /// ```
    #[must_use]
    pub const fn with_singularity(mut self, exponent: f64) -> Self {
        self.exponent = Some(exponent);
        self
    }

    /// These moments of a kernel that jumps or has kinks at places that nobody has named, in one dimension: intervals are cut in two until
    /// the rules of both parts agree with that of the whole to 10⁻¹² of the cell.
    ///
    /// ```
    /// use fredholm_cube::{Cube, KernelMoments};
    ///
    /// let kernel = |x: &[f64; 1], y: &[f64; 1]| if (x[0] - y[0]).abs() < 0.1 { 3.0 } else { 0.0 };
    /// let cube = Cube::new(kernel, |_: &[f64; 1]| 1.0, 1, 0.2)?;
    /// let moments = KernelMoments::new(&cube, 0, 4)?.with_adaptive_rules();
    /// let mut out = [0.0];
    /// moments.fill(&kernel, &[0.73], &mut out)?;
    /// assert!((out[0] - 0.6).abs() < 1e-11 && moments.is_rough(&kernel, &[0.73]));
    /// # Ok::<(), fredholm_cube::CubeError>(())
    /// ```
    #[must_use]
    pub const fn with_adaptive_rules(mut self) -> Self {
        self.adaptive = D == 1;
        self
    }

    /// Whether rules are adaptive.
    #[must_use]
    pub const fn is_adaptive(&self) -> bool {
        self.adaptive
    }

    /// Whether the kernel has a jump or a kink but for y = x, seen from `x`; in one dimension.
    #[must_use]
    pub fn is_rough(&self, kernel: &dyn KernelFn<f64, D>, x: &[f64; D]) -> bool {
        D == 1
            && (0..self.mesh.per_axis()).any(|place| self.over_cell(kernel, x, place, &|_| 1.0).1)
    }

    /// The cells in which a function has a jump or a kink, in one dimension, each with the coefficients of its projection.
    #[must_use]
    pub fn rough_cells(&self, f: &dyn Fn(&[f64; D]) -> f64) -> Vec<(usize, Vec<f64>)> {
        let m = f64::from(self.mesh.per_axis());
        let of = |place: u32| {
            let at = |t: f64| f(&[(f64::from(place) + 0.5 * (1.0 + t)) / m; D]);
            let (sums, is_rough) = integrals(&at, &[[-1.0, 1.0]], self.functions, &self.rule);
            let sums = sums.iter().take(self.functions).copied().collect();
            is_rough.then_some((place as usize, sums))
        };
        let cells = if D == 1 { self.mesh.per_axis() } else { 0 };
        (0..cells).filter_map(of).collect()
    }

    /// ∫ K(x,y) f(y) dy over a cell in one dimension, wherever K(x, ·) and f have jumps and kinks.
    #[must_use]
    pub fn rough_integral(
        &self,
        kernel: &dyn KernelFn<f64, D>,
        x: &[f64; D],
        cell: usize,
        f: &dyn Fn(&[f64; D]) -> f64,
    ) -> f64 {
        let place = u32::try_from(cell).unwrap_or(u32::MAX);
        let ([integral, ..], _) = self.over_cell(kernel, x, place, f);
        integral
    }

    /// ∫ K(x,y) f(y) ψ_b(y) dy over a cell in one dimension by adaptive rules, and whether K(x, ·) f has a jump or a kink there but for y = x.
    fn over_cell(
        &self,
        kernel: &dyn KernelFn<f64, D>,
        x: &[f64; D],
        place: u32,
        f: &dyn Fn(&[f64; D]) -> f64,
    ) -> (Axis, bool) {
        let m = f64::from(self.mesh.per_axis());
        let at = |t: f64| {
            let y = [(f64::from(place) + 0.5 * (1.0 + t)) / m; D];
            kernel.kernel(x, &y) * f(&y)
        };
        let cut = x
            .first()
            .map_or(1.0, |x| 2.0 * (x * m - f64::from(place)) - 1.0);
        let cut = cut.clamp(-1.0, 1.0);
        let all = [[-1.0, cut], [cut, 1.0]];
        let parts = all.iter().filter(|[from, to]| from < to).copied();
        let parts: Vec<[f64; 2]> = parts.collect();
        let (mut sums, is_rough) = integrals(&at, &parts, self.degree + 1, &self.rule);
        sums.iter_mut().for_each(|sum| *sum /= m);
        (sums, is_rough)
    }

    /// n·B.
    #[must_use]
    pub const fn unknowns(&self) -> usize {
        self.mesh.cells().saturating_mul(self.functions)
    }

    /// g.
    #[must_use]
    pub const fn points(&self) -> usize {
        self.rule.len()
    }

    /// The moments of any kernel at `x`, in up to (m + 1)^D g^D of its values.
    ///
    /// # Errors
    /// [`CubeError::Length`]: `out` has not n·B entries; [`CubeError::Galerkin`]: memory.
    pub fn fill(
        &self,
        kernel: &dyn KernelFn<f64, D>,
        x: &[f64; D],
        out: &mut [f64],
    ) -> Result<(), CubeError> {
        self.check(out.len())?;
        out.fill(0.0);
        if self.adaptive {
            let cells = out.chunks_exact_mut(self.functions);
            for (place, out) in (0..).zip(cells) {
                let (sums, _) = self.over_cell(kernel, x, place, &|_| 1.0);
                out.iter_mut().zip(sums).for_each(|(out, sum)| *out = sum);
            }
            return Ok(());
        }
        let axes = self.axes(x)?;
        let walk = Tensor {
            moments: self,
            axes: &axes,
            kernel,
            x,
        };
        walk.add(0, Partial::first(), out);
        Ok(())
    }

    /// The moments of a product kernel at `x`, in up to D (m + 1) g values of its factors.
    ///
    /// # Errors
    /// As [`fill`](Self::fill).
    pub fn fill_product(
        &self,
        factors: &dyn KernelFactors<f64>,
        x: &[f64; D],
        out: &mut [f64],
    ) -> Result<(), CubeError> {
        self.check(out.len())?;
        out.fill(0.0);
        let axes = self.axes(x)?;
        let m = self.mesh.per_axis() as usize;
        let mut tables: Vec<Axis> = reserve(m.saturating_mul(D))?;
        tables.resize(m.saturating_mul(D), [0.0; PER_AXIS]);
        let rows = tables.chunks_exact_mut(m);
        for (axis, (table, (nodes, &x))) in rows.zip(axes.iter().zip(x)).enumerate() {
            for node in nodes {
                let k = node.weight * factors.factor(axis, x, node.y);
                if let Some(row) = table.get_mut(node.place as usize) {
                    add_axis(row, k, &node.psi);
                }
            }
        }
        for (cell, out) in out.chunks_exact_mut(self.functions).enumerate() {
            let places = self.mesh.places(cell);
            let place = |a: usize| tables.get(a * m + places[a] as usize);
            let axes: [Axis; D] = from_fn(|a| place(a).copied().unwrap_or([f64::NAN; PER_AXIS]));
            add_products(&axes, self.degree, 1.0, &mut out.iter_mut());
        }
        Ok(())
    }

    fn check(&self, found: usize) -> Result<(), CubeError> {
        let expected = self.unknowns();
        if expected == found {
            Ok(())
        } else {
            Err(CubeError::Length { expected, found })
        }
    }

    /// The nodes of every axis, cell by cell.
    fn axes(&self, x: &[f64; D]) -> Result<[Vec<Node>; D], GalerkinError> {
        let mut axes = [const { Vec::new() }; D];
        for (nodes, &x) in axes.iter_mut().zip(x) {
            *nodes = self.axis(x)?;
        }
        Ok(axes)
    }

    fn axis(&self, x: f64) -> Result<Vec<Node>, GalerkinError> {
        let m = self.mesh.per_axis();
        let mut nodes = reserve((m as usize + 1).saturating_mul(self.rule.len()))?;
        for place in 0..m {
            if let Some(exponent) = self.exponent {
                self.add_graded(&mut nodes, place, x, exponent);
                continue;
            }
            // Where the axis is cut, in the coordinate of the cell.
            let cut = 2.0 * (x * f64::from(m) - f64::from(place)) - 1.0;
            if -1.0 < cut && cut < 1.0 {
                self.add_nodes(&mut nodes, place, [-1.0, cut]);
                self.add_nodes(&mut nodes, place, [cut, 1.0]);
            } else {
                self.add_nodes(&mut nodes, place, [-1.0, 1.0]);
            }
        }
        Ok(nodes)
    }

    /// Adds the rules of a cell on both sides of a singularity at x.
    fn add_graded(&self, nodes: &mut Vec<Node>, place: u32, x: f64, exponent: f64) {
        let m = f64::from(self.mesh.per_axis());
        let [low, high] = [0.0, 1.0].map(|end| (f64::from(place) + end) / m);
        for (side, distances) in [(1.0, [low - x, high - x]), (-1.0, [x - high, x - low])] {
            // In distances from x, none of which is what rounding leaves of 0.
            let [near, far] = distances.map(|distance| distance.max(0.0));
            let cell = |distance: f64| 2.0 * ((x + side * distance) * m - f64::from(place)) - 1.0;
            let mut from = near;
            if near < CLOSE && near < far {
                from = far.min(CLOSE);
                let before = Real::pow(near / from, 1.0 - exponent);
                nodes.push(Node {
                    place,
                    y: x + side * from,
                    weight: from / (1.0 - exponent) * (1.0 - before),
                    psi: legendre(cell(near)),
                });
            }
            while from < far {
                // A last interval that is hardly longer takes no rule of its own.
                let is_last = far < 1.5 * GRADING * from;
                let to = if is_last { far } else { GRADING * from };
                self.add_nodes(nodes, place, [cell(from), cell(to)]);
                from = to;
            }
        }
    }

    /// Adds the rule between two coordinates of a cell.
    fn add_nodes(&self, nodes: &mut Vec<Node>, place: u32, [from, to]: [f64; 2]) {
        let m = f64::from(self.mesh.per_axis());
        let half = 0.5 * (to - from);
        nodes.extend(self.rule.iter().map(|&(node, weight)| {
            let t = from + half * (1.0 + node);
            Node {
                place,
                y: (f64::from(place) + 0.5 * (1.0 + t)) / m,
                weight: Real::abs(0.5 * half * weight) / m,
                psi: legendre(t),
            }
        }));
    }
}

/// sums += factor · values.
fn add_axis(sums: &mut Axis, factor: f64, values: &Axis) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

/// Integrals over all cells, one axis after the other, the last one first to be added up.
struct Tensor<'a, const D: usize> {
    moments: &'a KernelMoments<D>,
    axes: &'a [Vec<Node>; D],
    kernel: &'a dyn KernelFn<f64, D>,
    x: &'a [f64; D],
}

/// What the first axes of a node say.
#[derive(Clone, Copy)]
struct Partial<const D: usize> {
    cell: usize,
    y: [f64; D],
    weight: f64,
    psi: [Axis; D],
}

impl<const D: usize> Partial<D> {
    const fn first() -> Self {
        Self {
            cell: 0,
            y: [0.0; D],
            weight: 1.0,
            psi: [[0.0; PER_AXIS]; D],
        }
    }
}

impl<const D: usize> Tensor<'_, D> {
    fn add(&self, axis: usize, partial: Partial<D>, out: &mut [f64]) {
        let m = self.moments.mesh.per_axis() as usize;
        let Some(nodes) = self.axes.get(axis) else {
            return;
        };
        for of_place in nodes.chunk_by(|a, b| a.place == b.place) {
            let mut next = partial;
            let place = of_place.first().map_or(0, |node| node.place as usize);
            next.cell = partial.cell * m + place;
            if axis + 1 == D {
                next.psi[axis] = [0.0; PER_AXIS];
                for node in of_place {
                    next.y[axis] = node.y;
                    let k = node.weight * self.kernel.kernel(self.x, &next.y);
                    add_axis(&mut next.psi[axis], k, &node.psi);
                }
                self.score(&next, out);
            } else {
                for node in of_place {
                    next.y[axis] = node.y;
                    next.weight = partial.weight * node.weight;
                    next.psi[axis] = node.psi;
                    self.add(axis + 1, next, out);
                }
            }
        }
    }

    fn score(&self, at: &Partial<D>, out: &mut [f64]) {
        let functions = self.moments.functions;
        let start = at.cell * functions;
        if let Some(out) = out.get_mut(start..start + functions) {
            let degree = self.moments.degree;
            add_products(&at.psi, degree, at.weight, &mut out.iter_mut());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{KernelMoments, Real};
    use crate::{Cube, CubeError, KernelFactors, KernelFn, Product};

    /// K = (1 + x y²)·|x − y| along every axis.
    #[derive(Clone, Copy)]
    struct Kink;
    impl KernelFactors<f64> for Kink {
        fn factor(&self, axis: usize, x: f64, y: f64) -> f64 {
            (1.0 + axis as f64 + x * y * y) * Real::abs(x - y)
        }
    }

    #[test]
    fn products_and_others_agree() {
        let x = [0.3, 0.61, 0.05];
        let kernel = Product(Kink);
        let cube = Cube::<f64, 3, _, _>::new(kernel, |_: &[f64; 3]| 1.0, 3, 0.2).unwrap();
        let moments = KernelMoments::new(&cube, 2, 3).unwrap();
        let mut all = [alloc::vec![0.0; 270], alloc::vec![0.0; 270]];
        let [one, other] = &mut all;
        moments.fill(&kernel, &x, one).unwrap();
        moments.fill_product(&Kink, &x, other).unwrap();
        for (one, other) in one.iter().zip(&*other) {
            assert!((one - other).abs() < 1e-15);
        }
        // A finer rule has nothing to add: 1 + xy² times |x − y| times ψ are of degree 5 on both sides.
        let finer = KernelMoments::new(&cube, 2, 7).unwrap();
        finer.fill(&kernel, &x, other).unwrap();
        for (one, other) in one.iter().zip(&*other) {
            assert!((one - other).abs() < 1e-15);
        }
    }

    /// Against closed forms, at points inside of cells, at their edges, next to them and at the ends of the interval.
    #[test]
    fn singular_kernels_are_integrated() {
        type Primitive = fn(f64) -> f64;
        // ∫₀ʳ d^−a dd and ∫₀ʳ d^−a d dd.
        let kernels: [(f64, Primitive, [Primitive; 2]); 3] = [
            (
                0.3,
                |d| Real::pow(d, -0.3),
                [|r| Real::pow(r, 0.7) / 0.7, |r| Real::pow(r, 1.7) / 1.7],
            ),
            (
                0.45,
                |d| Real::pow(d, -0.45),
                [|r| Real::pow(r, 0.55) / 0.55, |r| Real::pow(r, 1.55) / 1.55],
            ),
            (
                0.05,
                |d| Real::ln(d),
                [
                    |r| if r > 0.0 { r * Real::ln(r) - r } else { 0.0 },
                    |r| {
                        if r > 0.0 {
                            r * r * (0.5 * Real::ln(r) - 0.25)
                        } else {
                            0.0
                        }
                    },
                ],
            ),
        ];
        for (exponent, kernel, [zeroth, first]) in kernels {
            let kernel = |x: &[f64; 1], y: &[f64; 1]| kernel(Real::abs(x[0] - y[0]));
            let cube = Cube::<f64, 1, _, _>::new(kernel, |_: &[f64; 1]| 1.0, 4, 0.2).unwrap();
            let moments = KernelMoments::new(&cube, 1, 8).unwrap();
            let moments = moments.with_singularity(exponent);
            for x in [0.0, 1e-13, 0.1, 0.25, 0.25 + 1e-9, 0.5 - 1e-14, 0.61, 1.0] {
                let mut out = [0.0; 8];
                moments.fill(&kernel, &[x], &mut out).unwrap();
                for (j, out) in out.chunks_exact(2).enumerate() {
                    let [low, high] = [j, j + 1].map(|j| j as f64 / 4.0);
                    // ∫ over d from both sides of x, y = x ± d.
                    let signed = |f: Primitive, end: f64, odd: bool| {
                        let value = f(Real::abs(end - x));
                        if end < x && !odd { -value } else { value }
                    };
                    let mass = signed(zeroth, high, false) - signed(zeroth, low, false);
                    let lever = signed(first, high, true) - signed(first, low, true);
                    // ψ₁ = √3 (8 (y − middle)).
                    let middle = 0.5 * (low + high);
                    let linear = Real::sqrt(3.0) * 8.0 * (lever + (x - middle) * mass);
                    for (found, exact) in [(out[0], mass), (out[1], linear)] {
                        assert!(
                            (found - exact).abs() < 2e-10,
                            "{exponent} {x} {j} {found} {exact}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let kernel = |_: &[f64; 1], _: &[f64; 1]| 1.0;
        let cube = Cube::<f64, 1, _, _>::new(kernel, |_: &[f64; 1]| 1.0, 4, 0.2).unwrap();
        let none = KernelMoments::new(&cube, 1, 0).map(|_| ());
        assert_eq!(none, Err(CubeError::Points));
        assert!(KernelMoments::new(&cube, 8, 3).is_err());
        let moments = KernelMoments::new(&cube, 1, 1).unwrap();
        let kernel: &dyn KernelFn<f64, 1> = &kernel;
        let short = moments.fill(kernel, &[0.5], &mut [0.0; 7]);
        let length = CubeError::Length {
            expected: 8,
            found: 7,
        };
        assert_eq!(short, Err(length));
    }
}
