//! The scenes of the tests, and published numbers of them.

use fredholm_core::{Real, RngUniforms, Uniforms, WalkSeeds};
use fredholm_room::{Enclosure, Material, RoomError, Scene, Surface};

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
    pub factors: Vec<f64>,
    /// What the numbers are good for.
    pub accuracy: f64,
}

/// A random room: a lamp in the ceiling, which may be a gable, and up to three boxes and screens. Of obstacles that lie on each
/// other no room is made: other numbers of the same seed are drawn then.
#[must_use]
pub fn random(seed: u64) -> Drawing {
    let mut draws = RngUniforms(<WalkSeeds>::new(seed, 25).generator(0));
    loop {
        let mut between = |a: f64, b: f64| {
            let uniform: f64 = draws.uniform();
            a + (b - a) * uniform
        };
        let [w, h] = [between(2.0, 6.0), between(2.0, 4.0)];
        let [a, gable] = [between(0.2, 0.6), between(-0.5, 0.5).max(0.0)];
        let top = |x: f64| [x * w, h + gable * (1.0 - (2.0 * x - 1.0).abs())];
        let b = a + between(0.05, 0.3);
        let mut drawing = Drawing::new("random")
            .line(&[[0.0, 0.0], [w, 0.0], [w, h]], between(0.1, 0.8), 0.0)
            .line(&[[w, h], top(b)], between(0.1, 0.8), 0.0)
            .line(&[top(b), top(a)], 0.1, 1.0)
            .line(&[top(a), [0.0, h], [0.0, 0.0]], between(0.1, 0.8), 0.0);
        for _ in 0..between(0.0, 4.0) as usize {
            let [x, y] = [between(0.15, w - 0.8), between(0.15, h - 0.8)];
            let [dx, dy] = [between(0.1, 0.6), between(0.05, 0.6)];
            drawing = if between(0.0, 1.0) < 0.4 {
                drawing.baffle([x, y], [x + dx, y + dy], 0.5)
            } else {
                let corners = [[x, y], [x, y + dy], [x + dx, y + dy], [x + dx, y]];
                drawing.closed(&corners, 0.4, 0.0)
            };
        }
        if drawing.scene::<f64>().is_ok() {
            return drawing;
        }
    }
}

/// Published form factors, twelve digits of each: closed forms of crossed strings, of the block by
/// quadrature, of FACET from UCID-19887 (1983).
#[must_use]
pub fn published() -> Vec<Published> {
    let row = |drawing, row, factors: &str, accuracy| Published {
        drawing,
        row,
        factors: factors.split(' ').map(|f| f.parse().unwrap()).collect(),
        accuracy,
    };
    // Of the block: the bottom to itself, right, top, left; the block's bottom, left, top, right. Made by quadrature: last digits differ
    // from the strings'.
    vec![
        row(rectangle(), 0, "0.0 0.190983005625 0.618033988750", 1e-12),
        row(
            l_room(),
            0,
            "0.0 0.139620389972 0.497355345883 0.041989317034 0.066390939611 0.254644007500",
            1e-12,
        ),
        row(
            block(),
            0,
            "0.0 0.209430584956 0.081138830084 0.209430584956 0.437016024454 0.031491987775 0.0 0.031491987775",
            1e-11,
        ),
        row(
            facet(),
            0,
            "0.0 0.259687576257 0.0 0.0 0.007123828961 0.052163627192 0.0 0.062990978841 0.236067977500 \
             0.052026984593 0.090266807444 0.239672219213",
            1e-12,
        ),
        row(
            facet(),
            4,
            "0.003561914480 0.0 0.238660722451 0.190983005625 0.0 0.190983005625 0.238660722451 0.0 \
             0.003561914480 0.038532750784 0.056523213319 0.038532750784",
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
