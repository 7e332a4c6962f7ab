//! Light that no surface emits: `[[problem.light]]`.

use fredholm::room::Outside;
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

/// What `light` says in a room: a list of directions with an `irradiance`.
pub(crate) fn suns(section: &mut Section<'_, '_>) -> Result<Vec<Outside<f64>>, InputError> {
    let all = section.read("light", |field| field.tables("in `[[problem.light]]`", sun))?;
    Ok(all.unwrap_or_default())
}

fn sun(mut own: Section<'_, '_>) -> Result<Outside<f64>, InputError> {
    if let Some(at) = own.optional("at") {
        return Err(at.unsuited(
            "a room has no lamps at points: a lamp is a surface with an `emission`, and a light the sun, with `towards` and `irradiance`",
        ));
    }
    let (towards, irradiance) = (own.required("towards")?, own.required("irradiance")?);
    own.finish()?;
    let numbers = towards.elements("two numbers [x, y]", Field::number)?;
    let [x, y] = numbers.value.as_slice() else {
        return Err(towards.error("two numbers are needed: [x, y]"));
    };
    let (x, y) = (x.value, y.value);
    let length = libm::hypot(x, y);
    if !(length > 0.0 && length.is_finite()) {
        return Err(
            towards.error("`towards` is a direction, of finite numbers that are not both 0")
        );
    }
    Ok(Outside::Sun {
        towards: [x / length, y / length],
        irradiance: strength(&irradiance)?,
    })
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
