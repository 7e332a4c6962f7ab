//! Walks of jobs whose parts are objects.
//!
//! Tests walk on hundreds of types of equations. What walks on objects is compiled once for every type of points and values.

use fredholm_conformance::check;
use fredholm_conformance::runners::{Any, Walkable};
use fredholm_core::{
    Equation, Functional, Goal, Goals, Located, Neighbour, Real, Start, StartOf, Statistics,
    Uniforms, Value, WalkOptions, WideOf,
};

/// An equation and its chain.
type AnyEquation<'a, F, P, V> = dyn Walkable<Scalar = F, Point = P, Value = V> + Sync + 'a;
/// A neighbour equation.
pub type AnyNeighbour<'a, F, P, V> = dyn Neighbour<Scalar = F, Point = P, Value = V> + Sync + 'a;

/// A functional on the space of an equation.
trait Starts<F: Real, P, V: Value<F>> {
    fn start(&self, uniforms: &mut dyn Uniforms<F>) -> Start<P, F, V>;
    fn control_estimate(&self, x0: &Located<P>, phi: F, v: &V) -> V::Wide;
    fn looks(&self) -> u32;
}

struct On<'a, E, T> {
    equation: &'a E,
    functional: &'a T,
}

impl<E: Equation, T: Functional<E>> Starts<E::Scalar, E::Point, E::Value> for On<'_, E, T> {
    fn start(&self, uniforms: &mut dyn Uniforms<E::Scalar>) -> StartOf<E> {
        self.functional.start(self.equation, &mut Numbers(uniforms))
    }
    fn control_estimate(&self, x0: &Located<E::Point>, phi: E::Scalar, v: &E::Value) -> WideOf<E> {
        self.functional.control_estimate(x0, phi, v)
    }
    fn looks(&self) -> u32 {
        self.functional.looks()
    }
}

/// Uniform numbers of any kind.
struct Numbers<'a, F>(&'a mut dyn Uniforms<F>);

impl<F> Uniforms<F> for Numbers<'_, F> {
    fn uniform(&mut self) -> F {
        self.0.uniform()
    }
}

/// The object as a functional.
#[allow(
    missing_debug_implementations,
    reason = "an object of a trait has none"
)]
pub struct AnyStart<'a, F, P, V>(Box<dyn Starts<F, P, V> + Sync + 'a>);

impl<E: Equation> Functional<E> for AnyStart<'_, E::Scalar, E::Point, E::Value> {
    fn start<U: Uniforms<E::Scalar>>(&self, _: &E, uniforms: &mut U) -> StartOf<E> {
        self.0.start(uniforms)
    }
    fn control_estimate(&self, x0: &Located<E::Point>, phi: E::Scalar, v: &E::Value) -> WideOf<E> {
        self.0.control_estimate(x0, phi, v)
    }
    fn looks(&self) -> u32 {
        self.0.looks()
    }
}

/// An equation, its neighbour equation and a goal as objects: walks have the same bits.
#[allow(
    missing_debug_implementations,
    reason = "an object of a trait has none"
)]
pub struct Objects<'a, F: Real, P, V: Value<F>> {
    equation: Any<'a, AnyEquation<'a, F, P, V>>,
    neighbour: &'a AnyNeighbour<'a, F, P, V>,
    goals: [Goal<AnyStart<'a, F, P, V>, V::Wide>; 1],
}

/// The job of objects.
pub type ObjectGoals<'o, 'a, F, P, V> =
    Goals<'o, Any<'a, AnyEquation<'a, F, P, V>>, AnyNeighbour<'a, F, P, V>, AnyStart<'a, F, P, V>>;

impl<'a, F: Real, P: Copy + 'a, V: Value<F>> Objects<'a, F, P, V> {
    /// These as objects.
    pub fn new<E, T>(
        equation: &'a E,
        neighbour: &'a AnyNeighbour<'a, F, P, V>,
        goal: &'a Goal<T, V::Wide>,
    ) -> Self
    where
        E: Equation<Scalar = F, Point = P, Value = V> + Sync,
        T: Functional<E> + Sync,
    {
        let functional = &goal.functional;
        Self {
            equation: Any(equation),
            neighbour,
            goals: [Goal {
                functional: AnyStart(Box::new(On {
                    equation,
                    functional,
                })),
                control_mean: goal.control_mean,
                known: goal.known,
            }],
        }
    }

    /// Their job with these options.
    pub fn job(&self, options: WalkOptions) -> ObjectGoals<'_, 'a, F, P, V> {
        Goals::new(&self.equation, self.neighbour, &self.goals, options)
    }
}

/// Runs the first walks of a goal of one channel, in batches.
///
/// # Panics
/// If a walk scores a value that is not finite.
pub fn run<E, T>(
    equation: &E,
    neighbour: &AnyNeighbour<'_, E::Scalar, E::Point, E::Scalar>,
    goal: &Goal<T, f64>,
    options: WalkOptions,
    walks: u64,
) -> Statistics
where
    E: Equation<Value = <E as fredholm_core::Space>::Scalar> + Sync,
    T: Functional<E> + Sync,
{
    let objects = Objects::new(equation, neighbour, goal);
    check::run(&objects.job(options), walks)[0]
}
