//! DrivingStereo: `train-left-image/SEQUENCE` and `train-right-image/SEQUENCE`, or the folders of a
//! weather, `left-image-half-size` and `right-image-half-size`; `half-image-calib/SEQUENCE.txt`. The
//! names of all images of a recording begin with that of its sequence.

use super::kitti::{chosen, sequences};
use super::names::{pictures_in, stem_of};
use super::pairing::CameraFiles;
use super::sequence::{ImageFiles, Parts, Sequence, present};
use crate::formats::bounds::CALIBRATION_TEXT;
use crate::formats::{parse_date, picture_size, read_text_within};
use crate::input::data_set::{DataSet, Layout, OpenOptions};
use crate::input::source::InputError;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Folders of the images, left and right.
const SIDES: [[&str; 2]; 5] = [
    ["train-left-image", "train-right-image"],
    ["test-left-image", "test-right-image"],
    ["left-image-full-size", "right-image-full-size"],
    ["left-image-half-size", "right-image-half-size"],
    ["left-image", "right-image"],
];
/// Folders above that of the images in which calibrations are looked for.
const ABOVE: usize = 3;
/// Folders below one with calibrations in its name, for the two sizes.
const SIZES: [&str; 3] = ["", "half-image-calib", "full-image-calib"];
/// Letters of a date and time in a name: `2018-07-09-16-11-56`.
const DATE_LETTERS: usize = 19;

/// DrivingStereo.
pub const DATA_SET: Layout = Layout::new(&DataSet {
    name: "drivingstereo",
    summary: "DrivingStereo: `train-left-image/SEQUENCE`, `train-right-image/SEQUENCE`, \
              `half-image-calib/SEQUENCE.txt`",
    describe: |_| "DrivingStereo: left and right images of each recording".to_owned(),
    matches: |path| sides_of(path).next().is_some(),
    sequences: |path| Ok(recordings(path)?.into_keys().collect()),
    open: |path, options| Ok(Box::new(open(path, options)?)),
});

/// The pairs of folders below a path whose left one is there.
fn sides_of(path: &Path) -> impl Iterator<Item = [PathBuf; 2]> {
    let both = SIDES.map(|sides| sides.map(|side| path.join(side)));
    both.into_iter().filter(|[left, _]| left.is_dir())
}

/// The recordings below a path, with the folders of their images.
fn recordings(path: &Path) -> Result<BTreeMap<String, [PathBuf; 2]>, InputError> {
    let mut recordings = BTreeMap::new();
    for sides in sides_of(path) {
        for name in sequences(&sides[0])?.into_iter().filter(|name| is_date(name)) {
            let folders = sides.each_ref().map(|side| side.join(&name));
            recordings.insert(name, folders);
        }
        // Unpacked without folders, the names of the images tell.
        for file in pictures_in(&sides[0]).unwrap_or_default() {
            if let Some(name) = recording_of(&file) {
                recordings.entry(name).or_insert_with(|| sides.clone());
            }
        }
    }
    Ok(recordings)
}

fn is_date(name: &str) -> bool {
    stamp_ns(&format!("{name}-000")).is_some()
}

/// The recording of an image, `DRIVE_2018-07-09-16-12-14-770.jpg`.
fn recording_of(file: &Path) -> Option<String> {
    let stem = stem_of(file);
    let (recording, _) = stem.split_once('_')?;
    is_date(recording).then(|| recording.to_owned())
}

/// Time of a name's end, `2018-07-09-16-12-14-770`: ns since 1970.
fn stamp_ns(text: &str) -> Option<u64> {
    let (date, ms) = text.split_at_checked(DATE_LETTERS)?;
    let parts: Vec<&str> = date.split('-').collect();
    let [year, month, day, hour, minute, second] = parts.as_slice() else { return None };
    let ms = ms.strip_prefix('-').filter(|ms| ms.len() == 3)?;
    parse_date(&format!("{year}-{month}-{day} {hour}:{minute}:{second}.{ms}"))
}

/// Opens a recording.
fn open(path: &Path, options: &OpenOptions) -> Result<Sequence, InputError> {
    let all = recordings(path)?;
    let names: Vec<String> = all.keys().cloned().collect();
    let name = chosen(path, options.sequence.as_deref(), &names)?;
    let [left, right] = all.get(&name).cloned().unwrap_or_default();
    let action = "Fetch the right images of the data set: a stereo mapper needs both cameras";
    let camera = |folder: &Path| -> Result<CameraFiles, InputError> {
        let files = pictures_in(folder)?.into_iter();
        let files: Vec<PathBuf> = files
            .filter(|file| recording_of(file).is_none_or(|recording| recording == name))
            .collect();
        let stamp = |file: &PathBuf| {
            let stem = stem_of(file);
            stamp_ns(stem.rsplit_once('_').map_or(stem.as_str(), |(_, time)| time))
        };
        let stamps_ns: Option<Vec<u64>> = files.iter().map(stamp).collect();
        let stamps_ns = stamps_ns.filter(|stamps| stamps.is_sorted_by(|a, b| a < b));
        Ok(CameraFiles { files, stamps_ns })
    };
    let images = [camera(&left)?, camera(&present(right, action)?)?];
    let cameras = if options.calibration.is_empty() {
        let size = images[0].files.first().and_then(|file| picture_size(file).ok());
        options.cameras_of(&[calibration(path, &name, size)?])?
    } else {
        options.cameras_of(&options.calibration)?
    };
    Sequence::from_parts(Parts {
        instances: path.join("instances"),
        ..Parts::new(options, format!("drivingstereo-{name}"), ImageFiles::Cameras(images), cameras)
    })
}

/// The calibration of a recording for images of a size: full and half ones differ.
fn calibration(
    path: &Path,
    name: &str,
    size: Option<(usize, usize)>,
) -> Result<PathBuf, InputError> {
    let file_name = format!("{name}.txt");
    let root = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let mut files = Vec::new();
    for above in root.ancestors().take(ABOVE) {
        let below = sequences(above).unwrap_or_default().into_iter();
        let folders = below.filter(|folder| folder.contains("calib"));
        let inner = folders.flat_map(|folder| SIZES.map(|size| above.join(&folder).join(size)));
        files.extend(inner.map(|folder| folder.join(&file_name)).filter(|file| file.is_file()));
    }
    let suits = |file: &&PathBuf| size.is_some() && rectified_size(file) == size;
    files.iter().find(suits).or(files.first()).cloned().ok_or_else(|| InputError::Part {
        path: path.join("half-image-calib").join(&file_name),
        action: "Fetch the calibrations of the data set and unpack them next to the images, or \
                 give one with --calibration"
            .to_owned(),
    })
}

/// Size of rectified images that a calibration says.
fn rectified_size(file: &Path) -> Option<(usize, usize)> {
    let text = read_text_within(file, &CALIBRATION_TEXT).ok()?;
    let line = text.lines().find_map(|line| line.trim().strip_prefix("S_rect_101:"))?;
    let mut sides = line.split_whitespace().map(|word| word.parse::<f64>().ok());
    let mut side = || sides.next().flatten().map(|side| side as usize);
    Some((side()?, side()?))
}
