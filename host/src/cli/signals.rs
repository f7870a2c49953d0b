//! SIGINT and SIGTERM end a run after the frame it is at; the second one ends the process.

use crate::input::StopRequest;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A request that both signals make.
///
/// # Errors
/// The system refuses a handler.
pub fn stop_request() -> std::io::Result<StopRequest> {
    let stop = StopRequest::default();
    let asked = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // In this order: the first signal only sets `asked`, the second finds it set.
        flag::register_conditional_default(signal, Arc::clone(&asked))?;
        flag::register(signal, Arc::clone(&asked))?;
        flag::register_usize(signal, stop.word(), signal as usize)?;
    }
    Ok(stop)
}
