//! What is doubtful about a recording's images, before the first is mapped.

use super::RunArgs;
use crate::input::FrameSource;
use crate::input::diagnosis::{self, Fault, Finding, RefusedInput};
use crate::run::FrameNumbers;

/// Examines the images of a recording, without masks and injected faults: warnings.
///
/// # Errors
/// They would make a map meaningless, and `--force` is not given.
pub fn warnings(args: &RunArgs, dataset: &dyn FrameSource) -> anyhow::Result<Vec<String>> {
    if args.path.is_none() {
        // The synthetic street knows what it renders.
        return Ok(Vec::new());
    }
    let frames = FrameNumbers::of(dataset, args.start, args.stride, args.frames)?;
    let stream = dataset.stream().is_some();
    // Of a stream the first frame can be looked at, and a camera may begin in the dark.
    let findings = diagnosis::examine(dataset, if stream { &[0] } else { frames.listed() })?;
    let refused = |finding: &Finding| finding.refused && !(stream && finding.fault == Fault::Black);
    if findings.iter().any(refused) && !args.force {
        return Err(RefusedInput { findings }.into());
    }
    Ok(findings.into_iter().map(|finding| finding.message).collect())
}
