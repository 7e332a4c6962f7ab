//! A solution of a higher degree than its matrix, and walks that follow it with h = k.

use fredholm_core::{Located, Neighbour, NoDraws, Real, Space, Uniforms};
use fredholm_model::numbers::{largest, short};
use fredholm_rayon::fill_rows;

use super::CustomEquation;
use super::cells::tensor;
use super::scores::{Integrals, MOST_DEGREE, Polynomials, parameters};
use crate::{Error, Subject};

/// The degree in which T_K v' is approximated: the highest that there is.
pub(super) const HIGHEST: usize = MOST_DEGREE;
/// Places at which rules for T_K are compared, and the part of ‖v‖ by which a finer one may move it.
const PROBES: usize = 16;
const SETTLED: f64 = 1e-14;
/// The most Gauss points of a cell and axis.
const MOST_POINTS: usize = 12;
/// The most values of a kernel for a lift.
const MOST_WORK: f64 = 2e9;
/// Values of the kernel, or what takes as long, that corrections of a score take on average.
const CORRECTIONS: f64 = 2.0;

/// v', the projection of F + T_K v on polynomials of degree p', and what walks need of its neighbour equation h = k,
/// G = v' − T_K v'.
///
/// T_K v' is smooth. So walks score the polynomial near G of the highest degree, and in a small share of scores the
/// difference over that share beside it, by quadrature to rounding: the mean is G to rounding.
#[derive(Clone, Debug)]
pub(super) struct Lifted {
    /// p'.
    pub(super) degree: usize,
    /// v', a block of coefficients for every cell.
    pub(super) v: Vec<f64>,
    /// The polynomial near G, blocks of the highest degree.
    near: Vec<f64>,
    /// Gauss points of a cell and axis by which T_K v' is exact to rounding.
    points: usize,
    /// The share of scores that are corrected.
    share: f64,
}

/// A function of points, with their cells.
type AtPoints<'a, P> = dyn Fn(&Located<P>) -> f64 + Sync + 'a;

/// Values of the kernel for one point.
fn nodes<E: CustomEquation>(equation: &E, points: usize) -> f64 {
    // The own cell of a point is cut there.
    let cells = equation.cells() as f64 + f64::from(2_u32.pow(E::DIMENSION as u32)) - 1.0;
    cells * (points as f64).powi(E::DIMENSION as i32)
}

/// Values of the kernel that a lift to a degree takes, about.
pub(super) fn values<E: CustomEquation>(equation: &E, degree: usize, points: usize) -> f64 {
    let places =
        |points: usize| equation.cells() as f64 * (points as f64).powi(E::DIMENSION as i32);
    (places(degree + 2) + places(HIGHEST + 1)) * nodes(equation, points)
}

/// The number of Gauss points by which T_K of a piecewise polynomial of this degree is exact to rounding.
fn settled<E: CustomEquation>(
    equation: &E,
    degree: usize,
    v: &AtPoints<'_, E::Point>,
    size: f64,
) -> Result<usize, Error> {
    // Kronecker's sequence of the golden ratio and its powers, over cells and their parameters.
    let probe = |i: usize| {
        let mut step = 1.0;
        let mut next = || {
            step *= 0.618_033_988_749_894_9;
            (step * (i + 1) as f64).fract()
        };
        let cell = (next() * equation.cells() as f64) as usize;
        let t: Vec<f64> = (0..E::DIMENSION).map(|_| next()).collect();
        equation.point(cell.min(equation.cells() - 1), &t)
    };
    let all = |points: usize| -> Result<Vec<f64>, Error> {
        let none = Polynomials::new(E::DIMENSION, 0);
        let image = Integrals::new((equation, &none), v, points)?;
        Ok((0..PROBES).map(|i| image.image(&probe(i))).collect())
    };
    let (mut points, mut moved) = (degree + 1, f64::NAN);
    let mut before = all(points)?;
    while points + 2 <= MOST_POINTS {
        let now = all(points + 2)?;
        let distances = before.iter().zip(&now).map(|(a, b)| (a - b).abs());
        moved = distances.fold(0.0, f64::max);
        if moved <= SETTLED * size {
            return Ok(points);
        }
        (points, before) = (points + 2, now);
    }
    Err(Error::Option {
        subject: Subject::Lift,
        message: format!(
            "a lift needs T_K v to rounding, and Gauss rules of {MOST_POINTS} points on a cell still move it by {}: use \
             more cells, or no lift",
            short(moved)
        ),
    })
}

/// The coefficients of the projection of a function on polynomials, by so many Gauss points of a cell and axis.
pub(super) fn projected<E: CustomEquation>(
    equation: &E,
    degree: usize,
    points: usize,
    value: &AtPoints<'_, E::Point>,
) -> Result<Vec<f64>, Error> {
    let polynomials = Polynomials::new(E::DIMENSION, degree);
    let (rule, width) = (tensor(E::DIMENSION, points)?, polynomials.functions());
    let mut all = vec![0.0; equation.cells() * width];
    fill_rows(&mut all, width, |cell, out| {
        for (t, share) in &rule {
            let x = Located {
                point: equation.point(cell, t),
                cell,
            };
            polynomials.add_at(t, share * value(&x), out);
        }
        Ok::<(), Error>(())
    })?;
    Ok(all)
}

impl Lifted {
    /// The lift of a solution v, of this degree, to another one.
    ///
    /// # Errors
    /// [`Error::Option`]: T_K v is not smooth on cells. [`Error::TooMuch`].
    pub(super) fn new<E: CustomEquation<Scalar = f64>>(
        equation: &E,
        own_degree: usize,
        v: &AtPoints<'_, E::Point>,
        (size, degree): (f64, usize),
    ) -> Result<Self, Error> {
        let points = settled(equation, own_degree, v, size)?;
        let work = values(equation, degree, points + 2);
        if work > MOST_WORK {
            return Err(Error::TooMuch {
                message: format!(
                    "a lift takes {work:.1e} values of the kernel here, and more than {MOST_WORK:.0e} take too long: \
                     use fewer cells (`--cells`)"
                ),
            });
        }
        let none = Polynomials::new(E::DIMENSION, 0);
        let image = Integrals::new((equation, &none), v, points)?;
        let lifted = projected(equation, degree, degree + 2, &|x| {
            equation.source(&x.point, &mut NoDraws) + image.image(&x.point)
        })?;
        let polynomials = Polynomials::new(E::DIMENSION, degree);
        let lifted_at = |x: &Located<E::Point>| {
            polynomials.value(&parameters(equation, x), own(&lifted, x.cell, &polynomials))
        };
        let points = settled(equation, degree, &lifted_at, largest(&lifted))?;
        let image = Integrals::new((equation, &none), &lifted_at, points)?;
        let near = projected(equation, HIGHEST, HIGHEST + 1, &|x| {
            lifted_at(x) - image.image(&x.point)
        })?;
        let work = nodes(equation, points) + lifted.len() as f64;
        Ok(Self {
            degree,
            near,
            points,
            share: (CORRECTIONS / work).min(1.0),
            v: lifted,
        })
    }

    /// The coefficients of v' of total degree ≤ `degree`.
    pub(super) fn lower(&self, dimension: usize, degree: usize) -> Vec<f64> {
        let totals: Vec<usize> = Polynomials::new(dimension, self.degree).totals().collect();
        let all = self.v.iter().zip(totals.iter().cycle());
        all.filter(|(_, total)| **total <= degree)
            .map(|(v, _)| *v)
            .collect()
    }

    /// The neighbour equation of an equation of any scalar.
    pub(super) fn neighbour<'a, E: CustomEquation>(
        &'a self,
        equation: &'a E,
    ) -> LiftedNeighbour<'a, E> {
        LiftedNeighbour {
            lifted: self,
            equation,
            own: Polynomials::new(E::DIMENSION, self.degree),
            highest: Polynomials::new(E::DIMENSION, HIGHEST),
            none: Polynomials::new(E::DIMENSION, 0),
        }
    }
}

/// The coefficients of a cell.
fn own<'c>(all: &'c [f64], cell: usize, polynomials: &Polynomials) -> &'c [f64] {
    let width = polynomials.functions();
    all.get(cell * width..(cell + 1) * width).unwrap_or(&[])
}

/// The neighbour equation of a lift: h = k.
#[derive(Debug)]
pub(super) struct LiftedNeighbour<'a, E> {
    lifted: &'a Lifted,
    equation: &'a E,
    own: Polynomials,
    highest: Polynomials,
    none: Polynomials,
}

impl<E: CustomEquation> LiftedNeighbour<'_, E> {
    fn v(&self, x: &Located<E::Point>) -> f64 {
        let own = own(&self.lifted.v, x.cell, &self.own);
        self.own.value(&parameters(self.equation, x), own)
    }

    fn near(&self, x: &Located<E::Point>) -> f64 {
        let own = own(&self.lifted.near, x.cell, &self.highest);
        self.highest.value(&parameters(self.equation, x), own)
    }

    /// G minus the polynomial near it; NaN without memory.
    fn difference(&self, x: &Located<E::Point>, near: f64) -> f64 {
        let v = |y: &Located<E::Point>| self.v(y);
        let image = Integrals::new((self.equation, &self.none), &v, self.lifted.points);
        image.map_or(f64::NAN, |image| (self.v(x) - image.image(&x.point)) - near)
    }
}

impl<E: Space> Space for LiftedNeighbour<'_, E> {
    type Scalar = E::Scalar;
    type Point = E::Point;
}

impl<E: CustomEquation> Neighbour for LiftedNeighbour<'_, E> {
    type Value = E::Scalar;

    fn locate(&self, point: E::Point) -> Located<E::Point> {
        let cell = self.equation.locate(&point);
        Located { point, cell }
    }

    fn kernel(&self, _: &Located<E::Point>, _: &Located<E::Point>, k: &E::Scalar) -> E::Scalar {
        *k
    }

    fn source(&self, x: &Located<E::Point>, draws: &mut dyn Uniforms<E::Scalar>) -> E::Scalar {
        let (near, share) = (self.near(x), self.lifted.share);
        let is_corrected = draws.uniform().to_f64() < share;
        E::Scalar::from_f64(if is_corrected {
            near + self.difference(x, near) / share
        } else {
            near
        })
    }

    fn value(&self, x: &Located<E::Point>) -> E::Scalar {
        E::Scalar::from_f64(self.v(x))
    }

    fn is_pointwise(&self) -> bool {
        true
    }

    fn source_moments(&self, x: &Located<E::Point>) -> [E::Scalar; 2] {
        let near = self.near(x);
        let difference = self.difference(x, near);
        let variance = difference * difference * (1.0 / self.lifted.share - 1.0);
        [near + difference, variance].map(E::Scalar::from_f64)
    }
}
