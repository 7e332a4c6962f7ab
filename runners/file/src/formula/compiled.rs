//! A formula with the text that its program borrows.

use nanoexpr::{Context, Error, Evaluator, Instruction, Number, Program};
use ouroboros::self_referencing;

/// The most values that a formula may have pending at once.
const STACK: usize = 32;

/// The number of values that most formulas have pending at once. Room for them is cleared at each
/// evaluation: for 32 it takes a twelfth of the instructions of a short formula.
const FEW: usize = 8;

/// A program by the number of its pending values.
enum Either<'c, N> {
    Few(Program<'c, 'c, N, FEW>),
    Many(Program<'c, 'c, N, STACK>),
}

/// A text, room for its instructions, and the program that borrows both.
#[self_referencing]
pub(crate) struct Compiled<N: Number + 'static> {
    text: String,
    #[borrows(text)]
    #[not_covariant]
    room: Vec<Instruction<'this, N>>,
    #[borrows(text, mut room)]
    #[not_covariant]
    program: Either<'this, N>,
}

impl<N: Number + 'static> Compiled<N> {
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

    /// The value, if there is one.
    #[inline]
    pub(crate) fn value(&self, at: &impl Context<N>) -> Option<N> {
        let value = self.with_program(|program| match program {
            Either::Few(program) => program.evaluate(at),
            Either::Many(program) => program.evaluate(at),
        });
        value.ok()
    }

    /// The number of instructions.
    pub(crate) fn len(&self) -> usize {
        self.with_program(|program| match program {
            Either::Few(program) => program.len(),
            Either::Many(program) => program.len(),
        })
    }
}
