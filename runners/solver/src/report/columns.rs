//! Reports as columns of numbers, for arrays and meshes.

use super::{Coordinates, EstimateReport, GlobalReport, GoalReport, Report};

/// A column of numbers with its name; NaN where there is no number.
pub type Column = (&'static str, Vec<f64>);

/// The numbers of a report in columns, without those in which there is no number.
///
/// ```
/// use fredholm::{CubeModel, Solver};
///
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let report = Solver::new(&u).at([0.5]).cells(4).walks(5000).solve()?;
/// let columns = report.columns();
/// let (name, numbers) = &columns.of_targets[0];
/// assert_eq!((*name, numbers.len()), ("estimate", 1));
/// assert_eq!(columns.coordinates, [[0.5]]);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    /// The names of targets.
    pub names: Vec<String>,
    /// The coordinates of targets, in a room those in the drawing; none of what is no point.
    pub coordinates: Vec<Vec<f64>>,
    /// A number for every target; the first column is the estimate.
    pub of_targets: Vec<Column>,
    /// A number for every cell of which means were asked for ([`Solver::means_between`](crate::Solver::means_between)).
    pub of_cells: Vec<Column>,
    /// The corners of every cell of a scene, whose numbers come last in the columns of targets.
    pub mesh: Vec<Vec<[f64; 3]>>,
}

/// The numbers of estimates; NaN where there is none.
fn column<'a, T: 'a>(all: &'a [T], of: impl Fn(&'a T) -> Option<f64>) -> Vec<f64> {
    all.iter().map(|x| of(x).unwrap_or(f64::NAN)).collect()
}

const IRRADIANCE: [&str; 2] = ["irradiance", "irradiance_std_error"];
const NET_FLUX: [&str; 2] = ["net_flux", "net_flux_std_error"];
const TEMPERATURE: [&str; 2] = ["temperature", "temperature_std_error"];

/// The numbers of estimates that only some kinds have, and their standard errors.
fn estimates<T>(
    all: &[T],
    [name, error]: [&'static str; 2],
    of: impl Fn(&T) -> Option<EstimateReport>,
) -> [Column; 2] {
    [
        (name, column(all, |t| of(t)?.estimate)),
        (error, column(all, |t| of(t)?.std_error)),
    ]
}

/// Columns without those in which there is no number.
fn some(columns: Vec<Column>) -> Vec<Column> {
    let is_some = |(_, numbers): &Column| numbers.iter().any(|x| !x.is_nan());
    columns.into_iter().filter(is_some).collect()
}

/// The coordinates of a point: of one on a surface those of its place.
fn numbers(at: Option<&Coordinates>, position: Option<&[f64]>) -> Vec<f64> {
    match (at, position) {
        (_, Some(position)) => position.to_vec(),
        (Some(Coordinates::Many(x)), None) => x.clone(),
        _ => Vec::new(),
    }
}

/// The columns of goals.
fn of_goals<'a>(goals: impl Iterator<Item = &'a GoalReport>) -> Columns {
    let all: &Vec<_> = &goals.collect();
    let mut of_targets = vec![
        ("estimate", column(all, |t| t.preconditioned.estimate)),
        ("std_error", column(all, |t| t.preconditioned.std_error)),
        ("band", column(all, |t| t.band)),
        ("iterate", column(all, |t| t.iterate)),
        ("plain", column(all, |t| t.plain.estimate)),
        ("plain_std_error", column(all, |t| t.plain.std_error)),
        ("galerkin", column(all, |t| Some(t.galerkin))),
        ("exact", column(all, |t| t.exact)),
    ];
    of_targets.extend(estimates(all, IRRADIANCE, |t| t.irradiance));
    of_targets.extend(estimates(all, NET_FLUX, |t| t.net_flux));
    of_targets.extend(estimates(all, TEMPERATURE, |t| t.temperature));
    Columns {
        names: all.iter().map(|t| t.name.clone()).collect(),
        coordinates: all
            .iter()
            .map(|t| numbers(t.at.as_ref(), t.position.as_deref()))
            .collect(),
        of_targets: some(of_targets),
        of_cells: Vec::new(),
        mesh: Vec::new(),
    }
}

impl Report {
    /// The report as columns of numbers.
    #[must_use]
    pub fn columns(&self) -> Columns {
        let whole = self.whole.as_ref();
        Columns {
            of_cells: whole.map_or(Vec::new(), |whole| whole.of_cells()),
            ..of_goals(self.goals.iter())
        }
    }
}

impl GlobalReport {
    /// The report as columns of numbers.
    #[must_use]
    pub fn columns(&self) -> Columns {
        Columns {
            of_cells: self.of_cells(),
            mesh: self.mesh.iter().map(|cell| cell.corners.clone()).collect(),
            ..of_goals(self.rows())
        }
    }

    fn of_cells(&self) -> Vec<Column> {
        let all = &self.means;
        some(vec![
            ("mean", column(all, |mean| Some(mean.estimate))),
            ("mean_std_error", column(all, |mean| mean.std_error)),
            ("mean_iterate", column(all, |mean| Some(mean.iterate))),
            (
                "mean_quadrature_error",
                column(all, |mean| Some(mean.quadrature_error)),
            ),
        ])
    }
}
