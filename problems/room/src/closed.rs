//! Is a room closed? Exact, by signs; and if not, where light leaves.

use alloc::collections::BTreeSet;
use alloc::vec::Vec;
use fredholm_core::array::Each;
use fredholm_surfaces::Forest;
use fredholm_surfaces::space::ring;

use crate::error::Place;
use crate::geometry::{Backs, Wall, nobody};
use crate::scene::{Scene, middle, turn};
use crate::sides::Sides;
use crate::vector::{Vector, along, dot, sub};
use crate::{Hit, RoomError};

/// Whether what is to the left of a side, and what is to the right of the next around their start, are both active or both backs.
fn agrees(sides: &Sides, [right, left]: [usize; 2]) -> bool {
    sides.walls[right].is_some() == sides.walls[left ^ 1].is_some()
}

/// Around every vertex active sectors, between a wall that leaves and the next to the left, which
/// arrives, must alternate with sectors behind walls; and a set of connected walls must be in an
/// active region of another exactly where its own outside is active. Then every active region is
/// bounded, and by active sides only. In each a wall must absorb.
pub(crate) fn check(scene: &Scene, absorbs: &dyn Fn(&Wall<f64>) -> bool) -> Result<(), RoomError> {
    let sides = Sides::new(scene);
    for fan in sides.fans() {
        if let Some([bad, _]) = ring(fan).find(|&sector| !agrees(&sides, sector)) {
            let bad = sides.walls[bad].or_else(|| sides.walls[bad ^ 1]);
            return Err(open(scene, &sides, fan, bad.unwrap_or(u32::MAX)));
        }
    }
    let mut regions = Forest::new(sides.cycles);
    for &side in &sides.outermost {
        if let Some(around) = check_outside(scene, &sides, side)? {
            regions.unite(
                sides.cycle[side] as u32,
                sides.cycle[sides.of_walls[around as usize]] as u32,
            );
        }
    }
    let mut region = |wall: u32| regions.root(sides.cycle[sides.of_walls[wall as usize]] as u32);
    let walls = (0..).zip(&scene.walls);
    let absorbing = walls.filter(|(_, wall)| absorbs(wall));
    let good: BTreeSet<u32> = absorbing.map(|(w, _)| region(w)).collect();
    let mut walls = 0..scene.walls.len() as u32;
    let none = walls.find(|&w| !good.contains(&region(w)));
    none.map_or(Ok(()), |wall| {
        Err(RoomError::NothingAbsorbs(place(scene, wall)))
    })
}

/// What is to the left of the leftmost vertex of a set? A wall of the active region around it, if it is in one.
fn check_outside(scene: &Scene, sides: &Sides, last: usize) -> Result<Option<u32>, RoomError> {
    let (left, hub) = ([-1.0, 0.0], sides.place(scene, last));
    let hit = scene
        .geometry()
        .nearest(&nobody(hub), u32::MAX, hub, left, Backs::Block);
    let sees_active = hit.is_some_and(|hit| !hit.back);
    let own = sides.walls[last];
    if sees_active == own.is_some() {
        return Ok(hit.filter(|_| sees_active).map(|hit| hit.wall));
    }
    let (from, direction) = match hit {
        Some(Hit { distance, back, .. }) if !back => (along(hub, distance, left), [1.0, 0.0]),
        _ => (hub, left),
    };
    let wall = own.or_else(|| sides.walls[last ^ 1]).unwrap_or(u32::MAX);
    Err(RoomError::Open {
        at: place(scene, wall),
        from,
        direction,
    })
}

/// Which vertices stand out into the room: an active sector of more than a half turn is around
/// them.
pub(crate) fn standing_out(scene: &Scene) -> Vec<bool> {
    let sides = Sides::new(scene);
    let mut out = alloc::vec![false; scene.vertices.len()];
    let at = |side: usize| sides.place(scene, side);
    for fan in sides.fans() {
        let stands = ring(fan).any(|[a, b]| {
            let (hub, right, left) = (at(a), at(a ^ 1), at(b ^ 1));
            let turn = turn(hub, right, left);
            let ahead = dot(sub(right, hub), sub(left, hub)) > 0.0;
            let is_wide = turn < 0.0 || (turn == 0.0 && ahead);
            sides.walls[a].is_some() && is_wide || !agrees(&sides, [a, b])
        });
        let vertex = fan.first().map_or(u32::MAX, |&side| sides.starts[side]);
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

/// A wall at one of its vertices.
#[derive(Clone, Copy, Debug)]
struct Spoke {
    wall: u32,
    hub: Vector<f64>,
    end: Vector<f64>,
}

/// The way out near a vertex around which active sides and backs do not alternate: the first of
/// some promising rays that leaves, or meets a back.
fn open(scene: &Scene, sides: &Sides, fan: &[usize], bad: u32) -> RoomError {
    // At one angle the wall that arrives first.
    let spokes = fan.iter().flat_map(|&side| {
        let walls = [side ^ 1, side].map(|own| sides.walls[own]);
        let [hub, end] = [side, side ^ 1].map(|own| sides.place(scene, own));
        let spoke = move |wall| Spoke { wall, hub, end };
        walls.into_iter().flatten().map(spoke)
    });
    let around: Vec<Spoke> = spokes.collect();
    let mut rays: Vec<(u32, Vector<f64>, Vector<f64>)> = Vec::new();
    for spoke in &around {
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
        for spoke in &around {
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
