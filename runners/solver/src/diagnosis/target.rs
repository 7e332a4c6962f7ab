//! What is said of a target: its deviations, their bounds, where they come from, and advice.

use fredholm_variance::{Parts, Prediction, Quantities};
use serde::Serialize;

use super::places::Summed;
use fredholm_model::numbers::short;

/// Pairs of places that are shown.
const SHOWN: usize = 8;

/// The diagnosis of a goal: its deviations, their bounds, where they come from, and advice.
#[derive(Clone, Debug, Serialize)]
pub struct GoalDiagnosis {
    /// The name of the goal.
    pub name: String,
    /// (u,Φ) on the level.
    pub solution: f64,
    /// (v,Φ) on the level.
    pub galerkin: f64,
    /// √Var η(k,f); null where it is infinite.
    pub plain: Option<f64>,
    /// √Var ζ; null where it is infinite.
    pub preconditioned: Option<f64>,
    /// The ratio of the two deviations.
    pub gain: Option<f64>,
    /// The shares of Var ζ.
    pub parts: Option<Shares>,
    /// Bounds of √Var ζ; null where an assumption does not hold.
    pub bounds: Option<BoundsReport>,
    /// The pairs of places that contribute most, of the first targets.
    pub places: Vec<PlaceReport>,
    /// The share of the pairs of sites that makes half of the variance.
    pub half_in: Option<f64>,
    /// Advice, in words.
    pub advice: Vec<String>,
}

/// Shares of Var ζ, in sum 1; a share may be negative. `start` is what comes of (v,Φ) not being known.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Shares {
    /// The kernels differ on pairs in S.
    pub kernel: f64,
    /// Pairs are left out.
    pub left_out: f64,
    /// The sources differ.
    pub sources: f64,
    /// The square of the mean, which is taken off.
    pub mean: f64,
    /// (v,Φ) is not known.
    pub start: f64,
}

/// Bounds of √Var ζ; null where an assumption does not hold.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct BoundsReport {
    /// The bound of Theorem 3.
    pub theorem_3: Option<f64>,
    /// The bound of Corollary 4.
    pub corollary_4: Option<f64>,
    /// The bound of Theorem 5.
    pub theorem_5: Option<f64>,
}

/// The contribution of the steps between two places to Var ζ.
#[derive(Clone, Debug, Serialize)]
pub struct PlaceReport {
    /// The place from which the steps start.
    pub from: String,
    /// The place to which the steps lead; null: the difference of the sources at `from`.
    pub into: Option<String>,
    /// The share in Var ζ.
    pub share: f64,
}

impl GoalDiagnosis {
    pub(crate) fn new(
        name: &str,
        known: f64,
        prediction: &Prediction,
        quantities: Option<&Quantities>,
    ) -> Self {
        // Rounding may leave a little below 0.
        let root = |variance: f64| variance.max(0.0).sqrt();
        let [plain, preconditioned] =
            [prediction.plain, prediction.preconditioned].map(|v| v.map(root));
        Self {
            name: name.to_owned(),
            solution: known + prediction.solution,
            galerkin: known + prediction.solution - prediction.error,
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
    pub(super) fn detail(&mut self, parts: &Parts, summed: Summed) {
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

    /// Advice, in words.
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
                "{} of the variance comes from the difference of the sources{at}: \
                 v is no closer to u there; more cells or a higher `degree`",
                percent(shares.sources)
            ));
        }
        advice
    }
}

/// What to do about an infinite variance.
pub(super) fn infinite(prediction: &Prediction) -> Vec<String> {
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
    pub(crate) fn new(parts: &Parts) -> Self {
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

impl GoalDiagnosis {
    /// The diagnosis of the goal for people.
    #[must_use]
    pub fn text(&self) -> String {
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
                            "  {name}: √Var is at most {}, which is {} times what is predicted\n",
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
