//! The report of targets of a scene at many times.

use fredholm_model::numbers::{aligned, short, with_error};
use serde::Serialize;

use super::csv::harmless;
use super::unit_of;
use crate::scene::AtTimes;
use crate::{Choices as _, Error, GlobalQuantity, Goal, Model};

/// A file that cannot be written.
const FAILED: Error = Error::Internal("times that are no CSV");

/// Targets of a scene under the suns and skies of many times. The serialised names are stable; fields may be added.
///
/// ```
/// use fredholm::report::TimesReport;
/// use fredholm::scene::{AtTimes, Enclosure, GoalAtTimes, Material, NamedSurface, shapes};
/// use fredholm::{Goal, Region, Scalar, SceneModel};
///
/// let polygons = shapes::room([0.0; 3], [1.0; 3]).surfaces.swap_remove(0);
/// let ground = NamedSurface { name: "ground".to_owned(), polygons, material: Material::BLACK };
/// let scene = SceneModel::new(vec![ground], Enclosure::Open, Scalar::F64)?;
/// let found = |value| fredholm::room::Spot { value, error: 0.5 };
/// let goal = GoalAtTimes { values: vec![found(2.0), found(4.0)], mean: found(3.0), walks: 1024 };
/// let found = AtTimes { goals: vec![goal], seconds: 0.1 };
/// let names = ["morning", "noon"].map(str::to_owned);
/// let report = TimesReport::new(&scene, &[Goal::new("u", Region::Whole)], names.to_vec(), &found);
/// assert_eq!(report.csv()?, "time,u,u std_error\nmorning,2.0,0.5\nnoon,4.0,0.5\n");
/// # Ok::<(), fredholm::Error>(())
/// ```
#[derive(Clone, Debug, Serialize)]
pub struct TimesReport {
    /// The kind of the problem.
    pub problem: &'static str,
    /// The names of the times.
    pub times: Vec<String>,
    /// The targets.
    pub targets: Vec<TargetAtTimes>,
    /// Seconds that all took.
    pub seconds: f64,
}

/// A target at many times.
///
/// ```
/// use fredholm::report::TargetAtTimes;
///
/// let desk = TargetAtTimes { values: vec![1.0, 3.0], mean: 2.0, ..TargetAtTimes::default() };
/// assert_eq!(desk.mean, 0.5 * (desk.values[0] + desk.values[1]));
/// ```
#[derive(Clone, Debug, Default, Serialize)]
pub struct TargetAtTimes {
    /// The name.
    pub name: String,
    /// What is asked for in the place of u, if that is so.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ask: Option<&'static str>,
    /// The unit, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// The number of walks, which all times share.
    pub walks: u64,
    /// The mean over all times.
    pub mean: f64,
    /// The standard error of that.
    pub mean_std_error: f64,
    /// The value at every time.
    pub values: Vec<f64>,
    /// The standard error of each.
    pub std_errors: Vec<f64>,
}

impl TimesReport {
    /// The report of these goals of a model, from times of these names.
    #[must_use]
    pub fn new(model: &dyn Model, goals: &[Goal], times: Vec<String>, found: &AtTimes) -> Self {
        let target = |(goal, own): (&Goal, &crate::scene::GoalAtTimes)| {
            let quantity = goal.region.asked().0;
            TargetAtTimes {
                name: goal.name.clone(),
                ask: (quantity != GlobalQuantity::U).then(|| quantity.word()),
                unit: unit_of(model, goal),
                walks: own.walks,
                mean: own.mean.value,
                mean_std_error: own.mean.error,
                values: own.values.iter().map(|own| own.value).collect(),
                std_errors: own.values.iter().map(|own| own.error).collect(),
            }
        };
        Self {
            problem: model.about().kind,
            times,
            targets: goals.iter().zip(&found.goals).map(target).collect(),
            seconds: found.seconds,
        }
    }

    /// The report as a table for people: of every target its mean, its largest value, and when that is.
    #[must_use]
    pub fn table(&self) -> String {
        let mut rows = vec![
            [
                "target",
                "mean over all times",
                "largest",
                "at",
                "largest error",
            ]
            .map(str::to_owned)
            .to_vec(),
        ];
        rows.extend(self.targets.iter().map(|own| {
            let unit = own.unit.map_or(String::new(), |unit| format!(" {unit}"));
            let number = |a: &usize, b: &usize| own.values[*a].total_cmp(&own.values[*b]);
            let largest = (0..own.values.len()).max_by(number).unwrap_or(0);
            let value = own.values.get(largest).copied().unwrap_or(f64::NAN);
            let error = own.std_errors.get(largest).copied();
            let errors = own.std_errors.iter().copied().fold(0.0, f64::max);
            vec![
                own.name.clone(),
                with_error(own.mean, Some(own.mean_std_error)) + &unit,
                with_error(value, error),
                self.times.get(largest).cloned().unwrap_or_default(),
                short(errors),
            ]
        }));
        let walks: u64 = self.targets.iter().map(|own| own.walks).sum();
        format!(
            "{} at {} times\n\n{}\n{walks} walks, which all times share; {} s\n",
            self.problem,
            self.times.len(),
            aligned(&rows),
            short(self.seconds)
        )
    }

    /// All values as CSV: a row for every time, and for every target a column and one of its standard errors.
    ///
    /// # Errors
    /// [`Error::Internal`].
    pub fn csv(&self) -> Result<String, Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let names = self.targets.iter().map(|own| harmless(&own.name));
        let columns = names.flat_map(|name| [name.clone(), format!("{name} std_error")]);
        let head = ["time".to_owned()].into_iter().chain(columns);
        writer.write_record(head).map_err(|_| FAILED)?;
        for (number, time) in self.times.iter().enumerate() {
            let numbers = self.targets.iter();
            let numbers = numbers.flat_map(|own| [own.values[number], own.std_errors[number]]);
            let row: Vec<f64> = numbers.collect();
            writer
                .serialize((harmless(time), row))
                .map_err(|_| FAILED)?;
        }
        let bytes = writer.into_inner().map_err(|_| FAILED)?;
        String::from_utf8(bytes).map_err(|_| FAILED)
    }
}
