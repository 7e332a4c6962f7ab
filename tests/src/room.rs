//! What the checks need to know of rooms, and the scenes of the tests.

use fredholm_core::galerkin::{Dense, Piecewise, PointwiseSource, Solution, rounded};
use fredholm_core::{Located, Real, TransitionDensity};
use fredholm_room::{
    Choice, Enclosure, Grading, Material, Matrix, Mesh, Point, Polynomials, R_MIN, Room, RoomError,
    RoomPairs, Scene, Surface, Tables, Wall, r_min,
};

use crate::description::Description;
use crate::examine::{Offers, Report, examine_both};
use crate::quadrature::{gauss_legendre, split};

/// The absorption probability q0 of the tests.
pub const ABSORPTION: f64 = 0.2;

/// A scene that owns its surfaces.
#[derive(Clone, Debug, Default)]
pub struct Drawing {
    /// What it is called in messages.
    pub name: &'static str,
    /// Vertices and materials of every surface.
    pub surfaces: Vec<(Vec<[f64; 2]>, Vec<Material>)>,
    /// Whether light may leave.
    pub open: bool,
}

impl Drawing {
    /// Nothing yet.
    #[must_use]
    pub fn new(name: &'static str) -> Self {
        Self {
            name,
            ..Self::default()
        }
    }

    /// With a polyline more, of one material.
    #[must_use]
    pub fn line(mut self, points: &[[f64; 2]], reflectance: f64, emission: f64) -> Self {
        let material = Material {
            reflectance,
            emission,
        };
        self.surfaces.push((points.to_vec(), vec![material]));
        self
    }

    /// With an obstacle more: `points` go round it clockwise, so that its outside is active.
    #[must_use]
    pub fn closed(self, points: &[[f64; 2]], reflectance: f64, emission: f64) -> Self {
        let mut points = points.to_vec();
        points.extend(points.first().copied());
        self.line(&points, reflectance, emission)
    }

    /// With a thin baffle more: both sides.
    #[must_use]
    pub fn baffle(self, from: [f64; 2], to: [f64; 2], reflectance: f64) -> Self {
        self.line(&[from, to], reflectance, 0.0)
            .line(&[to, from], reflectance, 0.0)
    }

    /// The same drawing with other materials: surface number → material.
    #[must_use]
    pub fn with(mut self, material: impl Fn(usize) -> Material) -> Self {
        for (s, (_, materials)) in self.surfaces.iter_mut().enumerate() {
            materials.fill(material(s));
        }
        self
    }

    /// Validated.
    ///
    /// # Errors
    /// As [`Scene::new`].
    pub fn scene<F: Real>(&self) -> Result<Scene, RoomError> {
        let surfaces: Vec<Surface<'_>> = self
            .surfaces
            .iter()
            .map(|(points, materials)| Surface { points, materials })
            .collect();
        let enclosure = if self.open {
            Enclosure::Open
        } else {
            Enclosure::Closed
        };
        Scene::new::<F>(&surfaces, enclosure)
    }
}

/// The unit square whose value at a point is known: ρ = .3 .6 .7 .5 and F = 0 1 0 0 on bottom, right, top, left.
#[must_use]
pub fn square() -> Drawing {
    Drawing::new("square")
        .line(&[[0.0, 0.0], [1.0, 0.0]], 0.3, 0.0)
        .line(&[[1.0, 0.0], [1.0, 1.0]], 0.6, 1.0)
        .line(&[[1.0, 1.0], [0.0, 1.0]], 0.7, 0.0)
        .line(&[[0.0, 1.0], [0.0, 0.0]], 0.5, 0.0)
}

/// The rectangle 2 × 1.
#[must_use]
pub fn rectangle() -> Drawing {
    Drawing::new("rectangle")
        .line(&[[0.0, 0.0], [2.0, 0.0]], 0.5, 1.0)
        .line(&[[2.0, 0.0], [2.0, 1.0]], 0.4, 0.0)
        .line(&[[2.0, 1.0], [0.0, 1.0]], 0.5, 0.0)
        .line(&[[0.0, 1.0], [0.0, 0.0]], 0.6, 0.0)
}

/// The L-shaped room: bottom, right, inner horizontal, inner vertical, top, left.
#[must_use]
pub fn l_room() -> Drawing {
    Drawing::new("L-shaped room")
        .line(&[[0.0, 0.0], [3.0, 0.0]], 0.5, 1.0)
        .line(&[[3.0, 0.0], [3.0, 1.0]], 0.6, 0.0)
        .line(&[[3.0, 1.0], [1.0, 1.0]], 0.4, 0.0)
        .line(&[[1.0, 1.0], [1.0, 3.0]], 0.7, 0.0)
        .line(&[[1.0, 3.0], [0.0, 3.0]], 0.3, 0.0)
        .line(&[[0.0, 3.0], [0.0, 0.0]], 0.5, 0.0)
}

/// The unit square with a centred block of half its width: bottom, right, top, left, then the
/// block's bottom, left, top, right.
#[must_use]
pub fn block() -> Drawing {
    square()
        .line(&[[0.75, 0.25], [0.25, 0.25]], 0.5, 0.0)
        .line(&[[0.25, 0.25], [0.25, 0.75]], 0.6, 0.0)
        .line(&[[0.25, 0.75], [0.75, 0.75]], 0.3, 0.0)
        .line(&[[0.75, 0.75], [0.75, 0.25]], 0.7, 0.5)
        .named("block in a square")
}

/// FACET (UCID-19887, 1983): the unit square with two baffles, S1 … S12.
#[must_use]
pub fn facet() -> Drawing {
    const VERTICES: [[f64; 2]; 10] = [
        [0.0, 0.0],
        [0.0, 0.5],
        [0.4, 0.5],
        [0.0, 1.0],
        [1.0, 1.0],
        [1.0, 0.5],
        [0.6, 0.5],
        [1.0, 0.0],
        [0.65, 0.0],
        [0.35, 0.0],
    ];
    const SURFACES: [[usize; 2]; 12] = [
        [2, 1],
        [3, 2],
        [2, 3],
        [4, 2],
        [5, 4],
        [6, 5],
        [7, 6],
        [6, 7],
        [8, 6],
        [9, 8],
        [10, 9],
        [1, 10],
    ];
    let mut drawing = Drawing::new("FACET");
    for (s, [a, b]) in SURFACES.into_iter().enumerate() {
        let reflectance = 0.2 + 0.05 * s as f64;
        let emission = if s == 4 { 1.0 } else { 0.0 };
        let ends = [VERTICES[a - 1], VERTICES[b - 1]];
        drawing = drawing.line(&ends, reflectance, emission);
    }
    drawing
}

/// Two rooms and a doorway; the lamp is in the left one. The wall between them is thick, and meets
/// the outline in the middle of its sides.
#[must_use]
pub fn doorway() -> Drawing {
    Drawing::new("two rooms and a doorway")
        .line(&[[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]], 0.6, 0.0)
        .line(&[[0.0, 2.0], [0.0, 0.0]], 0.4, 1.0)
        // Below the doorway a thick wall, above it a thin one.
        .line(&[[1.9, 0.0], [1.9, 0.7], [2.1, 0.7], [2.1, 0.0]], 0.5, 0.0)
        .baffle([2.0, 1.2], [2.0, 2.0], 0.5)
        .opened([1.9, 2.1])
}

/// A furnished room: a lamp on the ceiling, a table, a cupboard in the corner, a picture, a screen
/// at an angle.
#[must_use]
pub fn furnished() -> Drawing {
    let table = [[1.2, 0.7], [1.2, 0.75], [2.2, 0.75], [2.2, 0.7]];
    let seat = [
        [2.6, 0.4],
        [2.55, 0.43],
        [2.6, 0.46],
        [3.0, 0.46],
        [3.0, 0.4],
    ];
    Drawing::new("furnished room")
        .line(
            &[[0.0, 0.0], [3.4, 0.0], [3.4, 1.8], [4.0, 1.8], [4.0, 2.5]],
            0.5,
            0.0,
        )
        .line(&[[4.0, 2.5], [2.4, 2.5]], 0.7, 0.0)
        .line(&[[2.4, 2.5], [1.6, 2.5]], 0.1, 1.0)
        .line(&[[1.6, 2.5], [0.0, 2.5]], 0.7, 0.0)
        .line(&[[0.0, 2.5], [0.0, 0.0]], 0.6, 0.0)
        .closed(&table, 0.3, 0.0)
        .closed(&seat, 0.4, 0.0)
        .baffle([0.3, 0.2], [0.7, 1.3], 0.5)
        .baffle([0.0, 1.9], [0.35, 2.0], 0.2)
}

/// The cross-section of a furnace: a hot bed, walls, a load of two billets on a skid, temperatures
/// in kelvin.
#[must_use]
pub fn furnace() -> Drawing {
    let mut drawing = Drawing::new("furnace");
    let mut add = |points: &[[f64; 2]], emissivity, temperature| {
        let material = Material::grey(emissivity, temperature);
        drawing.surfaces.push((points.to_vec(), vec![material]));
    };
    add(&[[0.0, 0.0], [3.0, 0.0]], 0.8, 1500.0);
    add(&[[3.0, 0.0], [3.0, 1.2]], 0.6, 1200.0);
    add(&[[3.0, 1.2], [1.5, 1.8], [0.0, 1.2]], 0.6, 1100.0);
    add(&[[0.0, 1.2], [0.0, 0.0]], 0.6, 1200.0);
    for x in [0.7, 1.8] {
        let billet = [[x, 0.5], [x, 0.9], [x + 0.4, 0.9], [x + 0.4, 0.5], [x, 0.5]];
        add(&billet, 0.9, 700.0);
    }
    drawing
}

/// A regular polygon inscribed in the unit circle, the middle of its side number k at the angle
/// 2πk/n, with the emission `emission(angle)` of the middle.
#[must_use]
pub fn polygon(n: usize, reflectance: f64, emission: impl Fn(f64) -> f64) -> Drawing {
    let angle = |k: f64| core::f64::consts::TAU * k / n as f64;
    let point = |k: usize| {
        let a = angle((k % n) as f64 - 0.5);
        [a.cos(), a.sin()]
    };
    let points = (0..=n).map(point).collect();
    let material = |k: usize| Material {
        reflectance,
        emission: emission(angle(k as f64)),
    };
    Drawing {
        name: "regular polygon",
        surfaces: vec![(points, (0..n).map(material).collect())],
        open: false,
    }
}

/// The unit square with n/4 small square obstacles, each turned another way, on a grid: n + 4
/// walls.
#[must_use]
pub fn crowd(n: usize) -> Drawing {
    let mut drawing = square().named("crowd");
    let side = ((n / 4) as f64).sqrt().ceil();
    for k in 0..n / 4 {
        let k = k as f64;
        let at = [(k % side + 0.5) / side, ((k / side).floor() + 0.5) / side];
        let corner = |q: f64| {
            let angle = k - q * core::f64::consts::FRAC_PI_2;
            [
                at[0] + 0.3 / side * angle.cos(),
                at[1] + 0.3 / side * angle.sin(),
            ]
        };
        let corners = [corner(0.0), corner(1.0), corner(2.0), corner(3.0)];
        drawing = drawing.closed(&corners, 0.5, 0.0);
    }
    drawing
}

/// u(0.37, 0) in [`square`] by a graded Nyström scheme, two independent computations.
pub const SQUARE_VALUE: f64 = 0.160_505_386_056;

/// A row of form factors that others have published or made, to within `accuracy`.
#[derive(Clone, Debug)]
pub struct Published {
    /// The room.
    pub drawing: Drawing,
    /// The number of the surface from which light leaves.
    pub row: usize,
    /// The share of it that arrives at the surfaces 0, 1, ….
    pub factors: &'static [f64],
    /// What the numbers are good for.
    pub accuracy: f64,
}

/// Published form factors, twelve digits of each: closed forms of crossed strings, of the block by
/// quadrature, of FACET from UCID-19887 (1983).
#[must_use]
pub fn published() -> Vec<Published> {
    let row = |drawing, row, factors, accuracy| Published {
        drawing,
        row,
        factors,
        accuracy,
    };
    vec![
        row(
            rectangle(),
            0,
            &[0.0, 0.190983005625, 0.618033988750],
            1e-12,
        ),
        row(
            l_room(),
            0,
            &[
                0.0,
                0.139620389972,
                0.497355345883,
                0.041989317034,
                0.066390939611,
                0.254644007500,
            ],
            1e-12,
        ),
        // Bottom: itself, right, top, left; the block's bottom, left, top, right. Made by
        // quadrature: last digits differ from the strings'.
        row(
            block(),
            0,
            &[
                0.0,
                0.209430584956,
                0.081138830084,
                0.209430584956,
                0.437016024454,
                0.031491987775,
                0.0,
                0.031491987775,
            ],
            1e-11,
        ),
        row(
            facet(),
            0,
            &[
                0.0,
                0.259687576257,
                0.0,
                0.0,
                0.007123828961,
                0.052163627192,
                0.0,
                0.062990978841,
                0.236067977500,
                0.052026984593,
                0.090266807444,
                0.239672219213,
            ],
            1e-12,
        ),
        row(
            facet(),
            4,
            &[
                0.003561914480,
                0.0,
                0.238660722451,
                0.190983005625,
                0.0,
                0.190983005625,
                0.238660722451,
                0.0,
                0.003561914480,
                0.038532750784,
                0.056523213319,
                0.038532750784,
            ],
            1e-12,
        ),
    ]
}

/// All closed scenes with names.
#[must_use]
pub fn scenes() -> Vec<Drawing> {
    vec![
        square(),
        rectangle(),
        l_room(),
        block(),
        facet(),
        doorway(),
        furnished(),
        furnace(),
        polygon(17, 0.5, f64::cos),
    ]
}

impl Drawing {
    /// The same under another name.
    #[must_use]
    pub fn named(mut self, name: &'static str) -> Self {
        self.name = name;
        self
    }

    /// Without the part of the floor between two places, where an inner wall is thick.
    fn opened(mut self, [from, to]: [f64; 2]) -> Self {
        let (outline, materials) = self.surfaces.remove(0);
        let rest = [&[[to, 0.0]], &outline[1..]].concat();
        self.surfaces
            .insert(0, (vec![[0.0, 0.0], [from, 0.0]], materials.clone()));
        self.surfaces.insert(1, (rest, materials));
        self
    }
}

/// Everything deterministic about a room, in f64.
#[derive(Clone, Debug)]
pub struct Setup<const B: usize = 1> {
    /// The scene.
    pub scene: Scene,
    /// Its partition.
    pub mesh: Mesh,
    /// Views and coefficients.
    pub matrix: Matrix,
    /// The Galerkin solution.
    pub solution: Solution,
}

/// A room with B functions on every cell.
pub type OfDegree<'c, 'a, F, const B: usize> = Piecewise<
    'c,
    F,
    Polynomials<'c, 'a, F, B>,
    Dense<'c, F>,
    RoomPairs<'c>,
    PointwiseSource<'c, F, Polynomials<'c, 'a, F, B>, RoomPairs<'c>, B>,
    B,
>;

impl<const B: usize> Setup<B> {
    /// As [`new`](Setup::new), with B functions on every cell.
    ///
    /// # Errors
    /// [`RoomError`].
    pub fn of_degree<F: Real>(
        drawing: &Drawing,
        cells: usize,
        grading: Grading,
    ) -> Result<Self, RoomError> {
        let scene = drawing.scene::<F>()?;
        let mesh = Mesh::new::<F>(&scene, cells, grading)?;
        let matrix = Matrix::with_functions(&scene, &mesh, r_min(B - 1), B)?;
        let solution = matrix.solve(&scene, &mesh, 1e-15, 1000)?;
        Ok(Self {
            scene,
            mesh,
            matrix,
            solution,
        })
    }

    /// As [`with`](Setup::with).
    ///
    /// # Panics
    /// If there is no such neighbour equation.
    pub fn with_polynomials<F: Real, R>(
        &self,
        choice: Choice,
        then: impl FnOnce(&Polynomials<'_, '_, F, B>, &OfDegree<'_, '_, F, B>, &[F], &[f64]) -> R,
    ) -> R {
        let tables = Tables::<F>::new(&self.scene, &self.mesh);
        let views = self.matrix.views();
        let room = Room::new(tables.geometry(), tables.cells(), views, ABSORPTION).unwrap();
        let polynomials = Polynomials::<_, B>::new(&room);
        let pairs = RoomPairs { views, choice };
        let v = self.solution.rounded::<F>().unwrap();
        let g = self
            .solution
            .source::<F>(&self.matrix.coefficients(), &pairs)
            .unwrap();
        let entries = rounded::<F>(self.matrix.entries()).unwrap();
        let dense = Dense::new(&entries, self.matrix.cells(), B).unwrap();
        let neighbour = Piecewise::with_pointwise(&polynomials, &dense, pairs, &v, &g).unwrap();
        then(&polynomials, &neighbour, &v, tables.lengths())
    }
}

impl Setup {
    /// Of a drawing, for walks in F. `spoil` is a relative error of every coefficient.
    ///
    /// # Errors
    /// [`RoomError`].
    pub fn new<F: Real>(
        drawing: &Drawing,
        cells: usize,
        grading: Grading,
    ) -> Result<Self, RoomError> {
        let scene = drawing.scene::<F>()?;
        let mesh = Mesh::new::<F>(&scene, cells, grading)?;
        let matrix = Matrix::new(&scene, &mesh, R_MIN)?;
        let solution = matrix.solve(&scene, &mesh, 1e-15, 1000)?;
        Ok(Self {
            scene,
            mesh,
            matrix,
            solution,
        })
    }

    /// The neighbour equation for a choice of pairs.
    ///
    /// # Panics
    /// If there is none.
    pub fn with<F: Real, R>(
        &self,
        choice: Choice,
        then: impl FnOnce(&Room<'_, F>, &RoomNeighbour<'_, F>, &[F], &[f64]) -> R,
    ) -> R {
        let tables = Tables::<F>::new(&self.scene, &self.mesh);
        let views = self.matrix.views();
        let room = Room::new(tables.geometry(), tables.cells(), views, ABSORPTION).unwrap();
        let pairs = RoomPairs { views, choice };
        let v = self.solution.rounded::<F>().unwrap();
        let g = self
            .solution
            .source::<F>(&self.matrix.coefficients(), &pairs)
            .unwrap();
        let entries = rounded::<F>(self.matrix.entries()).unwrap();
        let dense = Dense::new(&entries, v.len(), 1).unwrap();
        let neighbour = Piecewise::with_pointwise(&room, &dense, pairs, &v, &g).unwrap();
        then(&room, &neighbour, &v, tables.lengths())
    }
}

/// The neighbour equation of a room.
pub type RoomNeighbour<'a, F> = Piecewise<
    'a,
    F,
    Room<'a, F>,
    Dense<'a, F>,
    RoomPairs<'a>,
    PointwiseSource<'a, F, Room<'a, F>, RoomPairs<'a>>,
>;

/// The three choices of pairs.
pub const CHOICES: [Choice; 3] = [Choice::Paper, Choice::Default, Choice::Pointwise];

/// F = 1 − ρ with another ρ on every surface: u = 1, whatever is in the way.
#[must_use]
pub fn glowing(drawing: &Drawing) -> Drawing {
    drawing.clone().with(|s| {
        let reflectance = 0.15 + 0.7 * ((s as f64 * 0.618).fract());
        Material {
            reflectance,
            emission: 1.0 - reflectance,
        }
    })
}

/// A yard: floor and two walls, one of them slanted, under the open sky. All see each other wholly.
#[must_use]
pub fn yard() -> Drawing {
    let mut drawing = Drawing::new("yard")
        .line(&[[-0.3, 1.2], [0.0, 0.0]], 0.6, 0.0)
        .line(&[[0.0, 0.0], [1.0, 0.0]], 0.5, 1.0)
        .line(&[[1.0, 0.0], [1.0, 0.8]], 0.3, 0.5);
    drawing.open = true;
    drawing
}

/// A room as the kit sees it.
#[derive(Clone, Debug)]
pub struct Described<'a, F> {
    room: Room<'a, F>,
    setup: &'a Setup,
    drawing: &'a Drawing,
    claim: f64,
    rule: Vec<(f64, f64)>,
    /// Where the outer integrals of Galerkin coefficients are cut: in a corner moments of higher
    /// order change as quickly as x nears it.
    outer: Vec<f64>,
    /// The largest coordinate.
    size: f64,
    /// Whether nothing is in the way of anything: no vertex is behind any wall.
    clear: bool,
}

/// Describes the room of a drawing with about so many cells. `claim` is what its coefficients claim
/// to be right to, of the size of a row.
///
/// # Panics
/// If there is no such room.
pub fn described<F: Real, R>(
    drawing: &Drawing,
    cells: usize,
    claim: f64,
    then: impl FnOnce(&Described<'_, F>) -> R,
) -> R {
    described_by(drawing, cells, claim, (12, &[]), then)
}

/// The same by a rule of so many points, and with cuts for the outer integrals.
fn described_by<F: Real, R>(
    drawing: &Drawing,
    cells: usize,
    claim: f64,
    (order, outer): (usize, &[f64]),
    then: impl FnOnce(&Described<'_, F>) -> R,
) -> R {
    let setup = Setup::new::<F>(drawing, cells, Grading::default()).unwrap();
    let tables = Tables::<F>::new(&setup.scene, &setup.mesh);
    let views = setup.matrix.views();
    let room = Room::new(tables.geometry(), tables.cells(), views, ABSORPTION).unwrap();
    let points = drawing.surfaces.iter().flat_map(|(points, _)| points);
    let walls = room.geometry().walls().iter();
    let vertices = walls.clone().flat_map(|wall| wall.ends);
    let convex = walls.clone().all(|wall| {
        let [a, b] = wall.ends.map(wide);
        let height = |v: [F; 2]| cross(sub(b, a), sub(wide(v), a));
        vertices.clone().all(|v| height(v) >= 0.0)
    });
    then(&Described {
        room,
        setup: &setup,
        drawing,
        claim,
        rule: gauss_legendre(order),
        outer: outer.to_vec(),
        size: points.flatten().fold(0.0, |m, c| m.max(c.abs())),
        clear: convex,
    })
}

/// Everything about a room, in f32 and f64.
#[must_use]
pub fn examined(drawing: &Drawing, cells: usize, claim: f64, seed: u64) -> Report {
    described(drawing, cells, claim, |narrow| {
        described(drawing, cells, claim, |wide| {
            examine_both(narrow, wide, seed)
        })
    })
}

type Vector = [f64; 2];

fn sub(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1]]
}
fn cross(a: Vector, b: Vector) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}
fn wide<F: Real>(p: [F; 2]) -> Vector {
    p.map(Real::to_f64)
}

/// A cell as a point sees it.
struct Seen {
    ends: [Vector; 2],
    length: f64,
    /// Where shadows may end, as fractions of the cell, and how far away the vertex is.
    shadows: Vec<(f64, f64)>,
    /// Where the horizon of the point is.
    horizon: Option<f64>,
}

impl<F: Real> Described<'_, F> {
    fn wall(&self, wall: usize) -> &Wall<F> {
        &self.room.geometry().walls()[wall]
    }

    fn wall_of(&self, cell: usize) -> usize {
        self.room.table().wall(cell).expect("a cell")
    }

    fn inside(&self, cell: usize, t: f64) -> Point<F> {
        self.room.inside(cell, F::from_f64(t)).expect("a cell")
    }

    fn ends(&self, cell: usize) -> [Vector; 2] {
        [0.0, 1.0].map(|t| wide(self.inside(cell, t).position()))
    }

    /// The distance of `y` from the line of a wall, in f64.
    fn height(&self, wall: usize, y: Vector) -> f64 {
        let [a, b] = self.wall(wall).ends.map(wide);
        let span = sub(b, a);
        cross(span, sub(y, a)) / dot(span, span).sqrt()
    }

    fn seen(&self, x: &Point<F>, cell: usize) -> Seen {
        let ends = self.ends(cell);
        let (at, span) = (wide(x.position()), sub(ends[1], ends[0]));
        let inside = |t: &f64| *t > 0.0 && *t < 1.0;
        // Beyond every vertex that is nearer: a + t span on the line from x through it.
        let walls = self.room.geometry().walls().iter();
        let vertices = walls.flat_map(|wall| wall.ends.map(wide));
        let shadows = vertices.filter_map(|vertex| {
            let ray = sub(vertex, at);
            let t = cross(sub(at, ends[0]), ray) / cross(span, ray);
            let y = [ends[0][0] + t * span[0], ends[0][1] + t * span[1]];
            let (to, near) = (dot(sub(y, at), ray), dot(ray, ray));
            (inside(&t) && to > near && near > 0.0).then(|| (t, near.sqrt()))
        });
        let [a, b] = ends.map(|end| self.height(x.wall(), end));
        Seen {
            ends,
            length: self.room.table().length(cell).to_f64(),
            shadows: shadows.collect(),
            horizon: Some(a / (a - b)).filter(inside),
        }
    }

    /// ½(sin b − sin a) of the directions from `x` to two points, both turned into the half plane
    /// before its wall: the form factor to what is between them, seen from its active side, where
    /// nothing is in the way.
    fn form_factor(&self, x: &Point<F>, to: [Vector; 2]) -> f64 {
        let [first, last] = self.wall(x.wall()).ends.map(wide);
        let at = wide(x.position());
        let tangent = sub(last, first);
        let sine = |end: Vector| {
            let d = sub(end, at);
            if d == [0.0; 2] {
                // The corner that x is in: what is there fills the angle up to the horizon.
                return if end == last { 1.0 } else { -1.0 };
            }
            let along = dot(tangent, d);
            if cross(tangent, d) <= 0.0 {
                return along.signum();
            }
            along / (dot(tangent, tangent) * dot(d, d)).sqrt()
        };
        // Seen from before it, a wall goes from right to left: against the direction of sin φ.
        (0.5 * (sine(to[0]) - sine(to[1]))).max(0.0)
    }
}

impl<'a, F: Real> Description for Described<'a, F> {
    type Equation = Room<'a, F>;
    const DIMENSION: usize = 1;

    fn equation(&self) -> &Self::Equation {
        &self.room
    }

    /// By its place on the wall, as a user makes it: its cell is looked for.
    fn point(&self, cell: usize, t: &[f64]) -> Point<F> {
        let [from, to] = [0.0, 1.0].map(|t| self.inside(cell, t).along().to_f64());
        let wall = self.wall_of(cell);
        let fraction = (from + t[0] * (to - from)) / self.wall(wall).length.to_f64();
        self.room.point(wall, fraction.min(1.0)).expect("a wall")
    }

    fn contains(&self, cell: usize, x: &Point<F>) -> bool {
        let [a, b] = self.ends(cell);
        let (span, to) = (sub(b, a), sub(wide(x.position()), a));
        let t = (dot(to, span) / dot(span, span)).clamp(0.0, 1.0);
        let off = sub(to, [t * span[0], t * span[1]]);
        // Ends and points are stored to ε of their coordinates.
        let edge = 16.0 * F::EPSILON.to_f64() * self.size;
        x.wall() == self.wall_of(cell) && dot(off, off).sqrt() <= edge
    }

    /// Split where the edge of a shadow may fall, at the horizon, and, where x is near, at one,
    /// two, four … times its distance from the foot of its perpendicular: the integrand's poles are
    /// at that distance.
    fn nodes(&self, x: &Point<F>, cell: usize) -> Vec<(Point<F>, f64)> {
        let seen = self.seen(x, cell);
        let mut cuts: Vec<f64> = seen.shadows.iter().map(|(t, _)| *t).collect();
        cuts.extend(seen.horizon);
        if x.wall() == self.wall_of(cell) {
            cuts.extend(&self.outer);
        } else {
            let (span, to) = (
                sub(seen.ends[1], seen.ends[0]),
                sub(wide(x.position()), seen.ends[0]),
            );
            let square = dot(span, span);
            let foot = dot(to, span) / square;
            // No nearer than the rounding of points.
            let height = (cross(span, to) / square).abs().max(1e-9);
            let steps = core::iter::successors(Some(height), |step| Some(2.0 * step));
            let steps = steps.take_while(|step| *step < foot.abs() + 1.0);
            cuts.push(foot);
            cuts.extend(steps.flat_map(|step| [foot - step, foot + step]));
        }
        let nodes = split(&self.rule, 0.0, 1.0, &cuts).into_iter();
        nodes
            .map(|(t, weight)| (self.inside(cell, t), weight * seen.length))
            .collect()
    }

    /// Of p = (1 − q0) h_x h_y/(2r³), h_x the height of x above the wall of y and h_y that of y
    /// above the wall of x: where x and y move by δ = ε × the size of the scene, p changes by at
    /// most p δ(1/h_x + 1/h_y + 3/r). In a corner h_x is small.
    ///
    /// Where the edge of a shadow is thrown on y by a vertex at the distance s, the edge moves by δ
    /// r/s across the ray, and what x sees by the angle, δ/s, times ½ cos φ = h_y/2r.
    fn sensitivity(&self, x: &Point<F>, cell: usize) -> f64 {
        let wall = self.wall_of(cell);
        let above = self.height(wall, wide(x.position()));
        if x.wall() == wall || above <= 0.0 {
            return 0.0;
        }
        let at = wide(x.position());
        let mut sum = 0.0;
        for (y, weight) in self.nodes(x, cell) {
            let to = wide(y.position());
            let (up, r) = (self.height(x.wall(), to), dist(at, to));
            if up > 0.0 {
                let p = self.room.density(x, &y).to_f64();
                sum += weight * p * (1.0 / above + 1.0 / up + 3.0 / r);
            }
        }
        let seen = self.seen(x, cell);
        let shadows = seen.shadows.iter().map(|&(t, s)| {
            let y = wide(self.inside(cell, t).position());
            0.5 * self.height(x.wall(), y).max(0.0) / (s * dist(at, y))
        });
        self.size * (sum + shadows.sum::<f64>())
    }

    fn offers(&self, offers: &mut Offers<'_, Self>) {
        let views = self.room.views();
        let pairs = |choice| RoomPairs { views, choice };
        offers.pairs("the paper's", pairs(Choice::Paper));
        offers.pointwise_pairs("the others pointwise", pairs(Choice::Default));
        offers.pointwise_pairs("all pointwise", pairs(Choice::Pointwise));
        let claim = self.claim;
        offers.coefficients("strings", &self.setup.matrix.coefficients(), claim);
        // In f64 whatever F is: with nodes in f32 there is nothing to compare it with.
        if F::EPSILON.to_f64() < 1e-10 {
            let v = &self.setup.solution;
            offers.galerkin_solution("own", &v.v, claim / (1.0 - v.contraction));
        }
        // With all pairs pointwise there is no coefficient to be the room's own.
        for choice in [Choice::Paper, Choice::Default] {
            self.setup.with::<F, _>(choice, |_, neighbour, _, _| {
                offers.neighbour::<RoomNeighbour<'_, F>>(&format!("own, {choice:?}"), neighbour);
            });
        }
    }

    /// What is left of the sky, where nothing is in the way.
    fn leaving(&self, x: &Point<F>) -> f64 {
        if !self.drawing.open {
            return 0.0;
        }
        assert!(self.clear, "an open scene with shadows");
        let walls = self.room.geometry().walls();
        let others = walls.iter().enumerate().filter(|&(w, _)| w != x.wall());
        let factors = others.map(|(_, wall)| self.form_factor(x, wall.ends.map(wide)));
        1.0 - factors.sum::<f64>()
    }

    fn solution(&self, _: &Point<F>) -> Option<f64> {
        self.constant()
    }

    fn constant(&self) -> Option<f64> {
        let mut materials = self.drawing.surfaces.iter().flat_map(|(_, m)| m);
        let glows = materials.all(|m| m.emission == 1.0 - m.reflectance);
        (glows && !self.drawing.open).then_some(1.0)
    }

    /// By the cosine law: sin φ is uniform in (−1, 1).
    fn cumulative(&self, x: &Point<F>, y: &Point<F>) -> Option<f64> {
        let [a, b] = self.wall(x.wall()).ends.map(wide);
        let (tangent, to) = (sub(b, a), sub(wide(y.position()), wide(x.position())));
        let sine = dot(tangent, to) / (dot(tangent, tangent) * dot(to, to)).sqrt();
        (!self.drawing.open).then_some(0.5 + 0.5 * sine)
    }

    /// In f32, by f64, where nothing is in the way.
    fn mass(&self, x: &Located<Point<F>>, cell: usize) -> Option<f64> {
        if F::EPSILON.to_f64() < 1e-10 || !self.clear {
            return None;
        }
        let survival = 1.0 - F::from_f64(ABSORPTION).to_f64();
        // In the line of the cell, and not in the corner where it ends, x sees its edge.
        let (at, ends) = (wide(x.point.position()), self.ends(cell));
        let aside = self.height(self.wall_of(cell), at) <= 0.0 && !ends.contains(&at);
        if aside || x.point.wall() == self.wall_of(cell) {
            return Some(0.0);
        }
        Some(survival * self.form_factor(&x.point, ends))
    }
}

/// A room with polynomials as the kit sees it.
struct Curved<'x, 'a, F, const B: usize> {
    flat: &'x Described<'a, F>,
    setup: &'x Setup<B>,
    polynomials: Polynomials<'x, 'x, F, B>,
    claim: f64,
}

/// As [`examined`], with B functions on every cell.
///
/// # Panics
/// If there is no such room.
#[must_use]
pub fn examined_of_degree<const B: usize>(
    drawing: &Drawing,
    cells: usize,
    claim: f64,
    seed: u64,
) -> Report {
    curved::<f32, _, B>(drawing, cells, claim, |narrow| {
        curved::<f64, _, B>(drawing, cells, claim, |wide| {
            examine_both(narrow, wide, seed)
        })
    })
}

fn curved<F: Real, R, const B: usize>(
    drawing: &Drawing,
    cells: usize,
    claim: f64,
    then: impl FnOnce(&Curved<'_, '_, F, B>) -> R,
) -> R {
    // Polynomials of degree 2B − 2 times a density, on the parts that `nodes` makes: 12 points are
    // too few for 10⁻¹³ there.
    let cuts = [4.0_f64, 16.0, 64.0].map(|n| [1.0 / n, 1.0 - 1.0 / n]);
    let by = (16, cuts.as_flattened());
    described_by::<F, _>(drawing, cells, claim, by, |flat| {
        let setup = Setup::<B>::of_degree::<F>(drawing, cells, Grading::default()).unwrap();
        let views = setup.matrix.views();
        let room = Room::new(*flat.room.geometry(), flat.room.table(), views, ABSORPTION).unwrap();
        then(&Curved {
            flat,
            setup: &setup,
            polynomials: Polynomials::new(&room),
            claim,
        })
    })
}

impl<'x, F: Real, const B: usize> Description<B> for Curved<'x, '_, F, B> {
    type Equation = Polynomials<'x, 'x, F, B>;
    const DIMENSION: usize = 1;

    fn equation(&self) -> &Self::Equation {
        &self.polynomials
    }
    fn point(&self, cell: usize, t: &[f64]) -> Point<F> {
        self.flat.point(cell, t)
    }
    fn contains(&self, cell: usize, x: &Point<F>) -> bool {
        self.flat.contains(cell, x)
    }
    fn nodes(&self, x: &Point<F>, cell: usize) -> Vec<(Point<F>, f64)> {
        self.flat.nodes(x, cell)
    }
    fn sensitivity(&self, x: &Point<F>, cell: usize) -> f64 {
        self.flat.sensitivity(x, cell)
    }
    fn leaving(&self, x: &Point<F>) -> f64 {
        self.flat.leaving(x)
    }
    fn solution(&self, x: &Point<F>) -> Option<f64> {
        self.flat.solution(x)
    }
    fn constant(&self) -> Option<f64> {
        self.flat.constant()
    }
    fn cumulative(&self, x: &Point<F>, y: &Point<F>) -> Option<f64> {
        self.flat.cumulative(x, y)
    }
    fn mass(&self, x: &Located<Point<F>>, cell: usize) -> Option<f64> {
        self.flat.mass(x, cell)
    }

    fn offers(&self, offers: &mut Offers<'_, Self, B>) {
        let views = self.setup.matrix.views();
        let pairs = |choice| RoomPairs { views, choice };
        offers.pairs("the paper's", pairs(Choice::Paper));
        offers.pointwise_pairs("the others pointwise", pairs(Choice::Default));
        offers.pointwise_pairs("all pointwise", pairs(Choice::Pointwise));
        offers.coefficients("quadrature", &self.setup.matrix.coefficients(), self.claim);
        if F::EPSILON.to_f64() < 1e-10 {
            let v = &self.setup.solution;
            offers.galerkin_solution("own", &v.v, self.claim / (1.0 - v.contraction));
        }
        for choice in [Choice::Paper, Choice::Default] {
            self.setup
                .with_polynomials::<F, _>(choice, |_, neighbour, _, _| {
                    let name = format!("own, {choice:?}");
                    offers.neighbour::<OfDegree<'_, '_, F, B>>(&name, neighbour);
                });
        }
    }
}

fn dist(a: Vector, b: Vector) -> f64 {
    dot(sub(a, b), sub(a, b)).sqrt()
}
