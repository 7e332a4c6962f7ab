//! The smallest program that solves: a circle in f32 from a table in flash, no
//! semihosting, no formatting. `.ci/firmware` reads its sizes from the linker's map.
//!
//! The panic handler calls a function that does not exist: the program links only where the
//! optimiser has proved that nothing can panic. There is no allocator either.

#![no_std]
#![no_main]

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m_rt::entry;
use fredholm_circle::{BorrowedTables, GalerkinSystem, Harmonic};
use fredholm_core::galerkin::{DiagonalRule, PairKind, Piecewise};
use fredholm_core::{
    At, Goal, Goals, Neighbour, NeighbourOf, Real, RunOptions, Tolerance, WalkOptions,
};
use fredholm_embedded::{Aligned, Driver, Tables};

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

#[path = "../circle.rs"]
mod circle;
use circle::FlashCircle;
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

/// The neighbour equation, which follows the walks.
// Out of line, as the circle is read: what reads tables is gone from the stack while walks use it.
#[inline(never)]
fn neighbour<'a>(
    tables: &Tables<'a>,
    circle: &'a FlashCircle<'a, f32>,
    system: &'a GalerkinSystem<'a, BorrowedTables<'a, f32>, Harmonic>,
) -> Option<impl NeighbourOf<FlashCircle<'a, f32>> + use<'a>> {
    let pairs = DiagonalRule {
        diagonal: PairKind::Pointwise,
    };
    let (v, g) = (tables.get("v").ok()?, tables.get("source").ok()?);
    Piecewise::<_, _, _, _, _, 1>::with_pointwise(circle, system, pairs, v, g).ok()
}

#[inline(never)]
fn solve() -> Option<()> {
    let tables = Tables::read(&TABLE.0, "circle").ok()?;
    // Not by `?`: they would be on the stack twice.
    let circle = circle::circle::<f32>(&tables);
    let Some(circle) = &circle else { return None };
    let system = circle.system::<1>();
    let neighbour = neighbour(&tables, circle, &system);
    let Some(neighbour) = &neighbour else {
        return None;
    };
    // s = 0.3: cos and sin of s/2 as constants, so that no trigonometry is linked.
    let mut goals = [Goal::new(
        At(circle.point_at(0.988_771_1, 0.149_438_13)),
        None,
    )];
    let v0 = neighbour
        .value(&neighbour.locate(goals[0].functional.0))
        .to_f64();
    goals[0].control_mean = Some(v0);
    let job: Goals<'_, _, _, _> = Goals::new(circle, neighbour, &goals, WalkOptions::default());
    let mut options = RunOptions::new(1_000_000);
    options.tolerance = Some(Tolerance::Absolute(1e-3));
    let Ok(mut driver) = Driver::<_, 1>::new(&job, 0, options) else {
        return None;
    };
    loop {
        let progress = driver.poll(&job, 100).ok()?;
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
            let mut bytes = [0; fredholm_embedded::State::<1>::BYTES];
            driver.save(&job).write(&mut bytes).ok()?;
            let state = fredholm_embedded::State::read(&bytes).ok()?;
            driver = Driver::restore(&job, 0, options, &state).ok()?;
        }
        if progress.stop.is_some() {
            return Some(());
        }
    }
}
