//! Doubts about a recording's images, before the first is mapped.

use super::{FrameNumbers, Request, RequestError, frame_interval_s};
use crate::input::FrameSource;
use crate::input::diagnosis::{self, Finding, RefusedInput};

/// Findings about a recording.
pub struct Examined {
    /// Doubts about the images.
    pub warnings: Vec<String>,
    /// Time from frame to frame, s, where it is known.
    pub interval_s: Option<f64>,
}

/// Examines a recording without masks and injected faults.
///
/// # Errors
/// The images would make a map meaningless, and the request does not force it.
pub fn examine(request: &Request, dataset: &dyn FrameSource) -> Result<Examined, RequestError> {
    let frames = FrameNumbers::new(dataset, &request.frames)?;
    // Of a stream while no frame has come: then it is its nominal interval.
    let interval_s = frame_interval_s(dataset, &frames);
    Ok(Examined { warnings: warnings(request, dataset, &frames)?, interval_s })
}

fn warnings(
    request: &Request,
    dataset: &dyn FrameSource,
    frames: &FrameNumbers,
) -> Result<Vec<String>, RequestError> {
    if request.input.source.is_synthetic() {
        // The synthetic street knows what it renders.
        return Ok(Vec::new());
    }
    let stream = dataset.stream().is_some();
    // Of a stream the first frame can be looked at, and a camera may begin in the dark.
    let findings = diagnosis::examine(dataset, if stream { &[0] } else { frames.listed() })?;
    let refused = |finding: &Finding| match stream {
        true => finding.is_refused_live(),
        false => finding.refused,
    };
    if findings.iter().any(refused) && !request.frames.force {
        return Err(RefusedInput { findings }.into());
    }
    Ok(findings.into_iter().map(|finding| finding.message).collect())
}
