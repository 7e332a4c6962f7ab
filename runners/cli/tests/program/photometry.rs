//! Light in lumens and lux.

use crate::common::{self, Folder};

const KEY: &str = "photometric = true\n";
/// A box with a lamp of 5,000 lm/m², and a meter at the height of a desk.
const OFFICE: &str = r#"[problem]
kind = "scene"
photometric = true
[[problem.surface]]
name = "walls"
box = [[0, 0, 0], [2, 3, 2.5]]
inward = true
reflectance = 0.5
[[problem.surface]]
name = "lamp"
box = [[0.8, 1, 2.2], [1.2, 2, 2.3]]
reflectance = 0.5
emission = 5000
[galerkin]
cells = 60
degree = 1
[walk]
walks = 1024
[[target]]
name = "corner"
at = [0, 0, 0]
[[target]]
name = "desk"
at = { point = [1, 1, 0.8], facing = [0, 0, 1] }
[[target]]
name = "walls"
over = "walls"
"#;

/// The numbers are those without units, u is in lumens per square metre, and what arrives is in lux.
#[test]
fn light_has_units_if_they_are_asked_for() {
    let folder = Folder::new();
    let with = folder.file("office.toml", OFFICE);
    let without = folder.file("plain.toml", OFFICE.replace(KEY, ""));
    let [with_units, plain] = [&with, &without].map(|file| {
        let ran = common::fredholm(&["solve", file, "--json"]);
        ran.quietly(0).json()
    });
    let targets = common::list(&with_units, "targets").iter();
    for (target, other) in targets.zip(common::list(&plain, "targets")) {
        for (kind, unit) in [
            ("plain", "lm/m2"),
            ("preconditioned", "lm/m2"),
            ("irradiance", "lx"),
        ] {
            if other[kind].is_null() {
                assert_eq!((kind, &target["name"]), ("irradiance", &"desk".into()));
                continue;
            }
            assert_eq!(target[kind]["unit"], unit);
            assert!(other[kind]["unit"].is_null());
            assert_eq!(target[kind]["estimate"], other[kind]["estimate"]);
        }
    }
    let table = common::fredholm(&["solve", &with]).quietly(0).stdout;
    assert!(table.contains("preconditioned, lm/m2") && table.contains("irradiance, lx"));
    let surfaces = OFFICE.split("[[target]]").next().unwrap_or_default();
    let all = folder.file(
        "all.toml",
        format!("{surfaces}[[target]]\nname = \"walls\"\nover = \"walls\"\n"),
    );
    let whole = common::fredholm(&["solve", &all, "--global"])
        .quietly(0)
        .stdout;
    assert!(
        whole.contains("global estimate, lm/m2") && whole.contains("irradiance, lx"),
        "{whole}"
    );
}

/// Temperatures give watts, and colours have a channel each.
#[test]
fn units_of_light_go_with_one_channel_of_light() {
    let folder = Folder::new();
    let heat = ("reflectance = 0.5\n[", "temperature = 300\n[");
    let colours = ("reflectance = 0.5\n[", "reflectance = [0.5, 0.4, 0.3]\n[");
    for (from, to) in [heat, colours] {
        let file = folder.file("office.toml", OFFICE.replace(from, to));
        let ran = common::fredholm(&["check", &file]);
        let words = "photometric units are of light in one channel";
        assert!(
            ran.status == Some(2) && ran.stderr.contains(":3:") && ran.stderr.contains(words),
            "{ran:?}"
        );
    }
}
