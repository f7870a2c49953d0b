//! Each format on tiny folders made here, each kind of bad input, and the real clips' masks.

mod boxes;
mod choice;
mod dumps;

use super::*;
use crate::formats::rle;
use crate::input::source::{FrameMasks, InstanceMask, MAX_BYTES, MAX_MASKS, MaskRefusals};
use crate::input::{self, FrameSource, InputError, OpenOptions, StopRequest, StreetFrames};
use crate::synth::StreetConfig;
use dynvox_core::masks::PixelBox;
use image::{ImageBuffer, Luma};
use std::fs;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use tempfile::TempDir;

/// Masks in every frame.
const EVERY: NonZeroUsize = NonZeroUsize::MIN;
const WIDTH: u32 = 40;
const HEIGHT: u32 = 36;

/// A stereo folder with two frames.
fn rig() -> TempDir {
    let root = TempDir::new().unwrap();
    for side in ["left", "right"] {
        fs::create_dir_all(root.path().join(side)).unwrap();
        for frame in 0..2 {
            ImageBuffer::from_pixel(WIDTH, HEIGHT, Luma([90u8]))
                .save(root.path().join(side).join(format!("{frame:06}.png")))
                .unwrap();
        }
    }
    fs::write(
        root.path().join("calib.txt"),
        "focal_px 90\ncenter_u_px 20\ncenter_v_px 18\nbaseline_m 0.5\n",
    )
    .unwrap();
    root
}

/// A rectangle of instance k at columns 4k.., rows 10..16, 3 px wide.
fn pixels_of(k: i32) -> PixelBox {
    PixelBox { left: 4 * k, top: 10, width: 3, height: 6 }
}

fn labels(path: &Path, values: &[u16], deep: bool) {
    let at = |u: u32, v: u32| {
        (1..)
            .zip(values)
            .find(|(k, _)| pixels_of(*k).contains(u as i32, v as i32))
            .map_or(0, |(_, value)| *value)
    };
    if deep {
        ImageBuffer::from_fn(WIDTH, HEIGHT, |u, v| Luma([at(u, v)])).save(path).unwrap();
    } else {
        ImageBuffer::from_fn(WIDTH, HEIGHT, |u, v| Luma([at(u, v) as u8])).save(path).unwrap();
    }
}

/// Lays masks over a data set, in a run that is not stopped.
fn attach(
    dataset: Box<dyn FrameSource>,
    choice: &MaskChoice,
    every: NonZeroUsize,
) -> Result<Box<dyn FrameSource>, InputError> {
    super::attach(dataset, choice, every, &StopRequest::default())
}

fn laid_over(root: &Path, choice: &MaskChoice) -> Result<Box<dyn FrameSource>, InputError> {
    attach(input::open(root, &OpenOptions::default())?, choice, EVERY)
}

fn first(root: &Path, choice: &MaskChoice) -> Result<FrameMasks, InputError> {
    Ok(laid_over(root, choice)?.frame(0)?.masks)
}

/// Writes frame 0 of `instances/` and reads it.
fn listed(values: &[u16], list: &str) -> Result<FrameMasks, InputError> {
    let root = rig();
    let folder = root.path().join("instances");
    fs::create_dir(&folder).unwrap();
    labels(&folder.join("000000.png"), values, false);
    fs::write(folder.join("000000.txt"), list).unwrap();
    first(root.path(), &MaskChoice::Auto)
}

fn refusal_of<T>(result: Result<T, InputError>) -> String {
    result.map(|_| ()).unwrap_err().to_string()
}

#[test]
fn a_list_names_the_instances_of_the_picture_best_first() {
    let masks = listed(
        &[1, 2, 3],
        "# id class score x1 y1 x2 y2\n1 car 0.4 0 0 9 9\n3 person 0.9 1.5 2 3 \
                            4\n2 traffic light 0.7 0 0 1 1\n",
    )
    .unwrap();
    let of: Vec<_> = masks.instances.iter().map(|one| (one.class, one.score, one.pixels)).collect();
    assert_eq!(
        of,
        [
            (Class::Person, 0.9, pixels_of(3)),
            (Class::Other, 0.7, pixels_of(2)),
            (Class::Car, 0.4, pixels_of(1))
        ]
    );
    assert!(
        masks
            .instances
            .iter()
            .all(|one| one.mask.len() == 18 && one.mask.iter().all(|&pixel| pixel == 1))
    );
    assert_eq!(masks.refusals, MaskRefusals::default());
}

#[test]
fn what_cannot_be_used_of_a_list_is_counted() {
    let masks =
        listed(&[1, 2, 3], "1 car 0.4 0 0 9 9\n2 hovercraft 0.5 0 0 1 1\n9 car 0.9 0 0 1 1\n")
            .unwrap();
    assert_eq!(
        masks.refusals,
        MaskRefusals { unnamed: 1, unknown_class: 1, empty: 1, ..MaskRefusals::default() }
    );
    assert_eq!(
        masks.instances.iter().map(|one| one.class).collect::<Vec<_>>(),
        [Class::Other, Class::Car],
        "an unknown class is kept as other"
    );
    // The core validates scores: it refuses and counts these two.
    let masks = listed(&[1, 2], "1 car nan 0 0 9 9\n2 car 1.5 0 0 9 9\n").unwrap();
    assert!(
        masks.instances.len() == 2
            && masks.instances.iter().any(|one| one.score.is_nan())
            && masks.instances.iter().any(|one| one.score == 1.5)
    );
}

#[test]
fn a_list_that_is_none_is_refused_with_its_line() {
    for (list, reason) in [
        ("1 car 0.4 0 0 9\n", "line 1 is not"),
        ("\n1 car 0.4 0 0 9 nine\n", "line 2 is not"),
        ("0 car 0.4 0 0 9 9\n", "line 1 is not"),
        ("1 car 0.4 0 0 9 9\n1 bus 0.4 0 0 9 9\n", "a second time"),
    ] {
        let message = refusal_of(listed(&[1], list));
        assert!(
            message.contains(reason)
                && message.contains("000000.txt")
                && message.contains("--instances"),
            "{message}"
        );
    }
}

#[test]
fn masks_of_another_size_without_a_list_or_in_colour_are_refused() {
    let root = rig();
    let folder = root.path().join("instances");
    fs::create_dir(&folder).unwrap();
    let png = folder.join("000000.png");
    labels(&png, &[1], false);
    assert!(refusal_of(first(root.path(), &MaskChoice::Auto)).contains("its list"));
    fs::write(folder.join("000000.txt"), "1 car 0.5 0 0 1 1\n").unwrap();
    ImageBuffer::from_pixel(WIDTH - 1, HEIGHT, Luma([1u8])).save(&png).unwrap();
    assert!(
        refusal_of(first(root.path(), &MaskChoice::Auto))
            .contains("39 x 36 px, but the images are 40 x 36 px")
    );
    ImageBuffer::from_pixel(WIDTH, HEIGHT, image::Rgb([1u8, 2, 3])).save(&png).unwrap();
    assert!(refusal_of(first(root.path(), &MaskChoice::Auto)).contains("colour image"));
    fs::write(&png, "no picture").unwrap();
    assert!(refusal_of(first(root.path(), &MaskChoice::Auto)).contains("cannot be used"));
}

#[test]
fn a_frame_without_a_file_has_no_masks_and_empty_folders_are_refused() {
    let root = rig();
    let folder = root.path().join("instances");
    fs::create_dir(&folder).unwrap();
    labels(&folder.join("000001.png"), &[1], false);
    fs::write(folder.join("000001.txt"), "1 car 0.5 0 0 1 1\n").unwrap();
    let dataset = laid_over(root.path(), &MaskChoice::Auto).unwrap();
    assert!(
        dataset.notes().iter().any(|note| note.contains("for 1 of 2 frames")),
        "{:?}",
        dataset.notes()
    );
    assert_eq!(dataset.frame(0).unwrap().masks.refusals.missing, 1);
    assert_eq!(dataset.frame(1).unwrap().masks.instances.len(), 1);
    let empty = TempDir::new().unwrap();
    let asked = |path: &Path| {
        refusal_of(laid_over(root.path(), &MaskChoice::Files(&indexed::FORMAT, path.to_path_buf())))
    };
    assert!(asked(empty.path()).contains("nothing for any frame; the first image is 000000.png"));
    assert!(asked(&empty.path().join("no")).contains("no such file or folder"));
    fs::remove_file(folder.join("000001.png")).unwrap();
    assert!(first(root.path(), &MaskChoice::Auto).unwrap().instances.is_empty());
    assert!(
        refusal_of(laid_over(root.path(), &MaskChoice::Exact))
            .contains("only the synthetic street")
    );
}

#[test]
fn scaled_images_have_scaled_masks() {
    let root = rig();
    let folder = root.path().join("instances");
    fs::create_dir(&folder).unwrap();
    let calibration = "focal_px 100\ncenter_u_px 40\ncenter_v_px 36\nbaseline_m 0.5\n";
    fs::write(root.path().join("calib.txt"), calibration).unwrap();
    let square = |u: u32, v: u32| (8..24).contains(&u) && (12..20).contains(&v);
    let picture = ImageBuffer::from_fn(80, 72, |u, v| Luma([u8::from(square(u, v))]));
    for side in ["left", "right"] {
        (0..2).for_each(|frame| {
            picture.save(root.path().join(side).join(format!("{frame:06}.png"))).unwrap()
        });
    }
    picture.save(folder.join("000000.png")).unwrap();
    fs::write(folder.join("000000.txt"), "1 car 0.5 0 0 1 1\n").unwrap();
    let half = input::Scaled::new(input::open(root.path(), &OpenOptions::default()).unwrap(), 0.5)
        .unwrap();
    let masks = attach(Box::new(half), &MaskChoice::Auto, EVERY).unwrap().frame(0).unwrap().masks;
    assert_eq!(masks.instances.len(), 1);
    assert_eq!(masks.instances[0].pixels, PixelBox { left: 4, top: 6, width: 8, height: 4 });
}

fn street() -> Box<dyn FrameSource> {
    Box::new(
        StreetFrames::new(StreetConfig {
            width: 320,
            height: 96,
            frames: 40,
            ..StreetConfig::default()
        })
        .unwrap(),
    )
}

#[test]
fn the_street_knows_every_car_it_draws_parked_ones_too() {
    let given = |choice: &MaskChoice| attach(street(), choice, EVERY).unwrap().frame(20).unwrap();
    assert!(
        given(&MaskChoice::Auto).masks.instances.is_empty(),
        "exact masks are given only to those who ask for them"
    );
    let frame = given(&MaskChoice::Exact);
    let truth = frame.objects.unwrap();
    assert_eq!(frame.masks.instances.len(), truth.objects.len());
    assert!(
        truth.objects.iter().any(|object| object.moving)
            && truth.objects.iter().any(|object| !object.moving)
    );
    let mut boxes: Vec<PixelBox> = frame.masks.instances.iter().map(|one| one.pixels).collect();
    let mut expected: Vec<PixelBox> = truth.objects.iter().map(|object| object.pixels).collect();
    boxes.sort();
    expected.sort();
    assert_eq!(boxes, expected);
    let pixels: usize =
        frame.masks.instances.iter().flat_map(|one| &one.mask).filter(|&&pixel| pixel == 1).count();
    assert_eq!(pixels, frame.exact.unwrap().instances.pixels().iter().filter(|&&k| k > 0).count());
}

#[dynvox_needs::long]
#[test]
fn noise_is_a_detectors_and_the_same_again_for_the_same_seed() {
    let exact = attach(street(), &MaskChoice::Exact, EVERY).unwrap();
    let noisy = |seed: u64| attach(street(), &MaskChoice::Noisy(seed), EVERY).unwrap();
    let (again, other) = (noisy(3), noisy(4));
    let noisy = noisy(3);
    let (mut missed, mut false_ones, mut ragged, mut differs) = (0i64, 0, 0, 0);
    for index in (0..40).step_by(2) {
        let [a, b, c, d] =
            [&noisy, &again, &other, &exact].map(|dataset| dataset.frame(index).unwrap().masks);
        assert_eq!(a, b);
        differs += u32::from(a != c);
        missed += d.instances.len() as i64 - a.instances.len() as i64;
        let overlap = |one: &InstanceMask| {
            d.instances.iter().map(|other| other.pixels.overlap(&one.pixels)).fold(0.0, f32::max)
        };
        false_ones += a.instances.iter().filter(|one| overlap(one) < 0.1).count();
        ragged += a
            .instances
            .iter()
            .filter(|one| d.instances.iter().all(|other| other.mask != one.mask))
            .count();
        assert!(a.instances.iter().all(|one| (0.3..1.0).contains(&one.score)));
    }
    assert!(
        missed > 0 && false_ones > 0 && ragged > 10 && differs > 10,
        "{missed} {false_ones} {ragged} {differs}"
    );
}

#[dynvox_needs::clips(
    "kitti-odometry/sequences/06/instances",
    "kitti-odometry/sequences/r1405/instances",
    "kitti-tracking/training/image_02/0003",
    "kitti-tracking/training/image_02/0005"
)]
#[test]
fn masks_of_the_real_clips_are_read_whole() {
    let data = Path::new(dynvox_needs::data_folder!());
    let clips = [
        ("kitti-odometry", "06"),
        ("kitti-odometry", "r1405"),
        ("kitti-tracking", "0003"),
        ("kitti-tracking", "0005"),
    ];
    for (root, sequence) in clips {
        let clip = input::open(
            &data.join(root),
            &OpenOptions { sequence: Some(sequence.into()), ..OpenOptions::default() },
        )
        .unwrap();
        let clip = attach(clip, &MaskChoice::Auto, EVERY).unwrap();
        let frames: Vec<FrameMasks> = [0, clip.len() / 2, clip.len() - 1]
            .iter()
            .map(|&at| clip.frame(at).unwrap().masks)
            .collect();
        assert!(frames.iter().all(|masks| masks.instances.len() > 1 && masks.refusals == MaskRefusals::default()), "{root} {sequence}");
        assert!(
            frames.iter().flat_map(|masks| &masks.instances).any(|one| one.class == Class::Car)
        );
    }
}
