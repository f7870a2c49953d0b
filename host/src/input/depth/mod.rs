//! Where disparity comes from: the core's own stereo matching, files another program wrote, or the
//! synthetic street's exact depth.
//!
//! Files are the slot of any network run elsewhere (DispNet in the paper). Three formats are read:
//! 16-bit PNG, PFM of either byte order, OpenCV's XML. All become disparity in 1/256 px before they
//! enter the core, where the near and far limits of the map hold for them as for its own. A value
//! that is not a number, or not a disparity of this rig, is taken as none and counted
//! ([`crate::input::DepthRefusals`]); a file that is missing, broken, of another size or mostly
//! such values ends the run with a sentence. So does a folder whose depths differ by a factor from
//! the run's own matches (`compare`): its unit is another ([`DepthScale`]).
//!
//! Memory: one image of `f32` and one of `u16`, independent of a file's header.

mod compare;
mod files;
mod scale;
#[cfg(test)]
mod tests;

pub use scale::DepthScale;

pub use files::{DEPTH_FOLDERS, DepthChoice, DepthFolder, attach};
