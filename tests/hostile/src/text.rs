//! What people write: problem files, View2D decks, formulas.

use fredholm_core::Real;
use fredholm_factors::{Factors, Sights, Sky};
use fredholm_file::deck::{self, Deck};
use fredholm_file::formula::{self, Formula, Variables};
use fredholm_file::scene::SceneFile;
use fredholm_file::{self as file, InputError, ProblemFile};
use fredholm_scene::Scene;

use crate::memory::Bound;

/// A problem file. The most that was found are 236 bytes each, for `}` again and again in an array, of
/// each of which the parser makes an error; good files take up to 122.
const FILE: Bound = Bound {
    each: 512,
    besides: 1 << 16,
};
/// A deck. The most that was found are 12 bytes each, for a good one.
const DECK: Bound = Bound {
    each: 32,
    besides: 1 << 16,
};
/// A scene: a polygon of 112 bytes for two bytes more of a face, in a list that doubles, and what TOML takes.
const SCENE: Bound = Bound {
    each: 1024,
    besides: 1 << 16,
};
/// A formula: two instructions of 48 bytes each for each of two characters, as in abs(x) for |x|, names, and what a message says.
const FORMULA: Bound = Bound {
    each: 384,
    besides: 1 << 12,
};

/// Reads a problem file, as the program does before it makes anything of it.
///
/// # Panics
/// If that takes too much memory, if a refusal does not name its place, or if a comment below changes
/// what the file says.
pub fn problem_file(bytes: &[u8]) {
    const NAME: &str = "problem.toml";
    let read = |bytes: &[u8]| -> Result<ProblemFile, InputError> {
        let text = file::utf8(NAME, bytes.to_vec())?;
        let file = file::read(NAME, &text)?;
        file.validate()?;
        Ok(file)
    };
    match FILE.holds(bytes.len(), || read(bytes)) {
        Err(error) => assert_placed(&error.to_string(), NAME, &String::from_utf8_lossy(bytes)),
        Ok(file) => {
            let below = [bytes, b"\n# nothing more"].concat();
            let same = read(&below).expect("a comment is no error");
            // Kinds differ in type; what they have read is printed to the last digit.
            let parts = |file: ProblemFile| {
                let problem = format!("{:?}", file.problem);
                (problem, file.galerkin, file.walk, file.targets)
            };
            assert_eq!(parts(same), parts(file), "a comment says nothing");
        }
    }
}

/// Reads a View2D deck.
///
/// # Panics
/// If that takes too much memory, if a refusal does not name its place, or if the deck written again from
/// what was read is another.
pub fn deck(bytes: &[u8]) {
    const NAME: &str = "room.vs2";
    let read = |text: String| deck::parse_named(NAME, text);
    let text = String::from_utf8_lossy(bytes).into_owned();
    match DECK.holds(text.len(), || read(text.clone())) {
        Err(error) => assert_placed(&error.to_string(), NAME, &text),
        Ok(deck) => {
            let same = read(written(&deck)).expect("what was read can be read again");
            assert_eq!(same, deck, "a deck written again is the same");
            match deck.parts() {
                Err(error) => assert_placed(&error.to_string(), NAME, &text),
                Ok(parts) => assert_eq!(parts.surfaces.names.len(), parts.lines.len()),
            }
        }
    }
}

/// Reads a scene: a mesh or a description, of the format that the first byte chooses.
///
/// # Panics
/// If that takes too much memory, if a refusal does not name the file, or if form factors of a small scene that was
/// accepted are no shares.
pub fn scene(bytes: &[u8]) {
    const NAMES: [&str; 5] = ["a.obj", "a.stl", "a.ply", "a.vs3", "a.toml"];
    let Some((&first, rest)) = bytes.split_first() else {
        return;
    };
    let name = NAMES[usize::from(first) % NAMES.len()];
    let read = || {
        if name.ends_with("toml") {
            let text = file::utf8(name, rest.to_vec())?;
            file::scene::parse_description(name, &text)
        } else {
            file::scene::parse_mesh(name, rest.to_vec())
        }
    };
    match SCENE.holds(rest.len(), read) {
        Err(error) => {
            let message = error.to_string();
            assert!(message.starts_with(name), "{message}");
            assert_message(&message);
        }
        Ok(scene) => {
            assert!(!scene.surfaces.is_empty());
            for surface in &scene.surfaces {
                let numbers = surface.polygons.iter().flat_map(|p| p.points()).flatten();
                assert!(
                    numbers.into_iter().all(|x| x.is_finite()),
                    "{:?}",
                    surface.name
                );
            }
            let polygons: usize = scene.surfaces.iter().map(|s| s.polygons.len()).sum();
            if polygons <= 16 {
                form_factors(&scene);
            }
        }
    }
}

/// What is asked for behind obstacles.
const ERROR: f64 = 1e-3;

/// Form factors of what was read, if it makes a scene.
fn form_factors(file: &SceneFile) {
    /// The area of the smallest face in squares of the scene's width, above which its sums must be right: what is as small
    /// as the smallest distance that a scene tells, 2^-40 of its width, is not told from nothing.
    const SMALLEST: f64 = 1e-12;
    match file.scene::<f64>() {
        Err(error) => assert_message(&error.to_string()),
        Ok(scene) => {
            let factors = fredholm_factors::scene_factors(&scene, ERROR).expect("the error is one");
            let points = || scene.faces().iter().flat_map(|f| f.polygon());
            let width = (0..3).fold(0.0_f64, |width, k| {
                let least = points().fold(f64::INFINITY, |m, p| m.min(p[k]));
                points().fold(width, |m, p| m.max(p[k] - least))
            });
            let smallest = factors.areas().iter().fold(f64::INFINITY, |m, a| m.min(*a));
            let is_even = smallest > SMALLEST * width * width;
            // Each of up to 16 pairs may be off.
            let most = 1.0 + 16.0 * ERROR;
            for sum in factors.row_sums() {
                assert!(sum >= 0.0 && sum.is_finite(), "{sum}");
                assert!(!is_even || sum < most, "{sum}");
                assert!(!is_even || file.open || sum > 2.0 - most, "{sum}");
            }
            if let Some(sky) = &file.sky {
                let sky = Sky::bands(&sky.altitudes, &sky.sectors)
                    .expect("a sky that was checked is one");
                if sky.patches().len() <= 16 {
                    sky_factors(&scene, &sky, &factors, is_even);
                }
            }
        }
    }
}

/// What faces see of a sky: with what they see of each other no more than all.
fn sky_factors(scene: &Scene, sky: &Sky, factors: &Factors, is_even: bool) {
    let sights = Sights::new(scene, ERROR).expect("the error is one");
    for (face, sum) in factors.row_sums().into_iter().enumerate() {
        let row = sights.sky(face, sky).expect("a scene with a sky is open");
        assert!(row.exchange.iter().all(|&x| x >= 0.0), "{row:?}");
        let seen = row.exchange.iter().sum::<f64>() / factors.areas()[face];
        // Each of 17 patches may be off, too.
        let most = 1.0 + 33.0 * ERROR;
        assert!(
            seen.is_finite() && (!is_even || sum + seen < most),
            "{sum} {seen}"
        );
    }
}

/// A deck as a file, with two vertices for each surface.
fn written(deck: &Deck) -> String {
    let mut text = format!("C {} 0\nG 2\n", u8::from(!deck.open));
    for (i, surface) in deck.surfaces.iter().enumerate() {
        let (a, b, name) = (2 * i, 2 * i + 1, &surface.name);
        for (vertex, [x, y]) in [a, b].into_iter().zip(surface.ends) {
            text += &format!("V {vertex} {x:?} {y:?}\n");
        }
        let number = |line: Option<usize>| line.map_or(0, |line| line + 1);
        let (base, combined) = (number(surface.base), number(surface.combined));
        let emissivity = surface.emissivity;
        text += &format!(
            "S {} {a} {b} 0 {base} {combined} {emissivity:?} {name}\n",
            i + 1
        );
    }
    text + "End of data\n"
}

/// Reads a formula, whose first byte says of which variables, and evaluates it.
///
/// # Panics
/// If reading takes too much memory or evaluating any, if a refusal does not name a part of the formula,
/// or if a formula in parentheses has another value.
pub fn formula(bytes: &[u8]) {
    let Some((&first, rest)) = bytes.split_first() else {
        return;
    };
    let variables = Variables {
        dimension: usize::from(first % 6) + 1,
        two: first & 0x80 == 0,
        parameters: &[],
    };
    let text = String::from_utf8_lossy(rest);
    if let Err(error) = FORMULA.holds(text.len(), || formula::check(&text, variables)) {
        // A part, even where nothing is there.
        assert!(text.get(error.span.clone()).is_some(), "{error:?}: {text}");
        assert_message(&error.message);
        return;
    }
    values::<f64>(&text);
    values::<f32>(&text);
}

/// Evaluates a good formula at some points.
fn values<F: Real>(text: &str) {
    let bracketed = format!("({text})");
    let formula = Formula::<F>::new(text, &[]).expect("a formula that was checked is one");
    let bracketed = match Formula::<F>::new(&bracketed, &[]) {
        Ok(formula) => formula,
        Err(error) => {
            assert!(error.message.contains("deep"), "{}", error.message);
            return;
        }
    };
    for (x, y) in [(0.5, 0.5), (0.0, 1.0), (1.0, 0.0), (0.3, 0.8)] {
        let (x, y) = ([F::from_f64(x); 6], [F::from_f64(y); 6]);
        let value = Bound::NOTHING.holds(0, || formula.value(&x, &y)).to_f64();
        let same = bracketed.value(&x, &y).to_f64();
        assert!(value.is_nan() && same.is_nan() || value == same, "{text}");
    }
}

/// # Panics
/// Unless the message begins with the name of the file, a line and a column of its text.
fn assert_placed(message: &str, name: &str, text: &str) {
    let place = message
        .strip_prefix(name)
        .and_then(|rest| rest.strip_prefix(':'))
        .and_then(|rest| {
            let mut parts = rest.splitn(3, ':');
            let mut number = || parts.next()?.parse::<usize>().ok()?.checked_sub(1);
            Some((number()?, number()?, parts.next()?.trim()))
        });
    let Some((line, before, what)) = place else {
        panic!("no place: {message}");
    };
    let line = text.split('\n').nth(line);
    let inside = line.is_some_and(|line| before <= line.chars().count());
    assert!(inside, "a place outside: {message}");
    assert!(!what.is_empty(), "no words: {message}");
    assert_message(message);
}

/// # Panics
/// If a terminal should not be given the message.
fn assert_message(message: &str) {
    let shown = |c: char| !c.is_control() || matches!(c, '\n' | '\t');
    assert!(message.chars().all(shown), "{message:?}");
    assert!(!message.trim().is_empty(), "an empty message");
}
