//! The picture of numbers on a grid of two axes.

use crate::scale::sorted;
use crate::{Canvas, Error, Figure, Overlay, Panel, Picture, Scale, Wall};

/// Pixels of the longer side.
const ACROSS: usize = 420;

/// Numbers on a grid of equally spaced points of two axes, as blocks of colours with a scale.
#[derive(Clone, Debug)]
pub struct GridPicture<'a> {
    /// The first and the last point.
    pub ends: [[f64; 2]; 2],
    /// The number of points along both axes.
    pub counts: [usize; 2],
    /// The numbers, those along the second axis one after the other; NaN where there is none.
    pub numbers: &'a [f64],
    /// What they are, above the scale.
    pub legend: &'a str,
    /// The line of text below the picture.
    pub caption: String,
}

impl GridPicture<'_> {
    /// The picture.
    ///
    /// ```
    /// use fredholm_plot::GridPicture;
    ///
    /// let picture = GridPicture {
    ///     ends: [[0.0, 0.0], [1.0, 2.0]],
    ///     counts: [2, 3],
    ///     numbers: &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0],
    ///     legend: "u",
    ///     caption: "six numbers".to_owned(),
    /// };
    /// assert!(picture.draw()?.svg()?.contains("six numbers"));
    /// # Ok::<(), fredholm_plot::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::WrongLength`]: there are more points or fewer. [`Error::NothingToDraw`]: an axis has no length, or no number
    /// is finite.
    pub fn draw(&self) -> Result<Figure, Error> {
        let ([rows, columns], [low, high]) = (self.counts, self.ends);
        Error::unless_equal("numbers", rows * columns, self.numbers.len())?;
        let corners = [low, [high[0], low[1]], high, [low[0], high[1]]];
        let side = |i: usize| Wall {
            vertices: [i as u32, ((i + 1) % 4) as u32],
            ends: [corners[i], corners[(i + 1) % 4]],
        };
        let canvas = Canvas::new(&[0, 1, 2, 3].map(side), ACROSS, 0, 1.0)?;
        let nearest = |x: f64, axis: usize, count: usize| {
            let part = (x - low[axis]) / (high[axis] - low[axis]);
            ((part * (count as f64 - 1.0)).round().max(0.0) as usize).min(count - 1)
        };
        let value =
            |[x, y]: [f64; 2]| self.numbers[nearest(x, 0, rows) * columns + nearest(y, 1, columns)];
        let pixels: Vec<f64> = canvas.middles().into_iter().map(value).collect();
        let finite = sorted(self.numbers.iter().copied().filter(|x| x.is_finite()));
        let (Some(least), Some(most)) = (finite.first(), finite.last()) else {
            return Err(Error::NothingToDraw);
        };
        // Numbers that are all the same have a colour, too.
        let around = 0.5 * most.abs().max(f64::MIN_POSITIVE);
        let scale = Scale::between(*least, *most, false)
            .or_else(|| Scale::between(least - around, most + around, false));
        let scale = scale.ok_or(Error::NothingToDraw)?;
        let picture = Picture {
            overlay: Some(Overlay::bare(&canvas)),
            captions: vec![self.caption.clone()],
            ..Picture::new(canvas.size(), scale, self.legend)
        };
        picture.draw(&[Panel {
            pixels: pixels.into(),
            ..Panel::default()
        }])
    }
}

#[cfg(test)]
mod tests {
    use super::GridPicture;
    use crate::Error;

    #[test]
    fn what_is_no_grid_is_refused() {
        let of = |counts, numbers: &[f64]| {
            let picture = GridPicture {
                ends: [[0.0, 0.0], [1.0, 1.0]],
                counts,
                numbers,
                legend: "u",
                caption: String::new(),
            };
            picture.draw().map(|_| ())
        };
        assert_eq!(of([2, 2], &[1.0; 3]), Error::unless_equal("numbers", 4, 3));
        assert_eq!(of([2, 2], &[f64::NAN; 4]), Err(Error::NothingToDraw));
        assert!(of([2, 2], &[7.0; 4]).is_ok());
    }
}
