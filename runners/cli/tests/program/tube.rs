//! `kind = "tube"`: transmission against known values, by both methods, and what is refused.

use crate::common;

use common::{Folder, list, number, refused};

fn tube(length: f64, reflectance: f64, rest: &str) -> String {
    format!(
        "[problem]\nkind = 'tube'\nlength = {length:?}\nreflectance = {reflectance}\nends = [0, 1]\n{rest}\n\
         [[target]]\nname = 'left'\nover = 'left'\n[[target]]\nname = 'right'\nover = 'right'\n\
         [[target]]\nname = 'wall'\nover = 'all'\n"
    )
}

/// Of a white tube: what comes through, by Nyström's method with a rule that knows the kink of p; what goes back, 1 less that; and the
/// mean, ½ by symmetry.
#[test]
fn white_tubes_have_clausings_values() {
    let folder = Folder::new();
    let known = [
        (1.0, 0.671_983_901_919),
        (2.0, 0.514_230_534_547),
        (10.0, 0.190_942_431_920),
    ];
    for (length, through) in known {
        let file = tube(length, 1.0, "[walk]\ntarget_error = 1e-6");
        let json = folder.solve(&file, &["--json"]).quietly(0).json();
        let exact = [through, 1.0 - through, 0.5];
        for (target, exact) in list(&json, "targets").iter().zip(exact) {
            let found = &target["preconditioned"];
            let off = (number(found, "estimate") - exact).abs();
            // Twelve digits are known.
            assert!(
                off < 4.5 * number(found, "std_error") + 1e-12,
                "{length} {exact}: {target}"
            );
        }
    }
}

/// By the chain: the part that is absorbed is what the ends do not get. A furnace of other numbers is as hot as its ends.
#[test]
fn a_furnace_is_as_hot_as_its_ends() {
    let folder = Folder::new();
    let furnace = tube(
        3.0,
        0.7,
        "emission = 0.3\n[galerkin]\ncells = 34\n[walk]\nmethod = 'walks'\nwalks = 20000",
    );
    let furnace = furnace.replace("[0, 1]", "[1, 1]");
    let json = folder.solve(&furnace, &["--json"]).quietly(0).json();
    for target in list(&json, "targets") {
        for walks in ["plain", "preconditioned"] {
            let found = &target[walks];
            let off = (number(found, "estimate") - 1.0).abs();
            assert!(off < 4.5 * number(found, "std_error") + 1e-12, "{target}");
        }
        let [plain, best] =
            ["plain", "preconditioned"].map(|walks| number(&target[walks], "std_error"));
        assert!(best < 0.2 * plain, "{target}");
    }
}

#[test]
fn what_is_no_tube_is_refused() {
    let folder = Folder::new();
    for (wrong, right, message) in [
        (
            "length = 2.0",
            "length = 0.0",
            "`length` must be from 1e-6 to 1e6 radii",
        ),
        (
            "reflectance = 1",
            "reflectance = 1.1",
            "`reflectance` must be from 0 to 1",
        ),
        ("ends = [0, 1]", "ends = [1]", "`ends` must be two numbers"),
        ("over = 'left'", "over = 'top'", "`over` must be \"all\""),
        (
            "over = 'left'",
            "at = 2.5",
            "`at` must be one number from 0 to the length, 2",
        ),
    ] {
        let file = tube(2.0, 1.0, "").replacen(wrong, right, 1);
        refused(&folder.solve(&file, &[]), &[message]);
    }
}
