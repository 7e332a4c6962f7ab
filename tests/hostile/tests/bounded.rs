//! Some seconds of what the fuzz targets do for hours, with the same assertions and without a fuzzer.

use fredholm_hostile::{
    deck, formula, problem_file, scene, state, state_with_checksum, table, table_with_checksum,
};
use proptest::prelude::*;
use proptest::sample::{Index, select};
use proptest::test_runner::RngSeed;

mod seeds;
use seeds::{DECKS, FILES, PIECES, SCENES, TABLES};

/// The same cases every time; a hundred times as many with FREDHOLM_LONG in the environment.
fn config() -> ProptestConfig {
    let long = std::env::var_os("FREDHOLM_LONG").is_some();
    ProptestConfig {
        cases: if long { 100_000 } else { 1000 },
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

/// One of these with some bytes changed, lost or doubled, or with other pieces in it.
fn mutated(good: &'static [&'static [u8]]) -> impl Strategy<Value = Vec<u8>> {
    let change = (
        0..6_u8,
        any::<Index>(),
        any::<Index>(),
        any::<u8>(),
        select(&PIECES[..]),
    );
    let changes = prop::collection::vec(change, 1..6);
    (select(good), changes).prop_map(|(good, changes)| {
        let mut bytes = good.to_vec();
        for (kind, from, to, byte, piece) in changes {
            let (a, b) = (from.index(bytes.len() + 1), to.index(bytes.len() + 1));
            let (from, to) = (a.min(b), a.max(b));
            // Most parts are short.
            let to = if byte < 200 { to.min(from + 10) } else { to };
            match kind {
                0 => bytes.truncate(to.max(10).min(bytes.len())),
                1 => drop(bytes.drain(from..to)),
                2 => {
                    let part = bytes[from..to].to_vec();
                    drop(bytes.splice(to..to, part));
                }
                3 => drop(bytes.splice(from..to, piece.bytes())),
                4 => drop(bytes.splice(from..from, piece.bytes())),
                _ => bytes.iter_mut().skip(from).take(1).for_each(|b| *b ^= byte),
            }
        }
        bytes
    })
}

/// Any pieces one after the other, behind a byte of variables.
fn pieces() -> impl Strategy<Value = Vec<u8>> {
    let any_pieces = prop::collection::vec(select(&PIECES[..]), 0..12);
    (any::<u8>(), any_pieces).prop_map(|(first, pieces)| {
        let mut bytes = vec![first];
        bytes.extend(pieces.concat().bytes());
        bytes
    })
}

/// Formulas that are good but for one piece.
fn formulas() -> impl Strategy<Value = Vec<u8>> {
    let leaf = select(vec!["x", "y", "x1", "y2", "0.5", "1e-3", "pi", "e"]).prop_map(str::to_owned);
    let tree = leaf.prop_recursive(8, 40, 3, |inner| {
        let binary = select(vec!["+", "-", "*", "/", "%", "^", "<", "==", "||"]);
        let call = select(vec!["sin", "exp", "ln", "cbrt", "-", "!", ""]);
        prop_oneof![
            (inner.clone(), binary, inner.clone()).prop_map(|(a, op, b)| format!("{a} {op} {b}")),
            (call, inner.clone()).prop_map(|(f, a)| format!("{f}({a})")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("max({a}, {b})")),
            (inner.clone(), inner.clone(), inner)
                .prop_map(|(a, b, c)| format!("{a} < {b} ? {c} : {a}")),
        ]
    });
    let spoilt = (tree, any::<Index>(), prop::option::of(select(&PIECES[..])));
    (any::<u8>(), spoilt).prop_map(|(first, (mut formula, at, piece))| {
        if let Some(piece) = piece {
            formula.insert_str(at.index(formula.len()), piece);
        }
        let mut bytes = vec![first];
        bytes.extend(formula.bytes());
        bytes
    })
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn files_are_read_or_refused_at_their_place(bytes in mutated(&FILES)) {
        problem_file(&bytes);
    }

    #[test]
    fn decks_are_read_or_refused_at_their_place(bytes in mutated(&DECKS)) {
        deck(&bytes);
    }

    #[test]
    fn scenes_are_read_or_refused(bytes in mutated(&SCENES)) {
        scene(&bytes);
    }

    #[test]
    fn tables_are_read_or_refused(bytes in mutated(&TABLES)) {
        table(&bytes);
        table_with_checksum(&bytes);
    }

    #[test]
    fn anything_is_read_or_refused(bytes in pieces()) {
        formula(&bytes);
        scene(&bytes);
        problem_file(&bytes[1..]);
        deck(&bytes[1..]);
        table(&bytes);
        table_with_checksum(&bytes);
        state(&bytes);
    }

    #[test]
    fn formulas_are_read_or_refused_at_their_place(bytes in formulas()) {
        formula(&bytes);
    }

    #[test]
    fn states_are_read_or_refused(
        first in any::<u8>(),
        changes in prop::collection::vec((0..198_usize, any::<u8>()), 0..4),
    ) {
        let mut bytes = [0; 199];
        bytes[0] = first;
        changes.iter().for_each(|&(at, change)| bytes[1 + at] ^= change);
        state(&bytes);
        state_with_checksum(&bytes);
    }
}

/// What recurses would overflow the stack, what is quadratic would not end, and what takes much memory for
/// each byte shows here how much. By day in every second piece behind a beginning, and in the others behind the next.
#[test]
fn what_is_repeated_a_hundred_thousand_times_is_no_other() {
    let heads = [
        "",
        "[problem]\nkind = \"circle\"\nemission = 1\nreflectance = [",
        "[problem]\nkind = \"room\"\n[[problem.surface]]\nname = \"a\"\npoints = [",
        "[problem]\nkind = \"cube\"\ndimension = 1\nsource = \"1\"\nkernel = \"",
        "[galerkin]\n",
        "V 1 0 0\nV 2 1 0\nS 1 1 2 0 0 0 1 ",
    ];
    let more = [
        "0,", "[0,0],", "[[],", "{a=", "\"\",", "-(", "sin(", "x+", "x ", "1?1:", "[[a]]\n",
        "[a.a]\n",
    ];
    let long = std::env::var_os("FREDHOLM_LONG").is_some();
    for (i, head) in heads.into_iter().enumerate() {
        for (j, piece) in PIECES.into_iter().chain(more).enumerate() {
            if !long && (i + j) % 2 == 1 {
                continue;
            }
            let mut bytes = head.as_bytes().to_vec();
            bytes.extend(piece.repeat(100_000 / piece.len()).bytes());
            problem_file(&bytes);
            deck(&bytes);
            formula(&bytes);
            table(&bytes);
        }
    }
}

/// Deeply nested in every way that is closed again.
#[test]
fn what_is_nested_deeply_is_refused() {
    for depth in [1, 10, 100, 1000, 100_000] {
        for (open, close) in [
            ("[", "]"),
            ("{a=", "}"),
            ("\"", "\""),
            ("(", ")"),
            ("-", ""),
            ("x<y?", ":1"),
        ] {
            let nested = [&open.repeat(depth), "1", &close.repeat(depth)].concat();
            problem_file(format!("a = {nested}").as_bytes());
            problem_file(
                format!("[problem]\nkind = \"circle\"\nreflectance = {nested}").as_bytes(),
            );
            formula(format!("\0{nested}").as_bytes());
        }
    }
}

/// Good files of any size, made of what is small in the file and large in memory.
#[test]
fn what_is_large_and_good_keeps_to_its_memory() {
    let each = |piece: &dyn Fn(usize) -> String| (0..20_000).map(piece).collect::<String>();
    let all = "[[target]]\nname = \"all\"\nover = \"all\"\n";
    let circle = "[problem]\nkind = \"circle\"\nemission = 1\n";
    let numbers = each(&|_| "0,".to_owned());
    let targets = each(&|i| format!("[[target]]\nname=\"{i}\"\nat=1\n"));
    let inline = each(&|i| format!("{{name=\"{i}\",at=1}},"));
    let points = each(&|_| "[0,1],".to_owned());
    let surfaces = each(&|i| {
        format!("[[problem.surface]]\nname=\"{i}\"\npoints=[[0,0],[1,0]]\nreflectance=0\n")
    });
    let room = "[problem]\nkind = \"room\"\n";
    let files = [
        format!("{circle}reflectance = [{numbers}]\n{all}"),
        format!("{circle}reflectance = 0\n{targets}"),
        format!("target = [{inline}]\n{circle}reflectance = 0\n"),
        format!("{room}[[problem.surface]]\nname=\"a\"\npoints=[{points}]\nreflectance=0\n{all}"),
        format!("{room}{surfaces}{all}"),
    ];
    let sum = |add: &str| format!("x{}", add.repeat(10_000));
    for add in ["+1", "+x", "-y", "*-x"] {
        let text = sum(add);
        formula(format!("\0{text}").as_bytes());
        problem_file(
            format!(
                "[problem]\nkind=\"cube\"\ndimension=1\nsource=\"1\"\nkernel=\"{text}\"\n{all}"
            )
            .as_bytes(),
        );
    }
    for file in files {
        problem_file(file.as_bytes());
    }
    let vertices = each(&|i| format!("V {i} 0 {i}\n"));
    let surfaces = each(&|i| format!("S {i} {i} 0 0 0 0 1\n"));
    deck(format!("{vertices}{surfaces}End of data").as_bytes());
}

/// A saved state whose run has made as many states as can be counted: the next walk's could not be added.
#[test]
fn a_state_of_too_many_states_is_refused() {
    let mut changes = vec![0; 1 + 2 + 8 + 96 + 8];
    changes.extend([0xff; 8]);
    state_with_checksum(&changes);
}

/// A saved state that says of itself that it is longer than a state is.
#[test]
fn a_state_that_says_another_length_is_refused() {
    state_with_checksum(&[0, 1, 0]);
}
