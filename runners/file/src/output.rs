//! `[output]`: a grid of points, and the files of results.

use std::path::Path;

use toml::de::DeValue;

use crate::place::{InputError, Placed};
use crate::section::Section;
use crate::{Target, What};

/// The name of the target that `grid` makes.
const NAME: &str = "u";

/// Reads `[output]`, whose grid is one more target. Returns the names of files.
pub(crate) fn read(
    mut section: Section<'_, '_>,
    targets: &mut Vec<Target>,
) -> Result<Vec<Placed<String>>, InputError> {
    let (grid, files) = (section.optional("grid"), section.optional("files"));
    section.finish()?;
    if let Some(field) = grid {
        if targets.iter().any(|target| target.name.value == NAME) {
            return Err(field.error(
                "the points of `grid` are called \"u\", as one of the targets is: give that another name",
            ));
        }
        let what = if matches!(field.value, DeValue::Array(_)) {
            What::Lattice(field.integers()?)
        } else {
            What::Grid(field.integer()?, None)
        };
        let name = Placed::file(field.key.clone(), NAME.to_owned());
        targets.push(Target {
            name,
            component: None,
            ask: None,
            from: None,
            what,
            measured: None,
        });
    }
    let Some(field) = files else {
        return Ok(Vec::new());
    };
    let files = match &field.value {
        DeValue::String(_) => vec![field.string()?],
        _ => field.strings()?.value,
    };
    for file in &files {
        // A problem file that somebody sends writes nowhere else.
        let is_plain = Path::new(&file.value)
            .file_name()
            .is_some_and(|name| name == &*file.value);
        if !is_plain {
            return Err(field.error(
                "`files` are written beside the problem file: give names without folders, such as \"u.csv\"",
            ));
        }
    }
    Ok(files)
}
