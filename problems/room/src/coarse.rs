//! A solution on many cells, from one on few.

use alloc::vec::Vec;

use fredholm_core::galerkin::{Solution, legendre};
use fredholm_core::{Equation as _, NoDraws, Value};
use fredholm_surfaces::Tint;

use crate::matrix::{RowFill, in_order, places, side_by_side};
use crate::views::parts;
use crate::{Grading, Matrix, Mesh, Room, RoomError, Scene, Tables};

/// The functions on a cell of few.
const FUNCTIONS: usize = 4;

/// A Galerkin solution v_c on few cells of degree 3, of one channel or of several, from which a v on any number n of cells follows by
/// one step,
///
/// ```text
/// v = the projection of F + T_K v_c.
/// ```
///
/// What is lost against the Galerkin solution on the n cells is the error of v_c, which a step smooths; the estimate of a walk
/// is unbiased for any v. Time and memory grow like n, those of a [`Matrix`] like n².
///
/// ```
/// use fredholm_room::{
///     CoarseSolution, Enclosure, Grading, Grey, Material, Mesh, Scene, Surface, Tables,
/// };
///
/// // ρ = ½ and F = ½ everywhere: u = 1.
/// let grey = [Material { reflectance: 0.5, emission: 0.5 }];
/// let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
/// let scene = Scene::new::<f64>(&[Surface { points: &points, materials: &grey }], Enclosure::Closed)?;
/// let mesh = Mesh::new::<f64>(&scene, 1000, Grading::default())?;
/// let tables = Tables::<f64>::new(&scene, &mesh);
/// let room = tables.room();
///
/// let coarse = CoarseSolution::new(&scene, 100, &Grey)?;
/// let mut v = vec![0.0; mesh.len()];
/// for (cell, own) in v.chunks_exact_mut(1).enumerate() {
///     coarse.step::<_, 1>(&room, cell, own);
/// }
/// assert!(v.iter().all(|v| (v - 1.0).abs() < 1e-8));
/// # Ok::<(), fredholm_room::RoomError>(())
/// ```
#[derive(Clone, Debug)]
pub struct CoarseSolution {
    tables: Tables<f64>,
    solutions: Vec<Solution>,
    /// v of all channels, side by side.
    v: Vec<f64>,
}

impl CoarseSolution {
    /// The Galerkin solutions of all channels, with about so many unknowns in each.
    ///
    /// # Errors
    /// Those of [`Mesh::new`] and [`Matrix::new`], and [`RoomError::Galerkin`].
    pub fn new(scene: &Scene, unknowns: usize, tint: &impl Tint<f64>) -> Result<Self, RoomError> {
        Self::with_rows(scene, unknowns, tint, in_order)
    }

    /// The Galerkin solutions by a function that has the rows of the matrix filled, on threads, say: see [`Matrix::with_rows`].
    ///
    /// # Errors
    /// Those of [`Mesh::new`] and of the function, [`RoomError::Memory`] and [`RoomError::Galerkin`].
    pub fn with_rows<E: From<RoomError>>(
        scene: &Scene,
        unknowns: usize,
        tint: &impl Tint<f64>,
        rows: impl FnOnce(&mut [f64], usize, RowFill<'_>) -> Result<(), E>,
    ) -> Result<Self, E> {
        let cells = unknowns.div_ceil(FUNCTIONS).max(1);
        let mesh = Mesh::new::<f64>(scene, cells, Grading::of_degree(FUNCTIONS - 1))?;
        let tables = Tables::new(scene, &mesh);
        let room = tables.room();
        let matrix = Matrix::with_rows::<FUNCTIONS, E>(&room, rows)?;
        let solutions =
            (0..tint.channels()).map(|channel| matrix.solve_channel(&room, tint, channel));
        let solutions = solutions.collect::<Result<Vec<_>, RoomError>>()?;
        Ok(Self {
            v: side_by_side(&solutions, FUNCTIONS),
            tables,
            solutions,
        })
    }

    /// The Galerkin solutions on the few cells, one for every channel.
    #[must_use]
    pub fn solutions(&self) -> &[Solution] {
        &self.solutions
    }

    /// Writes v of an equation of these channels on one of its cells: B numbers of each. What the few cells see serves all channels.
    pub fn step<C: Tint<f64>, const B: usize>(
        &self,
        many: &Room<'_, f64, C>,
        cell: usize,
        v: &mut [f64],
    ) {
        let few = self.tables.room();
        v.fill(0.0);
        // Where other walls begin to be seen T_K v_c has a kink, of which no few points over the cell tell the mean.
        for [from, to] in parts(&many.grey(), cell, &[]) {
            for (place, weight) in places(B) {
                let (t, weight) = (from + (to - from) * place, (to - from) * weight);
                let x = many.inside(cell, t);
                let Some((x, wall)) =
                    x.and_then(|x| Some((x, many.geometry().wall(x.wall() as u32)?)))
                else {
                    return v.fill(f64::NAN);
                };
                let on_few = few.point_of(x.wall() as u32, wall, x.along() / wall.length);
                let irradiance: C::Value = few.irradiance_of::<_, FUNCTIONS>(&on_few, &self.v);
                let reflected = many.kernel(&x, &x).times(&irradiance);
                let value = many.source(&x, &mut NoDraws).plus(&reflected);
                let psi: [f64; B] = legendre(t + t - 1.0);
                for (channel, own) in v.chunks_exact_mut(B).enumerate() {
                    for (own, psi) in own.iter_mut().zip(psi) {
                        *own += weight * value.get(channel) * psi;
                    }
                }
            }
        }
    }
}
