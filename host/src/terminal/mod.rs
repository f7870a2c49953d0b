//! Text for people: the only module that writes to standard output and standard error.
//!
//! A reader that goes away, a closed terminal or a full device never ends a run: after the first
//! failure nothing more is printed to standard output, and the command fails once its work is done;
//! a failure of standard error is of no consequence. Control characters are escaped on the way, so
//! that no name of a file or topic commands the terminal ([`escape`](mod@escape)). Names in commands that are
//! printed for a shell are quoted ([`quoted`]).
//!
//! The lints `print_stdout` and `print_stderr` keep the printing macros out of other modules.

mod escape;
mod expected;
mod quote;

use escape::escape;
pub use escape::name;
pub use expected::expect;
pub use quote::quoted;

use std::fmt::Arguments;
use std::io::{Error, Write, stderr, stdout};
use std::sync::OnceLock;

/// Prints to standard output without a panic where it is closed.
macro_rules! out {
    ($($text:tt)*) => { $crate::terminal::print(format_args!($($text)*)) };
}

/// `out` and a line's end.
macro_rules! outln {
    ($($text:tt)*) => { $crate::terminal::print(format_args!("{}\n", format_args!($($text)*))) };
}

/// Prints a line to standard error without a panic where it is closed.
macro_rules! errln {
    ($($text:tt)*) => { $crate::terminal::print_error(format_args!($($text)*)) };
}

/// The first failure of standard output.
static FAILURE: OnceLock<Error> = OnceLock::new();

/// Prints text to standard output; nothing after a failure.
pub fn print(text: Arguments<'_>) {
    if FAILURE.get().is_none()
        && let Err(error) = stdout().lock().write_all(shown(text).as_bytes())
    {
        // Only one thread prints, so nothing else was set.
        let _ = FAILURE.set(error);
    }
}

/// Prints a line to standard error, in one write, so that lines of threads do not mix. A failure
/// leaves nothing to do: there is no other way to tell of it.
pub fn print_error(line: Arguments<'_>) {
    // No message of ours has a tab: it is of a name, which the parser may have changed.
    let line = shown(line).replace('\t', "\\t") + "\n";
    let _ = stderr().lock().write_all(line.as_bytes());
}

/// The text without a control character.
fn shown(text: Arguments<'_>) -> String {
    escape(&expected::in_one_line(text.to_string())).into_owned()
}

/// Flushes standard output, and returns the failure if not all was printed.
///
/// # Errors
/// Names the reason why the printing stopped.
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
