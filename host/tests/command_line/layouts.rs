//! One clip of the street in every layout and format: equal digests for all names and places of the
//! images.

use super::binary::{dynvox, output_text};
use image::{DynamicImage, GrayImage, ImageBuffer, Luma};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const FRAMES: usize = 6;
const SMALL: [&str; 4] = ["--set", "street.width=160", "--set", "street.height=64"];
/// From frame to frame, ns: 10 Hz.
const STEP_NS: u64 = 100_000_000;
/// Time of the first frame, ns.
const START_NS: u64 = 1_317_042_145_000_000_000;

/// A clip of the street, and where to dress it.
struct Clip {
    root: TempDir,
    pairs: Vec<[GrayImage; 2]>,
    /// The rows of both projection matrices.
    projections: [String; 2],
}

impl Clip {
    fn new(frames: usize, size: [&str; 4]) -> Self {
        let root = TempDir::new().unwrap();
        let written = dynvox(
            root.path(),
            &[&["synth", "--out", "street", "--frames", &frames.to_string()], &size[..]].concat(),
        );
        assert!(written.status.success(), "{}", output_text(&written));
        let sequence = root.path().join("street/sequences/00");
        // Written once, and dressed as each layout from there.
        let picture = |side: usize, at: usize| {
            image::open(sequence.join(format!("image_{side}/{at:06}.png"))).unwrap().into_luma8()
        };
        let calib = fs::read_to_string(sequence.join("calib.txt")).unwrap();
        let row = |key: &str| {
            calib.lines().find_map(|line| line.strip_prefix(key)).unwrap().trim().to_owned()
        };
        Self {
            pairs: (0..frames).map(|at| [picture(0, at), picture(1, at)]).collect(),
            projections: [row("P0:"), row("P1:")],
            root,
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.root.path().join(name)
    }

    /// KITTI's calibration lines, with these keys for the two cameras.
    fn calibration(&self, keys: [&str; 2]) -> String {
        keys.iter().zip(&self.projections).map(|(key, row)| format!("{key}: {row}\n")).collect()
    }

    /// Saves all pairs under the paths that `path` gives.
    fn save(&self, path: impl Fn(usize, usize) -> PathBuf) {
        for (at, pair) in self.pairs.iter().enumerate() {
            pair.iter()
                .enumerate()
                .for_each(|(side, image)| save(&image.clone().into(), &path(at, side)));
        }
    }

    /// Digest and notes of a run.
    fn run(&self, path: &str, more: &[&str]) -> (String, String) {
        let coarse =
            ["--profile", "tiny", "--instances", "none", "--set", "volume.voxel_size_m=0.2"];
        let args =
            [&["run", path, "--json", "--overwrite", "--out", "result"], &coarse[..]].concat();
        let run = dynvox(self.root.path(), &[&args[..], more].concat());
        assert!(run.status.success(), "{path}: {}", output_text(&run));
        let summary: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
        let inspected = dynvox(self.root.path(), &["inspect", path]);
        (
            summary["digest"].as_str().unwrap().to_owned(),
            String::from_utf8_lossy(&inspected.stdout).into_owned(),
        )
    }

    fn digest(&self, path: &str) -> String {
        self.run(path, &[]).0
    }

    /// The poses of the last run.
    fn trajectory(&self) -> String {
        fs::read_to_string(self.root.path().join("result/trajectory_kitti.txt")).unwrap()
    }

    fn plain(&self) -> String {
        self.run("street", &["--images", "grey"]).0
    }
}

fn write(path: PathBuf, text: &str) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

fn save(image: &DynamicImage, path: &Path) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    image.save(path).unwrap();
}

/// `data.csv` of a camera whose images are late by so much.
fn data_csv(late_ns: u64) -> String {
    let row = |at: usize| format!("{},{at}.png\n", START_NS + at as u64 * STEP_NS + late_ns);
    (0..FRAMES).map(row).fold("#timestamp [ns],filename\n".to_owned(), |table, row| table + &row)
}

/// Names in the layout of a data set, and its calibration.
fn dress_data_sets(clip: &Clip) {
    let at_root = |name: &'static str| clip.path(name);
    // Time stamps of the cameras may be off by a millisecond.
    for (name, late_ns) in [("euroc", 0), ("late", 1_000_000)] {
        clip.save(|at, side| at_root(name).join(format!("mav0/cam{side}/data/{at}.png")));
        write(at_root(name).join("mav0/calib.txt"), &clip.calibration(["P0", "P1"]));
        write(at_root(name).join("mav0/cam0/data.csv"), &data_csv(0));
        write(at_root(name).join("mav0/cam1/data.csv"), &data_csv(late_ns));
    }
    clip.save(|at, side| {
        at_root("tracking").join(format!("training/image_0{}/0000/{at:06}.png", side + 2))
    });
    write(
        at_root("tracking").join("training/calib/0000.txt"),
        &(clip.calibration(["P0", "P1"]) + &clip.calibration(["P2", "P3"])),
    );
    // Nanoseconds, as KITTI's raw recordings have them.
    let dates: String =
        (0..FRAMES as u64).map(|at| format!("2011-09-26 13:02:25.{:09}\n", at * STEP_NS)).collect();
    for (name, recording, data) in [
        ("raw/2011_09_26", "2011_09_26_drive_0001_sync", "data"),
        ("kitti360", "data_2d_raw/2013_05_28_drive_0000_sync", "data_rect"),
    ] {
        clip.save(|at, side| {
            at_root(name).join(format!("{recording}/image_0{side}/{data}/{at:010}.png"))
        });
        ["image_00", "image_01"].iter().for_each(|camera| {
            write(at_root(name).join(recording).join(camera).join("timestamps.txt"), &dates)
        });
    }
    let rectified = clip.calibration(["P_rect_00", "P_rect_01"]);
    write(
        at_root("raw/2011_09_26/calib_cam_to_cam.txt"),
        &format!("S_rect_00: 160 64\n{rectified}"),
    );
    write(at_root("kitti360/calibration/perspective.txt"), &rectified);
    clip.save(|at, side| {
        let folder = ["leftImg8bit", "rightImg8bit"][side];
        at_root("cityscapes")
            .join(format!("{folder}_sequence/train/aachen/aachen_000001_{at:06}_{folder}.png"))
    });
    let [left, right] = clip
        .projections
        .each_ref()
        .map(|row| row.split(' ').map(|word| word.parse().unwrap()).collect::<Vec<f64>>());
    // Cityscapes states a baseline where others have a projection.
    let camera = serde_json::json!({
        "extrinsic": { "baseline": -right[3] / right[0] },
        "intrinsic": { "fx": left[0], "fy": left[5], "u0": left[2], "v0": left[6] },
    });
    write(
        at_root("cityscapes/camera/train/aachen/aachen_000001_000002_camera.json"),
        &camera.to_string(),
    );
}

/// Two folders, one folder with prefixes or suffixes, and images that hold both cameras.
fn dress_folders(clip: &Clip) -> Vec<&'static str> {
    // Names of the two folders; the numbers begin with 8, so that 10 follows 9.
    let two = ["left/right", "cam0/cam1", "image_0/image_1", "infra1/infra2"];
    let mut names = vec!["left-right", "cam0-cam1", "image_0-image_1", "infra1-infra2"];
    for (name, sides) in names.iter().zip(two.map(|sides| sides.split_once('/').unwrap())) {
        clip.save(|at, side| {
            clip.path(name).join([sides.0, sides.1][side]).join(format!("{}.png", at + 8))
        });
    }
    clip.save(|at, side| {
        clip.path("prefixes").join(format!("{}_{}.png", ["left", "right"][side], at + 8))
    });
    clip.save(|at, side| {
        clip.path("suffixes").join(format!("{}_{}.png", at + 8, ["l", "r"][side]))
    });
    for (at, [left, right]) in clip.pairs.iter().enumerate() {
        let (width, height) = left.dimensions();
        let both = |columns: u32, rows: u32| {
            // Left or above the left picture, right or below the right one.
            GrayImage::from_fn(columns, rows, |u, v| {
                if u < width && v < height {
                    *left.get_pixel(u, v)
                } else {
                    *right.get_pixel(u % width, v % height)
                }
            })
        };
        save(
            &both(2 * width, height).into(),
            &clip.path("side-by-side").join(format!("{at:03}.png")),
        );
        save(
            &both(width, 2 * height).into(),
            &clip.path("top-bottom").join(format!("{at:03}.png")),
        );
    }
    names.extend(["prefixes", "suffixes", "side-by-side", "top-bottom"]);
    names
}

/// Each format that keeps every pixel; 16 bit with the values in the upper ones, as TUM VI.
fn dress_formats(clip: &Clip) -> Vec<&'static str> {
    for format in ["pgm", "tiff", "bmp"] {
        clip.save(|at, side| {
            clip.path(format).join(["left", "right"][side]).join(format!("{at:03}.{format}"))
        });
    }
    for (at, pair) in clip.pairs.iter().enumerate() {
        for (image, side) in pair.iter().zip(["left", "right"]) {
            // Eight bits in the upper half, as TUM VI has its pictures.
            let wide = |u: u32, v: u32| Luma([u16::from(image.get_pixel(u, v).0[0]) << 8]);
            let wide =
                ImageBuffer::<Luma<u16>, Vec<u16>>::from_fn(image.width(), image.height(), wide);
            save(&wide.into(), &clip.path("png16").join(side).join(format!("{at:03}.png")));
        }
    }
    vec!["pgm", "tiff", "bmp", "png16"]
}

#[test]
fn every_lossless_format_gives_the_digest_of_the_plain_clip() {
    let clip = Clip::new(2, SMALL);
    let plain = clip.plain();
    for name in dress_formats(&clip) {
        write(clip.path(name).join("calib.txt"), &clip.calibration(["P0", "P1"]));
        assert_eq!(clip.digest(name), plain, "{name}");
    }
}

#[dynvox_needs::long]
#[test]
fn every_layout_and_lossless_format_has_the_plain_clips_digest() {
    let clip = Clip::new(FRAMES, SMALL);
    dress_data_sets(&clip);
    let folders: Vec<&str> = dress_folders(&clip).into_iter().chain(dress_formats(&clip)).collect();
    folders
        .iter()
        .for_each(|name| write(clip.path(name).join("calib.txt"), &clip.calibration(["P0", "P1"])));
    let (plain, trajectory) = (clip.plain(), clip.trajectory());
    for name in
        ["euroc", "late", "tracking", "raw/2011_09_26", "kitti360"].into_iter().chain(folders)
    {
        assert_eq!(clip.digest(name), plain, "{name}");
    }
    // Cityscapes is taken to have another frame rate, which the camera's state knows.
    clip.digest("cityscapes");
    assert_eq!(clip.trajectory(), trajectory);
}

#[test]
fn names_without_padding_and_missing_images_keep_order_and_pairs() {
    let clip = Clip::new(12, SMALL);
    let plain = clip.plain();
    clip.save(|at, side| {
        clip.path("unpadded").join(["left", "right"][side]).join(format!("{}.png", at + 3))
    });
    clip.save(|at, side| {
        clip.path("missing").join(["left", "right"][side]).join(format!("{}.png", at + 3))
    });
    clip.save(|at, side| {
        clip.path("whole").join(["left", "right"][side]).join(format!("{}.png", at + 3))
    });
    for name in ["unpadded", "missing", "whole"] {
        write(clip.path(name).join("calib.txt"), &clip.calibration(["P0", "P1"]));
    }
    assert_eq!(clip.digest("unpadded"), plain, "3, 4, ..., 9, 10, ..., 14");
    // In one folder one side is missing, in the other both: the same frames are left.
    for at in [5, 9, 12] {
        fs::remove_file(clip.path("missing/right").join(format!("{at}.png"))).unwrap();
        ["left", "right"].iter().for_each(|side| {
            fs::remove_file(clip.path("whole").join(side).join(format!("{at}.png"))).unwrap()
        });
    }
    let (digest, notes) = clip.run("missing", &[]);
    assert_eq!(digest, clip.digest("whole"));
    assert!(notes.contains("3 left and 0 right images have no partner: skipped"), "{notes}");
}

#[dynvox_needs::long]
#[test]
fn jpeg_of_quality_90_keeps_the_trajectory_within_two_percent() {
    let clip = Clip::new(12, ["--set", "street.width=480", "--set", "street.height=144"]);
    clip.save(|at, side| {
        clip.path("plain").join(["left", "right"][side]).join(format!("{at:03}.png"))
    });
    for (at, pair) in clip.pairs.iter().enumerate() {
        for (image, side) in pair.iter().zip(["left", "right"]) {
            let path = clip.path("jpeg").join(side).join(format!("{at:03}.jpg"));
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            let file = fs::File::create(path).unwrap();
            image::codecs::jpeg::JpegEncoder::new_with_quality(file, 90)
                .encode_image(image)
                .unwrap();
        }
    }
    // The camera's position after the last frame.
    let end_m = |name: &str| {
        write(clip.path(name).join("calib.txt"), &clip.calibration(["P0", "P1"]));
        let args = [
            "run",
            name,
            "--profile",
            "small",
            "--instances",
            "none",
            "--quiet",
            "--overwrite",
            "--out",
            "result",
        ];
        let run = dynvox(clip.root.path(), &args);
        assert!(run.status.success(), "{name}: {}", output_text(&run));
        let text = fs::read_to_string(clip.path("result/trajectory_kitti.txt")).unwrap();
        let row: Vec<f64> =
            text.lines().last().unwrap().split(' ').map(|word| word.parse().unwrap()).collect();
        [row[3], row[7], row[11]]
    };
    let (plain, jpeg) = (end_m("plain"), end_m("jpeg"));
    let norm = |of: [f64; 3]| of.iter().map(|value| value * value).sum::<f64>().sqrt();
    let apart = norm([0, 1, 2].map(|axis| plain[axis] - jpeg[axis])) / norm(plain);
    println!("JPEG 90: the end is {:.2} % of the path apart", 100.0 * apart);
    assert!(apart < 0.02, "{apart}");
}
