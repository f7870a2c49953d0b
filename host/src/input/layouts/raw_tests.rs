//! Raw recordings: KITTI's unrectified frames against the rectified ones of the same drive.

use crate::formats::read_picture;
use crate::input::{OpenOptions, open};
use dynvox_core::{
    Capacity, Serial,
    memory::{Carver, SLAB_ALIGN},
    rectify::{Pair, RectifiedImages, Rectifier},
};
use std::path::Path;

/// Position in r1405 of the first raw frame.
const FIRST: usize = 45;

#[dynvox_needs::clips(
    "kitti-raw/2011_09_26/2011_09_26_drive_1405_extract",
    "kitti-odometry/sequences/r1405"
)]
#[test]
fn kitti_raw_rectifies_to_the_pictures_opencv_makes_of_it() {
    let [raw, rectified] =
        ["kitti-raw/2011_09_26/2011_09_26_drive_1405_extract", "kitti-odometry/sequences/r1405"]
            .map(|path| Path::new(dynvox_needs::data_folder!()).join(path));
    let source = open(&raw, &OpenOptions::default()).unwrap();
    let rectification = *source.rectification().expect("the calibration is found by itself");
    assert_eq!((source.len(), source.size()), (36, (1242, 375)));
    let capacity = Capacity { raw_width: 1392, raw_height: 512, ..Capacity::ONBOARD };
    let bytes = Rectifier::bytes(&capacity) + RectifiedImages::bytes(&capacity);
    let mut slab = vec![0u8; bytes + SLAB_ALIGN];
    let mut carver = Carver::new(&mut slab, bytes).unwrap();
    let mut rectifier = Rectifier::new_in(&capacity, &mut carver);
    let mut images = RectifiedImages::new_in(&capacity, &mut carver);
    rectifier.prepare(&rectification, &source.rig()).unwrap();
    let (mut sum, mut count, mut near, mut worst) = (0u64, 0u64, 0u64, 0);
    for at in (0..36).step_by(7) {
        let frame = source.frame(at).unwrap();
        let pair = Pair {
            left: frame.left.view().unwrap(),
            right: frame.right.view().unwrap(),
            colour: None,
        };
        let ours = rectifier.rectify(&pair, &mut images, &Serial).unwrap();
        for (camera, ours) in [("image_0", ours.left), ("image_1", ours.right)] {
            let path = rectified.join(camera).join(format!("{:06}.png", FIRST + at));
            let theirs = read_picture(&path).unwrap().to_8_bit(None).grey;
            for (v, row) in ours.rows().enumerate() {
                for (u, &grey) in row.iter().enumerate() {
                    let difference = grey.abs_diff(theirs.get(u, v).unwrap());
                    sum += u64::from(difference);
                    near += u64::from(difference <= 2);
                    worst = worst.max(difference);
                    count += 1;
                }
            }
        }
    }
    let mean = sum as f64 / count as f64;
    let share = near as f64 / count as f64;
    println!(
        "mean absolute difference {mean:.4}, within 2 {:.4} %, largest {worst}",
        100.0 * share
    );
    assert!(mean <= 0.5 && share >= 0.999, "mean {mean}, within 2 {share}");
}
