//! Target `gait_c3d` of the fuzzer.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz_properties::gait_files::c3d(bytes));
