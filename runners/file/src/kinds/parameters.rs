//! Numbers with names, which formulas know.

use fredholm::{Derivatives, Quantity};
use toml::de::DeValue;

use crate::formula::{Parameter, Slope, constant, occurrences, refused_name};

use super::space::Space;
use crate::ProblemFile;
use crate::place::{InputError, Place, Placed};
use crate::section::Field;

/// Reads `[problem.parameters]`; a formula knows those that stand before it.
pub(super) fn read_parameters(field: &Field<'_, '_>) -> Result<Placed<Vec<Parameter>>, InputError> {
    let DeValue::Table(table) = &field.value else {
        return Err(field.mistyped("a table of numbers, such as `a = 0.5`"));
    };
    let mut entries: Vec<_> = table.iter().collect();
    // The tree is sorted by key.
    entries.sort_by_key(|(key, _)| key.span().start);
    let mut parameters = Vec::new();
    for (key, value) in entries {
        let name = key.get_ref().to_string();
        if let Some(message) = refused_name(&name) {
            return Err(field.source.error(key.span(), message));
        }
        let value = Field {
            source: field.source,
            name: name.clone(),
            key: key.span(),
            span: value.span(),
            value: value.get_ref().clone(),
        };
        let formula = match &value.value {
            DeValue::String(text) => Some(text.to_string()),
            _ => None,
        };
        let given = |text: &String| {
            let mut known = parameters.iter();
            known.any(|own: &Parameter| occurrences(text, &own.name) > 0)
        };
        let formula = formula.filter(given);
        parameters.push(Parameter {
            value: number(&value, &parameters)?,
            name,
            formula,
        });
    }
    Ok(Placed::file(field.span.clone(), parameters))
}

/// What is said of parameters that the file has at one place only.
pub(super) fn unused(file: &ProblemFile, parameters: &Placed<Vec<Parameter>>) -> Option<String> {
    let all = parameters.value.iter();
    let unused = all.filter(|own| occurrences(&file.source.text, &own.name) < 2);
    let names: Vec<String> = unused.map(|own| format!("`{}`", own.name)).collect();
    let message = format!("no formula has the parameter {}", names.join(", "));
    (!names.is_empty()).then(|| file.remark(&parameters.place, message))
}

/// The parameters by which derivatives are taken: numbers by which no end of the domain and no edge is given.
fn independent(file: &ProblemFile, space: &Space) -> Vec<(usize, Quantity)> {
    let places = [
        space.domain.as_ref().map(|domain| &domain.place),
        space.edges.as_ref().map(|edges| &edges.place),
    ];
    let texts = places.into_iter().flatten().map(|place| match place {
        Place::File(span) => file.source.text.get(span.clone()).unwrap_or_default(),
        _ => "",
    });
    let moves = |own: &Parameter| texts.clone().any(|text| occurrences(text, &own.name) > 0);
    let all = space.parameters.value.iter().enumerate();
    let own = all.filter(|(_, own)| own.formula.is_none() && !moves(own));
    own.map(|(number, own)| (number, Quantity::number(&own.name, own.value)))
        .collect()
}

/// A formula with its derivatives by all of some parameters.
type Slopes = Vec<Slope>;

/// The derivatives by the parameters, if there are some, of K_ij by [i, j], which is one formula or one for each axis, and of F_i.
///
/// # Errors
/// What is wrong with a formula, at its place.
pub(super) fn derivatives(
    file: &ProblemFile,
    space: &Space,
    kernels: &[Vec<&[Placed<String>]>],
    sources: &[&Placed<String>],
) -> Result<Option<Derivatives>, InputError> {
    let (numbers, quantities): (Vec<usize>, Vec<Quantity>) =
        independent(file, space).into_iter().unzip();
    if quantities.is_empty() {
        return Ok(None);
    }
    let slopes = |text: &Placed<String>| -> Result<Slopes, InputError> {
        let slope = |&number: &usize| {
            Slope::new(&text.value, &space.parameters.value, number)
                .map_err(|error| file.error_within(text, error.span, error.message))
        };
        numbers.iter().map(slope).collect()
    };
    let factors = |own: &&[Placed<String>]| own.iter().map(slopes).collect();
    let row = |own: &Vec<&[Placed<String>]>| own.iter().map(factors).collect();
    let kernels: Vec<Vec<Vec<Slopes>>> = kernels.iter().map(row).collect::<Result<_, _>>()?;
    let sources = sources.iter().map(|text| slopes(text));
    let sources = sources.collect::<Result<Vec<_>, _>>()?;
    Ok(Some(Derivatives {
        quantities,
        kernel: Box::new(move |q, [i, j], x, y| match &*kernels[i][j] {
            [one] => one[q].value(x, y)[1],
            factors => {
                let axes = factors.iter().zip(x.iter().zip(y));
                let axes = axes.map(|(own, (x, y))| own[q].value(&[*x], &[*y]));
                let product = |[a, da]: [f64; 2], [b, db]: [f64; 2]| [a * b, a * db + da * b];
                axes.fold([1.0, 0.0], product)[1]
            }
        }),
        source: Box::new(move |q, i, x| sources[i][q].value(x, &[])[1]),
    }))
}

/// The number here, or that of the formula here.
pub(super) fn number(field: &Field<'_, '_>, parameters: &[Parameter]) -> Result<f64, InputError> {
    let DeValue::String(text) = &field.value else {
        return Ok(field.number()?.value);
    };
    constant(text, parameters).map_err(|error| {
        let message = error.message;
        field
            .source
            .error_within(&field.span, text, error.span, message)
    })
}
