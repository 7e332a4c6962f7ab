//! The tables that a neighbour equation of rays takes from.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::array::Each;
use fredholm_core::galerkin::reserve;

use crate::ray_boxes::CellRays;
use crate::rays::{
    Interval, PLACES, RayBox, RayControl, RayNeighbour, Share, Stretch, TERMS, add_means,
};
use crate::{PolynomialRoom, RoomError};

/// The tables of a [`RayNeighbour`].
#[derive(Clone, Debug)]
pub struct RayTables<F> {
    first: Vec<u32>,
    stretches: Vec<Stretch<F>>,
    intervals: Vec<Interval<F>>,
    boxes: Vec<RayBox<F>>,
    shares: Vec<Share>,
}

impl RayTables<f64> {
    /// The tables of all cells, in their order.
    ///
    /// # Errors
    /// [`RoomError::Memory`]: more than 2³² − 1 boxes, or no memory.
    pub fn new(cells: Vec<CellRays>) -> Result<Self, RoomError> {
        let count = |of: fn(&CellRays) -> usize| cells.iter().map(of).sum::<usize>();
        let boxes = count(|cell| cell.boxes.len());
        if u32::try_from(boxes).is_err() {
            return Err(RoomError::Memory { bytes: None });
        }
        let mut all = Self {
            first: reserve(cells.len() + 1)?,
            stretches: reserve(count(|cell| cell.stretches.len()) + 1)?,
            intervals: reserve(count(|cell| cell.intervals.len()))?,
            boxes: reserve(boxes)?,
            shares: reserve(boxes)?,
        };
        for cell in cells {
            let (interval, ray_box) = (all.intervals.len() as u32, all.boxes.len() as u32);
            all.first.push(all.stretches.len() as u32);
            let own = cell.stretches.iter().map(|stretch| Stretch {
                interval: interval + stretch.interval,
                ray_box: ray_box + stretch.ray_box,
                ..*stretch
            });
            all.stretches.extend(own);
            all.intervals.extend(cell.intervals);
            all.boxes.extend(cell.boxes);
            all.shares.extend(cell.shares);
        }
        all.first.push(all.stretches.len() as u32);
        all.stretches.push(Stretch {
            from: 0.0,
            interval: all.intervals.len() as u32,
            ray_box: all.boxes.len() as u32,
            near: [0; 2],
            integral: [0.0; PLACES],
        });
        Ok(all)
    }

    /// The tables in the scalar of the walks: c is rounded, and its means are those of c as rounded.
    ///
    /// # Errors
    /// [`RoomError::Memory`].
    pub fn rounded<F: Real>(&self) -> Result<RayTables<F>, RoomError> {
        let to = F::from_f64;
        let mut all = RayTables {
            first: self.first.clone(),
            stretches: reserve(self.stretches.len())?,
            intervals: reserve(self.intervals.len())?,
            boxes: reserve(self.boxes.len())?,
            shares: self.shares.clone(),
        };
        all.stretches
            .extend(self.stretches.iter().map(|stretch| Stretch {
                from: to(stretch.from),
                interval: stretch.interval,
                ray_box: stretch.ray_box,
                near: stretch.near,
                integral: stretch.integral.each(to),
            }));
        all.intervals
            .extend(self.intervals.iter().map(|interval| Interval {
                end: interval.end.each(to),
                mean: [F::zero(); TERMS],
                integral: interval.integral.each(to),
            }));
        all.boxes.extend(self.boxes.iter().map(|ray_box| RayBox {
            from: to(ray_box.from),
            width: to(ray_box.width),
            control: ray_box.control.each(to),
        }));
        let stretches = all.stretches.iter().zip(all.stretches.iter().skip(1));
        for (own, next) in stretches {
            let range = own.ray_box as usize..next.ray_box as usize;
            let boxes = all.boxes.get(range.clone()).unwrap_or(&[]);
            let shares = all.shares.get(range).unwrap_or(&[]);
            for (ray_box, share) in boxes.iter().zip(shares) {
                let interval = own.interval as usize + share.interval as usize;
                if let Some(interval) = all.intervals.get_mut(interval) {
                    add_means(&mut interval.mean, ray_box.width, &ray_box.control, 1);
                }
            }
        }
        Ok(all)
    }
}

impl<F: Real> RayTables<F> {
    /// The tables, borrowed.
    #[must_use]
    pub fn control(&self) -> RayControl<'_, F> {
        RayControl {
            first: &self.first,
            stretches: &self.stretches,
            intervals: &self.intervals,
            boxes: &self.boxes,
            shares: &self.shares,
        }
    }

    /// The neighbour equation of v with these tables.
    ///
    /// # Errors
    /// [`RoomError::Length`], [`RoomError::Tables`]: v or the tables are those of other cells.
    pub fn neighbour<'n, 'r, 'a, const B: usize>(
        &'n self,
        polynomials: &'n PolynomialRoom<'r, 'a, F, B>,
        v: &'n [F],
    ) -> Result<RayNeighbour<'n, 'r, 'a, F, B>, RoomError> {
        RayNeighbour::new(polynomials, v, self.control())
    }
}
