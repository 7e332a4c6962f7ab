//! The whole function of a sphere: T_K by its eigenfunctions, the spherical harmonics.

use core::f64::consts::{PI, TAU};
use std::sync::Arc;

use fredholm_core::array::Each;
use fredholm_core::galerkin::{Piecewise, Rounded};
use fredholm_core::whole::{Scores, WholeTask};
use fredholm_core::{Real, Source};
use fredholm_model::numbers::{dot, largest};
use fredholm_model::{
    Error, IMAGE_HEAD, Region, WholeField, WholeQuantity, WholeRequest, WholeSystem, WithWholeJob,
    in_scalar, only_u, v_of_walks,
};
use fredholm_rayon::fill_rows;
use fredholm_sphere::{Harmonics, Point, Sphere};
use fredholm_variance::gauss;

use super::{SpherePartition, SphereSystem, kinds, place};

/// The largest degree of scores: 625 functions.
const MOST_DEGREE: usize = 24;
/// What T_K leaves of the first harmonic that scores leave out, unless their degree is given.
const LEFT_OUT: f64 = 1e-4;
/// What it leaves of the first that T_K v leaves out.
const NOTHING: f64 = 1e-17;

/// A solved sphere whose walks score in every state.
#[derive(Debug)]
pub(super) struct SphereWhole {
    system: Arc<SphereSystem>,
}

impl SphereWhole {
    pub(super) fn new(system: SphereSystem) -> Self {
        Self {
            system: Arc::new(system),
        }
    }

    fn walks_in<F: Real>(
        &self,
        request: &WholeRequest<'_>,
        then: &mut WithWholeJob<'_>,
    ) -> Result<(), Error> {
        let (system, walk) = (&*self.system, request.walk);
        let sphere = system.cut.sphere::<F>(walk.absorption)?;
        let pairs = kinds(walk.pairs);
        let vectors = system.solution.for_walks::<F, _>(&system.table, pairs)?;
        let table = Rounded::<_, F>::new(&system.table);
        let neighbour: Piecewise<'_, F, _, _, _, _> = vectors.piecewise(&sphere, &table)?;
        let harmonics = Harmonics::new(request.degree)?;
        let scores: &(dyn Scores<Point<F>> + Sync) = &harmonics;
        let options = walk.for_core();
        then(&WholeTask::new(
            &sphere, &sphere, &neighbour, scores, options,
        ))
    }
}

/// The degree of the first harmonic that T_K leaves no more of than this, less one.
fn enough(asymmetry: f64, share: f64) -> usize {
    let mut left = asymmetry;
    let mut degree = 0;
    while left > share {
        left *= asymmetry;
        degree += 1;
    }
    degree
}

impl<'m> WholeSystem<'m> for SphereWhole {
    fn degree(&self) -> usize {
        0
    }

    fn most_degree(&self) -> usize {
        MOST_DEGREE
    }

    fn default_degree(&self) -> usize {
        let asymmetry = self.system.cut.parameters.asymmetry;
        enough(asymmetry, LEFT_OUT).clamp(2, MOST_DEGREE)
    }

    fn degrees(&self, degree: usize) -> Vec<usize> {
        Harmonics::new(degree).map_or(Vec::new(), |harmonics| harmonics.degrees().collect())
    }

    /// Harmonics are functions on all of the sphere.
    fn cells(&self) -> usize {
        1
    }

    fn measure(&self, _: usize) -> f64 {
        4.0 * PI
    }

    fn sizes(&self) -> [f64; 2] {
        let solution = &self.system.solution;
        [largest(&solution.v), solution.radius_bound]
    }

    fn walks(&self, request: &WholeRequest<'_>, then: &mut WithWholeJob<'_>) -> Result<(), Error> {
        in_scalar!(self.system.cut.scalar, F => self.walks_in::<F>(request, then))
    }

    fn field(
        &self,
        request: &WholeRequest<'_>,
        rows: Vec<f64>,
    ) -> Result<Box<dyn WholeField + 'm>, Error> {
        let cut = self.system.cut;
        let v = v_of_walks(&self.system.solution, cut.scalar)?;
        let parameters = cut.parameters;
        let all = Harmonics::new(enough(parameters.asymmetry, NOTHING))?;
        let own = Harmonics::new(request.degree)?;
        let image = |l: usize| parameters.albedo * parameters.asymmetry.powi(l as i32);
        let mut field = SphereField {
            sphere: cut.sphere::<f64>(0.5)?,
            v: coefficients(&cut, &all, &v)?,
            rows,
            all,
            own,
        };
        let scale = |harmonics: &Harmonics, rows: &mut [f64]| {
            let factors: Vec<f64> = harmonics.degrees().map(image).collect();
            for row in rows.chunks_exact_mut(factors.len()) {
                for (value, factor) in row.iter_mut().zip(&factors) {
                    *value *= factor;
                }
            }
        };
        scale(&field.all, &mut field.v);
        scale(&field.own, &mut field.rows);
        Ok(Box::new(field))
    }
}

/// The coefficients of the piecewise constant v: exact along azimuths, by Gauss rules along meridians.
fn coefficients(
    cut: &SpherePartition,
    harmonics: &Harmonics,
    v: &[f64],
) -> Result<Vec<f64>, Error> {
    let (bands, sectors) = (cut.bands as usize, cut.sectors as usize);
    let degree = harmonics.degree();
    // A wave of degree p has p/bands half waves on a band.
    let rule = gauss(8 + degree.div_ceil(bands))?;
    let mut out = vec![0.0; (degree + 1) * (degree + 1)];
    let width = TAU / sectors as f64;
    for (band, v) in v.chunks_exact(sectors).enumerate() {
        // The means of v cos mφ and v sin mφ over the circle.
        let waves = (0..=degree).map(|m| {
            let m = m as f64;
            let mut sums = [0.0; 2];
            for (sector, v) in v.iter().enumerate() {
                let middle = (sector as f64 + 0.5) * width - PI;
                let half = 0.5 * m * width;
                let share = if m == 0.0 { 1.0 } else { half.sin() / half };
                sums[0] += v * share * (m * middle).cos();
                sums[1] += v * share * (m * middle).sin();
            }
            sums.map(|sum| sum / sectors as f64)
        });
        let waves: Vec<[f64; 2]> = waves.collect();
        let edge = |i: usize| {
            (1.0 - 2.0 * i as f64 / bands as f64)
                .clamp(-1.0, 1.0)
                .acos()
        };
        let [from, to] = [edge(band), edge(band + 1)];
        for (t, weight) in &rule {
            let colatitude = from + 0.5 * (1.0 + t) * (to - from);
            let radius = colatitude.sin();
            // Of the mean over heights, dz/2.
            let weight = 0.25 * weight * (to - from) * radius;
            let mut out = out.iter_mut();
            let mut add = |value: f64| {
                if let Some(out) = out.next() {
                    *out += weight * value;
                }
            };
            harmonics.visit(&[radius, 0.0, colatitude.cos()], |_, m, [value, _]| {
                add(value * waves[m][0]);
                if m > 0 {
                    add(value * waves[m][1]);
                }
            });
        }
    }
    Ok(out)
}

/// T_K v and the images of other functions, by their coefficients.
struct SphereField {
    sphere: Sphere<f64>,
    /// The coefficients of T_K v.
    v: Vec<f64>,
    all: Harmonics,
    /// The coefficients of the images.
    rows: Vec<f64>,
    own: Harmonics,
}

impl SphereField {
    fn image(&self, region: &Region, out: &mut [f64]) -> Result<(), Error> {
        let functions = (self.own.degree() + 1).pow(2);
        let rows = self.rows.chunks_exact(functions);
        match region {
            Region::Point(angles) => {
                let x: Point<f64> = place(angles)?;
                out[0] = self.sphere.source(&x) + dot(&self.v, &values(&self.all, &x));
                let own = values(&self.own, &x);
                for (out, row) in out[IMAGE_HEAD..].iter_mut().zip(rows) {
                    *out = dot(row, &own);
                }
            }
            Region::Whole => {
                // The mean of F is that of both poles.
                let poles = [1.0, -1.0].each(|z| self.sphere.source(&[0.0, 0.0, z]));
                out[0] = 0.5 * (poles[0] + poles[1]) + self.v[0];
                for (out, row) in out[IMAGE_HEAD..].iter_mut().zip(rows) {
                    *out = row[0];
                }
            }
            _ => return Err(Error::Internal("a sphere has points and a mean")),
        }
        Ok(())
    }
}

/// The values of all functions at a point.
fn values(harmonics: &Harmonics, x: &Point<f64>) -> Vec<f64> {
    let mut values = Vec::with_capacity((harmonics.degree() + 1).pow(2));
    harmonics.visit(x, |_, m, [cosine, sine]| {
        values.push(cosine);
        if m > 0 {
            values.push(sine);
        }
    });
    values
}

impl WholeField for SphereField {
    fn rows(&self) -> usize {
        self.rows.len() / (self.own.degree() + 1).pow(2)
    }

    fn images(&self, quantity: WholeQuantity, regions: &[Region]) -> Result<Vec<f64>, Error> {
        only_u(quantity)?;
        let width = IMAGE_HEAD + self.rows();
        let mut out = vec![0.0; regions.len() * width];
        fill_rows(&mut out, width, |region, out| {
            self.image(&regions[region], out)
        })?;
        Ok(out)
    }
}
