//! Whole functions of a chain that preserves no density that starts have: what it says of itself decides which states are scored.

use core::f64::consts::PI;

use fredholm::{CustomModel, Estimator, Model, Region, SolveError, Solver};
use fredholm_core::galerkin::{Basis, CellMap, Partition, TransitionMoments, legendre};
use fredholm_core::whole::Starts;
use fredholm_core::{Kernel, Located, Sampler, Source, StateSpace, TransitionDensity, Uniforms};

/// What an equation says of its chain.
#[derive(Clone, Copy)]
enum Says {
    /// The density of all its states, which is so.
    States,
    /// That the chain preserves what is uniform, which is not so.
    Preserved,
}

/// u(x) = ∫₀¹ (0.4 + ½ cos πx cos πy) u(y) dy + F(x) with u = 2 + sin πx + cos πx, by steps of density (1 − q)(½ + y) from
/// everywhere.
struct Crowded {
    cells: usize,
    absorption: f64,
    says: Says,
}

fn solution(x: &f64) -> f64 {
    2.0 + (PI * x).sin() + (PI * x).cos()
}

impl Crowded {
    fn of(says: Says) -> impl Fn(usize, f64) -> Result<Self, core::convert::Infallible> {
        move |cells, absorption| {
            Ok(Self {
                cells,
                absorption,
                says,
            })
        }
    }
}

impl StateSpace for Crowded {
    type Scalar = f64;
    type Point = f64;
}

impl Sampler for Crowded {
    fn absorption(&self, _: &f64) -> f64 {
        self.absorption
    }

    fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
        // y/2 + y²/2 = u.
        Some(0.5 * ((1.0 + 8.0 * uniforms.uniform()).sqrt() - 1.0))
    }
}

impl TransitionDensity for Crowded {
    fn density(&self, _: &f64, y: &f64) -> f64 {
        (1.0 - self.absorption) * (0.5 + y)
    }
}

impl Kernel for Crowded {
    fn kernel(&self, x: &f64, y: &f64) -> f64 {
        (0.4 + 0.5 * (PI * x).cos() * (PI * y).cos()) / self.density(x, y)
    }
}

impl Source for Crowded {
    fn source(&self, x: &f64) -> f64 {
        solution(x) - 0.4 * (2.0 + 2.0 / PI) - 0.25 * (PI * x).cos()
    }
}

impl Partition for Crowded {
    fn cells(&self) -> usize {
        self.cells
    }

    fn locate(&self, x: &f64) -> usize {
        ((x * self.cells as f64) as usize).min(self.cells - 1)
    }
}

impl CellMap for Crowded {
    const DIMENSION: usize = 1;

    fn measure(&self, _: usize) -> f64 {
        1.0 / self.cells as f64
    }

    fn point(&self, cell: usize, t: &[f64]) -> f64 {
        (cell as f64 + t[0]) / self.cells as f64
    }

    fn at(&self, coordinates: &[f64]) -> Option<f64> {
        match *coordinates {
            [x] if (0.0..=1.0).contains(&x) => Some(x),
            _ => None,
        }
    }

    fn parameters(&self, x: &Located<f64>, t: &mut [f64]) -> bool {
        t.fill(x.point * self.cells as f64 - x.cell as f64);
        true
    }
}

impl<const B: usize> Basis<B> for Crowded {
    fn basis(&self, x: &Located<f64>) -> [f64; B] {
        legendre(2.0 * (x.point * self.cells as f64 - x.cell as f64) - 1.0)
    }
}

/// Degrees 0 and 1: with t from −1 to 1 on a cell, ½ + y is c + wt, and the mean of √3 t (c + wt) is w/√3.
impl<const B: usize> TransitionMoments<B> for Crowded {
    fn moments(&self, _: &Located<f64>, j: usize) -> [[f64; B]; B] {
        assert!(B <= 2);
        let width = 1.0 / self.cells as f64;
        let middle = 0.5 + (j as f64 + 0.5) * width;
        let of = |a, b| {
            if a == b {
                middle
            } else {
                0.5 * width / 3_f64.sqrt()
            }
        };
        let scale = (1.0 - self.absorption) * width;
        core::array::from_fn(|a| core::array::from_fn(|b| scale * of(a, b)))
    }
}

impl Starts for Crowded {
    fn start<U: Uniforms<f64>>(&self, uniforms: &mut U) -> f64 {
        uniforms.uniform()
    }

    fn start_density(&self, _: &f64) -> f64 {
        1.0
    }

    fn survival(&self) -> Option<f64> {
        match self.says {
            Says::States => None,
            Says::Preserved => Some(1.0 - self.absorption),
        }
    }

    /// 1 for the start, and (1 − q)^l (½ + x) for the l-th state after it.
    fn density_of_states(&self, x: &f64, most: usize) -> Option<f64> {
        let s = 1.0 - self.absorption;
        let further = s * (1.0 - s.powi(most as i32 - 1)) / self.absorption;
        matches!(self.says, Says::States).then_some(1.0 + further * (0.5 + x))
    }
}

/// The largest |z| of points and a mean, and the largest standard error.
fn walked(
    model: &CustomModel<Crowded>,
    (degree, estimator): (usize, Estimator),
    walks: u64,
) -> [f64; 2] {
    let solver = Solver::new(model)
        .cells(8)
        .degree(degree)
        .estimator(estimator);
    let whole = solver.walks(walks).whole().unwrap();
    let mut values = whole.grid(40).unwrap();
    values.push((Region::Whole, whole.functional(&Region::Whole).unwrap()));
    let z = values.iter().map(|(region, value)| {
        let exact = model.exact(region).unwrap().unwrap();
        ((value.estimate - exact) / value.std_error.unwrap()).abs()
    });
    [
        z.fold(0.0, f64::max),
        whole.summary().largest_std_error.unwrap(),
    ]
}

/// Starts alone and all states of a known density are unbiased, the latter with less noise. A chain that claims what is not so is
/// biased by many standard errors: the kit's "preserved density" and "suffix starts" find such a claim before any walk.
///
/// Šidák: 164 values of Student's t with 63 degrees of freedom are below 5.1 but with probability 10⁻³.
#[test]
fn what_a_chain_says_decides_which_states_are_scored() {
    let model = |says| {
        let model = CustomModel::new(Crowded::of(says)).with_functions::<2>();
        model.with_solution(solution)
    };
    let (alone, known) = (model(Says::States), model(Says::States).with_starts());
    let wrong = model(Says::Preserved).with_starts();
    for (degree, estimator) in [(0, Estimator::Absorption), (0, Estimator::Collision)] {
        let how = (degree, estimator);
        let [alone, known] = [&alone, &known].map(|model| walked(model, how, 1 << 16));
        println!("{alone:?} {known:?}");
        assert!(alone[0] < 5.1 && known[0] < 5.1, "{alone:?} {known:?}");
        assert!(known[1] < 0.8 * alone[1], "{alone:?} {known:?}");
    }
    let wrong = walked(&wrong, (0, Estimator::Collision), 1 << 22);
    println!("{wrong:?}");
    assert!(wrong[0] > 10.0, "{wrong:?}");
}

/// Without parameters there are no polynomials on which to score.
#[test]
fn what_lacks_parameters_says_so() {
    let model = super::interval::model();
    match Solver::new(&model).whole() {
        Err(SolveError::Failed(error)) => assert!(error.to_string().contains("`parameters`")),
        other => panic!("{other:?}"),
    }
}
