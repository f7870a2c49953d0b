//! Files that a run keeps while it lasts.

use serde::{Deserialize, Serialize};
use std::path::PathBuf;

const MIB: u64 = 1 << 20;

/// Files kept on disk during the run.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Storage {
    /// Lose blocks evicted from the full pool; otherwise they are stored in
    /// `map.blocks` and loaded back when they are seen again.
    pub lose_evicted: bool,
    /// Size of `map.blocks` at most, MiB; the disk's space when absent.
    pub most_mib: Option<u64>,
    /// Keep `map.blocks` in the run folder.
    pub keep_blocks: bool,
    /// Frames from one snapshot to the next, at least 1; none are written when absent.
    pub snapshot_every: Option<usize>,
    /// Folder of an old run whose map is continued; its `map.blocks` and `map.places` are read.
    pub continues: Option<PathBuf>,
}

/// Store of evicted blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Streaming {
    /// Bytes the file may grow to; limited by the disk when absent.
    pub max_bytes: Option<u64>,
    /// Keep the file as a part of the result.
    pub keep_file: bool,
}

impl Storage {
    /// Store of evicted blocks; `None` where they are lost.
    pub fn streaming(&self) -> Option<Streaming> {
        (!self.lose_evicted).then_some(Streaming {
            max_bytes: self.most_mib.map(|mib| mib.saturating_mul(MIB)),
            keep_file: self.keep_blocks,
        })
    }
}
