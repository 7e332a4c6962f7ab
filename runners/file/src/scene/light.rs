//! Light that no surface emits: `[[problem.light]]`.

use fredholm_scene::Beam;

use super::description::triple;
use crate::place::InputError;
use crate::section::{Field, Section};

/// What `light` says: a list of points with an `intensity`, and of directions with an `irradiance`.
pub(super) fn read(section: &mut Section<'_, '_>) -> Result<Vec<Beam<f64>>, InputError> {
    let all = section.read("light", |field| field.tables("in `[[problem.light]]`", one))?;
    Ok(all.unwrap_or_default())
}

fn one(mut own: Section<'_, '_>) -> Result<Beam<f64>, InputError> {
    let (at, towards) = (own.optional("at"), own.optional("towards"));
    let (intensity, irradiance) = (own.optional("intensity"), own.optional("irradiance"));
    own.finish()?;
    match (&at, &intensity, &towards, &irradiance) {
        (Some(at), Some(intensity), None, None) => Ok(Beam::Point {
            at: triple(at)?.value,
            intensity: strength(intensity)?,
        }),
        (None, None, Some(towards), Some(irradiance)) => {
            let direction = triple(towards)?.value;
            if direction == [0.0; 3] {
                return Err(towards.error("`towards` is a direction, which [0, 0, 0] is not"));
            }
            Ok(Beam::Parallel {
                towards: direction,
                irradiance: strength(irradiance)?,
            })
        }
        _ => Err(own.source.error(
            own.span.clone(),
            "a light has `at` and `intensity`, or, if it is far away, `towards` and `irradiance`",
        )),
    }
}

/// A finite number that is not negative.
fn strength(field: &Field<'_, '_>) -> Result<f64, InputError> {
    let value = field.number()?.value;
    if value >= 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(field.error(format_args!("`{}` must be 0 or more", field.name)))
    }
}
