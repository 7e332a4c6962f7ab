//! u(0.3) on a circle whose tables lie in flash, to a standard error of 5·10⁻³.

#![no_std]
#![no_main]

use core::panic::PanicInfo;

use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use fredholm_circle::{Cells, Circle, Harmonic};
use fredholm_core::galerkin::{DiagonalRule, PairKind, Piecewise};
use fredholm_core::{
    At, Estimator, Form, Length, Neighbour, Real, RunOptions, Task, Tolerance, WalkSeeds,
};
use fredholm_embedded::{Aligned, Driver, Table};

/// Written by `fredholm export circle_f32.toml -o circle_f32.bin`.
static TABLE: &Aligned<[u8]> = &Aligned(*include_bytes!("../../tables/circle_f32.bin"));

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
    let table = Table::read(&TABLE.0, "circle").ok()?;
    let [constant, amplitude, frequency] = *table.slice::<f64>("harmonic").ok()? else {
        return None;
    };
    let frequency = frequency as u32;
    let light = Harmonic {
        constant,
        amplitude,
        frequency,
    };

    // Everything is read where it lies.
    let cells = Cells::<f32>::new(table.slice("cells").ok()?, table.slice("slots").ok()?).ok()?;
    let circle = Circle::with_constants(cells, light, table.one("circle").ok()?).ok()?;
    let pairs = DiagonalRule {
        diagonal: PairKind::Pointwise,
    };
    let (v, g) = (table.slice("v").ok()?, table.slice("source").ok()?);
    let neighbour = Piecewise::with_pointwise(&circle, &circle, pairs, v, g).ok()?;

    let start = circle.point(0.3);
    let task = Task {
        equation: &circle,
        neighbour: &neighbour,
        functional: &At(start),
        control_mean: Some(neighbour.value(&neighbour.locate(start)).to_f64()),
        estimator: Estimator::Absorption,
        form: Form::Product,
        seeds: <WalkSeeds>::new(1, 0),
        length: Length::default(),
    };
    let mut options = RunOptions::new(100_000);
    options.batch = 256;
    options.tolerance = Some(Tolerance::Absolute(5e-3));
    let mut driver = Driver::new(task, options).ok()?;
    loop {
        // Some milliseconds of work; the main loop does the rest of its duties in between.
        let progress = driver.poll(100).ok()?;
        if progress.stop.is_some() {
            let estimate = progress.estimate;
            hprintln!("{} ± {}", estimate.estimate, estimate.std_error?);
            return Some(());
        }
    }
}
