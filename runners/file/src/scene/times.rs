//! The sun and the sky over time, from a CSV file whose first line names its columns.

use std::path::Path;

use fredholm::scene::SunAndSky;

use super::{SkyBands, nowhere};
use crate::place::{InputError, Source};
use crate::points::{number, rows};
use crate::{load, utf8};

/// The most bytes of a file of times: a minute's each for a year have a tenth.
const MAX_BYTES: u64 = 1 << 28;
/// The most times.
const MAX_TIMES: usize = 1_000_000;

/// Columns that there may be.
const COLUMNS: [&str; 8] = [
    "time", "altitude", "azimuth", "x", "y", "z", "beam", "diffuse",
];
/// What a wrong head is told.
const HEAD: &str = "the first line names the columns: `time`, then `altitude` and `azimuth` of the sun in degrees (from north, the axis y, over \
                    east), or `x`, `y`, `z` towards it, and `beam`, what a surface receives that faces the sun; and `diffuse`, what a \
                    horizontal one receives from the sky";

/// The times of a file.
#[derive(Clone, Debug, Default)]
pub struct Times {
    /// Their names: the column `time`, or numbers from 1.
    pub names: Vec<String>,
    /// The sun and the sky of each.
    pub lights: Vec<SunAndSky>,
    /// Remarks for people.
    pub remarks: Vec<String>,
}

/// Which column is which.
struct Head {
    columns: [Option<usize>; COLUMNS.len()],
    /// What a horizontal surface receives from the sky of the scene.
    horizontal: f64,
}

impl Head {
    fn new(fields: &[&str], sky: Option<&SkyBands>) -> Result<Self, String> {
        let mut columns = [None; COLUMNS.len()];
        for (at, field) in fields.iter().enumerate() {
            let name = field.to_ascii_lowercase();
            let Some(known) = COLUMNS.iter().position(|own| *own == name) else {
                return Err(format!("unknown column {field:?}; {HEAD}"));
            };
            if columns[known].replace(at).is_some() {
                return Err(format!("a second column {name:?}"));
            }
        }
        let has = |wanted: &[usize]| wanted.iter().filter(|&&own| columns[own].is_some()).count();
        let [angles, vector, beam, diffuse] = [&[1, 2][..], &[3, 4, 5], &[6], &[7]].map(has);
        let is_good = match beam {
            0 => angles + vector == 0 && diffuse == 1,
            _ => matches!((angles, vector), (2, 0) | (0, 3)),
        };
        if !is_good {
            return Err(HEAD.to_owned());
        }
        let horizontal = sky.map_or(0.0, SkyBands::horizontal);
        if diffuse == 1 && horizontal == 0.0 {
            let message = "the column `diffuse` is the light of a sky, of which the scene says how it is distributed: \
                           `sky = { emission = 1 }`, or `sky = { cie = \"overcast\", emission = 1 }`";
            return Err(message.to_owned());
        }
        Ok(Self {
            columns,
            horizontal,
        })
    }

    /// The time of a line, and whether its sun is below the horizon.
    fn time(&self, fields: &[&str]) -> Result<(SunAndSky, bool), String> {
        let own = |known: usize| match self.columns[known] {
            None => Ok(0.0),
            Some(at) => number(fields.get(at).copied().unwrap_or_default())
                .map_err(|_| format!("the column `{}` has no number", COLUMNS[known])),
        };
        let [beam, diffuse] = [own(6)?, own(7)?];
        for (value, name) in [(beam, "beam"), (diffuse, "diffuse")] {
            if value < 0.0 {
                return Err(format!("`{name}` must be 0 or more"));
            }
        }
        let by_angles = self.columns[1].is_some();
        let towards = match by_angles {
            false => [own(3)?, own(4)?, own(5)?],
            true => {
                let [altitude, azimuth] = [own(1)?, own(2)?];
                if !(-90.0..=90.0).contains(&altitude) {
                    return Err("`altitude` is from −90 to 90 degrees".to_owned());
                }
                let [height, turn] = [altitude, azimuth].map(f64::to_radians);
                let wide = libm::cos(height);
                [
                    wide * libm::sin(turn),
                    wide * libm::cos(turn),
                    libm::sin(height),
                ]
            }
        };
        let is_below = by_angles && beam > 0.0 && towards[2] <= 0.0;
        let is_none = beam > 0.0 && towards == [0.0; 3];
        if is_none {
            return Err("x, y, z are a direction, which 0, 0, 0 is not".to_owned());
        }
        let sky = match self.columns[7] {
            Some(_) => diffuse / self.horizontal,
            None => 1.0,
        };
        let irradiance = if is_below { 0.0 } else { beam };
        let light = SunAndSky {
            towards,
            irradiance,
            sky,
        };
        Ok((light, is_below))
    }
}

impl Times {
    /// Reads the times of a file. `sky`: that of the scene, whose light the column `diffuse` scales; without this column it shines as the scene
    /// says.
    ///
    /// # Errors
    /// A file that cannot be read, or what is wrong with it, with the line.
    pub fn read(path: &Path, sky: Option<&SkyBands>) -> Result<Self, InputError> {
        let name = path.display().to_string();
        let text = utf8(&name, load(path, MAX_BYTES)?)?;
        Self::parse(&Source { name, text }, sky)
    }

    /// Reads the times of a text, as [`read`](Self::read) those of a file.
    ///
    /// # Errors
    /// What is wrong with it, with the line.
    pub fn parse(source: &Source, sky: Option<&SkyBands>) -> Result<Self, InputError> {
        let mut all = Self::default();
        let mut head = None;
        let mut below = 0;
        for row in rows(source) {
            let fail = |message: String| source.error(row.here.clone(), message);
            let Some(head) = &head else {
                head = Some(Head::new(&row.fields, sky).map_err(fail)?);
                continue;
            };
            if all.lights.len() == MAX_TIMES {
                return Err(fail(format!("more than {MAX_TIMES} times")));
            }
            let (light, is_below) = head.time(&row.fields).map_err(fail)?;
            below += usize::from(is_below);
            let label = head.columns[0].and_then(|at| row.fields.get(at));
            let number = all.lights.len() + 1;
            all.names
                .push(label.map_or_else(|| number.to_string(), |own| (*own).to_owned()));
            all.lights.push(light);
        }
        if all.lights.is_empty() {
            return Err(nowhere(
                &source.name,
                format_args!("there are no times; {HEAD}"),
            ));
        }
        if below > 0 {
            all.remarks.push(format!(
                "{below} of {} times have a `beam` of a sun that is not above the horizon, which gives nothing",
                all.lights.len()
            ));
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::{SkyBands, Source, SunAndSky, Times};

    fn times(text: &str, sky: Option<&SkyBands>) -> Result<Times, String> {
        let source = Source {
            name: "t.csv".to_owned(),
            text: text.to_owned(),
        };
        Times::parse(&source, sky).map_err(|error| error.to_string())
    }

    /// Bands of 3 below 30° and 1 above: 3/4 + 3/4.
    fn sky() -> SkyBands {
        SkyBands {
            altitudes: vec![0.0, 30.0, 90.0],
            sectors: vec![2, 1],
            emissions: Some(vec![2.0, 4.0, 1.0]),
            is_heat: false,
        }
    }

    #[test]
    fn suns_and_skies_are_read() {
        let text = "time, altitude, azimuth, beam, diffuse\n\"8:00, a\", 0, 90, 0, 3\n9:00, 30, 90, 500, 1.5\n10:00, -1, 90, 5, 0\n";
        let own = times(text, Some(&sky())).unwrap();
        assert_eq!(own.names, ["8:00, a", "9:00", "10:00"]);
        let skies: Vec<f64> = own.lights.iter().map(|own| own.sky).collect();
        assert!(
            (skies[0] - 2.0).abs() < 1e-14 && (skies[1] - 1.0).abs() < 1e-14 && skies[2] == 0.0
        );
        let SunAndSky {
            towards: [x, y, z],
            irradiance,
            ..
        } = own.lights[1];
        assert!((x - 0.75_f64.sqrt()).abs() < 1e-15 && y.abs() < 1e-15 && (z - 0.5).abs() < 1e-15);
        assert_eq!([irradiance, own.lights[2].irradiance], [500.0, 0.0]);
        assert!(
            own.remarks[0].starts_with("1 of 3 times"),
            "{:?}",
            own.remarks
        );
        let own = times("beam, x, y, z\n2, 0, 0, -1\n", None).unwrap();
        assert_eq!(own.names, ["1"]);
        let down = SunAndSky {
            towards: [0.0, 0.0, -1.0],
            irradiance: 2.0,
            sky: 1.0,
        };
        assert_eq!(own.lights, [down]);
    }

    #[test]
    fn wrong_lines_are_shown() {
        let bad = |text: &str, place: &str, words: &str| {
            let error = times(text, Some(&sky())).expect_err(words);
            assert!(error.starts_with(place) && error.contains(words), "{error}");
        };
        bad(
            "time, beam\n",
            "t.csv:1:1:",
            "the first line names the columns",
        );
        bad("0, 1\n", "t.csv:1:1:", "unknown column \"0\"");
        bad("x, y, z, beam, x\n", "t.csv:1:1:", "a second column");
        bad("x, y, z, beam\n", "t.csv:", "there are no times");
        bad(
            "x, y, z, beam\n1, 0, 0\n",
            "t.csv:2:1:",
            "`beam` has no number",
        );
        bad(
            "x, y, z, beam\n0, 0, 0, 1\n",
            "t.csv:2:1:",
            "are a direction",
        );
        bad(
            "x, y, z, beam\n0, 0, 1, -1\n",
            "t.csv:2:1:",
            "must be 0 or more",
        );
        bad(
            "altitude, azimuth, beam\n91, 0, 1\n",
            "t.csv:2:1:",
            "from −90 to 90",
        );
        let error = times("diffuse\n1\n", None).unwrap_err();
        assert!(error.contains("the scene says how"), "{error}");
    }
}
