//! Regions of a cube: which it has, and what is known of u on them.

use core::iter;

use fredholm_cube::ScalarField as _;
use fredholm_variance::Quadrature;

use super::CubeModel;
use super::domain::Domain;
use super::functions::{WeightOf, Which, with_values};
use super::mean::mean_of;
use fredholm_model::{Error, Region};

impl CubeModel {
    /// (u, Φ) of a region by the known solution, if quadrature knows it.
    pub(super) fn exact_in<const D: usize>(&self, region: &Region) -> Result<Option<f64>, Error> {
        with_values::<f64, _>(&*self.functions, |values| {
            let u = values.function(Which::Solution);
            let value = match region {
                Region::Point(x) => Some(u.value(&values.domain().unit::<D>(x))),
                Region::Whole => mean_of::<D>(&|x| u.value(x))?,
                region => match WeightOf::region(region) {
                    Some(weight) => {
                        let weight = values.function(Which::Weight(weight));
                        mean_of::<D>(&|x| u.value(x) * weight.value(x))?
                    }
                    None => None,
                },
            };
            values.check()?;
            Ok(value)
        })
    }

    /// Refuses a region that it does not have.
    pub(super) fn check_region(&self, region: &Region) -> Result<(), Error> {
        let message = match region {
            Region::Whole | Region::Function(_) => return Ok(()),
            Region::Weight(number) if *number < self.functions.weights() => return Ok(()),
            Region::Weight(number) => format!("there is no weight of number {number}"),
            Region::Point(x) if x.len() == self.dimension => {
                let intervals = self
                    .functions
                    .domain()
                    .iter()
                    .chain(iter::repeat(&[0.0, 1.0]));
                match x
                    .iter()
                    .zip(intervals)
                    .find(|(x, [low, high])| !(low <= *x && *x <= high))
                {
                    None => return Ok(()),
                    Some((x, [low, high])) => {
                        format!("a coordinate is {x}, and it must be from {low} to {high}")
                    }
                }
            }
            Region::Point(_) => format!("a point has {} coordinates", self.dimension),
            _ => "a cube has points, weights, and the mean over all of it".to_owned(),
        };
        Err(Error::Region { message })
    }
}

/// The place of a site for people: the part of every axis.
pub(super) fn place_of<const D: usize>(
    quadrature: &impl Quadrature<Point = [f64; D]>,
    domain: &Domain<f64>,
    site: usize,
) -> String {
    let mut places = Vec::new();
    quadrature.nodes(site, |x, _| {
        if places.is_empty() {
            let part = |(axis, &x): (usize, &f64)| {
                let [low, high] = quarter(x, D).map(|end| domain.coordinate(axis, end));
                format!("[{low}, {high}]")
            };
            places = x.iter().enumerate().map(part).collect();
        }
    });
    places.join(" × ")
}

/// The part of an axis in which a place lies: an eighth in one dimension, a quarter in two and half of it in more.
fn quarter(x: f64, dimension: usize) -> [f64; 2] {
    let parts = match dimension {
        1 => 8.0,
        2 => 4.0,
        _ => 2.0,
    };
    let part = (x * parts).floor().min(parts - 1.0);
    [part / parts, (part + 1.0) / parts]
}
