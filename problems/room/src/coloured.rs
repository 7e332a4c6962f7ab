//! Light in several channels: colours.

use fredholm_core::galerkin::{Basis, Cells};
use fredholm_core::global::Stationary;
use fredholm_core::{
    Chain, Channels, Density, Equation, Located, MOST_CHANNELS, Real, Space, Uniforms, Value,
};

#[cfg(feature = "alloc")]
use crate::{Material, Scene, Wall};
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

#[cfg(feature = "alloc")]
impl WallColours<'_, f64> {
    /// The material of a wall in a channel.
    pub(crate) fn material(&self, wall: usize, channel: usize) -> Material {
        let of = |own: &[f64]| own.get(channel).copied().unwrap_or(f64::NAN);
        Material {
            reflectance: of(self.reflectances(wall)),
            emission: of(self.emissions(wall)),
        }
    }
}

#[cfg(feature = "alloc")]
impl Scene {
    /// The material of a wall.
    pub(crate) fn material(&self, wall: usize) -> Material {
        let of = |own: fn(&Wall<f64>) -> f64| self.walls.get(wall).map_or(f64::NAN, own);
        Material {
            reflectance: of(|wall| wall.reflectance),
            emission: of(|wall| wall.emission),
        }
    }
}

/// The equations of light in several channels in a room, u_c = F_c + ρ_c H u_c, where H, what light of u arrives at a wall, is the
/// same for all. M is the most channels that a value holds.
///
/// Chain and cells are those of the [`Room`] behind them, whose own reflectances and emissions play no role: one walk of it serves
/// all channels. What a point sees of a light is computed once for all channels.
///
/// ```
/// use fredholm_core::Equation;
/// use fredholm_room::{
///     ColouredRoom, Enclosure, Grading, Material, Mesh, Scene, Surface, Tables, VisibilityTable,
///     WallColours,
/// };
///
/// let grey = [Material { reflectance: 0.5, emission: 0.0 }];
/// let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
/// let scene = Scene::new::<f64>(&[Surface { points: &points, materials: &grey }], Enclosure::Closed)?;
/// let mesh = Mesh::new::<f64>(&scene, 4, Grading::default())?;
/// let tables = Tables::<f64>::new(&scene, &mesh);
/// let room = tables.room(VisibilityTable::none());
/// // Four walls that reflect half of the red and a tenth of the green.
/// let (reflectances, emissions) = ([0.5, 0.1].repeat(4), [0.0; 8]);
/// let colours = WallColours::new(2, (&reflectances, &emissions))?;
/// let coloured = ColouredRoom::<_, 2>::new(&room, colours)?;
/// let x = room.on_wall(0, 0.5)?;
/// assert_eq!(coloured.kernel(&x, &x).as_slice(), [0.5, 0.1]);
/// # Ok::<(), fredholm_room::RoomError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ColouredRoom<'r, 'a, F, const M: usize> {
    room: &'r Room<'a, F>,
    colours: WallColours<'r, F>,
}

impl<'r, 'a, F: Real, const M: usize> ColouredRoom<'r, 'a, F, M> {
    /// The equations of all channels of these walls.
    ///
    /// # Errors
    /// [`RoomError::Length`]: the room has another number of walls; [`RoomError::Channels`]: there are more than M.
    pub fn new(room: &'r Room<'a, F>, colours: WallColours<'r, F>) -> Result<Self, RoomError> {
        let (expected, found) = (room.geometry().walls().len(), colours.walls());
        if expected != found {
            return Err(RoomError::Length { expected, found });
        }
        let channels = colours.channels();
        if channels > M {
            return Err(RoomError::Channels { channels });
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

    /// The numbers of a wall as a value.
    #[inline]
    pub(crate) fn value(&self, own: &[F]) -> Channels<F, M> {
        Channels::from_fn(self.colours.channels, |channel| {
            own.get(channel).copied().unwrap_or(F::NAN)
        })
    }
}

impl<F: Real, const M: usize> Space for ColouredRoom<'_, '_, F, M> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real, const M: usize> Chain for ColouredRoom<'_, '_, F, M> {
    #[inline]
    fn step<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> Option<Point<F>> {
        self.room.step(x, uniforms)
    }
}

impl<F: Real, const M: usize> Density for ColouredRoom<'_, '_, F, M> {
    fn density(&self, x: &Point<F>, y: &Point<F>) -> F {
        self.room.density(x, y)
    }
}

impl<F: Real, const M: usize> Equation for ColouredRoom<'_, '_, F, M> {
    type Value = Channels<F, M>;

    #[inline]
    fn kernel(&self, x: &Point<F>, _: &Point<F>) -> Channels<F, M> {
        self.value(self.colours.reflectances(x.wall()))
    }

    #[inline]
    fn source<U: Uniforms<F>>(&self, x: &Point<F>, _: &mut U) -> Channels<F, M> {
        self.value(self.colours.emissions(x.wall()))
    }

    fn channels(&self) -> usize {
        self.colours.channels
    }

    /// The largest ρ_c.
    #[inline]
    fn size(&self, x: &Point<F>) -> F {
        self.kernel(x, x).largest()
    }
}

impl<F: Real, const M: usize> Cells for ColouredRoom<'_, '_, F, M> {
    const DIMENSION: usize = 1;

    fn cells(&self) -> usize {
        self.room.cells()
    }
    #[inline]
    fn locate(&self, x: &Point<F>) -> usize {
        self.room.locate(x)
    }
    fn measure(&self, cell: usize) -> f64 {
        self.room.measure(cell)
    }
    fn point(&self, cell: usize, t: &[f64]) -> Point<F> {
        self.room.point(cell, t)
    }
    #[inline]
    fn parameters(&self, x: &Located<Point<F>>, t: &mut [F]) {
        self.room.parameters(x, t);
    }
    fn at(&self, coordinates: &[f64]) -> Option<Point<F>> {
        self.room.at(coordinates)
    }
}

impl<F: Real, const M: usize, const B: usize> Basis<B> for ColouredRoom<'_, '_, F, M> {}

/// The starts of the room.
impl<F, E, const M: usize> Stationary<E> for ColouredRoom<'_, '_, F, M>
where
    F: Real,
    E: Space<Scalar = F, Point = Point<F>> + ?Sized,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> Point<F> {
        Stationary::<E>::start(self.room, uniforms)
    }
    #[inline]
    fn start_density(&self, x: &Point<F>) -> f64 {
        Stationary::<E>::start_density(self.room, x)
    }
    fn is_preserved(&self) -> bool {
        Stationary::<E>::is_preserved(self.room)
    }
}
