#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    fredholm_hostile::table(bytes);
    fredholm_hostile::table_with_checksum(bytes);
});
