//! Source of the images.

use super::source::Source;
use super::world::{Change, SyntheticWorld};
use super::{Request, RequestError, stream};
use crate::formats::BayerPattern;
use crate::formats::calibration::CalibrationHints;
use crate::input::Topics;
use crate::input::faults::{self, Faults};
use crate::input::stream::WhenLate;
use crate::input::{
    self, CameraPair, FrameSource, InertialChoice, Layout, OpenOptions, Scaled, Stacking,
    StopRequest, StreetFrames, depth, ignored, masks,
};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Source of the images, and how they are read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Input {
    /// The source.
    pub source: Source,
    /// Layout of the recording; guessed from its path when absent.
    pub layout: Option<Layout>,
    /// Sequence within the recording.
    pub sequence: Option<String>,
    /// Camera pair of KITTI odometry.
    pub cameras: CameraPair,
    /// Significant bits of 16-bit images, 8 to 16; told from some of them when absent.
    pub bits: Option<u32>,
    /// Colour filters of images that are mosaics.
    pub bayer: Option<BayerPattern>,
    /// Topics of both cameras in a recording of ROS; told by their names when absent.
    pub topics: Option<Topics>,
    /// Arrangement of a pair in one image; told from the calibration when absent.
    pub stacking: Option<Stacking>,
    /// Frames a second of a stream.
    pub rate_hz: Option<f64>,
    /// Fate of a stream's frames that come while the mapper is busy.
    pub when_late: Option<WhenLate>,
    /// Calibration files instead of the recording's own: one, or one for each camera.
    pub calibration: Vec<PathBuf>,
    /// Answers of a person to what the files of a calibration leave open.
    pub hints: CalibrationHints,
    /// Picture whose white pixels no stage uses.
    pub ignore_mask: Option<PathBuf>,
    /// Source of inertial samples.
    pub inertial: InertialChoice,
    /// Files with the inertial unit's mounting instead of the recording's own.
    pub inertial_calibration: Vec<PathBuf>,
    /// Faults to inject.
    pub faults: Option<Faults>,
}

/// Opens the source with its depth, scaled, without masks and faults.
pub fn open(request: &Request, stop: &StopRequest) -> Result<Box<dyn FrameSource>, RequestError> {
    let Input { source, layout, sequence, rate_hz, when_late, .. } = &request.input;
    // Options of streams are refused elsewhere, rather than ignored.
    let only_streams = *source != Source::Stream && (rate_hz.is_some() || when_late.is_some());
    if only_streams {
        return Err(RequestError::invalid(
            "--rate and --when-late are for a stream: `dynvox run -`",
        ));
    }
    let has_unit = matches!(request.input.inertial, InertialChoice::File(_))
        || !request.input.inertial_calibration.is_empty();
    if has_unit && !matches!(source, Source::Recording(_)) {
        return Err(RequestError::invalid(
            "--inertial FILE and --inertial-calibration belong to a recording: `dynvox run PATH`. \
             The synthetic street has a unit of its own: --set street.inertial.rate_hz=200",
        ));
    }
    let dataset: Box<dyn FrameSource> = match source {
        Source::Stream => stream::open(request, stop)?,
        Source::Recording(path) => input::open(path, &options(request))?,
        _ if layout.is_some() || sequence.is_some() => {
            return Err(RequestError::invalid(
                "--dataset and --sequence need a data set. Give its path: `dynvox run PATH`",
            ));
        }
        Source::Street | Source::Room | Source::Yard | Source::Town => {
            let world = SyntheticWorld::of_source(source).unwrap_or_default();
            let without_unit = request.input.inertial == InertialChoice::None;
            let change = Change { without_unit, ..Change::default() };
            Box::new(StreetFrames::from_world(world.build(&request.settings, &change)?))
        }
    };
    let dataset = depth::attach(dataset, &request.depth, request.depth_scale.as_ref())?;
    let scale = request.frames.scale;
    let scaled: Box<dyn FrameSource> =
        if scale == 1.0 { dataset } else { Box::new(Scaled::new(dataset, scale)?) };
    Ok(match &request.input.ignore_mask {
        Some(path) => ignored::attach(scaled, path)?,
        None => scaled,
    })
}

fn options(request: &Request) -> OpenOptions {
    let input = &request.input;
    OpenOptions {
        layout: input.layout,
        sequence: input.sequence.clone(),
        cameras: input.cameras,
        bits: input.bits,
        bayer: input.bayer,
        stacking: input.stacking,
        topics: input.topics.clone(),
        calibration: input.calibration.clone(),
        hints: input.hints,
        rectified: request.settings.rectify,
        inertial: input.inertial.clone(),
        inertial_calibration: input.inertial_calibration.clone(),
    }
}

/// Lays the masks and faults that are asked for over an open source.
pub fn dress(
    request: &Request,
    dataset: Box<dyn FrameSource>,
    stop: &StopRequest,
) -> Result<Box<dyn FrameSource>, RequestError> {
    let masked = masks::attach(dataset, &request.masks.source, request.masks.every, stop)?;
    faults::attach(masked, request.input.faults.as_ref()).map_err(RequestError::Invalid)
}
