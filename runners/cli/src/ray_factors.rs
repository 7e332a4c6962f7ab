//! Form factors of scenes by rays.

use std::time::Instant;

use fredholm_factors::{RAYS_OF_BLOCK, RayCounts, RayFactor, RayFactors, Rays, Sky};
use fredholm_scene::Scene;
use rayon::prelude::*;

use crate::args::FactorsArgs;
use crate::factors::{Factors, SkyTable, Space};
use crate::failure::{Failure, say};
use crate::progress::bar;
use crate::scene::{Parts, Watch, patches_of};
use crate::sparse::Rows;
use crate::threads::with_threads;

/// The standard error of form factors by rays if nothing else is asked for.
const ERROR: f64 = 1e-3;

/// The blocks of a row in the first stage; each stage doubles them.
const FIRST: u64 = 4;

/// The rays of a row for this standard error: a form factor of a half has the largest.
pub(crate) fn rays_for(error: f64) -> f64 {
    0.25 / (error * error)
}

/// Form factors by rays, and whether all rays were cast.
pub(crate) fn by_rays(
    args: &FactorsArgs,
    parts: &Parts,
    scene: &Scene,
    sky: Option<&Sky>,
    watch: &Watch<'_>,
) -> Result<(Factors, bool), Failure> {
    let error = args.error.unwrap_or(ERROR);
    if !(1e-7..=0.1).contains(&error) {
        return Err(Failure::input(
            "`--error`: rays have standard errors from 1e-7 to 0.1",
        ));
    }
    let seed = args.seed.unwrap_or(1);
    let count = parts.names.len();
    let rays = Rays::new(scene, &parts.group_of, count, sky, seed).map_err(Failure::input)?;
    let rows = parts.wanted();
    let blocks = (rays_for(error) / RAYS_OF_BLOCK as f64).ceil() as u64;
    let mut counts = vec![RayCounts::default(); count];
    let total = blocks.saturating_mul(rows.len() as u64);
    let bar = bar(
        total,
        "{bar:30} {percent:>3} % of rays, {eta} left",
        |style| style,
    );
    let (mut done, mut is_finished) = (0, true);
    let cast = |from: u64, to: u64| {
        // A row is no more than a unit of work.
        let of_row = |&row: &usize| {
            let mut own = RayCounts::default();
            for block in from..to {
                if watch.is_over() {
                    return None;
                }
                own.add(&rays.block(row, block));
                bar.inc(1);
            }
            Some(own)
        };
        rows.par_iter()
            .with_max_len(1)
            .map(of_row)
            .collect::<Option<Vec<RayCounts>>>()
    };
    watch.begin();
    let mut seconds_of_block = 0.0;
    while done < blocks {
        let to = if done == 0 {
            FIRST.min(blocks)
        } else {
            (2 * done).min(blocks)
        };
        let left = watch
            .deadline
            .map(|end| end.saturating_duration_since(Instant::now()));
        // All rows have the same number of rays, so that no stage is begun which does not end.
        let next = (to - done) as f64 * seconds_of_block;
        if done > 0 && left.is_some_and(|left| next > left.as_secs_f64()) {
            is_finished = false;
            break;
        }
        let start = Instant::now();
        let Some(stage) = with_threads(args.threads, || cast(done, to))? else {
            is_finished = false;
            break;
        };
        seconds_of_block = start.elapsed().as_secs_f64() / (to - done) as f64;
        for (&row, own) in rows.iter().zip(&stage) {
            counts[row].add(own);
        }
        done = to;
    }
    bar.finish_and_clear();
    if done == 0 {
        return Err(Failure::run("no ray was cast in time"));
    }
    if !is_finished {
        say(format_args!(
            "warning: {} of {} rays of each row were cast",
            done * RAYS_OF_BLOCK,
            blocks * RAYS_OF_BLOCK
        ));
    }
    let found = RayFactors::new(&rays, &counts).map_err(Failure::run)?;
    let listed = |value: fn(&RayFactor) -> f64| {
        let row = |&row: &usize| {
            let own = found.row(row).iter();
            own.map(|entry| (entry.column as usize, value(entry)))
                .collect()
        };
        Rows::Listed(rows.iter().map(row).collect(), count)
    };
    let entries = || {
        rows.iter()
            .flat_map(|&row| found.row(row).iter().chain(found.sky(row)))
    };
    let largest = entries().map(|entry| entry.std_error).fold(0.0, f64::max);
    let pairs: usize = rows.iter().map(|&row| found.row(row).len()).sum();
    let result = Factors {
        factors: listed(|entry| entry.factor),
        std_errors: Some(listed(|entry| entry.std_error)),
        bounds: None,
        surfaces: parts.names.clone(),
        rows: parts.rows.as_ref().map(|rows| parts.row_names(rows)),
        unit: None,
        space: Some(Space {
            areas: found.areas().to_vec(),
            emissivities: parts.emissivities.clone(),
            mesh_crc32: parts.mesh_crc32.clone(),
            drawn: parts.drawn.clone(),
            open: parts.open,
            polygons: scene.faces().len(),
            pairs,
            estimated_error: largest,
            seconds: 0.0,
        }),
        sky: sky.map(|sky| sky_table(sky, &found, &rows)),
    };
    Ok((result, is_finished))
}

/// What arrives at the patches of a sky.
fn sky_table(sky: &Sky, found: &RayFactors, rows: &[usize]) -> SkyTable {
    let width = sky.patches().len() + 1;
    let whole = |value: fn(&RayFactor) -> f64| -> Vec<Vec<f64>> {
        let row = |&row: &usize| {
            let mut all = vec![0.0; width];
            for entry in found.sky(row) {
                all[entry.column as usize] = value(entry);
            }
            all
        };
        rows.iter().map(row).collect()
    };
    let factors = whole(|entry| entry.factor);
    SkyTable {
        patches: patches_of(sky),
        below: factors.iter().map(|row| row[width - 1]).collect(),
        factors: factors
            .into_iter()
            .map(|row| row[..width - 1].to_vec())
            .collect(),
        std_errors: Some(whole(|entry| entry.std_error)),
        bounds: Vec::new(),
    }
}
