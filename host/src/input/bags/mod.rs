//! Recordings of ROS as MCAP files: `sensor_msgs/Image`, `CompressedImage`, `CameraInfo` and `Imu`.
//!
//! Opening reads all files once, chunk by chunk, for the time stamp of every image and the first
//! calibration of each camera. A frame is then read by its time through its file's index. Memory:
//! one chunk of a file at a time, its index, 32 bytes for each image.

mod cameras;
mod container;
mod images;
mod index;
mod inertial;
mod listing;
mod mcap_file;
mod messages;
mod recording;
mod stamps;
mod topics;

#[cfg(test)]
mod tests;

use super::data_set::{DataSet, Layout, OpenOptions, no_sequences};
use super::inertial::choice::InertialChoice;
use super::layouts::nearest_stamps;
use super::source::{
    FrameInfo, FrameSource, InputError, LidarScan, SourceInfo, StereoImages, StreamState,
    require_size,
};
use crate::formats::calibration::{SettledCameras, StereoCalibration, Swap};
use crate::formats::{Picture, RANGE_PICTURES, SampleRange};
use crate::input::diagnosis;
use recording::{Entry, Recording};
use stamps::TimedImages;
use std::path::Path;

/// Command that converts recordings.
const CONVERT: &str = "`rosbags-convert";

/// Pairs tried for one that can be read.
const FIRST_PAIRS: usize = 16;

/// The stereo pairs of a recording.
pub struct Bag {
    info: SourceInfo,
    recording: Recording,
    topics: [String; 2],
    pairs: Vec<[Entry; 2]>,
    image_size: (usize, usize),
    bits: Option<u32>,
    /// True if the right camera's images are on the first topic.
    exchanged: bool,
}

/// Recordings of ROS 2.
pub const DATA_SET: Layout = Layout::new(&DataSet {
    name: "mcap",
    summary: "ROS 2: an MCAP file, or the folder of a recording with all its files",
    describe: |_| "ROS 2: MCAP, stamps and calibration of its messages".to_owned(),
    matches: listing::is_recording,
    sequences: no_sequences,
    open: |path, options| Ok(Box::new(open(path, options)?)),
});

/// Opens a recording.
///
/// # Errors
/// A file is cut off or has no index, its topics cannot be told, or there is no calibration.
fn open(path: &Path, options: &OpenOptions) -> Result<Bag, InputError> {
    let recording = Recording::open(path)?.with_bayer(options.bayer);
    let topics = topics::choose(&recording, options.topics.as_ref())?;
    let mut notes =
        vec![format!("{} (left) and {} (right), paired by time stamp", topics[0], topics[1])];
    notes.extend(recording.notes());
    let pairs = pairs(&recording, &topics, &mut notes)?;
    let first = first_pair(&recording, &topics, &pairs)?;
    let image_size = first[0].size();
    notes.extend(first[0].mosaic_note());
    let bits = match options.bits {
        Some(bits) => Some(bits),
        None => bits(&recording, &topics[0], &pairs, &mut notes),
    };
    let first = [first.map(|picture| picture.to_8_bit(bits).grey)];
    let found = cameras::cameras(&recording, &topics, options, &first)?;
    notes.extend(found.notes);
    let exchanged = found.cameras.hints().swap.is_some_and(Swap::images);
    let rows = |calibration: &StereoCalibration| diagnosis::row_difference_px(&first, calibration);
    let SettledCameras { cameras, notes: found } =
        found.cameras.settled(image_size, Some(&rows))?;
    notes.extend(found);
    let geometry = cameras.fitted(image_size, &options.rectified)?;
    let name = path.file_stem();
    let name = name.map_or_else(|| "bag".to_owned(), |stem| stem.to_string_lossy().into_owned());
    // Reading all messages of a unit takes as long as listing the images.
    let own_unit = match options.inertial {
        InertialChoice::Auto => inertial::unit(&recording, &topics[0])?,
        _ => None,
    };
    let info = SourceInfo { own_unit, notes, ..SourceInfo::new(name, pairs.len(), &geometry) };
    Ok(Bag { info, recording, topics, pairs, image_size, bits, exchanged })
}

/// The pairs of two topics, by the nearest time.
fn pairs(
    recording: &Recording,
    topics: &[String; 2],
    notes: &mut Vec<String>,
) -> Result<Vec<[Entry; 2]>, InputError> {
    let sides = [recording.entries(&topics[0])?, recording.entries(&topics[1])?];
    let TimedImages { sides, notes: found } = stamps::timed(sides, topics, recording.path())?;
    notes.extend(found);
    let [left, right] =
        sides.each_ref().map(|side| side.iter().map(|entry| entry.time_ns).collect::<Vec<_>>());
    let pairs: Vec<[Entry; 2]> = nearest_stamps(&left, &right)
        .iter()
        .map(|&(left, right)| [sides[0][left], sides[1][right]])
        .collect();
    if pairs.is_empty() {
        return Err(InputError::bag(
            recording.path(),
            format!("no image of {} has a partner of {}", topics[0], topics[1]),
        ));
    }
    let [left, right] = sides.map(|side| side.len() - pairs.len());
    if left + right > 0 {
        notes.push(format!("{left} left and {right} right images have no partner: skipped"));
    }
    Ok(pairs)
}

/// The first pair that can be read: one that cannot is refused when its turn comes.
fn first_pair(
    recording: &Recording,
    topics: &[String; 2],
    pairs: &[[Entry; 2]],
) -> Result<[Picture; 2], InputError> {
    let mut tried = pairs.iter().take(FIRST_PAIRS).map(|pair| recording.pair(topics, pair));
    let first = tried.next().ok_or(InputError::PastEnd { frames: 0 })?;
    first.or_else(|error| tried.find_map(Result::ok).ok_or(error))
}

/// Significant bits of 16-bit images, by pictures spread over the recording; `None` of other ones.
fn bits(
    recording: &Recording,
    topic: &str,
    pairs: &[[Entry; 2]],
    notes: &mut Vec<String>,
) -> Option<u32> {
    let mut range = SampleRange::default();
    for [entry, _] in pairs.iter().step_by(pairs.len().div_ceil(RANGE_PICTURES).max(1)) {
        let Ok(picture) = recording.picture(topic, entry) else { continue };
        range.add(&picture);
        if !range.is_deep() {
            return None;
        }
    }
    notes.extend(range.note());
    range.bits()
}

impl FrameSource for Bag {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn frame_info(&self, index: usize) -> FrameInfo {
        let stamp_ns = self.pairs.get(index).map(|[left, _]| left.time_ns);
        let time_s = stamp_ns.map_or(0.0, |stamp_ns| stamp_ns as f64 / 1e9);
        FrameInfo { stem: None, stamp_ns, time_s }
    }
    fn stream(&self) -> Option<StreamState> {
        None
    }

    fn frame(&self, index: usize) -> Result<StereoImages, InputError> {
        let pair = self.pairs.get(index).ok_or(InputError::PastEnd { frames: self.pairs.len() })?;
        let mut pair =
            self.recording.pair(&self.topics, pair)?.map(|picture| picture.to_8_bit(self.bits));
        if self.exchanged {
            pair.reverse();
        }
        require_size(&pair, self.image_size, |_| {
            format!("{} frame {index}", self.recording.path().display()).into()
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
