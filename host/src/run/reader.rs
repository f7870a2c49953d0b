//! Decodes frames ahead of the mapper on a thread of its own, at most [`AHEAD`] of them.

use crate::input::{FrameSource, InputError, StereoImages};
use std::sync::mpsc::{Receiver, sync_channel};

/// Frames decoded and not yet taken.
pub const AHEAD: usize = 2;

/// Runs `consume` with frames `indices` of the data set, decoded ahead in order. It ends when `consume` returns.
pub fn read_ahead<R>(
    dataset: &dyn FrameSource,
    indices: &[usize],
    consume: impl FnOnce(&Receiver<(usize, Result<StereoImages, InputError>)>) -> R,
) -> R {
    std::thread::scope(|scope| {
        // One frame more is with the sender while it waits.
        let (sender, receiver) = sync_channel(AHEAD - 1);
        scope.spawn(move || {
            for &index in indices {
                let frame = dataset.frame(index);
                let last = frame.is_err();
                // A receiver that is gone has ended the run.
                if sender.send((index, frame)).is_err() || last {
                    break;
                }
            }
        });
        let result = consume(&receiver);
        drop(receiver);
        result
    })
}
