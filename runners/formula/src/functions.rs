//! The formulas of one equation as the functions of a model.

use fredholm_core::Real;
use fredholm_cube_model::{CubeFunctions, CubeValues};

use crate::{Formula, Room, room, seconds};

/// The formulas of an equation on a cube, which [`check`](crate::check) has accepted.
///
/// ```
/// use fredholm_cube_model::CubeFunctions;
/// use fredholm_formula::Formulas;
///
/// let formulas = Formulas {
///     dimension: 1,
///     domain: vec![],
///     is_product: false,
///     kernel: vec!["0.5 * exp(-(x - y)^2)".to_owned()],
///     integral: vec![],
///     source: "1 + x".to_owned(),
///     solution: None,
///     weights: vec![],
/// };
/// let mut found = 0.0;
/// formulas.with_f64(&mut |values| found = values.source(&[0.5]));
/// assert_eq!(found, 1.5);
/// ```
#[derive(Clone, Debug)]
pub struct Formulas {
    /// d, from 1 to 6.
    pub dimension: usize,
    /// Both ends of the interval of every axis; none for [0, 1]^d.
    pub domain: Vec<[f64; 2]>,
    /// Whether the kernel is a product of one factor per axis.
    pub is_product: bool,
    /// K(x, y), or its factors, one of each axis.
    pub kernel: Vec<String>,
    /// ∫ K dy from anywhere up to y, or that of each factor; empty where it is not known.
    pub integral: Vec<String>,
    /// F(x).
    pub source: String,
    /// u(x), if it is known.
    pub solution: Option<String>,
    /// Weights of functionals, in x.
    pub weights: Vec<String>,
}

impl Formulas {
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
