//! Parts of walls on which obstacles stand: nothing sees them, and they are left out. Exact, by signs.

use alloc::vec::Vec;

use crate::error::Place;
use crate::scene::Scene;
use crate::sides::Sides;
use crate::vector::{Vector, cross, norm, sub};

/// A part of a surface that lies under another, and so is left out of the room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covered {
    /// The segment of which it is a part.
    pub place: Place,
    /// The ends of the part, in the direction of the segment.
    pub ends: [[f64; 2]; 2],
    /// The number of the surface that covers it.
    pub by: usize,
}

/// What is around a region.
#[derive(Clone, Debug, Default)]
struct Region {
    /// The sides that are active.
    active: Vec<usize>,
    /// The sides that are backs.
    backs: Vec<usize>,
    /// Whether it goes round a set of connected walls from outside.
    is_outside: bool,
}

impl Region {
    /// Only active sides, as in a room.
    const fn is_room(&self) -> bool {
        self.backs.is_empty()
    }

    const fn is_mixed(&self) -> bool {
        !self.backs.is_empty() && !self.active.is_empty()
    }
}

/// Whether walls are split from their segments, wall by wall.
fn split(scene: &Scene) -> Vec<bool> {
    let place = |w: usize| scene.place(w);
    let is_same = |a: usize, b: Option<usize>| b.is_some_and(|b| place(a) == place(b));
    let count = scene.walls.len();
    (0..count)
        .map(|w| is_same(w, w.checked_sub(1)) || is_same(w, Some(w + 1).filter(|&b| b < count)))
        .collect()
}

/// The walls that others cover, with the number of the surface that covers them.
///
/// A region with active sides and backs around it is no room. It is the inside of an obstacle, and its active sides are
/// covered by it, if they are parts of longer segments, or lie on others, or are all on one line, and if behind the backs is
/// a room: a wall that was drawn with the wrong active side is none.
pub(crate) fn find(scene: &Scene, is_open: bool) -> Vec<(usize, usize)> {
    let sides = Sides::new(scene);
    let mut regions = alloc::vec![Region::default(); sides.cycles];
    for side in 0..sides.walls.len() {
        let region = &mut regions[sides.cycle[side]];
        match sides.walls[side] {
            Some(_) => region.active.push(side),
            None => region.backs.push(side),
        }
    }
    for &side in &sides.outermost {
        regions[sides.cycle[side]].is_outside = true;
    }
    if !regions.iter().any(Region::is_mixed) {
        return Vec::new();
    }
    let judge = Judge {
        scene,
        is_open,
        sides,
        split: split(scene),
        regions,
    };
    judge.covered()
}

/// What is needed to tell obstacles.
struct Judge<'a> {
    scene: &'a Scene,
    is_open: bool,
    sides: Sides,
    split: Vec<bool>,
    regions: Vec<Region>,
}

impl Judge<'_> {
    /// The region on the other side.
    fn beyond(&self, side: usize) -> &Region {
        &self.regions[self.sides.cycle[side ^ 1]]
    }

    /// The surface of the wall whose active side this is.
    fn surface(&self, side: usize) -> Option<usize> {
        let place = self.scene.place(self.sides.walls[side]? as usize)?;
        Some(place.surface)
    }

    /// The surface around a region that covers what is active there.
    fn cover(&self, region: &Region) -> Option<usize> {
        self.surface(region.backs.first()? ^ 1)
    }

    /// Whether a region is the inside of an obstacle that stands on walls.
    fn is_inside(&self, number: usize, region: &Region) -> bool {
        if !region.is_mixed() || region.is_outside {
            return false;
        }
        let is_room = |side: &usize| self.beyond(*side).is_room();
        let is_other = |side: &usize| self.sides.cycle[side ^ 1] != number;
        let is_bounded = |side: &usize| !self.beyond(*side).is_outside;
        let is_held = if self.is_open {
            region.backs.iter().all(is_other)
        } else {
            region.backs.iter().any(is_room)
                && region.backs.iter().all(|s| is_room(s) || is_bounded(s))
        };
        let is_part = |side: &usize| {
            let wall = self.sides.walls[*side].unwrap_or(u32::MAX) as usize;
            self.split.get(wall) == Some(&true)
        };
        let lies_on =
            |side: &usize| self.sides.walls[side ^ 1].is_some() && self.beyond(*side).is_mixed();
        let lie = region.active.iter().all(|s| is_part(s) || lies_on(s));
        is_held && (lie || !self.is_open && self.are_in_line(&region.active))
    }

    /// Whether walls lie on one line, up to the scene's smallest distance.
    fn are_in_line(&self, sides: &[usize]) -> bool {
        let wall = |side: &usize| self.scene.walls.get(self.sides.walls[*side]? as usize);
        let mut walls = sides.iter().filter_map(wall);
        let longest = walls.clone().max_by(|a, b| a.length.total_cmp(&b.length));
        let Some(longest) = longest else { return false };
        let [from, to] = longest.ends;
        let span = sub(to, from);
        let aside = |end: &Vector<f64>| cross(span, sub(*end, from)).abs() / norm(span);
        walls.all(|wall| {
            wall.ends
                .iter()
                .all(|end| aside(end) <= self.scene.smallest)
        })
    }

    fn covered(&self) -> Vec<(usize, usize)> {
        let numbered = self.regions.iter().enumerate();
        let inside: Vec<bool> = numbered.map(|(i, r)| self.is_inside(i, r)).collect();
        let is_inside = |side: usize| inside[self.sides.cycle[side]];
        let mut covered = Vec::new();
        for region in self.regions.iter().filter(|region| region.is_mixed()) {
            for &side in &region.active {
                // What is inside, or the underside of an obstacle, which lies on what it covers.
                let by = if is_inside(side) {
                    self.cover(region)
                } else if is_inside(side ^ 1) && self.is_underside(side) {
                    self.surface(side ^ 1)
                } else {
                    None
                };
                if let (Some(by), Some(wall)) = (by, self.sides.walls[side]) {
                    covered.push((wall as usize, by));
                }
            }
        }
        covered.sort_unstable();
        covered
    }

    /// Whether a side lies on another's and, in an open room where nothing else tells it from a thin wall, is of the
    /// obstacle that covers that one.
    fn is_underside(&self, side: usize) -> bool {
        let (Some(own), Some(_)) = (self.surface(side), self.surface(side ^ 1)) else {
            return false;
        };
        let mut around = self.beyond(side).backs.iter();
        !self.is_open || around.any(|back| self.surface(back ^ 1) == Some(own))
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use crate::{Enclosure, Material, Scene, Surface};

    /// A square whose walls are all split by thin partitions of two sides, and in it a screen with one side, split as well.
    /// In an open room, where backs may be seen, only what is behind backs tells that the square is not the inside of an
    /// obstacle: the room itself.
    #[test]
    fn a_screen_in_an_open_room_covers_nothing() {
        let mut lines: Vec<Vec<[f64; 2]>> = [
            [[0.0, 0.0], [4.0, 0.0]],
            [[4.0, 0.0], [4.0, 4.0]],
            [[4.0, 4.0], [0.0, 4.0]],
            [[0.0, 4.0], [0.0, 0.0]],
            [[1.0, 0.0], [1.0, 2.0]],
        ]
        .map(Vec::from)
        .into();
        for [from, to] in [
            [[3.0, 0.0], [3.0, 1.0]],
            [[4.0, 2.0], [3.5, 2.0]],
            [[2.0, 4.0], [2.0, 3.5]],
            [[0.0, 3.0], [0.5, 3.0]],
            [[1.0, 1.0], [1.5, 1.0]],
        ] {
            lines.extend([Vec::from([from, to]), Vec::from([to, from])]);
        }
        let materials = [Material {
            reflectance: 0.5,
            emission: 1.0,
        }];
        let surfaces: Vec<Surface<'_>> = lines
            .iter()
            .map(|points| Surface {
                points,
                materials: &materials,
            })
            .collect();
        let scene = Scene::new::<f64>(&surfaces, Enclosure::Open).unwrap();
        assert_eq!(scene.covered(), []);
        // Without its screen all of it is active, and nothing is an obstacle either.
        let mut without = surfaces.clone();
        without.remove(4);
        without.truncate(12);
        let scene = Scene::new::<f64>(&without, Enclosure::Closed).unwrap();
        assert_eq!(scene.covered(), []);
    }
}
