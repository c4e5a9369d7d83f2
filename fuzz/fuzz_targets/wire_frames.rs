//! Target `wire_frames` of the fuzzer.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz_properties::wire_records::frames(bytes));
