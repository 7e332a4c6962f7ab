//! Randomised quasi-Monte Carlo: Sobol' points for the first numbers that walks draw.

use core::convert::Infallible;
use core::iter::Zip;
use core::slice::Iter;

#[cfg(feature = "alloc")]
use rand_core::SeedableRng;
use rand_core::{Rng, TryRng};

#[cfg(feature = "alloc")]
use crate::galerkin::MOST_DIMENSIONS;
use crate::{DefaultGenerator, Generators, WalkNumber, WalkSeeds};

/// The number of draws of a walk that are coordinates of a Sobol' point; what it draws after them is pseudo-random.
pub const SOBOL_COORDINATES: usize = 32;

/// Bits of a coordinate that are Sobol's; those below are pseudo-random.
const BITS: usize = 32;

/// The numbers that walks draw, chosen at run time: independent ones or, for the walks of a replicate, points of one Sobol' sequence that is
/// randomised for the replicate, randomised quasi-Monte Carlo (Owen 1997).
///
/// Walk i of a replicate draws the coordinates of point i, one after the other, of a Sobol' sequence with the direction
/// numbers of Joe and Kuo (2008). Its first [`SOBOL_COORDINATES`] draws have their first 32 bits from it; all other bits are
/// those of the [`DefaultGenerator`]. Every coordinate is scrambled by a hash with the seed of (run, goal, replicate, coordinate): the hash of Laine and
/// Karras (2011) of the reversed bits, a nested uniform scrambling to good approximation (Burley 2020). It adds the seed, which is
/// uniform, and is a bijection after that, so that the numbers of any one walk are independent and uniform, and estimates
/// are unbiased. Walks of one replicate depend on each other: error bars come from replicates.
///
/// A [`Batch`](crate::Batch) is a replicate, and the [`Statistics`](crate::Statistics) of its walks count as one sample. The
/// replicates of a global estimate are its [`Replicate`](crate::global::Replicate)s. A replicate with a power of 2 of walks
/// has points that are spread most evenly; 2³² walks are most: further ones begin another randomisation.
///
/// ```
/// use fredholm_core::{Generators, Sequence, WalkNumber, WalkSeeds};
/// use rand_core::Rng;
///
/// // Of 16 walks the first numbers are in different sixteenths of [0, 1).
/// let seeds = <WalkSeeds>::new(1, 0);
/// let mut memory = Default::default();
/// let mut found = [false; 16];
/// for walk in 0..16 {
///     let number = WalkNumber { walk, replicate: 0, index: walk };
///     let mut generator = Sequence::Sobol.generator(&seeds, number, &mut memory);
///     found[(generator.next_u64() >> 60) as usize] = true;
/// }
/// assert_eq!(found, [true; 16]);
/// ```
///
/// A. B. Owen, *Monte Carlo variance of scrambled net quadrature*, SIAM J. Numer. Anal. 34, 1997. S. Joe and F. Y. Kuo,
/// *Constructing Sobol sequences with better two-dimensional projections*, SIAM J. Sci. Comput. 30, 2008. S. Laine and T.
/// Karras, *Stratified sampling for stochastic transparency*, Computer Graphics Forum 30, 2011. B. Burley, *Practical
/// hash-based Owen scrambling*, J. Computer Graphics Techniques 9, 2020.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sequence {
    /// Pseudo-random numbers: walks do not depend on each other.
    Random,
    /// Scrambled Sobol' points, a randomisation for each batch.
    Sobol,
}

/// The point of the last walk, from which that of the next one follows by one addition modulo 2, and the seeds of its
/// replicate.
#[derive(Clone, Debug, Default)]
pub struct SobolPoint {
    /// Whose point it is: replicate, and index.
    of: Option<[u64; 2]>,
    /// Bits from the lowest on: 2⁻¹ is bit 0.
    coordinates: [u32; SOBOL_COORDINATES],
    seeds: [u32; SOBOL_COORDINATES],
}

impl SobolPoint {
    /// Goes to the point of a walk.
    #[inline]
    fn go_to(&mut self, seeds: &WalkSeeds, walk: WalkNumber) {
        // A replicate of a replicate, from 2³² walks on.
        let (part, index) = (walk.index >> BITS, walk.index & u64::from(u32::MAX));
        let replicate = walk.replicate.wrapping_add(part << BITS);
        let next = [replicate, index.wrapping_sub(1)];
        if index > 0 && self.of == Some(next) {
            // Of i − 1 and i the bits below and at the lowest one of i differ.
            self.add(index.trailing_zeros());
        } else {
            self.coordinates = [0; SOBOL_COORDINATES];
            let mut rest = index ^ (index >> 1);
            while rest != 0 {
                self.add(rest.trailing_zeros());
                rest &= rest - 1;
            }
            for (c, seed) in self.seeds.iter_mut().enumerate() {
                *seed = (seeds.word(replicate, c as u64) >> 32) as u32;
            }
        }
        self.of = Some([replicate, index]);
    }

    /// Adds Σ_{b ≤ bit} of the direction numbers of every coordinate, modulo 2.
    #[inline]
    fn add(&mut self, bit: u32) {
        if let Some(steps) = STEPS.get(bit as usize) {
            for (coordinate, step) in self.coordinates.iter_mut().zip(steps) {
                *coordinate ^= step;
            }
        }
    }
}

/// The generator of one walk: words whose first 32 bits are coordinates, as long as there are some, and then those of G.
#[derive(Debug)]
pub struct SobolWalk<'m, G> {
    /// The coordinates that have not been drawn yet, and their seeds.
    left: Zip<Iter<'m, u32>, Iter<'m, u32>>,
    rest: G,
}

impl<G: Rng> TryRng for SobolWalk<'_, G> {
    type Error = Infallible;

    #[inline]
    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        let word = self.rest.next_u64();
        Ok(match self.left.next() {
            Some((&coordinate, &seed)) => u64::from(scrambled(coordinate, seed)) << 32 | word >> 32,
            None => word,
        })
    }

    #[inline]
    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        self.try_next_u64().map(|word| (word >> 32) as u32)
    }

    fn try_fill_bytes(&mut self, to: &mut [u8]) -> Result<(), Infallible> {
        for bytes in to.chunks_mut(8) {
            let word = self.try_next_u64()?;
            for (to, from) in bytes.iter_mut().zip(word.to_le_bytes()) {
                *to = from;
            }
        }
        Ok(())
    }
}

/// Laine and Karras' hash of a coordinate, whose bits are reversed before and after it: a bit depends on higher ones alone.
#[inline]
const fn scrambled(reversed: u32, seed: u32) -> u32 {
    let mut x = reversed.wrapping_add(seed);
    x ^= x.wrapping_mul(0x6c50_b47c);
    x ^= x.wrapping_mul(0xb82f_1e52);
    x ^= x.wrapping_mul(0xc7af_e638);
    x ^= x.wrapping_mul(0x8d22_f6e6);
    x.reverse_bits()
}

impl Generators for Sequence {
    type Random = DefaultGenerator;
    type Generator<'m> = SobolWalk<'m, DefaultGenerator>;
    type Memory = SobolPoint;
    const ONE_LOOP_PER_END: bool = false;

    #[inline(always)]
    fn is_sequence(self) -> bool {
        self == Self::Sobol
    }

    #[inline]
    fn generator<'m>(
        self,
        seeds: &WalkSeeds,
        walk: WalkNumber,
        memory: &'m mut SobolPoint,
    ) -> SobolWalk<'m, DefaultGenerator> {
        let coordinates: &[u32] = match self {
            Self::Random => &[],
            Self::Sobol => {
                memory.go_to(seeds, walk);
                &memory.coordinates
            }
        };
        SobolWalk {
            left: coordinates.iter().zip(&memory.seeds),
            rest: seeds.generator(walk.walk),
        }
    }
}

/// The most coordinates of a [`Net`].
#[cfg(feature = "alloc")]
pub(crate) const NET_COORDINATES: usize = 2 * MOST_DIMENSIONS + 1;

/// The first points of a Sobol' sequence of few coordinates in one randomisation, one after the other: at most 2³².
#[cfg(feature = "alloc")]
#[derive(Clone, Debug)]
pub(crate) struct Net<G = DefaultGenerator> {
    draws: WalkSeeds<G>,
    /// The number of the randomisation.
    unit: u64,
    index: u64,
    used: usize,
    coordinates: [u32; NET_COORDINATES],
    seeds: [u32; NET_COORDINATES],
}

#[cfg(feature = "alloc")]
impl<G: Rng + SeedableRng> Net<G> {
    /// The points of so many coordinates.
    pub(crate) fn new(draws: &WalkSeeds<G>, unit: u64, coordinates: usize) -> Self {
        let mut seeds = [0; NET_COORDINATES];
        for (c, seed) in (0..).zip(seeds.iter_mut().take(coordinates)) {
            *seed = (draws.word(unit, c) >> 32) as u32;
        }
        Self {
            draws: *draws,
            unit,
            index: 0,
            used: coordinates.min(NET_COORDINATES),
            coordinates: [0; NET_COORDINATES],
            seeds,
        }
    }

    /// The draws of the next point: its coordinates, and pseudo-random numbers after them.
    #[inline]
    pub(crate) fn next(&mut self) -> SobolWalk<'_, G> {
        let index = self.index;
        if let Some(steps) = STEPS.get(index.trailing_zeros() as usize) {
            for (coordinate, step) in self.coordinates.iter_mut().zip(steps) {
                *coordinate ^= step;
            }
        }
        self.index += 1;
        let coordinates = self.coordinates.get(..self.used).unwrap_or(&[]);
        SobolWalk {
            left: coordinates.iter().zip(&self.seeds),
            rest: self.draws.generator((self.unit << BITS) | index),
        }
    }
}

/// A primitive polynomial of Joe and Kuo's table, and the first direction numbers.
struct Coordinate {
    /// The coefficients between the first and the last, which are 1, as bits.
    a: u32,
    /// m_1, m_2, …, as many as the polynomial's degree; 0 behind them.
    m: [u32; 7],
}

const fn of(a: u32, m: [u32; 7]) -> Coordinate {
    Coordinate { a, m }
}

/// Coordinates 2 to 32 of `new-joe-kuo-6`, S. Joe and F. Y. Kuo 2008.
const COORDINATES: [Coordinate; SOBOL_COORDINATES - 1] = [
    of(0, [1, 0, 0, 0, 0, 0, 0]),
    of(1, [1, 3, 0, 0, 0, 0, 0]),
    of(1, [1, 3, 1, 0, 0, 0, 0]),
    of(2, [1, 1, 1, 0, 0, 0, 0]),
    of(1, [1, 1, 3, 3, 0, 0, 0]),
    of(4, [1, 3, 5, 13, 0, 0, 0]),
    of(2, [1, 1, 5, 5, 17, 0, 0]),
    of(4, [1, 1, 5, 5, 5, 0, 0]),
    of(7, [1, 1, 7, 11, 19, 0, 0]),
    of(11, [1, 1, 5, 1, 1, 0, 0]),
    of(13, [1, 1, 1, 3, 11, 0, 0]),
    of(14, [1, 3, 5, 5, 31, 0, 0]),
    of(1, [1, 3, 3, 9, 7, 49, 0]),
    of(13, [1, 1, 1, 15, 21, 21, 0]),
    of(16, [1, 3, 1, 13, 27, 49, 0]),
    of(19, [1, 1, 1, 15, 7, 5, 0]),
    of(22, [1, 3, 1, 15, 13, 25, 0]),
    of(25, [1, 1, 5, 5, 19, 61, 0]),
    of(1, [1, 3, 7, 11, 23, 15, 103]),
    of(4, [1, 3, 7, 13, 13, 15, 69]),
    of(7, [1, 1, 3, 13, 7, 35, 63]),
    of(8, [1, 3, 5, 9, 1, 25, 53]),
    of(14, [1, 3, 1, 13, 9, 35, 107]),
    of(19, [1, 3, 1, 5, 27, 61, 31]),
    of(21, [1, 1, 5, 11, 19, 41, 61]),
    of(28, [1, 3, 5, 3, 3, 13, 69]),
    of(31, [1, 1, 7, 13, 1, 19, 1]),
    of(32, [1, 3, 7, 5, 13, 19, 59]),
    of(37, [1, 1, 3, 9, 25, 29, 41]),
    of(41, [1, 3, 5, 13, 23, 1, 55]),
    of(42, [1, 3, 7, 3, 13, 59, 17]),
];

/// For every bit b, and coordinate, the sum modulo 2 of the direction numbers of the bits up to b, with their bits reversed.
static STEPS: [[u32; SOBOL_COORDINATES]; BITS] = steps();

// A panic here would be one of the compiler.
#[allow(clippy::indexing_slicing)]
const fn steps() -> [[u32; SOBOL_COORDINATES]; BITS] {
    let mut steps = [[0; SOBOL_COORDINATES]; BITS];
    let mut c = 0;
    while c < SOBOL_COORDINATES {
        let directions = directions(c);
        let mut sum = 0;
        let mut bit = 0;
        while bit < BITS {
            sum ^= directions[bit].reverse_bits();
            steps[bit][c] = sum;
            bit += 1;
        }
        c += 1;
    }
    steps
}

/// m_b 2^(31 − b) of a coordinate: by the polynomial's recurrence, and of the first one m_b = 1.
#[allow(clippy::indexing_slicing)]
const fn directions(coordinate: usize) -> [u32; BITS] {
    let mut v = [0; BITS];
    let mut degree = 0;
    let mut bit = 0;
    while bit < BITS {
        if coordinate == 0 {
            v[bit] = 1 << (BITS - 1 - bit);
        } else {
            let Coordinate { a, m } = &COORDINATES[coordinate - 1];
            if bit < m.len() && m[bit] != 0 {
                v[bit] = m[bit] << (BITS - 1 - bit);
                degree = bit + 1;
            } else {
                v[bit] = v[bit - degree] ^ (v[bit - degree] >> degree);
                let mut k = 1;
                while k < degree {
                    if *a >> (degree - 1 - k) & 1 == 1 {
                        v[bit] ^= v[bit - k];
                    }
                    k += 1;
                }
            }
        }
        bit += 1;
    }
    v
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use rand_core::Rng;

    use super::{SOBOL_COORDINATES, STEPS, Sequence, SobolPoint};
    use crate::{Generators, WalkNumber, WalkSeeds};

    fn number(replicate: u64, index: u64) -> WalkNumber {
        WalkNumber {
            walk: replicate * 1000 + index,
            replicate,
            index,
        }
    }

    /// Coordinates 1, 2, 3, 8 and 32 of points 1 to 8 and 12,345, computed by another program from the table of Joe and Kuo.
    #[test]
    fn points_are_those_of_joe_and_kuo() {
        let mut point = SobolPoint::default();
        for (index, expected) in POINTS {
            point.go_to(&WalkSeeds::new(1, 0), number(0, index));
            let found = [0, 1, 2, 7, 31].map(|c: usize| point.coordinates[c].reverse_bits());
            assert_eq!(found, expected.map(|half| half << 16), "point {index}");
        }
    }

    /// The upper halves, of which the lower ones are 0, by `scipy.stats.qmc.Sobol(32, scramble=False, bits=32)` of SciPy 1.17.1, in plain
    /// order.
    const POINTS: [(u64, [u32; 5]); 9] = [
        (1, [0x8000, 0x8000, 0x8000, 0x8000, 0x8000]),
        (2, [0x4000, 0xc000, 0xc000, 0x4000, 0xc000]),
        (3, [0xc000, 0x4000, 0x4000, 0xc000, 0x4000]),
        (4, [0x2000, 0xa000, 0x6000, 0xa000, 0xe000]),
        (5, [0xa000, 0x2000, 0xe000, 0x2000, 0x6000]),
        (6, [0x6000, 0x6000, 0xa000, 0xe000, 0x2000]),
        (7, [0xe000, 0xe000, 0x2000, 0x6000, 0xa000]),
        (8, [0x1000, 0xf000, 0x9000, 0x5000, 0x3000]),
        (12_345, [0x9c0c, 0x7044, 0xe4f4, 0xb33c, 0x4ae4]),
    ];

    /// One step at a time or at once, and in any order.
    #[test]
    fn a_walk_depends_on_its_number_alone() {
        let seeds = WalkSeeds::new(3, 5);
        let words = |number, memory: &mut SobolPoint| {
            let mut generator = Sequence::Sobol.generator(&seeds, number, memory);
            core::array::from_fn::<u64, 40, _>(|_| generator.next_u64())
        };
        let mut memory = SobolPoint::default();
        let mut all = Vec::new();
        for replicate in 0..2 {
            for index in 0..300 {
                let number = number(replicate, index);
                let found = words(number, &mut memory);
                assert_eq!(
                    found,
                    words(number, &mut SobolPoint::default()),
                    "{number:?}"
                );
                all.push(found);
            }
        }
        // Coordinates and what follows them differ between replicates.
        for (one, other) in all[0].iter().zip(&all[300]) {
            assert_ne!(one, other);
        }
        // Behind the last coordinate they are those of the plain generator.
        let mut plain = WalkSeeds::<crate::DefaultGenerator>::new(3, 5).generator(7);
        let words: [u64; 40] = core::array::from_fn(|_| plain.next_u64());
        assert_eq!(all[7][SOBOL_COORDINATES..], words[SOBOL_COORDINATES..]);
    }

    /// Every two coordinates of 2¹⁰ scrambled points have one in each of 2¹⁰ rectangles, as far as the sequence's t
    /// allows: coordinates 1 and 2 in all rectangles of that size.
    #[test]
    fn scrambled_points_stay_spread() {
        let seeds = WalkSeeds::new(9, 0);
        let mut memory = SobolPoint::default();
        let points: Vec<[u64; 2]> = (0..1024)
            .map(|index| {
                let mut generator =
                    Sequence::Sobol.generator(&seeds, number(4, index), &mut memory);
                core::array::from_fn(|_| generator.next_u64())
            })
            .collect();
        for bits in 0..=10 {
            let mut found = [false; 1024];
            for [x, y] in &points {
                let (x, y) = (x >> 32 >> (32 - bits), y >> 32 >> (22 + bits));
                found[(x << (10 - bits) | y) as usize] = true;
            }
            assert!(found.iter().all(|found| *found), "{bits} bits");
        }
    }

    /// Direction numbers have their own bit, and none of lower weight: every coordinate by itself is a permutation.
    #[test]
    fn directions_are_triangular() {
        for c in 0..SOBOL_COORDINATES {
            let mut before = 0;
            for (bit, steps) in STEPS.iter().enumerate() {
                let direction = steps[c] ^ before;
                assert_eq!(
                    32 - direction.leading_zeros() as usize,
                    bit + 1,
                    "coordinate {c}"
                );
                before = steps[c];
            }
        }
    }
}
