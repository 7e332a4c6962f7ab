//! What may be asked of a scene.

use fredholm_core::{
    At, Equation as _, Functional, LastStep, Lights as _, Real, Start, StartOf, Uniforms,
    Value as _,
};
use fredholm_model::{Error, Region};
use fredholm_scene::{
    Air, Facing, Geometry, Irradiance, Mean, Point, Radiosity, Scene, Sources, Tint, Wide, areas,
};

/// A point of a face, a point between the faces, what faces in a direction there, the faces over which a mean is, or of the way
/// back the sources.
#[derive(Clone, Debug)]
pub(crate) enum Place {
    Point(u32, [f64; 3]),
    Air([f64; 3]),
    /// The place and the direction.
    Facing([f64; 3], [f64; 3]),
    /// In ascending order.
    Faces(Vec<u32>),
    Sources,
}

impl Place {
    /// The place of a region, if the scene has it.
    pub(crate) fn new(scene: &Scene, region: &Region) -> Result<Self, Error> {
        let wrong = |message: String| Err(Error::Region { message });
        let geometry = scene.geometry();
        match region.place() {
            Region::Whole => Ok(Self::Faces((0..scene.faces().len() as u32).collect())),
            Region::Part(part) => Ok(Self::Faces(faces_of(scene, &[*part])?)),
            Region::Parts(parts) if !parts.is_empty() => Ok(Self::Faces(faces_of(scene, parts)?)),
            Region::Spot(part, position) => {
                let own = faces_of(scene, &[*part])?;
                let at = scene.moved_in(*position);
                match own.into_iter().find(|&face| geometry.is_on(face, at)) {
                    Some(face) => Ok(Self::Point(face, at)),
                    None => wrong(format!("the point {position:?} is not on its surface")),
                }
            }
            Region::Point(coordinates) => match *coordinates.as_slice() {
                [x, y, z] => {
                    let at = scene.moved_in([x, y, z]);
                    match geometry.face_at(at) {
                        Some(face) => Ok(Self::Point(face, at)),
                        None if scene.is_between(at) => Ok(Self::Air(at)),
                        None => wrong(format!(
                            "the point {coordinates:?} is neither on a surface nor between them"
                        )),
                    }
                }
                _ => wrong("a point of a scene has three coordinates".to_owned()),
            },
            Region::Facing { at, direction } => {
                if !direction.iter().all(|c| c.is_finite()) || direction.iter().all(|c| *c == 0.0) {
                    return wrong(format!(
                        "{direction:?} is no direction: its coordinates must be finite, and one of them not 0"
                    ));
                }
                let place = scene.moved_in(*at);
                if !scene.is_between(place) {
                    return wrong(format!("the point {at:?} is not between the surfaces"));
                }
                Ok(Self::Facing(place, *direction))
            }
            _ => wrong(
                "a scene has points on its surfaces and between them, means over surfaces, and the mean over all"
                    .to_owned(),
            ),
        }
    }

    /// The faces over which a mean is, or on which a point lies.
    pub(crate) fn faces(&self) -> &[u32] {
        match self {
            Self::Point(face, _) => core::slice::from_ref(face),
            Self::Faces(faces) => faces,
            _ => &[],
        }
    }

    /// The areas of faces over which a mean is, each with all before it: where starts look.
    pub(crate) fn ends<F: Real>(&self, geometry: Geometry<'_, F>) -> Result<Vec<F>, Error> {
        Ok(match self {
            Self::Faces(faces) => areas(geometry, faces)?,
            _ => Vec::new(),
        })
    }

    /// Where walks start, with the [ends](Self::ends) of this place and the sources of the scene.
    pub(crate) fn origin<'a, F: Real, C>(
        &'a self,
        radiosity: &Radiosity<'a, F, C>,
        ends: &'a [F],
        sources: Option<&'a Sources<F>>,
    ) -> Result<Origin<'a, F>, Error> {
        Ok(match self {
            Self::Point(face, position) => Origin::Point(At(radiosity.at(*face, *position)?)),
            Self::Faces(faces) => Origin::Mean(Mean::new(radiosity.geometry(), faces, ends)?),
            Self::Air(position) => Origin::Air(Air {
                position: position.map(F::from_f64),
            }),
            Self::Facing(position, direction) => {
                Origin::Facing(Facing::new(*position, *direction)?)
            }
            Self::Sources => {
                Origin::Sources(sources.ok_or(Error::Internal("a scene without a source"))?)
            }
        })
    }
}

/// The faces of surfaces, in ascending order.
fn faces_of(scene: &Scene, parts: &[usize]) -> Result<Vec<u32>, Error> {
    let mut all = Vec::new();
    for &part in parts {
        let faces = scene.faces_of(part).map_err(|_| Error::Region {
            message: format!("there is no surface {part}"),
        })?;
        all.extend(faces.map(|face| face as u32));
    }
    all.sort_unstable();
    all.dedup();
    Ok(all)
}

/// Where walks start.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Origin<'a, F> {
    Point(At<Point<F>>),
    Mean(Mean<'a, F>),
    Air(Air<F>),
    Facing(Facing<F>),
    Sources(&'a Sources<F>),
    /// For what arrives there.
    Arriving(&'a Self),
    /// For a share of the sunlight that arrives there, besides u there or all that arrives.
    Sunlit {
        of: &'a Self,
        is_arriving: bool,
        share: F,
    },
}

impl<F: Real> Origin<'_, F> {
    /// (F_s, Φ) of lights, to which the last step leads, where it is the same for all walks.
    pub(crate) fn known<C: Tint<F>>(&self, radiosity: &Radiosity<'_, F, C>) -> Wide<F, C> {
        match self {
            Self::Point(At(x)) => radiosity.known(x).wide(),
            Self::Mean(mean) => mean.known(radiosity),
            _ => Wide::<F, C>::splat(fredholm_core::Equation::channels(radiosity), 0.0),
        }
    }
}

impl<'e, 'r, F: Real, C: Tint<F>> Functional<LastStep<'e, Radiosity<'r, F, C>>> for Origin<'_, F> {
    #[inline]
    fn start<U: Uniforms<F>>(
        &self,
        equation: &LastStep<'e, Radiosity<'r, F, C>>,
        uniforms: &mut U,
    ) -> StartOf<Radiosity<'r, F, C>> {
        match self {
            Self::Point(at) => at.start(equation, uniforms),
            Self::Mean(mean) => mean.start(equation, uniforms),
            Self::Air(air) => air.start(equation, uniforms),
            Self::Facing(facing) => facing.start(equation, uniforms),
            Self::Sources(sources) => sources.start(equation, uniforms),
            Self::Arriving(of) => Irradiance(**of).start(equation, uniforms),
            Self::Sunlit {
                of,
                is_arriving,
                share,
            } => {
                let at = of.start(equation, uniforms);
                let sunlight = equation.0.sunlight(&at.point, uniforms) * *share * at.phi;
                let start = match is_arriving {
                    true => equation.arriving(&at.point, uniforms).scaled(at.phi),
                    false => at,
                };
                let channels = equation.channels();
                let known = start.known.plus(&C::Value::splat(channels, sunlight));
                Start { known, ..start }
            }
        }
    }

    fn looks(&self) -> u32 {
        match self {
            Self::Sources(sources) => {
                Functional::<LastStep<'e, Radiosity<'r, F, C>>>::looks(*sources)
            }
            _ => 1,
        }
    }
}
