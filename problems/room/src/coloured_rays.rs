//! Neighbour equations with h = k of several channels, whose G take one ray together.

use fredholm_core::channels::ChannelNeighbours;
use fredholm_core::galerkin::{Basis, Partition};
use fredholm_core::{Located, Real, StateSpace, Uniforms};
use num_traits::{one, zero};

use crate::rays::{PLACES, PRODUCTS, RayControl, TERMS, View, between, products};
use crate::{ColouredRoom, Point, PolynomialRoom, RoomError};

/// The tables of the control variates of a [`ColouredRays`], borrowed.
///
/// Of every stretch, interval or box there are numbers for functions, and for the first of these a number for each channel, then for the
/// next.
#[derive(Clone, Copy, Debug)]
pub struct ChannelControl<'a, F> {
    /// The stretches, intervals and boxes of all channels, with no c of their own, and what boxes are drawn by.
    pub rays: RayControl<'a, F>,
    /// The sums of [integrals](crate::Interval::integral) of every stretch, as in [`Stretch::integral`](crate::Stretch::integral).
    pub integrals: &'a [F],
    /// The [means](crate::Interval::mean) of every interval.
    pub means: &'a [F],
    /// The [integrals](crate::Interval::integral) of every interval.
    pub of_intervals: &'a [F],
    /// The [c](crate::RayBox::control) of every box.
    pub controls: &'a [F],
}

/// The neighbour equations v_c = T_Kc v_c + G_c of any v_c in a room in several channels, with unbiased estimates of all G_c from
/// **one** ray: [`RayNeighbour`](crate::RayNeighbour) for each, with the same stretches, intervals and boxes.
///
/// Boxes are drawn by the largest of the shares that the channels would give them, each relative to what its own v_c lacks, so that
/// the ray of no channel weighs more than with its own. The tables come from a [`ChannelRaySetup`](crate::ChannelRaySetup), with an
/// example.
#[derive(Clone, Copy, Debug)]
pub struct ColouredRays<'n, 'r, 'a, F, const B: usize> {
    coloured: &'n ColouredRoom<'r, 'a, F>,
    polynomials: PolynomialRoom<'r, 'a, F, B>,
    v: &'n [F],
    control: ChannelControl<'n, F>,
}

impl<'n, 'r, 'a, F: Real, const B: usize> ColouredRays<'n, 'r, 'a, F, B> {
    /// The neighbour equations of v, which has for every cell, and there for every channel, B numbers.
    ///
    /// # Errors
    /// [`RoomError::Length`]: v or a table has another length. [`RoomError::Tables`], as
    /// [`RayNeighbour::new`](crate::RayNeighbour::new).
    pub fn new(
        coloured: &'n ColouredRoom<'r, 'a, F>,
        v: &'n [F],
        control: ChannelControl<'n, F>,
    ) -> Result<Self, RoomError> {
        let polynomials = coloured.room().with_functions::<B>();
        let (cells, channels) = (polynomials.cells(), coloured.colours().channels());
        let rays = &control.rays;
        rays.check(cells)?;
        let stretches = rays.stretches.len().saturating_sub(1);
        for (expected, found) in [
            (cells * B, v.len()),
            (stretches * PLACES, control.integrals.len()),
            (rays.intervals.len() * TERMS, control.means.len()),
            (rays.intervals.len() * PLACES, control.of_intervals.len()),
            (rays.boxes.len() * PRODUCTS, control.controls.len()),
        ] {
            let expected = expected * channels;
            if found != expected {
                return Err(RoomError::Length { expected, found });
            }
        }
        Ok(Self {
            coloured,
            polynomials,
            v,
            control,
        })
    }

    /// v_c of a point in every channel.
    #[inline]
    fn write_values(&self, x: &Located<Point<F>>, to: &mut [F]) {
        self.coloured.direct(&x.point, to);
        self.reflect(x, to);
    }

    /// Multiplies irradiances by the reflectances of the wall, and adds what v has besides the light.
    #[inline]
    fn reflect(&self, x: &Located<Point<F>>, to: &mut [F]) {
        self.coloured.reflect(&x.point, to);
        let psi: [F; B] = self.polynomials.basis(x);
        let own = self.v.get(x.cell * self.channels() * B..).unwrap_or(&[]);
        for (to, own) in to.iter_mut().zip(own.chunks_exact(B)) {
            *to = own
                .iter()
                .zip(psi)
                .fold(*to, |sum, (&v, psi)| sum + v * psi);
        }
    }

    const fn channels(&self) -> usize {
        self.coloured.colours().channels()
    }

    /// The estimates of all G_c, of a box by its number and a place in it.
    #[inline]
    fn draw(&self, x: &Located<Point<F>>, [chosen, place]: [F; 2], to: &mut [F]) -> Option<()> {
        let room = self.coloured.room();
        let view: View<'_, F> = self.control.rays.view(room, x)?;
        let (number, probability) = view.chosen(chosen)?;
        let share = view.shares.get(number)?;
        let ray_box = view.boxes.get(number)?;
        let tangent = room.geometry().wall(x.point.wall() as u32)?.tangent;
        let position = x.point.position();
        let psi: &[F; TERMS] = view.psi.first_chunk()?;
        let first = view.stretch.interval as usize;
        let k = share.interval as usize;
        let [from, width] = between(view.intervals, k, position, tangent);
        let omega = from + width * (ray_box.from + ray_box.width * place);
        // What the ray brings less c, times the weight of the box, then the integral of c.
        match room.ray(&x.point, omega) {
            Some(y) => self.write_values(&self.locate(y), to),
            None => to.fill(zero()),
        }
        let per_probability = ray_box.width / probability;
        let box_number = view.stretch.ray_box as usize + number;
        let terms = products(psi, place);
        add(self.control.controls, box_number, &terms, -one::<F>(), to);
        let is_near = view.near() >> k & 1 != 0;
        if !is_near {
            add(self.control.means, first + k, psi, one(), to);
        }
        let weight = width * per_probability;
        to.iter_mut().for_each(|to| *to *= weight);
        if !is_near {
            // What the polynomial lacks of the integral of c.
            let of_intervals = self.control.of_intervals;
            add(of_intervals, first + k, &view.psi, -per_probability, to);
        }
        add(self.control.integrals, view.number, &view.psi, one(), to);
        let mut near = view.near();
        while near != 0 {
            let k = near.trailing_zeros() as usize;
            near &= near - 1;
            let [_, width] = between(view.intervals, k, position, tangent);
            add(self.control.means, first + k, psi, width, to);
        }
        // G = v − ρ times that.
        to.iter_mut().for_each(|to| *to = -*to);
        self.coloured.add_direct(&x.point, to);
        self.reflect(x, to);
        Some(())
    }
}

/// Adds the combinations of rows of a table, of a stretch, an interval or a box by its number, times a factor, in every channel.
#[inline]
fn add<F: Real, const N: usize>(table: &[F], number: usize, psi: &[F; N], factor: F, to: &mut [F]) {
    let channels = to.len();
    let rows = table.get(number * N * channels..).unwrap_or(&[]);
    for (row, &psi) in rows.chunks_exact(channels).zip(psi) {
        let psi = factor * psi;
        for (to, &own) in to.iter_mut().zip(row) {
            *to += psi * own;
        }
    }
}

impl<F: Real, const B: usize> StateSpace for ColouredRays<'_, '_, '_, F, B> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real, const B: usize> ChannelNeighbours for ColouredRays<'_, '_, '_, F, B> {
    #[inline]
    fn locate(&self, x: Point<F>) -> Located<Point<F>> {
        Located {
            point: x,
            cell: self.polynomials.locate(&x),
        }
    }

    fn sources(&self, x: &Located<Point<F>>, draws: &mut dyn Uniforms<F>, sources: &mut [F]) {
        let drawn = [draws.uniform(), draws.uniform()];
        if self.draw(x, drawn, sources).is_none() {
            sources.fill(F::NAN);
        }
    }

    #[inline]
    fn values(&self, x: &Located<Point<F>>, values: &mut [F]) {
        self.write_values(x, values);
    }
}
