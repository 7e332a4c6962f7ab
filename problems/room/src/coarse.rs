//! A solution on many cells, from one on few.

use alloc::vec;
use alloc::vec::Vec;

use fredholm_core::galerkin::{Partition as _, Solution, legendre};

use crate::panels::gauss;
use crate::views::parts;
use crate::{
    Grading, Matrix, Mesh, Point, PolynomialRoom, Room, RoomError, Scene, Tables, Wall,
    WallColours, min_mass_ratio,
};

/// The functions on a cell of few.
const FUNCTIONS: usize = 4;
/// Sweeps of the solution on few cells, and the change at which they end.
const SWEEPS: u32 = 1000;
const TOLERANCE: f64 = 1e-14;

/// A Galerkin solution v_c on few cells of degree 3, from which a v on any number n of cells follows by one step,
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
///     CoarseSolution, Enclosure, Grading, Material, Mesh, Room, Scene, Surface, Tables, VisibilityTable,
/// };
///
/// // ρ = ½ and F = ½ everywhere: u = 1.
/// let grey = [Material { reflectance: 0.5, emission: 0.5 }];
/// let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
/// let scene = Scene::new::<f64>(&[Surface { points: &points, materials: &grey }], Enclosure::Closed)?;
/// let mesh = Mesh::new::<f64>(&scene, 1000, Grading::default())?;
/// let tables = Tables::<f64>::new(&scene, &mesh);
/// let room = Room::new(tables.geometry(), tables.cells(), VisibilityTable::none(), 0.5)?;
/// let polynomials = room.with_functions::<1>();
///
/// let coarse = CoarseSolution::new(&scene, 100)?;
/// let on_few = coarse.room()?;
/// let step = coarse.step(&on_few);
/// let v = (0..mesh.len()).map(|cell| step.on(&polynomials, cell));
/// assert!(v.flatten().all(|v| (v - 1.0).abs() < 1e-8));
/// # Ok::<(), fredholm_room::RoomError>(())
/// ```
#[derive(Clone, Debug)]
pub struct CoarseSolution {
    tables: Tables<f64>,
    matrix: Matrix<'static>,
    solution: Solution,
}

/// The step from few cells to many.
#[derive(Clone, Debug)]
pub struct CoarseStep<'c, 'r> {
    few: PolynomialRoom<'r, 'c, f64, FUNCTIONS>,
    v: &'c [f64],
}

/// Galerkin solutions of all channels on the same few cells, from which those on any number of cells follow: see
/// [`CoarseSolution`].
#[derive(Clone, Debug)]
pub struct CoarseChannels {
    tables: Tables<f64>,
    matrix: Matrix<'static>,
    solutions: Vec<Solution>,
}

/// The mesh and the coefficients of about so many unknowns.
fn few(scene: &Scene, unknowns: usize) -> Result<(Mesh, Matrix<'static>), RoomError> {
    let cells = unknowns.div_ceil(FUNCTIONS).max(1);
    let mesh = Mesh::new::<f64>(scene, cells, Grading::of_pairs(FUNCTIONS - 1))?;
    let ratio = min_mass_ratio(FUNCTIONS - 1);
    let matrix = Matrix::with_functions(scene, &mesh, ratio, FUNCTIONS)?;
    Ok((mesh, matrix))
}

/// The room with the few cells. q0 makes no difference to T_K.
fn room_of<'a>(
    tables: &'a Tables<f64>,
    matrix: &'a Matrix<'_>,
) -> Result<Room<'a, f64>, RoomError> {
    Room::new(tables.geometry(), tables.cells(), matrix.views(), 0.5)
}

impl CoarseSolution {
    /// The Galerkin solution with about so many unknowns.
    ///
    /// # Errors
    /// Those of [`Mesh::new`] and [`Matrix::with_functions`], and [`RoomError::Galerkin`].
    pub fn new(scene: &Scene, unknowns: usize) -> Result<Self, RoomError> {
        let (mesh, matrix) = few(scene, unknowns)?;
        let solution = matrix.solve(scene, &mesh, TOLERANCE, SWEEPS)?;
        Ok(Self {
            tables: Tables::new(scene, &mesh),
            matrix,
            solution,
        })
    }

    /// The Galerkin solution on the few cells.
    #[must_use]
    pub const fn solution(&self) -> &Solution {
        &self.solution
    }

    /// The room with the few cells.
    ///
    /// # Errors
    /// None: q0 is one that [`Room::new`] takes.
    pub fn room(&self) -> Result<Room<'_, f64>, RoomError> {
        room_of(&self.tables, &self.matrix)
    }

    /// The step to other cells. `room` is [`room`](Self::room).
    #[must_use]
    pub fn step<'c, 'r>(&'c self, room: &'r Room<'c, f64>) -> CoarseStep<'c, 'r> {
        CoarseStep {
            few: room.with_functions(),
            v: &self.solution.v,
        }
    }
}

impl CoarseStep<'_, '_> {
    /// v on a cell: the coefficients of its B functions.
    #[must_use]
    pub fn on<const B: usize>(
        &self,
        many: &PolynomialRoom<'_, '_, f64, B>,
        cell: usize,
    ) -> [f64; B] {
        let mut own = [0.0; B];
        places(many, cell, &mut |t, weight| {
            let value = self.at(many, cell, t);
            let psi: [f64; B] = legendre(t + t - 1.0);
            for (own, psi) in own.iter_mut().zip(psi) {
                *own += weight * value * psi;
            }
        });
        own
    }

    /// F + T_K v_c at a place in a cell.
    fn at<const B: usize>(
        &self,
        many: &PolynomialRoom<'_, '_, f64, B>,
        cell: usize,
        t: f64,
    ) -> f64 {
        on_few(&self.few, many, cell, t).map_or(f64::NAN, |(x, wall)| {
            wall.emission + wall.reflectance * self.few.irradiance_of(&x, self.v)
        })
    }
}

/// Calls `each` with places in a cell, and weights that sum to 1.
fn places<const B: usize>(
    many: &PolynomialRoom<'_, '_, f64, B>,
    cell: usize,
    each: &mut dyn FnMut(f64, f64),
) {
    // Where other walls begin to be seen T_K v_c has a kink, of which no few points over the cell tell the mean.
    for [from, to] in parts(many.room(), cell, &[]) {
        let mut add = |place: f64, weight: f64| {
            each(from + (to - from) * place, (to - from) * weight);
        };
        if B == 1 {
            // The mean is the value in the middle, but for what cells of degree 0 do not see either.
            add(0.5, 1.0);
        } else {
            for (t, weight) in gauss::<f64>(usize::from(B > 3)) {
                add(0.5 + 0.5 * t, 0.5 * weight);
            }
        }
    }
}

/// The point of the few cells at a place in one of many, and its wall.
fn on_few<'w, const B: usize>(
    few: &PolynomialRoom<'_, '_, f64, FUNCTIONS>,
    many: &PolynomialRoom<'_, 'w, f64, B>,
    cell: usize,
    t: f64,
) -> Option<(Point<f64>, &'w Wall<f64>)> {
    let x = many.room().inside(cell, t)?;
    let wall = many.room().geometry().walls().get(x.wall())?;
    let place = x.along() / wall.length;
    Some((few.room().at(x.wall() as u32, wall, place), wall))
}

impl CoarseChannels {
    /// The Galerkin solutions with about so many unknowns in each channel.
    ///
    /// # Errors
    /// As [`CoarseSolution::new`]; [`RoomError::Length`]: colours of another number of walls.
    pub fn new(
        scene: &Scene,
        unknowns: usize,
        colours: &WallColours<'_, f64>,
    ) -> Result<Self, RoomError> {
        let (mesh, matrix) = few(scene, unknowns)?;
        let solutions = matrix.solve_channels(scene, &mesh, colours, TOLERANCE, SWEEPS)?;
        Ok(Self {
            tables: Tables::new(scene, &mesh),
            matrix,
            solutions,
        })
    }

    /// The Galerkin solutions on the few cells.
    #[must_use]
    pub fn solutions(&self) -> &[Solution] {
        &self.solutions
    }

    /// The room with the few cells.
    ///
    /// # Errors
    /// None: q0 is one that [`Room::new`] takes.
    pub fn room(&self) -> Result<Room<'_, f64>, RoomError> {
        room_of(&self.tables, &self.matrix)
    }

    /// The step to other cells, of these colours. `room` is [`room`](Self::room).
    #[must_use]
    pub fn step<'c, 'r>(
        &'c self,
        room: &'r Room<'c, f64>,
        colours: WallColours<'c, f64>,
    ) -> CoarseChannelStep<'c, 'r> {
        CoarseChannelStep {
            few: room.with_functions(),
            solutions: &self.solutions,
            colours,
        }
    }
}

/// The step from few cells to many in all channels.
#[derive(Clone, Debug)]
pub struct CoarseChannelStep<'c, 'r> {
    few: PolynomialRoom<'r, 'c, f64, FUNCTIONS>,
    solutions: &'c [Solution],
    colours: WallColours<'c, f64>,
}

impl CoarseChannelStep<'_, '_> {
    /// Writes v_c of every channel on a cell: B numbers for each. What the few cells see serves all channels.
    pub fn on<const B: usize>(
        &self,
        many: &PolynomialRoom<'_, '_, f64, B>,
        cell: usize,
        to: &mut [f64],
    ) {
        to.fill(0.0);
        let mut irradiances = vec![0.0; self.solutions.len()];
        places(many, cell, &mut |t, weight| {
            let Some((x, _)) = on_few(&self.few, many, cell, t) else {
                to.fill(f64::NAN);
                return;
            };
            irradiances.fill(0.0);
            for j in 0..self.few.cells() {
                let factors = self.few.form_factors(&x, j);
                if factors == [0.0; FUNCTIONS] {
                    continue;
                }
                for (to, own) in irradiances.iter_mut().zip(self.solutions) {
                    let own = own.v.get(j * FUNCTIONS..).unwrap_or(&[]);
                    *to += own.iter().zip(factors).map(|(v, f)| v * f).sum::<f64>();
                }
            }
            let psi: [f64; B] = legendre(t + t - 1.0);
            let materials = self.colours.reflectances(x.wall());
            let materials = materials.iter().zip(self.colours.emissions(x.wall()));
            let numbers = materials.zip(&irradiances);
            for (to, ((reflectance, emission), irradiance)) in to.chunks_exact_mut(B).zip(numbers) {
                let value = emission + reflectance * irradiance;
                for (to, psi) in to.iter_mut().zip(psi) {
                    *to += weight * value * psi;
                }
            }
        });
    }
}
