//! Form factors between faces, surfaces and groups.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_scene::Scene;
use fredholm_surfaces::Enclosure;

use crate::FactorsError;
use crate::sights::{Row, Sights};

/// Form factors between all faces of a scene, as a sparse symmetric table of exchange areas
/// A_i F_ij.
#[derive(Clone, Debug, PartialEq)]
pub struct Factors {
    areas: Vec<f64>,
    /// Where the entries of each face begin, and their number.
    first: Vec<usize>,
    /// The entries above the diagonal: the other face, and A_i F_ij.
    entries: Vec<(u32, f64)>,
    error: f64,
    partial: usize,
    open: bool,
}

/// Form factors between all faces of a scene, by one thread; see [`Sights`] for more.
///
/// F_ij is the share of what leaves face i evenly and diffusely that arrives at face j. Pairs that
/// see each other wholly are exact but for rounding, others to `error`.
///
/// ```
/// use fredholm_factors::scene_factors;
/// use fredholm_scene::{Enclosure, Scene, shapes};
///
/// let cube = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
/// let f = scene_factors(&cube, 1e-9)?;
/// // Howell's C-11 and C-14: opposite and neighbouring sides.
/// assert!((f.factor(0, 1) - 0.199824895698387).abs() < 1e-14);
/// assert!((f.factor(0, 2) - 0.200043776075403).abs() < 1e-14);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
///
/// # Errors
/// [`FactorsError::Tolerance`].
pub fn scene_factors(scene: &Scene, error: f64) -> Result<Factors, FactorsError> {
    let sights = Sights::new(scene, error)?;
    let rows: Vec<Row> = (0..scene.faces().len()).map(|i| sights.row(i)).collect();
    Factors::new(scene, rows)
}

impl Factors {
    /// Puts the rows of all faces together.
    ///
    /// # Errors
    /// [`FactorsError::Length`]: there are not as many rows as faces.
    pub fn new(scene: &Scene, rows: Vec<Row>) -> Result<Self, FactorsError> {
        let faces = scene.faces().len();
        FactorsError::length(faces, rows.len())?;
        let mut all = Self {
            areas: scene.faces().iter().map(|face| face.area).collect(),
            first: Vec::with_capacity(faces + 1),
            entries: Vec::with_capacity(rows.iter().map(|row| row.entries.len()).sum()),
            error: 0.0,
            partial: 0,
            open: scene.enclosure() == Enclosure::Open,
        };
        for row in rows {
            all.first.push(all.entries.len());
            all.entries.extend_from_slice(&row.entries);
            all.error = Real::max(row.error, all.error);
            all.partial += row.partial;
        }
        all.first.push(all.entries.len());
        Ok(all)
    }

    /// The areas of the faces.
    #[must_use]
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// The largest estimated error of a form factor, rounding included: in a scene of width W a face of width w has some
    /// ten roundings times W/w. What is between faces that are hardly further apart than 2⁻⁴⁰ W is not told from nothing,
    /// and no part of it.
    #[must_use]
    pub const fn error(&self) -> f64 {
        self.error
    }

    /// The number of pairs that see each other in part, as far as planes tell.
    #[must_use]
    pub const fn partial(&self) -> usize {
        self.partial
    }

    /// The number of pairs that see something of each other.
    #[must_use]
    pub const fn pairs(&self) -> usize {
        self.entries.len()
    }

    /// The exchange of a face with those after it: the others' numbers, ascending, and A_i F_ij.
    #[must_use]
    pub fn row(&self, face: usize) -> &[(u32, f64)] {
        match (self.first.get(face), self.first.get(face + 1)) {
            (Some(&from), Some(&to)) => self.entries.get(from..to).unwrap_or(&[]),
            _ => &[],
        }
    }

    /// A_i F_ij = A_j F_ji, in the unit of area.
    #[must_use]
    pub fn exchange_area(&self, i: usize, j: usize) -> f64 {
        let row = self.row(i.min(j));
        let other = i.max(j) as u32;
        let at = row.binary_search_by_key(&other, |entry| entry.0);
        at.ok()
            .and_then(|k| row.get(k))
            .map_or(0.0, |entry| entry.1)
    }

    /// F_ij: the share of what leaves face i evenly and diffusely that arrives at face j.
    #[must_use]
    pub fn factor(&self, i: usize, j: usize) -> f64 {
        let area = self.areas.get(i).copied().unwrap_or(f64::NAN);
        self.exchange_area(i, j) / area
    }

    /// Σ_j F_ij for every i: 1 in a closed scene, in an open one the share that does not leave.
    #[must_use]
    pub fn row_sums(&self) -> Vec<f64> {
        let mut sums = self.times(&alloc::vec![1.0; self.areas.len()]);
        for (sum, area) in sums.iter_mut().zip(&self.areas) {
            *sum /= area;
        }
        sums
    }

    /// Σ_j A_i F_ij x_j for every i.
    pub(crate) fn times(&self, x: &[f64]) -> Vec<f64> {
        let of = |k: usize| x.get(k).copied().unwrap_or(0.0);
        let mut sums = alloc::vec![0.0; self.areas.len()];
        for i in 0..self.areas.len() {
            for &(j, exchange) in self.row(i) {
                let j = j as usize;
                for (k, value) in [(i, of(j)), (j, of(i))] {
                    if let Some(sum) = sums.get_mut(k) {
                        *sum += exchange * value;
                    }
                }
            }
        }
        sums
    }

    /// Multiplies A_i F_ij by 1 + λ_i + λ_j, or by 0 if that is negative.
    pub(crate) fn scale(&mut self, lambda: &[f64]) {
        let of = |k: usize| lambda.get(k).copied().unwrap_or(0.0);
        for (i, ends) in self.first.windows(2).enumerate() {
            let own = self.entries.get_mut(ends[0]..ends[1]).unwrap_or(&mut []);
            for (j, exchange) in own {
                *exchange *= Real::max(1.0 + of(i) + of(*j as usize), 0.0);
            }
        }
    }

    /// Whether light may leave.
    pub(crate) const fn is_open(&self) -> bool {
        self.open
    }
}
