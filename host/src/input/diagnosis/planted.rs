//! Faults planted into a clean recording: each is named, and the clean recording gives no finding.

use super::tests::data;
use super::*;
use crate::input::source::{FrameInfo, LidarScan, SourceInfo, StereoImages, StreamState};
use crate::input::{OpenOptions, StreetFrames, open};
use crate::synth::StreetConfig;

/// Fault that a test plants in a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Planted {
    Nothing,
    /// Right images rotated clockwise, degrees, and shifted down, px.
    Rotated(f64),
    Lowered(f64),
    Exchanged,
    Millimetres,
    Shuffled,
    SameTwice,
    Brighter(f64),
}

/// A recording with a fault.
struct CorruptedSource<'s> {
    source: &'s dyn FrameSource,
    frames: &'s [StereoImages],
    planted: Planted,
    info: SourceInfo,
}

fn bilinear(image: &Image<u8>, u: f64, v: f64) -> u8 {
    let last = |side: usize| side as f64 - 1.0;
    let (u, v) = (u.clamp(0.0, last(image.width())), v.clamp(0.0, last(image.height())));
    let (x, y) = (u.floor(), v.floor());
    let at = |dx: f64, dy: f64| {
        let (column, row) = ((x + dx).min(last(image.width())), (y + dy).min(last(image.height())));
        f64::from(image.get(column as usize, row as usize).unwrap())
    };
    let (right, down) = (u - x, v - y);
    let upper = at(0.0, 0.0) * (1.0 - right) + at(1.0, 0.0) * right;
    let lower = at(0.0, 1.0) * (1.0 - right) + at(1.0, 1.0) * right;
    (upper * (1.0 - down) + lower * down).round() as u8
}

/// The image whose pixels show what `from` shows where `at` says.
fn resampled(from: &Image<u8>, at: impl Fn(f64, f64) -> [f64; 2]) -> Image<u8> {
    let (width, height) = (from.width(), from.height());
    let pixel = |index: usize| {
        let [u, v] = at((index % width) as f64, (index / width) as f64);
        bilinear(from, u, v)
    };
    Image::new(width, height, (0..width * height).map(pixel).collect()).unwrap()
}

impl FrameSource for CorruptedSource<'_> {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn frame_info(&self, index: usize) -> FrameInfo {
        FrameInfo { time_s: self.source.time_s(index), ..FrameInfo::default() }
    }
    fn stream(&self) -> Option<StreamState> {
        None
    }

    fn frame(&self, index: usize) -> Result<StereoImages, InputError> {
        let shuffled = index * 7 % self.len();
        let mut frame =
            self.frames[if self.planted == Planted::Shuffled { shuffled } else { index }].clone();
        let right = &frame.right;
        let center = [0.5 * right.width() as f64, 0.5 * right.height() as f64];
        match self.planted {
            Planted::Nothing | Planted::Millimetres | Planted::Shuffled => {}
            Planted::Rotated(degrees) => {
                let (sine, cosine) = degrees.to_radians().sin_cos();
                frame.right = resampled(right, |u, v| {
                    let (x, y) = (u - center[0], v - center[1]);
                    [center[0] + cosine * x + sine * y, center[1] - sine * x + cosine * y]
                });
            }
            Planted::Lowered(px) => frame.right = resampled(right, |u, v| [u, v - px]),
            Planted::Exchanged => std::mem::swap(&mut frame.left, &mut frame.right),
            Planted::SameTwice => frame.right = frame.left.clone(),
            Planted::Brighter(factor) => {
                let pixels = right
                    .pixels()
                    .iter()
                    .map(|&grey| (f64::from(grey) * factor).min(255.0) as u8)
                    .collect();
                frame.right = Image::new(right.width(), right.height(), pixels).unwrap();
            }
        }
        Ok(frame)
    }

    fn has_lidar(&self, _: usize) -> bool {
        false
    }

    fn lidar(&self, _: usize) -> Result<Option<LidarScan>, InputError> {
        Ok(None)
    }
}

/// Frames of a recording that are examined: no multiple of 7, by which they are shuffled.
const FRAMES: usize = 25;

fn frames(source: &dyn FrameSource, count: usize) -> Vec<StereoImages> {
    (0..count).map(|index| source.frame(index).unwrap()).collect()
}

fn found(source: &dyn FrameSource, frames: &[StereoImages], planted: Planted) -> Vec<Finding> {
    let mut info = SourceInfo { frames: frames.len(), notes: Vec::new(), ..source.info().clone() };
    if planted == Planted::Millimetres {
        info.rig.baseline_m *= 1e3;
    }
    let spoilt = CorruptedSource { source, frames, planted, info };
    examine(&spoilt, &(0..spoilt.len()).collect::<Vec<_>>()).unwrap()
}

/// The number behind some words.
fn number(text: &str, before: &str) -> f64 {
    let rest = text.split(before).nth(1).unwrap_or_else(|| panic!("{before}: {text}"));
    rest.split(' ').next().unwrap().parse().unwrap()
}

fn each_fault_is_named(source: &dyn FrameSource) {
    let frames = frames(source, FRAMES);
    let cases = [
        (Planted::Nothing, None),
        (Planted::Rotated(0.6), Some(Fault::NotRectified)),
        (Planted::Lowered(3.0), Some(Fault::NotRectified)),
        (Planted::Exchanged, Some(Fault::Exchanged)),
        (Planted::Millimetres, Some(Fault::Baseline)),
        (Planted::Shuffled, Some(Fault::Order)),
        (Planted::SameTwice, Some(Fault::SameImage)),
        (Planted::Brighter(1.5), Some(Fault::Exposure)),
    ];
    for (planted, fault) in cases {
        let findings = found(source, &frames, planted);
        let faults: Vec<Fault> = findings.iter().map(|one| one.fault).collect();
        println!(
            "{} {planted:?}: {faults:?} {:?}",
            source.name(),
            findings.first().map(|one| &one.message)
        );
        assert_eq!(faults, Vec::from_iter(fault), "{} {planted:?}", source.name());
        let off = |before: &str, truth: f64| (number(&findings[0].message, before) - truth).abs();
        match planted {
            Planted::Rotated(roll) => assert!(off("rotated by ", roll) < 0.1, "{findings:?}"),
            Planted::Lowered(px) => assert!(off("Right images are ", px) < 0.3, "{findings:?}"),
            _ => {}
        }
    }
}

#[test]
fn faults_planted_into_the_street_are_named() {
    let config =
        StreetConfig { width: 480, height: 160, frames: FRAMES as u32, ..StreetConfig::default() };
    each_fault_is_named(&StreetFrames::new(config).unwrap());
}

#[dynvox_needs::clips("kitti-odometry/sequences/06")]
#[test]
fn faults_planted_into_a_real_clip_are_named() {
    let options = OpenOptions { sequence: Some("06".to_owned()), ..OpenOptions::default() };
    each_fault_is_named(open(&data("kitti-odometry"), &options).unwrap().as_ref());
}

#[dynvox_needs::long]
#[test]
fn ten_streets_give_no_false_alarm() {
    let sizes = [(640, 192), (480, 160), (320, 240), (376, 240), (320, 96)];
    for seed in 1..=10 {
        let (width, height) = sizes[seed as usize % sizes.len()];
        let street =
            StreetFrames::new(StreetConfig { seed, width, height, ..StreetConfig::default() })
                .unwrap();
        let findings = found(&street, &frames(&street, 8), Planted::Nothing);
        assert!(findings.is_empty(), "seed {seed}, {width} x {height}: {findings:?}");
    }
}
