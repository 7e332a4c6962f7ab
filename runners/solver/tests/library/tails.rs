//! Reports say where an error bar does not see the tail of the scores.

use fredholm::{CubeModel, Estimator, Report, Solver};

/// A strip of this width shines upon so much beside it, and the neighbour equation of one cell knows nothing of where.
fn strip(width: f64, beside: f64) -> CubeModel {
    CubeModel::from_fn::<1>(
        |_, _| 0.5,
        move |x| beside * x[0] + if x[0] < width { 1.0 / width } else { 0.0 },
    )
}

fn solved(width: f64, beside: f64, walks: u64) -> Report {
    let model = strip(width, beside);
    let solver = Solver::new(&model).mean().cells(1).absorption(0.5);
    let report = solver.estimator(Estimator::Absorption).walks(walks).solve();
    report.unwrap()
}

#[test]
fn rare_large_scores_are_told_in_report_table_and_json() {
    let report = solved(2e-5, 0.1, 1 << 17);
    let kurtosis = report.goals[0].excess_kurtosis.unwrap();
    // Scores of 1/p with probability p have the excess kurtosis 1/p; here p is of the size of the strip.
    assert!((1e4..2e5).contains(&kurtosis), "{kurtosis}");
    assert!(
        report
            .to_string()
            .contains("warning: 1 target: large scores are rare")
    );
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["targets"][0]["excess_kurtosis"], kurtosis);
    let usual = solved(0.5, 0.1, 1 << 17);
    assert_eq!(
        (usual.goals[0].excess_kurtosis, usual.goals[0].few_scores),
        (None, None)
    );
    let json = serde_json::to_value(&usual).unwrap();
    assert!(json["targets"][0].get("excess_kurtosis").is_none());
    assert!(!usual.to_string().contains("warning"), "{usual}");
}

#[test]
fn few_scores_are_told() {
    // The rule of one point does not see the strip, so that v is 0, and one walk in a thousand scores.
    let report = solved(1e-3, 0.0, 20_000);
    let few = report.goals[0].few_scores.unwrap();
    assert!((1..64).contains(&few), "{few}");
    assert!(
        report.to_string().contains("so few walks scored"),
        "{report}"
    );
}
