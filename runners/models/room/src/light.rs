//! The last step to the light.

use std::sync::OnceLock;

use fredholm_core::MOST_CHANNELS;
use fredholm_model::Error;
use fredholm_room::{DirectLight, Grey, Scene};

use crate::RoomModel;

/// The walls to which last steps lead, and what they give to other walls in every channel.
#[derive(Clone, Debug)]
pub(crate) struct Lights {
    walls: Vec<u32>,
    /// Whether they pay: otherwise they are all walls that emit.
    pub(crate) pay: bool,
    direct: OnceLock<Vec<DirectLight>>,
}

impl Lights {
    pub(crate) fn new(scene: &Scene) -> Self {
        let best = scene.best_lights();
        let walls = (0..).zip(scene.geometry().walls());
        let emitting = walls.filter(|(_, wall)| wall.emission != 0.0);
        Self {
            pay: !best.is_empty(),
            walls: if best.is_empty() {
                emitting.map(|(wall, _)| wall).collect()
            } else {
                best
            },
            direct: OnceLock::new(),
        }
    }
}

impl RoomModel {
    /// The walls to which the last step of walks leads, if it does.
    pub(crate) fn lights(&self, last_step: bool) -> &[u32] {
        if last_step { &self.lights.walls } else { &[] }
    }

    /// What the lights give to walls in every channel, computed at the first call.
    pub(crate) fn direct(&self) -> Result<&[DirectLight], Error> {
        if let Some(direct) = self.lights.direct.get() {
            return Ok(direct);
        }
        let direct = match self.wall_colours() {
            None => DirectLight::new(&self.scene, &self.lights.walls, &Grey)?,
            Some(colours) => {
                let tint = colours.tint::<MOST_CHANNELS>();
                DirectLight::new(&self.scene, &self.lights.walls, &tint)?
            }
        };
        Ok(self.lights.direct.get_or_init(|| direct))
    }
}
