//! Folders of camera images: which two form a pair, and which file has the times of their images.

use super::names::{pictures_in, stem_of};
use super::pairing::CameraFiles;
use super::sequence::stamps_in_names;
use super::tables::TableFrames;
use crate::formats::{read_stamped_names, read_times};
use crate::input::source::InputError;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Names of the two cameras: as folders, or as prefixes and suffixes of file names.
pub const SIDES: [[&str; 2]; 37] = [
    ["left", "right"],
    ["Left", "Right"],
    ["LEFT", "RIGHT"],
    ["cam0", "cam1"],
    ["cam_0", "cam_1"],
    ["image_0", "image_1"],
    ["image_00", "image_01"],
    ["image_2", "image_3"],
    ["image_02", "image_03"],
    ["infra1", "infra2"],
    ["image_left", "image_right"],
    ["camera_left", "camera_right"],
    ["cam1", "cam2"],
    ["cam_left", "cam_right"],
    ["camera0", "camera1"],
    ["camera1", "camera2"],
    ["Camera_0", "Camera_1"],
    ["stereo_left", "stereo_right"],
    ["stereo_front_left", "stereo_front_right"],
    ["frame_left", "frame_right"],
    ["rectified_left", "rectified_right"],
    ["left_rect", "right_rect"],
    ["left_images", "right_images"],
    ["img_left", "img_right"],
    ["img0", "img1"],
    ["im0", "im1"],
    ["view0", "view1"],
    // RealSense's and OAK cameras' own names.
    ["Infra1", "Infra2"],
    ["infrared_1", "infrared_2"],
    ["Infrared_1", "Infrared_2"],
    ["mono_left", "mono_right"],
    ["rect_left", "rect_right"],
    ["CAM_B", "CAM_C"],
    ["I1", "I2"],
    ["l", "r"],
    ["L", "R"],
    ["0", "1"],
];
/// Names at the end of the list that say something only together: a single letter or digit.
const SHORT_SIDES: usize = 3;
/// Letters of a name that is told from the number behind it without a separator: `left0001`.
const WORD_LETTERS: usize = 4;
/// Folder in which some recordings keep a camera's images, below that of the camera.
const INNER: [&str; 3] = ["data", "data_rect", "images"];

/// The two folders of a stereo recording, by their names. One of the two is enough: the other is
/// then missed by name.
pub fn side_folders(path: &Path) -> Option<[PathBuf; 2]> {
    let both = SIDES.map(|sides| sides.map(|side| path.join(side)));
    let whole = both.iter().find(|sides| sides.iter().all(|folder| folder.is_dir()));
    // A single letter or digit is no sign of a stereo recording unless both are there.
    let half = || {
        both.iter()
            .take(SIDES.len() - SHORT_SIDES)
            .find(|sides| sides.iter().any(|folder| folder.is_dir()))
    };
    whole.or_else(half).cloned()
}

/// The images of one camera's folder, in it or in `data` below it, with their times: by `data.csv`,
/// by `timestamps.txt` or `times.txt`, by their names, in this order.
///
/// # Errors
/// There is no image, or a table of times cannot be read.
pub fn camera_in(folder: &Path) -> Result<CameraFiles, InputError> {
    let inner = INNER.iter().map(|inner| folder.join(inner)).find(|inner| inner.is_dir());
    let files = pictures_in(inner.as_deref().unwrap_or(folder))?;
    let table = |name: &str| Some(folder.join(name)).filter(|path| path.is_file());
    let stamps_ns =
        match (table("data.csv"), table("timestamps.txt").or_else(|| table("times.txt"))) {
            (Some(path), _) => stamps_by_name(&path, &files)?,
            (None, Some(path)) => Some(stamps_by_row(&path, &files)?),
            (None, None) => stamps_in_names(&files),
        };
    Ok(CameraFiles { files, stamps_ns })
}

fn stamps_by_name(table: &Path, files: &[PathBuf]) -> Result<Option<Vec<u64>>, InputError> {
    let rows: BTreeMap<String, u64> = read_stamped_names(table)?
        .into_iter()
        .map(|(stamp, name)| (stem_of(Path::new(&name)), stamp))
        .collect();
    let stamps: Option<Vec<u64>> =
        files.iter().map(|path| rows.get(&stem_of(path)).copied()).collect();
    Ok(stamps.filter(|stamps| stamps.is_sorted_by(|a, b| a < b)))
}

/// One row an image, or rows by the images' numbers where some images are missing.
fn stamps_by_row(path: &Path, files: &[PathBuf]) -> Result<Vec<u64>, InputError> {
    let positions: Vec<usize> = (0..files.len()).collect();
    let frames = TableFrames { files, positions: &positions, numbered: false };
    frames.times(path, &read_times(path)?, &mut Vec::new())
}

/// Splits the images of one folder by a prefix or suffix that names the camera: `left_0008`,
/// `0008_right`, `cam0-0008`, `left0008`, or a single pair `im0` and `im1`. `None` where not every
/// name has one.
pub fn split_by_mark(files: &[PathBuf]) -> Option<[Vec<PathBuf>; 2]> {
    let separated = |rest: &str, mark: &str, at_end: bool| {
        let next = if at_end { rest.chars().next_back() } else { rest.chars().next() };
        // A word ends where digits begin; cam0 does not.
        let is_word =
            mark.len() >= WORD_LETTERS && mark.ends_with(|c: char| c.is_ascii_alphabetic());
        next.is_some_and(|c| ['_', '-', '.'].contains(&c) || (is_word && c.is_ascii_digit()))
    };
    let has = |stem: &str, mark: &str, suffix: bool| {
        let rest = if suffix { stem.strip_suffix(mark) } else { stem.strip_prefix(mark) };
        rest.is_some_and(|rest| separated(rest, mark, suffix))
    };
    if let Some(pair) = one_pair(files) {
        return Some(pair);
    }
    for ([left, right], suffix) in
        SIDES.into_iter().flat_map(|sides| [(sides, false), (sides, true)])
    {
        let side = |mark: &str| {
            files
                .iter()
                .filter(|path| has(&stem_of(path), mark, suffix))
                .cloned()
                .collect::<Vec<_>>()
        };
        let sides = [side(left), side(right)];
        // One of each could as well be two frames that are numbered 0 and 1.
        if sides.iter().all(|side| side.len() > 1) && sides[0].len() + sides[1].len() == files.len()
        {
            return Some(sides);
        }
    }
    None
}

/// A folder with two images that are named as the two cameras.
fn one_pair(files: &[PathBuf]) -> Option<[Vec<PathBuf>; 2]> {
    let [first, second] = files else { return None };
    let stems = [first, second].map(|path| stem_of(path));
    let whole = SIDES.iter().take(SIDES.len() - SHORT_SIDES);
    for sides in whole {
        if stems == *sides {
            return Some([vec![first.clone()], vec![second.clone()]]);
        }
        if stems == [sides[1], sides[0]] {
            return Some([vec![second.clone()], vec![first.clone()]]);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(|name| PathBuf::from(format!("{name}.png"))).collect()
    }

    #[test]
    fn prefixes_and_suffixes_tell_the_sides_and_frame_numbers_do_not() {
        for names in [
            ["left_8", "left_9", "right_8", "right_9"],
            ["8_l", "9_l", "8_r", "9_r"],
            ["cam0-8", "cam0-9", "cam1-8", "cam1-9"],
            ["0_8", "0_9", "1_8", "1_9"],
            ["left0008", "left0009", "right0008", "right0009"],
            ["left01", "left02", "right01", "right02"],
            ["left-0000", "left-0001", "right-0000", "right-0001"],
            ["Infrared_1_8", "Infrared_1_9", "Infrared_2_8", "Infrared_2_9"],
            ["CAM_B_8", "CAM_B_9", "CAM_C_8", "CAM_C_9"],
            ["I1_000000", "I1_000001", "I2_000000", "I2_000001"],
            ["stereo_left_8", "stereo_left_9", "stereo_right_8", "stereo_right_9"],
        ] {
            let [left, right] = split_by_mark(&files(&names)).unwrap();
            assert_eq!((left, right), (files(&names[..2]), files(&names[2..])));
        }
        assert_eq!(split_by_mark(&files(&["frame_0", "frame_1"])), None);
        assert_eq!(split_by_mark(&files(&["left_8", "left_9", "right_8", "right_9", "map"])), None);
        assert_eq!(split_by_mark(&files(&["000000", "000001", "000010", "000011"])), None);
        assert_eq!(split_by_mark(&files(&["cam00", "cam01", "cam10", "cam11"])), None);
        let pair = split_by_mark(&files(&["im0", "im1"])).unwrap();
        assert_eq!(pair, [files(&["im0"]), files(&["im1"])]);
        assert_eq!(split_by_mark(&files(&["0", "1"])), None, "two frames of one camera");
    }
}
