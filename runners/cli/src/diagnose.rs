//! `fredholm diagnose`: the variance before the walks, and what limits it.

use std::collections::HashMap;
use std::io::Write;
use std::time::Instant;

use fredholm_core::galerkin::{self, Coefficients};
use fredholm_core::variance::{
    Contribution, Level, PairQuantities, Parts, Pass, Power, Prediction, Quantities, Setting,
    Start, VarianceError,
};
use fredholm_core::{Estimator, Kernel, Neighbour, Sampler, Source};
use fredholm_rayon::fill_rows;
use serde::Serialize;

use crate::args::DiagnoseArgs;
use crate::failure::{Ended, Failure};
use crate::file::{Pairs, Placed, ProblemFile, word};
use crate::numbers::{aligned, short};
use crate::output::open_all;
use crate::problem::{self, Problem};
use crate::solve::{plan, read, refuse_beyond_memory, refuse_memory};
use crate::threads::with_threads;

/// Bytes of a pair of sites: moments, contributions, and a list of these.
const PAIR: usize = 48 + 8 + 40;
/// Pairs of places that are shown.
const SHOWN: usize = 8;
/// So many targets are looked at in detail: the points of a grid are many, and much alike.
const DETAILED: usize = 3;

/// How to look.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request {
    /// What walks score.
    pub(crate) estimator: Estimator,
    /// About so many nodes.
    pub(crate) nodes: usize,
}

impl Request {
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
        C: Coefficients<1, Scalar = f64>,
    {
        let clock = Instant::now();
        let setting = &subject.setting;
        let analysis = setting
            .analyse(self.estimator, in_parallel)
            .map_err(explained)?;
        let quantities = match self.estimator {
            Estimator::Absorption => Some(analysis.quantities().map_err(explained)?),
            Estimator::Collision => None,
        };
        let pairs = match (subject.coefficients, &quantities) {
            (Some(coefficients), Some(of)) => {
                let mut report = PairsReport::default();
                let each = |pair: PairQuantities| report.add(&pair, of.alpha);
                setting
                    .pair_quantities(coefficients, each)
                    .map_err(explained)?;
                Some(report)
            }
            _ => None,
        };
        let mut targets = Vec::new();
        let mut picture = Picture::Table(Vec::new(), Vec::new());
        for begin in subject.targets {
            let prediction = setting.predict(&analysis, begin.start).map_err(explained)?;
            let mut target = TargetDiagnosis::new(begin.name, &prediction, quantities.as_ref());
            if targets.len() < DETAILED
                && let Some(attribution) = prediction.attribute(&analysis).map_err(explained)?
            {
                let contributions = &attribution.contributions;
                let summed = Summed::new(contributions, analysis.sites.len(), subject.place);
                if targets.is_empty() {
                    picture = match subject.draw {
                        Some(draw) => Picture::Drawn(draw(&shares_of_sites(
                            contributions,
                            analysis.sites.len(),
                        ))?),
                        None => summed.table(),
                    };
                }
                target.detail(&attribution.parts, summed);
            }
            targets.push(target);
        }
        Ok(Diagnosis {
            sites: analysis.sites.len(),
            nodes: analysis.sites.iter().map(|site| site.nodes.len()).sum(),
            seconds: clock.elapsed().as_secs_f64(),
            kernel_power: analysis.kernel_power.map(PowerReport::from),
            neighbour_power: analysis.neighbour_power.map(PowerReport::from),
            quantities: quantities.map(|of| QuantitiesReport::new(&of, pairs)),
            targets,
            other_pairs: Vec::new(),
            picture,
        })
    }
}

impl Diagnosis {
    /// What other pairs would do: the file with them in place of its own.
    fn compare(&mut self, file: &ProblemFile, request: &Request) -> Result<(), Failure> {
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
            if theory && problem.unknowns() > request.nodes {
                continue;
            }
            let found = match problem.diagnose(request) {
                // There is nothing to choose by where variances are infinite.
                Err(_) if theory => continue,
                found => found?,
            };
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

/// The share of every site in the variance, by steps from it and by the sources' difference in it.
fn shares_of_sites(contributions: &[Contribution], sites: usize) -> Vec<f64> {
    let mut shares = vec![0.0; sites];
    for contribution in contributions {
        shares[contribution.from] += contribution.variance;
    }
    let all: f64 = shares.iter().sum();
    shares.iter_mut().for_each(|share| *share /= all);
    shares
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

/// A picture of where the variance comes from.
#[derive(Debug)]
pub(crate) enum Picture {
    /// Shares of pairs of places: rows are where a step starts, the last column is the sources'.
    Table(Vec<String>, Vec<Vec<f64>>),
    /// An SVG that the problem drew.
    Drawn(String),
}

#[derive(Debug, Serialize)]
pub(crate) struct PowerReport {
    exponent: u32,
    norm: f64,
}

impl From<Power> for PowerReport {
    fn from(power: Power) -> Self {
        Self {
            exponent: power.exponent,
            norm: power.norm,
        }
    }
}

/// The quantities of sections 3 and 4 of the paper, by their names.
#[derive(Debug, Serialize)]
pub(crate) struct QuantitiesReport {
    alpha: f64,
    theta: f64,
    delta: f64,
    epsilon: f64,
    rho: f64,
    sigma: f64,
    tau: f64,
    c_p: f64,
    n0: Option<u32>,
    gamma: Option<f64>,
    beta_0: Option<f64>,
    beta_1: Option<f64>,
    beta: Option<f64>,
    q0: f64,
    /// The bound of τ by Proposition 7.
    proposition_7: f64,
    /// Of pairs of cells, for degree 0.
    pairs: Option<PairsReport>,
}

/// The extremes over the pairs in S, and the bound of σ by Proposition 6.
#[derive(Debug, Default, Serialize)]
pub(crate) struct PairsReport {
    in_s: usize,
    others: usize,
    kappa: f64,
    r: f64,
    lambda: f64,
    coefficient_error: f64,
    proposition_6: f64,
}

#[derive(Debug, Serialize)]
pub(crate) struct TargetDiagnosis {
    pub(crate) name: String,
    /// (u,Φ) and (v,Φ) on the level.
    pub(crate) solution: f64,
    pub(crate) galerkin: f64,
    /// √Var; null where it is infinite.
    pub(crate) plain: Option<f64>,
    pub(crate) preconditioned: Option<f64>,
    /// The ratio of the two.
    pub(crate) gain: Option<f64>,
    pub(crate) parts: Option<Shares>,
    /// Bounds of √Var ζ; null where an assumption does not hold.
    pub(crate) bounds: Option<BoundsReport>,
    /// The pairs of places that contribute most, of the first targets.
    pub(crate) places: Vec<PlaceReport>,
    /// The share of the pairs of sites that makes half of the variance.
    pub(crate) half_in: Option<f64>,
    pub(crate) advice: Vec<String>,
}

/// Shares of Var ζ, in sum 1; a share may be negative. `start` is what comes of (v,Φ) not being known.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Shares {
    pub(crate) kernel: f64,
    pub(crate) left_out: f64,
    pub(crate) sources: f64,
    pub(crate) mean: f64,
    pub(crate) start: f64,
}

#[derive(Debug, Serialize)]
pub(crate) struct BoundsReport {
    theorem_3: Option<f64>,
    corollary_4: Option<f64>,
    theorem_5: Option<f64>,
}

#[derive(Debug, Serialize)]
pub(crate) struct PlaceReport {
    from: String,
    /// null: the difference of the sources at `from`.
    into: Option<String>,
    share: f64,
}

/// The whole report.
#[derive(Debug, Serialize)]
struct Report<'a> {
    problem: &'a str,
    cells: usize,
    unknowns: usize,
    degree: usize,
    pairs: String,
    estimator: String,
    #[serde(flatten)]
    diagnosis: &'a Diagnosis,
}

impl PairsReport {
    fn add(&mut self, pair: &PairQuantities, alpha: f64) {
        self.proposition_6 += pair.proposition_6(alpha);
        if !pair.in_s {
            self.others += 1;
            return;
        }
        let error = (pair.mean_kernel - pair.coefficient).abs();
        self.r = if self.in_s == 0 {
            pair.r
        } else {
            self.r.min(pair.r)
        };
        self.in_s += 1;
        self.kappa = self.kappa.max(pair.kappa);
        self.lambda = self.lambda.max(pair.lambda);
        self.coefficient_error = self.coefficient_error.max(error);
    }
}

impl QuantitiesReport {
    fn new(of: &Quantities, mut pairs: Option<PairsReport>) -> Self {
        if let Some(pairs) = &mut pairs {
            // The proposition is of the square.
            pairs.proposition_6 = pairs.proposition_6.sqrt();
        }
        Self {
            alpha: of.alpha,
            theta: of.theta,
            delta: of.delta,
            epsilon: of.epsilon,
            rho: of.rho,
            sigma: of.sigma,
            tau: of.tau,
            c_p: of.c_p,
            n0: of.power.map(|power| power.exponent),
            gamma: of.power.map(|power| power.norm),
            beta_0: of.beta_0,
            beta_1: of.beta_1,
            beta: of.beta,
            q0: of.absorption,
            proposition_7: of.proposition_7().sqrt(),
            pairs,
        }
    }
}

/// Contributions by places.
struct Summed {
    /// From, into, variance; the largest first.
    places: Vec<(String, Option<String>, f64)>,
    /// Their sum.
    all: f64,
    half_in: Option<f64>,
    /// The names of the places, and what every pair of them adds; the sources last.
    names: Vec<String>,
    sums: Vec<f64>,
}

impl Summed {
    fn table(&self) -> Picture {
        let rows = self.sums.chunks_exact(self.names.len() + 1);
        let shares = rows.map(|row| row.iter().map(|sum| sum / self.all).collect());
        Picture::Table(self.names.clone(), shares.collect())
    }

    fn new(contributions: &[Contribution], sites: usize, name: &dyn Fn(usize) -> String) -> Self {
        // In the order in which they come.
        let mut distinct: Vec<String> = Vec::new();
        let mut known = HashMap::new();
        let of: Vec<usize> = (0..sites)
            .map(|site| {
                let name = name(site);
                *known.entry(name.clone()).or_insert_with(|| {
                    distinct.push(name);
                    distinct.len() - 1
                })
            })
            .collect();
        let width = distinct.len() + 1;
        let mut sums = vec![0.0; distinct.len() * width];
        let mut all = 0.0;
        for contribution in contributions {
            let into = contribution.into.map_or(distinct.len(), |into| of[into]);
            sums[of[contribution.from] * width + into] += contribution.variance;
            all += contribution.variance;
        }
        let mut places: Vec<(String, Option<String>, f64)> = sums
            .iter()
            .enumerate()
            .map(|(place, &sum)| {
                let into = distinct.get(place % width).cloned();
                (distinct[place / width].clone(), into, sum)
            })
            .filter(|(.., sum)| *sum != 0.0)
            .collect();
        places.sort_by(|a, b| b.2.total_cmp(&a.2));
        // Pairs alone, the largest first.
        let pairs = || {
            contributions
                .iter()
                .filter(|c| c.into.is_some() && c.variance > 0.0)
        };
        let total: f64 = pairs().map(|c| c.variance).sum();
        let mut sum = 0.0;
        let half = pairs().take_while(|c| {
            let before = sum;
            sum += c.variance;
            before < 0.5 * total
        });
        let half = half.count();
        Self {
            places,
            all,
            half_in: (total > 0.0).then(|| half as f64 / (sites * sites) as f64),
            names: distinct,
            sums,
        }
    }
}

impl TargetDiagnosis {
    fn new<P>(name: &str, prediction: &Prediction<P>, quantities: Option<&Quantities>) -> Self {
        // Rounding may leave a little below 0.
        let root = |variance: f64| variance.max(0.0).sqrt();
        let [plain, preconditioned] =
            [prediction.plain, prediction.preconditioned].map(|v| v.map(root));
        Self {
            name: name.to_owned(),
            solution: prediction.solution,
            galerkin: prediction.solution - prediction.error,
            plain,
            preconditioned,
            gain: plain
                .zip(preconditioned)
                .map(|(a, b)| a / b)
                .filter(|gain| gain.is_finite()),
            parts: None,
            bounds: quantities.map(|of| {
                let bounds = of.bounds(prediction);
                BoundsReport {
                    theorem_3: bounds.theorem_3.map(f64::sqrt),
                    corollary_4: bounds.corollary_4.map(f64::sqrt),
                    theorem_5: bounds.theorem_5.map(f64::sqrt),
                }
            }),
            half_in: None,
            places: Vec::new(),
            advice: infinite(prediction),
        }
    }

    /// Where it comes from, and what may help.
    fn detail(&mut self, parts: &Parts, summed: Summed) {
        self.parts = Some(Shares::new(parts));
        self.half_in = summed.half_in;
        let shown = summed.places.into_iter().take(SHOWN);
        let share = |variance: f64| variance / summed.all;
        self.places = shown
            .map(|(from, into, variance)| PlaceReport {
                from,
                into,
                share: share(variance),
            })
            .collect();
        self.advice = self.advise();
    }

    /// What may help, in words.
    fn advise(&self) -> Vec<String> {
        let Some(shares) = self.parts else {
            return Vec::new();
        };
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        let mut advice = Vec::new();
        if shares.left_out > 0.1 {
            advice.push(format!(
                "{} of the variance comes from pairs that the neighbour equation leaves out: `pairs = \
                 \"default\"` follows them exactly where the problem has their integrals",
                percent(shares.left_out)
            ));
        }
        let pair = self
            .places
            .iter()
            .find_map(|place| Some((place, place.into.as_ref()?)));
        if let (true, Some(half), Some((place, into))) = (shares.kernel > 0.3, self.half_in, pair) {
            let from = &place.from;
            if half < 0.05 {
                advice.push(format!(
                    "half of what pairs of cells contribute comes from {:.2} % of them, and {} of the \
                     variance from steps from {from} into {into}: more cells there, or `pairs = \
                     \"pointwise\"` for a kernel that varies too fast for cells",
                    100.0 * half,
                    percent(place.share)
                ));
            } else {
                advice.push(format!(
                    "the kernel differs everywhere, most from {from} into {into} ({}): more cells, or a \
                     higher `degree` where the problem has it",
                    percent(place.share)
                ));
            }
        }
        if shares.sources > 0.5 {
            let place = self.places.iter().find(|place| place.into.is_none());
            let at = place.map_or(String::new(), |place| {
                format!(", most at {} ({})", place.from, percent(place.share))
            });
            advice.push(format!(
                "{} of the variance comes from the difference of the sources, where walks end{at}: \
                 v is no closer to u there; more cells or a higher `degree`",
                percent(shares.sources)
            ));
        }
        advice
    }
}

/// What to do about an infinite variance.
fn infinite<P>(prediction: &Prediction<P>) -> Vec<String> {
    let which = match (prediction.plain, prediction.preconditioned) {
        (None, _) => "plain and preconditioned",
        (_, None) => "preconditioned",
        _ => return Vec::new(),
    };
    vec![format!(
        "the variance of {which} walks is infinite, or no power below 1000 of their operator is a contraction: a \
         smaller `absorption`, or more cells, may help"
    )]
}

impl Shares {
    fn new(parts: &Parts) -> Self {
        let all = parts.kernel + parts.left_out + parts.sources + parts.start - parts.mean;
        let share = |part: f64| if all > 0.0 { part / all } else { 0.0 };
        Self {
            kernel: share(parts.kernel),
            left_out: share(parts.left_out),
            sources: share(parts.sources),
            mean: share(-parts.mean),
            start: share(parts.start),
        }
    }
}

impl Report<'_> {
    fn json(&self) -> Result<String, Failure> {
        let mut text = serde_json::to_string_pretty(self).map_err(Failure::run)?;
        text.push('\n');
        Ok(text)
    }

    fn text(&self, problem: &dyn Problem) -> String {
        let Diagnosis {
            sites,
            nodes,
            kernel_power,
            neighbour_power,
            quantities,
            targets,
            ..
        } = self.diagnosis;
        let mut text = format!(
            "{}, {} cells, degree {}, {} pairs, {} estimator; {sites} sites with {nodes} nodes\n\n",
            self.problem,
            problem.cells_text(),
            self.degree,
            self.pairs,
            self.estimator
        );
        let number = |x: Option<f64>| x.map_or_else(|| "infinite".to_owned(), short);
        let header = [
            "target",
            "u",
            "Galerkin",
            "√Var plain",
            "preconditioned",
            "gain",
        ];
        let mut rows = vec![header.map(str::to_owned).to_vec()];
        let others = &self.diagnosis.other_pairs;
        rows[0].extend(others.iter().map(|other| format!("{} pairs", other.pairs)));
        for (place, target) in targets.iter().enumerate() {
            let mut row = vec![
                target.name.clone(),
                format!("{:.6}", target.solution),
                format!("{:.6}", target.galerkin),
                number(target.plain),
                number(target.preconditioned),
                target.gain.map_or_else(|| "-".to_owned(), short),
            ];
            row.extend(
                others
                    .iter()
                    .map(|other| number(other.preconditioned.get(place).copied().flatten())),
            );
            rows.push(row);
        }
        text += &aligned(&rows);
        for target in targets.iter().take(DETAILED) {
            text += &target.text();
        }
        if targets.len() > DETAILED {
            text += &format!(
                "\n{} more targets are not looked at in detail: those that come first in the file are\n",
                targets.len() - DETAILED
            );
        }
        text += "\nfinite variance\n";
        for (name, power) in [("T_k²p", kernel_power), ("T_h²p", neighbour_power)] {
            text += &match power {
                Some(PowerReport { exponent, norm }) => {
                    format!("  ‖({name})^{exponent}‖ = {} < 1\n", short(*norm))
                }
                None => format!("  no power of {name} below 1000 is seen to be a contraction\n"),
            };
        }
        if let Some(quantities) = quantities {
            text += &quantities.text();
        }
        text
    }
}

impl TargetDiagnosis {
    fn text(&self) -> String {
        let mut text = format!("\n{}\n", self.name);
        if let Some(shares) = self.parts {
            for (what, share) in [
                ("kernels differ in S", shares.kernel),
                ("pairs left out", shares.left_out),
                ("sources differ", shares.sources),
                ("square of the mean", shares.mean),
                ("(v,Φ) is not known", shares.start),
            ] {
                if share != 0.0 {
                    text += &format!("  {:>6.1} %  {what}\n", 100.0 * share);
                }
            }
            text += "  most by place\n";
            for place in &self.places {
                let into = place.into.as_ref();
                let into = into.map_or_else(|| " (source)".to_owned(), |into| format!(" → {into}"));
                text += &format!("  {:>6.1} %  {}{into}\n", 100.0 * place.share, place.from);
            }
        }
        if let (Some(bounds), Some(sd)) = (&self.bounds, self.preconditioned) {
            for (name, bound) in [
                ("Theorem 3", bounds.theorem_3),
                ("Corollary 4", bounds.corollary_4),
                ("Theorem 5", bounds.theorem_5),
            ] {
                text += &match bound {
                    Some(bound) => {
                        format!(
                            "  {name}: √Var ≤ {}, {} times it\n",
                            short(bound),
                            short(bound / sd)
                        )
                    }
                    None if name == "Theorem 5" => {
                        "  Theorem 5: not for a start in one point, which has no density\n"
                            .to_owned()
                    }
                    None => format!("  {name}: its assumptions do not hold\n"),
                };
            }
        }
        for advice in &self.advice {
            text += &format!("  * {advice}\n");
        }
        text
    }
}

impl QuantitiesReport {
    fn text(&self) -> String {
        let number = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), short);
        let mut rows: Vec<Vec<String>> = Vec::new();
        let mut add = |name: &str, value: String, what: &str| {
            rows.push(vec![format!("  {name}"), value, what.to_owned()]);
        };
        add("α", short(self.alpha), "largest |k|, |h|");
        add("θ", short(self.theta), "largest f²q, g²q");
        add("δ(k,h)", short(self.delta), "sup ∫|k − h| p");
        add("ε(k,h)", short(self.epsilon), "(sup ∫(k − h)² p)^½");
        add("ρ(f,g)", short(self.rho), "(sup (f − g)² q)^½");
        add("σ(k,h)", short(self.sigma), "(∫∫(k − h)² p)^½");
        add("τ(f,g)", short(self.tau), "(∫(f − g)² q)^½");
        add("τ ≤", short(self.proposition_7), "Proposition 7");
        add(
            "n0",
            self.n0.map_or_else(|| "-".to_owned(), |n| n.to_string()),
            "power of the bounds",
        );
        add("γ", number(self.gamma), "‖T_k²p^n0‖, ‖T_h²p^n0‖ at most");
        add("β0", number(self.beta_0), "Lemma 1");
        add("β", number(self.beta), "‖(I − T_k²p)⁻¹‖ in L1");
        add("c_p", short(self.c_p), "sup ∫p(x,y) dx");
        if let Some(pairs) = &self.pairs {
            add("σ ≤", short(pairs.proposition_6), "Proposition 6");
            add("κ", short(pairs.kappa), "largest in S");
            add("r", short(pairs.r), "smallest in S");
            add("λ", short(pairs.lambda), "largest in S");
            add("|k̄ − k̄'|", short(pairs.coefficient_error), "largest in S");
        }
        format!("\nquantities of the paper\n{}", aligned(&rows))
    }
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
    let nodes = usize::from(args.nodes);
    refuse_beyond_memory(&file, &*problem)?;
    refuse_memory(&file, problem.unknowns(), nodes * nodes / 4 * PAIR)?;
    let output = match &args.out {
        Some(dir) => Some(open_all(dir, ["diagnosis.json", "where.svg"])?),
        None => None,
    };
    let request = Request {
        estimator: plan(&file, None).estimator,
        nodes,
    };
    let work = || -> Result<Diagnosis, Failure> {
        let mut diagnosis = problem.diagnose(&request)?;
        diagnosis.compare(&file, &request)?;
        Ok(diagnosis)
    };
    let diagnosis = with_threads(args.common.threads, work)??;
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
