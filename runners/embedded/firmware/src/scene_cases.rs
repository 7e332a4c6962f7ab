//! The cases of scenes, whose walks have a last step to the light.

use fredholm_core::{
    At, KnownPart, LastStep, Neighbour, Real, RunOptions, Started, Tolerance, WithKnown,
};
use fredholm_embedded::{Aligned, Table};

use super::scene_table::SceneTable;
use super::{Runner, both, options, until};

/// Constants that `fredholm export -o FILE.rs` wrote.
mod scene_f64 {
    include!("../tables/scene_f64.rs");
}
/// A table that `fredholm export -o FILE.bin` wrote.
static SCENE_LINEAR_F32: &Aligned<[u8]> =
    &Aligned(*include_bytes!("../tables/scene_linear_f32.bin"));

/// The arrays of a scene as constants of a module.
macro_rules! scene_of_constants {
    ($module:ident) => {
        SceneTable {
            absorb: $module::ABSORB[0],
            open: $module::OPEN[0],
            faces: &$module::FACES,
            triangles: &$module::TRIANGLE,
            nodes: &$module::NODES,
            sides: &$module::SIDES,
            patches: &$module::PATCHES,
            lights: &$module::LIGHTS,
            shares: &$module::SHARES,
            surfaces: &$module::SURFACES,
            numbers: &$module::NUMBERS,
            ends: &$module::ENDS,
            known: &$module::KNOWN,
            means: &$module::MEANS,
            degree: $module::DEGREE[0],
            v: &$module::V,
            control: &$module::CONTROL,
            integral: &$module::INTEGRAL,
            events: &$module::EVENTS,
            of_events: &$module::OFEVENTS,
            rays: &$module::RAYS,
            pairs: $module::PAIRS[0],
        }
    };
}

/// A room in space, as constants of degree 0, and one with a block as bytes of degree 1.
pub(super) fn scenes(runner: &mut impl Runner) -> Option<()> {
    scene::<f64, 1>("scene", &scene_of_constants!(scene_f64), runner)?;
    let bytes = Table::read(&SCENE_LINEAR_F32.0, "scene").ok()?;
    scene::<f32, 3>("scene/linear", &SceneTable::read(&bytes)?, runner)
}

/// u in a point of the floor until an error is reached, and the mean over the walls: of walks with a last step to the light.
fn scene<F: Real, const B: usize>(
    name: &str,
    table: &SceneTable<'_, F>,
    runner: &mut impl Runner,
) -> Option<()> {
    const FLOOR: u32 = 0;
    const WALLS: usize = 2;
    let radiosity = table.radiosity()?;
    let sampled = table.neighbour::<B>(&radiosity)?;
    let last = LastStep(&radiosity);
    let (equation, neighbour) = (WithKnown(&last), WithKnown(&sampled));
    let point = radiosity.at(FLOOR, [0.3, 0.6, 0.0]).ok()?;
    let known = radiosity.emission_of_light(FLOOR);
    let at = neighbour.locate(Started { point, known });
    let v0 = neighbour.value(&at).to_f64();
    let start = KnownPart {
        functional: At(point),
        known,
    };
    let few = |options: RunOptions| RunOptions {
        walks: options.walks / 8,
        batch: options.batch / 8,
        ..options
    };
    let all = (&equation, &neighbour);
    let relative = few(until(Tolerance::Relative(1e-3)));
    both(runner, name, all, (&start, Some(v0), 9), relative);
    let start = KnownPart {
        functional: table.mean_over(&radiosity, WALLS)?,
        known: F::from_f64(*table.known.get(WALLS)?),
    };
    let mean = (&start, table.means.get(WALLS).copied(), 10);
    both(runner, name, all, mean, few(options()));
    Some(())
}
