//! The description of a room with polynomials on its cells, for the kit.

use fredholm_core::{Located, Real};
use fredholm_room::{Choice, Grading, Point, PolynomialRoom, Room, RoomPairs};

use super::described::{Described, described_by};
use super::{ABSORPTION, Drawing, OfDegree, Setup};
use crate::description::Description;
use crate::examine::examine_both;
use crate::offers::{Neighbours, Offers};
use crate::report::Report;

/// A room with polynomials as the kit sees it.
struct Curved<'x, 'a, F, const B: usize> {
    flat: &'x Described<'a, F>,
    setup: &'x Setup<B>,
    polynomials: PolynomialRoom<'x, 'x, F, B>,
    claim: f64,
}

/// As [`examined`](super::examined), with B functions on every cell.
///
/// # Panics
/// If there is no such room.
#[must_use]
pub fn examined_of_degree<const B: usize>(
    drawing: &Drawing,
    cells: usize,
    claim: f64,
    seed: u64,
) -> Report {
    curved::<f32, _, B>(drawing, cells, claim, |narrow| {
        curved::<f64, _, B>(drawing, cells, claim, |wide| {
            examine_both(narrow, wide, seed)
        })
    })
}

fn curved<F: Real, R, const B: usize>(
    drawing: &Drawing,
    cells: usize,
    claim: f64,
    then: impl FnOnce(&Curved<'_, '_, F, B>) -> R,
) -> R {
    // Polynomials of degree 2B − 2 times a density, on the parts that `nodes` makes: 12 points are
    // too few for 10⁻¹³ there.
    let cuts = [4.0_f64, 16.0, 64.0].map(|n| [1.0 / n, 1.0 - 1.0 / n]);
    let by = (16, cuts.as_flattened());
    described_by::<F, _>(drawing, cells, claim, by, |flat| {
        let setup = Setup::<B>::of_degree::<F>(drawing, cells, Grading::default()).unwrap();
        let views = setup.matrix.views();
        let room = Room::new(*flat.room.geometry(), flat.room.table(), views, ABSORPTION).unwrap();
        then(&Curved {
            flat,
            setup: &setup,
            polynomials: room.with_functions(),
            claim,
        })
    })
}

impl<'x, F: Real, const B: usize> Description<B> for Curved<'x, '_, F, B> {
    type Equation = PolynomialRoom<'x, 'x, F, B>;
    const DIMENSION: usize = 1;

    fn equation(&self) -> &Self::Equation {
        &self.polynomials
    }
    fn point(&self, cell: usize, t: &[f64]) -> Point<F> {
        self.flat.point(cell, t)
    }
    fn contains(&self, cell: usize, x: &Point<F>) -> bool {
        self.flat.contains(cell, x)
    }
    fn nodes(&self, x: &Point<F>, cell: usize) -> Vec<(Point<F>, f64)> {
        self.flat.nodes(x, cell)
    }
    fn sensitivity(&self, x: &Point<F>, cell: usize) -> f64 {
        self.flat.sensitivity(x, cell)
    }
    fn leaving(&self, x: &Point<F>) -> f64 {
        self.flat.leaving(x)
    }
    fn solution(&self, x: &Point<F>) -> Option<f64> {
        self.flat.solution(x)
    }
    fn constant(&self) -> Option<f64> {
        self.flat.constant()
    }
    fn cumulative(&self, x: &Point<F>, y: &Point<F>) -> Option<f64> {
        self.flat.cumulative(x, y)
    }
    fn mass(&self, x: &Located<Point<F>>, cell: usize) -> Option<f64> {
        self.flat.mass(x, cell)
    }
}

impl<'x, F: Real, const B: usize> Neighbours<B> for Curved<'x, '_, F, B> {
    fn offers(&self, offers: &mut Offers<'_, Self, B>) {
        let views = self.setup.matrix.views();
        let pairs = |choice| RoomPairs { views, choice };
        offers.pairs("the paper's", pairs(Choice::Paper));
        offers.pointwise_pairs("the others pointwise", pairs(Choice::Default));
        offers.pointwise_pairs("all pointwise", pairs(Choice::Pointwise));
        offers.coefficients("quadrature", &self.setup.matrix.coefficients(), self.claim);
        if F::EPSILON.to_f64() < 1e-10 {
            let v = &self.setup.solution;
            offers.galerkin_solution("own", &v.v, self.claim / (1.0 - v.radius_bound));
        }
        self.setup
            .with_rays::<F, _>(|neighbour| offers.neighbour("own, rays", neighbour));
        for choice in [Choice::Paper, Choice::Default] {
            self.setup
                .with_polynomials::<F, _>(choice, |_, neighbour, _, _| {
                    let name = format!("own, {choice:?}");
                    offers.neighbour::<OfDegree<'_, '_, F, B>>(&name, neighbour);
                });
        }
    }
}
