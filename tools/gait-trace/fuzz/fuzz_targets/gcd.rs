#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| gait_trace_fuzz::check("a.gcd", gait_trace::format::gcd::parse, bytes));
