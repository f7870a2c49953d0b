//! The frames that a run takes.

use super::RequestError;
use crate::evaluate::quantile::median;
use crate::input::FrameSource;
use serde::{Deserialize, Serialize};

/// Choice of the frames that are mapped, and their size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Frames {
    /// First frame.
    pub start: usize,
    /// Frames at most; all when absent.
    pub most: Option<usize>,
    /// Frames from one that is taken to the next, at least 1.
    pub stride: usize,
    /// Factor of the images' sides, above 0 and up to 1.
    pub scale: f64,
    /// Leave out and count frames that cannot be read or mapped; otherwise the run
    /// ends before the first of them.
    pub skip_bad: bool,
    /// Map images that an examination refuses as exchanged, unrectified, out of
    /// order, black or the same in both cameras.
    pub force: bool,
}

impl Default for Frames {
    fn default() -> Self {
        Self { start: 0, most: None, stride: 1, scale: 1.0, skip_bad: false, force: false }
    }
}
/// The frames a run takes, by their numbers in the source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FrameNumbers {
    /// These.
    Listed(Vec<usize>),
    /// Frames of a source without a known end: from `start`, every `stride`-th, at most `most`.
    Open {
        /// The first.
        start: usize,
        /// Distance from one to the next.
        stride: usize,
        /// Number of frames at most.
        most: usize,
    },
}

impl FrameNumbers {
    /// The frames of a source that are asked for.
    ///
    /// # Errors
    /// Nothing is left of the source.
    pub fn new(source: &dyn FrameSource, asked: &Frames) -> Result<Self, RequestError> {
        let (start, stride) = (asked.start, asked.stride.max(1));
        let most = asked.most.unwrap_or(usize::MAX);
        // A stream's frames cannot be counted before they came.
        if source.stream().is_some() {
            return Ok(Self::Open { start, stride, most });
        }
        let len = source.len();
        let listed: Vec<usize> = (start..len).step_by(stride).take(most).collect();
        if listed.is_empty() {
            Err(RequestError::NoFrames { start, len })
        } else {
            Ok(Self::Listed(listed))
        }
    }

    /// All of them; empty where the end is unknown.
    pub fn listed(&self) -> &[usize] {
        match self {
            Self::Listed(listed) => listed,
            Self::Open { .. } => &[],
        }
    }

    /// Number of frames; `None` where the end is unknown.
    pub fn count(&self) -> Option<usize> {
        match self {
            Self::Listed(listed) => Some(listed.len()),
            Self::Open { .. } => None,
        }
    }

    /// Positions and numbers from a position on.
    pub fn from_position(
        &self,
        first: usize,
    ) -> Box<dyn Iterator<Item = (usize, usize)> + Send + '_> {
        match self {
            Self::Listed(listed) => Box::new(listed.iter().copied().enumerate().skip(first)),
            &Self::Open { start, stride, most } => Box::new(
                (0..most)
                    .map_while(move |at| Some((at, at.checked_mul(stride)?.checked_add(start)?))),
            ),
        }
    }

    /// The position of a frame.
    pub fn position_of(&self, index: usize) -> Option<usize> {
        self.listed().binary_search(&index).ok()
    }
}

/// Median time between two of the frames, s; `None` where there is only one.
pub fn frame_interval_s(source: &dyn FrameSource, frames: &FrameNumbers) -> Option<f64> {
    match frames {
        FrameNumbers::Listed(listed) => {
            median(listed.windows(2).map(|pair| source.time_s(pair[1]) - source.time_s(pair[0])))
        }
        &FrameNumbers::Open { stride, .. } => Some(source.time_s(stride) - source.time_s(0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::StreetFrames;
    use crate::synth::StreetConfig;

    #[test]
    fn frames_are_taken_from_start_by_stride_up_to_a_number() {
        let street =
            StreetFrames::new(StreetConfig { frames: 10, ..StreetConfig::default() }).unwrap();
        let of = |start, stride, most| {
            FrameNumbers::new(&street, &Frames { start, stride, most, ..Frames::default() })
        };
        assert_eq!(of(2, 3, None).unwrap().listed(), [2, 5, 8]);
        assert_eq!(of(0, 1, Some(2)).unwrap().listed(), [0, 1]);
        assert!(of(10, 1, None).unwrap_err().to_string().contains("leaves none of the 10 frames"));
        let open = FrameNumbers::Open { start: 4, stride: 2, most: 3 };
        assert_eq!(open.from_position(0).collect::<Vec<_>>(), [(0, 4), (1, 6), (2, 8)]);
        assert_eq!((open.count(), open.listed().len()), (None, 0));
    }
}
