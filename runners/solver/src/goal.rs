//! What is asked for.

use crate::{Error, Model};

/// A part of the space of states, or a point, for which something is asked.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Region {
    /// The mean of u over the whole space.
    Whole,
    /// u at an angle of a circle.
    Angle(f64),
    /// The mean of u over an interval of angles.
    Arc(f64, f64),
    /// u at a point, by its coordinates; in a room the mean of u over all directions in which the point, between the walls,
    /// sees them.
    Point(Vec<f64>),
    /// ∫ u w for the weight of this number, which the model knows.
    Weight(usize),
    /// u on the part of this number, a surface say, at this share of its length.
    On(usize, f64),
    /// The mean of u over the part of this number.
    Part(usize),
    /// The mean of u over the parts of these numbers together.
    Parts(Vec<usize>),
}

/// A functional of the solution, with the name that results give it.
#[derive(Clone, Debug, PartialEq)]
pub struct Goal {
    /// The name.
    pub name: String,
    /// Where.
    pub region: Region,
}

/// One thing that is asked for, or many in a row.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// What results call it.
    pub name: String,
    /// What is asked.
    pub ask: Ask,
}

/// What a target asks.
#[derive(Clone, Debug, PartialEq)]
pub enum Ask {
    /// One functional.
    One(Region),
    /// u at so many points, equally spaced over the space or along the part of this number.
    Grid {
        /// The number of points.
        points: usize,
        /// The part, where the space has several.
        part: Option<usize>,
    },
}

impl Target {
    /// The functionals that it asks for: `name`, or `name[0]`, `name[1]` and so on.
    fn goals(&self, model: &dyn Model) -> Vec<Goal> {
        match &self.ask {
            Ask::One(region) => vec![Goal {
                name: self.name.clone(),
                region: region.clone(),
            }],
            Ask::Grid { points, part } => {
                let regions = model.grid(*points, *part).into_iter().enumerate();
                let goal = |(i, region)| Goal {
                    name: format!("{}[{i}]", self.name),
                    region,
                };
                regions.map(goal).collect()
            }
        }
    }
}

/// The functionals of all targets.
///
/// # Errors
/// [`Error::TwoGoals`]: two have the same name.
pub fn goals(model: &dyn Model, targets: &[Target]) -> Result<Vec<Goal>, Error> {
    let all: Vec<Goal> = targets
        .iter()
        .flat_map(|target| target.goals(model))
        .collect();
    let mut names: Vec<&str> = all.iter().map(|goal| goal.name.as_str()).collect();
    names.sort_unstable();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(Error::TwoGoals {
            name: pair[0].to_owned(),
        }),
        None => Ok(all),
    }
}
