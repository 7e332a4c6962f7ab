//! What may be asked of a scene.

use fredholm_core::{At, Functional, Real, Uniforms};
use fredholm_model::{Error, Region};
use fredholm_scene::{Mean, Point, Radiosity, Scene};

/// A point, or the faces over which a mean is.
#[derive(Clone, Debug)]
pub(crate) enum Place {
    Point(u32, [f64; 3]),
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
                let found = on_any(scene, faces(*part)?, *position);
                match found {
                    Some(face) => Ok(Self::Point(face, *position)),
                    None => wrong(format!("the point {position:?} is not on its surface")),
                }
            }
            Region::Point(coordinates) => match *coordinates.as_slice() {
                [x, y, z] => match on_any(scene, 0..scene.faces().len(), [x, y, z]) {
                    Some(face) => Ok(Self::Point(face, [x, y, z])),
                    None => wrong(format!("the point {:?} is on no surface", [x, y, z])),
                },
                _ => wrong("a point of a scene has three coordinates".to_owned()),
            },
            _ => wrong(
                "a scene has points on its surfaces, means over them, and the mean over all"
                    .to_owned(),
            ),
        }
    }

    /// (F, Φ).
    pub(crate) fn emission(&self, scene: &Scene) -> f64 {
        let faces = scene.faces();
        match self {
            Self::Point(face, _) => faces.get(*face as usize).map_or(f64::NAN, |f| f.emission),
            Self::Faces(numbers) => {
                let all = || numbers.iter().filter_map(|face| faces.get(*face as usize));
                let area: f64 = all().map(|face| face.area).sum();
                all().map(|face| face.area * face.emission).sum::<f64>() / area
            }
        }
    }

    /// Where walks start.
    pub(crate) fn start<'a, F: Real>(
        &'a self,
        radiosity: &Radiosity<'a, F>,
    ) -> Result<Start<'a, F>, Error> {
        Ok(match self {
            Self::Point(face, position) => Start::Point(At(radiosity.at(*face, *position)?)),
            Self::Faces(faces) => Start::Mean(Mean::new(radiosity.geometry(), faces)?),
        })
    }
}

/// The first of some faces on which a position is.
fn on_any(scene: &Scene, mut faces: core::ops::Range<usize>, position: [f64; 3]) -> Option<u32> {
    let geometry = scene.geometry();
    faces
        .find(|&face| geometry.is_on(face as u32, position))
        .map(|face| face as u32)
}

/// Where walks start.
pub(crate) enum Start<'a, F> {
    Point(At<Point<F>>),
    Mean(Mean<'a, F>),
}

impl<F: Real, E> Functional<E> for Start<'_, F>
where
    E: fredholm_core::StateSpace<Scalar = F, Point = Point<F>>,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Point<F>, F) {
        match self {
            Self::Point(At(x)) => (*x, F::from_f64(1.0)),
            Self::Mean(mean) => mean.draw(uniforms),
        }
    }
}
