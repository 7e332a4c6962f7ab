//! What a point sees of a part of a wall: exact, by visible intervals.

use fredholm_core::Real;
use fredholm_core::array::Each;
use num_traits::zero;

use crate::geometry::{Geometry, Node, Segment, Wall, factor, nobody};
use crate::vector::{Vector, cross, dot, sub};

/// A part of a wall, from one point to another in the wall's direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part<F> {
    pub(crate) wall: u32,
    pub(crate) ends: [Vector<F>; 2],
    pub(crate) length: F,
}

/// A point of a wall that looks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Viewer<F> {
    pub(crate) wall: u32,
    pub(crate) position: Vector<F>,
}

/// The directions to the two ends of a part, turned into the half plane before the viewer's wall.
/// `None`: the part is seen from behind or is behind the viewer.
#[inline]
fn directions<F: Real>(
    from: &Wall<F>,
    position: Vector<F>,
    part: &Part<F>,
    to: &Wall<F>,
) -> Option<[Vector<F>; 2]> {
    let [first, last] = to.vertices;
    // Of a thin wall one side does not see the other, wherever rounding puts the point.
    if !(to.height(position) > zero()) || from.vertices == [last, first] {
        return None;
    }
    in_front(from, part.ends.each(|end| sub(end, position)))
}

/// The directions between two, from right to left, that lead to the active side of a wall.
#[inline]
pub(crate) fn in_front<F: Real>(
    from: &Wall<F>,
    mut directions: [Vector<F>; 2],
) -> Option<[Vector<F>; 2]> {
    let heights = directions.each(|d| dot(from.normal(), d));
    if !(heights[0] > zero() || heights[1] > zero()) {
        return None;
    }
    let [tx, ty] = from.tangent;
    // Seen from before it, a wall goes from right to left.
    if heights[0] < zero() {
        directions[0] = [tx, ty];
    }
    if heights[1] < zero() {
        directions[1] = [-tx, -ty];
    }
    (cross(directions[0], directions[1]) > zero()).then_some(directions)
}

impl<F: Real> Geometry<'_, F> {
    /// The form factor from a point to a part that it sees wholly, where nothing but the two walls'
    /// own half planes is in the way.
    #[inline(always)]
    pub(crate) fn unobstructed(&self, from: &Viewer<F>, part: &Part<F>) -> F {
        let (Some(own), Some(other)) = (self.wall(from.wall), self.wall(part.wall)) else {
            return F::NAN;
        };
        let height = other.height(from.position);
        let [a, b] = part.ends.each(|end| sub(end, from.position));
        let nothing = [zero(); 2];
        if height > zero() && a != nothing && b != nothing {
            return factor(own.normal(), a, b, height * part.length);
        }
        // In a corner, or within rounding of it: the walls there fill the angle up to the horizon.
        let [tx, ty] = own.tangent;
        let (a, b) = if part.ends[0] == own.ends[1] {
            ([tx, ty], b)
        } else if part.ends[1] == own.ends[0] {
            (a, [-tx, -ty])
        } else {
            return zero();
        };
        factor(own.normal(), a, b, cross(a, b))
    }

    /// Calls `piece` for every visible interval of directions, from right to left, and tells it
    /// whether that is the whole part.
    // Never inlined: the loop over shadows has more registers by itself, whatever calls it.
    #[inline(never)]
    pub(crate) fn visible_pieces(
        &self,
        from: &Viewer<F>,
        part: &Part<F>,
        piece: impl FnMut(bool, Vector<F>, Vector<F>),
    ) {
        let (Some(own), Some(other)) = (self.wall(from.wall), self.wall(part.wall)) else {
            return;
        };
        // A wall does not see itself, wherever rounding puts the point.
        if from.wall == part.wall {
            return;
        }
        if let Some(directions) = directions(own, from.position, part, other) {
            self.sweep((own, from), (other, part), directions, piece);
        }
    }

    /// Calls `piece` for every interval of directions in which a point between the walls sees a
    /// wall from its active side, from right to left.
    #[inline]
    pub(crate) fn seen_pieces(
        &self,
        position: Vector<F>,
        wall: u32,
        mut piece: impl FnMut(Vector<F>, Vector<F>),
    ) {
        let Some(other) = self.wall(wall) else {
            return;
        };
        let directions = other.ends.each(|end| sub(end, position));
        if !(other.height(position) > zero() && cross(directions[0], directions[1]) > zero()) {
            return;
        }
        let part = other.part(wall);
        let from = Viewer {
            wall: u32::MAX,
            position,
        };
        let nobody = nobody(position);
        self.sweep((&nobody, &from), (other, &part), directions, |_, a, b| {
            piece(a, b);
        });
    }

    /// Calls `piece` for every interval of directions between two, from right to left, in which nothing is in the way of a ray from a
    /// point of a wall, or from nobody's.
    pub(crate) fn open_pieces(
        &self,
        own: &Wall<F>,
        from: &Viewer<F>,
        between: [Vector<F>; 2],
        mut piece: impl FnMut(Vector<F>, Vector<F>),
    ) {
        let [right, left] = between;
        if !(cross(right, left) > zero()) {
            return;
        }
        // A wall of which everything is in front.
        let mut far = nobody(from.position);
        far.tangent = [zero(); 2];
        let part = far.part(u32::MAX);
        self.sweep((own, from), (&far, &part), between, |_, a, b| piece(a, b));
    }

    /// The pieces of a part between two directions that no segment hides.
    fn sweep(
        &self,
        (own, from): (&Wall<F>, &Viewer<F>),
        (other, part): (&Wall<F>, &Part<F>),
        [right, left]: [Vector<F>; 2],
        mut piece: impl FnMut(bool, Vector<F>, Vector<F>),
    ) {
        let x = from.position;
        let uncut = part.ends.each(|end| sub(end, x));
        let mut low = right;
        // Every turn of the loop passes at least one end of a shadow.
        for _ in 0..=2 * self.all().len() {
            let (mut reach, mut next) = (low, left);
            let outside = |node: &Node<F>| beyond(node, x, low, left, part, other);
            self.visit(outside, |segment| {
                let Some([a, b]) = shadow(segment, from, own, part, other, [low, left]) else {
                    return;
                };
                if !(cross(low, a) > zero()) {
                    if cross(reach, b) > zero() {
                        reach = b;
                    }
                } else if cross(a, next) > zero() {
                    next = a;
                }
            });
            if cross(low, reach) > zero() {
                low = reach;
            } else {
                piece([low, next] == uncut, low, next);
                low = next;
            }
            if !(cross(low, left) > zero()) {
                break;
            }
        }
    }
}

/// Whether a box is outside the triangle of a point and a part seen between two directions.
#[inline]
fn beyond<F: Real>(
    node: &Node<F>,
    x: Vector<F>,
    low: Vector<F>,
    high: Vector<F>,
    part: &Part<F>,
    wall: &Wall<F>,
) -> bool {
    let to = sub(node.centre, x);
    let size = |d: Vector<F>| d[0].abs() * node.half[1] + d[1].abs() * node.half[0];
    let behind = cross(wall.tangent, sub(node.centre, part.ends[0]));
    cross(low, to) < -size(low) || cross(to, high) < -size(high) || behind < -size(wall.tangent)
}

/// The directions between `low` and `high` in which a segment hides a part: from right to left.
// Always: it is called for every segment of every sweep.
#[inline(always)]
fn shadow<F: Real>(
    segment: &Segment<F>,
    from: &Viewer<F>,
    own: &Wall<F>,
    part: &Part<F>,
    other: &Wall<F>,
    [low, high]: [Vector<F>; 2],
) -> Option<[Vector<F>; 2]> {
    // The walls themselves and their twins on the back hide nothing.
    if twins(segment.vertices, own.vertices) || twins(segment.vertices, other.vertices) {
        return None;
    }
    let [mut a, mut b] = segment.ends.each(|end| sub(end, from.position));
    let turn = cross(a, b);
    if turn < zero() {
        (a, b) = (b, a);
    } else if !(turn > zero()) {
        return None;
    }
    // Two angles below π meet where the right side of one lies in the other.
    let inside = |d: Vector<F>| cross(low, d) >= zero() && cross(d, high) > zero();
    let begin = if inside(a) {
        a
    } else if cross(a, low) >= zero() && cross(low, b) > zero() {
        low
    } else {
        return None;
    };
    // From a point in line with the segment its two ends may be one direction up to rounding, and then so may the second
    // and `low`: it ends there, and hides nothing beyond. In every case it ends to the left of where it begins.
    let end = if cross(b, high) >= zero() { b } else { high };
    is_before(segment, from, part, other).then_some([begin, end])
}

#[inline]
pub(crate) fn twins(a: [u32; 2], b: [u32; 2]) -> bool {
    a == b || a == [b[1], b[0]]
}

/// Whether a segment, some of whose directions from a point are those of a part, is nearer than it.
#[inline]
fn is_before<F: Real>(
    segment: &Segment<F>,
    from: &Viewer<F>,
    part: &Part<F>,
    other: &Wall<F>,
) -> bool {
    let mut heights = [zero::<F>(); 2];
    for ((height, end), vertex) in heights.iter_mut().zip(segment.ends).zip(segment.vertices) {
        if vertex != other.vertices[0] && vertex != other.vertices[1] {
            *height = other.height(end);
        }
    }
    if heights[0] >= zero() && heights[1] >= zero() {
        return true;
    }
    if heights[0] <= zero() && heights[1] <= zero() {
        return false;
    }
    // The segment crosses the line of the other wall outside the part, so the part is on one side
    // of the segment's line.
    let [a, b] = segment.ends;
    let span = sub(b, a);
    let side = |p: Vector<F>| cross(span, sub(p, a));
    let beyond = side(part.ends[0]) + side(part.ends[1]);
    let here = side(from.position);
    (here > zero()) != (beyond > zero())
}

#[cfg(test)]
mod tests {
    use alloc::vec;
    use alloc::vec::Vec;
    use core::f64::consts::{PI, TAU};

    use crate::{Enclosure, Grading, Material, Mesh, Scene, Seen, Surface, Tables};

    /// A square of this size with 16 triangles in it whose vertices are on a lattice, as drawings are.
    fn outlines(state: &mut u64, unit: f64) -> Vec<Vec<[f64; 2]>> {
        let mut next = || {
            *state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            1.0 + ((*state >> 33) % 8) as f64
        };
        let mut outlines = vec![vec![
            [0.0, 0.0],
            [40.0, 0.0],
            [40.0, 40.0],
            [0.0, 40.0],
            [0.0; 2],
        ]];
        for place in 0..16_u32 {
            let [x, y] = [place / 4, place % 4].map(|k| 10.0 * f64::from(k));
            let [a, b, c] = [(); 3].map(|()| [x + next(), y + next()]);
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            // The active side is outside.
            if area < 0.0 {
                outlines.push(vec![a, b, c, a]);
            } else if area > 0.0 {
                outlines.push(vec![a, c, b, a]);
            }
        }
        let scaled = |points: &Vec<[f64; 2]>| points.iter().map(|p| p.map(|x| x * unit)).collect();
        outlines.iter().map(scaled).collect()
    }

    /// Points in line with walls see walls all around, as others do: what is seen edge on hides nothing, whichever way
    /// rounding turns it.
    #[test]
    fn points_in_line_with_walls_see_all_around() {
        let material = [Material {
            reflectance: 0.5,
            emission: 1.0,
        }];
        let mut state = 1;
        for layout in 0..6 {
            let unit = [0.05, 0.1, 0.025][layout % 3];
            let outlines = outlines(&mut state, unit);
            let of = |points| Surface {
                points,
                materials: &material,
            };
            let surfaces: Vec<Surface<'_>> = outlines.iter().map(|points| of(points)).collect();
            let scene = Scene::new::<f64>(&surfaces, Enclosure::Closed).unwrap();
            let mesh = Mesh::new::<f64>(&scene, 10, Grading::default()).unwrap();
            let tables = Tables::<f64>::new(&scene, &mesh);
            let room = &tables.room();
            for number in 0..160 * 160 {
                let pixel = 40.0 * unit / 160.0;
                let position = [number / 160, number % 160].map(|k| (f64::from(k) + 0.5) * pixel);
                let mut sum = 0.0;
                Seen { room, position }.cells(|_, angle| sum += angle);
                // Nothing within an obstacle, and one half on the edge of one.
                let good = [0.0, PI, TAU].iter().any(|all| (sum - all).abs() < 1e-9);
                assert!(good, "{layout}: {position:?} sees {sum}");
            }
        }
    }
}
