//! A solution of a higher degree than its matrix, and walks that follow it with h = k.

use fredholm_core::galerkin::{Partition, Solution};
use fredholm_core::{Located, Neighbour, Real, StateSpace, Uniforms};
use fredholm_cube::{CubeScores, KernelMoments, ScalarField, functions};
use fredholm_model::numbers::{dot, largest, short};
use fredholm_model::{Error, Subject};
use fredholm_rayon::fill_rows;
use fredholm_variance::gauss;

use super::CubePartition;
use super::functions::{ModelCube, Watched};
use super::setup::ANY;
use super::whole::{MOST_POINTS, nodes};

/// The degree in which T_K v' is approximated: the highest that there is.
pub(super) const HIGHEST: usize = CubeScores::<f64, 1>::MOST_DEGREE;
/// Places at which rules for T_K are compared, and the part of ‖v‖ by which a finer one may move it.
const PROBES: usize = 16;
const SETTLED: f64 = 1e-14;
/// The most values of a kernel for a lift.
const MOST_WORK: f64 = 2e9;
/// Values of the kernel, or what takes as long, that corrections of a score take on average.
const CORRECTIONS: f64 = 2.0;
const DEGREE: Error = Error::Internal("polynomials of this degree are not offered");

/// v', the projection of F + T_K v on polynomials of degree p', and what walks need of its neighbour equation h = k,
/// G = v' − T_K v'.
///
/// T_K v' is smooth. So walks score the polynomial near G of the highest degree, and in a small share of scores the exact
/// difference over that share besides: the mean is G to rounding.
#[derive(Clone, Debug)]
pub(super) struct Lifted {
    /// p'.
    pub(super) degree: usize,
    /// v', n blocks.
    pub(super) v: Vec<f64>,
    /// The polynomial near G, n blocks of the highest degree.
    source: Vec<f64>,
    /// Gauss points of a cell and axis by which T_K v' is exact to rounding.
    points: usize,
    /// The share of scores that are corrected.
    share: f64,
}

/// What T_K is taken of, and how.
struct Image<'a, const D: usize> {
    values: &'a Watched<'a, f64>,
    moments: KernelMoments<D>,
    coefficients: &'a [f64],
    product: bool,
}

impl<'a, const D: usize> Image<'a, D> {
    fn new(
        (cut, values): (&CubePartition<'_>, &'a Watched<'a, f64>),
        degree: usize,
        coefficients: &'a [f64],
        points: usize,
    ) -> Result<Self, Error> {
        let cube = values.cube::<D>(cut.per_axis, ANY)?;
        Ok(Self {
            values,
            moments: KernelMoments::new(&cube, degree, points)?,
            coefficients,
            product: cut.functions().is_product(),
        })
    }

    /// (T_K v)(x).
    fn at(&self, x: &[f64; D]) -> Result<f64, Error> {
        let mut integrals = vec![0.0; self.moments.unknowns()];
        let kernel = self.values.kernel();
        if self.product {
            self.moments.fill_product(&kernel, x, &mut integrals)?;
        } else {
            self.moments.fill(&kernel, x, &mut integrals)?;
        }
        Ok(dot(&integrals, self.coefficients))
    }
}

/// Gauss points of a cell and axis by which T_K of these coefficients is exact to rounding.
fn settled<const D: usize>(
    of: (&CubePartition<'_>, &Watched<'_, f64>),
    degree: usize,
    coefficients: &[f64],
) -> Result<usize, Error> {
    let probe = |i: usize| {
        // Kronecker's sequence of the golden ratio and its powers.
        let mut step = 1.0;
        core::array::from_fn::<f64, D, _>(|_| {
            step *= 0.618_033_988_749_894_9;
            (step * (i + 1) as f64).fract()
        })
    };
    let all = |points: usize| -> Result<Vec<f64>, Error> {
        let image = Image::<D>::new(of, degree, coefficients, points)?;
        (0..PROBES).map(|i| image.at(&probe(i))).collect()
    };
    let enough = SETTLED * largest(coefficients);
    let (mut points, mut moved) = (degree + 1, f64::NAN);
    let mut before = all(points)?;
    while points + 2 <= MOST_POINTS {
        let now = all(points + 2)?;
        let distances = before.iter().zip(&now).map(|(a, b)| (a - b).abs());
        moved = distances.fold(0.0, f64::max);
        if moved <= enough {
            return Ok(points);
        }
        points += 2;
        before = now;
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

/// The coefficients of the projection on polynomials of a degree, by so many Gauss points of a cell and axis.
fn projected<const D: usize>(
    cube: &ModelCube<'_, f64, D>,
    degree: usize,
    points: usize,
    value: &(dyn Fn(&[f64; D]) -> Result<f64, Error> + Sync),
) -> Result<Vec<f64>, Error> {
    let (width, rule) = (functions(D, degree), gauss(points)?);
    let scores = CubeScores::<f64, D>::new(cube, degree).ok_or(DEGREE)?;
    let mut all = vec![0.0; cube.cells() * width];
    fill_rows(&mut all, width, |cell, out| {
        let (low, high) = cube.cell_box(cell);
        for mut number in 0..rule.len().pow(D as u32) {
            let (mut point, mut share) = (low, 1.0);
            for (x, high) in point.iter_mut().zip(high) {
                let (t, weight) = rule[number % rule.len()];
                number /= rule.len();
                *x += 0.5 * (1.0 + t) * (high - *x);
                share *= 0.5 * weight;
            }
            let score = share * value(&point)?;
            scores.add_own(&Located { point, cell }, score, out);
        }
        Ok::<(), Error>(())
    })?;
    Ok(all)
}

impl Lifted {
    /// The lift of a solution to degree p'.
    pub(super) fn new<const D: usize>(
        cut: &CubePartition<'_>,
        values: &Watched<'_, f64>,
        solution: &Solution,
        degree: usize,
    ) -> Result<Self, Error> {
        let of = (cut, values);
        let cube = values.cube::<D>(cut.per_axis, ANY)?;
        let points = settled::<D>(of, cut.degree, &solution.v)?;
        let places = |points: usize| (cut.per_axis as f64 * points as f64).powi(D as i32);
        let work =
            places(degree + 2) * nodes(cut, points) + places(HIGHEST + 1) * nodes(cut, points + 2);
        if work > MOST_WORK {
            return Err(Error::TooMuch {
                message: format!(
                    "a lift takes {work:.1e} values of the kernel here, and more than {MOST_WORK:.0e} take too long: \
                     use fewer cells (`--cells`)"
                ),
            });
        }
        let image = Image::<D>::new(of, cut.degree, &solution.v, points)?;
        let v = projected(&cube, degree, degree + 2, &|x| {
            Ok(cube.right_hand_side().value(x) + image.at(x)?)
        })?;
        let points = settled::<D>(of, degree, &v)?;
        let image = Image::<D>::new(of, degree, &v, points)?;
        let near = projected(&cube, HIGHEST, HIGHEST + 1, &|x| image.at(x))?;
        let mut source = vec![0.0; near.len()];
        let scores = CubeScores::<f64, D>::new(&cube, HIGHEST).ok_or(DEGREE)?;
        scores.embed(degree, &v, &mut source);
        for (source, near) in source.iter_mut().zip(near) {
            *source -= near;
        }
        let work = nodes(cut, points) + v.len() as f64;
        Ok(Self {
            degree,
            v,
            source,
            points,
            share: (CORRECTIONS / work).min(1.0),
        })
    }

    /// The coefficients of v' of a lower degree: those of its projection.
    pub(super) fn lower<F: Real, const D: usize>(&self, degree: usize) -> Vec<F> {
        let degrees: Vec<usize> = fredholm_cube::degrees(D, self.degree).collect();
        let all = self.v.iter().zip(degrees.iter().cycle());
        let low = all.filter(|(_, total)| **total <= degree);
        low.map(|(v, _)| F::from_f64(*v)).collect()
    }
}

/// The neighbour equation of a lift, with h = k.
pub(super) struct LiftedNeighbour<'a, F: Real, const D: usize> {
    lifted: &'a Lifted,
    cube: ModelCube<'a, F, D>,
    own: CubeScores<F, D>,
    highest: CubeScores<F, D>,
    image: Image<'a, D>,
}

impl<'a, F: Real, const D: usize> LiftedNeighbour<'a, F, D> {
    /// The neighbour equation for walks in F, with the values in double precision for corrections.
    pub(super) fn new(
        cut: &CubePartition<'_>,
        lifted: &'a Lifted,
        values: &'a Watched<'a, F>,
        exact: &'a Watched<'a, f64>,
    ) -> Result<Self, Error> {
        let cube = values.cube::<D>(cut.per_axis, ANY)?;
        Ok(Self {
            lifted,
            own: CubeScores::new(&cube, lifted.degree).ok_or(DEGREE)?,
            highest: CubeScores::new(&cube, HIGHEST).ok_or(DEGREE)?,
            cube,
            image: Image::new((cut, exact), lifted.degree, &lifted.v, lifted.points)?,
        })
    }

    fn v(&self, x: &Located<[F; D]>) -> f64 {
        self.own.value(x, &self.lifted.v)
    }

    fn near(&self, x: &Located<[F; D]>) -> f64 {
        self.highest.value(x, &self.lifted.source)
    }

    /// G minus the polynomial near it; NaN without memory.
    fn difference(&self, x: &Located<[F; D]>, near: f64) -> f64 {
        let point = x.point.map(Real::to_f64);
        let image = self.image.at(&point).unwrap_or(f64::NAN);
        (self.v(x) - image) - near
    }
}

impl<F: Real, const D: usize> StateSpace for LiftedNeighbour<'_, F, D> {
    type Scalar = F;
    type Point = [F; D];
}

impl<F: Real, const D: usize> Neighbour for LiftedNeighbour<'_, F, D> {
    fn locate(&self, point: [F; D]) -> Located<[F; D]> {
        let cell = self.cube.locate(&point);
        Located { point, cell }
    }

    fn kernel(&self, _: &Located<[F; D]>, _: &Located<[F; D]>, k: F) -> F {
        k
    }

    fn source(&self, x: &Located<[F; D]>, draws: &mut dyn Uniforms<F>) -> F {
        let (near, share) = (self.near(x), self.lifted.share);
        let is_corrected = draws.uniform().to_f64() < share;
        F::from_f64(if is_corrected {
            near + self.difference(x, near) / share
        } else {
            near
        })
    }

    fn value(&self, x: &Located<[F; D]>) -> F {
        F::from_f64(self.v(x))
    }

    fn source_moments(&self, x: &Located<[F; D]>) -> [F; 2] {
        let near = self.near(x);
        let difference = self.difference(x, near);
        let variance = difference * difference * (1.0 / self.lifted.share - 1.0);
        [near + difference, variance].map(F::from_f64)
    }
}
