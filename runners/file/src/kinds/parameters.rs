//! Numbers with names, which formulas know.

use crate::formula::{Parameter, constant, occurrences, refused_name};
use toml::de::DeValue;

use crate::ProblemFile;
use crate::place::{InputError, Placed};
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
        let value = number(&value, &parameters)?;
        parameters.push(Parameter { name, value });
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
