//! What a camera sees of a scene: the numbers of a picture.

use std::time::Instant;

use fredholm_core::{
    Batch, DefaultGenerator, Form, Functional, LastStep, Length, NoNeighbour, Real, RngUniforms,
    Started, StateSpace, Statistics, Task, Uniforms, WalkSeeds, WithKnown,
};
use fredholm_model::{BLANK, Discretisation, Error, Partitioned, Spot, WalkOptions, in_scalar};
use fredholm_rayon::{Observer, fill_rows};
use fredholm_scene::{Point, Radiosity, Scene};

use crate::SceneModel;
use crate::partition::{ScenePartition, WalkTables};
use crate::system::{Boxed, SceneSystem, with_neighbour};

/// A pinhole camera.
///
/// ```
/// use fredholm::scene::Camera;
///
/// let camera = Camera { from: [0.0, -4.0, 1.0], towards: [0.0, 0.0, 1.0], angle: 40.0, size: [640, 480] };
/// assert_eq!(camera.size[0] * camera.size[1], 307_200);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The place of the camera.
    pub from: [f64; 3],
    /// A point in the middle of the picture.
    pub towards: [f64; 3],
    /// The angle between the lower and the upper edge of the picture, in degrees.
    pub angle: f64,
    /// Pixels across the picture, and down.
    pub size: [usize; 2],
}

/// The angle of a camera of which nothing is said, in degrees.
const ANGLE: f64 = 40.0;
/// How much further away it stands than it must.
const MARGIN: f64 = 1.05;

impl Camera {
    /// A camera that looks at all of a scene from outside: along the axis y and a little down. Where it meets the backs of
    /// surfaces it sees through them.
    #[must_use]
    pub fn outside(scene: &Scene, size: [usize; 2]) -> Self {
        let corners = scene.faces().iter().flat_map(|face| face.corners);
        let ends = [f64::INFINITY, f64::NEG_INFINITY].map(|end| [end; 3]);
        let [low, high] = corners.fold(ends, |[low, high], at| {
            let least = |a: [f64; 3], b: [f64; 3]| core::array::from_fn(|k| a[k].min(b[k]));
            let most = |a: [f64; 3], b: [f64; 3]| core::array::from_fn(|k| a[k].max(b[k]));
            [least(low, at), most(high, at)]
        });
        let towards: [f64; 3] = core::array::from_fn(|k| 0.5 * (low[k] + high[k]));
        let direction = [0.24, -0.93, 0.28];
        let mut camera = Self {
            from: core::array::from_fn(|k| towards[k] + direction[k]),
            towards,
            angle: ANGLE,
            size,
        };
        let [ahead, right, above] = camera.frame();
        // So far away that every corner of the box around all is within the picture.
        let away = (0..8).fold(0.0, |away: f64, corner| {
            let from_middle: [f64; 3] = core::array::from_fn(|k| {
                let end = if corner >> k & 1 == 0 { low } else { high };
                end[k] - towards[k]
            });
            let along = |axis: [f64; 3]| (0..3).map(|k| axis[k] * from_middle[k]).sum::<f64>();
            // The edges' vectors are as long as the tangents of the angles there.
            let aside =
                |axis: [f64; 3]| along(axis).abs() / axis.map(|x| x * x).iter().sum::<f64>();
            away.max(aside(right).max(aside(above)) - along(ahead))
        });
        camera.from = core::array::from_fn(|k| towards[k] - MARGIN * away * ahead[k]);
        camera
    }

    /// Refuses what is no camera.
    ///
    /// # Errors
    /// [`Error::Picture`].
    pub fn check(&self) -> Result<(), Error> {
        let wrong = |message: &str| Err(Error::Picture(message.to_owned()));
        let away = distance(self.from, self.towards);
        if !(away > 0.0 && away.is_finite()) {
            return wrong("a camera looks from one point towards another");
        }
        if !(self.angle > 0.0 && self.angle < 180.0) {
            return wrong("the angle of a camera must be more than 0 and less than 180 degrees");
        }
        if self.size.contains(&0) {
            return wrong("a picture has at least one pixel");
        }
        Ok(())
    }

    /// The directions to the middle, to the right edge and to the upper edge, of which the last two are perpendicular to the
    /// first.
    fn frame(&self) -> [[f64; 3]; 3] {
        let sub = |a: [f64; 3], b: [f64; 3]| core::array::from_fn(|k| a[k] - b[k]);
        let unit = |a: [f64; 3]| {
            let length = distance(a, [0.0; 3]);
            a.map(|x| x / length)
        };
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [
                a[1] * b[2] - a[2] * b[1],
                a[2] * b[0] - a[0] * b[2],
                a[0] * b[1] - a[1] * b[0],
            ]
        };
        let ahead: [f64; 3] = unit(sub(self.towards, self.from));
        // Up is z; who looks along it has y above.
        let up = if ahead[2].abs() < 0.999 {
            [0.0, 0.0, 1.0]
        } else {
            [0.0, 1.0, 0.0]
        };
        let right = unit(cross(ahead, up));
        let above = cross(right, ahead);
        let half = (0.5 * self.angle).to_radians().tan();
        let ratio = self.size[0] as f64 / self.size[1] as f64;
        [
            ahead,
            right.map(|x| x * half * ratio),
            above.map(|x| x * half),
        ]
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let squares = (0..3).map(|k| (a[k] - b[k]).powi(2));
    squares.sum::<f64>().sqrt()
}

/// Which numbers of a picture are wanted, and how.
#[derive(Clone, Copy, Debug)]
pub struct ViewRequest<'a> {
    /// The camera.
    pub camera: &'a Camera,
    /// How walks are made: `walks` of them for a pixel.
    pub walk: &'a WalkOptions,
    /// Whether plain walks that take as long are wanted, too.
    pub beside_plain: bool,
}

/// The numbers of a picture.
#[derive(Clone, Debug)]
pub struct View {
    /// The mean of u over each pixel, row by row from the upper left.
    pub pixels: Vec<Spot>,
    /// Walks for a pixel.
    pub walks: u64,
    /// Seconds that it took, set-up included.
    pub seconds: f64,
}

impl SceneModel {
    /// Estimates the pixels of a picture, without bias, and, if they are wanted, those by plain walks that take as long.
    /// `walking` is called when walks begin.
    ///
    /// u = v + (u − v), and the mean of v over a pixel is that of 64 rays through it. A walk of a pixel starts where a ray
    /// through a random point of it meets a surface, and estimates what is in brackets: its noise is all that a pixel has.
    ///
    /// # Errors
    /// [`Error`]; [`Error::Cancelled`].
    pub fn view(
        &self,
        discretisation: &Discretisation,
        request: &ViewRequest<'_>,
        watch: &dyn Observer,
        walking: &dyn Fn(),
    ) -> Result<(View, Option<View>), Error> {
        request.camera.check()?;
        let start = Instant::now();
        let cells = ScenePartition::new(self, discretisation)?;
        cells.check_variance(request.walk)?;
        let system = cells.system(request.walk.absorption)?;
        walking();
        in_scalar!(discretisation.scalar, F => system.view::<F>(request, watch, start))
    }
}

impl SceneSystem<'_> {
    fn view<F: Real>(
        &self,
        request: &ViewRequest<'_>,
        watch: &dyn Observer,
        start: Instant,
    ) -> Result<(View, Option<View>), Error> {
        let tables = WalkTables::<F>::new(self.model.scene(), &self.cut)?;
        let radiosity = tables.radiosity(&self.cut, request.walk.absorption)?;
        let last = LastStep(&radiosity);
        let vectors = self.solution.for_walks::<F>()?;
        let mut view = None;
        with_neighbour(self.cut.degree, &vectors, &last, &mut |neighbour| {
            let walker = Walker {
                request,
                watch,
                radiosity: &radiosity,
                last: &last,
                neighbour,
                is_plain: false,
                score: |statistics| statistics.preconditioned().into(),
            };
            view = Some(walker.view(start, request.walk.walks)?);
            Ok(())
        })?;
        let view = view.ok_or(Error::Internal("no walks were made"))?;
        if !request.beside_plain {
            return Ok((view, None));
        }
        let none = NoNeighbour::<WithKnown<'_, LastStep<'_, Radiosity<'_, F>>>>::new();
        let plain = Walker {
            request,
            watch,
            radiosity: &radiosity,
            last: &last,
            neighbour: &none,
            is_plain: true,
            score: |statistics| statistics.plain().into(),
        };
        let one = plain.view(Instant::now(), 1)?;
        let walks = (view.seconds / one.seconds).round().max(1.0) as u64;
        let plain = plain.view(Instant::now(), walks)?;
        Ok((view, Some(plain)))
    }
}

/// Where walks of a pixel start.
struct Pixel<'a, F> {
    radiosity: &'a Radiosity<'a, F>,
    from: [F; 3],
    /// The direction to the pixel's upper left corner, and the vectors from there to the corners beside it.
    corner: [F; 3],
    spans: [[F; 3]; 2],
    /// Whether walks start in the part of it that sees something, and nowhere else.
    is_partial: bool,
}

/// Points of a pixel among which one is sought that sees something.
const TRIES: u32 = 4096;

impl<F: Real> Pixel<'_, F> {
    /// What is seen through the point with these coordinates in the pixel.
    fn at(&self, [s, t]: [F; 2]) -> Option<(Started<Point<F>, F>, F)> {
        let [p, q] = self.spans;
        let to: [F; 3] = core::array::from_fn(|k| self.corner[k] + s * p[k] + t * q[k]);
        let length = (to[0] * to[0] + to[1] * to[1] + to[2] * to[2]).sqrt();
        self.radiosity
            .seen_through_backs(self.from, to.map(|x| x / length))
    }

    /// How many of its corners and its middle see something, of five.
    fn looks(&self) -> usize {
        let looks = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.5, 0.5]];
        let seen = looks.map(|at| self.at(at.map(F::from_f64)).is_some());
        seen.into_iter().filter(|seen| *seen).count()
    }

    /// What is seen through a random point of it, or of its part that sees something.
    fn draw<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Started<Point<F>, F>, F) {
        for _ in 0..if self.is_partial { TRIES } else { 1 } {
            if let Some(seen) = self.at([uniforms.uniform(), uniforms.uniform()]) {
                return seen;
            }
        }
        self.radiosity.nowhere()
    }
}

impl<'e, F: Real, E> Functional<WithKnown<'e, E>> for Pixel<'_, F>
where
    E: StateSpace<Scalar = F, Point = Point<F>>,
{
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Started<Point<F>, F>, F) {
        self.draw(uniforms)
    }
}

/// Walks of one kind.
struct Walker<'w, F> {
    request: &'w ViewRequest<'w>,
    watch: &'w dyn Observer,
    radiosity: &'w Radiosity<'w, F>,
    last: &'w LastStep<'w, Radiosity<'w, F>>,
    neighbour: &'w Boxed<'w, F>,
    is_plain: bool,
    score: fn(&Statistics) -> Spot,
}

/// Parts of a pixel along both sides, through each of which a ray looks for what is known there.
const PARTS: u32 = 8;
/// Pixels whose estimates one thread makes in one go.
const ROW: usize = 64;

impl<F: Real> Walker<'_, F> {
    /// All pixels from so many walks each.
    fn view(&self, start: Instant, walks: u64) -> Result<View, Error> {
        let camera = self.request.camera;
        let [width, height] = camera.size;
        let [ahead, right, above] = camera.frame();
        let vector = |of: &dyn Fn(usize) -> f64| core::array::from_fn(|k| F::from_f64(of(k)));
        let (across, down) = (2.0 / width as f64, -2.0 / height as f64);
        let mut pixels = vec![BLANK; width * height];
        fill_rows(&mut pixels, ROW, |row, spots| {
            for (i, to) in spots.iter_mut().enumerate() {
                let number = row * ROW + i;
                let x = across * (number % width) as f64 - 1.0;
                let y = down * (number / width) as f64 + 1.0;
                let mut pixel = Pixel {
                    radiosity: self.radiosity,
                    from: camera.from.map(F::from_f64),
                    corner: vector(&|k| ahead[k] + x * right[k] + y * above[k]),
                    spans: [vector(&|k| across * right[k]), vector(&|k| down * above[k])],
                    is_partial: false,
                };
                self.watch.walked(walks);
                *to = match pixel.looks() {
                    0 => BLANK,
                    looks => {
                        pixel.is_partial = looks < 5;
                        self.walk(&pixel, number, walks)?
                    }
                };
            }
            Ok::<(), Error>(())
        })?;
        Ok(View {
            pixels,
            walks,
            seconds: start.elapsed().as_secs_f64(),
        })
    }

    /// The mean over a pixel of what is known of u and of v, and its standard error: of rays through equal parts of it, so
    /// that edges are smooth, or through random points of the part that sees something. Neighbours tell what each varies by.
    fn known(&self, pixel: &Pixel<'_, F>, number: usize) -> [f64; 2] {
        // Other numbers than those of any walk.
        let seeds = WalkSeeds::<DefaultGenerator>::new(self.request.walk.seed, !(number as u64));
        let mut draws = RngUniforms(seeds.generator(0));
        let (mut sum, mut squares, mut before) = (0.0, 0.0, 0.0);
        let part = F::from_f64(1.0 / f64::from(PARTS));
        for i in 0..PARTS * PARTS {
            let seen = if pixel.is_partial {
                Some(pixel.draw(&mut draws))
            } else {
                let [s, t]: [F; 2] = [draws.uniform(), draws.uniform()];
                pixel.at([
                    (F::from_u32(i % PARTS) + s) * part,
                    (F::from_u32(i / PARTS) + t) * part,
                ])
            };
            let value = seen.map_or(0.0, |(start, phi)| {
                let v = self.neighbour.value(&self.neighbour.locate(start));
                (phi * v).to_f64()
            });
            sum += value;
            if i % 2 == 1 {
                squares += (value - before) * (value - before);
            }
            before = value;
        }
        let count = f64::from(PARTS * PARTS);
        [sum / count, squares.sqrt() / count]
    }

    /// A few walks of one pixel.
    fn walk(&self, pixel: &Pixel<'_, F>, number: usize, walks: u64) -> Result<Spot, Error> {
        if self.watch.cancelled() {
            return Err(Error::Cancelled);
        }
        let known = (!self.is_plain).then(|| self.known(pixel, number));
        let control_mean = Some(known.map_or(0.0, |[mean, _]| mean));
        let equation = WithKnown(self.last);
        let task = Task {
            equation: &equation,
            neighbour: self.neighbour,
            functional: pixel,
            control_mean,
            estimator: self.request.walk.estimator,
            form: Form::Product,
            seeds: WalkSeeds::<DefaultGenerator>::new(self.request.walk.seed, number as u64),
            length: Length::default(),
        };
        let mut batch = Batch::new(0, walks, walks);
        batch
            .run(&task, walks)
            .map_err(|error| Error::Picture(format!("pixel {number}: {error}")))?;
        if let Some([_, error]) = known {
            batch.set_control_error(error);
        }
        if batch.statistics().terminations().step_limit > 0 {
            let why = "a walk met the step limit, so that a picture would be biased: use a larger `absorption`";
            return Err(Error::Picture(why.to_owned()));
        }
        Ok((self.score)(batch.statistics()))
    }
}
