//! Means of a global estimate over the cells of grids.

use core::f64::consts::{PI, TAU};

use fredholm::room::{Material, Surfaces};
use fredholm::{CubeModel, Error, Region, RoomModel, Scalar, Solver};

/// Means over the cells of grids: around the circle past the angle 0, against the mean over an arc, which knows where u jumps; of
/// a box against the integral of sin.
#[test]
fn means_over_cells_are_those_of_the_solution() {
    let model = super::circle();
    let whole = Solver::new(&model).cells(40).walks(20_000);
    let whole = whole.whole().unwrap();
    let ends = [0.5, 1.7, 6.0, 0.5];
    let cells = ends.windows(2).map(|ends| ends.iter().copied());
    let cells: Vec<Vec<Region>> = cells
        .map(|ends| ends.map(|s| Region::Point(vec![s])).collect())
        .collect();
    let means = whole.means_between(&cells).unwrap();
    let u = |s: f64| 5.0 * s - (5.0 * s).cos() / 5.0;
    for (mean, [from, to]) in means.iter().zip([[0.5, 1.7], [1.7, 6.0], [6.0, 0.5 + TAU]]) {
        let exact = (u(to) - u(from)) / (to - from);
        let error = mean.std_error.unwrap();
        assert!(
            (mean.estimate - exact).abs() < 4.5 * error && error < 3e-3,
            "{mean:?} {exact}"
        );
        assert!(
            mean.band.is_none() && mean.quadrature_error < 1e-9,
            "{mean:?}"
        );
    }
    let arc = whole.functional(&Region::Arc(0.5, 1.7)).unwrap();
    assert!((arc.estimate - means[0].estimate).abs() < 1e-9);
    assert!((arc.std_error.unwrap() / means[0].std_error.unwrap() - 1.0).abs() < 1e-9);
    // K = 0.4, u = 2 + Σ sin πx_a + cos πx_3.
    let u = |x: &[f64]| 2.0 + x.iter().map(|x| (PI * x).sin()).sum::<f64>() + (PI * x[2]).cos();
    let source = move |x: &[f64; 3]| u(x) - 0.4 * (2.0 + 6.0 / PI);
    let model = CubeModel::from_fn::<3>(|_, _| 0.4, source);
    let whole = Solver::new(&model).cells(2).degree(1).walks(5_000);
    let whole = whole.whole().unwrap();
    let corner = [0.1, 0.2, 0.3];
    let along = |axis: usize| {
        let mut x = corner;
        x[axis] += 0.4;
        Region::Point(x.to_vec())
    };
    let mut cell = vec![Region::Point(corner.to_vec())];
    cell.extend((0..3).map(along));
    let mean = whole.means_between(core::slice::from_ref(&cell)).unwrap()[0];
    let sine = |a: f64| ((PI * a).cos() - (PI * (a + 0.4)).cos()) / (0.4 * PI);
    let cosine = ((PI * 0.7).sin() - (PI * 0.3).sin()) / (0.4 * PI);
    let exact = 2.0 + corner.into_iter().map(sine).sum::<f64>() + cosine;
    let error = mean.std_error.unwrap();
    assert!(
        (mean.estimate - exact).abs() < 4.5 * error && error < 1e-2,
        "{mean:?} {exact}"
    );
    let black = Material {
        reflectance: 0.5,
        emission: 1.0,
    };
    let walls = Material {
        reflectance: 0.5,
        emission: 0.0,
    };
    let square = Surfaces::default()
        .with("floor", &[[0.0, 0.0], [1.0, 0.0]], black)
        .with(
            "walls",
            &[[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]],
            walls,
        );
    let room = RoomModel::new(square, Scalar::F64).unwrap();
    let lit = Solver::new(&room).cells(40).degree(0).walks(5_000);
    let lit = lit.whole().unwrap();
    let ends = [0.0, 0.1, 1.0 / 3.0, 0.6, 2.0 / 3.0, 1.0];
    let cells = ends
        .windows(2)
        .map(|ends| ends.iter().map(|&s| Region::On(1, s)));
    let cells: Vec<Vec<Region>> = cells.map(Iterator::collect).collect();
    let means = lit.means_between(&cells).unwrap();
    let shares = ends.windows(2).map(|ends| ends[1] - ends[0]);
    let all = means.iter().zip(shares);
    let [mean, off] = all.fold([0.0; 2], |[mean, off], (own, share)| {
        [
            mean + share * own.estimate,
            off + share * own.quadrature_error,
        ]
    });
    // In corners no derivative of u is bounded: rules end before they agree.
    let part = lit.functional(&Region::Part(1)).unwrap();
    assert!(
        (mean - part.estimate).abs() < off && off < part.std_error.unwrap(),
        "{mean} {off} {part:?}"
    );
    for bad in [
        vec![],
        vec![Region::Whole, Region::Whole],
        [cell.clone(), cell].concat(),
    ] {
        let refused = whole.means_between(&[bad]);
        assert!(matches!(refused, Err(Error::Region { .. })), "{refused:?}");
    }
}
