//! A run is asked for by a value: [`Request`].
//!
//! A request is plain data: it can be compared, cloned, stored and sent to another machine. The
//! command line, Python's keywords and a person's list of recordings become one by way of
//! [`Options`]; snapshots, jobs and sweeps store it. [`Request::resolve`] opens the data set and
//! gives a [`Plan`], which the run and its observers borrow.
//!
//! To add an option of a run: a field of [`Options`] and its line in `Options::request`, a field
//! of the part of the request it belongs to, and the code that reads it.

mod bounds;
mod checks;
mod describe;
mod error;
mod evaluation;
mod examine;
mod exports;
mod frames;
mod input;
mod limits;
mod mapper;
mod masks;
mod opening;
mod options;
mod overrides;
mod paths;
mod plan;
mod poses;
mod resolve;
mod scale;
mod scene_export;
mod settings;
mod sizes;
mod source;
mod storage;
mod stream;
#[cfg(test)]
mod tests;
mod words;
mod world;

pub use bounds::{Bounds, Memory, PlanningWindow, profile, solve};
pub use checks::{check_bounds, resident_limit_bytes};
pub use error::RequestError;
pub use evaluation::{Evaluation, Reference};
pub use exports::{Exports, MapObjects, UdpAddress};
pub use frames::{FrameNumbers, Frames, frame_interval_s};
pub use input::Input;
pub use limits::Limits;
pub use mapper::MapperPlan;
pub use masks::Masks;
pub use options::Options;
pub use plan::Plan;
pub use poses::Poses;
pub use scale::{ScaleWord, SceneScale, searched_from_m, sentence as scale_sentence};
pub use scene_export::{SceneExport, SceneFormat};
pub(crate) use settings::leaves;
pub use settings::{Settings, Worlds};
pub use sizes::{Bytes, ImageSize, WindowSize};
pub use source::Source;
pub use storage::{Storage, Streaming};
pub use world::{Change, SyntheticWorld};

use crate::input::depth::{DepthChoice, DepthScale};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Everything that is asked of a run. The default maps the synthetic street.
///
/// ```
/// use dynvox::Request;
/// use dynvox::request::Memory;
/// use dynvox::run::{RunFolder, run};
///
/// let mut request = Request::default();
/// request.bounds.memory = Memory::Profile("tiny".to_owned());
/// request.settings.volume.voxel_size_m = 0.1;
/// request.settings.street_mut().frames = 2;
/// request.settings.street_mut().width = 160;
/// request.settings.street_mut().height = 64;
///
/// let scratch = tempfile::TempDir::new()?;
/// let folder = RunFolder::begin(&scratch.path().join("street"), false)?;
/// let record = run(request.resolve()?, &folder, None)?;
/// assert_eq!(record.frames.len(), 2);
///
/// // A request outlives its process: jobs and snapshots store it.
/// let stored = serde_json::to_string(&request)?;
/// assert_eq!(serde_json::from_str::<Request>(&stored)?, request);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Request {
    /// Source of the images.
    pub input: Input,
    /// Choice of the images that are mapped, and their size.
    pub frames: Frames,
    /// Source of depth.
    pub depth: DepthChoice,
    /// Unit of the numbers in files of depth; the usual one of their format if absent.
    pub depth_scale: Option<DepthScale>,
    /// Source of instance masks.
    pub masks: Masks,
    /// Source of the camera's poses.
    pub poses: Poses,
    /// Positions of the camera that something else measured.
    pub fixes: Option<PathBuf>,
    /// Memory of the mapper.
    pub bounds: Bounds,
    /// Settings of the mapper; stored are those that differ from the defaults.
    #[serde(with = "overrides")]
    pub settings: Settings,
    /// Lengths of the map that no setting names.
    pub scale: SceneScale,
    /// Files kept on disk during the run.
    pub storage: Storage,
    /// Evaluation of the map.
    pub evaluation: Evaluation,
    /// Results for other programs.
    pub exports: Exports,
    /// Limits of the process.
    pub limits: Limits,
}
