//! Running the program and measuring what it took.

use super::Call;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;
use wait4::Wait4;

/// Bounds of the shell around the program, so that a fault does not take the machine: CPU seconds,
/// and KiB of address space.
const GUARD: &str = "ulimit -t 40; ulimit -v 6000000; exec \"$@\"";

/// Result of a call.
pub struct Usage {
    /// Exit code; `None` after a signal.
    pub code: Option<i32>,
    /// User and system time, s.
    pub cpu_s: f64,
    /// Peak of the resident memory, bytes.
    pub rss: u64,
    /// Both outputs.
    pub text: String,
}

/// Reads a pipe to its end.
fn whole(mut pipe: impl Read + Send + 'static) -> thread::JoinHandle<String> {
    thread::spawn(move || {
        let mut text = Vec::new();
        let _ = pipe.read_to_end(&mut text);
        String::from_utf8_lossy(&text).into_owned()
    })
}

/// The peak of a process's resident memory, bytes, as long as it lives. What the system counts for
/// a process that ended includes the tests' own memory, from which it was made.
fn peak(id: u32) -> u64 {
    let mut peak = 0;
    while let Ok(status) = std::fs::read_to_string(format!("/proc/{id}/status")) {
        let Some(line) = status.lines().find_map(|line| line.strip_prefix("VmHWM:")) else { break };
        let kib = line.split_whitespace().next().and_then(|number| number.parse().ok());
        peak = peak.max(1_024 * kib.unwrap_or(0u64));
        thread::sleep(Duration::from_millis(1));
    }
    peak
}

/// Runs the program in a folder.
pub fn measured(folder: &Path, call: Call) -> Usage {
    let mut command = Command::new("sh");
    command.args(["-c", GUARD, "sh", env!("CARGO_BIN_EXE_dynvox")]).args(&call.args);
    let stdin = if call.stream.is_some() { Stdio::piped() } else { Stdio::null() };
    let mut child = command
        .current_dir(folder)
        .stdin(stdin)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Writes until the program closes the pipe.
    let writer = child.stdin.take().zip(call.stream).map(|(mut pipe, stream)| {
        thread::spawn(move || {
            let mut written = pipe.write_all(&stream.begin);
            while written.is_ok() && !stream.rest.is_empty() {
                written = pipe.write_all(&stream.rest);
            }
        })
    });
    let (out, err) = (child.stdout.take().unwrap(), child.stderr.take().unwrap());
    let text = [whole(out), whole(err)];
    let id = child.id();
    let sampler = thread::spawn(move || peak(id));
    let used = child.wait4().unwrap();
    if let Some(writer) = writer {
        writer.join().unwrap();
    }
    Usage {
        code: used.status.code(),
        cpu_s: (used.rusage.utime + used.rusage.stime).as_secs_f64(),
        rss: sampler.join().unwrap(),
        text: text.map(|reader| reader.join().unwrap()).concat(),
    }
}
