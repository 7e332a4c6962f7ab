//! The files of `solve --out`: the numbers of a report as JSON, CSV, arrays, a mesh or a picture.

use std::path::{Path, PathBuf};

use fredholm::Sensitivities;
use fredholm::model::WholeValues;
use fredholm::report::{Column, Columns, GlobalReport, Report};
use fredholm_file::npz::Archive;
use fredholm_file::parts::output::Output;
use fredholm_plot::{Cell, Figure, GridPicture, Mesh, Quantity, lattice};
use serde::Serialize;

use crate::failure::Failure;
use crate::file::{self, Resolution, What};
use crate::solve::Problem;
use crate::table;

/// The kinds of result files.
pub(crate) enum Format {
    Json,
    Csv,
    Npz,
    /// Of all grids, one below the other.
    Svg(Vec<Shown>),
    /// With the places of all targets that are points, and the cells between those of grids; for ParaView, or glTF with colours.
    Mesh(Places, fn(&Mesh) -> Result<Vec<u8>, fredholm_plot::Error>),
}

/// A grid target in a picture: its name, and of two axes its first target and the numbers of points.
pub(crate) struct Shown {
    name: String,
    map: Option<(usize, [usize; 2])>,
}

/// What files are made of.
pub(crate) trait Results: Serialize {
    fn csv(&self) -> Result<String, fredholm::Error>;
    fn svg(&self, grid: &str) -> Result<Figure, Failure>;
    fn columns(&self) -> Columns;
    fn table(&self) -> String;
    fn remarks(&self) -> Vec<String>;

    /// The derivatives of targets, if they are wanted.
    fn sensitivities(&self) -> Option<&Sensitivities> {
        None
    }
}

impl Format {
    /// What to write where, known to be possible before any work is done.
    pub(crate) fn open(path: &Path, problem: &Problem) -> Result<(Self, Output), Failure> {
        Self::open_of(path, problem, false)
    }

    /// What to write where; `is_of_faces` if values are those of all faces, and not of targets.
    pub(crate) fn open_of(
        path: &Path,
        problem: &Problem,
        is_of_faces: bool,
    ) -> Result<(Self, Output), Failure> {
        let places = || match is_of_faces {
            true => Ok(Places::default()),
            false => Places::new(problem),
        };
        let refuse = |why: &str| Failure::of_out(path, why);
        let format = match path.extension().and_then(|e| e.to_str()) {
            Some("json") => Self::Json,
            Some("csv") => Self::Csv,
            Some("npz") => Self::Npz,
            Some("svg") if is_of_faces => {
                return Err(refuse(
                    "the name must end in .json, .csv, .npz, .vtu or .glb",
                ));
            }
            Some("svg") => {
                let is_grid = |target: &&file::Target| {
                    matches!(target.what, What::Grid(..) | What::Lattice(..))
                };
                let shown = |grid: &file::Target| {
                    let name = grid.name.value.clone();
                    let map = match counts(&grid.what, 0)[..] {
                        [rows, columns] => {
                            let mut goals = problem.goals.iter();
                            let first = goals.position(|of| table::is_of(&of.name, &name));
                            Some((first.unwrap_or(0), [rows, columns]))
                        }
                        [_] => None,
                        _ => return Err(refuse("a picture shows grids of one or two axes")),
                    };
                    Ok(Shown { name, map })
                };
                let grids = problem.file.targets.iter().filter(is_grid);
                let all = grids.map(shown).collect::<Result<Vec<_>, _>>()?;
                if all.is_empty() {
                    return Err(refuse("a picture needs a target with `grid = points`"));
                }
                Self::Svg(all)
            }
            Some("vtu") => Self::Mesh(places().map_err(refuse)?, |mesh| {
                mesh.vtu().map(String::into_bytes)
            }),
            Some("glb") => {
                let places = places().map_err(refuse)?;
                let is_flat = |cell: &Cell| matches!(cell, Cell::Quad(_));
                if !places.points.is_empty() && !places.cells.iter().any(is_flat) {
                    return Err(refuse("glTF shows grids of two axes, and cells of scenes"));
                }
                Self::Mesh(places, Mesh::glb)
            }
            _ => {
                return Err(refuse(
                    "the name must end in .json, .csv, .npz, .svg, .vtu or .glb",
                ));
            }
        };
        Ok((format, Output::open("--out", path)?))
    }

    /// The file of `--out`, or else those that the problem file names; none in a process that writes nothing.
    pub(crate) fn open_all(
        out: Option<&Path>,
        problem: &Problem,
        writes: bool,
    ) -> Result<Vec<(Self, Output)>, Failure> {
        let own = problem.file.files.iter();
        let own = own.map(|file| problem.file.beside(Path::new(&file.value)));
        let all: Vec<PathBuf> = out.map_or_else(|| own.collect(), |out| vec![out.to_owned()]);
        let all = all.iter().filter(|_| writes);
        all.map(|path| Self::open(path, problem)).collect()
    }

    /// The content of the file.
    pub(crate) fn content(&self, report: &impl Results) -> Result<Vec<u8>, Failure> {
        Ok(match self {
            Self::Json => table::json(report)?.into_bytes(),
            Self::Csv => report.csv().map_err(Failure::run)?.into_bytes(),
            Self::Npz => npz(report)?,
            Self::Svg(all) => {
                let picture = |grid: &Shown| match grid.map {
                    Some(map) => maps(report, &grid.name, map),
                    None => report.svg(&grid.name),
                };
                let figures = all.iter().map(picture).collect::<Result<_, _>>()?;
                table::drawn(Ok(Figure::stacked(figures)))?.into_bytes()
            }
            Self::Mesh(places, written) => {
                let mesh = match report.sensitivities() {
                    Some(all) if !places.faces.is_empty() => places.of_derivatives(all),
                    _ => places.mesh(report.columns()),
                };
                written(&mesh).map_err(Failure::run)?
            }
        })
    }
}

/// Writes all files, or says why not.
pub(crate) fn finish(all: Vec<(Format, Output)>, report: &impl Results) -> Result<(), Failure> {
    let mut all = all.into_iter();
    all.try_for_each(|(format, output)| Ok(output.finish(format.content(report)?)?))
}

/// Pictures of the values on a grid of two axes and of their standard errors, one below the other.
fn maps(
    report: &impl Results,
    grid: &str,
    (first, counts): (usize, [usize; 2]),
) -> Result<Figure, Failure> {
    let all = first..first + counts[0] * counts[1];
    let columns = report.columns();
    let end = |i: usize| {
        columns
            .coordinates
            .get(i)
            .and_then(|x| <[f64; 2]>::try_from(&x[..]).ok())
    };
    let ends = [end(all.start), end(all.end - 1)].map(|end| end.unwrap_or([f64::NAN; 2]));
    let all_columns = columns.of_targets.iter();
    let shown = all_columns.filter(|(name, _)| ["estimate", "std_error"].contains(name));
    let picture = |(name, column): &(&'static str, Vec<f64>)| {
        let words = [
            ("u", "the solution u(x1, x2)"),
            ("error", "its standard error"),
        ];
        let (legend, caption) = words[usize::from(*name == "std_error")];
        GridPicture {
            ends,
            counts,
            numbers: column.get(all.clone()).unwrap_or_default(),
            legend,
            caption: format!("{grid}: {caption}, x1 to the right and x2 upwards"),
        }
        .draw()
        .map_err(Failure::run)
    };
    let figures = shown.map(picture).collect::<Result<_, _>>()?;
    Ok(Figure::stacked(figures))
}

/// An array for every column, and the names and coordinates of targets.
fn npz(report: &impl Results) -> Result<Vec<u8>, Failure> {
    let Columns {
        names,
        coordinates: at,
        of_targets,
        ..
    } = report.columns();
    let mut archive = Archive::default();
    archive.texts("name", &names)?;
    let axes = at.iter().map(Vec::len).max().unwrap_or(0);
    let none = [f64::NAN].iter().cycle();
    let padded = at
        .iter()
        .flat_map(|x| x.iter().chain(none.clone()).take(axes));
    archive.numbers("at", &[names.len(), axes], padded)?;
    for (name, numbers) in of_targets {
        archive.numbers(name, &[names.len()], numbers.iter())?;
    }
    Ok(archive.finish()?)
}

/// Where targets are in space: nowhere in a scene whose global estimate is asked for, which shows its cells, or whose sensitivities are, which show
/// its faces.
#[derive(Default)]
pub(crate) struct Places {
    /// The faces, each with the name of its surface.
    faces: Vec<(String, Vec<[f64; 3]>)>,
    /// The numbers of the targets that are points, and their places.
    points: Vec<(usize, [f64; 3])>,
    cells: Vec<Cell>,
}

impl Places {
    fn new(problem: &Problem) -> Result<Self, &'static str> {
        let model = problem.model();
        if let (true, Resolution::Scene(model)) = (
            problem.resolved.settings.sensitivities,
            &problem.resolved.model,
        ) {
            let faces = model.scene().faces().iter().enumerate();
            let faces = faces.filter_map(|(number, face)| {
                let name = model.names().get(model.scene().place(number)?.surface)?;
                Some((name.clone(), face.polygon().to_vec()))
            });
            return Ok(Self {
                faces: faces.collect(),
                ..Self::default()
            });
        }
        let about = model.about();
        let has_points = about.whole == WholeValues::Points;
        if !has_points && problem.resolved.settings.global == Some(true) {
            return Ok(Self::default());
        }
        let is_closed = about.kind == "circle";
        let all = problem.goals.iter().enumerate();
        let places = all.filter_map(|(i, goal)| Some((i, model.place(&goal.region)?)));
        let points: Vec<_> = places.collect();
        if points.is_empty() {
            return Err(match about.dimension {
                _ if !has_points => "no target is a point: `--global` has all cells",
                None | Some(..=3) => "no target is a point",
                _ => "a mesh has three dimensions at most: write .csv or .npz",
            });
        }
        let mut cells = Vec::new();
        let mut goals = problem.goals.iter().peekable();
        let (mut goal, mut from) = (0, 0);
        for target in &problem.file.targets {
            let name = &target.name.value;
            while goals.next_if(|of| table::is_of(&of.name, name)).is_some() {
                goal += 1;
            }
            let to = points.partition_point(|(i, _)| *i < goal);
            cells.extend(lattice(
                &counts(&target.what, to - from),
                from..to,
                is_closed,
            ));
            from = to;
        }
        Ok(Self {
            points,
            cells,
            ..Self::default()
        })
    }

    /// The faces with the derivatives of every target by what their surfaces are, "desk by reflectance" say; 0 where a surface has none. What
    /// matters most comes first.
    fn of_derivatives(&self, all: &Sensitivities) -> Mesh {
        let corners: Vec<_> = self.faces.iter().map(|(_, own)| own.clone()).collect();
        let mut on_cells: Vec<Quantity> = Vec::new();
        let names: Vec<&str> = self.faces.iter().map(|(name, _)| name.as_str()).collect();
        for own in &all.derivatives {
            let word = |name: &str| own.quantity.strip_prefix(name)?.strip_prefix(' ');
            let surfaces = names.iter().filter(|name| word(name).is_some());
            let Some(surface) = surfaces.max_by_key(|name| name.len()) else {
                continue;
            };
            let name = format!("{} by {}", own.target, word(surface).unwrap_or_default());
            let known = on_cells.iter().position(|quantity| quantity.name == name);
            let known = known.unwrap_or_else(|| {
                let numbers = vec![0.0; names.len()];
                on_cells.push(Quantity { name, numbers });
                on_cells.len() - 1
            });
            let numbers = names.iter().zip(&mut on_cells[known].numbers);
            let numbers = numbers.filter(|(name, _)| *name == surface);
            numbers.for_each(|(_, number)| *number = own.derivative);
        }
        Mesh {
            on_cells,
            ..Mesh::of_cells(&corners)
        }
    }

    fn mesh(&self, columns: Columns) -> Mesh {
        if !columns.mesh.is_empty() {
            return of_cells(columns);
        }
        let at = |all: Vec<f64>| self.points.iter().map(|(i, _)| all[*i]).collect();
        let of_points = columns.of_targets.into_iter();
        let of_points = of_points.map(|(name, all)| quantity((name, at(all))));
        Mesh {
            points: self.points.iter().map(|(_, place)| *place).collect(),
            cells: self.cells.clone(),
            on_points: of_points.collect(),
            on_cells: columns.of_cells.into_iter().map(quantity).collect(),
        }
    }

    /// The targets in a corner of every cell and beside it along every axis.
    fn axes(&self) -> Vec<Vec<usize>> {
        let target = |point: usize| self.points[point].0;
        let of = |cell: &Cell| cell.axes().into_iter().map(target).collect();
        self.cells.iter().map(of).collect()
    }
}

fn quantity((name, numbers): Column) -> Quantity {
    let name = name.to_owned();
    Quantity { name, numbers }
}

/// The cells of a scene.
fn of_cells(columns: Columns) -> Mesh {
    let mesh = Mesh::of_cells(&columns.mesh);
    let cells = mesh.cells.len();
    // Behind the targets.
    let own = |(name, mut all): Column| quantity((name, all.split_off(all.len() - cells)));
    let on_cells = columns.of_targets.into_iter().map(own).collect();
    Mesh { on_cells, ..mesh }
}

/// The cells of which a file shows means.
pub(crate) fn means_between(all: &[(Format, Output)]) -> Vec<Vec<usize>> {
    let places = all.iter().find_map(|(format, _)| match format {
        Format::Mesh(places, _) => Some(places.axes()),
        _ => None,
    });
    places.unwrap_or_default()
}

/// The numbers of points of a target along every axis; of others than grids there is none.
fn counts(what: &What, points: usize) -> Vec<usize> {
    match what {
        What::Grid(..) => vec![points],
        What::Lattice(counts) => counts.value.iter().map(|count| count.value).collect(),
        _ => Vec::new(),
    }
}

impl Results for Report {
    fn csv(&self) -> Result<String, fredholm::Error> {
        Self::csv(self)
    }

    fn svg(&self, grid: &str) -> Result<Figure, Failure> {
        match &self.whole {
            Some(whole) => table::whole_svg(whole, grid),
            None => table::svg(self, grid),
        }
    }

    fn columns(&self) -> Columns {
        Self::columns(self)
    }

    fn table(&self) -> String {
        Self::table(self)
    }

    fn remarks(&self) -> Vec<String> {
        Self::remarks(self)
    }

    fn sensitivities(&self) -> Option<&Sensitivities> {
        self.sensitivities.as_ref()
    }
}

impl Results for GlobalReport {
    fn csv(&self) -> Result<String, fredholm::Error> {
        Self::csv(self)
    }

    fn svg(&self, grid: &str) -> Result<Figure, Failure> {
        table::whole_svg(self, grid)
    }

    fn columns(&self) -> Columns {
        Self::columns(self)
    }

    fn table(&self) -> String {
        Self::table(self)
    }

    fn remarks(&self) -> Vec<String> {
        self.summary.remarks()
    }
}
