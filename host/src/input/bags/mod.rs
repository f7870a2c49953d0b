//! Recordings of ROS 2 as MCAP files: `sensor_msgs/Image`, `CompressedImage` and `CameraInfo` in
//! CDR.
//!
//! Opening reads the file once, chunk by chunk, for the time stamp of every image and the first
//! calibration of each camera. A frame is then read by its time through the file's index. Memory:
//! one chunk of the file at a time, 16 bytes for each image.

mod cdr;
mod file;
mod images;
mod topics;

#[cfg(test)]
mod tests;

use super::data_set::{DataSet, Layout, OpenOptions, no_sequences};
use super::layouts::nearest_stamps;
use super::source::{
    FrameInfo, FrameSource, InputError, LidarScan, SourceInfo, StereoImages, StreamState,
    require_size,
};
use crate::formats::calibration::{
    CalibrationFiles, CameraGeometry, SettledCameras, StereoCalibration, Swap,
};
use crate::formats::significant_bits;
use crate::input::diagnosis;
use cdr::CameraInfo;
use file::BagFile;
use std::path::{Path, PathBuf};

/// Command that converts the files of other recorders.
const CONVERT: &str = "Convert it with `mcap convert";

/// An image in the file.
#[derive(Clone, Copy, Debug)]
struct Entry {
    /// Log time, ns: the position in the recording.
    log_ns: u64,
    /// Time stamp of the header, ns.
    stamp_ns: u64,
}

/// The stereo pairs of an MCAP file.
pub struct Bag {
    info: SourceInfo,
    file: BagFile,
    topics: [String; 2],
    pairs: Vec<[Entry; 2]>,
    image_size: (usize, usize),
    bits: Option<u32>,
    /// True if the right camera's images are on the first topic.
    exchanged: bool,
}

/// The MCAP file at a path: itself, or the one in the folder of a recording.
pub fn file_at(path: &Path) -> Option<PathBuf> {
    let is_mcap =
        |path: &Path| path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"));
    if path.is_file() {
        return is_mcap(path).then(|| path.to_path_buf());
    }
    if !path.join("metadata.yaml").is_file() {
        return None;
    }
    let mut files: Vec<PathBuf> = path
        .read_dir()
        .ok()?
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| is_mcap(path))
        .collect();
    files.sort();
    files.into_iter().next()
}

/// The command that makes an MCAP file of a recording of another kind, if it is one.
pub fn conversion(path: &Path) -> Option<String> {
    let other =
        |path: &Path| path.extension().is_some_and(|ending| ending == "db3" || ending == "bag");
    let found = if path.is_file() {
        Some(path.to_path_buf()).filter(|path| other(path))
    } else {
        path.join("metadata.yaml")
            .is_file()
            .then(|| {
                path.read_dir().ok()?.flatten().map(|entry| entry.path()).find(|path| other(path))
            })
            .flatten()
    };
    let found = found?;
    let (from, to) = (found.display(), found.with_extension("mcap"));
    Some(format!(
        "{CONVERT} {from} {to}` (github.com/foxglove/mcap) and give the result",
        to = to.display()
    ))
}

/// Recordings of ROS 2.
pub const DATA_SET: Layout = Layout::new(&DataSet {
    name: "mcap",
    summary: "ROS 2: an MCAP file, or the folder of a recording with one",
    describe: |_| "ROS 2: an MCAP file, stamps and calibration of its messages".to_owned(),
    matches: |path| file_at(path).is_some(),
    sequences: no_sequences,
    open: |path, options| Ok(Box::new(open(path, options)?)),
});

/// Opens the file.
///
/// # Errors
/// It is truncated or has no index, its topics cannot be told, or there is no calibration.
fn open(path: &Path, options: &OpenOptions) -> Result<Bag, InputError> {
    let path = file_at(path).ok_or_else(|| InputError::File { path: path.to_path_buf() })?;
    let file = BagFile::open(&path)?;
    let topics = topics::choose(&file, options.topics.as_ref())?;
    let entries = [0, 1]
        .map(|side| file.entries(&topics[side]))
        .into_iter()
        .collect::<Result<Vec<_>, _>>()?;
    let stamps = |side: usize| entries[side].iter().map(|entry| entry.stamp_ns).collect::<Vec<_>>();
    let found = nearest_stamps(&stamps(0), &stamps(1));
    let pairs: Vec<[Entry; 2]> =
        found.iter().map(|&(left, right)| [entries[0][left], entries[1][right]]).collect();
    let first = pairs.first().ok_or_else(|| {
        InputError::bag(&path, format!("no image of {} has a partner of {}", topics[0], topics[1]))
    })?;
    let images = file.pair(&topics, first)?;
    let image_size = images[0].size();
    let mut notes =
        vec![format!("{} (left) and {} (right), paired by time stamp", topics[0], topics[1])];
    if pairs.len() < entries[0].len().max(entries[1].len()) {
        let [left, right] = [0, 1].map(|side| entries[side].len() - pairs.len());
        notes.push(format!("{left} left and {right} right images have no partner: skipped"));
    }
    let bits = options.bits.or_else(|| images[0].largest_sample().map(significant_bits));
    let cameras = cameras(&file, &topics, options, &mut notes)?;
    let exchanged = cameras.hints().swap.is_some_and(Swap::images);
    let first = images.clone().map(|picture| picture.to_8_bit(bits).grey);
    let rows = |calibration: &StereoCalibration| {
        diagnosis::row_difference_px(std::slice::from_ref(&first), calibration)
    };
    let SettledCameras { cameras, notes: found } = cameras.settled(image_size, Some(&rows))?;
    notes.extend(found);
    let geometry = cameras.fitted(image_size, &options.rectified)?;
    let name = path
        .file_stem()
        .map_or_else(|| "bag".to_owned(), |stem| stem.to_string_lossy().into_owned());
    let info = SourceInfo { notes, ..SourceInfo::new(name, pairs.len(), &geometry) };
    Ok(Bag { info, file, topics, pairs, image_size, bits, exchanged })
}

/// The cameras as they are given, else by the bag's `CameraInfo`.
fn cameras(
    file: &BagFile,
    topics: &[String; 2],
    options: &OpenOptions,
    notes: &mut Vec<String>,
) -> Result<CameraGeometry, InputError> {
    if !options.calibration.is_empty() {
        return Ok(options.cameras_of(&options.calibration)?);
    }
    let mut infos = Vec::new();
    for topic in topics {
        let info = topics::info_of(file, topic).ok_or_else(|| {
            InputError::bag(
                file.path(),
                format!(
                    "there is no CameraInfo for {topic}. Give the \
                calibration with --calibration FILE"
                ),
            )
        })?;
        infos.push(file.camera_info(&info)?);
        notes.push(format!("calibration of {info}"));
    }
    let [left, right] = infos.as_slice() else {
        return Err(InputError::bag(file.path(), "two calibrations are needed"));
    };
    let rectified = topics.iter().all(|topic| topic.contains("rect"))
        || [left, right].iter().all(|info| info.is_undistorted());
    let texts = [left, right].map(CameraInfo::as_yaml);
    let files = CalibrationFiles::from_camera_infos(file.path(), &texts, rectified, options.hints);
    // What is wrong with them is said here, and what only the images tell later.
    files.cameras(None)?;
    Ok(CameraGeometry::Files(Box::new(files)))
}

impl FrameSource for Bag {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn frame_info(&self, index: usize) -> FrameInfo {
        let stamp_ns = self.pairs.get(index).map(|[left, _]| left.stamp_ns);
        let time_s = stamp_ns.map_or(0.0, |stamp_ns| stamp_ns as f64 / 1e9);
        FrameInfo { stem: None, stamp_ns, time_s }
    }
    fn stream(&self) -> Option<StreamState> {
        None
    }

    fn frame(&self, index: usize) -> Result<StereoImages, InputError> {
        let pair = self.pairs.get(index).ok_or(InputError::PastEnd { frames: self.pairs.len() })?;
        let mut pair =
            self.file.pair(&self.topics, pair)?.map(|picture| picture.to_8_bit(self.bits));
        if self.exchanged {
            pair.reverse();
        }
        require_size(&pair, self.image_size, |_| {
            format!("{} frame {index}", self.file.path().display()).into()
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
