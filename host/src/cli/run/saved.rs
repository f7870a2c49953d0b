//! The folder that a run saves its instances to.

use crate::run::RunFolder;
use anyhow::bail;
use std::path::Path;

/// The folder that instances are saved to, which takes its name when the run is complete.
pub fn begin(target: &Path) -> anyhow::Result<RunFolder> {
    if target.exists() {
        bail!("{} exists. Give another --save-instances, or remove it", target.display());
    }
    Ok(RunFolder::begin(target, false)?)
}
