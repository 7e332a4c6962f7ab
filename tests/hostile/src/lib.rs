//! What must hold of everything that is read, whatever is fed to it.
//!
//! One function for each kind of input. It reads the bytes as the program or a device would and panics
//! unless they are read or refused as promised: no panic, no more memory than so many bytes for each of
//! the input, a message that names the place, and what is accepted is what was written. The fuzz targets
//! (`fuzz/`) call these functions, and so do the tests here, which need no fuzzer.

mod bytes;
mod container;
mod memory;
mod part;
mod system;
mod text;

pub use bytes::{state, state_with_checksum, table, table_with_checksum};
pub use memory::Bound;
pub use part::{good_part, part, part_with_checksum};
pub use system::{good_systems, models, system, system_of_numbers, system_with_checksum};
pub use text::{deck, formula, problem_file, scene};
