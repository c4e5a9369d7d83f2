#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| gait_trace_fuzz::check("a.mvnx", gait_trace::format::mvnx::parse, bytes));
