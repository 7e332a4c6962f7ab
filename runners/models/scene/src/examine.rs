//! Predictions of variances, by draws from parts of the surfaces.

use fredholm_core::galerkin::{CellMap, GalerkinError, Partition};
use fredholm_core::{DefaultGenerator, LastStep, RngUniforms, Uniforms, WalkSeeds};
use fredholm_model::{Error, Examined, Request};
use fredholm_rayon::fill_rows;
use fredholm_scene::{Cells, Point, Radiosity, Scene, Tables};
use fredholm_variance::{
    Density, DrawCounts, DrawnModel, DrawnSite, DrawnStart, Draws, SiteDensity,
};

use crate::SceneModel;
use crate::regions::Place;
use crate::system::{OnPoints, SceneSystem, with_sampled};

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

/// Parts of the surfaces and of the sky: cells of a partition of their own or, where they are too many, runs of them on one
/// surface.
struct Sites<'a> {
    map: Radiosity<'a, f64>,
    /// The first cell of every site.
    first: Vec<usize>,
}

impl<'a> Sites<'a> {
    /// About so many sites.
    fn new(scene: &Scene, map: Radiosity<'a, f64>, wanted: usize) -> Self {
        let cells = map.cells();
        let run = cells.div_ceil(wanted.max(1));
        let mut first: Vec<usize> = Vec::new();
        let mut before = None;
        for cell in 0..cells {
            let surface = surface_of(scene, &map, cell);
            let is_long = first.last().is_some_and(|&first| cell - first >= run);
            if first.is_empty() || is_long || before != surface {
                first.push(cell);
            }
            before = surface;
        }
        Self { map, first }
    }

    const fn number(&self) -> usize {
        self.first.len()
    }

    /// The cells of a site.
    fn cells(&self, site: usize) -> core::ops::Range<usize> {
        let first = self.first.get(site).copied().unwrap_or(0);
        let next = self.first.get(site + 1).copied();
        first..next.unwrap_or_else(|| self.map.cells())
    }

    fn site_of(&self, x: &Point<f64>) -> usize {
        let cell = self.map.locate(x);
        self.first.partition_point(|&first| first <= cell).max(1) - 1
    }

    /// The measure of a cell, in the sky 1: no walk starts there.
    fn measure_of(&self, cell: usize) -> f64 {
        let measure = self.map.measure(cell);
        if measure > 0.0 { measure } else { 1.0 }
    }

    fn measure(&self, site: usize) -> f64 {
        self.cells(site).map(|cell| self.measure_of(cell)).sum()
    }

    /// The face of the first cell of a site.
    fn face(&self, site: usize) -> u32 {
        face_of(&self.map, self.cells(site).start)
    }

    /// A uniform point of a site of this measure.
    fn point(&self, site: usize, measure: f64, draws: &mut Draws) -> Point<f64> {
        let uniform: f64 = draws.uniform();
        let mut left = uniform * measure;
        let mut cells = self.cells(site);
        let last = cells.end.saturating_sub(1);
        let chosen = cells.find(|&cell| {
            left -= self.measure_of(cell);
            left < 0.0
        });
        let t: [f64; 2] = [draws.uniform(), draws.uniform()];
        self.map.point(chosen.unwrap_or(last), &t)
    }
}

/// The face of a cell.
fn face_of(map: &Radiosity<'_, f64>, cell: usize) -> u32 {
    map.point(cell, &[0.5, 0.25]).face
}

/// The surface of a cell; `None`: it is one of the sky.
fn surface_of(scene: &Scene, map: &Radiosity<'_, f64>, cell: usize) -> Option<usize> {
    let place = scene.place(face_of(map, cell) as usize);
    place.map(|place| place.surface)
}

/// The equation of walks.
type Equation<'a> = LastStep<'a, Radiosity<'a, f64>>;

impl SceneSystem<'_> {
    /// Draws from about `nodes`/4 sites, and from the points in which walks start, and hands on what they tell.
    pub(crate) fn examine_drawn(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let scene = self.model.scene();
        let wanted = nodes / NODES;
        let (tables, cells) = (Tables::<f64>::new(scene), Cells::new(scene, wanted)?);
        let map = Radiosity::new(tables.geometry(), &cells, request.walk.absorption)?;
        let sites = Sites::new(scene, map, wanted);
        let radiosity = self.cut.radiosity(request.walk.absorption)?;
        let last = LastStep(&radiosity);
        let vectors = self.solution.for_walks::<f64>()?;
        let places = self.model.places(request)?;
        with_sampled(self.cut.degree, &vectors, &last, &mut |neighbour| {
            let starts = places.iter().zip(0..request.goals.len() as u64);
            let starts = starts
                .map(|(place, number)| drawn_start((&last, neighbour), &sites, place, number));
            let model = DrawnModel {
                starts: starts.collect::<Result<_, Error>>()?,
                sites: drawn_sites((&last, neighbour), &sites)?,
            };
            let name = |site: usize| self.model.name_of(&sites, site);
            then(&Examined {
                model: &model,
                coefficients: None,
                goals: request.goals,
                known: &[],
                place: &name,
                hides: None,
                pieces: None,
            })
        })
    }
}

impl SceneModel {
    /// The surface of a site.
    fn name_of(&self, sites: &Sites<'_>, site: usize) -> String {
        let surface = surface_of(&self.scene, &sites.map, sites.cells(site).start);
        let name = surface.and_then(|surface| self.names.get(surface));
        name.map_or_else(|| "the sky".to_owned(), Clone::clone)
    }
}

/// Draws of all sites, on all threads.
fn drawn_sites(
    equations: (&Equation<'_>, &OnPoints<'_, f64>),
    sites: &Sites<'_>,
) -> Result<Vec<DrawnSite>, Error> {
    let seeds = WalkSeeds::<DefaultGenerator>::new(1, NUMBERS[0]);
    let mut drawn: Vec<Option<DrawnSite>> = vec![None; sites.number()];
    fill_rows(&mut drawn, 1, |site, row| {
        let measure = sites.measure(site);
        let mut draws = RngUniforms(seeds.generator(site as u64));
        let mut point = |draws: &mut Draws| sites.point(site, measure, draws);
        let found = DrawnSite::new(equations, SITE, &mut draws, &mut point, &|y| {
            sites.site_of(y)
        })?;
        row.fill(Some(found.with_measure(measure)));
        Ok::<(), GalerkinError>(())
    })?;
    Ok(drawn.into_iter().flatten().collect())
}

/// Where walks of a goal start, of this number.
fn drawn_start<'a>(
    equations: (&Equation<'_>, &OnPoints<'_, f64>),
    sites: &'a Sites<'_>,
    place: &Place,
    number: u64,
) -> Result<DrawnStart<'a>, Error> {
    let radiosity = equations.0.0;
    let known = place.known(radiosity);
    match place {
        Place::Point(face, position) => {
            let x = radiosity.at(*face, *position)?;
            let seeds = WalkSeeds::<DefaultGenerator>::new(1, NUMBERS[1]);
            let mut draws = RngUniforms(seeds.generator(number));
            let site_of = |y: &Point<f64>| sites.site_of(y);
            let drawn = DrawnSite::new(equations, START, &mut draws, &mut |_| x, &site_of)?;
            Ok(DrawnStart::At(sites.site_of(&x), drawn.with_known(known)))
        }
        Place::Faces(faces) => {
            let all = radiosity.geometry().faces();
            let mut is_in = vec![false; all.len()];
            let mut area = 0.0;
            for &face in faces {
                if let (Some(is_in), Some(face)) =
                    (is_in.get_mut(face as usize), all.get(face as usize))
                {
                    *is_in = true;
                    area += face.area;
                }
            }
            // A site is on one surface, and a mean over whole surfaces.
            let density: SiteDensity<'a> = Box::new(move |site| {
                if is_in.get(sites.face(site) as usize) == Some(&true) {
                    Density {
                        known,
                        ..Density::uniform(area)
                    }
                } else {
                    Density::nothing()
                }
            });
            Ok(DrawnStart::Density(density))
        }
        Place::Air(_) | Place::Facing(..) => Err(Error::Region {
            message: "variances of walks that start between the surfaces are not predicted: ask for points on surfaces, and for \
                      means over them"
                .to_owned(),
        }),
    }
}
