//! Form factors as other programs read them: EnergyPlus, uDALES and OpenFOAM.

use core::fmt::{Display, Write as _};
use std::collections::BTreeMap;

use serde_json::json;

use crate::factors::Factors;
use crate::failure::Failure;

/// The object of EnergyPlus that has form factors.
const OBJECT: &str = "ZoneProperty:UserViewFactors:BySurfaceName";

/// A file of OpenFOAM in `constant`.
pub(crate) struct FoamFile {
    pub(crate) name: &'static str,
    class: &'static str,
}

const fn foam(name: &'static str, class: &'static str) -> FoamFile {
    FoamFile { name, class }
}

/// What OpenFOAM's model `viewFactor` reads: factors, whom they are to, which faces are one, and what processes exchange, as those of
/// openfoam.com (from v2206 on) and openfoam.org have it.
pub(crate) const FOAM: [FoamFile; 7] = [
    foam("F", "scalarListList"),
    foam("globalFaceFaces", "labelListList"),
    foam("finalAgglom", "labelListList"),
    foam("mapDist", "mapDistribute"),
    foam("subMap", "labelListList"),
    foam("constructMap", "labelListList"),
    foam("constructMapDim", "labelList"),
];

/// A list of OpenFOAM.
fn list<T: Display>(items: impl ExactSizeIterator<Item = T>) -> String {
    let mut text = format!("{}(", items.len());
    for (k, item) in items.enumerate() {
        let _ = write!(text, "{}{item}", if k > 0 { " " } else { "" });
    }
    text + ")"
}

/// A list of lists of OpenFOAM, one on a line.
fn lists(rows: impl ExactSizeIterator<Item = String>) -> String {
    let mut text = format!("{}\n(\n", rows.len());
    for row in rows {
        text += &row;
        text.push('\n');
    }
    text + ")\n"
}

/// What separates fields of an IDF file, ends objects, and begins comments.
const SEPARATORS: [char; 4] = [',', ';', '!', '\n'];

impl Factors {
    /// The names of both surfaces and the factor of every pair, row by row; of factors that are not 0, which EnergyPlus takes for granted.
    fn pairs(&self) -> impl Iterator<Item = (&str, &str, f64)> {
        let rows = self.row_names().iter().enumerate();
        rows.flat_map(move |(i, from)| {
            let pair = move |(j, factor): (usize, f64)| {
                let to = self.surfaces.get(j).map_or("", String::as_str);
                (from.as_str(), to, factor)
            };
            self.factors.row(i).map(pair)
        })
    }

    /// An IDF object of EnergyPlus with the factors of a zone.
    pub(crate) fn idf(&self, zone: &str) -> Result<String, Failure> {
        let mut names = self.surfaces.iter().map(String::as_str).chain([zone]);
        if let Some(name) = names.find(|name| name.contains(SEPARATORS)) {
            return Err(Failure::input(format_args!(
                "`--out`: {name:?} has a comma, a semicolon or an exclamation mark, which end names in IDF files: write .epJSON"
            )));
        }
        let mut text = format!("{OBJECT},\n  {zone}");
        for (from, to, factor) in self.pairs() {
            let _ = write!(text, ",\n  {from}, {to}, {factor:.9}");
        }
        Ok(text + ";\n")
    }

    /// An epJSON document of EnergyPlus with the factors of a zone.
    pub(crate) fn epjson(&self, zone: &str) -> String {
        let pair = |(from, to, factor): (&str, &str, f64)| json!({ "from_surface": from, "to_surface": to, "view_factor": factor });
        let own = json!({
            "zone_or_zonelist_or_space_or_spacelist_name": zone,
            "view_factors": self.pairs().map(pair).collect::<Vec<_>>(),
        });
        let object = format!("View factors of {zone}");
        let mut text = json!({ OBJECT: { object: own } }).to_string();
        text.push('\n');
        text
    }

    /// The sparse factors of uDALES, `vfsparse.inp`: the numbers of both facets, from 1, and the factor.
    pub(crate) fn vfsparse(&self) -> String {
        let mut text = String::new();
        for i in 0..self.factors.len() {
            for (j, factor) in self.factors.row(i).filter(|(_, factor)| *factor >= 5e-7) {
                let _ = writeln!(text, "{} {} {factor:.6}", i + 1, j + 1);
            }
        }
        text
    }

    /// The sky factors of uDALES, `svf.inp`: what of each facet meets no other.
    pub(crate) fn svf(&self) -> String {
        let mut text = "# sky view factors\n".to_owned();
        for i in 0..self.factors.len() {
            let met: f64 = self.factors.row(i).map(|(_, factor)| factor).sum();
            let _ = writeln!(text, "{:.6}", f64::max(1.0 - met, 0.0));
        }
        text
    }

    /// The files of [`FOAM`] for a case that is not decomposed, whose faces are the polygons of the file, surface by surface.
    pub(crate) fn foam(&self) -> [String; FOAM.len()] {
        let Some(space) = &self.space else {
            return FOAM.map(|_| String::new());
        };
        let count = space.drawn.counts.iter().sum();
        let (mut rows, mut areas) = (vec![BTreeMap::<usize, f64>::new(); count], vec![0.0; count]);
        for (i, (&own, area)) in space.drawn.part_of.iter().zip(&space.areas).enumerate() {
            areas[own] += area;
            for (j, factor) in self.factors.row(i) {
                *rows[own].entry(space.drawn.part_of[j]).or_default() += area * factor;
            }
        }
        let rows = || rows.iter().zip(&areas);
        let own = list(0..count);
        let one = lists([own.clone()].into_iter());
        let contents = [
            lists(rows().map(|(row, area)| list(row.values().map(|own| own / area)))),
            lists(rows().map(|(row, _)| list(row.keys()))),
            lists(space.drawn.counts.iter().map(|&count| list(0..count))),
            // Its length, what is sent and received; no flips, the communicator of all, no transformations.
            format!("{count}\n{one}{one}0 0 0\n0()\n0()\n"),
            one.clone(),
            one,
            list([count].into_iter()) + "\n",
        ];
        let mut contents = contents.into_iter();
        FOAM.map(|FoamFile { name, class }| {
            let head = format!(
                "FoamFile\n{{\n    version 2.0;\n    format ascii;\n    class {class};\n    location \"constant\";\n    object {name};\n}}\n\n"
            );
            head + &contents.next().unwrap_or_default()
        })
    }
}
