//! What two cells exchange, and how evenly.

use fredholm_core::Real;
use fredholm_core::array::{Each, from_fn};
use fredholm_core::galerkin::legendre;

use crate::geometry::Geometry;
use crate::moments::MOST;
use crate::pairs::Visibility;
use crate::panels::{Panels, RULES, gauss};
use crate::vector::{Vector, dot, norm, sub};
use crate::visible::{Part, Viewer};

/// The first B rows and columns count.
pub(crate) type Block = [[f64; MOST]; MOST];

/// The block with rows and columns exchanged.
pub(crate) fn transposed(block: &Block) -> Block {
    from_fn(|b| block.each(|row| row[b]))
}

/// The point at the fraction `t` of a part.
fn at(part: &Part<f64>, t: f64) -> Viewer<f64> {
    let [from, to] = part.ends;
    Viewer {
        wall: part.wall,
        position: [
            from[0] + t * (to[0] - from[0]),
            from[1] + t * (to[1] - from[1]),
        ],
    }
}

/// What two parts exchange, and how evenly.
pub(crate) struct Sights<'a> {
    geometry: Geometry<'a, f64>,
    /// B ≤ [`MOST`].
    functions: usize,
    panels: Panels<f64>,
    min_mass_ratio: f64,
}

/// How many times a part is halved where it is near another.
const HALVINGS: u32 = 6;

impl<'a> Sights<'a> {
    /// For B = `functions`, at most [`MOST`].
    pub(crate) fn new(geometry: Geometry<'a, f64>, functions: usize, min_mass_ratio: f64) -> Self {
        Self {
            geometry,
            functions,
            panels: Panels::new(functions),
            min_mass_ratio,
        }
    }

    /// Whether no eigenvalue of M_j(x) is below min_mass_ratio times `mean` for x in `from`. Within
    /// a part that sees another wholly p_j has one maximum, so its infimum is at an end; at a
    /// corner it is a limit.
    pub(crate) fn is_even(&self, from: &Part<f64>, to: &Part<f64>, mean: f64) -> bool {
        let even = |t: f64| {
            let mut moments = [[0.0; MOST]; MOST];
            self.measure(&at(from, t), to, Visibility::Full, &mut |share, psi| {
                for (row, left) in moments.iter_mut().zip(psi) {
                    let left = share * left;
                    for (sum, right) in row.iter_mut().zip(psi) {
                        *sum += left * right;
                    }
                }
            });
            for (b, row) in moments.iter_mut().enumerate() {
                row[b] -= self.min_mass_ratio * mean;
            }
            is_positive(moments, self.functions)
        };
        let places = [1e-6, 1.0 - 1e-6, 0.5];
        let count = if self.functions == 1 { 2 } else { 3 };
        places.into_iter().take(count).all(even)
    }

    /// Calls `each` with numbers and the B functions of a part in as many places: see [`Geometry::measure`].
    fn measure(
        &self,
        from: &Viewer<f64>,
        part: &Part<f64>,
        view: Visibility,
        each: &mut dyn FnMut(f64, &[f64]),
    ) {
        let (geometry, panels) = (&self.geometry, &self.panels);
        if self.functions == 1 {
            geometry.measure(panels, from, part, view, |share, psi: &[f64; 1]| {
                each(share, psi);
            });
        } else {
            geometry.measure(panels, from, part, view, |share, psi: &[f64; MOST]| {
                each(share, psi.get(..self.functions).unwrap_or(psi));
            });
        }
    }

    /// ∫∫ ψ_a(x) ψ_b(y) cos θ_x cos θ_y/(2r) dy dx over x in one part and y in the other.
    pub(crate) fn exchange(&self, own: &Part<f64>, other: &Part<f64>, view: Visibility) -> Block {
        if self.functions == 1 {
            let exchange = match view {
                Visibility::Partial => partly(&self.geometry, own, other),
                _ => wholly(&self.geometry, own, other),
            };
            return [[exchange; MOST]; MOST];
        }
        let mut sums = [[0.0; MOST]; MOST];
        if own.length <= other.length {
            self.integrate([own, other], view, [0.0, 1.0], HALVINGS, &mut sums);
            sums
        } else {
            self.integrate([other, own], view, [0.0, 1.0], HALVINGS, &mut sums);
            transposed(&sums)
        }
    }

    /// Adds the part of it with x between two fractions of the first part.
    fn integrate(
        &self,
        parts: [&Part<f64>; 2],
        view: Visibility,
        [from, to]: [f64; 2],
        halvings: u32,
        sums: &mut Block,
    ) {
        let [own, other] = parts;
        let middle = 0.5 * (from + to);
        let half = 0.5 * (to - from) * own.length;
        let away = distance(at(own, middle).position, other);
        let rule = self.panels.rule(away * away, half * half);
        if rule.is_none() && halvings > 0 {
            for ends in [[from, middle], [middle, to]] {
                self.integrate(parts, view, ends, halvings - 1, sums);
            }
            return;
        }
        let last = RULES - 1;
        let rule = if view == Visibility::Partial {
            last
        } else {
            rule.unwrap_or(last)
        };
        for (place, weight) in gauss::<f64>(rule) {
            let t = middle + 0.5 * (to - from) * place;
            let psi: [f64; MOST] = legendre(t + t - 1.0);
            let mut inner = [0.0; MOST];
            self.measure(&at(own, t), other, view, &mut |share, psi| {
                for (sum, psi) in inner.iter_mut().zip(psi) {
                    *sum += share * psi;
                }
            });
            for (row, psi) in sums.iter_mut().zip(psi).take(self.functions) {
                for (sum, inner) in row.iter_mut().zip(inner).take(self.functions) {
                    *sum += half * weight * psi * inner;
                }
            }
        }
    }
}

/// The distance of a point from a part.
fn distance(point: Vector<f64>, part: &Part<f64>) -> f64 {
    let [a, b] = part.ends;
    let (span, to) = (sub(b, a), sub(point, a));
    let t = (dot(span, to) / dot(span, span)).clamp(0.0, 1.0);
    norm(sub(to, [t * span[0], t * span[1]]))
}

/// Whether the symmetric matrix of the first `size` rows and columns has no negative eigenvalue: by its pivots.
// Row operations on two rows of one matrix read best by index.
#[allow(clippy::needless_range_loop)]
fn is_positive(mut a: Block, size: usize) -> bool {
    let size = size.min(MOST);
    for column in 0..size {
        let pivot = a[column][column];
        // Written so that NaN fails.
        if !(pivot >= 0.0) {
            return false;
        }
        for row in column + 1..size {
            let factor = a[row][column] / pivot;
            for k in column + 1..size {
                let above = a[column][k];
                a[row][k] -= factor * above;
            }
        }
    }
    true
}

// Gauss–Legendre rules on [0, 1].
const THREE: [(f64, f64); 3] = [
    (0.112_701_665_379_258_3, 0.277_777_777_777_777_8),
    (0.5, 0.444_444_444_444_444_4),
    (0.887_298_334_620_741_7, 0.277_777_777_777_777_8),
];
const FOUR: [(f64, f64); 4] = [
    (0.069_431_844_202_973_7, 0.173_927_422_568_726_9),
    (0.330_009_478_207_571_9, 0.326_072_577_431_273_1),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_1),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_9),
];

/// Length times form factor of two parts that see each other wholly.
fn wholly(geometry: &Geometry<'_, f64>, a: &Part<f64>, b: &Part<f64>) -> f64 {
    let distance = |p: Vector<f64>, q: Vector<f64>| norm(sub(p, q));
    let sides = [
        distance(a.ends[1], b.ends[0]),
        distance(b.ends[1], a.ends[0]),
    ];
    let diagonals = [
        distance(a.ends[0], b.ends[0]),
        distance(a.ends[1], b.ends[1]),
    ];
    let (small, large) = if a.length <= b.length { (a, b) } else { (b, a) };
    let nearest = sides
        .iter()
        .chain(&diagonals)
        .fold(f64::INFINITY, |m, &d| m.min(d));
    if nearest > 4.0 * small.length {
        let terms = THREE.each(|(t, weight)| weight * geometry.unobstructed(&at(small, t), large));
        return small.length * terms.iter().sum::<f64>();
    }
    // Where strings cancel to nothing, nothing is what the pair exchanges.
    Real::max(
        0.5 * ((diagonals[0] + diagonals[1]) - (sides[0] + sides[1])),
        0.0,
    )
}

/// Length times form factor of two other parts.
fn partly(geometry: &Geometry<'_, f64>, a: &Part<f64>, b: &Part<f64>) -> f64 {
    let (small, large) = if a.length <= b.length { (a, b) } else { (b, a) };
    let terms = FOUR.each(|(t, weight)| weight * geometry.visible(&at(small, t), large));
    small.length * terms.iter().sum::<f64>()
}
