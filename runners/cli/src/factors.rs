//! `fredholm factors`: form factors between the surfaces of a room, or of a scene in space.

use std::io::Write;
use std::path::Path;

use fredholm::Scalar;
use fredholm::room::{Outside, Surfaces};
use fredholm_factors::{Groups, room_factors};
use fredholm_room::Scene;
use serde::Serialize;

use crate::args::FactorsArgs;
use crate::deck::{self, Deck};
use fredholm_file::npz::Archive;
use fredholm_file::scene::SkyBands;

use crate::failure::{Ended, Failure, print, say};
use crate::file::{ProblemFile, kinds::Room};
use crate::numbers::aligned;
use crate::progress::Signals;
use crate::sparse::Rows;
use crate::{exchange, scene, solve, table};
use fredholm_file::parts::output::Output;

/// The most surfaces of scenes and rooms of which a table is printed.
const WIDEST: usize = 200;

/// Bytes of a form factor: twice as a number, and as text.
const PAIR: usize = 48;

/// Everything that `factors --json` prints.
#[derive(Debug, Serialize)]
pub(crate) struct Factors {
    pub(crate) surfaces: Vec<String>,
    /// The surfaces of the rows, if these are not all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) rows: Option<Vec<String>>,
    /// Row I: of the energy that leaves surface I, the share that arrives at each.
    pub(crate) factors: Rows,
    /// The standard errors of form factors by rays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) std_errors: Option<Rows>,
    /// Bounds of the errors of exact form factors, if a table is to have them.
    #[serde(skip)]
    pub(crate) bounds: Option<Rows>,
    /// The unit of what is in the place of form factors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) unit: Option<&'static str>,
    /// What only scenes in space have.
    #[serde(flatten)]
    pub(crate) space: Option<Space>,
    /// What arrives at the sky, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) sky: Option<SkyTable>,
}

/// What is said of form factors in space beside them.
#[derive(Debug, Serialize)]
pub(crate) struct Space {
    pub(crate) areas: Vec<f64>,
    pub(crate) emissivities: Vec<f64>,
    /// A checksum of names and polygons, in hexadecimal digits.
    pub(crate) mesh_crc32: String,
    #[serde(skip)]
    pub(crate) drawn: Drawn,
    pub(crate) open: bool,
    /// The number of polygons, and of their pairs that see each other.
    pub(crate) polygons: usize,
    pub(crate) pairs: usize,
    /// The largest error that a form factor between polygons is estimated to have.
    pub(crate) estimated_error: f64,
    pub(crate) seconds: f64,
}

/// The polygons of a file, where those of the scene are parts of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Drawn {
    /// The number of the file's polygon that each polygon of the scene is a part of.
    pub(crate) part_of: Vec<usize>,
    /// How many every surface has.
    pub(crate) counts: Vec<usize>,
}

/// What arrives at a sky.
#[derive(Debug, Serialize)]
pub(crate) struct SkyTable {
    pub(crate) patches: Vec<SkyPatch>,
    /// Row I: of the energy that leaves surface I, the share that arrives at each patch.
    pub(crate) factors: Vec<Vec<f64>>,
    /// The share that goes below the horizon.
    pub(crate) below: Vec<f64>,
    /// The standard errors by rays of each patch and, last, of what goes below the horizon.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) std_errors: Option<Vec<Vec<f64>>>,
    /// The bounds of errors in each row, of exact factors.
    #[serde(skip)]
    pub(crate) bounds: Vec<f64>,
}

/// A patch of a sky; angles in degrees.
#[derive(Debug, Serialize)]
pub(crate) struct SkyPatch {
    pub(crate) name: String,
    pub(crate) altitudes: [f64; 2],
    pub(crate) azimuths: [f64; 2],
    /// In space.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) solid_angle: Option<f64>,
}

/// Runs `factors`.
pub(crate) fn factors(args: &FactorsArgs, signals: &Signals) -> Result<Ended, Failure> {
    let output = args.out.as_deref().map(Format::open).transpose()?;
    let (factors, ended) = match scene::read(&args.file, args.weld)? {
        Some(file) => {
            let Computed { factors, ended } = scene::factors(args, file, Some(signals))?;
            (factors, ended)
        }
        None => (of_room(args)?, Ended::Done),
    };
    let written = output.map_or(Ok(()), |(format, output, more)| {
        if let Some(name) = format.whole().filter(|_| factors.rows.is_some()) {
            return Err(Failure::run(format_args!(
                "`--out`: {name} has all rows, and not all are finished"
            )));
        }
        if let Some(name) = format.whole().filter(|_| factors.sky.is_some()) {
            return Err(Failure::input(format_args!(
                "`--out`: {name} has no sky: write .json, .csv or .npz"
            )));
        }
        Ok(match format {
            Format::Json => output.finish(table::json(&factors)?),
            Format::Csv => output.finish_with(|file| factors.csv(file)).map(drop),
            Format::Npz => output.finish(factors.npz()?),
            Format::View3d => output.finish(factors.view3d()),
            Format::Idf => output.finish(factors.idf(&zone(args))?),
            Format::EpJson => output.finish(factors.epjson(&zone(args))),
            Format::Vfsparse => output.finish(factors.vfsparse()),
            Format::Svf => output.finish(factors.svf()),
            Format::Foam => {
                let [first, others @ ..] = factors.foam();
                let mut others = more.into_iter().zip(others);
                let all = output.finish(first);
                all.and_then(|()| others.try_for_each(|(output, text)| output.finish(text)))
            }
        }?)
    });
    print(if args.json {
        table::json(&factors)?
    } else {
        factors.text()
    })?;
    factors.remarks(args);
    written.map(|()| ended)
}

/// The name of the zone of EnergyPlus whose factors these are: that of the file.
fn zone(args: &FactorsArgs) -> String {
    let stem = args.file.file_stem().and_then(|stem| stem.to_str());
    args.zone
        .clone()
        .or_else(|| stem.map(str::to_owned))
        .unwrap_or_default()
}

/// Form factors, and whether all that was asked for was done.
pub(crate) struct Computed {
    pub(crate) factors: Factors,
    pub(crate) ended: Ended,
}

/// The form factors that are asked for.
pub(crate) fn found(args: &FactorsArgs) -> Result<Factors, Failure> {
    match scene::read(&args.file, args.weld)? {
        Some(file) => Ok(scene::factors(args, file, None)?.factors),
        None => of_room(args),
    }
}

/// The kinds of files of form factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Format {
    Json,
    Csv,
    Npz,
    View3d,
    Idf,
    EpJson,
    Vfsparse,
    Svf,
    Foam,
}

impl Format {
    /// The format of a file of this name.
    pub(crate) fn of(path: &Path) -> Option<Self> {
        let name = path.file_name().and_then(|name| name.to_str());
        let is_called = |start| name.is_some_and(|name| name.starts_with(start));
        Some(match path.extension().and_then(|e| e.to_str()) {
            // uDALES has the number of the run at the end.
            _ if is_called("vfsparse.inp") => Self::Vfsparse,
            _ if is_called("svf.inp") => Self::Svf,
            _ if name == Some(exchange::FOAM[0].name) => Self::Foam,
            Some("json") => Self::Json,
            Some("csv") => Self::Csv,
            Some("npz") => Self::Npz,
            Some("txt") => Self::View3d,
            Some("idf") => Self::Idf,
            Some("epJSON" | "epjson") => Self::EpJson,
            _ => return None,
        })
    }

    /// What to write where, known to be possible before any work is done; and what stands beside it.
    fn open(path: &Path) -> Result<(Self, Output, Vec<Output>), Failure> {
        let Some(format) = Self::of(path) else {
            let message = "the name must end in .json, .csv, .npz, .txt, .idf or .epJSON, or be vfsparse.inp.N, svf.inp.N or F";
            return Err(Failure::of_out(path, message));
        };
        let beside = match format {
            Self::Foam => &exchange::FOAM[1..],
            _ => &[],
        };
        let beside = beside
            .iter()
            .map(|own| Output::open("--out", &path.with_file_name(own.name)));
        let beside = beside.collect::<Result<_, _>>()?;
        Ok((format, Output::open("--out", path)?, beside))
    }

    /// The name for people of a format that has all rows, no sky and no bounds.
    pub(crate) const fn whole(self) -> Option<&'static str> {
        match self {
            Self::View3d => Some("View3D's text format"),
            Self::Foam => Some("OpenFOAM's format"),
            _ => None,
        }
    }
}

/// The form factors of a room or a deck in the plane.
fn of_room(args: &FactorsArgs) -> Result<Factors, Failure> {
    let format = args.out.as_deref().and_then(Format::of);
    let flags = [
        ("--out F", format == Some(Format::Foam)),
        ("--error", args.error.is_some()),
        ("--open", args.open),
        ("--faces", args.faces),
        ("--grey", args.grey),
        ("--close", args.close),
        ("--threads", args.threads.is_some()),
        ("--method", args.method.is_some()),
        ("--time-limit", args.time_limit.is_some()),
        ("--rows", !args.rows.is_empty()),
        ("--seed", args.seed.is_some()),
        ("--drop", args.drop.is_some()),
        ("--weld", args.weld.is_some()),
    ];
    if let Some((flag, _)) = flags.iter().find(|(_, given)| *given) {
        let message = format_args!(
            "`{flag}` belongs to scenes in space; {} is a room",
            args.file.display()
        );
        return Err(Failure::input(message));
    }
    let is_deck = args
        .file
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("vs2"));
    if is_deck && !args.watts {
        return of_deck(&deck::read(&args.file)?);
    }
    let file = solve::read(&args.file, |_| ())?;
    of_file(&args.file.display().to_string(), &file, args.watts)
}

/// The form factors of a deck.
pub(crate) fn of_deck(deck: &Deck) -> Result<Factors, Failure> {
    let parts = deck.parts()?;
    refuse_beyond_memory(parts.lines.len())?;
    let scene = parts.surfaces.scene::<f64>().map_err(|error| match error {
        fredholm::Error::Scene {
            place: Some(at), ..
        } => Failure::input(deck.error(parts.lines[at.surface], error)),
        error => Failure::input(error),
    })?;
    say_covered(&parts.surfaces, &scene);
    let lengths = (0..parts.lines.len()).map(|part| scene.length(part));
    let lengths: Vec<f64> = lengths.collect::<Result<_, _>>().map_err(Failure::run)?;
    let factors = room_factors(&scene).map_err(Failure::run)?;
    let combined = parts.combined(&factors, &lengths);
    Ok(Factors::of_rows(parts.names, &combined))
}

/// The form factors of the problem file of this name, which must be a room, or the watts from surface to surface.
pub(crate) fn of_file(name: &str, file: &ProblemFile, watts: bool) -> Result<Factors, Failure> {
    let Some(own) = file.problem.of::<Room>() else {
        return Err(Failure::input(format_args!(
            "{name}: form factors belong to rooms: `kind = \"room\"`, or a .vs2 deck"
        )));
    };
    let mut surfaces = own.all_surfaces(file)?;
    surfaces.outside = own.sky.as_ref().map_or_else(Vec::new, |sky| {
        let mut all = sky.outside();
        all.extend(Outside::below());
        all
    });
    refuse_beyond_memory(surfaces.names.len())?;
    let scene = match file.walk.scalar.value {
        Scalar::F32 => surfaces.scene::<f32>(),
        Scalar::F64 => surfaces.scene::<f64>(),
    };
    let scene = scene.map_err(Failure::of(file))?;
    say_covered(&surfaces, &scene);
    if watts {
        if own.sky.is_some() {
            let message =
                "`--watts` knows of surfaces alone: leave `sky` out, and say `open = true`";
            return Err(Failure::input(message));
        }
        return of_watts(surfaces, &scene);
    }
    let entries = room_factors(&scene).map_err(Failure::run)?;
    let (n, m) = (surfaces.names.len(), surfaces.outside.len());
    let rows = entries.chunks_exact((n + m).max(1));
    let inside: Vec<f64> = rows.clone().flat_map(|row| &row[..n]).copied().collect();
    let mut factors = Factors::of_rows(surfaces.names, &inside);
    factors.sky = own.sky.as_ref().map(|sky| {
        let outside = rows.map(|row| &row[n..]);
        sky_table(sky, outside.collect())
    });
    Ok(factors)
}

/// What arrives at the sky of a room, from rows with both sides of every band and the two quarters below.
fn sky_table(sky: &SkyBands, rows: Vec<&[f64]>) -> SkyTable {
    let mut patches = Vec::new();
    // Of every patch the sides that it has.
    let mut sides = Vec::new();
    for (band, (ends, &sectors)) in sky.altitudes.windows(2).zip(&sky.sectors).enumerate() {
        for sector in 0..sectors as usize {
            let width = 360.0 / f64::from(sectors);
            patches.push(SkyPatch {
                name: format!("sky {}.{}", band + 1, sector + 1),
                altitudes: [ends[0], ends[1]],
                azimuths: [sector, sector + 1].map(|k| width * k as f64),
                solid_angle: None,
            });
            let first = 2 * band + sector;
            sides.push(first..first + 2 / sectors as usize);
        }
    }
    let sum = |own: &[f64]| own.iter().sum::<f64>();
    let of_row = |row: &&[f64]| sides.iter().map(|own| sum(&row[own.clone()])).collect();
    SkyTable {
        patches,
        factors: rows.iter().map(of_row).collect(),
        below: rows.iter().map(|row| sum(&row[row.len() - 2..])).collect(),
        std_errors: None,
        bounds: Vec::new(),
    }
}

/// Says on stderr what of walls obstacles cover.
fn say_covered(surfaces: &Surfaces, scene: &Scene) {
    for note in surfaces.notes(scene) {
        say(format_args!("note: {note}"));
    }
}

/// What surfaces of even radiosity give each other.
fn of_watts(surfaces: Surfaces, scene: &Scene) -> Result<Factors, Failure> {
    let (mut emissivities, mut black) = (Vec::new(), Vec::new());
    for (name, materials) in surfaces.names.iter().zip(&surfaces.materials) {
        let first = materials.first().filter(|first| {
            surfaces.heat && first.reflectance < 1.0 && materials.iter().all(|of| of == *first)
        });
        let material = first.ok_or_else(|| {
            Failure::input(format_args!(
                "`--watts` needs one `temperature` and one `emissivity` of every surface, and {name:?} has not"
            ))
        })?;
        emissivities.push(1.0 - material.reflectance);
        black.push(material.emission / (1.0 - material.reflectance));
    }
    let lengths = (0..emissivities.len()).map(|surface| scene.length(surface));
    let lengths = lengths.collect::<Result<_, _>>().map_err(Failure::run)?;
    let factors = room_factors(scene).map_err(Failure::run)?;
    let groups = Groups::new(lengths, &factors).map_err(Failure::run)?;
    let watts = groups.net_exchange(&emissivities, &black);
    let mut factors = Factors::of_rows(surfaces.names, &watts.map_err(Failure::run)?);
    factors.unit = Some("W per metre");
    Ok(factors)
}

/// Asked before a scene is made, which may take long.
fn refuse_beyond_memory(surfaces: usize) -> Result<(), Failure> {
    let needed = surfaces.saturating_mul(surfaces).saturating_mul(PAIR);
    let what = || format!("the form factors of {surfaces} surfaces");
    fredholm::memory::refuse_beyond_memory(what, needed, "").map_err(Failure::input)
}

impl Factors {
    fn of_rows(surfaces: Vec<String>, entries: &[f64]) -> Self {
        let rows = entries.chunks_exact(surfaces.len().max(1));
        Self {
            factors: Rows::Dense(rows.map(<[f64]>::to_vec).collect()),
            surfaces,
            rows: None,
            std_errors: None,
            bounds: None,
            unit: None,
            space: None,
            sky: None,
        }
    }

    /// The names of the surfaces of the rows.
    pub(crate) fn row_names(&self) -> &[String] {
        self.rows.as_deref().unwrap_or(&self.surfaces)
    }

    /// The number of the surface of a row.
    fn number(&self, row: usize) -> Option<usize> {
        match &self.rows {
            Some(rows) => (self.surfaces.iter()).position(|own| Some(own) == rows.get(row)),
            None => Some(row),
        }
    }

    fn sky(&self) -> Option<&SkyTable> {
        self.sky.as_ref()
    }

    /// The shares of a surface that arrive at the sky and below the horizon; none without a sky.
    fn outside(&self, surface: usize) -> Option<[f64; 2]> {
        let sky = self.sky()?;
        let patches = sky.factors.get(surface)?.iter().sum();
        Some([patches, *sky.below.get(surface)?])
    }

    /// The sum of a row, with the sky and what is below the horizon.
    fn sum(&self, surface: usize) -> f64 {
        let inside = self.factors.row(surface).map(|(_, factor)| factor);
        let outside = self.outside(surface);
        // A sum of nothing would be -0.
        inside
            .chain(outside.into_iter().flatten())
            .fold(0.0, |sum, factor| sum + factor)
    }

    /// A line for every factor that is not 0; in space with its error, the area of the surface that it is from, and the checksum of the mesh.
    fn csv(&self, file: &mut dyn Write) -> std::io::Result<()> {
        let mut writer = csv::Writer::from_writer(file);
        let what = match self.unit {
            Some(_) => "watts_per_metre",
            None => "factor",
        };
        let errors = match (&self.std_errors, &self.bounds) {
            (Some(errors), _) => Some(("std_error", errors)),
            (None, bounds) => bounds.as_ref().map(|bounds| ("bound", bounds)),
        };
        let space = self.space.as_ref();
        let mut head = vec!["from", "to", what];
        head.extend(errors.map(|(name, _)| name));
        head.extend(space.iter().flat_map(|_| ["area", "mesh_crc32"]));
        writer.write_record(head)?;
        let mut line = |(i, to): (usize, &str), factor: f64, error: Option<f64>| {
            let mut record = vec![
                self.row_names()[i].clone(),
                to.to_owned(),
                format!("{factor:?}"),
            ];
            if errors.is_some() {
                record.push(error.map_or_else(String::new, |error| format!("{error:?}")));
            }
            if let Some(space) = space {
                let area = self.number(i).map_or(f64::NAN, |at| space.areas[at]);
                record.extend([format!("{area:?}"), space.mesh_crc32.clone()]);
            }
            writer.write_record(record)
        };
        for i in 0..self.factors.len() {
            let all: Option<Vec<_>> = errors.map(|(_, errors)| errors.row(i).collect());
            for (j, factor) in self.factors.row(i) {
                let to = self.surfaces.get(j).map_or("", String::as_str);
                let found = all.as_ref().and_then(|all| {
                    let at = all.binary_search_by_key(&j, |own| own.0);
                    at.ok().map(|at| all[at].1)
                });
                line((i, to), factor, found)?;
            }
        }
        if let Some(sky) = self.sky() {
            for (i, (row, below)) in sky.factors.iter().zip(&sky.below).enumerate() {
                let to = sky.patches.iter().map(|patch| patch.name.as_str());
                let all = to.zip(row).chain([("below", below)]).enumerate();
                for (k, (to, &factor)) in all.filter(|(_, (_, factor))| **factor != 0.0) {
                    let error = match &sky.std_errors {
                        Some(errors) => errors.get(i).and_then(|row| row.get(k)),
                        None => sky.bounds.get(i),
                    };
                    line((i, to), factor, error.copied())?;
                }
            }
        }
        writer.flush()
    }

    /// Arrays for NumPy.
    fn npz(&self) -> Result<Vec<u8>, Failure> {
        let n = self.surfaces.len();
        let count = self.factors.len();
        let mut archive = Archive::default();
        if let Some(rows) = &self.rows {
            archive.texts("rows", rows)?;
        }
        if let Some(errors) = &self.std_errors {
            let all: Vec<f64> = (0..count).flat_map(|i| errors.whole_row(i)).collect();
            archive.numbers("std_errors", &[count, n], all.iter())?;
        }
        match &self.factors {
            Rows::Dense(rows) => {
                archive.numbers("factors", &[n, n], rows.iter().flatten())?;
            }
            Rows::Listed(rows, _) => {
                let all: Vec<f64> = (0..rows.len())
                    .flat_map(|i| self.factors.whole_row(i))
                    .collect();
                archive.numbers("factors", &[count, n], all.iter())?;
            }
            // As `scipy.sparse.load_npz` reads it.
            Rows::Sparse(sparse) => {
                archive.word("format", "csr")?;
                archive.integers("shape", [n as i64; 2].into_iter())?;
                archive.integers("indptr", sparse.first().iter().map(|&x| x as i64))?;
                archive.small_integers("indices", sparse.columns())?;
                archive.numbers("data", &[sparse.factors().len()], sparse.factors().iter())?;
            }
        }
        archive.texts("surfaces", &self.surfaces)?;
        if let Some(space) = &self.space {
            archive.word("mesh_crc32", &space.mesh_crc32)?;
            archive.numbers("areas", &[n], space.areas.iter())?;
            archive.numbers("emissivities", &[n], space.emissivities.iter())?;
        }
        if let Some(sky) = self.sky() {
            let m = sky.patches.len();
            archive.numbers("sky", &[count, m], sky.factors.iter().flatten())?;
            archive.numbers("below", &[count], sky.below.iter())?;
            let bounds = |p: &SkyPatch| {
                let ([a, b], [c, d]) = (p.altitudes, p.azimuths);
                [a, b, c, d, p.solid_angle.unwrap_or(f64::NAN)]
            };
            let patches: Vec<f64> = sky.patches.iter().flat_map(bounds).collect();
            archive.numbers("patches", &[m, 5], patches.iter())?;
        }
        Ok(archive.finish()?)
    }

    /// As View3D's format 0 has it: a line that says what follows, areas, rows of factors, emissivities.
    fn view3d(&self) -> String {
        let joined = |numbers: &[f64]| {
            let words: Vec<String> = numbers.iter().map(|x| format!("{x:?}")).collect();
            words.join(" ") + "\n"
        };
        let n = self.surfaces.len();
        let (closed, areas, emissivities) = match &self.space {
            Some(space) => (!space.open, space.areas.clone(), space.emissivities.clone()),
            None => (true, vec![1.0; n], vec![1.0; n]),
        };
        let head = format!(
            "fredholm {} 0 {} 0 {n}",
            env!("CARGO_PKG_VERSION"),
            u8::from(closed)
        );
        let mut text = format!("{head:<30}\n");
        text += &joined(&areas);
        for i in 0..n {
            text += &joined(&self.factors.whole_row(i));
        }
        text + &joined(&emissivities)
    }

    /// Says on stderr how good they are.
    fn remarks(&self, args: &FactorsArgs) {
        let Some(space) = &self.space else { return };
        let sums = (0..self.factors.len()).map(|k| self.sum(k));
        if !args.grey && (!space.open || self.sky.is_some()) {
            let off = sums.map(|sum| (sum - 1.0).abs()).fold(0.0, f64::max);
            say(format_args!("row sums: at most {off:.1e} from 1"));
        }
        if self.std_errors.is_some() {
            say(format_args!(
                "{} polygons, {} pairs see each other, by rays; standard errors are at most {:.1e}, {:.2} s",
                space.polygons, space.pairs, space.estimated_error, space.seconds
            ));
            return;
        }
        say(format_args!(
            "{} polygons, {} pairs see each other, estimated error {:.1e}, {:.2} s; A_I F_IJ = A_J F_JI: one number is \
             kept for both",
            space.polygons, space.pairs, space.estimated_error, space.seconds
        ));
        let asked = args.error.unwrap_or(scene::ERROR);
        if self.std_errors.is_none() && space.estimated_error > asked {
            say(format_args!(
                "warning: {asked:e} was asked for: some polygons are too small beside what hides them"
            ));
        }
    }

    /// The sums of the rows of a table that is too wide.
    fn summary(&self) -> String {
        let mut rows = vec![vec![
            "surface".to_owned(),
            "sum".to_owned(),
            "area".to_owned(),
        ]];
        for (k, name) in self.row_names().iter().enumerate() {
            let area = self
                .space
                .as_ref()
                .zip(self.number(k))
                .and_then(|(space, at)| space.areas.get(at));
            let area = area.map_or_else(String::new, |area| format!("{area:.6}"));
            rows.push(vec![name.clone(), format!("{:.12}", self.sum(k)), area]);
        }
        aligned(&rows)
            + "the factors are too many for a table: write them with `--out FILE.csv`, or use `--json`\n"
    }

    /// A table, with the sum of every row: 1 in a closed room.
    fn text(&self) -> String {
        if self.surfaces.len() > WIDEST {
            return self.summary();
        }
        let unit = self
            .unit
            .map_or_else(String::new, |unit| format!("{unit}, "));
        let mut header = vec![format!("{unit}from \\ to")];
        header.extend(self.surfaces.iter().cloned());
        if self.sky().is_some() {
            header.extend(["sky".to_owned(), "below".to_owned()]);
        }
        header.push("sum".to_owned());
        let mut rows = vec![header];
        for (k, name) in self.row_names().iter().enumerate() {
            let row = self.factors.whole_row(k);
            let outside = self.outside(k);
            let all = row.iter().chain(outside.iter().flatten());
            let errors = self.std_errors.as_ref().map(|errors| errors.whole_row(k));
            let mut cells = vec![name.clone()];
            cells.extend(all.enumerate().map(|(column, f)| {
                let error = errors.as_ref().and_then(|errors| errors.get(column));
                match error {
                    _ if *f == 0.0 => "0".to_owned(),
                    Some(error) => format!("{f:.6} ± {error:.1e}"),
                    None => format!("{f:.6}"),
                }
            }));
            cells.push(format!("{:.6}", self.sum(k)));
            rows.push(cells);
        }
        aligned(&rows)
    }
}
