//! What starts of walks meet, where (v, Φ) has no closed form.

use fredholm_core::{
    Equation, Functional, Generators as _, NeighbourOf, RngUniforms, Sequence, SobolPoint, Start,
    Value, WalkNumber, WalkSeeds, WideOf,
};

/// Starts of walks from which (v, Φ) is told to people where it is not known.
const LOOKS: u64 = 4096;

/// (v, Φ) and what starts know, in the unit of u, about: the mean over 4096 starts that are spread evenly, the same in every run.
pub fn seen_from<E: Equation, N: NeighbourOf<E> + ?Sized>(
    origin: &impl Functional<E>,
    equation: &E,
    neighbour: &N,
) -> WideOf<E> {
    let seeds = WalkSeeds::new(0, 0);
    let mut memory = SobolPoint::default();
    let mut sum = WideOf::<E>::splat(equation.channels(), 0.0);
    for index in 0..LOOKS {
        let number = WalkNumber {
            walk: index,
            replicate: 0,
            index,
        };
        let mut draws = RngUniforms(Sequence::Sobol.generator(&seeds, number, &mut memory));
        let Start { point, phi, known } = origin.start(equation, &mut draws);
        let v = neighbour.value(&neighbour.locate(point));
        sum = sum.plus(&v.scaled(phi).plus(&known).wide());
    }
    sum.scaled(1.0 / LOOKS as f64)
}
