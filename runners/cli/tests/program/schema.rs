//! docs/report.schema.json is what reports are.

use crate::{adjoint, colours, common};

use std::collections::BTreeSet;
use std::fs;

use common::{CIRCLE, Folder, circle_with, fredholm};
use serde_json::Value;

use crate::parts::{CUBE, ROOM, SPHERE, parts};
use crate::systems::SCENE;

/// Looks for what a document has against a schema, by the words of JSON Schema that ours uses. Others than the properties that it
/// names are errors here, although fields may be added: what is added must be added to the schema.
struct Looking<'a> {
    schema: &'a Value,
    /// The names of the properties that were met.
    met: BTreeSet<String>,
}

impl Looking<'_> {
    /// What is wrong with a value, which stands in this place.
    fn wrong(&mut self, own: &Value, value: &Value, place: &str) -> Vec<String> {
        let mut wrong = Vec::new();
        for (word, what) in own.as_object().unwrap() {
            match word.as_str() {
                "$ref" => {
                    let name = what.as_str().unwrap().strip_prefix("#/$defs/").unwrap();
                    let definition = &self.schema["$defs"][name];
                    assert!(definition.is_object(), "no {name}");
                    wrong.extend(self.wrong(definition, value, place));
                }
                "anyOf" => {
                    let all = what.as_array().unwrap().iter();
                    let all: Vec<_> = all.map(|one| self.wrong(one, value, place)).collect();
                    // What is nearest to being right.
                    wrong.extend(all.into_iter().min_by_key(Vec::len).unwrap());
                }
                "type" => {
                    let types: Vec<&str> = match what {
                        Value::Array(all) => all.iter().filter_map(Value::as_str).collect(),
                        one => one.as_str().into_iter().collect(),
                    };
                    if !types.iter().any(|word| is(value, word)) {
                        wrong.push(format!("{place} is no {types:?}: {value}"));
                    }
                }
                "enum" if !what.as_array().unwrap().contains(value) => {
                    wrong.push(format!("{place}: {value}"));
                }
                "minimum" if value.as_f64() < what.as_f64() => {
                    wrong.push(format!("{place} is too small: {value}"));
                }
                "minItems" | "maxItems" => {
                    let length = value.as_array().map(Vec::len);
                    if length.is_some_and(|length| Some(length as u64) != what.as_u64()) {
                        wrong.push(format!("{place} has {length:?}"));
                    }
                }
                "items" => {
                    for (i, item) in value.as_array().into_iter().flatten().enumerate() {
                        wrong.extend(self.wrong(what, item, &format!("{place}[{i}]")));
                    }
                }
                "properties" => {
                    for (key, value) in value.as_object().into_iter().flatten() {
                        let place = format!("{place}.{key}");
                        match what.get(key) {
                            Some(own) => {
                                wrong.extend(self.wrong(own, value, &place));
                                self.met.insert(key.clone());
                            }
                            None => wrong.push(format!("{place} is not in the schema")),
                        }
                    }
                }
                "required" => {
                    let keys = what.as_array().unwrap().iter().filter_map(Value::as_str);
                    let missing = keys.filter(|key| value.get(key).is_none());
                    wrong.extend(missing.map(|key| format!("{place} has no {key}")));
                }
                "enum" | "minimum" | "$schema" | "title" | "description" | "$defs" => {}
                _ => panic!("what is {word}?"),
            }
        }
        wrong
    }

    /// What is wrong with a document.
    fn document(&mut self, document: &Value) -> Vec<String> {
        let schema = self.schema;
        self.wrong(schema, document, "")
    }
}

/// Whether a value is of this type.
fn is(value: &Value, word: &str) -> bool {
    match word {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        "number" => value.is_number(),
        "integer" => value.is_u64(),
        _ => panic!("what is {word}?"),
    }
}

/// All names of properties of a schema.
fn properties(schema: &Value, all: &mut BTreeSet<String>) {
    for (word, what) in schema.as_object().into_iter().flatten() {
        if word == "properties" {
            all.extend(what.as_object().unwrap().keys().cloned());
        }
        properties(what, all);
    }
    for item in schema.as_array().into_iter().flatten() {
        properties(item, all);
    }
}

/// What reports of ordinary runs do not have: error bars that may mean nothing, and a global estimate that was given up.
const RARE: [&str; 6] = [
    "doubtful_share",
    "tail_index",
    "excess_kurtosis",
    "few_scores",
    "reason",
    "whole_given_up",
];

#[test]
fn reports_are_what_their_schema_says() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/report.schema.json");
    let schema: Value = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    let mut looking = Looking {
        schema: &schema,
        met: BTreeSet::new(),
    };
    let folder = Folder::new();
    let run = |problem: &str, args: &[&str]| {
        let ran = folder.solve(problem, &[&["--json"], args].concat());
        assert!(matches!(ran.status, Some(0 | 3)), "{ran:?}");
        ran.json()
    };
    let out = folder.at("a.json");
    let whole = ["--global", "--out", &out];
    let line = "[problem]\nkind = 'cube'\ndimension = 1\nkernel = '0.5 * exp(-(x - y)^2)'\nsource = '1 + x'\n\
        solution = '2'\n[walk]\ntarget_error = 1e-5\n[[target]]\nname = 'u'\ngrid = 20\n";
    let plain = line
        .replace("1e-5", "1e-2")
        .replace("grid = 20", "at = 0.5");
    let given = ROOM.replace(
        "emissivity = 0.9\ntemperature = 290",
        "emissivity = 0.9\nnet_flux = 20",
    );
    let given = format!("{given}[[target]]\nname = 'wall'\nover = 'others'\n");
    let doubtful = format!("{given}[uncertainties]\n'others net flux' = 5\n");
    let air = format!("{ROOM}[[target]]\nname = 'air'\nat = [0.3, 0.4]\n");
    let spike = "[problem]\nkind = 'cube'\ndimension = 1\nsource = '1'\n\
        kernel = 'abs(x - 0.5) < 0.001 && abs(y - 0.5) < 0.001 ? 300 : 0.1'\n\
        [galerkin]\ncells = 50\n[walk]\nwalks = 1000\nseed = 3\n[[target]]\nname = 'a'\nat = 0.3\n";
    let stop = ["--walks", "9000000000000", "--time-limit", "0.2"];
    let lifted = circle_with("pairs = \"default\"", "lift = 4");
    let point = "[[target]]\nname = 'a'\nat = [0.5, 0.5, 1]\n";
    let means = SCENE.replace(point, "");
    let mut documents = vec![
        run(CIRCLE, &[]),
        run(&lifted, &["--sequence", "sobol", "--forced-steps", "2"]),
        run(CIRCLE, &stop),
        run(CIRCLE, &whole),
        run(CUBE, &whole),
        run(
            CUBE,
            &[
                "--global",
                "--walks",
                "64",
                "--sequence",
                "sobol",
                "--forced-steps",
                "1",
            ],
        ),
        run(CUBE, &["--global"]),
        run(spike, &["--allow-infinite-variance"]),
        run(line, &[]),
        run(line, &["--method", "walks"]),
        run(line, &["--method", "walks", "--no-global"]),
        run(line, &["--global", "--walks", "1000"]),
        run(&plain, &["--method", "walks"]),
        run(&air, &[]),
        run(&air, &["--global"]),
        run(&given, &["--last-step", "true"]),
        run(&given, &["--global"]),
        run(&given, &["--sensitivities"]),
        run(&doubtful, &[]),
        run(&format!("{given}ask = 'irradiance'\n"), &[]),
        run(SPHERE, &[]),
        run(SPHERE, &["--global"]),
        run(SCENE, &[]),
        run(&means, &["--global"]),
        run(&colours::room(None), &["--cells", "20"]),
        run(
            &adjoint::room("walks = 1000\n"),
            &["--adjoint", "true", "--cells", "20"],
        ),
    ];
    let first = folder.solve(
        CUBE,
        &["--part", "1/2", "--save", &folder.at("p"), "--json"],
    );
    documents.push(first.json());
    let files = parts(&folder, CUBE, 2, &[]);
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    documents.push(fredholm(&[&["merge", "--json"], &files[..]].concat()).json());
    for document in &documents {
        let wrong = looking.document(document);
        assert!(wrong.is_empty(), "{wrong:#?}\n{document:#}");
    }
    // And nothing is in the schema that no report has.
    let mut all = BTreeSet::new();
    properties(&schema, &mut all);
    let ghosts: Vec<_> = all.difference(&looking.met).collect();
    let rare: BTreeSet<String> = RARE.map(str::to_owned).into();
    assert!(ghosts.iter().all(|name| rare.contains(*name)), "{ghosts:?}");

    // It can fail.
    for (key, value) in [
        ("states", None),
        ("states", Some("-1")),
        ("states", Some("\"many\"")),
        ("stop", Some("\"tired\"")),
        ("targets", Some("[{}]")),
        ("new", Some("1")),
    ] {
        let mut document = documents[0].clone();
        let table = document.as_object_mut().unwrap();
        match value {
            Some(value) => table.insert(key.to_owned(), serde_json::from_str(value).unwrap()),
            None => table.remove(key),
        };
        assert!(!looking.document(&document).is_empty(), "{key} {value:?}");
    }
}
