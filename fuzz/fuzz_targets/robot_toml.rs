//! Target `robot_toml` of the fuzzer.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz_properties::parameter_files::robot(bytes));
