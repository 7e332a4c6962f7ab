//! What programs write: export tables and saved states.

use crc::{CRC_32_ISO_HDLC, Crc};
use fredholm_core::{
    At, Chain, Equation, Goal, Goals, NoNeighbour, RunOptions, Space, Statistics, Tolerance,
    Uniforms, WalkOptions,
};
use fredholm_embedded::zerocopy::{FromBytes, Immutable, IntoBytes};
use fredholm_embedded::{Driver, State, StateError, TableBuilder, TableError, Tables};

use crate::memory::Bound;

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Kinds of tables, the last of which nobody writes.
const KINDS: [&str; 3] = ["circle", "scene", ""];
/// Names of arrays, the last of which nobody writes.
const NAMES: [&str; 8] = [
    "circle", "cells", "slots", "source", "faces", "control", "v", "",
];

/// Reads an export table, of the kind that it says and of another.
///
/// # Panics
/// If that takes any memory, if an array lies outside the bytes, or if a refusal's message says nothing.
pub fn table(bytes: &[u8]) {
    // At a multiple of 8, and at another place.
    let mut words = vec![0_u64; bytes.len() / 8 + 2];
    let space = words.as_mut_bytes();
    let (even, odd) = (0..bytes.len(), 1..bytes.len() + 1);
    space[odd.clone()].copy_from_slice(bytes);
    let kind = |k: &&str| {
        bytes
            .get(16..)
            .is_some_and(|name| name.starts_with(k.as_bytes()))
    };
    let kind = KINDS.iter().copied().find(kind).unwrap_or("circle");
    let misplaced = Tables::read(&space[odd], kind).err();
    space[even.clone()].copy_from_slice(bytes);
    let bytes = &space[even];
    match Bound::NOTHING.holds(0, || Tables::read(bytes, kind)) {
        Ok(table) => {
            assert_eq!(misplaced, Some(TableError::Alignment));
            assert!(is_laid_out(bytes), "arrays that do not fit");
            Bound::NOTHING.holds(0, || arrays(&table, bytes));
            let other = if kind == "scene" { "circle" } else { "scene" };
            assert_eq!(Tables::read(bytes, other).err(), Some(TableError::Kind));
        }
        Err(error) => {
            let wrong = matches!(error, TableError::Directory { .. });
            assert!(!wrong || !is_laid_out(bytes), "arrays that fit");
            assert_named(error, bytes);
        }
    }
}

/// Whether head, directory and arrays are as long as the bytes are, each array at a multiple of 8 and with
/// a name.
fn is_laid_out(bytes: &[u8]) -> bool {
    let word = |at: usize| -> Option<u128> {
        let word = bytes.get(at..)?.first_chunk()?;
        Some(u32::from_le_bytes(*word).into())
    };
    let arrays = usize::from(u16::from_le_bytes([bytes[6], bytes[7]]));
    let mut length = 24 + 16 * arrays as u128;
    for entry in (0..arrays).map(|i| 24 + 16 * i) {
        let (Some(element), Some(count)) = (word(entry + 8), word(entry + 12)) else {
            return false;
        };
        if element == 0 || bytes[entry] == 0 {
            return false;
        }
        length += (element * count).next_multiple_of(8);
    }
    length == bytes.len() as u128
}

/// As [`table`], with the head mended so that what is behind the checksum is met; and as the numbers of a
/// table that is written, read, and damaged.
///
/// # Panics
/// As [`table`], or if the table that is read is not the one that was written.
pub fn table_with_checksum(bytes: &[u8]) {
    let mut mended = bytes.to_vec();
    if let Some(head) = mended.get_mut(..24) {
        head[..6].copy_from_slice(b"FHTB\x01\x00");
        head[8..12].copy_from_slice(&(bytes.len() as u32).to_le_bytes());
        let kind = KINDS[usize::from(head[16]) % KINDS.len()].as_bytes();
        head[16..].fill(0);
        head[16..16 + kind.len()].copy_from_slice(kind);
        let sum = checksum(&[&mended[..12], &mended[16..]]);
        mended[12..16].copy_from_slice(&sum);
    }
    table(&mended);
    round_trip(bytes);
}

fn checksum(parts: &[&[u8]]) -> [u8; 4] {
    let mut digest = CRC.digest();
    parts.iter().for_each(|part| digest.update(part));
    digest.finalize().to_le_bytes()
}

/// Looks at every array as every type.
fn arrays(table: &Tables<'_>, bytes: &[u8]) {
    for name in NAMES {
        array::<u8>(table, name, bytes);
        array::<u32>(table, name, bytes);
        array::<f32>(table, name, bytes);
        array::<f64>(table, name, bytes);
        array::<[f32; 6]>(table, name, bytes);
        array::<[f64; 9]>(table, name, bytes);
    }
}

fn array<T: FromBytes + Immutable + Copy>(table: &Tables<'_>, name: &'static str, bytes: &[u8]) {
    let slice = table.get::<T>(name);
    match slice {
        Ok(array) => {
            let (whole, part) = (bytes.as_ptr_range(), array.as_ptr_range());
            let (start, end) = (part.start.addr(), part.end.addr());
            assert!(whole.start.addr() <= start && end <= whole.end.addr());
        }
        Err(TableError::Missing { name: missing }) => {
            assert_eq!(missing, name);
        }
        Err(TableError::Element { name: other, found }) => {
            assert!(other == name && found != size_of::<T>());
        }
        Err(other) => panic!("{name}: {other}"),
    }
    let length = slice.map(<[T]>::len);
    assert_eq!(table.one::<T>(name).is_ok(), length == Ok(1));
}

/// # Panics
/// Unless the message says what is wrong where: how many bytes, which version, which array.
fn assert_named(error: TableError, bytes: &[u8]) {
    let message = error.to_string();
    let place = match error {
        TableError::Foreign => "first bytes".to_owned(),
        TableError::Version { found } => format!("not {found}"),
        TableError::Kind => "kind".to_owned(),
        TableError::Length { expected, found } => {
            assert_eq!(found, bytes.len());
            format!("{expected} bytes, and {found} are here")
        }
        TableError::Checksum => "checksum".to_owned(),
        TableError::Directory { array } => format!("array number {array} "),
        TableError::Alignment => "multiple of 8".to_owned(),
        other => panic!("no error of reading a table: {other}"),
    };
    assert!(message.contains(&place), "{message}");
}

/// Writes a table of the bytes as numbers, reads it, and damages it at one place.
fn round_trip(bytes: &[u8]) {
    let Some((&[a, b], numbers)) = bytes.split_first_chunk() else {
        return;
    };
    let (small, large) = numbers.split_at(numbers.len() / 2);
    let small: Vec<u32> = small
        .chunks(4)
        .map(|c| c.iter().fold(0, |n, &byte| n << 8 | u32::from(byte)))
        .collect();
    let large: Vec<f64> = large
        .chunks(8)
        .map(|c| {
            let bits = c.iter().fold(0, |n, &byte| n << 8 | u64::from(byte));
            f64::from_bits(bits)
        })
        .collect();
    let kind = KINDS[usize::from(a) % 2];
    let mut builder = TableBuilder::new(kind);
    builder.numbers("slots", &small);
    builder.numbers("v", &large);
    let few = numbers.get(..9).unwrap_or(numbers);
    builder.numbers("cells", few);
    builder.numbers("light", &[u32::from(b)]);
    let written = builder.to_bytes();
    let mut words = vec![0_u64; written.len().div_ceil(8)];
    let place = words.as_mut_bytes();
    place.copy_from_slice(&written);
    let table = Tables::read(place, kind).expect("a table that was written is read");
    assert_eq!(table.get::<u32>("slots"), Ok(&small[..]));
    let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(table.get::<f64>("v").map(bits), Ok(bits(&large)));
    assert_eq!(table.get::<u8>("cells"), Ok(few));
    assert_eq!(table.one::<u32>("light"), Ok(&u32::from(b)));
    // One byte that changes is always found.
    let at = usize::from(a) * 256 + usize::from(b);
    if let Some(byte) = place.get_mut(at) {
        *byte ^= (a ^ b).max(1);
        assert!(Tables::read(place, kind).is_err(), "byte {at}");
    }
}

/// The bytes of a state.
const BYTES: usize = State::<1>::BYTES;
/// Bytes before its checksum, and before what is behind it.
const HEAD: [usize; 2] = [24, 28];

fn written(state: &State) -> [u8; BYTES] {
    let mut bytes = [0; BYTES];
    state.write(&mut bytes).expect("room for a state");
    bytes
}

/// Reads a saved state.
///
/// # Panics
/// If that takes any memory, if a state written again is another, or if a refusal's message says nothing.
pub fn state(bytes: &[u8]) {
    match Bound::NOTHING.holds(0, || State::read(bytes)) {
        Ok(state) => assert_eq!(written(&state), *bytes, "a state written again is the same"),
        Err(error) => {
            let message = error.to_string();
            let place = match error {
                StateError::Length { expected, found } => {
                    assert!(expected == BYTES && found != BYTES);
                    format!("not {found}")
                }
                StateError::Foreign => "first bytes".to_owned(),
                StateError::Version { found } => format!("not {found}"),
                StateError::Checksum => "checksum".to_owned(),
                StateError::Contradiction => "numbers of walks and batches".to_owned(),
                other => panic!("no error of reading a state: {other}"),
            };
            assert!(message.contains(&place), "{message}");
        }
    }
}

/// u(x) = x + ∫₀¹ ½ x y u(y) dy, by jumps to uniform points.
#[derive(Clone, Copy, Debug)]
struct Toy;

impl Space for Toy {
    type Scalar = f64;
    type Point = f64;
}

impl Chain for Toy {
    fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
        Some(uniforms.uniform())
    }
}

impl Equation for Toy {
    type Value = f64;

    fn kernel(&self, x: &f64, y: &f64) -> f64 {
        0.5 * x * y
    }
    fn source<U: Uniforms<f64>>(&self, x: &f64, _: &mut U) -> f64 {
        *x
    }
}

/// As [`state`], with head and checksum mended so that what is behind them is met; and a run goes on from
/// there, if it can.
///
/// # Panics
/// As [`state`], or if a run that is restored stands elsewhere than where the state says.
pub fn state_with_checksum(bytes: &[u8]) {
    let Some((&first, bytes)) = bytes.split_first() else {
        return;
    };
    let (neighbour, goals) = (NoNeighbour::new(&Toy), [Goal::new(At(0.3), None)]);
    let job: Goals<'_, _, _, _> = Goals::new(&Toy, &neighbour, &goals, WalkOptions::default());
    let options = RunOptions {
        tolerance: [None, Some(Tolerance::Relative(1e-3))][usize::from(first & 1)],
        ..OPTIONS[usize::from(first >> 1) % OPTIONS.len()]
    };
    let mut fresh = Driver::<_, 1>::new(&job, 0, options).expect("possible options");
    let done = if first & 0x80 == 0 { 0 } else { 25 };
    fresh.poll(&job, done).expect("walks of the toy are finite");

    // The bytes say what is changed in a good state, but for what says what it is of.
    let [sum, numbers] = HEAD;
    let mut mended = written(&fresh.save(&job));
    let (head, changeable) = mended.split_at_mut(numbers);
    let (length, rest) = head[6..sum].split_at_mut(2);
    // The options and the walks stand between.
    let changed = (length.iter_mut().chain(&mut rest[8..])).chain(changeable);
    for (to, change) in changed.zip(bytes) {
        *to ^= change;
    }
    let of_all = checksum(&[&mended[..sum], &mended[numbers..]]);
    mended[sum..numbers].copy_from_slice(&of_all);
    state(&mended);
    let Ok(saved) = State::read(&mended) else {
        return;
    };
    let mut driver =
        match Bound::NOTHING.holds(0, || Driver::<_, 1>::restore(&job, 0, options, &saved)) {
            Ok(driver) => driver,
            Err(error) => {
                assert_eq!(error, StateError::Contradiction, "the options are the same");
                return;
            }
        };
    assert_eq!(written(&driver.save(&job)), mended, "saved as restored");
    let before = driver.statistics()[0].walks();
    assert!(
        before <= options.walks,
        "{before} walks of {}",
        options.walks
    );
    if before <= 1000 && options.tolerance.is_none() {
        // The walks that are done are the first ones, in the same batches.
        let mut same = Driver::<_, 1>::new(&job, 0, options).expect("possible options");
        same.poll(&job, before)
            .expect("walks of the toy are finite");
        let batch = numbers + Statistics::BYTES;
        let walks = |bytes: &[u8]| [&bytes[numbers..][..8], &bytes[batch..][..8]].concat();
        assert_eq!(walks(&written(&same.save(&job))), walks(&mended));
    }
    let progress = driver.poll(&job, 3).expect("walks of the toy are finite");
    let after = driver.statistics()[0].walks();
    assert!((before..=before + 3).contains(&after) && progress.walks == after);
    assert_eq!(driver.stop(), progress.stop);
}

/// Few walks, and as many as there can be.
const OPTIONS: [RunOptions; 3] = [
    RunOptions {
        walks: 1000,
        batch: 10,
        tolerance: None,
    },
    RunOptions {
        walks: u64::MAX,
        batch: 4096,
        tolerance: None,
    },
    RunOptions {
        walks: u64::MAX,
        batch: u64::MAX,
        tolerance: None,
    },
];
