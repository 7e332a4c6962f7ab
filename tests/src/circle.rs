//! What the checks need to know of the circle.

use core::f64::consts::TAU;

use fredholm_circle::{Circle, Emission, GalerkinSystem, Harmonic, OwnedTables, Point, Residual};
use fredholm_core::galerkin::{
    AllPointwise, Cells, DiagonalRule, PairKind, Pairs, Piecewise, PointwiseSource,
};
use fredholm_core::{Channels, Located, Real, Value};

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

/// A circle that owns its tables.
pub type Owned<F, E, V = F> = Circle<OwnedTables<F, V>, E>;

/// The circle with this reflectance, cells and emission.
///
/// # Panics
/// If there is none.
pub fn circle<F: Real, V: Value<F>, E: Emission<F, V>>(
    reflectance: &[V::Wide],
    cells: usize,
    emission: E,
) -> Owned<F, E, V> {
    Circle::new(OwnedTables::new(reflectance, cells).unwrap(), emission).unwrap()
}

/// The generic neighbour equation on a circle with B functions per cell.
pub type OnCircle<'a, F, E, S, const B: usize = 1> = Piecewise<
    'a,
    F,
    Owned<F, E>,
    GalerkinSystem<'a, OwnedTables<F>, E>,
    S,
    PointwiseSource<'a, F, Owned<F, E>, S, B>,
    B,
>;

/// Makes the generic neighbour equation with these pairs, as a user makes it: everything in f64 first.
///
/// # Panics
/// If there is no such circle.
pub fn with_piecewise<F: Real, E: Emission<F> + Emission<f64> + Copy, S: Pairs + Copy, R>(
    reflectance: &[f64],
    cells: usize,
    emission: E,
    pairs: S,
    then: impl FnOnce(&Owned<F, E>, &OnCircle<'_, F, E, S>, &[F]) -> R,
) -> R {
    with_polynomials::<F, E, S, R, 1>(reflectance, cells, emission, pairs, then)
}

/// As [`with_piecewise`], with polynomials of degree B − 1.
///
/// # Panics
/// If there is no such circle.
pub fn with_polynomials<F, E, S, R, const B: usize>(
    reflectance: &[f64],
    cells: usize,
    emission: E,
    pairs: S,
    then: impl FnOnce(&Owned<F, E>, &OnCircle<'_, F, E, S, B>, &[F]) -> R,
) -> R
where
    F: Real,
    E: Emission<F> + Emission<f64> + Copy,
    S: Pairs + Copy,
{
    let wide = circle::<f64, f64, _>(reflectance, cells, emission);
    let system = wide.system::<B>();
    let solution = system.solve(1e-15, 1000).unwrap();
    let (v, g) = (
        solution.rounded().unwrap(),
        solution.source(&system, &pairs).unwrap(),
    );
    let circle = circle(reflectance, cells, emission);
    let system = circle.system::<B>();
    let neighbour = Piecewise::with_pointwise(&circle, &system, pairs, &v, &g).unwrap();
    then(&circle, &neighbour, &v)
}

/// As [`with_polynomials`], with all pairs pointwise.
///
/// # Panics
/// If there is no such circle.
pub fn with_residual<F: Real, E: Emission<F> + Emission<f64> + Copy, R, const B: usize>(
    reflectance: &[f64],
    cells: usize,
    emission: E,
    then: impl FnOnce(&Owned<F, E>, &Residual<'_, OwnedTables<F>, B>, &[F]) -> R,
) -> R {
    let wide = circle::<f64, f64, _>(reflectance, cells, emission);
    let system = wide.system::<B>();
    let solution = system.solve(1e-15, 1000).unwrap();
    let (v, moments) = (
        solution.rounded().unwrap(),
        system.residual_moments(&solution).unwrap(),
    );
    let circle = circle(reflectance, cells, emission);
    let residual = Residual::new(circle.tables(), &v, &moments).unwrap();
    then(&circle, &residual, &v)
}

/// A furnace: u = 1 whatever the reflectance.
pub const FURNACE: Harmonic = Harmonic {
    constant: 1.0,
    amplitude: 0.0,
    frequency: 1,
};

/// A circle as the kit sees it.
#[derive(Clone, Debug)]
pub struct Described<F: Real, V: Value<F> = F> {
    circle: Owned<F, Harmonic, V>,
    reflectance: Vec<V::Wide>,
    rule: Vec<(f64, f64)>,
}

impl<F: Real, V: Value<F>> Described<F, V> {
    /// Describes the circle with this reflectance, cells and light.
    ///
    /// # Panics
    /// If there is no such circle.
    #[must_use]
    pub fn new(reflectance: &[V::Wide], cells: usize, light: Harmonic) -> Self {
        Self {
            circle: circle(reflectance, cells, light),
            reflectance: reflectance.to_vec(),
            // A wave of sin 5s wants some eight points.
            rule: gauss_legendre(12 + 36 / cells),
        }
    }

    fn light(&self) -> Harmonic {
        *self.circle.emission()
    }

    fn width(&self) -> f64 {
        TAU / self.circle.cells() as f64
    }

    /// The same number in every channel.
    fn splat(&self, x: f64) -> V::Wide {
        V::Wide::splat(self.reflectance[0].channels(), x)
    }
}

/// Everything about a circle with polynomials of degree B − 1, in f32 and f64.
#[must_use]
pub fn examined<const B: usize>(cells: usize, light: Harmonic, seed: u64) -> Report {
    let narrow = Described::<f32>::new(&RHO, cells, light);
    let wide = Described::<f64>::new(&RHO, cells, light);
    examine_both::<_, _, B>(&narrow, &wide, seed)
}

/// Three colours that share the chain.
type Colours<F> = Channels<F, 3>;

/// As [`examined`], in three colours, of which the first has the same reflectance, the second another and the third half of it.
#[must_use]
pub fn examined_in_colours<const B: usize>(cells: usize, light: Harmonic, seed: u64) -> Report {
    let of = |rho: &f64| Channels::from_fn(3, |c| [*rho, 0.75 - rho, 0.5 * rho][c]);
    let reflectance: Vec<Colours<f64>> = RHO.iter().map(of).collect();
    let narrow = Described::<f32, Colours<f32>>::new(&reflectance, cells, light);
    let wide = Described::<f64, Colours<f64>>::new(&reflectance, cells, light);
    examine_both::<_, _, B>(&narrow, &wide, seed)
}

/// The masses of a circle with very many cells, in f32 and f64.
#[must_use]
pub fn examined_masses(cells: usize, seed: u64) -> Report {
    let wide = Described::<f64>::new(&RHO, cells, LIGHT);
    let narrow = Described::<f32>::new(&RHO, cells, LIGHT);
    let mut report = examine_masses::<_, 1>(&wide, seed);
    report.extend(examine_masses::<_, 1>(&narrow, seed));
    report
}

impl<F: Real, V: Value<F>, const B: usize> Description<B> for Described<F, V> {
    type Equation = Owned<F, Harmonic, V>;

    fn equation(&self) -> &Self::Equation {
        &self.circle
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

    fn solution(&self, x: &Point<F>) -> Option<V::Wide> {
        Some(self.splat(self.light().solution(x.angle().to_f64())))
    }

    fn constant(&self) -> Option<V::Wide> {
        (self.light().amplitude == 0.0).then(|| self.splat(self.light().constant))
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
        Some(if cell == x.cell {
            // 1 − cos A cos B = sin²((A−B)/2) + sin²((A+B)/2)
            let b = half - middle;
            (0.5 * (quarter - b)).sin().powi(2) + (0.5 * (quarter + b)).sin().powi(2)
        } else {
            quarter.sin() * (middle - half).sin().abs()
        })
    }
}

impl<F: Real, const B: usize> Neighbours<B> for Described<F> {
    fn offers(&self, offers: &mut Offers<'_, Self, B>) {
        let (n, light, rho) = (self.circle.cells(), self.light(), &self.reflectance);
        if n > 1 {
            offers.starts(&self.circle);
        }
        offers.pairs("the paper's", PAPER);
        offers.pairs("all in S", IN_S);
        offers.pointwise_pairs("diagonal pointwise", DEFAULT);
        if n < 50 {
            offers.pointwise_pairs("all pointwise", AllPointwise);
        }
        offers.coefficients("closed form", &self.circle.system::<B>(), 0.0);
        for pairs in [PAPER, DEFAULT] {
            let name = format!("own, diagonal {:?}", pairs.diagonal);
            with_polynomials::<F, _, _, _, B>(rho, n, light, pairs, |_, neighbour, _| {
                offers.neighbour::<OnCircle<'_, F, _, _, B>>(&name, neighbour);
            });
        }
        with_residual::<F, _, _, B>(rho, n, light, |_, residual, _| {
            offers.neighbour("residual", residual);
        });
        let wide = circle::<f64, f64, _>(rho, n, light);
        let mut means = vec![0.0; n * B];
        wide.system::<B>().source_means(&mut means).unwrap();
        offers.source_means("16 points a cell", &means, 1e-14);
        let solution = wide.system::<B>().solve(1e-15, 1000).unwrap();
        offers.galerkin_solution("own", &solution.v, 1e-13);
    }
}

impl<F: Real, const B: usize> Neighbours<B> for Described<F, Colours<F>> {
    fn offers(&self, offers: &mut Offers<'_, Self, B>) {
        let (n, light) = (self.circle.cells(), self.light());
        offers.starts(&self.circle);
        let wide = circle::<f64, Colours<f64>, _>(&self.reflectance, n, light);
        let (mut v, mut moments) = (Vec::new(), Vec::new());
        for channel in 0..3 {
            let system = wide.system::<B>().channel(channel);
            let solution = system.solve(1e-15, 1000).unwrap();
            v.extend(solution.rounded::<F>().unwrap());
            moments.extend(system.residual_moments(&solution).unwrap());
        }
        let residual = Residual::<_, B>::new(self.circle.tables(), &v, &moments).unwrap();
        offers.neighbour("residual", &residual);
    }
}
