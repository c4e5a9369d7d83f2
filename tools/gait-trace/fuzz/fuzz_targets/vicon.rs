#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| gait_trace_fuzz::check("a.csv", gait_trace::format::vicon::parse, bytes));
