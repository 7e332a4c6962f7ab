//! On what a target depends, and how strongly.

use std::time::Instant;

use fredholm_core::global::over_replicates;
use fredholm_model::memory::refuse_beyond_memory;
use fredholm_model::numbers::{aligned, short, with_error};
use fredholm_model::{GLOBAL_REPLICATES as REPLICATES, Quantity, Request, Wanted};
use fredholm_rayon::Replicates;
use serde::Serialize;

use crate::{Ask, Error, Goal, Report, Settings, SolveError, Solver, Subject, Target};

/// Walks of each target, if nothing is said of them.
const WALKS: u64 = 100_000;
/// Walks of a replicate before the first look at the clock.
const FIRST_ROUND: u64 = 64;
/// Rows in a table for people, about, and the most and the fewest of a target.
const ROWS: usize = 48;
const MOST: usize = 12;
const FEWEST: usize = 2;

/// The derivatives of all targets with respect to the quantities on which u depends.
///
/// The derivative u' of u with respect to a quantity λ solves u' = T_K u' + ∂F/∂λ + (∂T_K/∂λ) u. A walk from a target passes every surface that
/// could change it, and scores there what the change would do; [`fredholm_core::global::Sensitivities`] has the formula. Derivatives are unbiased,
/// and their error bars are those of replicates. The serialised names are stable; fields may be added.
///
/// ```
/// use fredholm::room::{Material, Surfaces};
/// use fredholm::{RoomModel, Scalar, Solver};
///
/// // A room all of whose walls have ρ = 0.6 and F = 0.4, so that u = F/(1 − ρ) = 1.
/// let wall = Material { reflectance: 0.6, emission: 0.4 };
/// let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
/// let room = RoomModel::new(Surfaces::default().with("wall", &corners, wall), Scalar::F64)?;
/// let all = Solver::new(&room).over("wall").walks(20_000).sensitivities()?;
/// // ∂u/∂ρ = F/(1 − ρ)² and ∂u/∂F = 1/(1 − ρ).
/// for (name, exact) in [("wall reflectance", 2.5), ("wall emission", 2.5)] {
///     let own = all.get("wall", name).unwrap();
///     assert!((own.derivative - exact).abs() < 5.0 * own.std_error && own.std_error < 0.05);
/// }
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug, Serialize)]
pub struct Sensitivities {
    /// The derivatives, target by target, and of every target the largest first: by what the quantity as a whole contributes, |λ ∂u/∂λ|.
    pub derivatives: Vec<Sensitivity>,
    /// The number of walks of each target.
    pub walks: u64,
    /// The number of states that they visited.
    pub states: u64,
    /// Seconds of the set-up.
    pub setup_seconds: f64,
    /// Seconds of the walks.
    pub walk_seconds: f64,
}

/// The derivative of a target with respect to a quantity.
///
/// ```
/// use fredholm::Sensitivity;
///
/// let own = Sensitivity {
///     target: "desk".to_owned(),
///     quantity: "lamp emission".to_owned(),
///     value: Some(100.0),
///     derivative: 0.02,
///     std_error: 1e-4,
///     unit: None,
/// };
/// assert_eq!(own.contribution(), 2.0);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sensitivity {
    /// The name of the target.
    pub target: String,
    /// The name of the quantity: "floor reflectance".
    pub quantity: String,
    /// The value of the quantity, if all of it has one.
    pub value: Option<f64>,
    /// The derivative, in the unit of u over that of the quantity.
    pub derivative: f64,
    /// The standard error of the derivative; an interval of 95 % is 2 of them wide on each side.
    pub std_error: f64,
    /// The unit of the quantity, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
}

impl Sensitivity {
    /// λ ∂u/∂λ: by how much the target would change if the quantity grew by all of itself, to first order; the derivative itself where no
    /// value is known.
    #[must_use]
    pub fn contribution(&self) -> f64 {
        self.value.unwrap_or(1.0) * self.derivative
    }
}

impl Sensitivities {
    /// The derivatives that are the goals of a report.
    fn of_report(report: &Report, goals: &[Goal], quantities: &[Quantity]) -> Self {
        let values = report
            .goals
            .iter()
            .map(|own| [own.value(), own.std_error()]);
        Self {
            derivatives: sorted(goals, quantities, values),
            walks: report.walks(),
            states: report.states,
            setup_seconds: report.setup_seconds,
            walk_seconds: report.walk_seconds,
        }
    }

    /// The derivative of the target of this name with respect to the quantity of that name.
    #[must_use]
    pub fn get(&self, target: &str, quantity: &str) -> Option<&Sensitivity> {
        let mut all = self.derivatives.iter();
        all.find(|own| own.target == target && own.quantity == quantity)
    }

    /// A table for people: of every target the quantities that contribute most.
    #[must_use]
    pub fn table(&self) -> String {
        let head = [
            "target",
            "quantity",
            "value",
            "∂target/∂quantity",
            "per 1 %",
        ];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        let mut left = 0;
        let by_target = || self.derivatives.chunk_by(|a, b| a.target == b.target);
        let most = (ROWS / by_target().count().max(1)).clamp(FEWEST, MOST);
        for own in by_target() {
            left += own.len().saturating_sub(most);
            rows.extend(own.iter().take(most).map(|own| {
                let unit = own.unit.map_or(String::new(), |unit| format!(" {unit}"));
                let value = own
                    .value
                    .map_or(String::new(), |value| short(value) + &unit);
                let part = own.value.map(|value| short(0.01 * value * own.derivative));
                vec![
                    own.target.clone(),
                    own.quantity.clone(),
                    value,
                    with_error(own.derivative, Some(own.std_error)),
                    part.unwrap_or_default(),
                ]
            }));
        }
        let mut text = aligned(&rows);
        if left > 0 {
            text += &format!("{left} smaller ones are in the JSON\n");
        }
        text
    }
}

impl Solver<'_> {
    /// Refuses sensitivities of an equation that has none, and of targets that have none.
    ///
    /// # Errors
    /// [`SolveError`]; [`Error::Option`].
    pub fn check_sensitivities(&self) -> Result<(), SolveError> {
        let run = || -> Result<(), SolveError> {
            let goals = self.goals(&self.targets()?)?;
            if !self.model.quantities().is_empty() {
                self.model.with_derivatives(&goals)?;
                return Ok(());
            }
            let what = match self.model.channels() {
                [] => "are those of rooms, scenes and equations with parameters",
                _ => "of several channels are not offered",
            };
            let message = format!("sensitivities {what}: leave them out");
            let subject = Subject::Problem;
            Err(Error::Option { subject, message }.into())
        };
        self.explained(run())
    }

    /// The derivatives of u at all targets with respect to the quantities on which it depends: of rooms and scenes reflectances and emissions of
    /// surfaces, or emissivities, temperatures and given net fluxes; of formulas their parameters. Of a black surface there is none with respect to its
    /// reflectance.
    ///
    /// Every target takes as many walks as are [asked for](Self::walks), or 100,000, on few cells, by roulette; an error plays no part, and at a time
    /// limit they end with what there is. Derivatives by parameters are the solutions of equations of their own, to which all settings belong.
    ///
    /// # Errors
    /// [`SolveError`]; [`Error::Option`], where the equation has no such quantities.
    pub fn sensitivities(&self) -> Result<Sensitivities, SolveError> {
        let run = || -> Result<Sensitivities, SolveError> {
            self.check_sensitivities()?;
            let goals = self.goals(&self.targets()?)?;
            let quantities = self.model.quantities();
            if let Some((model, derivatives)) = self.model.with_derivatives(&goals)? {
                let targets = derivatives.iter().map(|goal| Target {
                    name: goal.name.clone(),
                    ask: Ask::One(goal.region.clone()),
                });
                let solver = Solver::with(&*model, self.settings.clone(), targets.collect());
                let solved = solver.observer(self.watch).solve();
                return Ok(Sensitivities::of_report(&solved?, &goals, &quantities));
            }
            let start = Instant::now();
            let settings = self.few_cells();
            let walk = settings.walk_options();
            let cells = self.model.partition(&settings.discretisation())?;
            let needed = cells.memory(&goals, walk.pairs);
            let what = || format!("{} unknowns", cells.unknowns());
            refuse_beyond_memory(what, needed, self.model.about().less_memory)?;
            let request = Request {
                goals: &goals,
                walk: &walk,
                wanted: Wanted::Derivatives,
            };
            let system = cells.solve()?;
            let mut found = None;
            system.job(&request, &mut |prepared| {
                let job = prepared.sensitivities.ok_or(Error::Internal(
                    "quantities of which walks tell no derivatives",
                ))?;
                let setup_seconds = start.elapsed().as_secs_f64();
                let start = Instant::now();
                let mut replicates = Replicates::new(job, REPLICATES);
                let walks = self.settings.walks.unwrap_or(WALKS);
                let each = walks.div_ceil(REPLICATES as u64);
                self.watch.walking();
                let (mut done, limit) = (0, settings.time_limit);
                while done < each && limit.is_none_or(|limit| start.elapsed() < limit) {
                    // Twice as many from look to look.
                    let more = done.max(FIRST_ROUND).min(each - done);
                    replicates.run(job, more, self.watch)?;
                    if self.watch.cancelled() {
                        return Err(Error::Cancelled);
                    }
                    done += more;
                }
                let counts = replicates.counts();
                found = Some(Sensitivities {
                    derivatives: Vec::new(),
                    walks: counts.walks,
                    states: counts.states,
                    setup_seconds,
                    walk_seconds: start.elapsed().as_secs_f64(),
                });
                let means = replicates.coefficients(job, &|_| 1.0);
                let width = job.unknowns();
                let of = |unknown: usize| -> Vec<f64> {
                    let rows = means.chunks_exact(width.max(1));
                    rows.map(|row| row.get(unknown).copied().unwrap_or(f64::NAN))
                        .collect()
                };
                let Some(found) = &mut found else {
                    return Ok(());
                };
                let values = (0..goals.len() * quantities.len()).map(|unknown| {
                    let values = over_replicates(&of(unknown));
                    [values.mean, values.std_error]
                });
                found.derivatives = sorted(&goals, &quantities, values);
                Ok(())
            })?;
            found.ok_or(Error::Internal("no walks were prepared").into())
        };
        self.explained(run())
    }

    /// The settings of the walks: what they find depends little on how well v is known, and a set-up takes longer than they do.
    fn few_cells(&self) -> Settings {
        let Settings {
            seed,
            scalar,
            time_limit,
            grading,
            shadow_cuts,
            ..
        } = self.settings;
        let settings = Settings {
            seed,
            scalar,
            time_limit,
            grading,
            shadow_cuts,
            last_step: Some(false),
            ..Settings::default()
        };
        let cut = settings.discretisation();
        let coarse = self.model.coarse_levels(&cut).into_iter();
        let cells = coarse.chain(self.model.levels(&cut)).next();
        Settings { cells, ..settings }
    }
}

/// The derivatives of all goals by all quantities, of each the largest first.
fn sorted(
    goals: &[Goal],
    quantities: &[Quantity],
    mut values: impl Iterator<Item = [f64; 2]>,
) -> Vec<Sensitivity> {
    let mut all = Vec::new();
    for goal in goals {
        let own = quantities.iter().zip(values.by_ref());
        let own = own.map(|(quantity, [derivative, std_error])| Sensitivity {
            target: goal.name.clone(),
            quantity: quantity.name.clone(),
            value: quantity.value,
            derivative,
            std_error,
            unit: quantity.unit,
        });
        let mut own: Vec<Sensitivity> = own.collect();
        own.sort_by(|a, b| b.contribution().abs().total_cmp(&a.contribution().abs()));
        all.extend(own);
    }
    all
}
