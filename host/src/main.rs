//! The host of dynvox.
fn main() {}
