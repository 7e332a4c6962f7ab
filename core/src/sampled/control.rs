//! What walks ask of a neighbour equation from steps.

use core::fmt;
use core::num::NonZeroU32;

use num_traits::{one, zero};

use super::events::{NoEvents, SampledStep, StepEvents};
use crate::array::from_fn;
use crate::galerkin::Basis;
use crate::{Equation, Located, Neighbour, Real, Space, Uniforms, Value};

/// The tables of v and of the control variate c, borrowed, of C channels, B functions on a cell and D numbers of a step.
///
/// Numbers of a cell, or of one of its boxes or events, stand side by side for all channels.
#[derive(Clone, Copy, Debug)]
pub struct StepControl<'a, F> {
    /// v_ia: C B numbers of every cell.
    pub v: &'a [F],
    /// c: for every cell, each of its m^D boxes of steps and every channel the B coefficients of ψ_ia(x), and the D of the place in
    /// the box.
    pub control: &'a [F],
    /// C_ia, m^−D times the sum of these coefficients over the boxes of a cell: C B numbers of every cell. Where they are
    /// something else, there is a bias.
    pub integral: &'a [F],
    /// m, the boxes along each axis of [0, 1]^D.
    pub per_axis: u32,
    /// The numbers of the events of every cell, as many of each; `u32::MAX`: none in this place, nor behind it.
    pub events: &'a [u32],
    /// For every event of every cell and every channel the B coefficients of ψ_ia(x).
    pub of_events: &'a [F],
}

/// Why tables and cells do not belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampledError {
    /// There must be a box of steps along every axis, and 2¹⁶ at most.
    PerAxis,
    /// There are more than 32 events of a cell, or not as many of each.
    Events,
    /// A table has another length than n·C·B numbers, n·m^D·C·(B + D), or C·B for every event.
    Length {
        /// The length that it should have.
        expected: usize,
        /// The length that it has.
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
        }
    }
}

impl core::error::Error for SampledError {}

/// The neighbour equation v = T_k v + G of any v, with an unbiased estimate of G from steps: see the
/// [module](crate::sampled). D is the number of uniform numbers that the control variate knows of a step; a step may draw
/// more, or fewer. Of several channels each has its own v and c, and all share the steps.
///
/// ```
/// use fredholm_core::galerkin::{Basis, Cells};
/// use fredholm_core::sampled::{Sampled, StepControl};
/// use fredholm_core::{Chain, Equation, Located, Neighbour, Space, Uniforms};
///
/// /// u(x) = ½ ∫ u dy + 1 on [0, 1], of which nothing is known but how to step. u = 2.
/// struct Half;
///
/// impl Space for Half {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl Chain for Half {
///     fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
///         Some(uniforms.uniform())
///     }
/// }
/// impl Equation for Half {
///     type Value = f64;
///     fn kernel(&self, _: &f64, _: &f64) -> f64 {
///         0.5
///     }
///     fn source<U: Uniforms<f64>>(&self, _: &f64, _: &mut U) -> f64 {
///         1.0
///     }
/// }
/// # impl Cells for Half {
/// #     const DIMENSION: usize = 1;
/// #     fn cells(&self) -> usize { 1 }
/// #     fn locate(&self, _: &f64) -> usize { 0 }
/// #     fn measure(&self, _: usize) -> f64 { 1.0 }
/// #     fn point(&self, _: usize, t: &[f64]) -> f64 { t[0] }
/// #     fn parameters(&self, x: &Located<f64>, t: &mut [f64]) { t[0] = x.point }
/// #     fn at(&self, x: &[f64]) -> Option<f64> { x.first().copied() }
/// # }
/// # impl Basis for Half {}
///
/// // v = 2, and c = k v = 1 in one box of steps, on one cell.
/// let tables = StepControl {
///     v: &[2.0],
///     control: &[1.0, 0.0],
///     integral: &[1.0],
///     per_axis: 1,
///     events: &[],
///     of_events: &[],
/// };
/// let neighbour = Sampled::<_, 1, 1>::new(&Half, tables, 1.try_into().unwrap())?;
/// let x = neighbour.locate(0.3);
/// // v = T_k v + G with G = 1. Where c is all of k v, G does not depend on what is drawn.
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
pub struct Sampled<'a, E: Space, const D: usize, const B: usize = 1, V = NoEvents<E>> {
    equation: &'a E,
    events: &'a V,
    channels: usize,
    /// Events of a cell.
    slots: usize,
    tables: StepControl<'a, E::Scalar>,
    steps: u32,
    per_steps: E::Scalar,
    /// From one step of a score to the next.
    by: [E::Scalar; D],
}

// By hand: a derive would ask the equation to be `Clone` and `Copy`.
impl<E: Space, const D: usize, const B: usize, V> Clone for Sampled<'_, E, D, B, V> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<E: Space, const D: usize, const B: usize, V> Copy for Sampled<'_, E, D, B, V> {}

impl<'a, E: Equation + Basis<B>, const D: usize, const B: usize> Sampled<'a, E, D, B> {
    /// A neighbour equation whose G takes so many steps wherever it is scored, and whose control variate has no events.
    ///
    /// # Errors
    /// [`SampledError`].
    pub fn new(
        equation: &'a E,
        tables: StepControl<'a, E::Scalar>,
        steps: NonZeroU32,
    ) -> Result<Self, SampledError> {
        Self::with_events(equation, &NoEvents::NEW, tables, steps)
    }
}

impl<'a, E, V, const D: usize, const B: usize> Sampled<'a, E, D, B, V>
where
    E: Equation + Basis<B>,
    V: StepEvents<D, Scalar = E::Scalar, Point = E::Point>,
{
    /// A neighbour equation whose G takes so many steps wherever it is scored, with events of these steps.
    ///
    /// # Errors
    /// [`SampledError`].
    pub fn with_events(
        equation: &'a E,
        events: &'a V,
        tables: StepControl<'a, E::Scalar>,
        steps: NonZeroU32,
    ) -> Result<Self, SampledError> {
        if tables.per_axis == 0 || tables.per_axis > 1 << 16 {
            return Err(SampledError::PerAxis);
        }
        let (cells, channels) = (equation.cells(), equation.channels());
        let unknowns = cells.saturating_mul(channels * B);
        let entries = (0..D)
            .fold(cells, |n, _| n.saturating_mul(tables.per_axis as usize))
            .saturating_mul(channels * (B + D));
        let slots = tables.events.len().checked_div(cells).unwrap_or(0);
        if slots > 32 || slots.saturating_mul(cells) != tables.events.len() {
            return Err(SampledError::Events);
        }
        for (table, expected) in [
            (tables.v, unknowns),
            (tables.integral, unknowns),
            (tables.control, entries),
            (
                tables.of_events,
                tables.events.len().saturating_mul(channels * B),
            ),
        ] {
            let found = table.len();
            if found != expected {
                return Err(SampledError::Length { expected, found });
            }
        }
        let mut by = [0.0; D];
        spread(&mut by);
        Ok(Self {
            equation,
            events,
            channels,
            slots,
            tables,
            steps: steps.get(),
            per_steps: one::<E::Scalar>() / E::Scalar::from_u32(steps.get()),
            by: by.map(E::Scalar::from_f64),
        })
    }

    /// A combination of the ψ_ia(x) of a table with C B numbers for every place, channel by channel.
    #[inline(always)]
    fn combined(&self, table: &[E::Scalar], place: usize, psi: &[E::Scalar; B]) -> E::Value {
        let first = place.saturating_mul(self.channels);
        E::Value::from_fn(self.channels, |c| combine(table, first + c, psi))
    }

    /// c of the boxes at (x, ω).
    #[inline]
    fn of_boxes(&self, cell: usize, psi: &[E::Scalar; B], omega: &[E::Scalar; D]) -> E::Value {
        let (number, place) = box_of(omega, self.tables.per_axis);
        let boxes = power::<D>(self.tables.per_axis);
        let first = (cell * boxes + number) * self.channels;
        E::Value::from_fn(self.channels, |c| {
            let from = (first + c) * (B + D);
            let own = self.tables.control.get(from..from + B + D).unwrap_or(&[]);
            linear(own, psi, &place)
        })
    }

    /// The events of a cell.
    #[inline]
    fn events_of(&self, cell: usize) -> &'a [u32] {
        let from = cell.saturating_mul(self.slots);
        let own: &[u32] = self.tables.events.get(from..).unwrap_or(&[]);
        let own = own.get(..self.slots).unwrap_or(&[]);
        let count = own.iter().take_while(|&&event| event != u32::MAX).count();
        own.get(..count).unwrap_or(&[])
    }
}

/// The number of the box of steps in which ω lies, and its place there, from −1 to 1 along each axis.
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

impl<E: Space, const D: usize, const B: usize, V> Space for Sampled<'_, E, D, B, V> {
    type Scalar = E::Scalar;
    type Point = E::Point;
}

impl<E, V, const D: usize, const B: usize> Neighbour for Sampled<'_, E, D, B, V>
where
    E: Equation + Basis<B>,
    V: StepEvents<D, Scalar = E::Scalar, Point = E::Point>,
{
    type Value = E::Value;

    #[inline]
    fn locate(&self, x: E::Point) -> Located<E::Point> {
        Located {
            point: x,
            cell: self.equation.locate(&x),
        }
    }

    /// h = k.
    #[inline]
    fn kernel(&self, _: &Located<E::Point>, _: &Located<E::Point>, k: &E::Value) -> E::Value {
        *k
    }

    fn source(&self, x: &Located<E::Point>, draws: &mut dyn Uniforms<E::Scalar>) -> E::Value {
        let psi = self.equation.basis(x);
        let events = self.events_of(x.cell);
        let mut omega: [E::Scalar; D] = from_fn(|_| draws.uniform());
        let mut sum = E::Value::splat(self.channels, zero());
        // How often each event occurs.
        let mut times = [0_u32; 32];
        for step in 0..self.steps {
            if step > 0 {
                advance(&mut omega, &self.by);
            }
            let mut numbers = Given::new(omega, &mut *draws);
            let to = self.equation.step(&x.point, &mut numbers);
            if let Some(y) = to {
                let k = self.equation.kernel(&x.point, &y);
                sum = sum.plus(&k.times(&self.value(&self.locate(y))));
            }
            sum = sum.minus(&self.of_boxes(x.cell, &psi, &omega));
            if !events.is_empty() {
                let step = SampledStep {
                    from: &x.point,
                    omega: &omega,
                    to: to.as_ref(),
                };
                let mut left = self.events.occurring(&step, events);
                while left != 0 {
                    if let Some(times) = times.get_mut(left.trailing_zeros() as usize) {
                        *times += 1;
                    }
                    left &= left - 1;
                }
            }
        }
        let mut source = self.value(x);
        let integral = self.combined(self.tables.integral, x.cell, &psi);
        source = source.minus(&integral).minus(&sum.scaled(self.per_steps));
        // An event counts by how much more often it occurred than it does.
        let first = x.cell.saturating_mul(self.slots);
        for ((place, &event), &times) in (first..).zip(events).zip(&times) {
            let share = E::Scalar::from_u32(times) * self.per_steps;
            let more = share - self.events.probability(&x.point, event);
            let own = self.combined(self.tables.of_events, place, &psi);
            source = source.plus(&own.scaled(more));
        }
        source
    }

    #[inline]
    fn value(&self, x: &Located<E::Point>) -> E::Value {
        self.combined(self.tables.v, x.cell, &self.equation.basis(x))
    }

    #[inline]
    fn is_pointwise(&self) -> bool {
        true
    }
}
