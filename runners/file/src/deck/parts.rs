//! The segments of a deck as a scene has them: bases without their subsurfaces, and segments cut where they cross.

use core::ops::Range;
use std::collections::HashMap;

use fredholm::room::Surfaces;

use super::{Deck, DeckSurface};
use crate::InputError;

/// The share of a base's length that its subsurfaces may be beside it, or beyond its ends, or on one another.
const BESIDE: f64 = 1e-6;
/// Segments that cross this share of their length from an end meet there: the scene says what is wrong with that.
const INNER: f64 = 1e-9;
/// The most segments that are compared with all others, which cut each other into a quarter of a million at most. Of more, those
/// that cross are refused.
const MOST_COMPARED: usize = 1000;

/// The segments of a deck, and the surfaces of which they are parts.
#[derive(Clone, Debug)]
pub struct DeckParts {
    /// The segments. All segments of a surface have its name.
    pub surfaces: Surfaces,
    /// The number of each segment's line among the surfaces of the deck.
    pub lines: Vec<usize>,
    /// The names of the surfaces in results: lines that are combined with another have its name.
    pub names: Vec<String>,
    /// The number of each segment's surface among these names.
    of: Vec<usize>,
}

impl DeckParts {
    /// The form factors between surfaces, row by row, of those between segments: a surface gives what its parts give in the mean
    /// over their lengths, and receives what they receive together. One that is covered wholly gives nothing.
    #[must_use]
    pub fn combined(&self, factors: &[f64], lengths: &[f64]) -> Vec<f64> {
        let (parts, count) = (self.of.len(), self.names.len());
        let mut total = vec![0.0; count];
        for (of, length) in self.of.iter().zip(lengths) {
            total[*of] += length;
        }
        let mut all = vec![0.0; count * count];
        let rows = factors.chunks_exact(parts.max(1));
        for ((from, length), row) in self.of.iter().zip(lengths).zip(rows) {
            // Of a surface that is one segment, exactly 1.
            let share = match total[*from] {
                0.0 => 0.0,
                all => length / all,
            };
            for (to, factor) in self.of.iter().zip(row) {
                all[from * count + to] += share * factor;
            }
        }
        all
    }
}

impl Deck {
    /// The segments of which form factors are those of the deck: its surfaces less the subsurfaces (`bas`) on them, baffles cut
    /// where they cross, and combined (`cmb`) with others.
    ///
    /// # Errors
    /// [`InputError`]: a subsurface does not lie on its base, or nothing of a base is left.
    pub fn parts(&self) -> Result<DeckParts, InputError> {
        let mut pieces: Vec<(usize, [[f64; 2]; 2])> = Vec::new();
        // A deck has up to a million surfaces: each is looked at once.
        let mut on_bases: HashMap<usize, Vec<usize>> = HashMap::new();
        for (number, surface) in self.surfaces.iter().enumerate() {
            if let Some(base) = surface.base {
                on_bases.entry(base).or_default().push(number);
            }
        }
        for (line, surface) in self.surfaces.iter().enumerate() {
            let left = match on_bases.get(&line) {
                None => vec![surface.ends],
                Some(all) => self.without_subsurfaces(line, surface, all)?,
            };
            pieces.extend(left.into_iter().map(|ends| (line, ends)));
        }
        if pieces.len() <= MOST_COMPARED {
            pieces = cut(&pieces);
        }
        // A line is combined with one above it.
        let mut groups: Vec<usize> = Vec::new();
        let mut names = Vec::new();
        for surface in &self.surfaces {
            let own = surface.combined.and_then(|line| groups.get(line).copied());
            groups.push(own.unwrap_or(names.len()));
            if own.is_none() {
                names.push(surface.name.clone());
            }
        }
        let mut parts = DeckParts {
            surfaces: Surfaces {
                open: self.open,
                is_deck: true,
                ..Surfaces::default()
            },
            lines: Vec::new(),
            names,
            of: Vec::new(),
        };
        for (line, ends) in pieces {
            let surface = &self.surfaces[line];
            parts.surfaces = parts
                .surfaces
                .with(&surface.name, &ends, surface.material());
            parts.lines.push(line);
            parts.of.push(groups[line]);
        }
        Ok(parts)
    }

    /// What is left of a surface beside the subsurfaces on it, from its first end to its last.
    fn without_subsurfaces(
        &self,
        line: usize,
        base: &DeckSurface,
        all: &[usize],
    ) -> Result<Vec<[[f64; 2]; 2]>, InputError> {
        let [a, b] = base.ends;
        let along = [b[0] - a[0], b[1] - a[1]];
        let square = along[0] * along[0] + along[1] * along[1];
        // The share of the base's length, and how far beside it as a share of that.
        let place = |p: [f64; 2]| {
            let d = [p[0] - a[0], p[1] - a[1]];
            [
                (d[0] * along[0] + d[1] * along[1]) / square,
                (d[1] * along[0] - d[0] * along[1]) / square,
            ]
        };
        let mut on_it: Vec<(Range<f64>, usize)> = Vec::new();
        for &number in all {
            let [[from, off], [to, off_too]] = self.surfaces[number].ends.map(place);
            let lies = off.abs().max(off_too.abs()) < BESIDE && from > -BESIDE && to < 1.0 + BESIDE;
            if !(lies && from < to) {
                return Err(self.error(
                    number,
                    format_args!(
                        "a subsurface must lie on its base {:?}, and face in the same direction",
                        base.name
                    ),
                ));
            }
            on_it.push((from..to, number));
        }
        on_it.sort_by(|(a, _), (b, _)| a.start.total_cmp(&b.start));
        let (mut left, mut from, mut at) = (Vec::new(), a, 0.0);
        for (range, number) in on_it {
            if range.start < at - BESIDE {
                return Err(self.error(
                    number,
                    "it lies on another subsurface: give that one as its base",
                ));
            }
            let [start, end] = self.surfaces[number].ends;
            if range.start > at + BESIDE {
                left.push([from, start]);
            }
            (from, at) = (end, range.end);
        }
        if at < 1.0 - BESIDE {
            left.push([from, b]);
        }
        if left.is_empty() {
            return Err(self.error(
                line,
                "subsurfaces cover it wholly: leave it out, and combine them by `cmb`",
            ));
        }
        Ok(left)
    }
}

/// Segments cut where they cross others, if both are baffles, drawn from both sides. A wall that is crossed lets something through to
/// where there may be no room: the scene refuses that.
fn cut(pieces: &[(usize, [[f64; 2]; 2])]) -> Vec<(usize, [[f64; 2]; 2])> {
    let ends = |&(_, ends): &(usize, [[f64; 2]; 2])| ends;
    let has_back = |piece: &(usize, [[f64; 2]; 2])| {
        let [a, b] = ends(piece);
        pieces.iter().any(|other| ends(other) == [b, a])
    };
    let is_baffle: Vec<bool> = pieces.iter().map(has_back).collect();
    let mut cuts: Vec<Vec<(f64, [f64; 2])>> = vec![Vec::new(); pieces.len()];
    for (i, (_, first)) in pieces.iter().enumerate() {
        for (j, (_, second)) in pieces.iter().enumerate().skip(i + 1) {
            if is_baffle[i]
                && is_baffle[j]
                && let Some((s, t, point)) = crossing(*first, *second)
            {
                cuts[i].push((s, point));
                cuts[j].push((t, point));
            }
        }
    }
    let mut all = Vec::new();
    for ((line, [from, to]), mut own) in pieces.iter().zip(cuts) {
        own.sort_by(|(s, _), (t, _)| s.total_cmp(t));
        // Both sides of a baffle cross both of another in one point.
        own.dedup_by(|(_, p), (_, q)| p == q);
        let mut from = *from;
        for (_, point) in own {
            all.push((*line, [from, point]));
            from = point;
        }
        all.push((*line, [from, *to]));
    }
    all
}

/// Where two segments cross, as shares of their lengths and as a point, which is the same for both sides of them.
fn crossing(first: [[f64; 2]; 2], second: [[f64; 2]; 2]) -> Option<(f64, f64, [f64; 2])> {
    let apart = |k: usize| {
        let [a, b] = [first, second].map(|[p, q]| [p[k].min(q[k]), p[k].max(q[k])]);
        a[1] < b[0] || b[1] < a[0]
    };
    if apart(0) || apart(1) {
        return None;
    }
    let ordered = |[p, q]: [[f64; 2]; 2]| if p <= q { [p, q] } else { [q, p] };
    let (one, other) = (ordered(first), ordered(second));
    let (one, other) = if one <= other {
        (one, other)
    } else {
        (other, one)
    };
    let share = |[a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]| {
        let (u, v) = ([b[0] - a[0], b[1] - a[1]], [d[0] - c[0], d[1] - c[1]]);
        let cross = u[0] * v[1] - u[1] * v[0];
        ((c[0] - a[0]) * v[1] - (c[1] - a[1]) * v[0]) / cross
    };
    let (s, t) = (share(first, second), share(second, first));
    let is_inner = |t: f64| t > INNER && t < 1.0 - INNER;
    let at = share(one, other);
    let point = [0, 1].map(|k| one[0][k] + at * (one[1][k] - one[0][k]));
    (is_inner(s) && is_inner(t)).then_some((s, t, point))
}
