//! Cells and solved systems of an equation of a crate of its own.

use std::sync::Mutex;

use fredholm_core::galerkin::Solution;
use fredholm_embedded::{Number, TableBuilder};
use fredholm_variance::{Density, MeanCoefficients, Quadrature, Start as Begin, VarianceSetup};

use super::cells::{Nodes, Uniform};
use super::degree::{Degree, Kinds, Of};
use super::lifted::{self, Lifted};
use super::quadrature::Sites;
use super::walk::{How, Lit, Solved, Walks, is_weight, known_of, place};
use super::whole::CustomWhole;
use super::{CustomEquation, CustomModel};
use crate::{
    Discretisation, Error, Goal, Model, Pairs, Partitioned, Region, Scalar, Subject, System,
};
use fredholm_core::{Absorption, Form, Located, NoDraws, Real};
use fredholm_model::cost::{Cost, PointwisePairs, WalkCost};
use fredholm_model::device::{PairRule, add_dense};
use fredholm_model::pairs::AnyPairs;
use fredholm_model::{Examined, in_scalar};
use fredholm_model::{GlobalSystem, Request, SavedSystem, Then, WalkOptions};

/// The relative residual at which the iteration for v stops.
const TOLERANCE: f64 = 1e-14;
/// Sweeps enough for spectral radii up to 0.99.
const SWEEPS: u32 = 4000;
/// Seconds of a state of a walk besides its kernel, as for the other kinds of equations.
const STATE: f64 = 20e-9;
/// Seconds of a product of two functions on a cell, of which a step has the square of their number.
const FOLLOW: f64 = 0.3e-9;
/// Values of F in a cell, for its means.
const VALUES_OF_SOURCE: f64 = 64.0;
/// The most points of an axis for the means of F: exact for half a wave on a cell.
const MOST_POINTS: usize = 16;
/// Seconds of the set-up for an unknown, where coefficients are closed forms.
const CLOSED: f64 = 1e-6;
/// Seconds of a polynomial of the highest degree at a point.
const FUNCTION: f64 = 2e-9;
/// Places into which a diagnosis sums the cells.
const PLACES: usize = 16;

/// Cells of an equation.
pub(super) struct CustomPartition<'m, E: CustomEquation> {
    pub(super) model: &'m CustomModel<E>,
    /// Cells as they were asked for.
    asked: usize,
    /// n.
    all: usize,
    pub(super) degree: usize,
    /// Quadrature points of a cell and axis.
    points: usize,
    pub(super) scalar: Scalar,
}

// By hand: a derive would ask the equation to be `Copy`.
impl<E: CustomEquation> Clone for CustomPartition<'_, E> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<E: CustomEquation> Copy for CustomPartition<'_, E> {}

impl<'m, E: CustomEquation<Scalar = f64>> CustomPartition<'m, E> {
    pub(super) fn new(
        model: &'m CustomModel<E>,
        discretisation: &Discretisation,
    ) -> Result<Self, Error> {
        let degree = discretisation.degree;
        let asked = discretisation
            .cells
            .unwrap_or_else(|| model.default_cells(degree));
        Ok(Self {
            model,
            asked,
            all: model.equation(asked)?.cells(),
            degree,
            points: discretisation.points.unwrap_or(degree + 1),
            scalar: discretisation.scalar,
        })
    }

    pub(super) fn equation(&self) -> Result<E, Error> {
        (self.model.equations.build)(self.asked)
    }

    pub(super) fn of_degree(&self) -> Result<&'m dyn Degree<E>, Error> {
        self.model.equations.degree(self.degree)
    }

    /// B.
    fn functions(&self) -> usize {
        self.of_degree().map_or(1, |degree| degree.functions())
    }

    pub(super) fn kinds(&self, pairs: Pairs) -> Kinds {
        let default = self.of_degree().map(|degree| degree.pairs().default);
        match pairs {
            Pairs::Paper => Kinds::Paper,
            Pairs::Pointwise => Kinds::AllPointwise,
            _ => default.unwrap_or(Kinds::AllInS),
        }
    }

    pub(super) fn walks(&self) -> Result<&'m dyn Walks, Error> {
        match self.scalar {
            Scalar::F64 => Ok(&self.model.equations),
            Scalar::F32 => self.model.single.as_deref().ok_or_else(|| Error::Option {
                subject: Subject::Problem,
                message:
                    "walks in single precision need the equation in it: see `CustomModel::with_f32`"
                        .to_owned(),
            }),
        }
    }

    /// The number of numbers that are kept of K', if it can be counted.
    fn stored(&self) -> Option<usize> {
        self.of_degree().ok()?.stored(self.all)
    }

    /// Whether coefficients are closed forms.
    fn is_closed(&self) -> bool {
        self.stored() == Some(0)
    }

    /// Values of the kernel in a cell.
    fn values(&self) -> f64 {
        self.points.max(1).pow(E::DIMENSION as u32) as f64
    }

    /// Points of a cell and axis for the means of F, which cost nothing beside a row of K'.
    fn points_of_source(&self) -> usize {
        let affordable = VALUES_OF_SOURCE.powf(1.0 / E::DIMENSION as f64);
        self.points
            .max((affordable.round() as usize).min(MOST_POINTS))
    }

    /// Nodes of a site, one more an axis than the square of k − h needs.
    fn points_of_site(&self) -> usize {
        self.degree + 2
    }

    /// Sites for about so many nodes: parts of cells, or cells.
    fn sites(&self, nodes: usize) -> Result<Sites<E>, Error> {
        let points = self.points_of_site();
        let d = E::DIMENSION as u32;
        let nodes_of_cells = self.all * points.pow(d);
        let parts = (nodes as f64 / nodes_of_cells as f64).powf(1.0 / f64::from(d));
        Sites::new(self.equation()?, (parts as usize).max(1), points)
    }

    /// The system of these coefficients with this solution.
    fn solved(&self, entries: Vec<f64>, solution: Solution) -> Box<dyn System + 'm> {
        Box::new(CustomSystem {
            cut: *self,
            solved: Solved {
                cells: self.asked,
                degree: self.degree,
                entries,
                solution,
                lifted: None,
            },
            radii: Mutex::default(),
        })
    }
}

impl<'m, E: CustomEquation<Scalar = f64>> Partitioned<'m> for CustomPartition<'m, E> {
    fn cells(&self) -> usize {
        self.asked
    }

    fn unknowns(&self) -> usize {
        self.all.saturating_mul(self.functions())
    }

    fn cells_text(&self) -> String {
        if self.asked == self.all {
            self.asked.to_string()
        } else if self.asked.checked_pow(E::DIMENSION as u32) == Some(self.all) {
            format!("{} per axis, {} in all", self.asked, self.all)
        } else {
            format!("{} ({} in all)", self.asked, self.all)
        }
    }

    fn memory(&self, goals: &[Goal], _: Pairs) -> usize {
        let n = self.unknowns();
        let nodes = (self.all as f64 * self.values()) as usize;
        let points = nodes.saturating_mul(size_of::<E::Point>());
        // K', F', v, G and their copies.
        let of_matrix = self.stored().unwrap_or(usize::MAX).saturating_mul(8);
        of_matrix
            .saturating_add(n.saturating_mul(8 * 8))
            .saturating_add(points)
            .saturating_add(goals.len().saturating_mul(1024))
    }

    fn cost(&self, _: Pairs) -> Cost {
        let (n, b, values) = (self.all as f64, self.functions() as f64, self.values());
        let kernel = self.model.kernel_seconds;
        let stored = self.stored().map_or(f64::INFINITY, |stored| stored as f64);
        let step = STATE + kernel;
        let plain = WalkCost {
            start: step,
            step,
            score: 0.5 * step,
            pair: 0.0,
            hidden_pair: 0.0,
        };
        let follow = step + STATE + FOLLOW * b * b;
        Cost {
            setup: match self.is_closed() {
                true => n * b * CLOSED,
                false => self.evaluations(0) * kernel + stored * 20e-9,
            },
            // The moments of h, for its variance, are most of it.
            source: match self.is_closed() {
                true => n * b * CLOSED,
                false => stored * (values * 10e-9 + 3e-9),
            },
            kept: 0.0,
            walk: WalkCost {
                start: follow,
                step: follow,
                pair: kernel,
                ..plain
            },
            plain,
            light: 0.5 * step,
        }
    }

    fn lift_cost(&self, degree: usize) -> Option<Cost> {
        let equation = self.equation().ok()?;
        let values = lifted::values(&equation, degree, degree + 3);
        let kernel = self.model.kernel_seconds;
        let cost = self.cost(Pairs::Default);
        let functions = fredholm_core::galerkin::functions(E::DIMENSION, lifted::HIGHEST) as f64;
        let follow = WalkCost {
            score: cost.walk.score + FUNCTION * functions + 2.0 * kernel,
            ..cost.plain
        };
        Some(Cost {
            setup: cost.setup + values * kernel,
            source: 0.0,
            walk: follow,
            ..cost
        })
    }

    fn pointwise_pairs(&self, pairs: Pairs) -> Result<PointwisePairs, Error> {
        // Their closed forms are a part of a score.
        let seen = match self.kinds(pairs) {
            _ if self.is_closed() => 0.0,
            Kinds::AllInS | Kinds::Paper => 0.0,
            Kinds::DiagonalPointwise => 1.0,
            Kinds::AllPointwise => self.all as f64,
        };
        Ok(PointwisePairs { seen, hidden: 0.0 })
    }

    fn evaluations(&self, _: u32) -> f64 {
        match self.of_degree() {
            Ok(degree) if !self.is_closed() => degree.evaluations(self.all, self.values()),
            _ => self.unknowns() as f64,
        }
    }

    fn plain_radius(&self) -> Result<f64, Error> {
        self.model.plain_radius()
    }

    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        fredholm_model::finite::check_plain("k², the square of K/p,", walk.absorption, || {
            self.plain_radius()
        })
    }

    fn examined_points(&self) -> Result<usize, Error> {
        let points = self.points_of_site().pow(E::DIMENSION as u32);
        Ok(self.all.saturating_mul(points))
    }

    fn solve(&self) -> Result<Box<dyn System + 'm>, Error> {
        let (equation, degree) = (self.equation()?, self.of_degree()?);
        let of_source = Nodes::new(&equation, self.points_of_source())?;
        let source = |x: &E::Point| equation.source(x, &mut NoDraws);
        let source = degree.on_cells().means(&equation, &of_source, &source);
        drop(of_source);
        let entries = degree.entries(&equation, self.points)?;
        let solution = Solution::new(
            &*degree.matrix(&equation, &entries)?,
            source,
            TOLERANCE,
            SWEEPS,
        )?;
        Ok(self.solved(entries, solution))
    }

    fn restore(&self, saved: SavedSystem<'m>) -> Result<Box<dyn System + 'm>, Error> {
        let solution = saved.fitting(self.unknowns(), self.stored())?;
        Ok(self.solved(saved.coefficients.into_owned(), solution))
    }

    fn plain_job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        self.walks()?.plain_job(self.asked, request, then)
    }
}

/// A solved equation.
pub(super) struct CustomSystem<'m, E: CustomEquation> {
    pub(super) cut: CustomPartition<'m, E>,
    pub(super) solved: Solved,
    /// The spectral radii of T_h²p that are known, by pairs.
    radii: Mutex<Vec<(Kinds, f64)>>,
}

impl<E: CustomEquation<Scalar = f64>> CustomSystem<'_, E> {
    /// The kinds of pairs: of a lift all are pointwise.
    pub(super) fn kinds(&self, pairs: Pairs) -> Kinds {
        match self.solved.lifted {
            Some(_) => Kinds::AllPointwise,
            None => self.cut.kinds(pairs),
        }
    }

    /// The densities of starts of all arcs that are asked for, in the order of their goals: even on the nodes there.
    fn arcs<'a>(
        &self,
        uniform: &'a Uniform<'a, E>,
        quadrature: &Sites<E>,
        goals: &[Goal],
    ) -> Result<Vec<impl Fn(&E::Point) -> Density + Sync + use<'a, E>>, Error> {
        let [low, high] = self
            .cut
            .model
            .coordinates
            .first()
            .copied()
            .unwrap_or([0.0, 1.0]);
        let arcs = goals.iter().filter_map(|goal| match goal.region {
            Region::Arc(from, to) => Some([from, to].map(|s| (s - low) / (high - low))),
            _ => None,
        });
        let density = |[from, to]: [f64; 2]| {
            let is_inside = move |x: &E::Point| (from..=to).contains(&uniform.before(x));
            let mut measure = 0.0;
            for site in 0..quadrature.sites() {
                quadrature.nodes(site, |x, weight| {
                    measure += if is_inside(&x) { weight } else { 0.0 };
                });
            }
            if measure == 0.0 {
                return Err(Error::TooMuch {
                    message: "no point of a diagnosis lies within an arc that is asked for: more `--nodes` help"
                        .to_owned(),
                });
            }
            Ok(move |x: &E::Point| match is_inside(x) {
                true => Density::uniform(measure),
                false => Density::nothing(),
            })
        };
        arcs.map(density).collect()
    }

    /// The spectral radius of T_h²p, which must be below 1; `None` if it is not looked at.
    pub(super) fn check_neighbour(
        &self,
        kinds: Kinds,
        absorption: Absorption,
    ) -> Result<Option<f64>, Error> {
        // With all pairs pointwise h is k, which has been looked at.
        if kinds == Kinds::AllPointwise {
            return Ok(None);
        }
        let poisoned = |_| Error::Internal("another thread has failed");
        let mut radii = self.radii.lock().map_err(poisoned)?;
        let known = radii.iter().find(|known| known.0 == kinds);
        let radius = match known {
            Some(&(_, radius)) => radius,
            None => {
                let equation = self.cut.equation()?;
                let nodes = Nodes::new(&equation, self.cut.points)?;
                let of = Of {
                    equation: &equation,
                    entries: &self.solved.entries,
                    solution: &self.solved.solution,
                };
                let degree = self.cut.of_degree()?;
                let radius = degree.neighbour_radius(&of, &nodes, kinds)?;
                radii.push((kinds, radius));
                radius
            }
        };
        let of = || format!("h² on {} cells (more may help)", self.cut.all);
        fredholm_model::finite::refuse(of, absorption, radius)?;
        Ok(Some(radius))
    }
}

impl<E: CustomEquation<Scalar = f64>> System for CustomSystem<'_, E> {
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        self.cut.check_variance(walk)
    }

    fn job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let (walk, kinds) = (request.walk, self.kinds(request.walk.pairs));
        let is_residual = walk.form == Form::Residual;
        let neighbour_second_moment_radius = if walk.allow_infinite_variance || is_residual {
            None
        } else {
            self.check_neighbour(kinds, walk.absorption)?
        };
        let how = How {
            kinds,
            pointwise: self.cut.pointwise_pairs(walk.pairs)?,
            neighbour_second_moment_radius,
        };
        self.cut.walks()?.job(&self.solved, how, request, then)
    }

    fn examine(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let (absorption, degree) = (request.walk.absorption, self.cut.of_degree()?);
        let equation = &self.cut.equation()?;
        let kinds = self.kinds(request.walk.pairs);
        let quadrature = self.cut.sites(nodes)?;
        let matrix = degree.matrix(equation, &self.solved.entries)?;
        let mean = |i, j| matrix.mean(i, j);
        let cells = self.cut.all;
        let means = MeanCoefficients { cells, mean: &mean };
        let is_constant = degree.functions() == 1;
        let uniform = Uniform::new(equation, None);
        let measure = uniform.measure;
        let everywhere = |_: &E::Point| Density::uniform(measure);
        let arcs = self.arcs(&uniform, &quadrature, request.goals)?;
        // Around a closed curve cells lie in the order of the coordinate, to which their measures are proportional.
        let ends = self.cut.model.about().around.map(|[from, to]| {
            let (mut below, mut ends) = (0.0, vec![from]);
            for cell in 0..cells {
                below += equation.measure(cell);
                ends.push(from + (to - from) * below / measure);
            }
            ends
        });
        let equations = &self.cut.model.equations;
        let last_step = request.walk.last_step;
        let lights = equations.lights.as_deref().filter(|_| last_step);
        let known = |goal: &Goal| Ok(known_of(equation, lights, &goal.region)?.unwrap_or(0.0));
        let known: Vec<f64> = request
            .goals
            .iter()
            .map(known)
            .collect::<Result<_, Error>>()?;
        let lit = Lit { equation, lights };
        let how = (kinds, last_step);
        equations.with_neighbour(equation, &self.solved, how, &mut |neighbour, v| {
            let weighted = equations.weighted(&uniform, request.goals, Some((degree, v)))?;
            let density = |weight| {
                let weight: &super::walk::Weighted<'_, E> = weight;
                move |x: &E::Point| {
                    let phi = weight.weight(x) * measure;
                    let start = neighbour.locate(*x);
                    let value = weight.control_estimate(&start, phi, neighbour.value(&start));
                    Density {
                        functional: phi / measure,
                        square: phi * phi / measure,
                        initial: 1.0 / measure,
                        fluctuation: value - weight.of_means,
                        known: lights.map_or(0.0, |lights| phi * lights.known(equation, x)),
                    }
                }
            };
            let densities: Vec<_> = weighted.iter().map(density).collect();
            let mut weights = densities.iter();
            let mut arcs = arcs.iter();
            let mut starts: Vec<Begin<'_, E::Point>> = Vec::new();
            for goal in request.goals {
                starts.push(match &goal.region {
                    Region::Point(x) => Begin::At(place(equation, x)?),
                    region if is_weight(region) => match weights.next() {
                        Some(density) => Begin::Density(density),
                        None => return Err(Error::Internal("a weight has no means")),
                    },
                    Region::Arc(..) => match arcs.next() {
                        Some(density) => Begin::Density(density),
                        None => return Err(Error::Internal("an arc has no density")),
                    },
                    _ => Begin::Density(&everywhere),
                });
            }
            let setting = VarianceSetup {
                equation: &lit,
                neighbour,
                pairs: kinds.any(degree.pairs().paper),
                quadrature: &quadrature,
                absorption,
            };
            then(&Examined {
                model: &setting.with_starts(&starts)?,
                coefficients: is_constant.then_some(means),
                pieces: None,
                goals: request.goals,
                known: &known,
                place: &|site| {
                    let x = quadrature.inside(site);
                    if let Some(position) = &equations.positions {
                        return part_of(
                            &position.position(&x).coordinates,
                            &self.cut.model.coordinates,
                        );
                    }
                    let cell = neighbour.locate(x).cell;
                    group(cell, cells, ends.as_deref())
                },
            })
        })
    }

    fn lift<'s>(mut self: Box<Self>, degree: usize) -> Result<Box<dyn System + 's>, Error>
    where
        Self: 's,
    {
        let equation = self.cut.equation()?;
        let of_degree = self.cut.of_degree()?;
        let v = &self.solved.solution.v;
        let value = |x: &Located<E::Point>| of_degree.on_cells().series(&equation, v, x);
        let size = fredholm_model::numbers::largest(v);
        let lifted = Lifted::new(&equation, self.cut.degree, &value, (size, degree))?;
        self.solved.lifted = Some(lifted);
        Ok(self)
    }

    fn whole<'s>(self: Box<Self>) -> Result<Box<dyn GlobalSystem<'s> + 's>, Error>
    where
        Self: 's,
    {
        Ok(Box::new(CustomWhole::new(*self)?))
    }

    fn saved(&self) -> Option<SavedSystem<'_>> {
        let Solved {
            solution, entries, ..
        } = &self.solved;
        Some(SavedSystem::new(solution, entries))
    }

    fn tables(&self, pairs: Pairs) -> Result<TableBuilder, Error> {
        in_scalar!(self.cut.scalar, F => self.tables_in::<F>(pairs))
    }
}

impl<E: CustomEquation<Scalar = f64>> CustomSystem<'_, E> {
    /// The tables of a device: kernel, source and chain are for the device to know.
    fn tables_in<F: Real + Number>(&self, pairs: Pairs) -> Result<TableBuilder, Error> {
        let (solved, kinds) = (&self.solved, self.kinds(pairs));
        let refuse = |message: &str| {
            let message = message.to_owned();
            Err(Error::Option {
                subject: Subject::Problem,
                message,
            })
        };
        if self.cut.is_closed() {
            return refuse(
                "a device computes coefficients in closed form by itself: there are no tables of them",
            );
        }
        if solved.lifted.is_some() {
            return Err(Error::Internal("tables have no lift"));
        }
        self.check_neighbour(kinds, Absorption::Roulette)?;
        let (equation, degree) = (self.cut.equation()?, self.cut.of_degree()?);
        let matrix = degree.matrix(&equation, &solved.entries)?;
        let any = kinds.any(degree.pairs().paper);
        let g = solved.solution.source(&*matrix, &any)?;
        let v = solved.solution.rounded::<F>()?;
        let mut tables = TableBuilder::new(self.cut.model.name);
        tables.numbers("axes", &[E::DIMENSION as u32, self.cut.asked as u32]);
        tables.numbers("degree", &[self.cut.degree as u32]);
        if solved.entries.len() == self.cut.unknowns().pow(2) {
            add_dense::<F>(&mut tables, &solved.entries, degree.functions());
        } else {
            // Products are rounded, not factors, so that the walks are the library's own.
            tables.numbers("factors", &solved.entries);
        }
        tables.numbers("v", &v);
        tables.numbers::<F>("source", &g);
        let rule = match any {
            AnyPairs::Diagonal(rule) => Some(rule),
            _ => None,
        };
        PairRule::of(rule).add_to(&mut tables);
        Ok(tables)
    }
}

/// The part of every axis in which a point lies, for people: an eighth of it in one dimension, a quarter in two and half of it in more.
fn part_of(x: &[f64], intervals: &[[f64; 2]]) -> String {
    let parts = match intervals.len() {
        1 => 8.0,
        2 => 4.0,
        _ => 2.0,
    };
    let part = |(x, [low, high]): (&f64, &[f64; 2])| {
        if !(high - low).is_finite() {
            return format!("near {x:.2}");
        }
        let number = ((x - low) / (high - low) * parts)
            .floor()
            .clamp(0.0, parts - 1.0);
        let [from, to] = [number, number + 1.0].map(|end| low + (high - low) * (end / parts));
        format!("[{from}, {to}]")
    };
    let places: Vec<String> = x.iter().zip(intervals).map(part).collect();
    places.join(" × ")
}

/// The neighbouring cells with which a cell is summed, for people: where a coordinate has them, by the ends of all cells.
fn group(cell: usize, cells: usize, ends: Option<&[f64]>) -> String {
    let width = cells.div_ceil(PLACES).max(1);
    let first = cell / width * width;
    let last = (first + width).min(cells) - 1;
    match ends.and_then(|ends| ends.get(first..last + 2)) {
        Some([from, .., to]) => format!("[{from:.2}, {to:.2}]"),
        _ if last > first => format!("cells {first} to {last}"),
        _ => format!("cell {first}"),
    }
}
