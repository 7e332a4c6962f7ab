//! `[problem]` with `kind = "room"`, and what it asks of the rest of the file.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use fredholm::channels::Bands;
use fredholm::room::{Colours, Outside, RoomModel, Surfaces};
use fredholm::{Ask, Error, Region, Subject, Target};
use fredholm_room::Material as RoomMaterial;

use super::material::{COLD, colours, set_material};
use super::surface::read_surface;
use super::{Kind, KindEntry, compact, shared};
use crate::channels::{channel_names, names_or_bands};
use crate::deck::{self, Deck, DeckSurface};
use crate::model::{NOTHING, grid};
use crate::place::{InputError, Place, Placed};
use crate::points::number;
use crate::scene::{NO_BANDS, SkyBands, light, sky};
use crate::section::{Field, Section, nearest};
use crate::validate::{UNPRINTABLE, is_printable};
use crate::{ProblemFile, Resolution, What};

pub(super) const ENTRY: KindEntry = KindEntry {
    word: "room",
    about: "Light or heat in a room with straight walls",
    template: include_str!("../../templates/room.toml"),
    has_channels: true,
    read: |section| shared(read(section)),
};

pub use super::material::{Material, Numbers};
pub use super::surface::Surface;
pub use crate::channels::Lists;

/// Light or heat in a room: `[problem]` with `kind = "room"`.
#[derive(Clone, Debug, PartialEq)]
pub struct Room {
    /// A View2D deck, relative to the problem file.
    pub deck: Option<Placed<String>>,
    /// Whether light that leaves is absorbed.
    pub open: Placed<bool>,
    /// The sky of an open room, if the file has one.
    pub sky: Option<SkyBands>,
    /// The suns that shine into it.
    pub suns: Vec<Outside<f64>>,
    /// The period with which it repeats, if it does.
    pub period: Option<Placed<f64>>,
    /// Whether the net fluxes of all surfaces are wanted where there are temperatures.
    pub net_fluxes: Placed<bool>,
    /// The names of the channels; none if there is one.
    pub channels: Vec<String>,
    /// The bands of wavelengths, if the channels are such.
    pub bands: Option<Bands>,
    /// The surfaces; with a deck, what is said of its own.
    pub surfaces: Vec<Surface>,
    /// The place of the section in the file.
    pub place: Place,
}

/// What the name of the back of a surface with two sides has at its end.
const BACK: &str = " (back)";

/// What is along a surface, in the other direction.
fn reversed<T: Clone>(along: &[T]) -> Vec<T> {
    along.iter().rev().cloned().collect()
}

/// Reads the rest of `[problem]` for a room.
fn read(mut section: Section<'_, '_>) -> Result<Room, InputError> {
    let deck = section.read("deck", Field::string)?;
    let open = section.read("open", Field::boolean)?;
    let sky = sky::read(&mut section, open.as_ref(), true)?;
    let suns = light::suns(&mut section)?;
    let period = section.read("period", Field::number)?;
    let mut open = open.unwrap_or_else(|| Placed::default(period.is_some()));
    open.value |= sky.is_some();
    let net_fluxes = section.read_or("net_fluxes", Field::boolean, true)?;
    let channels = section.optional("channels");
    let wavelengths = section.optional("wavelengths");
    let (channels, bands) = names_or_bands(channels.as_ref(), wavelengths.as_ref())?;
    if let Some(wavelengths) = &wavelengths
        && (sky.as_ref().is_some_and(|sky| sky.emissions.is_some()) || !suns.is_empty())
    {
        return Err(wavelengths.error(NO_BANDS));
    }
    let kind = (channels.len(), bands.is_some());
    let surfaces = section.read("surface", |field| {
        field.tables("in `[[problem.surface]]`", |own| read_surface(own, kind))
    })?;
    section.finish()?;
    Ok(Room {
        deck,
        open,
        sky,
        suns,
        period,
        net_fluxes,
        channels,
        bands,
        surfaces: surfaces.unwrap_or_default(),
        place: Place::File(section.span.clone()),
    })
}

impl Room {
    /// The surfaces, with those of the deck.
    ///
    /// # Errors
    /// A deck that cannot be read, or that lacks a surface of the file.
    pub fn all_surfaces(&self, file: &ProblemFile) -> Result<Surfaces, InputError> {
        Ok(self.with_colours(file)?.0)
    }

    /// The surfaces, and their colours if there are several channels: then the surfaces have the largest materials of all.
    fn with_colours(&self, file: &ProblemFile) -> Result<(Surfaces, Option<Colours>), InputError> {
        let mut all = match &self.deck {
            Some(path) => self.surfaces_of_deck(file, path)?,
            None => self.surfaces_of_file(),
        };
        all.open |= self.open.value;
        if let Some(sky) = self.sky.as_ref().filter(|sky| sky.emissions.is_some()) {
            all.outside = sky.outside();
            all.heat |= sky.is_heat;
        }
        all.outside.extend(&self.suns);
        all.period = self.period.as_ref().map(|period| period.value);
        all.without_fluxes = !self.net_fluxes.value;
        if self.channels.is_empty() {
            return Ok((all, None));
        }
        let channels = (self.channels.len(), self.bands.as_ref());
        let of = |(name, materials): (&String, &Vec<RoomMaterial>)| {
            let find = |name: &str| self.surfaces.iter().find(|own| own.name.value == name);
            let reflectance = materials.first().map_or(0.0, |m| m.reflectance);
            let front = name.strip_suffix(BACK).and_then(find);
            match (find(name), front) {
                (Some(own), _) => colours(&own.material, reflectance, channels),
                (None, Some(front)) => reversed(&colours(&front.material, reflectance, channels)),
                (None, None) => materials.iter().map(|one| vec![*one; channels.0]).collect(),
            }
        };
        let materials = all.names.iter().zip(&all.materials).map(of).collect();
        let names = channel_names(&self.channels, self.bands.as_ref());
        let colours = Colours { names, materials };
        for (surface, materials) in all.materials.iter_mut().enumerate() {
            *materials = colours.largest(surface);
        }
        Ok((all, Some(colours)))
    }

    fn surfaces_of_deck(
        &self,
        file: &ProblemFile,
        path: &Placed<String>,
    ) -> Result<Surfaces, InputError> {
        let whole = file.beside(Path::new(&path.value));
        let deck = deck::read(&whole).map_err(|error| file.error(&path.place, error))?;
        let parts = deck
            .surfaces
            .iter()
            .position(|of| of.base.or(of.combined).is_some());
        if let Some(number) = parts {
            let message = "subsurfaces (`bas`) and combined surfaces (`cmb`) are for `fredholm factors`: in a room draw what \
                           is beside a subsurface, and name several surfaces in `over`";
            return Err(deck.error(number, message));
        }
        let mut all = deck.surfaces();
        all.is_deck = false;
        for surface in &self.surfaces {
            let known = all.names.iter();
            let Some(i) = known.clone().position(|name| *name == surface.name.value) else {
                return Err(unknown_surface(file, &surface.name, &all.names));
            };
            let own = all.materials[i].first().map_or(0.0, |m| m.reflectance);
            // Of colours it is the deck's that serves where nothing is said.
            let many = matches!(
                surface.material,
                Material::Coloured(..) | Material::Banded(..)
            );
            if !many {
                set_material(&mut all, i, &surface.material, own);
            }
        }
        Ok(all)
    }

    fn surfaces_of_file(&self) -> Surfaces {
        let mut all = Surfaces::default();
        for (i, surface) in self.surfaces.iter().enumerate() {
            let points = surface.points.iter().flat_map(|points| &points.value);
            all.names.push(surface.name.value.clone());
            all.points.push(points.map(|point| point.value).collect());
            all.materials.push(Vec::new());
            set_material(&mut all, i, &surface.material, 0.0);
        }
        for (i, surface) in self.surfaces.iter().enumerate() {
            if surface.two_sided.value {
                let back = all.names.len();
                all.names.push(surface.name.value.clone() + BACK);
                all.points.push(reversed(&all.points[i]));
                all.materials.push(reversed(&all.materials[i]));
                if let Some(emissivities) = all.emissivities.get(&i) {
                    all.emissivities.insert(back, reversed(emissivities));
                }
            }
        }
        all
    }

    fn vertex(&self, at: fredholm_room::Place) -> Option<Place> {
        let points = self.surfaces.get(at.surface)?.points.as_ref()?;
        let point = points.value.get(at.vertex);
        Some(point.map_or(&points.place, |point| &point.place).clone())
    }
}

impl Kind for Room {
    /// What surfaces ask of one another is checked where the scene is made.
    fn validate(&self, file: &ProblemFile) -> Result<(), InputError> {
        if self.surfaces.is_empty() && self.deck.is_none() {
            let message = "a room needs surfaces: `[[problem.surface]]`, or a `deck`";
            return Err(file.error(&self.place, message));
        }
        if let Some(period) = self.period.as_ref().filter(|_| !self.open.value) {
            let message = "a room with a period is open: leave `period` or `open = false` out";
            return Err(file.error(&period.place, message));
        }
        if let Some(period) = &self.period {
            let good = period.value > 0.0 && period.value.is_finite();
            file.demand(period, good, "the period must be above 0")?;
        }
        if !self.suns.is_empty() && !self.open.value {
            let message = "the sun of `[[problem.light]]` shines into open rooms alone: say `open = true`, or give it a `sky`";
            return Err(file.error(&self.place, message));
        }
        if let Some(points) = &file.galerkin.points {
            let message = "`points` belongs to cubes; a room has its own rules";
            return Err(file.refuse(points, message));
        }
        let mut seen = HashMap::new();
        for surface in &self.surfaces {
            let name = &surface.name;
            if surface.two_sided.value
                && let Some(own) = self
                    .surfaces
                    .iter()
                    .find(|own| own.name.value.strip_suffix(BACK) == Some(name.value.as_str()))
            {
                let message =
                    "this is the name of the back of a surface with two sides: choose another";
                return Err(file.refuse(&own.name, message));
            }
            let good = !name.value.trim().is_empty() && name.value != "all";
            let message = "the name of a surface must not be empty, nor \"all\"";
            file.demand(name, good, message)?;
            file.demand(name, is_printable(&name.value), UNPRINTABLE)?;
            if let Some(first) = seen.insert(name.value.as_str(), &name.place) {
                let first = file.line(first);
                let message = format!("a second surface named {:?}{first}", name.value);
                return Err(file.refuse(name, message));
            }
            surface.validate(file, self.deck.is_some())?;
        }
        Ok(())
    }

    /// Which surfaces there are is known where the scene is made.
    fn validate_target(&self, file: &ProblemFile, what: &What) -> Result<(), InputError> {
        let (place, message) = match what {
            What::Spot(_, point) => (
                &point.place,
                "`point` belongs to scenes: a place on a surface of a room is `t`, its share of the length",
            ),
            What::Facing(_, facing) => (&facing.place, "`facing` belongs to scenes"),
            What::On(_, t) => {
                let inside = (0.0..=1.0).contains(&t.value);
                return file.demand(t, inside, "`t` must be from 0 to 1, along the surface");
            }
            What::Grid(points, Some(_)) => return file.validate_grid(points),
            What::Grid(points, None) => (
                &points.place,
                "in a room a grid lies on a surface: add `surface = \"name\"`",
            ),
            What::OverAll | What::OverSurface(_) | What::Listed(_) => return Ok(()),
            What::OverSurfaces(names) => return validate_names(file, names),
            What::Lattice(points) => (
                &points.place,
                "a surface has one coordinate: `grid` must be one number of points",
            ),
            What::At(at) if at.value.len() == 2 => return Ok(()),
            What::At(at) => (
                &at.place,
                "`at` must be a place on a surface, { surface = \"name\", t = 0.5 }, or a point in the air, [x, y]",
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
        (4, "in a room")
    }

    fn resolve(&self, file: &ProblemFile) -> Result<(Resolution, Vec<Target>), InputError> {
        let sky = self.sky.as_ref();
        sky.map_or(Ok(()), |sky| sky.refuse_dark(&file.source.name))?;
        let (surfaces, colours) = self.with_colours(file)?;
        let settings = file.settings();
        let cut = settings.discretisation();
        RoomModel::refuse_beyond_memory(&surfaces, &cut).map_err(|error| file.explain(&error))?;
        let names = surfaces.names.clone();
        let model = RoomModel::new(surfaces, file.walk.scalar.value);
        let model = match colours {
            Some(colours) => model.and_then(|model| model.with_colours(colours)),
            None => model,
        };
        let model = model.map_err(|error| file.explain(&error))?;
        let find = |name: &Placed<String>| {
            let found = names.iter().position(|known| *known == name.value);
            found.ok_or_else(|| unknown_surface(file, name, &names))
        };
        let targets = file.ask(|target| {
            let region = match &target.what {
                What::On(surface, t) => Region::On(find(surface)?, t.value),
                What::At(at) => {
                    let x: Vec<f64> = at.value.iter().map(|x| x.value).collect();
                    check_inside(&model, &x).map_err(|message| file.error(&at.place, message))?;
                    Region::Point(x)
                }
                What::OverSurface(surface) => Region::Part(find(surface)?),
                What::OverSurfaces(surfaces) => {
                    Region::Parts(surfaces.value.iter().map(find).collect::<Result<_, _>>()?)
                }
                What::OverAll => Region::Whole,
                What::Grid(points, Some(surface)) => return Ok(grid(points, Some(find(surface)?))),
                What::Listed(path) => {
                    return file.listed(path, &mut |fields| listed_place(fields, &names, &model));
                }
                _ => return Ok(NOTHING),
            };
            Ok(vec![Ask::One(region)])
        })?;
        Ok((Resolution::Room(Box::new(model)), targets))
    }

    fn place(&self, subject: Subject) -> Option<Place> {
        match subject {
            Subject::Vertex(at) => Some(self.vertex(at).unwrap_or_else(|| self.place.clone())),
            Subject::Problem => Some(self.place.clone()),
            _ => None,
        }
    }

    /// The surfaces of a deck stand in the deck.
    fn explain(&self, file: &ProblemFile, error: &Error) -> Option<InputError> {
        let path = self.deck.as_ref()?;
        let Error::Scene {
            message,
            place: Some(at),
        } = error
        else {
            return None;
        };
        let deck = deck::read(&file.beside(Path::new(&path.value))).ok()?;
        Some(deck.error(at.surface, message))
    }

    fn remarks(&self, file: &ProblemFile) -> Vec<String> {
        // Of each remark the first place, and the number of surfaces.
        let mut remarks: Vec<(&str, &Place, usize)> = Vec::new();
        for surface in &self.surfaces {
            let (numbers, doubtful, message): (_, fn(f64) -> bool, _) = match &surface.material {
                Material::Light(_, emission) => (
                    emission,
                    |x| x < 0.0,
                    "this emission is negative: the surface takes light away",
                ),
                Material::Grey(_, temperature) | Material::Banded(_, temperature) => (
                    temperature,
                    |x| (0.0..COLD).contains(&x) && x > 0.0,
                    "this temperature is in kelvin, and cold: write \"20 C\" for degrees Celsius",
                ),
                Material::Flux(..) | Material::Coloured(..) => continue,
            };
            let numbers = numbers.iter().flat_map(|numbers| &numbers.value);
            let Some(number) = numbers.into_iter().find(|number| doubtful(number.value)) else {
                continue;
            };
            match remarks.iter_mut().find(|(known, ..)| *known == message) {
                Some((.., count)) => *count += 1,
                None => remarks.push((message, &number.place, 1)),
            }
        }
        let told = remarks
            .into_iter()
            .map(|(message, place, count)| match count {
                1 => file.remark(place, message),
                _ => {
                    let all = format_args!("{message} (the first of {count} such surfaces)");
                    file.remark(place, all)
                }
            });
        told.collect()
    }

    fn identity(&self, file: &ProblemFile) -> Result<String, InputError> {
        Ok(match self.with_colours(file)? {
            (surfaces, None) => compact(surfaces),
            with_colours => compact(with_colours),
        })
    }

    fn has_walls(&self) -> bool {
        true
    }
}

impl DeckSurface {
    /// The material of the surface, which emits nothing.
    pub(crate) fn material(&self) -> RoomMaterial {
        RoomMaterial {
            reflectance: 1.0 - self.emissivity,
            emission: 0.0,
        }
    }
}

impl Deck {
    /// The surfaces of a deck, which says nothing of temperatures: nothing emits.
    #[must_use]
    pub fn surfaces(&self) -> Surfaces {
        let mut all = Surfaces {
            open: self.open,
            is_deck: true,
            ..Surfaces::default()
        };
        for surface in &self.surfaces {
            all.names.push(surface.name.clone());
            all.points.push(surface.ends.to_vec());
            all.materials.push(vec![surface.material()]);
        }
        all
    }
}

/// Refuses an empty list of surfaces, and one that names a surface twice.
fn validate_names(
    file: &ProblemFile,
    names: &Placed<Vec<Placed<String>>>,
) -> Result<(), InputError> {
    if names.value.is_empty() {
        return Err(file.error(&names.place, "`over` must name at least one surface"));
    }
    let mut seen = HashSet::new();
    names.value.iter().try_for_each(|name| {
        let new = seen.insert(name.value.as_str());
        file.demand(name, new, "this surface is in the list already")
    })
}

/// Refuses a point that is behind the walls.
fn check_inside(model: &RoomModel, x: &[f64]) -> Result<(), String> {
    let &[x, y] = x else {
        return Err("a point has two coordinates: [x, y]".to_owned());
    };
    match model.are_inside(&[[x, y]]) {
        Ok(inside) if inside.contains(&true) => Ok(()),
        Ok(_) => Err(
            "this point is not between the walls: it is on one, behind one, or within an obstacle"
                .to_owned(),
        ),
        Err(error) => Err(error.to_string()),
    }
}

/// The place on a surface in a line of a CSV file, `name, t`, or the point in the air, `x, y`.
fn listed_place(fields: &[&str], names: &[String], model: &RoomModel) -> Result<Region, String> {
    let [name, t] = *fields else {
        return Err(
            "a line must be the name of a surface and t, `floor, 0.5`, or a point in the air, `1.5, 2`".to_owned(),
        );
    };
    let t = number(t)?;
    let is_name = names.iter().any(|known| known == name);
    if let Some(x) = number(name).ok().filter(|_| !is_name) {
        check_inside(model, &[x, t])?;
        return Ok(Region::Point(vec![x, t]));
    }
    if !(0.0..=1.0).contains(&t) {
        return Err("`t` must be from 0 to 1, along the surface".to_owned());
    }
    let surface = names.iter().position(|known| known == name);
    let surface = surface.ok_or_else(|| no_surface(name, names))?;
    Ok(Region::On(surface, t))
}

/// The error for a name that no surface has.
fn unknown_surface(file: &ProblemFile, name: &Placed<String>, known: &[String]) -> InputError {
    file.error(&name.place, no_surface(&name.value, known))
}

/// What is wrong with a name that no surface has.
pub(super) fn no_surface(name: &str, known: &[String]) -> String {
    let hint = match nearest(name, known) {
        Some(near) => format!("; did you mean \"{near}\"?"),
        None => String::new(),
    };
    format!("there is no surface {name:?}{hint}")
}
