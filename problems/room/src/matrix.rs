//! Views and Galerkin coefficients of all pairs of cells.

use alloc::vec::Vec;
use fredholm_core::array::Each;

use fredholm_core::Real;
use fredholm_core::galerkin::{Dense, buffer};

use crate::exchange::{Block, Sights, transposed};
use crate::geometry::{Geometry, Node, Segment, Wall};
use crate::moments::MOST;
use crate::pairs::{Visibility, VisibilityTable};
use crate::partition::Partition;
use crate::vector::{Vector, cross, sub};
use crate::visible::{Part, twins};
use crate::{Mesh, RoomError, Scene};

/// The smallest ratio r_ij = inf p_j/mean p_j of a pair in S of piecewise constants, unless another
/// is asked for.
pub const MIN_MASS_RATIO: f64 = 0.25;

/// The [`Matrix::with_functions`] ratio that serves cells of a degree: ¼ for piecewise constants, ½
/// above, where h is a polynomial that fits the worse the less even p is. Pairs next to a corner
/// look alike at every size, so that a better h there is what the standard deviation gains most
/// from: in furnished rooms it is up to six times smaller than with ¼, at the same cost.
#[must_use]
pub const fn min_mass_ratio(degree: usize) -> f64 {
    if degree == 0 { MIN_MASS_RATIO } else { 0.5 }
}

/// The visibility of all pairs of cells, and K' with B functions on a cell: n² bytes and 8
/// (nB)² bytes. For B = 1 K'_ij is ρ_i F_ij with F_ij the form factor from cell i to cell j.
///
/// Form factors of pairs that see each other wholly are exact to some 10⁻⁶ of their own size or
/// better (crossed strings, Hottel 1954, where the cells are as large as their distance, a rule of
/// three points elsewhere); of others a mean over four points of one cell, exact in the other, and
/// less where a row would sum to more than ρ: an error that costs variance and no correctness.
/// [`exchanges`](crate::exchanges) are exact.
///
/// For B > 1 the moments in the larger of two cells, which are exact, are integrated over the
/// smaller one by Gauss points: to rounding where the cells are apart, in halves of halves down to
/// 1/64 of a cell where they are near, by 16 points each where a shadow is between them.
#[derive(Clone, Debug)]
pub struct Matrix {
    views: Vec<u8>,
    entries: Vec<f64>,
    cells: usize,
    functions: usize,
}

/// One of two walls whose cells are compared.
struct Side<'a> {
    number: u32,
    wall: &'a Wall<f64>,
    /// The cells' numbers begin here.
    first: usize,
    cells: &'a [Part<f64>],
}

impl Matrix {
    /// Visibility and coefficients of all pairs of the mesh, for piecewise constants. A pair is
    /// [`Visibility::FullBounded`] where r_ij ≥ `min_mass_ratio`.
    ///
    /// # Errors
    /// [`RoomError::Ratio`] for min_mass_ratio outside [0, 1], [`RoomError::Memory`].
    pub fn new(scene: &Scene, mesh: &Mesh, min_mass_ratio: f64) -> Result<Self, RoomError> {
        Self::with_functions(scene, mesh, min_mass_ratio, 1)
    }

    /// Visibility and coefficients of all pairs, with B = `functions` on every cell, at most 5. A pair is
    /// [`Visibility::FullBounded`] where no eigenvalue of M_j(x) is below `min_mass_ratio` times the mean of p_j over
    /// the cell of x: at its ends and, for B > 1, in its middle.
    ///
    /// # Errors
    /// As there, and [`RoomError::Functions`].
    pub fn with_functions(
        scene: &Scene,
        mesh: &Mesh,
        min_mass_ratio: f64,
        functions: usize,
    ) -> Result<Self, RoomError> {
        if !(0.0..=1.0).contains(&min_mass_ratio) {
            return Err(RoomError::Ratio);
        }
        if !(1..=MOST).contains(&functions) {
            return Err(RoomError::Functions { functions });
        }
        let cells = mesh.len();
        let square = |n: usize| n.checked_mul(n).ok_or(RoomError::Memory { bytes: None });
        let unknowns = cells.checked_mul(functions);
        let unknowns = unknowns.ok_or(RoomError::Memory { bytes: None })?;
        let mut matrix = Self {
            views: buffer(square(cells)?)?,
            entries: buffer(square(unknowns)?)?,
            cells,
            functions,
        };
        let (geometry, table) = (scene.geometry(), mesh.cells());
        let sights = Sights::new(geometry, functions, min_mass_ratio);
        let parts: Vec<Part<f64>> = (0..cells).filter_map(|c| table.part(c)).collect();
        let side = |w: usize| side(w, &geometry, &table, &parts);
        let mut blockers = Vec::new();
        for b in 0..scene.walls.len() {
            let Some(b) = side(b) else { continue };
            for a in 0..b.number as usize {
                let Some(a) = side(a) else { continue };
                let facing = Facing::new(scene.smallest, &a, &b);
                if facing == Facing::Not {
                    continue;
                }
                obstacles(&geometry, facing, [&a, &b], &mut blockers);
                matrix.fill(&sights, facing, [&a, &b], &blockers);
            }
        }
        matrix.contract(scene, mesh);
        Ok(matrix)
    }
}

impl Matrix {
    /// A row sums to at most ρ. Where the rule for shadows says more, the partly seen pairs get
    /// less: otherwise a ρ near 1 would be no contraction.
    fn contract(&mut self, scene: &Scene, mesh: &Mesh) {
        let (n, functions) = (self.cells.max(1), self.functions);
        let rows = self
            .entries
            .chunks_exact_mut(n * functions * functions)
            .zip(self.views.chunks_exact(n));
        for ((entries, views), &wall) in rows.zip(&mesh.walls) {
            let reflectance = scene
                .walls
                .get(wall as usize)
                .map_or(0.0, |w| w.reflectance);
            let partly = |view: u8| view == Visibility::Partial as u8;
            let (mut sum, mut shadows) = (0.0, 0.0);
            for (&mean, &view) in entries.iter().step_by(functions).zip(views) {
                sum += mean;
                shadows += if partly(view) { mean } else { 0.0 };
            }
            if sum > reflectance && shadows > 0.0 {
                let share = Real::max(1.0 - (sum - reflectance) / shadows, 0.0);
                for row in entries.chunks_exact_mut(n * functions) {
                    let blocks = row.chunks_exact_mut(functions).zip(views);
                    let blocks = blocks.filter(|(_, view)| partly(**view));
                    for entry in blocks.flat_map(|(block, _)| block) {
                        *entry *= share;
                    }
                }
            }
        }
    }

    /// Fills in the pairs of cells of two walls.
    fn fill(
        &mut self,
        sights: &Sights<'_>,
        facing: Facing,
        [a, b]: [&Side<'_>; 2],
        blockers: &[Segment<f64>],
    ) {
        for (i, own) in a.cells.iter().enumerate() {
            for (j, other) in b.cells.iter().enumerate() {
                let (views, exchange) = match sight(facing, [a.wall, b.wall], own, other, blockers)
                {
                    Sight::None => continue,
                    Sight::Part => (
                        [Visibility::Partial; 2],
                        sights.exchange(own, other, Visibility::Partial),
                    ),
                    Sight::Whole => {
                        let exchange = sights.exchange(own, other, Visibility::Full);
                        let mean = exchange.first().map_or(f64::NAN, |row| row[0]);
                        let even = |from: &Part<f64>, to: &Part<f64>| {
                            let mean = mean / from.length;
                            if mean > 0.0 && sights.is_even(from, to, mean) {
                                Visibility::FullBounded
                            } else {
                                Visibility::Full
                            }
                        };
                        ([even(own, other), even(other, own)], exchange)
                    }
                };
                let (i, j) = (a.first + i, b.first + j);
                let back = transposed(&exchange);
                self.put(i, j, views[0], [a.wall.reflectance, own.length], &exchange);
                self.put(j, i, views[1], [b.wall.reflectance, other.length], &back);
            }
        }
    }

    /// The pair (i, j), with what its cells exchange where both have all functions.
    fn put(
        &mut self,
        i: usize,
        j: usize,
        view: Visibility,
        [reflectance, length]: [f64; 2],
        exchange: &Block,
    ) {
        let (n, functions) = (self.cells, self.functions);
        if let Some(place) = self.views.get_mut(i * n + j) {
            *place = view as u8;
        }
        for (a, row) in exchange.iter().take(functions).enumerate() {
            let from = (i * functions + a) * n * functions + j * functions;
            let entries = self.entries.get_mut(from..from + functions);
            for (entry, &exchange) in entries.unwrap_or_default().iter_mut().zip(row) {
                *entry = reflectance * (exchange / length);
            }
        }
    }

    /// n.
    #[must_use]
    pub const fn cells(&self) -> usize {
        self.cells
    }

    /// B.
    #[must_use]
    pub const fn functions(&self) -> usize {
        self.functions
    }

    /// The visibility of all pairs of cells.
    #[must_use]
    pub fn views(&self) -> VisibilityTable<'_> {
        VisibilityTable::made(&self.views, self.cells)
    }

    /// K'_(ia)(jb), row by row: (nB)² entries.
    #[must_use]
    pub fn entries(&self) -> &[f64] {
        &self.entries
    }

    /// K'.
    ///
    /// # Panics
    /// Never: the table is square.
    #[must_use]
    pub fn coefficients(&self) -> Dense<'_, f64> {
        Dense::new(&self.entries, self.cells, self.functions).expect("a square table")
    }
}

fn side<'a>(
    wall: usize,
    geometry: &Geometry<'a, f64>,
    table: &Partition<'_, f64>,
    parts: &'a [Part<f64>],
) -> Option<Side<'a>> {
    let range = table.range(wall as u32);
    Some(Side {
        number: wall as u32,
        wall: geometry.walls().get(wall)?,
        first: range.start,
        cells: parts.get(range)?,
    })
}

/// How two walls lie.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Facing {
    /// On one line, or one behind the other.
    Not,
    /// Each in front of the other, wholly.
    Wholly,
    /// One crosses the line of the other. Distances below the number are none.
    Partly(f64),
}

impl Facing {
    fn new(smallest: f64, a: &Side<'_>, b: &Side<'_>) -> Self {
        let [low_a, high_a] = heights(a.wall, b.wall.ends);
        let [low_b, high_b] = heights(b.wall, a.wall.ends);
        if twins(a.wall.vertices, b.wall.vertices) || high_a <= smallest || high_b <= smallest {
            return Self::Not;
        }
        if low_a >= -smallest && low_b >= -smallest {
            Self::Wholly
        } else {
            Self::Partly(smallest)
        }
    }
}

/// The smallest and the largest distance of two points from the line of a wall.
fn heights(wall: &Wall<f64>, ends: [Vector<f64>; 2]) -> [f64; 2] {
    let [a, b] = ends.each(|end| wall.height(end));
    if a <= b { [a, b] } else { [b, a] }
}

/// The walls that may come between two.
fn obstacles(
    geometry: &Geometry<'_, f64>,
    facing: Facing,
    [a, b]: [&Side<'_>; 2],
    out: &mut Vec<Segment<f64>>,
) {
    out.clear();
    let [[ax, ay], [bx, by]] = a.wall.ends;
    let [[cx, cy], [dx, dy]] = b.wall.ends;
    let low = [ax.min(bx).min(cx).min(dx), ay.min(by).min(cy).min(dy)];
    let high = [ax.max(bx).max(cx).max(dx), ay.max(by).max(cy).max(dy)];
    let off = |node: &Node<f64>| {
        let size = |d: Vector<f64>| d[0].abs() * node.half[1] + d[1].abs() * node.half[0];
        let behind = |wall: &Wall<f64>| wall.height(node.centre) < -size(wall.tangent);
        let apart = |k: usize| {
            node.centre[k] + node.half[k] < low[k] || node.centre[k] - node.half[k] > high[k]
        };
        behind(a.wall) || behind(b.wall) || apart(0) || apart(1)
    };
    geometry.visit(off, |segment| {
        if !twins(segment.vertices, a.wall.vertices)
            && !twins(segment.vertices, b.wall.vertices)
            && (facing != Facing::Wholly
                || between([a.wall.ends, b.wall.ends], segment.ends) != Between::Outside)
        {
            out.push(*segment);
        }
    });
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Sight {
    None,
    Part,
    Whole,
}

/// What two cells see of each other: whether a wall is in the convex hull of the two.
fn sight(
    facing: Facing,
    walls: [&Wall<f64>; 2],
    own: &Part<f64>,
    other: &Part<f64>,
    blockers: &[Segment<f64>],
) -> Sight {
    if let Facing::Partly(smallest) = facing {
        let [low_a, high_a] = heights(walls[0], other.ends);
        let [low_b, high_b] = heights(walls[1], own.ends);
        if high_a <= smallest || high_b <= smallest {
            return Sight::None;
        }
        if low_a < -smallest || low_b < -smallest {
            return Sight::Part;
        }
    }
    let mut sight = Sight::Whole;
    for blocker in blockers {
        match between([own.ends, other.ends], blocker.ends) {
            Between::Outside => {}
            Between::Inside => sight = Sight::Part,
            Between::Across => return Sight::None,
        }
    }
    sight
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Between {
    Outside,
    Inside,
    Across,
}

/// Where a segment is relative to the hull of two parts that face each other, X_1 X_2 Y_1 Y_2 to
/// the left: outside (touching it perhaps), inside somewhere, or across, so that it separates the
/// two.
///
/// Convex sets with disjoint interiors are separated by the line of one of their sides.
fn between([x, y]: [[Vector<f64>; 2]; 2], segment: [Vector<f64>; 2]) -> Between {
    let corners = [x[0], x[1], y[0], y[1]];
    let [p, q] = segment;
    let mut outside = false;
    let mut across = 0;
    let line = sub(q, p);
    for (k, &from) in corners.iter().enumerate() {
        let to = corners[(k + 1) % 4];
        let side = sub(to, from);
        let [a, b] = [cross(side, sub(p, from)), cross(side, sub(q, from))];
        // A side without length separates nothing.
        outside |= side != [0.0; 2] && a <= 0.0 && b <= 0.0;
        if k % 2 == 1 {
            let [c, d] = [cross(line, sub(from, p)), cross(line, sub(to, p))];
            let cuts = (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0);
            across += u8::from(cuts && ((c < 0.0 && d > 0.0) || (c > 0.0 && d < 0.0)));
        }
    }
    let turns = corners.each(|corner| cross(line, sub(corner, p)));
    outside |= turns.iter().all(|&t| t >= 0.0) || turns.iter().all(|&t| t <= 0.0);
    if outside {
        Between::Outside
    } else if across == 2 {
        Between::Across
    } else {
        Between::Inside
    }
}
