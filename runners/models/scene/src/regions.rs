//! What may be asked of a scene.

use fredholm_core::{At, Functional, KnownPart, Real, Started, StateSpace, Uniforms, WithKnown};
use fredholm_model::{Error, Region};
use fredholm_scene::{Air, Facing, Irradiance, Mean, Point, Radiosity, Scene, areas};

/// A point of a face, a point between the faces, what faces in a direction there, or the faces over which a mean is.
#[derive(Clone, Debug)]
pub(crate) enum Place {
    Point(u32, [f64; 3]),
    Air([f64; 3]),
    /// The place and the direction.
    Facing([f64; 3], [f64; 3]),
    Faces(Vec<u32>),
}

impl Place {
    /// The place of a region, if the scene has it.
    pub(crate) fn new(scene: &Scene, region: &Region) -> Result<Self, Error> {
        let wrong = |message: String| Err(Error::Region { message });
        let faces = |part: usize| {
            scene.faces_of(part).map_err(|_| Error::Region {
                message: format!("there is no surface {part}"),
            })
        };
        match region {
            Region::Whole => Ok(Self::Faces((0..scene.faces().len() as u32).collect())),
            Region::Part(part) => Ok(Self::Faces(faces(*part)?.map(|face| face as u32).collect())),
            Region::Parts(parts) if !parts.is_empty() => {
                let mut all = Vec::new();
                for &part in parts {
                    all.extend(faces(part)?.map(|face| face as u32));
                }
                Ok(Self::Faces(all))
            }
            Region::Spot(part, position) => {
                let geometry = scene.geometry();
                let mut own = faces(*part)?.map(|face| face as u32);
                match own.find(|&face| geometry.is_on(face, *position)) {
                    Some(face) => Ok(Self::Point(face, *position)),
                    None => wrong(format!("the point {position:?} is not on its surface")),
                }
            }
            Region::Point(coordinates) => match *coordinates.as_slice() {
                [x, y, z] => match scene.face_at([x, y, z]) {
                    Some(face) => Ok(Self::Point(face, [x, y, z])),
                    None if scene.is_between([x, y, z]) => Ok(Self::Air([x, y, z])),
                    None => wrong(format!(
                        "the point {:?} is neither on a surface nor between them",
                        [x, y, z]
                    )),
                },
                _ => wrong("a point of a scene has three coordinates".to_owned()),
            },
            Region::Facing { at, direction } => {
                if !direction.iter().all(|c| c.is_finite()) || direction.iter().all(|c| *c == 0.0) {
                    return wrong(format!(
                        "{direction:?} is no direction: its coordinates must be finite, and one of them not 0"
                    ));
                }
                if !scene.is_between(*at) {
                    return wrong(format!("the point {at:?} is not between the surfaces"));
                }
                Ok(Self::Facing(*at, *direction))
            }
            _ => wrong(
                "a scene has points on its surfaces and between them, means over surfaces, and the mean over all"
                    .to_owned(),
            ),
        }
    }

    /// (F, Φ) of the emission that is known where a walk starts: that of lights, to which the last step leads.
    pub(crate) fn known<F: Real>(&self, radiosity: &Radiosity<'_, F>) -> f64 {
        match self {
            Self::Point(face, _) => radiosity.emission_of_light(*face).to_f64(),
            // Every walk knows its own.
            Self::Air(_) | Self::Facing(..) => 0.0,
            Self::Faces(numbers) => {
                let (mut sum, mut areas) = (0.0, 0.0);
                for &number in numbers {
                    let face = radiosity.geometry().faces().get(number as usize);
                    let area = face.map_or(f64::NAN, |face| face.area.to_f64());
                    sum += area * radiosity.emission_of_light(number).to_f64();
                    areas += area;
                }
                sum / areas
            }
        }
    }

    /// Where a mean over faces looks for starts.
    pub(crate) fn areas<F: Real>(&self, radiosity: &Radiosity<'_, F>) -> Result<Vec<F>, Error> {
        Ok(match self {
            Self::Faces(faces) => areas(radiosity.geometry(), faces)?,
            _ => Vec::new(),
        })
    }

    /// Where walks start, with the [`areas`](Self::areas) of the place.
    pub(crate) fn start<'a, F: Real>(
        &'a self,
        radiosity: &'a Radiosity<'a, F>,
        ends: &'a [F],
    ) -> Result<Start<'a, F>, Error> {
        Ok(match self {
            Self::Air(position) => Start::Air(Air {
                radiosity,
                position: position.map(F::from_f64),
            }),
            Self::Facing(position, direction) => {
                Start::Facing(Facing::new(radiosity, *position, *direction)?)
            }
            _ => Start::On(KnownPart {
                functional: self.on(radiosity, ends)?,
                known: F::from_f64(self.known(radiosity)),
            }),
        })
    }

    /// Where walks start on faces, with the [`areas`](Self::areas) of the place.
    pub(crate) fn on<'a, F: Real>(
        &'a self,
        radiosity: &Radiosity<'a, F>,
        ends: &'a [F],
    ) -> Result<On<'a, F>, Error> {
        match self {
            Self::Point(face, position) => Ok(On::Point(At(radiosity.at(*face, *position)?))),
            Self::Faces(faces) => Ok(On::Mean(Mean::new(radiosity.geometry(), faces, ends)?)),
            Self::Air(_) | Self::Facing(..) => {
                Err(Error::Internal("a place between the faces is on none"))
            }
        }
    }
}

/// Where walks for u start on faces.
#[derive(Clone, Copy)]
pub(crate) enum On<'a, F> {
    Point(At<Point<F>>),
    Mean(Mean<'a, F>),
}

impl<F: Real, E> Functional<E> for On<'_, F>
where
    E: StateSpace<Scalar = F, Point = Point<F>>,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Point<F>, F) {
        match self {
            Self::Point(At(x)) => (*x, F::from_f64(1.0)),
            Self::Mean(mean) => mean.draw(uniforms),
        }
    }
}

/// Where walks start: for u, for what arrives at faces, and for what a point between them sees.
#[derive(Clone, Copy)]
pub(crate) enum Start<'a, F> {
    On(KnownPart<On<'a, F>, F>),
    Irradiance(Irradiance<'a, F, On<'a, F>>),
    Air(Air<'a, F>),
    Facing(Facing<'a, F>),
}

impl<'a, F: Real> Start<'a, F> {
    /// Where walks start for the irradiance of what these walks are for.
    pub(crate) fn irradiance(self, radiosity: &'a Radiosity<'a, F>) -> Self {
        match self {
            Self::On(KnownPart { functional: of, .. }) => {
                Self::Irradiance(Irradiance { radiosity, of })
            }
            other => other,
        }
    }
}

impl<'e, F: Real, E> Functional<WithKnown<'e, E>> for Start<'_, F>
where
    E: StateSpace<Scalar = F, Point = Point<F>>,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Started<Point<F>, F>, F) {
        match self {
            Self::On(known) => Functional::<WithKnown<'e, E>>::start(known, uniforms),
            Self::Irradiance(irradiance) => irradiance.draw::<E, U>(uniforms),
            Self::Air(air) => air.draw(uniforms),
            Self::Facing(facing) => facing.draw(uniforms),
        }
    }
}
