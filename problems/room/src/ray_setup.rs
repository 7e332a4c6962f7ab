//! Tables of the control variate of a neighbour equation with h = k.

use alloc::vec;
use alloc::vec::Vec;

use fredholm_core::array::Each;
use fredholm_core::galerkin::{Cells, reserve};
use fredholm_core::{Equation as _, Lights as _, Located, NoDraws, Real, Value};
use fredholm_surfaces::Tint;

use crate::ray_boxes::{Builder, CellRays};
use crate::rays::{GAUSS, between, polynomials};
use crate::shadows;
use crate::views::{ShadowEnd, edges};
use crate::{Point, RayTables, Room, RoomError, Scene};

/// The standard deviation of G relative to the residual of v, which no ray can mend, at which boxes are narrow enough: a
/// variance of a quarter of its square.
const NOISE: f64 = 0.5;
/// A residual this small beside v is rounding, and no channel's boxes are cut for it.
const ROUNDING: f64 = 1e-12;
/// The points from which the residual of v is looked at.
const PROBES: usize = 128;
/// How often an interval of directions, in which v is looked at from there, is halved towards its ends: from near a corner
/// the next wall is seen from there to its far end within a small part of the angle.
const GRADES: i32 = 12;

/// The set-up of a [`RayNeighbour`](crate::RayNeighbour), cell by cell. Boxes are narrow enough for each channel.
///
/// ```
/// use fredholm_core::{At, Batch, Channels, Goal, Goals, Job, Value};
/// use fredholm_room::{
///     CoarseSolution, Colours, Enclosure, Grading, Material, Mesh, RayNeighbour, RaySetup, Scene, Surface, Tables,
/// };
///
/// let grey = [Material { reflectance: 0.5, emission: 0.0 }];
/// let lamp = [Material { reflectance: 0.1, emission: 1.0 }];
/// let surfaces = [
///     Surface { points: &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], materials: &grey },
///     Surface { points: &[[1.0, 1.0], [0.0, 1.0], [0.0, 0.0]], materials: &lamp },
/// ];
/// let scene = Scene::new::<f64>(&surfaces, Enclosure::Closed)?;
/// let mesh = Mesh::new::<f64>(&scene, 60, Grading::of_degree(1))?;
/// let tables = Tables::<f64>::new(&scene, &mesh);
/// // Two channels, of which the grey walls do not reflect the second: one ray serves both.
/// let (reflectances, emissions) = (
///     [1.0, 0.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0],
///     [0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 0.5, 1.0],
/// );
/// let colours = Colours::<_, 2> { channels: 2, reflectances: &reflectances, emissions: &emissions };
/// let room = tables.room().with_colours(colours)?;
/// let coarse = CoarseSolution::new(&scene, 100, &colours)?;
/// let mut v = vec![0.0; 4 * mesh.len()];
/// for (cell, own) in v.chunks_exact_mut(4).enumerate() {
///     coarse.step::<_, 2>(&room, cell, own);
/// }
/// let rays = RaySetup::<_, 2>::new(&room, &v)?.tables()?;
/// let neighbour = RayNeighbour::<_, _, 2>::new(&room, &v, rays.control())?;
///
/// // Radiosity in the middle of the floor by 10,000 walks.
/// let goals = [Goal { functional: At(room.on_wall(0, 0.5)?), control_mean: None, known: Channels::splat(2, 0.0) }];
/// let job = Goals::new(&room, &neighbour, &goals, Default::default());
/// let mut batches = [Batch::new(0, 10_000, 10_000); 2];
/// job.run(0, &mut batches, u64::MAX)?;
/// let [plain, _] = batches.map(|batch| batch.statistics().plain());
/// let [red, green] = batches.map(|batch| batch.statistics().preconditioned());
/// assert!(red.std_error.unwrap() < plain.std_error.unwrap() / 100.0);
/// assert!((red.estimate - plain.estimate).abs() < 4.0 * plain.std_error.unwrap() && green.estimate == 0.0);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct RaySetup<'s, E, const B: usize> {
    equation: &'s E,
    v: &'s [f64],
    /// The standard deviation of a ray's estimate of T_k v/ρ that is small enough, in every channel.
    noise: Vec<f64>,
    /// Where boxes end besides at vertices.
    shadows: Vec<ShadowEnd>,
}

impl<'s, 'a, C: Tint<f64>, const B: usize> RaySetup<'s, Room<'a, f64, C>, B> {
    /// A set-up for v, which has B numbers of every channel, cell by cell. Looks from a few points at how good it is.
    ///
    /// # Errors
    /// [`RoomError::Length`].
    pub fn new(equation: &'s Room<'a, f64, C>, v: &'s [f64]) -> Result<Self, RoomError> {
        let (cells, channels) = (equation.cells(), equation.channels());
        let (expected, found) = (cells * channels * B, v.len());
        if expected != found {
            return Err(RoomError::Length { expected, found });
        }
        let mut setup = Self {
            equation,
            v,
            noise: Vec::new(),
            shadows: Vec::new(),
        };
        setup.noise = setup.residuals();
        for (channel, noise) in setup.noise.iter_mut().enumerate() {
            let own = v.chunks_exact(B).skip(channel).step_by(channels).flatten();
            let largest = own.fold(0.0, |most: f64, v| Real::max(most, v.abs()));
            *noise = Real::max(NOISE * *noise, ROUNDING * largest);
        }
        Ok(setup)
    }

    /// Lets boxes end at the ends of the shadows of a scene's lights, too, where v has kinks: with 100 to 400 cells of degree 4 around a
    /// corner that leaves a fifth of the standard deviation.
    #[must_use]
    pub fn with_shadows(self, scene: &Scene) -> Self {
        let shadows = shadows::ends(scene);
        Self { shadows, ..self }
    }

    /// The root mean squares of v − T_k v − F over ρ, over the walls, in every channel.
    fn residuals(&self) -> Vec<f64> {
        let room = self.equation;
        let mut sums = vec![[0.0; 2]; room.channels()];
        let grey = room.grey();
        for x in probes(&grey) {
            let mut seen: C::Value = room.irradiance_of::<C::Value, B>(&x.point, self.v);
            for (y, share) in light_of_walls(&grey, &x) {
                seen = seen.plus(&room.light(&y, &mut NoDraws).scaled(share));
            }
            // T_K F_s is in v and in F: what is left of both is the polynomials and F − F_s.
            let emitted = polynomials::<C, f64, B>(room, self.v, &x).minus(&room.rest(&x.point));
            let reflectance = room.kernel(&x.point, &x.point);
            let length = room.measure(x.cell);
            for (channel, [sum, all]) in sums.iter_mut().enumerate() {
                if reflectance.get(channel) > 0.0 {
                    let own = emitted.get(channel) / reflectance.get(channel);
                    let residual = own - seen.get(channel);
                    *sum += length * residual * residual;
                    *all += length;
                }
            }
        }
        let mean = |&[sum, all]: &[f64; 2]| {
            if all > 0.0 {
                Real::sqrt(sum / all)
            } else {
                0.0
            }
        };
        sums.iter().map(mean).collect()
    }

    /// The tables of a cell.
    #[must_use]
    pub fn cell(&self, cell: usize) -> CellRays {
        let room = self.equation;
        let builder = Builder {
            room: &room.grey(),
            seen: &|x, omega, to| match room.ray(x, omega) {
                Some(point) => {
                    let light = room.light(&point, &mut NoDraws);
                    let cell = room.locate(&point);
                    let x = Located { point, cell };
                    let value = light.plus(&polynomials::<C, f64, B>(room, self.v, &x));
                    for (channel, to) in to.iter_mut().enumerate() {
                        *to = value.get(channel);
                    }
                }
                None => to.fill(0.0),
            },
            noise: &self.noise,
            shadows: &self.shadows,
        };
        builder.cell(cell)
    }

    /// The tables of all cells, one after the other.
    ///
    /// # Errors
    /// As [`RayTables::new`], and [`RoomError::Galerkin`]: no memory.
    pub fn tables(&self) -> Result<RayTables<f64>, RoomError> {
        let count = self.equation.cells();
        let mut cells = reserve(count)?;
        cells.extend((0..count).map(|cell| self.cell(cell)));
        RayTables::new(cells)
    }
}

/// Points of some cells from which a residual is looked at.
fn probes(room: &Room<'_, f64>) -> impl Iterator<Item = Located<Point<f64>>> {
    let cells = room.cells();
    let count = PROBES.min(cells);
    (0..count).filter_map(move |probe| {
        let cell = probe * cells / count;
        // One of the zeros of no low Legendre polynomial, another from probe to probe.
        let t = 0.06 + 0.88 * ((probe as f64 * 0.618_033_988_749_894_9) % 1.0);
        let point = room.inside(cell, t)?;
        Some(Located { point, cell })
    })
}

/// Points of walls that a point sees, and shares of all its directions: Gauss points between the directions of vertices. What lights
/// throw on walls and walls on the point has no closed integral. That of the polynomials has one, and their jumps from cell to cell
/// would be lost between such points. Without lights there are none.
fn light_of_walls(room: &Room<'_, f64>, x: &Located<Point<f64>>) -> Vec<(Point<f64>, f64)> {
    let mut all = Vec::new();
    let wall = room.geometry().wall(x.point.wall() as u32);
    let Some(wall) = wall.filter(|_| !room.lights().is_empty()) else {
        return all;
    };
    let mut t = [0.0];
    room.parameters(x, &mut t);
    let edges = edges(room, x.cell, t[0], &[]);
    let end = |k: usize| edges.get(k).map(|edge| edge.position);
    for k in 0..=edges.len() {
        let [from, width] = between(end, k, x.point.position(), wall.tangent);
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
                let y = room.ray(&x.point, 0.5 - 0.5 * Real::cos(theta));
                all.extend(y.map(|y| (y, share)));
            }
        }
    }
    all
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

    use crate::{Enclosure, Grading, Material, Matrix, Mesh, RaySetup, Scene, Surface, Tables};

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
            let tables = Tables::<f64>::new(&scene, &mesh);
            let room = tables.room();
            let v = Matrix::new::<5>(&room)?.solve(&room)?.v;
            let [residual] = RaySetup::<_, 5>::new(&room, &v)?.residuals()[..] else {
                return Err("one channel has one residual".into());
            };
            Ok(residual)
        };
        let [few, many] = [residual(60)?, residual(240)?];
        assert!(4.0 * many < few, "{few:e}, {many:e}");
        Ok(())
    }
}
