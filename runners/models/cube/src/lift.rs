//! A solution of a higher degree than its matrix, and walks that follow it with h = k.

use fredholm_core::galerkin::{Cells as _, Solution};
use fredholm_core::{Located, Neighbour, Real, Space, Uniforms};
use fredholm_cube::{CubeRule, CubeScores, KernelFn, KernelMoments, KernelShape, ScalarField};
use fredholm_model::numbers::{dot, largest, short};
use fredholm_model::{Error, Subject};
use fredholm_rayon::fill_rows;

use super::CubePartition;
use super::functions::{ModelCube, Watched, Which};
use super::global::{MOST_POINTS, nodes};

/// The degree in which T_K v' is approximated: the highest that there is.
pub(super) const HIGHEST: usize = CubeScores::<1>::MOST_DEGREE;
/// Places at which rules for T_K are compared, and the part of ‖v‖ by which a finer one may move it.
const PROBES: usize = 16;
const SETTLED: f64 = 1e-14;
/// The most values of a kernel for a lift.
pub(super) const MOST_WORK: f64 = 2e9;
/// Values of the kernel, or what takes as long, that corrections of a score take on average.
pub(super) const CORRECTIONS: f64 = 2.0;

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
    /// The rule by which T_K v' is exact to rounding.
    rule: Rule,
    /// The share of scores that are corrected.
    share: f64,
}

/// A Gauss rule for T_K of a piecewise polynomial.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rule {
    /// Gauss points of a cell and axis.
    points: usize,
    /// Whether cells are cut at y = x, where a kernel may have a kink. If not, all x have the same points.
    is_cut: bool,
}

impl Rule {
    /// The next finer one.
    const fn finer(self) -> Self {
        Self {
            points: self.points + 2,
            ..self
        }
    }

    /// Values of the kernel, or of its factors, that T_K takes at one point.
    fn nodes(self, cut: &CubePartition<'_>) -> f64 {
        if self.is_cut {
            nodes(cut, self.points)
        } else {
            ((cut.per_axis * self.points) as f64).powi(cut.model.dimension as i32)
        }
    }
}

/// The number of places, with this number of points of a cell and axis.
fn places(cut: &CubePartition<'_>, points: usize) -> f64 {
    (cut.per_axis as f64 * points as f64).powi(cut.model.dimension as i32)
}

/// Values of the kernel, or of its factors, that a lift to a degree takes with so many Gauss points.
pub(super) fn values(cut: &CubePartition<'_>, degree: usize, points: usize) -> f64 {
    (places(cut, degree + 2) + places(cut, HIGHEST + 1)) * nodes(cut, points)
}

/// What T_K is taken of, and how.
struct Image<'a, const D: usize> {
    values: &'a Watched<'a, f64>,
    integral: Integral<'a, D>,
}

enum Integral<'a, const D: usize> {
    /// Moments of the kernel, with cells that are cut at y = x, times coefficients.
    Moments {
        moments: KernelMoments<D>,
        coefficients: &'a [f64],
        product: bool,
    },
    /// Values of v times weights.
    Points(Vec<([f64; D], f64)>),
}

impl<'a, const D: usize> Image<'a, D> {
    fn new(
        (cut, values): (&CubePartition<'_>, &'a Watched<'a, f64>),
        degree: usize,
        coefficients: &'a [f64],
        rule: Rule,
    ) -> Result<Self, Error> {
        let cube = values.cube::<D>(cut.per_axis)?;
        let integral = if rule.is_cut {
            Integral::Moments {
                moments: KernelMoments::new(&cube, degree, rule.points, KernelShape::Smooth)?,
                coefficients,
                product: cut.functions().is_product(),
            }
        } else {
            let scores = CubeScores::new(&cube, degree)?;
            let points = CubeRule::new(&cube, 0, rule.points)?;
            let share = 1.0 / points.cells() as f64;
            let at = |cell: usize| {
                let value = move |point| scores.value(&Located { point, cell }, coefficients);
                let own = points.points(cell);
                own.map(move |(point, weight)| (point, weight * share * value(point)))
            };
            Integral::Points((0..points.cells()).flat_map(at).collect())
        };
        Ok(Self { values, integral })
    }

    /// (T_K v)(x); NaN without memory.
    fn at(&self, x: &[f64; D]) -> f64 {
        let kernel = self.values.kernel();
        let (moments, coefficients, product) = match &self.integral {
            Integral::Points(all) => {
                let all = all.iter().map(|(y, v)| kernel.kernel(x, y) * v);
                return all.sum();
            }
            Integral::Moments {
                moments,
                coefficients,
                product,
            } => (moments, coefficients, *product),
        };
        let mut integrals = vec![0.0; moments.unknowns()];
        let filled = if product {
            moments.fill_product(&kernel, x, &mut integrals)
        } else {
            moments.fill(&kernel, x, &mut integrals)
        };
        filled.map_or(f64::NAN, |()| dot(&integrals, coefficients))
    }
}

/// A rule by which T_K of these coefficients is exact to rounding: if there is one, without cuts.
fn settled<const D: usize>(
    of: (&CubePartition<'_>, &Watched<'_, f64>),
    degree: usize,
    coefficients: &[f64],
) -> Result<Rule, Error> {
    let probe = |i: usize| {
        // Kronecker's sequence of the golden ratio and its powers.
        let mut step = 1.0;
        core::array::from_fn::<f64, D, _>(|_| {
            step *= 0.618_033_988_749_894_9;
            (step * (i + 1) as f64).fract()
        })
    };
    let all = |rule: Rule| -> Result<Vec<f64>, Error> {
        let image = Image::<D>::new(of, degree, coefficients, rule)?;
        Ok((0..PROBES).map(|i| image.at(&probe(i))).collect())
    };
    let enough = SETTLED * largest(coefficients);
    let mut moved = f64::NAN;
    // Factors of a product take no time.
    let cuts: &[bool] = match of.0.functions().is_product() {
        true => &[true],
        false => &[false, true],
    };
    for &is_cut in cuts {
        let mut rule = Rule {
            points: degree + 1,
            is_cut,
        };
        let mut before = all(rule)?;
        while rule.points + 2 <= MOST_POINTS {
            let finer = rule.finer();
            let now = all(finer)?;
            let distances = before.iter().zip(&now).map(|(a, b)| (a - b).abs());
            moved = distances.fold(0.0, f64::max);
            if moved <= enough {
                return Ok(rule);
            }
            (rule, before) = (finer, now);
        }
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
    value: &(dyn Fn(&[f64; D]) -> f64 + Sync),
) -> Result<Vec<f64>, Error> {
    let rule = CubeRule::new(cube, degree, points)?;
    let mut all = vec![0.0; rule.unknowns()];
    fill_rows(&mut all, rule.functions(), |cell, out| {
        rule.add_means(&|x: &[f64; D]| value(x), cell, out);
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
        let cube = values.cube::<D>(cut.per_axis)?;
        let rule = settled::<D>(of, cut.degree, &solution.v)?;
        let places = |points: usize| places(cut, points);
        let work =
            places(degree + 2) * rule.nodes(cut) + places(HIGHEST + 1) * rule.finer().nodes(cut);
        if work > MOST_WORK {
            return Err(Error::TooMuch {
                message: format!(
                    "a lift takes {work:.1e} values of the kernel here, and more than {MOST_WORK:.0e} take too long: \
                     use fewer cells (`--cells`)"
                ),
            });
        }
        let image = Image::<D>::new(of, cut.degree, &solution.v, rule)?;
        let source = values.function(Which::Source);
        let v = projected(&cube, degree, degree + 2, &|x| {
            source.value(x) + image.at(x)
        })?;
        let rule = settled::<D>(of, degree, &v)?;
        let image = Image::<D>::new(of, degree, &v, rule)?;
        let near = projected(&cube, HIGHEST, HIGHEST + 1, &|x| image.at(x))?;
        let mut source = vec![0.0; near.len()];
        CubeScores::new(&cube, HIGHEST)?.embed(degree, &v, &mut source);
        for (source, near) in source.iter_mut().zip(near) {
            *source -= near;
        }
        let work = rule.nodes(cut) + v.len() as f64;
        Ok(Self {
            degree,
            v,
            source,
            rule,
            share: (CORRECTIONS / work).min(1.0),
        })
    }

    /// The coefficients of v' of a lower degree: those of its projection.
    pub(super) fn lower<F: Real, const D: usize>(&self, degree: usize) -> Vec<F> {
        let degrees: Vec<usize> = fredholm_cube::degrees::<D>(self.degree).collect();
        let all = self.v.iter().zip(degrees.iter().cycle());
        let low = all.filter(|(_, total)| **total <= degree);
        low.map(|(v, _)| F::from_f64(*v)).collect()
    }
}

/// The neighbour equation of a lift, with h = k.
pub(super) struct LiftedNeighbour<'a, F: Real, const D: usize> {
    lifted: &'a Lifted,
    cube: ModelCube<'a, F, D>,
    own: CubeScores<D>,
    highest: CubeScores<D>,
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
        let cube = values.cube::<D>(cut.per_axis)?;
        Ok(Self {
            lifted,
            own: CubeScores::new(&cube, lifted.degree)?,
            highest: CubeScores::new(&cube, HIGHEST)?,
            cube,
            image: Image::new((cut, exact), lifted.degree, &lifted.v, lifted.rule)?,
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
        (self.v(x) - self.image.at(&x.point.map(Real::to_f64))) - near
    }
}

impl<F: Real, const D: usize> Space for LiftedNeighbour<'_, F, D> {
    type Scalar = F;
    type Point = [F; D];
}

impl<F: Real, const D: usize> Neighbour for LiftedNeighbour<'_, F, D> {
    type Value = F;

    fn locate(&self, point: [F; D]) -> Located<[F; D]> {
        let cell = self.cube.locate(&point);
        Located { point, cell }
    }

    fn kernel(&self, _: &Located<[F; D]>, _: &Located<[F; D]>, k: &F) -> F {
        *k
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
