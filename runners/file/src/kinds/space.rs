//! What formulas are functions of: the points of a product of intervals, and numbers with names; and what is asked for there.

use crate::formula::{self, Parameter, Variables};
use fredholm::{Ask, Method, Region, Target};

use super::parameters::{number, read_parameters};
use crate::model::{NOTHING, grid};
use crate::place::{InputError, Place, Placed};
use crate::points::numbers;
use crate::section::{Field, Section};
use crate::{MAX_GRID, ProblemFile, Scalar, What};

/// The space of the formulas of cubes and systems: a product of intervals.
#[derive(Clone, Debug, PartialEq)]
pub struct Space {
    /// d.
    pub dimension: Placed<usize>,
    /// Numbers that all formulas know by a name.
    pub parameters: Placed<Vec<Parameter>>,
    /// The interval of every axis, whose ends may be infinite; without it, [0, 1].
    pub domain: Option<Placed<Vec<Placed<[f64; 2]>>>>,
    /// Coordinates on every axis where cells end.
    pub edges: Option<Placed<Vec<Vec<Placed<f64>>>>>,
}

/// The formula of a weight, and the number of its component, from 0 on.
pub(super) type Weight = (Placed<String>, usize);

impl Space {
    /// Reads `dimension`, `parameters`, `domain` and `edges`.
    pub(super) fn read(section: &mut Section<'_, '_>) -> Result<Self, InputError> {
        let dimension = section.required("dimension")?.integer()?;
        let parameters = section.read_or("parameters", read_parameters, Vec::new())?;
        let known = &parameters.value;
        let domain = section.read("domain", |field| {
            field.one_or_more(|own| interval(own, known))
        });
        // One list of numbers for each axis, or the numbers of the only one.
        let edges = section.read("edges", |field| {
            field.one_or_more(|own| {
                let edge = |edge: &Field<'_, '_>| {
                    Ok(Placed::file(edge.span.clone(), number(edge, known)?))
                };
                Ok(own.elements("an array of numbers", edge)?.value)
            })
        });
        Ok(Self {
            dimension,
            domain: domain?,
            edges: edges?,
            parameters,
        })
    }

    /// The names in functions of one point.
    pub(super) fn point(&self) -> Variables<'_> {
        Variables {
            dimension: self.dimension.value,
            two: false,
            parameters: &self.parameters.value,
        }
    }

    /// The names in functions of two points.
    pub(super) fn pair(&self) -> Variables<'_> {
        Variables {
            two: true,
            ..self.point()
        }
    }

    /// The ends of every axis' interval; none for [0, 1]^d.
    #[must_use]
    pub fn ends(&self) -> Vec<[f64; 2]> {
        let domain = self.domain.iter().flat_map(|domain| &domain.value);
        domain.map(|ends| ends.value).collect()
    }

    /// The coordinates on every axis where cells end; none where nothing is said.
    #[must_use]
    pub fn edges(&self) -> Vec<Vec<f64>> {
        let axes = self.edges.iter().flat_map(|edges| &edges.value);
        axes.map(|own| own.iter().map(|edge| edge.value).collect())
            .collect()
    }

    /// The interval of every axis.
    pub(super) fn intervals(&self) -> Vec<[f64; 2]> {
        match &self.domain {
            Some(_) => self.ends(),
            None => vec![[0.0, 1.0]; self.dimension.value],
        }
    }

    /// Refuses more dimensions than so many, and what is no domain.
    pub(super) fn validate(&self, file: &ProblemFile, most: usize) -> Result<(), InputError> {
        let dimension = self.dimension.value;
        file.demand(
            &self.dimension,
            (1..=most).contains(&dimension),
            format_args!("`dimension` must be from 1 to {most}"),
        )?;
        if let Some(domain) = &self.domain {
            validate_domain(file, domain, dimension)?;
        }
        self.validate_edges(file)
    }

    /// Refuses edges that are not those of each axis, within it.
    fn validate_edges(&self, file: &ProblemFile) -> Result<(), InputError> {
        let Some(edges) = &self.edges else {
            return Ok(());
        };
        let (dimension, found) = (self.dimension.value, edges.value.len());
        file.demand(
            edges,
            found == dimension,
            format_args!("`edges` must have {dimension} lists, one an axis, not {found}"),
        )?;
        for ([low, high], own) in self.intervals().iter().zip(&edges.value) {
            for edge in own {
                let message = format_args!("an edge must be between {low} and {high}");
                file.demand(edge, *low < edge.value && edge.value < *high, message)?;
            }
        }
        let Some(method) = &file.walk.method else {
            return Ok(());
        };
        file.demand(
            method,
            method.value == Method::Resolvent,
            "`edges` are those of resolvent walks, and walks of a chain have equal cells: leave one of the two out",
        )
    }

    /// Refuses what is no target of this kind of equation: a cube, say.
    pub(super) fn validate_target(
        &self,
        file: &ProblemFile,
        what: &What,
        kind: &str,
    ) -> Result<(), InputError> {
        let (place, message) = match what {
            What::At(at) => {
                return file.validate_point(at, |x| check_point(x, &self.intervals()));
            }
            What::OverAll | What::Listed(_) => return Ok(()),
            What::Weight(text) => return check_formula(file, text, self.point()),
            What::Grid(points, None) => return validate_grid(file, points, &self.intervals()),
            What::Lattice(points) => return validate_lattice(file, points, &self.intervals()),
            What::Over(from, _) => (
                &from.place,
                format!("a part of {kind} is not offered: use `over = \"all\"` or a `weight`"),
            ),
            What::OverSurface(Placed { place, .. }) | What::OverSurfaces(Placed { place, .. }) => (
                place,
                format!("`over` must be \"all\"; for a part of {kind} use a `weight`"),
            ),
            What::Facing(_, facing) => (&facing.place, "`facing` belongs to scenes".to_owned()),
            What::Grid(_, Some(surface)) | What::On(surface, _) | What::Spot(surface, _) => (
                &surface.place,
                format!("{kind} has no surfaces: they belong to rooms"),
            ),
        };
        Err(file.error(place, message))
    }

    /// The targets, by the regions of a point and of the whole space in a component, and the weights that they ask for.
    pub(super) fn targets(
        &self,
        file: &ProblemFile,
        point: &dyn Fn(Vec<f64>, usize) -> Region,
        whole: &dyn Fn(usize) -> Region,
    ) -> Result<(Vec<Target>, Vec<Weight>), InputError> {
        let (intervals, mut weights) = (self.intervals(), Vec::new());
        let targets = file.ask(|target| {
            let component = target
                .component
                .as_ref()
                .map_or(0, |own| own.value.saturating_sub(1));
            let at = |x: Vec<f64>| Ask::One(point(x, component));
            Ok(match &target.what {
                What::At(x) => vec![at(x.value.iter().map(|x| x.value).collect())],
                What::OverAll => vec![Ask::One(whole(component))],
                What::Weight(text) => {
                    weights.push((text.clone(), component));
                    vec![Ask::One(Region::Weight(weights.len() - 1))]
                }
                What::Grid(points, _) if target.component.is_none() => grid(points, None),
                What::Grid(points, _) => {
                    let all = lattice(core::slice::from_ref(points), &intervals);
                    all.into_iter().map(at).collect()
                }
                What::Lattice(points) => {
                    let all = lattice(&points.value, &intervals);
                    all.into_iter().map(at).collect()
                }
                What::Listed(path) => file.listed(path, &mut |fields| {
                    let x = numbers(fields)?;
                    check_point(&x, &intervals).map_err(|(_, message)| message)?;
                    Ok(point(x, component))
                })?,
                _ => NOTHING,
            })
        })?;
        Ok((targets, weights))
    }
}

/// Checks a formula.
pub(super) fn check_formula(
    file: &ProblemFile,
    text: &Placed<String>,
    variables: Variables<'_>,
) -> Result<(), InputError> {
    formula::check(&text.value, variables)
        .map_err(|error| file.error_within(text, error.span, error.message))
}

/// Reads an interval of `domain`.
fn interval(
    field: &Field<'_, '_>,
    parameters: &[Parameter],
) -> Result<Placed<[f64; 2]>, InputError> {
    let mut items = field.items("a pair `[from, to]`")?;
    let (Some(low), Some(high), None) = (items.next(), items.next(), items.next()) else {
        return Err(field.error(format_args!(
            "`{}` must be two numbers, `[from, to]`",
            field.name
        )));
    };
    let end = |item: &Field<'_, '_>| match item.value.as_float().map(|float| float.as_str()) {
        Some("inf" | "+inf") => Ok(f64::INFINITY),
        Some("-inf") => Ok(f64::NEG_INFINITY),
        _ => number(item, parameters),
    };
    Ok(Placed::file(field.span.clone(), [end(&low)?, end(&high)?]))
}

/// Refuses intervals that are not one of each axis, the lower end first.
fn validate_domain(
    file: &ProblemFile,
    domain: &Placed<Vec<Placed<[f64; 2]>>>,
    dimension: usize,
) -> Result<(), InputError> {
    let found = domain.value.len();
    if found != dimension {
        let message = format!("`domain` must have {dimension} intervals, one an axis, not {found}");
        return Err(file.error(&domain.place, message));
    }
    domain.value.iter().try_for_each(|ends| {
        let message = "an interval of `domain` must be `[from, to]`, the lower end first, and not too short or too \
                       long for the scalar of the walks";
        file.demand(ends, is_interval(ends.value, file.walk.scalar.value), message)
    })
}

/// Whether two ends are those of an interval as walks hold them: f32 may make it empty.
fn is_interval(ends: [f64; 2], scalar: Scalar) -> bool {
    let held = |value: f64| match scalar {
        Scalar::F32 => f64::from(value as f32),
        Scalar::F64 => value,
    };
    let [low, high] = ends.map(held);
    let length = high - low;
    let is_infinite = ends.iter().any(|end| end.is_infinite());
    let is_held = ends
        .iter()
        .all(|&end| end.is_finite() == held(end).is_finite());
    let is_long = length > 1e-5 * low.abs().max(high.abs()) && length.is_finite();
    low < high && is_held && (is_infinite || is_long)
}

/// Refuses what is no point of these intervals: the axis at fault, if it is one, and what would be right.
fn check_point(x: &[f64], intervals: &[[f64; 2]]) -> Result<(), (Option<usize>, String)> {
    let dimension = intervals.len();
    if x.len() != dimension {
        let plural = if dimension == 1 { "" } else { "s" };
        let message = format!("`at` must have {dimension} coordinate{plural}");
        return Err((None, message));
    }
    let mut axes = x.iter().zip(intervals).enumerate();
    match axes.find(|(_, (x, [low, high]))| !(low..=high).contains(x)) {
        None => Ok(()),
        Some((axis, (_, [low, high]))) => {
            let message = format!("a coordinate must be from {low} to {high}");
            Err((Some(axis), message))
        }
    }
}

/// Refuses equally spaced points of an interval that has none.
fn validate_ends(file: &ProblemFile, place: &Place, ends: [f64; 2]) -> Result<(), InputError> {
    match ends.iter().all(|end| end.is_finite()) {
        true => Ok(()),
        false => Err(file.error(
            place,
            "an infinite interval has no equally spaced points: give points, `at = …`, or a file of them, `at = \"points.csv\"`",
        )),
    }
}

/// Refuses one number of points where there are several axes, and one that is too small or too large.
fn validate_grid(
    file: &ProblemFile,
    points: &Placed<usize>,
    intervals: &[[f64; 2]],
) -> Result<(), InputError> {
    let [ends] = intervals else {
        let all = vec![points.value.to_string(); intervals.len()];
        let (d, all) = (all.len(), all.join(", "));
        let message =
            format!("in {d} dimensions a `grid` needs a number of points for each: [{all}]");
        return Err(file.error(&points.place, message));
    };
    validate_ends(file, &points.place, *ends)?;
    file.validate_grid(points)
}

/// Refuses numbers of points that are not one of each axis, or are too many.
fn validate_lattice(
    file: &ProblemFile,
    points: &Placed<Vec<Placed<usize>>>,
    intervals: &[[f64; 2]],
) -> Result<(), InputError> {
    let (d, found) = (intervals.len(), points.value.len());
    if found != d {
        let message = format!("`grid` must have {d} numbers of points, one an axis, not {found}");
        return Err(file.error(&points.place, message));
    }
    for (points, ends) in points.value.iter().zip(intervals) {
        validate_ends(file, &points.place, *ends)?;
        file.validate_grid(points)?;
    }
    let all = points.value.iter().map(|points| points.value);
    if all.fold(1, usize::saturating_mul) > MAX_GRID {
        let message = format!("`grid` must be at most {MAX_GRID} points in all");
        return Err(file.error(&points.place, message));
    }
    Ok(())
}

/// All points of a grid, those of the last axis next to each other.
fn lattice(points: &[Placed<usize>], intervals: &[[f64; 2]]) -> Vec<Vec<f64>> {
    let mut all = vec![Vec::new()];
    for (points, [low, high]) in points.iter().zip(intervals) {
        let last = points.value.saturating_sub(1).max(1) as f64;
        let at = |i: usize| (1.0 - i as f64 / last) * low + i as f64 / last * high;
        let longer = |x: Vec<f64>| (0..points.value).map(move |i| [&*x, &[at(i)]].concat());
        all = all.into_iter().flat_map(longer).collect();
    }
    all
}
