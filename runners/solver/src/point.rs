//! Coordinates of points.

/// Coordinates of a point: a number, an array or a slice of numbers.
///
/// An angle of a circle; the coordinates of a point of a cube; colatitude and azimuth on a sphere; in a room the place of
/// a point in the air.
///
/// ```
/// use fredholm::Point;
///
/// assert_eq!(Point::from(0.3), Point::from([0.3]));
/// assert_ne!(Point::from([0.3, 0.5]), Point::from(0.3));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Point(pub(crate) Vec<f64>);

impl From<f64> for Point {
    fn from(x: f64) -> Self {
        Self(vec![x])
    }
}

impl<const D: usize> From<[f64; D]> for Point {
    fn from(x: [f64; D]) -> Self {
        Self(x.to_vec())
    }
}

impl From<&[f64]> for Point {
    fn from(x: &[f64]) -> Self {
        Self(x.to_vec())
    }
}
