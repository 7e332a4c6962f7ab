//! The formulas of a cube as functions.

use fredholm::cube::{CubeFunctions, CubeValues};
use fredholm_core::Real;

use super::{Cube, KernelText, singular};
use crate::Placed;
use crate::formula::{Formula, Room, room, seconds};

/// The formulas of a cube, which validation has checked.
#[derive(Clone, Debug)]
pub(super) struct Formulas {
    dimension: usize,
    domain: Vec<[f64; 2]>,
    is_product: bool,
    /// K, or its factors.
    kernel: Vec<String>,
    /// ∫ K up to y, or of its factors.
    integral: Vec<String>,
    source: String,
    solution: Option<String>,
    weights: Vec<String>,
}

impl Formulas {
    /// The formulas of a cube, and of the weights of its targets.
    pub(super) fn new(cube: &Cube, weights: Vec<String>) -> Self {
        let list = |text: &KernelText| match text {
            KernelText::General(text) => vec![text.value.clone()],
            KernelText::Factors(texts) => {
                texts.value.iter().map(|text| text.value.clone()).collect()
            }
        };
        let text = |text: &Placed<String>| text.value.clone();
        // That of a singularity which is written as such.
        let known = || match &cube.kernel {
            KernelText::General(text) if cube.dimension.value == 1 => {
                singular::integral(&text.value)
            }
            _ => None,
        };
        let integral = match &cube.integral {
            Some(given) => list(given),
            None => known().into_iter().collect(),
        };
        Self {
            dimension: cube.dimension.value,
            domain: cube.ends(),
            is_product: matches!(cube.kernel, KernelText::Factors(_)),
            kernel: list(&cube.kernel),
            integral,
            source: text(&cube.source),
            solution: cube.solution.as_ref().map(text),
            weights,
        }
    }

    /// Compiles the formulas, which takes microseconds, and hands them on: a program borrows the text of its formula,
    /// so that neither outlives the other and nothing is leaked.
    fn with<F: Real>(&self, then: &mut dyn FnMut(&dyn CubeValues<F>)) {
        let mut rooms = Rooms {
            kernel: rooms(&self.kernel),
            integral: rooms(&self.integral),
            weights: rooms(&self.weights),
            source: room(&self.source),
            solution: room(self.solution_text()),
        };
        // Validation has compiled them once, so that there is always something to hand on.
        if let Some(compiled) = self.compiled(&mut rooms) {
            then(&compiled);
        }
    }

    /// The formula of the solution; where it is not known it is not asked for.
    fn solution_text(&self) -> &str {
        self.solution.as_deref().unwrap_or("0")
    }

    fn compiled<'c, F: Real>(&'c self, rooms: &'c mut Rooms<'c, F>) -> Option<Compiled<'c, F>> {
        Some(Compiled {
            kernel: compile(&self.kernel, &mut rooms.kernel)?,
            integral: compile(&self.integral, &mut rooms.integral)?,
            weights: compile(&self.weights, &mut rooms.weights)?,
            source: Formula::new(&self.source, &mut rooms.source).ok()?,
            solution: Formula::new(self.solution_text(), &mut rooms.solution).ok()?,
        })
    }
}

/// Room for the programs of all formulas.
struct Rooms<'c, F> {
    kernel: Vec<Room<'c, F>>,
    integral: Vec<Room<'c, F>>,
    weights: Vec<Room<'c, F>>,
    source: Room<'c, F>,
    solution: Room<'c, F>,
}

/// Room for the programs of some formulas.
fn rooms<F: Real>(texts: &[String]) -> Vec<Room<'_, F>> {
    texts.iter().map(|text| room(text)).collect()
}

fn compile<'c, F: Real>(
    texts: &'c [String],
    rooms: &'c mut [Room<'c, F>],
) -> Option<Vec<Formula<'c, F>>> {
    let pairs = texts.iter().zip(rooms);
    pairs
        .map(|(text, room)| Formula::new(text, room).ok())
        .collect()
}

/// The formulas in one scalar.
struct Compiled<'c, F> {
    kernel: Vec<Formula<'c, F>>,
    integral: Vec<Formula<'c, F>>,
    weights: Vec<Formula<'c, F>>,
    source: Formula<'c, F>,
    solution: Formula<'c, F>,
}

/// The value of one of some formulas.
#[inline]
fn value<F: Real>(formulas: &[Formula<'_, F>], number: usize, x: &[F], y: &[F]) -> F {
    match formulas.get(number) {
        Some(formula) => formula.value(x, y),
        None => F::NAN,
    }
}

impl<F: Real> CubeValues<F> for Compiled<'_, F> {
    #[inline]
    fn kernel(&self, x: &[F], y: &[F]) -> F {
        value(&self.kernel, 0, x, y)
    }
    #[inline]
    fn factor(&self, axis: usize, x: F, y: F) -> F {
        value(&self.kernel, axis, &[x], &[y])
    }
    #[inline]
    fn integral(&self, axis: usize, x: F, y: F) -> F {
        value(&self.integral, axis, &[x], &[y])
    }
    #[inline]
    fn source(&self, x: &[F]) -> F {
        self.source.value(x, &[])
    }
    #[inline]
    fn solution(&self, x: &[F]) -> F {
        self.solution.value(x, &[])
    }
    #[inline]
    fn weight(&self, number: usize, x: &[F]) -> F {
        value(&self.weights, number, x, &[])
    }
}

impl CubeFunctions for Formulas {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn domain(&self) -> &[[f64; 2]] {
        &self.domain
    }

    fn is_product(&self) -> bool {
        self.is_product
    }

    fn has_integral(&self) -> bool {
        !self.integral.is_empty()
    }

    fn has_solution(&self) -> bool {
        self.solution.is_some()
    }

    fn weights(&self) -> usize {
        self.weights.len()
    }

    fn weight_text(&self, number: usize) -> Option<&str> {
        self.weights.get(number).map(String::as_str)
    }

    fn seconds(&self) -> [f64; 3] {
        let all = |texts: &[String]| texts.iter().map(|text| seconds(text)).sum();
        [
            all(&self.kernel),
            all(&self.integral),
            seconds(&self.source),
        ]
    }

    fn with_f64(&self, then: &mut dyn FnMut(&dyn CubeValues<f64>)) {
        self.with(then);
    }

    fn with_f32(&self, then: &mut dyn FnMut(&dyn CubeValues<f32>)) {
        self.with(then);
    }
}
