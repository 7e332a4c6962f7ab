//! What the checks need to know of the circle.

use core::f64::consts::TAU;

use fredholm_circle::{
    Circle, Emission, Harmonic, Point, PolynomialCircle, Residual, Tables, residual_moments,
};
use fredholm_core::galerkin::{
    AllPointwise, DiagonalRule, PairKind, Pairs, Partition, Piecewise, PointwiseSource,
};
use fredholm_core::{Located, Real};

use crate::description::Description;
use crate::examine::{examine_both, examine_masses};
use crate::offers::{Neighbours, Offers};
use crate::quadrature::{gauss_legendre, split};
use crate::report::Report;

/// Reflectances of five arcs, one of them black.
pub const RHO: [f64; 5] = [0.3, 0.7, 0.0, 0.55, 0.74];
/// The paper's light.
pub const LIGHT: Harmonic = Harmonic {
    constant: 5.0,
    amplitude: 1.0,
    frequency: 5,
};
/// The paper's pairs: the diagonal left out.
pub const PAPER: DiagonalRule = DiagonalRule {
    diagonal: PairKind::Dropped,
};
/// The program's default: the diagonal pointwise.
pub const DEFAULT: DiagonalRule = DiagonalRule {
    diagonal: PairKind::Pointwise,
};
/// All pairs in S.
pub const IN_S: DiagonalRule = DiagonalRule {
    diagonal: PairKind::Galerkin,
};

/// The generic neighbour equation on a circle.
pub type OnCircle<'a, F, E, S> = Piecewise<
    'a,
    F,
    Circle<'a, F, E>,
    Circle<'a, F, E>,
    S,
    PointwiseSource<'a, F, Circle<'a, F, E>, S>,
>;

/// Makes the generic neighbour equation with these pairs, q0 = 0.2, as a user makes it: everything
/// in f64 first.
///
/// # Panics
/// If there is no such circle.
pub fn with_piecewise<F: Real, E: Emission<F> + Emission<f64> + Copy, S: Pairs + Copy, R>(
    reflectance: &[f64],
    cells: usize,
    emission: E,
    pairs: S,
    then: impl FnOnce(&Circle<'_, F, E>, &OnCircle<'_, F, E, S>, &[F]) -> R,
) -> R {
    let wide_tables = Tables::<f64>::new(reflectance, cells).unwrap();
    let wide = Circle::new(wide_tables.cells(), emission, 0.2).unwrap();
    let solution = wide.solve(1e-15, 1000).unwrap();
    let (v, g) = (
        solution.rounded().unwrap(),
        solution.source(&wide, &pairs).unwrap(),
    );
    let tables = Tables::new(reflectance, cells).unwrap();
    let circle = Circle::new(tables.cells(), emission, 0.2).unwrap();
    let neighbour = Piecewise::with_pointwise(&circle, &circle, pairs, &v, &g).unwrap();
    then(&circle, &neighbour, &v)
}

/// As [`with_piecewise`], with all pairs pointwise.
///
/// # Panics
/// If there is no such circle.
pub fn with_residual<F: Real, E: Emission<F> + Emission<f64> + Copy, R>(
    reflectance: &[f64],
    cells: usize,
    emission: E,
    then: impl FnOnce(&Circle<'_, F, E>, &Residual<'_, F, Circle<'_, F, E>>, &[F]) -> R,
) -> R {
    let wide_tables = Tables::<f64>::new(reflectance, cells).unwrap();
    let wide = Circle::new(wide_tables.cells(), emission, 0.2).unwrap();
    let solution = wide.solve(1e-15, 1000).unwrap();
    let (v, moments) = (
        solution.rounded().unwrap(),
        residual_moments(&wide, &solution).unwrap(),
    );
    let tables = Tables::new(reflectance, cells).unwrap();
    let circle = Circle::new(tables.cells(), emission, 0.2).unwrap();
    let residual = Residual::new(&circle, &v, &moments).unwrap();
    then(&circle, &residual, &v)
}

/// A furnace: u = 1 whatever the reflectance.
pub const FURNACE: Harmonic = Harmonic {
    constant: 1.0,
    amplitude: 0.0,
    frequency: 1,
};

/// A circle as the kit sees it, with q0 = 0.2.
#[derive(Clone, Debug)]
pub struct Described<'a, F> {
    circle: Circle<'a, F, Harmonic>,
    reflectance: &'a [f64],
    rule: Vec<(f64, f64)>,
}

impl<F: Real> Described<'_, F> {
    fn cells(&self) -> usize {
        self.circle.cells()
    }
    fn light(&self) -> Harmonic {
        *self.circle.emission()
    }
    fn width(&self) -> f64 {
        TAU / self.cells() as f64
    }
}

/// Describes the circle with this reflectance, cells and light.
///
/// # Panics
/// If there is no such circle.
pub fn described<F: Real, R>(
    reflectance: &[f64],
    cells: usize,
    light: Harmonic,
    then: impl FnOnce(&Described<'_, F>) -> R,
) -> R {
    let tables = Tables::new(reflectance, cells).unwrap();
    let circle = Circle::new(tables.cells(), light, 0.2).unwrap();
    then(&Described {
        circle,
        reflectance,
        // A wave of sin 5s wants some eight points.
        rule: gauss_legendre(12 + 36 / cells),
    })
}

/// Everything about a circle, in f32 and f64.
#[must_use]
pub fn examined(cells: usize, light: Harmonic, seed: u64) -> Report {
    described(&RHO, cells, light, |narrow| {
        described(&RHO, cells, light, |wide| examine_both(narrow, wide, seed))
    })
}

/// The masses of a circle with very many cells, in f32 and f64.
#[must_use]
pub fn examined_masses(cells: usize, seed: u64) -> Report {
    let mut report = described::<f64, _>(&RHO, cells, LIGHT, |wide| examine_masses(wide, seed));
    report.extend(described::<f32, _>(&RHO, cells, LIGHT, |narrow| {
        examine_masses(narrow, seed)
    }));
    report
}

impl<'a, F: Real> Description for Described<'a, F> {
    type Equation = Circle<'a, F, Harmonic>;
    const DIMENSION: usize = 1;

    fn equation(&self) -> &Self::Equation {
        &self.circle
    }

    fn point(&self, cell: usize, t: &[f64]) -> Point<F> {
        self.circle
            .point(TAU * ((cell as f64 + t[0]) / self.cells() as f64))
    }

    fn contains(&self, cell: usize, x: &Point<F>) -> bool {
        // The pseudo-angles of an edge and of a point are each wrong by a few ε, and an angle is up
        // to 4π times as wide.
        let edge = 64.0 * F::EPSILON.to_f64();
        let (left, right) = (cell as f64 * self.width(), (cell + 1) as f64 * self.width());
        let angle = x.angle().to_f64();
        [angle - TAU, angle, angle + TAU]
            .iter()
            .any(|angle| (left - edge..=right + edge).contains(angle))
    }

    fn nodes(&self, x: &Point<F>, cell: usize) -> Vec<(Point<F>, f64)> {
        // p(x, ·) has a kink at x. In parts of a cell, as a width that is the difference of two
        // angles has lost digits.
        let (left, width) = (cell as f64 * self.width(), self.width());
        let kink = (x.angle().to_f64() - left) / width;
        let nodes = split(&self.rule, 0.0, 1.0, &[kink]).into_iter();
        nodes
            .map(|(t, w)| (self.circle.point(left + t * width), w * width))
            .collect()
    }

    fn solution(&self, x: &Point<F>) -> Option<f64> {
        Some(self.light().solution(x.angle().to_f64()))
    }

    fn constant(&self) -> Option<f64> {
        (self.light().amplitude == 0.0).then_some(self.light().constant)
    }

    /// By the turn φ from x: (1 − cos φ/2)/2.
    fn cumulative(&self, x: &Point<F>, y: &Point<F>) -> Option<f64> {
        let turn = (y.angle().to_f64() - x.angle().to_f64()).rem_euclid(TAU);
        Some(0.5 - 0.5 * (0.5 * turn).cos())
    }

    /// In f32, by f64 from the stored half angle. For f64 see the 60 digits in `tests/circle.rs`.
    fn mass(&self, x: &Located<Point<F>>, cell: usize) -> Option<f64> {
        if F::EPSILON.to_f64() < 1e-10 {
            return None;
        }
        let (cos, sin) = x.point.half_angle();
        let half = sin.to_f64().atan2(cos.to_f64());
        let middle = 0.5 * self.width() * (cell as f64 + 0.5);
        let quarter = 0.25 * self.width();
        let form_factor = if cell == x.cell {
            // 1 − cos A cos B = sin²((A−B)/2) + sin²((A+B)/2)
            let b = half - middle;
            (0.5 * (quarter - b)).sin().powi(2) + (0.5 * (quarter + b)).sin().powi(2)
        } else {
            quarter.sin() * (middle - half).sin().abs()
        };
        Some((1.0 - F::from_f64(0.2).to_f64()) * form_factor)
    }
}

impl<'a, F: Real> Neighbours for Described<'a, F> {
    fn offers(&self, offers: &mut Offers<'_, Self>) {
        let (n, light) = (self.cells(), self.light());
        offers.starts(&self.circle);
        offers.pairs("the paper's", PAPER);
        offers.pairs("all in S", IN_S);
        offers.pointwise_pairs("diagonal pointwise", DEFAULT);
        if n < 50 {
            offers.pointwise_pairs("all pointwise", AllPointwise);
        }
        offers.coefficients("closed form", &self.circle, 0.0);
        for pairs in [PAPER, DEFAULT] {
            let name = format!("own, diagonal {:?}", pairs.diagonal);
            with_piecewise(self.reflectance, n, light, pairs, |_, neighbour, _| {
                offers.neighbour::<OnCircle<'_, F, _, _>>(&name, neighbour);
            });
        }
        with_residual::<F, _, _>(self.reflectance, n, light, |_, residual, _| {
            offers.neighbour("residual", residual);
        });
        let tables = Tables::<f64>::new(self.reflectance, n).unwrap();
        let wide = Circle::new(tables.cells(), light, 0.2).unwrap();
        let mut means = vec![0.0; n];
        wide.source_means(&mut means).unwrap();
        offers.source_means("closed form", &means, 0.0);
        let solution = wide.solve(1e-15, 1000).unwrap();
        offers.galerkin_solution("own", &solution.v, 1e-13);
    }
}

/// The generic neighbour equation on a circle with B functions per cell.
pub type OfDegree<'c, 'a, F, E, S, const B: usize> = Piecewise<
    'c,
    F,
    PolynomialCircle<'c, 'a, F, E, B>,
    PolynomialCircle<'c, 'a, F, E, B>,
    S,
    PointwiseSource<'c, F, PolynomialCircle<'c, 'a, F, E, B>, S, B>,
    B,
>;

/// As [`with_piecewise`], with polynomials of degree B − 1.
///
/// # Panics
/// If there is no such circle.
pub fn with_polynomials<F, E, S, R, const B: usize>(
    reflectance: &[f64],
    cells: usize,
    emission: E,
    pairs: S,
    then: impl FnOnce(&Circle<'_, F, E>, &OfDegree<'_, '_, F, E, S, B>, &[F]) -> R,
) -> R
where
    F: Real,
    E: Emission<F> + Emission<f64> + Copy,
    S: Pairs + Copy,
{
    let wide_tables = Tables::<f64>::new(reflectance, cells).unwrap();
    let wide = Circle::new(wide_tables.cells(), emission, 0.2).unwrap();
    let wide = wide.with_functions::<B>();
    let solution = wide.solve(1e-15, 1000).unwrap();
    let (v, g) = (
        solution.rounded().unwrap(),
        solution.source(&wide, &pairs).unwrap(),
    );
    let tables = Tables::new(reflectance, cells).unwrap();
    let circle = Circle::new(tables.cells(), emission, 0.2).unwrap();
    let polynomials = circle.with_functions();
    let neighbour = Piecewise::with_pointwise(&polynomials, &polynomials, pairs, &v, &g).unwrap();
    then(&circle, &neighbour, &v)
}

/// A circle with polynomials as the kit sees it.
struct Curved<'x, 'a, F, const B: usize> {
    circle: &'x Described<'a, F>,
    polynomials: PolynomialCircle<'x, 'a, F, Harmonic, B>,
}

/// As [`examined`], with polynomials of degree B − 1.
#[must_use]
pub fn examined_of_degree<const B: usize>(cells: usize, light: Harmonic, seed: u64) -> Report {
    fn curved<'x, 'a, F: Real, const B: usize>(
        circle: &'x Described<'a, F>,
    ) -> Curved<'x, 'a, F, B> {
        Curved {
            circle,
            polynomials: circle.circle.with_functions(),
        }
    }
    described::<f32, _>(&RHO, cells, light, |narrow| {
        described::<f64, _>(&RHO, cells, light, |wide| {
            examine_both::<_, _, B>(&curved(narrow), &curved(wide), seed)
        })
    })
}

impl<'x, 'a, F: Real, const B: usize> Description<B> for Curved<'x, 'a, F, B> {
    type Equation = PolynomialCircle<'x, 'a, F, Harmonic, B>;
    const DIMENSION: usize = 1;

    fn equation(&self) -> &Self::Equation {
        &self.polynomials
    }
    fn point(&self, cell: usize, t: &[f64]) -> Point<F> {
        self.circle.point(cell, t)
    }
    fn contains(&self, cell: usize, x: &Point<F>) -> bool {
        self.circle.contains(cell, x)
    }
    fn nodes(&self, x: &Point<F>, cell: usize) -> Vec<(Point<F>, f64)> {
        self.circle.nodes(x, cell)
    }
    fn solution(&self, x: &Point<F>) -> Option<f64> {
        self.circle.solution(x)
    }
    fn constant(&self) -> Option<f64> {
        self.circle.constant()
    }
    fn mass(&self, x: &Located<Point<F>>, cell: usize) -> Option<f64> {
        self.circle.mass(x, cell)
    }
}

impl<'x, 'a, F: Real, const B: usize> Neighbours<B> for Curved<'x, 'a, F, B> {
    fn offers(&self, offers: &mut Offers<'_, Self, B>) {
        let (n, light) = (self.circle.cells(), self.circle.light());
        offers.pairs("the paper's", PAPER);
        offers.pairs("all in S", IN_S);
        offers.pointwise_pairs("diagonal pointwise", DEFAULT);
        offers.coefficients("closed form", &self.polynomials, 0.0);
        for pairs in [PAPER, DEFAULT] {
            let name = format!("own, diagonal {:?}", pairs.diagonal);
            with_polynomials::<F, _, _, _, B>(&RHO, n, light, pairs, |_, neighbour, _| {
                offers.neighbour::<OfDegree<'_, '_, F, _, _, B>>(&name, neighbour);
            });
        }
        let tables = Tables::<f64>::new(&RHO, n).unwrap();
        let wide = Circle::new(tables.cells(), light, 0.2).unwrap();
        let wide = wide.with_functions::<B>();
        let solution = wide.solve(1e-15, 1000).unwrap();
        let v = solution.rounded::<F>().unwrap();
        let moments = residual_moments(&wide, &solution).unwrap();
        let residual = Residual::new(&self.polynomials, &v, &moments).unwrap();
        offers.neighbour("residual", &residual);
        let mut means = vec![0.0; n * B];
        wide.source_means(&mut means).unwrap();
        offers.source_means("16 points a cell", &means, 1e-14);
        offers.galerkin_solution("own", &solution.v, 1e-13);
    }
}
