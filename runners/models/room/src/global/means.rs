//! Means over walls, and net fluxes out of them.
//!
//! As light goes both ways, ∫_w H dx = ∫ F_yw u(y) dy with the form factor F_yw from y to all of the wall w: exact, and as
//! a function of y smooth but for the edges of shadows, at which cells are halved until nothing is left of the kink.

use fredholm_core::galerkin::legendre;
use fredholm_room::Room;

/// The rule of an interval, Lobatto's: points from -1 to 1, and weights. It has both ends, so that a shadow's edge near one of them moves it.
/// Between an end and the first of Gauss's points an edge is seen by no half, either.
const RULE: [(f64, f64); 5] = [
    (-1.0, 0.1),
    (-INNER, 49.0 / 90.0),
    (0.0, 32.0 / 45.0),
    (INNER, 49.0 / 90.0),
    (1.0, 0.1),
];
/// The share of a cell by which points are inside of it: where walls meet, a point of one is none that sees the other.
const INSET: f64 = 1e-9;
/// √(3/7).
const INNER: f64 = 0.654_653_670_707_977_1;
/// The share of a cell's length that halving may move the integrals of an interval by. What a kink leaves falls fourfold
/// with every halving: 13 lower it to that.
const SHARE: f64 = 1e-8;
/// The most halvings: the jump of what is seen through a gap that closes.
const HALVINGS: u32 = 40;

/// The part of a mean that is no multiple of u, and how far the rest moved with the last halving.
pub(super) struct Means {
    pub(super) constant: f64,
    pub(super) error: f64,
}

/// Fills `moments` with what the functions on all cells contribute to a quantity over these walls, which is on each a
/// constant and a multiple of the irradiance: in the mean over their length, or in all.
pub(super) fn moments(
    room: &Room<'_, f64>,
    walls: &[(usize, [f64; 2])],
    is_mean: bool,
    rows: &[f64],
    moments: &mut [f64],
) -> Means {
    let length = |wall: usize| {
        let wall = room.geometry().walls().get(wall);
        wall.map_or(f64::NAN, |wall| wall.length)
    };
    let all: f64 = walls.iter().map(|(wall, _)| length(*wall)).sum();
    let scale = if is_mean { 1.0 / all } else { 1.0 };
    let constant = walls
        .iter()
        .map(|(wall, [constant, _])| constant * length(*wall));
    let constant = scale * constant.sum::<f64>();
    let cells = room.partition();
    let functions = moments.len() / cells.len().max(1);
    let mut error = 0.0;
    let (mut outside, mut moved) = (0.0, 0.0);
    for &(wall, [_, factor]) in walls.iter().filter(|_| room.has_outside()) {
        for cell in cells.range(wall as u32) {
            let arrival = Arrival {
                room,
                cell,
                wall: None,
                length: cells.length(cell),
            };
            let [fine, last] = arrival.integrals(1);
            outside += scale * factor * fine[0];
            moved += scale * factor * last[0];
        }
    }
    error += moved;
    for (cell, (out, v)) in moments
        .chunks_exact_mut(functions)
        .zip(rows.chunks_exact(functions))
        .enumerate()
    {
        for &(wall, [_, factor]) in walls {
            // Black walls cost nothing.
            if factor == 0.0 {
                continue;
            }
            let arrival = Arrival {
                room,
                cell,
                wall: Some(wall),
                length: cells.length(cell),
            };
            let [fine, moved] = arrival.integrals(functions);
            for (b, out) in out.iter_mut().enumerate() {
                *out += scale * factor * fine[b];
                error += scale * factor * moved[b] * v[b];
            }
        }
    }
    Means {
        constant: constant + outside,
        error: f64::abs(error),
    }
}

/// The most functions on a cell.
const MOST: usize = 5;

/// Light from a cell that arrives at a wall, or light from outside that arrives at the cell.
struct Arrival<'a, 'r> {
    room: &'a Room<'r, f64>,
    cell: usize,
    wall: Option<usize>,
    length: f64,
}

impl Arrival<'_, '_> {
    /// ∫ F_yw ψ_b(y) dy over the cell, and how far the last halvings moved it.
    fn integrals(&self, functions: usize) -> [[f64; MOST]; 2] {
        let mut found = [[0.0; MOST]; 2];
        let ends = [0.0, 1.0];
        self.halve(ends, &self.sums(ends), functions, HALVINGS, &mut found);
        found
    }

    fn halve(
        &self,
        [from, to]: [f64; 2],
        whole: &[f64; MOST],
        functions: usize,
        left: u32,
        found: &mut [[f64; MOST]; 2],
    ) {
        let middle = 0.5 * (from + to);
        let parts = [[from, middle], [middle, to]];
        let halves = parts.map(|ends| self.sums(ends));
        let mut moved = [0.0; MOST];
        for (b, moved) in moved.iter_mut().enumerate().take(functions) {
            *moved = halves[0][b] + halves[1][b] - whole[b];
        }
        let largest = moved.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        if left > 0 && largest > SHARE * self.length {
            for (ends, half) in parts.into_iter().zip(&halves) {
                self.halve(ends, half, functions, left - 1, found);
            }
            return;
        }
        for b in 0..functions {
            found[0][b] += whole[b] + moved[b];
            found[1][b] += moved[b];
        }
    }

    /// By one rule between two fractions of the cell.
    fn sums(&self, [from, to]: [f64; 2]) -> [f64; MOST] {
        let half = 0.5 * (to - from);
        let mut sums = [0.0; MOST];
        for (t, weight) in RULE {
            let place = (from + half * (1.0 + t)).clamp(INSET, 1.0 - INSET);
            let Some(y) = self.room.inside(self.cell, place) else {
                return [f64::NAN; MOST];
            };
            let share = match self.wall {
                Some(wall) => self.room.form_factor_of_wall(&y, wall),
                None => self.room.from_outside(&y),
            };
            let share = half * weight * self.length * share;
            let psi: [f64; MOST] = legendre(2.0 * place - 1.0);
            for (sum, psi) in sums.iter_mut().zip(psi) {
                *sum += share * psi;
            }
        }
        sums
    }
}
