//! Uniform numbers, and which walk they belong to.

use core::marker::PhantomData;

use rand_core::{Rng, SeedableRng};

use crate::Real;

/// A source of uniform numbers in [0, 1).
///
/// A step of a walk is a pure function of its state and of the numbers drawn here, so a chain
/// is tested with numbers of one's own choice, and a quasi-random sequence can take the place of
/// a generator.
///
/// ```
/// use fredholm_core::{Real, RngUniforms, Uniforms};
///
/// struct Constant;
/// impl<F: Real> Uniforms<F> for Constant {
///     fn uniform(&mut self) -> F {
///         F::from_f64(0.25)
///     }
/// }
/// let x: f64 = Constant.uniform();
/// assert_eq!(x, 0.25);
/// ```
pub trait Uniforms<F> {
    /// The next number in [0, 1).
    fn uniform(&mut self) -> F;
}

impl<F, U: Uniforms<F> + ?Sized> Uniforms<F> for &mut U {
    #[inline]
    fn uniform(&mut self) -> F {
        (**self).uniform()
    }
}

/// Uniform numbers from a generator of `rand_core`, one 64-bit word each for `f32` and `f64`.
#[derive(Clone, Debug)]
pub struct RngUniforms<G>(pub G);

impl<F: Real, G: Rng> Uniforms<F> for RngUniforms<G> {
    #[inline]
    fn uniform(&mut self) -> F {
        F::unit_from_bits(self.0.next_u64())
    }
}

/// The generator that every runner uses unless told otherwise: PCG XSL RR 128/64 (MCG), O'Neill
/// 2014, whose state of 126 bits is filled by the hash of [`WalkSeeds`].
pub type DefaultGenerator = rand_pcg::Pcg64Mcg;

/// The name of [`DefaultGenerator`] in outputs.
pub const DEFAULT_GENERATOR: &str = "pcg64mcg";

/// The draws of one goal: from the seed of the run and the number of the goal follows the
/// generator of every walk.
///
/// Draws belong to the walk. Walk w of goal g draws from a generator that is seeded with a hash
/// of (seed, g, w), and from no other, so that
///
/// - any walk can be replayed alone,
/// - batches may have any size and be run in any order or place without changing a bit.
///
/// The hash is the SplitMix64 sequence (Steele, Lea, Flood 2014) started at a mix of the three.
/// Two walks of one goal never start from the same first word, as the mix is a bijection of the
/// walk's number.
///
/// ```
/// use fredholm_core::{DefaultGenerator, WalkSeeds};
/// use rand_core::Rng;
///
/// let seeds = WalkSeeds::<DefaultGenerator>::new(1, 0);
/// assert_eq!(seeds.generator(7).next_u64(), seeds.generator(7).next_u64());
/// assert_ne!(seeds.generator(7).next_u64(), seeds.generator(8).next_u64());
/// ```
#[derive(Debug, PartialEq, Eq)]
pub struct WalkSeeds<G = DefaultGenerator> {
    key: u64,
    salt: u64,
    generator: PhantomData<fn() -> G>,
}

// By hand: a derive would ask the generator to be `Clone` and `Copy`.
impl<G> Clone for WalkSeeds<G> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<G> Copy for WalkSeeds<G> {}

/// The golden ratio's fraction times 2⁶⁴, made odd: SplitMix64's increment.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Stafford's variant 13 of the 64-bit finalizer of MurmurHash3, as in SplitMix64: a bijection
/// that changes every output bit with probability close to ½ when one input bit changes.
#[inline]
const fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl<G> WalkSeeds<G> {
    /// The draws of goal number `goal` in a run with this `seed`.
    #[must_use]
    pub const fn new(seed: u64, goal: u64) -> Self {
        let key = mix(mix(seed.wrapping_add(GOLDEN)) ^ goal.wrapping_mul(GOLDEN));
        Self {
            key,
            salt: mix(key ^ seed) ^ mix(goal),
            generator: PhantomData,
        }
    }
}

impl<G> WalkSeeds<G> {
    /// A word for a place of a replicate, which no walk's generator is seeded with.
    #[inline]
    pub(crate) const fn word(&self, replicate: u64, place: u64) -> u64 {
        let start = mix(self.salt ^ mix(self.key.wrapping_add(replicate.wrapping_mul(GOLDEN))));
        mix(start.wrapping_add((place + 1).wrapping_mul(GOLDEN)))
    }

    /// The draws of the neighbour equation on the walks of these: independent of those of the walks, which are the same
    /// whatever a neighbour equation draws.
    #[must_use]
    pub const fn of_control(&self) -> Self {
        Self {
            key: mix(self.key ^ GOLDEN),
            salt: mix(self.salt.wrapping_add(GOLDEN)),
            generator: PhantomData,
        }
    }
}

/// The number of a walk, and its place among those that depend on each other if walks do: in batches, or in the replicates of
/// a global estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WalkNumber {
    /// The number of the walk, among all walks of its goal.
    pub walk: u64,
    /// The number of its replicate: that of the first walk of its batch, or a number from 0.
    pub replicate: u64,
    /// Place of the walk in the replicate, from 0.
    pub index: u64,
}

/// Generators of the numbers that walks draw, one for every walk, by which walks may depend on those of the same replicate:
/// [`Independent`], or a [`Sequence`](crate::Sequence).
pub trait Generators: Copy + Sync {
    /// The generator of pseudo-random numbers behind it.
    type Random: Rng + SeedableRng;
    /// The generator of one walk.
    type Generator<'m>: Rng;
    /// What is kept from walk to walk so that the next one takes less time. No walk depends on it.
    type Memory: Default;
    /// Whether each way in which walks may end has a loop over walks of its own. The cheapest walks need a twentieth fewer instructions
    /// there, and the compiler longer.
    const ONE_LOOP_PER_END: bool;

    /// Whether walks of a replicate depend on each other, so that error bars come from replicates.
    fn is_sequence(self) -> bool;

    /// The generator of a walk.
    fn generator<'m>(
        self,
        seeds: &WalkSeeds<Self::Random>,
        walk: WalkNumber,
        memory: &'m mut Self::Memory,
    ) -> Self::Generator<'m>;
}

/// Generators of independent walks: those of a generator of `rand_core` that can be seeded.
///
/// ```
/// use fredholm_core::rand_core::Rng;
/// use fredholm_core::{Generators, Independent, WalkNumber, WalkSeeds};
///
/// let seeds = <WalkSeeds>::new(1, 0);
/// let number = WalkNumber { walk: 7, replicate: 0, index: 7 };
/// let mut generator = <Independent>::NEW.generator(&seeds, number, &mut ());
/// assert_eq!(generator.next_u64(), seeds.generator(7).next_u64());
/// ```
#[derive(Debug)]
pub struct Independent<G = DefaultGenerator>(PhantomData<fn() -> G>);

impl<G> Independent<G> {
    /// Generators of this type.
    pub const NEW: Self = Self(PhantomData);
}

// By hand: a derive would ask the generator to be `Clone` and `Copy`.
impl<G> Clone for Independent<G> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<G> Copy for Independent<G> {}

impl<G: Rng + SeedableRng> Generators for Independent<G> {
    type Random = G;
    type Generator<'m> = G;
    type Memory = ();
    const ONE_LOOP_PER_END: bool = true;

    #[inline(always)]
    fn is_sequence(self) -> bool {
        false
    }

    #[inline(always)]
    fn generator(self, seeds: &WalkSeeds<G>, walk: WalkNumber, (): &mut ()) -> G {
        seeds.generator(walk.walk)
    }
}

/// The draws of the neighbour equation on one walk, seeded when the first is asked for: most neighbour equations ask for
/// none.
#[derive(Clone, Debug)]
pub(crate) struct ControlDraws<G> {
    seeds: WalkSeeds<G>,
    walk: u64,
    draws: Option<RngUniforms<G>>,
}

impl<G> ControlDraws<G> {
    #[inline]
    pub(crate) const fn new(seeds: &WalkSeeds<G>, walk: u64) -> Self {
        Self {
            seeds: *seeds,
            walk,
            draws: None,
        }
    }
}

impl<F: Real, G: Rng + SeedableRng> Uniforms<F> for ControlDraws<G> {
    #[inline]
    fn uniform(&mut self) -> F {
        let (seeds, walk) = (self.seeds, self.walk);
        self.draws
            .get_or_insert_with(|| RngUniforms(seeds.of_control().generator(walk)))
            .uniform()
    }
}

impl<G: SeedableRng> WalkSeeds<G> {
    /// The generator of walk number `walk`.
    #[inline]
    #[must_use]
    pub fn generator(&self, walk: u64) -> G {
        let mut seed = G::Seed::default();
        let mut word = mix(self.key.wrapping_add(walk.wrapping_mul(GOLDEN)));
        let mut salt = self.salt;
        for bytes in seed.as_mut().chunks_mut(8) {
            for (to, from) in bytes.iter_mut().zip(word.to_le_bytes()) {
                *to = from;
            }
            salt = salt.wrapping_add(GOLDEN);
            word = mix(word ^ salt);
        }
        G::from_seed(seed)
    }
}

#[cfg(test)]
mod tests {
    use super::{DefaultGenerator, RngUniforms, Uniforms, WalkSeeds};
    use rand_core::Rng;

    /// Results are a promise: a change of these words changes every published number.
    #[test]
    fn first_words_of_a_walk_never_change() {
        let words = |seed, goal, walk| {
            let mut g = WalkSeeds::<DefaultGenerator>::new(seed, goal).generator(walk);
            [g.next_u64(), g.next_u64()]
        };
        assert_eq!(words(1, 0, 0), WORDS[0]);
        assert_eq!(words(1, 0, 1), WORDS[1]);
        assert_eq!(words(1, 1, 0), WORDS[2]);
        assert_eq!(words(2, 0, u64::MAX), WORDS[3]);
    }

    /// Computed independently, with integers of arbitrary length.
    const WORDS: [[u64; 2]; 4] = [
        [0xd870_299c_7023_f3c2, 0x09c7_5dc3_d97a_b623],
        [0x56dd_fe09_3f11_a696, 0x251b_9ee5_9cdc_3f73],
        [0xe445_ccab_2777_1762, 0x2dd4_e292_5307_558e],
        [0x9dfa_7c18_3678_c7a5, 0x8673_b8b0_e5c1_c548],
    ];

    /// Neighbouring walks, goals and seeds must be as good as independent: the products of
    /// their centred first draws have mean 0 and variance 1/144.
    #[test]
    fn neighbouring_streams_are_uncorrelated() {
        let draw = |seed, goal, walk| -> f64 {
            let uniform: f64 =
                RngUniforms(WalkSeeds::<DefaultGenerator>::new(seed, goal).generator(walk))
                    .uniform();
            uniform - 0.5
        };
        let n = 200_000_u32;
        let mut sums = [0.0; 4];
        for walk in 0..u64::from(n) {
            let x = draw(1, 0, walk);
            sums[0] += x;
            sums[1] += x * draw(1, 0, walk + 1);
            sums[2] += x * draw(1, 1, walk);
            sums[3] += x * draw(2, 0, walk);
        }
        // Four standard deviations each; the mean's is (12 n)^-1/2, the products' (144 n)^-1/2.
        let n = f64::from(n);
        assert!(sums[0].abs() < 4.0 * (n / 12.0).sqrt());
        for sum in &sums[1..] {
            assert!(sum.abs() < 4.0 * n.sqrt() / 12.0, "{sums:?}");
        }
    }
}
