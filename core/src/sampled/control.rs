//! What walks ask of a neighbour equation from steps.

use core::fmt;
use core::num::NonZeroU32;

use num_traits::{one, zero};

use super::events::{NoEvents, SampledStep, StepEvents};
use crate::array::from_fn;
use crate::galerkin::Basis;
use crate::{Kernel, Located, Neighbour, Real, Sampler, StateSpace, Uniforms};

/// The tables of v and of the control variate c, borrowed, of B functions on a cell and D numbers of a step.
#[derive(Clone, Copy, Debug)]
pub struct StepControl<'a, F> {
    /// v_ia: B numbers of every cell.
    pub v: &'a [F],
    /// c: for every cell and each of its m^D boxes of steps the B coefficients of ψ_ia(x), and the D of the place in the box.
    pub control: &'a [F],
    /// C_ia, m^−D times the sum of these coefficients over the boxes of a cell: B numbers of every cell. Where they are
    /// something else, there is a bias.
    pub integral: &'a [F],
    /// m, the boxes along each axis of [0, 1]^D.
    pub per_axis: u32,
    /// The numbers of the events of every cell, as many of each; `u32::MAX`: none in this place, nor behind it.
    pub events: &'a [u32],
    /// For every event of every cell the B coefficients of ψ_ia(x).
    pub of_events: &'a [F],
}

/// Why tables and cells do not belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampledError {
    /// There must be a box of steps along every axis, and 2¹⁶ at most.
    PerAxis,
    /// There are more than 32 events of a cell, or not as many of each.
    Events,
    /// A table has another length than n·B numbers, n·m^D·(B + D), or B for every event.
    Length {
        /// The length that it should have.
        expected: usize,
        /// The length that it has.
        found: usize,
    },
    /// The tables are of another number of channels than the equation has, or of more than
    /// [a walk serves](crate::channels::MOST_CHANNELS).
    Channels {
        /// The number of the equation's channels.
        expected: usize,
        /// The number of the tables' channels.
        found: usize,
    },
}

impl fmt::Display for SampledError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PerAxis => {
                f.write_str("there must be from 1 to 65536 boxes of steps along an axis")
            }
            Self::Events => f.write_str("every cell must have as many events, and 32 at most"),
            Self::Length { expected, found } => {
                write!(f, "a table must have {expected} numbers, not {found}")
            }
            Self::Channels { expected, found } => write!(
                f,
                "tables of {found} channels, for an equation of {expected}; there are {} at most",
                crate::channels::MOST_CHANNELS
            ),
        }
    }
}

impl core::error::Error for SampledError {}

/// The neighbour equation v = T_k v + G of any v, with an unbiased estimate of G from steps: see the
/// [module](crate::sampled). D is the number of uniform numbers that the control variate knows of a step; a step may draw
/// more, or fewer.
///
/// ```
/// use fredholm_core::galerkin::{Basis, Partition};
/// use fredholm_core::sampled::{Sampled, StepControl};
/// use fredholm_core::{Kernel, Located, Neighbour, NoDraws, Sampler, StateSpace, Uniforms};
///
/// /// u(x) = ½ ∫ u dy + 1 on [0, 1], of which nothing is known but how to step. u = 2.
/// struct Half;
///
/// impl StateSpace for Half {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl Sampler for Half {
///     fn absorption(&self, _: &f64) -> f64 {
///         0.5
///     }
///     fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
///         Some(uniforms.uniform())
///     }
/// }
/// impl Kernel for Half {
///     fn kernel(&self, _: &f64, _: &f64) -> f64 {
///         1.0
///     }
/// }
/// impl Partition for Half {
///     fn cells(&self) -> usize {
///         1
///     }
///     fn locate(&self, _: &f64) -> usize {
///         0
///     }
/// }
/// impl Basis for Half {
///     fn basis(&self, _: &Located<f64>) -> [f64; 1] {
///         [1.0]
///     }
/// }
///
/// // v = 2, and c = κ v = 1 in one box of steps.
/// let tables = StepControl {
///     v: &[2.0],
///     control: &[1.0, 0.0],
///     integral: &[1.0],
///     per_axis: 1,
///     events: &[],
///     of_events: &[],
/// };
/// let neighbour = Sampled::<_, _, 1, 1>::new(&Half, tables, 1.try_into().unwrap())?;
/// let x = neighbour.locate(0.3);
/// // v = T_k v + G with G = 1. Where c is all of κ v, G does not depend on what is drawn.
/// struct Fixed;
/// impl Uniforms<f64> for Fixed {
///     fn uniform(&mut self) -> f64 {
///         0.37
///     }
/// }
/// assert_eq!(neighbour.source(&x, &mut Fixed), 1.0);
/// # Ok::<(), fredholm_core::sampled::SampledError>(())
/// ```
#[derive(Debug)]
pub struct Sampled<'a, F, P, const D: usize, const B: usize = 1, E = NoEvents<P>> {
    problem: &'a P,
    events: &'a E,
    /// Events of a cell.
    slots: usize,
    tables: StepControl<'a, F>,
    steps: u32,
    per_steps: F,
    /// From one step of a score to the next.
    by: [F; D],
}

// By hand: a derive would ask the problem to be `Clone` and `Copy`.
impl<F: Copy, P, const D: usize, const B: usize, E> Clone for Sampled<'_, F, P, D, B, E> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<F: Copy, P, const D: usize, const B: usize, E> Copy for Sampled<'_, F, P, D, B, E> {}

impl<'a, F, P, const D: usize, const B: usize> Sampled<'a, F, P, D, B>
where
    F: Real,
    P: Basis<B> + StateSpace<Scalar = F>,
{
    /// A neighbour equation whose G takes so many steps wherever it is scored, and whose control variate has no events.
    ///
    /// # Errors
    /// [`SampledError`].
    pub fn new(
        problem: &'a P,
        tables: StepControl<'a, F>,
        steps: NonZeroU32,
    ) -> Result<Self, SampledError> {
        Self::with_events((problem, &NoEvents::NEW), tables, steps)
    }
}

impl<'a, F, P, const D: usize, const B: usize, E> Sampled<'a, F, P, D, B, E>
where
    F: Real,
    P: Basis<B> + StateSpace<Scalar = F>,
    E: StepEvents<D, Scalar = F, Point = P::Point>,
{
    /// A neighbour equation whose G takes so many steps wherever it is scored, with events of these steps.
    ///
    /// # Errors
    /// [`SampledError`].
    pub fn with_events(
        (problem, events): (&'a P, &'a E),
        tables: StepControl<'a, F>,
        steps: NonZeroU32,
    ) -> Result<Self, SampledError> {
        if tables.per_axis == 0 || tables.per_axis > 1 << 16 {
            return Err(SampledError::PerAxis);
        }
        let cells = problem.cells();
        let unknowns = cells.saturating_mul(B);
        let entries = (0..D)
            .fold(cells, |n, _| n.saturating_mul(tables.per_axis as usize))
            .saturating_mul(B + D);
        let slots = tables.events.len().checked_div(cells).unwrap_or(0);
        if slots > 32 || slots.saturating_mul(cells) != tables.events.len() {
            return Err(SampledError::Events);
        }
        for (table, expected) in [
            (tables.v, unknowns),
            (tables.integral, unknowns),
            (tables.control, entries),
            (tables.of_events, tables.events.len().saturating_mul(B)),
        ] {
            let found = table.len();
            if found != expected {
                return Err(SampledError::Length { expected, found });
            }
        }
        let mut by = [0.0; D];
        spread(&mut by);
        Ok(Self {
            problem,
            events,
            slots,
            tables,
            steps: steps.get(),
            per_steps: one::<F>() / F::from_u32(steps.get()),
            by: by.map(F::from_f64),
        })
    }

    /// c(x, ω).
    #[inline]
    fn control(&self, cell: usize, psi: &[F; B], omega: &[F; D]) -> F {
        let (number, place) = self.box_of(omega);
        let boxes = power::<D>(self.tables.per_axis);
        let from = (cell * boxes + number) * (B + D);
        let own = self.tables.control.get(from..from + B + D).unwrap_or(&[]);
        linear(own, psi, &place)
    }

    /// The events of x, with what c has for each there.
    #[inline]
    fn events_of(&self, x: &Located<P::Point>, psi: &[F; B]) -> EventsAt<'a, F> {
        let from = x.cell.saturating_mul(self.slots);
        let own = self.tables.events.get(from..).unwrap_or(&[]);
        let mut at = EventsAt {
            numbers: &[],
            values: [zero(); 32],
            integral: zero(),
        };
        for (&event, value) in own.iter().take(self.slots).zip(&mut at.values) {
            if event == u32::MAX {
                break;
            }
            let place = from + at.numbers.len();
            *value = combine(self.tables.of_events, place, psi);
            at.integral += *value * self.events.probability(&x.point, event);
            at.numbers = own.get(..at.numbers.len() + 1).unwrap_or(&[]);
        }
        at
    }

    /// The number of the box of steps in which ω lies, and its place there, from −1 to 1 along each axis.
    #[inline]
    fn box_of(&self, omega: &[F; D]) -> (usize, [F; D]) {
        box_of(omega, self.tables.per_axis)
    }
}

/// The events of a state.
struct EventsAt<'a, F> {
    numbers: &'a [u32],
    /// What c has for each, where it occurs.
    values: [F; 32],
    /// The sum of these times the probabilities.
    integral: F,
}

impl<F: Real> EventsAt<'_, F> {
    /// c(x, ω) of the events that occur.
    #[inline]
    fn control<E, const D: usize>(&self, events: &E, step: &SampledStep<'_, E::Point, F, D>) -> F
    where
        E: StepEvents<D, Scalar = F>,
    {
        let mut sum = zero::<F>();
        if self.numbers.is_empty() {
            return sum;
        }
        let mut left = events.occurring(step, self.numbers);
        while left != 0 {
            let place = left.trailing_zeros() as usize;
            sum += self.values.get(place).copied().unwrap_or(F::NAN);
            left &= left - 1;
        }
        sum
    }
}

/// See [`Sampled::box_of`].
#[inline]
pub(super) fn box_of<F: Real, const D: usize>(omega: &[F; D], per_axis: u32) -> (usize, [F; D]) {
    let m = F::from_u32(per_axis);
    let mut number = 0;
    let place = from_fn(|d| {
        let scaled = omega[d] * m;
        // Rounding may lead to m itself.
        let index = scaled.to_u32().min(per_axis - 1);
        number = number * per_axis as usize + index as usize;
        let within = scaled - F::from_u32(index);
        within + within - one()
    });
    (number, place)
}

/// m^D.
#[inline]
pub(super) const fn power<const D: usize>(per_axis: u32) -> usize {
    let (mut power, mut d) = (1_usize, 0);
    while d < D {
        power *= per_axis as usize;
        d += 1;
    }
    power
}

/// c in a box of steps, of its B + D coefficients: Σ_b c_b ψ_b(x), and Σ_d c_d t_d of the place in the box.
#[inline(always)]
pub(super) fn linear<F: Real, const D: usize, const B: usize>(
    own: &[F],
    psi: &[F; B],
    place: &[F; D],
) -> F {
    match own.split_first_chunk::<B>() {
        Some((of_x, of_omega)) => of_omega
            .iter()
            .zip(place)
            .fold(dot(of_x, psi), |sum, (&c, &t)| sum + c * t),
        None => F::NAN,
    }
}

/// Σ_b t_ib ψ_ib(x) of a table of B numbers for every i.
#[inline(always)]
pub(super) fn combine<F: Real, const B: usize>(table: &[F], i: usize, psi: &[F; B]) -> F {
    let own: &[F] = table.get(i * B..).unwrap_or(&[]);
    own.first_chunk::<B>().map_or(F::NAN, |own| dot(own, psi))
}

#[inline(always)]
fn dot<F: Real, const B: usize>(a: &[F; B], b: &[F; B]) -> F {
    let mut sum = a[0] * b[0];
    let mut i = 1;
    while i < B {
        sum += a[i] * b[i];
        i += 1;
    }
    sum
}

/// The numbers of a step: first those given, then others.
pub(super) struct Given<'a, F, const D: usize> {
    omega: [F; D],
    at: usize,
    rest: &'a mut dyn Uniforms<F>,
}

impl<'a, F, const D: usize> Given<'a, F, D> {
    pub(super) fn new(omega: [F; D], rest: &'a mut dyn Uniforms<F>) -> Self {
        Self { omega, at: 0, rest }
    }
}

impl<F: Real, const D: usize> Uniforms<F> for Given<'_, F, D> {
    #[inline]
    fn uniform(&mut self) -> F {
        let given = self.omega.get(self.at).copied();
        self.at += 1;
        given.unwrap_or_else(|| self.rest.uniform())
    }
}

/// The irrational steps of a sequence of points that fills [0, 1]^D evenly, D the length of `by`: powers of 1/φ, where
/// φ^(D+1) = φ + 1 (Roberts 2018; for D = 1 the golden ratio's). Shifted by a point that is uniform, each of its points is
/// uniform.
pub(super) fn spread(by: &mut [f64]) {
    let dimension = by.len();
    // Newton's iteration from above converges in a few steps; 32 are enough for any D.
    let mut phi = 2.0_f64;
    for _ in 0..32 {
        let power = (0..dimension).fold(1.0, |power, _| power * phi);
        let value = power * phi - phi - 1.0;
        phi -= value / ((dimension + 1) as f64 * power - 1.0);
    }
    let mut share = 1.0;
    for by in by {
        share /= phi;
        *by = share;
    }
}

/// The next point of that sequence.
#[inline]
pub(super) fn advance<F: Real>(omega: &mut [F], by: &[F]) {
    for (omega, &by) in omega.iter_mut().zip(by) {
        *omega += by;
        if *omega >= one() {
            *omega -= one();
        }
    }
}

impl<F: Real, P: StateSpace<Scalar = F>, const D: usize, const B: usize, E> StateSpace
    for Sampled<'_, F, P, D, B, E>
{
    type Scalar = F;
    type Point = P::Point;
}

impl<F, P, const D: usize, const B: usize, E> Neighbour for Sampled<'_, F, P, D, B, E>
where
    F: Real,
    P: Sampler + Kernel + Basis<B> + StateSpace<Scalar = F>,
    E: StepEvents<D, Scalar = F, Point = P::Point>,
{
    #[inline]
    fn locate(&self, x: P::Point) -> Located<P::Point> {
        Located {
            point: x,
            cell: self.problem.locate(&x),
        }
    }

    /// h = k.
    #[inline]
    fn kernel(&self, _: &Located<P::Point>, _: &Located<P::Point>, k: F) -> F {
        k
    }

    fn source(&self, x: &Located<P::Point>, draws: &mut dyn Uniforms<F>) -> F {
        let psi = self.problem.basis(x);
        let events = self.events_of(x, &psi);
        let survival = one::<F>() - self.problem.absorption(&x.point);
        let mut omega: [F; D] = from_fn(|_| draws.uniform());
        let mut sum = zero::<F>();
        for step in 0..self.steps {
            if step > 0 {
                advance(&mut omega, &self.by);
            }
            let mut numbers = Given::new(omega, &mut *draws);
            let to = self.problem.step(&x.point, &mut numbers);
            if let Some(y) = to {
                let kappa = survival * self.problem.kernel(&x.point, &y);
                sum += kappa * self.value(&self.locate(y));
            }
            sum -= self.control(x.cell, &psi, &omega);
            let step = SampledStep {
                from: &x.point,
                omega: &omega,
                to: to.as_ref(),
            };
            sum -= events.control(self.events, &step);
        }
        let own = combine(self.tables.v, x.cell, &psi);
        let integral = combine(self.tables.integral, x.cell, &psi) + events.integral;
        own - integral - sum * self.per_steps
    }

    #[inline]
    fn value(&self, x: &Located<P::Point>) -> F {
        combine(self.tables.v, x.cell, &self.problem.basis(x))
    }
}
