//! The sky of an open scene: `sky = "uniform"`, or bands of patches.

use fredholm_scene::{SceneError, Sky};
use toml::de::DeValue;

use crate::place::{InputError, Placed};
use crate::section::{Field, Section};

/// The patches of a sky in bands: what [`Sky::bands`] is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct SkyBands {
    /// The altitudes in degrees between which the bands are, from 0 to 90.
    pub altitudes: Vec<f64>,
    /// The number of patches in each band.
    pub sectors: Vec<u32>,
}

impl SkyBands {
    /// The sky.
    ///
    /// # Errors
    /// As [`Sky::bands`], but not for what was read.
    pub fn sky(&self) -> Result<Sky, SceneError> {
        Sky::bands(&self.altitudes, &self.sectors)
    }
}

/// What `sky` says; `open` is said, too, perhaps.
pub(super) fn read(
    section: &mut Section<'_, '_>,
    open: Option<&Placed<bool>>,
) -> Result<Option<SkyBands>, InputError> {
    let Some(field) = section.optional("sky") else {
        return Ok(None);
    };
    if open.is_some_and(|open| !open.value) {
        return Err(field.error("a closed scene has no sky: leave out `sky` or `open = false`"));
    }
    let DeValue::Table(_) = &field.value else {
        if field.text()? != "uniform" {
            return Err(field.error(
                "`sky` must be \"uniform\", or bands of patches: { altitudes = [0, 30, 60, 90], sectors = [12, 8, 4] }",
            ));
        }
        return Ok(Some(SkyBands {
            altitudes: vec![0.0, 90.0],
            sectors: vec![1],
        }));
    };
    let mut own = field.section("in `sky`")?;
    let altitudes = own.required("altitudes")?;
    let sectors = own.required("sectors")?;
    own.finish()?;
    Ok(Some(bands(&altitudes, &sectors)?))
}

fn bands(altitudes: &Field<'_, '_>, sectors: &Field<'_, '_>) -> Result<SkyBands, InputError> {
    let heights = altitudes.numbers()?.value;
    let counts = sectors.integers()?.value;
    if counts.len() + 1 != heights.len() {
        let message = format!(
            "{} altitudes have {} bands between them, and so many numbers of sectors are needed, not {}",
            heights.len(),
            heights.len().saturating_sub(1),
            counts.len()
        );
        return Err(sectors.error(message));
    }
    let number = |count: &Placed<usize>| u32::try_from(count.value).unwrap_or(u32::MAX);
    let own = SkyBands {
        altitudes: heights.iter().map(|height| height.value).collect(),
        sectors: counts.iter().map(number).collect(),
    };
    let heights = &own.altitudes;
    let is_whole = heights.first() == Some(&0.0) && heights.last() == Some(&90.0);
    if !(is_whole && heights.windows(2).all(|w| w[0] < w[1])) {
        return Err(
            altitudes.error("altitudes must ascend from 0, the horizon, to 90 degrees, the zenith")
        );
    }
    match Sky::check(&own.altitudes, &own.sectors) {
        Ok(()) => Ok(own),
        Err(error) => Err(sectors.error(error)),
    }
}
