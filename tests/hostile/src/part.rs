//! Files of batches.

use std::path::Path;

use crc::{CRC_64_XZ, Crc, Table};
use fredholm_parts::{Content, Record};

use crate::memory::Bound;

static CRC: Crc<u64, Table<16>> = Crc::<u64, Table<16>>::new(&CRC_64_XZ);

/// The first bytes of a part.
const MAGIC: &[u8] = b"fredholm part 1\n";
/// Bytes of a frame before and behind its payload.
const HEAD: usize = 8;
const TAIL: usize = 8;

/// What reading takes: numbers of two letters become sixteen bytes each, in lists that grow to twice their size.
const MEMORY: Bound = Bound {
    each: 128,
    besides: 64 << 10,
};

/// Reads a part.
///
/// # Panics
/// If that takes more memory than it may, if it has more batches than fit, if a refusal does not name the file, or if what is
/// whole of it is not read as the same.
pub fn part(bytes: &[u8]) {
    let path = Path::new("part-1");
    let read = |bytes: &[u8]| Content::begun(path, bytes);
    let records = |content: &Content| -> Vec<Record> {
        content
            .runs
            .iter()
            .flat_map(|run| run.records.clone())
            .collect()
    };
    match MEMORY.holds(bytes.len(), || read(bytes)) {
        Err(error) => {
            let text = error.to_string();
            assert!(
                text.starts_with("part-1: ") && !text.contains(char::is_control),
                "{text:?}"
            );
        }
        Ok(None) => {}
        Ok(Some(content)) => {
            let found = records(&content);
            assert!(content.length <= bytes.len());
            assert!(found.len() <= bytes.len() / (HEAD + Record::BYTES + TAIL));
            let again = read(&bytes[..content.length]).expect("it was read before");
            let again = again.map(|content| records(&content));
            let bytes_of =
                |records: &[Record]| -> Vec<_> { records.iter().map(Record::to_bytes).collect() };
            assert_eq!(again.map(|again| bytes_of(&again)), Some(bytes_of(&found)));
        }
    }
}

/// As [`part`], with the checksum of every frame mended so that what is behind it is met.
///
/// # Panics
/// As [`part`].
pub fn part_with_checksums(bytes: &[u8]) {
    let mut mended = MAGIC.to_vec();
    let mut rest = bytes.get(MAGIC.len()..).unwrap_or_default();
    while let Some((head, behind)) = rest.split_at_checked(HEAD) {
        // A kind that there is, and a length that fits.
        let kind = u32::from(head[0]) % 6;
        let length = u32::from_le_bytes([head[4], head[5], head[6], head[7]]) as usize;
        let length = length.min(behind.len());
        let (payload, behind) = behind.split_at(length);
        push(kind, payload, &mut mended);
        rest = behind.get(TAIL..).unwrap_or_default();
    }
    part(&mended);
}

fn push(kind: u32, payload: &[u8], to: &mut Vec<u8>) {
    let start = to.len();
    to.extend(kind.to_le_bytes());
    to.extend((payload.len() as u32).to_le_bytes());
    to.extend(payload);
    let sum = CRC.checksum(&to[start..]);
    to.extend(sum.to_le_bytes());
}

/// A good part, of three batches.
#[must_use]
pub fn good_part() -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    let header = r#"{"program":"0.1.0","values":1,"generator":"g","problem":[["kind","cube"]],"name":"a.toml","text":"","options":""}"#;
    let job = r#"{"settings":{"cells":4,"degree":null,"pairs":"paper","score_degree":null,"points":null,"grading":null,"shadow_cuts":null,"exact_source":null,"walks":9,"absorption":null,"estimator":null,"form":null,"scalar":"f64","seed":1,"batch":4,"tolerance":{"absolute":0.1},"allow_infinite_variance":false},"plain":false,"cells":{"cells":4,"unknowns":4,"text":"4"},"choice":null,"set_up":{"goals":1,"galerkin":[0.5],"largest":1.5,"radius_bound":0.5,"sweeps":2,"residual":0.1,"pointwise":{"seen":0.0,"hidden":0.0},"neighbour_second_moment_radius":null,"pair_counts":null,"seconds":0.0}}"#;
    push(1, header.as_bytes(), &mut bytes);
    push(2, br#"{"part":1,"of":2,"after":0}"#, &mut bytes);
    push(3, job.as_bytes(), &mut bytes);
    for batch in 0..3_u8 {
        let mut record = [0; Record::BYTES];
        record[8] = batch;
        // Four walks, each of one state.
        record[24] = 4;
        record[32] = 4;
        push(4, &record, &mut bytes);
    }
    push(5, br#"{"set_up":0.1,"walks":0.2}"#, &mut bytes);
    bytes
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use fredholm_parts::Content;

    use super::{good_part, part, part_with_checksums};

    #[test]
    fn the_good_part_is_good() {
        let bytes = good_part();
        let content = Content::read(Path::new("a"), &bytes).unwrap();
        assert_eq!(
            (content.runs[0].records.len(), content.length),
            (3, bytes.len())
        );
        part(&bytes);
        part_with_checksums(&bytes);
    }
}
