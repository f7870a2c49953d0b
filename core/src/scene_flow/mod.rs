//! Sparse scene flow: features of a stereo camera matched over two frames and two cameras (Geiger, Ziegler, Stiller: *StereoScan: Dense
//! 3d Reconstruction in Real-time*, IV 2011).

mod bucket;
mod camera;
mod cells;
mod circle;
mod config;
mod features;
mod filter;
mod matcher;
mod matches;
mod prior;
mod refine;
mod report;
mod support;
mod suppression;

pub use camera::FeatureCount;
pub use config::SceneFlowConfig;
pub use matcher::FlowMatcher;
pub use matches::Match;
pub use report::{FlowReport, FlowStatus, PassCount};

#[cfg(test)]
pub(crate) mod room;
#[cfg(test)]
pub(crate) mod tests;
