//! A network in a process of its own: the runtime can neither be given a bound of memory nor be
//! stopped, and a process can.
//!
//! The process is this program again, called with the hidden command `network-worker`. It bounds
//! its own address space before it loads the file, answers pictures on its standard output, and
//! ends when its standard input does, wherever it computes. It is in a process group of its own, so
//! that a terminal's Ctrl-C reaches only the run, which ends it.

use super::arrays::{InputShape, Output, Request};
use super::protocol::{Answer, read_input, read_outputs, write_input, write_outputs};
use super::runtime::Runtime;
use crate::formats::bounds::{MAX_NETWORK_BYTES, MAX_NETWORK_TIME, bytes_text};
use crate::input::source::StopRequest;
use rustix::process::{Resource, Rlimit, setrlimit};
use std::io::{self, BufReader, BufWriter, Write};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitCode, Stdio};
use std::sync::OnceLock;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

/// Name of the hidden command.
pub const COMMAND: &str = "network-worker";
/// Interval at which a waiting run checks whether it is asked to stop.
const POLL: Duration = Duration::from_millis(50);

/// The program that can be called with [`COMMAND`].
static PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// Lets networks run in processes of `program`, which must know the hidden command. Without it they
/// run in this process, without bounds of memory and time.
pub fn run_networks_in(program: PathBuf) {
    // The first one stays.
    let _ = PROGRAM.set(program);
}

/// The program of workers, if there is one.
pub fn program() -> Option<&'static Path> {
    PROGRAM.get().map(PathBuf::as_path)
}

/// Serves a network until standard input ends.
pub fn serve(path: &Path) -> ExitCode {
    let most = Some(MAX_NETWORK_BYTES);
    let bounded = setrlimit(Resource::As, Rlimit { current: most, maximum: most });
    let (sender, requests) = sync_channel(1);
    // Reading is a thread of its own: a network that does not come back ends with its run.
    thread::spawn(move || {
        let mut stdin = BufReader::new(io::stdin());
        while let Ok(Some(request)) = Request::read(&mut stdin) {
            if sender.send(request).is_err() {
                break;
            }
        }
        std::process::exit(0);
    });
    let opened = match bounded {
        Ok(()) => Runtime::open(path),
        Err(error) => Err(format!("its memory cannot be bounded ({error})")),
    };
    let mut stdout = BufWriter::new(io::stdout());
    let (runtime, shape) = match opened {
        Ok((runtime, shape)) => (Ok(runtime), Ok(shape)),
        Err(reason) => (Err(reason.clone()), Err(reason)),
    };
    let mut written = write_input(&shape, &mut stdout);
    if let Ok(runtime) = runtime {
        for request in requests {
            written = written.and_then(|()| write_outputs(&runtime.run(request), &mut stdout));
        }
    }
    if written.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// The process of a network.
pub struct Worker {
    child: Child,
    stdin: BufWriter<ChildStdin>,
    outputs: Receiver<io::Result<Answer<Vec<Output>>>>,
    stop: StopRequest,
}

impl Worker {
    /// Starts a process and lets it load the network.
    ///
    /// # Errors
    /// It cannot be started, refuses the network, or takes more memory or time than it may.
    pub fn start(
        program: &Path,
        network: &Path,
        stop: StopRequest,
    ) -> Result<(Self, InputShape), String> {
        let failed = |error: io::Error| format!("its process cannot be started ({error})");
        let mut child = Command::new(program)
            .arg(COMMAND)
            .arg(network)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .process_group(0)
            .spawn()
            .map_err(failed)?;
        let missing = || failed(io::ErrorKind::BrokenPipe.into());
        let stdin = BufWriter::new(child.stdin.take().ok_or_else(missing)?);
        let mut stdout = BufReader::new(child.stdout.take().ok_or_else(missing)?);
        let (shape_to, shape) = channel();
        let (outputs_to, outputs) = channel();
        thread::spawn(move || {
            let read = read_input(&mut stdout);
            let mut goes_on = read.is_ok() && shape_to.send(read).is_ok();
            while goes_on {
                let read = read_outputs(&mut stdout);
                goes_on = read.is_ok() && outputs_to.send(read).is_ok();
            }
        });
        let mut worker = Self { child, stdin, outputs, stop };
        let shape = worker.wait(&shape)?;
        Ok((worker, shape))
    }

    /// Runs the network on a picture.
    ///
    /// # Errors
    /// The network fails, takes more memory or time than it may, or the run is asked to stop.
    pub fn run(&mut self, request: &Request) -> Result<Vec<Output>, String> {
        // What a process that ended cannot take is told by its answer.
        let _ = request.write(&mut self.stdin);
        let outputs = std::mem::replace(&mut self.outputs, channel().1);
        let answer = self.wait(&outputs);
        self.outputs = outputs;
        answer
    }

    /// Waits for an answer within its time.
    fn wait<T>(&mut self, answers: &Receiver<io::Result<Answer<T>>>) -> Result<T, String> {
        let begin = Instant::now();
        loop {
            match answers.recv_timeout(POLL) {
                Ok(Ok(answer)) => return answer,
                Ok(Err(_)) | Err(RecvTimeoutError::Disconnected) => return Err(self.ended()),
                Err(RecvTimeoutError::Timeout) if self.stop.signal().is_some() => {
                    let _ = self.child.kill();
                    return Err("it was stopped, as the run was".to_owned());
                }
                Err(RecvTimeoutError::Timeout) if begin.elapsed() > MAX_NETWORK_TIME => {
                    // A late answer would be taken for that of the next picture.
                    let _ = self.child.kill();
                    return Err(format!(
                        "it takes more than the {} s that it may take for a picture. Export it \
                         smaller, or check its loops",
                        MAX_NETWORK_TIME.as_secs()
                    ));
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// Explains the end of a process that gave no answer.
    fn ended(&mut self) -> String {
        let _ = self.child.kill();
        let how = self.child.wait().map_or_else(|error| error.to_string(), |how| how.to_string());
        let most = bytes_text(MAX_NETWORK_BYTES);
        format!(
            "its process ended ({how}): it may take at most {most} of memory. Export it with \
             smaller inputs and outputs"
        )
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        let _ = self.stdin.flush();
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
