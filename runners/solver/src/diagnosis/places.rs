//! Contributions by places.

use std::collections::HashMap;

use fredholm_variance::Contribution;

/// A picture of where the variance comes from.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Picture {
    /// Shares of pairs of places: rows are where a step starts, the last column is the sources'.
    Table(Vec<String>, Vec<Vec<f64>>),
    /// Pieces of walls by the number of the wall, their ends in fractions of it, and the share of each in the variance
    /// over its share of all length.
    Walls(Vec<(usize, [f64; 2], f64)>),
}

impl Picture {
    /// The walls, with the shares of sites that are these pieces of them.
    pub(super) fn walls(pieces: &[(usize, [f64; 2], f64)], shares: &[f64]) -> Self {
        let all: f64 = pieces.iter().map(|(.., own)| own).sum();
        let pieces = pieces.iter().zip(shares);
        Self::Walls(
            pieces
                .map(|(&(wall, ends, own), share)| (wall, ends, share * all / own))
                .collect(),
        )
    }
}

/// The share of every site in the variance, by steps from it and by the sources' difference in it.
pub(super) fn shares_of_sites(contributions: &[Contribution], sites: usize) -> Vec<f64> {
    let mut shares = vec![0.0; sites];
    for contribution in contributions {
        shares[contribution.from] += contribution.variance;
    }
    let all: f64 = shares.iter().sum();
    shares.iter_mut().for_each(|share| *share /= all);
    shares
}

/// Contributions by places.
pub(super) struct Summed {
    /// From, into, variance; the largest first.
    pub(super) places: Vec<(String, Option<String>, f64)>,
    /// Their sum.
    pub(super) all: f64,
    pub(super) half_in: Option<f64>,
    /// The names of the places, and what every pair of them adds; the sources last.
    names: Vec<String>,
    sums: Vec<f64>,
}

impl Summed {
    pub(super) fn table(&self) -> Picture {
        let rows = self.sums.chunks_exact(self.names.len() + 1);
        let shares = rows.map(|row| row.iter().map(|sum| sum / self.all).collect());
        Picture::Table(self.names.clone(), shares.collect())
    }

    pub(super) fn new(
        contributions: &[Contribution],
        sites: usize,
        name: &dyn Fn(usize) -> String,
    ) -> Self {
        // In the order in which they come.
        let mut distinct: Vec<String> = Vec::new();
        let mut known = HashMap::new();
        let of: Vec<usize> = (0..sites)
            .map(|site| {
                let name = name(site);
                *known.entry(name.clone()).or_insert_with(|| {
                    distinct.push(name);
                    distinct.len() - 1
                })
            })
            .collect();
        let width = distinct.len() + 1;
        let mut sums = vec![0.0; distinct.len() * width];
        let mut all = 0.0;
        for contribution in contributions {
            let into = contribution.into.map_or(distinct.len(), |into| of[into]);
            sums[of[contribution.from] * width + into] += contribution.variance;
            all += contribution.variance;
        }
        let mut places: Vec<(String, Option<String>, f64)> = sums
            .iter()
            .enumerate()
            .map(|(place, &sum)| {
                let into = distinct.get(place % width).cloned();
                (distinct[place / width].clone(), into, sum)
            })
            .filter(|(.., sum)| *sum != 0.0)
            .collect();
        places.sort_by(|a, b| b.2.total_cmp(&a.2));
        // Pairs alone, the largest first.
        let pairs = || {
            contributions
                .iter()
                .filter(|c| c.into.is_some() && c.variance > 0.0)
        };
        let total: f64 = pairs().map(|c| c.variance).sum();
        let mut sum = 0.0;
        let half = pairs().take_while(|c| {
            let before = sum;
            sum += c.variance;
            before < 0.5 * total
        });
        let half = half.count();
        Self {
            places,
            all,
            half_in: (total > 0.0).then(|| half as f64 / (sites * sites) as f64),
            names: distinct,
            sums,
        }
    }
}
