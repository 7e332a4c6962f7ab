//! Quantities from measured targets: synthetic furnaces whose emissivities are known.

use crate::common::{Draws, is_long};
use fredholm::room::{Material, Surfaces};
use fredholm::{
    Fitting, Measured, Measurement, Model, Pairs, Quantity, RoomModel, Scalar, Solver, Uncertainty,
    Unknown,
};

const REFRACTORY: [&str; 5] = ["sill", "end", "roof east", "roof west", "back"];
const UNKNOWN: [&str; 2] = ["load emissivity", "burner emissivity"];

/// A furnace of random size, whose burner is a part of one of its ends.
#[derive(Clone, Copy)]
struct Furnace {
    width: f64,
    height: f64,
    burner: [f64; 2],
    load: f64,
    flame: f64,
}

impl Furnace {
    fn new(draws: &mut Draws) -> Self {
        let height = draws.between(1.0, 3.0);
        let low = height * draws.between(0.15, 0.4);
        Self {
            width: draws.between(1.5, 5.0),
            height,
            burner: [low, low + height * draws.between(0.15, 0.4)],
            load: draws.between(400.0, 900.0),
            flame: draws.between(1200.0, 1800.0),
        }
    }

    fn model(&self, [load, burner]: [f64; 2]) -> RoomModel {
        let Self {
            width: w,
            height: h,
            burner: [low, high],
            ..
        } = *self;
        let heat = Surfaces {
            heat: true,
            ..Surfaces::default()
        };
        let mut surfaces = heat
            .with(
                "load",
                &[[0.0, 0.0], [w, 0.0]],
                Material::grey(load, self.load),
            )
            .with(
                "burner",
                &[[w, low], [w, high]],
                Material::grey(burner, self.flame),
            );
        let walls = [
            [[w, 0.0], [w, low]],
            [[w, high], [w, h]],
            [[w, h], [0.5 * w, h]],
            [[0.5 * w, h], [0.0, h]],
            [[0.0, h], [0.0, 0.0]],
        ];
        for (name, wall) in REFRACTORY.iter().zip(walls) {
            surfaces = surfaces.with(name, &wall, Material::flux(0.0));
        }
        RoomModel::new(surfaces, Scalar::F64).unwrap()
    }

    fn solver<'m>(&self, model: &'m dyn Model, seed: u64) -> Solver<'m> {
        let solver = Solver::new(model)
            .seed(seed)
            .cells(60)
            .degree(1)
            .pairs(Pairs::Default)
            .walks(4000);
        REFRACTORY
            .iter()
            .fold(solver, |solver, name| solver.over(name))
    }
}

/// The quantity of this name as one that is looked for.
fn unknown(all: &[Quantity], name: &str) -> Unknown {
    let quantity = all.iter().find(|own| own.name == name);
    Unknown {
        quantity: quantity.unwrap().clone(),
        known_to: None,
    }
}

/// (λ̂ − λ)ᵀ C⁻¹ (λ̂ − λ) of two quantities.
fn distance(found: [f64; 2], c: &[Vec<f64>]) -> f64 {
    let [x, y] = found;
    let determinant = c[0][0] * c[1][1] - c[0][1] * c[1][0];
    (c[1][1] * x * x - 2.0 * c[0][1] * x * y + c[0][0] * y * y) / determinant
}

/// Emissivities of furnaces from five temperatures, with the temperature of the burner uncertain in half of them.
#[test]
fn ellipses_of_emissivities_cover_the_truth() {
    // Bounds of the binomial distribution with 95 % that are missed once in a thousand times, or more seldom.
    let (count, least) = if is_long() { (200, 178) } else { (3, 1) };
    let (mut covered, mut in_interval, mut solutions, mut chi_square) = (0, 0, 0, 0.0);
    for number in 0..count {
        let mut draws = Draws::new(53, number);
        let furnace = Furnace::new(&mut draws);
        let truth = [(); 2].map(|()| draws.between(0.3, 0.9));
        let error = draws.between(0.5, 3.0);
        let of_flame = if number % 2 == 0 {
            0.0
        } else {
            draws.between(2.0, 10.0)
        };
        // The burner is hotter or colder than the model has it.
        let real = Furnace {
            flame: furnace.flame + of_flame * draws.normal(),
            ..furnace
        };
        let model = real.model(truth);
        let measured = real
            .solver(&model, 1_000_000 + number)
            .walks(if is_long() { 100_000 } else { 40_000 })
            .solve()
            .unwrap();
        let measurements = REFRACTORY.map(|name| Measurement {
            target: name.to_owned(),
            what: Measured::Temperature,
            value: measured[name].temperature.unwrap().estimate.unwrap() + error * draws.normal(),
            std_error: error,
        });
        let start = furnace.model([0.6; 2]);
        let quantities = start.quantities();
        let unknowns = UNKNOWN.map(|name| unknown(&quantities, name));
        let uncertain = Uncertainty {
            quantity: "burner temperature".to_owned(),
            std_error: of_flame,
        };
        let fitting = Fitting {
            unknowns: unknowns.to_vec(),
            measurements: measurements.to_vec(),
            uncertainties: if of_flame > 0.0 {
                vec![uncertain]
            } else {
                Vec::new()
            },
        };
        let fit = fitting
            .fit(&mut |values| {
                let model = furnace.model([values[0], values[1]]);
                furnace
                    .solver(&model, number)
                    .with_sensitivities(true)
                    .solve()
            })
            .unwrap();
        let found = [0, 1].map(|i| fit.quantities[i].value - truth[i]);
        let is_covered = distance(found, &fit.covariance) <= 5.991;
        covered += usize::from(is_covered);
        for (own, truth) in fit.quantities.iter().zip(truth) {
            let [low, high] = own.interval;
            in_interval += usize::from(low <= truth && truth <= high);
        }
        solutions += fit.solutions;
        chi_square += fit.chi_square;
    }
    println!(
        "{covered} of {count} ellipses, {in_interval} of {} intervals, {solutions} solutions, χ² in the mean {}",
        2 * count,
        chi_square / count as f64
    );
    assert!(covered >= least, "{covered} of {count}");
    // Of 3 degrees of freedom each: 4.9 standard deviations of the mean.
    let deviation = (chi_square / count as f64 - 3.0) / (6.0 / count as f64).sqrt();
    assert!(deviation.abs() < 4.9, "{deviation}");
}

#[test]
fn what_is_not_told_is_refused() {
    let mut draws = Draws::new(53, 1);
    let furnace = Furnace::new(&mut draws);
    let model = furnace.model([0.5; 2]);
    let quantities = model.quantities();
    let measured = |target: &str| Measurement {
        target: target.to_owned(),
        what: Measured::Temperature,
        value: 900.0,
        std_error: 2.0,
    };
    let refusal = |unknowns: &[&str], measurements: &[&str]| {
        let fitting = Fitting {
            unknowns: unknowns
                .iter()
                .map(|name| unknown(&quantities, name))
                .collect(),
            measurements: measurements.iter().copied().map(measured).collect(),
            uncertainties: Vec::new(),
        };
        let solve = &mut |_: &[f64]| {
            let solver = furnace.solver(&model, 1);
            solver.walks(1000).with_sensitivities(true).solve()
        };
        fitting.fit(solve).unwrap_err().to_string()
    };
    let one = refusal(&UNKNOWN, &["sill"]);
    assert_eq!(one, "2 quantities do not follow from 1 measurements");
    let nowhere = refusal(&UNKNOWN[..1], &["door"]);
    assert_eq!(nowhere, "there is no target \"door\"");
    let given = refusal(&["sill net flux"], &["sill", "end"]);
    assert!(given.contains("its emissivity is not known"), "{given}");
    let same = refusal(&UNKNOWN, &["sill", "sill"]);
    assert!(
        same.contains("do not tell load emissivity, burner emissivity from each other"),
        "{same}"
    );
}
