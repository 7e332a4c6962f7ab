//! What is repeated, nested and large, and saved states that cannot be: within its memory and time, and refused at its place.

use core::hint::black_box;
use std::path::Path;

use fredholm_file::parts::{Part, SystemContent};
use fredholm_hostile::{
    Bound, deck, formula, good_part, good_systems, models, part, part_with_checksum, problem_file,
    state_with_checksum, system, system_of_numbers, system_with_checksum, table,
};

mod seeds;
use seeds::PIECES;

/// What recurses would overflow the stack, what is quadratic would not end, and what takes much memory for
/// each byte shows here how much. By day every fourth piece behind a beginning, and the others behind the next ones.
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
            if !long && (i + j) % 4 != 0 {
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
    let long = std::env::var_os("FREDHOLM_LONG").is_some();
    let count = if long { 20_000 } else { 5000 };
    let each = |piece: &dyn Fn(usize) -> String| (0..count).map(piece).collect::<String>();
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

const BOUND: Bound = Bound {
    each: 10,
    besides: 100,
};

#[test]
fn memory_within_the_bound_is_let_through() {
    assert_eq!(BOUND.holds(90, || black_box(vec![1_u8; 1000]).len()), 1000);
}

#[test]
#[should_panic(expected = "an input of 89 bytes took 1000 bytes, more than 990")]
fn memory_beyond_the_bound_is_found() {
    BOUND.holds(89, || black_box(vec![1_u8; 1000]).len());
}

#[test]
fn the_good_part_is_good() {
    let bytes = good_part();
    let content = Part::read(Path::new("a"), &bytes).unwrap();
    assert_eq!(content.runs[0].batches.len(), 3);
    part(&bytes);
    part_with_checksum(&bytes);
}

/// Every system is made again by its own model; that it has the same numbers is looked at wherever one is read.
#[test]
fn the_good_systems_are_good() {
    for (bytes, (model, settings)) in good_systems().iter().zip(models()) {
        let content = SystemContent::read(Path::new("a"), bytes).unwrap();
        let cells = model.partition(&settings.discretisation()).unwrap();
        cells.restore(content.saved.clone()).unwrap();
        system(bytes);
        system_with_checksum(bytes);
    }
    (0..5).for_each(|kind| system_of_numbers(&[kind]));
}
