//! Scenes in space: their form factors, and what `check` says of them.

use std::path::{Path, PathBuf};
use std::time::Instant;

use fredholm_factors::{
    Factors as AllFactors, Groups, Row, Sights, Sky, SkyFactors, SkyRow, SparseFactors,
};
use fredholm_file::scene::{SceneFile, SceneSurface, is_description, is_mesh, parse_description};
use fredholm_plot::SpaceDrawing;
use fredholm_scene::{Place, Scene};
use rayon::prelude::*;

use crate::args::FactorsArgs;
use crate::factors::{Factors, SkyPatch, SkyTable, Space};
use crate::failure::{Ended, Failure, print, say};
use crate::file;
use crate::numbers::aligned;
use crate::progress::bar;
use crate::sparse::Rows;
use crate::table;
use crate::threads::with_threads;
use fredholm_file::parts::output::Output;

/// The error of form factors behind obstacles if nothing else is asked for.
pub(crate) const ERROR: f64 = 1e-9;

/// Bytes of a pair of faces, and of a pair of surfaces, which is printed.
const PAIR: usize = 16;
const PRINTED: usize = 48;

/// The scene of a file; `None` if the file is no scene.
pub(crate) fn read(path: &Path) -> Result<Option<SceneFile>, Failure> {
    if is_mesh(path) {
        return Ok(Some(file::scene::read(path)?));
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
pub(crate) fn factors(args: &FactorsArgs, mut file: SceneFile) -> Result<Factors, Failure> {
    let is_text = |path: &PathBuf| path.extension().is_some_and(|e| e == "txt");
    if file.sky.is_some() && args.out.as_ref().is_some_and(is_text) {
        return Err(Failure::input(
            "`--out`: View3D's text format has no sky: write .json, .csv or .npz",
        ));
    }
    file.open |= args.open;
    if args.watts {
        return Err(Failure::input(
            "`--watts` is for rooms in the plane: of a scene `--grey` gives script F, and A_I F_IJ σ(T_I⁴ − T_J⁴) W go from I to J",
        ));
    }
    let scene = file.scene::<f64>()?;
    tell(&file, &scene);
    let start = Instant::now();
    let sights = Sights::new(&scene, args.error.unwrap_or(ERROR)).map_err(Failure::input)?;
    refuse_beyond_memory(args, &file, &scene)?;
    let sky = match &file.sky {
        Some(bands) => Some(Sky::bands(&bands.altitudes, &bands.sectors).map_err(Failure::run)?),
        None => None,
    };
    let all_rows = |face: usize| {
        (
            sights.row(face),
            sky.as_ref().map(|sky| sights.sky(face, sky)),
        )
    };
    let (rows, of_sky): (Vec<Row>, Vec<_>) =
        with_threads(args.threads, || rows(scene.faces().len(), &all_rows))?
            .into_iter()
            .unzip();
    let of_sky: Option<Result<Vec<SkyRow>, _>> = of_sky.into_iter().collect();
    let of_sky = of_sky.transpose().map_err(Failure::run)?;
    let mut all = AllFactors::new(&scene, rows).map_err(Failure::run)?;
    if args.close {
        let off = all
            .close()
            .map_err(|error| Failure::input(format_args!("`--close`: {error}")))?;
        say(format_args!(
            "rows closed: they were off by at most {off:.1e}"
        ));
    }
    let seconds = start.elapsed().as_secs_f64();
    let names: Vec<String> = file.surfaces.iter().map(|s| s.name.clone()).collect();
    let own: Vec<f64> = file
        .surfaces
        .iter()
        // Of a surface from which the net flux is given it may be known.
        .map(|s| s.emissivity.unwrap_or(1.0 - s.material.reflectance))
        .collect();
    let places: Vec<Place> = (0..scene.faces().len())
        .filter_map(|f| scene.place(f))
        .collect();
    let (group_of, names, emissivities): (Vec<usize>, Vec<String>, Vec<f64>) = if args.faces {
        let name = |p: &Place| format!("{} {}", names[p.surface], p.polygon);
        let emissivities = places.iter().map(|p| own[p.surface]).collect();
        let each = (0..places.len()).collect();
        (each, places.iter().map(name).collect(), emissivities)
    } else {
        (places.iter().map(|p| p.surface).collect(), names, own)
    };
    let (areas, pairs, error) = (all.areas().to_vec(), all.pairs(), all.error());
    let grey = args.grey.then_some(emissivities.as_slice());
    let groups = if args.faces {
        None
    } else {
        let groups = all.of_groups(&group_of, names.len());
        Some(groups.map_err(Failure::run)?)
    };
    let sky_table = match (&sky, &of_sky) {
        (Some(sky), Some(rows)) => {
            let f = SkyFactors::of_groups(&areas, rows, &group_of, names.len());
            let groups = groups.as_ref().zip(grey);
            Some(sky_table(sky, &f.map_err(Failure::run)?, groups)?)
        }
        _ => None,
    };
    let sky_error = of_sky.iter().flatten().map(|row| row.error);
    let (factors, areas) = match &groups {
        Some(groups) => (Rows::Dense(rows_of(groups, grey)?), groups.areas().to_vec()),
        None => (Rows::Sparse(SparseFactors::new(&all)), areas),
    };
    Ok(Factors {
        factors,
        surfaces: names,
        unit: None,
        space: Some(Space {
            sky: sky_table,
            areas,
            emissivities,
            open: file.open,
            polygons: scene.faces().len(),
            pairs,
            estimated_error: sky_error.fold(error, f64::max),
            seconds,
        }),
    })
}

/// Says what was left out, and how precise the coordinates are.
fn tell(file: &SceneFile, scene: &Scene) {
    let names: Vec<String> = file.surfaces.iter().map(|s| s.name.clone()).collect();
    for note in fredholm::scene::notes(&names, scene) {
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
    Ok(SkyTable {
        patches: patches
            .map(|(name, own)| SkyPatch {
                name,
                altitudes: own.altitudes,
                azimuths: own.azimuths,
                solid_angle: own.solid_angle,
            })
            .collect(),
        factors: rows.clone().map(|row| row[..width - 1].to_vec()).collect(),
        below: rows.map(|row| row[width - 1]).collect(),
    })
}

/// Asked before the work: at worst all faces see each other.
fn refuse_beyond_memory(
    args: &FactorsArgs,
    file: &SceneFile,
    scene: &Scene,
) -> Result<(), Failure> {
    let faces = scene.faces().len();
    // Sparse tables have no zeros, but these do.
    let has_zeros = |path: &PathBuf| path.extension().is_none_or(|e| e != "csv" && e != "npz");
    let printed = if !args.faces {
        file.surfaces.len()
    } else if args.json || args.out.as_ref().is_some_and(has_zeros) {
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

/// The rows of all faces, on the threads of the pool, with a bar on a terminal.
fn rows<T: Send>(faces: usize, row: &(dyn Fn(usize) -> T + Sync)) -> Vec<T> {
    let template = "{bar:30} {percent:>3} % of {human_len} polygons, {eta} left";
    let bar = bar(faces as u64, template, |style| style);
    // First rows are the longest: one by one, so that no thread gets all of them.
    let rows = (0..faces)
        .into_par_iter()
        .with_max_len(1)
        .map(|face| {
            let row = row(face);
            bar.inc(1);
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
    let scene = file.scene::<f64>()?;
    tell(file, &scene);
    let sights = Sights::new(&scene, ERROR).map_err(Failure::run)?;
    let light = if file.open { "may leave" } else { "stays" };
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let mut rows = vec![
        row("problem", "scene".to_owned()),
        row("polygons", scene.faces().len().to_string()),
        row("light", light.to_owned()),
        row(
            "large polygons that may hide",
            sights.occluders().to_string(),
        ),
    ];
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
    for remark in &file.remarks {
        say(format_args!("warning: {remark}"));
    }
    Ok(Ended::Done)
}
