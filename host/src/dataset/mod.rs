//! Where frames come from: KITTI odometry and tracking, a plain stereo folder, the synthetic street.
//!
//! A data set is a list of rectified stereo pairs with one rig. Loaders guess nothing silently: what they assume stands in
//! [`Dataset::notes`], and what they cannot use is a [`DatasetError`] that says what to do.

mod calibration;
mod error;
mod folder;
mod image;
mod kitti;
mod labels;
mod lidar;
mod open;
mod overlay;
mod poses;
mod scaled;
mod sequence;
mod street;
mod table;
#[cfg(test)]
mod tests;
mod truth;

pub use calibration::read_plain as read_calibration;
pub use error::DatasetError;
pub use image::{Image, luma, read_png, read_png_deep, read_png_u16};
pub use labels::read_labels;
pub use lidar::LidarScan;
pub use open::{Found, Kind, open, sequences_at, survey};
pub use overlay::{Layer, Overlay};
pub use poses::read_given_poses;
pub use scaled::Scaled;
pub use sequence::Sequence;
pub use street::StreetFrames;
pub use table::{pose_of_row, read_poses};
pub use truth::{ObjectsTruth, TrueObject};

use crate::depth::GivenDepth;
use crate::segmentation::Sightings;
use dynvox_core::geometry::{StereoRig, Transform};
use std::path::PathBuf;

/// One stereo pair, decoded.
#[derive(Clone, Debug)]
pub struct StereoImages {
    /// Left grey image.
    pub left: Image<u8>,
    /// Right grey image, of the same size.
    pub right: Image<u8>,
    /// Left image in colour, where the data set has it: the same camera as `left`.
    pub colour: Option<Image<[u8; 3]>>,
    /// Disparity from elsewhere; the core matches the pair where it is absent.
    pub depth: Option<GivenDepth>,
    /// What the renderer of a synthetic frame knows exactly.
    pub exact: Option<ExactFrame>,
    /// What is true of the things that move or could, where known.
    pub objects: Option<ObjectsTruth>,
    /// What is seen in the left image; nothing before a source of masks is laid over the data set.
    pub sightings: Sightings,
}

/// What a renderer knows of a frame exactly.
#[derive(Clone, Debug)]
pub struct ExactFrame {
    /// Depth of the left pixels, m; 0 or infinite where there is none.
    pub depth_m: Image<f32>,
    /// Whether the pixel belongs to something that moves in this frame.
    pub moving: Image<bool>,
    /// What each left pixel sees: k is an instance of class `classes[k - 1]`, 0 is none.
    pub instances: Image<u8>,
    /// Class names of the instances.
    pub classes: Vec<&'static str>,
}

/// Which masks a data set brings along.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Masks {
    /// None.
    Absent,
    /// Instance PNGs in a folder beside the images.
    Folder(PathBuf),
    /// Exact ones, from the renderer.
    Exact,
}

/// Which camera pair of KITTI odometry to use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Images {
    /// The grey pair where it is there, else the colour pair.
    #[default]
    Auto,
    /// `image_0` and `image_1`.
    Grey,
    /// `image_2` and `image_3`: matched in grey, fused in colour.
    Colour,
}

/// A list of stereo pairs with one rig.
pub trait Dataset: Send + Sync {
    /// Short name, fit for a folder: `kitti-odometry-06`.
    fn name(&self) -> &str;

    /// Frames in all.
    fn len(&self) -> usize;

    /// Whether there is no frame.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Width and height of every image, px.
    fn size(&self) -> (usize, usize);

    /// The same of the images as they are stored, before any scaling: masks in files have this size.
    fn full_size(&self) -> (usize, usize) {
        self.size()
    }

    /// Name of a frame's left image without its ending, where it is a file: masks in files have the same names.
    fn stem(&self, _: usize) -> Option<String> {
        None
    }

    /// Masks that come with the data set.
    fn masks(&self) -> Masks {
        Masks::Absent
    }

    /// The rig, equal for all frames.
    fn rig(&self) -> StereoRig;

    /// Time of a frame, s.
    fn time_s(&self, index: usize) -> f64;

    /// Decodes or renders a frame.
    fn frame(&self, index: usize) -> Result<StereoImages, DatasetError>;

    /// Whether frames come with exact depth ([`StereoImages::exact`]).
    fn has_exact_depth(&self) -> bool {
        self.masks() == Masks::Exact
    }

    /// Whether there is a LiDAR scan for a frame. Without a default, so that no data set laid over another loses its scans.
    fn has_lidar(&self, index: usize) -> bool;

    /// The scan of a frame, where there is one. Nothing is read of it before.
    fn lidar(&self, index: usize) -> Result<Option<LidarScan>, DatasetError>;

    /// True `t_world_camera` of every frame's left camera, where known.
    fn truth(&self) -> Option<&[Transform]> {
        None
    }

    /// What was assumed or left aside, as sentences.
    fn notes(&self) -> &[String] {
        &[]
    }
}
