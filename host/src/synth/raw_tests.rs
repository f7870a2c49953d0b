//! Streets through lenses, and with a rig that is off.

use super::*;
use crate::formats::calibration::StereoCalibration;
use dynvox_core::Serial;
use dynvox_core::image::View;
use dynvox_core::memory::{Capacity, Carver, SLAB_ALIGN};
use dynvox_core::rectify::{LENS_MODELS, LensModel};
use dynvox_core::rectify::{Pair, RectifiedImages, Rectifier};

const WIDTH: u32 = 240;
const HEIGHT: u32 = 96;

fn street(lens: StreetLens, rig_error: RigError) -> Street {
    let plain = StreetConfig::static_street();
    Street::new(StreetConfig {
        width: WIDTH,
        height: HEIGHT,
        noise_sigma: 0.0,
        gain_difference: 0.0,
        lens,
        rig_error,
        ..plain
    })
    .unwrap()
}

/// A typical lens of every model, and a rational one.
fn lenses() -> Vec<StreetLens> {
    let rational = LensModel::RadialTangential {
        radial: [0.9, 0.2, 0.01, 1.2, 0.4, 0.05],
        tangential: [1e-4, 1e-4],
    };
    let typical = LENS_MODELS.iter().map(|kind| kind.typical);
    typical.chain([rational]).map(StreetLens::Bent).collect()
}

#[test]
fn a_lens_is_a_table_whose_missing_keys_are_typical() {
    for lens in lenses() {
        let text = toml::to_string(&lens).unwrap();
        assert_eq!(toml::from_str::<StreetLens>(&text).unwrap(), lens, "{text}");
    }
    for kind in LENS_MODELS {
        let text = format!("model = \"{}\"", kind.name);
        let lens = toml::from_str::<StreetLens>(&text).unwrap();
        assert_eq!(lens, StreetLens::Bent(kind.typical));
    }
    assert_eq!(toml::from_str::<StreetLens>("model = \"ideal\"").unwrap(), StreetLens::Ideal);
    let refused = |text: &str| toml::from_str::<StreetLens>(text).unwrap_err().to_string();
    assert!(refused("model = \"fov\"").contains("use one of radial_tangential"));
    assert!(refused("model = \"double_sphere\"\nxy = 1").contains("unknown field `xy`"));
    assert!(refused("model = \"equidistant\"\nradial = [1]").contains("1 numbers, not 4"));
    assert!(refused("radial = [1]").contains("missing field `model`"));
}

/// By how many columns and rows `a` is moved against `b`, px, near a guess: where the squared
/// difference is least.
fn moved(a: &[u8], b: &[u8], [near_u, near_v]: [i32; 2]) -> [f64; 2] {
    let (width, height) = (WIDTH as i32, HEIGHT as i32);
    let at = |image: &[u8], u: i32, v: i32| i64::from(image[(v * width + u) as usize]);
    let difference = |du: i32, dv: i32| -> f64 {
        // Without the border, so that the shift never leaves the image.
        let pixels = (10..height - 10).flat_map(|v| (10..width - 10).map(move |u| (u, v)));
        pixels.map(|(u, v)| (at(a, u, v) - at(b, u - du, v - dv)).pow(2)).sum::<i64>() as f64
    };
    // The vertex of the parabola through three differences.
    let vertex = |before: f64, here: f64, after: f64| {
        assert!(here < before && here < after, "{before} {here} {after}");
        0.5 * (before - after) / (before + after - 2.0 * here)
    };
    let here = difference(near_u, near_v);
    let u = vertex(difference(near_u - 1, near_v), here, difference(near_u + 1, near_v));
    let v = vertex(difference(near_u, near_v - 1), here, difference(near_u, near_v + 1));
    [f64::from(near_u) + u, f64::from(near_v) + v]
}

/// Returns true if a displacement is within 0.1 px of the expected one.
fn is_near([u, v]: [f64; 2], [expected_u, expected_v]: [f64; 2]) -> bool {
    (u - expected_u).abs() < 0.1 && (v - expected_v).abs() < 0.1
}

#[test]
fn raw_images_rectify_to_what_the_ideal_rig_sees() {
    let ideal = street(StreetLens::Ideal, RigError::default()).frame(3);
    for lens in lenses() {
        let street = street(lens.clone(), RigError::default());
        let frame = street.frame(3);
        let [raw_width, raw_height] = frame.image_size;
        // Raw images are larger than what they are rectified to.
        assert_ne!(frame.image_size, [WIDTH as usize, HEIGHT as usize]);
        assert_eq!(
            (&frame.depth_m, &frame.instances),
            (&ideal.depth_m, &ideal.instances),
            "truth is that of the ideal rig"
        );
        let capacity = Capacity {
            image_width: WIDTH as usize,
            image_height: HEIGHT as usize,
            raw_width,
            raw_height,
            ..Capacity::TINY
        };
        let bytes = Rectifier::bytes(&capacity) + RectifiedImages::bytes(&capacity);
        let mut slab = vec![0u8; bytes + SLAB_ALIGN];
        let mut carver = Carver::new(&mut slab, bytes).unwrap();
        let mut rectifier = Rectifier::new_in(&capacity, &mut carver);
        let mut images = RectifiedImages::new_in(&capacity, &mut carver);
        rectifier.prepare(&street.rectification().unwrap(), &street.rig()).unwrap();
        let view = |image| View::new(image, raw_width, raw_height).unwrap();
        let raw = Pair {
            left: view(&frame.left_grey[..]),
            right: view(&frame.right_grey[..]),
            colour: None,
        };
        let rectified = rectifier.rectify(&raw, &mut images, &Serial).unwrap();
        for (camera, ours, theirs) in [
            ("left", rectified.left, &ideal.left_grey),
            ("right", rectified.right, &ideal.right_grey),
        ] {
            let ours = ours.rows().flatten().copied().collect::<Vec<u8>>();
            let by = moved(&ours, theirs, [0, 0]);
            assert!(is_near(by, [0.0, 0.0]), "{lens:?}, {camera}: {by:?}");
        }
    }
}

#[test]
fn a_rig_that_is_off_moves_right_images_and_nothing_else() {
    let ideal = street(StreetLens::Ideal, RigError::default()).frame(3);
    let with = |rig_error: RigError| street(StreetLens::Ideal, rig_error).frame(3);
    let shifted =
        with(RigError { disparity_offset_px: 1.7, vertical_shift_px: 3.0, ..RigError::default() });
    let by = moved(&shifted.right_grey, &ideal.right_grey, [2, 3]);
    assert!(is_near(by, [1.7, 3.0]), "{by:?}");
    assert!(is_near(moved(&shifted.left_grey, &ideal.left_grey, [0, 0]), [0.0, 0.0]));
    assert_eq!(shifted.depth_m, ideal.depth_m);
    // 1.4 degrees are 3.4 px at a focal length of 139 px, and a little more at the sides: what is
    // seen moves down.
    let [_, down] = moved(
        &with(RigError { pitch_deg: 1.4, ..RigError::default() }).right_grey,
        &ideal.right_grey,
        [0, 3],
    );
    assert!((3.2..4.0).contains(&down), "{down}");
    // Clockwise about the middle: all in all it stays where it is, but not with the same pixels.
    let rolled = with(RigError { roll_deg: 0.6, ..RigError::default() }).right_grey;
    let rows = |from: usize, to: usize| -> (Vec<u8>, Vec<u8>) {
        let blanked = |image: &[u8]| {
            let pixel = |(at, &grey): (usize, &u8)| {
                if (from..to).contains(&(at % WIDTH as usize)) { grey } else { 0 }
            };
            image.iter().enumerate().map(pixel).collect()
        };
        (blanked(&rolled), blanked(&ideal.right_grey))
    };
    let [left, right] = [(0, 60, -1), (180, 240, 1)].map(|(from, to, near)| {
        let (a, b) = rows(from, to);
        moved(&a, &b, [0, near])[1]
    });
    assert!((-1.3..-0.5).contains(&left) && (0.5..1.3).contains(&right), "{left} {right}");
}

#[test]
fn both_written_calibrations_tell_of_the_same_cameras() {
    for lens in lenses() {
        let street = Street::new(StreetConfig {
            frames: 1,
            ..street(lens.clone(), RigError::default()).config().clone()
        })
        .unwrap();
        let parent = tempfile::TempDir::new().unwrap();
        let folder = parent.path().join("street");
        write_kitti(&street, &folder, |_, _| ()).unwrap();
        let read =
            |name: &str| StereoCalibration::read(&[&folder.join("sequences/00").join(name)], None);
        let own = read("calibration.toml").unwrap();
        assert_eq!(
            StereoCalibration { format: "the synthetic world", ..own },
            *street.calibration().unwrap()
        );
        let Ok(kalibr) = read("camchain.yaml") else {
            // Kalibr knows neither a rational model nor the general one: such a camera has no
            // camchain.
            let is_unknown = match lens {
                StreetLens::Bent(LensModel::RadialTangential { radial, .. }) => radial[3] != 0.0,
                StreetLens::Bent(LensModel::General { .. }) => true,
                _ => false,
            };
            assert!(is_unknown, "{lens:?}");
            continue;
        };
        assert_eq!((kalibr.left, kalibr.right), (own.left, own.right));
        assert!(
            (kalibr.baseline_m() - 0.54).abs() < 1e-9
                && (kalibr.angle_deg() - own.angle_deg()).abs() < 1e-9
        );
    }
}

#[test]
fn what_cannot_be_rendered_is_named() {
    let refusal = |lens: StreetLens, rig_error: RigError| {
        let config = StreetConfig { lens, rig_error, ..StreetConfig::static_street() };
        Street::new(config).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let spheres = StreetLens::Bent(LensModel::DoubleSphere { xi: -0.2, alpha: 2.0 });
    assert!(refusal(spheres, RigError::default()).contains("street.lens cannot be used"));
    let off = RigError { roll_deg: 90.0, ..RigError::default() };
    assert!(refusal(StreetLens::Ideal, off).contains("street.rig_error.roll_deg must be"));
}
