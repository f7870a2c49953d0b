//! Streams: frames that come once, in order, and whose number is unknown: from a camera, through a
//! pipe, or from any iterator.
//!
//! [`Stream`] makes a source of frames from an iterator of pairs; [`netpbm`] is such an iterator over bytes. A thread takes pairs from the
//! iterator into a queue of [`QUEUE`] pairs. Where it is full, the iterator waits, or the oldest
//! pair is dropped and counted ([`WhenLate`]).
//!
//! Memory: [`QUEUE`] pairs, the one being read, and the first until the second is asked for.

pub mod netpbm;
mod queue;
#[cfg(test)]
mod tests;

pub use queue::WhenLate;

use super::source::{
    ASSUMED_HZ, FrameInfo, FrameSource, InputError, LidarScan, SourceInfo, StereoImages,
    StopRequest, StreamState, require_size,
};
use crate::formats::Decoded;
use crate::formats::calibration::{
    CameraGeometry, RectifiedSize, SettledCameras, StereoCalibration, Swap,
};
use crate::input::diagnosis;
use queue::{Arrived, Queue};
use std::sync::{Arc, Mutex, PoisonError};

/// Pairs that wait for the mapper, at most.
pub const QUEUE: usize = 2;

/// Left and right image of a frame.
pub type Pair = [Decoded; 2];

/// Facts that a stream does not contain.
#[derive(Clone, Debug)]
pub struct StreamOptions {
    /// Name of the data set.
    pub name: String,
    /// The cameras.
    pub cameras: CameraGeometry,
    /// Size to which raw pairs are rectified.
    pub rectified: RectifiedSize,
    /// Frames a second, where known: frames then bear time stamps by their number. Without it
    /// [`ASSUMED_HZ`] is assumed.
    pub rate_hz: Option<f64>,
    /// Treatment of frames that come while the mapper is busy.
    pub when_late: WhenLate,
}

/// A source of frames over an iterator of pairs.
pub struct Stream {
    options: StreamOptions,
    info: SourceInfo,
    image_size: (usize, usize),
    queue: Arc<Queue>,
    stop: StopRequest,
    cursor: Mutex<Cursor>,
    /// True if the right camera's images come first.
    exchanged: bool,
}

/// Position up to which a stream is read.
#[derive(Default)]
struct Cursor {
    /// Frames handed out.
    taken: usize,
    /// Number of the last among all that came, dropped ones included.
    number: u64,
    /// The first frame, which may be looked at before the run.
    first: Option<Pair>,
}

impl Stream {
    /// Begins to take pairs from `pairs` on a thread of its own, and waits for the first of them.
    /// `stop` ends the waiting for frames.
    ///
    /// # Errors
    /// There is no pair, the first cannot be read, or the calibration is for images of another
    /// size.
    pub fn begin<I>(options: StreamOptions, stop: StopRequest, pairs: I) -> Result<Self, InputError>
    where
        I: Iterator<Item = Result<Pair, InputError>> + Send + 'static,
    {
        let queue = Arc::new(Queue::new(QUEUE, options.when_late));
        let sender = Arc::clone(&queue);
        // Not joined: it may wait for a byte that never comes.
        std::thread::spawn(move || {
            for pair in pairs {
                if !sender.push(pair) {
                    return;
                }
            }
            sender.close();
        });
        let first = queue.pop(&stop).ok_or(InputError::PastEnd { frames: 0 })?;
        let pair = first.pair?;
        let image_size = (pair[0].grey.width(), pair[0].grey.height());
        let hints = options.cameras.hints();
        let first_pair = [pair.each_ref().map(|image| image.grey.clone())];
        let rows = |calibration: &StereoCalibration| {
            diagnosis::row_difference_px(&first_pair, calibration)
        };
        let SettledCameras { cameras, mut notes } =
            options.cameras.clone().settled(image_size, Some(&rows))?;
        let geometry = cameras.fitted(image_size, &options.rectified)?;
        let rate = match options.rate_hz {
            Some(rate_hz) => format!("a stream of {rate_hz} frames a second"),
            None => {
                format!("a stream: {ASSUMED_HZ} frames a second are assumed; --rate says otherwise")
            }
        };
        notes.push(rate);
        let exchanged = hints.swap.is_some_and(Swap::images);
        let cursor = Mutex::new(Cursor { taken: 0, number: first.number, first: Some(pair) });
        let info = SourceInfo { notes, ..SourceInfo::new(options.name.clone(), 0, &geometry) };
        Ok(Self { info, image_size, queue, stop, cursor, options, exchanged })
    }

    /// Time of frame number `number`, s.
    fn at_s(&self, number: u64) -> f64 {
        number as f64 / self.options.rate_hz.unwrap_or(ASSUMED_HZ)
    }

    /// Number of a frame among all that came, where it is the last one read; else as if none was
    /// dropped.
    fn number_of(&self, index: usize) -> u64 {
        let cursor = self.cursor.lock().unwrap_or_else(PoisonError::into_inner);
        if cursor.taken == index + 1 { cursor.number } else { index as u64 }
    }

    /// The pair at `index`; those before it are passed over.
    fn pair(&self, index: usize) -> Result<Pair, InputError> {
        let mut cursor = self.cursor.lock().unwrap_or_else(PoisonError::into_inner);
        if index == 0
            && let Some(first) = &cursor.first
        {
            let first = first.clone();
            cursor.taken = 1;
            return Ok(first);
        }
        if cursor.first.take().is_some() {
            cursor.taken = 1;
        }
        loop {
            let Some(Arrived { number, pair }) = self.queue.pop(&self.stop) else {
                return Err(InputError::PastEnd { frames: cursor.taken });
            };
            let pair = pair?;
            (cursor.taken, cursor.number) = (cursor.taken + 1, number);
            if cursor.taken > index {
                return Ok(pair);
            }
        }
    }
}

impl Drop for Stream {
    fn drop(&mut self) {
        self.queue.abandon();
    }
}

impl FrameSource for Stream {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn frame_info(&self, index: usize) -> FrameInfo {
        let time_s = self.at_s(self.number_of(index));
        // Where frames may be dropped, the mapper must know how much later the next one was taken.
        let known = self.options.rate_hz.is_some() || self.options.when_late == WhenLate::Drop;
        let stamp_ns = known.then(|| (time_s * 1e9).round() as u64);
        FrameInfo { stem: None, stamp_ns, time_s }
    }
    fn stream(&self) -> Option<StreamState> {
        Some(StreamState { dropped: self.queue.dropped() })
    }

    fn frame(&self, index: usize) -> Result<StereoImages, InputError> {
        let mut pair = self.pair(index)?;
        if self.exchanged {
            pair.reverse();
        }
        require_size(&pair, self.image_size, |_| {
            format!("frame {index} of the {}", self.options.name).into()
        })?;
        Ok(StereoImages::of_pair(pair))
    }

    fn has_lidar(&self, _: usize) -> bool {
        false
    }

    fn lidar(&self, _: usize) -> Result<Option<LidarScan>, InputError> {
        Ok(None)
    }
}
