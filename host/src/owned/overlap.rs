//! Output that would contain an input, or lie within one.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// An output and an input that overlap.
#[derive(Debug, thiserror::Error)]
#[error(
    "{output} {relation} {input}, which is read here. Give an output folder that neither \
     contains an input nor lies within one"
)]
pub struct Overlap {
    /// The folder to be written.
    pub output: PathBuf,
    /// The file or folder that is read.
    pub input: PathBuf,
    relation: &'static str,
}

/// Refuses an output that is an input, contains one or lies within one, also by way of links.
///
/// # Errors
/// The first such input.
pub fn check_overlap(output: &Path, inputs: &[PathBuf]) -> Result<(), Overlap> {
    // Compared without links, and named as the user gave them.
    let real_output = resolved(output);
    for input in inputs {
        let real_input = resolved(input);
        let relation = if real_input == real_output {
            "is"
        } else if real_input.starts_with(&real_output) {
            "contains"
        } else if real_output.starts_with(&real_input) {
            "lies within"
        } else {
            continue;
        };
        return Err(Overlap { output: output.to_path_buf(), input: input.clone(), relation });
    }
    Ok(())
}

/// A path without links; its last parts need not exist.
fn resolved(path: &Path) -> PathBuf {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let mut missing: Vec<OsString> = Vec::new();
    for existing in absolute.ancestors() {
        if let Ok(real) = existing.canonicalize() {
            return missing.iter().rev().fold(real, |path, name| path.join(name));
        }
        missing.extend(existing.file_name().map(ToOwned::to_owned));
    }
    absolute
}
