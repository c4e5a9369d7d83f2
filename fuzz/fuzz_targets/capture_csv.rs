//! Target `capture_csv` of the fuzzer.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz_properties::host_files::capture_csv(bytes));
