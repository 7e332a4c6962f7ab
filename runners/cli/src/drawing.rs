//! The surfaces of a room as `check --out` draws them, also of a room that is refused.

use std::path::Path;

use fredholm_plot::Drawing;

use crate::failure::Failure;
use crate::file::{ProblemFile, kinds::Room};
use crate::table;
use fredholm_file::parts::output::Output;

/// Draws the surfaces of a file.
pub(crate) fn draw(file: &ProblemFile, out: &Path) -> Result<(), Failure> {
    let Some(room) = file.problem.of::<Room>() else {
        return Err(Failure::of_out(
            out,
            "drawings are of rooms: `kind = \"room\"`",
        ));
    };
    let extension = out.extension();
    if extension.is_none_or(|e| !e.eq_ignore_ascii_case("svg")) {
        return Err(Failure::of_out(out, "the name must end in .svg"));
    }
    let output = Output::open("--out", out)?;
    let surfaces = room.all_surfaces(file)?;
    let ray = match surfaces.open {
        true => None,
        false => surfaces.leaving_ray(),
    };
    let unit = if surfaces.heat { "m" } else { "" };
    let parts = surfaces.parts_in_room();
    let drawing = Drawing {
        surfaces: surfaces.names.into_iter().zip(parts).collect(),
        ray,
        unit: unit.to_owned(),
    };
    Ok(output.finish(table::drawn(drawing.draw())?)?)
}
