//! Where the edges of shadows meet walls.

use alloc::vec::Vec;
use fredholm_core::array::Each;

use crate::closed::standing_out;
use crate::geometry::{Backs, nobody};
use crate::outside::Outside;
use crate::scene::Scene;
use crate::vector::{Vector, along, cross, norm, sub};
use crate::views::ShadowEnd;

/// Distances along every wall at which an end of a light, or a sun, is in line with a vertex that stands out
/// into the room, both seen: there its shadow begins or ends, and u has a kink. A few are listed
/// that change nothing.
pub(crate) fn of_lights(scene: &Scene) -> Vec<Vec<f64>> {
    lines(
        scene,
        &outstanding(scene),
        &ends_of_lights(scene),
        &suns(scene),
    )
}

/// Distances along every wall at which a sun's shadow has an edge, where F itself jumps; none if there is no sun.
pub(crate) fn of_suns(scene: &Scene) -> Vec<Vec<f64>> {
    match &*suns(scene) {
        [] => Vec::new(),
        suns => lines(scene, &outstanding(scene), &[], suns),
    }
}

/// The directions towards the suns.
fn suns(scene: &Scene) -> Vec<Vector<f64>> {
    let suns = scene.outside.iter();
    let suns = suns.filter(|own| matches!(own, Outside::Sun { .. }));
    suns.flat_map(Outside::ends).copied().collect()
}

/// The ends of the shadows of lights on the walls of a scene, where u has kinks.
pub(crate) fn ends(scene: &Scene) -> Vec<ShadowEnd> {
    let walls = (0..).zip(&scene.walls).zip(of_lights(scene));
    let ends = walls.flat_map(|((number, wall), places)| {
        let end = move |distance: f64| ShadowEnd {
            wall: number,
            position: along(wall.ends[0], distance, wall.tangent),
        };
        places.into_iter().map(end)
    });
    ends.collect()
}

/// The vertices at which the emission jumps.
fn ends_of_lights(scene: &Scene) -> Vec<u32> {
    let mut ends: Vec<Option<[f64; 2]>> = alloc::vec![None; scene.vertices.len()];
    for wall in &scene.walls {
        for vertex in wall.vertices {
            if let Some(range) = ends.get_mut(vertex as usize) {
                let [low, high] = range.unwrap_or([wall.emission; 2]);
                *range = Some([low.min(wall.emission), high.max(wall.emission)]);
            }
        }
    }
    let jumps = |v: &u32| {
        let range = ends.get(*v as usize).copied().flatten();
        range.is_some_and(|[low, high]| low < high)
    };
    let mut used = used(scene);
    used.retain(jumps);
    used
}

/// The cuts for every vertex behind one that stands out: all places at which what is seen of the
/// walls changes.
pub(crate) fn kinks(scene: &Scene) -> Vec<Vec<f64>> {
    let ends: Vec<_> = scene
        .outside
        .iter()
        .flat_map(Outside::ends)
        .copied()
        .collect();
    lines(scene, &outstanding(scene), &used(scene), &ends)
}

/// The vertices that stand out into the room.
fn outstanding(scene: &Scene) -> Vec<u32> {
    let out = standing_out(scene);
    let mut used = used(scene);
    used.retain(|&v| out.get(v as usize) == Some(&true));
    used
}

/// The vertices that walls have, once each.
pub(crate) fn used(scene: &Scene) -> Vec<u32> {
    let mut used: Vec<u32> = scene.walls.iter().flat_map(|w| w.vertices).collect();
    used.sort_unstable();
    used.dedup();
    used
}

/// Where lines from a vertex of `far`, or from one of the directions, past one of `near` meet a wall in sight of the latter.
fn lines(scene: &Scene, near: &[u32], far: &[u32], farthest: &[Vector<f64>]) -> Vec<Vec<f64>> {
    let geometry = scene.geometry();
    let mut places: Vec<Vec<f64>> = alloc::vec![Vec::new(); scene.walls.len()];
    let at = |v: u32| scene.vertices.get(v as usize).copied().unwrap_or_default();
    for &v in near {
        let hub = at(v);
        let cast = |d: Vector<f64>| geometry.nearest(&nobody(hub), u32::MAX, hub, d, Backs::Block);
        let far = far.iter().filter(|&&w| w != v).map(|&w| sub(at(w), hub));
        let far = far.map(|to| (to, norm(to), norm(to)));
        let farthest = farthest.iter().map(|&to| (to, 1.0, f64::INFINITY));
        for (to, size, length) in far.chain(farthest) {
            let d = [to[0] / size, to[1] / size];
            // A ray through a vertex passes it on one side; vertices are often in line, and this is
            // about what can be seen from either side.
            let either = [0.0, 1e-9, -1e-9].each(|turn| [d[0] - turn * d[1], d[1] + turn * d[0]]);
            let seen =
                |d: &Vector<f64>| cast(*d).is_none_or(|hit| hit.distance >= length * (1.0 - 1e-6));
            if !either.iter().any(seen) {
                continue;
            }
            let mut last = u32::MAX;
            for d in either {
                let hit = cast([-d[0], -d[1]]);
                let Some(hit) = hit.filter(|hit| !hit.back && hit.wall != last) else {
                    continue;
                };
                last = hit.wall;
                let wall = scene.walls.get(hit.wall as usize);
                let own = places.get_mut(hit.wall as usize);
                if let (Some(wall), Some(own)) = (wall, own) {
                    // hub + s·to on the line of the wall.
                    let turn = cross(wall.tangent, to);
                    let place = cross(sub(hub, wall.ends[0]), to) / turn;
                    if place > 0.0 && place < wall.length {
                        own.push(place);
                    }
                }
            }
        }
    }
    for own in &mut places {
        own.sort_by(f64::total_cmp);
        own.dedup();
    }
    places
}
