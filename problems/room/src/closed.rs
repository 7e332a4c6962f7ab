//! Is a room closed? Exact, by signs; and if not, where light leaves.

use alloc::collections::BTreeSet;
use alloc::vec::Vec;
use core::cmp::Ordering;
use fredholm_core::array::Each;
use fredholm_surfaces::Forest;

use crate::error::Place;
use crate::geometry::{Backs, Wall, nobody};
use crate::scene::{Scene, middle, turn};
use crate::vector::{Vector, along, dot, sub};
use crate::{Hit, RoomError};

/// A wall at one of its vertices.
#[derive(Clone, Copy, Debug)]
struct Spoke {
    vertex: u32,
    /// Where the wall begins at the vertex: its active side is to the left of the spoke, otherwise
    /// to the right.
    leaves: bool,
    wall: u32,
    hub: Vector<f64>,
    end: Vector<f64>,
}

/// By angle, at one angle the wall that arrives first.
fn by_angle(a: &Spoke, b: &Spoke) -> Ordering {
    by_direction(a.hub, a.end, b.end).then(a.leaves.cmp(&b.leaves))
}

/// By the angles in (−π, π] of the directions from `hub` to two points: exact signs.
pub(crate) fn by_direction(hub: Vector<f64>, a: Vector<f64>, b: Vector<f64>) -> Ordering {
    // Below, or to the left on the level of the hub: −π is no angle, π is.
    let lower = |end: Vector<f64>| end[1] < hub[1];
    let left = |end: Vector<f64>| end[1] == hub[1] && end[0] < hub[0];
    let half = |end| {
        if lower(end) {
            0
        } else {
            1 + u8::from(left(end))
        }
    };
    let turn = turn(hub, a, b);
    half(a)
        .cmp(&half(b))
        .then(0.0.partial_cmp(&turn).unwrap_or(Ordering::Equal))
}

/// Around every vertex active sectors, between a wall that leaves and the next to the left, which
/// arrives, must alternate with sectors behind walls; and a set of connected walls must be in an
/// active region of another exactly where its own outside is active. Then every active region is
/// bounded, and by active sides only. In each a wall must absorb.
pub(crate) fn check(scene: &Scene, absorbs: &dyn Fn(&Wall<f64>) -> bool) -> Result<(), RoomError> {
    let mut spokes = spokes(&scene.walls);
    spokes.sort_by(|a, b| a.vertex.cmp(&b.vertex).then_with(|| by_angle(a, b)));
    let mut component = Forest::new(scene.vertices.len());
    // Of walls, by the active region that they bound.
    let mut region = Forest::new(scene.walls.len());
    for around in spokes.chunk_by(|a, b| a.vertex == b.vertex) {
        let next = around.iter().cycle().skip(1);
        if let Some((bad, _)) = around.iter().zip(next).find(|(a, b)| a.leaves == b.leaves) {
            return Err(open(scene, around, bad.wall));
        }
        let next = around.iter().cycle().skip(1);
        for (a, b) in around.iter().zip(next).filter(|(a, _)| a.leaves) {
            region.unite(a.wall, b.wall);
        }
    }
    for wall in &scene.walls {
        component.unite(wall.vertices[0], wall.vertices[1]);
    }
    // The leftmost vertex of every set of connected walls, the lowest of these: its last spoke is
    // the one before the direction to the left.
    let mut outermost: Vec<Option<Spoke>> = alloc::vec![None; scene.vertices.len()];
    for around in spokes.chunk_by(|a, b| a.vertex == b.vertex) {
        let (Some(&last), Some(first)) = (around.last(), around.first()) else {
            continue;
        };
        let set = component.root(first.vertex);
        if let Some(place) = outermost.get_mut(set as usize) {
            let better = place.is_none_or(|best| {
                let [bx, by] = best.hub;
                last.hub[0] < bx || (last.hub[0] == bx && last.hub[1] < by)
            });
            if better {
                *place = Some(last);
            }
        }
    }
    for spoke in outermost.iter().flatten() {
        if let Some(around) = check_outside(scene, spoke)? {
            region.unite(spoke.wall, around);
        }
    }
    check_absorption(scene, &mut region, absorbs)
}

/// In every active region a wall must absorb.
fn check_absorption(
    scene: &Scene,
    region: &mut Forest,
    absorbs: &dyn Fn(&Wall<f64>) -> bool,
) -> Result<(), RoomError> {
    let walls = (0..).zip(&scene.walls);
    let absorbing = walls.filter(|(_, wall)| absorbs(wall));
    let good: BTreeSet<u32> = absorbing.map(|(w, _)| region.root(w)).collect();
    let mut walls = 0..scene.walls.len() as u32;
    let none = walls.find(|&w| !good.contains(&region.root(w)));
    none.map_or(Ok(()), |wall| {
        Err(RoomError::NothingAbsorbs(place(scene, wall)))
    })
}

/// What is to the left of the leftmost vertex of a set? A wall of the active region around it, if it is in one.
fn check_outside(scene: &Scene, last: &Spoke) -> Result<Option<u32>, RoomError> {
    let left = [-1.0, 0.0];
    let nobody = nobody(last.hub);
    let geometry = scene.geometry();
    let hit = geometry.nearest(&nobody, u32::MAX, last.hub, left, Backs::Block);
    let sees_active = hit.is_some_and(|hit| !hit.back);
    if sees_active == last.leaves {
        return Ok(hit.filter(|_| sees_active).map(|hit| hit.wall));
    }
    let (from, direction) = match hit {
        Some(Hit { distance, back, .. }) if !back => (along(last.hub, distance, left), [1.0, 0.0]),
        _ => (last.hub, left),
    };
    Err(RoomError::Open {
        at: place(scene, last.wall),
        from,
        direction,
    })
}

fn spokes(walls: &[Wall<f64>]) -> Vec<Spoke> {
    let of = |(w, wall): (usize, &Wall<f64>)| {
        [(0, 1, true), (1, 0, false)].each(|(at, to, leaves)| Spoke {
            vertex: wall.vertices[at],
            leaves,
            wall: w as u32,
            hub: wall.ends[at],
            end: wall.ends[to],
        })
    };
    walls.iter().enumerate().flat_map(of).collect()
}

/// Which vertices stand out into the room: an active sector of more than a half turn is around
/// them.
pub(crate) fn standing_out(scene: &Scene) -> Vec<bool> {
    let mut out = alloc::vec![false; scene.vertices.len()];
    let mut spokes = spokes(&scene.walls);
    spokes.sort_by(|a, b| a.vertex.cmp(&b.vertex).then_with(|| by_angle(a, b)));
    for around in spokes.chunk_by(|a, b| a.vertex == b.vertex) {
        let next = around.iter().cycle().skip(1);
        let stands = around.iter().zip(next).any(|(a, b)| {
            let turn = turn(a.hub, a.end, b.end);
            let ahead = dot(sub(a.end, a.hub), sub(b.end, b.hub)) > 0.0;
            a.leaves && (turn < 0.0 || (turn == 0.0 && ahead)) || a.leaves == b.leaves
        });
        let vertex = around.first().map_or(u32::MAX, |s| s.vertex);
        if let Some(place) = out.get_mut(vertex as usize) {
            *place = stands;
        }
    }
    out
}

fn place(scene: &Scene, wall: u32) -> Place {
    scene.place(wall as usize).unwrap_or(Place {
        surface: 0,
        vertex: 0,
    })
}

/// The way out near a vertex around which active sides and backs do not alternate: the first of
/// some promising rays that leaves, or meets a back.
fn open(scene: &Scene, around: &[Spoke], bad: u32) -> RoomError {
    let mut rays: Vec<(u32, Vector<f64>, Vector<f64>)> = Vec::new();
    for spoke in around {
        let Some(wall) = scene.walls.get(spoke.wall as usize) else {
            continue;
        };
        let (from, normal) = (middle(wall), wall.normal());
        rays.push((spoke.wall, from, normal));
        // Closely past the vertex.
        for power in [1, 2, 3, 4, 6, 9] {
            let aside = 1.0 / f64::from(10_u32.pow(power));
            rays.push((spoke.wall, from, along(sub(spoke.hub, from), aside, normal)));
        }
        // To the backs of the others, near the vertex.
        for other in around.iter().filter(|other| other.wall != spoke.wall) {
            for power in 1..=20 {
                let share = 1.0 / f64::from(1_u32 << power);
                let near = along(spoke.hub, share, sub(spoke.end, spoke.hub));
                let to = along(other.hub, share, sub(other.end, other.hub));
                rays.push((spoke.wall, near, sub(to, near)));
            }
        }
        // To the back of this one, from what is behind it.
        let behind = normal.each(|x| -x);
        if let Some(hit) = scene.probe(spoke.wall as usize, from, behind)
            && !hit.back
        {
            let at = along(from, hit.distance, behind);
            rays.push((hit.wall, at, normal));
        }
    }
    // Into a gap beyond the vertex, from all over the room.
    for power in 1..=12 {
        let share = 1.0 / (10_u64.pow(power) as f64);
        for spoke in around {
            let beyond = along(spoke.hub, share, sub(spoke.hub, spoke.end));
            let from = spread(scene).take(64);
            rays.extend(from.map(|(wall, from, _)| (wall, from, sub(beyond, from))));
        }
    }
    for (wall, from, direction) in rays.iter().copied().chain(spread(scene)) {
        let active = scene
            .walls
            .get(wall as usize)
            .is_some_and(|w| dot(w.normal(), direction) > 0.0);
        if active
            && scene
                .probe(wall as usize, from, direction)
                .is_none_or(|hit| hit.back)
        {
            return RoomError::Open {
                at: place(scene, bad),
                from,
                direction,
            };
        }
    }
    let spoke = around.first();
    let hub = spoke.map_or([0.0; 2], |s| s.hub);
    let from = spoke
        .and_then(|s| scene.walls.get(s.wall as usize))
        .map_or(hub, middle);
    RoomError::Open {
        at: place(scene, bad),
        from,
        direction: sub(hub, from),
    }
}

/// Rays from everywhere, evenly spread: multiples of irrational numbers (Weyl 1916).
fn spread(scene: &Scene) -> impl Iterator<Item = (u32, Vector<f64>, Vector<f64>)> {
    let count = scene.walls.len() as f64;
    let fraction = |x: f64| x - (x as u64) as f64;
    (1..10_000_u32).filter_map(move |k| {
        let k = f64::from(k);
        let place = count * fraction(k * 0.618_033_988_749_895);
        let w = place as u32;
        let wall = scene.walls.get(w as usize)?;
        let from = along(wall.ends[0], fraction(place) * wall.length, wall.tangent);
        let xi = fraction(k * core::f64::consts::SQRT_2);
        Some((w, from, crate::geometry::lambert(wall, xi)))
    })
}
