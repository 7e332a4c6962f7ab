//! Form factors as other programs read them: EnergyPlus and uDALES.

use core::fmt::Write as _;

use serde_json::json;

use crate::factors::Factors;
use crate::failure::Failure;

/// The object of EnergyPlus that has form factors.
const OBJECT: &str = "ZoneProperty:UserViewFactors:BySurfaceName";

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
}
