//! The kinds of equations that follow from what a problem states.

use fredholm_model::Quantity;

use crate::PointDependences;

/// What a model leaves to the one that it is made of, which its method of this name gives: walks and set-ups are compiled in this crate, with
/// this crate's optimisation, and not once more wherever such a model is used.
macro_rules! delegated {
    ($inner:ident) => {
        fredholm_model::of_space!($inner);

        fn exact(&self, region: &Region) -> Result<Option<f64>, Error> {
            self.$inner().exact(region)
        }

        fn partition<'m>(
            &'m self,
            discretisation: &Discretisation,
        ) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
            self.$inner().partition(discretisation)
        }
    };
}

/// What a model of no checks of its own leaves to the one that it is made of.
macro_rules! delegated_checks {
    ($inner:ident) => {
        fn about(&self) -> About {
            self.$inner().about()
        }

        fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
            self.$inner().check_goals(goals)
        }

        fn by_resolvent(
            &self,
            question: &ResolventQuestion<'_>,
        ) -> Result<ResolventFound<'_>, Error> {
            self.$inner().by_resolvent(question)
        }

        fn quantities(&self) -> Vec<Quantity> {
            self.$inner().quantities()
        }

        fn check(&self, discretisation: &Discretisation, pairs: Pairs) -> Result<(), Error> {
            self.$inner().check(discretisation, pairs)
        }
    };
}

/// Quantities of a key of these values, in this range: numbered, if there are several.
fn numbered(name: &str, values: &[f64], range: [f64; 2]) -> Vec<Quantity> {
    let one = |(i, &value): (usize, &f64)| {
        let name = match values.len() {
            1 => name.to_owned(),
            _ => format!("{name} {}", i + 1),
        };
        Quantity {
            range,
            ..Quantity::number(&name, value)
        }
    };
    values.iter().enumerate().map(one).collect()
}

/// The quantities of an equation, and what points and steps have to do with them.
type Told<P> = (Vec<Quantity>, Box<PointDependences<P>>);

/// All numbers, and the parts of a whole.
const ANY: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
const PART: [f64; 2] = [0.0, 1.0];

pub mod circle;
pub mod cube;
mod derivatives;
pub mod sphere;
pub mod system;
pub mod tube;
mod watch;

pub use circle::CircleModel;
pub use cube::CubeModel;
pub use derivatives::{Derivatives, KernelSlopes, SourceSlopes};
pub use sphere::SphereModel;
pub use system::SystemModel;
pub use tube::TubeModel;
