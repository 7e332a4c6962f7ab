//! The variance before the walks, and what limits it.

mod places;
mod quantities;
mod target;

use web_time::Instant;

use fredholm_core::{Estimator, Form};
use fredholm_variance::{
    Analysis, PairQuantities, Pass, Prediction, Quantities, Site, pair_quantities,
};
use serde::Serialize;

pub use places::Picture;
pub use quantities::{PairsReport, PowerReport, QuantitiesReport};
pub use target::{BoundsReport, GoalDiagnosis, PlaceReport, Shares};

use crate::answer::{SolveObserver, Solved};
use crate::{
    Choices, Error, Goal, Model, Pairs, Partitioned, Settings, Subject, WalkOptions,
    memory::refuse_beyond_memory,
};
use fredholm_model::numbers::short;
use fredholm_model::{Examined, in_parallel};
use fredholm_model::{Request, Wanted};
use places::{Summed, shares_of_sites};

/// Bytes of a pair of sites: moments, contributions, and a list of these.
const PAIR: usize = 64 + 8 + 40;
/// The most nodes of a diagnosis, whose work grows with their square.
const MOST_NODES: usize = 20_000;
/// The number of goals that are looked at in detail: the points of a grid are many, and much alike.
pub const DETAILED: usize = 3;

/// The results of a diagnosis.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// The number of sites.
    pub sites: usize,
    /// The number of nodes.
    pub nodes: usize,
    /// Measured seconds.
    pub seconds: f64,
    /// ‖T_k²p^m‖ < 1: null if the variance of plain walks is infinite.
    pub kernel_power: Option<PowerReport>,
    /// ‖T_h²p^m‖ < 1: null if the variance of preconditioned walks is infinite.
    pub neighbour_power: Option<PowerReport>,
    /// The quantities of the paper, of the absorption estimator.
    pub quantities: Option<QuantitiesReport>,
    /// The degree of the lift, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lift: Option<usize>,
    /// The diagnosis of each goal.
    pub targets: Vec<GoalDiagnosis>,
    /// √Var ζ of every goal with other pairs.
    pub other_pairs: Vec<OtherPairs>,
    /// A picture of the first goal.
    #[serde(skip)]
    pub picture: Picture,
}

/// The effect of another choice of pairs.
#[derive(Clone, Debug, Serialize)]
pub struct OtherPairs {
    /// Their word.
    pub pairs: &'static str,
    /// √Var ζ of every goal; null where it is infinite.
    pub preconditioned: Vec<Option<f64>>,
}

/// Refuses a diagnosis on so many cells that nobody waits for it.
pub(crate) fn refuse_long(cells: &dyn Partitioned<'_>) -> Result<(), Error> {
    let points = cells.examined_points()?;
    if points <= MOST_NODES {
        return Ok(());
    }
    let message = format!(
        "a diagnosis on {} cells takes integrals in {points} points, and more than {MOST_NODES} take too long: use fewer cells, which shows the \
         same at a coarser level",
        cells.cells_text()
    );
    Err(Error::TooMuch { message })
}

/// Predicts the variance of every goal with integrals in about so many points, says what limits it, and compares other
/// pairs. Settings in which variances are infinite are not refused.
///
/// # Errors
/// [`Error`].
pub fn diagnose(
    model: &dyn Model,
    goals: &[Goal],
    settings: &Settings,
    nodes: usize,
    watch: &dyn SolveObserver,
) -> Result<Diagnosis, Error> {
    let (cut, walk) = (settings.discretisation(), settings.walk_options());
    let cells = model.partition(&cut)?;
    refuse_long(&*cells)?;
    let lift = settings.lifted();
    let solved = Solved::new(&*cells)?.lifted(lift)?;
    let look = |pairs: Pairs, is_brief: bool| {
        let inquiry = Inquiry {
            estimator: walk.absorption.estimator(),
            form: walk.form,
            is_brief,
            watch,
        };
        let request = Request {
            goals,
            walk: &WalkOptions { pairs, ..walk },
            wanted: Wanted::U,
        };
        let mut diagnosis = None;
        solved.system.examine(&request, nodes, &mut |subject| {
            diagnosis = Some(inquiry.examine(subject)?);
            Ok(())
        })?;
        diagnosis.ok_or(Error::Internal("nothing was examined"))
    };
    let mut diagnosis = look(walk.pairs, false)?;
    let of_default = model
        .about()
        .pairs_to_choose
        .first()
        .copied()
        .unwrap_or(Pairs::Default);
    let own = match walk.pairs {
        Pairs::Default => of_default,
        pairs => pairs,
    };
    // With a lift all pairs are pointwise.
    let others: &[_] = if lift.is_some() || model.about().pairs_to_choose.len() == 1 {
        &[]
    } else {
        Pairs::ALL
    };
    for &choice in others {
        let pairs = choice.value;
        // Not every model has all of them.
        if pairs == own
            || pairs == Pairs::Default && own == of_default
            || model.check(&cut, pairs).is_err()
        {
            continue;
        }
        let found = match look(pairs, true) {
            Ok(found) => found,
            Err(Error::Option {
                subject: Subject::Pairs,
                ..
            }) => continue,
            Err(error) => return Err(error),
        };
        diagnosis.other_pairs.push(OtherPairs {
            pairs: choice.word,
            preconditioned: found.targets.iter().map(|t| t.preconditioned).collect(),
        });
    }
    diagnosis.lift = lift;
    diagnosis.advise_pairs();
    Ok(diagnosis)
}

impl Diagnosis {
    /// Advises other pairs where they help.
    fn advise_pairs(&mut self) {
        for (number, target) in self.targets.iter_mut().enumerate().take(DETAILED) {
            for other in &self.other_pairs {
                let sd = other.preconditioned.get(number).copied().flatten();
                if let (Some(sd), Some(own)) = (sd, target.preconditioned)
                    && own > 1.2 * sd
                {
                    target.advice.push(format!(
                        "`pairs = \"{}\"` makes √Var {} times smaller on the same cells{}",
                        other.pairs,
                        short(own / sd),
                        match other.pairs {
                            "pointwise" => {
                                "; a walk takes longer, as G is an integral over all cells wherever it is scored"
                            }
                            _ => "",
                        }
                    ));
                }
            }
        }
    }
}

/// How to look.
struct Inquiry<'a> {
    /// What walks score.
    estimator: Estimator,
    /// The form of the control variate.
    form: Form,
    /// Whether deviations are all that is wanted.
    is_brief: bool,
    watch: &'a dyn SolveObserver,
}

impl Inquiry<'_> {
    /// Takes all integrals, and says what they come to.
    fn examine(&self, subject: &Examined<'_>) -> Result<Diagnosis, Error> {
        let clock = Instant::now();
        // Not every level has as many sites as nodes were asked for.
        refuse_pairs(subject.model.sites())?;
        let run = |sites: &mut [Site], pass: &Pass<'_, Site>| {
            self.watch.expect_sites(sites.len() as u64);
            in_parallel(sites, &|i, site| {
                pass(i, site);
                self.watch.finish_site();
            });
        };
        let analysis = Analysis::new(subject.model, self.estimator, self.form, &run)?;
        // These, and the bounds that they give, are of the product form in any case.
        let quantities = match self.estimator {
            Estimator::Absorption if !self.is_brief => Some(analysis.quantities()?),
            _ => None,
        };
        let mut pairs = None;
        if let (Some(coefficients), Some(of)) = (subject.coefficients, &quantities) {
            let mut report = PairsReport::default();
            let mut each = |pair: PairQuantities| report.add(&pair, of.alpha);
            pair_quantities(subject.model, coefficients, &mut each)?;
            pairs = Some(report);
        }
        let mut targets = Vec::new();
        let mut picture = None;
        for (number, goal) in subject.goals.iter().enumerate() {
            let prediction = analysis.predict(number)?;
            let known = subject.known.get(number).copied().unwrap_or(0.0);
            let mut target =
                GoalDiagnosis::new(&goal.name, known, &prediction, quantities.as_ref());
            if !self.is_brief && targets.len() < DETAILED {
                let drawn = detail(subject, &analysis, &prediction, &mut target)?;
                picture = picture.or(drawn);
            }
            targets.push(target);
        }
        Ok(Diagnosis {
            sites: analysis.sites.len(),
            nodes: analysis.sites.iter().map(|site| site.nodes.len()).sum(),
            seconds: clock.elapsed().as_secs_f64(),
            kernel_power: analysis.kernel_power.map(PowerReport::from),
            neighbour_power: analysis.neighbour_power.map(PowerReport::from),
            quantities: quantities.map(|of: Quantities| QuantitiesReport::new(&of, pairs)),
            lift: None,
            targets,
            other_pairs: Vec::new(),
            picture: picture.unwrap_or(Picture::Table(Vec::new(), Vec::new())),
        })
    }
}

/// Says where the variance of a goal comes from, if that is finite, and what a picture of it shows.
fn detail(
    of: &Examined<'_>,
    analysis: &Analysis<'_>,
    prediction: &Prediction,
    target: &mut GoalDiagnosis,
) -> Result<Option<Picture>, Error> {
    let Some(attribution) = prediction.attribute(analysis)? else {
        return Ok(None);
    };
    let (contributions, sites) = (&attribution.contributions, analysis.sites.len());
    let summed = Summed::new(contributions, sites, of.place);
    let picture = match of.pieces {
        Some(pieces) => Picture::walls(pieces, &shares_of_sites(contributions, sites)),
        None => summed.table(),
    };
    target.detail(&attribution.parts, summed);
    Ok(Some(picture))
}

/// Refuses more pairs of sites than there is room for.
fn refuse_pairs(sites: usize) -> Result<(), Error> {
    let needed = sites.saturating_mul(sites).saturating_mul(PAIR);
    let advice = ": use fewer `--nodes`, or fewer cells (`--cells`)";
    refuse_beyond_memory(|| format!("{sites} sites"), needed, advice)
}
