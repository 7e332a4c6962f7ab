//! A model from draws alone, of an equation of which nothing is known but how to step.
//!
//! A neighbour equation [from steps](fredholm_core::sampled) has h = k, and no integrals in closed form. Then the operators of the
//! variance are means over steps, and the sources means over what walks score: of a site, over points that are spread over it.
//! Let f and g be what is drawn for F and G in such a point. The equations ask for E f, E g, E f² and E (f − g)², and each is its
//! mean over the draws. A mean square of draws is the square of their mean and their variance over their number n, not
//! n − 1: what is too much in the one is missing in the other, so that the noise of the means adds nothing to a predicted variance.
//! Between two sites draws are independent.
//!
//! What varies within a site together with what later states score, is taken as if it did not: sites are to be small against
//! that.

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::fmt;
use core::ops::Range;

use fredholm_core::galerkin::{GalerkinError, PairKind, reserve};
use fredholm_core::{Absorption, DefaultGenerator, Equation, Located, NeighbourOf, RngUniforms};

use crate::survival::{Survival, Survived};
use crate::{Density, Origin, Position, Transition, Values, VarianceModel, Wanted};

/// Numbers to draw from.
pub type Draws = RngUniforms<DefaultGenerator>;

/// How much is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DrawCounts {
    /// Scores of F and of G.
    pub scores: u32,
    /// Steps.
    pub steps: u32,
}

/// What draws tell of a site, or of a point in which walks start.
#[derive(Clone, Debug)]
pub struct DrawnSite {
    weight: f64,
    values: Values,
    /// By sites, and of equal weights together.
    steps: Vec<DrawnStep>,
}

/// Steps into a site.
#[derive(Clone, Copy, Debug, PartialEq)]
struct DrawnStep {
    site: u32,
    /// Their probability.
    mass: f64,
    survived: Survived,
}

/// What walks: an equation, its neighbour equation, in which h = k, and how walks end.
#[derive(Debug)]
pub struct Walked<'a, E, N: ?Sized> {
    /// The equation.
    pub equation: &'a E,
    /// The neighbour equation.
    pub neighbour: &'a N,
    /// How walks end.
    pub absorption: Absorption,
}

impl DrawnSite {
    /// Draws scores of an equation and of its neighbour equation, in which h = k, and steps, each from a point of its own.
    /// `point` gives points of the site with its measure as density, and `site_of` the site of every point.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn new<E, N>(
        walked: &Walked<'_, E, N>,
        counts: DrawCounts,
        draws: &mut Draws,
        point: &mut dyn FnMut(&mut Draws) -> E::Point,
        site_of: &dyn Fn(&E::Point) -> usize,
    ) -> Result<Self, GalerkinError>
    where
        E: Equation<Scalar = f64, Value = f64>,
        N: NeighbourOf<E> + ?Sized,
    {
        let Walked {
            equation,
            neighbour,
            absorption,
        } = *walked;
        let survival = Survival::new(equation, neighbour, absorption);
        let x = point(draws);
        let mut site = Self {
            weight: 1.0,
            values: Values {
                absorption: 1.0 - survival.probability(&x, 1.0),
                source: 0.0,
                neighbour_source: 0.0,
                source_noise: 0.0,
                noise: 0.0,
                value: 0.0,
            },
            steps: reserve(counts.steps as usize)?,
        };
        let (mut of_source, mut of_difference) = (Squares::default(), Squares::default());
        for _ in 0..counts.scores {
            let x: Located<E::Point> = neighbour.locate(point(draws));
            let source = equation.source(&x.point, draws);
            let difference = source - neighbour.source(&x, draws);
            of_source.add(source);
            of_difference.add(difference);
            site.values.value += neighbour.value(&x) / f64::from(counts.scores);
        }
        site.values.source = of_source.mean;
        site.values.source_noise = of_source.variance();
        site.values.neighbour_source = of_source.mean - of_difference.mean;
        site.values.noise = of_difference.variance();
        for _ in 0..counts.steps {
            let x = point(draws);
            if let Some(y) = equation.step(&x, draws) {
                let kernel = equation.kernel(&x, &y);
                let survived = survival.step(survival.probability(&x, 1.0), &y, kernel);
                site.steps.push(DrawnStep {
                    site: site_of(&y) as u32,
                    mass: survived.probability / f64::from(counts.steps),
                    survived,
                });
            }
        }
        let order = |a: &DrawnStep, b: &DrawnStep| {
            let [of_a, of_b] = [a, b].map(|step| step.survived);
            (a.site.cmp(&b.site))
                .then(of_a.kernel.total_cmp(&of_b.kernel))
                .then(of_a.next.total_cmp(&of_b.next))
                .then(of_a.later.total_cmp(&of_b.later))
        };
        site.steps.sort_by(order);
        site.steps.dedup_by(|next, kept| {
            let is_same = order(next, kept).is_eq();
            if is_same {
                kept.mass += next.mass;
            }
            is_same
        });
        site.steps.shrink_to_fit();
        Ok(site)
    }

    /// The site with its measure.
    #[must_use]
    pub fn with_measure(self, measure: f64) -> Self {
        Self {
            weight: measure,
            ..self
        }
    }
}

/// Mean and variance of numbers, by Welford.
#[derive(Clone, Copy, Debug, Default)]
struct Squares {
    count: f64,
    mean: f64,
    sum: f64,
}

impl Squares {
    fn add(&mut self, x: f64) {
        self.count += 1.0;
        let from = x - self.mean;
        self.mean += from / self.count;
        self.sum += from * (x - self.mean);
    }

    /// Σ (x − mean)² over the number: with the square of the mean it is the mean square.
    fn variance(&self) -> f64 {
        if self.count > 0.0 {
            self.sum / self.count
        } else {
            0.0
        }
    }
}

/// A density of starts, by sites.
pub type SiteDensity<'a> = Box<dyn Fn(usize) -> Density + Sync + 'a>;

/// Where walks start.
pub enum DrawnStart<'a> {
    /// One point of a site, of which draws were made, with φ = 1.
    At(usize, DrawnSite),
    /// A density of starts that is constant on every site.
    Density(SiteDensity<'a>),
}

impl fmt::Debug for DrawnStart<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::At(..) => "At",
            Self::Density(_) => "Density",
        })
    }
}

/// An equation and a neighbour equation with h = k, as draws tell of them. Every site has one node.
#[derive(Debug)]
pub struct DrawnModel<'a> {
    /// The sites.
    pub sites: Vec<DrawnSite>,
    /// The starts.
    pub starts: Vec<DrawnStart<'a>>,
}

impl DrawnModel<'_> {
    /// A site, or a start in a point behind them.
    fn site(&self, point: usize) -> Option<&DrawnSite> {
        match point.checked_sub(self.sites.len()) {
            None => self.sites.get(point),
            Some(start) => match self.starts.get(start)? {
                DrawnStart::At(_, site) => Some(site),
                DrawnStart::Density(_) => None,
            },
        }
    }
}

impl VarianceModel for DrawnModel<'_> {
    fn sites(&self) -> usize {
        self.sites.len()
    }

    fn nodes(&self, site: usize) -> Range<usize> {
        site..site + 1
    }

    fn position(&self, point: usize) -> Position {
        Position {
            cell: point,
            weight: self.site(point).map_or(f64::NAN, |site| site.weight),
        }
    }

    fn values(&self, point: usize) -> Values {
        self.site(point).map_or(Values::MISSING, |site| site.values)
    }

    fn steps(&self, point: usize, site: usize, _: Wanted, visit: &mut dyn FnMut(&Transition)) {
        let Some(from) = self.site(point) else {
            return;
        };
        let first = from
            .steps
            .partition_point(|step| (step.site as usize) < site);
        let steps = from.steps.iter().skip(first);
        for step in steps.take_while(|step| step.site as usize == site) {
            visit(&Transition {
                weight: step.mass,
                node: None,
                cell: site,
                left_out: false,
                kernel: step.survived.kernel,
                next: step.survived.next,
                later: step.survived.later,
                neighbour: step.survived.kernel,
                // Where h = k nobody needs v.
                value: 0.0,
            });
        }
    }

    fn kind(&self, _: usize, _: usize) -> PairKind {
        PairKind::Pointwise
    }

    fn start(&self, start: usize) -> Option<Origin> {
        Some(match self.starts.get(start)? {
            DrawnStart::At(site, _) => Origin::Point {
                point: self.sites.len() + start,
                site: *site,
            },
            DrawnStart::Density(_) => Origin::Density,
        })
    }

    fn density(&self, start: usize, point: usize) -> Density {
        match self.starts.get(start) {
            Some(DrawnStart::Density(density)) if point < self.sites.len() => density(point),
            _ => Density::nothing(),
        }
    }
}
