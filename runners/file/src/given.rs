//! A solution that somebody gives: formulas, or a table of points and values.

use core::ops::Range;
use std::collections::HashSet;
use std::path::Path;

use fredholm::{Field, Model};

use crate::formula::{self, Formula, Variables};
use crate::place::{InputError, Place, Placed, Source};
use crate::points::{Row, number, rows};
use crate::{MAX_BYTES, MAX_GRID, ProblemFile, Target, What, load, utf8};

/// Where what is wrong with a given solution is said to stand.
const FLAG: &str = "--with";
/// The columns of values, the best first.
const VALUES: [&str; 5] = ["value", "u", "v", "estimate", "preconditioned"];
/// The columns of coordinates, in the order of points.
const COORDINATES: [&str; 13] = [
    "s",
    "theta",
    "phi",
    "x",
    "y",
    "z",
    "x1",
    "x2",
    "x3",
    "x4",
    "x5",
    "x6",
    "component",
];

/// A function that formulas are.
pub type Solution = Box<Field>;

/// The values of a table: rows are targets of a problem file, and each has a value for every channel; NaN where there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct GivenTable {
    /// What the rows are of.
    pub targets: Vec<Target>,
    /// The values of all rows, those of the channels of a row next to each other.
    pub values: Vec<f64>,
    /// Half of the last digit with which any of them is written; 0 where that is as exact as numbers are.
    pub rounding: f64,
}

/// The digits of a number that stands for its nearest one in double precision.
const ALL_DIGITS: usize = 15;

/// Half of the last digit of a written number: by how much rounding may have moved it. It is 0 of one with all digits of double precision.
///
/// ```
/// use fredholm_file::last_digit;
///
/// assert_eq!(last_digit("0.25"), 0.005);
/// assert_eq!(last_digit("-2.5e3"), 50.0);
/// assert_eq!(last_digit("0.30000000000000004"), 0.0);
/// ```
#[must_use]
pub fn last_digit(field: &str) -> f64 {
    let (number, power) = field.split_once(['e', 'E']).unwrap_or((field, "0"));
    let decimals = number
        .split_once('.')
        .map_or(0, |(_, decimals)| decimals.len());
    let digits = number.trim_start_matches(['-', '+', '0', '.']);
    let digits = digits.chars().filter(char::is_ascii_digit).count();
    match power.parse::<i32>() {
        Ok(power) if digits < ALL_DIGITS => 0.5 * 10_f64.powi(power - decimals as i32),
        _ => 0.0,
    }
}

impl ProblemFile {
    /// The functions of formulas, one for each channel or, of a system, for each component, which are one function then.
    /// Coordinates are those of points: x, or x1, x2 and so on.
    ///
    /// # Errors
    /// What is wrong with a formula, or with their number.
    pub fn given_formulas(
        &self,
        model: &dyn Model,
        texts: &[String],
    ) -> Result<Vec<Solution>, InputError> {
        let space = self.problem.space();
        let parts = usize::from(self.problem.has_components());
        let dimension = given_dimension(model).saturating_sub(parts).max(1);
        let parameters = space.map_or(&[][..], |space| &space.parameters.value);
        let variables = Variables {
            dimension,
            two: false,
            parameters,
        };
        let functions = texts.iter().map(|text| {
            let refuse = |error: formula::FormulaError| {
                let part = text.get(error.span).unwrap_or_default();
                let at = if part.is_empty() { text.as_str() } else { part };
                InputError::new(format_args!("`{FLAG} {text:?}`: {at}: {}", error.message))
            };
            formula::check(text, variables).map_err(refuse)?;
            Formula::<f64>::new(text, parameters).map_err(refuse)
        });
        let functions = functions.collect::<Result<Vec<_>, _>>()?;
        if parts == 0 {
            let of = |own: Formula<f64>| Box::new(move |x: &[f64]| own.value(x, &[])) as Solution;
            return Ok(functions.into_iter().map(of).collect());
        }
        let of_components = move |x: &[f64]| {
            let (x, component) = x.split_at(dimension.min(x.len()));
            let own = component.first().map_or(0, |number| *number as usize);
            let own = functions.get(own.wrapping_sub(1));
            own.map_or(f64::NAN, |own| own.value(x, &[]))
        };
        Ok(vec![Box::new(of_components)])
    }

    /// The rows of a CSV file as targets with values. A head names the columns: `value` (or `u`, or what a result file of this program calls
    /// its estimate), or the names of all channels; coordinates; `surface` and `t`; `name` of a target of this file, whose
    /// coordinates are those of the file. Without a head the last column is the value, and before it are the coordinates, or a surface and then these.
    ///
    /// # Errors
    /// A file that cannot be read, or a wrong line of it, at the line.
    pub fn given_table(&self, model: &dyn Model, path: &Path) -> Result<GivenTable, InputError> {
        let name = path.display().to_string();
        self.given_rows(model, &name, utf8(&name, load(path, MAX_BYTES)?)?)
    }

    /// The rows of the text of such a file, with the name that errors say.
    ///
    /// # Errors
    /// A wrong line, at the line.
    pub fn given_rows(
        &self,
        model: &dyn Model,
        name: &str,
        text: String,
    ) -> Result<GivenTable, InputError> {
        let source = Source {
            text,
            name: name.to_owned(),
        };
        let reader = Reader {
            file: self,
            source: &source,
            channels: model.channels(),
            parts: (0..).map_while(|number| model.part(number)).collect(),
        };
        reader.read()
    }
}

/// The number of coordinates of a point for functions of it: of a system, with the number of an equation behind them.
#[must_use]
pub fn given_dimension(model: &dyn Model) -> usize {
    let point = model.spread(1.0).into_iter().next();
    let coordinates = point.and_then(|region| coordinates(model, &region));
    coordinates.map_or(1, |x| x.len())
}

/// The coordinates of a point for functions of it.
fn coordinates(model: &dyn Model, region: &fredholm::Region) -> Option<Vec<f64>> {
    match region {
        fredholm::Region::Point(x) => Some(x.clone()),
        _ => (model.position(region)).or_else(|| model.place(region).map(|at| at.to_vec())),
    }
}

/// What columns are.
struct Columns {
    names: Option<usize>,
    surface: Option<usize>,
    share: Option<usize>,
    component: Option<usize>,
    coordinates: Vec<usize>,
    values: Vec<usize>,
}

/// Who reads a table.
struct Reader<'a> {
    file: &'a ProblemFile,
    source: &'a Source,
    channels: &'a [String],
    /// The names of all surfaces.
    parts: Vec<&'a str>,
}

impl Reader<'_> {
    fn read(&self) -> Result<GivenTable, InputError> {
        let (mut targets, mut values, mut rounding) = (Vec::new(), Vec::new(), f64::INFINITY);
        let (mut columns, mut names) = (None, HashSet::new());
        for Row {
            here,
            fields,
            is_head,
        } in rows(self.source)
        {
            if is_head {
                columns = Some(self.headed(&fields, &here)?);
                continue;
            }
            let columns = match &columns {
                Some(columns) => columns,
                None => columns.insert(self.headless(&fields, &here)?),
            };
            if targets.len() == MAX_GRID {
                return Err(self
                    .source
                    .error(here, format_args!("more than {MAX_GRID} rows")));
            }
            let number = targets.len();
            let Some(mut target) = self.target(columns, &fields, &here)? else {
                continue;
            };
            if target.name.value.is_empty() || !names.insert(target.name.value.clone()) {
                target.name.value = format!("row {}", number + 1);
                names.insert(target.name.value.clone());
            }
            let wrong = self.file.problem.validate_target(self.file, &target.what);
            wrong.map_err(|error| {
                let message = error.to_string();
                let own = message
                    .strip_prefix(&format!("`{FLAG}`: "))
                    .unwrap_or(&message);
                self.source.error(here.clone(), own)
            })?;
            for &column in &columns.values {
                values.push(match fields.get(column).copied().unwrap_or_default() {
                    "" => f64::NAN,
                    field => {
                        rounding = rounding.min(last_digit(field));
                        self.number(field, &here)?
                    }
                });
            }
            // The sum of channels is not given.
            values.extend((columns.values.len()..self.channels.len()).map(|_| f64::NAN));
            targets.push(target);
        }
        if targets.is_empty() {
            let name = &self.source.name;
            return Err(InputError::new(format_args!(
                "{name} has no values: a point and a value are wanted on each line"
            )));
        }
        Ok(GivenTable {
            targets,
            values,
            rounding,
        })
    }

    fn number(&self, field: &str, here: &Range<usize>) -> Result<f64, InputError> {
        number(field).map_err(|message| self.source.error(here.clone(), message))
    }

    /// The columns of a head.
    fn headed(&self, head: &[&str], here: &Range<usize>) -> Result<Columns, InputError> {
        let find = |name: &str| head.iter().position(|own| own.eq_ignore_ascii_case(name));
        let channels: Option<Vec<usize>> = match self.channels {
            [] => VALUES.into_iter().find_map(find).map(|column| vec![column]),
            channels => {
                let own = channels.iter().map(|name| find(name));
                let own: Vec<usize> = own.map_while(|column| column).collect();
                Some(own).filter(|own| own.len() + 1 >= channels.len())
            }
        };
        let wanted = match self.channels {
            [] => "`value`".to_owned(),
            channels => format!("each of {}", channels.join(", ")),
        };
        let values = channels.ok_or_else(|| {
            let message = format!("the head has no column of values: {wanted} is wanted");
            self.source.error(here.clone(), message)
        })?;
        let coordinates = COORDINATES.iter().filter(|name| **name != "component");
        Ok(Columns {
            names: find("name"),
            surface: find("surface"),
            share: find("t"),
            component: find("component"),
            coordinates: coordinates.filter_map(|name| find(name)).collect(),
            values,
        })
    }

    /// The columns of a table without a head, by its first line.
    fn headless(&self, fields: &[&str], here: &Range<usize>) -> Result<Columns, InputError> {
        let channels = self.channels.len().max(1);
        let surface = fields
            .first()
            .is_some_and(|field| field.parse::<f64>().is_err());
        let from = usize::from(surface);
        let Some(to) = fields
            .len()
            .checked_sub(channels)
            .filter(|&to| to >= from.max(1))
        else {
            let message = format!("coordinates and {channels} of values are wanted on each line");
            return Err(self.source.error(here.clone(), message));
        };
        // One number behind a surface is a share of its length, and three are a place.
        let share = (surface && to == from + 1).then_some(from);
        Ok(Columns {
            names: None,
            surface: surface.then_some(0),
            share,
            component: None,
            coordinates: share.map_or((from..to).collect(), |_| Vec::new()),
            values: (to..to + channels).collect(),
        })
    }

    /// What a row is of; `None`: it has no value.
    fn target(
        &self,
        columns: &Columns,
        fields: &[&str],
        here: &Range<usize>,
    ) -> Result<Option<Target>, InputError> {
        let field = |column: usize| {
            fields
                .get(column)
                .copied()
                .filter(|field| !field.is_empty())
        };
        if columns.values.iter().all(|&column| field(column).is_none()) {
            return Ok(None);
        }
        let text = |column: Option<usize>| column.and_then(field);
        let name = text(columns.names).unwrap_or_default();
        let placed = |value: &str| Placed::flag(FLAG, value.to_owned());
        let number = |field: &str| Ok(Placed::flag(FLAG, self.number(field, here)?));
        let own = columns
            .coordinates
            .iter()
            .filter_map(|&column| field(column));
        let own = own.map(number).collect::<Result<Vec<_>, InputError>>()?;
        let component = text(columns.component).map(|field| {
            field
                .parse()
                .map(|own| Placed::flag(FLAG, own))
                .map_err(|_| {
                    let message =
                        format!("a component is the number of an equation, not {field:?}");
                    self.source.error(here.clone(), message)
                })
        });
        let mut component = component.transpose()?;
        if let Some(surface) = text(columns.surface).filter(|own| !self.parts.contains(own)) {
            let message = format!("there is no surface {surface:?}");
            return Err(self.source.error(here.clone(), message));
        }
        let mut targets = self.file.targets.iter();
        let named = targets.find(|target| target.name.value == name);
        let what = match (text(columns.surface), text(columns.share)) {
            (Some(surface), Some(share)) => What::On(placed(surface), number(share)?),
            (Some(surface), None) if own.is_empty() => What::OverSurface(placed(surface)),
            (Some(surface), None) => What::Spot(placed(surface), Placed::flag(FLAG, own)),
            (None, _) if own.is_empty() || named.is_some() => {
                let Some(target) = named else {
                    let message = format!(
                        "a row without coordinates is that of a target, and the problem has none named {name:?}"
                    );
                    return Err(self.source.error(here.clone(), message));
                };
                component = component.or_else(|| target.component.clone());
                target.what.clone()
            }
            (None, _) => What::At(Placed {
                value: own,
                place: Place::Flag(FLAG),
            }),
        };
        let mut targets = self.file.targets.iter();
        let own = targets.find(|target| target.name.value == name);
        Ok(Some(Target {
            name: placed(name),
            ask: own.and_then(|target| target.ask.clone()),
            from: own.and_then(|target| target.from.clone()),
            component,
            what,
            measured: None,
        }))
    }
}
