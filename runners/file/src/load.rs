//! Bytes of a file, and their text.

use core::cell::RefCell;
use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::place::{InputError, Source};

/// The most bytes of a problem file: what it comes to in memory is a multiple of them.
pub const MAX_BYTES: u64 = 16 << 20;

thread_local! {
    /// What this thread reads in the place of the disk.
    static FILES: RefCell<Option<HashMap<PathBuf, Vec<u8>>>> = const { RefCell::new(None) };
}

/// Lets this thread read from files in memory, by their paths, and from no others: a web page has no disk.
pub fn read_from_memory(files: HashMap<PathBuf, Vec<u8>>) {
    FILES.set(Some(files));
}

/// The bytes of the file at a path, if they are not more than `most`. What never ends, such as a device,
/// is not read to its end.
pub fn load(path: &Path, most: u64) -> Result<Vec<u8>, InputError> {
    let name = path.display();
    let in_memory = FILES.with_borrow(|files| match files.as_ref()?.get(path) {
        Some(bytes) => Some(load_from(&name.to_string(), &bytes[..], most)),
        None => Some(Err(InputError::new(format_args!(
            "there is no file {name}"
        )))),
    });
    if let Some(loaded) = in_memory {
        return loaded;
    }
    let file = File::open(path)
        .map_err(|error| InputError::new(format_args!("cannot read {name}: {error}")))?;
    load_from(&name.to_string(), file, most)
}

/// The bytes of what is read under this name, if they are not more than `most`.
pub fn load_from(name: &str, from: impl Read, most: u64) -> Result<Vec<u8>, InputError> {
    let mut bytes = Vec::new();
    from.take(most + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| InputError::new(format_args!("cannot read {name}: {error}")))?;
    if bytes.len() as u64 > most {
        let message = format!("{name} has more than {most} bytes, the most that are read");
        return Err(InputError::new(message));
    }
    Ok(bytes)
}

/// The text of the problem file `name`.
pub fn utf8(name: &str, bytes: Vec<u8>) -> Result<String, InputError> {
    String::from_utf8(bytes).map_err(|error| {
        let place = error.utf8_error().valid_up_to();
        let source = Source {
            name: name.to_owned(),
            text: String::from_utf8_lossy(error.as_bytes()).into_owned(),
        };
        let message = "this is not UTF-8 text, as a problem file must be";
        source.error(place..place, message)
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::{load, read_from_memory, utf8};

    #[test]
    fn files_in_memory_stand_in_for_the_disk() {
        let files = [("a/b.csv".into(), b"0.5".to_vec())];
        let here = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"));
        let in_memory = std::thread::spawn(move || {
            read_from_memory(files.into());
            [Path::new("a/b.csv"), here].map(|path| load(path, 3).map_err(|e| e.to_string()))
        });
        let [own, disk] = in_memory.join().unwrap();
        assert_eq!(own.unwrap(), b"0.5");
        assert!(disk.unwrap_err().starts_with("there is no file "));
        assert!(load(here, crate::MAX_BYTES).is_ok());
    }

    #[test]
    fn a_file_without_an_end_is_refused() {
        let zeros = Path::new("/dev/zero");
        if zeros.exists() {
            let refused = load(zeros, 1000).unwrap_err().to_string();
            assert_eq!(
                refused,
                "/dev/zero has more than 1000 bytes, the most that are read"
            );
        }
        let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("templates/room.toml");
        let size = std::fs::metadata(&here).unwrap().len();
        assert_eq!(load(&here, size).unwrap().len() as u64, size);
        assert!(load(&here, size - 1).is_err());
    }

    #[test]
    fn what_is_no_text_is_refused_at_its_byte() {
        let refused = utf8("a.toml", b"[walk]\nseed = \xff".to_vec()).unwrap_err();
        assert!(refused.to_string().starts_with("a.toml:2:8: "), "{refused}");
    }
}
