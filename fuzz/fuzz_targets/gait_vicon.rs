//! Target `gait_vicon` of the fuzzer.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz_properties::gait_files::vicon(bytes));
