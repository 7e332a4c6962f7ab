//! Runs all cases and prints, by semihosting, a line of bits for each, and behind a `#` what
//! belongs to this machine: ticks of SysTick per walk, and stack.

#![no_std]
#![no_main]

#[path = "../cases.rs"]
mod cases;
#[path = "../line.rs"]
mod line;
#[path = "../paint.rs"]
mod paint;

use core::panic::PanicInfo;

use cases::{Case, Runner, drive};
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::entry;
use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::hio::{self, HostStream};
use fredholm_core::{Equation, Functional, NeighbourOf, RunOptions, Space, Statistics};

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    fail()
}

fn fail() -> ! {
    loop {
        debug::exit(EXIT_FAILURE);
    }
}

#[entry]
fn main() -> ! {
    let (Some(mut peripherals), Ok(out)) = (cortex_m::Peripherals::take(), hio::hstdout()) else {
        fail()
    };
    let clock = &mut peripherals.SYST;
    clock.set_clock_source(SystClkSource::Core);
    clock.set_reload(SYST_MASK);
    clock.clear_current();
    clock.enable_counter();
    let mut device = Device { out, failed: false };
    if cases::all(&mut device).is_none() || device.failed {
        fail()
    }
    debug::exit(EXIT_SUCCESS);
    fail()
}

/// SysTick counts down from here.
const SYST_MASK: u32 = 0x00ff_ffff;
/// Walks between two looks at SysTick, which begins anew after 2²⁴ ticks.
const WALKS: u64 = 16;

struct Device {
    out: HostStream,
    failed: bool,
}

impl Runner for Device {
    fn run<E, N, T>(&mut self, name: &str, case: &Case<'_, E, N, T>, options: RunOptions)
    where
        E: Equation<Value = <E as Space>::Scalar> + Sync,
        N: NeighbourOf<E> + Sync,
        T: Functional<E> + Sync,
    {
        let top = paint::paint();
        let mut ticks = 0;
        let mut before = SYST::get_current();
        let count = || {
            let now = SYST::get_current();
            ticks += u64::from(before.wrapping_sub(now) & SYST_MASK);
            before = now;
        };
        let Some(statistics) = run(case, options, count) else {
            self.failed = true;
            return;
        };
        let stack = paint::used_below(top);
        let ends = case.options.absorption;
        let lines = line::line::<E::Scalar>(&mut self.out, name, ends, &statistics);
        let per_walk = ticks / statistics.walks();
        let note = core::fmt::Write::write_fmt(
            &mut self.out,
            format_args!("# ticks per walk {per_walk} stack {stack}\n"),
        );
        self.failed |= lines.is_err() || note.is_err();
    }
}

/// Out of line, so that its stack is below what is painted.
#[inline(never)]
fn run<E, N, T>(
    case: &Case<'_, E, N, T>,
    options: RunOptions,
    count: impl FnMut(),
) -> Option<Statistics>
where
    E: Equation<Value = <E as Space>::Scalar> + Sync,
    N: NeighbourOf<E> + Sync,
    T: Functional<E> + Sync,
{
    drive(case, options, WALKS, count)
}
