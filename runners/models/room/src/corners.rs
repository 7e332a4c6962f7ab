//! What cells next to corners add to the variance, in steps that few walks see.

use fredholm_core::galerkin::{PairKind, Pairs as _, Piecewise, Rounded};
use fredholm_core::{Kernel as _, Neighbour as _, TransitionDensity as _};
use fredholm_room::{Cells, Choice, Geometry, Matrix, Mesh, Room, RoomPairs, Scene, Tables};
use fredholm_variance::gauss;

use fredholm_model::Error;

/// Cells at each end of a wall that count as next to its corner.
const NEXT_TO_CORNER: usize = 6;

/// (1 − q0) ∫∫ (k − h)² p over the pairs in S of cells next to the same corner. It is the same for every q0.
pub(super) fn rare<const B: usize>(
    scene: &Scene,
    mesh: &Mesh,
    choice: Choice,
    matrix: &Matrix<'_>,
) -> Result<f64, Error> {
    // As many points as functions would lie where k − h nearly vanishes.
    rare_by::<B>(scene, mesh, choice, matrix, if B == 3 { 2 } else { 3 })
}

/// The estimate with this many Gauss points on a cell.
fn rare_by<const B: usize>(
    scene: &Scene,
    mesh: &Mesh,
    choice: Choice,
    matrix: &Matrix<'_>,
    points: usize,
) -> Result<f64, Error> {
    let tables = Tables::<f64>::new(scene, mesh);
    let (geometry, cells) = (tables.geometry(), tables.cells());
    let corners = Corners::new(&geometry, &cells);
    let (views, absorption) = (matrix.views(), 0.5);
    let room = Room::new(geometry, cells, views, absorption)?;
    let polynomials = room.with_functions::<B>();
    let dense = matrix.coefficients();
    let coefficients = Rounded::<_, f64>::new(&dense);
    let pairs = RoomPairs { views, choice };
    // No solution is asked for.
    let none = vec![0.0; cells.len() * B];
    let neighbour = Piecewise::with_pointwise(&polynomials, &coefficients, pairs, &none, &none)?;
    let rule = gauss(points)?;
    let mut sum = 0.0;
    for (i, j) in corners.pairs() {
        if pairs.kind(i, j) != PairKind::Galerkin {
            continue;
        }
        let area = 0.25 * cells.length(i) * cells.length(j);
        for &(s, u) in &rule {
            for &(t, v) in &rule {
                let place = |s: f64| 0.5 + 0.5 * s;
                let inside = room.inside(i, place(s)).zip(room.inside(j, place(t)));
                let Some((x, y)) = inside else { continue };
                let k = room.kernel(&x, &y);
                let h = neighbour.kernel(&neighbour.locate(x), &neighbour.locate(y), k);
                sum += area * u * v * (k - h).powi(2) * room.density(&x, &y);
            }
        }
    }
    Ok((1.0 - absorption) * sum)
}

/// The vertices that every cell is next to.
struct Corners(Vec<[Option<u32>; 2]>);

impl Corners {
    fn new(geometry: &Geometry<'_, f64>, cells: &Cells<'_, f64>) -> Self {
        let mut all = vec![[None; 2]; cells.len()];
        for (number, wall) in geometry.walls().iter().enumerate() {
            let [from, to] = wall.vertices;
            let own = all.get_mut(cells.range(number as u32)).unwrap_or_default();
            for cell in own.iter_mut().take(NEXT_TO_CORNER) {
                cell[0] = Some(from);
            }
            for cell in own.iter_mut().rev().take(NEXT_TO_CORNER) {
                cell[1] = Some(to);
            }
        }
        Self(all)
    }

    /// All pairs of cells next to the same vertex, vertex by vertex.
    fn pairs(&self) -> Vec<(usize, usize)> {
        let mut near: Vec<(u32, usize)> = Vec::new();
        for (cell, vertices) in self.0.iter().enumerate() {
            near.extend(vertices.iter().flatten().map(|&vertex| (vertex, cell)));
        }
        near.sort_unstable();
        let mut pairs = Vec::new();
        for next in near.chunk_by(|a, b| a.0 == b.0) {
            for &(_, i) in next {
                pairs.extend(next.iter().map(|&(_, j)| (i, j)));
            }
        }
        pairs
    }
}

#[cfg(test)]
mod tests {
    use fredholm_room::{Enclosure, Grading, Material, Surface, min_mass_ratio};

    use super::*;

    /// A square with a wall across a half of it.
    fn scene() -> Scene {
        let wall = |reflectance| {
            [Material {
                reflectance,
                emission: 1.0,
            }]
        };
        let walls = [wall(0.3), wall(0.7), wall(0.5)];
        let points: [&[[f64; 2]]; 3] = [
            &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]],
            &[[0.5, 0.0], [0.5, 0.6]],
            &[[0.5, 0.6], [0.5, 0.0]],
        ];
        let surfaces = [0, 1, 2].map(|k| Surface {
            points: points[k],
            materials: &walls[k],
        });
        Scene::new::<f64>(&surfaces, Enclosure::Closed).unwrap()
    }

    fn check<const B: usize>() {
        let scene = scene();
        let grading = Grading::of_pairs(B - 1);
        for cells in [30, 75, 100] {
            let mesh = Mesh::new::<f64>(&scene, cells, grading).unwrap();
            let matrix = Matrix::with_functions(&scene, &mesh, min_mass_ratio(B - 1), B).unwrap();
            let of = |choice, points| rare_by::<B>(&scene, &mesh, choice, &matrix, points).unwrap();
            let few = rare::<B>(&scene, &mesh, Choice::Default, &matrix).unwrap();
            let many = of(Choice::Default, 32);
            assert!(
                (0.75..1.25).contains(&(few / many)),
                "{cells} cells, {B} functions: {few} and {many}"
            );
            assert_eq!(of(Choice::Pointwise, 3), 0.0);
        }
    }

    #[test]
    fn few_pairs_and_points_are_enough() {
        check::<1>();
        check::<2>();
        check::<3>();
        check::<4>();
        check::<5>();
    }
}
