//! Scenes in space: their form factors, and what `check` says of them.

use std::collections::HashMap;
use std::path::Path;
use std::time::Instant;

use crc::{CRC_32_ISO_HDLC, Crc};
use fredholm_factors::{
    Factors as AllFactors, Groups, Row, Sights, Sky, SkyFactors, SkyRow, SparseFactors,
};
use fredholm_file::scene::{
    SceneFile, SceneSurface, is_description, is_mesh, nearest, parse_description,
};
use fredholm_plot::SpaceDrawing;
use fredholm_scene::{Place, Scene};
use rayon::prelude::*;

use crate::args::{FactorMethod, FactorsArgs};
use crate::factors::{Computed, Drawn, Factors, Format, SkyPatch, SkyTable, Space};
use crate::failure::{Ended, Failure, print, say};
use crate::file;
use crate::numbers::aligned;
use crate::progress::{Signals, bar};
use crate::sparse::Rows;
use crate::threads::with_threads;
use crate::{ray_factors, solve, table};
use fredholm_file::parts::output::Output;

/// The error of form factors behind obstacles if nothing else is asked for.
pub(crate) const ERROR: f64 = 1e-9;

/// Bytes of a pair of faces, and of a pair of surfaces, which is printed.
const PAIR: usize = 16;
const PRINTED: usize = 48;

/// The scene of a file; `None` if the file is no scene.
pub(crate) fn read(path: &Path, weld: Option<f64>) -> Result<Option<SceneFile>, Failure> {
    if is_mesh(path) {
        return Ok(Some(file::scene::read_welded(path, weld)?));
    }
    if weld.is_some() {
        return Err(Failure::input(
            "`--weld` is for meshes and decks: in a problem file write `weld = \"1 mm\"`",
        ));
    }
    let is_toml = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    if !is_toml {
        return Ok(None);
    }
    let name = path.display().to_string();
    let text = file::utf8(&name, file::load(path, file::MAX_BYTES)?)?;
    if !is_description(&text) {
        return Ok(None);
    }
    Ok(Some(parse_description(&name, &text)?))
}

/// The form factors of a scene.
pub(crate) fn factors(
    args: &FactorsArgs,
    mut file: SceneFile,
    signals: Option<&Signals>,
) -> Result<Computed, Failure> {
    let format = args.out.as_deref().and_then(Format::of);
    if let Some(name) = format.and_then(Format::whole) {
        let refused = [
            ("no sky", file.sky.is_some(), ""),
            ("all rows", !args.rows.is_empty(), ", or leave out `--rows`"),
        ];
        if let Some((what, _, advice)) = refused.iter().find(|(_, refused, _)| *refused) {
            return Err(Failure::input(format_args!(
                "`--out`: {name} has {what}: write .json, .csv or .npz{advice}"
            )));
        }
    }
    if format == Some(Format::Foam) && !args.faces {
        return Err(Failure::input(
            "`--out`: OpenFOAM has form factors between polygons: add `--faces`",
        ));
    }
    if !args.rows.is_empty() && (args.grey || args.close) {
        return Err(Failure::input(
            "`--rows`: `--grey` and `--close` need all rows",
        ));
    }
    let least = args.drop.unwrap_or(0.0);
    if !(0.0..1.0).contains(&least) {
        return Err(Failure::input("`--drop` needs a form factor from 0 to 1"));
    }
    file.open |= args.open;
    if args.watts {
        return Err(Failure::input(
            "`--watts` is for rooms in the plane: of a scene `--grey` gives script F, and A_I F_IJ σ(T_I⁴ − T_J⁴) W go from I to J",
        ));
    }
    let deadline = match args.time_limit {
        Some(seconds) => Some(Instant::now() + solve::time_limit(seconds)?),
        None => None,
    };
    if let Some(names) = file.mirrors() {
        if args.grey {
            return Err(Failure::input(format_args!(
                "`--grey` is of surfaces that reflect diffusely, and mirrors are {names}: leave out `specular`"
            )));
        }
        say(format_args!(
            "note: form factors are of what arrives straight: what {names} mirror is no part of them"
        ));
    }
    let scene = file.geometry()?;
    tell(&file, &scene);
    let sky = match &file.sky {
        Some(bands) => Some(Sky::bands(&bands.altitudes, &bands.sectors).map_err(Failure::run)?),
        None => None,
    };
    let parts = Parts::new(args, &file, &scene)?;
    let watch = Watch { signals, deadline };
    let start = Instant::now();
    let (mut factors, is_finished) = if parts.takes_rays(args, &scene, sky.as_ref())? {
        ray_factors::by_rays(args, &parts, &scene, sky.as_ref(), &watch)?
    } else {
        refuse_beyond_memory(args, &file, &scene)?;
        exact(args, &parts, &scene, sky.as_ref(), &watch)?
    };
    if least > 0.0 {
        let all = &factors.factors;
        let kept = all.chosen(0..all.len(), least);
        let errors = factors.std_errors.as_ref();
        factors.std_errors = errors.map(|errors| errors.moved(&kept, &kept));
        let bounds = factors.bounds.as_ref();
        factors.bounds = bounds.map(|bounds| bounds.moved(all, &kept));
        factors.factors = kept;
    }
    if let Some(space) = &mut factors.space {
        space.seconds = start.elapsed().as_secs_f64();
    }
    let is_interrupted = signals.is_some_and(Signals::interrupted);
    let ended = match is_finished {
        true => Ended::Done,
        false if is_interrupted => Ended::Interrupted,
        false => Ended::ErrorNotReached,
    };
    Ok(Computed { factors, ended })
}

/// What ends the work early.
pub(crate) struct Watch<'a> {
    signals: Option<&'a Signals>,
    pub(crate) deadline: Option<Instant>,
}

impl Watch<'_> {
    pub(crate) fn is_over(&self) -> bool {
        self.signals.is_some_and(Signals::interrupted)
            || self.deadline.is_some_and(|end| Instant::now() >= end)
    }

    /// From now on a first Ctrl-C waits for what is printed.
    pub(crate) fn begin(&self) {
        if let Some(signals) = self.signals {
            signals.expect_results();
        }
    }
}

/// The groups between which form factors are wanted: surfaces or polygons.
pub(crate) struct Parts {
    pub(crate) names: Vec<String>,
    pub(crate) emissivities: Vec<f64>,
    /// The group of each face.
    pub(crate) group_of: Vec<usize>,
    /// The rows that are wanted, if these are not all.
    pub(crate) rows: Option<Vec<usize>>,
    pub(crate) open: bool,
    pub(crate) mesh_crc32: String,
    /// The polygons of the file, if it matters.
    pub(crate) drawn: Drawn,
}

impl Parts {
    fn new(args: &FactorsArgs, file: &SceneFile, scene: &Scene) -> Result<Self, Failure> {
        let names: Vec<String> = file.surfaces.iter().map(|s| s.name.clone()).collect();
        let own: Vec<f64> = file
            .surfaces
            .iter()
            // Of a surface from which the net flux is given it may be known.
            .map(|s| s.emissivity.unwrap_or(1.0 - s.material.reflectance))
            .collect();
        let unknown = file.without_material().filter(|_| args.grey);
        if let Some(unknown) = unknown {
            return Err(Failure::input(format_args!(
                "`--grey` takes the emissivity of every surface, and {unknown}"
            )));
        }
        let mut wanted = Vec::new();
        for name in &args.rows {
            let Some(at) = names.iter().position(|own| own == name) else {
                let near = nearest(name, &names);
                let near = near.map_or(String::new(), |near| format!("; did you mean {near:?}?"));
                return Err(Failure::input(format_args!(
                    "`--rows`: there is no surface named {name:?}{near}"
                )));
            };
            wanted.push(at);
        }
        // Obstructions of decks hide others and are not reported, where rows can be left out.
        let format = args.out.as_deref().and_then(Format::of);
        let has_all_rows = args.grey || args.close || format.and_then(Format::whole).is_some();
        let reported = || file.surfaces.iter().map(|own| !own.is_obstruction);
        let leaves_out = !has_all_rows && args.rows.is_empty() && reported().any(|own| !own);
        if leaves_out {
            let own = reported()
                .enumerate()
                .filter(|(_, is_reported)| *is_reported);
            wanted.extend(own.map(|(at, _)| at));
            let count = names.len() - wanted.len();
            say(format_args!(
                "note: obstructions have no rows: {count} of them"
            ));
        }
        let places: Vec<Place> = (0..scene.faces().len())
            .filter_map(|f| scene.place(f))
            .collect();
        let drawn = match format {
            Some(Format::Foam) => drawn(file, &places),
            _ => Drawn::default(),
        };
        let surfaces = places.iter().map(|place| place.surface);
        let (group_of, rows, names, emissivities) = if args.faces {
            // A polygon that was cut has several parts.
            let mut parts: HashMap<(usize, usize), usize> = HashMap::new();
            let name = |p: &Place| {
                let part = parts.entry((p.surface, p.polygon)).or_default();
                *part += 1;
                match part {
                    1 => format!("{} {}", names[p.surface], p.polygon),
                    _ => format!("{} {}, part {part}", names[p.surface], p.polygon),
                }
            };
            let all: Vec<String> = places.iter().map(name).collect();
            let emissivities = places.iter().map(|p| own[p.surface]).collect();
            let rows = (0..places.len()).filter(|&f| wanted.contains(&places[f].surface));
            (
                (0..places.len()).collect(),
                rows.collect(),
                all,
                emissivities,
            )
        } else {
            (surfaces.collect(), wanted, names, own)
        };
        Ok(Self {
            names,
            emissivities,
            group_of,
            rows: (leaves_out || !args.rows.is_empty()).then_some(rows),
            open: file.open,
            mesh_crc32: digest(file),
            drawn,
        })
    }

    /// The number of rows.
    pub(crate) fn count(&self) -> usize {
        self.wanted().len()
    }

    /// The numbers of the rows.
    pub(crate) fn wanted(&self) -> Vec<usize> {
        let all = || (0..self.names.len()).collect();
        self.rows.clone().unwrap_or_else(all)
    }

    /// Whether a face is in one of the rows.
    fn wants(&self, face: usize) -> bool {
        let own = self.rows.as_ref().zip(self.group_of.get(face));
        own.is_none_or(|(rows, group)| rows.contains(group))
    }

    pub(crate) fn row_names(&self, rows: &[usize]) -> Vec<String> {
        rows.iter().map(|&row| self.names[row].clone()).collect()
    }

    /// Whether rays are asked for, or take much less time than exact factors: a forecast from some rows, the same on every machine.
    fn takes_rays(
        &self,
        args: &FactorsArgs,
        scene: &Scene,
        sky: Option<&Sky>,
    ) -> Result<bool, Failure> {
        let refused = [("--grey", args.grey), ("--close", args.close)];
        let refused = refused.iter().find(|(_, given)| *given);
        match args.method.unwrap_or(FactorMethod::Auto) {
            FactorMethod::Exact => return Ok(false),
            FactorMethod::Rays => {
                return match refused {
                    Some((flag, _)) => Err(Failure::input(format_args!(
                        "`{flag}` takes exact factors: leave out `--method rays`"
                    ))),
                    None => Ok(true),
                };
            }
            FactorMethod::Auto if refused.is_some() => return Ok(false),
            FactorMethod::Auto => {}
        }
        let error = args.error.unwrap_or(ERROR);
        let sights = Sights::new(scene, error).map_err(Failure::input)?;
        let exact: f64 = self
            .forecast(&sights, scene.faces().len(), sky)
            .iter()
            .sum();
        let rays = ray_factors::rays_for(error) * self.count() as f64 * RAY;
        Ok(exact > 60.0 && exact > 10.0 * rays)
    }

    /// The seconds on one thread that the row of each face takes: a forecast from some rows, the same on every machine.
    fn forecast(&self, sights: &Sights<'_>, faces: usize, sky: Option<&Sky>) -> Vec<f64> {
        let wanted: Vec<usize> = (0..faces).filter(|&face| self.wants(face)).collect();
        let step = wanted.len().div_ceil(SAMPLE).max(1);
        let mut all = vec![0.0; faces];
        for own in wanted.chunks(step) {
            let middle = own[own.len() / 2];
            let pairs = sights.work(middle);
            let outside = sky.map_or(0.0, |sky| sights.sky_work(middle, sky));
            for &face in own {
                // Of all rows each pair is looked at once, by the first of its faces.
                let share = match self.rows {
                    Some(_) => 1.0,
                    None => (faces - face) as f64 / faces as f64,
                };
                all[face] = POINT * (share * pairs + outside);
            }
        }
        all
    }
}

/// The rows of which the time of all is forecast.
const SAMPLE: usize = 32;

/// Seconds of a point past one obstacle, and of a ray, on one thread.
const POINT: f64 = 1e-6;
const RAY: f64 = 1e-6;

/// Exact form factors, and whether all rows are finished.
fn exact(
    args: &FactorsArgs,
    parts: &Parts,
    scene: &Scene,
    sky: Option<&Sky>,
    watch: &Watch<'_>,
) -> Result<(Factors, bool), Failure> {
    let sights = Sights::new(scene, args.error.unwrap_or(ERROR)).map_err(Failure::input)?;
    let count = scene.faces().len();
    let is_wanted = |face: usize| parts.wants(face);
    let all_rows = |face: usize| {
        if watch.is_over() {
            return None;
        }
        if !is_wanted(face) {
            return Some((Row::default(), None));
        }
        let row = match parts.rows {
            // What another wanted row has is not done again.
            Some(_) => {
                let mut row = sights.whole_row(face);
                row.entries
                    .retain(|&(other, _)| other as usize > face || !is_wanted(other as usize));
                row
            }
            None => sights.row(face),
        };
        Some((row, sky.map(|sky| sights.sky(face, sky))))
    };
    watch.begin();
    let seconds = parts.forecast(&sights, count, sky);
    let found = with_threads(args.threads, || rows(&seconds, &all_rows))?;
    let finished = found.iter().position(Option::is_none).unwrap_or(count);
    let is_finished = finished == count;
    let (all, of_sky): (Vec<Row>, Vec<_>) =
        found.into_iter().map(|own| own.unwrap_or_default()).unzip();
    let of_sky: Result<Vec<Option<SkyRow>>, _> =
        of_sky.into_iter().map(Option::transpose).collect();
    let of_sky = of_sky.map_err(Failure::run)?;
    let errors: Vec<f64> = all.iter().map(|row| row.error).collect();
    // Entries of a row that is wanted alone may be before its own face.
    let mut all = AllFactors::new(scene, ascending(all)).map_err(Failure::run)?;
    let format = args.out.as_deref().and_then(Format::of);
    let has_bounds = format == Some(Format::Csv) && !args.grey;
    let before = (has_bounds && args.close).then(|| all.clone());
    if args.close && is_finished {
        let off = all
            .close()
            .map_err(|error| Failure::input(format_args!("`--close`: {error}")))?;
        say(format_args!(
            "rows closed: they were off by at most {off:.1e}"
        ));
    }
    let (areas, pairs, error) = (all.areas().to_vec(), all.pairs(), all.error());
    let grey = (args.grey && is_finished).then_some(parts.emissivities.as_slice());
    if args.grey && !is_finished {
        return Err(Failure::run(
            "`--grey` needs all rows, and not all are finished",
        ));
    }
    let grouped = |all: &AllFactors| {
        let groups = all.of_groups(&parts.group_of, parts.names.len());
        groups.map_err(Failure::run)
    };
    let groups = (!args.faces).then(|| grouped(&all)).transpose()?;
    let bounds = match has_bounds {
        true => {
            let bounds = bounds(&all, before.as_ref(), &errors);
            let bounds = AllFactors::new(scene, bounds).map_err(Failure::run)?;
            Some(match args.faces {
                true => Rows::Sparse(SparseFactors::new(&bounds)),
                false => Rows::Dense(rows_of(&grouped(&bounds)?, None)?),
            })
        }
        false => None,
    };
    let sky_error = of_sky
        .iter()
        .flatten()
        .map(|row| row.error)
        .fold(error, f64::max);
    let width = sky.map_or(0, |sky| sky.patches().len() + 1);
    let sky_table = match sky {
        Some(sky) => {
            let none = SkyRow {
                exchange: vec![0.0; width],
                error: 0.0,
            };
            let rows: Vec<SkyRow> = of_sky
                .into_iter()
                .map(|row| row.unwrap_or_else(|| none.clone()))
                .collect();
            let f = SkyFactors::of_groups(&areas, &rows, &parts.group_of, parts.names.len());
            let groups = groups.as_ref().zip(grey);
            let mut table = sky_table(sky, &f.map_err(Failure::run)?, groups)?;
            if has_bounds {
                // The mean of those of its faces, by area.
                let mut sums = vec![[0.0; 2]; parts.names.len()];
                for ((&group, row), area) in parts.group_of.iter().zip(&rows).zip(&areas) {
                    let [error, all] = &mut sums[group];
                    *error += area * row.error;
                    *all += area;
                }
                table.bounds = sums.iter().map(|[error, all]| error / all).collect();
            }
            Some(table)
        }
        None => None,
    };
    let (factors, areas) = match &groups {
        Some(groups) => (Rows::Dense(rows_of(groups, grey)?), groups.areas().to_vec()),
        None => (Rows::Sparse(SparseFactors::new(&all)), areas),
    };
    // Of rows that were not finished the pairs with others are not known.
    let mut is_known = vec![true; parts.names.len()];
    for &group in parts.group_of.get(finished..).unwrap_or(&[]) {
        is_known[group] = false;
    }
    let chosen: Option<Vec<usize>> = match (is_finished, &parts.rows) {
        (true, None) => None,
        _ => Some(
            parts
                .wanted()
                .into_iter()
                .filter(|&row| is_known[row])
                .collect(),
        ),
    };
    if !is_finished {
        say(format_args!(
            "warning: {} of {} rows were finished, and are printed",
            chosen.as_ref().map_or(0, Vec::len),
            parts.count()
        ));
    }
    let mut result = Factors {
        factors,
        surfaces: parts.names.clone(),
        rows: None,
        std_errors: None,
        bounds,
        unit: None,
        space: Some(Space {
            areas,
            emissivities: parts.emissivities.clone(),
            mesh_crc32: parts.mesh_crc32.clone(),
            drawn: parts.drawn.clone(),
            open: parts.open,
            polygons: count,
            pairs,
            estimated_error: sky_error,
            seconds: 0.0,
        }),
        sky: sky_table,
    };
    if let Some(rows) = chosen {
        result.factors = result.factors.chosen(rows.iter().copied(), 0.0);
        let bounds = result.bounds.as_ref();
        result.bounds = bounds.map(|bounds| bounds.chosen(rows.iter().copied(), 0.0));
        if let Some(sky) = result.sky.as_mut() {
            if has_bounds {
                sky.bounds = rows.iter().map(|&row| sky.bounds[row]).collect();
            }
            sky.factors = rows.iter().map(|&row| sky.factors[row].clone()).collect();
            sky.below = rows.iter().map(|&row| sky.below[row]).collect();
        }
        result.rows = Some(parts.row_names(&rows));
    }
    Ok((result, is_finished))
}

/// Bounds of the errors of exchange areas: what the rows of both faces are estimated to be off by, of the smaller face, and by how much
/// they have been changed.
fn bounds(all: &AllFactors, before: Option<&AllFactors>, errors: &[f64]) -> Vec<Row> {
    let areas = all.areas();
    let row = |i: usize| {
        let pairs = all.row(i).iter().zip(before.unwrap_or(all).row(i));
        let entry = |(&(other, now), &(_, was)): (&(u32, f64), &(u32, f64))| {
            let j = other as usize;
            let error = errors[i].max(errors[j]) * areas[i].min(areas[j]);
            (other, error + (now - was).abs())
        };
        Row {
            entries: pairs.map(entry).collect(),
            ..Row::default()
        }
    };
    (0..areas.len()).map(row).collect()
}

/// The CRC-32 of names and polygons: of each surface the name in UTF-8 and a zero byte, then of each polygon the number of vertices in 32
/// bits and the coordinates in 64, little endian.
fn digest(file: &SceneFile) -> String {
    const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
    let mut digest = CRC.digest();
    for surface in &file.surfaces {
        digest.update(surface.name.as_bytes());
        digest.update(&[0]);
        for polygon in &surface.polygons {
            let points = polygon.points();
            digest.update(&(points.len() as u32).to_le_bytes());
            // -0 is 0.
            for x in points.iter().flatten() {
                digest.update(&(x + 0.0).to_le_bytes());
            }
        }
    }
    format!("{:08x}", digest.finalize())
}

/// Which polygon of the file each face is a part of.
fn drawn(file: &SceneFile, places: &[Place]) -> Drawn {
    let numbers: Vec<Vec<usize>> = (0..file.surfaces.len())
        .map(|surface| file.drawn(surface))
        .collect();
    let count = |own: &Vec<usize>| own.last().map_or(0, |last| last + 1);
    let counts: Vec<usize> = numbers.iter().map(count).collect();
    let first = |surface: usize| counts[..surface].iter().sum::<usize>();
    let first: Vec<usize> = (0..counts.len()).map(first).collect();
    let part_of = places.iter();
    let part_of = part_of.map(|p| first[p.surface] + numbers[p.surface][p.polygon]);
    Drawn {
        part_of: part_of.collect(),
        counts,
    }
}

/// Rows whose entries are after their own face: what stands before it goes to the row of the other.
fn ascending(mut rows: Vec<Row>) -> Vec<Row> {
    for face in 0..rows.len() {
        let own = core::mem::take(&mut rows[face].entries);
        for (other, amount) in own {
            let (first, second) = (face.min(other as usize), face.max(other as usize));
            if let Some(row) = rows.get_mut(first) {
                row.entries.push((second as u32, amount));
            }
        }
    }
    for row in &mut rows {
        row.entries.sort_unstable_by_key(|entry| entry.0);
        row.entries.dedup_by_key(|entry| entry.0);
    }
    rows
}

/// Says what was left out, and how precise the coordinates are.
fn tell(file: &SceneFile, scene: &Scene) {
    let names: Vec<String> = file.surfaces.iter().map(|s| s.name.clone()).collect();
    let own = file.remarks.iter().cloned().chain(file.in_millimetres());
    for note in own.chain(fredholm::scene::notes(&names, scene)) {
        say(format_args!("note: {note}"));
    }
}

/// Form factors, or exchange factors of grey surfaces, row by row.
fn rows_of(groups: &Groups, grey: Option<&[f64]>) -> Result<Vec<Vec<f64>>, Failure> {
    let n = groups.len();
    match grey {
        Some(emissivities) => {
            let all = groups.script_f(emissivities).map_err(Failure::input)?;
            Ok(all.chunks(n.max(1)).map(<[f64]>::to_vec).collect())
        }
        None => Ok((0..n)
            .map(|i| (0..n).map(|j| groups.factor(i, j)).collect())
            .collect()),
    }
}

/// What arrives at the patches of a sky, all reflections of grey surfaces included, and below the horizon.
fn sky_table(
    sky: &Sky,
    factors: &SkyFactors,
    grey: Option<(&Groups, &[f64])>,
) -> Result<SkyTable, Failure> {
    let width = factors.patches() + 1;
    let all: Vec<f64> = match grey {
        Some((groups, emissivities)) => groups
            .script_sky(emissivities, factors)
            .map_err(Failure::input)?,
        None => (0..factors.len())
            .flat_map(|i| (0..width).map(move |k| factors.factor(i, k)))
            .collect(),
    };
    let rows = all.chunks_exact(width);
    Ok(SkyTable {
        patches: patches_of(sky),
        factors: rows.clone().map(|row| row[..width - 1].to_vec()).collect(),
        below: rows.map(|row| row[width - 1]).collect(),
        std_errors: None,
        bounds: Vec::new(),
    })
}

/// The patches of a sky, with their names.
pub(crate) fn patches_of(sky: &Sky) -> Vec<SkyPatch> {
    let mut names = Vec::new();
    let (mut band, mut sector, mut low) = (0, 0, f64::NAN);
    for patch in sky.patches() {
        if patch.altitudes[0] != low {
            (band, sector, low) = (band + 1, 0, patch.altitudes[0]);
        }
        sector += 1;
        names.push(format!("sky {band}.{sector}"));
    }
    let patches = names.into_iter().zip(sky.patches());
    patches
        .map(|(name, own)| SkyPatch {
            name,
            altitudes: own.altitudes,
            azimuths: own.azimuths,
            solid_angle: Some(own.solid_angle),
        })
        .collect()
}

/// Asked before the work: at worst all faces see each other.
fn refuse_beyond_memory(
    args: &FactorsArgs,
    file: &SceneFile,
    scene: &Scene,
) -> Result<(), Failure> {
    let faces = scene.faces().len();
    // Sparse tables have no zeros, but these do.
    let format = args.out.as_deref().and_then(Format::of);
    let has_zeros = matches!(format, Some(Format::Json | Format::View3d));
    let printed = if !args.faces {
        file.surfaces.len()
    } else if args.json || has_zeros {
        faces
    } else {
        0
    };
    let pairs = faces.saturating_mul(faces) / 2;
    let patches = file.sky.as_ref().map_or(0, |sky| {
        sky.sectors.iter().fold(1, |sum, &n| sum + n as usize)
    });
    let needed = pairs
        .saturating_mul(PAIR)
        .saturating_add(patches.saturating_mul(8 * faces + PRINTED * printed))
        .saturating_add(printed.saturating_mul(printed).saturating_mul(PRINTED));
    let what = || format!("the form factors of {faces} polygons");
    let advice = if printed == faces {
        "; files .csv and .npz leave out zeros"
    } else {
        ""
    };
    fredholm::memory::refuse_beyond_memory(what, needed, advice).map_err(Failure::input)
}

/// The rows of all faces, on the threads of the pool, with a bar on a terminal: by the seconds that they are forecast to take.
fn rows<T: Send>(seconds: &[f64], row: &(dyn Fn(usize) -> T + Sync)) -> Vec<T> {
    // Microseconds, and one at least.
    let steps = |face: usize| 1 + (1e6 * seconds[face]) as u64;
    let faces = seconds.len();
    let all = (0..faces).map(steps).sum();
    let template = "{bar:30} {percent:>3} % of the work, {eta} left";
    let bar = bar(all, template, |style| style);
    // First rows are the longest: one by one, so that no thread gets all of them.
    let rows = (0..faces)
        .into_par_iter()
        .with_max_len(1)
        .map(|face| {
            let row = row(face);
            bar.inc(steps(face));
            row
        })
        .collect();
    bar.finish_and_clear();
    rows
}

/// Checks a scene, and says what it is made of; draws it into a file.
pub(crate) fn check(file: &SceneFile, out: Option<&Path>) -> Result<Ended, Failure> {
    // Before it is refused: the picture may show why.
    if let Some(path) = out {
        if path.extension().is_none_or(|e| e != "svg") {
            return Err(Failure::of_out(path, "the name must end in .svg"));
        }
        let polygons = |surface: &SceneSurface| {
            let own = surface.polygons.iter();
            own.map(|polygon| polygon.points().to_vec()).collect()
        };
        let surfaces = file.surfaces.iter();
        let drawing = SpaceDrawing {
            surfaces: surfaces
                .map(|own| (own.name.clone(), polygons(own)))
                .collect(),
        };
        Output::open("--out", path)?.finish(table::drawn(drawing.draw())?)?;
    }
    let scene = file.geometry()?;
    tell(file, &scene);
    let light = if file.open { "may leave" } else { "stays" };
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let mut rows = vec![
        row("problem", "scene".to_owned()),
        row("polygons", scene.faces().len().to_string()),
        row("light", light.to_owned()),
    ];
    if scene.period().is_none() {
        let sights = Sights::new(&scene, ERROR).map_err(Failure::run)?;
        let hiding = sights.occluders().to_string();
        rows.push(row("large polygons that may hide", hiding));
    }
    if let Some(sky) = &file.sky {
        let patches: u64 = sky.sectors.iter().map(|&n| u64::from(n)).sum();
        let plural = if patches == 1 { "" } else { "es" };
        let light = if sky.emissions.is_some() {
            "light"
        } else {
            "no light"
        };
        rows.push(row(
            "sky",
            format!("{patches} patch{plural}, gives {light}"),
        ));
    }
    for (k, surface) in file.surfaces.iter().enumerate() {
        let area = scene.area(k).map_err(Failure::run)?;
        // Nobody means the last digits of a sum.
        let area = (1e6 * area).round() / 1e6;
        let count = surface.polygons.len();
        let plural = if count == 1 { "" } else { "s" };
        rows.push(row(
            &surface.name,
            format!("{count} polygon{plural}, area {area}"),
        ));
    }
    print(aligned(&rows))?;
    if let Some(remark) = file.without_material() {
        say(format_args!("note: {remark}"));
    }
    Ok(Ended::Done)
}
