//! What a camera sees of a scene: the numbers of a picture.

use web_time::Instant;

use fredholm_core::{
    DefaultGenerator, Equation as _, Functional, Goal, LastStep, Real, RngUniforms, Start, StartOf,
    Uniforms, Value as _, WalkSeeds,
};
use fredholm_model::channels::with_sum;
use fredholm_model::{
    Beside, Discretisation, Error, Partitioned, Spot, SpotWalks, WalkOptions, in_channels,
    in_scalar, spots,
};
use fredholm_rayon::Observer;
use fredholm_scene::{Point, Radiosity, Tint, Wide};

use crate::SceneModel;
use crate::camera::Camera;
use crate::partition::{ScenePartition, Walked};
use crate::system::{AnyNeighbour, SceneSystem};

/// Which numbers of a picture are wanted, and how.
#[derive(Clone, Copy, Debug)]
pub struct ViewRequest<'a> {
    /// The camera.
    pub camera: &'a Camera,
    /// How walks are made: `walks` of them for a pixel.
    pub walk: &'a WalkOptions,
    /// What is wanted beside it.
    pub beside: Beside,
}

/// The numbers of a picture.
#[derive(Clone, Debug)]
pub struct View {
    /// The mean of u over each pixel, row by row from the upper left; of several channels that of their weighted sum.
    pub pixels: Vec<Spot>,
    /// The mean over each pixel in every channel, if there are several.
    pub channels: Vec<Vec<Spot>>,
    /// Walks for a pixel.
    pub walks: u64,
    /// Seconds that it took, set-up included.
    pub seconds: f64,
}

impl SceneModel {
    /// Estimates the pixels of a picture, without bias, and, if they are wanted, those by plain walks.
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
        let system = cells.system()?;
        walking();
        in_scalar!(discretisation.scalar, F => {
            let tables = system.cut.tables::<F>()?;
            in_channels!(tables.radiosity()?, &tables.channels, radiosity => {
                views(&LastStep(radiosity), &system, (request, watch), start)
            })
        })
    }
}

/// The view, and beside it that of plain walks, if it is wanted.
fn views<F: Real, C: Tint<F>>(
    equation: &Walked<'_, F, C>,
    system: &SceneSystem<'_>,
    (request, watch): (&ViewRequest<'_>, &dyn Observer),
    start: Instant,
) -> Result<(View, Option<View>), Error> {
    let cut = &system.cut;
    let vectors = system.solution.for_walks::<F>()?;
    let neighbour = cut.neighbour(Some(&vectors), equation)?;
    let walker: Walker<'_, F, C> = SpotWalks {
        equation,
        neighbour: &*neighbour,
        walk: request.walk,
        weights: cut.model.weights(),
        is_plain: false,
        watch,
    };
    let camera = &Camera {
        from: cut.model.scene.moved_in(request.camera.from),
        towards: cut.model.scene.moved_in(request.camera.towards),
        ..*request.camera
    };
    let view = view(&walker, camera, start, request.walk.walks)?;
    let none = cut.neighbour(None, equation)?;
    let plain: Walker<'_, F, C> = SpotWalks {
        neighbour: &*none,
        is_plain: true,
        ..walker
    };
    let plain = |walks| self::view(&plain, camera, Instant::now(), walks);
    let walks = request
        .beside
        .walks(view.seconds, || Ok(plain(1)?.seconds))?;
    let beside = walks.map(plain);
    Ok((view, beside.transpose()?))
}

/// Points of a pixel among which one is sought that sees something.
const TRIES: u32 = 4096;

/// Where walks of a pixel start.
struct Pixel<F> {
    from: [F; 3],
    /// The direction to the pixel's upper left corner, and the vectors from there to the corners beside it.
    corner: [F; 3],
    spans: [[F; 3]; 2],
    /// Whether walks start in the part of it that sees something, and nowhere else.
    is_partial: bool,
    /// Whether the mean of what starts know is told elsewhere.
    is_known: bool,
}

impl<F: Real> Pixel<F> {
    /// What is seen through the point with these coordinates in the pixel.
    fn at<C>(&self, radiosity: &Radiosity<'_, F, C>, at: [F; 2]) -> Option<Point<F>> {
        radiosity.seen_through_backs(self.from, self.towards(at))
    }

    /// How many of its corners and its middle see something, of five.
    fn looks<C>(&self, radiosity: &Radiosity<'_, F, C>) -> usize {
        let looks = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.5, 0.5]];
        let seen = looks.map(|at| self.at(radiosity, at.map(F::from_f64)).is_some());
        seen.into_iter().filter(|seen| *seen).count()
    }

    /// What is seen through a random point of it, or of its part that sees something.
    fn draw<C, U: Uniforms<F>>(
        &self,
        radiosity: &Radiosity<'_, F, C>,
        uniforms: &mut U,
    ) -> Option<Point<F>> {
        let tries = if self.is_partial { TRIES } else { 1 };
        let at = |at| Some((self.at(radiosity, at)?, at));
        let seen = (0..tries).find_map(|_| at([uniforms.uniform(), uniforms.uniform()]));
        let (point, at) = seen?;
        radiosity.mirrored(Some(point), self.towards(at), uniforms)
    }

    /// The direction to the point with these coordinates in the pixel.
    fn towards(&self, [s, t]: [F; 2]) -> [F; 3] {
        let [p, q] = self.spans;
        let to: [F; 3] = core::array::from_fn(|k| self.corner[k] + s * p[k] + t * q[k]);
        let length = (to[0] * to[0] + to[1] * to[1] + to[2] * to[2]).sqrt();
        to.map(|x| x / length)
    }
}

impl<'e, 'r, F: Real, C: Tint<F>> Functional<LastStep<'e, Radiosity<'r, F, C>>> for Pixel<F> {
    fn start<U: Uniforms<F>>(
        &self,
        equation: &LastStep<'e, Radiosity<'r, F, C>>,
        uniforms: &mut U,
    ) -> StartOf<Radiosity<'r, F, C>> {
        let seen = self.draw(equation.0, uniforms);
        let start = equation.0.start_at(seen, F::from_f64(1.0));
        match self.is_known {
            true => Start::of(equation, start.point, start.phi),
            false => start,
        }
    }
}

/// Walks of one kind.
type Walker<'w, F, C> = SpotWalks<'w, Walked<'w, F, C>, AnyNeighbour<'w, F, <C as Tint<F>>::Value>>;

/// Parts of a pixel along both sides, through each of which a ray looks for what is known there.
const PARTS: u32 = 8;
/// All pixels from a number of walks each.
fn view<F: Real, C: Tint<F>>(
    walker: &Walker<'_, F, C>,
    camera: &Camera,
    start: Instant,
    walks: u64,
) -> Result<View, Error> {
    let [width, height] = camera.size;
    let [ahead, right, above] = camera.frame();
    let vector = |of: &dyn Fn(usize) -> f64| core::array::from_fn(|k| F::from_f64(of(k)));
    let (across, down) = (2.0 / width as f64, -2.0 / height as f64);
    let radiosity = walker.equation.0;
    let means = walker.equation.channels() + usize::from(!walker.weights.is_empty());
    let (pixels, channels) = spots(width * height, means, &|number, to| {
        let x = across * (number % width) as f64 - 1.0;
        let y = down * (number / width) as f64 + 1.0;
        let mut pixel = Pixel {
            from: camera.from.map(F::from_f64),
            corner: vector(&|k| ahead[k] + x * right[k] + y * above[k]),
            spans: [vector(&|k| across * right[k]), vector(&|k| down * above[k])],
            is_partial: false,
            is_known: !walker.is_plain,
        };
        walker.watch.walked(walks);
        let looks = pixel.looks(radiosity);
        pixel.is_partial = looks < 5;
        if looks == 0 {
            return Ok(());
        }
        let mut errors = vec![0.0; to.len()];
        let goal = goal(walker, pixel, number as u64, &mut errors);
        walker.walk(&goal, number as u64, walks, to)?;
        for (to, error) in to.iter_mut().zip(errors) {
            to.error = to.error.hypot(error);
        }
        Ok(())
    })?;
    Ok(View {
        pixels,
        channels,
        walks,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// The goal of a pixel with the means of v and of what is known besides, and their standard errors: of rays through equal parts of
/// it, so that edges are smooth, or through random points of the part that sees something. Neighbours tell what each varies
/// by. Of plain walks both are 0.
fn goal<F: Real, C: Tint<F>>(
    walker: &Walker<'_, F, C>,
    pixel: Pixel<F>,
    number: u64,
    errors: &mut [f64],
) -> Goal<Pixel<F>, Wide<F, C>> {
    let radiosity = walker.equation.0;
    // Other numbers than those of any walk.
    let seeds = WalkSeeds::<DefaultGenerator>::new(walker.walk.seed, !number);
    let mut draws = RngUniforms(seeds.generator(0));
    let nothing = Wide::<F, C>::splat(walker.equation.channels(), 0.0);
    let [mut v, mut known, mut before] = [nothing; 3];
    let part = F::from_f64(1.0 / f64::from(PARTS));
    for i in 0..if walker.is_plain { 0 } else { PARTS * PARTS } {
        let seen = if pixel.is_partial {
            pixel.draw(radiosity, &mut draws)
        } else {
            let within = [i % PARTS, i / PARTS];
            let at = within.map(|i| (F::from_u32(i) + draws.uniform()) * part);
            let seen = pixel.at(radiosity, at);
            radiosity.mirrored(seen, pixel.towards(at), &mut draws)
        };
        let start = radiosity.start_at(seen, F::from_f64(1.0));
        let at = walker.neighbour.locate(start.point);
        let of_v = walker.neighbour.value(&at).scaled(start.phi).wide();
        let value = of_v.plus(&start.known.wide());
        (v, known) = (v.plus(&of_v), known.plus(&start.known.wide()));
        if i % 2 == 1 {
            let off = with_sum(&value.minus(&before), walker.weights);
            let sums = errors.iter_mut().zip(off);
            sums.for_each(|(sum, off)| *sum += off * off);
        }
        before = value;
    }
    let count = f64::from(PARTS * PARTS);
    errors.iter_mut().for_each(|sum| *sum = sum.sqrt() / count);
    Goal {
        functional: pixel,
        control_mean: Some(v.scaled(1.0 / count)),
        known: known.scaled(1.0 / count),
    }
}
