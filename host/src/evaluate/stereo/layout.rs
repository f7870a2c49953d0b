//! The benchmarks' folders.

use std::path::{Path, PathBuf};

/// Folders and file names of one benchmark.
struct Layout {
    name: &'static str,
    /// Folders of the left and of the right images, the first that is there.
    cameras: [&'static [&'static str]; 2],
    /// Truth of what both cameras see, and of all the left one sees.
    truth: [&'static str; 2],
}

const LAYOUTS: [Layout; 2] = [
    Layout {
        name: "kitti-2012",
        cameras: [&["image_0", "colored_0"], &["image_1", "colored_1"]],
        truth: ["disp_noc", "disp_occ"],
    },
    Layout {
        name: "kitti-2015",
        cameras: [&["image_2"], &["image_3"]],
        truth: ["disp_noc_0", "disp_occ_0"],
    },
];
const OBJECTS: &str = "obj_map";

/// A folder of pairs with truth.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StereoSet {
    /// `kitti-2012` or `kitti-2015`.
    pub name: &'static str,
    /// The pairs that have truth, by name.
    pub pairs: Vec<StereoPair>,
}

/// One pair with truth: files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StereoPair {
    /// File name without its ending: `000027_10`.
    pub name: String,
    /// Left and right image.
    pub images: [PathBuf; 2],
    /// Truth of what both cameras see, and of all; either may be missing.
    pub truth: [Option<PathBuf>; 2],
    /// Foreground objects, numbered from 1.
    pub objects: Option<PathBuf>,
}

/// Reason why a folder holds nothing to evaluate.
#[derive(Debug, thiserror::Error)]
pub enum StereoSetError {
    /// No such folder.
    #[error("there is no folder {path}. Check the path")]
    Absent {
        /// Folder asked for.
        path: PathBuf,
    },
    /// The folder has none of the layouts.
    #[error(
        "{path} is not a stereo benchmark. KITTI 2012 has image_0, image_1 (or colored_0, \
         colored_1) and disp_noc, disp_occ; KITTI 2015 has image_2, image_3 and \
         disp_noc_0, disp_occ_0; give the folder with these, or the one with training/ in it"
    )]
    Layout {
        /// The folder.
        path: PathBuf,
    },
    /// No truth for any image.
    #[error(
        "{path} has images, but no ground truth: it should be in {truth}. The benchmarks' test \
         halves have none"
    )]
    NoTruth {
        /// The folder.
        path: PathBuf,
        /// Folder of the truth.
        truth: &'static str,
    },
}

/// Looks for a benchmark's pairs in `path` or its `training`.
///
/// # Errors
/// The folder is not there, has no known layout, or no truth.
pub fn find_stereo_set(path: &Path) -> Result<StereoSet, StereoSetError> {
    if !path.is_dir() {
        return Err(StereoSetError::Absent { path: path.to_path_buf() });
    }
    let mut without_truth = None;
    // As unpacked, or one folder further up.
    for root in [path.to_path_buf(), path.join("training")] {
        for Layout { name, cameras, truth } in LAYOUTS {
            let found = |names: &[&str]| {
                names.iter().map(|name| root.join(name)).find(|folder| folder.is_dir())
            };
            let ([Some(left), Some(right)], objects) = (cameras.map(found), root.join(OBJECTS))
            else {
                continue;
            };
            // A pair counts only with both images and its truth.
            let there = |file: PathBuf| Some(file).filter(|file| file.is_file());
            let mut pairs: Vec<StereoPair> = left
                .read_dir()
                .into_iter()
                .flatten()
                .flatten()
                .filter_map(|entry| {
                    let file = entry.file_name();
                    let pair = StereoPair {
                        name: entry.path().file_stem()?.to_string_lossy().into_owned(),
                        images: [there(left.join(&file))?, there(right.join(&file))?],
                        truth: truth.map(|folder| there(root.join(folder).join(&file))),
                        objects: there(objects.join(&file)),
                    };
                    pair.truth.iter().any(Option::is_some).then_some(pair)
                })
                .collect();
            // By name, since folders list their files in any order.
            pairs.sort_by(|a, b| a.name.cmp(&b.name));
            if !pairs.is_empty() {
                return Ok(StereoSet { name, pairs });
            }
            // Remembered, because the images are there: the message should name what is missing.
            without_truth = Some(StereoSetError::NoTruth { path: root.clone(), truth: truth[0] });
        }
    }
    Err(without_truth.unwrap_or_else(|| StereoSetError::Layout { path: path.to_path_buf() }))
}
