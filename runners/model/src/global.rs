//! The global estimate of a solved system: its walks, and its values.

use fredholm_core::Located;
use fredholm_core::galerkin::Solution;
use fredholm_core::global::{GlobalJob, Scores};
use fredholm_rayon::fill_rows;
use fredholm_variance::gauss;

use crate::{Choice, Choices, Error, Region, Scalar, Subject, WalkOptions};

/// The options of the walks of a global estimate.
#[derive(Clone, Copy, Debug)]
pub struct GlobalRequest<'a> {
    /// How walks are made.
    pub walk: &'a WalkOptions,
    /// The degree of the polynomials on whose coefficients they score.
    pub degree: usize,
    /// Whether walks are to leave out what is [known](GlobalJob::known) of F − G where the kind knows it.
    pub knows_first: bool,
}

/// Nodes on the cells of a space: so many Gauss points of a cell and parameter.
#[derive(Clone, Copy, Debug)]
pub struct CellNodes {
    /// The number of cells.
    pub cells: usize,
    /// The number of parameters of a point of a cell.
    pub dimension: usize,
    /// Gauss points of a parameter.
    pub points: usize,
    /// The share of a cell in the measure of one on which scores have functions: most often 1.
    pub share: f64,
}

/// F − G at parameters of a cell, from 0 to 1, and its point, if there is one.
pub type First<'a, P> = dyn Fn(usize, &[f64]) -> Option<(Located<P>, f64)> + Sync + 'a;

/// The coefficients of F − G for [`GlobalTask::with_known`](fredholm_core::global::GlobalTask::with_known), by a Gauss rule on every cell. They
/// need not be exact. None, if walks are not to know them or F or G is drawn.
///
/// # Errors
/// [`Error::Galerkin`]: memory.
pub fn known_first<P: Send>(
    request: &GlobalRequest<'_>,
    scores: &(dyn Scores<P> + Sync),
    nodes: CellNodes,
    first: &First<'_, P>,
) -> Result<Vec<f64>, Error> {
    if !request.knows_first {
        return Ok(Vec::new());
    }
    let rule = gauss(nodes.points)?;
    let own = nodes.points.pow(nodes.dimension as u32);
    let mut all: Vec<Option<(Located<P>, f64)>> = Vec::new();
    all.resize_with(nodes.cells * own, || None);
    fill_rows(&mut all, own, |cell, row| {
        for (number, slot) in row.iter_mut().enumerate() {
            let (mut t, mut weight, mut number) = (vec![0.0; nodes.dimension], nodes.share, number);
            for t in &mut t {
                let (at, share) = rule[number % rule.len()];
                number /= rule.len();
                *t = 0.5 * (1.0 + at);
                weight *= 0.5 * share;
            }
            *slot = first(cell, &t).map(|(x, first)| (x, weight * first));
        }
        Ok::<(), Error>(())
    })?;
    let mut known = vec![0.0; scores.unknowns()];
    for (x, first) in all.iter().flatten() {
        scores.add(x, *first, &mut known);
    }
    if known.iter().all(|c| c.is_finite()) {
        Ok(known)
    } else {
        Ok(Vec::new())
    }
}

/// Seconds of the integral of K times one function on a cell, as a room takes it: others take less.
const CELL_SECONDS: f64 = 60e-9;
/// The points on a cell, beyond the degree, of a mean that is taken by two rules.
const MEAN_POINTS: usize = 6;

/// A function that is called with prepared walks.
pub type WithGlobalJob<'a> = dyn FnMut(&dyn GlobalJob) -> Result<(), Error> + 'a;

/// A solved system whose chain preserves a density, so that one set of walks gives the global estimate: `core::global` has
/// the mathematics.
pub trait GlobalSystem<'m>: Send + Sync {
    /// The degree of v.
    fn degree(&self) -> usize;

    /// The largest degree of scores.
    fn most_degree(&self) -> usize;

    /// The degree of scores unless it is given: one to three degrees more than v, so that the projection of e loses little
    /// beside the error bars.
    fn default_degree(&self) -> usize {
        (self.degree() + 2).min(self.most_degree())
    }

    /// The degrees of all functions on a cell, in their order, if they are of this degree or less.
    fn degrees(&self, degree: usize) -> Vec<usize>;

    /// The number of cells on which scores have functions.
    fn cells(&self) -> usize;

    /// μ(X_j).
    fn measure(&self, cell: usize) -> f64;

    /// Seconds of the integrals that T_K of all functions at one point takes, by constants: a choice by them must not depend
    /// on the machine.
    fn point_seconds(&self, degree: usize) -> f64 {
        CELL_SECONDS * (self.cells() * self.degrees(degree).len()) as f64
    }

    /// The number of points at which that is taken for a mean, about.
    fn mean_points(&self, degree: usize) -> f64 {
        ((degree + MEAN_POINTS) * self.cells()) as f64
    }

    /// ‖v‖∞, and a bound below 1 of the spectral radius of |K'|: for what rounding leaves.
    fn sizes(&self) -> [f64; 2];

    /// Prepares the walks, and hands them on.
    ///
    /// # Errors
    /// [`Error`], or what `then` says.
    fn walks(&self, request: &GlobalRequest<'_>, then: &mut WithGlobalJob<'_>)
    -> Result<(), Error>;

    /// Prepares walks that score on K(x, ·) of some points x, one number for each, in place of polynomials, and hands them on:
    /// no projection loses anything.
    ///
    /// # Errors
    /// [`Error`], among them that this kind has no such walks, or that a region is no point; or what `then` says.
    fn adjoint_walks(
        &self,
        request: &GlobalRequest<'_>,
        points: &[Region],
        then: &mut WithGlobalJob<'_>,
    ) -> Result<(), Error> {
        let _ = (request, points, then);
        Err(Error::Option {
            subject: Subject::Problem,
            message: "values without a projection are offered for circles and cubes".to_owned(),
        })
    }

    /// The function of these coefficients: rows of one number for every function of every cell, of which each is a
    /// piecewise polynomial. They estimate u − v, but for the last two, which are the parts of the highest degree of the means of
    /// either half of the others; there are none
    /// if nothing is projected.
    ///
    /// # Errors
    /// [`Error`].
    fn field(
        &self,
        request: &GlobalRequest<'_>,
        rows: Vec<f64>,
    ) -> Result<Box<dyn GlobalField + 'm>, Error>;
}

/// A cell over which a global estimate tells the mean of u, of a space whose function has no values at points.
///
/// ```
/// use fredholm_model::MeshCell;
///
/// let triangle = MeshCell { part: 0, corners: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] };
/// assert_eq!(triangle.middle(), [1.0 / 3.0, 1.0 / 3.0, 0.0]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct MeshCell {
    /// The number of the part, of a scene of the surface, to which it belongs.
    pub part: usize,
    /// Three or four corners, in their order around the cell.
    pub corners: Vec<[f64; 3]>,
}

impl MeshCell {
    /// The mean of the corners.
    #[must_use]
    pub fn middle(&self) -> [f64; 3] {
        let count = self.corners.len() as f64;
        [0, 1, 2].map(|k| self.corners.iter().map(|corner| corner[k]).sum::<f64>() / count)
    }
}

/// A quantity that walks estimate.
///
/// ```
/// use fredholm::{Choices, GlobalQuantity};
///
/// assert_eq!(GlobalQuantity::of_word("net_flux"), Some(GlobalQuantity::NetFlux));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GlobalQuantity {
    /// u.
    U,
    /// The irradiance of walls, in rooms and scenes: the part of u that comes from elsewhere, without the reflectance. NaN where u does
    /// not tell it.
    Irradiance,
    /// The net flux out of walls, in rooms and scenes: at a point in the unit of u, over a part in all. NaN where u does not tell
    /// it.
    NetFlux,
    /// The temperature, in rooms and scenes with temperatures, in kelvin: of surfaces from which the net flux is given, and the mean radiant
    /// temperature of what is between them. Walks estimate σT⁴.
    Temperature,
    /// The share of the molecules which enter a vacuum by one surface that arrive at others.
    Transmission,
}

impl GlobalQuantity {
    /// This quantity of a region.
    #[must_use]
    pub fn of(self, region: Region) -> Region {
        match self {
            Self::U => region,
            Self::Irradiance => Region::Irradiance(Box::new(region)),
            Self::NetFlux => Region::NetFlux(Box::new(region)),
            Self::Temperature => Region::Temperature(Box::new(region)),
            Self::Transmission => Region::Transmission(Box::new(region)),
        }
    }
}

impl Choices for GlobalQuantity {
    const ALL: &'static [Choice<Self>] = &[
        Choice {
            value: Self::U,
            word: "u",
            help: "The solution, in rooms and scenes the radiosity",
        },
        Choice {
            value: Self::Irradiance,
            word: "irradiance",
            help: "What arrives at surfaces of a room or a scene",
        },
        Choice {
            value: Self::NetFlux,
            word: "net_flux",
            help: "What surfaces with temperatures lose, per area",
        },
        Choice {
            value: Self::Temperature,
            word: "temperature",
            help: "In kelvin: that of surfaces whose net flux is given, and the mean radiant temperature between surfaces",
        },
        Choice {
            value: Self::Transmission,
            word: "transmission",
            help: "The share of the molecules that enter a vacuum which arrive",
        },
    ];
}

/// The values of F + T_K v, and of T_K of some piecewise polynomials.
pub trait GlobalField: Send + Sync {
    /// The number of piecewise polynomials.
    fn rows(&self) -> usize;

    /// The coefficients of v, and behind them those of every piecewise polynomial, cell by cell, all of one degree. `None`:
    /// the cells are not equal, or the functions on them are not products of Legendre polynomials.
    fn coefficients(&self) -> Option<&[f64]> {
        None
    }

    /// The images of all regions one after the other. That of a region is (F + T_K v, Φ); by how much a finer rule in x
    /// moved that, 0 at a point of the space; and then (T_K r, Φ) for every piecewise polynomial r. For other quantities than
    /// u it is what these have in their place.
    ///
    /// # Errors
    /// [`Error`]; [`Error::Internal`], where there is no such quantity.
    fn images(&self, quantity: GlobalQuantity, regions: &[Region]) -> Result<Vec<f64>, Error>;

    /// The cells over which it tells means, where it has [no values at points](crate::WholeValues::Means).
    fn mesh(&self) -> &[MeshCell] {
        &[]
    }

    /// The images of all cells of the [`mesh`](Self::mesh), as [`images`](Self::images) has those of regions.
    fn mesh_images(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Raises the order of quadrature until F + T_K v in these points moves by no more than `error`, or no more points are
    /// taken. Returns by how much it moved last: 0 where T_K has a closed form.
    ///
    /// # Errors
    /// [`Error`].
    fn refine(&mut self, points: &[Region], error: f64) -> Result<f64, Error> {
        let _ = (points, error);
        Ok(0.0)
    }

    /// The image of a region as [`images`](Self::images) has it, with so many Gauss points more on every cell and axis in T_K.
    /// `None`: T_K has a closed form, or so many points are not taken.
    ///
    /// # Errors
    /// As [`images`](Self::images).
    fn finer(
        &self,
        quantity: GlobalQuantity,
        region: &Region,
        more: usize,
    ) -> Result<Option<Vec<f64>>, Error> {
        let _ = (quantity, region, more);
        Ok(None)
    }
}

/// v as walks in this scalar have it, in f64: what e is the difference from.
///
/// # Errors
/// [`Error::Galerkin`]: memory.
pub fn v_of_walks(solution: &Solution, scalar: Scalar) -> Result<Vec<f64>, Error> {
    Ok(match scalar {
        Scalar::F32 => solution.rounded_through::<f32>()?,
        Scalar::F64 => solution.rounded_through::<f64>()?,
    })
}

/// Refuses a region that is no point, of which K(x, ·) is to be scored.
#[must_use]
pub fn only_points() -> Error {
    Error::Region {
        message: "values without a projection are those of points".to_owned(),
    }
}

/// Refuses quantities other than u, where there are none.
///
/// # Errors
/// [`Error::Internal`].
pub const fn only_u(quantity: GlobalQuantity) -> Result<(), Error> {
    match quantity {
        GlobalQuantity::U => Ok(()),
        _ => Err(Error::Internal("irradiances are quantities of rooms")),
    }
}

/// Replicates of a global estimate: an error bar of 64 is itself uncertain by 9 %, and Student's t of 63 degrees of freedom is 2 % wider than
/// the normal distribution. More make every value dearer.
pub const GLOBAL_REPLICATES: usize = 64;

/// The places before those of the piecewise polynomials in [`GlobalField::images`].
pub const IMAGE_HEAD: usize = 2;

/// The share of a mean by which a finer rule may move it.
const MEAN_SHARE: f64 = 1e-13;

/// A rule for means over x: it adds F, then T_K v, then (T_K r, Φ) to a slice of zeros by the rule of this number, or says
/// that there is none of it.
pub type MeanRule<'a> = dyn FnMut(usize, &mut [f64]) -> Result<bool, Error> + 'a;

/// A mean over x by rules that become finer until they agree, or no finer one is taken. The image goes to
/// `out`.
///
/// # Errors
/// What `rule` says.
pub fn refined_mean(out: &mut [f64], rule: &mut MeanRule<'_>) -> Result<(), Error> {
    let mut before = f64::NAN;
    for number in 0.. {
        let mut sums = vec![0.0; out.len()];
        if !rule(number, &mut sums)? {
            break;
        }
        let [source, image] = [sums[0], sums[1]];
        let now = source + image;
        let moved = (now - before).abs();
        out.copy_from_slice(&sums);
        (out[0], out[1]) = (now, moved);
        // Both may cancel: their sizes are what rounding knows.
        if moved <= MEAN_SHARE * (source.abs() + image.abs()).max(f64::MIN_POSITIVE) {
            break;
        }
        before = now;
    }
    Ok(())
}
