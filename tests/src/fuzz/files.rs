//! Readers of files, handed a file with any content.

use std::fs;
use std::io::Cursor;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use dynvox::evaluate::trajectory::read_trajectory;
use dynvox::formats::calibration::{
    KittiCalibration, StereoCalibration, UnitCalibration, read_rig,
};
use dynvox::formats::{
    read_gnss, read_inertial, read_numbered, read_opencv_depth, read_pfm, read_png_deep,
    read_png_u16, read_poses, read_stamped_names, read_times,
};
use dynvox::input::masks::{MaskChoice, attach};
use dynvox::input::stream::netpbm::NetpbmPairs;
use dynvox::input::{OpenOptions, Stacking, StopRequest, open};
use dynvox::run::store::BlockFile;
use dynvox_core::volume::{BlockCoord, BlockKey};

/// Pairs read of a stream at most.
const FRAMES: usize = 4;
/// Size of the images, px.
pub const SIZE: [u32; 2] = [48, 32];
/// Voxel size and truncation of a store, m.
pub const VOXEL_M: f32 = 0.05;
pub const TRUNCATION_M: f32 = 0.25;

/// A folder that goes with its content.
pub(super) struct Folder(PathBuf);

impl Folder {
    pub fn new() -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let name =
            format!("dynvox-fuzz-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let path = std::env::temp_dir().join(name);
        fs::create_dir_all(&path).expect("a folder for temporary files");
        Self(path)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    pub fn file(&self, name: &str, content: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, content).expect("the temporary folder can be written to");
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Returns the bytes that a writer writes.
pub fn written(name: &str, write: impl FnOnce(&Path)) -> Vec<u8> {
    let folder = Folder::new();
    let path = folder.0.join(name);
    write(&path);
    fs::read(&path).expect("it was written")
}

/// The first byte chooses a way to read the others.
fn choose<'b, T: Copy>(bytes: &'b [u8], of: &[T]) -> Option<(T, &'b [u8])> {
    let (&first, rest) = bytes.split_first()?;
    Some((*of.get(usize::from(first) % of.len())?, rest))
}

/// File endings of calibrations, by the first byte.
const CALIBRATIONS: [&str; 4] = ["yaml", "xml", "txt", "toml"];

pub fn calibration(bytes: &[u8]) -> bool {
    let Some((ending, content)) = choose(bytes, &CALIBRATIONS) else { return false };
    let folder = Folder::new();
    let path = folder.file(&format!("calibration.{ending}"), content);
    let raw = StereoCalibration::read(&[&path], Some(SIZE)).is_ok()
        | StereoCalibration::read(&[&path, &path], None).is_ok();
    raw | KittiCalibration::read(&path).is_ok() | read_rig(&path).is_ok()
}

pub fn poses(bytes: &[u8]) -> bool {
    let folder = Folder::new();
    let path = folder.file("poses.txt", bytes);
    read_poses(&path).is_ok() | read_numbered(&path).is_ok() | read_trajectory(&path).is_ok()
}

pub fn times(bytes: &[u8]) -> bool {
    let folder = Folder::new();
    let path = folder.file("times.txt", bytes);
    read_times(&path).is_ok() | read_stamped_names(&path).is_ok() | read_gnss(&path).is_ok()
}

/// Files of an inertial unit, by the first byte.
const UNIT_FILES: [&str; 3] = ["imu.csv", "camchain.yaml", "mount.txt"];

pub fn inertial(bytes: &[u8]) -> bool {
    let Some((name, content)) = choose(bytes, &UNIT_FILES) else { return false };
    let folder = Folder::new();
    let path = folder.file(name, content);
    read_inertial(&path).is_ok() | UnitCalibration::read(&[path]).is_ok()
}

/// The files of a recording in the layout of the tracking benchmark, by the first byte.
const RECORDING: [&str; 4] =
    ["label_02/0000.txt", "velodyne/0000/000000.bin", "calib/0000.txt", "poses/0000.txt"];

pub fn recording(bytes: &[u8]) -> bool {
    let Some((name, content)) = choose(bytes, &RECORDING) else { return false };
    let folder = Folder::new();
    let image = super::seeds::pgm(SIZE);
    let whole: [(&str, &[u8]); 6] = [
        ("image_02/0000/000000.pgm", &image),
        ("image_03/0000/000000.pgm", &image),
        ("calib/0000.txt", super::seeds::KITTI),
        ("poses/0000.txt", super::seeds::POSE),
        ("label_02/0000.txt", super::seeds::LABEL),
        ("velodyne/0000/000000.bin", &[0; 32]),
    ];
    for (file, content) in whole.into_iter().chain([(name, content)]) {
        let path = folder.0.join("training").join(file);
        fs::create_dir_all(path.parent().unwrap_or(&folder.0)).expect("a folder");
        fs::write(path, content).expect("the temporary folder can be written to");
    }
    open(&folder.0, &OpenOptions::default())
        .is_ok_and(|source| source.frame(0).is_ok() && source.lidar(0).is_ok())
}

/// File endings of pictures, by the first byte.
const PICTURES: [&str; 5] = ["png", "pgm", "jpg", "tif", "bmp"];

pub fn pictures(bytes: &[u8]) -> bool {
    let Some((ending, content)) = choose(bytes, &PICTURES) else { return false };
    let folder = Folder::new();
    let path = folder.file(&format!("picture.{ending}"), content);
    dynvox::formats::read_picture(&path).is_ok()
        | read_png_u16(&path).is_ok()
        | read_png_deep(&path).is_ok()
}

/// File endings of depth, by the first byte.
const DEPTH: [&str; 2] = ["pfm", "xml"];

pub fn depth(bytes: &[u8]) -> bool {
    let Some((ending, content)) = choose(bytes, &DEPTH) else { return false };
    let (folder, size) = (Folder::new(), (4, 3));
    let path = folder.file(&format!("depth.{ending}"), content);
    read_pfm(&path, size).is_ok() | read_opencv_depth(&path, size).is_ok()
}

/// Formats of masks, by the first byte: the choice on the command line, and the file that the bytes
/// become.
const MASKS: [(&str, &str); 6] = [
    ("files:", "instances/000000.png"),
    ("coco:", "coco.json"),
    ("yolo:", "yolo/000000.txt"),
    ("boxes:", "labels.txt"),
    ("ids:", "ids/000000.png"),
    ("boxes:", "boxes/000000.txt"),
];

pub fn masks(bytes: &[u8]) -> bool {
    let Some(((choice, name), content)) = choose(bytes, &MASKS) else { return false };
    let folder = Folder::new();
    for side in ["left", "right"] {
        fs::create_dir_all(folder.0.join(side)).expect("a folder");
        folder.file(&format!("{side}/000000.pgm"), &super::seeds::pgm(SIZE));
    }
    folder.file("calib.txt", super::seeds::RIG);
    let path = folder.0.join(name);
    fs::create_dir_all(path.parent().unwrap_or(Path::new(""))).expect("a folder");
    fs::write(&path, content).expect("the temporary folder can be written to");
    let source = open(&folder.0, &OpenOptions::default()).expect("the images are sound");
    let from = if name.contains('/') { path.parent().unwrap_or(&path) } else { &path };
    let Ok(choice) = format!("{choice}{}", from.display()).parse::<MaskChoice>() else {
        return false;
    };
    attach(source, &choice, NonZeroUsize::MIN, &StopRequest::default())
        .is_ok_and(|source| source.frame(0).is_ok_and(|frame| !frame.masks.instances.is_empty()))
}

pub fn store(bytes: &[u8]) -> bool {
    let folder = Folder::new();
    let path = folder.file("map.blocks", bytes);
    let Ok((mut file, opened)) = BlockFile::open(&path, VOXEL_M, TRUNCATION_M) else {
        return false;
    };
    for tile in file.tiles() {
        for key in file.blocks_of(tile) {
            file.holds(key);
        }
    }
    file.holds(BlockKey::in_first(BlockCoord { x: 0, y: 0, z: 0 }));
    opened.records > 0
}

/// Arrangements of a stream's images, by the first byte.
const STACKINGS: [Option<Stacking>; 3] =
    [None, Some(Stacking::SideBySide), Some(Stacking::TopBottom)];

pub fn stream(bytes: &[u8]) -> bool {
    let Some((stacking, content)) = choose(bytes, &STACKINGS) else { return false };
    NetpbmPairs::new(Cursor::new(content), stacking, None)
        .take(FRAMES)
        .filter(Result::is_ok)
        .count()
        > 0
}
