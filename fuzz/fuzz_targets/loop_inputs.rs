//! Target `loop_inputs` of the fuzzer.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz_properties::loop_inputs::check(bytes));
