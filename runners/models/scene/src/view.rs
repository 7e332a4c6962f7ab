//! What a camera sees of a scene: the numbers of a picture.

use std::time::Instant;

use fredholm_core::{
    Batch, DefaultGenerator, LastStep, NoNeighbour, Real, RngUniforms, Uniforms as _, WalkSeeds,
    WithKnown,
};
use fredholm_model::channels;
use fredholm_model::{
    BLANK, Discretisation, Error, Model as _, Partitioned, Spot, WalkOptions, in_scalar,
};
use fredholm_rayon::{Observer, fill_rows};
use fredholm_scene::{Coloured, Radiosity};

use crate::SceneModel;
use crate::camera::Camera;
use crate::channels::{FaceTables, with_neighbours};
use crate::coloured::ColouredSystem;
use crate::partition::{ScenePartition, WalkTables};
use crate::pixel::{AllChannels, OneChannel, Pixel, PixelWalks};
use crate::system::{SceneSystem, with_neighbour};

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
    /// The mean of u over each pixel, row by row from the upper left; of several channels that of their weighted sum.
    pub pixels: Vec<Spot>,
    /// The mean over each pixel in every channel, if there are several.
    pub channels: Vec<Vec<Spot>>,
    /// Walks for a pixel.
    pub walks: u64,
    /// Seconds that it took, set-up included.
    pub seconds: f64,
}

impl View {
    /// The names of a pixel's [numbers](Self::numbers) in a table: values and standard errors, of all channels if there are several.
    #[must_use]
    pub fn names(scene: &SceneModel) -> Vec<String> {
        channels::columns(scene.channels(), "seen")
    }

    /// The value and the standard error of a pixel, in every channel and then for their sum if there are several; NaN where nothing is
    /// seen, and where there is no such pixel.
    #[must_use]
    pub fn numbers(&self, pixel: usize) -> Vec<f64> {
        channels::numbers(&self.channels, &self.pixels, pixel)
    }

    /// Red, green and blue of every pixel, if these are the channels of the scene.
    #[must_use]
    pub fn colours(&self, scene: &SceneModel) -> Option<[Vec<f64>; 3]> {
        channels::colours(scene.channels(), &self.channels)
    }
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
        let absorption = request.walk.absorption;
        let making = Making {
            request,
            watch,
            start,
        };
        if let Some(colours) = self.colours() {
            let system = cells.coloured_system(colours, absorption)?;
            walking();
            return in_scalar!(discretisation.scalar, F => making.of_colours::<F>(&system));
        }
        let system = cells.system(absorption)?;
        walking();
        in_scalar!(discretisation.scalar, F => making.of_one::<F>(&system))
    }
}

/// A view that is asked for, since when, and who watches.
#[derive(Clone, Copy)]
struct Making<'a> {
    request: &'a ViewRequest<'a>,
    watch: &'a dyn Observer,
    start: Instant,
}

impl Making<'_> {
    fn of_one<F: Real>(&self, system: &SceneSystem<'_>) -> Result<(View, Option<View>), Error> {
        let tables = WalkTables::<F>::new(system.model.scene(), &system.cut)?;
        let radiosity = tables.radiosity(&system.cut, self.request.walk.absorption)?;
        let last = LastStep(&radiosity);
        let vectors = system.solution.for_walks::<F>()?;
        let mut view = None;
        with_neighbour(system.cut.degree, &vectors, &last, &mut |neighbour| {
            let walks = OneChannel {
                last: &last,
                neighbour,
                walk: self.request.walk,
                is_plain: false,
            };
            view = Some(self.view(&radiosity, &walks)?);
            Ok(())
        })?;
        let none = NoNeighbour::<WithKnown<'_, LastStep<'_, Radiosity<'_, F>>>>::new();
        let plain = OneChannel {
            last: &last,
            neighbour: &none,
            walk: self.request.walk,
            is_plain: true,
        };
        self.beside(view, &radiosity, &plain)
    }

    fn of_colours<F: Real>(
        &self,
        system: &ColouredSystem<'_>,
    ) -> Result<(View, Option<View>), Error> {
        let absorption = self.request.walk.absorption;
        let tables = WalkTables::<F>::new(system.model.scene(), &system.cut)?;
        let faces = FaceTables::new(&system.per_face);
        let coloured = faces.of(tables.radiosity(&system.cut, absorption)?)?;
        let of_channels = system.solved.tables::<F>(system.cut.degree)?;
        let weights = system.colours.weights();
        let mut view = None;
        let to = (&coloured, weights);
        with_neighbours(system.cut.degree, &of_channels, to, &mut |neighbours| {
            let walks = AllChannels {
                coloured: &coloured,
                weights,
                neighbours,
                walk: self.request.walk,
                is_plain: false,
            };
            view = Some(self.view(coloured.radiosity(), &walks)?);
            Ok(())
        })?;
        let none = NoNeighbour::<Coloured<'_, F>>::new();
        let plain = AllChannels {
            coloured: &coloured,
            weights,
            neighbours: &none,
            walk: self.request.walk,
            is_plain: true,
        };
        self.beside(view, coloured.radiosity(), &plain)
    }

    fn view<F: Real>(
        &self,
        radiosity: &Radiosity<'_, F>,
        walks: &dyn PixelWalks<F>,
    ) -> Result<View, Error> {
        let walker = Walker {
            making: self,
            radiosity,
            walks,
        };
        walker.view(self.start, self.request.walk.walks)
    }

    /// The view, and beside it that of plain walks that take as long, if it is wanted.
    fn beside<F: Real>(
        &self,
        view: Option<View>,
        radiosity: &Radiosity<'_, F>,
        plain: &dyn PixelWalks<F>,
    ) -> Result<(View, Option<View>), Error> {
        let view = view.ok_or(Error::Internal("no walks were made"))?;
        if !self.request.beside_plain {
            return Ok((view, None));
        }
        let plain = Walker {
            making: self,
            radiosity,
            walks: plain,
        };
        let one = plain.view(Instant::now(), 1)?;
        let walks = (view.seconds / one.seconds).round().max(1.0) as u64;
        let plain = plain.view(Instant::now(), walks)?;
        Ok((view, Some(plain)))
    }
}

/// Walks of one kind.
struct Walker<'w, F> {
    making: &'w Making<'w>,
    radiosity: &'w Radiosity<'w, F>,
    walks: &'w dyn PixelWalks<F>,
}

/// Parts of a pixel along both sides, through each of which a ray looks for what is known there.
const PARTS: u32 = 8;
/// Pixels whose estimates one thread makes in one go.
const ROW: usize = 64;

impl<F: Real> Walker<'_, F> {
    /// All pixels from so many walks each.
    fn view(&self, start: Instant, walks: u64) -> Result<View, Error> {
        let camera = self.making.request.camera;
        let [width, height] = camera.size;
        let [ahead, right, above] = camera.frame();
        let vector = |of: &dyn Fn(usize) -> f64| core::array::from_fn(|k| F::from_f64(of(k)));
        let (across, down) = (2.0 / width as f64, -2.0 / height as f64);
        let means = self.walks.means();
        let mut spots = vec![BLANK; width * height * means];
        fill_rows(&mut spots, ROW * means, |row, spots| {
            for (i, to) in spots.chunks_mut(means).enumerate() {
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
                self.making.watch.walked(walks);
                match pixel.looks() {
                    0 => to.fill(BLANK),
                    looks => {
                        pixel.is_partial = looks < 5;
                        self.walk(&pixel, number, walks, to)?;
                    }
                }
            }
            Ok::<(), Error>(())
        })?;
        let of = |mean: usize| spots.iter().skip(mean).step_by(means).copied().collect();
        Ok(View {
            // The sum of several channels comes last.
            pixels: of(means - 1),
            channels: (0..means - 1).map(of).collect(),
            walks,
            seconds: start.elapsed().as_secs_f64(),
        })
    }

    /// The means over a pixel of v and of what is known besides, and the standard errors of both together: of rays through
    /// equal parts of it, so that edges are smooth, or through random points of the part that sees something. Neighbours tell
    /// what each varies by.
    fn looks(&self, pixel: &Pixel<'_, F>, number: usize) -> ([Vec<f64>; 2], Vec<f64>) {
        // Other numbers than those of any walk.
        let seed = self.making.request.walk.seed;
        let seeds = WalkSeeds::<DefaultGenerator>::new(seed, !(number as u64));
        let mut draws = RngUniforms(seeds.generator(0));
        let zeros = || vec![0.0; self.walks.means()];
        let [mut v, mut known, mut before, mut squares] = [(); 4].map(|()| zeros());
        let mut looks = [zeros(), zeros()];
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
            v.fill(0.0);
            known.fill(0.0);
            if let Some(seen) = seen {
                self.walks.look(seen, [&mut v, &mut known]);
            }
            for (mean, (v, known)) in v.iter().zip(&known).enumerate() {
                looks[0][mean] += v;
                looks[1][mean] += known;
                let value = v + known;
                if i % 2 == 1 {
                    squares[mean] += (value - before[mean]) * (value - before[mean]);
                }
                before[mean] = value;
            }
        }
        let count = f64::from(PARTS * PARTS);
        let looks = looks.map(|sums| sums.into_iter().map(|sum| sum / count).collect());
        let errors = squares.into_iter().map(|squares| squares.sqrt() / count);
        (looks, errors.collect())
    }

    /// A few walks of one pixel.
    fn walk(
        &self,
        pixel: &Pixel<'_, F>,
        number: usize,
        walks: u64,
        to: &mut [Spot],
    ) -> Result<(), Error> {
        if self.making.watch.cancelled() {
            return Err(Error::Cancelled);
        }
        let is_plain = self.walks.is_plain();
        let looks = (!is_plain).then(|| self.looks(pixel, number));
        let mut batches = vec![Batch::new(0, walks, walks); to.len()];
        let means = looks.as_ref().map(|(means, _)| means);
        self.walks
            .run(pixel, number as u64, means, &mut batches)
            .map_err(|error| Error::Picture(format!("pixel {number}: {error}")))?;
        for (mean, (batch, to)) in batches.iter_mut().zip(to).enumerate() {
            if let Some((_, errors)) = &looks {
                batch.set_control_error(errors[mean]);
            }
            let statistics = batch.statistics();
            if statistics.terminations().step_limit > 0 {
                let why = "a walk met the step limit, so that a picture would be biased: use a larger `absorption`";
                return Err(Error::Picture(why.to_owned()));
            }
            *to = match is_plain {
                true => statistics.plain().into(),
                false => statistics.preconditioned().into(),
            };
        }
        Ok(())
    }
}
