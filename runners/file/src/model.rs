//! From what a file says to a model, its targets and its settings; and from an error to its place.

use core::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

use fredholm::circle::{CircleModel, Emission as CircleEmission};
use fredholm::cube::CubeModel;
use fredholm::room::{RoomModel, Surfaces};
use fredholm::{Ask, Error, Model, Region, Settings, Subject, Target, Tolerance};
use fredholm_circle::Harmonic;
use fredholm_room::Material;

use crate::deck::{self, Deck};
use crate::functions::Formulas;
use crate::room::{Numbers, unknown_surface};
use crate::{
    Circle, Cube, Emission, InputError, KernelText, Material as MaterialText, Place, Placed,
    Problem, ProblemFile, Room, What,
};

/// What a file comes to: a model, what is asked of it, and how.
#[derive(Debug)]
pub struct Resolved {
    /// The equation.
    pub model: Resolution,
    /// What is asked for.
    pub targets: Vec<Target>,
    /// How it is solved.
    pub settings: Settings,
}

/// The model of each kind of problem.
#[derive(Debug)]
pub enum Resolution {
    /// Light on the unit circle.
    Circle(CircleModel),
    /// An equation on [0, 1]^d.
    Cube(CubeModel),
    /// Light or heat in a room.
    Room(RoomModel),
}

impl Resolution {
    /// The model, of whichever kind.
    #[must_use]
    pub const fn model(&self) -> &dyn Model {
        match self {
            Self::Circle(model) => model,
            Self::Cube(model) => model,
            Self::Room(model) => model,
        }
    }
}

impl ProblemFile {
    /// The model, the targets and the settings of the file, which validation has passed.
    ///
    /// # Errors
    /// What the model does not take, at its place.
    pub fn resolve(&self) -> Result<Resolved, InputError> {
        let settings = self.settings();
        let (model, targets) = match &self.problem {
            Problem::Circle(circle) => (Resolution::Circle(circle_model(circle)), self.on_circle()),
            Problem::Cube(cube) => self.cube_model(cube),
            Problem::Room(room) => self.room_model(room)?,
        };
        let (cut, pairs) = (settings.discretisation(), settings.walk_options().pairs);
        let checked = model.model().check(&cut, pairs);
        checked.map_err(|error| self.explain(&error))?;
        Ok(Resolved {
            model,
            targets,
            settings,
        })
    }

    /// What the file, and flags in its place, say of the solution.
    fn settings(&self) -> Settings {
        /// What nobody gave is open.
        fn given<T: Copy>(placed: &Placed<T>) -> Option<T> {
            (placed.place != Place::Default).then_some(placed.value)
        }
        let (galerkin, walk) = (&self.galerkin, &self.walk);
        let value = |placed: &Option<Placed<usize>>| placed.as_ref().map(|placed| placed.value);
        Settings {
            cells: value(&galerkin.cells),
            degree: given(&galerkin.degree),
            pairs: given(&galerkin.pairs),
            points: value(&galerkin.points),
            grading: galerkin.grading.as_ref().map(|grading| grading.value),
            shadow_cuts: galerkin.shadow_cuts.as_ref().map(|cuts| cuts.value),
            walks: given(&walk.walks),
            absorption: given(&walk.absorption),
            estimator: given(&walk.estimator),
            scalar: walk.scalar.value,
            seed: walk.seed.value,
            batch: walk.batch.value,
            tolerance: walk.target_error.as_ref().map(|error| {
                if walk.relative.value {
                    Tolerance::Relative(error.value)
                } else {
                    Tolerance::Absolute(error.value)
                }
            }),
            time_limit: None,
            allow_infinite_variance: walk.allow_infinite_variance,
        }
    }

    /// An error of the solution, at its place in the file if it has one.
    #[must_use]
    pub fn explain(&self, error: &Error) -> InputError {
        let (galerkin, walk) = (&self.galerkin, &self.walk);
        let nowhere = || InputError::new(error);
        match error.subject() {
            Some(Subject::Cells) => match &galerkin.cells {
                Some(cells) => self.refuse(cells, error),
                None => nowhere(),
            },
            Some(Subject::Degree) => self.refuse(&galerkin.degree, error),
            Some(Subject::Pairs) => self.refuse(&galerkin.pairs, error),
            Some(Subject::Absorption) => self.refuse(&walk.absorption, error),
            Some(Subject::Tolerance) => match &walk.target_error {
                Some(target) => self.refuse(target, error),
                None => nowhere(),
            },
            Some(Subject::KernelIntegral(axis)) => match self.integral_place(axis) {
                Some(place) => self.error(place, error),
                None => nowhere(),
            },
            Some(Subject::Vertex(place)) => match self.vertex_place(place) {
                Some(place) => self.error(place, error),
                None => self.error(&self.problem_place(), error),
            },
            Some(Subject::Problem) => self.error(&self.problem_place(), error),
            _ => nowhere(),
        }
    }

    fn integral_place(&self, axis: usize) -> Option<&Place> {
        let Problem::Cube(cube) = &self.problem else {
            return None;
        };
        Some(match cube.integral.as_ref()? {
            KernelText::General(text) => &text.place,
            KernelText::Factors(texts) => match texts.value.get(axis) {
                Some(text) => &text.place,
                None => &texts.place,
            },
        })
    }

    fn vertex_place(&self, at: fredholm_room::Place) -> Option<&Place> {
        let Problem::Room(room) = &self.problem else {
            return None;
        };
        let points = room.surfaces.get(at.surface)?.points.as_ref()?;
        let point = points.value.get(at.vertex);
        Some(point.map_or(&points.place, |point| &point.place))
    }

    fn problem_place(&self) -> Place {
        match &self.problem {
            Problem::Room(room) => room.place.clone(),
            _ => Place::Default,
        }
    }

    /// All targets, by what each asks; validation has refused what asks nothing.
    fn ask(&self, mut ask: impl FnMut(&What) -> Option<Ask>) -> Vec<Target> {
        let target = |target: &crate::Target| {
            Some(Target {
                name: target.name.value.clone(),
                ask: ask(&target.what)?,
            })
        };
        self.targets.iter().filter_map(target).collect()
    }

    fn on_circle(&self) -> Vec<Target> {
        self.ask(|what| {
            Some(Ask::One(match what {
                What::At(at) => Region::Angle(at.value.first()?.value),
                What::OverAll => Region::Arc(0.0, TAU),
                What::Over(from, to) => Region::Arc(from.value, to.value),
                What::Grid(points, part) => return grid(points, part.as_ref().map(|_| 0)),
                _ => return None,
            }))
        })
    }

    fn cube_model(&self, cube: &Cube) -> (Resolution, Vec<Target>) {
        let mut weights = Vec::new();
        let targets = self.ask(|what| {
            Some(Ask::One(match what {
                What::At(at) => Region::Point(at.value.iter().map(|x| x.value).collect()),
                What::OverAll => Region::Whole,
                What::Weight(text) => {
                    weights.push(text.value.clone());
                    Region::Weight(weights.len() - 1)
                }
                What::Grid(points, part) => return grid(points, part.as_ref().map(|_| 0)),
                _ => return None,
            }))
        });
        let formulas = Formulas::new(cube, weights);
        (
            Resolution::Cube(CubeModel::new(Arc::new(formulas))),
            targets,
        )
    }

    fn room_model(&self, room: &Room) -> Result<(Resolution, Vec<Target>), InputError> {
        let surfaces = self.surfaces(room)?;
        let cut = self.settings().discretisation();
        RoomModel::refuse_beyond_memory(&surfaces, &cut).map_err(|error| self.explain(&error))?;
        let names = surfaces.names.clone();
        let model = RoomModel::new(surfaces, self.walk.scalar.value);
        let model = model.map_err(|error| self.explain(&error))?;
        let mut unknown = None;
        let mut find = |name: &Placed<String>| {
            let found = names.iter().position(|known| *known == name.value);
            if found.is_none() {
                unknown.get_or_insert_with(|| unknown_surface(self, name, &names));
            }
            found
        };
        let targets = self.ask(|what| {
            Some(Ask::One(match what {
                What::On(surface, t) => Region::On(find(surface)?, t.value),
                What::OverSurface(surface) => Region::Part(find(surface)?),
                What::OverAll => Region::Whole,
                What::Grid(points, Some(surface)) => return grid(points, Some(find(surface)?)),
                _ => return None,
            }))
        });
        match unknown {
            Some(error) => Err(error),
            None => Ok((Resolution::Room(model), targets)),
        }
    }

    /// The surfaces of a room, with its deck.
    ///
    /// # Errors
    /// A deck that cannot be read, or that lacks a surface of the file.
    pub fn surfaces(&self, room: &Room) -> Result<Surfaces, InputError> {
        let mut all = match &room.deck {
            Some(path) => self.surfaces_of_deck(room, path)?,
            None => surfaces_of_file(room),
        };
        all.open |= room.open.value;
        Ok(all)
    }

    fn surfaces_of_deck(&self, room: &Room, path: &Placed<String>) -> Result<Surfaces, InputError> {
        let whole = self.beside(Path::new(&path.value));
        let deck = deck::read(&whole).map_err(|error| self.error(&path.place, error))?;
        let mut all = deck.surfaces();
        for surface in &room.surfaces {
            let known = all.names.iter();
            let Some(i) = known.clone().position(|name| *name == surface.name.value) else {
                return Err(unknown_surface(self, &surface.name, &all.names));
            };
            let own = all.materials[i].first().map_or(0.0, |m| m.reflectance);
            all.materials[i] = materials(&surface.material, own);
            all.heat |= matches!(surface.material, MaterialText::Grey(..));
        }
        Ok(all)
    }
}

fn grid(points: &Placed<usize>, part: Option<usize>) -> Option<Ask> {
    Some(Ask::Grid {
        points: points.value,
        part,
    })
}

fn circle_model(circle: &Circle) -> CircleModel {
    let values = |array: &[Placed<f64>]| array.iter().map(|value| value.value).collect();
    let emission = match &circle.emission {
        Emission::Harmonic {
            constant,
            amplitude,
            frequency,
        } => CircleEmission::Harmonic(Harmonic {
            constant: constant.value,
            amplitude: amplitude.value,
            frequency: frequency.value,
        }),
        Emission::Arcs(array) => CircleEmission::Arcs(values(&array.value)),
    };
    CircleModel::new(values(&circle.reflectance.value), emission)
}

fn surfaces_of_file(room: &Room) -> Surfaces {
    let mut all = Surfaces::default();
    for surface in &room.surfaces {
        let points = surface.points.iter().flat_map(|points| &points.value);
        all.names.push(surface.name.value.clone());
        all.points.push(points.map(|point| point.value).collect());
        all.materials.push(materials(&surface.material, 0.0));
        all.heat |= matches!(surface.material, MaterialText::Grey(..));
    }
    all
}

impl Deck {
    /// The surfaces of a deck, which says nothing of temperatures: nothing emits.
    #[must_use]
    pub fn surfaces(&self) -> Surfaces {
        let mut all = Surfaces {
            open: self.open,
            ..Surfaces::default()
        };
        for surface in &self.surfaces {
            all.names.push(surface.name.clone());
            all.points.push(surface.ends.to_vec());
            all.materials.push(vec![Material {
                reflectance: 1.0 - surface.emissivity,
                emission: 0.0,
            }]);
        }
        all
    }
}

/// The materials of a surface; `own` is its reflectance where nothing is said of it.
fn materials(material: &MaterialText, own: f64) -> Vec<Material> {
    let list = |numbers: &Numbers, default: f64| -> Vec<f64> {
        numbers.as_ref().map_or(vec![default], |numbers| {
            numbers.value.iter().map(|number| number.value).collect()
        })
    };
    let (first, second, make): (_, _, fn(f64, f64) -> Material) = match material {
        MaterialText::Light(reflectance, emission) => (
            list(reflectance, own),
            list(emission, 0.0),
            |reflectance, emission| Material {
                reflectance,
                emission,
            },
        ),
        MaterialText::Grey(emissivity, temperature) => (
            list(emissivity, 1.0 - own),
            list(temperature, 0.0),
            Material::grey,
        ),
    };
    // A list of another length than the other's stays one: the scene refuses it.
    let at = |list: &[f64], i: usize| match list {
        [one] => *one,
        many => many.get(i).copied().unwrap_or(f64::NAN),
    };
    (0..first.len().max(second.len()))
        .map(|i| make(at(&first, i), at(&second, i)))
        .collect()
}
