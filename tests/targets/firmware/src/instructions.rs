//! Instructions that stages take, on a Cortex-M whose time is counted in them (QEMU's `-icount`).

use crate::{line::Line, platform};
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
use dynvox_core::{Executor, Stage};

/// Runs everything on one thread, and says what each stage takes.
pub struct Counting {
    ticks: [AtomicU32; Stage::ALL.len()],
}

impl Counting {
    pub const fn new() -> Self {
        Self { ticks: [const { AtomicU32::new(0) }; Stage::ALL.len()] }
    }

    /// Writes the ticks of each stage since the last time.
    pub fn put(&self) {
        for (stage, ticks) in Stage::ALL.iter().zip(&self.ticks) {
            platform::put(
                &Line::new()
                    .str("ticks ")
                    .str(stage.name())
                    .str(" ")
                    .decimal(ticks.swap(0, Relaxed))
                    .str("\n"),
            );
        }
    }
}

impl Executor for Counting {
    fn stage<R>(&self, stage: Stage, work: impl FnOnce() -> R) -> R {
        let before = platform::ticks();
        let result = work();
        let taken = platform::ticks().wrapping_sub(before);
        for (_, ticks) in Stage::ALL.iter().zip(&self.ticks).filter(|(this, _)| **this == stage) {
            ticks.fetch_add(taken, Relaxed);
        }
        result
    }
}
