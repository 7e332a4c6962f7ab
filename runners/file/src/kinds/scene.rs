//! `[problem]` with `kind = "scene"`, and what it asks of the rest of the file.

use fredholm::scene::{Colours, SceneModel, Temperatures, Vacuum};
use fredholm::{Ask, GlobalQuantity, Model, Region, Scalar, Target};
use fredholm_scene::Material;

use super::room::no_surface;
use super::{Kind, KindEntry, compact, shared};
use crate::channels::channel_names;
use crate::model::NOTHING;
use crate::place::{InputError, Placed};
use crate::points::numbers;
use crate::scene::{SceneFile, TEMPLATE, of_problem};
use crate::section::Section;
use crate::{ProblemFile, Resolution, What};

pub(super) const ENTRY: KindEntry = KindEntry {
    word: "scene",
    about: "Light or heat between polygons in space; form factors",
    template: TEMPLATE,
    has_channels: true,
    read: |section| shared(read(section, false)),
};

pub(super) const VACUUM: KindEntry = KindEntry {
    word: "vacuum",
    about: "Molecules between surfaces in space: pressures, pumps, transmission",
    template: include_str!("../../templates/vacuum.toml"),
    has_channels: false,
    read: |section| shared(read(section, true)),
};

/// The largest degree of polynomials on a cell.
const MOST_DEGREE: usize = 2;

/// Light or heat between polygons in space: `[problem]` with `kind = "scene"`.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The surfaces, of the file itself and of the meshes that it names.
    pub file: SceneFile,
}

fn read(section: Section<'_, '_>, is_vacuum: bool) -> Result<Scene, InputError> {
    let source = section.source;
    Ok(Scene {
        file: of_problem(source, section, is_vacuum)?,
    })
}

impl Scene {
    fn model(&self, file: &ProblemFile) -> Result<SceneModel, InputError> {
        if let Some(cold) = self.file.without_temperature() {
            let source = &file.source.name;
            return Err(InputError::new(format_args!("{source}: {cold}")));
        }
        let passage = self.passage(file)?;
        let (own, inlet) = match &passage {
            Some((own, inlet)) => (own, Some(*inlet)),
            None => (&self.file, None),
        };
        let scene = match file.walk.scalar.value {
            Scalar::F32 => own.scene::<f32>()?,
            Scalar::F64 => own.scene::<f64>()?,
        };
        let model = SceneModel::of_scene(self.names(), scene);
        if !self.file.channels.is_empty() {
            let surfaces = self.file.surfaces.iter();
            let materials = surfaces
                .map(|surface| vec![surface.colours.clone()])
                .collect();
            let names = channel_names(&self.file.channels, self.file.bands.as_ref());
            let colours = Colours { names, materials };
            return model.with_colours(colours).map_err(InputError::new);
        }
        if let Some(gas) = self.file.gas {
            let gas = Vacuum {
                throughputs: !self.file.without_fluxes && inlet.is_none(),
                inlet,
                ..gas
            };
            return model.with_vacuum(gas).map_err(InputError::new);
        }
        if self.file.is_photometric {
            return model.with_photometry().map_err(InputError::new);
        }
        if !self.file.heat {
            return Ok(model);
        }
        let surfaces = self.file.surfaces.iter();
        Ok(model.with_heat(Temperatures {
            emissivities: surfaces.map(|surface| surface.emissivity).collect(),
            net_fluxes: !self.file.without_fluxes,
        }))
    }

    /// Where transmissions are asked for, the scene of molecules which enter by one surface alone, whose number this is, at 1 mbar, and stay
    /// there and where they are asked for.
    fn passage(&self, file: &ProblemFile) -> Result<Option<(SceneFile, usize)>, InputError> {
        let mut all = file.targets.iter();
        let Some(first) = all.find_map(|target| target.from.as_ref()) else {
            return Ok(None);
        };
        if self.file.gas.is_none() {
            return Err(file.error(
                &first.place,
                "a transmission is of molecules: `kind = \"vacuum\"`",
            ));
        }
        if file.asks_sensitivities() {
            return Err(file.error(
                &first.place,
                "derivatives of transmissions are not told: leave `sensitivities` out",
            ));
        }
        let inlet = self.find(file, first)?;
        let mut ends = vec![inlet];
        for target in &file.targets {
            let refuse = |place, message: &str| Err(file.error(place, message));
            let names = match (&target.from, &target.what) {
                (None, _) => {
                    let message = "where a transmission is asked for, molecules enter by its `from` alone: ask for pressures in another file";
                    return refuse(&target.name.place, message);
                }
                (Some(from), _) if from.value != first.value => {
                    let message = "transmissions are from one surface: ask for those from another in another file";
                    return refuse(&from.place, message);
                }
                (_, What::OverSurface(name)) => core::slice::from_ref(name),
                (_, What::OverSurfaces(names)) => &names.value,
                (Some(from), _) => {
                    return refuse(
                        &from.place,
                        "a transmission is to surfaces: `over = \"name\"`",
                    );
                }
            };
            for name in names {
                let outlet = self.find(file, name)?;
                if outlet == inlet {
                    return refuse(
                        &name.place,
                        "molecules enter by this surface: name another by which they leave",
                    );
                }
                ends.push(outlet);
            }
        }
        let mut own = self.file.clone();
        for (number, surface) in own.surfaces.iter_mut().enumerate() {
            let refuse = |message: &str| {
                let (source, name) = (&file.source.name, &surface.name);
                Err(InputError::new(format_args!(
                    "{source}: surface {name:?}: {message}"
                )))
            };
            if surface.material.emission > 0.0 {
                return refuse(
                    "of a transmission molecules enter by its `from` alone: leave out the outgassing",
                );
            }
            if !ends.contains(&number) {
                continue;
            }
            if surface.material.reflectance != 1.0 && surface.material.reflectance != 0.0 {
                return refuse(
                    "every molecule that comes here leaves, as a transmission is asked for: leave out `sticking` and `pump`",
                );
            }
            surface.material = Material {
                reflectance: 0.0,
                emission: f64::from(u8::from(number == inlet)),
            };
        }
        Ok(Some((own, inlet)))
    }

    fn names(&self) -> Vec<String> {
        let surfaces = self.file.surfaces.iter();
        surfaces.map(|surface| surface.name.clone()).collect()
    }

    /// The number of the surface of this name.
    fn find(&self, file: &ProblemFile, name: &Placed<String>) -> Result<usize, InputError> {
        let surfaces = &self.file.surfaces;
        let found = surfaces.iter().position(|s| s.name == name.value);
        found.ok_or_else(|| file.error(&name.place, no_surface(&name.value, &self.names())))
    }
}

/// Three coordinates.
fn triple(file: &ProblemFile, at: &Placed<Vec<Placed<f64>>>) -> Result<[f64; 3], InputError> {
    match at.value.as_slice() {
        [x, y, z] => Ok([x.value, y.value, z.value]),
        _ => Err(file.error(
            &at.place,
            "a point of a scene has three coordinates: [x, y, z]",
        )),
    }
}

impl Kind for Scene {
    fn validate(&self, file: &ProblemFile) -> Result<(), InputError> {
        self.file.refuse_nothing(&file.source)?;
        let sky = self.file.sky.as_ref();
        sky.map_or(Ok(()), |sky| sky.refuse_dark(&file.source.name))?;
        match &file.galerkin.points {
            Some(points) => {
                let message = "`points` belongs to cubes: a scene's cells are fitted to rays";
                Err(file.refuse(points, message))
            }
            None => Ok(()),
        }
    }

    fn validate_target(&self, file: &ProblemFile, what: &What) -> Result<(), InputError> {
        let (place, message) = match what {
            What::At(at) => return triple(file, at).map(|_| ()),
            What::Spot(surface, at) => {
                self.find(file, surface)?;
                return triple(file, at).map(|_| ());
            }
            What::Facing(at, facing) => {
                triple(file, at)?;
                return triple(file, facing).map(|_| ());
            }
            What::OverSurface(name) => return self.find(file, name).map(|_| ()),
            What::OverSurfaces(names) => {
                if names.value.is_empty() {
                    return Err(file.error(&names.place, "`over` must name at least one surface"));
                }
                let mut names = names.value.iter();
                return names.try_for_each(|name| self.find(file, name).map(|_| ()));
            }
            What::OverAll | What::Listed(_) => return Ok(()),
            What::On(_, t) => (
                &t.place,
                "a place on a surface in space is a point: write `at = { surface = \"name\", point = [x, y, z] }`",
            ),
            What::Grid(points, _) => (
                &points.place,
                "a `grid` is along a line: in a scene give points, `at = [x, y, z]`, or `at = \"points.csv\"`",
            ),
            What::Lattice(points) => (
                &points.place,
                "a `grid` belongs to cubes: in a scene give points, `at = [x, y, z]`, or `at = \"points.csv\"`",
            ),
            What::Over(from, _) => (
                &from.place,
                "`over` must be \"all\", the name of a surface, or an array of such names",
            ),
            What::Weight(weight) => (&weight.place, "`weight` belongs to cubes"),
        };
        Err(file.error(place, message))
    }

    fn most_degree(&self) -> (usize, &'static str) {
        (MOST_DEGREE, "in a scene")
    }

    fn resolve(&self, file: &ProblemFile) -> Result<(Resolution, Vec<Target>), InputError> {
        let model = self.model(file)?;
        let checked = |region: Region| match model.check_place(&region) {
            Ok(()) => Ok(region),
            Err(error) => Err(error.to_string()),
        };
        let targets = file.ask(|target| {
            let region = match &target.what {
                What::At(at) => {
                    let point = triple(file, at)?.to_vec();
                    checked(Region::Point(point)).map_err(|error| file.error(&at.place, error))?
                }
                What::Spot(surface, at) => {
                    let (part, point) = (self.find(file, surface)?, triple(file, at)?);
                    checked(Region::Spot(part, point))
                        .map_err(|error| file.error(&at.place, error))?
                }
                What::Facing(at, facing) => {
                    let (at, direction) = (triple(file, at)?, triple(file, facing)?);
                    checked(Region::Facing { at, direction })
                        .map_err(|error| file.error(&facing.place, error))?
                }
                What::OverAll => Region::Whole,
                What::OverSurface(name) => Region::Part(self.find(file, name)?),
                What::OverSurfaces(names) => {
                    let parts = names.value.iter().map(|name| self.find(file, name));
                    Region::Parts(parts.collect::<Result<_, _>>()?)
                }
                What::Listed(path) => {
                    return file.listed(path, &mut |fields| {
                        let point = numbers(fields)?;
                        checked(match *point.as_slice() {
                            [x, y, z, a, b, c] => Region::Facing {
                                at: [x, y, z],
                                direction: [a, b, c],
                            },
                            _ => Region::Point(point),
                        })
                    });
                }
                _ => return Ok(NOTHING),
            };
            // Of molecules people ask for the pressure.
            let is_lit = || (model.exchange()).is_some_and(|surfaces| !surfaces.is_in_air(&region));
            let is_pressure = self.file.gas.is_some() && target.ask.is_none() && is_lit();
            let own = Ask::One(region);
            Ok(vec![match is_pressure {
                true => Ask::Of(GlobalQuantity::Irradiance, Box::new(own)),
                false => own,
            }])
        })?;
        Ok((Resolution::Scene(Box::new(model)), targets))
    }

    fn remarks(&self, _: &ProblemFile) -> Vec<String> {
        let mut remarks = self.file.remarks.clone();
        remarks.extend(self.file.without_material());
        remarks.extend(self.file.in_millimetres());
        remarks
    }

    /// Names, polygons, materials and lights, and whether they are of heat; not where they stand.
    fn identity(&self, problem: &ProblemFile) -> Result<String, InputError> {
        let surfaces = self.file.surfaces.iter();
        let all: Vec<_> = surfaces
            .map(|surface| {
                (
                    &surface.name,
                    &surface.polygons,
                    surface.material,
                    (surface.specular, surface.absorptance),
                    surface.emissivity,
                    &surface.colours,
                )
            })
            .collect();
        let file = &self.file;
        let lights = &file.lights;
        let gas = file.gas.map(|gas| format!("{gas:?}")).unwrap_or_default();
        let all = compact((
            (file.open, file.period),
            file.heat,
            file.without_fluxes,
            lights,
            all,
            &file.channels,
        ));
        let mut targets = problem.targets.iter();
        let inlet = targets.find_map(|target| target.from.as_ref());
        Ok(all + &gas + inlet.map_or("", |inlet| &inlet.value))
    }
}
