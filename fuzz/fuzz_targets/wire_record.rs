//! Target `wire_record` of the fuzzer.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz_properties::wire_records::record(bytes));
