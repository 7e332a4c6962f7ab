//! The figure of values on a grid of one axis: with their band, and below that what walks add.

use crate::{Axis, BandPlot, Curve, Error, Style, stacked};

/// A value on a grid of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridPoint {
    /// The abscissa of the point.
    pub at: f64,
    /// The value at the point.
    pub value: f64,
    /// The standard error of the value.
    pub std_error: f64,
    /// What is known of the value without walks; NaN if nothing is.
    pub known: f64,
    /// The exact value, if there is one.
    pub exact: Option<f64>,
}

/// Values on a grid of one axis, with their band.
#[derive(Clone, Debug)]
pub struct GridCurve<'a> {
    /// The name of the grid.
    pub name: &'a str,
    /// The abscissa.
    pub axis: Axis,
    /// The points, in the order of their abscissas.
    pub points: Vec<GridPoint>,
    /// What the values are of, in the legend.
    pub values: &'a str,
    /// What the band is, in the title.
    pub band: &'a str,
    /// The name of what is known without walks.
    pub known: &'a str,
}

impl GridCurve<'_> {
    /// The text of an SVG file: the values with their band, and below them, if that is nowhere wider than a line, what walks add
    /// to what is known.
    ///
    /// ```
    /// use fredholm_plot::{Axis, GridCurve, GridPoint};
    ///
    /// let point = |i: u32| GridPoint {
    ///     at: f64::from(i),
    ///     value: f64::from(i * i),
    ///     std_error: 1e-6,
    ///     known: f64::from(i * i) + 1e-5,
    ///     exact: None,
    /// };
    /// let curve = GridCurve {
    ///     name: "square",
    ///     axis: Axis::Coordinate,
    ///     points: (0..9).map(point).collect(),
    ///     values: "walks",
    ///     band: "band",
    ///     known: "v",
    /// };
    /// assert!(curve.svg()?.contains("what walks add to v"));
    /// # Ok::<(), fredholm_plot::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::NothingToDraw`]: no value is finite.
    pub fn svg(&self) -> Result<String, Error> {
        let name = self.name;
        let title = format!("{name}: the solution with its 95 % {}", self.band);
        let values = self.plot(title, None, |_| 0.0);
        let svg = values.svg()?;
        if !values.is_invisible() || self.points.iter().any(|point| point.known.is_nan()) {
            return Ok(svg);
        }
        let title = format!(
            "{name}: what walks add to {}, with the same band",
            self.known
        );
        let added = self.plot(title, Some("difference".to_owned()), |point| point.known);
        Ok(stacked(&[svg, added.svg()?]))
    }

    /// The values less what `of` says.
    fn plot(&self, title: String, label: Option<String>, of: fn(&GridPoint) -> f64) -> BandPlot {
        let points = self.points.iter();
        let exact = points
            .clone()
            .filter_map(|point| Some((point.at, point.exact? - of(point))));
        let exact: Vec<_> = exact.collect();
        let style = Style {
            colour: 0,
            marker: None,
            dashed: true,
        };
        let exact = (!exact.is_empty()).then_some(Curve {
            name: "exact solution".to_owned(),
            points: exact,
            style,
        });
        BandPlot {
            title,
            axis: self.axis,
            name: self.values.to_owned(),
            points: points
                .map(|point| (point.at, point.value - of(point), point.std_error))
                .collect(),
            label,
            curves: exact.into_iter().collect(),
        }
    }
}
