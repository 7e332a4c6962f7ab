//! Tables of the control variates of several channels, from the rays of one set-up.

use alloc::vec::Vec;

use fredholm_core::channels::MOST_CHANNELS;
use fredholm_core::galerkin::{Basis, GalerkinError, Partition, buffer, reserve};
use fredholm_core::{Located, Real};

use crate::ray_boxes::{Builder, CellChannelRays, CellRays};
use crate::ray_setup::{NOISE, light_of_walls, probes};
use crate::rays::{PRODUCTS, TERMS, add_means};
use crate::shadows::Shadows;
use crate::views::ShadowEnd;
use crate::{
    ChannelControl, ColouredRays, ColouredRoom, Point, PolynomialRoom, RayTables, RoomError,
};

/// A residual this small beside v is rounding, and no channel's boxes are cut for it.
const ROUNDING: f64 = 1e-12;

/// The set-up of a [`ColouredRays`], cell by cell: [`RaySetup`](crate::RaySetup) for several channels, whose boxes are narrow enough
/// for each of them.
///
/// ```
/// use fredholm_core::channels::{ChannelGoal, ChannelGoals, NothingKnown};
/// use fredholm_core::galerkin::Partition;
/// use fredholm_core::{At, Batch, Job, WalkOptions};
/// use fredholm_room::{
///     ChannelRaySetup, ChannelRayTables, ColouredRoom, Enclosure, Grading, Material, Matrix, Mesh, Room, Scene,
///     Surface, Tables, WallColours,
/// };
///
/// // Two grey walls and two lamps; of the green nothing is reflected by the grey ones.
/// let material = |reflectance, emission| [Material { reflectance, emission }];
/// let (grey, lamp) = (material(0.5, 0.0), material(0.1, 2.0));
/// let surfaces = [
///     Surface { points: &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], materials: &grey },
///     Surface { points: &[[1.0, 1.0], [0.0, 1.0], [0.0, 0.0]], materials: &lamp },
/// ];
/// let scene = Scene::new::<f64>(&surfaces, Enclosure::Closed)?;
/// let (reflectances, emissions) = (
///     [0.5, 0.0, 0.5, 0.0, 0.1, 0.1, 0.1, 0.1],
///     [0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 1.0, 2.0],
/// );
/// let colours = WallColours::new(2, (&reflectances, &emissions))?;
/// let mesh = Mesh::new::<f64>(&scene, 60, Grading::default())?;
/// let matrix = Matrix::with_functions(&scene, &mesh, 0.5, 2)?;
/// let solutions = matrix.solve_channels(&scene, &mesh, &colours, 1e-14, 1000)?;
/// // v of every cell, and there of every channel.
/// let cells = (0..mesh.len()).flat_map(|cell| solutions.iter().map(move |own| &own.v[2 * cell..2 * cell + 2]));
/// let v = cells.flatten().copied().collect::<Vec<f64>>();
///
/// let tables = Tables::<f64>::new(&scene, &mesh);
/// let room = Room::new(tables.geometry(), tables.cells(), matrix.views(), 0.5)?;
/// let coloured = ColouredRoom::new(&room, colours)?;
/// let setup = ChannelRaySetup::<2>::new(&coloured, &v)?;
/// let cells = (0..room.cells()).map(|i| setup.cell(i)).collect::<Result<Vec<_>, _>>()?;
/// let rays = ChannelRayTables::new(cells, 2)?;
/// let neighbours = rays.neighbours::<2>(&coloured, &v)?;
///
/// // Radiosity in the middle of the floor, by 10,000 walks for both channels.
/// let start = At(room.point(0, 0.5)?);
/// let goal = ChannelGoal { functional: NothingKnown(start), control_means: None, known: &[] };
/// let job = ChannelGoals {
///     equations: &coloured,
///     neighbours: &neighbours,
///     goals: &[goal],
///     weights: &[],
///     options: WalkOptions::default(),
/// };
/// let mut batches = [Batch::new(0, 10_000, 10_000); 2];
/// job.run_shared(0, &mut batches, u64::MAX)?;
/// let [red, green] = batches.map(|batch| *batch.statistics());
/// assert!(red.preconditioned().std_error.unwrap() < red.plain().std_error.unwrap() / 100.0);
/// // The black floor neither emits nor reflects.
/// assert_eq!(green.preconditioned().estimate, 0.0);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct ChannelRaySetup<'s, 'r, 'a, const B: usize> {
    coloured: &'s ColouredRoom<'r, 'a, f64>,
    polynomials: PolynomialRoom<'r, 'a, f64, B>,
    v: &'s [f64],
    /// The standard deviation of a ray's estimate of T_kc v_c/ρ_c that is small enough, in every channel.
    noise: Vec<f64>,
    /// Where boxes end besides at vertices.
    shadows: &'s [ShadowEnd],
}

impl<'s, 'r, 'a, const B: usize> ChannelRaySetup<'s, 'r, 'a, B> {
    /// A set-up for v, which has for every cell, and there for every channel, B numbers. Looks from a few points at how good they
    /// are.
    ///
    /// # Errors
    /// [`RoomError::Length`]; [`RoomError::Galerkin`]: no memory.
    pub fn new(coloured: &'s ColouredRoom<'r, 'a, f64>, v: &'s [f64]) -> Result<Self, RoomError> {
        let polynomials = coloured.room().with_functions::<B>();
        let channels = coloured.colours().channels();
        let (expected, found) = (polynomials.cells() * channels * B, v.len());
        if expected != found {
            return Err(RoomError::Length { expected, found });
        }
        let mut setup = Self {
            coloured,
            polynomials,
            v,
            noise: Vec::new(),
            shadows: &[],
        };
        setup.noise = setup.residuals()?;
        for (channel, noise) in setup.noise.iter_mut().enumerate() {
            let own = v.chunks_exact(B).skip(channel).step_by(channels).flatten();
            let largest = own.fold(0.0, |most: f64, v| Real::max(most, v.abs()));
            *noise = Real::max(NOISE * *noise, ROUNDING * largest);
        }
        Ok(setup)
    }

    /// Lets boxes end at the ends of shadows, too: see [`RaySetup::with_shadows`](crate::RaySetup::with_shadows).
    #[must_use]
    pub fn with_shadows(mut self, shadows: &'s Shadows) -> Self {
        self.shadows = shadows.all();
        self
    }

    const fn channels(&self) -> usize {
        self.coloured.colours().channels()
    }

    /// The root mean squares of v_c − T_kc v_c − F_c over ρ_c, over the walls.
    fn residuals(&self) -> Result<Vec<f64>, GalerkinError> {
        let (room, channels) = (self.coloured.room(), self.channels());
        let [mut sums, mut lengths, mut seen] =
            [buffer(channels)?, buffer(channels)?, buffer(channels)?];
        let [mut values, mut lit, mut direct] =
            [buffer(channels)?, buffer(channels)?, buffer(channels)?];
        probes(room, &mut |x, _, cell, t| {
            self.write_values(x, &mut values);
            self.irradiances(x, &mut seen);
            self.coloured.direct(x, &mut direct);
            light_of_walls(room, (x, cell, t), &mut |y, share| {
                self.coloured.reflected_light(y, &mut lit);
                for (seen, lit) in seen.iter_mut().zip(&lit) {
                    *seen += share * lit;
                }
            });
            let is_light = room.is_light(x.wall() as u32);
            let length = room.table().length(cell);
            let colours = self.coloured.colours();
            let materials = colours.reflectances(x.wall());
            let materials = materials.iter().zip(colours.emissions(x.wall()));
            for (channel, (&reflectance, &emission)) in materials.enumerate() {
                if reflectance > 0.0 {
                    // Of the light that is known v_c has T_Kc F_s,c, and its own source no F_s,c.
                    let own = if is_light { 0.0 } else { emission };
                    let emitted = (values[channel] - own) / reflectance - direct[channel];
                    let residual = emitted - seen[channel];
                    sums[channel] += length * residual * residual;
                    lengths[channel] += length;
                }
            }
        });
        for (sum, &length) in sums.iter_mut().zip(&lengths) {
            *sum = if length > 0.0 {
                Real::sqrt(*sum / length)
            } else {
                0.0
            };
        }
        Ok(sums)
    }

    /// The irradiances that polynomials make at a point: form factors serve all channels.
    fn irradiances(&self, x: &Point<f64>, to: &mut [f64]) {
        to.fill(0.0);
        let cells = self.v.chunks_exact(self.channels() * B).enumerate();
        for (cell, own) in cells {
            let factors = self.polynomials.form_factors(x, cell);
            for (to, own) in to.iter_mut().zip(own.chunks_exact(B)) {
                *to += own.iter().zip(factors).map(|(v, f)| v * f).sum::<f64>();
            }
        }
    }

    /// v_c of a point in every channel.
    fn write_values(&self, x: &Point<f64>, to: &mut [f64]) {
        self.coloured.reflected_light(x, to);
        let cell = self.polynomials.locate(x);
        let psi: [f64; B] = self.polynomials.basis(&Located { point: *x, cell });
        let own = self.v.get(cell * self.channels() * B..).unwrap_or(&[]);
        for (to, own) in to.iter_mut().zip(own.chunks_exact(B)) {
            *to += own.iter().zip(psi).map(|(v, psi)| v * psi).sum::<f64>();
        }
    }

    /// The tables of a cell.
    ///
    /// # Errors
    /// [`RoomError::Galerkin`]: no memory.
    pub fn cell(&self, cell: usize) -> Result<CellChannelRays, RoomError> {
        let room = self.coloured.room();
        let builder = Builder {
            room,
            seen: &|x, omega, to| match room.ray(x, omega) {
                Some(y) => self.write_values(&y, to),
                None => to.fill(0.0),
            },
            noise: &self.noise,
            shadows: self.shadows,
        };
        Ok(builder.cell(cell))
    }
}

/// The tables of a [`ColouredRays`].
#[derive(Clone, Debug)]
pub struct ChannelRayTables<F> {
    channels: usize,
    rays: RayTables<F>,
    integrals: Vec<F>,
    means: Vec<F>,
    of_intervals: Vec<F>,
    controls: Vec<F>,
}

impl ChannelRayTables<f64> {
    /// The tables of all cells, in their order, in so many channels.
    ///
    /// # Errors
    /// [`RoomError::Channels`]; [`RoomError::Memory`]: more than 2³² − 1 boxes, or no memory.
    pub fn new(cells: Vec<CellChannelRays>, channels: usize) -> Result<Self, RoomError> {
        if !(1..=MOST_CHANNELS).contains(&channels) {
            return Err(RoomError::Channels { channels });
        }
        let count = |of: fn(&CellChannelRays) -> usize| cells.iter().map(of).sum::<usize>();
        let mut integrals = reserve(count(|cell| cell.integrals.len()))?;
        let mut means = reserve(count(|cell| cell.means.len()))?;
        let mut of_intervals = reserve(count(|cell| cell.of_intervals.len()))?;
        let mut controls = reserve(count(|cell| cell.controls.len()))?;
        let mut rays: Vec<CellRays> = reserve(cells.len())?;
        for cell in cells {
            integrals.extend(cell.integrals);
            means.extend(cell.means);
            of_intervals.extend(cell.of_intervals);
            controls.extend(cell.controls);
            rays.push(cell.rays);
        }
        Ok(Self {
            channels,
            rays: RayTables::new(rays)?,
            integrals,
            means,
            of_intervals,
            controls,
        })
    }

    /// The tables in the scalar of the walks: c is rounded, and its means are those of c as rounded.
    ///
    /// # Errors
    /// [`RoomError::Memory`].
    pub fn rounded<F: Real>(&self) -> Result<ChannelRayTables<F>, RoomError> {
        let mut means: Vec<F> = reserve(self.means.len())?;
        means.resize(self.means.len(), F::zero());
        let controls = rounded(&self.controls)?;
        let rays = self.rays.rounded::<F>()?;
        let control = rays.control();
        let mut boxes = control.boxes.iter().zip(control.shares);
        let mut own = controls.chunks_exact(PRODUCTS * self.channels);
        let stretches = control.stretches;
        for (stretch, next) in stretches.iter().zip(stretches.iter().skip(1)) {
            let count = (next.ray_box - stretch.ray_box) as usize;
            for ((ray_box, share), own) in boxes.by_ref().zip(own.by_ref()).take(count) {
                let interval = (stretch.interval + share.interval) as usize;
                let row = TERMS * self.channels;
                let means = means.get_mut(interval * row..(interval + 1) * row);
                add_means(means.unwrap_or_default(), ray_box.width, own, self.channels);
            }
        }
        Ok(ChannelRayTables {
            channels: self.channels,
            integrals: rounded(&self.integrals)?,
            of_intervals: rounded(&self.of_intervals)?,
            means,
            controls,
            rays,
        })
    }
}

/// Numbers in another scalar.
fn rounded<F: Real>(all: &[f64]) -> Result<Vec<F>, GalerkinError> {
    let mut to = reserve(all.len())?;
    to.extend(all.iter().map(|&x| F::from_f64(x)));
    Ok(to)
}

impl<F: Real> ChannelRayTables<F> {
    /// The number of channels.
    #[must_use]
    pub const fn channels(&self) -> usize {
        self.channels
    }

    /// The tables, borrowed.
    #[must_use]
    pub fn control(&self) -> ChannelControl<'_, F> {
        ChannelControl {
            rays: self.rays.control(),
            integrals: &self.integrals,
            means: &self.means,
            of_intervals: &self.of_intervals,
            controls: &self.controls,
        }
    }

    /// The neighbour equations of v, which has for every cell, and there for every channel, B numbers.
    ///
    /// # Errors
    /// [`RoomError::Length`], [`RoomError::Tables`]: v or the tables are those of other cells or channels.
    pub fn neighbours<'n, 'r, 'a, const B: usize>(
        &'n self,
        coloured: &'n ColouredRoom<'r, 'a, F>,
        v: &'n [F],
    ) -> Result<ColouredRays<'n, 'r, 'a, F, B>, RoomError> {
        ColouredRays::new(coloured, v, self.control())
    }
}
