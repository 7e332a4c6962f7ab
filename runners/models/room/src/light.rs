//! The last step to the light.

use std::sync::OnceLock;

use fredholm_core::galerkin::Partition as _;
use fredholm_core::{At, Real};
use fredholm_model::{Error, LastSteps, Region};
use fredholm_rayon::fill_rows;
use fredholm_room::{
    CellRays, DirectLight, RaySetup, RayTables, Room, RoomError, Scene, Seen, Shadows, Tables,
};

use super::starts::Start;
use super::system::RoomSystem;
use super::{RoomModel, of_degree};

/// The walls to which last steps lead, and what they give to other walls.
#[derive(Clone, Debug)]
pub(crate) struct Lights {
    walls: Vec<u32>,
    /// Whether they pay: otherwise they are all walls that emit.
    pay: bool,
    direct: OnceLock<DirectLight>,
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

    pub(crate) const fn last_steps(&self) -> LastSteps {
        LastSteps::Open { pay: self.pay }
    }
}

impl RoomModel {
    /// The walls to which the last step of walks leads, if it does.
    pub(crate) fn lights(&self, last_step: bool) -> &[u32] {
        if last_step { &self.lights.walls } else { &[] }
    }

    /// What the lights give to walls, computed at the first call.
    pub(crate) fn direct(&self) -> Result<&DirectLight, Error> {
        if let Some(direct) = self.lights.direct.get() {
            return Ok(direct);
        }
        let direct = DirectLight::new(&self.scene, &self.lights.walls)?;
        Ok(self.lights.direct.get_or_init(|| direct))
    }

    /// (F_s, Φ): what is known besides what walks estimate.
    pub(crate) fn known<F: Real>(
        &self,
        room: &Room<'_, F>,
        start: &Start<'_, '_, F>,
        region: &Region,
    ) -> Result<f64, Error> {
        if room.lights().is_empty() {
            return Ok(0.0);
        }
        let walls = || Ok::<_, Error>(self.walls(region)?.into_iter().flatten());
        Ok(match start {
            Start::Point(At(x)) => room.emission_of_light(x.wall()).to_f64(),
            Start::Mean(_) => self.direct()?.emission(walls()?),
            Start::Air(seen) => light_at(seen),
            Start::Light(light) => room.direct(&light.of.0).to_f64(),
            Start::LightMean(_) => self.direct()?.irradiance(walls()?),
        })
    }
}

/// (F_s, Φ) of a point between the walls.
pub(super) fn light_at<F: Real>(seen: &Seen<'_, '_, F>) -> f64 {
    let room = seen.room;
    if room.lights().is_empty() {
        return 0.0;
    }
    let wall = |cell| room.table().wall(cell).unwrap_or(usize::MAX);
    let of = |cell| room.emission_of_light(wall(cell));
    let emission: Vec<F> = (0..room.cells()).map(of).collect();
    seen.of(&emission)[0]
}

/// v of rays and their tables, in a room with lights: T_K F_s is known in every point, and v is the rest.
#[derive(Debug)]
pub(super) struct LitRays {
    pub(super) v: Vec<f64>,
    pub(super) tables: RayTables<f64>,
}

impl RoomSystem<'_> {
    /// v less the emission of lights: that of w = u − F_s.
    pub(super) fn less_emission(&self, lights: &[u32]) -> Vec<f64> {
        let mut v = self.solution.v.clone();
        let walls = self.cut.model.scene().geometry();
        let (cells, functions) = (self.cut.mesh.cells(), self.cut.cut.degree + 1);
        for (cell, own) in v.chunks_exact_mut(functions).enumerate() {
            let wall = cells.wall(cell);
            let light = wall.filter(|&wall| lights.contains(&(wall as u32)));
            let found = light.and_then(|wall| walls.walls().get(wall));
            if let (Some(first), Some(wall)) = (own.first_mut(), found) {
                *first -= wall.emission;
            }
        }
        v
    }

    /// v and the tables of rays where lights are, made at the first call.
    pub(super) fn lit_rays(&self) -> Result<&LitRays, Error> {
        if let Some(lit) = self.lit.get() {
            return Ok(lit);
        }
        let lights = self.cut.model.lights(true);
        let tables = Tables::<f64>::new(self.cut.model.scene(), &self.cut.mesh);
        let room = self.any_room(&tables, lights)?;
        let mut light = vec![0.0; self.solution.v.len()];
        of_degree!(self.cut.cut.degree, B => {
            let polynomials = room.with_functions::<B>();
            fill_rows(&mut light, B, |cell, row| {
                row.copy_from_slice(&polynomials.project_light(cell));
                Ok::<(), Error>(())
            })?;
        });
        let own = self.less_emission(lights).into_iter().zip(light);
        let v: Vec<f64> = own.map(|(v, light)| v - light).collect();
        let tables = self.ray_tables(&room, &v)?;
        Ok(self.lit.get_or_init(|| LitRays { v, tables }))
    }

    /// The room on its cells, with some q0, for what does not depend on it.
    pub(super) fn any_room<'a>(
        &'a self,
        tables: &'a Tables<f64>,
        lights: &'a [u32],
    ) -> Result<Room<'a, f64>, Error> {
        let room = Room::new(tables.geometry(), tables.cells(), self.views(), 0.5)?;
        Ok(room.with_lights(lights)?)
    }

    /// What cells see of v.
    pub(super) fn ray_tables(
        &self,
        room: &Room<'_, f64>,
        v: &[f64],
    ) -> Result<RayTables<f64>, Error> {
        let mut cells = vec![CellRays::default(); self.cut.mesh.len()];
        let shadows = Shadows::new(&self.cut.model.scene);
        of_degree!(self.cut.cut.degree, B => {
            let polynomials = room.with_functions::<B>();
            let setup = RaySetup::new(&polynomials, v)?.with_shadows(&shadows);
            fill_rows(&mut cells, 1, |cell, row| {
                row.fill(setup.cell(cell)?);
                Ok::<(), RoomError>(())
            })?;
        });
        Ok(RayTables::new(cells)?)
    }
}
