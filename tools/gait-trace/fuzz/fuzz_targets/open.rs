#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| gait_trace_fuzz::check("a", gait_trace::format::open::of_bytes, bytes));
