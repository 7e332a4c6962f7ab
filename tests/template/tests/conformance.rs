//! My equation passes the kit.

use core::num::NonZeroU32;

use fredholm_conformance::quadrature::gauss_legendre;
use fredholm_conformance::{Description, Neighbours, Offers, examine_both};
use fredholm_core::galerkin::{Cells, DiagonalRule, PairKind};
use fredholm_core::sampled::{NoEvents, SampledSetup, SetupOptions};
use fredholm_core::{Located, Real};
use fredholm_my_equation::MyEquation;

/// My equation as the kit sees it.
struct Described<F>(MyEquation<F>);

impl<F: Real> Described<F> {
    fn new(cells: u32) -> Self {
        Self(MyEquation::new(cells).expect("a valid equation"))
    }
}

impl<F: Real> Description for Described<F> {
    type Equation = MyEquation<F>;

    fn equation(&self) -> &MyEquation<F> {
        &self.0
    }

    fn contains(&self, cell: usize, x: &F) -> bool {
        let width = self.0.measure(cell);
        let (left, right) = (cell as f64 * width, (cell + 1) as f64 * width);
        let edge = 4.0 * F::EPSILON.to_f64();
        (left - edge..=right + edge).contains(&x.to_f64())
    }

    fn nodes(&self, _: &F, cell: usize) -> Vec<(F, f64)> {
        // Yours: enough points for your p and K, and split at x where they have a kink there
        // (`quadrature::split`). Four are exact for the polynomials of this equation.
        let rule = gauss_legendre(4).into_iter();
        rule.map(|(t, w)| (self.0.point(cell, &[t]), w * self.0.measure(cell)))
            .collect()
    }

    // ---- What follows may be left out; each makes one more check possible.

    fn solution(&self, x: &F) -> Option<f64> {
        Some(1.2 * x.to_f64())
    }

    fn cumulative(&self, _: &F, y: &F) -> Option<f64> {
        Some(y.to_f64())
    }

    fn mass(&self, _: &Located<F>, cell: usize) -> Option<f64> {
        Some(self.0.measure(cell))
    }
}

impl<F: Real> Neighbours for Described<F> {
    fn offers(&self, offers: &mut Offers<'_, Self>) {
        // Yours: every choice of pairs that a user of your crate may make.
        let diagonal = |diagonal| DiagonalRule { diagonal };
        offers.pairs("all in S", diagonal(PairKind::Galerkin));
        offers.pairs("diagonal outside", diagonal(PairKind::Dropped));
        offers.pointwise_pairs("diagonal pointwise", diagonal(PairKind::Pointwise));
        // What the chain says of itself.
        offers.starts(&self.0);
        // From steps alone: this one asks for no integrals of p or K. D = 1, the numbers that a step draws.
        let wide = Described::<f64>::new(self.0.cells() as u32).0;
        let setup = SampledSetup::<_, 1, 1> {
            equation: &wide,
            events: &NoEvents::NEW,
            options: SetupOptions {
                samples: 64,
                ..SetupOptions::default()
            },
        };
        let solution = setup.solve_all().expect("a contraction");
        let tables = solution.for_walks::<F>().expect("memory");
        let (none, two) = (NoEvents::NEW, NonZeroU32::MIN.saturating_add(1));
        let neighbour = tables.neighbour::<_, NoEvents<MyEquation<F>>, 1, 1>(&self.0, &none, two);
        offers.neighbour("from steps", &neighbour.expect("its tables"));
    }
}

#[test]
fn my_equation_passes_the_kit() {
    for seed in 1..=3 {
        let report = examine_both(&Described::<f32>::new(10), &Described::<f64>::new(10), seed);
        println!("{report}");
        report.assert_passed("my equation");
    }
}
