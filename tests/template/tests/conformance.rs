//! My equation passes the kit.

use core::num::NonZeroU32;

use fredholm_conformance::quadrature::gauss_legendre;
use fredholm_conformance::{Description, Neighbours, Offers, examine_both};
use fredholm_core::galerkin::{CellMap, DiagonalRule, PairKind, Partition};
use fredholm_core::sampled::{SampledSolution, SetupOptions};
use fredholm_core::{Located, Real};
use fredholm_my_equation::MyEquation;

/// My equation as the kit sees it.
struct Described<F>(MyEquation<F>);

impl<F: Real> Described<F> {
    fn new(cells: u32) -> Self {
        Self(MyEquation::new(cells, 0.2).expect("a valid equation"))
    }

    /// 1/n.
    fn width(&self) -> f64 {
        1.0 / self.0.cells() as f64
    }
}

impl<F: Real> Description for Described<F> {
    type Equation = MyEquation<F>;
    const DIMENSION: usize = 1;

    fn equation(&self) -> &MyEquation<F> {
        &self.0
    }

    fn point(&self, cell: usize, t: &[f64]) -> F {
        self.0.point(cell, t)
    }

    fn contains(&self, cell: usize, x: &F) -> bool {
        let (left, right) = (cell as f64 * self.width(), (cell + 1) as f64 * self.width());
        let edge = 4.0 * F::EPSILON.to_f64();
        (left - edge..=right + edge).contains(&x.to_f64())
    }

    fn nodes(&self, _: &F, cell: usize) -> Vec<(F, f64)> {
        // Yours: enough points for your p and K, and split at x where they have a kink there
        // (`quadrature::split`). Four are exact for the polynomials of this equation.
        let rule = gauss_legendre(4).into_iter();
        rule.map(|(t, w)| (self.point(cell, &[t]), w * self.0.measure(cell)))
            .collect()
    }

    // ---- What follows may be left out; each makes one more check possible.

    fn measure(&self, cell: usize) -> Option<f64> {
        Some(self.0.measure(cell))
    }

    fn parameters(&self, x: &Located<F>) -> Option<Vec<f64>> {
        let mut t = vec![0.0];
        self.0.parameters(x, &mut t).then_some(t)
    }

    fn solution(&self, x: &F) -> Option<f64> {
        Some(1.2 * x.to_f64())
    }

    fn cumulative(&self, _: &F, y: &F) -> Option<f64> {
        Some(y.to_f64())
    }

    fn mass(&self, _: &Located<F>, _: usize) -> Option<f64> {
        Some((1.0 - F::from_f64(0.2).to_f64()) * self.width())
    }
}

impl<F: Real> Neighbours for Described<F> {
    fn offers(&self, offers: &mut Offers<'_, Self>) {
        // Yours: every choice of pairs that a user of your crate may make.
        let diagonal = |diagonal| DiagonalRule { diagonal };
        offers.pairs("all in S", diagonal(PairKind::Galerkin));
        offers.pairs("diagonal outside", diagonal(PairKind::Dropped));
        offers.pointwise_pairs("diagonal pointwise", diagonal(PairKind::Pointwise));
        // What the chain of a whole function says of itself.
        offers.starts(&self.0);
        // From steps alone: this one asks for no integrals of p or K. D = 1, the numbers that a step draws.
        let wide = Described::<f64>::new(self.0.cells() as u32).0;
        let options = SetupOptions {
            samples: 64,
            ..SetupOptions::default()
        };
        let solution = SampledSolution::new::<_, _, 1, 1>(&wide, &wide, &options);
        let tables = solution.and_then(|solution| solution.for_walks::<F>());
        let tables = tables.expect("a contraction");
        let two = NonZeroU32::MIN.saturating_add(1);
        let neighbour = tables.neighbour::<_, 1, 1>(&self.0, two);
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
