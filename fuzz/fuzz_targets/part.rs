#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    fredholm_hostile::part(bytes);
    fredholm_hostile::part_with_checksum(bytes);
});
