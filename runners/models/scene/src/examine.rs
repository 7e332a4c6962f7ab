//! Predictions of variances, by draws from parts of the surfaces.

use core::ops::Range;

use fredholm_core::galerkin::{Cells as _, GalerkinError};
use fredholm_core::{At, DefaultGenerator, LastStep, RngUniforms, Uniforms, WalkSeeds};
use fredholm_model::heat::RadiativeExchange as _;
use fredholm_model::{Error, Examined, Request};
use fredholm_rayon::fill_rows;
use fredholm_scene::{Cells, Grey, Point, Radiosity, Scene, Tables};
use fredholm_variance::{
    Density, DrawCounts, DrawnModel, DrawnSite, DrawnStart, Draws, Walked as Drawn,
};

use crate::partition::Walked;
use crate::places::{Origin, Place};
use crate::system::{AnyNeighbour, SceneSystem};

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

/// A part of a surface or of the sky: a cell or, where they are too many, a run of them.
struct Site {
    cells: Range<usize>,
    measure: f64,
    /// The face of the first cell; that of the sky is none.
    face: u32,
    /// The surface; `None`: the sky.
    surface: Option<usize>,
}

/// All sites, made of cells of their own.
struct Sites<'a> {
    map: Radiosity<'a, f64>,
    all: Vec<Site>,
}

impl<'a> Sites<'a> {
    /// About so many sites.
    fn new(scene: &Scene, map: Radiosity<'a, f64>, wanted: usize) -> Self {
        let run = map.cells().div_ceil(wanted.max(1));
        let mut all: Vec<Site> = Vec::new();
        for cell in 0..map.cells() {
            let face = map.point(cell, &[0.5, 0.25]).face;
            let surface = scene.place(face as usize).map(|place| place.surface);
            let measure = measure(&map, cell);
            match all.last_mut() {
                Some(site) if site.surface == surface && site.cells.len() < run => {
                    site.cells.end += 1;
                    site.measure += measure;
                }
                _ => all.push(Site {
                    cells: cell..cell + 1,
                    measure,
                    face,
                    surface,
                }),
            }
        }
        Self { map, all }
    }

    fn of_point(&self, x: &Point<f64>) -> usize {
        let cell = self.map.locate(x);
        let after = self.all.partition_point(|site| site.cells.start <= cell);
        after.max(1) - 1
    }

    /// A uniform point of a site.
    fn point(&self, site: &Site, draws: &mut Draws) -> Point<f64> {
        let uniform: f64 = draws.uniform();
        let mut left = uniform * site.measure;
        let chosen = site.cells.clone().find(|&cell| {
            left -= measure(&self.map, cell);
            left < 0.0
        });
        let t: [f64; 2] = [draws.uniform(), draws.uniform()];
        self.map.point(chosen.unwrap_or(site.cells.end - 1), &t)
    }
}

/// The measure of a cell, in the sky 1: no walk starts there.
fn measure(map: &Radiosity<'_, f64>, cell: usize) -> f64 {
    match map.measure(cell) {
        0.0 => 1.0,
        measure => measure,
    }
}

/// The equation and its neighbour, of which draws are made.
type Pair<'a> = Drawn<'a, Walked<'a, f64, Grey>, AnyNeighbour<'a, f64, f64>>;

impl SceneSystem<'_> {
    /// Draws from about `nodes`/4 sites, and from the points in which walks start, and hands on what they tell.
    pub(crate) fn examine_drawn(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let (cut, model) = (&self.cut, self.cut.model);
        let wanted = nodes / NODES;
        let (tables, cells) = (Tables::new(&model.scene), Cells::new(&model.scene, wanted)?);
        let sites = Sites::new(
            &model.scene,
            Radiosity::new(tables.geometry(), &cells)?,
            wanted,
        );
        let radiosity = cut.wide.radiosity()?;
        let equation = LastStep(&radiosity);
        let vectors = self.solution.for_walks::<f64>()?;
        let neighbour = cut.neighbour(Some(&vectors), &equation)?;
        let pair = Pair {
            equation: &equation,
            neighbour: &*neighbour,
            absorption: request.walk.absorption,
        };
        let places = cut.places(&model.regions(request.goals, true))?;
        let (mut starts, mut known) = (Vec::new(), Vec::new());
        for (number, place) in (0..).zip(&places) {
            let ends = place.ends(radiosity.geometry())?;
            let origin = place.origin(&radiosity, &ends, None)?;
            known.push(origin.known(&radiosity));
            starts.push(drawn_start(&pair, &sites, (place, &origin), number)?);
        }
        then(&Examined {
            model: &DrawnModel {
                starts,
                sites: drawn_sites(&pair, &sites)?,
            },
            coefficients: None,
            goals: request.goals,
            known: &known,
            place: &|site| {
                let surface = sites.all.get(site).and_then(|site| site.surface);
                let name = surface.and_then(|surface| model.names.get(surface));
                name.map_or_else(|| "the sky".to_owned(), Clone::clone)
            },
            pieces: None,
        })
    }
}

/// Draws of all sites, on all threads.
fn drawn_sites(pair: &Pair<'_>, sites: &Sites<'_>) -> Result<Vec<DrawnSite>, Error> {
    let seeds = WalkSeeds::<DefaultGenerator>::new(1, NUMBERS[0]);
    let mut drawn: Vec<Option<DrawnSite>> = vec![None; sites.all.len()];
    fill_rows(&mut drawn, 1, |number, row| {
        let site = &sites.all[number];
        let mut draws = RngUniforms(seeds.generator(number as u64));
        let mut point = |draws: &mut Draws| sites.point(site, draws);
        let of_point = |y: &Point<f64>| sites.of_point(y);
        let found = DrawnSite::new(pair, SITE, &mut draws, &mut point, &of_point)?;
        row.fill(Some(found.with_measure(site.measure)));
        Ok::<(), GalerkinError>(())
    })?;
    Ok(drawn.into_iter().flatten().collect())
}

/// Where walks of the goal of this number start.
fn drawn_start<'a>(
    pair: &Pair<'_>,
    sites: &'a Sites<'_>,
    (place, origin): (&Place, &Origin<'_, f64>),
    number: u64,
) -> Result<DrawnStart<'a>, Error> {
    match (place, origin) {
        (_, &Origin::Point(At(x))) => {
            let seeds = WalkSeeds::<DefaultGenerator>::new(1, NUMBERS[1]);
            let mut draws = RngUniforms(seeds.generator(number));
            let of_point = |y: &Point<f64>| sites.of_point(y);
            let drawn = DrawnSite::new(pair, START, &mut draws, &mut |_| x, &of_point)?;
            Ok(DrawnStart::At(sites.of_point(&x), drawn))
        }
        (Place::Faces(faces), Origin::Mean(mean)) => {
            let (faces, density) = (faces.clone(), Density::uniform(mean.area()));
            // A site is on one surface, and a mean over whole surfaces.
            Ok(DrawnStart::Density(Box::new(move |site| {
                match sites.all.get(site) {
                    Some(site) if faces.binary_search(&site.face).is_ok() => density,
                    _ => Density::nothing(),
                }
            })))
        }
        _ => Err(Error::Region {
            message: "variances of walks that start between the surfaces are not predicted: ask for points on surfaces, and for \
                      means over them"
                .to_owned(),
        }),
    }
}
