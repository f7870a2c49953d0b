//! An ordinary program, to see the same code under every optimisation level of this machine.

/// Writes text to standard output.
pub fn put(text: &crate::line::Line) {
    print!("{}", String::from_utf8_lossy(text.text()));
}
