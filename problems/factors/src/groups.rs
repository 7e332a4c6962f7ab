//! Exchange between groups of faces, such as surfaces, and with a sky.

use alloc::vec::Vec;

use fredholm_core::galerkin::buffer;
use fredholm_scene::Scene;

use crate::sights::SkyRow;
use crate::{Factors, FactorsError};

/// A pivot that is 0 but for rounding.
const SINGULAR: f64 = 1e-12;

/// Exchange areas of groups, row by row.
#[derive(Clone, Debug, PartialEq)]
struct Table {
    areas: Vec<f64>,
    width: usize,
    exchange: Vec<f64>,
}

impl Table {
    /// Zeros for `count` groups, over whose faces these areas are summed up: `groups` has the group of each face.
    fn new(
        areas: &[f64],
        groups: &[usize],
        count: usize,
        width: usize,
    ) -> Result<Self, FactorsError> {
        FactorsError::length(areas.len(), groups.len())?;
        if let Some(&group) = groups.iter().find(|&&group| group >= count) {
            return Err(FactorsError::Group { group });
        }
        let entries = count.checked_mul(width);
        let entries = entries.ok_or(FactorsError::Memory { bytes: None })?;
        let none = |_| FactorsError::Memory {
            bytes: entries.checked_mul(size_of::<f64>()),
        };
        let mut table = Self {
            areas: alloc::vec![0.0; count],
            width,
            exchange: buffer(entries).map_err(none)?,
        };
        for (&group, area) in groups.iter().zip(areas) {
            table.areas[group] += area;
        }
        Ok(table)
    }

    fn add(&mut self, group: usize, column: usize, amount: f64) {
        if let Some(sum) = self.exchange.get_mut(group * self.width + column) {
            *sum += amount;
        }
    }

    fn factor(&self, i: usize, column: usize) -> f64 {
        let row = self.exchange.get(i * self.width..).unwrap_or(&[]);
        let at = row.get(column).filter(|_| column < self.width);
        let area = self.areas.get(i).copied().unwrap_or(f64::NAN);
        // Of a group without faces nothing leaves.
        if area == 0.0 {
            return 0.0;
        }
        at.copied().unwrap_or(f64::NAN) / area
    }
}

/// Exchange areas between groups of faces, such as surfaces, as a dense symmetric table.
#[derive(Clone, Debug, PartialEq)]
pub struct Groups(Table);

impl Factors {
    /// Form factors between the surfaces of a scene: F_IJ = Σ_{i ∈ I} A_i Σ_{j ∈ J} F_ij / A_I.
    ///
    /// # Errors
    /// [`FactorsError::Length`] if the scene has another number of faces, [`FactorsError::Memory`].
    pub fn of_surfaces(&self, scene: &Scene) -> Result<Groups, FactorsError> {
        let surface = |face: usize| scene.place(face).map_or(usize::MAX, |place| place.surface);
        let groups: Vec<usize> = (0..scene.faces().len()).map(surface).collect();
        self.of_groups(&groups, scene.surfaces())
    }

    /// Form factors between groups: `groups` has the group of each face, below `count`.
    ///
    /// # Errors
    /// [`FactorsError::Length`] if there are not as many as faces, [`FactorsError::Group`] for a group that is none,
    /// [`FactorsError::Memory`].
    pub fn of_groups(&self, groups: &[usize], count: usize) -> Result<Groups, FactorsError> {
        let mut table = Table::new(self.areas(), groups, count, count)?;
        for (i, &own) in groups.iter().enumerate() {
            for &(j, amount) in self.row(i) {
                let other = groups.get(j as usize).copied().unwrap_or(own);
                table.add(own, other, amount);
                table.add(other, own, amount);
            }
        }
        Ok(Groups(table))
    }
}

impl Groups {
    /// Groups of these areas with these form factors F_IJ, row by row: also surfaces in the plane, whose areas are lengths.
    ///
    /// # Errors
    /// [`FactorsError::Length`] if there are not as many factors as pairs of groups.
    pub fn new(areas: Vec<f64>, factors: &[f64]) -> Result<Self, FactorsError> {
        let width = areas.len();
        FactorsError::length(width * width, factors.len())?;
        let rows = factors.chunks_exact(width.max(1)).zip(&areas);
        let exchange = rows.flat_map(|(row, area)| row.iter().map(move |factor| area * factor));
        Ok(Self(Table {
            exchange: exchange.collect(),
            width,
            areas,
        }))
    }

    /// The number of groups.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.0.areas.len()
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.0.areas.is_empty()
    }

    /// The areas of the groups.
    #[must_use]
    pub fn areas(&self) -> &[f64] {
        &self.0.areas
    }

    /// F_IJ: the share of what leaves group I evenly and diffusely that arrives at J. Times the area of I it is the same for both.
    #[must_use]
    pub fn factor(&self, i: usize, j: usize) -> f64 {
        self.0.factor(i, j)
    }

    /// The script-F exchange factors 𝓕_IJ of grey groups of even radiosity, row by row:
    /// dimensionless.
    ///
    /// The net heat from I to J is A_I 𝓕_IJ σ(T_I⁴ − T_J⁴), all reflections included, where
    /// 𝓕 = ε (I − F diag(1 − ε))⁻¹ F ε (Hottel and Sarofim 1967; ε G of Gebhart 1961). Like A F,
    /// A 𝓕 is symmetric, and in a closed scene a row's sum is the emissivity of its group. A group of emissivity 0 is adiabatic: it
    /// takes part by what it reflects or radiates again, and has no exchange of its own.
    ///
    /// ```
    /// use fredholm_factors::scene_factors;
    /// use fredholm_scene::{Enclosure, Scene, shapes};
    ///
    /// let cube = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
    /// let f = scene_factors(&cube, 1e-9)?.of_surfaces(&cube)?;
    /// let script = f.script_f(&[0.9, 0.5, 0.5, 0.5, 0.5, 0.2])?;
    /// assert!((script[..6].iter().sum::<f64>() - 0.9).abs() < 1e-13);
    /// assert!((script[5] - script[30]).abs() < 1e-15);
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`FactorsError::Length`] if there are not as many emissivities as groups,
    /// [`FactorsError::Emissivity`] for one outside [0, 1], and if adiabatic groups see each other alone.
    pub fn script_f(&self, emissivities: &[f64]) -> Result<Vec<f64>, FactorsError> {
        let emissivity = |j: usize| emissivities.get(j).copied().unwrap_or(f64::NAN);
        let to = |i: usize, j: usize| self.factor(i, j) * emissivity(j);
        self.with_reflections(emissivities, self.len(), to)
    }

    /// The net heat from I to J, row by row, A_I 𝓕_IJ (b_I − b_J), if black bodies as warm as the groups emit b = σT⁴: in watts, or
    /// in watts per metre of depth in the plane. The sum of a row is what its group gives, and all together are 0.
    ///
    /// ```
    /// use fredholm_factors::Groups;
    ///
    /// // A flat floor of 2 m below a vault of 3 m: 1/(0.5/(0.5 · 2) + 1/2 + 0.2/(0.8 · 3)) W per W/m².
    /// let vault = Groups::new(vec![2.0, 3.0], &[0.0, 1.0, 2.0 / 3.0, 1.0 / 3.0])?;
    /// let watts = vault.net_exchange(&[0.5, 0.8], &[500.0, 400.0])?;
    /// assert!((watts[1] - 100.0 / (0.5 + 0.5 + 0.25 / 3.0)).abs() < 1e-11);
    /// assert!((watts[1] + watts[2]).abs() < 1e-11);
    /// # Ok::<(), fredholm_factors::FactorsError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Groups::script_f`], and [`FactorsError::Length`] if there are not as many b as groups.
    pub fn net_exchange(
        &self,
        emissivities: &[f64],
        black: &[f64],
    ) -> Result<Vec<f64>, FactorsError> {
        FactorsError::length(self.len(), black.len())?;
        let script = self.script_f(emissivities)?;
        let rows = script.chunks_exact(self.len().max(1));
        let rows = rows.zip(self.areas().iter().zip(black));
        let net = rows.flat_map(|(row, (area, own))| {
            let all = row.iter().zip(black);
            all.map(move |(factor, other)| area * factor * (own - other))
        });
        Ok(net.collect())
    }

    /// The script-F exchange factors from grey groups to the patches of a sky and, last, to what is below the horizon, which are
    /// black: row by row, dimensionless.
    ///
    /// With those of [`Groups::script_f`] a row's sum is the emissivity of its group, if nobody sees a back.
    ///
    /// # Errors
    /// As [`Groups::script_f`], and [`FactorsError::Length`] if `sky` has another number of groups.
    pub fn script_sky(
        &self,
        emissivities: &[f64],
        sky: &SkyFactors,
    ) -> Result<Vec<f64>, FactorsError> {
        FactorsError::length(self.len(), sky.len())?;
        let to = |i: usize, patch: usize| sky.factor(i, patch);
        self.with_reflections(emissivities, sky.patches() + 1, to)
    }

    /// ε (I − F diag(1 − ε))⁻¹ times a matrix with so many columns, row by row.
    fn with_reflections(
        &self,
        emissivities: &[f64],
        columns: usize,
        to: impl Fn(usize, usize) -> f64,
    ) -> Result<Vec<f64>, FactorsError> {
        let n = self.len();
        FactorsError::length(n, emissivities.len())?;
        if let Some(group) = emissivities.iter().position(|e| !(0.0..=1.0).contains(e)) {
            return Err(FactorsError::Emissivity { group });
        }
        // [I − F (1 − ε) | the matrix]: no element of the first half beside the diagonal is positive, and no row's sum is negative, so
        // no pivoting is needed. A pivot is 0 if groups see each other alone, and none of them absorbs.
        let own = |i: usize| {
            let reflected = emissivities.iter().enumerate();
            reflected.map(move |(j, e)| f64::from(u8::from(i == j)) - self.factor(i, j) * (1.0 - e))
        };
        let row = |i: usize| own(i).chain((0..columns).map(|k| to(i, k))).collect();
        let mut rows: Vec<Vec<f64>> = (0..n).map(row).collect();
        for k in 0..n {
            let pivot = rows[k].clone();
            if !(pivot[k] > SINGULAR) {
                return Err(FactorsError::Emissivity { group: k });
            }
            let per = 1.0 / pivot[k];
            for (i, row) in rows.iter_mut().enumerate() {
                let factor = if i == k { 1.0 - per } else { row[k] * per };
                if factor != 0.0 {
                    for (x, p) in row.iter_mut().zip(&pivot).skip(k) {
                        *x -= factor * p;
                    }
                }
            }
        }
        let scaled = rows.iter().zip(emissivities);
        let scaled = scaled.flat_map(|(row, e)| row[n..].iter().map(move |x| x * e));
        Ok(scaled.collect())
    }
}

/// Form factors from faces, or groups of them, to the patches of a sky.
#[derive(Clone, Debug, PartialEq)]
pub struct SkyFactors(Table);

impl SkyFactors {
    /// Adds up the rows of all faces in groups: `groups` has the group of each face, below `count`.
    ///
    /// # Errors
    /// [`FactorsError::Length`] if groups, rows and faces are not equally many or rows are not equally long,
    /// [`FactorsError::Group`] for a group that is none, [`FactorsError::Memory`].
    pub fn of_groups(
        areas: &[f64],
        rows: &[SkyRow],
        groups: &[usize],
        count: usize,
    ) -> Result<Self, FactorsError> {
        let width = rows.first().map_or(1, |row| row.exchange.len());
        FactorsError::length(areas.len(), rows.len())?;
        let mut table = Table::new(areas, groups, count, width)?;
        for (&group, row) in groups.iter().zip(rows) {
            FactorsError::length(width, row.exchange.len())?;
            for (patch, &amount) in row.exchange.iter().enumerate() {
                table.add(group, patch, amount);
            }
        }
        Ok(Self(table))
    }

    /// F_ik: the share of what leaves group i evenly and diffusely that arrives at patch k. After all patches comes what is below the
    /// horizon.
    #[must_use]
    pub fn factor(&self, i: usize, patch: usize) -> f64 {
        self.0.factor(i, patch)
    }

    /// The number of groups.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.0.areas.len()
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.0.areas.is_empty()
    }

    /// The number of patches.
    #[must_use]
    pub const fn patches(&self) -> usize {
        self.0.width - 1
    }
}
