//! A toy equation on [0, 1] that uses every seam of the core: a density that is not constant, sources and kernels that are not
//! either, any small degree, every kind of pair, walks that leave the space, several channels, and a known solution.
//!
//! p(x,y) = (1 − ℓ)(1 + s x(y − ½)) with s = 1 or 0, where a step leaves with probability ℓ, k_c(x,y) = r_c (3 + xy)/5 in channel c, u(x) =
//! 1 + x − x² or 1. Everything is a polynomial, so that four Gauss points give every integral exactly.

use core::num::NonZeroU32;

use fredholm_core::galerkin::{
    Basis, Cells, Dense, PairIntegral, PairKind, Pairs, TransitionMoments,
};
use fredholm_core::global::Stationary;
use fredholm_core::sampled::{NoEvents, SampledSetup, SetupOptions};
use fredholm_core::{
    Chain, Channels, Density, Equation, Functional, Located, Neighbour, NoDraws, Real, Space,
    Start, StartOf, Uniforms, Value,
};

use crate::description::Description;
use crate::offers::{Neighbours, Offers};
use crate::quadrature::gauss_legendre;

/// The toy equation with n equal cells, of values V.
#[derive(Clone, Debug)]
pub struct Toy<F, V = F> {
    cells: usize,
    rule: Vec<(f64, f64)>,
    leaving: F,
    /// What x (y − ½) is multiplied by in p.
    slope: F,
    constant: bool,
    /// r_c.
    colours: V,
}

/// The toy in three channels.
pub type Coloured<F> = Toy<F, Channels<F, 3>>;

impl<F: Real> Toy<F> {
    /// With `cells` equal cells.
    #[must_use]
    pub fn new(cells: usize) -> Self {
        Self::of_colours(cells, F::one())
    }
}

impl<F: Real> Coloured<F> {
    /// With `cells` equal cells in three channels, of which the second is black.
    #[must_use]
    pub fn coloured(cells: usize) -> Self {
        let colours = [1.0, 0.0, -0.7].map(F::from_f64);
        Self::of_colours(cells, Channels::from_fn(3, |c| colours[c]))
    }
}

impl<F: Real, V: Value<F>> Toy<F, V> {
    fn of_colours(cells: usize, colours: V) -> Self {
        Self {
            cells,
            rule: gauss_legendre(4),
            leaving: F::zero(),
            slope: F::one(),
            constant: false,
            colours,
        }
    }

    /// The same with steps that leave the space with probability `leaving`.
    #[must_use]
    pub fn leaving(self, leaving: f64) -> Self {
        let leaving = F::from_f64(leaving);
        Self { leaving, ..self }
    }

    /// The same with uniform steps, which preserve a uniform density.
    #[must_use]
    pub fn uniform(self) -> Self {
        let slope = F::zero();
        Self { slope, ..self }
    }

    /// The same with the solution 1.
    #[must_use]
    pub fn constant(self) -> Self {
        Self {
            constant: true,
            ..self
        }
    }

    fn solution_at(&self, x: F) -> F {
        if self.constant {
            F::one()
        } else {
            F::one() + x - x * x
        }
    }

    /// k without r_c.
    fn grey(x: F, y: F) -> F {
        F::from_f64(0.2) * (F::from_f64(3.0) + x * y)
    }

    /// The Gauss points of cell `j` with weights that sum to its length.
    fn points(&self, j: usize) -> impl Iterator<Item = (F, f64)> {
        let length = 1.0 / self.cells as f64;
        let point = move |t: f64| F::from_f64((j as f64 + t) * length);
        self.rule.iter().map(move |&(t, w)| (point(t), w * length))
    }

    /// ∫_Xj p(x,y) f(y) dy of B functions.
    fn integral<const B: usize>(&self, x: F, j: usize, f: impl Fn(F) -> [F; B]) -> [F; B] {
        let mut integrals = [F::zero(); B];
        for (y, weight) in self.points(j) {
            let mass = F::from_f64(weight) * self.density(&x, &y);
            for (integral, f) in integrals.iter_mut().zip(f(y)) {
                *integral += mass * f;
            }
        }
        integrals
    }
}

impl<F: Real> Toy<F> {
    /// The solution 1 + x − x².
    #[must_use]
    pub fn exact(x: F) -> F {
        F::one() + x - x * x
    }

    /// The Galerkin matrix (39) and right-hand side (40), exact.
    #[must_use]
    pub fn galerkin<const B: usize>(&self) -> (Vec<F>, Vec<F>) {
        let unknowns = self.cells * B;
        let mut matrix = vec![F::zero(); unknowns * unknowns];
        let mut right = vec![F::zero(); unknowns];
        for i in 0..self.cells {
            for (point, weight) in self.points(i) {
                let weight = F::from_f64(weight * self.cells as f64);
                let x = Located { point, cell: i };
                let psi: [F; B] = self.basis(&x);
                for (a, &psi) in psi.iter().enumerate() {
                    right[i * B + a] += weight * psi * self.source(&point, &mut NoDraws);
                    for j in 0..self.cells {
                        let integral: [F; B] = self.pair_integral(&x, j);
                        for (b, &k) in integral.iter().enumerate() {
                            matrix[(i * B + a) * unknowns + j * B + b] += weight * psi * k;
                        }
                    }
                }
            }
        }
        (matrix, right)
    }

    /// The table as coefficients.
    ///
    /// # Panics
    /// If the table is not a square of cells·B rows.
    #[must_use]
    pub fn coefficients<'a, const B: usize>(&self, matrix: &'a [F]) -> Dense<'a, F> {
        Dense::new(matrix, self.cells, B).expect("a square table")
    }
}

impl<F: Real, V: Value<F>> Space for Toy<F, V> {
    type Scalar = F;
    type Point = F;
}

impl<F: Real, V: Value<F>> Chain for Toy<F, V> {
    fn step<U: Uniforms<F>>(&self, x: &F, uniforms: &mut U) -> Option<F> {
        let xi: F = uniforms.uniform();
        if xi < self.leaving {
            return None;
        }
        // y + s x(y² − y)/2 = ξ, solved without cancellation for small x.
        let xi = (xi - self.leaving) / (F::one() - self.leaving);
        let half = self.slope * *x * F::from_f64(0.5);
        let b = F::one() - half;
        let root = (b * b + F::from_f64(4.0) * half * xi).sqrt();
        Some(F::from_f64(2.0) * xi / (b + root))
    }
}

impl<F: Real, V: Value<F>> Density for Toy<F, V> {
    fn density(&self, x: &F, y: &F) -> F {
        let slope = self.slope * *x;
        (F::one() - self.leaving) * (F::one() + slope * (*y - F::from_f64(0.5)))
    }
}

impl<F: Real, V: Value<F>> Equation for Toy<F, V> {
    type Value = V;

    fn kernel(&self, x: &F, y: &F) -> V {
        self.colours.scaled(Self::grey(*x, *y))
    }

    fn source<U: Uniforms<F>>(&self, x: &F, _: &mut U) -> V {
        // F = u − T_K u; four Gauss points on [0, 1] are exact for degree 7.
        let integral = self.rule.iter().fold(F::zero(), |sum, &(t, w)| {
            let y = F::from_f64(t);
            let k = Self::grey(*x, y) * self.density(x, &y);
            sum + F::from_f64(w) * k * self.solution_at(y)
        });
        let u = V::splat(self.channels(), self.solution_at(*x));
        u.minus(&self.colours.scaled(integral))
    }

    fn channels(&self) -> usize {
        self.colours.channels()
    }

    fn size(&self, x: &F) -> F {
        Self::grey(*x, F::from_f64(0.5))
    }
}

impl<F: Real, V: Value<F>> Cells for Toy<F, V> {
    const DIMENSION: usize = 1;

    fn cells(&self) -> usize {
        self.cells
    }
    fn locate(&self, x: &F) -> usize {
        ((*x * F::from_f64(self.cells as f64)).to_u32() as usize).min(self.cells - 1)
    }
    fn measure(&self, _: usize) -> f64 {
        1.0 / self.cells as f64
    }
    fn point(&self, cell: usize, t: &[f64]) -> F {
        F::from_f64((cell as f64 + t[0]) / self.cells as f64)
    }
    fn parameters(&self, x: &Located<F>, t: &mut [F]) {
        t[0] = x.point * F::from_f64(self.cells as f64) - F::from_f64(x.cell as f64);
    }
    fn at(&self, x: &[f64]) -> Option<F> {
        x.first().copied().map(F::from_f64)
    }
}

impl<F: Real, V: Value<F>, const B: usize> Basis<B> for Toy<F, V> {}

impl<F: Real, V: Value<F>, const B: usize> TransitionMoments<B> for Toy<F, V> {
    fn moments(&self, x: &Located<F>, j: usize) -> [[F; B]; B] {
        let basis = |point| -> [F; B] { self.basis(&Located { point, cell: j }) };
        core::array::from_fn(|b| {
            self.integral(x.point, j, |y| {
                let psi = basis(y);
                psi.map(|other| psi[b] * other)
            })
        })
    }
}

impl<F: Real, V: Value<F>, const B: usize> PairIntegral<B> for Toy<F, V> {
    fn pair_integral(&self, x: &Located<F>, j: usize) -> [V; B] {
        let integrals = self.integral(x.point, j, |point| -> [F; B] {
            let psi: [F; B] = self.basis(&Located { point, cell: j });
            psi.map(|psi| Self::grey(x.point, point) * psi)
        });
        integrals.map(|integral| self.colours.scaled(integral))
    }
}

/// Uniform starts.
impl<F: Real, V: Value<F>> Stationary for Toy<F, V> {
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> F {
        uniforms.uniform()
    }
    fn start_density(&self, _: &F) -> f64 {
        1.0
    }
    fn is_preserved(&self) -> bool {
        [self.slope, self.leaving] == [F::zero(); 2]
    }
}

impl<F: Real, V: Value<F>, const B: usize> Description<B> for Toy<F, V> {
    type Equation = Self;

    fn equation(&self) -> &Self {
        self
    }
    fn contains(&self, cell: usize, x: &F) -> bool {
        let n = self.cells as f64;
        let (left, right) = (cell as f64 / n, (cell + 1) as f64 / n);
        let edge = 2.0 * F::EPSILON.to_f64();
        (left - edge..=right + edge).contains(&x.to_f64())
    }
    fn nodes(&self, _: &F, j: usize) -> Vec<(F, f64)> {
        self.points(j).collect()
    }
    fn leaving(&self, _: &F) -> f64 {
        self.leaving.to_f64()
    }
    fn solution(&self, x: &F) -> Option<V::Wide> {
        let u = self.solution_at(*x).to_f64();
        Some(V::Wide::splat(self.channels(), u))
    }
    fn constant(&self) -> Option<V::Wide> {
        self.constant.then(|| V::Wide::splat(self.channels(), 1.0))
    }
    fn cumulative(&self, x: &F, y: &F) -> Option<f64> {
        let (x, y) = (self.slope.to_f64() * x.to_f64(), y.to_f64());
        Some(y + 0.5 * x * (y * y - y))
    }
    fn mass(&self, x: &Located<F>, j: usize) -> Option<f64> {
        let (n, at) = (self.cells as f64, self.slope.to_f64() * x.point.to_f64());
        let staying = 1.0 - self.leaving.to_f64();
        Some(staying * (1.0 + at * ((j as f64 + 0.5) / n - 0.5)) / n)
    }
}

impl<F: Real, const B: usize> Neighbours<B> for Toy<F> {
    fn offers(&self, offers: &mut Offers<'_, Self, B>) {
        offers.starts(self);
        offers.pairs("all in S", ALL);
        offers.pointwise_pairs("diagonal pointwise", POINTWISE_DIAGONAL);
        offers.pointwise_pairs("pairs of all kinds", MIXED);
        offers.pointwise_pairs("all pointwise", ALL_POINTWISE);
        let (matrix, right) = self.galerkin::<B>();
        offers.coefficients("own", &self.coefficients::<B>(&matrix), 0.0);
        let right: Vec<f64> = right.into_iter().map(Real::to_f64).collect();
        offers.source_means("own", &right, 0.0);
    }
}

impl<F: Real, const B: usize> Neighbours<B> for Coloured<F> {
    fn offers(&self, offers: &mut Offers<'_, Self, B>) {
        offers.neighbour("constants", &Constants(self));
        let wide = Coloured::<f64>::coloured(self.cells).leaving(self.leaving.to_f64());
        let setup = SampledSetup::<_, 1, B> {
            equation: &wide,
            events: &NoEvents::NEW,
            options: SetupOptions {
                samples: 64,
                ..SetupOptions::default()
            },
        };
        let solution = setup.solve_all().expect("a contraction");
        let tables = solution.for_walks::<F>().expect("memory");
        let neighbour = tables.neighbour::<_, _, 1, B>(self, &NoEvents::<Self>::NEW, TWO);
        offers.neighbour("from steps", &neighbour.expect("its tables"));
    }
}

const TWO: NonZeroU32 = NonZeroU32::MIN.saturating_add(1);

/// The neighbour equation of v_c = c + 1 with h = k/2, and 0.2 where k is 0.
struct Constants<'a, F>(&'a Coloured<F>);

impl<F: Real> Constants<'_, F> {
    fn of_channels(&self, of: impl Fn(F, F) -> F) -> Channels<F, 3> {
        Channels::from_fn(3, |c| {
            let colour = self.0.colours.get(c);
            let colour = if colour == F::zero() {
                F::from_f64(0.4)
            } else {
                colour
            };
            of(colour * F::from_f64(0.5), F::from_u32(c as u32 + 1))
        })
    }
}

impl<F: Real> Space for Constants<'_, F> {
    type Scalar = F;
    type Point = F;
}

impl<F: Real> Neighbour for Constants<'_, F> {
    type Value = Channels<F, 3>;

    fn locate(&self, x: F) -> Located<F> {
        let cell = self.0.locate(&x);
        Located { point: x, cell }
    }
    fn kernel(&self, x: &Located<F>, y: &Located<F>, _: &Self::Value) -> Self::Value {
        let k = Toy::<F>::grey(x.point, y.point);
        self.of_channels(|colour, _| colour * k)
    }
    fn source(&self, x: &Located<F>, _: &mut dyn Uniforms<F>) -> Self::Value {
        let cells = 0..self.0.cells;
        let integrals = cells.map(|j| {
            self.0
                .integral(x.point, j, |y| [Toy::<F>::grey(x.point, y)])
        });
        let integral = integrals.fold(F::zero(), |sum, [own]| sum + own);
        self.of_channels(|colour, v| v * (F::one() - colour * integral))
    }
    fn value(&self, _: &Located<F>) -> Self::Value {
        self.of_channels(|_, v| v)
    }
}

/// (u, Φ) with Φ = 1: the mean of u over [0, 1], from starts with density p0(x) = ½ + x, so that
/// φ = 1/(½ + x) varies. The exact value is 7/6.
#[derive(Clone, Copy, Debug)]
pub struct Mean;

impl<F: Real> Functional<Toy<F>> for Mean {
    fn start<U: Uniforms<F>>(&self, toy: &Toy<F>, uniforms: &mut U) -> StartOf<Toy<F>> {
        let half = F::from_f64(0.5);
        let xi: F = uniforms.uniform();
        // ½x + ½x² = ξ
        let x = (F::from_f64(0.25) + xi + xi).sqrt() - half;
        Start::of(toy, x, F::one() / (half + x))
    }
}

/// Pairs of every kind: those on the diagonal, those just above it, and the rest.
#[derive(Clone, Copy, Debug)]
pub struct Bands {
    /// (i, i).
    pub diagonal: PairKind,
    /// (i, i + 1).
    pub above: PairKind,
    /// All others.
    pub rest: PairKind,
}

/// All pairs in S.
pub const ALL: Bands = Bands {
    diagonal: PairKind::Galerkin,
    above: PairKind::Galerkin,
    rest: PairKind::Galerkin,
};
/// All but the diagonal in S.
pub const POINTWISE_DIAGONAL: Bands = Bands {
    diagonal: PairKind::Pointwise,
    ..ALL
};
/// Pairs of every kind.
pub const MIXED: Bands = Bands {
    diagonal: PairKind::Pointwise,
    above: PairKind::Dropped,
    rest: PairKind::Galerkin,
};
/// No pair in S.
pub const ALL_POINTWISE: Bands = Bands {
    diagonal: PairKind::Pointwise,
    above: PairKind::Pointwise,
    rest: PairKind::Pointwise,
};

impl Pairs for Bands {
    fn kind(&self, i: usize, j: usize) -> PairKind {
        if i == j {
            self.diagonal
        } else if i + 1 == j {
            self.above
        } else {
            self.rest
        }
    }
}
