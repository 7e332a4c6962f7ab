//! Predictions of variances by draws from parts of a space.

use core::ops::Range;

use fredholm_core::galerkin::{Cells, GalerkinError};
use fredholm_core::{DefaultGenerator, Equation, NeighbourOf, RngUniforms, Uniforms, WalkSeeds};
use fredholm_rayon::fill_rows;
use fredholm_variance::{DrawCounts, DrawnSite, DrawnStart, Draws, Walked};

use crate::Error;

/// The number of nodes that make one site, as pairs of sites are what takes memory.
const NODES: usize = 4;
/// Draws of a site.
const SITE: DrawCounts = DrawCounts {
    scores: 256,
    steps: 512,
};
/// Draws of a point in which walks start.
const START: DrawCounts = DrawCounts {
    scores: 16_384,
    steps: 8192,
};
/// The number in place of a goal's that draws of sites have, and that of starts.
const NUMBERS: [u64; 2] = [u64::MAX - 4, u64::MAX - 5];

/// About so many sites make a prediction with so many nodes.
#[must_use]
pub const fn wanted_sites(nodes: usize) -> usize {
    let sites = nodes / NODES;
    if sites == 0 { 1 } else { sites }
}

/// A part of a space: a cell or, where they are too many, a run of them.
#[derive(Clone, Debug)]
pub struct Site {
    /// The cells.
    pub cells: Range<usize>,
    /// The sum of their measures.
    pub measure: f64,
    /// The number of the part of the space, such as a surface, to which all of them belong; `None`: of none.
    pub part: Option<usize>,
}

/// Sites, made of the cells of a map of the space.
pub struct Sites<'a, M: Cells> {
    map: &'a M,
    /// The sites.
    pub all: Vec<Site>,
    /// A point of the map as walks have it, and one of walks as the map has it.
    convert: [&'a Convert<'a, M::Point>; 2],
}

/// A point as others have it.
type Convert<'a, P> = dyn Fn(&P) -> P + Sync + 'a;

impl<M: Cells> core::fmt::Debug for Sites<'_, M> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_tuple("Sites").field(&self.all).finish()
    }
}

impl<'a, M> Sites<'a, M>
where
    M: Cells<Scalar = f64> + Sync,
    M::Point: Send + Sync,
{
    /// About so many sites on the cells of a map, each in one part of the space. `convert`: a point of the map as walks have it, and one of
    /// walks as the map has it.
    pub fn new(
        map: &'a M,
        wanted: usize,
        part: impl Fn(usize) -> Option<usize>,
        convert: [&'a Convert<'a, M::Point>; 2],
    ) -> Self {
        let run = map.cells().div_ceil(wanted.max(1));
        let mut all: Vec<Site> = Vec::new();
        for cell in 0..map.cells() {
            let (part, measure) = (part(cell), measure(map, cell));
            match all.last_mut() {
                Some(site) if site.part == part && site.cells.len() < run => {
                    site.cells.end += 1;
                    site.measure += measure;
                }
                _ => all.push(Site {
                    cells: cell..cell + 1,
                    measure,
                    part,
                }),
            }
        }
        Self { map, all, convert }
    }

    /// The site of a point of walks.
    pub fn of_point(&self, x: &M::Point) -> usize {
        let cell = self.map.locate(&self.convert[1](x));
        let after = self.all.partition_point(|site| site.cells.start <= cell);
        after.max(1) - 1
    }

    /// A uniform point of a site.
    fn point(&self, site: &Site, draws: &mut Draws) -> M::Point {
        let uniform: f64 = draws.uniform();
        let mut left = uniform * site.measure;
        let chosen = site.cells.clone().find(|&cell| {
            left -= measure(self.map, cell);
            left < 0.0
        });
        let mut t = [0.0; 2];
        let t = t.get_mut(..M::DIMENSION).unwrap_or_default();
        t.fill_with(|| draws.uniform());
        self.convert[0](&self.map.point(chosen.unwrap_or(site.cells.end - 1), t))
    }

    /// Draws of all sites, on all threads.
    ///
    /// # Errors
    /// [`Error::Galerkin`]: memory.
    pub fn drawn<E, N>(&self, walked: &Walked<'_, E, N>) -> Result<Vec<DrawnSite>, Error>
    where
        E: Equation<Scalar = f64, Point = M::Point, Value = f64> + Sync,
        N: NeighbourOf<E> + Sync + ?Sized,
    {
        let seeds = WalkSeeds::<DefaultGenerator>::new(1, NUMBERS[0]);
        let mut drawn: Vec<Option<DrawnSite>> = vec![None; self.all.len()];
        fill_rows(&mut drawn, 1, |number, row| {
            let site = &self.all[number];
            let mut draws = RngUniforms(seeds.generator(number as u64));
            let mut point = |draws: &mut Draws| self.point(site, draws);
            let of_point = |y: &M::Point| self.of_point(y);
            let found = DrawnSite::new(walked, SITE, &mut draws, &mut point, &of_point)?;
            row.fill(Some(found.with_measure(site.measure)));
            Ok::<(), GalerkinError>(())
        })?;
        Ok(drawn.into_iter().flatten().collect())
    }

    /// The start of walks of the goal of this number in a point.
    ///
    /// # Errors
    /// [`Error::Galerkin`]: memory.
    pub fn start<'s, E, N>(
        &self,
        walked: &Walked<'_, E, N>,
        x: M::Point,
        number: u64,
    ) -> Result<DrawnStart<'s>, Error>
    where
        E: Equation<Scalar = f64, Point = M::Point, Value = f64>,
        N: NeighbourOf<E> + ?Sized,
    {
        let seeds = WalkSeeds::<DefaultGenerator>::new(1, NUMBERS[1]);
        let mut draws = RngUniforms(seeds.generator(number));
        let of_point = |y: &M::Point| self.of_point(y);
        let drawn = DrawnSite::new(walked, START, &mut draws, &mut |_| x, &of_point)?;
        Ok(DrawnStart::At(self.of_point(&x), drawn))
    }
}

/// The measure of a cell; 1 of one in which no walk starts, as in the sky.
fn measure(map: &impl Cells, cell: usize) -> f64 {
    match map.measure(cell) {
        0.0 => 1.0,
        measure => measure,
    }
}
