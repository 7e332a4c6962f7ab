//! Ten million inputs, as many for each reader: good ones that are spoilt, by a loop without a fuzzer.

use fredholm_hostile::{
    deck, formula, good_part, good_systems, part, part_with_checksum, problem_file, scene, state,
    state_with_checksum, system, system_of_numbers, system_with_checksum, table,
    table_with_checksum,
};

mod seeds;
use seeds::{DECKS, FILES, PIECES, SCENES, TABLES};

type Reader = fn(&[u8]);

/// Random numbers (SplitMix64: Steele, Lea and Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
}

/// A good input with up to four changes behind its first `kept` bytes.
fn spoilt(good: &[u8], kept: usize, random: &mut Random) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..random.below(4) + 1 {
        let from = kept + random.below(bytes.len() + 1 - kept);
        let to = bytes.len().min(from + random.below(12));
        let piece = PIECES[random.below(PIECES.len())].bytes();
        match random.below(7) {
            0 => bytes.truncate(from),
            1 => drop(bytes.drain(from..to)),
            2 => {
                let part = bytes[from..to].to_vec();
                drop(bytes.splice(to..to, part));
            }
            3 => drop(bytes.splice(from..to, piece)),
            4 => drop(bytes.splice(from..from, piece)),
            5 => {
                // What stands elsewhere, here.
                let other = kept + random.below(bytes.len() + 1 - kept);
                let end = bytes.len().min(other + random.below(12));
                let part = bytes[other..end].to_vec();
                drop(bytes.splice(from..to, part));
            }
            _ => {
                let change = random.next() as u8;
                bytes
                    .iter_mut()
                    .skip(from)
                    .take(1)
                    .for_each(|b| *b ^= change);
            }
        }
    }
    bytes
}

/// 10⁷ inputs with FREDHOLM_LONG in the environment, or as many as it says if more than 1; else 6,000.
fn inputs() -> usize {
    match std::env::var("FREDHOLM_LONG") {
        Ok(text) => text.parse().ok().filter(|&n| n > 1).unwrap_or(10_000_000),
        Err(_) => 6000,
    }
}

#[test]
fn millions_of_inputs_are_read_or_refused() {
    let formulas: [&[u8]; 3] = [
        b"\x01x < y ? sin(x1 * y2) : max(0.5, 1e-3 * exp(-x))",
        b"\x82(1 + x1^2) / (x2 - 0.3) % 2 * pi",
        b"\0-x + atan2(y, 1) * !x == 0 && y > 1 || min(x, y)",
    ];
    // Of each input, what is kept: the byte of a format or of variables.
    let mut readers: Vec<(&[u8], usize, Reader)> = Vec::new();
    // Meshes and descriptions are what is read most.
    for _ in 0..2 {
        readers.extend(SCENES.iter().map(|s| (*s, 1, scene as Reader)));
    }
    readers.extend(FILES.iter().map(|f| (*f, 0, problem_file as Reader)));
    readers.extend(DECKS.iter().map(|d| (*d, 0, deck as Reader)));
    readers.extend(formulas.map(|f| (f, 1, formula as Reader)));
    for table_of in TABLES {
        readers.push((table_of, 0, table));
        readers.push((table_of, 0, table_with_checksum));
    }
    // No change of a saved state.
    readers.push((&[0; 199], 0, state_with_checksum));
    let pieces = PIECES.concat();
    readers.push((pieces.as_bytes(), 1, anything));
    feed(&readers, 26);
}

/// Reads bytes as whatever there is.
fn anything(bytes: &[u8]) {
    for read in [
        formula,
        scene,
        problem_file,
        deck,
        table,
        table_with_checksum,
        state,
    ] {
        read(bytes);
    }
}

/// Parts of runs, which are longer.
#[test]
fn millions_of_parts_are_read_or_refused() {
    let good = good_part();
    // The first bytes of the second are mended, too.
    let readers: [(&[u8], usize, Reader); 2] = [(&good, 0, part), (&good, 24, part_with_checksum)];
    feed(&readers, 29);
}

/// Solved systems of every kind.
#[test]
fn millions_of_systems_are_read_or_refused() {
    let good = good_systems();
    let mut readers: Vec<(&[u8], usize, Reader)> = Vec::new();
    for good in &good {
        readers.push((good, 0, system));
        // Most bytes of the others are behind a checksum that is mended.
        readers.push((good, 24, system_with_checksum));
    }
    // No change of any number, behind the byte of a kind.
    let kinds = [0, 1, 2, 3, 4].map(|kind| [&[kind][..], &[0; 80]].concat());
    readers.extend(
        kinds
            .iter()
            .map(|kind| (&kind[..], 1, system_of_numbers as Reader)),
    );
    feed(&readers, 30);
}

/// Feeds spoilt inputs to each of the readers in turn.
fn feed(readers: &[(&[u8], usize, Reader)], seed: u64) {
    let mut random = Random(seed);
    let total = inputs();
    for k in 0..total {
        let (good, kept, read) = readers[k % readers.len()];
        let bytes = spoilt(good, kept, &mut random);
        // What the panic of a test shows to whoever looks for its cause.
        let shown = Shown(&bytes);
        read(&bytes);
        core::mem::forget(shown);
    }
    println!("{total} inputs, {} readers and kinds", readers.len());
}

/// Prints the input if its reader panics.
struct Shown<'a>(&'a [u8]);

impl Drop for Shown<'_> {
    fn drop(&mut self) {
        println!("the input: {}", self.0.escape_ascii());
    }
}
