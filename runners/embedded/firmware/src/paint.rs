//! How much stack was used: RAM below the stack pointer is painted, and what lost its colour was
//! used.

use core::ptr;

/// Words that are painted: 32 KiB.
const PAINTED: usize = 8192;
/// Words left alone, for the painter itself.
const MARGIN: usize = 32;
const COLOUR: u32 = 0xfeed_c0de;

/// Paints, and returns the stack pointer.
#[inline(never)]
pub fn paint() -> *mut u32 {
    let top = cortex_m::register::msp::read() as *mut u32;
    for i in MARGIN..PAINTED {
        // SAFETY: RAM below the stack pointer, which nobody uses: no interrupts are enabled.
        unsafe { ptr::write_volatile(top.sub(i), COLOUR) };
    }
    top
}

/// Bytes from `top` down to the deepest word that has been written since it was painted.
#[inline(never)]
pub fn used_below(top: *mut u32) -> usize {
    // SAFETY: as above.
    let clean = |i: &usize| unsafe { ptr::read_volatile(top.sub(*i)) } == COLOUR;
    let deepest = (MARGIN..PAINTED).rev().find(|i| !clean(i));
    4 * deepest.unwrap_or(MARGIN)
}

/// Prints the whole stack that was used, from the end of RAM, in hexadecimal and without formatting;
/// ends the program.
#[allow(dead_code, reason = "for `size` only")]
#[inline(never)]
pub fn report() -> ! {
    unsafe extern "C" {
        static _stack_start: u32;
    }
    // Little of the stack lay above what was painted: the lower end of the paint is certain.
    let end = (&raw const _stack_start).cast_mut();
    let bytes = used_below(end);
    if let Ok(mut out) = cortex_m_semihosting::hio::hstdout() {
        let mut text = *b"00000000\n";
        for (i, digit) in text.iter_mut().take(8).enumerate() {
            let nibble = (bytes >> (28 - 4 * i)) & 15;
            *digit = *b"0123456789abcdef".get(nibble).unwrap_or(&b'?');
        }
        let _ = out.write_all(&text);
        cortex_m_semihosting::debug::exit(cortex_m_semihosting::debug::EXIT_SUCCESS);
    }
    loop {
        cortex_m::asm::wfi();
    }
}
