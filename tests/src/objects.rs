//! Walks of tasks whose parts are objects.
//!
//! Tests walk on hundreds of types of equations. What walks on objects is compiled once for every type of points.

use fredholm_conformance::check;
use fredholm_conformance::runners::{Any, Walkable};
use fredholm_core::rand_core::{Rng, SeedableRng};
use fredholm_core::{
    Equation, Functional, Located, Neighbour, NeighbourOf, Real, StateSpace, Statistics, Task,
    Uniforms,
};

/// An equation and its chain.
type AnyEquation<'a, F, P> = dyn Walkable<Scalar = F, Point = P> + 'a;
/// A task of objects.
pub type ObjectTask<'a, F, P, G> = Task<
    'a,
    Any<'a, AnyEquation<'a, F, P>>,
    dyn Neighbour<Scalar = F, Point = P> + 'a,
    AnyStart<'a, F, P>,
    G,
>;

/// A functional as an object.
trait Start<F, P> {
    fn start(&self, uniforms: &mut dyn Uniforms<F>) -> (P, F);
    fn control_estimate(&self, x0: &Located<P>, phi: F, v: F) -> f64;
}

/// A functional on the space of an equation.
struct On<'a, E, T>(&'a T, core::marker::PhantomData<E>);

impl<E: StateSpace, T: Functional<E>> Start<E::Scalar, E::Point> for On<'_, E, T> {
    fn start(&self, uniforms: &mut dyn Uniforms<E::Scalar>) -> (E::Point, E::Scalar) {
        self.0.start(&mut Numbers(uniforms))
    }
    fn control_estimate(&self, x0: &Located<E::Point>, phi: E::Scalar, v: E::Scalar) -> f64 {
        self.0.control_estimate(x0, phi, v)
    }
}

/// The object as a functional.
#[allow(
    missing_debug_implementations,
    reason = "an object of a trait has none"
)]
pub struct AnyStart<'a, F, P>(&'a dyn Start<F, P>);

impl<F: Real, P: Copy, E> Functional<E> for AnyStart<'_, F, P>
where
    E: StateSpace<Scalar = F, Point = P>,
{
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (P, F) {
        self.0.start(uniforms)
    }
    fn control_estimate(&self, x0: &Located<P>, phi: F, v: F) -> f64 {
        self.0.control_estimate(x0, phi, v)
    }
}

/// Uniform numbers of any kind.
struct Numbers<'a, F>(&'a mut dyn Uniforms<F>);

impl<F> Uniforms<F> for Numbers<'_, F> {
    fn uniform(&mut self) -> F {
        self.0.uniform()
    }
}

/// Hands on a task whose parts are objects: its walks have the same bits.
pub fn with_objects<E, N, T, G, R>(
    task: &Task<'_, E, N, T, G>,
    then: impl FnOnce(&ObjectTask<'_, E::Scalar, E::Point, G>) -> R,
) -> R
where
    E: Equation,
    N: NeighbourOf<E>,
    T: Functional<E>,
    G: Rng + SeedableRng,
{
    then(&Task {
        equation: &Any(task.equation),
        neighbour: task.neighbour,
        functional: &AnyStart(&On(task.functional, core::marker::PhantomData::<E>)),
        control_mean: task.control_mean,
        estimator: task.estimator,
        form: task.form,
        seeds: task.seeds,
        length: task.length,
    })
}

/// Runs the first walks of a task, in batches.
///
/// # Panics
/// If a walk scores a value that is not finite.
pub fn run<E, N, T, G>(task: &Task<'_, E, N, T, G>, walks: u64) -> Statistics
where
    E: Equation,
    N: NeighbourOf<E>,
    T: Functional<E>,
    G: Rng + SeedableRng,
{
    with_objects(task, |task| check::run(task, walks))
}
