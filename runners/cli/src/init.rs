//! `fredholm init`.

use std::io::Write;

use crate::args::Kind;
use crate::failure::{Ended, Failure};

/// The commented file of a circle.
pub(crate) const CIRCLE: &str = include_str!("../templates/circle.toml");

/// The commented file of a cube.
pub(crate) const CUBE: &str = include_str!("../templates/cube.toml");

/// The commented file of a room.
pub(crate) const ROOM: &str = include_str!("../templates/room.toml");

/// Prints the file of a kind of problem.
pub(crate) fn init(kind: Kind) -> Result<Ended, Failure> {
    let template = match kind {
        Kind::Circle => CIRCLE,
        Kind::Cube => CUBE,
        Kind::Room => ROOM,
    };
    std::io::stdout().lock().write_all(template.as_bytes())?;
    Ok(Ended::Done)
}
