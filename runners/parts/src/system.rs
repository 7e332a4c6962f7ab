//! Solved systems in files: one set-up for all parts of a run, and for all processes of a node.

mod content;
mod store;

pub use content::SystemContent;
pub use store::SystemFile;
