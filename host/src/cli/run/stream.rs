//! `dynvox run -`: frames from standard input.

use super::RunArgs;
use crate::cli::egomotion::EgomotionChoice;
use crate::formats::calibration::{CameraGeometry, RectifiedSize};
use crate::input::depth::DepthChoice;
use crate::input::stream::netpbm::NetpbmPairs;
use crate::input::stream::{Stream, StreamOptions};
use crate::input::{FrameSource, InputError, StopRequest};
use anyhow::bail;
use std::io::{BufReader, stdin};
use std::path::Path;

/// Bytes read at once.
const BUFFER_BYTES: usize = 1 << 16;

/// Whether a path means standard input.
pub fn is_stream(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// The stereo pairs on standard input.
pub fn open(
    args: &RunArgs,
    rectified: RectifiedSize,
    stop: &StopRequest,
) -> anyhow::Result<Box<dyn FrameSource>> {
    if args.calibration.is_empty() {
        bail!("a stream has no calibration beside it. Give one with --calibration FILE");
    }
    let of_recordings = [
        ("--snapshot-every", args.snapshot_every.is_some()),
        ("--evaluate", args.evaluate.is_some()),
        ("--dataset", args.dataset.is_some()),
        ("--sequence", args.sequence.is_some()),
        ("--depth", args.depth != DepthChoice::Elas),
        ("--instances with files of masks", !args.masks.fits_stream()),
        ("--egomotion file", matches!(args.egomotion, Some(EgomotionChoice::File(_)))),
    ];
    if let Some((option, _)) = of_recordings.iter().find(|(_, given)| *given) {
        bail!(
            "{option} needs a recording, and a stream comes once. Leave it out, or record the stream first"
        );
    }
    let options = StreamOptions {
        name: "stream".to_owned(),
        cameras: CameraGeometry::read(&args.calibration, None).map_err(InputError::from)?,
        rectified,
        rate_hz: args.rate,
        when_late: args.when_late.unwrap_or_default(),
    };
    let pairs = NetpbmPairs::new(
        BufReader::with_capacity(BUFFER_BYTES, stdin()),
        args.stacking(),
        args.bits,
    );
    match Stream::begin(options, stop.clone(), pairs) {
        Err(InputError::PastEnd { .. }) => bail!(
            "standard input ended without an image. Let a program write PGM or PPM images to it"
        ),
        stream => Ok(Box::new(stream?)),
    }
}
