//! Convex polygons, in the plane or in space, cut by lines and planes.

use alloc::vec::Vec;

use fredholm_core::array::from_fn;

/// Writes the parts of a convex polygon of which `height` is not negative, and not positive. A part with fewer than three vertices
/// has none.
pub(crate) fn cut<const N: usize>(
    polygon: &[[f64; N]],
    height: impl Fn([f64; N]) -> f64,
    inside: &mut Vec<[f64; N]>,
    outside: &mut Vec<[f64; N]>,
) {
    inside.clear();
    outside.clear();
    let Some(&last) = polygon.last() else { return };
    let (mut before, mut low) = (last, height(last));
    for &at in polygon {
        let high = height(at);
        if (low < 0.0 && high > 0.0) || (low > 0.0 && high < 0.0) {
            let t = low / (low - high);
            let both = from_fn(|k| before[k] + t * (at[k] - before[k]));
            inside.push(both);
            outside.push(both);
        }
        if high >= 0.0 {
            inside.push(at);
        }
        if high <= 0.0 {
            outside.push(at);
        }
        (before, low) = (at, high);
    }
    for part in [inside, outside] {
        if part.len() < 3 {
            part.clear();
        }
    }
}

/// The part of a convex polygon of which `height` is not negative. Heights not above `slack` are 0.
pub(crate) fn keep<const N: usize>(
    polygon: &[[f64; N]],
    height: impl Fn([f64; N]) -> f64,
    slack: f64,
) -> Vec<[f64; N]> {
    let mut kept = Vec::new();
    let rounded = |p: [f64; N]| {
        let h = height(p);
        if h.abs() <= slack { 0.0 } else { h }
    };
    cut(polygon, rounded, &mut kept, &mut Vec::new());
    kept
}

/// Convex polygons, and what is said of each.
#[derive(Clone, Debug)]
pub(crate) struct Pieces<const N: usize, T> {
    points: Vec<[f64; N]>,
    /// Where each ends.
    ends: Vec<(usize, T)>,
}

impl<const N: usize, T> Default for Pieces<N, T> {
    fn default() -> Self {
        Self {
            points: Vec::new(),
            ends: Vec::new(),
        }
    }
}

impl<const N: usize, T: Copy> Pieces<N, T> {
    pub(crate) fn clear(&mut self) {
        self.points.clear();
        self.ends.clear();
    }

    pub(crate) fn push(&mut self, piece: &[[f64; N]], said: T) {
        if piece.len() >= 3 {
            self.points.extend_from_slice(piece);
            self.ends.push((self.points.len(), said));
        }
    }

    pub(crate) fn each(&self) -> impl Iterator<Item = (&[[f64; N]], T)> {
        let mut from = 0;
        self.ends.iter().filter_map(move |&(to, said)| {
            let piece = self.points.get(from..to)?;
            from = to;
            Some((piece, said))
        })
    }
}

/// Convex polygons from which others are taken away, and buffers for that.
#[derive(Clone, Debug)]
pub(crate) struct Rest<const N: usize> {
    pieces: Pieces<N, ()>,
    next: Pieces<N, ()>,
    own: Vec<[f64; N]>,
    inside: Vec<[f64; N]>,
    outside: Vec<[f64; N]>,
}

impl<const N: usize> Default for Rest<N> {
    fn default() -> Self {
        Self {
            pieces: Pieces::default(),
            next: Pieces::default(),
            own: Vec::new(),
            inside: Vec::new(),
            outside: Vec::new(),
        }
    }
}

impl<const N: usize> Rest<N> {
    /// Makes it one polygon.
    pub(crate) fn begin(&mut self, polygon: &[[f64; N]]) {
        self.pieces.clear();
        self.pieces.push(polygon, ());
    }

    /// Whether nothing is left.
    pub(crate) const fn is_empty(&self) -> bool {
        self.pieces.ends.is_empty()
    }

    /// What is left.
    pub(crate) fn each(&self) -> impl Iterator<Item = &[[f64; N]]> {
        self.pieces.each().map(|(piece, ())| piece)
    }

    /// Takes away what has no negative height over any of `halves`, and calls `taken` with it, piece by piece.
    pub(crate) fn take<H: Copy>(
        &mut self,
        halves: &[H],
        height: impl Fn(H, [f64; N]) -> f64,
        mut taken: impl FnMut(&[[f64; N]]),
    ) {
        self.next.clear();
        for (piece, ()) in self.pieces.each() {
            let misses = |&half: &H| piece.iter().all(|&p| height(half, p) <= 0.0);
            if halves.iter().any(misses) {
                self.next.push(piece, ());
                continue;
            }
            self.own.clear();
            self.own.extend_from_slice(piece);
            for &half in halves {
                cut(
                    &self.own,
                    |p| height(half, p),
                    &mut self.inside,
                    &mut self.outside,
                );
                self.next.push(&self.outside, ());
                core::mem::swap(&mut self.own, &mut self.inside);
            }
            taken(&self.own);
        }
        core::mem::swap(&mut self.pieces, &mut self.next);
    }
}
