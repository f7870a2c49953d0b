//! Faults injected into a recording, drawn from a seed: what cameras, cables, drivers and detectors
//! do wrong.
//!
//! [`Faults`] says which, [`FaultySource`] is the recording with them. The truth of a frame is that of the images delivered.

mod changed;
mod noise;
mod order;
mod pasted;
mod pictures;
mod spec;
#[cfg(test)]
mod tests;
mod weather;

pub use spec::{Fault, FaultKind, Faults, Side};

use super::source::{
    FrameInfo, FrameSource, InputError, LidarScan, SourceInfo, StereoImages, StreamState,
};
use dynvox_core::random::Random;
use order::{Delivery, deliveries};

/// A recording with faults, if there are any to be injected.
///
/// # Errors
/// A sentence: the recording is a stream.
pub fn attach(
    recording: Box<dyn FrameSource>,
    faults: Option<&Faults>,
) -> Result<Box<dyn FrameSource>, String> {
    match faults {
        None => Ok(recording),
        Some(faults) => Ok(Box::new(FaultySource::new(recording, faults.clone())?)),
    }
}

/// A recording with faults.
pub struct FaultySource {
    inner: Box<dyn FrameSource>,
    faults: Faults,
    order: Vec<Delivery>,
    info: SourceInfo,
}

impl FaultySource {
    /// Injects `faults` into `inner`.
    ///
    /// # Errors
    /// A sentence: a stream has no frames to go back or on to.
    pub fn new(inner: Box<dyn FrameSource>, faults: Faults) -> Result<Self, String> {
        if inner.stream().is_some() {
            return Err("--faults needs a recording, and this is a stream. Save its frames to a \
                        folder first"
                .to_owned());
        }
        let order = deliveries(inner.len(), &faults);
        let mut info = SourceInfo { frames: order.len(), ..inner.info().clone() };
        info.truth = inner
            .truth()
            .map(|truth| order.iter().filter_map(|one| truth.get(one.frame).copied()).collect());
        info.notes.push(format!("faults are injected, {} in all", faults.list.len()));
        Ok(Self { inner, faults, order, info })
    }

    /// The source's frame that is delivered at a position.
    fn delivered(&self, position: usize) -> Result<Delivery, InputError> {
        self.order.get(position).copied().ok_or(InputError::PastEnd { frames: self.order.len() })
    }

    /// The frame whose image a fault delivers instead of this one's.
    fn replaced_by(&self, kind: FaultKind, first: usize, position: usize) -> Option<(Side, usize)> {
        match kind {
            FaultKind::Freeze(side) => Some((side, first.saturating_sub(1))),
            FaultKind::Delay(side) => Some((side, position.saturating_sub(1))),
            _ => None,
        }
    }
}

impl FrameSource for FaultySource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn frame_info(&self, position: usize) -> FrameInfo {
        match self.order.get(position) {
            Some(one) => FrameInfo {
                stem: self.inner.frame_info(one.frame).stem,
                ..self.inner.frame_info(one.stamp)
            },
            None => FrameInfo {
                stem: None,
                stamp_ns: None,
                time_s: self.inner.frame_info(position).time_s,
            },
        }
    }

    fn frame(&self, position: usize) -> Result<StereoImages, InputError> {
        let mut images = self.inner.frame(self.delivered(position)?.frame)?;
        for (number, fault) in
            self.faults.list.iter().enumerate().filter(|(_, fault)| fault.covers(position))
        {
            let mut random = Random::new(
                self.faults.seed
                    ^ ((number as u64 + 1) << 32)
                    ^ (position as u64 + 1).wrapping_mul(0x9E37_79B9),
            );
            if random.below(100) >= fault.percent {
                continue;
            }
            match self.replaced_by(fault.kind, fault.first, position) {
                Some((side, other)) => pictures::put_side(
                    side,
                    self.inner.frame(self.delivered(other)?.frame)?,
                    &mut images,
                ),
                None => {
                    let (rig, since) = (&self.info.rig, position - fault.first);
                    let happening = pictures::Happening { kind: fault.kind, rig, since };
                    pictures::apply(&happening, &mut images, &mut random);
                }
            }
        }
        Ok(images)
    }

    fn stream(&self) -> Option<StreamState> {
        None
    }

    fn has_lidar(&self, position: usize) -> bool {
        self.order.get(position).is_some_and(|one| self.inner.has_lidar(one.frame))
    }

    fn lidar(&self, position: usize) -> Result<Option<LidarScan>, InputError> {
        self.inner.lidar(self.delivered(position)?.frame)
    }
}
