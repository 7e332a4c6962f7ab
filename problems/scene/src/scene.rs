//! Scenes: what a user gives, validated and made watertight.

use alloc::vec::Vec;
use core::ops::Range;

use fredholm_core::Real;
use fredholm_core::array::from_fn;
use fredholm_surfaces::{
    Branch, Enclosure, Item, Limits, Material, MaterialFault, balanced, hull, margin,
};

use crate::SceneError;
use crate::beam::Beam;
use crate::check::Survey;
use crate::contacts::{self, Covered, Pieces};
use crate::error::Place;
use crate::geometry::{Face, Geometry, Node, Period, Triangle};
use crate::join;
use crate::precision::Precision;
use crate::skylight::SkyLight;
use crate::vector::{Vector, cross, dot, norm, ring, sub, turn, unit};

/// A polygon of a surface. Its active side is the one from which its vertices are seen
/// counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Polygon {
    /// Three vertices.
    Triangle([[f64; 3]; 3]),
    /// Four vertices, in a plane and convex.
    Quad([[f64; 3]; 4]),
}

impl Polygon {
    /// The vertices.
    #[must_use]
    pub fn points(&self) -> &[[f64; 3]] {
        match self {
            Self::Triangle(points) => points,
            Self::Quad(points) => points,
        }
    }
}

/// A surface: polygons that are reported together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface<'a> {
    /// At least one polygon.
    pub polygons: &'a [Polygon],
    /// One material, or one for every polygon.
    pub materials: &'a [Material],
}

/// A validated scene, in f64, with coordinates that the walk's scalar has exactly.
///
/// Where faces meet they have vertices in common: vertices nearer to each other than the scene's
/// smallest distance, 2⁻⁴⁰ of its width (2⁻¹⁶ for f32), are one, and an edge on which a vertex of
/// another face lies has it, too. So a scene that is closed on paper is closed for rays, in spite
/// of rounding.
#[derive(Clone, Debug)]
pub struct Scene {
    pub(crate) faces: Vec<Face<f64>>,
    pub(crate) triangles: Vec<Triangle<f64>>,
    pub(crate) nodes: Vec<Node<f64>>,
    /// The vertices of each face in its sense of rotation, with those of others on its edges.
    pub(crate) outlines: Outlines,
    pub(crate) places: Vec<Place>,
    /// The first face of every surface, and the number of faces.
    first: Vec<u32>,
    pub(crate) vertices: Vec<Vector<f64>>,
    enclosure: Enclosure,
    beams: Vec<Beam<f64>>,
    sky: Option<SkyLight>,
    /// ρ_s of every face; none if all are 0.
    pub(crate) specular: Vec<f64>,
    /// The periods with which it repeats, if it does.
    pub(crate) period: Option<Period<f64>>,
    /// α of every face for the light of the sun, if that is told apart; and whether the sky gives such light.
    pub(crate) absorptances: Vec<f64>,
    pub(crate) sun_in_sky: bool,
    /// The scene's smallest distance.
    pub(crate) smallest: f64,
    precision: Precision,
    /// What is as near to a plane as this is in it.
    pub(crate) flat: f64,
    covered: Vec<Covered>,
    /// What was taken from all coordinates.
    shift: Vector<f64>,
}

/// The numbers of the vertices around every face.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outlines {
    pub(crate) vertices: Vec<u32>,
    /// Where those of each face begin, and the number of all.
    pub(crate) first: Vec<u32>,
}

impl Outlines {
    /// The vertices around a face.
    pub(crate) fn of(&self, face: usize) -> &[u32] {
        match (self.first.get(face), self.first.get(face + 1)) {
            (Some(&from), Some(&to)) => {
                self.vertices.get(from as usize..to as usize).unwrap_or(&[])
            }
            _ => &[],
        }
    }

    /// The edges around a face, in its sense of rotation.
    pub(crate) fn edges(&self, face: usize) -> impl Iterator<Item = [u32; 2]> {
        ring(self.of(face))
    }
}

fn limits<F: Real>() -> Limits {
    Limits::of::<F>([1e9, 1e60], [1e-6, 1e-60])
}

/// The lengths by which a scene is judged.
#[derive(Clone, Copy, Debug)]
struct Scale {
    smallest: f64,
    width: f64,
    /// The rounding of the walk's scalar.
    epsilon: f64,
    precision: Precision,
}

/// Rounding errors that computing a vertex within the scene may take, as shares of the scene's width: a few products and sums.
const COMPUTED: f64 = 16.0;

impl Scale {
    /// How far vertices of one plane may be off it: by what they were computed and rounded with, and the plane by as much.
    fn flat(&self) -> f64 {
        COMPUTED * self.epsilon * self.width + 2.0 * self.precision.distance
    }
}

/// What shares that sum up to 1 are off by.
const ROUNDING: f64 = 1e-12;

/// The part of the scene's smallest distance by which rounding may move a vertex: where coordinates are larger the scene is moved.
const MOVED: f64 = 0.0625;

/// What is taken from all coordinates before they are rounded to the walk's scalar, where that would move vertices by a part of the smallest
/// distance that matters: about the middle of the scene. Double precision keeps what it is given.
fn shift_of<F: Real>(surfaces: &[Surface<'_>]) -> Vector<f64> {
    let polygons = surfaces.iter().flat_map(|own| own.polygons);
    let points = polygons.flat_map(|own| own.points().iter().copied());
    let [low, high] = hull(&points.collect::<Vec<_>>());
    let width = (0..3).fold(0.0, |w: f64, k| Real::max(w, high[k] - low[k]));
    let furthest = (0..3).fold(0.0, |m: f64, k| {
        Real::max(m, Real::max(low[k].abs(), high[k].abs()))
    });
    let rounding = 0.5 * F::EPSILON.to_f64() * furthest;
    let is_far = rounding > MOVED * limits::<F>().smallest * width;
    let is_single = F::EPSILON.to_f64() > f64::EPSILON;
    let is_moved = is_single && is_far && width > 0.0 && width < f64::INFINITY;
    if !is_moved {
        return [0.0; 3];
    }
    // A power of ten that is no larger than the scene: people read what is a whole number of these.
    let mut step = 1.0;
    while step > width {
        step /= 10.0;
    }
    while 10.0 * step <= width {
        step *= 10.0;
    }
    from_fn(|k| {
        let middle = 0.5 * (low[k] + high[k]);
        middle - middle % step
    })
}

/// The polygons of all surfaces, with the coordinates of the walk's scalar.
struct Raw {
    /// The vertices of all polygons.
    points: Vec<Vector<f64>>,
    counts: Vec<u32>,
    places: Vec<Place>,
    materials: Vec<Material>,
    first: Vec<u32>,
}

impl Scene {
    /// A scene for walks in the scalar `F`. Form factors are always in f64.
    ///
    /// # Errors
    /// [`SceneError`] says what cannot be, and where: coordinates and materials that are none,
    /// polygons without area, quadrilaterals that are not planar or not convex, polygons that lie on
    /// each other or go through each other, and, if the scene is to be closed, gaps, vertices that
    /// are near an edge without being on it, and polygons that are seen from behind, with a ray that
    /// leaves.
    ///
    /// ```
    /// use fredholm_scene::{Enclosure, Material, Polygon, Scene, SceneError, Surface};
    ///
    /// // A pyramid without its base.
    /// let [a, b, c, top] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    /// let sides = [[a, b, top], [b, c, top], [c, a, top]].map(|[p, q, r]| Polygon::Triangle([p, r, q]));
    /// let surface = Surface { polygons: &sides, materials: &[Material::BLACK] };
    /// let refused = Scene::new::<f64>(&[surface], Enclosure::Closed).unwrap_err();
    /// assert!(matches!(refused, SceneError::Open { .. }));
    /// assert!(Scene::new::<f64>(&[surface], Enclosure::Open).is_ok());
    /// ```
    pub fn new<F: Real>(
        surfaces: &[Surface<'_>],
        enclosure: Enclosure,
    ) -> Result<Self, SceneError> {
        Self::within::<F>(surfaces, enclosure, 0.0)
    }

    /// A scene as [`new`](Self::new) has it, whose vertices may be off the planes that were meant by a distance that its coordinates do not tell:
    /// vertices that were joined, say.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    ///
    /// ```
    /// use fredholm_scene::{Enclosure, Scene, SceneError, shapes};
    ///
    /// let room = shapes::room([0.0; 3], [1.0; 3]);
    /// let scene = Scene::within::<f64>(&room.surfaces(), Enclosure::Closed, 1e-4)?;
    /// assert_eq!(scene.precision().distance, 1e-4);
    /// # Ok::<(), SceneError>(())
    /// ```
    pub fn within<F: Real>(
        surfaces: &[Surface<'_>],
        enclosure: Enclosure,
        distance: f64,
    ) -> Result<Self, SceneError> {
        let shift = shift_of::<F>(surfaces);
        let own = Self::moved::<F>(surfaces, enclosure, distance, shift);
        own.map_err(|error| error.moved(shift))
    }

    /// A scene whose coordinates are those that are given less a shift.
    fn moved<F: Real>(
        surfaces: &[Surface<'_>],
        enclosure: Enclosure,
        distance: f64,
        shift: Vector<f64>,
    ) -> Result<Self, SceneError> {
        let raw = read::<F>(surfaces, shift)?;
        let [low, high] = hull(&raw.points);
        let width = (0..3).fold(0.0, |w: f64, k| Real::max(w, high[k] - low[k]));
        // Written so that NaN fails.
        if !(width >= limits::<F>().narrowest) {
            let at = raw.places.first().copied();
            return Err(at.map_or(SceneError::Empty, SceneError::Coordinate));
        }
        let of_input = Precision::of(&raw.points, width).of_input::<F>();
        let scale = Scale {
            smallest: width * limits::<F>().smallest,
            width,
            epsilon: F::EPSILON.to_f64(),
            precision: Precision {
                distance: Real::max(of_input.distance, distance),
                ..of_input
            },
        };
        let own = Self::assemble(raw, enclosure, scale)?;
        Ok(Self { shift, ..own })
    }

    /// Joins, cuts what touches, and checks.
    fn assemble(raw: Raw, enclosure: Enclosure, scale: Scale) -> Result<Self, SceneError> {
        let (scene, survey) = Self::join(&raw, enclosure, scale, scale.smallest)?;
        if survey.contacts.is_none() {
            return scene.checked(survey.fault);
        }
        let Some(pieces) = contacts::cut(&scene, &survey.contacts, survey.touch) else {
            return scene.checked(survey.fault);
        };
        // Where several faces were cut each has a vertex of its own, off by what vertices are off by.
        let near = Real::max(scale.smallest, 2.0 * scale.flat());
        let cut = Self::join(&raw.cut(&scene, &pieces), enclosure, scale, near);
        let cut = cut.and_then(|(own, again)| own.checked(again.fault));
        match (cut, enclosure) {
            (Ok(own), _) => Ok(Self {
                covered: pieces.covered,
                ..own
            }),
            // What is wrong with what was given is easier to find.
            (Err(error), Enclosure::Open) => Err(survey.fault.unwrap_or(error)),
            (Err(error), Enclosure::Closed) => match scene.checked(survey.fault) {
                // What overlaps was cut, and a gap is left.
                Ok(_) | Err(SceneError::Overlap { .. }) => Err(error),
                Err(own) => Err(own),
            },
        }
    }

    /// Joins vertices that are nearer to each other than `near`, builds the hierarchy, and looks at what touches.
    fn join(
        raw: &Raw,
        enclosure: Enclosure,
        scale: Scale,
        near: f64,
    ) -> Result<(Self, Survey), SceneError> {
        let smallest = scale.smallest;
        let numbers = join::numbers(&raw.points, near);
        let mut faces = Vec::with_capacity(raw.counts.len());
        let mut at = 0;
        for ((&count, &place), material) in raw.counts.iter().zip(&raw.places).zip(&raw.materials) {
            let own = numbers.get(at..at + count as usize).unwrap_or(&[]);
            at += count as usize;
            faces.push(face(own, &raw.points, *material, place, smallest)?);
        }
        let mut scene = Self {
            faces,
            triangles: Vec::new(),
            nodes: Vec::new(),
            outlines: Outlines::default(),
            places: raw.places.clone(),
            first: raw.first.clone(),
            vertices: raw.points.clone(),
            enclosure,
            beams: Vec::new(),
            sky: None,
            specular: Vec::new(),
            period: None,
            absorptances: Vec::new(),
            sun_in_sky: false,
            smallest,
            precision: scale.precision,
            flat: scale.flat(),
            covered: Vec::new(),
            shift: [0.0; 3],
        };
        scene.outlines = join::plain_outlines(&scene.faces);
        scene.index(near);
        scene.outlines = join::outlines(&scene, &numbers, near);
        let margin = rounding(&scene.faces, scale.epsilon);
        let survey = crate::check::survey(&mut scene);
        scene.index(margin);
        Ok((scene, survey))
    }

    /// The scene, if nothing is wrong with it.
    fn checked(self, fault: Option<SceneError>) -> Result<Self, SceneError> {
        if let Some(fault) = fault {
            return Err(fault);
        }
        if self.enclosure == Enclosure::Closed {
            crate::closed::check(&self)?;
            if self.faces.iter().all(|face| face.reflectance >= 1.0) {
                return Err(SceneError::NothingAbsorbs);
            }
        }
        Ok(self)
    }

    /// Cuts the faces into triangles, and builds the hierarchy over these.
    fn index(&mut self, margin: f64) {
        let triangles = join::triangles(self);
        let item = |(t, number): (&Triangle<f64>, u32)| {
            let corners: [Vector<f64>; 3] = from_fn(|k| t.axes.map(|axis| axis[k]));
            let bounds = hull(&corners);
            Item { bounds, number }
        };
        let mut items: Vec<Item<3>> = triangles.iter().zip(0..).map(item).collect();
        let node = |branch: Branch<3>| {
            let [low, high] = branch.widened(margin);
            Node {
                low,
                high,
                first: branch.first,
                count: branch.count,
            }
        };
        self.nodes = balanced(&mut items).into_iter().map(node).collect();
        self.triangles = items
            .iter()
            .filter_map(|item| triangles.get(item.number as usize).copied())
            .collect();
    }

    /// The number of surfaces.
    #[must_use]
    pub fn surfaces(&self) -> usize {
        self.first.len() - 1
    }

    /// The faces of a surface, in the order of its polygons.
    ///
    /// # Errors
    /// [`SceneError::Surface`].
    pub fn faces_of(&self, surface: usize) -> Result<Range<usize>, SceneError> {
        match (self.first.get(surface), self.first.get(surface + 1)) {
            (Some(&from), Some(&to)) => Ok(from as usize..to as usize),
            _ => Err(SceneError::Surface { surface }),
        }
    }

    /// The faces, in the order of surfaces and polygons: one for every polygon, or several or none where others touch it.
    #[must_use]
    pub fn faces(&self) -> &[Face<f64>] {
        &self.faces
    }

    /// The surface and its polygon to which a face belongs.
    #[must_use]
    pub fn place(&self, face: usize) -> Option<Place> {
        self.places.get(face).copied()
    }

    /// The area of a surface.
    ///
    /// # Errors
    /// [`SceneError::Surface`].
    pub fn area(&self, surface: usize) -> Result<f64, SceneError> {
        let faces = self.faces.get(self.faces_of(surface)?).unwrap_or(&[]);
        Ok(faces.iter().map(|face| face.area).sum())
    }

    /// What was taken from all coordinates, 0 but where single precision would have moved vertices: then the scene stands near the origin, with
    /// all that [`moved_in`](Self::moved_in) takes there.
    ///
    /// ```
    /// use fredholm_scene::{Enclosure, Scene, SceneError, shapes};
    ///
    /// let far = shapes::room([5e6, 0.0, 0.0], [5e6 + 10.0, 10.0, 10.0]);
    /// let [single, double] = [
    ///     Scene::new::<f32>(&far.surfaces(), Enclosure::Closed)?,
    ///     Scene::new::<f64>(&far.surfaces(), Enclosure::Closed)?,
    /// ];
    /// assert_eq!((single.shift(), double.shift()), ([5e6, 0.0, 0.0], [0.0; 3]));
    /// assert_eq!(single.moved_in([5e6 + 4.0, 5.0, 5.0]), [4.0, 5.0, 5.0]);
    /// assert_eq!(single.moved_out([4.0, 5.0, 5.0]), [5e6 + 4.0, 5.0, 5.0]);
    /// # Ok::<(), SceneError>(())
    /// ```
    #[must_use]
    pub const fn shift(&self) -> Vector<f64> {
        self.shift
    }

    /// A point as it was given where the scene has it.
    #[must_use]
    pub fn moved_in(&self, point: Vector<f64>) -> Vector<f64> {
        sub(point, self.shift)
    }

    /// A point of the scene where it was given.
    #[must_use]
    pub fn moved_out(&self, point: Vector<f64>) -> Vector<f64> {
        // −0 stays.
        let out = |x: f64, by: f64| if by == 0.0 { x } else { x + by };
        from_fn(|k| out(point[k], self.shift[k]))
    }

    /// The scene with light that no surface emits, where that was given.
    ///
    /// # Errors
    /// [`SceneError::Beam`].
    ///
    /// ```
    /// use fredholm_scene::{Beam, Enclosure, Scene, SceneError, shapes};
    ///
    /// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
    /// let lamp = |intensity| Beam::Point { at: [0.5, 0.5, 0.5], intensity };
    /// assert_eq!(scene.clone().with_beams(vec![lamp(2.0)])?.beams(), [lamp(2.0)]);
    /// assert_eq!(scene.with_beams(vec![lamp(-2.0)]).unwrap_err(), SceneError::Beam { beam: 0 });
    /// # Ok::<(), SceneError>(())
    /// ```
    pub fn with_beams(self, mut beams: Vec<Beam<f64>>) -> Result<Self, SceneError> {
        for beam in &mut beams {
            if let Beam::Point { at, .. } = beam {
                *at = self.moved_in(*at);
            }
        }
        let is_wrong = |beam: &Beam<f64>| beam.rounded::<f64>().is_none();
        match beams.iter().position(is_wrong) {
            Some(beam) => Err(SceneError::Beam { beam }),
            None if !beams.is_empty() && self.has_mirrors() => Err(SceneError::MirroredBeam),
            None if self.period.is_some() && beams.iter().any(Beam::is_lamp) => {
                Err(SceneError::RepeatedLamp)
            }
            None => Ok(Self { beams, ..self }),
        }
    }

    /// The scene, which has no mirrors yet, with surfaces that reflect a part ρ_s of what arrives as mirrors do, besides what they reflect diffusely.
    ///
    /// What leaves them diffusely is (1 − ρ_s) û, where û solves
    ///
    /// ```text
    /// û(x) = ρ/(1 − ρ_s) ∫ p(x, y) û(y) dA(y) + F/(1 − ρ_s),
    /// ```
    ///
    /// and p is the density of where a ray from x ends that goes on from each face with the probability ρ_s: so faces have ρ/(1 − ρ_s) and
    /// F/(1 − ρ_s) from here on, and the irradiance of x is H = ∫ p û. For a surface of ε + ρ + ρ_s = 1 at the temperature T this is
    /// ε/(1 − ρ_s) σT⁴.
    ///
    /// # Errors
    /// [`SceneError::Length`]: not one number for every surface; [`SceneError::Specular`]; [`SceneError::MirroredBeam`];
    /// [`SceneError::NothingAbsorbs`].
    ///
    /// ```
    /// use fredholm_scene::{Enclosure, Scene, SceneError, shapes};
    ///
    /// let room = shapes::room([0.0; 3], [1.0; 3]);
    /// let scene = Scene::new::<f64>(&room.surfaces(), Enclosure::Closed)?;
    /// // Half of what arrives at the floor, which is black otherwise, is mirrored.
    /// let mirrored = scene.clone().with_specular(&[0.5, 0.0, 0.0, 0.0, 0.0, 0.0])?;
    /// assert_eq!([mirrored.specular(0), mirrored.specular(1)], [0.5, 0.0]);
    /// assert!(matches!(scene.with_specular(&[1.0; 6]), Err(SceneError::Specular(_))));
    /// # Ok::<(), SceneError>(())
    /// ```
    pub fn with_specular(mut self, specular: &[f64]) -> Result<Self, SceneError> {
        let (expected, found) = (self.surfaces(), specular.len());
        if expected != found {
            return Err(SceneError::Length { expected, found });
        }
        if specular.iter().all(|&r| r == 0.0) {
            return Ok(self);
        }
        if !self.absorptances.is_empty() {
            return Err(SceneError::MirroredBeam);
        }
        let mut all = Vec::with_capacity(self.faces.len());
        for (surface, &r) in specular.iter().enumerate() {
            let own = self.faces_of(surface)?;
            for face in self.faces.get_mut(own).unwrap_or_default() {
                let rest = 1.0 - r;
                // Sums of three shares may be above 1 by rounding. Written so that NaN fails.
                if !((0.0..1.0).contains(&r) && face.reflectance <= rest + ROUNDING) {
                    let polygon = 0;
                    return Err(SceneError::Specular(Place { surface, polygon }));
                }
                face.reflectance = f64::min(face.reflectance / rest, 1.0);
                face.emission /= rest;
                all.push(r);
            }
        }
        if !self.beams.is_empty() {
            return Err(SceneError::MirroredBeam);
        }
        let is_closed = self.enclosure == Enclosure::Closed;
        if is_closed && self.faces.iter().all(|face| face.reflectance >= 1.0) {
            return Err(SceneError::NothingAbsorbs);
        }
        self.specular = all;
        Ok(self)
    }

    /// An open scene that repeats without end along the axes whose period is above 0: rows of modules, street canyons. What leaves a period on one
    /// side enters the next one on the other.
    ///
    /// A ray that has passed a million periods has left.
    ///
    /// # Errors
    /// [`SceneError::Period`]: a period is negative or not finite, all are 0, the scene is closed, or it is wider than a period;
    /// [`SceneError::RepeatedLamp`].
    ///
    /// ```
    /// use fredholm_scene::{Enclosure, Material, Polygon, Scene, SceneError, Surface};
    ///
    /// // A wall of height 1 across a street without end, every 2 metres.
    /// let wall = [Polygon::Quad([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])];
    /// let surface = Surface { polygons: &wall, materials: &[Material::BLACK] };
    /// let scene = Scene::new::<f64>(&[surface], Enclosure::Open)?;
    /// let row = scene.clone().with_period([2.0, 1.0, 0.0])?;
    /// assert_eq!(row.period(), Some([2.0, 1.0, 0.0]));
    /// assert_eq!(scene.with_period([2.0, 0.5, 0.0]).unwrap_err(), SceneError::Period);
    /// # Ok::<(), SceneError>(())
    /// ```
    pub fn with_period(self, lengths: [f64; 3]) -> Result<Self, SceneError> {
        let [low, high] = hull(&self.vertices);
        let fits = |k: usize| {
            let length = lengths[k];
            let width = high[k] - low[k];
            length == 0.0
                || (length > 0.0 && length < f64::INFINITY && width <= length + self.smallest)
        };
        let is_one = lengths.iter().any(|&length| length > 0.0);
        if !is_one || !(0..3).all(fits) || self.enclosure == Enclosure::Closed {
            return Err(SceneError::Period);
        }
        if self.beams.iter().any(Beam::is_lamp) {
            return Err(SceneError::RepeatedLamp);
        }
        let period = Some(Period { lengths, low });
        Ok(Self { period, ..self })
    }

    /// A scene of heat in which the light of the sun is told apart: surfaces absorb a part α of it, the solar absorptance, and reflect the rest, as
    /// they absorb and emit a part ε of heat. `of_sky` says that the sky gives such light, too, and no heat.
    ///
    /// The sum w of both radiosities solves
    ///
    /// ```text
    /// w = H_w + q                                   where the net flux q is given: all that arrives leaves again,
    /// w = ε σT⁴ + (1 − ε) H_w + (ε − α) H_s         where the temperature T is given,
    /// ```
    ///
    /// with the irradiance H_w by both and that by sunlight, H_s, of which every state makes an estimate of its own. So σT⁴ is
    /// H_w + (α/ε − 1) H_s + q/ε where q is given, and ε (σT⁴ − H_w) + (ε − α) H_s W/m² go out where T is.
    ///
    /// # Errors
    /// [`SceneError::Length`]: not one number for every surface; [`SceneError::Absorptance`]; [`SceneError::MirroredBeam`]: there are mirrors;
    /// [`SceneError::NothingAbsorbs`].
    ///
    /// ```
    /// use fredholm_scene::{Enclosure, Scene, SceneError, shapes};
    ///
    /// let room = shapes::room([0.0; 3], [1.0; 3]);
    /// let scene = Scene::new::<f64>(&room.surfaces(), Enclosure::Closed)?;
    /// assert_eq!(scene.clone().with_absorptances(&[0.3; 6], false)?.absorptance(2), Some(0.3));
    /// assert!(matches!(scene.with_absorptances(&[1.1; 6], false), Err(SceneError::Absorptance(_))));
    /// # Ok::<(), SceneError>(())
    /// ```
    pub fn with_absorptances(self, absorptances: &[f64], of_sky: bool) -> Result<Self, SceneError> {
        let (expected, found) = (self.surfaces(), absorptances.len());
        if expected != found {
            return Err(SceneError::Length { expected, found });
        }
        if self.has_mirrors() {
            return Err(SceneError::MirroredBeam);
        }
        let mut all = Vec::with_capacity(self.faces.len());
        for (surface, &own) in absorptances.iter().enumerate() {
            if !(0.0..=1.0).contains(&own) {
                let polygon = 0;
                return Err(SceneError::Absorptance(Place { surface, polygon }));
            }
            all.extend(self.faces_of(surface)?.map(|_| own));
        }
        let is_closed = self.enclosure == Enclosure::Closed;
        if is_closed && all.iter().all(|&own| own == 0.0) {
            return Err(SceneError::NothingAbsorbs);
        }
        Ok(Self {
            absorptances: all,
            sun_in_sky: of_sky,
            ..self
        })
    }

    /// α of a face for the light of the sun, if that is told apart.
    #[must_use]
    pub fn absorptance(&self, face: usize) -> Option<f64> {
        self.absorptances.get(face).copied()
    }

    /// Whether sunlight is told apart from heat.
    #[must_use]
    pub const fn has_sunlight(&self) -> bool {
        !self.absorptances.is_empty()
    }

    /// The period along every axis, 0 along those on which nothing repeats, if the scene does.
    #[must_use]
    pub fn period(&self) -> Option<[f64; 3]> {
        self.period.map(|own| own.lengths)
    }

    /// Whether rays end where they go straight: there are no mirrors, and nothing repeats.
    #[must_use]
    pub const fn is_straight(&self) -> bool {
        !self.has_mirrors() && self.period.is_none()
    }

    /// ρ_s of a face, the part of what arrives that leaves as from a mirror.
    #[must_use]
    pub fn specular(&self, face: usize) -> f64 {
        self.specular.get(face).copied().unwrap_or(0.0)
    }

    /// Whether some surface is a mirror in part.
    #[must_use]
    pub const fn has_mirrors(&self) -> bool {
        !self.specular.is_empty()
    }

    /// The scene with another emission of every face, and no other light.
    ///
    /// # Errors
    /// [`SceneError::Length`]: not one for every face.
    pub fn with_emissions(mut self, emissions: &[f64]) -> Result<Self, SceneError> {
        let (expected, found) = (self.faces.len(), emissions.len());
        if expected != found {
            return Err(SceneError::Length { expected, found });
        }
        for (face, &emission) in self.faces.iter_mut().zip(emissions) {
            face.emission = emission;
        }
        (self.beams, self.sky) = (Vec::new(), None);
        Ok(self)
    }

    /// Light that no surface emits.
    #[must_use]
    pub fn beams(&self) -> &[Beam<f64>] {
        &self.beams
    }

    /// The scene with light of the sky.
    ///
    /// # Errors
    /// [`SceneError::NoSky`]: the scene is closed.
    ///
    /// ```
    /// use fredholm_scene::{Enclosure, Scene, SceneError, SkyLight, shapes};
    ///
    /// let closed = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
    /// assert_eq!(closed.with_sky(SkyLight::uniform(2.0)?).unwrap_err(), SceneError::NoSky);
    /// # Ok::<(), SceneError>(())
    /// ```
    pub fn with_sky(self, sky: SkyLight) -> Result<Self, SceneError> {
        match self.enclosure {
            Enclosure::Closed => Err(SceneError::NoSky),
            Enclosure::Open => Ok(Self {
                sky: Some(sky),
                ..self
            }),
        }
    }

    /// Light of the sky.
    #[must_use]
    pub const fn sky(&self) -> Option<&SkyLight> {
        self.sky.as_ref()
    }

    /// Whether light may leave.
    #[must_use]
    pub const fn enclosure(&self) -> Enclosure {
        self.enclosure
    }

    /// The geometry in f64: for deterministic work. For walks see [`Tables`](crate::Tables).
    #[must_use]
    pub fn geometry(&self) -> Geometry<'_, f64> {
        Geometry::made(
            &self.faces,
            &self.triangles,
            &self.nodes,
            self.enclosure == Enclosure::Open,
        )
        .with_specular(&self.specular)
        .with_period(self.period)
        .with_sunlight(crate::tables::sunlight(&self.absorptances, self.sun_in_sky))
    }

    pub(crate) fn place_of(&self, face: u32) -> Place {
        let none = Place {
            surface: 0,
            polygon: 0,
        };
        self.place(face as usize).unwrap_or(none)
    }

    /// The numbers of the vertices around a face in its sense of rotation, with those of others on its edges.
    #[must_use]
    pub fn outline(&self, face: usize) -> &[u32] {
        self.outlines.of(face)
    }

    /// What is nearer to each other than this is in one place.
    #[must_use]
    pub const fn smallest_distance(&self) -> f64 {
        self.smallest
    }

    /// Whether no face has a part in front of this one that faces it, hidden or not.
    #[must_use]
    pub fn sees_nothing(&self, face: usize) -> bool {
        let Some(own) = self.faces.get(face) else {
            return true;
        };
        let slack = Real::max(self.smallest, self.flat);
        let is_before = |a: &Face<f64>, b: &Face<f64>| {
            let mut points = b.polygon().iter();
            points.any(|&p| a.height(p) > slack)
        };
        let mut others = self.faces.iter().filter(|other| other.plane != own.plane);
        !others.any(|other| is_before(own, other) && is_before(other, own))
    }

    /// The areas of surfaces that others cover, which are no part of the scene: by surface and by what covers it.
    ///
    /// ```
    /// use fredholm_scene::{Enclosure, Material, Scene, Surface, shapes};
    ///
    /// // Two cubes that have a wall in common: neither wall is seen.
    /// let row = shapes::block([0.0; 3], [1.0; 3]).and(shapes::block([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]));
    /// let houses: Vec<Vec<_>> = row.surfaces.chunks(6).map(|house| house.concat()).collect();
    /// let surface = |polygons| Surface { polygons, materials: &[Material::BLACK] };
    /// let surfaces: Vec<_> = houses.iter().map(|house| surface(house)).collect();
    /// let scene = Scene::new::<f64>(&surfaces, Enclosure::Open)?;
    /// let areas = scene.covered().iter().map(|own| (own.surface, own.by, own.area));
    /// assert_eq!(areas.collect::<Vec<_>>(), [(0, 1, 1.0), (1, 0, 1.0)]);
    /// assert_eq!((scene.faces().len(), scene.area(0)?), (10, 5.0));
    /// # Ok::<(), fredholm_scene::SceneError>(())
    /// ```
    #[must_use]
    pub fn covered(&self) -> &[Covered] {
        &self.covered
    }

    /// How precisely the coordinates are known, as they themselves show.
    #[must_use]
    pub const fn precision(&self) -> Precision {
        self.precision
    }

    /// The distance from a plane, in the scene's unit of length, up to which faces that touch each other are in the plane.
    #[must_use]
    pub const fn flatness(&self) -> f64 {
        self.flat
    }

    /// The place of a vertex; NaN if there is none of this number.
    #[must_use]
    pub fn vertex(&self, number: u32) -> [f64; 3] {
        let at = self.vertices.get(number as usize);
        at.copied().unwrap_or([f64::NAN; 3])
    }
}

impl Raw {
    /// The polygons in pieces, without those that left.
    fn cut(&self, scene: &Scene, pieces: &Pieces) -> Self {
        let mut own = Self {
            points: Vec::new(),
            counts: Vec::new(),
            places: Vec::new(),
            materials: Vec::new(),
            first: Vec::from([0]),
        };
        let mut cut = pieces.cut.iter().peekable();
        let mut add = |points: &[Vector<f64>], place: Place, material: Material| {
            own.points.extend_from_slice(points);
            own.counts.push(points.len() as u32);
            own.places.push(place);
            own.materials.push(material);
        };
        let faces = scene.faces.iter().zip(&self.places).zip(&self.materials);
        for (((face, &place), &material), number) in faces.zip(0..) {
            if pieces.is_whole.get(number as usize) == Some(&true) {
                add(face.polygon(), place, material);
            }
            while let Some(piece) = cut.next_if(|piece| piece.face == number) {
                add(&piece.points, place, material);
            }
        }
        for surface in 1..self.first.len() {
            let to = own.places.partition_point(|place| place.surface < surface);
            own.first.push(to as u32);
        }
        own
    }
}

/// What the tests of boxes may be wrong by.
pub(crate) fn rounding(faces: &[Face<f64>], epsilon: f64) -> f64 {
    let corners = faces.iter().flat_map(|face| face.corners);
    margin(corners.flatten(), epsilon)
}

/// The face of some vertices, if they make one.
fn face(
    numbers: &[u32],
    points: &[Vector<f64>],
    material: Material,
    place: Place,
    smallest: f64,
) -> Result<Face<f64>, SceneError> {
    let number = |k: usize| {
        let own = numbers.get(k).or_else(|| numbers.first());
        own.copied().unwrap_or(u32::MAX)
    };
    let vertices = [number(0), number(1), number(2), number(3)];
    let corners = vertices.map(|v| points.get(v as usize).copied().unwrap_or([f64::NAN; 3]));
    let [a, b, c, d] = corners;
    let quad = numbers.len() == 4;
    // Twice the area vector; of a triangle d is a.
    let double = cross(sub(c, a), sub(d, b));
    let double = if quad { double } else { turn(a, b, c) };
    let longest = (0..4).fold(0.0, |m: f64, k| {
        let across = norm(sub(corners[k], corners[(k + 2) % 4]));
        Real::max(
            m,
            Real::max(across, norm(sub(corners[k], corners[(k + 1) % 4]))),
        )
    });
    // Written so that NaN fails.
    if !(norm(double) > 4.0 * smallest * longest) {
        let crossed = quad && norm(turn(a, b, c)) >= 4.0 * smallest * longest;
        return Err(if crossed {
            SceneError::NotConvex(place)
        } else {
            SceneError::Degenerate(place)
        });
    }
    let normal = unit(double);
    if quad {
        let by = dot(normal, sub(b, a))
            .abs()
            .max(dot(normal, sub(d, c)).abs());
        if !(by <= 2.0 * smallest) {
            return Err(SceneError::NotPlanar { at: place, by });
        }
        let turns = [turn(a, b, c), turn(b, c, d), turn(c, d, a), turn(d, a, b)];
        if turns
            .iter()
            .any(|&t| !(dot(normal, t) >= -smallest * longest))
        {
            return Err(SceneError::NotConvex(place));
        }
        let short = (0..4).any(|k| vertices[k] == vertices[(k + 1) % 4]);
        if short {
            return Err(SceneError::Degenerate(place));
        }
    }
    Ok(Face {
        corners,
        vertices,
        count: numbers.len() as u32,
        plane: 0,
        normal,
        area: 0.5 * norm(double),
        reflectance: material.reflectance,
        emission: material.emission,
    })
}

/// All polygons, if their numbers are numbers.
fn read<F: Real>(surfaces: &[Surface<'_>], shift: Vector<f64>) -> Result<Raw, SceneError> {
    if surfaces.is_empty() {
        return Err(SceneError::Empty);
    }
    let round = |x: f64| F::from_f64(x).to_f64();
    let largest = limits::<F>().largest;
    let mut raw = Raw {
        points: Vec::new(),
        counts: Vec::new(),
        places: Vec::new(),
        materials: Vec::new(),
        first: Vec::from([0]),
    };
    for (s, surface) in surfaces.iter().enumerate() {
        if surface.polygons.is_empty() {
            return Err(SceneError::Polygons { surface: s });
        }
        let given = surface.materials.len();
        if given != 1 && given != surface.polygons.len() {
            return Err(SceneError::Materials { surface: s });
        }
        let materials = surface.materials.iter().cycle();
        for ((p, polygon), material) in surface.polygons.iter().enumerate().zip(materials) {
            let place = Place {
                surface: s,
                polygon: p,
            };
            material.check::<F>().map_err(|fault| match fault {
                MaterialFault::Reflectance => SceneError::Reflectance(place),
                MaterialFault::Emission => SceneError::Emission(place),
            })?;
            for point in polygon.points() {
                // Written so that NaN fails.
                if !point.iter().all(|x| x.abs() <= largest) {
                    return Err(SceneError::Coordinate(place));
                }
                raw.points.push(sub(*point, shift).map(round));
            }
            raw.counts.push(polygon.points().len() as u32);
            raw.places.push(place);
            raw.materials.push(*material);
        }
        raw.first.push(raw.counts.len() as u32);
    }
    if raw.points.len() >= u32::MAX as usize {
        return Err(SceneError::TooMany);
    }
    Ok(raw)
}
