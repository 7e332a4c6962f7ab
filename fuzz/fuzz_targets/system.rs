#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    fredholm_hostile::system(bytes);
    fredholm_hostile::system_with_checksum(bytes);
    fredholm_hostile::system_of_numbers(bytes);
});
