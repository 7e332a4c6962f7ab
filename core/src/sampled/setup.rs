//! v and c from steps that are kept.

use alloc::vec::Vec;

use super::SampledTables;
use super::control::{Given, advance, power, spread};
use super::events::{NoEvents, SampledStep, StepEvents};
use super::fit::{Fit, NO_EVENT, Step, inverse};
use crate::galerkin::{Basis, CellMap, Convergence, GalerkinError, buffer, reserve, rounded};
use crate::{
    DefaultGenerator, Kernel, Located, RandomSource, Real, RngUniforms, Sampler, StateSpace,
    Uniforms, WalkSeeds,
};

/// Options of a set-up from steps.
///
/// ```
/// use fredholm_core::sampled::SetupOptions;
///
/// let options = SetupOptions { samples: 1024, ..SetupOptions::default() };
/// assert_eq!(options.seed, 1);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetupOptions {
    /// Steps from every cell, which are kept: the more, the nearer are v and c to what they approximate.
    pub samples: usize,
    /// m, the boxes of steps along an axis; `None`: as many as leave four steps for every coefficient of c.
    pub per_axis: Option<u32>,
    /// Most events that c has in a cell, 32 at most.
    pub events: usize,
    /// The relative change of v by a sweep at which the iteration stops. What is left costs variance and nothing else.
    pub tolerance: f64,
    /// Most sweeps of the iteration.
    pub sweeps: u32,
    /// The seed of points and steps.
    pub seed: u64,
}

impl Default for SetupOptions {
    /// 2048 steps, eight events, a change of 10⁻⁶ or 1000 sweeps, seed 1.
    fn default() -> Self {
        Self {
            samples: 2048,
            per_axis: None,
            events: 8,
            tolerance: 1e-6,
            sweeps: 1000,
            seed: 1,
        }
    }
}

/// v and c of an equation, in f64, from steps of its sampler.
///
/// v is piecewise the least-squares fit of T_k v + F in the points of which the steps are kept, by Gauss–Seidel sweeps over
/// the cells; then c is fitted to κ v(y) cell by cell and box by box.
#[derive(Clone, Debug)]
pub struct SampledSolution {
    v: Vec<f64>,
    control: Vec<f64>,
    per_axis: u32,
    /// Events of a cell.
    events: usize,
    functions: usize,
    numbers: usize,
    convergence: Convergence<f64>,
}

/// A kept step: the cell to which it led, and κ ψ_b there. Single precision, as it serves a fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kept<const B: usize> {
    cell: u32,
    values: [f32; B],
}

/// In place of a cell where a step left.
const LEFT: u32 = u32::MAX;

impl<const B: usize> Kept<B> {
    /// κ v of the step.
    pub(super) fn value(&self, v: &[f64]) -> f64 {
        if self.cell == LEFT {
            return 0.0;
        }
        let v: [f64; B] = block(v, self.cell as usize);
        let terms = self.values.iter().zip(v);
        terms.map(|(&value, v)| f64::from(value) * v).sum()
    }
}

/// A block of the Galerkin matrix that the steps give.
#[derive(Clone, Copy, Debug)]
struct Block<const B: usize> {
    cell: u32,
    entries: [[f64; B]; B],
}

/// ψ of a point of a cell, and the cell to which a step from there led with κ ψ_b there; `None`: it left.
type Sample<const B: usize> = ([f64; B], Option<(usize, [f64; B])>);

/// The steps from one cell, and the rows of the Galerkin system that follow from them.
#[derive(Clone, Debug)]
pub struct CellSteps<const B: usize> {
    kept: Vec<Kept<B>>,
    blocks: Vec<Block<B>>,
    source: [f64; B],
}

/// Numbers that steps draw besides those of the even sequence.
pub(super) type Draws = RngUniforms<DefaultGenerator>;

/// What is done with a point of a cell and the ω of a step from there.
pub(super) type Each<'a, P, const D: usize> = dyn FnMut(Located<P>, [f64; D], &mut Draws) + 'a;

/// Calls `each` with the points of a cell from which steps are kept, the ω of these steps, and what they draw besides: an
/// even sequence in t and ω together, shifted at random.
pub(super) fn points<P, const D: usize>(
    problem: &P,
    cell: usize,
    options: &SetupOptions,
    each: &mut Each<'_, P::Point, D>,
) -> Result<(), GalerkinError>
where
    P: CellMap + StateSpace<Scalar = f64>,
{
    let axes = P::DIMENSION + D;
    let seeds = WalkSeeds::<DefaultGenerator>::new(options.seed, SETUP);
    let mut draws = RngUniforms(seeds.generator(cell as u64));
    let mut by = buffer(axes)?;
    spread(&mut by);
    let mut at: Vec<f64> = buffer(axes)?;
    at.fill_with(|| draws.uniform());
    for _ in 0..options.samples {
        advance(&mut at, &by);
        let (t, omega) = at.split_at(P::DIMENSION);
        let omega = omega.first_chunk::<D>().copied().unwrap_or([f64::NAN; D]);
        let point = problem.point(cell, t);
        each(Located { point, cell }, omega, &mut draws);
    }
    Ok(())
}

/// The number in place of a goal's that draws of a set-up have: those of no goal, and of no whole function.
const SETUP: u64 = u64::MAX - 1;

/// A set-up from steps, in its parts: what concerns one cell may be done for all of them side by side.
///
/// [`SampledSolution::new`] does all of it, one cell after the other.
pub struct SampledSetup<'a, P, S, const D: usize, const B: usize, E = NoEvents<P>> {
    /// The equation's chain and kernel, with cells and functions on them.
    pub problem: &'a P,
    /// What v's equation has as F: the problem itself, or its [`LastStep`](crate::LastStep).
    pub source: &'a S,
    /// Events of the equation's steps, which c may have besides boxes.
    pub events: &'a E,
    /// Options of the set-up.
    pub options: SetupOptions,
}

// By hand: a derive would ask the problem to be `Debug`.
impl<P, S, const D: usize, const B: usize, E> core::fmt::Debug for SampledSetup<'_, P, S, D, B, E> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("SampledSetup")
            .field("options", &self.options)
            .finish_non_exhaustive()
    }
}

impl<P, S, const D: usize, const B: usize, E> SampledSetup<'_, P, S, D, B, E>
where
    P: Sampler + Kernel + Basis<B> + CellMap + StateSpace<Scalar = f64>,
    S: RandomSource + StateSpace<Scalar = f64, Point = P::Point>,
    E: StepEvents<D, Scalar = f64, Point = P::Point>,
{
    /// Takes the steps from a cell.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn steps(&self, cell: usize) -> Result<CellSteps<B>, GalerkinError> {
        let problem = self.problem;
        let mut own: Vec<Sample<B>> = reserve(self.options.samples)?;
        let mut gram = [[0.0; B]; B];
        let mut source = [0.0; B];
        points::<P, D>(problem, cell, &self.options, &mut |x, omega, draws| {
            let psi = problem.basis(&x);
            let survival = 1.0 - problem.absorption(&x.point);
            let step = problem.step(&x.point, &mut Given::new(omega, &mut *draws));
            let to = step.map(|point| {
                let kappa = survival * problem.kernel(&x.point, &point);
                let cell = problem.locate(&point);
                let psi = problem.basis(&Located { point, cell });
                (cell, psi.map(|psi| kappa * psi))
            });
            let own_source = self.source.sample_source(&x.point, draws);
            for (a, row) in gram.iter_mut().enumerate() {
                for (entry, other) in row.iter_mut().zip(psi) {
                    *entry += psi[a] * other;
                }
                source[a] += psi[a] * own_source;
            }
            own.push((psi, to));
        })?;
        let inverse = inverse(gram);
        let mut kept = reserve(own.len())?;
        kept.extend(own.iter().map(keep));
        Ok(CellSteps {
            kept,
            blocks: row(&mut own, &inverse)?,
            source: times(&inverse, &source),
        })
    }

    /// v_ia from the steps of all cells, by Gauss–Seidel sweeps until v changes little.
    ///
    /// # Errors
    /// [`GalerkinError::Length`]: not those of all cells; [`GalerkinError::Diverges`]: the equation is no contraction.
    pub fn solve(
        &self,
        steps: &[CellSteps<B>],
    ) -> Result<(Vec<f64>, Convergence<f64>), GalerkinError> {
        self.solve_rows(steps, &|cell| {
            let own = steps.get(cell);
            (own.map_or([f64::NAN; B], |own| own.source), 1.0)
        })
    }

    /// v_ia of rows, each with its source and what its blocks are multiplied by.
    pub(super) fn solve_rows(
        &self,
        steps: &[CellSteps<B>],
        rows: &dyn Fn(usize) -> ([f64; B], f64),
    ) -> Result<(Vec<f64>, Convergence<f64>), GalerkinError> {
        let (expected, found) = (self.problem.cells(), steps.len());
        if found != expected {
            return Err(GalerkinError::Length { expected, found });
        }
        let mut v = reserve(steps.len().saturating_mul(B))?;
        v.extend((0..steps.len()).flat_map(|cell| rows(cell).0));
        let mut convergence = Convergence {
            sweeps: 0,
            residual: 0.0,
        };
        let mut first = None;
        while convergence.sweeps < self.options.sweeps {
            let [change, size] = sweep(steps, rows, &mut v);
            convergence.sweeps += 1;
            convergence.residual = if size > 0.0 {
                Real::sqrt(change / size)
            } else {
                0.0
            };
            let first = *first.get_or_insert(convergence.residual);
            // Written so that NaN fails.
            if !(convergence.residual <= 1e6 * (1.0 + first)) || !size.is_finite() {
                return Err(GalerkinError::Diverges {
                    sweep: convergence.sweeps,
                });
            }
            if convergence.residual <= self.options.tolerance {
                break;
            }
        }
        Ok((v, convergence))
    }

    /// c of a cell, of v and the steps from there: B + D coefficients for every box, then for every event its number, or −1
    /// for none, and B coefficients.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn control(
        &self,
        cell: usize,
        steps: &CellSteps<B>,
        v: &[f64],
    ) -> Result<Vec<f64>, GalerkinError> {
        let candidates = self.candidates(steps, v)?;
        let value = |kept: &Kept<B>, values: &mut [f64]| values.fill(kept.value(v));
        let mut fit = self.fit(cell, steps, (&candidates, 1), &value)?;
        let mut control = [buffer(self.coefficients())?];
        fit.solve(&mut control)?;
        let [control] = control;
        Ok(control)
    }

    /// The fit of so many c to what steps are worth, among these events.
    pub(super) fn fit<'e>(
        &self,
        cell: usize,
        steps: &CellSteps<B>,
        (events, fitted): (&'e [u32], usize),
        values: &dyn Fn(&Kept<B>, &mut [f64]),
    ) -> Result<Fit<'e>, GalerkinError> {
        let mut fit = Fit::new::<D, B>(self.per_axis(), events, fitted)?;
        let mut kept = steps.kept.iter();
        let mut own: Vec<f64> = buffer(fitted)?;
        points::<P, D>(self.problem, cell, &self.options, &mut |x, omega, _| {
            let step = SampledStep {
                from: &x.point,
                omega: &omega,
                to: None,
            };
            match kept.next() {
                Some(kept) => values(kept, &mut own),
                None => own.fill(f64::NAN),
            }
            fit.add(&Step {
                psi: &self.problem.basis(&x),
                omega: &omega,
                values: &own,
                occurring: self.events.occurring(&step, events),
            });
        })?;
        Ok(fit)
    }

    /// The events among which c chooses: those towards cells from which steps bring what differs most from the mean.
    pub(super) fn candidates(
        &self,
        steps: &CellSteps<B>,
        v: &[f64],
    ) -> Result<Vec<u32>, GalerkinError> {
        let most = self.options.events.min(32);
        if most == 0 {
            return Ok(Vec::new());
        }
        let mut groups: Vec<(u32, f64, f64)> = reserve(steps.kept.len())?;
        let (mut sum, mut count) = (0.0, 0.0);
        for kept in &steps.kept {
            let value = kept.value(v);
            sum += value;
            count += 1.0;
            let towards = self.events.towards(kept.cell as usize);
            groups.extend(towards.map(|event| (event, 1.0, value)));
        }
        groups.sort_by_key(|&(event, ..)| event);
        groups.dedup_by(|next, group| {
            let is_same = next.0 == group.0;
            if is_same {
                group.1 += next.1;
                group.2 += next.2;
            }
            is_same
        });
        let mean = sum / count;
        let merit = |&(_, n, sum): &(u32, f64, f64)| n * (sum / n - mean) * (sum / n - mean);
        groups.sort_by(|a, b| merit(b).total_cmp(&merit(a)));
        groups.truncate((2 * most).min(32));
        let mut candidates = reserve(groups.len())?;
        candidates.extend(groups.iter().map(|&(event, ..)| event));
        Ok(candidates)
    }

    /// The number of coefficients of c on a cell: B + D of each box, 1 + B of each event.
    #[must_use]
    pub fn coefficients(&self) -> usize {
        power::<D>(self.per_axis()) * (B + D) + self.options.events.min(32) * (1 + B)
    }

    /// m.
    fn per_axis(&self) -> u32 {
        let SetupOptions {
            per_axis, samples, ..
        } = self.options;
        per_axis.unwrap_or_else(|| boxes(samples / (4 * (B + D)), D))
    }

    /// The solution of all parts: v and c of all cells, one after the other.
    #[must_use]
    pub fn solution(
        &self,
        (v, convergence): (Vec<f64>, Convergence<f64>),
        control: Vec<f64>,
    ) -> SampledSolution {
        SampledSolution {
            v,
            control,
            per_axis: self.per_axis(),
            events: self.options.events.min(32),
            functions: B,
            numbers: D,
            convergence,
        }
    }
}

/// What of a step is kept for the fit of c.
fn keep<const B: usize>((_, to): &Sample<B>) -> Kept<B> {
    match to {
        Some((cell, values)) => Kept {
            cell: *cell as u32,
            values: values.map(|value| value as f32),
        },
        None => Kept {
            cell: LEFT,
            values: [0.0; B],
        },
    }
}

/// The blocks of a row: Σ of N⁻¹ψ(x) κψ(y)ᵀ over the steps that lead to the same cell.
fn row<const B: usize>(
    own: &mut Vec<Sample<B>>,
    inverse: &[[f64; B]; B],
) -> Result<Vec<Block<B>>, GalerkinError> {
    own.retain(|(_, to)| to.is_some());
    own.sort_by_key(|(_, to)| to.map_or(usize::MAX, |(cell, _)| cell));
    let mut blocks: Vec<Block<B>> = Vec::new();
    for (psi, to) in &*own {
        let Some((cell, values)) = to else { continue };
        let weights = times(inverse, psi);
        let last = blocks.last();
        if last.is_none_or(|block| block.cell as usize != *cell) {
            blocks
                .try_reserve(1)
                .map_err(|_| GalerkinError::Memory { bytes: None })?;
            blocks.push(Block {
                cell: *cell as u32,
                entries: [[0.0; B]; B],
            });
        }
        if let Some(block) = blocks.last_mut() {
            for (row, weight) in block.entries.iter_mut().zip(weights) {
                for (entry, value) in row.iter_mut().zip(values) {
                    *entry += weight * value;
                }
            }
        }
    }
    Ok(blocks)
}

/// One sweep over all cells. Returns the squares of the change of v and of v.
fn sweep<const B: usize>(
    steps: &[CellSteps<B>],
    rows: &dyn Fn(usize) -> ([f64; B], f64),
    v: &mut [f64],
) -> [f64; 2] {
    let (mut change, mut size) = (0.0, 0.0);
    for (number, row) in steps.iter().enumerate() {
        let (mut new, factor) = rows(number);
        for part in &row.blocks {
            let other: [f64; B] = block(v, part.cell as usize);
            for (new, entries) in new.iter_mut().zip(&part.entries) {
                *new += factor * entries.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
            }
        }
        let own = v.get_mut(number * B..);
        if let Some(own) = own.and_then(<[f64]>::first_chunk_mut::<B>) {
            for (own, new) in own.iter().zip(new) {
                change += (own - new) * (own - new);
                size += new * new;
            }
            *own = new;
        }
    }
    [change, size]
}

/// The B numbers of a cell.
fn block<const B: usize>(values: &[f64], cell: usize) -> [f64; B] {
    let own = values.get(cell * B..).and_then(<[f64]>::first_chunk);
    own.copied().unwrap_or([f64::NAN; B])
}

pub(super) fn times<const B: usize>(matrix: &[[f64; B]; B], vector: &[f64; B]) -> [f64; B] {
    matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
}

impl SampledSolution {
    /// Steps from all cells, v, and c.
    ///
    /// `source` is what v's equation has as F: the problem itself, or its [`LastStep`](crate::LastStep).
    ///
    /// # Errors
    /// [`GalerkinError::Memory`]; [`GalerkinError::Diverges`]: the equation is no contraction.
    pub fn new<P, S, const D: usize, const B: usize>(
        problem: &P,
        source: &S,
        options: &SetupOptions,
    ) -> Result<Self, GalerkinError>
    where
        P: Sampler + Kernel + Basis<B> + CellMap + StateSpace<Scalar = f64>,
        S: RandomSource + StateSpace<Scalar = f64, Point = P::Point>,
    {
        let options = SetupOptions {
            events: 0,
            ..*options
        };
        Self::with_events::<P, S, NoEvents<P>, D, B>((problem, &NoEvents::NEW), source, &options)
    }

    /// Steps from all cells, v, and c with events of the steps.
    ///
    /// `source` is what v's equation has as F: the problem itself, or its [`LastStep`](crate::LastStep).
    ///
    /// # Errors
    /// [`GalerkinError::Memory`]; [`GalerkinError::Diverges`]: the equation is no contraction.
    pub fn with_events<P, S, E, const D: usize, const B: usize>(
        (problem, events): (&P, &E),
        source: &S,
        options: &SetupOptions,
    ) -> Result<Self, GalerkinError>
    where
        P: Sampler + Kernel + Basis<B> + CellMap + StateSpace<Scalar = f64>,
        S: RandomSource + StateSpace<Scalar = f64, Point = P::Point>,
        E: StepEvents<D, Scalar = f64, Point = P::Point>,
    {
        let setup = SampledSetup::<P, S, D, B, E> {
            problem,
            source,
            events,
            options: *options,
        };
        let cells = problem.cells();
        let mut steps = reserve(cells)?;
        for cell in 0..cells {
            steps.push(setup.steps(cell)?);
        }
        let solved = setup.solve(&steps)?;
        let per_cell = setup.coefficients();
        let mut control = reserve(cells.saturating_mul(per_cell))?;
        for (cell, steps) in steps.iter().enumerate() {
            control.extend(setup.control(cell, steps, &solved.0)?);
        }
        Ok(setup.solution(solved, control))
    }

    /// v_ia.
    #[must_use]
    pub fn v(&self) -> &[f64] {
        &self.v
    }

    /// c: of every cell the B + D coefficients of every box, and of every event its number and B coefficients, in this order.
    #[must_use]
    pub fn control(&self) -> &[f64] {
        &self.control
    }

    /// How the iteration for v ended; the residual is the relative change of v in the last sweep.
    #[must_use]
    pub const fn convergence(&self) -> Convergence<f64> {
        self.convergence
    }

    /// The tables in the scalar of the walks: v and c are rounded, and C is computed from c as rounded.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn for_walks<F: Real>(&self) -> Result<SampledTables<F>, GalerkinError> {
        let coefficients = self.functions + self.numbers;
        let boxes = (0..self.numbers).fold(1_usize, |n, _| n * self.per_axis as usize);
        let (of_boxes, of_slots) = (boxes * coefficients, self.events * (1 + self.functions));
        let cells = self.control.len() / (of_boxes + of_slots);
        let mut control: Vec<F> = reserve(cells * of_boxes)?;
        let mut events = reserve(cells * self.events)?;
        let mut of_events = reserve(cells * self.events * self.functions)?;
        let mut integral = reserve(self.v.len())?;
        for own in self.control.chunks_exact(of_boxes + of_slots) {
            let (of_boxes, of_slots) = own.split_at(of_boxes);
            control.extend(of_boxes.iter().map(|&c| F::from_f64(c)));
            let own = control.get(control.len() - of_boxes.len()..).unwrap_or(&[]);
            for a in 0..self.functions {
                let of_x = own.iter().skip(a).step_by(coefficients);
                let sum: f64 = of_x.map(|c| c.to_f64()).sum();
                integral.push(F::from_f64(sum / boxes as f64));
            }
            for slot in of_slots.chunks_exact(1 + self.functions) {
                let (&number, own) = slot.split_first().unwrap_or((&NO_EVENT, &[]));
                events.push(if number < 0.0 {
                    u32::MAX
                } else {
                    number as u32
                });
                of_events.extend(own.iter().map(|&c| F::from_f64(c)));
            }
        }
        Ok(SampledTables {
            v: rounded(&self.v)?,
            control,
            integral,
            per_axis: self.per_axis,
            events,
            of_events,
        })
    }
}

/// The largest m with m^D ≤ `most`, at least 1.
fn boxes(most: usize, dimension: usize) -> u32 {
    let mut m = 1_usize;
    let fits = |m: usize| (0..dimension).try_fold(1_usize, |n, _| n.checked_mul(m));
    while m < 1 << 12 && fits(m + 1).is_some_and(|n| n <= most) {
        m += 1;
    }
    m as u32
}
