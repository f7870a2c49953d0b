//! What made a result.

use dynvox_core::mapper::snapshot;

/// The program's version, and that of the core's state: a result of another one is not taken over.
pub fn program() -> String {
    format!("dynvox {}, core {}", env!("CARGO_PKG_VERSION"), snapshot::VERSION)
}
