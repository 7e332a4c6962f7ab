//! Meshes with values, as ParaView, `PyVista` and `meshio` read them.
//!
//! Crates that write VTK's files bring in parsers and compression; what is written here are five arrays, and the values.

use core::ops::Range;

use crate::Error;
use crate::page::base64;

/// A cell of a [`Mesh`]: the numbers of the points in its corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cell {
    /// A point by itself.
    Vertex([usize; 1]),
    /// A segment.
    Line([usize; 2]),
    /// A triangle.
    Triangle([usize; 3]),
    /// A quadrilateral, whose corners go around it.
    Quad([usize; 4]),
    /// A hexahedron: the corners of its floor go around that, and those of its ceiling stand above them.
    Hexahedron([usize; 8]),
}

impl Cell {
    /// The numbers of the points in the corners.
    #[must_use]
    pub const fn corners(&self) -> &[usize] {
        match self {
            Self::Vertex(corners) => corners,
            Self::Line(corners) => corners,
            Self::Triangle(corners) => corners,
            Self::Quad(corners) => corners,
            Self::Hexahedron(corners) => corners,
        }
    }

    /// The numbers of the points in a corner and beside it along every axis, of a cell of [`lattice`]: one, two, three or four.
    ///
    /// ```
    /// use fredholm_plot::Cell;
    ///
    /// assert_eq!(Cell::Quad([5, 7, 8, 6]).axes(), [5, 7, 6]);
    /// ```
    #[must_use]
    pub fn axes(&self) -> Vec<usize> {
        let corners = self.corners();
        let beside: &[usize] = match self {
            Self::Quad(_) => &[0, 1, 3],
            Self::Hexahedron(_) => &[0, 1, 3, 4],
            Self::Vertex(_) | Self::Line(_) | Self::Triangle(_) => return corners.to_vec(),
        };
        beside.iter().map(|&i| corners[i]).collect()
    }

    /// The number that VTK has for cells of this shape.
    const fn kind(&self) -> u8 {
        match self {
            Self::Vertex(_) => 1,
            Self::Line(_) => 3,
            Self::Triangle(_) => 5,
            Self::Quad(_) => 9,
            Self::Hexahedron(_) => 12,
        }
    }
}

/// A quantity on a [`Mesh`]: one number for every point, or for every cell; NaN where there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// The name of the quantity.
    pub name: String,
    /// The numbers.
    pub numbers: Vec<f64>,
}

/// Points, cells between them, and quantities on both.
///
/// ```
/// use fredholm_plot::{Cell, Mesh, Quantity};
///
/// let mesh = Mesh {
///     points: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
///     cells: vec![Cell::Triangle([0, 1, 2])],
///     on_points: Vec::new(),
///     on_cells: vec![Quantity { name: "u".to_owned(), numbers: vec![2.5] }],
/// };
/// assert!(mesh.vtu()?.contains("<Piece NumberOfPoints=\"3\" NumberOfCells=\"1\">"));
/// # Ok::<(), fredholm_plot::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// The points.
    pub points: Vec<[f64; 3]>,
    /// The cells.
    pub cells: Vec<Cell>,
    /// The quantities that points have.
    pub on_points: Vec<Quantity>,
    /// The quantities that cells have.
    pub on_cells: Vec<Quantity>,
}

impl Mesh {
    /// The mesh of triangles and quadrilaterals with these corners, of which each has points of its own.
    ///
    /// ```
    /// use fredholm_plot::Mesh;
    ///
    /// let mesh = Mesh::of_cells(&[vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]);
    /// assert_eq!((mesh.points.len(), mesh.cells.len()), (3, 1));
    /// ```
    #[must_use]
    pub fn of_cells(corners: &[Vec<[f64; 3]>]) -> Self {
        let mut mesh = Self::default();
        for own in corners {
            let at = mesh.points.len();
            mesh.points.extend(own);
            mesh.cells.push(match own[..] {
                [_, _, _] => Cell::Triangle([at, at + 1, at + 2]),
                _ => Cell::Quad([at, at + 1, at + 2, at + 3]),
            });
        }
        mesh
    }

    /// The text of a `.vtu` file, VTK's XML format of unstructured grids. Numbers keep their bits; a viewer shows the first
    /// quantity.
    ///
    /// # Errors
    /// [`Error::NothingToDraw`]: no point. [`Error::NoSuchPoint`], [`Error::WrongLength`].
    pub fn vtu(&self) -> Result<String, Error> {
        self.check()?;
        let points = self.points.len();
        let corners = self.cells.iter().flat_map(Cell::corners).copied();
        let ends = self.cells.iter().scan(0, |end, cell| {
            *end += cell.corners().len();
            Some(*end)
        });
        let kinds: Vec<u8> = self.cells.iter().map(Cell::kind).collect();
        let places = doubles(self.points.iter().flatten());
        let text = [
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
             header_type=\"UInt64\">\n<UnstructuredGrid>\n"
                .to_owned(),
            format!("<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{}\">\n", kinds.len()),
            "<Points>\n".to_owned(),
            array("Float64\" NumberOfComponents=\"3", "position", &places),
            "</Points>\n<Cells>\n".to_owned(),
            array("Int64", "connectivity", &integers(corners)),
            array("Int64", "offsets", &integers(ends)),
            array("UInt8", "types", &kinds),
            "</Cells>\n".to_owned(),
            quantities("PointData", &self.on_points),
            quantities("CellData", &self.on_cells),
            "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n".to_owned(),
        ];
        Ok(text.concat())
    }

    /// Refuses what does not fit together.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let points = self.points.len();
        if points == 0 {
            return Err(Error::NothingToDraw);
        }
        let mut corners = self.cells.iter().flat_map(Cell::corners).copied();
        if let Some(corner) = corners.find(|&corner| corner >= points) {
            return Err(Error::NoSuchPoint { corner, points });
        }
        let of_points = self.on_points.iter().map(|own| ("points", points, own));
        let of_cells = self.on_cells.iter();
        let of_cells = of_cells.map(|own| ("cells", self.cells.len(), own));
        of_points
            .chain(of_cells)
            .try_for_each(|(of, expected, own)| {
                Error::unless_equal(of, expected, own.numbers.len())
            })
    }
}

/// The quantities of points or of cells.
fn quantities(of: &str, all: &[Quantity]) -> String {
    let first = all.first().map_or(String::new(), |first| {
        format!(" Scalars=\"{}\"", escaped(&first.name))
    });
    let text = |own: &Quantity| {
        let numbers = doubles(own.numbers.iter());
        array("Float64", &escaped(&own.name), &numbers)
    };
    let all: String = all.iter().map(text).collect();
    format!("<{of}{first}>\n{all}</{of}>\n")
}

/// An array, its number of bytes first.
fn array(kind: &str, name: &str, bytes: &[u8]) -> String {
    let size = (bytes.len() as u64).to_le_bytes();
    let text = base64(&[&size, bytes].concat());
    format!("<DataArray type=\"{kind}\" Name=\"{name}\" format=\"binary\">{text}</DataArray>\n")
}

fn doubles<'a>(numbers: impl Iterator<Item = &'a f64>) -> Vec<u8> {
    numbers.flat_map(|x| x.to_le_bytes()).collect()
}

fn integers(numbers: impl Iterator<Item = usize>) -> Vec<u8> {
    numbers.flat_map(|i| (i as u64).to_le_bytes()).collect()
}

/// A text as the value of an attribute.
fn escaped(text: &str) -> String {
    let escape = |c| match c {
        '&' => "&amp;".to_owned(),
        '<' => "&lt;".to_owned(),
        '>' => "&gt;".to_owned(),
        '"' => "&quot;".to_owned(),
        // XML has no other control characters.
        c if c.is_control() => " ".to_owned(),
        c => c.to_string(),
    };
    text.chars().map(escape).collect()
}

/// The cells between these points of a mesh, which are a grid of so many along every axis, the last axis the fastest: lines,
/// squares or cubes between neighbours along all axes that have several, and of points that are no grid (no axis) each
/// one by itself. If a line of three points or more is closed, its last point is joined with its first.
///
/// ```
/// use fredholm_plot::{Cell, lattice};
///
/// assert_eq!(lattice(&[2, 2], 5..9, false), [Cell::Quad([5, 7, 8, 6])]);
/// assert_eq!(lattice(&[3], 0..3, true)[2], Cell::Line([2, 0]));
/// ```
#[must_use]
pub fn lattice(counts: &[usize], points: Range<usize>, is_closed: bool) -> Vec<Cell> {
    let mut axes = Vec::new();
    let mut stride = 1;
    for &count in counts.iter().rev() {
        if count > 1 {
            axes.push((stride, count));
        }
        stride *= count;
    }
    let is_inner = |i: &usize| {
        let mut axes = axes.iter();
        axes.all(|(stride, count)| (i - points.start) / stride % count + 1 < *count)
    };
    let square = |b: usize, s: usize, t: usize| [b, b + s, b + s + t, b + t];
    let cell = |b: usize| match *axes {
        [(s, _)] => Cell::Line([b, b + s]),
        [(s, _), (t, _)] => Cell::Quad(square(b, t, s)),
        [(s, _), (t, _), (r, _)] => {
            let [[a, b, c, d], [e, f, g, h]] = [b, b + r].map(|b| square(b, t, s));
            Cell::Hexahedron([a, b, c, d, e, f, g, h])
        }
        _ => Cell::Vertex([b]),
    };
    let ends = [points.end.saturating_sub(1), points.start];
    let is_ring = is_closed && axes.len() == 1 && points.len() > 2;
    let closing = is_ring.then_some(Cell::Line(ends));
    let inner = points.clone().filter(is_inner).map(cell);
    inner.chain(closing).collect()
}

#[cfg(test)]
mod tests {
    use super::{Cell, Mesh, Quantity};
    use crate::Error;
    use crate::page::base64;

    fn quantity(name: &str, numbers: &[f64]) -> Quantity {
        Quantity {
            name: name.to_owned(),
            numbers: numbers.to_vec(),
        }
    }

    /// A triangle beside a segment, the arrays of which are written out by hand.
    #[test]
    fn a_mesh_is_written_as_the_format_says() {
        let mesh = Mesh {
            points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2.0, -0.5]],
            cells: vec![Cell::Triangle([0, 1, 2]), Cell::Line([2, 0])],
            on_points: vec![quantity("a < \"b\"", &[f64::NAN, 1e-300, 3.0])],
            on_cells: vec![quantity("error", &[0.1, 0.2])],
        };
        let text = mesh.vtu().unwrap();
        let whole = |numbers: &[u64]| {
            let size = 8 * numbers.len() as u64;
            let all: Vec<u8> = [&[size], numbers]
                .concat()
                .iter()
                .flat_map(|i| i.to_le_bytes())
                .collect();
            base64(&all)
        };
        let bits =
            |numbers: &[f64]| whole(&numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>());
        let kinds = [2, 0, 0, 0, 0, 0, 0, 0, 5, 3];
        for (name, numbers) in [
            (
                "position",
                bits(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, -0.5]),
            ),
            ("connectivity", whole(&[0, 1, 2, 2, 0])),
            ("offsets", whole(&[3, 5])),
            ("types", base64(&kinds)),
            ("a &lt; &quot;b&quot;", bits(&[f64::NAN, 1e-300, 3.0])),
            ("error", bits(&[0.1, 0.2])),
        ] {
            let array = format!("Name=\"{name}\" format=\"binary\">{numbers}</DataArray>");
            assert!(text.contains(&array), "{array} in {text}");
        }
        assert!(text.contains("<CellData Scalars=\"error\">"));
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let mesh = Mesh {
            points: vec![[0.0; 3]],
            cells: vec![Cell::Line([0, 1])],
            ..Mesh::default()
        };
        let (corner, points) = (1, 1);
        assert_eq!(mesh.vtu(), Err(Error::NoSuchPoint { corner, points }));
        let mesh = Mesh {
            cells: vec![Cell::Vertex([0])],
            on_cells: vec![quantity("u", &[])],
            ..mesh
        };
        let wrong = Error::unless_equal("cells", 1, 0).unwrap_err();
        assert_eq!(mesh.vtu(), Err(wrong));
        assert_eq!(Mesh::default().vtu(), Err(Error::NothingToDraw));
    }
}
