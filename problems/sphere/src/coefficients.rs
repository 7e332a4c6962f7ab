//! The Galerkin coefficients.

use alloc::vec::Vec;
use fredholm_core::array::Each;

use fredholm_core::Real;
use fredholm_core::galerkin::{Coefficients, GalerkinError, GalerkinMatrix, buffer};

use crate::Sphere;

/// 1/√3, the nodes of the Gauss rule of two points.
const NODE: f64 = 0.577_350_269_189_625_8;

/// K'_ij in f64: the mean of K over both cells by two Gauss points an axis, times the area of a cell. Each row is scaled
/// so that its sum is a, as it is without the rule's error: the system is a contraction on any cells.
///
/// As K depends on x·y, there is one number for two bands and the difference of two sectors.
#[derive(Clone, Debug)]
pub struct MeanTable {
    bands: usize,
    sectors: usize,
    /// By the band of i, the band of j, and the sectors from i to j.
    entries: Vec<f64>,
}

impl MeanTable {
    /// The coefficients on the cells of a sphere: 12 kernel evaluations for each of `bands`² × `sectors` numbers.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn new(sphere: &Sphere<f64>) -> Result<Self, GalerkinError> {
        let (bands, sectors) = (sphere.bands() as usize, sphere.sectors() as usize);
        let row = bands.saturating_mul(sectors);
        let mut entries = buffer(bands.saturating_mul(row))?;
        let turns = turns(sectors)?;
        let [albedo, _] = sphere.albedo_and_forward();
        for (i, row) in entries.chunks_exact_mut(row.max(1)).enumerate() {
            let from = heights(sphere, i);
            for (j, entries) in row.chunks_exact_mut(sectors.max(1)).enumerate() {
                let to = heights(sphere, j);
                for (entry, turns) in entries.iter_mut().zip(&turns) {
                    *entry = mean(sphere, &from, &to, turns);
                }
            }
            let sum: f64 = row.iter().sum();
            row.iter_mut().for_each(|entry| *entry *= albedo / sum);
        }
        Ok(Self {
            bands,
            sectors,
            entries,
        })
    }

    /// The coefficients on the cells of a sphere, of [`entries`](Self::entries) that were computed before.
    ///
    /// # Errors
    /// [`GalerkinError::Length`]: they are not `bands`² × `sectors`.
    ///
    /// ```
    /// use fredholm_core::galerkin::GalerkinMatrix;
    /// use fredholm_sphere::{MeanTable, Parameters, Sphere};
    ///
    /// let parameters = Parameters {
    ///     albedo: 0.7,
    ///     asymmetry: 0.2,
    ///     emission: [1.0, 0.3, 0.2, 0.1],
    ///     absorption: 0.2,
    ///     forward: 0.0,
    /// };
    /// let sphere = Sphere::<f64>::new(2, 4, &parameters)?;
    /// let table = MeanTable::new(&sphere)?;
    /// let again = MeanTable::from_entries(&sphere, table.entries().to_vec())?;
    /// assert_eq!(again.mean(1, 6), table.mean(1, 6));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn from_entries(sphere: &Sphere<f64>, entries: Vec<f64>) -> Result<Self, GalerkinError> {
        let (bands, sectors) = (sphere.bands() as usize, sphere.sectors() as usize);
        let (expected, found) = (
            bands.saturating_mul(bands.saturating_mul(sectors)),
            entries.len(),
        );
        if expected != found {
            return Err(GalerkinError::Length { expected, found });
        }
        Ok(Self {
            bands,
            sectors,
            entries,
        })
    }

    /// The numbers: of the band of i, the band of j, and the sectors from i to j, the last fastest.
    #[must_use]
    pub fn entries(&self) -> &[f64] {
        &self.entries
    }

    /// The number of kernel evaluations of [`new`](Self::new).
    #[must_use]
    pub fn evaluations(bands: u32, sectors: u32) -> f64 {
        12.0 * f64::from(bands) * f64::from(bands) * f64::from(sectors)
    }
}

/// The nodes of a band: height and distance from the axis.
fn heights(sphere: &Sphere<f64>, band: usize) -> [(f64, f64); 2] {
    let middle = sphere.mean_height(band as u32);
    let half = 1.0 / f64::from(sphere.bands());
    [-NODE, NODE].each(|t| {
        let height = middle + half * t;
        (height, Real::sqrt((1.0 - height) * (1.0 + height)))
    })
}

/// Cosines of the differences of azimuths with their weights, for all differences of sectors. Of the four pairs of
/// nodes two have the same difference.
fn turns(sectors: usize) -> Result<Vec<[(f64, f64); 3]>, GalerkinError> {
    let width = core::f64::consts::TAU / sectors as f64;
    let mut turns = buffer(sectors)?;
    for (number, turns) in turns.iter_mut().enumerate() {
        let of = |t: f64, weight: f64| (Real::cos((number as f64 + t) * width), weight);
        *turns = [of(-NODE, 0.25), of(0.0, 0.5), of(NODE, 0.25)];
    }
    Ok(turns)
}

/// The mean of 4πK.
fn mean(
    sphere: &Sphere<f64>,
    from: &[(f64, f64); 2],
    to: &[(f64, f64); 2],
    turns: &[(f64, f64); 3],
) -> f64 {
    let mut sum = 0.0;
    for (height, radius) in from {
        for (other_height, other_radius) in to {
            for (cosine, weight) in turns {
                let cosine = height * other_height + radius * other_radius * cosine;
                sum += 0.25 * weight * sphere.phase(cosine);
            }
        }
    }
    sum
}

impl Coefficients for MeanTable {}

impl GalerkinMatrix for MeanTable {
    type Scalar = f64;

    fn cells(&self) -> usize {
        self.bands * self.sectors
    }

    fn functions(&self) -> usize {
        1
    }

    fn entry(&self, [i, _]: [usize; 2], [j, _]: [usize; 2]) -> f64 {
        let sectors = self.sectors;
        let turn = j % sectors + sectors - i % sectors;
        let turn = if turn < sectors { turn } else { turn - sectors };
        let place = (i / sectors * self.bands + j / sectors) * sectors + turn;
        self.entries.get(place).copied().unwrap_or(f64::NAN)
    }

    /// Band by band, the sectors from that of i on and those before it: no entry is looked for.
    fn rows_times(&self, i: usize, v: &[f64], out: &mut [f64]) {
        let (band, sector) = (i / self.sectors, i % self.sectors);
        let row = self.entries.chunks_exact(self.cells()).nth(band);
        let mut sum = 0.0;
        for (row, v) in row
            .unwrap_or(&[])
            .chunks_exact(self.sectors)
            .zip(v.chunks_exact(self.sectors))
        {
            let (before, after) = v.split_at(sector);
            let times =
                |row: &[f64], v: &[f64]| -> f64 { row.iter().zip(v).map(|(k, v)| k * v).sum() };
            sum += times(row, after)
                + row
                    .get(after.len()..)
                    .map_or(f64::NAN, |row| times(row, before));
        }
        out.fill(sum);
    }
}
