//! The choice on families of problems: nothing runs for ever, and little is lost.

mod common;

use common::{Folder, list, number};
use serde_json::Value;

/// Kernels without their constant, and the spectral radius of K² where the constant is 1: the constant is below one over its
/// root if walks of some absorption are to have a finite variance.
const KERNELS: [(&str, &str, f64); 5] = [
    ("1", "exp(-(x-y)^2)", 0.7724),
    ("1", "1/(1+4*(x-y)^2)", 0.5678),
    ("1", "cos(x-y)", 0.8581),
    ("1", "exp(x*y)", 2.0853),
    ("2", "exp(-(x1-y1)^2-(x2-y2)^2)", 0.5965),
];

/// A constant was fatal from about where K²/(1 − 0.7) has a spectral radius above 1: the shortest walks were refused, and
/// longer plain walks taken in place of longer walks of a neighbour equation.
#[test]
fn a_kernel_of_any_size_has_a_neighbour_equation() {
    for (dimension, kernel, radius) in KERNELS {
        for share in [0.4, 0.6, 0.75, 0.9, 0.97, 0.99] {
            let constant = share / f64::sqrt(radius);
            let at = if dimension == "1" {
                "0.5"
            } else {
                "[0.5, 0.5]"
            };
            let source = if dimension == "1" { "1+x" } else { "1+x1" };
            let text = format!(
                "problem = {{ kind = \"cube\", dimension = {dimension}, kernel = \"{constant}*{kernel}\", source = \
                 \"{source}\" }}\ntarget = [{{ name = \"m\", at = {at} }}]\n"
            );
            for error in ["1e-4", "1e-7"] {
                let report = solve(&text, error);
                assert_eq!(report["split"]["method"], "preconditioned", "{text}");
                let walks = number(&list(&report, "targets")[0], "walks");
                assert!(walks < 1e7, "{walks}: {text}");
            }
        }
    }
}

/// The report of `solve` with this error.
fn solve(problem: &str, error: &str) -> Value {
    let args = ["--target-error", error, "--json"];
    Folder::new().solve(problem, &args).quietly(0).json()
}
