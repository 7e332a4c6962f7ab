//! What a user is told of a scene: which parts of walls are covered.

use fredholm_room::{Covered, Scene};

use super::Surfaces;
use super::leaks::point;

/// The most parts that are told one by one.
const MOST: usize = 5;

impl Surfaces {
    /// A line for every part of a wall that an obstacle covers, or for some and the number of the others.
    #[must_use]
    pub fn notes(&self, scene: &Scene) -> Vec<String> {
        let mut parts: Vec<Covered> = Vec::new();
        for &part in scene.covered() {
            match parts.last_mut() {
                // A segment may be split for other reasons.
                Some(last)
                    if (last.place, last.by) == (part.place, part.by)
                        && last.ends[1] == part.ends[0] =>
                {
                    last.ends[1] = part.ends[1];
                }
                _ => parts.push(part),
            }
        }
        let name = |surface: usize| self.names.get(surface).map_or("?", String::as_str);
        let line = |part: &Covered| {
            format!(
                "the part of {:?} from {} to {} is covered by {:?} and left out",
                name(part.place.surface),
                point(part.ends[0]),
                point(part.ends[1]),
                name(part.by)
            )
        };
        let mut notes: Vec<String> = parts.iter().take(MOST).map(line).collect();
        if parts.len() > MOST {
            let more = parts.len() - MOST;
            notes.push(format!(
                "{more} more parts of walls are covered by others and left out"
            ));
        }
        if scene.lost() > 0.0 {
            notes.push(format!(
                "no connected walls reach from the lowest to the highest, so that rays may pass all copies of a period that are kept: at \
                 most {:.1e} of what leaves a point evenly",
                scene.lost()
            ));
        }
        notes
    }

    /// The error for a surface that is covered wholly.
    pub(super) fn without_walls(&self, surface: usize) -> String {
        let name = self.names.get(surface).map_or("?", String::as_str);
        format!(
            "surface {name:?} is covered wholly by others, so that nothing of it is in the room"
        )
    }
}
