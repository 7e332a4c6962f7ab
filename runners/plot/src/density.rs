//! The picture of a density on the walls of a room.

use core::ops::Range;

use crate::scale::sorted;
use crate::{Canvas, Error, Figure, Overlay, Panel, Picture, Piece, Scale, Wall};

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
    /// The picture.
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
    /// assert!(density.draw()?.svg()?.contains("six numbers"));
    /// # Ok::<(), fredholm_plot::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error`]: the walls have no extent.
    pub fn draw(&self) -> Result<Figure, Error> {
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
        let all = sorted(values.iter().map(|&(.., value)| value));
        let most = all.get(all.len() * 199 / 200).copied().unwrap_or(1.0);
        let density = || values.iter().map(|&(.., value)| value.min(most));
        let [width, height] = canvas.size();
        let scale = Scale::new(density(), density(), true);
        let picture = Picture {
            overlay: Some(Overlay {
                pieces: &pieces,
                unit: Some(""),
                names: self.names,
                ..Overlay::bare(&canvas)
            }),
            captions: vec![self.caption.to_owned()],
            ..Picture::new([width, height], scale, "density")
        };
        picture.draw(&[Panel {
            pixels: vec![f64::NAN; width * height].into(),
            walls: density().collect::<Vec<_>>().into(),
            ..Panel::default()
        }])
    }
}
