//! Moments of the cosine law over what a point sees of a part of a wall.
//!
//! With d the length of the perpendicular from x to the line of cell j and s the place along it, counted from the foot,
//!
//! ```text
//! M_j(x)_bc = ½ ∫ ψ_b ψ_c h(s) d (s² + d²)^(−3/2) ds
//! ```
//!
//! over what x sees of the cell, its visible intervals, exactly; h(s) is the height of y above the wall of x. The density has
//! one sign, so that nothing cancels, as it would in the closed form with its powers of tan for small, distant or near cells.
//! It is integrated by Gauss points whose number follows from the ellipse (Bernstein 1912) around the cell in which it is
//! analytic, up to s = ±id: 4 to 16 leave an error below rounding. A cell that is too near, by about 1.2 of its lengths, is
//! cut at ±d, and what is farther from the foot in halves of halves, first. Of 80,000 random cells of all sizes, near, far
//! and in corners, the largest error is 9 ε of the mass (times ψ_b(1) ψ_c(1)) up to degree 3 and 16 ε at degree 4 in f64,
//! 6 ε in f32. Where x is a corner itself, all of the mass is at the cell's end there.

use fredholm_core::array::Each;
use fredholm_core::galerkin::{Cells, PairIntegral, TransitionMoments, legendre};
use fredholm_core::{Equation, Located, Real, Value};
use num_traits::{one, zero};

use crate::geometry::{Wall, factor};
use crate::panels::{Panels, gauss};
use crate::vector::{Vector, cross, dot, sub};
use crate::visible::{Part, Viewer};
use crate::{Point, Room};

/// A part as a point sees it: by the places s on its wall, counted from the foot of the point's
/// perpendicular in the direction of the wall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight<F> {
    /// Where the part begins and ends, each from its own end.
    ends: [F; 2],
    /// How long it is.
    length: F,
    /// The length d of the perpendicular.
    distance: F,
    /// The heights of the part's ends above the point's own wall.
    heights: [F; 2],
}

impl<F: Real> Sight<F> {
    #[inline]
    pub(crate) fn new(
        normal: Vector<F>,
        position: Vector<F>,
        part: &Part<F>,
        wall: &Wall<F>,
    ) -> Self {
        let ends = part.ends.each(|end| sub(end, position));
        Self {
            ends: ends.each(|end| dot(wall.tangent, end)),
            length: part.length,
            distance: wall.height(position),
            heights: ends.each(|end| dot(normal, end)),
        }
    }

    /// d.
    #[inline]
    pub(crate) fn distance(&self) -> F {
        self.distance
    }

    /// The fractions of the part before and behind s.
    #[inline]
    pub(crate) fn fractions(&self, s: F) -> [F; 2] {
        let [from, to] = self.ends;
        [(s - from) / self.length, (to - s) / self.length]
    }

    /// Where a direction meets the wall, within the part.
    #[inline]
    pub(crate) fn meets(&self, direction: Vector<F>, wall: &Wall<F>) -> F {
        let s = self.distance * dot(wall.tangent, direction) / -dot(wall.normal(), direction);
        let [from, to] = self.ends;
        // NaN becomes an end.
        if s > from {
            if s < to { s } else { to }
        } else {
            from
        }
    }

    /// cos θ_x cos θ_y/(2r) ds at s, with its fractions.
    #[inline]
    fn law(&self, s: F, [before, behind]: [F; 2], ds: F) -> F {
        // A sum of positive numbers, however near an end in a corner is.
        let height = self.heights[0] * behind + self.heights[1] * before;
        let per = one::<F>() / (s * s + self.distance * self.distance).sqrt();
        // Cubes of small distances may be none.
        F::from_f64(0.5) * (height.max(zero()) * per) * (self.distance * per) * (ds * per)
    }
}

/// The largest B: on the parts of near cells the largest rule has all digits up to there.
pub(crate) const MOST: usize = 5;

/// Calls `each` with shares of the form factor to a whole part and the functions there.
#[inline]
fn of_whole<F: Real, const B: usize>(
    panels: &Panels<F>,
    sight: &Sight<F>,
    each: &mut impl FnMut(F, &[F; B]),
) {
    let half = F::from_f64(0.5);
    let width = half * sight.length;
    let [from, to] = sight.ends;
    let middle = half * (from + to);
    let distance = middle * middle + sight.distance * sight.distance;
    match panels.rule(distance, width * width) {
        Some(rule) => {
            for (place, weight) in gauss::<F>(rule) {
                let t = half + half * place;
                let share = sight.law(
                    from + t * sight.length,
                    [t, one::<F>() - t],
                    half * weight * sight.length,
                );
                each(share, &legendre(place));
            }
        }
        None => of_interval(panels, sight, sight.ends, each),
    }
}

/// The integrals over an interval of the part.
fn of_interval<F: Real, const B: usize>(
    panels: &Panels<F>,
    sight: &Sight<F>,
    ends: [F; 2],
    each: &mut impl FnMut(F, &[F; B]),
) {
    panels.points(ends, sight.distance, |s, ds| {
        let [before, behind] = sight.fractions(s);
        each(
            sight.law(s, [before, behind], ds),
            &legendre(before - behind),
        );
    });
}

impl<F: Real, C> Room<'_, F, C> {
    /// The form factor from `x` to cell `j`: the light that leaves x and arrives there.
    #[inline]
    #[must_use]
    pub fn form_factor(&self, x: &Point<F>, j: usize) -> F {
        let [factor] = self.form_factors(x, j);
        factor
    }

    /// ∫ ψ_b cos θ_x cos θ_y/(2r) dy over what `x` sees of cell `j`, for all b; the first is the
    /// [form factor](Self::form_factor).
    #[must_use]
    pub fn form_factors<const B: usize>(&self, x: &Point<F>, j: usize) -> [F; B] {
        let Some(wall) = self.partition().wall(j) else {
            return [F::NAN; B];
        };
        let mut sums = [zero(); B];
        for (w, _) in self.geometry().copies(wall) {
            if self.is_at_end(x, w) {
                self.in_corner(&x.viewer(), w, &mut |cell, own: &[F; B]| {
                    if cell == j {
                        plus(&mut sums, own);
                    }
                });
            } else if let Some(part) = self.part_on(j, w) {
                plus(&mut sums, &self.moments_of_part::<B>(x, &part));
            }
        }
        sums
    }

    /// The moments of what a point sees of a part of a wall.
    pub(crate) fn moments_of_part<const B: usize>(&self, x: &Point<F>, part: &Part<F>) -> [F; B] {
        let (viewer, mut sums) = (x.viewer(), [zero(); B]);
        let mut piece = |whole, right, left| {
            plus(
                &mut sums,
                &self.moments_of::<B>(&viewer, part, ([right, left], whole)),
            );
        };
        // Called by its address, so that the sweep is compiled once for all degrees.
        let piece: &mut dyn FnMut(bool, Vector<F>, Vector<F>) = &mut piece;
        self.geometry().visible_pieces(&viewer, part, piece);
        sums
    }

    /// The form factor from `x` to a whole wall, by what x sees of it; NaN if there is no such wall.
    #[must_use]
    pub fn form_factor_of_wall(&self, x: &Point<F>, wall: usize) -> F {
        if wall >= self.geometry().walls().len() {
            return F::NAN;
        }
        let copies = self.geometry().copies(wall);
        copies.fold(zero(), |sum, (w, found)| {
            let [factor] = self.moments_of_part(x, &found.part(w));
            sum + factor
        })
    }

    /// Calls `each` with the cells that a point sees and their [moments](Self::form_factors), wall by wall; with one that is seen in several
    /// pieces, several times.
    ///
    /// O(w) visits of the hierarchy for w walls, and O(1) for every cell that is seen.
    pub(crate) fn seen_cells<const B: usize>(
        &self,
        x: &Point<F>,
        mut each: impl FnMut(usize, &[F; B]),
    ) {
        let (geometry, viewer) = (self.geometry(), x.viewer());
        for (w, wall) in (0..).zip(geometry.all()) {
            if self.is_at_end(x, w) {
                self.in_corner(&viewer, w, &mut each);
                continue;
            }
            let mut piece = |_, right, left| {
                self.cells_between(viewer.position, w, [right, left], |cell, ends, whole| {
                    if let Some(part) = self.part_on(cell, w) {
                        each(cell, &self.moments_of(&viewer, &part, (ends, whole)));
                    }
                });
            };
            let piece: &mut dyn FnMut(bool, Vector<F>, Vector<F>) = &mut piece;
            geometry.visible_pieces(&viewer, &wall.part(w), piece);
        }
    }

    /// Whether a point is an end of another wall.
    fn is_at_end(&self, x: &Point<F>, wall: u32) -> bool {
        let found = self.geometry().wall(wall);
        x.viewer().wall != wall && found.is_some_and(|own| own.ends.contains(&x.position()))
    }

    /// What is seen of a wall from one of its ends: all at the end of a cell there.
    fn in_corner<const B: usize>(
        &self,
        viewer: &Viewer<F>,
        wall: u32,
        each: &mut impl FnMut(usize, &[F; B]),
    ) {
        let range = self.partition().range(self.geometry().original(wall));
        let (first, last) = (range.start, range.end.saturating_sub(1));
        // Once, of a wall of one cell.
        let both = (first..=last).step_by(last.saturating_sub(first).max(1));
        for cell in both {
            let part = self.part_on(cell, wall);
            if let Some(part) = part.filter(|part| part.ends.contains(&viewer.position)) {
                // The directions are not asked for.
                let nothing = [[zero(); 2]; 2];
                each(cell, &self.moments_of(viewer, &part, (nothing, true)));
            }
        }
    }

    /// The moments of a piece of a part, between two directions from right to left; whether it is all of the part.
    #[inline]
    fn moments_of<const B: usize>(
        &self,
        from: &Viewer<F>,
        part: &Part<F>,
        ([right, left], is_whole): ([Vector<F>; 2], bool),
    ) -> [F; B] {
        const {
            assert!(
                0 < B && B <= MOST,
                "a cell of a room has from 1 to 5 functions"
            );
        }
        let (geometry, panels) = (self.geometry(), self.panels(B));
        if is_whole && B == 1 {
            return [geometry.unobstructed(from, part); B];
        }
        let (Some(own), Some(other)) = (geometry.wall(from.wall), geometry.wall(part.wall)) else {
            return [F::NAN; B];
        };
        let mut sums = [zero(); B];
        let mut add = |share: F, psi: &[F; B]| {
            for (sum, &psi) in sums.iter_mut().zip(psi) {
                *sum += share * psi;
            }
        };
        let sight = || Sight::new(own.normal(), from.position, part, other);
        if !is_whole {
            let share = factor(own.normal(), right, left, cross(right, left));
            // Between the shadows of walls that meet, or end on another, rounding may leave a gap.
            let gap = F::from_f64(4.0) * F::EPSILON;
            if !(share > gap) {
                return sums;
            }
            if B == 1 {
                return [share; B];
            }
            let sight = sight();
            let ends = [right, left].each(|d| sight.meets(d, other));
            of_interval(panels, &sight, ends, &mut add);
            return sums;
        }
        let sight = sight();
        if sight.distance > zero() && !part.ends.contains(&from.position) {
            of_whole(panels, &sight, &mut add);
            return sums;
        }
        // In a corner: all that is seen of the part is seen where it begins.
        let place = if part.ends[0] == own.ends[1] {
            -one::<F>()
        } else {
            one()
        };
        add(geometry.unobstructed(from, part), &legendre(place));
        sums
    }

    /// Writes the moments of all cells, B of each: see [`form_factors`](Self::form_factors).
    pub fn all_form_factors<const B: usize>(&self, x: &Point<F>, out: &mut [F]) {
        out.fill(zero());
        self.seen_cells(x, |cell, own: &[F; B]| {
            let place = out.get_mut(cell * B..(cell + 1) * B);
            plus(place.unwrap_or_default(), own);
        });
    }

    /// The irradiance that v makes at a point: v times form factors, over all cells. v has B numbers of every channel, cell by cell;
    /// `f64` is the `W` of one channel.
    #[must_use]
    pub fn irradiance_of<W: Value<f64>, const B: usize>(&self, x: &Point<F>, v: &[F]) -> W {
        let channels = v.len() / (self.cells() * B).max(1);
        let mut sum = W::splat(channels, 0.0);
        self.seen_cells(x, |cell, factors: &[F; B]| {
            let own = v.get(cell * channels * B..).unwrap_or(&[]);
            let of_cell = W::from_fn(channels, |channel| {
                let own = own.iter().skip(channel * B).zip(factors);
                own.map(|(v, factor)| v.to_f64() * factor.to_f64()).sum()
            });
            sum = sum.plus(&of_cell);
        });
        sum
    }
}

/// Adds numbers to others.
#[inline]
fn plus<F: Real>(sums: &mut [F], own: &[F]) {
    for (sum, &own) in sums.iter_mut().zip(own) {
        *sum += own;
    }
}

/// p_j(x), of piecewise constants alone: pairs of cells serve the method of the paper.
impl<F: Real, C> TransitionMoments for Room<'_, F, C> {
    #[inline]
    fn moments(&self, x: &Located<Point<F>>, j: usize) -> [[F; 1]; 1] {
        [[self.form_factor(&x.point, j)]]
    }
}

impl<F: Real, const B: usize> PairIntegral<B> for Room<'_, F> {
    #[inline]
    fn pair_integral(&self, x: &Located<Point<F>>, j: usize) -> [F; B] {
        let reflectance = self.kernel(&x.point, &x.point);
        self.form_factors(&x.point, j).each(|f| reflectance * f)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use fredholm_core::Real;
    use fredholm_core::galerkin::legendre;

    use super::{Sight, of_whole};
    use crate::panels::{Panels, RULES, gauss};

    /// Adds `share` ψ_b ψ_c.
    fn add<F: Real, const B: usize>(sums: &mut [[F; B]; B], share: F, psi: &[F; B]) {
        for (row, &left) in sums.iter_mut().zip(psi) {
            for (sum, &right) in row.iter_mut().zip(psi) {
                *sum += share * left * right;
            }
        }
    }

    /// Numbers in [0, 1).
    struct Draws(u64);

    impl Draws {
        fn next(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / 9_007_199_254_740_992.0
        }

        /// Between 10^low and 10^high, as often in every power.
        fn power(&mut self, low: f64, high: f64) -> f64 {
            Real::pow(10.0, low + (high - low) * self.next())
        }

        /// A cell of any size at any place, seen from any distance; its heights are those of a
        /// slanted wall, often of one that meets that of the point.
        fn sight<F: Real>(&mut self, tiny: f64) -> Sight<F> {
            let to = F::from_f64;
            let length = to(self.power(tiny, 0.0));
            let kind = self.next();
            let far = to(self.power(tiny, 1.0));
            let from = if kind < 0.3 {
                // The foot is in the cell.
                -to(self.next()) * length
            } else if kind < 0.6 {
                far
            } else {
                -far - length
            };
            let distance = to(self.power(tiny, 1.0));
            let heights = match self.next() {
                none if none < 0.3 => [0.0, length.to_f64()],
                none if none < 0.6 => [self.next(), 0.0],
                _ => [self.next(), self.next()],
            };
            // A length that is the difference of the ends, as far as digits go.
            let to_end = from + length;
            Sight {
                ends: [from, to_end],
                length: to_end - from,
                distance,
                heights: heights.map(to),
            }
        }
    }

    /// In f64 by halving until a part is ten times as far from the foot's pole as it is wide.
    fn reference<F: Real, const B: usize>(sight: &Sight<F>) -> [[f64; B]; B] {
        let wide = Sight {
            ends: sight.ends.map(Real::to_f64),
            length: sight.length.to_f64(),
            distance: sight.distance.to_f64(),
            heights: sight.heights.map(Real::to_f64),
        };
        let [from, to] = wide.ends;
        // Places with their fractions, kept apart so that nothing cancels.
        let foot = 0.0_f64.clamp(from, to);
        let [before, behind] = wide.fractions(foot);
        let [from, foot, to] = [[from, 0.0, 1.0], [foot, before, behind], [to, 1.0, 0.0]];
        let [left, right] = [[from, foot], [foot, to]].map(|ends| halves(&wide, ends));
        plus(left, right)
    }

    fn plus<const B: usize>(mut a: [[f64; B]; B], b: [[f64; B]; B]) -> [[f64; B]; B] {
        for (a, b) in a.as_flattened_mut().iter_mut().zip(b.as_flattened()) {
            *a += b;
        }
        a
    }

    /// Sums of sums, which round less than long ones.
    fn halves<const B: usize>(sight: &Sight<f64>, [from, to]: [[f64; 3]; 2]) -> [[f64; B]; B] {
        let at = |t: f64| {
            let mix = |k: usize| 0.5 * ((1.0 - t) * from[k] + (1.0 + t) * to[k]);
            [mix(0), mix(1), mix(2)]
        };
        let (middle, d, h) = (at(0.0), sight.distance, sight.heights);
        // Of numbers that are as small as they can be.
        let width = if Real::abs(middle[0]) < sight.length {
            to[0] - from[0]
        } else {
            (to[1] - from[1]) * sight.length
        };
        if width * width > 0.01 * (middle[0] * middle[0] + d * d) {
            return plus(halves(sight, [from, middle]), halves(sight, [middle, to]));
        }
        let mut sums = [[0.0; B]; B];
        for (t, weight) in gauss::<f64>(RULES - 1) {
            let [s, before, behind] = at(t);
            let r = Real::sqrt(s * s + d * d);
            let law = 0.5 * (h[0] * behind + h[1] * before) * d / (r * r * r);
            add(
                &mut sums,
                0.5 * width * weight * law,
                &legendre(before - behind),
            );
        }
        sums
    }

    /// The largest error in units of ε of the mass, over so many sights.
    fn worst<F: Real, const B: usize>(tiny: f64, count: usize) -> f64 {
        let panels = Panels::<F>::new(B);
        let root: [f64; B] = legendre(1.0);
        let mut draws = Draws(1);
        let mut worst: f64 = 0.0;
        for _ in 0..count {
            let sight = draws.sight::<F>(tiny);
            let expected: [[f64; B]; B] = reference(&sight);
            let mut found = [[F::zero(); B]; B];
            of_whole(&panels, &sight, &mut |share, psi: &[F; B]| {
                add(&mut found, share, psi);
            });
            for (b, (found, expected_row)) in found.iter().zip(&expected).enumerate() {
                for (c, (found, entry)) in found.iter().zip(expected_row).enumerate() {
                    let error = Real::abs(found.to_f64() - entry);
                    let size = root[b] * root[c] * expected[0][0] * F::EPSILON.to_f64();
                    if error / size > worst {
                        worst = error / size;
                    }
                }
            }
        }
        worst
    }

    /// Over 20,000 cells each, of all sizes at all distances down to 10⁻⁹ (f32: 10⁻⁴), with and
    /// without a corner.
    #[test]
    fn moments_are_exact_to_rounding() {
        let wide = [
            worst::<f64, 2>(-9.0, 20_000),
            worst::<f64, 3>(-9.0, 20_000),
            worst::<f64, 4>(-9.0, 20_000),
            worst::<f64, 5>(-9.0, 20_000),
        ];
        let narrow = [
            worst::<f32, 2>(-4.0, 20_000),
            worst::<f32, 3>(-4.0, 20_000),
            worst::<f32, 4>(-4.0, 20_000),
            worst::<f32, 5>(-4.0, 20_000),
        ];
        std::println!("in units of ε: {wide:?}, {narrow:?}");
        assert!(wide.iter().all(|&worst| worst < 20.0), "{wide:?}");
        assert!(narrow.iter().all(|&worst| worst < 10.0), "{narrow:?}");
    }
}
