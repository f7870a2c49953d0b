//! Files of other programs, each kind of bad input, and what the core makes of given depth.

use super::files::{FileUnit, read};
use super::*;
use crate::formats::{Image, read_opencv_depth, read_pfm};
use crate::input::source::{DepthRefusals, Quantity, to_disparity};
use crate::input::{self, FrameSource, InputError, OpenOptions, Scaled, StreetFrames};
use crate::synth::StreetConfig;
use dynvox_core::geometry::StereoRig;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const SIZE: (usize, usize) = (8, 6);
/// 45 px m, as the fixtures were made for.
const RIG: StereoRig =
    StereoRig { focal_px: 90.0, center_u_px: 4.0, center_v_px: 3.0, baseline_m: 0.5 };

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src/input/depth/fixtures").join(name)
}

/// The wedge the fixtures hold, px.
fn wedge_px(u: usize, v: usize) -> f64 {
    4.0 + u as f64 + v as f64 / 8.0
}

fn refusal_of<T>(result: Result<T, impl std::fmt::Display>) -> String {
    result.err().expect("it should be refused").to_string()
}

#[test]
fn disparities_of_opencv_arrive_bit_for_bit() {
    for name in ["disparity.png", "disparity.pfm"] {
        let given =
            read(&fixture(name), FileUnit::usual(Quantity::DisparityPx), SIZE, &RIG).unwrap();
        let put_in = [(2, 1), (3, 2), (4, 3)];
        for v in 0..SIZE.1 {
            for u in 0..SIZE.0 {
                let none =
                    (u, v) == (0, 0) || (name == "disparity.pfm" && put_in.contains(&(u, v)));
                let expected = if none { 0 } else { (wedge_px(u, v) * 256.0).round() as u16 };
                assert_eq!(
                    given.disparity_q8.get(u, v),
                    Some(expected),
                    "{name} at {u}, {v}: rows are not upside down"
                );
            }
        }
        let expected = if name == "disparity.pfm" {
            DepthRefusals { not_finite: 2, out_of_range: 1 }
        } else {
            DepthRefusals::default()
        };
        assert_eq!(given.refused, expected, "{name}");
    }
}

#[test]
fn depths_of_opencv_become_the_disparities_they_were_made_of() {
    for name in ["depth_mm.png", "depth.xml"] {
        let given = read(&fixture(name), FileUnit::usual(Quantity::DepthM), SIZE, &RIG).unwrap();
        for v in 0..SIZE.1 {
            for u in (0..SIZE.0).filter(|&u| (u, v) != (0, 0)) {
                let found = f64::from(given.disparity_q8.get(u, v).unwrap()) / 256.0;
                // Half a millimetre at the nearest depth, and half a unit.
                assert!((found - wedge_px(u, v)).abs() < 0.004, "{name} at {u}, {v}: {found}");
            }
        }
        assert_eq!(
            (given.disparity_q8.get(0, 0), given.refused),
            (Some(0), DepthRefusals::default())
        );
    }
}

#[test]
fn big_endian_maps_of_netpbm_are_read() {
    let values = read_pfm(&fixture("big.pfm"), SIZE).unwrap();
    for (u, v) in [(0, 0), (7, 0), (0, 5), (7, 5)] {
        let found = f64::from(values.get(u, v).unwrap()) * 65_535.0 / 256.0;
        assert!((found - wedge_px(u, v)).abs() < 1e-4, "{found} at {u}, {v}");
    }
}

#[test]
fn broken_files_and_other_sizes_are_refused_with_a_sentence() {
    let root = TempDir::new().unwrap();
    let pfm = |bytes: &[u8]| {
        let path = root.path().join("a.pfm");
        fs::write(&path, bytes).unwrap();
        refusal_of(read_pfm(&path, (2, 1)))
    };
    assert!(
        pfm(b"Pf\n2 2\n-1\n0123456701234567")
            .contains("it is 2 x 2 px, but the images are 2 x 1 px")
    );
    assert!(pfm(b"Pf\n2 1\n-1\n0123").contains("holds 4 bytes of pixels, not 8"));
    assert!(pfm(b"PF\n2 1\n-1\n01234567").contains("in colour"));
    assert!(pfm(b"P5\n2 1\n255\nab").contains("does not begin with Pf"));
    assert!(pfm(b"Pf\n2 1\n0\n01234567").contains("scale"));
    assert!(pfm(b"Pf\n99999999999999999999 1\n-1\n").contains("not numbers"));
    assert!(pfm(b"Pf").contains("does not have the header"));
    assert!(
        refusal_of(read_opencv_depth(&fixture("depth_float.xml"), SIZE)).contains("type \"f\"")
    );
    assert!(
        refusal_of(read_opencv_depth(&fixture("depth.xml"), (9, 6))).contains("it is 8 x 6 px")
    );
    let text = fs::read_to_string(fixture("depth.xml")).unwrap();
    let xml = |text: &str| {
        let path = root.path().join("a.xml");
        fs::write(&path, text).unwrap();
        refusal_of(read_opencv_depth(&path, SIZE))
    };
    assert!(xml(&text.replace("9000", "90000")).contains("not a 16-bit number"));
    assert!(xml(&text.replace("9000 ", "")).contains("holds 47 values, not 48"));
    assert!(xml(&text.replace("depth-frame", "depth")).contains("no matrix depth-frame"));
    assert!(xml(&text[..200]).contains("not XML"));
    let small = root.path().join("small.png");
    image::GrayImage::new(8, 6).save(&small).unwrap();
    assert!(
        refusal_of(read(&small, FileUnit::usual(Quantity::DisparityPx), SIZE, &RIG))
            .contains("8 bit, not of one of 16")
    );
    assert!(
        refusal_of(read(
            &fixture("disparity.png"),
            FileUnit::usual(Quantity::DisparityPx),
            (4, 4),
            &RIG
        ))
        .contains("8 x 6 px")
    );
}

#[test]
fn values_impossible_for_the_rig_are_counted_in_every_format() {
    let values = Image::new(6, 1, vec![f32::INFINITY, f32::NAN, -3.0, 256.0, 255.9, 0.0]).unwrap();
    let given = to_disparity(&values, Quantity::DisparityPx, &RIG);
    assert_eq!(given.disparity_q8.pixels(), [0, 0, 0, 0, 65_510, 0]);
    assert_eq!(
        (given.refused, given.refused.count()),
        (DepthRefusals { not_finite: 2, out_of_range: 2 }, 4)
    );
    let depths =
        to_disparity(&Image::new(3, 1, vec![0.1, 9.0, 1e9]).unwrap(), Quantity::DepthM, &RIG);
    assert_eq!(depths.disparity_q8.pixels(), [0, 1_280, 0], "too near is refused, too far is none");
    assert_eq!(depths.refused.out_of_range, 1);
}

/// A stereo folder with two frames of the fixtures' size, enlarged to what the core takes, and
/// `depth` beside it.
fn rig(folder: &str, name: &str, file: &str) -> TempDir {
    let root = TempDir::new().unwrap();
    for side in ["left", "right"] {
        fs::create_dir_all(root.path().join(side)).unwrap();
        for frame in 0..2 {
            image::GrayImage::new(8, 6)
                .save(root.path().join(side).join(format!("{frame:06}.png")))
                .unwrap();
        }
    }
    fs::write(
        root.path().join("calib.txt"),
        "focal_px 90\ncenter_u_px 4\ncenter_v_px 3\nbaseline_m 0.5\n",
    )
    .unwrap();
    fs::create_dir_all(root.path().join(folder)).unwrap();
    fs::copy(fixture(file), root.path().join(folder).join(name)).unwrap();
    root
}

fn laid_over(root: &TempDir, choice: &str) -> Result<Box<dyn FrameSource>, InputError> {
    let choice = choice.replace("ROOT", &root.path().display().to_string());
    attach(input::open(root.path(), &OpenOptions::default())?, &choice.parse().unwrap(), None)
}

#[test]
fn a_folders_name_says_what_it_holds_unless_the_option_does() {
    let at = |root: &TempDir, choice: &str| {
        laid_over(root, choice).unwrap().frame(0).unwrap().depth.unwrap().disparity_q8.get(1, 0)
    };
    let disparity = rig("precomputed-depth-dispnet", "000000.png", "disparity.png");
    assert_eq!(at(&disparity, "files:ROOT/precomputed-depth-dispnet"), Some(5 * 256));
    let depth = rig("depth", "000000.png", "depth_mm.png");
    assert_eq!(at(&depth, "files:ROOT/depth"), Some(5 * 256));
    assert_eq!(at(&depth, "disparity:ROOT/depth"), Some(9_000));
    let original = rig("elas/Frames", "0000.xml", "depth.xml");
    assert_eq!(at(&original, "files:ROOT/elas"), Some(5 * 256), "the original's names");
    let notes = laid_over(&original, "depth:ROOT/elas").unwrap().notes().to_vec();
    assert!(
        notes.iter().any(|note| note.contains("depth from") && note.contains("for 1 of 2 frames")),
        "{notes:?}"
    );
    assert!(
        refusal_of(laid_over(&original, "files:ROOT/elas").unwrap().frame(1))
            .contains("000001.png cannot be used: it is missing")
    );
    assert!(
        refusal_of(laid_over(&original, "files:ROOT/left").unwrap().frame(0)).contains("8 bit"),
        "pictures are no depth"
    );
    assert!(refusal_of(laid_over(&original, "files:ROOT/nowhere")).contains("no such folder"));
    assert!(
        refusal_of(laid_over(&original, "files:ROOT/elas/..")).contains("nothing for any frame")
    );
    assert!(refusal_of(laid_over(&original, "exact")).contains("only the synthetic street"));
    assert!("pfm:x".parse::<DepthChoice>().is_err() && "files:".parse::<DepthChoice>().is_err());
}

#[test]
fn scaled_images_have_scaled_disparities() {
    let street =
        StreetFrames::new(StreetConfig { width: 160, height: 64, ..StreetConfig::default() })
            .unwrap();
    let street = attach(Box::new(street), &DepthChoice::Exact, None).unwrap();
    let whole = street.frame(0).unwrap();
    let half = Scaled::new(street, 0.5).unwrap();
    let (depth, exact) = (half.frame(0).unwrap(), half.rig().focal_baseline_px_m());
    let (shown, truth) = (depth.depth.unwrap().disparity_q8, depth.exact.unwrap().depth_m);
    assert_eq!((shown.width(), shown.height()), (80, 32));
    let pairs = shown
        .pixels()
        .iter()
        .zip(truth.pixels())
        .filter(|(_, depth_m)| depth_m.is_finite() && **depth_m > 0.0);
    let wrong = pairs
        .filter(|(disparity, depth_m)| {
            (f64::from(**disparity) / 256.0 - exact / f64::from(**depth_m)).abs() > 0.005
        })
        .count();
    assert_eq!((wrong, whole.depth.unwrap().refused.count()), (0, 0));
}

/// Size of the images of two walls.
const WALLS: (u32, u32) = (200, 96);

/// Disparity of the walls in a row, px: one far above, one near below. [`RIG`] has 45 px m.
fn wall_px(v: u32) -> u32 {
    if v < WALLS.1 / 2 { 8 } else { 16 }
}

/// Two walls of noise, and a folder of PFM files of their depth or disparity times a factor.
fn walls(
    factor: f32,
    kind: &str,
    scale: Option<&str>,
) -> (TempDir, Result<Box<dyn FrameSource>, InputError>) {
    let root = TempDir::new().unwrap();
    let noise = |u: u32, v: u32| {
        let hash = u.wrapping_mul(73_856_093) ^ v.wrapping_mul(19_349_663);
        let hash = hash.wrapping_mul(0x9e37_79b1);
        image::Luma([(hash >> 24) as u8])
    };
    let file = |side: &str, ending: &str| {
        fs::create_dir_all(root.path().join(side)).unwrap();
        root.path().join(side).join(format!("000000.{ending}"))
    };
    let (width, height) = WALLS;
    let left = image::GrayImage::from_fn(width, height, noise);
    let right = image::GrayImage::from_fn(width, height, |u, v| noise(u + wall_px(v), v));
    left.save(file("left", "png")).unwrap();
    right.save(file("right", "png")).unwrap();
    let calib = "focal_px 90\ncenter_u_px 100\ncenter_v_px 48\nbaseline_m 0.5\n";
    fs::write(root.path().join("calib.txt"), calib).unwrap();
    let value = |v: u32| match kind {
        "depth" => 45.0 / wall_px(v) as f32 * factor,
        _ => wall_px(v) as f32 * factor,
    };
    let mut bytes = format!("Pf\n{width} {height}\n-1\n").into_bytes();
    for v in (0..height).rev() {
        bytes.extend((0..width).flat_map(|_| value(v).to_le_bytes()));
    }
    fs::write(file("given", "pfm"), bytes).unwrap();
    let choice = format!("{kind}:{}", root.path().join("given").display()).parse().unwrap();
    let scale = scale.map(|scale| scale.parse().unwrap());
    let laid = input::open(root.path(), &OpenOptions::default())
        .and_then(|dataset| attach(dataset, &choice, scale.as_ref()));
    (root, laid)
}

#[test]
fn depth_in_another_unit_is_named_with_its_factor() {
    for (kind, factor, expected) in [
        ("depth", 4.0, "4.0 x too far"),
        ("depth", 0.25, "4.0 x too near"),
        ("depth", 100.0, "--depth-scale cm"),
        ("depth", 0.01, "100.0 x too near"),
        ("disparity", 40.0, "40.0 x too near"),
        ("disparity", 0.062_5, "--depth-scale 1.600e1"),
        ("disparity", 0.5, "2.0 x too far"),
    ] {
        let (_root, laid) = walls(factor, kind, None);
        let reason = refusal_of(laid.and_then(|dataset| dataset.frame(0)));
        assert!(reason.contains(expected), "{kind} times {factor}: {reason}");
        let (_root, laid) = walls(factor, kind, Some(&format!("1/{factor}")));
        let frame = laid.unwrap().frame(0).unwrap();
        let found = frame.depth.unwrap().disparity_q8.get(50, 80);
        assert_eq!(found, Some(16 * 256), "{kind} times {factor}, scaled back");
    }
    for (kind, factor) in [("depth", 1.0), ("disparity", 1.0), ("depth", 1.1)] {
        assert!(walls(factor, kind, None).1.is_ok(), "{kind} times {factor}");
    }
}

#[test]
fn negative_disparities_are_refused_and_turned_by_their_scale() {
    let (_root, laid) = walls(-1.0, "disparity", None);
    let reason = refusal_of(laid.unwrap().frame(0));
    assert!(
        reason.contains("are negative") && reason.contains("--depth-scale negative"),
        "{reason}"
    );
    let (_root, laid) = walls(-1.0, "disparity", Some("negative"));
    assert_eq!(laid.unwrap().frame(0).unwrap().depth.unwrap().refused, DepthRefusals::default());
}

#[test]
fn files_without_a_number_are_refused() {
    let (_root, laid) = walls(f32::INFINITY, "depth", None);
    let reason = refusal_of(laid.unwrap().frame(0));
    assert!(reason.contains("none of its"), "{reason}");
}

#[test]
fn sources_of_depth_are_named_and_saved() {
    let choice = |text: &str| text.parse::<DepthChoice>();
    for text in ["elas", "exact", "files:a/b", "disparity:c", "depth:d:e"] {
        assert_eq!(choice(text).unwrap().to_string(), text);
        let saved = serde_json::to_string(&choice(text).unwrap()).unwrap();
        assert_eq!(serde_json::from_str::<DepthChoice>(&saved).unwrap(), choice(text).unwrap());
    }
    for (wrong, words) in [("other:a", "one of elas, files:DIR"), ("depth:", "names no folder")] {
        assert!(choice(wrong).unwrap_err().contains(words), "{wrong}");
    }
    let other = serde_json::from_str::<DepthChoice>(r#"{"files": ["heights", "a"]}"#);
    assert!(other.unwrap_err().to_string().contains("no folder of depth is named heights"));
}
