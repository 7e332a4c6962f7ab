//! Cutting walls into cells.

use alloc::vec::Vec;
use fredholm_core::array::Each;

use fredholm_core::Real;

use crate::RoomError;
use crate::partition::{Edge, Partition, PartitionTables};
use crate::scene::{Scene, turn};
use crate::vector::{Vector, along, sub};
use crate::visible::twins;

/// How walls are cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grading {
    /// g: the i-th of m cells from a corner where two walls see each other ends at about (i/m)^g of
    /// the way. 1 makes equal cells.
    pub exponent: f64,
    /// Whether to cut at the edges of the shadows of lights as well: where the line from a vertex
    /// at which the emission jumps past one that stands out into the room meets a wall. There u has
    /// a kink, which polynomials of a higher degree do not have within a cell. At the edges of a sun's shadows, where u jumps, cells end
    /// in any case.
    pub shadows: bool,
}

impl Grading {
    /// The grading that serves cells of a degree p where h = k on all pairs: g = 3/2 + 3p/8, and cuts at
    /// shadows for degrees above 0. There is no pair whose h is wrong next to a corner; what asks for small cells there is that u
    /// is less smooth, and the more so the higher the degree is. Rooms whose shadows leave more than their corners do would do
    /// with less from degree 1 on, empty ones would not: there 2 in place of 3 leaves 20 times more at degree 4.
    #[must_use]
    pub const fn of_degree(degree: usize) -> Self {
        Self {
            exponent: 1.5 + 0.375 * degree as f64,
            shadows: degree > 0,
        }
    }
}

impl Default for Grading {
    /// The grading for cells of degree 0.
    fn default() -> Self {
        Self::of_degree(0)
    }
}

/// A partition of a scene's walls, in f64, with edges that the walk's scalar has exactly.
#[derive(Clone, Debug)]
pub struct Mesh {
    pub(crate) edges: Vec<Edge<f64>>,
    pub(crate) walls: Vec<u32>,
    pub(crate) first: Vec<u32>,
}

impl Mesh {
    /// About n = `cells` cells, at least one to a wall, in proportion to the walls' lengths.
    ///
    /// # Errors
    /// [`RoomError::Cells`], [`RoomError::Grading`].
    pub fn new<F: Real>(scene: &Scene, cells: usize, grading: Grading) -> Result<Self, RoomError> {
        if cells == 0 || u32::try_from(cells.saturating_add(scene.walls.len())).is_err() {
            return Err(RoomError::Cells);
        }
        if !(1.0..=10.0).contains(&grading.exponent) {
            return Err(RoomError::Grading);
        }
        let corners = corners(scene);
        let walls = scene.geometry().walls();
        let total: f64 = walls.iter().map(|wall| wall.length).sum();
        let mut mesh = Self {
            edges: Vec::new(),
            walls: Vec::new(),
            first: Vec::new(),
        };
        let mut shadows = if grading.shadows {
            crate::shadows::of_lights(scene)
        } else {
            crate::shadows::of_suns(scene)
        };
        for (w, (wall, corners)) in walls.iter().zip(corners).enumerate() {
            let share = (cells as f64 * wall.length / total + 0.5) as usize;
            let mut cuts = cuts(share.max(1), corners, grading.exponent);
            for cut in &mut cuts {
                *cut *= wall.length;
            }
            if let Some(own) = shadows.get_mut(w) {
                cuts.append(own);
                cuts.sort_by(f64::total_cmp);
            }
            mesh.first.push(mesh.walls.len() as u32);
            mesh.push::<F>(w as u32, wall, &cuts);
        }
        if u32::try_from(mesh.walls.len()).is_err() {
            return Err(RoomError::Cells);
        }
        mesh.first.push(mesh.walls.len() as u32);
        Ok(mesh)
    }

    /// The cells of a wall, cut at these distances. Cells that the scalar would hardly know are
    /// left out.
    fn push<F: Real>(&mut self, w: u32, wall: &crate::Wall<f64>, cuts: &[f64]) {
        let round = |x: f64| F::from_f64(x).to_f64();
        let length = round(wall.length);
        let smallest = 16.0 * F::EPSILON.to_f64() * length;
        self.edges.push(Edge {
            along: 0.0,
            position: wall.ends[0],
        });
        let mut last = 0.0;
        for &cut in cuts {
            let at = round(cut);
            if !(at - last >= smallest && length - at >= smallest) {
                continue;
            }
            let position = if at <= 0.5 * length {
                along(wall.ends[0], at, wall.tangent)
            } else {
                // The length that the walk knows: from the true one the cell would lose digits.
                along(wall.ends[1], at - length, wall.tangent)
            };
            self.edges.push(Edge {
                along: at,
                position: position.each(round),
            });
            self.walls.push(w);
            last = at;
        }
        self.edges.push(Edge {
            along: length,
            position: wall.ends[1],
        });
        self.walls.push(w);
    }

    /// n.
    #[must_use]
    pub fn len(&self) -> usize {
        self.walls.len()
    }

    /// Whether there is no cell; never, for a mesh of a scene.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.walls.is_empty()
    }

    /// The cells in f64.
    #[must_use]
    pub fn cells(&self) -> Partition<'_, f64> {
        Partition::made(PartitionTables {
            edges: &self.edges,
            walls: &self.walls,
            first: &self.first,
        })
    }
}

/// m − 1 cuts of the unit interval, graded towards the ends that are corners.
fn cuts(m: usize, corners: [bool; 2], exponent: f64) -> Vec<f64> {
    let graded = |i: usize, m: usize| Real::pow(i as f64 / m as f64, exponent);
    match corners {
        [false, false] => (1..m).map(|i| i as f64 / m as f64).collect(),
        [true, false] => (1..m).map(|i| graded(i, m)).collect(),
        [false, true] => (1..m).map(|i| 1.0 - graded(m - i, m)).collect(),
        [true, true] => {
            let left = m.div_ceil(2);
            let middle = left as f64 / m as f64;
            (1..m)
                .map(|i| {
                    if i <= left {
                        middle * graded(i, left)
                    } else {
                        1.0 - (1.0 - middle) * graded(m - i, m - left)
                    }
                })
                .collect()
        }
    }
}

/// Whether either end of every wall is a corner: another wall there rises on its active side.
fn corners(scene: &Scene) -> Vec<[bool; 2]> {
    let mut at: Vec<(u32, u32)> = Vec::new();
    for (w, wall) in scene.walls.iter().enumerate() {
        at.extend(wall.vertices.each(|v| (v, w as u32)));
    }
    at.sort_unstable();
    let meets = |w: usize, wall: &crate::Wall<f64>, k: usize| {
        let vertex = wall.vertices[k];
        let from = at.partition_point(|&(v, _)| v < vertex);
        let here = at.get(from..).unwrap_or(&[]);
        let here = here.iter().take_while(|&&(v, _)| v == vertex);
        here.filter_map(|&(_, other)| scene.walls.get(other as usize).map(|o| (other, o)))
            .any(|(other, o)| {
                let far = usize::from(o.vertices[0] == vertex);
                other as usize != w
                    && !twins(o.vertices, wall.vertices)
                    && rises(wall.ends, o.ends[far], scene.smallest)
            })
    };
    let of = |(w, wall): (usize, &crate::Wall<f64>)| [meets(w, wall, 0), meets(w, wall, 1)];
    scene
        .geometry()
        .walls()
        .iter()
        .enumerate()
        .map(of)
        .collect()
}

/// Whether a point is on the active side of the wall by more than the scene's smallest distance.
fn rises(ends: [Vector<f64>; 2], point: Vector<f64>, smallest: f64) -> bool {
    let span = sub(ends[1], ends[0]);
    turn(ends[0], ends[1], point) > smallest * crate::vector::norm(span)
}
