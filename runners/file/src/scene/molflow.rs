//! Geometries of Molflow, `.geo`: keys with numbers, and blocks in braces. Lengths are in centimetres there, and outgassing in mbar l/s.
//!
//! Facets at which nothing happens are one surface, `walls`, or `plates` if they have two sides; any other is a surface by its number, as
//! Molflow counts. Transparent ones count molecules and do nothing, and are left out. Read are vertices, sticking, opacity, sides and outgassing,
//! of one structure whose molecules leave evenly and diffusely; what else does something is refused.

use core::str::FromStr;

use super::{SceneFile, SceneSurface, Wrong, vacuum};

/// Metres in a centimetre.
const CENTIMETRE: f64 = 0.01;

/// Words of a text: numbers, keys without their colons, texts in quotation marks, and braces.
struct Reader<'t> {
    text: &'t str,
    rest: &'t str,
    line: u32,
}

impl<'t> Reader<'t> {
    fn next(&mut self) -> Option<&'t str> {
        let is_blank = |c: char| c.is_whitespace() || c == ':';
        let rest = self.rest.trim_start_matches(is_blank);
        let passed = &self.rest[..self.rest.len() - rest.len()];
        self.line += passed.matches('\n').count() as u32;
        let end = match rest.chars().next()? {
            '"' => rest[1..].find('"').map(|end| end + 2),
            '{' | '}' => Some(1),
            _ => rest.find(|c: char| is_blank(c) || "{}\"".contains(c)),
        };
        let (word, rest) = rest.split_at(end.unwrap_or(rest.len()));
        self.rest = rest;
        Some(word)
    }

    fn wrong(&self, word: &str, message: impl Into<String>) -> Wrong {
        let start = word.as_ptr() as usize - self.text.as_ptr() as usize;
        Wrong {
            place: start..start + word.len(),
            message: message.into(),
        }
    }

    fn word(&mut self, what: &str) -> Result<&'t str, Wrong> {
        let ends = || Wrong::cut_short(self.text, &format!("the file ends before {what}"));
        self.next().ok_or_else(ends)
    }

    fn parsed<T: FromStr>(&mut self, what: &str) -> Result<T, Wrong> {
        let word = self.word(what)?;
        let wrong = |_| self.wrong(word, format!("{word:?} is not {what}"));
        word.parse().map_err(wrong)
    }

    fn number(&mut self) -> Result<f64, Wrong> {
        self.parsed("a number")
    }

    fn count(&mut self) -> Result<usize, Wrong> {
        self.parsed("a whole number")
    }

    fn is_at(&self, start: char) -> bool {
        self.rest.trim_start().starts_with(start)
    }
}

/// What a facet's block says.
#[derive(Default)]
struct Facet {
    corners: Vec<[f64; 3]>,
    sticking: f64,
    opacity: f64,
    two_sided: bool,
    /// What it gives off, in mbar l/s.
    outgassing: f64,
    temperature: f64,
    /// How molecules leave that desorb: not at all, evenly in angle, by the cosine law, by a power of it, by a measured distribution.
    desorption: f64,
    /// How molecules are reflected: by the cosine law, as by a mirror, evenly in angle.
    reflection: f64,
    /// Whether it leads to another structure or facet.
    is_linked: bool,
}

impl Facet {
    fn read(reader: &mut Reader<'_>, vertices: &[[f64; 3]]) -> Result<Self, Wrong> {
        let mut own = Self {
            outgassing: f64::NAN,
            ..Self::default()
        };
        loop {
            let key = reader.word("the end of a facet")?;
            if key == "}" {
                break;
            }
            if key == "indices" {
                while !reader.rest.trim_start().starts_with(char::is_alphabetic) {
                    let at = &reader.rest.trim_start()[..0];
                    let number = reader.count()?;
                    let found = number.checked_sub(1).and_then(|at| vertices.get(at));
                    let missing = || reader.wrong(at, format!("there is no vertex {number}"));
                    own.corners.push(*found.ok_or_else(missing)?);
                }
                continue;
            }
            let value = reader.number()?;
            match key {
                "sticking" => own.sticking = value,
                "opacity" => own.opacity = value,
                "is2sided" => own.two_sided = value != 0.0,
                "temperature" => own.temperature = value,
                "outgassing" => own.outgassing = value,
                "desorbType" => own.desorption = value,
                "reflectType" => own.reflection = value,
                "superDest" | "superIdx" | "teleportDest" => own.is_linked |= value != 0.0,
                _ => {}
            }
        }
        if own.desorption == 0.0 {
            own.outgassing = 0.0;
        }
        Ok(own)
    }

    /// What of it is not read, if it is at this temperature.
    fn refused(&self, temperature: f64) -> Option<&'static str> {
        let is_even = |kind: f64, even: f64, share: f64| share == 0.0 || kind == even;
        let evenly = is_even(self.desorption, 2.0, self.outgassing)
            && is_even(self.reflection, 0.0, 1.0 - self.sticking);
        let all = [
            (
                self.is_linked,
                "it leads to another structure or facet: links and teleports are not read",
            ),
            (
                self.opacity != 1.0,
                "it is opaque in part: 1 and 0 are read",
            ),
            (
                !(0.0..=1.0).contains(&self.sticking),
                "a sticking factor is from 0 to 1",
            ),
            (
                !(self.outgassing >= 0.0),
                "it gives off gas, and `outgassing` does not say how much, a number of mbar l/s",
            ),
            (
                !evenly,
                "molecules leave it other than evenly and diffusely, by the cosine law",
            ),
            (
                self.temperature != temperature,
                "its temperature is not that of the facets before: walls have one",
            ),
        ];
        let found = all.into_iter().find(|(refused, _)| *refused);
        found.map(|(_, message)| message)
    }
}

/// Reads a `.geo` file into what is empty so far.
pub(super) fn read(scene: &mut SceneFile, file: u32, text: &str) -> Result<(), Wrong> {
    let mut reader = Reader {
        text,
        rest: text,
        line: 1,
    };
    let mut vertices = Vec::new();
    let (mut clear, mut left, mut mass, mut temperature) = (0, 0, None, None);
    while let Some(word) = reader.next() {
        match word {
            "nbSuper" if reader.count()? != 1 => {
                return Err(reader.wrong(word, "there are several structures, and one is read"));
            }
            "nbFacet" => left = reader.count()?,
            "gasMass" => mass = Some(reader.number()?),
            "vertices" => {
                reader.next();
                while !reader.rest.is_empty() && !reader.is_at('}') {
                    reader.count()?;
                    let [x, y, z] = [reader.number()?, reader.number()?, reader.number()?];
                    vertices.push([x, y, z].map(|own| CENTIMETRE * own));
                }
            }
            "facet" => {
                let line = reader.line;
                let number = reader.count()?;
                reader.next();
                let facet = Facet::read(&mut reader, &vertices)?;
                left = left.saturating_sub(1);
                if facet.opacity == 0.0 && !facet.is_linked {
                    clear += 1;
                    continue;
                }
                let known = *temperature.get_or_insert(facet.temperature);
                let wrong =
                    |message: &str| reader.wrong(word, format!("facet {number}: {message}"));
                if let Some(message) = facet.refused(known) {
                    return Err(wrong(message));
                }
                let at = place(scene, &facet, number);
                let added = scene.add(at, &facet.corners, (file, line));
                added.map_err(|message| wrong(&message))?;
            }
            // Formulas, views, selections and results.
            "{" => while reader.next().is_some_and(|word| word != "}") {},
            _ => {}
        }
    }
    if left > 0 {
        let message = format!("the file ends before the last of its facets: {left} are missing");
        return Err(Wrong::cut_short(text, &message));
    }
    if clear > 0 {
        let told = format!("transparent facets of Molflow are left out: {clear} of them");
        scene.remarks.push(told);
    }
    if let (Some(mass), Some(kelvin)) = (mass, temperature) {
        scene.remarks.push(format!(
            "Molflow has {mass} g/mol at {kelvin} K: `gas` and `temperature` of `[problem]` count"
        ));
    }
    Ok(())
}

/// The surface of a facet.
fn place(scene: &mut SceneFile, facet: &Facet, number: usize) -> usize {
    let name = match (
        facet.sticking == 0.0 && facet.outgassing == 0.0,
        facet.two_sided,
    ) {
        (true, false) => "walls".to_owned(),
        (true, true) => "plates".to_owned(),
        _ => format!("facet {number}"),
    };
    let known = scene.surfaces.iter().position(|own| own.name == name);
    known.unwrap_or_else(|| {
        let at = scene.surfaces.len();
        scene.surfaces.push(SceneSurface::new(name.clone()));
        // Molflow halves what a facet of two sides gives off, and a plate's words are of each side.
        let share = if facet.two_sided { 0.5 } else { 1.0 };
        let words = vacuum::Words::of(facet.sticking, share * facet.outgassing);
        scene.of_gas.push((name, words));
        scene.two_sided.extend(facet.two_sided.then_some(at));
        at
    })
}
