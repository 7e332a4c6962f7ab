//! Scenes as the kit sees them: nothing is known of their steps but how to make them.

use core::num::NonZeroU32;

use fredholm_core::galerkin::{Basis, Cells as _};
use fredholm_core::sampled::{
    Sampled, SampledSetup, SampledStep, SampledTables, SetupOptions, StepControl, StepEvents,
};
use fredholm_core::{Equation, LastStep, Lights, Located, Neighbour, Real, Space};
use fredholm_scene::{
    CellTables, Cells, Enclosure, Material, Point, Radiosity, Scene, Side, Surface, Tables,
    form_factor_of_point, shapes,
};

use crate::quadrature::{gauss_legendre, tensor};
use crate::{Description, Neighbours, Offers, Report, check, examine_steps_both};

/// Cells of every scene, about.
const CELLS: usize = 24;
/// The faces to which last steps lead: the ceiling, which is the second. In a furnace nothing is so bright that they would pay.
const LIGHTS: &[u32] = &[1];

/// A scene of the tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A cube whose ceiling is black and glows so that u = 1 everywhere.
    Cube,
    /// The cube with a plate in it, which hides things.
    Baffle,
    /// The cube without one of its walls.
    Open,
}

impl Place {
    fn scene<F: Real>(self) -> Scene {
        let mut surfaces = shapes::room([0.0; 3], [1.0, 1.2, 0.9]).surfaces;
        match self {
            Self::Cube => {}
            Self::Baffle => {
                surfaces.extend(shapes::block([0.3, 0.2, 0.2], [0.4, 0.8, 0.6]).surfaces);
            }
            // The last is not the ceiling, which is the second.
            Self::Open => drop(surfaces.pop()),
        }
        let material = |number: usize| {
            let reflectance = match number {
                1 => 0.0,
                _ => 0.8 - 0.05 * number as f64,
            };
            [Material {
                reflectance,
                emission: 1.0 - reflectance,
            }]
        };
        let materials: Vec<_> = (0..surfaces.len()).map(material).collect();
        let all = surfaces.iter().zip(&materials);
        let all: Vec<_> = all
            .map(|(polygons, materials)| Surface {
                polygons,
                materials,
            })
            .collect();
        let enclosure = match self {
            Self::Open => Enclosure::Open,
            _ => Enclosure::Closed,
        };
        Scene::new::<F>(&all, enclosure).expect("a valid scene")
    }

    /// Whether nothing hides anything, so that form factors from points are sums over edges.
    fn is_convex(self) -> bool {
        self != Self::Baffle
    }
}

/// What is wrong with a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The integral of the control of steps is 5 % too large.
    Integral,
    /// The probabilities of the control's events are 5 % too large.
    EventProbability,
}

/// What walks in a scene need, in their scalar.
struct Owned<F> {
    place: Place,
    tables: Tables<F>,
    cells: Cells<F>,
    sides: Vec<Side<F>>,
    shares: Vec<u8>,
    sampled: SampledTables<F>,
}

impl<F: Real> Owned<F> {
    /// With v and c of B functions on a cell: of u − F_s with a last step, otherwise of u.
    fn new<const B: usize>(place: Place, last_step: bool) -> Self {
        let scene = place.scene::<F>();
        let (tables, cells) = (Tables::<f64>::new(&scene), Cells::new(&scene, CELLS));
        let cells = cells.expect("few cells");
        let sides = sides_of(&cells);
        let wide = radiosity_of(&tables, &cells, &sides);
        let shares = wide.visible_shares(16);
        // v is left where two sweeps lead: the neighbour equation holds for any, and of a v that is u rounding alone would be left.
        let options = SetupOptions {
            samples: 256,
            sweeps: 2,
            ..SetupOptions::default()
        };
        let solution = if last_step {
            let equation = &LastStep(&wide);
            SampledSetup::<_, 2, B, _> {
                equation,
                events: &wide,
                options,
            }
            .solve_all()
        } else {
            SampledSetup::<_, 2, B, _> {
                equation: &wide,
                events: &wide,
                options,
            }
            .solve_all()
        };
        let sampled = solution.and_then(|solution| solution.for_walks());
        let cells = Cells::new(&scene, CELLS).expect("few cells");
        Self {
            place,
            tables: Tables::new(&scene),
            sides: sides_of(&cells),
            cells,
            shares,
            sampled: sampled.expect("a contraction"),
        }
    }

    fn radiosity(&self) -> Radiosity<'_, F> {
        let radiosity = radiosity_of(&self.tables, &self.cells, &self.sides);
        let radiosity = radiosity.with_visible_shares(&self.shares);
        radiosity.expect("shares of all cells")
    }

    /// The scene as the kit sees it, as an equation of u or of u − F_s.
    fn described<'a, E>(
        &'a self,
        radiosity: &'a Radiosity<'a, F>,
        equation: E,
    ) -> Described<'a, F, E> {
        Described {
            equation,
            radiosity,
            owned: self,
        }
    }
}

/// The sides of faces, of which those of lights have no emission that walks score where they meet it.
fn sides_of<F: Real>(cells: &Cells<F>) -> Vec<Side<F>> {
    let mut sides = cells.tables().sides.to_vec();
    for &light in LIGHTS {
        sides[light as usize].emission = F::zero();
    }
    sides
}

fn radiosity_of<'a, F: Real>(
    tables: &'a Tables<F>,
    cells: &'a Cells<F>,
    sides: &'a [Side<F>],
) -> Radiosity<'a, F> {
    let lit = CellTables {
        sides,
        lights: LIGHTS,
        ..cells.tables()
    };
    Radiosity::of_tables(tables.geometry(), lit).expect("a valid chain")
}

/// A scene, with the equation that walks follow.
struct Described<'a, F, E> {
    equation: E,
    radiosity: &'a Radiosity<'a, F>,
    owned: &'a Owned<F>,
}

/// What the equation of a scene is, with or without a last step.
trait SceneEquation {
    /// Whether it has one.
    const LAST_STEP: bool;
}

impl<F> SceneEquation for Radiosity<'_, F> {
    const LAST_STEP: bool = false;
}

impl<E> SceneEquation for LastStep<'_, E> {
    const LAST_STEP: bool = true;
}

impl<F: Real, E> Described<'_, F, E> {
    /// The corners of a cell in f64, and its face.
    fn corners(&self, cell: usize) -> (u32, Vec<[f64; 3]>) {
        let (face, corners) = self.radiosity.corners(cell).expect("a cell of a face");
        (face, corners.iter().map(wide).collect())
    }

    /// The form factor from a point to a part of a face, if nothing hides it.
    fn form_factor(&self, x: &Point<F>, (face, polygon): (u32, &[[f64; 3]])) -> f64 {
        if x.face == face {
            return 0.0;
        }
        let normal = self.face_normal(x.face);
        form_factor_of_point(wide(&x.position), normal, polygon)
    }

    /// The form factor from a point to a face, if nothing hides it.
    fn form_factor_of_face(&self, x: &Point<F>, face: u32) -> f64 {
        let faces = self.owned.tables.geometry().faces();
        let corners = faces[face as usize].polygon().iter();
        self.form_factor(x, (face, &corners.map(wide).collect::<Vec<_>>()))
    }

    fn face_normal(&self, face: u32) -> [f64; 3] {
        let faces = self.owned.tables.geometry().faces();
        wide(&faces[face as usize].normal)
    }
}

/// In f64.
fn wide<F: Real>(x: &[F; 3]) -> [f64; 3] {
    x.map(Real::to_f64)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

impl<F, E, const B: usize> Description<B> for Described<'_, F, E>
where
    F: Real,
    E: Equation<Scalar = F, Point = Point<F>, Value = F> + Basis<B> + SceneEquation + Sync,
{
    type Equation = E;

    fn equation(&self) -> &E {
        &self.equation
    }

    fn contains(&self, cell: usize, x: &Point<F>) -> bool {
        let (face, corners) = self.corners(cell);
        let normal = self.face_normal(face);
        let slack = 16.0 * F::EPSILON.to_f64();
        let next = corners.iter().cycle().skip(1);
        let inside = |(&a, &b): (&[f64; 3], &[f64; 3])| {
            let edge = minus(b, a);
            let inwards = cross(normal, edge);
            dot(inwards, minus(wide(&x.position), a)) >= -slack * dot(edge, edge).sqrt()
        };
        x.face == face && corners.iter().zip(next).all(inside)
    }

    /// All faces are rectangles, and so are their cells.
    fn nodes(&self, _: &Point<F>, cell: usize) -> Vec<(Point<F>, f64)> {
        let (face, corners) = self.corners(cell);
        let is_own = |other: &usize| {
            self.radiosity
                .corners(*other)
                .is_some_and(|(f, _)| f == face)
        };
        let cells = (0..self.radiosity.cells()).filter(is_own).count();
        let area = self.owned.place.scene::<f64>().faces()[face as usize].area;
        let spans = [minus(corners[1], corners[0]), minus(corners[3], corners[0])];
        // In f32 the measure is that of rounded tables.
        let is_wide = F::EPSILON.to_f64() < 1e-10;
        let area = if is_wide {
            area / cells as f64
        } else {
            self.radiosity.measure(cell)
        };
        let rule = gauss_legendre(4);
        let nodes = tensor(&[rule.clone(), rule]).into_iter();
        nodes
            .map(|(t, weight)| {
                let at = |k: usize| corners[0][k] + t[0] * spans[0][k] + t[1] * spans[1][k];
                let position = [at(0), at(1), at(2)].map(F::from_f64);
                (Point { face, position }, weight * area)
            })
            .collect()
    }

    fn leaving(&self, x: &Point<F>) -> f64 {
        let faces = self.owned.tables.geometry().faces().len() as u32;
        let seen = (0..faces).map(|face| self.form_factor_of_face(x, face));
        match self.owned.place {
            Place::Open => 1.0 - seen.sum::<f64>(),
            _ => 0.0,
        }
    }

    /// u = 1 in closed scenes; F_s is the emission of the ceiling.
    fn solution(&self, x: &Point<F>) -> Option<f64> {
        let known = if E::LAST_STEP {
            self.radiosity.known(x).to_f64()
        } else {
            0.0
        };
        (self.owned.place != Place::Open).then_some(1.0 - known)
    }

    fn mass(&self, x: &Located<Point<F>>, cell: usize) -> Option<f64> {
        self.owned.place.is_convex().then(|| {
            let (face, corners) = self.corners(cell);
            self.form_factor(&x.point, (face, &corners))
        })
    }

    fn absorption(&self) -> f64 {
        0.3
    }
}

/// Two steps of a score.
const STEPS: NonZeroU32 = NonZeroU32::MIN.saturating_add(1);

impl<F, E, const B: usize> Neighbours<B> for Described<'_, F, E>
where
    F: Real,
    E: Equation<Scalar = F, Point = Point<F>, Value = F> + Basis<B> + SceneEquation + Sync,
{
    fn offers(&self, offers: &mut Offers<'_, Self, B>) {
        let own = self.owned.sampled.tables();
        offers.neighbour_by_steps("from rays", &self.by_rays::<_, B>(own, self.radiosity));
    }
}

impl<'a, F: Real, E> Described<'a, F, E> {
    /// The neighbour equation from rays, with these tables and events.
    fn by_rays<'b, V, const B: usize>(
        &self,
        tables: StepControl<'b, F>,
        events: &'b V,
    ) -> Sampled<'b, Radiosity<'a, F>, 2, B, V>
    where
        'a: 'b,
        V: StepEvents<2, Scalar = F, Point = Point<F>>,
    {
        Sampled::with_events(self.radiosity, events, tables, STEPS).expect("its tables")
    }
}

/// Events of rays whose probabilities are 5 % too large.
struct LikelyEvents<'a>(&'a Radiosity<'a, f64>);

impl Space for LikelyEvents<'_> {
    type Scalar = f64;
    type Point = Point<f64>;
}

impl StepEvents<2> for LikelyEvents<'_> {
    fn towards(&self, cell: usize) -> Option<u32> {
        self.0.towards(cell)
    }
    fn probability(&self, x: &Point<f64>, event: u32) -> f64 {
        1.05 * self.0.probability(x, event)
    }
    fn occurring(&self, step: &SampledStep<'_, Point<f64>, f64, 2>, events: &[u32]) -> u32 {
        self.0.occurring(step, events)
    }
}

/// What the kit finds of a scene with B functions on a cell, as an equation of u, or of u − F_s by a last step to the light.
#[must_use]
pub fn examined<const B: usize>(place: Place, last_step: bool, seed: u64) -> Report {
    let narrow = Owned::<f32>::new::<B>(place, last_step);
    let wide = Owned::<f64>::new::<B>(place, last_step);
    let (few, many) = (narrow.radiosity(), wide.radiosity());
    if last_step {
        examine_steps_both::<_, _, B>(
            &narrow.described(&few, LastStep(&few)),
            &wide.described(&many, LastStep(&many)),
            seed,
        )
    } else {
        let (narrow, wide) = (narrow.described(&few, few), wide.described(&many, many));
        examine_steps_both::<_, _, B>(&narrow, &wide, seed)
    }
}

/// What the kit finds of the neighbour equation of a scene in which something is wrong: `None` for what is right.
#[must_use]
pub fn broken(fault: Option<Fault>, seed: u64) -> Report {
    const B: usize = 3;
    let owned = Owned::<f64>::new::<B>(Place::Cube, true);
    let radiosity = owned.radiosity();
    let described = owned.described(&radiosity, LastStep(&radiosity));
    let own = owned.sampled.tables();
    let large: Vec<f64> = own.integral.iter().map(|c| 1.05 * c).collect();
    let tables = StepControl {
        integral: &large,
        ..own
    };
    let likely = LikelyEvents(&radiosity);
    let mut report = Report::default();
    let mut look = |neighbour: &dyn Neighbour<Scalar = f64, Point = Point<f64>, Value = f64>| {
        let found = check::neighbour_equation_by_steps::<_, _, B>(&described, neighbour, seed);
        report.push("neighbour equation", "a scene", found);
    };
    match fault {
        None => look(&described.by_rays::<_, B>(own, &radiosity)),
        Some(Fault::Integral) => look(&described.by_rays::<_, B>(tables, &radiosity)),
        Some(Fault::EventProbability) => look(&described.by_rays::<_, B>(own, &likely)),
    }
    report
}
