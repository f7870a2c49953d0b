//! Decodes frames ahead of the mapper on a thread of its own, at most [`AHEAD`] of them.

use crate::input::{FrameSource, InputError, StereoImages};
use dynvox_core::StereoFrame;
use dynvox_core::inertial::InertialSample;
use dynvox_core::tracking::Detection;
use std::sync::mpsc::{Receiver, sync_channel};

/// Frames decoded and not yet taken.
pub const AHEAD: usize = 2;

/// A frame as the reader found it.
pub struct ReadFrame {
    /// Position of the frame in the run.
    pub position: usize,
    /// Number of the frame in the source.
    pub index: usize,
    /// Time stamp, ns, if the source has one.
    pub stamp_ns: Option<u64>,
    /// Time of the frame, s: by its stamp, else by an assumed rate.
    pub time_s: f64,
    /// Decoded images, or the error that prevented them.
    pub images: Result<StereoImages, InputError>,
}

/// The mapper's input as it was decoded; `None` where an image is empty.
pub fn stereo_frame<'f>(
    images: &'f StereoImages,
    detections: &'f [Detection<'f>],
) -> Option<StereoFrame<'f>> {
    Some(StereoFrame {
        colour: images.colour.as_ref().and_then(|colour| colour.view()),
        disparity_q8: images.depth.as_ref().and_then(|depth| depth.disparity_q8.view()),
        ignored: images.ignored.as_ref().and_then(|ignored| ignored.view()),
        detections,
        ..StereoFrame::pair(images.left.view()?, images.right.view()?)
    })
}

/// Samples of the source's inertial unit since the frame before; none without a unit or a time.
pub fn inertial_samples(
    source: &dyn FrameSource,
    before_ns: Option<u64>,
    stamp_ns: Option<u64>,
) -> &[InertialSample] {
    let unit = source.info().inertial.as_deref().zip(stamp_ns);
    unit.map_or(&[], |(unit, stamp_ns)| unit.between(before_ns, stamp_ns))
}

/// Runs `consume` with the frames of the source that `frames` numbers, decoded ahead in order.
/// Reading ends after an error, or after one that ends the source where `skip_bad_frames` is set;
/// all ends when `consume` returns.
pub fn read_ahead<R>(
    source: &dyn FrameSource,
    frames: impl Iterator<Item = (usize, usize)> + Send,
    skip_bad_frames: bool,
    consume: impl FnOnce(&Receiver<ReadFrame>) -> R,
) -> R {
    std::thread::scope(|scope| {
        // One frame more is with the sender while it waits.
        let (sender, receiver) = sync_channel(AHEAD - 1);
        scope.spawn(move || {
            for (position, index) in frames {
                let images = source.frame(index);
                let last =
                    images.as_ref().is_err_and(|error| error.ends_source() || !skip_bad_frames);
                let frame = ReadFrame {
                    position,
                    index,
                    stamp_ns: source.stamp_ns(index),
                    time_s: source.time_s(index),
                    images,
                };
                // A receiver that is gone has ended the run.
                if sender.send(frame).is_err() || last {
                    break;
                }
            }
        });
        let result = consume(&receiver);
        drop(receiver);
        result
    })
}
