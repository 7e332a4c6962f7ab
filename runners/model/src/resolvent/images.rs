//! Values by the iterate: T_K of what the points that all targets share tell of u.

use fredholm_core::galerkin::{buffer, degree_of, functions};
use fredholm_core::resolvent::{
    AxisNode, CellPoint, Grid, Image, ImageBounds, Images, MOST_SCORED, Regular, total_degrees,
};
use fredholm_core::{DefaultGenerator, Real, RngUniforms, WalkSeeds};
use fredholm_rayon::{fill_rows, gathered};
use fredholm_variance::{gauss, gauss_lobatto};

use super::blocks::{BlockSum, Blocks, sign};
use super::cut::{Asked, Cut, on_axis};
use super::regular::{AnyPoint, AnyRegular};
use crate::{Error, GLOBAL_REPLICATES, GlobalField, GlobalQuantity, IMAGE_HEAD, Region, only_u};

/// The degree on which points score, above that of the tables: a projection on polynomials of degree p loses all that they leave.
const HIGHER: [usize; 4] = [4, 3, 2, 1];
/// The largest dimension in which all of these are looked at: with more, functions would be so many that a point takes twice the time.
const MOST_PLANE: usize = 2;
/// The highest degree of functions on a cell.
const MOST_DEGREE: usize = 7;
/// The most values of K of an image.
const MOST_EVALUATIONS: u64 = 1 << 17;
/// How far within its ends a rule has nodes that are meant for these, in roundings: K may have no value in an end.
const INSET: f64 = 4096.0;
/// Points whose weights are made in one go.
const TOGETHER: usize = 16;
/// The number of the goal of draws of images.
const DRAWS: u64 = u32::MAX as u64 - 1;

/// The number of functions on a cell that points score on where values are images. `None`: there are none of a higher degree.
pub(super) fn scored(dimension: usize, own: usize) -> Option<usize> {
    let degree = degree_of(dimension, own);
    let from = if dimension > MOST_PLANE { 2 } else { 0 };
    let degrees = HIGHER.iter().skip(from).map(|higher| degree + higher);
    let all = degrees.filter(|&degree| degree <= MOST_DEGREE);
    let mut all = all.map(|degree| functions(dimension, degree));
    all.find(|&scored| scored <= MOST_SCORED)
}

/// A rule with both ends and one without: a kink that is nearer to an edge than all nodes of the second one is seen by the first. Of a jump
/// along a diagonal the first one has nodes on it, which count for one side, and the second one has none.
fn compared(points: usize, dimension: usize) -> Result<[Vec<Vec<AxisNode>>; 2], Error> {
    let inset = INSET * f64::EPSILON;
    let mut closed = on_axis(&gauss_lobatto(points)?);
    closed
        .iter_mut()
        .for_each(|node| node.at = node.at.clamp(inset, 1.0 - inset));
    let open = [0, 1, 2].map(|more| gauss(points - 1 + more));
    let open = open.into_iter().take(dimension);
    let open = open.map(|rule| Ok::<_, Error>(on_axis(&rule?)));
    Ok([vec![closed], open.collect::<Result<_, _>>()?])
}

/// What a value is made of.
#[derive(Clone, Debug, Default)]
pub(super) struct Imaged {
    /// What the sums of all blocks count for.
    pub(super) weights: Vec<f64>,
    /// What takes no walks: of a point F + T_K g.
    pub(super) known: f64,
    /// The sum of the sizes of its terms.
    pub(super) size: f64,
    pub(super) image: Image,
}

/// Images of a solved equation.
pub(super) struct ImageMaker<'c, 'k> {
    cut: &'c Cut<'k>,
    images: Images<'c, Grid<AnyRegular<'k>>>,
    pub(super) scored: usize,
    /// Where the functions of the tables are among those that points score on.
    places: Vec<usize>,
    is_highest: Vec<bool>,
    bounds: ImageBounds,
    seed: u64,
}

impl<'c, 'k> ImageMaker<'c, 'k> {
    /// Images that may be off by so much, with draws of this seed.
    pub(super) fn new(cut: &'c Cut<'k>, (error, seed): (f64, u64)) -> Result<Self, Error> {
        let dimension = cut.equation.dimension();
        let Some(scored) = scored(dimension, cut.functions) else {
            return Err(Error::Internal("no functions of a higher degree"));
        };
        let degree = degree_of(dimension, scored);
        // One has a node in the middle and the other has none: where K jumps between all nodes, both would say that it is there.
        let (rules, small) = (compared(degree + 2, dimension)?, compared(3, dimension)?);
        let own = degree_of(dimension, cut.functions);
        let degrees = total_degrees(dimension, degree);
        let places = degrees.iter().enumerate();
        let places = places.filter_map(|(place, &degree)| (degree <= own).then_some(place));
        Ok(Self {
            cut,
            images: gathered(|| Images::new(cut.resolvent(), scored, [&rules, &small]))?,
            scored,
            places: places.collect(),
            is_highest: degrees.iter().map(|own| *own == degree).collect(),
            bounds: ImageBounds {
                error,
                most: MOST_EVALUATIONS,
            },
            seed,
        })
    }

    /// What regions are made of.
    pub(super) fn imaged(&self, regions: &[&Region]) -> Result<Vec<Imaged>, Error> {
        let mut all = vec![Imaged::default(); regions.len()];
        fill_rows(&mut all, TOGETHER, |number, out| {
            let found = self.some(&regions[number * TOGETHER..][..out.len()])?;
            out.iter_mut().zip(found).for_each(|(out, own)| *out = own);
            Ok::<(), Error>(())
        })?;
        Ok(all)
    }

    fn some(&self, regions: &[&Region]) -> Result<Vec<Imaged>, Error> {
        let half = self.cut.measures.len() * self.scored;
        let (mut all, mut others) = (Vec::with_capacity(regions.len()), Vec::new());
        for region in regions {
            let mut weights = buffer(2 * half)?;
            let integrals = &mut weights[..half];
            let asked = self.cut.ask(region)?;
            let (known, image) = match &asked.point {
                Some(x) => {
                    // The same point has the same draws, whoever asks.
                    let bits = x.parameters.iter();
                    let bits = bits.fold(x.cell as u64, |all, t| all.rotate_left(23) ^ t.to_bits());
                    let seeds = WalkSeeds::<DefaultGenerator>::new(self.seed, DRAWS);
                    let mut draws = RngUniforms(seeds.generator(bits));
                    let image = self.images.image(x, &self.bounds, integrals, &mut draws);
                    let source = self.cut.equation.source(&x.point).to_f64();
                    (source + image.value, image)
                }
                None => {
                    let found = self.functional(&asked, integrals);
                    others.push((all.len(), asked.weights));
                    found
                }
            };
            all.push(Imaged {
                weights,
                known,
                size: asked.size,
                image,
            });
        }
        self.count_blocks(&mut all)?;
        for (number, own) in others {
            let cells = all[number].weights.chunks_exact_mut(self.scored);
            let own = own.chunks_exact(self.cut.functions);
            for (to, own) in cells.zip(own.clone().chain(own)) {
                let places = self.places.iter().zip(own);
                places.for_each(|(place, w)| to[*place] += w);
            }
        }
        Ok(all)
    }

    /// What takes no walks of a functional that is no point, with the integrals of what polynomials leave of its density.
    fn functional(&self, asked: &Asked<'_>, integrals: &mut [f64]) -> (f64, Image) {
        let Some(rest) = &asked.rest else {
            return (asked.known, Image::default());
        };
        let resolvent = self.cut.resolvent();
        let density = |x: &CellPoint<AnyPoint>| {
            (rest.weight)(&x.point) - resolvent.series(&rest.polynomial, x)
        };
        let [coarse, fine] = self.images.moments(&density, integrals);
        let error = (fine - coarse).abs();
        let image = Image {
            error,
            ..Image::default()
        };
        (asked.known + fine, image)
    }

    /// Makes the integrals of functions what blocks count for: ê = ψᵀ R'(β + ρ) + ψ⁺ᵀ β⁺.
    fn count_blocks(&self, all: &mut [Imaged]) -> Result<(), Error> {
        let (cut, scored) = (self.cut, self.scored);
        let (own, width) = (cut.functions, cut.source.len());
        let mut back: Vec<f64> = buffer(all.len().saturating_mul(width))?;
        for (row, numbers) in cut.resolvent.chunks_exact(width).enumerate() {
            let place = row / own * scored + self.places[row % own];
            for (imaged, back) in all.iter().zip(back.chunks_exact_mut(width)) {
                let integral = imaged.weights[place];
                let terms = back.iter_mut().zip(numbers);
                terms.for_each(|(to, r)| *to += integral * r);
            }
        }
        for (imaged, back) in all.iter_mut().zip(back.chunks_exact(width)) {
            let half = imaged.weights.len() / 2;
            let (pairs, sources) = imaged.weights.split_at_mut(half);
            let cells = pairs
                .chunks_exact_mut(scored)
                .zip(sources.chunks_exact_mut(scored));
            let cells = cells.zip(back.chunks_exact(own).zip(&cut.measures));
            for ((pairs, sources), (back, measure)) in cells {
                pairs.iter_mut().for_each(|w| *w /= measure);
                for (place, w) in self.places.iter().zip(back) {
                    pairs[*place] += w;
                    sources[*place] = *w;
                }
            }
        }
        Ok(())
    }

    /// What walks add to a value, with the error of samples and of rules in its image: this is small beside the errors that are asked for, and
    /// need not be beside a value's own.
    pub(super) fn sum(&self, own: &Imaged, blocks: &Blocks) -> BlockSum {
        let mut sum = blocks.sum(&own.weights);
        let error = own.image.variance.sqrt().hypot(own.image.error);
        let column = own.known.to_bits() as usize;
        let errors = sum.errors.iter_mut().enumerate();
        errors.for_each(|(replicate, to)| *to += sign(column, replicate) * error);
        sum.variance += error * error;
        sum.squares += own.image.squares;
        sum
    }

    /// Values as [`GlobalField::images`] has them.
    pub(super) fn rows(&self, all: &[Imaged], blocks: &Blocks) -> Vec<f64> {
        let rows = all.iter().flat_map(|own| {
            let (sum, highest) = (self.sum(own, blocks), self.highest(own, blocks));
            let (worth, noise) = (highest.value, highest.std_error());
            let scale = ((GLOBAL_REPLICATES - 1) as f64).sqrt() * sum.widening();
            let values = sum.errors.map(|error| sum.value + scale * error);
            let head = [own.known, own.image.error].into_iter().chain(values);
            head.chain([worth + noise, worth - noise])
        });
        rows.collect()
    }

    /// What a value would move by with scores of one degree less.
    pub(super) fn highest(&self, own: &Imaged, blocks: &Blocks) -> BlockSum {
        let mut weights = own.weights.clone();
        let (pairs, sources) = weights.split_at_mut(own.weights.len() / 2);
        let lower = pairs.iter_mut().zip(self.is_highest.iter().cycle());
        let lower = lower.filter_map(|(w, is_highest)| (!is_highest).then_some(w));
        lower.chain(sources).for_each(|w| *w = 0.0);
        blocks.sum(&weights)
    }
}

/// A solved equation, and what walks have found.
pub(super) struct ImageField<'k> {
    pub(super) cut: Box<Cut<'k>>,
    pub(super) blocks: Blocks,
    /// The error of values, of which rules and samples of T_K have a part, and the seed of these.
    pub(super) by: (f64, u64),
}

impl GlobalField for ImageField<'_> {
    fn rows(&self) -> usize {
        GLOBAL_REPLICATES + 2
    }

    /// At a point the second number is how far rules may be off.
    fn images(&self, quantity: GlobalQuantity, regions: &[Region]) -> Result<Vec<f64>, Error> {
        only_u(quantity)?;
        let maker = ImageMaker::new(&self.cut, self.by)?;
        let width = IMAGE_HEAD + self.rows();
        let mut images = buffer(regions.len().saturating_mul(width))?;
        fill_rows(&mut images, TOGETHER * width, |number, images| {
            let regions = regions.iter().skip(number * TOGETHER).take(TOGETHER);
            let all = maker.some(&regions.collect::<Vec<_>>())?;
            images.copy_from_slice(&maker.rows(&all, &self.blocks));
            Ok::<(), Error>(())
        })?;
        Ok(images)
    }
}
