//! The command line.

use core::time::Duration;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;
use fredholm::{Choices, Estimator, Form, GlobalQuantity, Pairs, Scalar, Sequence};
use fredholm_file::parts::Share;
use fredholm_file::{ProblemFile, SetByFlag as _, Walk};

use crate::failure::Failure;
use crate::init::names;
use crate::solve::time_limit;

/// The version, the commit if this is known of a release, and the version of results.
fn version() -> &'static str {
    static VERSION: LazyLock<String> = LazyLock::new(|| {
        let commit = match env!("FREDHOLM_COMMIT") {
            "" => String::new(),
            commit => format!("commit {commit}, "),
        };
        let (own, values) = (env!("CARGO_PKG_VERSION"), fredholm::VALUE_VERSION);
        format!("{own} ({commit}version {values} of results)")
    });
    &VERSION
}

/// Solves Fredholm integral equations u = T_K u + F of the second kind by random walks whose
/// variance is reduced by a neighbour equation. Results are unbiased and carry an error bar.
#[derive(Debug, Parser)]
#[command(
    name = "fredholm",
    version = version(),
    about,
    long_about = None,
    after_help = "\
Begin with:
  fredholm paper                 the experiment of Heinrich 1995, section 5
  fredholm init cube > a.toml    a commented problem file, for your equation on [0, 1]^d
  fredholm solve a.toml          solve it
  fredholm render room.toml -o room.png   a room with its light and shadows

Exit status: 0 done; 1 a failure on the way; 2 bad usage or input; 3 the requested error was not \
reached (results are printed); 130 interrupted (what was finished is printed)."
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Repeat the experiment of Heinrich 1995, section 5, beside the paper's numbers
    Paper(PaperArgs),
    /// Solve the problem of a file
    #[command(after_help = "\
Options override the file's values; the file's keys have the same names (`fredholm init circle`). \
A result is `estimate ± standard error`; about 68 % of such intervals contain the exact value, and \
about 95 % of those twice as wide.

Anything the file leaves out (cells, degree, pairs, walks) is chosen automatically: few walks on few cells measure the \
variance, and the setting wins that reaches the target error soonest, or without one leaves the least variance for its time; plain Monte \
Carlo if a neighbour equation is not worth its cost. The choice is printed, follows from the file alone, and may be \
written into it.")]
    Solve(SolveArgs),
    /// Targets of a scene under the suns and skies of many times, a year's hours say
    #[command(after_help = "\
TIMES is a CSV file whose first line names its columns: `time`; `altitude` and `azimuth` of the sun in degrees, from north, the axis \
y, over east, or `x`, `y`, `z` towards it; `beam`, the irradiance of a surface that faces the sun; and `diffuse`, that of a \
horizontal one by the sky. How the sky is distributed the scene says: `sky = { emission = 1 }`.

  fredholm times office.toml year.csv --out lux.csv

One set of walks serves all times, and every value has a standard error. With a target error there are as many walks as leave no \
time a larger one.")]
    Times(TimesArgs),
    /// A quantity on every face of a scene, with an error bar each and a band for all
    #[command(after_help = "\
Of every polygon of the scene the mean, by walks of its own: also of black surfaces, of which u tells nothing, and in scenes of a million \
triangles.

  fredholm faces street.toml --target-error 0.02 --relative --out street.vtu

Targets of the file are not looked at. With a target error every face takes as many walks as it needs. With `--cells` a neighbour equation \
is solved first, which takes some time and most of the noise; without, walks are plain.")]
    Faces(FacesArgs),
    /// Make one result of the parts of a run, in any order
    #[command(after_help = "\
Prints what `solve` prints, with the bits of a run that nobody divided. Of parts that are not all there, or not \
finished, it is the result of the longest beginning without a gap, and the missing parts are named (exit status 3). \
A part may come twice. Parts of another problem, seed or version are refused, with what differs.

  for k in 1 2 3 4; do fredholm solve FILE.toml --walks 4000000 --part $k/4 --save part-$k; done
  fredholm merge part-*

With --target-error the result is that of `solve` with the same number of walks and this target error: walks end after the \
stage in which it is reached. If it is not, the number of walks that it would take is printed.")]
    Merge(MergeArgs),
    /// Validate a file; print cells, memory and predicted time
    #[command(after_help = "\
Nothing is run, except the pilot walks of a file that gives a target error and leaves cells open: what \
`solve` would choose is printed.")]
    Check {
        /// The problem file (TOML), or a mesh or deck of a scene (.obj, .stl, .ply, .vs3)
        file: PathBuf,
        /// Rooms and scenes: draw the surfaces with their names, and of rooms active sides and where light leaves, into this
        /// file (.svg)
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Say how wrong a solution is that somebody else has found, with error bars
    #[command(after_help = "\
The solution is a formula, or a file of points and values. In a .csv file a head names the columns (coordinates, `surface`, \
`t`, `name` of a target, `value`); without one the last column is the value. An .npz file has arrays with such names, and a \
.vtu or .glb file is a mesh with values. A formula is compared with u at the targets of the file and at some 256 points all over the \
space, a file at its own points. Form factors (.csv of from, to, factor, .npz, or View3D's text) are compared with exact ones.

  fredholm certify FILE.toml --with \"1.2 * x\"
  fredholm certify FILE.toml --with nodes.csv --out errors.svg
  fredholm certify FILE.toml --factors theirs.csv

How exact u is follows from the file, --target-error or --walks, as for `solve`. Exit status: 0 if the solution is right to \
within the band, 1 if it is wrong, 3 if it is right and the target error was not reached.")]
    Certify(CertifyArgs),
    /// Find quantities, such as emissivities, from measured targets
    #[command(after_help = "\
The file names what is looked for, `quantities = [\"floor emissivity\"]` in `[fit]`, and what was measured, in `[[target]]`: \
`measured = { value = 0.31, error = 0.01 }`, or `temperature = 1012` in place of `value`. The values in the file are where \
the search starts; `[uncertainties]` holds how well other quantities are known, and what was known of these before.

  fredholm fit FILE.toml
  fredholm fit FILE.toml --out found.toml

The result has standard errors, correlations, the misfit of every target, and χ². Exit status: 0, or 1 if the model does not \
explain the measurements.")]
    Fit(FitArgs),
    /// Measure how fast the error falls with cells and walks, beside theory and other methods
    #[command(after_help = "\
A sweep over cells n with n² walks each, for the mean of u. The table has the standard deviation and \
the error against work, set-up counted, of preconditioned walks, of plain walks, of the Galerkin \
solution alone and, for cubes, of Gauss-Nyström, and the fitted exponents beside theory's. Work is \
kernel evaluations; for rooms, whose shadows cost more than their kernel, measured seconds, and so for \
several degrees, which are put into one table and one figure: --degree 0,1,2,3,4 shows which pays. The \
file's cells and targets are not used. With --walks, n² walks are what error and work are said of, and the \
standard deviation and the time of a walk come from as many as it says.")]
    Rates(RatesArgs),
    /// Predict the variance before any walk, and say what limits it
    #[command(after_help = "\
The standard deviations of plain and preconditioned walks for every target of the file, by the theory of \
Heinrich 1995 (Proposition 2), with integrals in about --nodes points; what the variance of the preconditioned walks is \
made of, and where: pairs of places between which kernels differ, and places at which the sources do; the \
quantities and bounds of the paper (absorption estimator); and whether variances are finite at all. Cells, degree \
and pairs that are open are those that `solve` would choose for separate walks, but no more cells than --nodes \
points are enough for. The file's scalar is not used.")]
    Diagnose(DiagnoseArgs),
    /// Draw a room with its light and shadows
    #[command(after_help = "\
Example:
  fredholm render examples/furnished.toml -o room.png

The walls have the colour of their radiosity u, on their active side. Between them every pixel shows \
the mean radiosity that it sees, (1/2π) ∫ u dω over all directions (π times that is the fluence): from \
the Galerkin solution exactly, by visible angles, so that shadows have no noise, plus what --walks walks \
a pixel find to be missing, so that the picture is unbiased. What no light reaches, behind walls and \
within obstacles, is blank. The same file gives the same bytes for any number of threads, except with \
--side-by-side, which compares what plain and preconditioned walks do in the same time. The file's \
targets, walks and pairs are not used.

Of a scene in space the picture is what a camera sees: light in greys, white where all but a fiftieth is darker, heat in \
colours. A pixel is the mean of u over it, unbiased.

  fredholm render FILE.toml -o field.csv           the numbers behind the pixels
  fredholm render FILE.toml --profile -o walls.svg  u along all walls, with a band of ±2 standard errors")]
    Render(RenderArgs),
    /// Print the form factors between the surfaces of a room, or of a scene in space
    #[command(after_help = "\
Exact, obstacles included: in space pairs that see each other wholly by closed forms, others by cutting what is hidden away, \
to --error. A row's sum is 1 in a closed scene. Areas times form factors are symmetric: one number is kept for both.")]
    Factors(FactorsArgs),
    /// Write the Galerkin solution and the neighbour equation as tables for a microcontroller
    #[command(after_help = "\
Of rooms, scenes and cubes. The table is read in place by `fredholm_embedded::Tables`, which checks it. Kernel and source of a \
cube are formulas here and must be written in Rust there.")]
    Export(ExportArgs),
    /// Compare published numbers with what this program finds
    #[command(after_help = "\
A hundred numbers that others published or derived, each with its source: exact solutions on the circle \
and on the cube, form factors to twelve digits, light in rooms, the paper's deviations and rates. Every \
one is asked for as you would ask: by a problem file, which is built in, with fixed seeds.

An estimate agrees if it is at most 4 of its standard errors off, and so must be that of plain walks (z and \
plain z are the distances in standard errors); an exact number if it has every printed digit; a rate or \
a size that depends on random choices which were not printed, if it is within the latitude that the \
table states. Exit status: 0 if all agree, 1 if not, 130 interrupted (what was finished is printed).")]
    Verify(Common),
    /// Print a commented problem file
    #[command(after_help = "\
Begin with:
  fredholm init cube > a.toml    a file of this kind, to be changed
  fredholm init satellite.toml | fredholm solve /dev/stdin")]
    Init {
        /// A kind of problem, or an example
        #[arg(value_parser = beginnings())]
        name: String,
    },
    /// Print the manual page of the program, or write those of all commands into a folder
    #[command(after_help = "\
  fredholm man | man -l -                 reads the page of the program
  fredholm man ~/.local/share/man/man1    makes `man fredholm` and `man fredholm-solve` find theirs")]
    Man {
        /// The folder for fredholm.1, fredholm-solve.1 and so on; it must be there
        folder: Option<PathBuf>,
    },
    /// Print a completion script for a shell
    Completions {
        /// The shell
        shell: Shell,
    },
}

/// Options of `paper`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub(crate) struct PaperArgs {
    /// The most walks for a point; the table has 10, 100, … up to it
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(10..))]
    pub(crate) max_walks: u64,
    /// Degree of the piecewise polynomials, 0 to 4; the paper's is 0
    #[arg(long, value_name = "p", default_value_t = 0, value_parser = degree)]
    pub(crate) degree: usize,
    /// Seed of the reflectances, the points and the walks
    #[arg(long, value_name = "S", default_value_t = 1995)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) common: Common,
    /// Write table.csv, table.json and the figures error.svg and deviation.svg into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

/// Options of `rates`.
#[derive(Debug, Args)]
pub(crate) struct RatesArgs {
    /// The problem file (TOML)
    pub(crate) file: PathBuf,
    /// Cells of the levels (per axis for cubes) [default: some that take seconds]
    #[arg(long, value_name = "n,…", value_delimiter = ',')]
    pub(crate) cells: Vec<usize>,
    /// Walks that every level's standard deviation is measured on [default: n² and at least 65536, at
    /// the finest 4194304]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..))]
    pub(crate) walks: Option<u64>,
    /// How the neighbour equation treats pairs of cells
    #[arg(long, value_name = "NAME", value_parser = choices::<Pairs>())]
    pub(crate) pairs: Option<Pairs>,
    /// Rooms: how cells shrink towards corners; 1 makes them equal
    #[arg(long, value_name = "g")]
    pub(crate) grading: Option<f64>,
    /// Rooms: cut walls at the edges of shadows too
    #[arg(long)]
    pub(crate) shadow_cuts: bool,
    /// Degree of the piecewise polynomials; several are compared by the clock
    #[arg(long, value_name = "p,…", value_delimiter = ',')]
    pub(crate) degree: Vec<usize>,
    /// Seed of the walks
    #[arg(long, value_name = "S")]
    pub(crate) seed: Option<u64>,
    #[command(flatten)]
    pub(crate) common: Common,
    /// Write rates.csv, rates.json and the figures work-error.svg and deviation.svg into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

/// How exact a solution is that another question needs.
#[derive(Debug, Args)]
pub(crate) struct WalkArgs {
    /// Walk until the standard errors of u are no larger
    #[arg(long, visible_alias = "error", value_name = "E")]
    pub(crate) target_error: Option<f64>,
    /// Interpret the target error relative to the estimate
    #[arg(long)]
    pub(crate) relative: bool,
    /// Walks for each value, or for all if one set of walks answers them; with a target error the maximum number
    #[arg(long, value_name = "N", value_parser = count::<u64>)]
    pub(crate) walks: Option<u64>,
    /// Stop walking after this time with what has been done by then; of several solutions each
    #[arg(long, value_name = "SECONDS")]
    pub(crate) time_limit: Option<f64>,
    /// Seed of the walks
    #[arg(long, value_name = "S", value_parser = count::<u64>)]
    pub(crate) seed: Option<u64>,
}

impl WalkArgs {
    /// Puts what is given in the place of what the file says.
    pub(crate) fn replace(&self, walk: &mut Walk) {
        walk.walks.set_by("--walks", self.walks);
        walk.seed.set_by("--seed", self.seed);
        walk.target_error
            .set_by("--target-error", self.target_error);
        walk.relative
            .set_by("--relative", self.relative.then_some(true));
    }

    /// The time limit.
    pub(crate) fn limit(&self) -> Result<Option<Duration>, Failure> {
        self.time_limit.map(time_limit).transpose()
    }
}

/// Options of `certify`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub(crate) struct CertifyArgs {
    /// The problem file (TOML); for form factors also a deck or a mesh
    pub(crate) file: PathBuf,
    /// The solution: a formula in x, or x1, x2, …, or a file of points and values (.csv, .npz, .vtu, .glb). Of several channels or
    /// components give one formula for each
    #[arg(
        long,
        value_name = "SOLUTION",
        required_unless_present = "factors",
        allow_hyphen_values = true
    )]
    pub(crate) with: Vec<String>,
    /// Form factors in place of a solution: .csv (from, to, factor) or View3D's text
    #[arg(long, value_name = "FILE", conflicts_with_all = ["with", "target_error", "relative", "walks", "time_limit", "seed"])]
    pub(crate) factors: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) walk: WalkArgs,
    #[command(flatten)]
    pub(crate) common: Common,
    /// Write all values to this file: .json, .csv, or .svg for a picture of the errors along one coordinate; of form factors .json
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Options of `fit`.
#[derive(Debug, Args)]
pub(crate) struct FitArgs {
    /// The problem file (TOML)
    pub(crate) file: PathBuf,
    /// A quantity that is looked for, in place of those of the file; may come several times
    #[arg(long, value_name = "NAME")]
    pub(crate) quantity: Vec<String>,
    #[command(flatten)]
    pub(crate) walk: WalkArgs,
    #[command(flatten)]
    pub(crate) common: Common,
    /// Write the file with the values that were found (.toml), or the result (.json)
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Options of `diagnose`.
#[derive(Debug, Args)]
pub(crate) struct DiagnoseArgs {
    /// The problem file (TOML)
    pub(crate) file: PathBuf,
    #[command(flatten)]
    pub(crate) method: Method,
    /// Nodes of the integrals; more are more accurate, and work grows with their square
    #[arg(long, value_name = "N", default_value_t = 2400, value_parser = clap::value_parser!(u16).range(10..=20_000))]
    pub(crate) nodes: u16,
    #[command(flatten)]
    pub(crate) common: Common,
    /// Write diagnosis.json and where.svg, a picture of where the variance of the first target comes from, into this
    /// folder
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

/// Options of `render`.
#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    /// The problem file of a room or of a scene in space (TOML)
    pub(crate) file: PathBuf,
    /// Where to write: .png, .svg, or .csv for the numbers
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Pixels: the width of a picture; of its numbers, .csv, along the longer side of the room
    #[arg(long, value_name = "PIXELS", default_value_t = 900, value_parser = clap::value_parser!(u16).range(16..=8000))]
    pub(crate) width: u16,
    /// Scenes: the height of what the camera sees; --width is its width [default: three quarters of it]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u16).range(16..=8000))]
    pub(crate) height: Option<u16>,
    /// Scenes: the place of the camera [default: outside; it sees through the backs of surfaces]
    #[arg(long, value_name = "X,Y,Z", value_parser = position, allow_hyphen_values = true)]
    pub(crate) from: Option<[f64; 3]>,
    /// Scenes: a point in the middle of the picture [default: the middle of the scene]
    #[arg(long, value_name = "X,Y,Z", value_parser = position, allow_hyphen_values = true)]
    pub(crate) towards: Option<[f64; 3]>,
    /// Scenes: degrees between the lower and the upper edge of the picture [default: 40]
    #[arg(long, value_name = "DEGREES")]
    pub(crate) angle: Option<f64>,
    /// Walks for each pixel [default: 4, of scenes 16], or for each point of --profile [default: 1000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub(crate) walks: Option<u64>,
    /// Colours by the logarithm, at most four decades
    #[arg(long)]
    pub(crate) log: bool,
    /// Colours from this number to that one, and beyond them the colours of the ends [default: from the least to the
    /// largest between the walls but for a fiftieth of the pixels at either end; with --log to the largest]
    #[arg(long, value_name = "A:B", value_parser = range, allow_hyphen_values = true)]
    pub(crate) range: Option<[f64; 2]>,
    /// Rooms by temperature: the mean radiant temperature in kelvin between the walls, and of walls the temperature of a black
    /// body with their radiosity
    #[arg(long, conflicts_with = "profile")]
    pub(crate) radiant_temperature: bool,
    /// Rooms: a mark at every target that is a point, and its name
    #[arg(long, conflicts_with = "profile")]
    pub(crate) targets: bool,
    /// Every pixel from one set of walks, by a global estimate; --walks is their number [default: 8192]
    #[arg(long, conflicts_with = "side_by_side")]
    pub(crate) global: bool,
    /// Where to write a picture of the standard errors, .png or .svg
    #[arg(long, value_name = "FILE", conflicts_with = "profile")]
    pub(crate) errors: Option<PathBuf>,
    /// Plain walks that take as long beside it; the picture then depends on how fast the machine is
    #[arg(long)]
    pub(crate) side_by_side: bool,
    /// Instead of the room, radiosity along all its surfaces with its error band
    #[arg(long, conflicts_with_all = ["width", "log", "range", "side_by_side"])]
    pub(crate) profile: bool,
    #[command(flatten)]
    pub(crate) common: Common,
}

/// Options of `export`.
#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// The problem file (TOML)
    pub(crate) file: PathBuf,
    /// Where to write: .bin, a compact table with a checksum
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: PathBuf,
}

/// How form factors of scenes are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum FactorMethod {
    Exact,
    Rays,
    Auto,
}

/// Options of `factors`.
#[derive(Debug, Args)]
pub(crate) struct FactorsArgs {
    /// The problem file of a room or a scene (TOML), a View2D or View3D deck (.vs2, .vs3), or a mesh (.obj, .stl, .ply)
    pub(crate) file: PathBuf,
    /// Scenes: the error that a form factor between two polygons behind an obstacle may have, from the smaller one; a sum of n may have n times that
    /// [default: 1e-9]; by rays the standard error [default: 1e-3]
    #[arg(long, value_name = "E")]
    pub(crate) error: Option<f64>,
    /// Scenes: `exact`, `rays`, with a standard error of every factor, or `auto`: rays where exact factors would take more than a
    /// minute and ten times as long [default: auto]
    #[arg(long, value_name = "M", value_enum)]
    pub(crate) method: Option<FactorMethod>,
    /// Scenes: end after so many seconds, with the rows that are finished, or with the rays that there are
    #[arg(long, value_name = "S")]
    pub(crate) time_limit: Option<f64>,
    /// Scenes: the rows of these surfaces alone; with --faces of all their polygons
    #[arg(long, value_name = "NAME", num_args = 1..)]
    pub(crate) rows: Vec<String>,
    /// Scenes: the seed of rays [default: 1]
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u64>,
    /// Scenes: leave out factors below this one, and scale the others of the row by the same share
    #[arg(long, value_name = "F")]
    pub(crate) drop: Option<f64>,
    /// Scenes: vertices nearer to each other than this length are one: "1 mm", or in the file's unit
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    pub(crate) weld: Option<f64>,
    /// The zone of EnergyPlus in .idf and .epJSON files [default: the name of the file]
    #[arg(long, value_name = "NAME")]
    pub(crate) zone: Option<String>,
    /// Scenes: light may leave, whatever the file says
    #[arg(long)]
    pub(crate) open: bool,
    /// Scenes: form factors between all polygons, and not between surfaces
    #[arg(long)]
    pub(crate) faces: bool,
    /// Scenes: the exchange factors (script F) of the grey surfaces, all reflections included, and not form factors
    #[arg(long, conflicts_with = "faces")]
    pub(crate) grey: bool,
    /// Rooms by temperature: the net heat from surface to surface in W per metre of depth, all reflections included, if u is
    /// even on every surface, and not form factors
    #[arg(long)]
    pub(crate) watts: bool,
    /// Closed scenes: change the factors by the least that makes every row sum to 1
    #[arg(long)]
    pub(crate) close: bool,
    /// Scenes: threads; results do not depend on it [default: all cores]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) threads: Option<u16>,
    /// Write them to this file: .json, .csv (from, to, factor, bound or standard error, area, checksum of the mesh; zeros left out), .npz
    /// (arrays for NumPy; with --faces a sparse matrix for SciPy), .txt (View3D's text format), .idf or .epJSON (EnergyPlus),
    /// vfsparse.inp.N or svf.inp.N (uDALES; with --faces), or F (OpenFOAM, with what stands beside it; with --faces)
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Print one JSON document on stdout and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

impl FactorsArgs {
    /// What is asked for of a file, if nothing else is said.
    pub(crate) fn of_file(file: &Path, threads: Option<u16>) -> Self {
        Self {
            file: file.to_owned(),
            error: None,
            method: None,
            time_limit: None,
            rows: Vec::new(),
            seed: None,
            drop: None,
            weld: None,
            zone: None,
            open: false,
            faces: false,
            grey: false,
            watts: false,
            close: false,
            threads,
            out: None,
            json: false,
        }
    }
}

/// A length more than 0, with a unit or without.
fn length(text: &str) -> Result<f64, String> {
    let length = fredholm_file::scene::metres(text);
    let length = length.filter(|length| *length > 0.0 && length.is_finite());
    length.ok_or_else(|| "a length is a number more than 0, or text such as \"1 mm\"".to_owned())
}

/// Options of every command that walks.
#[derive(Clone, Debug, Args)]
pub(crate) struct Common {
    /// Threads; results do not depend on it [default: all cores]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) threads: Option<u16>,
    /// Print one JSON document on stdout and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

/// Options of the neighbour equation and of what walks score.
#[derive(Debug, Args)]
pub(crate) struct Method {
    /// Number of cells (per axis for cubes)
    #[arg(long, value_name = "n", value_parser = count::<usize>)]
    pub(crate) cells: Option<usize>,
    /// Degree of the piecewise polynomials
    #[arg(long, value_name = "p")]
    pub(crate) degree: Option<usize>,
    /// How the neighbour equation treats pairs of cells
    #[arg(long, value_name = "NAME", value_parser = choices::<Pairs>())]
    pub(crate) pairs: Option<Pairs>,
    /// What a walk scores; with "absorption" walks end with the constant probability `absorption`, by default 0.2
    #[arg(long, value_name = "NAME", value_parser = choices::<Estimator>())]
    pub(crate) estimator: Option<Estimator>,
    /// The form of the control variate
    #[arg(long, value_name = "NAME", value_parser = choices::<Form>())]
    pub(crate) form: Option<Form>,
}

impl Method {
    /// Puts what was given in the place of the file's values.
    pub(crate) fn replace(&self, file: &mut ProblemFile) {
        let (galerkin, walk) = (&mut file.galerkin, &mut file.walk);
        galerkin.cells.set_by("--cells", self.cells);
        galerkin.degree.set_by("--degree", self.degree);
        galerkin.pairs.set_by("--pairs", self.pairs);
        walk.estimator.set_by("--estimator", self.estimator);
        walk.form.set_by("--form", self.form);
    }
}

/// Options of `solve`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub(crate) struct SolveArgs {
    /// The problem file (TOML), or - for the standard input
    pub(crate) file: PathBuf,
    /// Answer all targets from one set of walks, with a band that holds for all points together; in scenes, means over
    /// surfaces
    #[arg(long, conflicts_with = "no_global")]
    pub(crate) global: bool,
    /// Walk for every target by itself, also where a target error would be reached sooner from one set of walks
    #[arg(long)]
    pub(crate) no_global: bool,
    #[command(flatten)]
    pub(crate) method: Method,
    /// Circles and cubes: degree of the polynomials on which F + T_K v is projected, for walks that follow it
    #[arg(long, value_name = "p")]
    pub(crate) lift: Option<usize>,
    /// With --global: degree of the polynomials on whose coefficients walks score [default: two more than the degree]
    #[arg(long, value_name = "p", requires = "global")]
    pub(crate) score_degree: Option<usize>,
    /// Walks for each target, with --global for all; with a target error the maximum number
    #[arg(long, value_name = "N", value_parser = count::<u64>)]
    pub(crate) walks: Option<u64>,
    /// Stop a target once this standard error is reached
    #[arg(long, visible_alias = "error", value_name = "E")]
    pub(crate) target_error: Option<f64>,
    /// Interpret the target error relative to the estimate
    #[arg(long)]
    pub(crate) relative: bool,
    /// Stop walking after this time with what has been done by then; the set-up is not counted, but of resolvent walks
    /// none is made that is predicted to take longer
    #[arg(long, value_name = "SECONDS")]
    pub(crate) time_limit: Option<f64>,
    /// The method [default: walks]
    #[arg(long = "method", value_name = "NAME", value_parser = choices::<fredholm::Method>())]
    pub(crate) by: Option<fredholm::Method>,
    /// The numbers that walks draw
    #[arg(long, value_name = "NAME", value_parser = choices::<Sequence>())]
    pub(crate) sequence: Option<Sequence>,
    /// Number of first states in which walks do not end
    #[arg(long, value_name = "n")]
    pub(crate) forced_steps: Option<u32>,
    /// Whether the last step of walks leads to the light, in rooms and circles
    #[arg(long, value_name = "true|false")]
    pub(crate) last_step: Option<bool>,
    /// Whether walks go from the sources to the receivers, in scenes
    #[arg(long, value_name = "true|false")]
    pub(crate) adjoint: Option<bool>,
    /// Floating-point type of the walks
    #[arg(long, value_parser = choices::<Scalar>())]
    pub(crate) scalar: Option<Scalar>,
    /// Say how every target depends on reflectances, emissions and temperatures of surfaces, and on the parameters of formulas
    #[arg(long, conflicts_with = "global")]
    pub(crate) sensitivities: bool,
    /// Seed of the walks
    #[arg(long, value_name = "S", value_parser = count::<u64>)]
    pub(crate) seed: Option<u64>,
    #[command(flatten)]
    pub(crate) common: Common,
    /// Run even if the variance is infinite; error bars are then meaningless
    #[arg(long)]
    pub(crate) allow_infinite_variance: bool,
    /// Write the results to this file: .json, .csv, .npz (arrays for NumPy), .vtu or .glb (grids, or a scene's cells, for
    /// `ParaView` or a viewer of glTF), or .svg for a picture of the grid targets
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Keep the batches of walks that are done in this file, which is written many times a second. The same command goes on with
    /// it, whatever ended it, to the bits of a run that nothing ended
    #[arg(long, value_name = "FILE", conflicts_with = "global")]
    pub(crate) save: Option<PathBuf>,
    /// Solve the Galerkin system of a cube, a room or a scene once for many runs: what takes long of the set-up is written to this
    /// file, or taken from it if it is there. Needs a given number of cells
    #[arg(long, value_name = "FILE", conflicts_with = "system")]
    pub(crate) save_system: Option<PathBuf>,
    /// Take the solved system from this file, which `--save-system` made; all processes of a machine share its tables
    #[arg(long, value_name = "FILE")]
    pub(crate) system: Option<PathBuf>,
    /// Run the k-th of n parts of the walks only, into the file of --save; `fredholm merge` makes one result of all
    #[arg(long, value_name = "k/n", requires = "save")]
    pub(crate) part: Option<Share>,
    /// With --part: the first walks of each target, so many, are in other parts already
    #[arg(long, value_name = "N", requires = "part", value_parser = count::<u64>)]
    pub(crate) after: Option<u64>,
}

/// Walks of which a command over a scene has its own number.
#[derive(Debug, Args)]
pub(crate) struct SceneWalks {
    /// Walks of each target or face [default: 4096, 256]; with a target error the first ones, which tell how many it takes [default: 1024, 32]
    #[arg(long, value_name = "N", value_parser = count::<u64>)]
    walks: Option<u64>,
    /// The largest standard error that a value may have
    #[arg(long, visible_alias = "error", value_name = "E")]
    target_error: Option<f64>,
    /// Interpret the target error relative to the largest value of a target or of all faces
    #[arg(long)]
    relative: bool,
    /// Floating-point type of the walks
    #[arg(long, value_parser = choices::<Scalar>())]
    scalar: Option<Scalar>,
    /// Seed of the walks
    #[arg(long, value_name = "S", value_parser = count::<u64>)]
    seed: Option<u64>,
}

impl SceneWalks {
    /// Sets what was said in place of what the file says.
    pub(crate) fn set(&self, walk: &mut Walk) {
        walk.walks.set_by("--walks", self.walks);
        walk.scalar.set_by("--scalar", self.scalar);
        walk.seed.set_by("--seed", self.seed);
        walk.target_error
            .set_by("--target-error", self.target_error);
        let relative = self.relative.then_some(true);
        walk.relative.set_by("--relative", relative);
    }
}

/// Options of `times`.
#[derive(Debug, Args)]
pub(crate) struct TimesArgs {
    /// The problem file of a scene (TOML)
    pub(crate) file: PathBuf,
    /// The suns and skies (CSV)
    pub(crate) times: PathBuf,
    #[command(flatten)]
    pub(crate) walks: SceneWalks,
    #[command(flatten)]
    pub(crate) common: Common,
    /// Write the values of all times to this file: .csv or .json
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Options of `faces`.
#[derive(Debug, Args)]
pub(crate) struct FacesArgs {
    /// The problem file of a scene (TOML)
    pub(crate) file: PathBuf,
    /// The quantity: `u`, `irradiance`, or of heat `net_flux`
    #[arg(long, default_value = "irradiance", value_parser = choices::<GlobalQuantity>())]
    pub(crate) ask: GlobalQuantity,
    #[command(flatten)]
    pub(crate) walks: SceneWalks,
    /// Solve a neighbour equation on about so many cells first
    #[arg(long, value_name = "N", value_parser = count::<usize>)]
    pub(crate) cells: Option<usize>,
    #[command(flatten)]
    pub(crate) common: Common,
    /// Write all faces to this file: .json, .csv, .npz (arrays for NumPy), or .vtu or .glb, a mesh in colours
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Options of `merge`.
#[derive(Debug, Args)]
pub(crate) struct MergeArgs {
    /// The files of the parts
    #[arg(required = true)]
    pub(crate) parts: Vec<PathBuf>,
    /// Whether this standard error is reached, and how many walks more it takes [default: the problem's own]
    #[arg(long, value_name = "E")]
    pub(crate) target_error: Option<f64>,
    /// Interpret the target error relative to the estimate
    #[arg(long, requires = "target_error")]
    pub(crate) relative: bool,
    /// Print one JSON document on stdout and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    /// Write the results to this file: .json, .csv, .npz (arrays for NumPy), .vtu or .glb (grids, or a scene's cells, for
    /// `ParaView` or a viewer of glTF), or .svg for a picture of the grid targets
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// What a problem file may begin with: kinds and examples, with what each is.
fn beginnings() -> PossibleValuesParser {
    let values = names().map(|(name, about)| PossibleValue::new(name).help(about));
    PossibleValuesParser::new(values)
}

/// The words of an option, with what each does.
fn choices<T: Choices + Send + Sync>() -> impl TypedValueParser<Value = T> {
    let values = T::ALL
        .iter()
        .map(|choice| PossibleValue::new(choice.word).help(choice.help));
    // The parser lets nothing else pass.
    PossibleValuesParser::new(values).try_map(|word| T::of_word(&word).ok_or("no such word"))
}

/// A count, such as that of walks or cells.
fn count<T: TryFrom<u64>>(text: &str) -> Result<T, String> {
    if text.starts_with('-') {
        return Err("it must not be negative".to_owned());
    }
    let count = text.parse::<u64>().map_err(|_| match text.parse::<f64>() {
        Ok(x) if x.fract() == 0.0 && x < 1e15 => format!("it must be an integer: write {x:.0}"),
        _ => "it must be an integer".to_owned(),
    })?;
    T::try_from(count).map_err(|_| "it is too large".to_owned())
}

/// Two numbers, the smaller first: "200:500".
fn range(text: &str) -> Result<[f64; 2], String> {
    let (low, high) = text.split_once(':').unwrap_or((text, ""));
    match (low.trim().parse::<f64>(), high.trim().parse::<f64>()) {
        (Ok(low), Ok(high)) if low < high && (high - low).is_finite() => Ok([low, high]),
        _ => Err("a range is two numbers, the smaller first: 200:500".to_owned()),
    }
}

/// Three coordinates.
fn position(text: &str) -> Result<[f64; 3], String> {
    let numbers = text.split(',').map(|x| x.trim().parse().ok());
    let numbers: Option<Vec<f64>> = numbers.collect();
    let three = numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok());
    three.ok_or_else(|| "a position is three numbers: 1,2.5,0".to_owned())
}

/// A degree of the circle.
fn degree(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(degree @ 0..=4) => Ok(degree),
        Ok(_) => Err("the degree is at most 4".to_owned()),
        Err(_) => Err("a degree is a whole number".to_owned()),
    }
}
