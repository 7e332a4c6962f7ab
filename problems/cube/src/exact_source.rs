//! Neighbour equations whose source is F itself, for an F that no polynomial on cells comes near to.
//!
//! Where F jumps, v and G do not follow it, and the walks' variance has ∫(F − G)² whatever the degree. The unknown
//! u − F = T_K u is smooth if the kernel is, and a v that follows F exactly has only T_K u to approximate. Let Π be
//! the projection onto the functions on cells, (Πf)_ia the mean of f ψ_ia. On the cube p is a constant, so with all pairs in
//! S h(x,·) p is one of these functions, and for any f
//!
//! ```text
//! T_hp f = T_hp Πf.
//! ```
//!
//! If V solves V = T_hp V + ΠF, which is (41) with exact F', then
//!
//! ```text
//! v = V + F − ΠF   solves   v = T_hp v + F,
//! ```
//!
//! as T_hp (F − ΠF) = 0. The neighbour equation's source is F, which cancels in ζ but for Σ (k…k − h…h) F, and its
//! solution is F + w with the piecewise polynomial w = V − ΠF = T_hp V near T_K u.
//!
//! **Moments that are estimates.** ΠF of an F that jumps has no exact quadrature. With numbers F″ in its place, V that solves
//! (41) for them up to a residual, G_V by (42) and R = G_V − F″, walks have
//!
//! ```text
//! w = V − F″,   v = F + w,   G = F + R,
//! ```
//!
//! and E η(h, g) is (v*, Φ) for v* = (I − T_hp)⁻¹ (F + R) = F − ΠF + V + (I − T_hp)⁻¹ (ΠF − F″). It differs from v by
//!
//! ```text
//! v* − v = (I − T_hp)⁻¹ T_hp (ΠF − F″),
//! ```
//!
//! which is linear in ΠF − F″. So (v, Φ) is an unbiased estimate of E η(h, g) if E F″ = ΠF, and walks that are independent
//! of F″ give an unbiased estimate of u. Its error has a standard deviation of its own: that of (Z − Δ, Φ) with
//! Z = (I − K')⁻¹ Δ, where Δ is distributed as the error of F″. Of the mean over X, whose (F, 1) is as unknown, v is V in the
//! mean, and the error (Z, 1); so it is of the projection of any Φ.
//!
//! **Stratified moments.** [`Cube::sample_source`] cuts a cell into boxes Y, halved as long as F − F' differs much
//! between their corners, as it does wherever a plane cuts them, and draws two points y₁, y₂ in every one that is left:
//!
//! ```text
//! F″_ia = F'_ia + Σ_Y |Y|/|X_i| · ½ Σ_k (F − F')(y_k) ψ_ia(y_k),
//! ```
//!
//! where F' is a polynomial near F. Boxes do not depend on draws, so F″ has the mean ΠF wherever they are. The differences
//! ½ ± |Y|/|X_i| Σ_k ±(F − F')(y_k) ψ_ia(y_k) with the signs of y₁ and y₂ opposite and one random sign for each box have the
//! covariance of F″: [`REPLICATES`] of them, with signs of their own, serve as Δ. At a jump boxes of side s
//! leave an error like s^((d+1)/2), of s^−(d−1) boxes: a thousandth part in three dimensions for a thousand of them.

use fredholm_core::array::from_fn;
use fredholm_core::rand_core::Rng;
use fredholm_core::{
    DefaultGenerator, Located, Neighbour, RngUniforms, StateSpace, Uniforms, WalkSeeds,
};

use crate::functions::values_at;
use crate::{CellFunctions, Cube, CubeError, CubeSetup, KernelFn, ScalarField};

/// The number of errors that [`Cube::sample_source`] draws beside the moments: their mean square is χ² distributed with so
/// many degrees of freedom, so an error bar is known to 18 %.
pub const REPLICATES: usize = 16;
/// The most times that a cell is halved: boxes of 2⁻⁴⁰ cells are smaller than what rounding leaves of a place.
const MOST_HALVES: u32 = 40;
/// How far inside a box its corners are looked at, as a part of its side: a jump beyond is of a small part of the box.
const INSIDE: f64 = 1.0 / 1024.0;
/// The stream of draws: walks of goals have others.
const STREAM: u64 = u64::MAX;

impl<const D: usize, K, S, const B: usize> Cube<f64, D, K, S, B>
where
    K: KernelFn<f64, D>,
    S: ScalarField<f64, D>,
{
    /// The length of what [`sample_source`](Self::sample_source) fills: (1 + [`REPLICATES`])·B + 1.
    pub const SAMPLE: usize = (1 + REPLICATES) * B + 1;

    /// Fills `out` with an unbiased estimate F″_ia of the means of F ψ_ia over cell `i`, with [`REPLICATES`] errors of its
    /// distribution, B numbers each, and with the number of boxes. `near` is F'_ia, and a box is halved as long as its share
    /// of the cell times the spread of F − F' in it is above `threshold`.
    ///
    /// ```
    /// use fredholm_cube::Cube;
    ///
    /// // F = [x < 0.3] has the mean 0.6 on the first of two cells.
    /// let nothing = |_: &[f64; 1], _: &[f64; 1]| 0.0;
    /// let step = |x: &[f64; 1]| f64::from(u8::from(x[0] < 0.3));
    /// let cube = Cube::<f64, 1, _, _>::new(nothing, step, 2, 0.5)?;
    /// let mut out = [0.0; 18];
    /// cube.sample_source(0, &[1.0], 1e-9, 1, &mut out)?;
    /// assert!((out[0] - 0.6).abs() < 1e-8 && out[1..17].iter().all(|error| error.abs() < 1e-8));
    /// # Ok::<(), fredholm_cube::CubeError>(())
    /// ```
    ///
    /// # Errors
    /// [`CubeError::Cell`]; [`CubeError::Length`] where `near` has not B numbers, or `out` not
    /// [`SAMPLE`](Self::SAMPLE); [`CubeError::Source`] where a value is not finite.
    pub fn sample_source(
        &self,
        i: usize,
        near: &[f64],
        threshold: f64,
        seed: u64,
        out: &mut [f64],
    ) -> Result<(), CubeError> {
        CubeSetup::new(self, CellFunctions::new::<B>()).sample_source(i, near, threshold, seed, out)
    }
}

impl<const D: usize> CubeSetup<'_, D> {
    /// The length of what [`sample_source`](Self::sample_source) fills: (1 + [`REPLICATES`])·B + 1.
    #[must_use]
    pub const fn sample_length(&self) -> usize {
        (1 + REPLICATES) * self.functions.count() + 1
    }

    /// Fills `out` with an unbiased estimate of the means of F ψ_ia over cell `i`, and errors of its distribution: see
    /// [`Cube::sample_source`].
    ///
    /// # Errors
    /// As [`Cube::sample_source`], and [`CubeError::Memory`].
    pub fn sample_source(
        &self,
        i: usize,
        near: &[f64],
        threshold: f64,
        seed: u64,
        out: &mut [f64],
    ) -> Result<(), CubeError> {
        for (expected, found) in [
            (self.functions.count(), near.len()),
            (self.sample_length(), out.len()),
        ] {
            if expected != found {
                return Err(CubeError::Length { expected, found });
            }
        }
        if i >= self.cells() {
            return Err(CubeError::Cell { cell: i });
        }
        out.fill(0.0);
        for (out, near) in out.iter_mut().zip(near) {
            *out = *near;
        }
        let seeds = WalkSeeds::<DefaultGenerator>::new(seed, STREAM);
        let mut strata = Strata {
            source: self.source,
            corner: self.mesh.places(i).map(f64::from),
            width: 1.0 / f64::from(self.mesh.per_axis()),
            degree: self.functions.degree,
            near,
            threshold,
            draws: RngUniforms(seeds.generator(i as u64)),
        };
        let [mut first, mut second] = [self.block()?, self.block()?];
        let whole = Place {
            low: [0.0; D],
            side: 1.0,
            halves: 0,
        };
        strata.visit(&whole, [&mut first, &mut second], out);
        if out.iter().all(|number| number.is_finite()) {
            Ok(())
        } else {
            Err(CubeError::Source { row: i })
        }
    }
}

/// The boxes of a cell. The dimension alone is a constant, so that it is compiled once for all degrees and sources.
struct Strata<'a, const D: usize> {
    source: &'a dyn ScalarField<f64, D>,
    /// The place of the cell along the axes, in cells.
    corner: [f64; D],
    width: f64,
    degree: usize,
    /// F'_ia.
    near: &'a [f64],
    threshold: f64,
    draws: RngUniforms<DefaultGenerator>,
}

impl<const D: usize> Strata<'_, D> {
    /// (F − F')(y) for y ∈ [0, 1]^D in the cell, and the ψ_ia(y).
    fn rest(&self, y: &[f64; D], psi: &mut [f64]) -> f64 {
        let x = from_fn(|a| (self.corner[a] + y[a]) * self.width);
        values_at(y.map(|y| 2.0 * y - 1.0), self.degree, psi);
        let near: f64 = self.near.iter().zip(&*psi).map(|(f, psi)| f * psi).sum();
        self.source.value(&x) - near
    }

    /// Adds a box, or its halves along all axes.
    fn visit(&mut self, place: &Place<D>, [first, second]: [&mut [f64]; 2], out: &mut [f64]) {
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for corner in 0..1 << D {
            let rest = self.rest(&place.corner(corner), first);
            (least, most) = (least.min(rest), most.max(rest));
            if let Some(boxes) = out.last_mut().filter(|_| !rest.is_finite()) {
                *boxes = f64::NAN;
            }
        }
        if place.share() * (most - least) > self.threshold && place.halves < MOST_HALVES {
            for half in 0..1 << D {
                self.visit(&place.half(half), [&mut *first, &mut *second], out);
            }
            return;
        }
        let weight = 0.5 * place.share();
        let rests = [&mut *first, &mut *second].map(|psi| {
            let y = place.at(from_fn(|_| self.draws.uniform()));
            weight * self.rest(&y, psi)
        });
        let signs = self.draws.0.next_u64();
        if let Some(boxes) = out.last_mut() {
            *boxes += 1.0;
        }
        for (b, (one, other)) in first.iter().zip(&*second).enumerate() {
            let [one, other] = [rests[0] * one, rests[1] * other];
            let mut numbers = out.iter_mut().skip(b).step_by(self.near.len());
            if let Some(mean) = numbers.next() {
                *mean += one + other;
            }
            for (number, error) in numbers.take(REPLICATES).enumerate() {
                let difference = one - other;
                *error += if signs >> number & 1 == 0 {
                    difference
                } else {
                    -difference
                };
            }
        }
    }
}

/// A box in a cell [0, 1]^D.
struct Place<const D: usize> {
    low: [f64; D],
    side: f64,
    /// How many times the cell is halved.
    halves: u32,
}

impl<const D: usize> Place<D> {
    /// The share of the cell.
    fn share(&self) -> f64 {
        (0..D).fold(1.0, |share, _| share * self.side)
    }

    /// The place at t ∈ [0, 1]^D of the box.
    fn at(&self, t: [f64; D]) -> [f64; D] {
        from_fn(|a| self.low[a] + self.side * t[a])
    }

    /// The corner of this number, from 0 to 2^D − 1, a little inside: a jump at the side of a box is not in it.
    fn corner(&self, number: usize) -> [f64; D] {
        let far = |a: usize| number >> a & 1 == 1;
        self.at(from_fn(|a| if far(a) { 1.0 - INSIDE } else { INSIDE }))
    }

    /// The part of this number, from 0 to 2^D − 1, if all sides are halved.
    fn half(&self, number: usize) -> Self {
        let side = 0.5 * self.side;
        let far = |a: usize| if number >> a & 1 == 0 { 0.0 } else { side };
        Self {
            low: from_fn(|a| self.low[a] + far(a)),
            side,
            halves: self.halves + 1,
        }
    }
}

/// The neighbour equation whose source is F itself, from one of w and R: v = F + w and G = F + R.
#[derive(Clone, Copy, Debug)]
pub struct ExactSource<'a, N: ?Sized, S> {
    /// The neighbour equation of w, with the source R.
    pub rest: &'a N,
    /// F.
    pub source: &'a S,
}

impl<N: StateSpace + ?Sized, S> StateSpace for ExactSource<'_, N, S> {
    type Scalar = N::Scalar;
    type Point = N::Point;
}

impl<F, N, S, const D: usize> Neighbour for ExactSource<'_, N, S>
where
    F: fredholm_core::Real,
    N: Neighbour<Scalar = F, Point = [F; D]> + ?Sized,
    S: ScalarField<F, D>,
{
    #[inline]
    fn locate(&self, x: [F; D]) -> Located<[F; D]> {
        self.rest.locate(x)
    }

    #[inline]
    fn kernel(&self, x: &Located<[F; D]>, y: &Located<[F; D]>, k: F) -> F {
        self.rest.kernel(x, y, k)
    }

    #[inline]
    fn source(&self, x: &Located<[F; D]>, draws: &mut dyn Uniforms<F>) -> F {
        self.source.value(&x.point) + self.rest.source(x, draws)
    }

    #[inline]
    fn value(&self, x: &Located<[F; D]>) -> F {
        self.source.value(&x.point) + self.rest.value(x)
    }
}

#[cfg(test)]
mod tests {
    use super::REPLICATES;
    use crate::Cube;

    /// F = [x + y < 0.7] on one cell with the functions 1, √3 (2y − 1), √3 (2x − 1): the integral over the triangle is
    /// 0.49/2, and that of x or y there is 0.343/6.
    #[test]
    fn moments_are_unbiased_and_their_errors_are_known() {
        const SEEDS: u64 = 64;
        let nothing = |_: &[f64; 2], _: &[f64; 2]| 0.0;
        let triangle = |x: &[f64; 2]| f64::from(u8::from(x[0] + x[1] < 0.7));
        let cube = Cube::<f64, 2, _, _>::new(nothing, triangle, 1, 0.5).unwrap();
        let cube = cube.with_functions::<3>();
        let linear = 3.0_f64.sqrt() * (2.0 * 0.343 / 6.0 - 0.245);
        let exact = [0.245, linear, linear];
        // Whatever is near, and for few boxes and many.
        for (near, threshold) in [([0.0; 3], 0.1), ([0.3, -0.2, 0.1], 1e-3)] {
            let (mut sums, mut squares, mut told) = ([0.0; 3], 0.0, 0.0);
            for seed in 0..SEEDS {
                let mut out = [0.0; 3 * (1 + REPLICATES) + 1];
                cube.sample_source(0, &near, threshold, seed, &mut out)
                    .unwrap();
                let errors = out.chunks_exact(3).skip(1).flatten();
                told += errors.map(|error| error * error).sum::<f64>();
                for ((sum, found), exact) in sums.iter_mut().zip(out).zip(exact) {
                    *sum += found - exact;
                    squares += (found - exact) * (found - exact);
                }
            }
            // The variances of three numbers are as many; each number's is at most all of them.
            let told = told / REPLICATES as f64;
            for sum in sums {
                assert!(sum.abs() < 4.5 * told.sqrt(), "{sum} {told}");
            }
            // 64 errors know the size of an error to 9 %, or 11 % with those that are told; the three are not independent.
            let ratio = (squares / told).sqrt();
            assert!((0.6..1.5).contains(&ratio), "{near:?}: {ratio}");
        }
    }

    #[test]
    fn boxes_are_finer_at_a_jump_and_what_is_wrong_is_refused() {
        let nothing = |_: &[f64; 1], _: &[f64; 1]| 0.0;
        let step = |x: &[f64; 1]| f64::from(u8::from(x[0] < 0.3));
        let cube = Cube::<f64, 1, _, _>::new(nothing, step, 1, 0.5).unwrap();
        let mut out = [0.0; REPLICATES + 2];
        cube.sample_source(0, &[0.0], 1e-9, 1, &mut out).unwrap();
        // Halved thirty times, where the jump is; what is left of the errors is that box.
        assert_eq!(out[REPLICATES + 1], 31.0);
        assert!((out[0] - 0.3).abs() < 1e-9);
        assert!(cube.sample_source(1, &[0.0], 0.1, 1, &mut out).is_err());
        assert!(cube.sample_source(0, &[], 0.1, 1, &mut out).is_err());
        assert!(cube.sample_source(0, &[0.0], 0.1, 1, &mut [0.0]).is_err());
        let nan = |x: &[f64; 1]| (x[0] - 0.5).sqrt();
        let cube = Cube::<f64, 1, _, _>::new(nothing, nan, 1, 0.5).unwrap();
        assert!(cube.sample_source(0, &[0.0], 0.1, 1, &mut out).is_err());
    }
}
