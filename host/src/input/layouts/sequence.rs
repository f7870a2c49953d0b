//! A sequence of image files: two lists of PNGs with a rig, times and, where known, poses. Every layout on disk ends up here.

use super::lidar::LidarFiles;
use crate::formats::{Image, png_size, read_png};
use crate::input::source::{AvailableMasks, FrameMasks, FrameSource, InputError, LidarScan, ObjectsTruth, StereoImages, read_failed};
use dynvox_core::geometry::{StereoRig, Transform};
use std::path::{Path, PathBuf};

/// Frames per second where the data set has no times.
const ASSUMED_HZ: f64 = 10.0;

/// Stereo pairs in files.
#[derive(Debug)]
pub struct Sequence {
    name: String,
    left: Vec<PathBuf>,
    right: Vec<PathBuf>,
    size: (usize, usize),
    rig: StereoRig,
    times_s: Vec<f64>,
    truth: Option<Vec<Transform>>,
    masks: AvailableMasks,
    objects: Vec<ObjectsTruth>,
    lidar: Option<LidarFiles>,
    notes: Vec<String>,
}

/// What a layout's loader found, before it is checked.
pub(super) struct Parts {
    pub name: String,
    pub left: PathBuf,
    pub right: PathBuf,
    pub rig: StereoRig,
    /// Times and poses as read: one row per frame number, or `None` without a file.
    pub times: Option<(PathBuf, Vec<f64>)>,
    pub poses: Option<(PathBuf, Vec<Transform>)>,
    /// Whether file names are frame numbers, as in KITTI: row `n` of the tables then belongs to file `n`.
    pub numbered: bool,
    pub notes: Vec<String>,
    /// Folder of instance PNGs, there or not.
    pub instances: PathBuf,
    /// True objects by frame number; empty where nothing is known.
    pub objects: Vec<ObjectsTruth>,
    pub lidar: Option<LidarFiles>,
}

impl Sequence {
    /// Pairs the images by name and gives each its time and pose.
    pub(super) fn from_parts(parts: Parts) -> Result<Self, InputError> {
        let left = png_files(&parts.left)?;
        let right = paired(&left, &parts.left, &parts.right)?;
        let first = left.first().ok_or_else(|| InputError::Empty { path: parts.left.clone() })?;
        let size = png_size(first).map_err(InputError::image)?;
        let mut notes = parts.notes;
        let rows = left.iter().enumerate().map(|(at, path)| if parts.numbered { frame_number(path).unwrap_or(at) } else { at });
        let rows: Vec<usize> = rows.collect();
        let times_s = match parts.times {
            Some((path, times)) => {
                rows.iter().map(|&row| times.get(row).copied()).collect::<Option<Vec<f64>>>().ok_or_else(|| InputError::Table {
                    reason: format!("it has {} times, but there are images up to number {}", times.len(), rows.iter().max().unwrap_or(&0)),
                    action: "Give one line per image, or move the file away: 10 Hz are then assumed".into(),
                    path,
                })?
            }
            None => {
                notes.push(format!("no times.txt: {ASSUMED_HZ} frames a second are assumed"));
                rows.iter().map(|&row| row as f64 / ASSUMED_HZ).collect()
            }
        };
        let truth = parts.poses.and_then(|(path, poses)| {
            let found: Option<Vec<Transform>> = rows.iter().map(|&row| poses.get(row).copied()).collect();
            if found.is_none() {
                notes.push(format!("{} has only {} poses for {} images: left aside", path.display(), poses.len(), rows.len()));
            }
            found
        });
        let masks = if parts.instances.is_dir() { AvailableMasks::Folder(parts.instances) } else { AvailableMasks::Absent };
        let objects = rows.iter().map_while(|&row| parts.objects.get(row).cloned()).collect();
        Ok(Self {
            name: parts.name,
            left,
            right,
            size,
            rig: parts.rig,
            times_s,
            truth,
            masks,
            objects,
            lidar: parts.lidar,
            notes,
        })
    }
}

impl FrameSource for Sequence {
    fn name(&self) -> &str {
        &self.name
    }

    fn len(&self) -> usize {
        self.left.len()
    }

    fn size(&self) -> (usize, usize) {
        self.size
    }

    fn rig(&self) -> StereoRig {
        self.rig
    }

    fn stem(&self, index: usize) -> Option<String> {
        Some(self.left.get(index)?.file_stem()?.to_string_lossy().into_owned())
    }

    fn masks(&self) -> AvailableMasks {
        self.masks.clone()
    }

    fn time_s(&self, index: usize) -> f64 {
        self.times_s.get(index).copied().unwrap_or_default()
    }

    fn frame(&self, index: usize) -> Result<StereoImages, InputError> {
        let absent = || InputError::Absent { path: PathBuf::from(format!("{} frame {index}", self.name)) };
        let left_path = self.left.get(index).ok_or_else(absent)?;
        let right_path = self.right.get(index).ok_or_else(absent)?;
        let left = read_png(left_path).map_err(InputError::image)?;
        let right = read_png(right_path).map_err(InputError::image)?.grey;
        for (path, image) in [(left_path, &left.grey), (right_path, &right)] {
            check_size(path, image, self.size)?;
        }
        Ok(StereoImages {
            left: left.grey,
            right,
            colour: left.colour,
            depth: None,
            exact: None,
            objects: self.objects.get(index).cloned(),
            masks: FrameMasks::default(),
        })
    }

    fn has_lidar(&self, index: usize) -> bool {
        self.lidar.as_ref().zip(self.stem(index)).is_some_and(|(lidar, stem)| lidar.has(&stem))
    }

    fn lidar(&self, index: usize) -> Result<Option<LidarScan>, InputError> {
        let Some((lidar, stem)) = self.lidar.as_ref().zip(self.stem(index)) else { return Ok(None) };
        lidar.read(&stem)
    }

    fn truth(&self) -> Option<&[Transform]> {
        self.truth.as_deref()
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }
}

fn check_size(path: &Path, image: &Image<u8>, (width, height): (usize, usize)) -> Result<(), InputError> {
    if (image.width(), image.height()) == (width, height) {
        return Ok(());
    }
    Err(InputError::Size {
        path: path.to_path_buf(),
        found_width: image.width(),
        found_height: image.height(),
        width,
        height,
    })
}

/// The PNG files of a folder, by name.
pub(super) fn png_files(folder: &Path) -> Result<Vec<PathBuf>, InputError> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(read_failed(folder))? {
        let path = entry.map_err(read_failed(folder))?.path();
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(InputError::Empty { path: folder.to_path_buf() });
    }
    files.sort();
    Ok(files)
}

/// The right images of the left ones, by name. An image without partner on either side is an error: frames would shift against times.
fn paired(left: &[PathBuf], left_folder: &Path, right_folder: &Path) -> Result<Vec<PathBuf>, InputError> {
    let right = png_files(right_folder)?;
    let partner = |image: &Path, folder: &Path| folder.join(image.file_name().unwrap_or_default());
    for (images, others, folder) in [(left, right.as_slice(), right_folder), (&right, left, left_folder)] {
        let lonely = images.iter().map(|image| (image, partner(image, folder))).find(|(_, partner)| others.binary_search(partner).is_err());
        if let Some((image, partner)) = lonely {
            return Err(InputError::Partner { image: image.clone(), partner });
        }
    }
    Ok(right)
}

/// `000123.png` is frame 123.
fn frame_number(path: &Path) -> Option<usize> {
    path.file_stem()?.to_str()?.parse().ok()
}
