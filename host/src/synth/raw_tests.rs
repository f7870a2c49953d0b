//! Streets through lenses, and with a rig that is off.

use super::*;
use crate::formats::calibration::StereoCalibration;
use dynvox_core::Serial;
use dynvox_core::image::View;
use dynvox_core::memory::{Capacity, Carver, SLAB_ALIGN};
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

fn lenses() -> [StreetLens; 5] {
    let rational = RadialTangential { radial: [0.9, 0.2, 0.01, 1.2, 0.4, 0.05], tangential: [1e-4, 1e-4] };
    [
        StreetLens::RadialTangential(RadialTangential::default()),
        StreetLens::RadialTangential(rational),
        StreetLens::Equidistant(Equidistant::default()),
        StreetLens::DoubleSphere(DoubleSphere::default()),
        StreetLens::ExtendedUnified(ExtendedUnified::default()),
    ]
}

/// Mean absolute difference of two images, grey levels, where neither is moved by so many columns and rows.
fn difference(a: &[u8], b: &[u8], [du, dv]: [i32; 2]) -> f64 {
    let (width, height) = (WIDTH as i32, HEIGHT as i32);
    let at = |image: &[u8], u: i32, v: i32| i32::from(image[(v * width + u) as usize]);
    let (mut sum, mut count) = (0, 0);
    for (u, v) in (8..height - 8).flat_map(|v| (8..width - 8).map(move |u| (u, v))) {
        sum += (at(a, u, v) - at(b, u - du, v - dv)).abs();
        count += 1;
    }
    f64::from(sum) / f64::from(count)
}

#[test]
fn raw_images_rectify_to_what_the_ideal_rig_sees() {
    let ideal = street(StreetLens::Ideal, RigError::default()).frame(3);
    for lens in lenses() {
        let street = street(lens.clone(), RigError::default());
        let frame = street.frame(3);
        let [raw_width, raw_height] = frame.image_size;
        assert_ne!(frame.image_size, [WIDTH as usize, HEIGHT as usize]);
        assert_eq!((&frame.depth_m, &frame.instances), (&ideal.depth_m, &ideal.instances), "truth is that of the ideal rig");
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
        assert!(rectifier.invalid().is_none(), "{lens:?}: every rectified pixel is covered");
        for (camera, ours, theirs) in [("left", rectified.left, &ideal.left_grey), ("right", rectified.right, &ideal.right_grey)] {
            let ours = ours.rows().flatten().copied().collect::<Vec<u8>>();
            let [here, beside] = [[0, 0], [1, 0]].map(|by| difference(&ours, theirs, by));
            assert!(here < 4.0 && here < 0.6 * beside, "{lens:?}, {camera}: {here} grey levels, a column beside {beside}");
        }
    }
}

#[test]
fn a_rig_that_is_off_moves_right_images_and_nothing_else() {
    let ideal = street(StreetLens::Ideal, RigError::default()).frame(3);
    let with = |rig_error: RigError| street(StreetLens::Ideal, rig_error).frame(3);
    let moved = with(RigError { disparity_offset_px: 2.0, vertical_shift_px: 3.0, ..RigError::default() });
    assert!(difference(&moved.right_grey, &ideal.right_grey, [2, 3]) < 3.0);
    assert!(difference(&moved.right_grey, &ideal.right_grey, [0, 0]) > 6.0);
    assert!(difference(&moved.left_grey, &ideal.left_grey, [0, 0]) < 3.0);
    assert_eq!(moved.depth_m, ideal.depth_m);
    // 1.4 degrees are 3.4 px at a focal length of 139 px: what is seen moves down.
    let pitched = with(RigError { pitch_deg: 1.4, ..RigError::default() });
    let [down, up] = [3, -3].map(|rows| difference(&pitched.right_grey, &ideal.right_grey, [0, rows]));
    assert!(down < 5.0 && down < 0.6 * up, "{down} {up}");
    // Clockwise: what is right of the middle moves down, what is left of it up.
    let rolled = with(RigError { roll_deg: 5.0, ..RigError::default() }).right_grey;
    assert!(difference(&rolled, &ideal.right_grey, [0, 0]) > 8.0);
}

#[test]
fn both_written_calibrations_tell_of_the_same_cameras() {
    for lens in lenses() {
        let street = Street::new(StreetConfig { frames: 1, ..street(lens.clone(), RigError::default()).config().clone() }).unwrap();
        let parent = tempfile::TempDir::new().unwrap();
        let folder = parent.path().join("street");
        write_kitti(&street, &folder, |_, _| ()).unwrap();
        let read = |name: &str| StereoCalibration::read(&[&folder.join("sequences/00").join(name)], None);
        let own = read("calibration.toml").unwrap();
        assert_eq!(StereoCalibration { format: "the street", ..own }, *street.calibration().unwrap());
        let Ok(kalibr) = read("camchain.yaml") else {
            assert!(matches!(lens, StreetLens::RadialTangential(RadialTangential { radial, .. }) if radial[3] != 0.0), "{lens:?}");
            continue;
        };
        assert_eq!((kalibr.left, kalibr.right), (own.left, own.right));
        assert!((kalibr.baseline_m() - 0.54).abs() < 1e-9 && (kalibr.angle_deg() - own.angle_deg()).abs() < 1e-9);
    }
}

#[test]
fn what_cannot_be_rendered_is_named() {
    let refusal = |lens: StreetLens, rig_error: RigError| {
        let config = StreetConfig { lens, rig_error, ..StreetConfig::static_street() };
        Street::new(config).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let spheres = StreetLens::DoubleSphere(DoubleSphere { xi: -0.2, alpha: 2.0 });
    assert!(refusal(spheres, RigError::default()).contains("street.lens cannot be used"));
    let off = RigError { roll_deg: 90.0, ..RigError::default() };
    assert!(refusal(StreetLens::Ideal, off).contains("street.rig_error.roll_deg is 90"));
}
