//! Form factors by rays, with standard errors.
//!
//! N_I rays leave a group I evenly and by the cosine law, and n_IJ of them arrive at J. Both n_IJ and n_JI tell the exchange area
//!
//! ```text
//! X = A_I F_IJ = A_J F_JI ≈ (n_IJ + n_JI)/(d_I + d_J),   d = N/A,
//! ```
//!
//! without bias, as n_IJ has the mean d_I X. Its variance is that of two binomial numbers. Where a group J sends none, d_J = 0.
//! Rows of a closed scene are made to sum to 1 by the least change in proportion to the variances, d X ≈ X/(d_I + d_J).

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use fredholm_core::{DefaultGenerator, Real, RngUniforms, WalkSeeds};
use fredholm_scene::{Mean, Ray, Scene, areas};
use fredholm_surfaces::Enclosure;

use crate::FactorsError;
use crate::close::multipliers;
use crate::sky::Sky;

/// The rays of a block, the unit of work.
pub const RAYS_OF_BLOCK: u64 = 1024;

/// A scene from whose groups of faces rays leave.
///
/// ```
/// use fredholm_factors::{RayCounts, RayFactors, Rays};
/// use fredholm_scene::{Enclosure, Scene, shapes};
///
/// let cube = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
/// let rays = Rays::new(&cube, &[0, 1, 2, 3, 4, 5], 6, None, 1)?;
/// let mut counts = vec![RayCounts::default(); 6];
/// for (group, own) in counts.iter_mut().enumerate() {
///     (0..20).for_each(|block| own.add(&rays.block(group, block)));
/// }
/// let f = RayFactors::new(&rays, &counts)?;
/// let across = f.row(0).iter().find(|entry| entry.column == 1).unwrap();
/// assert!((across.factor - 0.199824895698).abs() < 4.0 * across.std_error);
/// assert!((f.row(0).iter().map(|entry| entry.factor).sum::<f64>() - 1.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Rays<'a> {
    scene: &'a Scene,
    group_of: &'a [usize],
    /// The faces of every group, and of each the area of all before it and itself.
    faces: Vec<Vec<u32>>,
    ends: Vec<Vec<f64>>,
    sky: Option<&'a Sky>,
    seed: u64,
}

/// Where rays of one group ended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// The number of rays.
    pub rays: u64,
    /// The number of those that arrived at each group.
    pub groups: BTreeMap<u32, u64>,
    /// The number of those that arrived at each patch of the sky and, last, left below the horizon; empty without a sky.
    pub sky: Vec<u64>,
}

impl RayCounts {
    /// Adds the counts of other rays.
    pub fn add(&mut self, other: &Self) {
        self.rays += other.rays;
        for (&group, count) in &other.groups {
            *self.groups.entry(group).or_default() += count;
        }
        if self.sky.len() < other.sky.len() {
            self.sky.resize(other.sky.len(), 0);
        }
        for (sum, count) in self.sky.iter_mut().zip(&other.sky) {
            *sum += count;
        }
    }

    fn of(&self, group: usize) -> u64 {
        self.groups.get(&(group as u32)).copied().unwrap_or(0)
    }
}

/// A form factor and its standard error, without a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayFactor {
    /// The group, or the patch, at which it arrives.
    pub column: u32,
    /// F_IJ.
    pub factor: f64,
    /// The standard error of F_IJ.
    pub std_error: f64,
}

impl<'a> Rays<'a> {
    /// Rays of a scene: `group_of` has the group of each face, below `count`.
    ///
    /// # Errors
    /// [`FactorsError::Length`] if there are not as many groups as faces, [`FactorsError::Group`] for a group that is none,
    /// [`FactorsError::NoSky`] for a sky above a closed scene, [`FactorsError::Repeats`].
    pub fn new(
        scene: &'a Scene,
        group_of: &'a [usize],
        count: usize,
        sky: Option<&'a Sky>,
        seed: u64,
    ) -> Result<Self, FactorsError> {
        FactorsError::length(scene.faces().len(), group_of.len())?;
        if scene.period().is_some() {
            return Err(FactorsError::Repeats);
        }
        if let Some(&group) = group_of.iter().find(|&&group| group >= count) {
            return Err(FactorsError::Group { group });
        }
        if sky.is_some() && scene.enclosure() == Enclosure::Closed {
            return Err(FactorsError::NoSky);
        }
        let mut faces: Vec<Vec<u32>> = alloc::vec![Vec::new(); count];
        for (number, &group) in (0..).zip(group_of) {
            faces[group].push(number);
        }
        // All of them are faces of the scene.
        let ends = |own: &Vec<u32>| areas(scene.geometry(), own).unwrap_or_default();
        let ends = faces.iter().map(ends).collect();
        Ok(Self {
            scene,
            group_of,
            faces,
            ends,
            sky,
            seed,
        })
    }

    /// The area of a group, in the square of the scene's unit of length.
    #[must_use]
    pub fn area(&self, group: usize) -> f64 {
        let own = self.ends.get(group).and_then(|ends| ends.last());
        own.copied().unwrap_or(0.0)
    }

    /// The number of groups.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.faces.len()
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// Where the rays of a block of a group end: always the same, whoever asks.
    #[must_use]
    pub fn block(&self, group: usize, number: u64) -> RayCounts {
        let mut counts = RayCounts::default();
        let geometry = self.scene.geometry();
        let own = self.faces.get(group).zip(self.ends.get(group));
        let Some(Ok(own)) = own.map(|(faces, ends)| Mean::new(geometry, faces, ends)) else {
            return counts;
        };
        counts.rays = RAYS_OF_BLOCK;
        if let Some(sky) = self.sky {
            counts.sky = alloc::vec![0; sky.patches().len() + 1];
        }
        let seeds = WalkSeeds::<DefaultGenerator>::new(self.seed, group as u64);
        let mut draws = RngUniforms(seeds.generator(number));
        for _ in 0..RAYS_OF_BLOCK {
            let Ray { from, direction } = own.ray(&mut draws);
            match geometry.meet(from.face, from.position, direction) {
                Some(hit) if hit.back => {}
                Some(hit) => {
                    let other = self
                        .group_of
                        .get(hit.face as usize)
                        .copied()
                        .unwrap_or(group);
                    *counts.groups.entry(other as u32).or_default() += 1;
                }
                None => {
                    let patch = self.sky.map_or(0, |sky| sky.patch_of(direction));
                    if let Some(count) = counts.sky.get_mut(patch) {
                        *count += 1;
                    }
                }
            }
        }
        counts
    }
}

/// Form factors of groups from rays.
#[derive(Clone, Debug, PartialEq)]
pub struct RayFactors {
    areas: Vec<f64>,
    rows: Vec<Vec<RayFactor>>,
    sky: Vec<Vec<RayFactor>>,
}

impl RayFactors {
    /// The form factors of all counts: of groups without rays none. Rows of a closed scene all of whose groups have rays sum to 1.
    ///
    /// # Errors
    /// [`FactorsError::Length`] if there are not as many counts as groups.
    pub fn new(rays: &Rays<'_>, counts: &[RayCounts]) -> Result<Self, FactorsError> {
        FactorsError::length(rays.len(), counts.len())?;
        let areas: Vec<f64> = (0..rays.len()).map(|group| rays.area(group)).collect();
        let density = |group: usize| match counts.get(group) {
            Some(own) if own.rays > 0 => own.rays as f64 / areas[group],
            _ => 0.0,
        };
        // Every pair of which at least one sends rays that arrive at the other, both ways.
        let mut pairs: BTreeMap<[u32; 2], f64> = BTreeMap::new();
        for (i, own) in (0_u32..).zip(counts) {
            for &j in own.groups.keys() {
                let [a, b] = [i.min(j) as usize, i.max(j) as usize];
                let both = if a == b {
                    own.of(a) as f64 / density(a)
                } else {
                    let n = counts[a].of(b) + counts[b].of(a);
                    n as f64 / (density(a) + density(b))
                };
                pairs.insert([a as u32, b as u32], both);
            }
        }
        let errors: Vec<f64> = pairs
            .iter()
            .map(|(&[a, b], &exchange)| {
                let [a, b] = [a as usize, b as usize];
                let of = |group: usize| {
                    let n = counts[group].rays as f64;
                    let p = if n > 0.0 {
                        (exchange / areas[group]).min(1.0)
                    } else {
                        0.0
                    };
                    n * p * (1.0 - p)
                };
                let (variance, all) = if a == b {
                    (of(a), density(a))
                } else {
                    (of(a) + of(b), density(a) + density(b))
                };
                Real::sqrt(variance) / all
            })
            .collect();
        let is_closed = rays.scene.enclosure() == Enclosure::Closed;
        if is_closed
            && counts
                .iter()
                .zip(&areas)
                .all(|(own, area)| own.rays > 0 || *area == 0.0)
        {
            close(&areas, &mut pairs, density);
        }
        let mut all = Self {
            rows: alloc::vec![Vec::new(); areas.len()],
            sky: alloc::vec![Vec::new(); areas.len()],
            areas,
        };
        for ((&[a, b], &exchange), &error) in pairs.iter().zip(&errors) {
            for (from, column) in [(a, b), (b, a)].into_iter().take(1 + usize::from(a != b)) {
                let area = all.areas[from as usize];
                if counts[from as usize].rays > 0 {
                    all.rows[from as usize].push(RayFactor {
                        column,
                        factor: exchange / area,
                        std_error: error / area,
                    });
                }
            }
        }
        all.rows
            .iter_mut()
            .for_each(|row| row.sort_by_key(|entry| entry.column));
        for (row, own) in all.sky.iter_mut().zip(counts) {
            let n = own.rays as f64;
            let patches = (0..).zip(&own.sky).filter(|(_, count)| **count > 0);
            row.extend(patches.map(|(column, &count)| {
                let p = count as f64 / n;
                RayFactor {
                    column,
                    factor: p,
                    std_error: Real::sqrt(p * (1.0 - p) / n),
                }
            }));
        }
        Ok(all)
    }

    /// The areas of the groups.
    #[must_use]
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// The form factors of a group to those groups at which rays arrived, by ascending numbers.
    #[must_use]
    pub fn row(&self, group: usize) -> &[RayFactor] {
        self.rows.get(group).map_or(&[], Vec::as_slice)
    }

    /// The form factors of a group to the patches of the sky at which rays arrived, after all of which comes what is below the
    /// horizon.
    #[must_use]
    pub fn sky(&self, group: usize) -> &[RayFactor] {
        self.sky.get(group).map_or(&[], Vec::as_slice)
    }
}

/// Changes exchange areas by w (λ_a + λ_b), w = X/(d_a + d_b), so that all rows sum to the areas.
fn close(areas: &[f64], pairs: &mut BTreeMap<[u32; 2], f64>, density: impl Fn(usize) -> f64) {
    let weights: Vec<([usize; 2], f64)> = pairs
        .iter()
        .map(|(&[a, b], &exchange)| {
            let [a, b] = [a as usize, b as usize];
            ([a, b], exchange / (density(a) + density(b)))
        })
        .collect();
    let times = |of: &[f64]| {
        let mut sums = alloc::vec![0.0; areas.len()];
        for &([a, b], w) in &weights {
            sums[a] += w * of[b];
            if a != b {
                sums[b] += w * of[a];
            }
        }
        sums
    };
    let mut rest = areas.to_vec();
    for (&[a, b], &exchange) in pairs.iter() {
        rest[a as usize] -= exchange;
        if a != b {
            rest[b as usize] -= exchange;
        }
    }
    let lambda = multipliers(&times, rest);
    for (exchange, ([a, b], w)) in pairs.values_mut().zip(&weights) {
        *exchange += w * (lambda[*a] + lambda[*b]);
    }
}
