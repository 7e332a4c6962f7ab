//! What is asked for.

use core::fmt;
use std::sync::Arc;

use crate::{Error, GlobalQuantity, Model};

/// A part of the space of states, or a point, for which something is asked.
///
/// ```
/// use fredholm::circle::Emission;
/// use fredholm::{CircleModel, Region, Solver};
///
/// let u = CircleModel::new(vec![0.5], Emission::Arcs(vec![1.0, 0.0]));
/// let report = Solver::new(&u).goal("upper half", Region::Arc(0.0, 3.14)).walks(5000).solve()?;
/// assert_eq!(report.goals[0].name, "upper half");
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Region {
    /// The mean of u over the whole space.
    Whole,
    /// The mean of u over an interval of the only coordinate, such as the angles of a circle.
    Arc(f64, f64),
    /// u at a point, by its coordinates, of a circle the angle; in a room the mean of u over all directions in which the point, between the walls,
    /// sees them.
    Point(Vec<f64>),
    /// ∫ u w for the weight of this number, which the model knows.
    Weight(usize),
    /// ∫ u w for a weight w of the coordinates.
    Function(WeightFn),
    /// u on the part of this number, a surface say, at this share of its length.
    On(usize, f64),
    /// u at a point of the part of this number, a surface of a scene, by its three coordinates.
    Spot(usize, [f64; 3]),
    /// The irradiance, in the unit of u, at a place between the surfaces of a scene of what faces in a direction: a light meter.
    Facing {
        /// The place, by its three coordinates.
        at: [f64; 3],
        /// The direction, of any length above 0.
        direction: [f64; 3],
    },
    /// The mean of u over the part of this number.
    Part(usize),
    /// The mean of u over the parts of these numbers together.
    Parts(Vec<usize>),
    /// The irradiance of another region, a place on surfaces of a room or a scene or a mean over some, in the unit of u.
    Irradiance(Box<Self>),
    /// The net flux out of another region of surfaces with temperatures, in W/m²; of several surfaces the mean by area.
    NetFlux(Box<Self>),
    /// The temperature of another region, in kelvin: surfaces with a given net flux, a point between surfaces, or what faces in a direction there.
    Temperature(Box<Self>),
    /// The share of the molecules which enter a vacuum that arrive at another region.
    Transmission(Box<Self>),
}

impl Region {
    /// The quantity that is asked for, and the region of which it is.
    ///
    /// ```
    /// use fredholm::{GlobalQuantity, Region};
    ///
    /// let lit = GlobalQuantity::Irradiance.of(Region::Part(2));
    /// assert_eq!(lit.asked(), (GlobalQuantity::Irradiance, &Region::Part(2)));
    /// assert_eq!(Region::Whole.asked(), (GlobalQuantity::U, &Region::Whole));
    /// ```
    #[must_use]
    pub fn asked(&self) -> (GlobalQuantity, &Self) {
        match self {
            Self::Irradiance(of) => (GlobalQuantity::Irradiance, of),
            Self::NetFlux(of) => (GlobalQuantity::NetFlux, of),
            Self::Temperature(of) => (GlobalQuantity::Temperature, of),
            Self::Transmission(of) => (GlobalQuantity::Transmission, of),
            of => (GlobalQuantity::U, of),
        }
    }

    /// The region itself, without what is asked of it.
    #[must_use]
    pub fn place(&self) -> &Self {
        self.asked().1
    }
}

/// A weight w of an integral ∫ u w, as a function of the coordinates of a point.
///
/// ```
/// use fredholm::{CubeModel, Region, Solver, WeightFn};
///
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let right_half = WeightFn::new(|x| if x[0] < 0.5 { 0.0 } else { 1.0 });
/// let solver = Solver::new(&u).goal("right half", Region::Function(right_half));
/// let report = solver.cells(10).degree(1).walks(10_000).solve()?;
/// assert!((report.goals[0].preconditioned.estimate.unwrap() - 0.45).abs() < 0.01);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone)]
pub struct WeightFn(Arc<Field>);

/// A function of the coordinates of a point.
///
/// ```
/// let first: &fredholm::Field = &|x| x[0];
/// assert_eq!(first(&[0.5, 1.0]), 0.5);
/// ```
pub type Field = dyn Fn(&[f64]) -> f64 + Send + Sync;

impl WeightFn {
    /// Creates the weight of a function.
    #[must_use]
    pub fn new(weight: impl Fn(&[f64]) -> f64 + Send + Sync + 'static) -> Self {
        Self(Arc::new(weight))
    }

    /// The weight of the point with these coordinates.
    #[must_use]
    pub fn value(&self, coordinates: &[f64]) -> f64 {
        (self.0)(coordinates)
    }
}

/// Equal if they are copies of one weight.
impl PartialEq for WeightFn {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl fmt::Debug for WeightFn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("WeightFn")
    }
}

/// A functional of the solution, with the name that results give it.
///
/// ```
/// use fredholm::{CubeModel, Goal, Model, Region};
///
/// let u = CubeModel::from_fn::<1>(|_, _| 0.5, |_| 1.0);
/// let goal = |x| [Goal::new("u", Region::Point(vec![x]))];
/// assert!(u.check_goals(&goal(0.5)).is_ok());
/// assert!(u.check_goals(&goal(1.5)).is_err());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Goal {
    /// The name in results.
    pub name: String,
    /// The region: a point, a part, or the whole space.
    pub region: Region,
    /// The number of its channel, or of their sum, where [`Model::channels`] says that there are some.
    pub channel: Option<usize>,
}

impl Goal {
    /// The goal of this name and region, of an equation without channels.
    #[must_use]
    pub fn new(name: impl Into<String>, region: Region) -> Self {
        Self {
            name: name.into(),
            region,
            channel: None,
        }
    }

    /// This goal in every channel of a model, or alone where it has none.
    #[must_use]
    pub fn in_channels(self, model: &dyn Model) -> Vec<Self> {
        let channels = model.channels();
        if channels.is_empty() {
            return vec![self];
        }
        let of = |(channel, name): (usize, &String)| Self {
            name: format!("{} {name}", self.name),
            region: self.region.clone(),
            channel: Some(channel),
        };
        channels.iter().enumerate().map(of).collect()
    }

    /// The name of the target whose goal in the first channel, or alone, this is. `None`: it is in another channel.
    #[must_use]
    pub fn target(&self, model: &dyn Model) -> Option<&str> {
        match self.channel {
            None => Some(&self.name),
            Some(0) => {
                let own = model.channels().first()?;
                self.name.strip_suffix(own.as_str())?.strip_suffix(' ')
            }
            Some(_) => None,
        }
    }
}

/// A named request: one functional, or a grid of points.
///
/// ```
/// use fredholm::{Ask, CubeModel, Target, goals};
///
/// let u = CubeModel::from_fn::<1>(|_, _| 0.5, |_| 1.0);
/// let line = Target { name: "line".to_owned(), ask: Ask::Grid { points: 3, part: None } };
/// let names: Vec<String> = goals(&u, &[line])?.into_iter().map(|goal| goal.name).collect();
/// assert_eq!(names, ["line[0]", "line[1]", "line[2]"]);
/// # Ok::<(), fredholm::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// The name in results.
    pub name: String,
    /// The functional or the grid of points.
    pub ask: Ask,
}

/// One functional, or a grid of points.
///
/// ```
/// use fredholm::{Ask, Region};
///
/// assert_ne!(Ask::One(Region::Whole), Ask::Grid { points: 3, part: None });
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Ask {
    /// One functional.
    One(Region),
    /// u at several points, equally spaced over the space or along the part of this number.
    Grid {
        /// The number of points.
        points: usize,
        /// The part, where the space has several.
        part: Option<usize>,
    },
    /// The quantity in the place of u, and where it is asked for.
    Of(GlobalQuantity, Box<Self>),
}

impl Ask {
    /// The number of points, if it is a grid.
    pub fn points(&mut self) -> Option<&mut usize> {
        match self {
            Self::One(_) => None,
            Self::Grid { points, .. } => Some(points),
            Self::Of(_, ask) => ask.points(),
        }
    }

    /// The regions, and whether they are points of a grid, which are numbered.
    fn regions(&self, model: &dyn Model) -> (Vec<Region>, bool) {
        match self {
            Self::One(region) => (vec![region.clone()], false),
            Self::Grid { points, part } => (model.grid(*points, *part), true),
            Self::Of(quantity, ask) => {
                let (regions, is_grid) = ask.regions(model);
                let regions = regions.into_iter().map(|region| quantity.of(region));
                (regions.collect(), is_grid)
            }
        }
    }
}

impl Target {
    /// The functionals that it asks for: `name`, or `name[0]`, `name[1]` and so on; in every channel, if there are channels.
    fn goals(&self, model: &dyn Model) -> Vec<Goal> {
        let all = self.regions(model).into_iter();
        all.flat_map(|goal| goal.in_channels(model)).collect()
    }

    fn regions(&self, model: &dyn Model) -> Vec<Goal> {
        let (regions, is_grid) = self.ask.regions(model);
        let name = |i| match is_grid {
            true => format!("{}[{i}]", self.name),
            false => self.name.clone(),
        };
        let regions = regions.into_iter().enumerate();
        regions
            .map(|(i, region)| Goal::new(name(i), region))
            .collect()
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
