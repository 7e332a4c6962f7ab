//! Where things are: pixels over a room, and its walls in pieces.

use crate::Error;
use crate::frame::bounds;
use crate::strips::{Strip, strips};

/// The length of a piece of wall in pixels.
const PIECE: f64 = 3.0;

/// A wall: its active side, which has the colours, is to the left on the way from its first end to
/// its second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// The numbers of the vertices at its ends: walls with a number in common meet there.
    pub vertices: [u32; 2],
    /// The coordinates of its ends.
    pub ends: [[f64; 2]; 2],
}

/// A piece of a wall, which has one colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// The number of the wall.
    pub wall: usize,
    /// The beginning of the stretch, as a fraction of the wall's length.
    pub from: f64,
    /// The end of the stretch, as a fraction of the wall's length.
    pub to: f64,
    /// The number of pixels that it covers, at least 1.
    pub pixels: u64,
}

impl Piece {
    /// The middle of the stretch, as a fraction of the wall's length.
    pub const fn middle(&self) -> f64 {
        0.5 * (self.from + self.to)
    }
}

/// Pixels over a room, the first on the upper left, and its walls as strips of some thickness.
#[derive(Clone, Debug)]
pub struct Canvas {
    /// The lowest and the highest coordinates of walls.
    extent: [[f64; 2]; 2],
    /// The lowest coordinates of pixels.
    low: [f64; 2],
    /// The width of a pixel.
    pixel: f64,
    /// Pixels across and down.
    size: [usize; 2],
    thickness: f64,
    strips: Vec<Strip>,
}

impl Canvas {
    /// A canvas over a room whose longer side is `across` pixels, with `margin` more on every side;
    /// walls are drawn `thickness` pixels thick.
    pub fn new(
        walls: &[Wall],
        across: usize,
        margin: usize,
        thickness: f64,
    ) -> Result<Self, Error> {
        let canvas = Self::over(extent(walls), across, margin)?;
        Ok(canvas.with_walls(walls, thickness))
    }

    /// A canvas over a room that is at most `width` pixels wide and twice as high, `margin` on every side included.
    pub fn fitting(
        walls: &[Wall],
        width: usize,
        margin: usize,
        thickness: f64,
    ) -> Result<Self, Error> {
        let own = |pixels: usize| pixels.saturating_sub(2 * margin).max(1) as f64;
        let [low, high] = extent(walls);
        let [across, down] = [high[0] - low[0], high[1] - low[1]];
        let pixel = (across / own(width)).max(down / own(2 * width));
        let canvas = Self::of_pixels([low, high], pixel, margin)?;
        Ok(canvas.with_walls(walls, thickness))
    }

    /// A canvas without walls, over a box whose longer side is `across` pixels.
    pub(crate) fn over(
        [low, high]: [[f64; 2]; 2],
        across: usize,
        margin: usize,
    ) -> Result<Self, Error> {
        let longer = (high[0] - low[0]).max(high[1] - low[1]);
        Self::of_pixels([low, high], longer / across as f64, margin)
    }

    fn of_pixels([low, high]: [[f64; 2]; 2], pixel: f64, margin: usize) -> Result<Self, Error> {
        if !(pixel > 0.0 && pixel.is_finite()) {
            return Err(Error::NothingToDraw);
        }
        // Rounding is no pixel more.
        let count = |side: f64| (side / pixel * (1.0 - 1e-12)).ceil() as usize + 2 * margin;
        Ok(Self {
            extent: [low, high],
            low: low.map(|low| low - margin as f64 * pixel),
            pixel,
            size: [0, 1].map(|k| count(high[k] - low[k])),
            thickness: 0.0,
            strips: Vec::new(),
        })
    }

    fn with_walls(mut self, walls: &[Wall], thickness: f64) -> Self {
        self.strips = strips(walls, thickness, |at| self.place(at));
        self.thickness = thickness;
        self
    }

    /// The number of pixels in a row, and the number of rows.
    pub const fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The coordinates of the middles of all pixels, row by row.
    pub fn middles(&self) -> Vec<[f64; 2]> {
        let [width, height] = self.size;
        let middle = |number: usize| {
            let (column, row) = (number % width, number / width);
            [
                self.low[0] + (column as f64 + 0.5) * self.pixel,
                self.low[1] + ((height - row) as f64 - 0.5) * self.pixel,
            ]
        };
        (0..width * height).map(middle).collect()
    }

    /// The walls in pieces of some pixels, wall by wall.
    pub fn pieces(&self) -> Vec<Piece> {
        let of = |(wall, strip): (usize, &Strip)| {
            let length = strip.length();
            let count = (length / PIECE).ceil().max(1.0) as u32;
            let covered = self.thickness * length / f64::from(count);
            let pixels = covered.round().max(1.0) as u64;
            (0..count).map(move |k| Piece {
                wall,
                from: f64::from(k) / f64::from(count),
                to: f64::from(k + 1) / f64::from(count),
                pixels,
            })
        };
        self.strips.iter().enumerate().flat_map(of).collect()
    }

    /// The lowest and the highest coordinates of walls.
    pub(crate) const fn extent(&self) -> [[f64; 2]; 2] {
        self.extent
    }

    pub(crate) fn strips(&self) -> &[Strip] {
        &self.strips
    }

    /// A point in pixels from the upper left corner.
    pub(crate) fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            (x - self.low[0]) / self.pixel,
            self.size[1] as f64 - (y - self.low[1]) / self.pixel,
        ]
    }
}

fn extent(walls: &[Wall]) -> [[f64; 2]; 2] {
    bounds(walls.iter().flat_map(|wall| wall.ends))
}

#[cfg(test)]
mod tests {
    use super::{Canvas, Wall};
    use crate::Error;

    fn walls(corners: [[f64; 2]; 3]) -> [Wall; 3] {
        [0, 1, 2].map(|i| {
            let j = (i + 1) % 3;
            Wall {
                vertices: [i as u32, j as u32],
                ends: [corners[i], corners[j]],
            }
        })
    }

    #[test]
    fn pixels_begin_on_the_upper_left() {
        let walls = walls([[1.0, 1.0], [9.0, 1.0], [1.0, 5.0]]);
        let canvas = Canvas::new(&walls, 8, 1, 3.0).unwrap();
        assert_eq!(canvas.size(), [10, 6]);
        let middles = canvas.middles();
        assert_eq!([middles[0], middles[59]], [[0.5, 5.5], [9.5, 0.5]]);
    }

    #[test]
    fn pieces_make_up_their_walls() {
        let walls = walls([[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]]);
        let pieces = Canvas::new(&walls, 40, 2, 3.0).unwrap().pieces();
        let of = |wall| pieces.iter().filter(move |piece| piece.wall == wall);
        // 40, 50 and 30 pixels.
        assert_eq!([0, 1, 2].map(|wall| of(wall).count()), [14, 17, 10]);
        for wall in 0..3 {
            assert_eq!(of(wall).next().map(|piece| piece.from), Some(0.0));
            assert_eq!(of(wall).next_back().map(|piece| piece.to), Some(1.0));
            assert!(of(wall).all(|piece| piece.pixels == 9));
        }
    }

    #[test]
    fn a_room_without_extent_has_no_canvas() {
        let nothing = Error::NothingToDraw;
        assert_eq!(Canvas::new(&[], 100, 2, 3.0).err(), Some(nothing.clone()));
        let point = walls([[1.0, 2.0]; 3]);
        assert_eq!(Canvas::new(&point, 100, 2, 3.0).err(), Some(nothing));
    }
}
