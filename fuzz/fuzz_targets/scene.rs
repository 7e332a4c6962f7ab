#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fredholm_hostile::scene(bytes));
