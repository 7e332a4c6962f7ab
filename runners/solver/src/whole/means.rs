//! Means of a global estimate over the cells of a mesh.

use fredholm_model::{GlobalQuantity, IMAGE_HEAD};
use fredholm_variance::gauss;

use super::{GlobalEstimate, GlobalValue, QUADRATURE_SHARE};
use crate::{Error, Goal, Region};

/// Gauss points along every axis of a cell, more and more.
const POINTS: [usize; 5] = [2, 3, 5, 8, 12];
/// Cells at once: images of their points are in memory together.
const CELLS: usize = 256;
/// The most axes of a cell: of four, every rule takes as many points as a grid has for all cells of three.
const AXES: usize = 3;

impl GlobalEstimate<'_> {
    /// The means of u over segments, parallelograms and parallelepipeds between points, such as the cells of a grid. A
    /// cell is a point in its corner, and the neighbours of this corner, one for each of three axes at most. The mean is
    /// taken in the coordinates of the points: angles, those of a cube, shares of the length of a part. From an angle to one that is
    /// not larger it goes past 0.
    ///
    /// Every mean has a standard error and no band. It is a Gauss rule, with more points until it moves by a hundredth of
    /// its standard error or less, or none is taken: `quadrature_error` says by how much it moved last.
    ///
    /// ```
    /// use fredholm::{CubeModel, Region, Solver};
    ///
    /// // u = 6x/5.
    /// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    /// let whole = Solver::new(&u).cells(10).walks(20_000).whole()?;
    /// let cell = [0.25, 0.75].map(|x| Region::Point(vec![x])).to_vec();
    /// let mean = whole.means_between(&[cell])?[0];
    /// assert!((mean.estimate - 0.6).abs() < 5.0 * mean.std_error.unwrap());
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Region`]: the space has no such point, a corner is no point, a neighbour is of a different kind or part, or
    /// there are more than three.
    pub fn means_between(&self, cells: &[Vec<Region>]) -> Result<Vec<GlobalValue>, Error> {
        let goals = cells
            .iter()
            .flatten()
            .map(|region| Goal::new("u", region.clone()));
        self.model.check_goals(&goals.collect::<Vec<_>>())?;
        let all = cells.chunks(CELLS).map(|cells| self.means(cells));
        Ok(all.collect::<Result<Vec<_>, Error>>()?.concat())
    }

    fn means(&self, cells: &[Vec<Region>]) -> Result<Vec<GlobalValue>, Error> {
        let mut means: Vec<Option<GlobalValue>> = vec![None; cells.len()];
        let mut open: Vec<usize> = (0..cells.len()).collect();
        for points in POINTS {
            if open.is_empty() {
                break;
            }
            let now = self.by_rule(open.iter().map(|&i| &cells[i][..]), points)?;
            let old = open.iter().map(|&i| means[i]);
            let moved = now.iter().zip(old).map(|(now, old)| match old {
                Some(old) => (now.estimate - old.estimate).abs(),
                None => f64::INFINITY,
            });
            let moved: Vec<f64> = moved.collect();
            for ((&i, now), &moved) in open.iter().zip(now).zip(&moved) {
                means[i] = Some(GlobalValue {
                    quadrature_error: moved.max(now.quadrature_error),
                    ..now
                });
            }
            let mut moved = moved.into_iter();
            open.retain(|&i| {
                let error = means[i].and_then(|mean| mean.std_error).unwrap_or(0.0);
                let may = (QUADRATURE_SHARE * error).max(self.summary.rounding_floor);
                moved.next().is_some_and(|moved| moved > may)
            });
        }
        let mean = |mean: Option<GlobalValue>| mean.ok_or(Error::Internal("a cell without a mean"));
        means.into_iter().map(mean).collect()
    }

    /// The means over cells by the Gauss rule of so many points along every axis.
    fn by_rule<'c>(
        &self,
        cells: impl Iterator<Item = &'c [Region]>,
        points: usize,
    ) -> Result<Vec<GlobalValue>, Error> {
        let rule = gauss(points)?;
        let around = self.model.about().around;
        let (mut nodes, mut ends) = (Vec::new(), Vec::new());
        for cell in cells {
            let Some((corner, neighbours)) = cell.split_first() else {
                return Err(refused("a cell has a corner"));
            };
            if neighbours.len() > AXES {
                return Err(refused("a cell has three axes at most"));
            }
            if let (Some(around), Region::Point(a), [Region::Point(b)]) =
                (around, corner, neighbours)
                && let ([a], [b]) = (&a[..], &b[..])
            {
                nodes.extend(arcs([*a, *b], around));
                ends.push(nodes.len());
                continue;
            }
            let mut own: Vec<(Region, f64)> = vec![(corner.clone(), 1.0)];
            for neighbour in neighbours {
                let along = |(from, weight): &(Region, f64)| {
                    let (from, weight) = (from.clone(), *weight);
                    rule.iter().map(move |(t, half)| {
                        let at = moved(&from, corner, neighbour, 0.5 * (1.0 + t))?;
                        Ok((at, 0.5 * half * weight))
                    })
                };
                let all = own.iter().flat_map(along);
                own = all.collect::<Result<_, Error>>()?;
            }
            nodes.extend(own);
            ends.push(nodes.len());
        }
        let (regions, weights): (Vec<Region>, Vec<f64>) = nodes.into_iter().unzip();
        let images = self.field.images(GlobalQuantity::U, &regions)?;
        let width = IMAGE_HEAD + self.field.rows();
        let mut images = images.chunks_exact(width).zip(weights);
        let mut from = 0;
        let mean = |end| {
            let mut sum = vec![0.0; width];
            for (image, weight) in images.by_ref().take(end - from) {
                for (sum, x) in sum.iter_mut().zip(image) {
                    *sum += weight * x;
                }
            }
            from = end;
            self.value(&sum, false)
        };
        Ok(ends.into_iter().map(mean).collect())
    }
}

fn refused(message: &str) -> Error {
    Error::Region {
        message: message.to_owned(),
    }
}

/// The arcs from an angle to another, past the end of the circle if that is not larger, with their shares: means over arcs know where u
/// jumps.
fn arcs([from, to]: [f64; 2], [low, high]: [f64; 2]) -> Vec<(Region, f64)> {
    let way = if to > from {
        to - from
    } else {
        to - from + high - low
    };
    let (before, after) = if to > from { (to, low) } else { (high, to) };
    let all = [(from, before), (low, after)].into_iter();
    let all = all.filter(|(from, to)| from < to);
    all.map(|(from, to)| (Region::Arc(from, to), (to - from) / way))
        .collect()
}

/// The point that is a share `t` of the way from a corner to its neighbour away from another.
fn moved(from: &Region, corner: &Region, neighbour: &Region, t: f64) -> Result<Region, Error> {
    Ok(match (from, corner, neighbour) {
        (Region::Point(x), Region::Point(a), Region::Point(b)) => {
            let ways = a.iter().zip(b);
            let moved = x.iter().zip(ways).map(|(x, (a, b))| x + t * (b - a));
            Region::Point(moved.collect())
        }
        (Region::On(part, x), Region::On(_, a), Region::On(other, b)) if part == other => {
            Region::On(*part, x + t * (b - a))
        }
        _ => {
            return Err(refused(
                "a cell lies between points of one kind and of one part",
            ));
        }
    })
}
