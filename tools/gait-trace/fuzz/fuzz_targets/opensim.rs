#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| gait_trace_fuzz::check("a.mot", gait_trace::format::opensim::parse, bytes));
