#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| gait_trace_fuzz::check("a.trc", gait_trace::format::trc::parse, bytes));
