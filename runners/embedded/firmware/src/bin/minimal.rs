//! u(0.3) on a circle whose tables lie in flash, to a standard error of 5·10⁻³.

#![no_std]
#![no_main]

use core::panic::PanicInfo;

use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use fredholm_circle::{BorrowedTables, Circle, Harmonic};
use fredholm_core::galerkin::{DiagonalRule, PairKind, Piecewise};
use fredholm_core::{At, Goal, Goals, Neighbour, Real, RunOptions, Tolerance, WalkOptions};
use fredholm_embedded::{Aligned, Driver, Tables};

/// Written on a workstation by a `TableBuilder`.
static TABLES: &Aligned<[u8]> = &Aligned(*include_bytes!("../../tables/circle_f32.bin"));

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}

#[entry]
fn main() -> ! {
    match solve() {
        Some(()) => debug::exit(debug::EXIT_SUCCESS),
        None => debug::exit(debug::EXIT_FAILURE),
    }
    loop {
        cortex_m::asm::wfi();
    }
}

/// `None`: a table or the options were refused, or a walk was not finite; the errors say what and why.
fn solve() -> Option<()> {
    // The light is a formula: C, D and ℓ of (57).
    let tables = Tables::read(&TABLES.0, "circle").ok()?;
    let [constant, amplitude, frequency] = *tables.get::<f64>("light").ok()? else {
        return None;
    };
    let frequency = frequency as u32;
    let light = Harmonic {
        constant,
        amplitude,
        frequency,
    };

    // Everything is read where it lies.
    let (cells, slots) = (tables.get("cells").ok()?, tables.get("slots").ok()?);
    let own = BorrowedTables::<f32>::new(cells, slots, tables.one("circle").ok()?).ok()?;
    let circle = Circle::new(own, light).ok()?;
    let system = circle.system::<1>();
    let pairs = DiagonalRule {
        diagonal: PairKind::Pointwise,
    };
    let (v, g) = (tables.get("v").ok()?, tables.get("source").ok()?);
    let neighbour =
        Piecewise::<_, _, _, _, _, 1>::with_pointwise(&circle, &system, pairs, v, g).ok()?;

    let start = circle.point(0.3);
    let v0 = neighbour.value(&neighbour.locate(start)).to_f64();
    let goals = [Goal::new(At(start), Some(v0))];
    let job: Goals<'_, _, _, _> = Goals::new(&circle, &neighbour, &goals, WalkOptions::default());
    let mut options = RunOptions::new(100_000);
    options.batch = 256;
    options.tolerance = Some(Tolerance::Absolute(5e-3));
    let mut driver = Driver::<_, 1>::new(&job, 0, options).ok()?;
    loop {
        // Some milliseconds of work; the main loop does the rest of its duties in between.
        let progress = driver.poll(&job, 100).ok()?;
        if progress.stop.is_some() {
            let estimate = progress.estimate;
            hprintln!("{} ± {}", estimate.estimate, estimate.std_error?);
            return Some(());
        }
    }
}
