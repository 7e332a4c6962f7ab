//! Galerkin coefficients of a product kernel, from borrowed tables.

use core::slice;
use fredholm_core::array::{Each, from_fn};

use fredholm_core::Real;
use fredholm_core::galerkin::{Coefficients, GalerkinMatrix};

use crate::CubeError;
use crate::functions::{CellFunctions, Functions};
use crate::mesh::Mesh;
use crate::product::product;

/// The coefficients K'_ij = Π_a K'_a(i_a, j_a) of a product kernel, from one m × m table for every
/// axis, wherever it lies: in flash, on a stack. It needs no memory; with the feature `alloc`,
/// [`ProductTables`](crate::ProductTables) computes the tables, owns them and multiplies faster.
///
/// With functions of degree p on a cell, K'_(iα)(jβ) = Π_a K'_a(i_a α_a, j_a β_a) in the degrees α_a and β_a
/// along the axes, and a table has m (p + 1) rows: those of the p + 1 polynomials of the first place, then
/// those of the next.
///
/// ```
/// use fredholm_core::galerkin::GalerkinMatrix;
/// use fredholm_cube::FactorTables;
///
/// // Two axes of two cells.
/// let entries = [0.1, 0.2, 0.3, 0.4, 1.0, 0.5, 0.5, 1.0];
/// let factors = FactorTables::<f64, 2>::new(2, &entries)?;
/// // From cell (1, 0) to cell (0, 1).
/// assert_eq!(factors.mean(2, 1), 0.3 * 0.5);
/// # Ok::<(), fredholm_cube::CubeError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct FactorTables<'a, F, const D: usize, const B: usize = 1> {
    axes: Axes<'a, F, D>,
}

impl<'a, F: Real, const D: usize> FactorTables<'a, F, D> {
    /// The factors of piecewise constants: D tables of m² numbers, m = `per_axis`: that of axis 0 row by row, then
    /// that of axis 1, and so on.
    ///
    /// # Errors
    /// [`CubeError::Cells`], [`CubeError::Length`].
    pub fn new(per_axis: usize, entries: &'a [F]) -> Result<Self, CubeError> {
        Self::of_functions(per_axis, entries)
    }
}

impl<'a, F: Real, const D: usize, const B: usize> FactorTables<'a, F, D, B> {
    /// D tables of (m (p + 1))² numbers, m = `per_axis`, for the B functions of degree p.
    ///
    /// # Errors
    /// [`CubeError::Cells`], [`CubeError::Length`].
    pub fn of_functions(per_axis: usize, entries: &'a [F]) -> Result<Self, CubeError> {
        let mesh = Mesh::new(per_axis)?;
        let width = per_axis.checked_mul(Functions::<D, B>::PER_AXIS);
        let length = width.and_then(|width| width.checked_mul(width));
        let expected = length.and_then(|entries| entries.checked_mul(D));
        match expected {
            Some(expected) if expected == entries.len() => {
                let functions = Functions::<D, B>::ALL;
                Ok(Self::of_axes(Axes::new(mesh, functions, entries)))
            }
            Some(expected) => Err(CubeError::Length {
                expected,
                found: entries.len(),
            }),
            None => Err(CubeError::Cells),
        }
    }

    #[inline]
    pub(crate) const fn of_axes(axes: Axes<'a, F, D>) -> Self {
        Self { axes }
    }

    /// Contracts the first `axes` axes, the last of them first: `left` has a number for all degrees along
    /// these axes that sum to p or less, and `out` gets one for all degrees along them that sum to `most`
    /// or less, the first axis running fastest.
    fn contract_axes(
        &self,
        places: &[[u32; D]; 2],
        (axes, most): (usize, usize),
        left: &[F; B],
        out: &mut impl FnMut(F),
    ) {
        let Some(axis) = axes.checked_sub(1) else {
            let [first, ..] = left.as_slice() else { return };
            return out(*first);
        };
        let per_axis = Functions::<D, B>::PER_AXIS;
        let [row, column] = places.each(|places| {
            let place = places.get(axis).copied().unwrap_or(0);
            place as usize * per_axis
        });
        for degree in 0..=most {
            let along = |a: usize| self.axes.number(axis, row + a, column + degree);
            let mut sums = [F::zero(); B];
            let degrees = (axes, Functions::<D, B>::DEGREE);
            sum_last(&mut left.iter(), degrees, &along, &mut sums.iter_mut());
            self.contract_axes(places, (axis, most - degree), &sums, out);
        }
    }
}

/// Σ over the degree along the last of `axes` axes of `column` times what `left` has, for all degrees
/// along the other axes; all of them sum to `most` or less.
fn sum_last<F: Real>(
    left: &mut slice::Iter<'_, F>,
    (axes, most): (usize, usize),
    column: &impl Fn(usize) -> F,
    out: &mut slice::IterMut<'_, F>,
) {
    if axes > 1 {
        for degree in 0..=most {
            sum_last(left, (axes - 1, most - degree), column, out);
        }
    } else if let Some(out) = out.next() {
        let products = left.take(most + 1).enumerate();
        *out = products.fold(F::zero(), |sum, (a, &left)| sum + left * column(a));
    }
}

impl<F: Real, const D: usize, const B: usize> Coefficients<B> for FactorTables<'_, F, D, B> {
    /// Axis by axis, without the block: its B² products of D factors are sums of products.
    #[inline]
    fn left_times_block(&self, i: usize, j: usize, left: &[F; B]) -> [F; B] {
        let places = [self.axes.mesh.places(i), self.axes.mesh.places(j)];
        if const { B == 1 } {
            let [from, to] = places.each(|places| places.each(|place| place as usize));
            let number = |axis: usize| self.axes.number(axis, from[axis], to[axis]);
            let mean = product(from_fn::<_, D>(number));
            return left.each(|left| left * mean);
        }
        let mut out = [F::NAN; B];
        let mut turned = Functions::<D, B>::TURNED.iter();
        let degree = Functions::<D, B>::DEGREE;
        self.contract_axes(&places, (D, degree), left, &mut |sum| {
            if let Some(out) = turned.next().and_then(|&b| out.get_mut(b)) {
                *out = sum;
            }
        });
        out
    }
}

impl<F: Real, const D: usize, const B: usize> GalerkinMatrix for FactorTables<'_, F, D, B> {
    type Scalar = F;

    fn cells(&self) -> usize {
        self.axes.cells()
    }

    fn functions(&self) -> usize {
        B
    }

    fn entry(&self, row: [usize; 2], column: [usize; 2]) -> F {
        self.axes.entry(row, column)
    }

    fn row_sum(&self, i: usize) -> F {
        self.axes.row_sum(i)
    }

    fn rows_times(&self, i: usize, v: &[F], out: &mut [F]) {
        self.axes.rows_times(i, v, out);
    }
}

/// The tables of all axes, with the functions on a cell known at run time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axes<'a, F, const D: usize> {
    mesh: Mesh<D>,
    functions: CellFunctions<D>,
    /// m (p + 1), the rows of a table.
    width: usize,
    /// The entries of axis 0 row by row, then those of axis 1, and so on.
    entries: &'a [F],
}

impl<'a, F: Real, const D: usize> Axes<'a, F, D> {
    /// The factors of tables that have the right length.
    #[inline]
    pub(crate) const fn new(mesh: Mesh<D>, functions: CellFunctions<D>, entries: &'a [F]) -> Self {
        Self {
            mesh,
            functions,
            width: mesh.per_axis() as usize * functions.per_axis(),
            entries,
        }
    }

    #[cfg(feature = "alloc")]
    pub(crate) const fn width(&self) -> usize {
        self.width
    }

    /// Row `row` of the table of `axis`; empty where there is none.
    #[inline]
    pub(crate) fn row(&self, axis: usize, row: usize) -> &'a [F] {
        let start = (axis * self.width + row) * self.width;
        self.entries.get(start..start + self.width).unwrap_or(&[])
    }

    #[inline]
    fn number(&self, axis: usize, row: usize, column: usize) -> F {
        let at = (axis * self.width + row) * self.width + column;
        self.entries.get(at).copied().unwrap_or(F::NAN)
    }

    /// K'_(iα)(jβ) for the places of i and j and the degrees α and β.
    #[inline]
    fn coefficient(&self, places: [[u32; D]; 2], degrees: [&[u8; D]; 2]) -> F {
        let at = |side: usize, axis: usize| {
            let (place, degree) = (places[side][axis], degrees[side][axis]);
            place as usize * self.functions.per_axis() + degree as usize
        };
        let number = |axis: usize| self.number(axis, at(0, axis), at(1, axis));
        product(from_fn::<_, D>(number))
    }

    /// K'_(ia)(ia) for all a.
    #[cfg(feature = "alloc")]
    pub(crate) fn diagonal(&self, i: usize) -> impl Iterator<Item = F> {
        let places = [self.mesh.places(i); 2];
        let degrees = self.functions.degrees.iter();
        degrees.map(move |degrees| self.coefficient(places, [degrees; 2]))
    }
}

impl<F: Real, const D: usize> GalerkinMatrix for Axes<'_, F, D> {
    type Scalar = F;

    fn cells(&self) -> usize {
        self.mesh.cells()
    }

    fn functions(&self) -> usize {
        self.functions.count()
    }

    fn entry(&self, [i, a]: [usize; 2], [j, b]: [usize; 2]) -> F {
        let [from, to] = [a, b].each(|a| self.functions.degrees.get(a));
        let (Some(from), Some(to)) = (from, to) else {
            return F::NAN;
        };
        let places = [self.mesh.places(i), self.mesh.places(j)];
        self.coefficient(places, [from, to])
    }

    /// O(D m): the row sums of the factors, multiplied.
    fn row_sum(&self, i: usize) -> F {
        let places = self.mesh.places(i);
        let per_axis = self.functions.per_axis();
        product(from_fn::<_, D>(|a| {
            let row = self.row(a, places[a] as usize * per_axis);
            let means = row.iter().step_by(per_axis);
            means.fold(F::zero(), |sum, k| sum + k.abs())
        }))
    }

    /// Applies K' with the places of a cell once for all of its functions.
    fn rows_times(&self, i: usize, v: &[F], out: &mut [F]) {
        out.fill(F::zero());
        for (j, v) in v.chunks_exact(self.functions.count()).enumerate() {
            let places = [self.mesh.places(i), self.mesh.places(j)];
            for (out, row) in out.iter_mut().zip(self.functions.degrees) {
                for (&v, column) in v.iter().zip(self.functions.degrees) {
                    *out += self.coefficient(places, [row, column]) * v;
                }
            }
        }
    }
}
