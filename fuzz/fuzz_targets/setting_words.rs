//! Target `setting_words` of the fuzzer.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz_properties::host_files::setting_words(bytes));
