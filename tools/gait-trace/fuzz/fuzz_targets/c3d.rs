#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| gait_trace_fuzz::check("a.c3d", gait_trace::format::c3d::parse, bytes));
