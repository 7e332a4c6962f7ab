//! v and c from steps that are kept.

use alloc::vec::Vec;

use super::SampledTables;
use super::control::{Given, advance, power, spread};
use super::events::{NoEvents, SampledStep, StepEvents};
use super::fit::{Fit, NO_EVENT, Step, inverse};
use crate::galerkin::{Basis, Cells, Convergence, GalerkinError, buffer, reserve, rounded};
use crate::{
    DefaultGenerator, Equation, Located, Real, RngUniforms, Space, Uniforms, Value, WalkSeeds,
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

/// v and c of an equation, in f64, from steps of its chain.
///
/// v is piecewise the least-squares fit of T_k v + F in the points of which the steps are kept, by Gauss–Seidel sweeps over
/// the cells; then c is fitted to k v(y) cell by cell and box by box.
#[derive(Clone, Debug)]
pub struct SampledSolution {
    v: Vec<f64>,
    control: Vec<f64>,
    shape: Shape,
    convergence: Convergence<f64>,
}

/// The sizes of tables.
#[derive(Clone, Copy, Debug)]
struct Shape {
    channels: usize,
    per_axis: u32,
    /// m^D.
    boxes: usize,
    /// Events of a cell.
    slots: usize,
    /// B.
    functions: usize,
    /// D.
    numbers: usize,
}

impl Shape {
    /// The numbers of all boxes of a cell: B + D of each, for every channel.
    const fn of_boxes(&self) -> usize {
        self.boxes * self.channels * (self.functions + self.numbers)
    }

    /// The numbers of an event of a cell: its own, and B for every channel.
    const fn of_slot(&self) -> usize {
        1 + self.channels * self.functions
    }

    /// The numbers of c on a cell.
    const fn of_cell(&self) -> usize {
        self.of_boxes() + self.slots * self.of_slot()
    }
}

/// A kept step: the cell to which it led, and k ψ_b there. Single precision, as it serves a fit.
#[derive(Clone, Copy, Debug)]
struct Kept<const B: usize> {
    cell: u32,
    values: [f32; B],
}

/// In place of a cell where a step left.
const LEFT: u32 = u32::MAX;

impl<const B: usize> Kept<B> {
    /// k v of the step.
    fn value(&self, v: &[f64]) -> f64 {
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

/// ψ of a point of a cell, and the cell to which a step from there led with k ψ_b there; `None`: it left.
type Sample<const B: usize> = ([f64; B], Option<(usize, [f64; B])>);

/// The row of a channel in the Galerkin system: its source, and what the blocks of the steps are multiplied by.
#[derive(Clone, Copy, Debug)]
struct Row<const B: usize> {
    source: [f64; B],
    factor: f64,
}

/// The steps from one cell, and the rows of the Galerkin system that follow from them.
///
/// Channels differ in the size of the kernel alone, which is the same on all of a cell: one of them is kept, and their ratios to it.
#[derive(Clone, Debug)]
pub struct CellSteps<const B: usize> {
    kept: Vec<Kept<B>>,
    blocks: Vec<Block<B>>,
    rows: Vec<Row<B>>,
}

/// v of every channel, and how their iterations ended.
#[derive(Clone, Debug)]
pub struct SolvedSteps {
    /// v of channel after channel.
    solved: Vec<Vec<f64>>,
    /// The sum of all channels of v, each over its size: what events are chosen by.
    sum: Vec<f64>,
    convergence: Convergence<f64>,
}

impl SolvedSteps {
    /// v_ia of a channel.
    #[must_use]
    pub fn v(&self, channel: usize) -> &[f64] {
        self.solved.get(channel).map_or(&[], Vec::as_slice)
    }
}

/// Numbers that steps draw beside those of the even sequence.
type Draws = RngUniforms<DefaultGenerator>;

/// What is done with a point of a cell and the ω of a step from there.
type Each<'a, P, const D: usize> = dyn FnMut(Located<P>, [f64; D], &mut Draws) + 'a;

/// Calls `each` with the points of a cell from which steps are kept, the ω of these steps, and what they draw beyond that: an
/// even sequence in t and ω together, shifted at random.
fn points<P, const D: usize>(
    problem: &P,
    cell: usize,
    options: &SetupOptions,
    each: &mut Each<'_, P::Point, D>,
) -> Result<(), GalerkinError>
where
    P: Cells + Space<Scalar = f64>,
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

/// The number in place of a goal's that draws of a set-up have: those of no goal, and of no global estimate.
const SETUP: u64 = u64::MAX - 1;

/// A set-up from steps, in its parts: what concerns one cell may be done for all of them side by side.
///
/// [`solve_all`](Self::solve_all) does all of it, one cell after the other.
pub struct SampledSetup<'a, E, const D: usize, const B: usize, V = NoEvents<E>> {
    /// The equation with cells and functions on them: the problem itself, or its [`LastStep`](crate::LastStep).
    pub equation: &'a E,
    /// Events of the equation's steps, which c may have beside boxes.
    pub events: &'a V,
    /// Options of the set-up.
    pub options: SetupOptions,
}

// By hand: a derive would ask the equation to be `Debug`.
impl<E, const D: usize, const B: usize, V> core::fmt::Debug for SampledSetup<'_, E, D, B, V> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("SampledSetup")
            .field("options", &self.options)
            .finish_non_exhaustive()
    }
}

impl<E, V, const D: usize, const B: usize> SampledSetup<'_, E, D, B, V>
where
    E: Equation<Scalar = f64> + Basis<B>,
    V: StepEvents<D, Scalar = f64, Point = E::Point>,
{
    /// Takes the steps from a cell.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn steps(&self, cell: usize) -> Result<CellSteps<B>, GalerkinError> {
        let (equation, channels) = (self.equation, self.equation.channels());
        let mut own: Vec<Sample<B>> = reserve(self.options.samples)?;
        let mut gram = [[0.0; B]; B];
        let mut sources: Vec<[f64; B]> = reserve(channels)?;
        sources.resize(channels, [0.0; B]);
        // The ratios of all channels to the one with the largest kernel.
        let mut ratios: Option<(usize, E::Value)> = None;
        points::<E, D>(equation, cell, &self.options, &mut |x, omega, draws| {
            let psi = equation.basis(&x);
            let step = equation.step(&x.point, &mut Given::new(omega, &mut *draws));
            let to = step.map(|point| {
                let k = equation.kernel(&x.point, &point);
                let kept = ratios.map_or(0, |(channel, _)| channel);
                let k = match ratios {
                    None if k.largest() > 0.0 => {
                        let all = 0..channels;
                        let size = |c: &usize| k.get(*c).abs();
                        let most = all.max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(0);
                        ratios = Some((most, k.scaled(1.0 / k.get(most))));
                        k.get(most)
                    }
                    _ => k.get(kept),
                };
                let cell = equation.locate(&point);
                let psi = equation.basis(&Located { point, cell });
                (cell, psi.map(|psi| k * psi))
            });
            let source = equation.source(&x.point, draws);
            for (a, row) in gram.iter_mut().enumerate() {
                for (entry, other) in row.iter_mut().zip(psi) {
                    *entry += psi[a] * other;
                }
            }
            for (channel, sum) in sources.iter_mut().enumerate() {
                for (sum, psi) in sum.iter_mut().zip(psi) {
                    *sum += psi * source.get(channel);
                }
            }
            own.push((psi, to));
        })?;
        let inverse = inverse(gram);
        let mut kept = reserve(own.len())?;
        kept.extend(own.iter().map(keep));
        let mut rows = reserve(channels)?;
        rows.extend(sources.iter().enumerate().map(|(channel, source)| Row {
            source: times(&inverse, source),
            factor: ratios.map_or(0.0, |(_, ratios)| ratios.get(channel)),
        }));
        Ok(CellSteps {
            kept,
            blocks: row(&mut own, &inverse)?,
            rows,
        })
    }

    /// v_ia of every channel from the steps of all cells, by Gauss–Seidel sweeps until v changes little.
    ///
    /// # Errors
    /// [`GalerkinError::Length`]: not those of all cells; [`GalerkinError::Diverges`]: the equation is no contraction.
    pub fn solve(&self, steps: &[CellSteps<B>]) -> Result<SolvedSteps, GalerkinError> {
        let (expected, found) = (self.equation.cells(), steps.len());
        if found != expected {
            return Err(GalerkinError::Length { expected, found });
        }
        let channels = self.equation.channels();
        let mut all = SolvedSteps {
            solved: reserve(channels)?,
            sum: buffer(steps.len().saturating_mul(B))?,
            convergence: Convergence {
                sweeps: 0,
                residual: 0.0,
            },
        };
        for channel in 0..channels {
            let none = Row {
                source: [f64::NAN; B],
                factor: f64::NAN,
            };
            let (v, convergence) = self.solve_rows(steps, &|cell| {
                let row = steps.get(cell).and_then(|own| own.rows.get(channel));
                row.copied().unwrap_or(none)
            })?;
            let squares: f64 = v.iter().map(|v| v * v).sum();
            if squares > 0.0 {
                let per_size = 1.0 / Real::sqrt(squares);
                let sums = all.sum.iter_mut().zip(&v);
                sums.for_each(|(sum, v)| *sum += per_size * v);
            }
            all.convergence.sweeps = all.convergence.sweeps.max(convergence.sweeps);
            all.convergence.residual = all.convergence.residual.max(convergence.residual);
            all.solved.push(v);
        }
        Ok(all)
    }

    /// v_ia of one channel's rows.
    fn solve_rows(
        &self,
        steps: &[CellSteps<B>],
        rows: &dyn Fn(usize) -> Row<B>,
    ) -> Result<(Vec<f64>, Convergence<f64>), GalerkinError> {
        let mut v = reserve(steps.len().saturating_mul(B))?;
        v.extend((0..steps.len()).flat_map(|cell| rows(cell).source));
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

    /// c of a cell, of v and the steps from there: B + D coefficients for every box and channel, then for every event its number, or −1
    /// for none, and B coefficients for every channel. All channels have the same events: those that serve the sum of all v,
    /// each over its size.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn control(
        &self,
        cell: usize,
        steps: &CellSteps<B>,
        solved: &SolvedSteps,
    ) -> Result<Vec<f64>, GalerkinError> {
        let (shape, channels) = (self.shape(), solved.solved.len());
        let candidates = self.candidates(steps, &solved.sum)?;
        // The last v that is fitted chooses the events.
        let fitted = channels + usize::from(channels > 1);
        let mut fit = Fit::new::<D, B>(shape.per_axis, &candidates, fitted)?;
        let mut kept = steps.kept.iter();
        let mut values: Vec<f64> = buffer(fitted)?;
        points::<E, D>(self.equation, cell, &self.options, &mut |x, omega, _| {
            let step = SampledStep {
                from: &x.point,
                omega: &omega,
                to: None,
            };
            match kept.next() {
                Some(kept) => {
                    if let Some(sum) = values.last_mut() {
                        *sum = kept.value(&solved.sum);
                    }
                    let all = solved.solved.iter().zip(&steps.rows);
                    for (value, (v, row)) in values.iter_mut().zip(all) {
                        *value = row.factor * kept.value(v);
                    }
                }
                None => values.fill(f64::NAN),
            }
            fit.add(&Step {
                psi: &self.equation.basis(&x),
                omega: &omega,
                values: &values,
                occurring: self.events.occurring(&step, &candidates),
            });
        })?;
        let of_channel = shape.boxes * (B + D);
        let mut controls: Vec<Vec<f64>> = reserve(channels)?;
        for _ in 0..channels {
            controls.push(buffer(of_channel + shape.slots * (1 + B))?);
        }
        fit.solve(&mut controls)?;
        // From channel by channel to side by side.
        let mut all = reserve(shape.of_cell())?;
        for from in (0..of_channel).step_by(B + D) {
            for control in &controls {
                all.extend_from_slice(control.get(from..from + B + D).unwrap_or(&[]));
            }
        }
        for slot in 0..shape.slots {
            let from = of_channel + slot * (1 + B);
            let own = |control: &Vec<f64>| control.get(from..from + 1 + B).map(<[f64]>::to_vec);
            all.extend(
                controls
                    .first()
                    .and_then(own)
                    .and_then(|own| own.first().copied()),
            );
            for own in controls.iter().filter_map(own) {
                all.extend(own.iter().skip(1));
            }
        }
        Ok(all)
    }

    /// The events among which c chooses: those towards cells from which steps bring what differs most from the mean.
    fn candidates(&self, steps: &CellSteps<B>, v: &[f64]) -> Result<Vec<u32>, GalerkinError> {
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

    fn shape(&self) -> Shape {
        let SetupOptions {
            per_axis, samples, ..
        } = self.options;
        let per_axis = per_axis.unwrap_or_else(|| boxes(samples / (4 * (B + D)), D));
        Shape {
            channels: self.equation.channels(),
            per_axis,
            boxes: power::<D>(per_axis),
            slots: self.options.events.min(32),
            functions: B,
            numbers: D,
        }
    }

    /// The number of coefficients of c on a cell.
    #[must_use]
    pub fn coefficients(&self) -> usize {
        self.shape().of_cell()
    }

    /// The solution of all parts: v, and c of all cells, one after the other.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn solution(
        &self,
        solved: &SolvedSteps,
        control: Vec<f64>,
    ) -> Result<SampledSolution, GalerkinError> {
        let mut v = reserve(solved.sum.len().saturating_mul(solved.solved.len()))?;
        for from in (0..solved.sum.len()).step_by(B) {
            for own in &solved.solved {
                v.extend_from_slice(own.get(from..from + B).unwrap_or(&[]));
            }
        }
        Ok(SampledSolution {
            v,
            control,
            shape: self.shape(),
            convergence: solved.convergence,
        })
    }

    /// Steps from all cells, v, and c, one cell after the other.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`]; [`GalerkinError::Diverges`]: the equation is no contraction.
    pub fn solve_all(&self) -> Result<SampledSolution, GalerkinError> {
        let cells = self.equation.cells();
        let mut steps = reserve(cells)?;
        for cell in 0..cells {
            steps.push(self.steps(cell)?);
        }
        let solved = self.solve(&steps)?;
        let mut control = reserve(cells.saturating_mul(self.coefficients()))?;
        for (cell, steps) in steps.iter().enumerate() {
            control.extend(self.control(cell, steps, &solved)?);
        }
        self.solution(&solved, control)
    }

    /// A solution from what [`SampledSolution::v`] and [`SampledSolution::control`] gave of one with the same options.
    ///
    /// # Errors
    /// [`GalerkinError::Length`]: they are of other cells, functions, channels or options.
    pub fn restore(
        &self,
        v: Vec<f64>,
        control: Vec<f64>,
        convergence: Convergence<f64>,
    ) -> Result<SampledSolution, GalerkinError> {
        let (cells, shape) = (self.equation.cells(), self.shape());
        for (found, of_cell) in [
            (v.len(), shape.channels * B),
            (control.len(), shape.of_cell()),
        ] {
            let expected = cells.saturating_mul(of_cell);
            if found != expected {
                return Err(GalerkinError::Length { expected, found });
            }
        }
        Ok(SampledSolution {
            v,
            control,
            shape,
            convergence,
        })
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

/// The blocks of a row: Σ of N⁻¹ψ(x) kψ(y)ᵀ over the steps that lead to the same cell.
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
    rows: &dyn Fn(usize) -> Row<B>,
    v: &mut [f64],
) -> [f64; 2] {
    let (mut change, mut size) = (0.0, 0.0);
    for (number, row) in steps.iter().enumerate() {
        let Row {
            source: mut new,
            factor,
        } = rows(number);
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

fn times<const B: usize>(matrix: &[[f64; B]; B], vector: &[f64; B]) -> [f64; B] {
    matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
}

impl SampledSolution {
    /// v_ia: B numbers of every channel, cell by cell.
    #[must_use]
    pub fn v(&self) -> &[f64] {
        &self.v
    }

    /// c: of every cell the B + D coefficients of every box and channel, and of every event its number and B coefficients for every channel,
    /// in this order.
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
        let Shape {
            channels,
            boxes,
            slots,
            functions,
            numbers,
            ..
        } = self.shape;
        let (coefficients, of_boxes) = (functions + numbers, self.shape.of_boxes());
        let cells = self.control.len() / self.shape.of_cell().max(1);
        let mut control: Vec<F> = reserve(cells * of_boxes)?;
        let mut events = reserve(cells * slots)?;
        let mut of_events = reserve(cells * slots * channels * functions)?;
        let mut integral = reserve(self.v.len())?;
        for own in self.control.chunks_exact(self.shape.of_cell().max(1)) {
            let (boxes_of_cell, of_slots) = own.split_at(of_boxes);
            control.extend(boxes_of_cell.iter().map(|&c| F::from_f64(c)));
            let own = control.get(control.len() - of_boxes..).unwrap_or(&[]);
            for channel in 0..channels {
                for a in 0..functions {
                    let first = channel * coefficients + a;
                    let of_x = own.iter().skip(first).step_by(channels * coefficients);
                    let sum: f64 = of_x.map(|c| c.to_f64()).sum();
                    integral.push(F::from_f64(sum / boxes as f64));
                }
            }
            for slot in of_slots.chunks_exact(self.shape.of_slot()) {
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
            per_axis: self.shape.per_axis,
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
