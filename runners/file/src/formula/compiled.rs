//! A formula with the text that its program borrows.

use fredholm_core::Real;
use nanoexpr::{Error, Evaluator, Instruction, Program};
use ouroboros::self_referencing;

use super::{At, Value};

/// The most values that a formula may have pending at once.
const STACK: usize = 32;

/// The number of values that most formulas have pending at once. Room for them is cleared at each
/// evaluation: for 32 it takes a twelfth of the instructions of a short formula.
const FEW: usize = 8;

/// A program by the number of its pending values.
enum Either<'c, F> {
    Few(Program<'c, 'c, Value<F>, FEW>),
    Many(Program<'c, 'c, Value<F>, STACK>),
}

/// A text, room for its instructions, and the program that borrows both.
#[self_referencing]
pub(crate) struct Compiled<F: Real> {
    text: String,
    #[borrows(text)]
    #[not_covariant]
    room: Vec<Instruction<'this, Value<F>>>,
    #[borrows(text, mut room)]
    #[not_covariant]
    program: Either<'this, F>,
}

impl<F: Real> Compiled<F> {
    pub(crate) fn of(text: String) -> Result<Self, Error> {
        let evaluator = Evaluator::<()>::new(&());
        Self::try_new(
            text,
            // No formula needs more than two instructions for a character.
            |text| Ok(vec![Instruction::default(); 2 * text.len() + 1]),
            |text, room| {
                let is_few = evaluator.compile::<_, FEW>(text, &mut *room).is_ok();
                Ok(match is_few {
                    true => Either::Few(evaluator.compile(text, room)?),
                    false => Either::Many(evaluator.compile(text, room)?),
                })
            },
        )
    }

    /// The text that is compiled.
    pub(crate) fn text(&self) -> &str {
        self.borrow_text()
    }

    /// The value; NaN where there is none.
    #[inline]
    pub(crate) fn value(&self, at: &At<'_, F>) -> F {
        let value = self.with_program(|program| match program {
            Either::Few(program) => program.evaluate(at),
            Either::Many(program) => program.evaluate(at),
        });
        value.map_or(F::NAN, |value| value.0)
    }

    /// The number of instructions.
    pub(crate) fn len(&self) -> usize {
        self.with_program(|program| match program {
            Either::Few(program) => program.len(),
            Either::Many(program) => program.len(),
        })
    }
}
