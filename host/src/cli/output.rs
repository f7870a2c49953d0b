//! Standard output. A reader that goes away, or a full device, ends the printing, and the command
//! fails once its work is done.

use std::fmt::Arguments;
use std::io::{Error, Write, stdout};
use std::sync::OnceLock;

/// The first failure.
static FAILURE: OnceLock<Error> = OnceLock::new();

/// Prints text; nothing after a failure.
pub fn print(text: Arguments<'_>) {
    if FAILURE.get().is_none()
        && let Err(error) = stdout().lock().write_fmt(text)
    {
        // Only one thread prints, so nothing else was set.
        let _ = FAILURE.set(error);
    }
}

/// Flushes the output, and returns the failure if not all was printed.
///
/// # Errors
/// What stopped the printing.
pub fn finish() -> anyhow::Result<()> {
    let flushed = stdout().lock().flush();
    let failure = FAILURE
        .get()
        .map(ToString::to_string)
        .or_else(|| flushed.err().map(|error| error.to_string()));
    failure.map_or(Ok(()), |failure| {
        Err(anyhow::anyhow!("standard output cannot be written: {failure}"))
    })
}
