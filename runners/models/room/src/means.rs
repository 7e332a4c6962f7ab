//! Means over the walls of several surfaces.

use core::ops::Range;

use fredholm_core::{Equation, Functional, Real, StartOf, Uniforms};
use fredholm_room::{MeanOver, Point, Room};

use fredholm_model::Error;

/// The mean of u over ranges of walls, weighted by length.
#[derive(Clone, Debug)]
pub(crate) struct Means<'r, 'a, F, C> {
    /// The mean over each, and the share of the length of this and all before.
    ranges: Vec<(MeanOver<'r, 'a, F, C>, f64)>,
}

impl<'r, 'a, F: Real, C> Means<'r, 'a, F, C> {
    /// Over these walls.
    pub(crate) fn new(room: &'r Room<'a, F, C>, walls: Vec<Range<usize>>) -> Result<Self, Error> {
        let length = |walls: &Range<usize>| -> f64 {
            let own = room.geometry().walls().get(walls.clone());
            let own = own.unwrap_or_default().iter();
            own.map(|wall| wall.length.to_f64()).sum()
        };
        let all: f64 = walls.iter().map(length).sum();
        let (mut sum, mut ranges) = (0.0, Vec::new());
        for walls in walls {
            sum += length(&walls) / all;
            ranges.push((MeanOver::new(room, walls)?, sum));
        }
        Ok(Self { ranges })
    }

    /// (v, Φ), exact up to rounding.
    pub(crate) fn of(&self, v: &[F]) -> f64 {
        if let [(mean, _)] = self.ranges.as_slice() {
            return mean.of(v);
        }
        let mut before = 0.0;
        let term = |(mean, sum): &(MeanOver<'r, 'a, F, C>, f64)| {
            let share = sum - before;
            before = *sum;
            share * mean.of(v)
        };
        self.ranges.iter().map(term).sum()
    }
}

impl<F: Real, C, E: Equation<Scalar = F, Point = Point<F>>> Functional<E> for Means<'_, '_, F, C> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, equation: &E, uniforms: &mut U) -> StartOf<E> {
        // Of one surface without a draw that chooses it.
        let mean = match self.ranges.as_slice() {
            [(mean, _)] => mean,
            ranges => {
                let xi: F = uniforms.uniform();
                let chosen = ranges.partition_point(|(_, sum)| *sum <= xi.to_f64());
                &ranges[chosen.min(ranges.len() - 1)].0
            }
        };
        mean.start(equation, uniforms)
    }
}
