//! Target `gait_open` of the fuzzer.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz_properties::gait_files::open(bytes));
