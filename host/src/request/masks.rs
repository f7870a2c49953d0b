//! Instance masks of a run.

use crate::input::masks::MaskChoice;
use serde::{Deserialize, Serialize};
use std::num::NonZeroUsize;

/// Source of instance masks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Masks {
    /// The source.
    pub source: MaskChoice,
    /// Masks are taken in every so many frames of the data set; tracks carry on in between.
    pub every: NonZeroUsize,
}

impl Default for Masks {
    fn default() -> Self {
        Self { source: MaskChoice::default(), every: NonZeroUsize::MIN }
    }
}

impl Masks {
    /// Returns true if the mapper finds the masks, should there be any.
    pub(super) fn need_no_recording(&self) -> bool {
        matches!(self.source, MaskChoice::Auto | MaskChoice::None | MaskChoice::Motion)
    }

    /// Returns true if the masks can be made of a stream's pairs.
    pub(super) fn fits_stream(&self) -> bool {
        self.need_no_recording() || matches!(self.source, MaskChoice::Networks(_))
    }
}
