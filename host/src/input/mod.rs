//! Where frames come from: data sets on disk, the synthetic street, and the depth and masks that
//! other programs made of them.
//!
//! [`source`] says what a source of frames is and what a frame holds; it depends on nothing else
//! here. [`layouts`] reads recordings, [`bags`] those of ROS, [`stream`] what comes through a pipe
//! or from an iterator, [`depth`] and [`masks`] lay files over any source, [`ignored`] leaves
//! pixels out, [`faults`] spoils one on purpose; [`diagnosis`] examines images before they are
//! mapped. Loaders guess nothing silently: what they assume stands in [`FrameSource::notes`], and
//! what they cannot use is an [`InputError`] that says what to do.

pub mod bags;
mod data_set;
mod data_sets;
pub mod depth;
pub mod diagnosis;
pub mod faults;
pub mod ignored;
mod inertial;
pub mod layouts;
pub mod masks;
pub mod source;
pub mod stream;

pub use data_set::{CameraPair, DataSet, Layout, OpenOptions, Topics};
pub use data_sets::{DATA_SETS, Found, open, sequences_at, survey};
pub use inertial::choice::InertialChoice;
pub use layouts::{Sequence, StreetFrames};
pub use source::{
    AvailableMasks, DepthRefusals, ExactFrame, FrameInfo, FrameMasks, FrameSource, GivenDepth,
    InertialUnitData, InputError, InstanceMask, LidarScan, MaskRefusals, ObjectsTruth, PositionFix,
    Scaled, SourceInfo, Stacking, StereoImages, StopRequest, StreamState, TrueObject,
    read_given_poses, read_position_fixes,
};
