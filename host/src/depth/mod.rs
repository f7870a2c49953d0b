//! Where disparity comes from: the core's own stereo matching, files another program wrote, or the synthetic street's exact depth.
//!
//! Files are the slot of any network run elsewhere (DispNet in the paper). Three formats are read: 16-bit PNG, PFM of either byte order,
//! OpenCV's XML. All become disparity in 1/256 px before they enter the core, where the near and far limits of the map hold for them as for
//! its own. A value that is no number, or no disparity of this rig, is taken as none and counted ([`DepthRefusals`]); a file that is missing,
//! broken or of another size ends the run with a sentence.
//!
//! Memory: one image of `f32` and one of `u16`, whatever a file's header says.

mod convert;
mod opencv;
mod pfm;
mod source;
#[cfg(test)]
mod tests;

pub use convert::DepthRefusals;
pub use source::{DepthChoice, attach};

use crate::dataset::{DatasetError, Image};
use std::path::Path;

/// Disparity of a frame from elsewhere.
#[derive(Clone, Debug)]
pub struct GivenDepth {
    /// Disparity of the left pixels, 1/256 px, 0 none.
    pub disparity_q8: Image<u16>,
    /// What could not be used of it.
    pub refused: DepthRefusals,
}

/// What the numbers of a file mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Meaning {
    /// Disparity, px.
    DisparityPx,
    /// Depth, m.
    DepthM,
}

/// Depth that cannot be used.
fn unusable(path: &Path, reason: String) -> DatasetError {
    DatasetError::Depth { path: path.to_path_buf(), reason }
}

/// Says that an image has another size than the frames.
fn other_size(path: &Path, found: (usize, usize), size: (usize, usize)) -> DatasetError {
    unusable(path, format!("it is {} x {} px, but the images are {} x {} px", found.0, found.1, size.0, size.1))
}
