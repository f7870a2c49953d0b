#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| dynvox_tests::fuzz::run("inertial", bytes));
