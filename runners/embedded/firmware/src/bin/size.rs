//! The smallest program that solves: a circle in f32 from a table in flash, one estimator, no
//! semihosting, no formatting. `.ci/firmware` reads its sizes from the linker's map.
//!
//! The panic handler calls a function that does not exist: the program links only where the
//! optimiser has proved that nothing can panic. There is no allocator either.

#![no_std]
#![no_main]

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m_rt::entry;
use fredholm_core::galerkin::{DiagonalRule, PairKind, Piecewise};
use fredholm_core::{
    At, Estimator, Form, Length, Neighbour, Real, RunOptions, Task, Tolerance, WalkSeeds,
};
use fredholm_embedded::{Aligned, Driver, Table};

unsafe extern "C" {
    /// Nowhere defined.
    fn fredholm_can_panic() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    // SAFETY: the call is never linked.
    unsafe { fredholm_can_panic() }
}

/// In flash; read in place.
static TABLE: &Aligned<[u8]> = &Aligned(*include_bytes!("../../tables/circle_f32.bin"));

/// Where a display, a valve or a radio would look: the bits of the estimate and of its standard
/// error, in f32; 0 while nothing is known, u32::MAX where something was refused.
#[unsafe(no_mangle)]
static ESTIMATE: AtomicU32 = AtomicU32::new(0);
#[unsafe(no_mangle)]
static STD_ERROR: AtomicU32 = AtomicU32::new(0);

#[path = "../circle_table.rs"]
mod circle_table;
#[cfg(feature = "report")]
#[path = "../paint.rs"]
mod paint;

#[entry]
fn main() -> ! {
    #[cfg(feature = "report")]
    paint::paint();
    if solve().is_none() {
        ESTIMATE.store(u32::MAX, Ordering::Relaxed);
    }
    #[cfg(feature = "report")]
    paint::report();
    #[cfg(not(feature = "report"))]
    loop {
        cortex_m::asm::wfi();
    }
}

#[inline(never)]
fn solve() -> Option<()> {
    let table = Table::read(&TABLE.0, "circle").ok()?;
    let circle = circle_table::circle::<f32>(&table)?;
    let pairs = DiagonalRule {
        diagonal: PairKind::Pointwise,
    };
    let (v, g) = (table.slice("v").ok()?, table.slice("source").ok()?);
    let neighbour = Piecewise::with_pointwise(&circle, &circle, pairs, v, g).ok()?;
    // s = 0.3: cos and sin of s/2 as constants, so that no trigonometry is linked.
    let x0 = circle.point_at(0.988_771_1, 0.149_438_13);
    let start = At(x0);
    let task = || Task {
        equation: &circle,
        neighbour: &neighbour,
        functional: &start,
        control_mean: Some(neighbour.value(&neighbour.locate(x0)).to_f64()),
        estimator: Estimator::Absorption,
        form: Form::Product,
        seeds: <WalkSeeds>::new(1, 0),
        length: Length::default(),
    };
    let mut options = RunOptions::new(1_000_000);
    options.tolerance = Some(Tolerance::Absolute(1e-3));
    let Ok(mut driver) = Driver::new(task(), options) else {
        return None;
    };
    loop {
        let progress = driver.poll(100).ok()?;
        #[cfg(feature = "panic")]
        assert!(progress.walks < 1000);
        #[cfg(feature = "format")]
        {
            use core::fmt::Write;
            let _ = write!(
                cortex_m_semihosting::hio::hstdout().ok()?,
                "{}",
                progress.walks
            );
        }
        let error = progress.estimate.std_error.unwrap_or(f64::INFINITY);
        ESTIMATE.store(
            (progress.estimate.estimate as f32).to_bits(),
            Ordering::Relaxed,
        );
        STD_ERROR.store((error as f32).to_bits(), Ordering::Relaxed);
        #[cfg(feature = "state")]
        {
            let bytes = driver.save().to_bytes();
            let state = fredholm_embedded::State::from_bytes(&bytes).ok()?;
            driver = Driver::restore(task(), options, &state).ok()?;
        }
        if progress.stop.is_some() {
            return Some(());
        }
    }
}
