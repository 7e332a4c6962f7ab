//! Tables of the control variate of a neighbour equation with h = k.

use fredholm_core::array::Each;
use fredholm_core::galerkin::{Basis, Partition};
use fredholm_core::{Located, Real, Source};

use crate::ray_boxes::{Builder, CellRays, intervals};
use crate::rays::{GAUSS, between};
use crate::shadows::Shadows;
use crate::views::{ShadowEnd, edges};
use crate::{Point, PolynomialRoom, Room, RoomError, Wall};

/// The standard deviation of G relative to the residual of v, which no ray can mend, at which boxes are narrow enough: a
/// variance of a quarter of its square.
pub(crate) const NOISE: f64 = 0.5;
/// The points from which the residual of v is looked at.
const PROBES: usize = 128;
/// How often an interval of directions, in which v is looked at from there, is halved towards its ends: from near a corner
/// the next wall is seen from there to its far end within a small part of the angle.
const GRADES: i32 = 12;

/// The set-up of a [`RayNeighbour`](crate::RayNeighbour), cell by cell.
///
/// ```
/// use fredholm_core::galerkin::Partition;
/// use fredholm_core::{At, Batch, Estimator, Form, Length, Task, WalkSeeds};
/// use fredholm_room::{
///     Enclosure, Grading, Material, Matrix, Mesh, RaySetup, RayTables, Room, Scene, Surface, Tables,
/// };
///
/// let grey = [Material { reflectance: 0.5, emission: 0.0 }];
/// let lamp = [Material { reflectance: 0.1, emission: 1.0 }];
/// let surfaces = [
///     Surface { points: &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], materials: &grey },
///     Surface { points: &[[1.0, 1.0], [0.0, 1.0], [0.0, 0.0]], materials: &lamp },
/// ];
/// let scene = Scene::new::<f64>(&surfaces, Enclosure::Closed)?;
/// let mesh = Mesh::new::<f64>(&scene, 60, Grading::default())?;
/// let matrix = Matrix::with_functions(&scene, &mesh, 0.5, 2)?;
/// let v = matrix.solve(&scene, &mesh, 1e-14, 1000)?.v;
///
/// let tables = Tables::<f64>::new(&scene, &mesh);
/// let room = Room::new(tables.geometry(), tables.cells(), matrix.views(), 0.5)?;
/// let polynomials = room.with_functions::<2>();
/// let setup = RaySetup::new(&polynomials, &v)?;
/// let cells = (0..polynomials.cells()).map(|i| setup.cell(i)).collect::<Result<Vec<_>, _>>()?;
/// let rays = RayTables::new(cells)?;
/// let neighbour = rays.neighbour(&polynomials, &v)?;
///
/// // Radiosity in the middle of the floor by 10,000 walks.
/// let start = At(room.point(0, 0.5)?);
/// let task = Task {
///     equation: &room,
///     neighbour: &neighbour,
///     functional: &start,
///     control_mean: None,
///     estimator: Estimator::Absorption,
///     form: Form::Product,
///     seeds: <WalkSeeds>::new(1, 0),
///     length: Length::default(),
/// };
/// let mut batch = Batch::new(0, 10_000, 10_000);
/// batch.run(&task, u64::MAX)?;
/// let (plain, best) = (batch.statistics().plain(), batch.statistics().preconditioned());
/// assert!(best.std_error.unwrap() < plain.std_error.unwrap() / 100.0);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct RaySetup<'s, 'r, 'a, const B: usize> {
    polynomials: &'s PolynomialRoom<'r, 'a, f64, B>,
    v: &'s [f64],
    /// The standard deviation of a ray's estimate of T_k v/ρ that is small enough.
    noise: f64,
    /// Where boxes end besides at vertices.
    shadows: &'s [ShadowEnd],
}

impl<'s, 'r, 'a, const B: usize> RaySetup<'s, 'r, 'a, B> {
    /// A set-up for v, which has B numbers for every cell. Looks from a few points at how good it is.
    ///
    /// # Errors
    /// [`RoomError::Length`].
    pub fn new(
        polynomials: &'s PolynomialRoom<'r, 'a, f64, B>,
        v: &'s [f64],
    ) -> Result<Self, RoomError> {
        let (expected, found) = (polynomials.cells() * B, v.len());
        if expected != found {
            return Err(RoomError::Length { expected, found });
        }
        let mut setup = Self {
            polynomials,
            v,
            noise: 0.0,
            shadows: &[],
        };
        setup.noise = NOISE * setup.residual();
        Ok(setup)
    }

    /// Lets boxes end at the ends of shadows, too, where v has kinks: with 100 to 400 cells of degree 4 around a corner that leaves a
    /// fifth of the standard deviation.
    #[must_use]
    pub fn with_shadows(mut self, shadows: &'s Shadows) -> Self {
        self.shadows = shadows.all();
        self
    }

    /// The root mean square of v − T_k v − F over ρ, over the walls.
    fn residual(&self) -> f64 {
        let room = self.polynomials.room();
        let (mut sum, mut all) = (0.0, 0.0);
        probes(room, &mut |x, wall, cell, t| {
            if wall.reflectance > 0.0 {
                let emitted = (self.value(x) - room.source(x)) / wall.reflectance;
                let seen = self.polynomials.irradiance_of(x, self.v);
                let mut of_light = 0.0;
                light_of_walls(room, (x, cell, t), &mut |y, share| {
                    of_light += share * room.reflected_light(y);
                });
                let residual = emitted - seen - of_light;
                let length = room.table().length(cell);
                sum += length * residual * residual;
                all += length;
            }
        });
        if all > 0.0 {
            Real::sqrt(sum / all)
        } else {
            0.0
        }
    }

    fn value(&self, x: &Point<f64>) -> f64 {
        let cell = self.polynomials.locate(x);
        let psi = self.polynomials.basis(&Located { point: *x, cell });
        let own = self.v.get(cell * B..).unwrap_or(&[]);
        let light = self.polynomials.room().reflected_light(x);
        light + own.iter().zip(psi).map(|(v, psi)| v * psi).sum::<f64>()
    }

    /// The tables of a cell.
    ///
    /// # Errors
    /// [`RoomError::Galerkin`]: no memory.
    pub fn cell(&self, cell: usize) -> Result<CellRays, RoomError> {
        let room = self.polynomials.room();
        let builder = Builder {
            room,
            seen: &|x, omega, to| {
                let y = room.ray(x, omega);
                to.fill(y.map_or(0.0, |y| self.value(&y)));
            },
            noise: core::slice::from_ref(&self.noise),
            shadows: self.shadows,
        };
        Ok(builder.cell(cell).alone())
    }
}

/// What is done with a point, its wall, its cell, and its place there.
pub(crate) type Probe<'p> = dyn FnMut(&Point<f64>, &Wall<f64>, usize, f64) + 'p;

/// Calls `each` with points of some cells from which a residual is looked at.
pub(crate) fn probes(room: &Room<'_, f64>, each: &mut Probe<'_>) {
    let cells = room.cells();
    for probe in 0..PROBES.min(cells) {
        let cell = probe * cells / PROBES.min(cells);
        // One of the zeros of no low Legendre polynomial, another from probe to probe.
        let t = 0.06 + 0.88 * ((probe as f64 * 0.618_033_988_749_894_9) % 1.0);
        let x = room.inside(cell, t);
        if let Some(x) = x
            && let Some(wall) = room.geometry().wall(x.wall() as u32)
        {
            each(&x, wall, cell, t);
        }
    }
}

/// Calls `each` with points of walls that a point sees, and shares of all its directions: Gauss points between the directions of
/// vertices. What lights throw on walls and walls on the point has no closed integral. That of the polynomials has one, and their
/// jumps from cell to cell would be lost between such points.
pub(crate) fn light_of_walls(
    room: &Room<'_, f64>,
    (x, cell, t): (&Point<f64>, usize, f64),
    each: &mut dyn FnMut(&Point<f64>, f64),
) {
    let wall = room.geometry().wall(x.wall() as u32);
    let Some(wall) = wall.filter(|_| !room.lights().is_empty()) else {
        return;
    };
    let intervals = intervals(&edges(room, cell, t, &[]));
    for k in 0..intervals.len() {
        let [from, width] = between(&intervals, k, x.position(), wall.tangent);
        // ω = (1 − cos θ)/2: in θ there is no root at the horizon.
        let angle = |omega: f64| {
            let square = Real::max(omega * (1.0 - omega), 0.0);
            Real::atan2(2.0 * Real::sqrt(square), 1.0 - 2.0 * omega)
        };
        let (begin, end) = (angle(from), angle(from + width));
        for (part, size) in panels() {
            for (place, weight) in GAUSS {
                let theta = begin + (end - begin) * (part + size * place);
                let share = 0.5 * Real::sin(theta) * (end - begin) * size * weight;
                if let Some(y) = room.scatter(x, 0.5 - 0.5 * Real::cos(theta)) {
                    each(&y, share);
                }
            }
        }
    }
}

/// Where parts of the unit interval begin, and their widths: halves of halves towards both ends, each in two parts.
fn panels() -> impl Iterator<Item = (f64, f64)> {
    let half = |grade: i32| {
        let to = 0.5 / f64::from(1 << grade);
        let from = if grade == GRADES { 0.0 } else { 0.5 * to };
        (from, 0.5 * (to - from))
    };
    let halves = (0..=GRADES).map(half);
    halves.flat_map(|(from, size)| {
        let first = [(from, size), (from + size, size)];
        let last = first.each(|(from, size)| (1.0 - from - size, size));
        first.into_iter().chain(last)
    })
}

#[cfg(test)]
mod tests {
    use alloc::boxed::Box;

    use crate::{
        Enclosure, Grading, Material, Matrix, Mesh, RaySetup, Room, Scene, Surface, Tables,
    };

    /// It is 8.2e-6 on 60 cells and 1.0e-6 on 240. Gauss points alone, between which jumps from cell to cell are lost, told of
    /// 4.4e-6 on these, and of no less on more.
    #[test]
    fn the_residual_falls_with_the_cells() -> Result<(), Box<dyn core::error::Error>> {
        let [grey, lamp] = [(0.5, 0.0), (0.1, 1.0)].map(|(reflectance, emission)| {
            [Material {
                reflectance,
                emission,
            }]
        });
        // Around a corner.
        let surfaces = [
            Surface {
                points: &[[0.0, 0.0], [2.4, 0.0], [2.4, 1.2], [1.2, 1.2]],
                materials: &grey,
            },
            Surface {
                points: &[[1.2, 1.2], [1.2, 0.75]],
                materials: &lamp,
            },
            Surface {
                points: &[[1.2, 0.75], [0.0, 0.75], [0.0, 0.0]],
                materials: &grey,
            },
        ];
        let scene = Scene::new::<f64>(&surfaces, Enclosure::Closed)?;
        let residual = |cells: usize| -> Result<f64, Box<dyn core::error::Error>> {
            let mesh = Mesh::new::<f64>(&scene, cells, Grading::default())?;
            let matrix = Matrix::with_functions(&scene, &mesh, 0.5, 5)?;
            let v = matrix.solve(&scene, &mesh, 1e-14, 1000)?.v;
            let tables = Tables::<f64>::new(&scene, &mesh);
            let room = Room::new(tables.geometry(), tables.cells(), matrix.views(), 0.5)?;
            let polynomials = room.with_functions::<5>();
            Ok(RaySetup::new(&polynomials, &v)?.residual())
        };
        let [few, many] = [residual(60)?, residual(240)?];
        assert!(4.0 * many < few, "{few:e}, {many:e}");
        Ok(())
    }
}
