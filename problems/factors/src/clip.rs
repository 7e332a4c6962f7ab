//! Convex polygons, in the plane or in space, cut by lines and planes.

use alloc::vec::Vec;

use fredholm_core::Real;
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

/// A ball around a polygon; in space polygons are cones from the origin, and the ball is around their unit vectors.
#[derive(Clone, Copy, Debug)]
struct Ball<const N: usize> {
    middle: [f64; N],
    radius: f64,
}

impl<const N: usize> Ball<N> {
    fn new(polygon: &[[f64; N]]) -> Self {
        let square = |p: [f64; N]| p.iter().map(|x| x * x).sum::<f64>();
        let place = |p: [f64; N]| {
            let scale = if N == 3 {
                1.0 / Real::sqrt(square(p))
            } else {
                1.0
            };
            p.map(|x| scale * x)
        };
        let mut middle = [0.0; N];
        for &p in polygon {
            let p = place(p);
            for k in 0..N {
                middle[k] += p[k] / polygon.len() as f64;
            }
        }
        let apart = |p: [f64; N]| {
            let p = place(p);
            square(from_fn(|k| p[k] - middle[k]))
        };
        let furthest = polygon
            .iter()
            .fold(0.0, |m: f64, &p| Real::max(m, apart(p)));
        Self {
            middle,
            radius: Real::sqrt(furthest),
        }
    }
}

/// A convex polygon among those of [`Rest`]: where its points are, and a ball that holds them, once that is needed.
#[derive(Clone, Copy, Debug)]
struct Held<const N: usize> {
    from: usize,
    to: usize,
    ball: Option<Ball<N>>,
}

/// Convex polygons from which others are taken away, and buffers for that.
#[derive(Clone, Debug)]
pub(crate) struct Rest<const N: usize> {
    points: Vec<[f64; N]>,
    pieces: Vec<Held<N>>,
    lengths: Vec<f64>,
    own: Vec<[f64; N]>,
    inside: Vec<[f64; N]>,
    outside: Vec<[f64; N]>,
}

impl<const N: usize> Default for Rest<N> {
    fn default() -> Self {
        Self {
            points: Vec::new(),
            pieces: Vec::new(),
            lengths: Vec::new(),
            own: Vec::new(),
            inside: Vec::new(),
            outside: Vec::new(),
        }
    }
}

impl<const N: usize> Rest<N> {
    /// Makes it one polygon.
    pub(crate) fn begin(&mut self, polygon: &[[f64; N]]) {
        self.points.clear();
        self.pieces.clear();
        if polygon.len() >= 3 {
            self.points.extend_from_slice(polygon);
            self.pieces.push(Held {
                from: 0,
                to: polygon.len(),
                ball: None,
            });
        }
    }

    /// Whether nothing is left.
    pub(crate) const fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// What is left.
    pub(crate) fn each(&self) -> impl Iterator<Item = &[[f64; N]]> {
        let pieces = self.pieces.iter();
        pieces.filter_map(|own| self.points.get(own.from..own.to))
    }

    /// Takes away what has no negative height over any of `halves`, and calls `taken` with it, piece by piece. Heights are linear, with a
    /// gradient of this length.
    pub(crate) fn take<H: Copy>(
        &mut self,
        halves: &[H],
        height: impl Fn(H, [f64; N]) -> f64,
        length: impl Fn(H) -> f64,
        mut taken: impl FnMut(&[[f64; N]]),
    ) {
        self.lengths.clear();
        self.lengths.extend(halves.iter().map(|&half| length(half)));
        let (mut kept, count) = (0, self.pieces.len());
        for k in 0..count {
            let mut piece = self.pieces[k];
            let own = self.points.get(piece.from..piece.to).unwrap_or(&[]);
            let ball = *piece.ball.get_or_insert_with(|| Ball::new(own));
            let is_off = |(&half, length): (&H, &f64)| {
                height(half, ball.middle) + length * ball.radius < 0.0
            };
            let misses = |&half: &H| own.iter().all(|&p| height(half, p) <= 0.0);
            if halves.iter().zip(&self.lengths).any(is_off) || halves.iter().any(misses) {
                self.pieces[kept] = piece;
                kept += 1;
                continue;
            }
            self.own.clear();
            self.own.extend_from_slice(own);
            for &half in halves {
                let height = |p| height(half, p);
                cut(&self.own, height, &mut self.inside, &mut self.outside);
                if self.outside.len() >= 3 {
                    let from = self.points.len();
                    self.points.extend_from_slice(&self.outside);
                    self.pieces.push(Held {
                        from,
                        to: self.points.len(),
                        ball: None,
                    });
                }
                core::mem::swap(&mut self.own, &mut self.inside);
            }
            taken(&self.own);
        }
        self.pieces.drain(kept..count);
    }
}
