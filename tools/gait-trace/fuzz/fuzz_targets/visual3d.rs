#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| gait_trace_fuzz::check("a.txt", gait_trace::format::visual3d::parse, bytes));
