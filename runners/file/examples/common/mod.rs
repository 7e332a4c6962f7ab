//! What examples measure scenes with.

use fredholm_core::{
    Absorption, Batch, Equation, Functional, Goal, Goals, Job, NeighbourOf, Statistics, WalkOptions,
};
use fredholm_file::Resolution;
use fredholm_scene::Scene;

pub(crate) type Failed = Box<dyn core::error::Error>;

/// Seconds that this process has computed, on Linux.
pub(crate) fn processor_seconds() -> f64 {
    let all = std::fs::read_dir("/proc/self/task").into_iter().flatten();
    let of_threads = all.flatten().filter_map(|thread| {
        let told = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        told.split(' ').next()?.parse::<f64>().ok()
    });
    1e-9 * of_threads.sum::<f64>()
}

/// The living room of the examples without its lamp at a point: the window gives the light.
pub(crate) fn living_room() -> Result<String, Failed> {
    let text = std::fs::read_to_string("examples/living-room.toml")?;
    let text = text.replace("living-room.obj", "examples/living-room.obj");
    let light = text.find("[[problem.light]]").ok_or("no light")?;
    let surfaces = text[light..].find("[[problem.surface]]");
    let rest = light + surfaces.ok_or("no surface")?;
    Ok(text[..light].to_owned() + &text[rest..])
}

/// What is done with the scene of a file.
pub(crate) fn with_scene(
    text: &str,
    then: impl FnOnce(&Scene) -> Result<(), Failed>,
) -> Result<(), Failed> {
    let resolved = fredholm_file::read("case.toml", text)?.resolve()?;
    match &resolved.model {
        Resolution::Scene(model) => then(model.scene()),
        _ => Err("this is no scene".into()),
    }
}

/// Statistics of so many walks, and seconds a walk.
pub(crate) fn walk<E, N, T>(
    (equation, neighbour): (&E, &N),
    functional: T,
    absorption: Absorption,
    (walks, control_mean): (u64, Option<f64>),
) -> Result<(Statistics, f64), Failed>
where
    E: Equation<Scalar = f64, Value = f64> + Sync,
    N: NeighbourOf<E> + Sync,
    T: Functional<E> + Sync,
{
    let goals = [Goal::new(functional, control_mean)];
    let options = WalkOptions {
        absorption,
        ..WalkOptions::default()
    };
    let job = Goals::new(equation, neighbour, &goals, options);
    let mut batches = [Batch::new(0, walks, walks)];
    let start = processor_seconds();
    job.run(0, &mut batches, u64::MAX)?;
    let seconds = (processor_seconds() - start) / walks as f64;
    Ok((*batches[0].statistics(), seconds))
}
