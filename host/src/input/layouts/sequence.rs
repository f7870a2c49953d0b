//! A sequence of image files: stereo pairs with a rig, times and, where known, poses. Every layout
//! on disk ends up here.

use super::lidar::LidarFiles;
use super::names::{pictures_in, stamp_in_name, stem_of};
use super::pairing::{CameraFiles, Pairing};
use super::tables::TableFrames;
use crate::formats::calibration::{
    CameraGeometry, FittedGeometry, RectifiedSize, SettledCameras, StereoCalibration, Swap,
};
use crate::formats::{
    BayerPattern, Decoded, RANGE_PICTURES, SampleRange, TimeTable, Trajectory, declared_maximum,
    picture_size, read_picture,
};
use crate::input::data_set::OpenOptions;
use crate::input::diagnosis;
use crate::input::source::{
    ASSUMED_HZ, AvailableMasks, FrameInfo, FrameSource, InputError, LidarScan, ObjectsTruth,
    OwnUnit, SourceInfo, Stacking, StereoImages, StreamState, require_size,
};
use std::path::{Path, PathBuf};

/// Pairs tried for one whose size can be read.
const FIRST_PAIRS: usize = 16;
/// Pairs by whose rows lenses are told apart.
const ROW_PAIRS: usize = 3;
const NS_PER_S: f64 = 1e9;

/// Stereo pairs in files.
#[derive(Debug)]
pub struct Sequence {
    info: SourceInfo,
    pairs: Vec<[PathBuf; 2]>,
    reading: PairReading,
    /// Width and height of the images in the files, px.
    image_size: (usize, usize),
    /// One a frame, ns; `None` where nothing tells them.
    stamps_ns: Option<Vec<u64>>,
    /// Numbers of the frames; times are assumed from them where no file has times.
    numbers: Vec<usize>,
    objects: Vec<ObjectsTruth>,
    lidar: Option<LidarFiles>,
}

/// The image files of a sequence.
#[derive(Clone, Debug)]
pub(super) enum ImageFiles {
    /// One file for each camera's image.
    Cameras([CameraFiles; 2]),
    /// One file for both images of a pair.
    Stacked(CameraFiles, Stacking),
}

impl ImageFiles {
    /// The images of two folders. Where all names are time stamps, these are the times.
    pub fn in_folders(left: &Path, right: &Path) -> Result<Self, InputError> {
        Ok(Self::Cameras([camera_files(left)?, camera_files(right)?]))
    }
}

/// The images of a folder.
pub(super) fn camera_files(folder: &Path) -> Result<CameraFiles, InputError> {
    let files = pictures_in(folder)?;
    Ok(CameraFiles { stamps_ns: stamps_in_names(&files), files })
}

/// The stamps in the names of files; `None` where a name holds none or they do not increase.
pub(super) fn stamps_in_names(files: &[PathBuf]) -> Option<Vec<u64>> {
    let stamps: Option<Vec<u64>> = files.iter().map(|path| stamp_in_name(&stem_of(path))).collect();
    stamps.filter(|stamps| stamps.is_sorted_by(|a, b| a < b))
}

/// Contents of a recording that a layout's loader found, before they are checked.
pub(super) struct Parts {
    pub name: String,
    pub images: ImageFiles,
    /// Number of significant bits of 16-bit images; told from the data if absent.
    pub bits: Option<u32>,
    /// Colour filters of grey images that are mosaics.
    pub bayer: Option<BayerPattern>,
    pub cameras: CameraGeometry,
    /// Size to which raw pairs are rectified.
    pub rectified: RectifiedSize,
    /// Times and poses as read, or `None` without a file.
    pub times: Option<(PathBuf, TimeTable)>,
    pub poses: Option<(PathBuf, Trajectory)>,
    /// True if file names are frame numbers, as in KITTI: row `n` of the tables then belongs to
    /// file `n`.
    pub numbered: bool,
    pub notes: Vec<String>,
    /// Folder of instance PNGs, there or not.
    pub instances: PathBuf,
    /// True objects by frame number; empty where nothing is known.
    pub objects: Vec<ObjectsTruth>,
    pub lidar: Option<LidarFiles>,
    /// Inertial unit of the recording.
    pub unit: Option<OwnUnit>,
}

impl Parts {
    /// Images and cameras, with nothing beside them.
    pub(super) fn new(
        options: &OpenOptions,
        name: String,
        images: ImageFiles,
        cameras: CameraGeometry,
    ) -> Self {
        Self {
            name,
            images,
            bits: options.bits,
            bayer: options.bayer,
            cameras,
            rectified: options.rectified,
            times: None,
            poses: None,
            numbered: false,
            notes: Vec::new(),
            instances: PathBuf::new(),
            objects: Vec::new(),
            lidar: None,
            unit: None,
        }
    }
}

impl Sequence {
    /// Pairs the images and gives each pair its time and pose.
    pub(super) fn from_parts(parts: Parts) -> Result<Self, InputError> {
        let mut notes = parts.notes;
        let (pairs, stacking, left, positions) = paired(parts.images, &mut notes)?;
        let size = first_size(&pairs, &parts.name)?;
        let image_size = stacking.map_or(size, |stacking| stacking.size_of_one(size));
        let exchanged = parts.cameras.hints().swap.is_some_and(Swap::images);
        let reading = PairReading { stacking, exchanged, bits: parts.bits, bayer: parts.bayer };
        let rows = |calibration: &StereoCalibration| row_difference(&pairs, reading, calibration);
        let SettledCameras { cameras, notes: found } =
            parts.cameras.settled(image_size, Some(&rows))?;
        let geometry = cameras.fitted(image_size, &parts.rectified)?;
        notes.extend(found);
        notes.extend(raw_note(&cameras, &geometry));
        if parts.bayer.is_none() {
            let first = pairs.iter().find_map(|[left, _]| read_picture(left).ok());
            notes.extend(first.and_then(|first| first.mosaic_note()));
        }
        let bits = match parts.bits {
            Some(bits) => Some(bits),
            None => detected_bits(&pairs, &mut notes),
        };
        let number = |&at: &usize| {
            if parts.numbered { frame_number(&left.files[at]).unwrap_or(at) } else { at }
        };
        let numbers: Vec<usize> = positions.iter().map(number).collect();
        let tables =
            TableFrames { files: &left.files, positions: &positions, numbered: parts.numbered };
        let stamps_ns = match parts.times {
            Some((path, times)) => Some(tables.times(&path, &times, &mut notes)?),
            None => left.stamps_ns.as_ref().and_then(|stamps| rows_of(stamps, &positions)),
        };
        if stamps_ns.is_none() {
            notes.push(format!("no times of the images: {ASSUMED_HZ} frames a second are assumed"));
        }
        let truth = parts
            .poses
            .and_then(|(path, read)| tables.poses(&path, &read, stamps_ns.as_deref(), &mut notes));
        let masks = Some(parts.instances).filter(|folder| folder.is_dir());
        let masks = masks.map_or(AvailableMasks::Absent, AvailableMasks::Folder);
        let objects = numbers.iter().map_while(|&row| parts.objects.get(row).cloned()).collect();
        let info = SourceInfo {
            masks,
            truth,
            own_unit: parts.unit,
            notes,
            ..SourceInfo::new(parts.name, pairs.len(), &geometry)
        };
        Ok(Self {
            info,
            pairs,
            reading: PairReading { bits, ..reading },
            image_size,
            stamps_ns,
            numbers,
            objects,
            lidar: parts.lidar,
        })
    }

    /// The two images of a pair, both of the sequence's size.
    fn images(&self, pair: &[PathBuf; 2]) -> Result<[Decoded; 2], InputError> {
        let images = self.reading.images(pair)?;
        require_size(&images, self.image_size, |side| {
            if side == 0 { pair[0].clone() } else { pair[1].clone() }
        })?;
        Ok(images)
    }
}

/// Way in which two images are read from the files of a pair.
#[derive(Clone, Copy, Debug)]
struct PairReading {
    /// Arrangement of two images in one file, if so: both paths of a pair are then equal.
    stacking: Option<Stacking>,
    /// True if the right camera's image comes first.
    exchanged: bool,
    /// Significant bits of 16-bit images.
    bits: Option<u32>,
    /// Colour filters of grey images that are mosaics.
    bayer: Option<BayerPattern>,
}

impl PairReading {
    /// The left and the right image.
    fn images(&self, [left, right]: &[PathBuf; 2]) -> Result<[Decoded; 2], InputError> {
        let read = |path: &Path| {
            let picture = read_picture(path).map_err(InputError::image)?;
            let picture = match self.bayer {
                Some(pattern) => picture
                    .demosaiced(pattern)
                    .map_err(|reason| InputError::Image { path: path.to_path_buf(), reason })?,
                None => picture,
            };
            Ok::<_, InputError>(picture.to_8_bit(self.bits))
        };
        let mut images = match self.stacking {
            None => [read(left)?, read(right)?],
            Some(stacking) => stacking.split(&read(left)?).ok_or_else(|| InputError::Image {
                path: left.clone(),
                reason: format!("it cannot be cut into two equal images {}", stacking.name()),
            })?,
        };
        if self.exchanged {
            images.reverse();
        }
        Ok(images)
    }
}

/// Row difference of some pairs by a calibration.
fn row_difference(
    pairs: &[[PathBuf; 2]],
    reading: PairReading,
    calibration: &StereoCalibration,
) -> Option<f64> {
    let step = pairs.len().div_ceil(ROW_PAIRS).max(1);
    let read = |pair: &[PathBuf; 2]| Some(reading.images(pair).ok()?.map(|image| image.grey));
    let pairs: Vec<_> = pairs.iter().step_by(step).filter_map(read).collect();
    diagnosis::row_difference_px(&pairs, calibration)
}

/// Returns the note that raw images are rectified, and to which size.
fn raw_note(cameras: &CameraGeometry, geometry: &FittedGeometry) -> Option<String> {
    let CameraGeometry::Raw { calibration, path } = cameras else { return None };
    let (width, height) = geometry.size;
    let focal_px = geometry.rig.focal_px;
    Some(format!(
        "raw images: rectified to {width} x {height} px, focal length {focal_px:.1} px, by {} ({})",
        path.display(),
        calibration.format
    ))
}

/// The pairs, how two images lie in one file, the left camera's files, and the position of each
/// pair's left image among them.
type Paired = (Vec<[PathBuf; 2]>, Option<Stacking>, CameraFiles, Vec<usize>);

fn paired(images: ImageFiles, notes: &mut Vec<String>) -> Result<Paired, InputError> {
    let [left, right] = match images {
        ImageFiles::Stacked(files, stacking) => {
            let pairs = files.files.iter().map(|path| [path.clone(), path.clone()]).collect();
            let positions = (0..files.files.len()).collect();
            return Ok((pairs, Some(stacking), files, positions));
        }
        ImageFiles::Cameras(cameras) => cameras,
    };
    let pairing = Pairing::of(&left, &right).ok_or_else(|| {
        let example = |camera: &CameraFiles| camera.files.first().cloned().unwrap_or_default();
        InputError::Pairs {
            left: example(&left),
            right: example(&right),
            counts: (left.files.len(), right.files.len()),
        }
    })?;
    notes.extend(pairing.note());
    let pairs = pairing
        .pairs
        .iter()
        .map(|&(l, r)| [left.files[l].clone(), right.files[r].clone()])
        .collect();
    let positions = pairing.pairs.iter().map(|&(at, _)| at).collect();
    Ok((pairs, None, left, positions))
}

/// Width and height of the first left picture whose header can be read: one that cannot is refused
/// when its turn comes.
fn first_size(pairs: &[[PathBuf; 2]], name: &str) -> Result<(usize, usize), InputError> {
    let mut sizes = pairs.iter().map(|[left, _]| picture_size(left).map_err(InputError::image));
    let first = sizes.next().ok_or_else(|| InputError::Empty { path: PathBuf::from(name) })?;
    first.or_else(|error| sizes.take(FIRST_PAIRS).find_map(Result::ok).ok_or(error))
}

/// Detects the number of significant bits of 16-bit images: as the first says in its header, else
/// from pictures spread over the sequence; `None` of 8-bit ones. A picture that cannot be read is
/// passed over: it is refused when its turn comes.
fn detected_bits(pairs: &[[PathBuf; 2]], notes: &mut Vec<String>) -> Option<u32> {
    let mut range = SampleRange::default();
    let declared = pairs.first().and_then(|[left, _]| declared_maximum(left));
    if let Some(maximum) = declared {
        range = SampleRange::from_declared(maximum);
    } else {
        let step = pairs.len().div_ceil(RANGE_PICTURES).max(1);
        for [path, _] in pairs.iter().step_by(step) {
            let Ok(picture) = read_picture(path) else { continue };
            range.add(&picture);
            if !range.is_deep() {
                return None;
            }
        }
    }
    notes.extend(range.note());
    range.bits()
}

/// The chosen rows of a table; `None` where one is missing.
fn rows_of<T: Copy>(table: &[T], rows: &[usize]) -> Option<Vec<T>> {
    rows.iter().map(|&row| table.get(row).copied()).collect()
}

impl FrameSource for Sequence {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn frame_info(&self, index: usize) -> FrameInfo {
        let stamp_ns = self.stamps_ns.as_ref().and_then(|stamps| stamps.get(index).copied());
        let assumed = || self.numbers.get(index).map_or(0.0, |&number| number as f64 / ASSUMED_HZ);
        FrameInfo {
            stem: self.pairs.get(index).map(|[left, _]| stem_of(left)),
            stamp_ns,
            time_s: stamp_ns.map_or_else(assumed, |stamp_ns| stamp_ns as f64 / NS_PER_S),
        }
    }

    fn stream(&self) -> Option<StreamState> {
        None
    }

    fn frame(&self, index: usize) -> Result<StereoImages, InputError> {
        let pair = self.images(
            self.pairs.get(index).ok_or(InputError::PastEnd { frames: self.pairs.len() })?,
        )?;
        Ok(StereoImages {
            objects: self.objects.get(index).cloned(),
            ..StereoImages::of_pair(pair)
        })
    }

    fn has_lidar(&self, index: usize) -> bool {
        self.lidar.as_ref().zip(self.stem(index)).is_some_and(|(lidar, stem)| lidar.has(&stem))
    }

    fn lidar(&self, index: usize) -> Result<Option<LidarScan>, InputError> {
        let Some((lidar, stem)) = self.lidar.as_ref().zip(self.stem(index)) else {
            return Ok(None);
        };
        lidar.read(&stem)
    }
}

/// `000123.png` is frame 123.
fn frame_number(path: &Path) -> Option<usize> {
    stem_of(path).parse().ok()
}

/// The path, when it is there.
pub(super) fn present(path: PathBuf, action: &str) -> Result<PathBuf, InputError> {
    if path.exists() { Ok(path) } else { Err(InputError::Part { path, action: action.to_owned() }) }
}
