//! Limits of the process that runs.

use serde::{Deserialize, Serialize};

/// Limits of the process.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Threads, 1 to 256; as many as the machine has, at most 4, when absent. The result does not
    /// depend on them.
    pub threads: Option<usize>,
    /// Resident memory above which the run ends, MiB; when absent that of
    /// [`super::resident_limit_bytes`].
    pub rss_mib: Option<u64>,
    /// End the run at the first frame that affects the map.
    pub strict: bool,
}
