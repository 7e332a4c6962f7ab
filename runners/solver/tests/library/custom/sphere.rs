//! Scattering on the unit sphere by a chain that prefers its hemisphere.

use core::f64::consts::{PI, TAU};
use core::fmt;
use core::marker::PhantomData;

use fredholm::{CustomModel, Error, Estimator, Model, Pairs, Region, Scalar, SolveError, Solver};
use fredholm_core::galerkin::{Basis, Cells, TransitionMoments};
use fredholm_core::global::Stationary;
use fredholm_core::{Chain, Density, Equation, Located, Real, Space, Uniforms};

/// K(x,y) = a (1 + 3g x·y)/4π and F(x) = e₀ + e·x, whose solution is e₀/(1 − a) + e·x/(1 − ag).
const ALBEDO: f64 = 0.6;
const ASYMMETRY: f64 = 0.3;
const EMISSION: [f64; 4] = [1.0, 0.4, 0.0, -0.7];
/// p(x,y) = (1 + b x₃y₃)/4π.
const FORWARD: f64 = 0.5;

/// The sphere in bands of equal height and sectors of equal angle.
struct Scattering<F> {
    bands: usize,
    sectors: usize,
    scalar: PhantomData<F>,
}

/// No such number of cells.
#[derive(Debug)]
struct Refused(usize);

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is no square", self.0)
    }
}

impl core::error::Error for Refused {}

impl<F: Real> Scattering<F> {
    fn new(cells: usize) -> Result<Self, Refused> {
        let bands = cells.isqrt();
        if bands == 0 || bands * bands != cells {
            return Err(Refused(cells));
        }
        Ok(Self {
            bands,
            sectors: bands,
            scalar: PhantomData,
        })
    }

    fn point_of(height: f64, turn: f64) -> [F; 3] {
        let radius = ((1.0 - height) * (1.0 + height)).sqrt();
        let (sin, cos) = (TAU * turn).sin_cos();
        [radius * cos, radius * sin, height].map(F::from_f64)
    }
}

fn dot<F: Real>(x: &[F; 3], y: &[F; 3]) -> F {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
}

fn solution(x: &[f64; 3]) -> f64 {
    let [e0, e1, e2, e3] = EMISSION;
    e0 / (1.0 - ALBEDO) + dot(&[e1, e2, e3], x) / (1.0 - ALBEDO * ASYMMETRY)
}

impl<F: Real> Space for Scattering<F> {
    type Scalar = F;
    type Point = [F; 3];
}

impl<F: Real> Chain for Scattering<F> {
    fn step<U: Uniforms<F>>(&self, x: &[F; 3], uniforms: &mut U) -> Option<[F; 3]> {
        // The root h of (h + 1)/2 + c (h² − 1)/4 = u with c = b x₃.
        let (c, u) = (FORWARD * x[2].to_f64(), uniforms.uniform().to_f64());
        let e = 2.0 - c - 4.0 * u;
        let height = (-e / (1.0 + (1.0 - c * e).sqrt())).clamp(-1.0, 1.0);
        Some(Self::point_of(height, uniforms.uniform().to_f64()))
    }
}

impl<F: Real> Density for Scattering<F> {
    fn density(&self, x: &[F; 3], y: &[F; 3]) -> F {
        let forward = F::from_f64(FORWARD) * x[2] * y[2];
        (F::one() + forward) / F::from_f64(4.0 * PI)
    }
}

impl<F: Real> Equation for Scattering<F> {
    type Value = F;

    fn kernel(&self, x: &[F; 3], y: &[F; 3]) -> F {
        let scattered = F::one() + F::from_f64(3.0 * ASYMMETRY) * dot(x, y);
        let forward = F::one() + F::from_f64(FORWARD) * x[2] * y[2];
        F::from_f64(ALBEDO) * scattered / forward
    }

    fn source<U: Uniforms<F>>(&self, x: &[F; 3], _: &mut U) -> F {
        let [e0, e1, e2, e3] = EMISSION.map(F::from_f64);
        e0 + dot(&[e1, e2, e3], x)
    }
}

impl<F: Real> Cells for Scattering<F> {
    const DIMENSION: usize = 2;

    fn cells(&self) -> usize {
        self.bands * self.sectors
    }

    fn locate(&self, x: &[F; 3]) -> usize {
        let [x, y, z] = x.map(|x| x.to_f64());
        let band = (0.5 * (z + 1.0) * self.bands as f64) as usize;
        let turn = (y.atan2(x) / TAU).rem_euclid(1.0);
        let sector = (turn * self.sectors as f64) as usize;
        band.min(self.bands - 1) * self.sectors + sector.min(self.sectors - 1)
    }

    fn measure(&self, _: usize) -> f64 {
        4.0 * PI / self.cells() as f64
    }

    fn point(&self, cell: usize, t: &[f64]) -> [F; 3] {
        let (band, sector) = (cell / self.sectors, cell % self.sectors);
        let height = 2.0 * (band as f64 + t[0]) / self.bands as f64 - 1.0;
        Self::point_of(height, (sector as f64 + t[1]) / self.sectors as f64)
    }

    /// Colatitude and azimuth.
    fn at(&self, coordinates: &[f64]) -> Option<[F; 3]> {
        match *coordinates {
            [colatitude, azimuth]
                if (0.0..=PI).contains(&colatitude) && (0.0..=TAU).contains(&azimuth) =>
            {
                Some(Self::point_of(colatitude.cos(), azimuth / TAU))
            }
            _ => None,
        }
    }

    fn parameters(&self, x: &Located<[F; 3]>, t: &mut [F]) {
        let [y0, y1, height] = x.point.map(|x| x.to_f64());
        let turn = (y1.atan2(y0) / TAU).rem_euclid(1.0);
        let (band, sector) = (x.cell / self.sectors, x.cell % self.sectors);
        t[0] = F::from_f64(0.5 * (height + 1.0) * self.bands as f64 - band as f64);
        t[1] = F::from_f64(turn * self.sectors as f64 - sector as f64);
    }
}

/// p is symmetric.
impl<F: Real> Stationary for Scattering<F> {
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> [F; 3] {
        let height = 2.0 * uniforms.uniform().to_f64() - 1.0;
        Self::point_of(height, uniforms.uniform().to_f64())
    }

    fn start_density(&self, _: &[F; 3]) -> f64 {
        1.0 / (4.0 * PI)
    }

    fn is_preserved(&self) -> bool {
        true
    }
}

impl<F: Real> Basis for Scattering<F> {}

impl<F: Real> TransitionMoments for Scattering<F> {
    fn moments(&self, x: &Located<[F; 3]>, j: usize) -> [[F; 1]; 1] {
        let middle = 2.0 * ((j / self.sectors) as f64 + 0.5) / self.bands as f64 - 1.0;
        let forward = F::one() + F::from_f64(FORWARD * middle) * x.point[2];
        [[forward / F::from_f64(self.cells() as f64)]]
    }
}

fn model() -> CustomModel<Scattering<f64>> {
    CustomModel::from_cells(Scattering::<f64>::new)
        .named("scattering")
        .by_its_chain()
        .with_solution(solution)
        .weight("height", |x: &[f64; 3]| x[2] / (4.0 * PI))
        .with_coordinates([[0.1, PI - 0.1], [0.0, 6.0]])
}

/// Every goal of a report is within so many standard errors of its exact value.
fn agrees(report: &fredholm::Report, most: f64) {
    for goal in &report.goals {
        let of = goal.preconditioned;
        let (exact, bar) = (goal.exact.unwrap(), of.std_error.unwrap());
        let error = (of.estimate.unwrap() - exact).abs();
        assert!(error < most * bar, "{}: {error} of {bar}", goal.name);
    }
}

#[test]
fn what_is_open_is_chosen_and_the_error_is_reached() {
    let model = model();
    let solver = Solver::new(&model).at([1.0, 2.0]).mean().weighted("height");
    const ERROR: f64 = 5e-4;
    let report = solver.clone().solve_to(ERROR).unwrap();
    assert_eq!(report.problem, "scattering");
    // ∫ x₃ u dμ/4π = e₃/3 (1 − ag)⁻¹.
    let exact = EMISSION[3] / 3.0 / (1.0 - ALBEDO * ASYMMETRY);
    assert!((report.goals[2].exact.unwrap() - exact).abs() < 1e-12);
    for goal in &report.goals {
        assert!(goal.preconditioned.std_error.unwrap() <= ERROR, "{goal:?}");
    }
    agrees(&report, 4.0);
    let choice = report.choice.unwrap();
    assert_eq!(choice.method, "preconditioned");
    let (settings, predicted) = solver.predict_to(ERROR).unwrap().unwrap();
    assert_eq!(settings.cells, Some(report.cells));
    assert_eq!(predicted.predicted_walks, choice.predicted_walks);
}

/// A group of walks.
const WALKS: u64 = 1 << 13;
const GROUPS: u64 = 32;

/// The standard deviation of these groups' walks, with what a prediction may differ from it: 2 %, or what the groups leave
/// open, as for the other kinds of equations.
fn measured(deviations: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
    let groups = GROUPS as f64;
    let variances = deviations.map(|deviation| deviation * deviation);
    let mean = variances.clone().sum::<f64>() / groups;
    let squares = variances.map(|variance| (variance - mean).powi(2));
    let spread = squares.sum::<f64>() / (groups - 1.0) / (mean * mean);
    // Var s² = σ⁴ (κ − 1)/n: where the kurtosis κ is large a sample misses the rarest scores.
    let kurtosis = 1.0 + spread * WALKS as f64;
    let own = 0.5 * (spread / groups).sqrt();
    let allowed = 3.0 * own * (kurtosis / 30.0).max(1.0).sqrt();
    [mean.sqrt(), allowed.max(0.02)]
}

#[test]
fn a_diagnosis_predicts_the_deviations_of_walks() {
    let model = model();
    for (cells, estimator) in [(16, Estimator::Absorption), (100, Estimator::Collision)] {
        let solver = Solver::new(&model)
            .at([1.0, 2.0])
            .mean()
            .weighted("height")
            .cells(cells)
            .absorption(0.3)
            .estimator(estimator)
            .walks(WALKS);
        let of_seed = |seed| solver.clone().seed(seed).solve().unwrap();
        let reports: Vec<_> = (0..GROUPS).map(of_seed).collect();
        let predicted = solver.diagnose_in(800).unwrap();
        // Of many cells some neighbours are one place.
        let place = if cells == 16 { "cell " } else { "cells " };
        let mut places = predicted.targets[0].places.iter();
        assert!(places.all(|of| of.from.starts_with(place)));
        for (number, predicted) in predicted.targets.iter().enumerate() {
            let goals = reports.iter().map(|report| &report.goals[number]);
            let plain = measured(goals.clone().map(|goal| goal.plain.std_dev.unwrap()));
            let both = measured(goals.map(|goal| goal.preconditioned.std_dev.unwrap()));
            for (predicted, [measured, allowed]) in
                [(predicted.plain, plain), (predicted.preconditioned, both)]
            {
                let off = predicted.unwrap() / measured - 1.0;
                assert!(
                    off.abs() < allowed,
                    "{cells} cells, {estimator:?}, goal {number}: {off} of {allowed}"
                );
            }
        }
    }
}

#[test]
fn a_sweep_falls_like_one_over_the_root_of_the_cells() {
    let model = model();
    let rates = Solver::new(&model).sweep(&[16, 64, 256, 1024], 20_000);
    let rates = rates.unwrap();
    assert_eq!(rates.fits.std_dev_theory, -0.5);
    let fitted = rates.fits.std_dev.unwrap();
    assert!((fitted + 0.5).abs() < 0.1, "{fitted}");
}

#[test]
fn a_grid_goes_over_all_coordinates() {
    let model = model();
    let report = Solver::new(&model).grid(5).cells(36).walks(20_000).solve();
    let report = report.unwrap();
    assert_eq!(report.goals.len(), 25);
    agrees(&report, 4.5);
    let last = report.goals.last().unwrap();
    assert_eq!(last.name, "u[24]");
}

#[test]
fn walks_in_single_precision_need_the_equation_in_it() {
    let double = model();
    let asked = |model| {
        Solver::new(model)
            .at([1.0, 2.0])
            .mean()
            .weighted("height")
            .cells(64)
            .walks(50_000)
            .scalar(Scalar::F32)
            .solve()
    };
    let error = asked(&double).unwrap_err();
    assert!(error.to_string().contains("with_f32"), "{error}");
    let without = model().with_f32(CustomModel::from_cells(Scattering::<f32>::new));
    let error = asked(&without).unwrap_err();
    assert!(error.to_string().contains("the weights"), "{error}");
    let single = CustomModel::from_cells(Scattering::<f32>::new)
        .weight("height", |x: &[f32; 3]| f64::from(x[2]) / (4.0 * PI));
    let both = model().with_f32(single);
    let report = asked(&both).unwrap();
    assert_eq!(report.scalar, "f32");
    agrees(&report, 4.0);
}

#[test]
fn what_the_equation_does_not_have_is_refused() {
    let model = model();
    let cases = [
        (
            Solver::new(&model).at(1.0),
            "no point with the coordinates [1.0]",
        ),
        (
            Solver::new(&model).at([4.0, 1.0]),
            "no point with the coordinates",
        ),
        (
            Solver::new(&model).weighted("width"),
            "the weights are height",
        ),
        (
            Solver::new(&model).over("north"),
            "this equation has no parts",
        ),
        (
            Solver::new(&model).goal("arc", Region::Arc(0.0, 1.0)),
            "has points, weights",
        ),
        (Solver::new(&model).mean().cells(7), "7 is no square"),
        (
            Solver::new(&model).mean().degree(1),
            "does not have this degree",
        ),
        (
            Solver::new(&model).mean().pairs(Pairs::Pointwise),
            "with_pair_integrals",
        ),
    ];
    for (solver, words) in cases {
        let error = solver.walks(1000).solve().unwrap_err();
        assert!(error.to_string().contains(words), "{words}: {error}");
    }
    let error = Solver::new(&model).mean().cells(7).solve().unwrap_err();
    let SolveError::Failed(Error::Equation(own)) = &error else {
        panic!("{error:?}");
    };
    let source = core::error::Error::source(own).unwrap();
    assert!(source.downcast_ref::<Refused>().is_some());
}

/// Points, the mean and a weight from one set of walks in both scalars, with suffixes and with starts alone. Šidák: 400 values
/// of Student's t with 63 degrees of freedom are below 5.4 but with probability 10⁻³.
#[test]
fn one_set_of_walks_gives_the_whole_function() {
    let single = || {
        CustomModel::from_cells(Scattering::<f32>::new)
            .weight("height", |x: &[f32; 3]| f64::from(x[2]) / (4.0 * PI))
    };
    let alone = model().with_f32(single());
    let all = model().with_starts().with_f32(single().with_starts());
    for (model, scalar) in [
        (&alone, Scalar::F64),
        (&all, Scalar::F64),
        (&all, Scalar::F32),
    ] {
        let solver = Solver::new(model).cells(16).scalar(scalar).walks(1 << 14);
        let whole = solver.whole().unwrap();
        let summary = whole.summary();
        assert_eq!(summary.remarks(), [""; 0], "{summary:?}");
        let mut values = whole.grid(10).unwrap();
        for region in [Region::Whole, Region::Weight(0)] {
            values.push((region.clone(), whole.functional(&region).unwrap()));
        }
        for (region, value) in values {
            let exact = model.exact(&region).unwrap().unwrap();
            let z = (value.estimate - exact) / value.std_error.unwrap();
            assert!(z.abs() < 5.4, "{region:?} {value:?} {exact}");
        }
    }
}

#[test]
fn many_targets_are_answered_together() {
    let model = model().with_starts();
    let mut solver = Solver::new(&model);
    for i in 0..40 {
        solver = solver.at([0.1 + 0.07 * f64::from(i), 0.15 * f64::from(i)]);
    }
    let report = solver.solve_to(1e-3).unwrap();
    let choice = report.choice.as_ref().unwrap();
    assert_eq!(choice.method, "global estimate", "{choice:?}");
    agrees(&report, 5.0);
}
