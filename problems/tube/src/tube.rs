//! The equation, its chain and its cells.

use fredholm_core::galerkin::{Basis, Cells, PairIntegral, TransitionMoments};
use fredholm_core::{Chain, Density, Equation, Located, Real, Space, Uniforms};

use crate::TubeError;

/// The part of the length that stands for an end, beyond 0 and beyond L.
const END: f64 = 1.0 / 64.0;

/// The parameters of an equation, with the radius of the tube as the unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// L/R.
    pub length: f64,
    /// ρ of the wall, in [0, 1].
    pub reflectance: f64,
    /// What the wall emits.
    pub emission: f64,
    /// What the black ends emit, that at 0 first.
    pub ends: [f64; 2],
}

/// The equation, its chain and its cells. A point is a place z along the axis: from 0 to L of the wall, below 0 and above L of the ends.
#[derive(Clone, Copy, Debug)]
pub struct Tube<F> {
    cells: usize,
    length: F,
    /// The length that stands for an end.
    end: F,
    reflectance: F,
    emission: F,
    ends: [F; 2],
}

/// Where a point lies.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    Left,
    Wall,
    Right,
}

/// q = √(1 + d²/4) − d/2 of a distance d: all view factors are rational in it.
#[derive(Clone, Copy)]
struct Distance<F> {
    half: F,
    root: F,
    q: F,
}

impl<F: Real> Distance<F> {
    fn new(d: F) -> Self {
        let half = F::from_f64(0.5) * d;
        let root = (F::one() + half * half).sqrt();
        let q = F::one() / (half + root);
        Self { half, root, q }
    }

    /// The distance of a q.
    fn of(q: F) -> F {
        F::one() / q - q
    }

    /// The part of what a ring sends out that passes the disc at this distance: q³/(1 + q²).
    fn of_ring(self) -> F {
        let square = self.q * self.q;
        square * self.q / (F::one() + square)
    }

    /// What passes this disc and not the further one, of what a ring and of what an end sends out. Nothing cancels.
    fn less(self, far: Self) -> [F; 2] {
        let (one, a, b) = (F::one(), self.q, far.q);
        let sum = a + b;
        let difference = (far.half - self.half) * sum / (self.root + far.root);
        let (a2, b2) = (a * a, b * b);
        let ring = difference * (a2 + a * b + b2 + a2 * b2) / ((one + a2) * (one + b2));
        [ring, difference * sum]
    }
}

/// The root q of q³ = s (1 + q²) for s in (0, ½], by Cardano's formula: what stands under both roots is positive.
fn root<F: Real>(s: F) -> F {
    let (third, half) = (F::from_f64(1.0 / 3.0), F::from_f64(0.5));
    let shift = s * third;
    let square = shift * shift;
    let a = shift * square + half * s;
    // a² − (s²/9)³, whose terms of s⁶ cancel.
    let b = s * s * (square * third + half * half);
    let y = (a + b.sqrt()).pow(third);
    shift + y + square / y
}

impl<F: Real> Tube<F> {
    /// The tube with its two ends and `cells` − 2 equal rings as cells, or all of it as one cell.
    ///
    /// # Errors
    /// [`TubeError`].
    pub fn new(cells: usize, parameters: &Parameters) -> Result<Self, TubeError> {
        if cells != 1 && !(3..=1 << 24).contains(&cells) {
            return Err(TubeError::Cells);
        }
        let length = F::from_f64(parameters.length);
        if !(length > F::zero() && length.is_finite()) {
            return Err(TubeError::Length);
        }
        if !(0.0..=1.0).contains(&parameters.reflectance) {
            return Err(TubeError::Reflectance);
        }
        let ends = parameters.ends.map(F::from_f64);
        let emission = F::from_f64(parameters.emission);
        if !(emission.is_finite() && ends.iter().all(|e| e.is_finite())) {
            return Err(TubeError::Emission);
        }
        Ok(Self {
            cells,
            length,
            end: F::from_f64(END) * length,
            reflectance: F::from_f64(parameters.reflectance),
            emission,
            ends,
        })
    }

    /// The length that stands for an end, beyond 0 and beyond L.
    #[must_use]
    pub const fn end(&self) -> F {
        self.end
    }

    fn place(&self, x: F) -> Place {
        if x < F::zero() {
            Place::Left
        } else if x <= self.length {
            Place::Wall
        } else {
            Place::Right
        }
    }

    /// The ends of a cell.
    fn edges(&self, cell: usize) -> [F; 2] {
        [self.edge(cell), self.edge(cell + 1)]
    }

    /// The lower end of a cell.
    fn edge(&self, cell: usize) -> F {
        match cell {
            0 => -self.end,
            _ if cell >= self.cells => self.length + self.end,
            _ => {
                let rings = F::from_f64((self.cells - 2) as f64);
                self.length * (F::from_f64((cell - 1) as f64) / rings)
            }
        }
    }

    /// The probability of a step from x to between two places of the wall.
    fn between(&self, x: F, [low, high]: [F; 2]) -> F {
        let zero = F::zero();
        let (low, high) = (
            low.max(zero),
            if high < self.length {
                high
            } else {
                self.length
            },
        );
        if low >= high {
            return zero;
        }
        let part = |near: F, far: F| Distance::new(near).less(Distance::new(far));
        match self.place(x) {
            Place::Left => part(low, high)[1],
            Place::Right => part(self.length - high, self.length - low)[1],
            Place::Wall if x <= low => part(low - x, high - x)[0],
            Place::Wall if x >= high => part(x - high, x - low)[0],
            Place::Wall => part(zero, x - low)[0] + part(zero, high - x)[0],
        }
    }
}

impl<F: Real> Space for Tube<F> {
    type Scalar = F;
    type Point = F;
}

/// What leaves through an end ends there.
impl<F: Real> Chain for Tube<F> {
    fn step<U: Uniforms<F>>(&self, x: &F, uniforms: &mut U) -> Option<F> {
        let half = F::from_f64(0.5);
        let u = uniforms.uniform();
        // 1 − u is never 0.
        let y = match self.place(*x) {
            Place::Left => Distance::of((F::one() - u).sqrt()),
            Place::Right => self.length - Distance::of((F::one() - u).sqrt()),
            Place::Wall if u < half => *x + Distance::of(root(half - u)),
            Place::Wall => *x - Distance::of(root(F::one() - u)),
        };
        (self.place(y) == Place::Wall).then_some(y)
    }
}

impl<F: Real> Density for Tube<F> {
    fn density(&self, x: &F, y: &F) -> F {
        let one = F::one();
        if self.place(*y) != Place::Wall {
            return F::zero();
        }
        let of_end = |distance| {
            let q = Distance::new(distance).q;
            (q + q) * q * q / (one + q * q)
        };
        match self.place(*x) {
            Place::Left => of_end(*y),
            Place::Right => of_end(self.length - *y),
            Place::Wall => {
                let q = Distance::new((*x - *y).abs()).q;
                let (square, all) = (q * q, one + q * q);
                square * square * (F::from_f64(3.0) + square) / (all * all * all)
            }
        }
    }
}

impl<F: Real> Equation for Tube<F> {
    type Value = F;

    /// ρ on the wall; an end is told what comes to it.
    fn kernel(&self, x: &F, _: &F) -> F {
        match self.place(*x) {
            Place::Wall => self.reflectance,
            _ => F::one(),
        }
    }

    fn source<U: Uniforms<F>>(&self, x: &F, _: &mut U) -> F {
        let [left, right] = self.ends;
        let across = || {
            let q = Distance::new(self.length).q;
            q * q
        };
        match self.place(*x) {
            Place::Left => right * across(),
            Place::Right => left * across(),
            Place::Wall => {
                let [near, far] = [*x, self.length - *x].map(|d| Distance::new(d).of_ring());
                self.emission + self.reflectance * (left * near + right * far)
            }
        }
    }
}

impl<F: Real> Cells for Tube<F> {
    const DIMENSION: usize = 1;

    fn cells(&self) -> usize {
        self.cells
    }

    fn locate(&self, x: &F) -> usize {
        if self.cells == 1 {
            return 0;
        }
        match self.place(*x) {
            Place::Left => 0,
            Place::Right => self.cells - 1,
            Place::Wall => {
                let rings = self.cells - 2;
                let ring = (*x / self.length * F::from_f64(rings as f64)).to_u32() as usize;
                1 + ring.min(rings - 1)
            }
        }
    }

    fn measure(&self, cell: usize) -> f64 {
        let [low, high] = self.edges(cell).map(F::to_f64);
        high - low
    }

    fn point(&self, cell: usize, t: &[f64]) -> F {
        let [low, high] = self.edges(cell).map(F::to_f64);
        let t = t.first().copied().unwrap_or(f64::NAN);
        F::from_f64(low + t * (high - low))
    }

    fn parameters(&self, x: &Located<F>, t: &mut [F]) {
        let [low, high] = self.edges(x.cell);
        let inside = ((x.point - low) / (high - low)).max(F::zero());
        let inside = if inside > F::one() { F::one() } else { inside };
        t.iter_mut().for_each(|t| *t = inside);
    }

    /// The ring at z, from 0 to L.
    fn at(&self, coordinates: &[f64]) -> Option<F> {
        let &[z] = coordinates else { return None };
        let z = F::from_f64(z);
        (self.place(z) == Place::Wall).then_some(z)
    }
}

impl<F: Real, const B: usize> Basis<B> for Tube<F> {}

impl<F: Real> TransitionMoments for Tube<F> {
    fn moments(&self, x: &Located<F>, j: usize) -> [[F; 1]; 1] {
        [[self.between(x.point, self.edges(j))]]
    }

    /// No step leads to an end, and no entry of K′ either.
    fn solve_moments(&self, x: &Located<F>, j: usize, right: [F; 1]) -> [F; 1] {
        let mass = self.between(x.point, self.edges(j));
        right.map(|k| if k == F::zero() { k } else { k / mass })
    }
}

impl<F: Real> PairIntegral for Tube<F> {
    fn pair_integral(&self, x: &Located<F>, j: usize) -> [F; 1] {
        [self.kernel(&x.point, &x.point) * self.between(x.point, self.edges(j))]
    }
}
