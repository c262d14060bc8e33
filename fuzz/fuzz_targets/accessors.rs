#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| frameless_fuzz::accessors(data));
