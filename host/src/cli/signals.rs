//! SIGINT, SIGTERM and SIGHUP end a run after the frame it is at; the second one ends the process.
//! A limit on the size of files is an error of writing, as a full disk is.

use crate::input::StopRequest;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A request that each of these signals makes.
///
/// # Errors
/// The system refuses a handler.
pub fn stop_request() -> std::io::Result<StopRequest> {
    let stop = StopRequest::default();
    let asked = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM].into_iter().chain(hang_up()) {
        // In this order: the first signal only sets `asked`, the second finds it set.
        flag::register_conditional_default(signal, Arc::clone(&asked))?;
        flag::register(signal, Arc::clone(&asked))?;
        flag::register_usize(signal, stop.word(), signal as usize)?;
    }
    Ok(stop)
}

/// SIGHUP, which a closed terminal sends, unless the process was started to ignore it (`nohup`).
#[cfg(unix)]
fn hang_up() -> Option<i32> {
    use signal_hook::consts::SIGHUP;
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    (!ignores(&status, SIGHUP)).then_some(SIGHUP)
}

#[cfg(not(unix))]
fn hang_up() -> Option<i32> {
    None
}

/// Returns true if a process's status says that it ignores a signal.
#[cfg(unix)]
fn ignores(status: &str, signal: i32) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// Lets a write beyond the limit on the size of files (`ulimit -f`) fail. Without a handler the
/// system would end the process.
pub fn survive_file_size_limit() {
    #[cfg(unix)]
    {
        // The handler has nothing to do; where it is refused, the limit ends the process.
        let _ = flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_process_started_by_nohup_ignores_the_end_of_its_terminal() {
        let status = "Name:\tdynvox\nSigIgn:\t0000000000001001\nSigCgt:\t0000000000000000\n";
        assert!(ignores(status, 1) && ignores(status, 13));
        assert!(!ignores(status, 2) && !ignores("", 1));
    }
}
