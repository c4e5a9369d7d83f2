//! Target `wire_request` of the fuzzer.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz_properties::wire_records::request(bytes));
