//! `fredholm diagnose`: the variance before the walks, and what limits it.

mod places;
mod quantities;
mod report;
mod target;

use std::io::Write;
use std::time::Instant;

use fredholm_core::galerkin::{self, GalerkinMatrix};
use fredholm_core::variance::{
    Analysis, Contribution, Level, PairQuantities, Pass, Prediction, Quantities, Setting, Site,
    Start, VarianceError,
};
use fredholm_core::{Estimator, Kernel, Neighbour, Sampler, Source};
use fredholm_rayon::fill_rows;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::args::DiagnoseArgs;
use crate::failure::{Ended, Failure};
use crate::file::{Pairs, Placed, ProblemFile, word};
use crate::numbers::short;
use crate::output::open_all;
use crate::problem;
use crate::progress::counting;
use crate::solve::{lacking_memory, plan, read, refuse_beyond_memory};
use crate::threads::with_threads;

pub(crate) use places::Picture;
use places::{Summed, shares_of_sites};
use quantities::{PairsReport, PowerReport, QuantitiesReport};
use report::Report;
use target::TargetDiagnosis;

/// Bytes of a pair of sites: moments, contributions, and a list of these.
const PAIR: usize = 48 + 8 + 40;
/// So many targets are looked at in detail: the points of a grid are many, and much alike.
const DETAILED: usize = 3;
/// Unknowns up to which pairs are chosen one by one for a comparison: on more it takes many seconds.
const COMPARED: usize = 300;
/// So many pairs of sites are asked for what is between them.
const MOST_PAIRS: usize = 200;

/// How to look.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request<'a> {
    /// What walks score.
    pub(crate) estimator: Estimator,
    /// About so many nodes.
    pub(crate) nodes: usize,
    /// Whether deviations are all that is wanted.
    brief: bool,
    /// Counts the sites that were gone through.
    bar: &'a ProgressBar,
}

impl Request<'_> {
    /// Takes all integrals, and says what they come to.
    pub(crate) fn examine<E, N, S, L, C>(
        &self,
        subject: &Subject<'_, E, N, S, L, C>,
    ) -> Result<Diagnosis, Failure>
    where
        E: Sampler<Scalar = f64, Point = L::Point> + Kernel + Source + Sync,
        N: Neighbour<Scalar = f64, Point = L::Point> + Sync + ?Sized,
        S: galerkin::Pairs + Sync,
        L: Level + Sync,
        L::Point: Send + Sync,
        C: GalerkinMatrix<Scalar = f64>,
    {
        let clock = Instant::now();
        let setting = &subject.setting;
        // Not every level has as many sites as nodes were asked for.
        refuse_pairs(setting.level.sites())?;
        let run = |sites: &mut [Site<L::Point>], pass: &Pass<'_, Site<L::Point>>| {
            self.bar.inc_length(sites.len() as u64);
            in_parallel(sites, &|i, site| {
                pass(i, site);
                self.bar.inc(1);
            });
        };
        let analysis = setting.analyse(self.estimator, run).map_err(explained)?;
        let quantities = match self.estimator {
            Estimator::Absorption if !self.brief => Some(analysis.quantities().map_err(explained)?),
            _ => None,
        };
        let mut pairs = None;
        if let (Some(coefficients), Some(of)) = (subject.coefficients, &quantities) {
            let mut report = PairsReport::default();
            let each = |pair: PairQuantities| report.add(&pair, of.alpha);
            setting
                .pair_quantities(coefficients, each)
                .map_err(explained)?;
            pairs = Some(report);
        }
        let mut targets = Vec::new();
        let mut picture = None;
        for begin in subject.targets {
            let prediction = setting.predict(&analysis, begin.start).map_err(explained)?;
            let mut target = TargetDiagnosis::new(begin.name, &prediction, quantities.as_ref());
            if !self.brief && targets.len() < DETAILED {
                let drawn = subject.detail(&analysis, &prediction, &mut target)?;
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
            targets,
            other_pairs: Vec::new(),
            picture: picture.unwrap_or(Picture::Table(Vec::new(), Vec::new())),
        })
    }
}

impl<E, N: ?Sized, S, L: Level, C> Subject<'_, E, N, S, L, C> {
    /// What stands between the pairs that contribute most, where something does between a tenth of them.
    fn hider(&self, contributions: &[Contribution]) -> Option<String> {
        let hides = self.hides?;
        let mut all = 0.0;
        let mut shares: Vec<(String, f64)> = Vec::new();
        for contribution in contributions.iter().take(MOST_PAIRS) {
            let Some(into) = contribution.into else {
                continue;
            };
            all += contribution.variance;
            let Some(name) = hides(contribution.from, into) else {
                continue;
            };
            match shares.iter_mut().find(|(known, _)| *known == name) {
                Some((_, share)) => *share += contribution.variance,
                None => shares.push((name, contribution.variance)),
            }
        }
        let most = shares.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        (most.1 > 0.1 * all).then_some(most.0)
    }

    /// Says where the variance of a target comes from, if that is finite, and draws it.
    fn detail(
        &self,
        analysis: &Analysis<L::Point>,
        prediction: &Prediction<L::Point>,
        target: &mut TargetDiagnosis,
    ) -> Result<Option<Picture>, Failure> {
        let Some(attribution) = prediction.attribute(analysis).map_err(explained)? else {
            return Ok(None);
        };
        let (contributions, sites) = (&attribution.contributions, analysis.sites.len());
        let summed = Summed::new(contributions, sites, self.place);
        let picture = match self.draw {
            Some(draw) => Picture::Drawn(draw(&shares_of_sites(contributions, sites))?),
            None => summed.table(),
        };
        let hidden_by = self.hider(contributions);
        target.detail(&attribution.parts, summed, hidden_by);
        Ok(Some(picture))
    }
}

impl Diagnosis {
    /// What other pairs would do: the file with them in place of its own.
    fn compare(&mut self, file: &ProblemFile, request: &Request<'_>) -> Result<(), Failure> {
        let request = &Request {
            brief: true,
            ..*request
        };
        for pairs in [
            Pairs::Paper,
            Pairs::Default,
            Pairs::Pointwise,
            Pairs::Theory,
        ] {
            if pairs == file.galerkin.pairs.value {
                continue;
            }
            let mut other = file.clone();
            other.galerkin.pairs.value = pairs;
            // Not every problem has all of them.
            if other.validate().is_err() {
                continue;
            }
            let Ok(problem) = problem::of_file(&other) else {
                continue;
            };
            let theory = pairs == Pairs::Theory;
            // There is nothing to choose by where variances are infinite.
            let finite = self.kernel_power.is_some() && self.neighbour_power.is_some();
            if theory && (!finite || problem.unknowns() > COMPARED) {
                continue;
            }
            let found = problem.diagnose(request)?;
            self.other_pairs.push(OtherPairs {
                pairs: word(&pairs),
                preconditioned: found.targets.iter().map(|t| t.preconditioned).collect(),
            });
        }
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
                        match other.pairs.as_str() {
                            "pointwise" => {
                                "; a walk takes longer, as G is an integral over all cells wherever it is scored"
                            }
                            "theory" => "; its choice reckons with the time of a walk",
                            _ => "",
                        }
                    ));
                }
            }
        }
        Ok(())
    }

    fn svg(&self) -> Result<String, Failure> {
        match &self.picture {
            Picture::Table(names, shares) => {
                crate::figure::shares_svg("share of the variance, by steps", names, shares)
                    .map_err(Failure::run)
            }
            Picture::Drawn(svg) => Ok(svg.clone()),
        }
    }
}

/// Refuses more pairs of sites than there is room for.
fn refuse_pairs(sites: usize) -> Result<(), Failure> {
    let needed = sites.saturating_mul(sites).saturating_mul(PAIR);
    match lacking_memory(needed) {
        Some(lacking) => Err(Failure::input(format_args!(
            "{sites} sites need {lacking}: use fewer `--nodes`, or fewer cells (`--cells`)"
        ))),
        None => Ok(()),
    }
}

fn explained(error: VarianceError) -> Failure {
    Failure::run(error)
}

/// All of them on the threads of the pool.
pub(crate) fn in_parallel<T: Send>(all: &mut [T], pass: &Pass<'_, T>) {
    let each = |i: usize, one: &mut [T]| {
        one.iter_mut().for_each(|one| pass(i, one));
        Ok::<(), core::convert::Infallible>(())
    };
    match fill_rows(all, 1, each) {
        Ok(()) => {}
        Err(never) => match never {},
    }
}

/// A target of a diagnosis.
pub(crate) struct Begin<'a, P> {
    pub(crate) name: &'a str,
    pub(crate) start: Start<'a, P>,
}

/// A setting with what is asked of it.
pub(crate) struct Subject<'a, E, N: ?Sized, S, L: Level, C> {
    pub(crate) setting: Setting<'a, E, N, S, L>,
    /// K' of piecewise constants, for the quantities of section 4.
    pub(crate) coefficients: Option<&'a C>,
    pub(crate) targets: &'a [Begin<'a, L::Point>],
    /// What the place of a site is called: contributions are summed over the sites of a place.
    pub(crate) place: &'a dyn Fn(usize) -> String,
    /// What hides a site from another in part, where something can.
    pub(crate) hides: Option<&'a dyn Fn(usize, usize) -> Option<String>>,
    /// Draws the shares of the sites, where the problem has a picture of its own.
    pub(crate) draw: Option<&'a Draw<'a>>,
}

/// From the shares of sites to an SVG.
pub(crate) type Draw<'a> = dyn Fn(&[f64]) -> Result<String, Failure> + 'a;

/// What `diagnose` found.
#[derive(Debug, Serialize)]
pub(crate) struct Diagnosis {
    pub(crate) sites: usize,
    pub(crate) nodes: usize,
    pub(crate) seconds: f64,
    /// ‖T_k²p^m‖ < 1, and ‖T_h²p^m‖ < 1: null where the variance is infinite.
    pub(crate) kernel_power: Option<PowerReport>,
    pub(crate) neighbour_power: Option<PowerReport>,
    /// Of the absorption estimator.
    pub(crate) quantities: Option<QuantitiesReport>,
    pub(crate) targets: Vec<TargetDiagnosis>,
    /// √Var ζ of every target with other pairs.
    pub(crate) other_pairs: Vec<OtherPairs>,
    /// Of the first target.
    #[serde(skip)]
    pub(crate) picture: Picture,
}

/// What other pairs would do.
#[derive(Debug, Serialize)]
pub(crate) struct OtherPairs {
    pairs: String,
    preconditioned: Vec<Option<f64>>,
}

/// The flags that were given, in place of the file's values.
fn replace(file: &mut ProblemFile, args: &DiagnoseArgs) {
    let galerkin = &mut file.galerkin;
    if let Some(cells) = args.cells {
        galerkin.cells = Some(Placed::flag("--cells", cells));
    }
    if let Some(degree) = args.degree {
        galerkin.degree = Placed::flag("--degree", degree);
    }
    if let Some(pairs) = args.pairs {
        galerkin.pairs = Placed::flag("--pairs", pairs);
    }
    if let Some(estimator) = args.estimator {
        file.walk.estimator = Placed::flag("--estimator", estimator);
    }
    // What is infinite is said, and not refused.
    file.walk.allow_infinite_variance = true;
}

/// Runs `diagnose`.
pub(crate) fn diagnose(args: &DiagnoseArgs) -> Result<Ended, Failure> {
    let file = read(&args.file, |file| replace(file, args))?;
    let problem = problem::of_file(&file)?;
    refuse_beyond_memory(&file, &*problem)?;
    let output = match &args.out {
        Some(dir) => Some(open_all(dir, ["diagnosis.json", "where.svg"])?),
        None => None,
    };
    let bar = counting("sites");
    let request = Request {
        estimator: plan(&file, None).estimator,
        nodes: usize::from(args.nodes),
        brief: false,
        bar: &bar,
    };
    let work = || -> Result<Diagnosis, Failure> {
        let mut diagnosis = problem.diagnose(&request)?;
        diagnosis.compare(&file, &request)?;
        Ok(diagnosis)
    };
    let diagnosis = with_threads(args.common.threads, work)??;
    bar.finish_and_clear();
    let report = Report {
        problem: problem.kind(),
        cells: problem.cells(),
        unknowns: problem.unknowns(),
        degree: file.galerkin.degree.value,
        pairs: word(&file.galerkin.pairs.value),
        estimator: word(&file.walk.estimator.value),
        diagnosis: &diagnosis,
    };
    if let Some([json, map]) = output {
        json.finish(report.json()?)?;
        map.finish(diagnosis.svg()?)?;
    }
    let text = if args.common.json {
        report.json()?
    } else {
        report.text(&*problem)
    };
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()?;
    Ok(Ended::Done)
}
