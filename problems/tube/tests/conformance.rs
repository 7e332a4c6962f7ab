//! Tubes pass the kit.

use fredholm_conformance::quadrature::gauss_legendre;
use fredholm_conformance::{Description, Neighbours, Offers, examine_both};
use fredholm_core::galerkin::{Cells, DiagonalRule, PairKind};
use fredholm_core::{Located, Real};
use fredholm_tube::{Parameters, Tube};

const GREY: Parameters = Parameters {
    length: 3.0,
    reflectance: 0.8,
    emission: 0.3,
    ends: [1.0, -0.4],
};

/// The tube as the kit sees it.
struct Described<F> {
    tube: Tube<F>,
    parameters: Parameters,
}

/// E(d).
fn of_ring(d: f64) -> f64 {
    let z = 0.5 * d;
    (z * z + 0.5) / (z * z + 1.0).sqrt() - z
}

/// What an end sends to the disc at d.
fn of_end(d: f64) -> f64 {
    let q = (1.0 + 0.25 * d * d).sqrt() - 0.5 * d;
    q * q
}

impl<F: Real> Described<F> {
    fn new(cells: usize, parameters: Parameters) -> Self {
        Self {
            tube: Tube::new(cells, &parameters).expect("a valid tube"),
            parameters,
        }
    }

    /// The probability that a step from x leads below y.
    fn below(&self, x: f64, y: f64) -> f64 {
        let length = self.parameters.length;
        let y = y.clamp(0.0, length);
        if x < 0.0 {
            1.0 - of_end(y)
        } else if x > length {
            of_end(length - y) - of_end(length)
        } else {
            let end = of_ring(x);
            match y < x {
                true => of_ring(x - y) - end,
                false => 1.0 - of_ring(y - x) - end,
            }
        }
    }

    fn span(&self, cell: usize) -> [f64; 2] {
        [0.0, 1.0].map(|t| self.tube.point(cell, &[t]).to_f64())
    }
}

impl<F: Real> Description for Described<F> {
    type Equation = Tube<F>;

    fn equation(&self) -> &Tube<F> {
        &self.tube
    }

    fn contains(&self, cell: usize, x: &F) -> bool {
        let edge = 8.0 * F::EPSILON.to_f64() * self.parameters.length;
        let [low, high] = self.span(cell);
        (low - edge..=high + edge).contains(&x.to_f64())
    }

    /// On both sides of x, where p has a kink.
    fn nodes(&self, x: &F, cell: usize) -> Vec<(F, f64)> {
        let [low, high] = self.span(cell);
        let middle = x.to_f64().clamp(low, high);
        let halves = [[low, middle], [middle, high]];
        let own = |[from, to]: [f64; 2]| {
            let rule = gauss_legendre(16).into_iter();
            rule.map(move |(t, w)| (F::from_f64(from + t * (to - from)), w * (to - from)))
        };
        halves.into_iter().flat_map(own).collect()
    }

    fn leaving(&self, x: &F) -> f64 {
        let x = x.to_f64();
        1.0 - self.below(x, self.parameters.length)
    }

    fn constant(&self) -> Option<f64> {
        // A furnace: everything is as hot as its ends.
        let Parameters {
            reflectance,
            emission,
            ends,
            ..
        } = self.parameters;
        let [left, right] = ends;
        let is_furnace = left == right && (emission - (1.0 - reflectance) * left).abs() < 1e-15;
        is_furnace.then_some(left)
    }

    fn cumulative(&self, x: &F, y: &F) -> Option<f64> {
        let below = |y| self.below(x.to_f64(), y);
        Some(below(y.to_f64()) / below(self.parameters.length))
    }

    fn mass(&self, x: &Located<F>, cell: usize) -> Option<f64> {
        let nodes = self.nodes(&x.point, cell).into_iter();
        let p = |y: F| {
            let wide = Tube::<f64>::new(1, &self.parameters).expect("a valid tube");
            fredholm_core::Density::density(&wide, &x.point.to_f64(), &y.to_f64())
        };
        Some(nodes.map(|(y, w)| w * p(y)).sum())
    }
}

impl<F: Real> Neighbours for Described<F> {
    fn offers(&self, offers: &mut Offers<'_, Self>) {
        let [all, outside, pointwise] =
            [PairKind::Galerkin, PairKind::Dropped, PairKind::Pointwise]
                .map(|diagonal| DiagonalRule { diagonal });
        offers.pairs("all in S", all);
        offers.pairs("diagonal outside", outside);
        offers.pointwise_pairs("diagonal pointwise", pointwise);
    }
}

fn passes(name: &str, cells: usize, parameters: Parameters) {
    let narrow = Described::<f32>::new(cells, parameters);
    let wide = Described::<f64>::new(cells, parameters);
    let report = examine_both(&narrow, &wide, 1);
    println!("{name}\n{report}");
    report.assert_passed(name);
}

#[test]
fn a_grey_tube_passes_the_kit() {
    passes("tube, 7 cells", 7, GREY);
}

#[test]
fn a_furnace_comes_out_constant() {
    let furnace = Parameters {
        length: 0.5,
        emission: 0.2,
        ends: [1.0, 1.0],
        ..GREY
    };
    passes("furnace, 6 cells", 6, furnace);
}
