//! The picture of a density on the walls of a room.

use core::ops::Range;

use crate::{Canvas, Error, Panel, Piece, RoomPicture, Scale, Wall};

/// Pixels along the longer side of the room.
const ACROSS: usize = 700;

/// A density on the walls of a room, as their colours on a logarithmic scale.
#[derive(Clone, Debug)]
pub struct WallDensity<'a> {
    /// The walls.
    pub walls: &'a [Wall],
    /// The number of a wall, the ends of a piece of it in fractions of its length, and the density there.
    pub values: &'a [(usize, [f64; 2], f64)],
    /// The names of surfaces, and their walls.
    pub names: &'a [(String, Range<usize>)],
    /// The line of text below the picture.
    pub caption: &'a str,
}

impl WallDensity<'_> {
    /// The text of an SVG file.
    ///
    /// ```
    /// use fredholm_plot::{Wall, WallDensity};
    ///
    /// let wall = |vertices, ends| Wall { vertices, ends };
    /// let density = WallDensity {
    ///     walls: &[wall([0, 1], [[0.0, 0.0], [4.0, 0.0]]), wall([1, 0], [[4.0, 0.0], [0.0, 3.0]])],
    ///     values: &[(0, [0.0, 0.5], 1.0), (0, [0.5, 1.0], 3.0), (1, [0.0, 1.0], 2.0)],
    ///     names: &[("floor".to_owned(), 0..1)],
    ///     caption: "six numbers",
    /// };
    /// assert!(density.svg()?.contains("six numbers"));
    /// # Ok::<(), fredholm_plot::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error`]: the walls have no extent.
    pub fn svg(&self) -> Result<String, Error> {
        let values = self.values;
        let canvas = Canvas::new(self.walls, ACROSS, 2, ACROSS as f64 / 50.0)?;
        let of = |&(wall, [from, to], _): &(usize, [f64; 2], f64)| Piece {
            wall,
            from,
            to,
            pixels: 1,
        };
        let pieces: Vec<Piece> = values.iter().map(of).collect();
        // A few short cells in corners would leave all others in the dark.
        let mut sorted: Vec<f64> = values.iter().map(|&(.., value)| value).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let most = sorted.get(sorted.len() * 199 / 200).copied().unwrap_or(1.0);
        let density = || values.iter().map(|&(.., value)| value.min(most));
        let air = vec![f64::NAN; canvas.width() * canvas.height()];
        let walls: Vec<f64> = density().collect();
        let picture = RoomPicture {
            canvas: &canvas,
            pieces: &pieces,
            scale: Scale::new(density(), density(), true),
            legend: "density",
            stefan_boltzmann: None,
            captions: vec![self.caption.to_owned()],
            width: None,
            unit: Some(""),
            names: self.names,
            marks: &[],
        };
        let panel = Panel {
            heading: None,
            air: &air,
            walls: &walls,
            colours: None,
        };
        picture.svg(&[panel])
    }
}
