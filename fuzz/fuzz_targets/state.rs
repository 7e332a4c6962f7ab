#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    fredholm_hostile::state(bytes);
    fredholm_hostile::state_with_checksum(bytes);
});
