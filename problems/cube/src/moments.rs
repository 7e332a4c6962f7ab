//! What T_K makes of piecewise polynomials, by quadrature.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::array::{Each, from_fn};
use fredholm_core::galerkin::{GalerkinError, buffer, functions, legendre, reserve};
use fredholm_variance::gauss;

use crate::adaptive::integrals;
use crate::functions::{Axis, PER_AXIS, add_products};
use crate::mesh::Mesh;
use crate::rule::add;
use crate::{Cube, CubeError, CubeScores, KernelFactors, KernelFn};

/// What rules for a kernel K(x, ·) are made for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum KernelShape {
    /// Smooth on both sides of y_a = x_a along every axis.
    #[default]
    Smooth,
    /// Like |x_a − y_a|^−a along every axis where y comes near to x, with a < 1; a
    /// logarithm is like a small a. From a distance of 2⁻⁴⁰ on intervals double, so that the rules converge as fast as
    /// for smooth kernels. Nearer to x the kernel is taken for that power.
    ///
    /// ```
    /// use fredholm_cube::{Cube, KernelMoments, KernelShape};
    ///
    /// let kernel = |x: &[f64; 1], y: &[f64; 1]| (x[0] - y[0]).abs().powf(-0.25);
    /// let cube = Cube::new(kernel, |_: &[f64; 1]| 1.0, 1)?;
    /// let moments = KernelMoments::new(&cube, 0, 8, KernelShape::Singular { exponent: 0.25 })?;
    /// let mut out = [0.0];
    /// moments.fill(&kernel, &[0.5], &mut out)?;
    /// let exact = 2.0 * 0.5_f64.powf(0.75) / 0.75;
    /// assert!((out[0] - exact).abs() < 1e-12);
    /// # Ok::<(), fredholm_cube::CubeError>(())
    /// ```
    Singular {
        /// a.
        exponent: f64,
    },
    /// Jumps or kinks at places that are not named, in one dimension: intervals are cut in two until
    /// the rules of both parts agree with that of the whole to 10⁻¹² of the cell. In several dimensions it is taken for smooth.
    ///
    /// ```
    /// use fredholm_cube::{Cube, KernelMoments, KernelShape};
    ///
    /// let kernel = |x: &[f64; 1], y: &[f64; 1]| if (x[0] - y[0]).abs() < 0.1 { 3.0 } else { 0.0 };
    /// let cube = Cube::new(kernel, |_: &[f64; 1]| 1.0, 1)?;
    /// let moments = KernelMoments::new(&cube, 0, 4, KernelShape::Rough)?;
    /// let mut out = [0.0];
    /// moments.fill(&kernel, &[0.73], &mut out)?;
    /// assert!((out[0] - 0.6).abs() < 1e-11 && moments.is_rough(&kernel, &[0.73]));
    /// # Ok::<(), fredholm_cube::CubeError>(())
    /// ```
    Rough,
}

/// The integrals ∫_Xj K(x,y) ψ_jb(y) dy over all cells for a point x, with functions of any total degree ≤ p that is
/// known at run time, by Gauss rules of g points an axis on every cell.
///
/// Along every axis a cell is cut at y_a = x_a, where kernels have their kinks: |x_a − y_a| and what is smooth on both
/// sides of it loses no order. A rule of g points is exact for polynomials of degree 2g − 1 an axis.
/// For singular kernels and for jumps see [`KernelShape`].
///
/// ```
/// use fredholm_cube::{Cube, KernelMoments, KernelShape};
///
/// let kernel = |x: &[f64; 1], y: &[f64; 1]| (x[0] - y[0]).abs();
/// let cube = Cube::new(kernel, |_: &[f64; 1]| 1.0, 2)?;
/// let moments = KernelMoments::new(&cube, 1, 2, KernelShape::Smooth)?;
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
    shape: KernelShape,
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

/// What the first axes of a node say.
#[derive(Clone, Copy)]
struct Partial<const D: usize> {
    cell: usize,
    y: [f64; D],
    weight: f64,
    psi: [Axis; D],
}

impl<const D: usize> KernelMoments<D> {
    /// The moments on the cells of a cube, of functions of this total degree or less, by g = `points` points.
    ///
    /// # Errors
    /// [`CubeError::Points`]; [`GalerkinError::Memory`] as [`CubeError::Galerkin`].
    pub fn new<F: Real, K, S, const B: usize>(
        cube: &Cube<F, D, K, S, B>,
        degree: usize,
        points: usize,
        shape: KernelShape,
    ) -> Result<Self, CubeError> {
        if points == 0 || degree > CubeScores::<D>::MOST_DEGREE {
            return Err(CubeError::Points);
        }
        Ok(Self {
            mesh: cube.mesh(),
            degree,
            functions: functions(D, degree),
            rule: gauss(points)?,
            shape,
        })
    }

    /// n·B.
    #[must_use]
    pub const fn unknowns(&self) -> usize {
        self.mesh.cells().saturating_mul(self.functions)
    }

    /// Whether the kernel has a jump or a kink but for y = x, seen from `x`; in one dimension.
    #[must_use]
    pub fn is_rough(&self, kernel: &dyn KernelFn<f64, D>, x: &[f64; D]) -> bool {
        let along = |y: f64| kernel.kernel(x, &[y; D]);
        D == 1 && (0..self.mesh.per_axis()).any(|place| self.over_cell(&along, x[0], place).1)
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
        let product = |y: f64| kernel.kernel(x, &[y; D]) * f(&[y; D]);
        let ([integral, ..], _) = self.over_cell(&product, x[0], place);
        integral
    }

    /// ∫ f(y) ψ_b(y) dy over a cell in one dimension by adaptive rules, and whether f has a jump or a kink there but at x.
    fn over_cell(&self, f: &dyn Fn(f64) -> f64, x: f64, place: u32) -> (Axis, bool) {
        let m = f64::from(self.mesh.per_axis());
        let at = |t: f64| f((f64::from(place) + 0.5 * (1.0 + t)) / m);
        let cut = (2.0 * (x * m - f64::from(place)) - 1.0).clamp(-1.0, 1.0);
        let parts = [[-1.0, cut], [cut, 1.0]];
        let parts = match cut {
            -1.0 => &parts[1..],
            1.0 => &parts[..1],
            _ => &parts[..],
        };
        let (sums, is_rough) = integrals(&at, parts, self.degree + 1, &self.rule);
        (sums.each(|sum| sum / m), is_rough)
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
        let along = |y: f64| kernel.kernel(x, &[y; D]);
        if self.fill_adaptively(&along, x, out)? {
            return Ok(());
        }
        let at = |y: &[f64; D]| kernel.kernel(x, y);
        let partial = Partial {
            cell: 0,
            y: [0.0; D],
            weight: 1.0,
            psi: [[0.0; PER_AXIS]; D],
        };
        self.add(&at, &self.axes(x)?, partial, out);
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
        if self.fill_adaptively(&|y| factors.factor(0, x[0], y), x, out)? {
            return Ok(());
        }
        let m = self.mesh.per_axis() as usize;
        let mut tables: Vec<Axis> = buffer(m.saturating_mul(D))?;
        let rows = tables.chunks_exact_mut(m).zip(self.axes(x)?);
        for (axis, (table, nodes)) in rows.enumerate() {
            for node in nodes {
                let k = node.weight * factors.factor(axis, x[axis], node.y);
                add(&mut table[node.place as usize], k, &node.psi);
            }
        }
        for (cell, out) in out.chunks_exact_mut(self.functions).enumerate() {
            let places = self.mesh.places(cell);
            let axes: [Axis; D] = from_fn(|a| tables[a * m + places[a] as usize]);
            add_products(&axes, self.degree, 1.0, &mut out.iter_mut());
        }
        Ok(())
    }

    /// Fills `out` with zeros, or with the moments of a function by adaptive rules: whether these were asked for.
    fn fill_adaptively(
        &self,
        f: &dyn Fn(f64) -> f64,
        x: &[f64; D],
        out: &mut [f64],
    ) -> Result<bool, CubeError> {
        CubeError::check_length(self.unknowns(), out.len())?;
        out.fill(0.0);
        let is_adaptive = D == 1 && self.shape == KernelShape::Rough;
        if is_adaptive {
            for (place, out) in (0..).zip(out.chunks_exact_mut(self.functions)) {
                let (sums, _) = self.over_cell(f, x[0], place);
                add(out, 1.0, &sums);
            }
        }
        Ok(is_adaptive)
    }

    /// Adds integrals over all cells, one axis after the other, the last one first to be added up.
    fn add(
        &self,
        kernel: &dyn Fn(&[f64; D]) -> f64,
        axes: &[Vec<Node>],
        partial: Partial<D>,
        out: &mut [f64],
    ) {
        let Some((nodes, rest)) = axes.split_first() else {
            return;
        };
        let axis = D - axes.len();
        for of_place in nodes.chunk_by(|a, b| a.place == b.place) {
            let mut next = partial;
            let place = of_place.first().map_or(0, |node| node.place as usize);
            next.cell = partial.cell * self.mesh.per_axis() as usize + place;
            next.psi[axis] = [0.0; PER_AXIS];
            for node in of_place {
                next.y[axis] = node.y;
                if rest.is_empty() {
                    let k = node.weight * kernel(&next.y);
                    add(&mut next.psi[axis], k, &node.psi);
                } else {
                    next.weight = partial.weight * node.weight;
                    next.psi[axis] = node.psi;
                    self.add(kernel, rest, next, out);
                }
            }
            let cell = next.cell * self.functions..(next.cell + 1) * self.functions;
            if rest.is_empty()
                && let Some(out) = out.get_mut(cell)
            {
                add_products(&next.psi, self.degree, next.weight, &mut out.iter_mut());
            }
        }
    }

    /// The nodes of every axis, cell by cell.
    fn axes(&self, x: &[f64; D]) -> Result<[Vec<Node>; D], GalerkinError> {
        let mut axes = [const { Vec::new() }; D];
        for (nodes, &x) in axes.iter_mut().zip(x) {
            *nodes = reserve((self.mesh.per_axis() as usize + 1).saturating_mul(self.rule.len()))?;
            for place in 0..self.mesh.per_axis() {
                if let KernelShape::Singular { exponent } = self.shape {
                    self.add_graded(nodes, place, x, exponent);
                    continue;
                }
                // Where the axis is cut, in the coordinate of the cell.
                let cut = 2.0 * (x * f64::from(self.mesh.per_axis()) - f64::from(place)) - 1.0;
                if -1.0 < cut && cut < 1.0 {
                    self.add_nodes(nodes, place, [-1.0, cut]);
                    self.add_nodes(nodes, place, [cut, 1.0]);
                } else {
                    self.add_nodes(nodes, place, [-1.0, 1.0]);
                }
            }
        }
        Ok(axes)
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
#[cfg(test)]
mod tests {
    use super::{KernelMoments, KernelShape, Real};
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
        let cube = Cube::<f64, 3, _, _>::new(kernel, |_: &[f64; 3]| 1.0, 3).unwrap();
        let moments = KernelMoments::new(&cube, 2, 3, KernelShape::Smooth).unwrap();
        let mut all = [alloc::vec![0.0; 270], alloc::vec![0.0; 270]];
        let [one, other] = &mut all;
        moments.fill(&kernel, &x, one).unwrap();
        moments.fill_product(&Kink, &x, other).unwrap();
        for (one, other) in one.iter().zip(&*other) {
            assert!((one - other).abs() < 1e-15);
        }
        // A finer rule has nothing to add: 1 + xy² times |x − y| times ψ are of degree 5 on both sides.
        let finer = KernelMoments::new(&cube, 2, 7, KernelShape::Smooth).unwrap();
        finer.fill(&kernel, &x, other).unwrap();
        for (one, other) in one.iter().zip(&*other) {
            assert!((one - other).abs() < 1e-15);
        }
    }

    /// Against closed forms, at points inside of cells, at their edges, next to them and at the ends of the interval.
    #[test]
    fn singular_kernels_are_integrated() {
        // d^−a and, for no exponent, ln d; and ∫₀ʳ of that times d^l dd.
        let power = |d: f64, a: Option<f64>| a.map_or(Real::ln(d), |a| Real::pow(d, -a));
        let primitive = |r: f64, l: f64, a: Option<f64>| match a {
            Some(a) => Real::pow(r, 1.0 + l - a) / (1.0 + l - a),
            None if r > 0.0 => Real::pow(r, 1.0 + l) * (Real::ln(r) - 1.0 / (1.0 + l)) / (1.0 + l),
            None => 0.0,
        };
        for (exponent, a) in [(0.3, Some(0.3)), (0.45, Some(0.45)), (0.05, None)] {
            let kernel = |x: &[f64; 1], y: &[f64; 1]| power(Real::abs(x[0] - y[0]), a);
            let cube = Cube::<f64, 1, _, _>::new(kernel, |_: &[f64; 1]| 1.0, 4).unwrap();
            let singular = KernelShape::Singular { exponent };
            let moments = KernelMoments::new(&cube, 1, 8, singular).unwrap();
            for x in [0.0, 1e-13, 0.1, 0.25, 0.25 + 1e-9, 0.5 - 1e-14, 0.61, 1.0] {
                let mut out = [0.0; 8];
                moments.fill(&kernel, &[x], &mut out).unwrap();
                for (j, out) in out.chunks_exact(2).enumerate() {
                    let [low, high] = [j, j + 1].map(|j| j as f64 / 4.0);
                    // ∫ over d from both sides of x, y = x ± d.
                    let signed = |end: f64, l: f64| {
                        let value = primitive(Real::abs(end - x), l, a);
                        if end < x && l == 0.0 { -value } else { value }
                    };
                    let [mass, lever] = [0.0, 1.0].map(|l| signed(high, l) - signed(low, l));
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
        let cube = Cube::<f64, 1, _, _>::new(kernel, |_: &[f64; 1]| 1.0, 4).unwrap();
        let of = |degree, points| KernelMoments::new(&cube, degree, points, KernelShape::Smooth);
        assert_eq!(of(1, 0).err(), Some(CubeError::Points));
        assert_eq!(of(8, 3).err(), Some(CubeError::Points));
        let moments = of(1, 1).unwrap();
        let kernel: &dyn KernelFn<f64, 1> = &kernel;
        let short = moments.fill(kernel, &[0.5], &mut [0.0; 7]);
        let length = CubeError::Length {
            expected: 8,
            found: 7,
        };
        assert_eq!(short, Err(length));
    }
}
