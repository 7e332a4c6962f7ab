//! The sky of an open scene: `sky = "uniform"`, or bands of patches, and its light.

use fredholm::room::Outside;
use fredholm_scene::{STEFAN_BOLTZMANN, SceneError, SkyLight};
use toml::de::DeValue;

use crate::kinds::material::{TEMPERATURE, is_temperature, read_temperature};
use crate::place::{InputError, Placed};
use crate::section::{Field, Section};

/// The patches of a sky in bands, what [`SkyLight::bands`] is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct SkyBands {
    /// The altitudes in degrees between which the bands are, from 0 to 90.
    pub altitudes: Vec<f64>,
    /// The number of patches in each band.
    pub sectors: Vec<u32>,
    /// What each patch gives, L in the unit of u, if it is said: see [`SkyLight`].
    pub emissions: Option<Vec<f64>>,
    /// Whether it follows from a temperature: u is in W/m² then.
    pub is_heat: bool,
}

impl SkyBands {
    /// The light of the sky, if the file says what it gives.
    ///
    /// # Errors
    /// As [`SkyLight::bands`], but not for what was read.
    pub fn light(&self) -> Result<Option<SkyLight>, SceneError> {
        let light = |emissions: &Vec<f64>| {
            SkyLight::bands(&self.altitudes, &self.sectors, emissions.clone())
        };
        self.emissions.as_ref().map(light).transpose()
    }

    /// The parts of the sky of a room, with what each gives, or with 0 if that is not said.
    #[must_use]
    pub fn outside(&self) -> Vec<Outside<f64>> {
        let mut rest = self.emissions.iter().flatten().copied();
        let mut next = || rest.next().unwrap_or(0.0);
        let sides = self.sectors.iter().map(|&sectors| {
            let first = next();
            [first, if sectors > 1 { next() } else { first }]
        });
        Outside::sky(&self.altitudes, &sides.collect::<Vec<_>>())
    }

    /// Refuses a sky without light, of which walks know nothing.
    pub(crate) fn refuse_dark(&self, name: &str) -> Result<(), InputError> {
        if self.emissions.is_some() {
            return Ok(());
        }
        let message = "this `sky` gives no light, which serves form factors, `fredholm factors`: walks need its \
                       `emission` or `temperature`, `sky = { emission = 100 }`, or `open = true` in place of a sky";
        Err(InputError::new(format_args!("{name}: {message}")))
    }

    /// What a horizontal surface receives that nothing hides from it, in the unit of the emission; 0 if that is not said.
    #[must_use]
    pub fn horizontal(&self) -> f64 {
        let mut rest = self.emissions.iter().flatten();
        let bands = self.altitudes.windows(2).zip(&self.sectors);
        let bands = bands.map(|(ends, &sectors)| {
            let [low, high] = [ends[0], ends[1]].map(|degrees| libm::sin(degrees.to_radians()));
            let sum: f64 = rest.by_ref().take(sectors as usize).sum();
            (high * high - low * low) * sum / f64::from(sectors)
        });
        bands.sum()
    }

    /// One patch.
    fn uniform() -> Self {
        Self {
            altitudes: vec![0.0, 90.0],
            sectors: vec![1],
            emissions: None,
            is_heat: false,
        }
    }

    /// The number of patches.
    pub(crate) fn patches(&self) -> usize {
        self.sectors.iter().map(|&n| n as usize).sum()
    }
}

/// What `sky` says; `open` is said, too, perhaps.
pub(crate) fn read(
    section: &mut Section<'_, '_>,
    open: Option<&Placed<bool>>,
    is_plane: bool,
) -> Result<Option<SkyBands>, InputError> {
    let Some(field) = section.optional("sky") else {
        return Ok(None);
    };
    if open.is_some_and(|open| !open.value) {
        let what = if is_plane { "room" } else { "scene" };
        let message = format!("a closed {what} has no sky: leave out `sky` or `open = false`");
        return Err(field.error(message));
    }
    let DeValue::Table(_) = &field.value else {
        if field.text()? != "uniform" {
            return Err(field.error(
                "`sky` must be \"uniform\", or bands of patches, { altitudes = [0, 30, 60, 90], sectors = [12, 8, 4] }, or \
                 have light, { emission = 100 }",
            ));
        }
        return Ok(Some(SkyBands::uniform()));
    };
    let mut own = field.section("in `sky`")?;
    let [altitudes, sectors, emission, temperature, cie] =
        ["altitudes", "sectors", "emission", "temperature", "cie"].map(|key| own.optional(key));
    own.finish()?;
    if let Some(cie) = cie {
        let others = [&altitudes, &sectors, &temperature];
        if let Some(other) = others.into_iter().flatten().next() {
            return Err(other.unsuited("a sky of the CIE has an `emission` alone"));
        }
        return overcast(&cie, emission.as_ref(), is_plane).map(Some);
    }
    let mut sky = match (&altitudes, &sectors) {
        (Some(altitudes), Some(sectors)) => {
            let own = bands(altitudes, sectors)?;
            if is_plane && own.sectors.iter().any(|&n| n > 2) {
                return Err(sectors.error(
                    "a band of a room's sky has 1 sector, or 2: on the right, where x grows, and on the left",
                ));
            }
            own
        }
        (None, None) if emission.is_some() || temperature.is_some() => SkyBands::uniform(),
        _ => {
            return Err(own.source.error(
                own.span.clone(),
                "a sky in bands has `altitudes` and `sectors`, and one that gives light an `emission` or a `temperature`",
            ));
        }
    };
    match (emission, temperature) {
        (Some(_), Some(temperature)) => {
            return Err(
                temperature.error("give either the `emission` of a sky or its `temperature`")
            );
        }
        (Some(emission), None) => sky.emissions = Some(emissions(&emission, sky.patches())?),
        (None, Some(temperature)) => {
            let kelvin = read_temperature(&temperature)?.value;
            if !is_temperature(kelvin) {
                return Err(temperature.error(TEMPERATURE));
            }
            sky.emissions = Some(vec![STEFAN_BOLTZMANN * kelvin.powi(4); sky.patches()]);
            sky.is_heat = true;
        }
        (None, None) => {}
    }
    Ok(Some(sky))
}

/// The bands in which the CIE overcast sky is taken.
const OVERCAST_BANDS: u32 = 30;

/// The overcast sky of the CIE (S 011, ISO 15469), whose luminance at the altitude γ is (1 + 2 sin γ)/3 of that at the zenith: in bands, each
/// with the luminance that gives a horizontal surface as much. `emission` is the irradiance of that surface. In a plane cut through what is endless
/// across it a direction at the altitude φ stands for all at cos ψ of it, with the weight cos²ψ: L is 1 + (16/3π) sin φ there.
fn overcast(
    cie: &Field<'_, '_>,
    emission: Option<&Field<'_, '_>>,
    is_plane: bool,
) -> Result<SkyBands, InputError> {
    if cie.text()? != "overcast" {
        return Err(cie.error("`cie` must be \"overcast\"; other skies are bands of patches"));
    }
    let Some(emission) = emission else {
        let message = "this sky gives light: `emission` is the irradiance of a horizontal surface";
        return Err(cie.unsuited(message));
    };
    let whole = emission.number()?.value;
    if !(whole >= 0.0 && whole.is_finite()) {
        return Err(emission.error("what a sky gives must be 0 or more"));
    }
    let altitude = |band: u32| 90.0 * f64::from(band) / f64::from(OVERCAST_BANDS);
    let altitudes: Vec<f64> = (0..=OVERCAST_BANDS).map(altitude).collect();
    let in_plane = |band: &[f64]| {
        let [low, high] = [band[0], band[1]].map(f64::to_radians);
        // Of the weight sin φ.
        let all = libm::cos(low) - libm::cos(high);
        let squares = (high - low) / 2.0 - (libm::sin(2.0 * high) - libm::sin(2.0 * low)) / 4.0;
        3.0 / 7.0 * whole * (1.0 + 16.0 / (3.0 * core::f64::consts::PI) * squares / all)
    };
    let emissions = altitudes.windows(2).map(|band| {
        if is_plane {
            return in_plane(band);
        }
        let [low, high] = [band[0], band[1]].map(|degrees| libm::sin(degrees.to_radians()));
        // The mean of 3/7 (1 + 2s) with the weight s = sin γ.
        let moment = |s: f64| s * s / 2.0 + 2.0 * s * s * s / 3.0;
        let mean = 2.0 * (moment(high) - moment(low)) / (high * high - low * low);
        3.0 / 7.0 * whole * mean
    });
    Ok(SkyBands {
        emissions: Some(emissions.collect()),
        sectors: vec![1; OVERCAST_BANDS as usize],
        altitudes,
        is_heat: false,
    })
}

/// What each patch gives: a number for all, or one for each.
fn emissions(field: &Field<'_, '_>, patches: usize) -> Result<Vec<f64>, InputError> {
    let all = match &field.value {
        DeValue::Array(_) => field.numbers()?.value.iter().map(|l| l.value).collect(),
        _ => vec![field.number()?.value; patches],
    };
    if all.len() != patches {
        let message = format!(
            "the sky has {patches} patches, and needs one number for all or one for each, not {}",
            all.len()
        );
        return Err(field.error(message));
    }
    match all.iter().all(|l| *l >= 0.0 && l.is_finite()) {
        true => Ok(all),
        false => Err(field.error("what a sky gives must be 0 or more")),
    }
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
        ..SkyBands::uniform()
    };
    let heights = &own.altitudes;
    let is_whole = heights.first() == Some(&0.0) && heights.last() == Some(&90.0);
    if !(is_whole && heights.windows(2).all(|w| w[0] < w[1])) {
        return Err(
            altitudes.error("altitudes must ascend from 0, the horizon, to 90 degrees, the zenith")
        );
    }
    match SkyLight::check(&own.altitudes, &own.sectors) {
        Ok(()) => Ok(own),
        Err(error) => Err(sectors.error(error)),
    }
}
