//! A square room from tables that a device would keep.

use fredholm_core::galerkin::{
    Dense, PairKind, PairTable, Piecewise, StoppingRule, gauss_seidel, neighbour_source,
};
use fredholm_core::{At, Real, Statistics};
use fredholm_room::{
    Edge, Geometry, Irradiance, MeanOver, Node, Partition, PartitionTables, Room, Strip, Wall,
};

use crate::{all_options, walks};

const CORNERS: [[f64; 2]; 5] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
const LENGTHS: [f64; 5] = [0.0, 1.0, 2.0, 3.0, 4.0];
const WALLS: [u32; 8] = [0, 0, 1, 1, 2, 2, 3, 3];
const FIRST: [u32; 5] = [0, 2, 4, 6, 8];

/// Every wall has two cells, ρ and F = 1 − ρ, so that u = 1: at a point, in the mean, and as
/// irradiance. Whether all estimates are near 1.
pub(crate) fn solve<F: Real>(reflectance: f64, seed: u64) -> Option<bool> {
    let to = F::from_f64;
    let corner = |k: usize| CORNERS.get(k).copied().unwrap_or_default();
    let wall = |w: usize| {
        let [a, b] = [corner(w), corner(w + 1)];
        Wall {
            ends: [a.map(to), b.map(to)],
            vertices: [w as u32, (w as u32 + 1) % 4],
            tangent: [to(b[0] - a[0]), to(b[1] - a[1])],
            length: F::one(),
            reflectance: to(reflectance),
            emission: to(1.0 - reflectance),
        }
    };
    let walls: [Wall<F>; 4] = core::array::from_fn(wall);
    // Two walls from corner to corner, the last of which stands twice.
    let strips: [Strip<F>; 2] = core::array::from_fn(|s| {
        let lanes = [2 * s, 2 * s + 1, 2 * s + 2, 2 * s + 2];
        let corners = lanes.map(corner);
        Strip {
            places: [corners.map(|p| to(p[0])), corners.map(|p| to(p[1]))],
            vertices: lanes.map(|k| k as u32 % 4),
            walls: [2 * s as u32, 2 * s as u32 + 1, u32::MAX, u32::MAX],
        }
    });
    // One box for all, so that nothing depends on how it is divided.
    let node = |first, count, links| Node {
        centre: [to(0.5); 2],
        half: [to(0.6); 2],
        first,
        count,
        links,
    };
    let links = [1 | 1 << 16, 0];
    let nodes = [node(1, 0, [0; 2]), node(0, 1, links), node(1, 1, links)];
    let edges: [Edge<F>; 12] = core::array::from_fn(|e| {
        let (w, along) = (e / 3, 0.5 * (e % 3) as f64);
        let [a, b] = [corner(w), corner(w + 1)];
        let at = |k: usize| {
            let [a, b] = [a, b].map(|p| if k == 0 { p[0] } else { p[1] });
            to(a + along * (b - a))
        };
        Edge {
            along: to(along),
            position: [at(0), at(1)],
        }
    });
    let geometry = Geometry::new(&walls, &strips, &nodes, false).ok()?;
    let tables = PartitionTables {
        edges: &edges,
        walls: &WALLS,
        first: &FIRST,
    };
    let partition = Partition::new(&geometry, tables).ok()?;
    // Opposite walls in S, others pointwise; a wall sees nothing of itself.
    let mut table = [0; 64];
    let mut entries = [F::zero(); 64];
    for (e, (kind, k)) in table.iter_mut().zip(&mut entries).enumerate() {
        let turns = (e / 16 + 4 - e % 8 / 2) % 4;
        (*kind, *k) = match turns {
            0 => (PairKind::Dropped as u8, F::zero()),
            2 => (PairKind::Galerkin as u8, to(0.2 * reflectance)),
            _ => (PairKind::Pointwise as u8, to(0.15 * reflectance)),
        };
    }
    let room = Room::new(geometry, partition, &LENGTHS).ok()?;
    let pairs = PairTable::new(&table, 8).ok()?;
    let dense = Dense::new(&entries, 8, 1)?;
    let (mut v, mut g) = ([F::zero(); 8], [F::zero(); 8]);
    let source = [to(1.0 - reflectance); 8];
    let scratch = &mut [F::zero(); 2];
    gauss_seidel(&dense, &source, &mut v, scratch, StoppingRule::Fixed(9)).ok()?;
    neighbour_source(&dense, &pairs, &v, &mut g).ok()?;
    let neighbour =
        Piecewise::<_, _, _, _, _, 1>::with_pointwise(&room, &dense, pairs, &v, &g).ok()?;
    let point = At(room.on_wall(0, 0.3).ok()?);
    let mean = || MeanOver::new(&room, 0..4).ok();
    let mut all = true;
    for options in all_options(seed) {
        all &= is_near(&walks(&room, &neighbour, point, options)?)
            & is_near(&walks(&room, &neighbour, mean()?, options)?)
            & is_near(&walks(
                &room,
                &neighbour,
                Irradiance {
                    room: &room,
                    of: mean()?,
                },
                options,
            )?);
    }
    Some(all)
}

/// Whether an estimate is near 1.
fn is_near(statistics: &Statistics) -> bool {
    let best = statistics.preconditioned();
    (best.estimate - 1.0).abs() < 5.0 * best.std_error.unwrap_or(0.0) + 1e-5
}
