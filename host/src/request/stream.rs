//! Frames from standard input.

use super::{Poses, Request, RequestError};
use crate::formats::calibration::CameraGeometry;
use crate::input::depth::DepthChoice;
use crate::input::stream::netpbm::NetpbmPairs;
use crate::input::stream::{Stream, StreamOptions};
use crate::input::{FrameSource, InputError, StopRequest};
use std::io::{BufReader, stdin};

/// Bytes read at once.
const BUFFER_BYTES: usize = 1 << 16;

/// Opens the stereo pairs on standard input.
pub fn open(request: &Request, stop: &StopRequest) -> Result<Box<dyn FrameSource>, RequestError> {
    let input = &request.input;
    if input.calibration.is_empty() {
        return Err(RequestError::invalid(
            "a stream has no calibration beside it. Give one with --calibration FILE",
        ));
    }
    // A stream can be read once, and not be counted beforehand.
    if let Some(option) = of_recordings(request) {
        return Err(RequestError::Invalid(format!(
            "{option} needs a recording, and a stream comes once. Leave it out, or record the \
             stream first"
        )));
    }
    let options = StreamOptions {
        name: "stream".to_owned(),
        cameras: CameraGeometry::read(&input.calibration, input.hints).map_err(InputError::from)?,
        rectified: request.settings.rectify,
        rate_hz: input.rate_hz,
        when_late: input.when_late.unwrap_or_default(),
    };
    let pairs = NetpbmPairs::new(
        BufReader::with_capacity(BUFFER_BYTES, stdin()),
        input.stacking,
        input.bits,
    )
    .with_bayer(input.bayer);
    // An empty input is not an empty recording.
    match Stream::begin(options, stop.clone(), pairs) {
        Err(InputError::PastEnd { .. }) => Err(RequestError::invalid(
            "standard input ended without an image. Let a program write PGM or PPM images to it",
        )),
        stream => Ok(Box::new(stream?)),
    }
}

/// The first option of a request that only recordings have.
fn of_recordings(request: &Request) -> Option<&'static str> {
    [
        ("--snapshot-every", request.storage.snapshot_every.is_some()),
        ("--evaluate", request.evaluation.reference.is_some()),
        ("--dataset", request.input.layout.is_some()),
        ("--sequence", request.input.sequence.is_some()),
        ("--depth", request.depth != DepthChoice::Elas),
        ("--instances with files of masks", !request.masks.fits_stream()),
        ("--egomotion file", matches!(request.poses, Poses::File(_))),
        ("--fixes", request.fixes.is_some()),
    ]
    .into_iter()
    .find_map(|(option, given)| given.then_some(option))
}
