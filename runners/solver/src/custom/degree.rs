//! What takes the number of functions on a cell as a constant.

use fredholm_core::galerkin::{
    AllPointwise, Basis, Cells, Coefficients, Dense, DiagonalRule, GalerkinMatrix, PairIntegral,
    PairKind, Piecewise, Rounded, Solution, TransitionMoments, buffer, second_moment_radius,
};
use fredholm_core::{Located, Neighbour, Real, Space};

use super::CustomEquation;
use super::cells::Nodes;
use crate::Error;
use fredholm_model::pairs::AnyPairs;
use fredholm_rayon::fill_rows;

/// Which pairs are pointwise; all others are in S.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kinds {
    /// The pairs of the paper: see [`Degree::paper`].
    Paper,
    AllInS,
    DiagonalPointwise,
    AllPointwise,
}

/// All pairs in S.
pub(crate) const IN_S: DiagonalRule = DiagonalRule {
    diagonal: PairKind::Galerkin,
};
/// The diagonal pointwise.
const DIAGONAL: DiagonalRule = DiagonalRule {
    diagonal: PairKind::Pointwise,
};

impl Kinds {
    /// The pairs for an analysis, of a degree with these pairs of the paper.
    pub(crate) const fn any(self, paper: DiagonalRule) -> AnyPairs {
        match self {
            Self::Paper => AnyPairs::Diagonal(paper),
            Self::AllInS => AnyPairs::Diagonal(IN_S),
            Self::DiagonalPointwise => AnyPairs::Diagonal(DIAGONAL),
            Self::AllPointwise => AnyPairs::AllPointwise,
        }
    }
}

/// A neighbour equation of any kind: one type of walk for all.
pub(crate) type Boxed<'a, E> = dyn Neighbour<
        Scalar = <E as Space>::Scalar,
        Point = <E as Space>::Point,
        Value = <E as Space>::Scalar,
    > + Sync
    + 'a;

/// What is done with a neighbour equation and its v.
pub(crate) type Use<'a, E> =
    dyn FnMut(&Boxed<'_, E>, &[<E as Space>::Scalar]) -> Result<(), Error> + 'a;

/// What a neighbour equation is made of, besides its pairs.
pub(crate) struct Of<'a, E> {
    pub(crate) equation: &'a E,
    /// The numbers that the degree keeps of K'.
    pub(crate) entries: &'a [f64],
    pub(crate) solution: &'a Solution,
}

/// Coefficients of any form.
pub(crate) type Closed<'e> = Box<dyn GalerkinMatrix<Scalar = f64> + Sync + 'e>;

/// The dense table of K' of an equation with so many functions on a cell.
fn dense<'e>(
    equation: &impl Cells,
    entries: &'e [f64],
    functions: usize,
) -> Result<Dense<'e, f64>, Error> {
    let table = Dense::new(entries, equation.cells(), functions);
    table.ok_or(Error::Internal("a table has a wrong size"))
}

/// Which pairs of cells a neighbour equation may have.
#[derive(Clone, Copy)]
pub(crate) struct DegreePairs {
    /// Whether pairs may be pointwise.
    pub(crate) pointwise: bool,
    /// The pairs of the paper.
    pub(crate) paper: DiagonalRule,
    /// The pairs unless they are given.
    pub(crate) default: Kinds,
}

/// All pairs are in S.
const ALL_IN_S: DegreePairs = DegreePairs {
    pointwise: false,
    paper: IN_S,
    default: Kinds::AllInS,
};

/// Functions on a cell, whose number the steps of walks take as a constant. It is object safe, so that an equation may
/// have several degrees.
pub(crate) trait Degree<E: CustomEquation>: Send + Sync {
    /// B.
    fn functions(&self) -> usize;

    /// Which pairs there may be.
    fn pairs(&self) -> DegreePairs {
        ALL_IN_S
    }

    /// The number of numbers that are kept of K' on so many cells, if memory can be counted: (n·B)², unless K' has a form of its own. 0: it is
    /// a closed form.
    fn stored(&self, cells: usize) -> Option<usize> {
        let unknowns = cells.checked_mul(self.functions())?;
        unknowns.checked_mul(unknowns)
    }

    /// Values of the kernel that K' takes on so many cells, by a rule of so many points in each.
    fn evaluations(&self, cells: usize, points: f64) -> f64 {
        (cells as f64 * points).powi(2)
    }

    /// The numbers that are kept of K', by a rule of so many points of a cell and axis.
    fn entries(&self, equation: &E, points: usize) -> Result<Vec<f64>, Error>;

    /// K' of these numbers: a dense table, unless it has a form of its own.
    fn matrix<'e>(&self, equation: &'e E, entries: &'e [f64]) -> Result<Closed<'e>, Error> {
        Ok(Box::new(dense(equation, entries, self.functions())?))
    }

    /// The functions themselves.
    fn on_cells(&self) -> &dyn OnCells<E>;

    /// Hands out the neighbour equation with these pairs.
    fn with_neighbour(
        &self,
        of: &Of<'_, E>,
        kinds: Kinds,
        then: &mut Use<'_, E>,
    ) -> Result<(), Error>;

    /// The spectral radius of T_h²p, estimated.
    fn neighbour_radius(
        &self,
        of: &Of<'_, E>,
        nodes: &Nodes<E::Point>,
        kinds: Kinds,
    ) -> Result<f64, Error>;
}

/// Functions on the cells of an equation.
pub(crate) trait OnCells<E: CustomEquation>: Sync {
    /// The means over every cell of a function times each function on the cell.
    fn means(
        &self,
        equation: &E,
        nodes: &Nodes<E::Point>,
        function: &dyn Fn(&E::Point) -> f64,
    ) -> Vec<f64>;

    /// Σ_a c_ia ψ_ia(x) for x in cell i.
    fn series(&self, equation: &E, coefficients: &[f64], x: &Located<E::Point>) -> f64;
}

/// B functions on a cell, with all pairs in S.
#[derive(Debug)]
pub(crate) struct Smooth<const B: usize>;

/// B functions on a cell, with pairs of any kind.
#[derive(Debug)]
pub(super) struct WithIntegrals<const B: usize>;

impl<E: CustomEquation + TransitionMoments<B>, const B: usize> OnCells<E> for Smooth<B> {
    fn means(
        &self,
        equation: &E,
        nodes: &Nodes<E::Point>,
        function: &dyn Fn(&E::Point) -> f64,
    ) -> Vec<f64> {
        let mut means = vec![0.0; nodes.cells() * B];
        for (cell, means) in means.chunks_exact_mut(B).enumerate() {
            for (point, share) in nodes.shares(cell) {
                let value = share * function(&point);
                let psi = Basis::<B>::basis(equation, &Located { point, cell });
                for (mean, psi) in means.iter_mut().zip(psi) {
                    *mean += value * psi.to_f64();
                }
            }
        }
        means
    }

    fn series(&self, equation: &E, coefficients: &[f64], x: &Located<E::Point>) -> f64 {
        let own = coefficients.get(x.cell * B..).unwrap_or(&[]);
        let psi = Basis::<B>::basis(equation, x);
        own.iter().zip(psi).map(|(c, psi)| c * psi.to_f64()).sum()
    }
}

impl<E: CustomEquation + TransitionMoments<B>, const B: usize> Degree<E> for Smooth<B> {
    fn functions(&self) -> usize {
        B
    }

    fn entries(&self, equation: &E, points: usize) -> Result<Vec<f64>, Error> {
        let nodes = &Nodes::new(equation, points)?;
        filled::<E, B>(equation, nodes, |x, j, psi| {
            let mut integrals = [0.0; B];
            // The nodes of all cells have the same parameters.
            for ((point, weight), psi) in nodes.weighted(j).zip(psi) {
                let k = equation.kernel(&x.point, &point).to_f64();
                let step = weight * k * equation.density(&x.point, &point).to_f64();
                for (integral, psi) in integrals.iter_mut().zip(psi) {
                    *integral += step * psi;
                }
            }
            integrals
        })
    }

    fn on_cells(&self) -> &dyn OnCells<E> {
        self
    }

    fn with_neighbour(
        &self,
        of: &Of<'_, E>,
        kinds: Kinds,
        then: &mut Use<'_, E>,
    ) -> Result<(), Error> {
        if !matches!(kinds, Kinds::AllInS | Kinds::Paper) {
            return Err(Error::Internal("pointwise pairs need their integrals"));
        }
        let coefficients = dense(of.equation, of.entries, B)?;
        let vectors = of.solution.for_walks(&coefficients, IN_S)?;
        let rounded = Rounded::new(&coefficients);
        let neighbour: Piecewise<'_, _, _, _, _, _, B> =
            vectors.piecewise(of.equation, &rounded)?;
        then(&neighbour, vectors.v())
    }

    fn neighbour_radius(
        &self,
        of: &Of<'_, E>,
        nodes: &Nodes<E::Point>,
        kinds: Kinds,
    ) -> Result<f64, Error> {
        let coefficients = dense(of.equation, of.entries, B)?;
        squared_radius::<_, _, B>(of.equation, &coefficients, nodes, &kinds.any(IN_S))
    }
}

/// The spectral radius of T_h²p, estimated, of coefficients in f64.
pub(crate) fn squared_radius<E, C, const B: usize>(
    equation: &E,
    coefficients: &C,
    nodes: &Nodes<E::Point>,
    pairs: &AnyPairs,
) -> Result<f64, Error>
where
    E: CustomEquation + TransitionMoments<B>,
    C: Coefficients<B, Scalar = f64>,
{
    let square = |x: &Located<E::Point>, j: usize| {
        let terms = nodes.weighted(j).map(|(y, weight)| {
            let k = equation.kernel(&x.point, &y).to_f64();
            weight * k * k * equation.density(&x.point, &y).to_f64()
        });
        terms.sum::<f64>()
    };
    let rounded = Rounded::new(coefficients);
    let points = |cell| nodes.shares(cell).map(|(x, _)| x);
    Ok(second_moment_radius::<_, _, _, B>(
        equation, &rounded, pairs, points, square,
    )?)
}

/// The dense table of what `integrals` says of a point, another cell, and the functions at the nodes of the point's own cell:
/// ∫_Xj K(x,y) ψ_jb(y) dμ(y).
fn filled<E: CustomEquation + TransitionMoments<B>, const B: usize>(
    equation: &E,
    nodes: &Nodes<E::Point>,
    integrals: impl Fn(&Located<E::Point>, usize, &[[f64; B]]) -> [f64; B] + Sync,
) -> Result<Vec<f64>, Error> {
    let unknowns = nodes.cells() * B;
    let mut entries: Vec<f64> = buffer(unknowns.saturating_mul(unknowns))?;
    fill_rows(&mut entries, unknowns * B, |cell, rows| {
        let at = |(point, _)| Basis::<B>::basis(equation, &Located { point, cell });
        let psi = nodes.shares(cell).map(|node| at(node).map(Real::to_f64));
        let psi: Vec<[f64; B]> = psi.collect();
        for ((point, share), own) in nodes.shares(cell).zip(&psi) {
            let x = Located { point, cell };
            for j in 0..nodes.cells() {
                let integrals = integrals(&x, j, &psi);
                for (row, own) in rows.chunks_exact_mut(unknowns).zip(own) {
                    let left = share * own;
                    for (entry, integral) in row[j * B..].iter_mut().zip(integrals) {
                        *entry += left * integral;
                    }
                }
            }
        }
        Ok::<(), Error>(())
    })?;
    Ok(entries)
}

impl<E, const B: usize> Degree<E> for WithIntegrals<B>
where
    E: CustomEquation + TransitionMoments<B> + PairIntegral<B>,
{
    fn functions(&self) -> usize {
        B
    }

    fn pairs(&self) -> DegreePairs {
        DegreePairs {
            pointwise: true,
            default: Kinds::DiagonalPointwise,
            ..ALL_IN_S
        }
    }

    fn entries(&self, equation: &E, points: usize) -> Result<Vec<f64>, Error> {
        let nodes = Nodes::new(equation, points)?;
        filled::<E, B>(equation, &nodes, |x, j, _| {
            PairIntegral::<B>::pair_integral(equation, x, j).map(Real::to_f64)
        })
    }

    fn on_cells(&self) -> &dyn OnCells<E> {
        &Smooth::<B>
    }

    fn with_neighbour(
        &self,
        of: &Of<'_, E>,
        kinds: Kinds,
        then: &mut Use<'_, E>,
    ) -> Result<(), Error> {
        let coefficients = dense(of.equation, of.entries, B)?;
        let rounded = Rounded::new(&coefficients);
        match kinds {
            Kinds::AllInS | Kinds::Paper => Smooth::<B>.with_neighbour(of, kinds, then),
            Kinds::DiagonalPointwise => {
                let vectors = of.solution.for_walks(&coefficients, DIAGONAL)?;
                let neighbour: Piecewise<'_, _, _, _, _, _, B> =
                    vectors.with_pointwise(of.equation, &rounded)?;
                then(&neighbour, vectors.v())
            }
            Kinds::AllPointwise => {
                let vectors = of.solution.for_walks(&coefficients, AllPointwise)?;
                let neighbour: Piecewise<'_, _, _, _, _, _, B> =
                    vectors.with_pointwise(of.equation, &rounded)?;
                then(&neighbour, vectors.v())
            }
        }
    }

    fn neighbour_radius(
        &self,
        of: &Of<'_, E>,
        nodes: &Nodes<E::Point>,
        kinds: Kinds,
    ) -> Result<f64, Error> {
        Smooth::<B>.neighbour_radius(of, nodes, kinds)
    }
}
