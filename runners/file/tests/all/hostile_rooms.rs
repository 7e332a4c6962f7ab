//! Rooms that nobody would draw: files and decks that are cut short, mutated, or huge. Whatever
//! comes, it is read, or refused with a place: no panic, no hang.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use fredholm_file::{self as file, InputError, deck};

const DECK: &str = include_str!("../../../../examples/facet.vs2");
const FILES: [&str; 5] = [
    include_str!("../../templates/room.toml"),
    include_str!("../../../../examples/furnished.toml"),
    include_str!("../../../../examples/doorway.toml"),
    include_str!("../../../../examples/furnace.toml"),
    include_str!("../../../../examples/facet.toml"),
];

/// Numbers that are none, or that nobody means.
const NUMBERS: [&str; 14] = [
    "nan",
    "inf",
    "-inf",
    "NaN",
    "1e999",
    "-1",
    "0",
    "1e308",
    "-1e-320",
    "",
    "1e",
    "0x",
    "99999999999999999999",
    "4294967296",
];

/// Why something is refused.
#[derive(Debug)]
enum Refusal {
    /// An error of the input.
    Input(String),
    /// Any other error.
    Other(String),
}

impl From<InputError> for Refusal {
    fn from(error: InputError) -> Self {
        Self::Input(error.to_string())
    }
}

/// What a problem file comes to before any walk: `Ok` where it would run.
fn read_file(text: &str) -> Result<(), Refusal> {
    let file = file::read("room.toml", text)?;
    file.validate()?;
    if file.problem.of::<file::kinds::Room>().is_none() {
        return Ok(());
    }
    let resolved = file.resolve()?;
    let (model, settings) = (resolved.model.model(), &resolved.settings);
    let walk = settings.walk_options();
    let cells = model.partition(&settings.discretisation());
    let checked = cells.and_then(|cells| cells.check_variance(&walk));
    checked.map_err(|error| {
        if error.is_of_input() {
            file.explain(&error).into()
        } else {
            Refusal::Other(error.to_string())
        }
    })
}

/// What a deck comes to.
fn read_deck(text: &str) -> Result<(), Refusal> {
    let other = |error: fredholm_room::RoomError| Refusal::Other(error.to_string());
    let deck = deck::parse_named("room.vs2", text.to_owned())?;
    let scene = deck.parts()?.surfaces.scene::<f64>();
    let scene = scene.map_err(|error| Refusal::Input(error.to_string()))?;
    let factors = fredholm_factors::room_factors(&scene).map_err(other)?;
    // What is accepted has form factors: at most 1, and 1 in all where nothing leaves.
    let coordinates = deck.surfaces.iter().flat_map(|s| s.ends).flatten();
    let size = coordinates.fold(0.0, |size: f64, x| size.max(x.abs()));
    for (i, row) in factors.chunks(scene.surfaces()).enumerate() {
        let sum: f64 = row.iter().sum();
        // Some hundred differences of distances, rounded as the largest is, per length.
        let length = scene.length(i).map_err(other)?;
        let allowed = 1e-9 + 1000.0 * f64::EPSILON * size / length;
        let good = -allowed..1.0 + allowed;
        assert!(row.iter().all(|f| good.contains(f)), "{row:?}: {text}");
        assert!(sum < 1.0 + allowed, "{sum}: {text}");
        assert!(deck.open || sum > 1.0 - allowed, "{sum}: {text}");
    }
    Ok(())
}

/// Fails unless the error is one of the input, and names a line and a column (or a surface and a
/// vertex) of `name`.
fn assert_placed(result: Result<(), Refusal>, name: &str) -> Result<(), TestCaseError> {
    let message = match result {
        Ok(()) => return Ok(()),
        Err(Refusal::Input(message)) => message,
        Err(Refusal::Other(other)) => {
            return Err(TestCaseError::fail(format!(
                "no error of the input: {other}"
            )));
        }
    };
    let placed = message
        .strip_prefix(&format!("{name}:"))
        .is_some_and(|rest| {
            let mut numbers = rest.split(':').take(2).map(str::parse::<u32>);
            numbers.all(|number| number.is_ok_and(|n| n > 0))
        });
    let surface = message.contains("surface \"") && message.contains("vertex ");
    prop_assert!(placed || surface, "no place: {message}");
    Ok(())
}

/// A part of a text up to any byte, as a reader in UTF-8 gets it.
fn cut(text: &str, share: f64) -> String {
    let end = (share * text.len() as f64) as usize;
    String::from_utf8_lossy(text.as_bytes().get(..end).unwrap_or(&[])).into_owned()
}

/// A text with some bytes replaced.
fn bytes_replaced(text: &str, changes: &[(f64, u8)]) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for &(share, byte) in changes {
        let place = (share * bytes.len() as f64) as usize;
        if let Some(old) = bytes.get_mut(place) {
            *old = byte;
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// A text with one of its numbers replaced by a word.
fn number_replaced(text: &str, share: f64, word: &str) -> String {
    let is_part = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
    let starts: Vec<usize> = text
        .char_indices()
        .filter(|&(i, c)| is_part(c) && !text[..i].ends_with(is_part))
        .map(|(i, _)| i)
        .collect();
    let start = starts[(share * starts.len() as f64) as usize];
    let rest = &text[start..];
    let end = rest.find(|c| !is_part(c)).unwrap_or(rest.len());
    format!("{}{word}{}", &text[..start], &rest[end..])
}

/// A text with one of its lines left out, doubled, or moved.
fn lines_changed(text: &str, change: usize, shares: [f64; 2]) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    let [from, to] = shares.map(|share| (share * lines.len() as f64) as usize);
    match change {
        0 => drop(lines.remove(from)),
        1 => lines.insert(to, lines[from]),
        _ => lines.swap(from, to),
    }
    lines.join("\n")
}

/// What is made of a text.
fn mutated(text: &'static str) -> impl Strategy<Value = String> {
    let byte = prop_oneof![
        any::<u8>(),
        prop::sample::select(b" \n0123456789.-e[],\"=#'{}".to_vec())
    ];
    let share = 0.0..1.0_f64;
    prop_oneof![
        share.clone().prop_map(move |at| cut(text, at)),
        prop::collection::vec((share.clone(), byte), 1..8)
            .prop_map(move |changes| bytes_replaced(text, &changes)),
        (share.clone(), prop::sample::select(NUMBERS.to_vec()))
            .prop_map(move |(at, word)| number_replaced(text, at, word)),
        (share.clone(), -10.0..10.0_f64).prop_map(move |(at, x)| number_replaced(
            text,
            at,
            &x.to_string()
        )),
        (0..3_usize, [share.clone(), share])
            .prop_map(move |(change, at)| lines_changed(text, change, at)),
    ]
}

fn mutated_file() -> impl Strategy<Value = String> {
    prop::sample::select(FILES.to_vec()).prop_flat_map(mutated)
}

/// A polygon through any points, which mostly crosses itself.
fn outlines() -> impl Strategy<Value = (Vec<[i8; 2]>, bool)> {
    let point = [-9..10_i8, -9..10_i8];
    (prop::collection::vec(point, 2..9), any::<bool>())
}

/// The same cases every time; a hundred times as many with FREDHOLM_LONG in the environment.
fn config() -> ProptestConfig {
    ProptestConfig {
        cases: if crate::is_long() { 40_000 } else { 400 },
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn a_mutated_deck_is_read_or_refused_at_its_place(text in mutated(DECK)) {
        assert_placed(read_deck(&text), "room.vs2")?;
    }

    #[test]
    fn a_mutated_file_is_read_or_refused_at_its_place(text in mutated_file()) {
        // Its deck is a file of its own, which is not there.
        if !text.contains("deck =") {
            assert_placed(read_file(&text), "room.toml")?;
        } else if let Err(Refusal::Other(other)) = read_file(&text) {
            return Err(TestCaseError::fail(other));
        }
    }

    #[test]
    fn an_outline_that_crosses_itself_is_refused_at_its_place((points, open) in outlines()) {
        let list = |points: &[[i8; 2]]| {
            let points: Vec<String> = points.iter().map(|[x, y]| format!("[{x}, {y}]")).collect();
            points.join(", ")
        };
        let text = format!(
            "[problem]\nkind = \"room\"\nopen = {open}\n[[problem.surface]]\nname = \"s\"\n\
             points = [{}, {}]\nreflectance = 0.5\n[galerkin]\ncells = 20\nshadow_cuts = true\n\
             [[target]]\nname = \"all\"\nover = \"all\"\n",
            list(&points),
            list(&points[..1]),
        );
        assert_placed(read_file(&text), "room.toml")?;
    }
}

/// Every byte, not some of them.
#[test]
fn a_deck_cut_short_anywhere_is_refused_at_its_place() {
    let whole = DECK.find("End of data").unwrap();
    for end in 0..whole {
        let result = read_deck(&DECK[..end]);
        assert!(result.is_err(), "{end}");
        assert_placed(result, "room.vs2").unwrap();
    }
    read_deck(DECK).unwrap();
}

#[test]
fn a_file_cut_short_anywhere_is_read_or_refused_at_its_place() {
    let file = FILES[2];
    for end in 0..file.len() {
        assert_placed(read_file(&file[..end]), "room.toml").unwrap();
    }
    read_file(file).unwrap();
}

/// The files as they stand are read, so that the mutations are of something good.
#[test]
fn what_is_mutated_is_good() {
    for file in &FILES[..4] {
        read_file(file).unwrap();
    }
}
