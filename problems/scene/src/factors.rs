//! Form factors between faces, surfaces and groups.

use alloc::vec::Vec;

use fredholm_core::Real;

use crate::scene::Scene;
use crate::sights::{Row, Sights};
use crate::sky::SkyFactors;
use crate::{Enclosure, SceneError};

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

/// Form factors between all faces, by one thread; see [`Sights`] for more.
///
/// F_ij is the share of what leaves face i evenly and diffusely that arrives at face j. Pairs that
/// see each other wholly are exact but for rounding, others to `error`.
///
/// ```
/// use fredholm_scene::{Enclosure, Scene, factors, shapes};
///
/// let cube = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
/// let f = factors(&cube, 1e-9)?;
/// // Howell's C-11 and C-14: opposite and neighbouring sides.
/// assert!((f.factor(0, 1) - 0.199824895698387).abs() < 1e-14);
/// assert!((f.factor(0, 2) - 0.200043776075403).abs() < 1e-14);
/// # Ok::<(), fredholm_scene::SceneError>(())
/// ```
///
/// # Errors
/// [`SceneError::Tolerance`].
pub fn factors(scene: &Scene, error: f64) -> Result<Factors, SceneError> {
    let sights = Sights::new(scene, error)?;
    let rows: Vec<Row> = (0..scene.faces().len()).map(|i| sights.row(i)).collect();
    Factors::new(scene, rows)
}

impl Factors {
    /// Puts the rows of all faces together.
    ///
    /// # Errors
    /// [`SceneError::Length`]: there are not as many rows as faces.
    pub fn new(scene: &Scene, rows: Vec<Row>) -> Result<Self, SceneError> {
        let faces = scene.faces().len();
        if rows.len() != faces {
            return Err(SceneError::Length {
                expected: faces,
                found: rows.len(),
            });
        }
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
    #[must_use]
    pub const fn is_open(&self) -> bool {
        self.open
    }
}

/// Exchange areas between groups of faces, such as surfaces, as a dense symmetric table.
#[derive(Clone, Debug, PartialEq)]
pub struct Groups {
    areas: Vec<f64>,
    /// Row by row.
    exchange: Vec<f64>,
}

impl Factors {
    /// Form factors between the surfaces of a scene: F_IJ = Σ_{i ∈ I} A_i Σ_{j ∈ J} F_ij / A_I.
    ///
    /// # Errors
    /// [`SceneError::Length`] if the scene has another number of faces, [`SceneError::Memory`].
    pub fn of_surfaces(&self, scene: &Scene) -> Result<Groups, SceneError> {
        let surface = |face: usize| scene.place(face).map_or(usize::MAX, |place| place.surface);
        let groups: Vec<usize> = (0..scene.faces().len()).map(surface).collect();
        self.of_groups(&groups, scene.surfaces())
    }

    /// Form factors between groups: `groups` has the group of each face, below `count`.
    ///
    /// # Errors
    /// [`SceneError::Length`] if there are not as many as faces, [`SceneError::Surface`] for a group
    /// that is none, [`SceneError::Memory`].
    pub fn of_groups(&self, groups: &[usize], count: usize) -> Result<Groups, SceneError> {
        if groups.len() != self.areas.len() {
            return Err(SceneError::Length {
                expected: self.areas.len(),
                found: groups.len(),
            });
        }
        if let Some(&surface) = groups.iter().find(|&&g| g >= count) {
            return Err(SceneError::Surface { surface });
        }
        let entries = count.checked_mul(count);
        let entries = entries.ok_or(SceneError::Memory { bytes: None })?;
        let mut exchange: Vec<f64> = Vec::new();
        exchange
            .try_reserve_exact(entries)
            .map_err(|_| SceneError::Memory {
                bytes: entries.checked_mul(size_of::<f64>()),
            })?;
        exchange.resize(entries, 0.0);
        let mut areas = alloc::vec![0.0; count];
        for (i, (&own, &area)) in groups.iter().zip(&self.areas).enumerate() {
            if let Some(sum) = areas.get_mut(own) {
                *sum += area;
            }
            for &(j, amount) in self.row(i) {
                let other = groups.get(j as usize).copied().unwrap_or(own);
                for at in [own * count + other, other * count + own] {
                    if let Some(sum) = exchange.get_mut(at) {
                        *sum += amount;
                    }
                }
            }
        }
        Ok(Groups { areas, exchange })
    }
}

impl Groups {
    /// Groups of these areas with these form factors F_IJ, row by row: also surfaces in the plane, whose areas are lengths.
    ///
    /// # Errors
    /// [`SceneError::Length`] if there are not as many factors as pairs of groups.
    pub fn new(areas: Vec<f64>, factors: &[f64]) -> Result<Self, SceneError> {
        let expected = areas.len() * areas.len();
        if factors.len() != expected {
            let found = factors.len();
            return Err(SceneError::Length { expected, found });
        }
        let rows = factors.chunks_exact(areas.len().max(1)).zip(&areas);
        let exchange = rows.flat_map(|(row, area)| row.iter().map(move |factor| area * factor));
        Ok(Self {
            exchange: exchange.collect(),
            areas,
        })
    }

    /// The number of groups.
    #[must_use]
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.areas.is_empty()
    }

    /// The areas of the groups.
    #[must_use]
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// A_I F_IJ = A_J F_JI, in the unit of area.
    #[must_use]
    pub fn exchange_area(&self, i: usize, j: usize) -> f64 {
        let row = self.exchange.get(i * self.len()..).unwrap_or(&[]);
        if j < self.len() {
            row.get(j).copied().unwrap_or(f64::NAN)
        } else {
            f64::NAN
        }
    }

    /// F_IJ: the share of what leaves group I evenly and diffusely that arrives at J.
    #[must_use]
    pub fn factor(&self, i: usize, j: usize) -> f64 {
        self.exchange_area(i, j) / self.areas.get(i).copied().unwrap_or(f64::NAN)
    }

    /// Σ_J F_IJ.
    #[must_use]
    pub fn row_sum(&self, i: usize) -> f64 {
        (0..self.len()).map(|j| self.factor(i, j)).sum()
    }

    /// The script-F exchange factors 𝓕_IJ of grey groups of even radiosity, row by row:
    /// dimensionless.
    ///
    /// The net heat from I to J is A_I 𝓕_IJ σ(T_I⁴ − T_J⁴), all reflections included, where
    /// 𝓕 = ε (I − F diag(1 − ε))⁻¹ F ε (Hottel and Sarofim 1967; ε G of Gebhart 1961). Like A F,
    /// A 𝓕 is symmetric, and in a closed scene a row's sum is the emissivity of its group.
    ///
    /// ```
    /// use fredholm_scene::{Enclosure, Scene, factors, shapes};
    ///
    /// let cube = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
    /// let f = factors(&cube, 1e-9)?.of_surfaces(&cube)?;
    /// let script = f.script_f(&[0.9, 0.5, 0.5, 0.5, 0.5, 0.2])?;
    /// assert!((script[..6].iter().sum::<f64>() - 0.9).abs() < 1e-13);
    /// assert!((script[5] - script[30]).abs() < 1e-15);
    /// # Ok::<(), fredholm_scene::SceneError>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::Length`] if there are not as many emissivities as groups,
    /// [`SceneError::Emissivity`] for one outside (0, 1].
    pub fn script_f(&self, emissivities: &[f64]) -> Result<Vec<f64>, SceneError> {
        let to = |i: usize, j: usize| {
            self.factor(i, j) * emissivities.get(j).copied().unwrap_or(f64::NAN)
        };
        self.with_reflections(emissivities, self.len(), &to)
    }

    /// The net heat from I to J, row by row, A_I 𝓕_IJ (b_I − b_J), if black bodies as warm as the groups emit b = σT⁴: in watts, or
    /// in watts per metre of depth in the plane. The sum of a row is what its group gives, and all together are 0.
    ///
    /// ```
    /// use fredholm_scene::Groups;
    ///
    /// // A flat floor of 2 m below a vault of 3 m: 1/(0.5/(0.5 · 2) + 1/2 + 0.2/(0.8 · 3)) W per W/m².
    /// let vault = Groups::new(vec![2.0, 3.0], &[0.0, 1.0, 2.0 / 3.0, 1.0 / 3.0])?;
    /// let watts = vault.net_exchange(&[0.5, 0.8], &[500.0, 400.0])?;
    /// assert!((watts[1] - 100.0 / (0.5 + 0.5 + 0.25 / 3.0)).abs() < 1e-11);
    /// assert!((watts[1] + watts[2]).abs() < 1e-11);
    /// # Ok::<(), fredholm_scene::SceneError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Groups::script_f`], and [`SceneError::Length`] if there are not as many b as groups.
    pub fn net_exchange(
        &self,
        emissivities: &[f64],
        black: &[f64],
    ) -> Result<Vec<f64>, SceneError> {
        let (expected, found) = (self.len(), black.len());
        if found != expected {
            return Err(SceneError::Length { expected, found });
        }
        let script = self.script_f(emissivities)?;
        let rows = script.chunks_exact(expected.max(1));
        let rows = rows.zip(self.areas.iter().zip(black));
        let of = |(row, (area, own)): (&[f64], (&f64, &f64))| -> Vec<f64> {
            let all = row.iter().zip(black);
            all.map(|(factor, other)| area * factor * (own - other))
                .collect()
        };
        Ok(rows.flat_map(of).collect())
    }

    /// The script-F exchange factors from grey groups to the patches of a sky and, last, to what is below the horizon, which are
    /// black: row by row, dimensionless.
    ///
    /// With those of [`Groups::script_f`] a row's sum is the emissivity of its group, if nobody sees a back.
    ///
    /// # Errors
    /// As [`Groups::script_f`], and [`SceneError::Length`] if `sky` has another number of groups.
    pub fn script_sky(
        &self,
        emissivities: &[f64],
        sky: &SkyFactors,
    ) -> Result<Vec<f64>, SceneError> {
        if sky.len() != self.len() {
            return Err(SceneError::Length {
                expected: self.len(),
                found: sky.len(),
            });
        }
        let patches = sky.patches();
        let to = |i: usize, k: usize| {
            if k < patches {
                sky.factor(i, k)
            } else {
                sky.below(i)
            }
        };
        self.with_reflections(emissivities, patches + 1, &to)
    }

    /// ε (I − F diag(1 − ε))⁻¹ times a matrix with so many columns, row by row.
    fn with_reflections(
        &self,
        emissivities: &[f64],
        columns: usize,
        to: &dyn Fn(usize, usize) -> f64,
    ) -> Result<Vec<f64>, SceneError> {
        let n = self.len();
        if emissivities.len() != n {
            return Err(SceneError::Length {
                expected: n,
                found: emissivities.len(),
            });
        }
        if let Some(surface) = emissivities.iter().position(|&e| !(e > 0.0 && e <= 1.0)) {
            return Err(SceneError::Emissivity { surface });
        }
        let emissivity = |i: usize| emissivities.get(i).copied().unwrap_or(1.0);
        // [I − F (1 − ε) | the matrix]: row sums of the first half are at least the least emissivity, so no
        // pivoting is needed.
        let own = |i: usize, j: usize| {
            f64::from(u8::from(i == j)) - self.factor(i, j) * (1.0 - emissivity(j))
        };
        let mut rows: Vec<Vec<f64>> = (0..n)
            .map(|i| {
                let right = (0..columns).map(|k| to(i, k));
                (0..n).map(|j| own(i, j)).chain(right).collect()
            })
            .collect();
        for k in 0..n {
            let pivot = rows.get(k).cloned().unwrap_or_default();
            let per = 1.0 / pivot.get(k).copied().unwrap_or(1.0);
            for (i, row) in rows.iter_mut().enumerate() {
                let own = row.get(k).copied().unwrap_or(0.0);
                let factor = if i == k { 1.0 - per } else { own * per };
                if factor != 0.0 {
                    for (x, p) in row.iter_mut().zip(&pivot).skip(k) {
                        *x -= factor * p;
                    }
                }
            }
        }
        let scaled = |(i, row): (usize, &Vec<f64>)| {
            let half = row.get(n..).unwrap_or(&[]).to_vec();
            half.into_iter().map(move |x| x * emissivity(i))
        };
        Ok(rows.iter().enumerate().flat_map(scaled).collect())
    }
}
