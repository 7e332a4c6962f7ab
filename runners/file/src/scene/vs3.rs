//! View3D decks (`.vs3`): vertices and surfaces with three or four vertices, one a line.
//!
//! `V id x y z`; `S id v1 v2 v3 v4 base cmb emit name`, counter-clockwise seen from its active side, v4 = 0 for a
//! triangle, or left out; `base` is the number of a surface from which this one, such as a window, is cut out; `O id v1 v2 v3 v4 0 0 emit
//! name` an obstruction, which is not reported; `T` a title, `C encl=1 …` control, `F 3` the format; `!` and `/` begin a comment; `End of
//! data` ends it (Walton, NISTIR 6925, 2002), and converters leave it out.

use std::collections::HashMap;

use fredholm_scene::Material;

use super::{Known, MAX_POLYGONS, SceneFile, SceneSurface, Words, Wrong, lines};

/// A line of a surface.
struct Line<'t> {
    words: Words<'t>,
    key: &'t str,
    surface: usize,
    points: Vec<[f64; 3]>,
    /// The word that names its base, if it has one.
    base: Option<&'t str>,
    /// The lines that are cut out of this one.
    holes: Vec<usize>,
}

/// What is known of a deck while it is read.
struct Deck<'s, 't> {
    scene: &'s mut SceneFile,
    vertices: HashMap<u64, [f64; 3]>,
    lines: Vec<Line<'t>>,
    /// The line of every surface's number.
    numbers: HashMap<u64, usize>,
}

pub(super) fn read(scene: &mut SceneFile, file: u32, text: &str) -> Result<(), Wrong> {
    scene.open = true;
    let mut deck = Deck {
        scene,
        vertices: HashMap::new(),
        lines: Vec::new(),
        numbers: HashMap::new(),
    };
    let mut has_end = false;
    for mut words in lines(text, &['!', '/']) {
        let key = words.next();
        match key.to_ascii_uppercase().as_str() {
            "T" => {}
            "C" => control(&mut words, deck.scene),
            "F" | "G" => {
                let word = words.word("the format")?;
                if !matches!(word, "3" | "3a" | "3A") {
                    return Err(words.wrong(word, "only decks in three dimensions are read: `F 3`"));
                }
            }
            "V" => {
                let id: u64 = words.parsed("the number of a vertex")?;
                let point = words.clone().point();
                let point = point.map_err(|wrong| Wrong {
                    message: format!("{}{}", wrong.message, used_by(text, id)),
                    ..wrong
                })?;
                if deck.vertices.insert(id, point).is_some() {
                    let message = format_args!("a second vertex {id}{}", used_by(text, id));
                    return Err(words.wrong(key, message));
                }
            }
            "S" | "O" => deck.surface(words, key)?,
            "END" => {
                has_end = true;
                break;
            }
            _ => {
                let message = format_args!(
                    "unknown key {key:?}; known: T, C, F, V, S, O, `End of data`, and `!` or `/` for comments"
                );
                return Err(words.wrong(key, message));
            }
        }
    }
    if !has_end {
        let count = deck.lines.len();
        deck.scene.remarks.push(format!(
            "the deck has no `End of data`: see that it is whole; {count} surfaces were read"
        ));
    }
    deck.finish(file)
}

/// `C encl=1 list=3 …`: only whether it is an enclosure concerns the geometry.
fn control(words: &mut Words<'_>, scene: &mut SceneFile) {
    loop {
        let word = words.next();
        if word.is_empty() {
            return;
        }
        if let Some(value) = word.strip_prefix("encl=") {
            scene.open = value == "0";
        }
    }
}

/// The surfaces of a deck that have a vertex.
fn used_by(text: &str, vertex: u64) -> String {
    let surfaces = lines(text, &['!', '/']).filter_map(|mut words| {
        let is_surface = matches!(words.next(), "S" | "s" | "O" | "o");
        let id: u64 = words.next().parse().ok().filter(|_| is_surface)?;
        let corners = if has_three(words.clone()) { 3 } else { 4 };
        let all: Vec<&str> = (0..corners).map(|_| words.next()).collect();
        // Its base, with which it is combined, and its emissivity.
        for _ in 0..3 {
            words.next();
        }
        let has_it = all.iter().any(|word| word.parse() == Ok(vertex));
        has_it.then(|| format!("{:?}", words.name_of(id)))
    });
    let names: Vec<String> = surfaces.collect();
    match names.is_empty() {
        true => ", which no surface has".to_owned(),
        false => format!(", which {} have", names.join(", ")),
    }
}

/// Whether a line has three numbers of vertices, and no 0 for a fourth: then its sixth word is the emissivity. One of 0 is rather a line that was
/// cut short.
fn has_three(mut words: Words<'_>) -> bool {
    let all: [&str; 7] = core::array::from_fn(|_| words.next());
    let is_whole = |word: &&str| word.parse::<u64>().is_ok();
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    let has_four = all[..6].iter().all(is_whole) && is_number(all[6]);
    !has_four && all[..5].iter().all(is_whole) && is_number(all[5]) && all[5] != "0"
}

impl<'t> Deck<'_, 't> {
    /// The rest of an `S` or `O` line.
    fn surface(&mut self, mut words: Words<'t>, key: &'t str) -> Result<(), Wrong> {
        if self.lines.len() >= MAX_POLYGONS {
            return Err(words.wrong(key, format_args!("more than {MAX_POLYGONS} surfaces")));
        }
        let id: u64 = words.parsed("the number of a surface")?;
        if self.numbers.contains_key(&id) {
            return Err(words.wrong(key, format_args!("a second surface {id}")));
        }
        let corners = if has_three(words.clone()) { 3 } else { 4 };
        let mut points = Vec::with_capacity(4);
        for k in 0..corners {
            let word = words.word("the number of a vertex")?;
            let vertex: u64 = word.parse().map_err(|_| {
                words.wrong(word, format_args!("{word:?} is not the number of a vertex"))
            })?;
            match self.vertices.get(&vertex) {
                Some(&point) => points.push(point),
                None if vertex == 0 && k == 3 => {}
                None => {
                    return Err(words.wrong(
                        word,
                        format_args!("there is no vertex {vertex} above this line"),
                    ));
                }
            }
        }
        let base = words.word("the number `base`")?;
        let combine = words.word("the number `cmb`")?;
        let combined: u64 = combine.parse().map_err(|_| {
            words.wrong(
                combine,
                format_args!("{combine:?} is not the number of a surface"),
            )
        })?;
        let material = emissivity(&mut words)?;
        let name = words.name_of(id);
        let surface = if combined == 0 {
            let mut own = SceneSurface::new(name);
            own.material = material;
            own.known = Known::Emissivity;
            own.is_obstruction = key.eq_ignore_ascii_case("O");
            self.scene.surfaces.push(own);
            self.scene.surfaces.len() - 1
        } else {
            let found = self
                .numbers
                .get(&combined)
                .and_then(|&at| self.lines.get(at));
            let found = found.map(|line| line.surface);
            found.ok_or_else(|| {
                words.wrong(
                    combine,
                    format_args!("there is no surface {combined} above this line to combine with"),
                )
            })?
        };
        self.numbers.insert(id, self.lines.len());
        self.lines.push(Line {
            words,
            key,
            surface,
            points,
            base: Some(base).filter(|base| *base != "0"),
            holes: Vec::new(),
        });
        Ok(())
    }

    /// Cuts what lies on others out of these, and adds all.
    fn finish(mut self, file: u32) -> Result<(), Wrong> {
        for at in 0..self.lines.len() {
            let line = &self.lines[at];
            let Some(word) = line.base else {
                continue;
            };
            let base = word.parse().ok().and_then(|id: u64| self.numbers.get(&id));
            let Some(&base) = base.filter(|base| **base != at) else {
                let message = format_args!(
                    "there is no other surface {} from which this one is cut out",
                    word.escape_debug()
                );
                return Err(line.words.wrong(word, message));
            };
            self.lines[base].holes.push(at);
        }
        let names = repeated(&mut self.scene.surfaces);
        if let Some((first, count)) = names {
            self.scene.remarks.push(format!(
                "{count} surfaces have the names of others and got numbers; the first is {first:?}"
            ));
        }
        for line in &self.lines {
            let holes = line
                .holes
                .iter()
                .map(|&hole| self.lines[hole].points.clone());
            let place = (file, line.words.line);
            let shape = (line.points.as_slice(), holes.collect());
            let added = self.scene.add_without(line.surface, shape, place);
            added.map_err(|message| {
                let name =
                    |line: &Line<'_>| format!("{:?}", self.scene.surfaces[line.surface].name);
                let holes: Vec<String> = (line.holes.iter())
                    .map(|&hole| name(&self.lines[hole]))
                    .collect();
                let cut = match holes.as_slice() {
                    [] => String::new(),
                    all => format!(", of which is cut out {}", all.join(", ")),
                };
                let message = format_args!("{message} (surface {}{cut})", name(line));
                line.words.wrong(line.key, message)
            })?;
        }
        Ok(())
    }
}

/// Gives numbers to surfaces of names that others have; the first name, and how many they are.
fn repeated(surfaces: &mut [SceneSurface]) -> Option<(String, usize)> {
    let before: Vec<String> = surfaces.iter().map(|own| own.name.clone()).collect();
    super::distinguish(surfaces);
    let mut changed = before
        .into_iter()
        .zip(surfaces)
        .filter(|(name, own)| *name != own.name);
    let (first, _) = changed.next()?;
    Some((first, 1 + changed.count()))
}

/// The material of an emissivity; one of 0 reflects all.
fn emissivity(words: &mut Words<'_>) -> Result<Material, Wrong> {
    let word = words.clone().next();
    let emissivity = words.number("the emissivity")?;
    match (0.0..=1.0).contains(&emissivity) {
        true => Ok(Material::grey(emissivity, 0.0)),
        false => Err(words.wrong(word, "an emissivity must be 0 or more, and at most 1")),
    }
}
