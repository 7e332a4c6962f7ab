//! Light in several channels: colours.

use fredholm_core::channels::{Channels, MOST_CHANNELS};
use fredholm_core::galerkin::Partition;
use fredholm_core::{Kernel, Real, Sampler, StateSpace, Uniforms};
use num_traits::zero;

use crate::{Point, Room, RoomError};

/// Reflectances and emissions of all walls in several channels: one number after the other for every wall, and there for every
/// channel.
///
/// ```
/// use fredholm_room::WallColours;
///
/// // Two walls in three channels.
/// let reflectances = [0.7, 0.3, 0.1, 0.2, 0.2, 0.2];
/// let emissions = [0.0, 0.0, 0.0, 1.0, 2.0, 4.0];
/// let colours = WallColours::new(3, (&reflectances, &emissions))?;
/// assert_eq!((colours.walls(), colours.emissions(1)), (2, &[1.0, 2.0, 4.0][..]));
/// # Ok::<(), fredholm_room::RoomError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct WallColours<'a, F> {
    channels: usize,
    reflectances: &'a [F],
    emissions: &'a [F],
}

impl<'a, F: Real> WallColours<'a, F> {
    /// The reflectances, from 0 to 1, and the emissions of all walls in so many channels.
    ///
    /// # Errors
    /// [`RoomError::Channels`], [`RoomError::Length`]: not the same number of walls in both, in every channel.
    pub fn new(
        channels: usize,
        (reflectances, emissions): (&'a [F], &'a [F]),
    ) -> Result<Self, RoomError> {
        if !(1..=MOST_CHANNELS).contains(&channels) {
            return Err(RoomError::Channels { channels });
        }
        let expected = reflectances.len() / channels * channels;
        for found in [reflectances.len(), emissions.len()] {
            if found != expected {
                return Err(RoomError::Length { expected, found });
            }
        }
        Ok(Self {
            channels,
            reflectances,
            emissions,
        })
    }

    /// The number of channels.
    #[must_use]
    pub const fn channels(&self) -> usize {
        self.channels
    }

    /// The number of walls.
    #[must_use]
    pub const fn walls(&self) -> usize {
        self.reflectances.len() / self.channels
    }

    /// ρ_c of a wall in every channel; none if there is no such wall.
    #[inline]
    #[must_use]
    pub fn reflectances(&self, wall: usize) -> &'a [F] {
        self.of_wall(self.reflectances, wall)
    }

    /// F_c of a wall in every channel; none if there is no such wall.
    #[inline]
    #[must_use]
    pub fn emissions(&self, wall: usize) -> &'a [F] {
        self.of_wall(self.emissions, wall)
    }

    #[inline]
    fn of_wall(&self, all: &'a [F], wall: usize) -> &'a [F] {
        let first = wall.saturating_mul(self.channels);
        all.get(first..first.saturating_add(self.channels))
            .unwrap_or(&[])
    }
}

/// The equations of light in several channels in a room, u_c = F_c + ρ_c H u_c, where H, what light of u arrives at a wall, is the
/// same for all.
///
/// The chain is that of the [`Room`] behind them, whose own reflectances and emissions play no role: one walk of it serves all
/// channels. In a room [with lights](Room::with_lights) they are the equations of w_c = u_c − F_s,c: what a point sees of a light
/// is computed once for all channels.
///
/// ```
/// use fredholm_core::channels::Channels;
/// use fredholm_room::{
///     ColouredRoom, Enclosure, Grading, Material, Mesh, Room, Scene, Surface, Tables, VisibilityTable,
///     WallColours,
/// };
///
/// let grey = [Material { reflectance: 0.5, emission: 0.0 }];
/// let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
/// let scene = Scene::new::<f64>(&[Surface { points: &points, materials: &grey }], Enclosure::Closed)?;
/// let mesh = Mesh::new::<f64>(&scene, 4, Grading::default())?;
/// let tables = Tables::<f64>::new(&scene, &mesh);
/// let room = Room::new(tables.geometry(), tables.cells(), VisibilityTable::none(), 0.5)?;
/// // Four walls that reflect half of the red and a tenth of the green.
/// let (reflectances, emissions) = ([0.5, 0.1].repeat(4), [0.0; 8]);
/// let coloured = ColouredRoom::new(&room, WallColours::new(2, (&reflectances, &emissions))?)?;
/// let mut own = [0.0; 2];
/// coloured.factors(&room.point(0, 0.5)?, &mut own);
/// assert_eq!(own, [0.5, 0.1]);
/// # Ok::<(), fredholm_room::RoomError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ColouredRoom<'r, 'a, F> {
    room: &'r Room<'a, F>,
    colours: WallColours<'r, F>,
}

impl<'r, 'a, F: Real> ColouredRoom<'r, 'a, F> {
    /// The equations of all channels of these walls.
    ///
    /// # Errors
    /// [`RoomError::Length`]: the room has another number of walls.
    pub fn new(room: &'r Room<'a, F>, colours: WallColours<'r, F>) -> Result<Self, RoomError> {
        let (expected, found) = (room.geometry().walls().len(), colours.walls());
        if expected != found {
            return Err(RoomError::Length { expected, found });
        }
        Ok(Self { room, colours })
    }

    /// The room behind the equations.
    #[must_use]
    pub const fn room(&self) -> &'r Room<'a, F> {
        self.room
    }

    /// The colours of the walls.
    #[must_use]
    pub const fn colours(&self) -> &WallColours<'r, F> {
        &self.colours
    }

    /// F_s,c of a wall: its emissions if it is a light, and 0 otherwise.
    pub fn emission_of_light(&self, wall: usize, to: &mut [F]) {
        to.fill(zero());
        if u32::try_from(wall).is_ok_and(|wall| self.room.is_light(wall)) {
            copy(self.colours.emissions(wall), to);
        }
    }

    /// The irradiance that lights make at a point directly, in every channel.
    pub fn direct(&self, x: &Point<F>, to: &mut [F]) {
        to.fill(zero());
        self.add_direct(x, to);
    }

    /// Adds the irradiance that lights make at a point directly.
    #[inline]
    pub(crate) fn add_direct(&self, x: &Point<F>, to: &mut [F]) {
        if self.room.lights().is_empty() {
            return;
        }
        self.room.seen_lights(x, |light, _, factor| {
            for (to, &emission) in to.iter_mut().zip(self.colours.emissions(light)) {
                *to += emission * factor;
            }
        });
    }

    /// T_Kc F_s,c at a point: what a wall reflects of the lights, in every channel.
    #[inline]
    pub fn reflected_light(&self, x: &Point<F>, to: &mut [F]) {
        self.direct(x, to);
        self.reflect(x, to);
    }

    /// Multiplies irradiances of a point by the reflectances of its wall.
    #[inline]
    pub(crate) fn reflect(&self, x: &Point<F>, to: &mut [F]) {
        for (to, &reflectance) in to.iter_mut().zip(self.colours.reflectances(x.wall())) {
            *to *= reflectance;
        }
    }
}

/// Copies as many numbers as there are places for them.
#[inline]
fn copy<F: Copy>(from: &[F], to: &mut [F]) {
    to.iter_mut().zip(from).for_each(|(to, &from)| *to = from);
}

impl<F: Real> StateSpace for ColouredRoom<'_, '_, F> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real> Sampler for ColouredRoom<'_, '_, F> {
    #[inline]
    fn absorption(&self, x: &Point<F>) -> F {
        self.room.absorption(x)
    }

    #[inline]
    fn step<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> Option<Point<F>> {
        self.room.step(x, uniforms)
    }
}

impl<F: Real> Kernel for ColouredRoom<'_, '_, F> {
    /// The kernel of a wall that reflects everything, 1/(1 − q0).
    #[inline]
    fn kernel(&self, _: &Point<F>, _: &Point<F>) -> F {
        self.room.per_survival()
    }
}

impl<F: Real> Partition for ColouredRoom<'_, '_, F> {
    fn cells(&self) -> usize {
        self.room.cells()
    }

    #[inline]
    fn locate(&self, x: &Point<F>) -> usize {
        self.room.locate(x)
    }
}

impl<F: Real> Channels for ColouredRoom<'_, '_, F> {
    fn channels(&self) -> usize {
        self.colours.channels
    }

    /// ρ_c.
    #[inline]
    fn factors(&self, x: &Point<F>, factors: &mut [F]) {
        copy(self.colours.reflectances(x.wall()), factors);
    }

    /// F_c, or T_Kc F_s,c + F_c − F_s,c in a room with lights: nothing is drawn.
    #[inline]
    fn sample_sources<U: Uniforms<F>>(&self, x: &Point<F>, _: &mut U, sources: &mut [F]) {
        let own = self.colours.emissions(x.wall());
        if self.room.lights().is_empty() {
            copy(own, sources);
            return;
        }
        self.reflected_light(x, sources);
        if !self.room.is_light(x.wall() as u32) {
            for (source, &emission) in sources.iter_mut().zip(own) {
                *source += emission;
            }
        }
    }
}
