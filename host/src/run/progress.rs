//! Progress: a bar on a terminal, some lines elsewhere, nothing when asked.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::Instant;

/// Lines written without a terminal, besides the last.
const PLAIN_LINES: usize = 10;
/// Frames from one line to the next where their number is unknown.
const OPEN_EVERY: usize = 100;

/// Display of the progress.
pub enum Progress {
    /// Not at all.
    Quiet,
    /// A bar.
    Bar(ProgressBar),
    /// A line every so many frames.
    Lines {
        /// Frames in all, where that is known.
        frames: Option<usize>,
        /// Time at which the run began.
        begin: Instant,
    },
}

impl Progress {
    /// Progress over `frames` frames, or over as many as come, on standard error.
    pub fn new(frames: Option<usize>, quiet: bool) -> Self {
        if quiet {
            return Self::Quiet;
        }
        if !std::io::stderr().is_terminal() {
            return Self::Lines { frames, begin: Instant::now() };
        }
        let (bar, template) = match frames {
            Some(frames) => (
                ProgressBar::new(frames as u64),
                "{bar:32.cyan/blue} {pos}/{len} frames  {msg}  {eta} left",
            ),
            None => (ProgressBar::no_length(), "{spinner:.cyan} {pos} frames  {msg}"),
        };
        let style = ProgressStyle::with_template(template);
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self::Bar(bar)
    }

    /// Prints a warning, also where no progress is shown.
    pub fn warn(&self, warning: &str) {
        match self {
            Self::Bar(bar) => bar.suspend(|| errln!("warning: {warning}")),
            Self::Quiet | Self::Lines { .. } => errln!("warning: {warning}"),
        }
    }

    /// Frame `done` (from 1) is mapped; the block pool is `fill` full, in 0 to 1.
    pub fn frame(&self, done: usize, fps: f64, fill: f64, extrapolated: bool) {
        let words = format!(
            "{fps:5.1} fps  pool {:3.0} %{}",
            100.0 * fill,
            if extrapolated { "  pose extrapolated" } else { "" }
        );
        match self {
            Self::Quiet => {}
            Self::Bar(bar) => {
                bar.set_position(done as u64);
                bar.set_message(words);
            }
            Self::Lines { frames, begin } => {
                let (due, of) = match frames {
                    Some(frames) => {
                        let every = frames.div_ceil(PLAIN_LINES).max(1);
                        (
                            done == 1 || done.is_multiple_of(every) || done == *frames,
                            format!("{done}/{frames}"),
                        )
                    }
                    None => (done == 1 || done.is_multiple_of(OPEN_EVERY), done.to_string()),
                };
                if due {
                    errln!("frame {of}  {words}  {:.1} s", begin.elapsed().as_secs_f64());
                }
            }
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}
