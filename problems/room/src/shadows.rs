//! Where the edges of shadows meet walls.

use alloc::vec::Vec;
use fredholm_core::array::Each;

use crate::closed::standing_out;
use crate::geometry::{Backs, nobody};
use crate::scene::Scene;
use crate::vector::{Vector, cross, norm, sub};
use crate::views::ShadowEnd;

/// Distances along every wall at which an end of a light is in line with a vertex that stands out
/// into the room, both seen: there its shadow begins or ends, and u has a kink. A few are listed
/// that change nothing.
pub(crate) fn of_lights(scene: &Scene) -> Vec<Vec<f64>> {
    lines(scene, &outstanding(scene), &ends_of_lights(scene))
}

/// The ends of the shadows of lights on the walls of a scene, where u has kinks.
///
/// ```
/// use fredholm_room::{Enclosure, Material, Scene, Shadows, Surface};
///
/// let [grey, lamp] = [(0.5, 0.0), (0.0, 1.0)].map(|(reflectance, emission)| [Material { reflectance, emission }]);
/// // Around a corner at (1.2, 0.75), past which the lamp's upper end is in line with (2.4, 0.75) on the right wall, and its lower
/// // end with (1.92, 1.2) on the ceiling.
/// let points = [[0.0, 0.0], [2.4, 0.0], [2.4, 1.2], [1.2, 1.2], [1.2, 0.75], [0.0, 0.75]];
/// let surfaces = [
///     Surface { points: &points, materials: &grey },
///     Surface { points: &[[0.0, 0.75], [0.0, 0.0]], materials: &lamp },
/// ];
/// let scene = Scene::new::<f64>(&surfaces, Enclosure::Closed)?;
/// assert!(Shadows::new(&scene).ends().any(|[x, y]| (x - 1.92).abs() < 1e-12 && (y - 1.2).abs() < 1e-12));
/// # Ok::<(), fredholm_room::RoomError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Shadows(Vec<ShadowEnd>);

impl Shadows {
    /// Finds where the shadows of the lights of a scene end.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let walls = (0..).zip(&scene.walls).zip(of_lights(scene));
        let all = walls.flat_map(|((number, wall), places)| {
            let ([x, y], [a, b]) = (wall.ends[0], wall.tangent);
            let end = move |along: f64| ShadowEnd {
                wall: number,
                position: [x + along * a, y + along * b],
            };
            places.into_iter().map(end)
        });
        Self(all.collect())
    }

    /// The positions, in the units of the scene.
    pub fn ends(&self) -> impl Iterator<Item = [f64; 2]> {
        self.0.iter().map(|end| end.position)
    }

    pub(crate) fn all(&self) -> &[ShadowEnd] {
        &self.0
    }
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
    lines(scene, &outstanding(scene), &used(scene))
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

/// Where lines from a vertex of `far` past one of `near` meet a wall in sight of the latter.
fn lines(scene: &Scene, near: &[u32], far: &[u32]) -> Vec<Vec<f64>> {
    let geometry = scene.geometry();
    let mut places: Vec<Vec<f64>> = alloc::vec![Vec::new(); scene.walls.len()];
    let at = |v: u32| scene.vertices.get(v as usize).copied().unwrap_or_default();
    for &v in near {
        let hub = at(v);
        let cast = |d: Vector<f64>| geometry.nearest(&nobody(hub), u32::MAX, hub, d, Backs::Block);
        for &w in far.iter().filter(|&&w| w != v) {
            let to = sub(at(w), hub);
            let length = norm(to);
            let d = [to[0] / length, to[1] / length];
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
