//! The tables that a neighbour equation of rays takes from.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::galerkin::{reserve, rounded};

use crate::RoomError;
use crate::ray_boxes::CellRays;
use crate::rays::{OF_INTERVAL, OWN, PRODUCTS, RayControl, Share, Stretch, TERMS, add_mean};

/// The tables of a [`RayNeighbour`](crate::RayNeighbour).
#[derive(Clone, Debug)]
pub struct RayTables<F> {
    channels: usize,
    first: Vec<u32>,
    stretches: Vec<Stretch<F>>,
    integrals: Vec<F>,
    intervals: Vec<F>,
    boxes: Vec<F>,
    shares: Vec<Share>,
}

impl RayTables<f64> {
    /// The tables of all cells, in their order.
    ///
    /// # Errors
    /// [`RoomError::Memory`]: more than 2³² − 1 boxes, or no memory; [`RoomError::Tables`]: cells are of different channels, or none.
    pub fn new(cells: Vec<CellRays>) -> Result<Self, RoomError> {
        let count = |of: fn(&CellRays) -> usize| cells.iter().map(of).sum::<usize>();
        let shares = count(|cell| cell.shares.len());
        if u32::try_from(shares).is_err() {
            return Err(RoomError::Memory { bytes: None });
        }
        let channels = cells.first().ok_or(RoomError::Tables)?.channels;
        if cells.iter().any(|cell| cell.channels != channels) {
            return Err(RoomError::Tables);
        }
        let mut all = Self {
            channels,
            first: reserve(cells.len() + 1)?,
            stretches: reserve(count(|cell| cell.stretches.len()) + 1)?,
            integrals: reserve(count(|cell| cell.integrals.len()))?,
            intervals: reserve(count(|cell| cell.intervals.len()))?,
            boxes: reserve(count(|cell| cell.boxes.len()))?,
            shares: reserve(shares)?,
        };
        for cell in cells {
            let end = all.end();
            all.first.push(all.stretches.len() as u32);
            all.stretches
                .extend(cell.stretches.iter().map(|own| Stretch {
                    interval: end.interval + own.interval,
                    ray_box: end.ray_box + own.ray_box,
                    ..*own
                }));
            all.integrals.extend(cell.integrals);
            all.intervals.extend(cell.intervals);
            all.boxes.extend(cell.boxes);
            all.shares.extend(cell.shares);
        }
        all.first.push(all.stretches.len() as u32);
        all.stretches.push(all.end());
        Ok(all)
    }

    /// A stretch that begins where the tables end.
    fn end(&self) -> Stretch<f64> {
        let row = OWN + self.channels * OF_INTERVAL;
        Stretch {
            from: 0.0,
            interval: (self.intervals.len() / row) as u32,
            ray_box: self.shares.len() as u32,
            near: [0; 2],
        }
    }

    /// The tables in the scalar of the walks: c is rounded, and its means are those of c as rounded.
    ///
    /// # Errors
    /// [`RoomError::Memory`].
    pub fn rounded<F: Real>(&self) -> Result<RayTables<F>, RoomError> {
        let mut stretches = reserve(self.stretches.len())?;
        stretches.extend(self.stretches.iter().map(|own| Stretch {
            from: F::from_f64(own.from),
            interval: own.interval,
            ray_box: own.ray_box,
            near: own.near,
        }));
        let mut intervals: Vec<F> = rounded(&self.intervals)?;
        let boxes: Vec<F> = rounded(&self.boxes)?;
        let [of_interval, of_box] =
            [OF_INTERVAL, PRODUCTS].map(|numbers| OWN + self.channels * numbers);
        for row in intervals.chunks_exact_mut(of_interval) {
            means_of(row).for_each(|mean| mean.fill(F::zero()));
        }
        let mut all = boxes.chunks_exact(of_box).zip(&self.shares);
        for (own, next) in stretches.iter().zip(stretches.iter().skip(1)) {
            for (row, share) in all.by_ref().take((next.ray_box - own.ray_box) as usize) {
                let from = (own.interval + share.interval) as usize * of_interval;
                let to = intervals.get_mut(from..from + of_interval);
                let Some(([_, width], control)) = row.split_first_chunk::<OWN>() else {
                    continue;
                };
                let means = means_of(to.unwrap_or_default());
                for (mean, own) in means.zip(control.chunks_exact(PRODUCTS)) {
                    add_mean(mean, *width, own);
                }
            }
        }
        Ok(RayTables {
            channels: self.channels,
            first: self.first.clone(),
            stretches,
            integrals: rounded(&self.integrals)?,
            intervals,
            boxes,
            shares: self.shares.clone(),
        })
    }
}

/// The means of all channels in the row of an interval.
fn means_of<F>(row: &mut [F]) -> impl Iterator<Item = &mut [F]> {
    let of_channels = row.get_mut(OWN..).unwrap_or_default();
    let of_channels = of_channels.chunks_exact_mut(OF_INTERVAL);
    of_channels.filter_map(|own| own.get_mut(..TERMS))
}

impl<F: Real> RayTables<F> {
    /// The tables, borrowed.
    #[must_use]
    pub fn control(&self) -> RayControl<'_, F> {
        RayControl {
            first: &self.first,
            stretches: &self.stretches,
            integrals: &self.integrals,
            intervals: &self.intervals,
            boxes: &self.boxes,
            shares: &self.shares,
        }
    }
}
