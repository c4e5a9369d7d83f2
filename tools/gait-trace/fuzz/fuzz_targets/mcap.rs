#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| gait_trace_fuzz::check("fuzz.mcap", gait_trace::format::mcap_file::parse, bytes));
