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

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::entry;
use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::hio::{self, HostStream};
use fredholm_core::{DefaultGenerator, Functional, Kernel, Neighbour, Sampler, Source, Task};
use fredholm_embedded::{Driver, Plan};

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

impl cases::Runner for Device {
    fn run<E, N, T>(
        &mut self,
        name: &str,
        task: Task<'_, E, N, T, DefaultGenerator>,
        _: u64,
        plan: Plan,
    ) where
        E: Sampler + Kernel + Source + Sync,
        N: Neighbour<Scalar = E::Scalar, Point = E::Point> + Sync,
        T: Functional<E> + Copy + Sync,
    {
        let estimator = task.estimator;
        let top = paint::paint();
        let Some((statistics, ticks)) = measured(task, plan) else {
            self.failed = true;
            return;
        };
        let stack = paint::used_below(top);
        let lines = line::line::<E::Scalar>(&mut self.out, name, estimator, &statistics);
        let per_walk = ticks / statistics.walks();
        let note = core::fmt::Write::write_fmt(
            &mut self.out,
            format_args!("# ticks per walk {per_walk} stack {stack}\n"),
        );
        self.failed |= lines.is_err() || note.is_err();
    }
}

/// Runs to the end, and counts ticks.
#[inline(never)]
fn measured<E, N, T>(
    task: Task<'_, E, N, T, DefaultGenerator>,
    plan: Plan,
) -> Option<(fredholm_core::Statistics, u64)>
where
    E: Sampler + Kernel + Source,
    N: Neighbour<Scalar = E::Scalar, Point = E::Point>,
    T: Functional<E>,
{
    let mut driver = Driver::new(task, plan).ok()?;
    let mut ticks = 0;
    loop {
        let before = SYST::get_current();
        let progress = driver.poll(WALKS).ok()?;
        let passed = before.wrapping_sub(SYST::get_current()) & SYST_MASK;
        ticks += u64::from(passed);
        if progress.stop.is_some() {
            return Some((driver.statistics(), ticks));
        }
    }
}
