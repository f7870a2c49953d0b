use super::{Faults, FaultySource};
use crate::formats::Image;
use crate::input::{FrameSource, StereoImages, StreetFrames};
use crate::synth::StreetConfig;

fn street() -> StreetFrames {
    StreetFrames::new(StreetConfig { frames: 6, width: 160, height: 48, ..StreetConfig::default() })
        .unwrap()
}

fn faulty(spec: &str) -> FaultySource {
    FaultySource::new(Box::new(street()), spec.parse::<Faults>().unwrap()).unwrap()
}

fn mean(image: &Image<u8>) -> f64 {
    image.pixels().iter().map(|&value| f64::from(value)).sum::<f64>() / image.pixels().len() as f64
}

/// Frames 2 to 4 of the source with a fault, and of the one without.
fn frames(spec: &str) -> Vec<(StereoImages, StereoImages)> {
    let (faulty, street) = (faulty(spec), street());
    (2..5).map(|at| (faulty.frame(at).unwrap(), street.frame(at).unwrap())).collect()
}

#[test]
fn images_freeze_come_late_and_are_exchanged() {
    let street = street();
    let right = |at: usize| street.frame(at).unwrap().right;
    for (at, (frame, clean)) in (2..).zip(frames("freeze:right@3..")) {
        assert_eq!((frame.left, frame.colour), (clean.left, clean.colour));
        assert_eq!(frame.right, right(at.min(2)));
    }
    for (at, (frame, clean)) in (2..).zip(frames("delay:right@3..")) {
        assert_eq!(frame.left, clean.left);
        assert_eq!(frame.right, right(if at < 3 { at } else { at - 1 }));
    }
    let (frame, clean) = &frames("exchange@2")[0];
    assert_eq!((&frame.left, &frame.right, &frame.colour), (&clean.right, &clean.left, &None));
}

#[test]
fn values_change_as_they_are_told_to_and_only_in_the_frames_named() {
    let of = |spec: &str| {
        frames(spec)
            .into_iter()
            .map(|(frame, clean)| (frame.left, clean.left, frame.right))
            .collect::<Vec<_>>()
    };
    let black = of("black@3");
    assert_eq!((&black[0].0, mean(&black[1].0), &black[2].0), (&black[0].1, 0.0, &black[2].1));
    let dark = of("brightness:left=0.5@2..");
    assert!((mean(&dark[0].0) / mean(&dark[0].1) - 0.5).abs() < 0.01);
    let noisy = of("noise=8@2..");
    let square = |(a, b): (&u8, &u8)| (f64::from(*a) - f64::from(*b)).powi(2);
    let variance = noisy[0].0.pixels().iter().zip(noisy[0].1.pixels()).map(square).sum::<f64>()
        / noisy[0].0.pixels().len() as f64;
    assert!((7.0..9.0).contains(&variance.sqrt()), "{}", variance.sqrt());
    let covered = &of("occlude=0.25@2..")[0].0;
    assert!(
        (0..40).all(|u| covered.get(u, 20) == Some(40))
            && covered.get(40, 20) == noisy[0].1.get(40, 20)
    );
    assert_eq!(frames("masks@2")[0].0.masks.instances.len(), 3);
}

#[test]
fn equal_seeds_spoil_alike_and_truth_and_time_follow_the_images() {
    let left = |spec: &str| faulty(spec).frame(1).unwrap().left;
    assert_eq!(left("noise=8"), left("noise=8"));
    assert_ne!(left("noise=8"), left("noise=8,seed=2"));
    let (jumped, street) = (faulty("jump=2@2"), street());
    assert_eq!((jumped.len(), jumped.truth().unwrap()[2]), (4, street.truth().unwrap()[4]));
    assert_eq!(jumped.stamp_ns(2), street.stamp_ns(2), "the stamps do not show it");
    assert_eq!(faulty("drop@2").stamp_ns(2), street.stamp_ns(3));
    assert!(faulty("drop@2").frame(5).unwrap_err().to_string().contains("ends after 5 frames"));
}

#[test]
fn what_moves_with_the_cameras_stays_where_it_is_in_their_images() {
    for spec in ["bonnet=0.3@2..", "truck=6@2.."] {
        let [(first, clean), _, (last, _)] = frames(spec).try_into().ok().unwrap();
        let stays = |u: usize, v: usize| first.left.get(u, v) == last.left.get(u, v);
        let (u, v) = if spec.starts_with("bonnet") { (80, 46) } else { (80, 30) };
        assert!((0..4).all(|at| stays(u + at, v)), "{spec}");
        assert_ne!(first.left.get(u, v), clean.left.get(u, v), "{spec}");
        assert_eq!(first.left.get(2, 2), clean.left.get(2, 2), "{spec}");
    }
}

#[test]
fn a_truck_has_the_disparity_of_its_distance() {
    let source = faulty("truck=5@0..");
    let rig = source.info().rig;
    let disparity_px = rig.focal_px * rig.baseline_m / 5.0;
    let frame = source.frame(1).unwrap();
    let row = |image: &Image<u8>, from: usize| {
        (from..from + 12).map(|u| f64::from(image.get(u, 28).unwrap())).collect::<Vec<_>>()
    };
    let left = row(&frame.left, 80);
    let apart = |shift: usize| -> f64 {
        left.iter().zip(row(&frame.right, 80 - shift)).map(|(a, b)| (a - b).abs()).sum()
    };
    let best = (0..30).min_by(|&a, &b| apart(a).total_cmp(&apart(b))).unwrap();
    assert!((best as f64 - disparity_px).abs() <= 0.6, "{best} px instead of {disparity_px}");
}

#[dynvox_needs::long]
#[test]
fn every_scene_changes_both_images_a_little_or_much() {
    for spec in [
        "walker=2@2..",
        "bus=0.5@2..",
        "reflection=0.4@2..",
        "dirt=0.4@2..",
        "tunnel=0.4@2..",
        "pattern=6@2..",
        "rain=60@2..",
        "wind=3@2..",
        "zoom=1.1@2..",
        "jpeg=20@2..",
        "flicker=0.4@2..",
    ] {
        for (frame, clean) in frames(spec) {
            assert_ne!(frame.left, clean.left, "{spec}");
            assert_ne!(frame.right, clean.right, "{spec}");
        }
    }
    let (moved, clean) = &frames("drift=0.5@2..")[1];
    assert_eq!(moved.left, clean.left);
    assert_eq!(moved.right.get(41, 20), clean.right.get(40, 20), "a pixel in two frames");
}
