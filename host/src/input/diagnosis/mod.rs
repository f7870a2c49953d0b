//! Examining images before the first is mapped: rectification, exchanged or identical cameras,
//! order, exposure.
//!
//! Ten pairs spread over the sequence are matched patch by patch without the rule that rows agree
//! (`patches`), and a run of consecutive left images is compared as thumbnails (`order`). What
//! makes a map meaningless is refused, what is doubtful is a warning. Where matches are too few or
//! too scattered for a verdict, that is said.

mod agreement;
mod correlation;
mod live;
mod order;
mod patches;
#[cfg(test)]
mod planted;
mod rectified;
mod rows;
#[cfg(test)]
mod tests;

use crate::formats::Image;
use crate::input::source::{FrameSource, InputError};
pub use agreement::{row_difference_px, row_error};
use dynvox_core::geometry::StereoRig;
pub use live::LiveExamination;
use patches::PatchMatch;
pub use rectified::{PairRectifier, RectifiedSource};
pub use rows::RowError;

/// Pairs that are matched.
const PAIRS: usize = 10;
/// Fewest matches, over all pairs, that allow a verdict.
const FEWEST_MATCHES: usize = 24;
/// Standard deviation of the rows' distance above which there is no verdict, px.
const UNKNOWN_ROWS_PX: f64 = 0.5;
/// Median distance of matches from the fitted rows above which images are not rectified, px.
const BENT_ROWS_PX: f64 = 1.0;
/// Distance of rows that is still called rectified, px.
const ROWS_PX: f64 = 0.5;
/// Row difference above which a map is meaningless, px.
const REFUSED_ROWS_PX: f64 = 1.0;
/// Roll that is still called rectified, degrees.
const ROLL_DEG: f64 = 0.15;
/// Exposures that differ by less are equal.
const EXPOSURE: f64 = 1.2;
/// Longest baseline, m.
const BASELINE_M: f64 = 10.0;
/// Mean difference of two images below which they are the same, grey levels.
const SAME: f64 = 0.5;
/// Mean grey level of a black image.
const BLACK: f64 = 4.0;
/// Share of saturated pixels of a usable image.
const SATURATED_SHARE: f64 = 0.4;
/// Contrast over one pixel, as a share of that over four, of an image in focus.
const FOCUS: f64 = 0.3;

/// Kind of fault in a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fault {
    /// Matches do not lie in one row.
    NotRectified,
    /// The left images are the right camera's.
    Exchanged,
    /// Both cameras show the same image.
    SameImage,
    /// The baseline is in another unit.
    Baseline,
    /// Frames do not follow each other.
    Order,
    /// One step between frames is much longer than the others.
    Jump,
    /// One camera is brighter.
    Exposure,
    /// Images are black.
    Black,
    /// Images are white.
    Saturated,
    /// Images are out of focus.
    Focus,
    /// There are too few matches to tell whether the images are rectified.
    Unknown,
}

impl Fault {
    /// Name of the fault, for programs.
    pub fn name(self) -> &'static str {
        match self {
            Self::NotRectified => "not_rectified",
            Self::Exchanged => "exchanged",
            Self::SameImage => "same_image",
            Self::Baseline => "baseline",
            Self::Order => "order",
            Self::Jump => "jump",
            Self::Exposure => "exposure",
            Self::Black => "black",
            Self::Saturated => "saturated",
            Self::Focus => "focus",
            Self::Unknown => "unknown",
        }
    }
}

/// One fault, in a sentence with the next action.
#[derive(Clone, Debug)]
pub struct Finding {
    /// Kind of the fault.
    pub fault: Fault,
    /// The sentence.
    pub message: String,
    /// True if a map would be meaningless.
    pub refused: bool,
}

/// Images that would give a meaningless map.
#[derive(Debug, thiserror::Error)]
#[error("{}. --force maps them nevertheless", messages(.findings))]
pub struct RefusedInput {
    /// Faults that were found.
    pub findings: Vec<Finding>,
}

fn messages(findings: &[Finding]) -> String {
    findings
        .iter()
        .filter(|finding| finding.refused)
        .map(|finding| finding.message.as_str())
        .collect::<Vec<_>>()
        .join(". ")
}

/// Examines the frames with these numbers. Images that cannot be read are left to the run.
///
/// # Errors
/// A raw source that cannot be rectified.
pub fn examine(source: &dyn FrameSource, indices: &[usize]) -> Result<Vec<Finding>, InputError> {
    let mut findings: Vec<Finding> = check_baseline(&source.rig()).into_iter().collect();
    let mut pairs = Vec::new();
    each_pair(source, indices, |left, right, of| pairs.push(Pair::new(left, right, of)))?;
    findings.extend(diagnose(&pairs));
    if source.rectification().is_some() {
        findings.iter_mut().for_each(name_calibration);
    }
    let thumbnails = order::window(indices)
        .iter()
        .map_while(|&index| Some(order::thumbnail(&source.frame(index).ok()?.left)));
    findings.extend(order::check(
        &thumbnails.collect::<Vec<_>>(),
        indices.first().copied().unwrap_or(0),
    ));
    Ok(findings)
}

/// Visits at most [`PAIRS`] of a source's pairs, spread over `indices`, as the mapper will see them,
/// with their number. One that cannot be read is left out. Memory: one pair at a time.
fn each_pair(
    source: &dyn FrameSource,
    indices: &[usize],
    mut visit: impl FnMut(&Image<u8>, &Image<u8>, usize),
) -> Result<(), InputError> {
    let mut rectified = RectifiedSource::new(source)?;
    let chosen = indices.iter().step_by(indices.len().div_ceil(PAIRS).max(1));
    let of = chosen.len();
    for &index in chosen {
        if let Ok(Some([left, right])) = rectified.pair(index) {
            visit(&left, &right, of);
        }
    }
    Ok(())
}

/// A baseline that no rig has.
fn check_baseline(rig: &StereoRig) -> Option<Finding> {
    (rig.baseline_m > BASELINE_M).then(|| {
        let message = format!(
            "the cameras are {} m apart. Is the calibration in millimetres? Give the baseline in \
             metres",
            rig.baseline_m
        );
        finding(Fault::Baseline, true, message)
    })
}

/// Action where images that come rectified are not.
const GIVE_RAW: &str = "Give the raw images with their calibration: --calibration FILE";
/// Action where images are not rectified by their calibration.
const CALIBRATE: &str = "The calibration is not of these cameras as they stand: calibrate anew, or \
                         look at its rows with `dynvox calibration FILE --images DIR`";

/// Says of raw images that it is their calibration which does not rectify them.
fn name_calibration(finding: &mut Finding) {
    if finding.fault == Fault::NotRectified {
        let by = "their calibration does not rectify these images";
        finding.message = finding
            .message
            .replace("these images are not rectified", by)
            .replace(GIVE_RAW, CALIBRATE);
    }
}

fn finding(fault: Fault, refused: bool, message: String) -> Finding {
    Finding { fault, message, refused }
}

/// Measurements of one pair.
struct Pair {
    width_px: f64,
    matches: Vec<PatchMatch>,
    difference: f64,
    mean: f64,
    saturated: f64,
    focus: [f64; 2],
}

impl Pair {
    /// Measures one of `pairs` pairs.
    fn new(left: &Image<u8>, right: &Image<u8>, pairs: usize) -> Self {
        let count = left.pixels().len().max(1) as f64;
        let sum = |image: &Image<u8>| {
            image.pixels().iter().map(|&grey| u64::from(grey)).sum::<u64>() as f64 / count
        };
        let differences =
            left.pixels().iter().zip(right.pixels()).map(|(a, b)| u64::from(a.abs_diff(*b)));
        Self {
            width_px: left.width() as f64,
            matches: patches::matches(left, right, patches::step_px(pairs)),
            difference: differences.sum::<u64>() as f64 / count,
            mean: 0.5 * (sum(left) + sum(right)),
            saturated: left.pixels().iter().filter(|grey| **grey >= 252).count() as f64 / count,
            focus: [left, right].map(focus),
        }
    }
}

/// Mean contrast over one pixel as a share of that over four.
fn focus(image: &Image<u8>) -> f64 {
    let contrast = |apart: usize| -> u64 {
        let row = |row: &[u8]| {
            row.iter()
                .zip(row.iter().skip(apart))
                .map(|(a, b)| u64::from(a.abs_diff(*b)))
                .sum::<u64>()
        };
        image.pixels().chunks_exact(image.width().max(1)).map(row).sum()
    };
    contrast(1) as f64 / contrast(4).max(1) as f64
}

/// The middle of some numbers.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

fn diagnose(pairs: &[Pair]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let most = |holds: &dyn Fn(&Pair) -> bool| {
        !pairs.is_empty() && 2 * pairs.iter().filter(|pair| holds(pair)).count() > pairs.len()
    };
    if most(&|pair| pair.mean < BLACK) {
        findings.push(finding(
            Fault::Black,
            true,
            "the images are black. Check exposure, lens caps and the bits of 16-bit images \
             (--bits)"
                .to_owned(),
        ));
        return findings;
    }
    if most(&|pair| pair.difference < SAME) {
        let message =
            "both cameras show the same image. Give the left camera's images and the right one's"
                .to_owned();
        findings.push(finding(Fault::SameImage, true, message));
        return findings;
    }
    if most(&|pair| pair.saturated > SATURATED_SHARE) {
        findings.push(finding(
            Fault::Saturated,
            false,
            "much of the images is saturated: nothing can be matched there. Lower the exposure"
                .to_owned(),
        ));
    }
    for (camera, name) in ["left", "right"].into_iter().enumerate() {
        if most(&|pair| pair.focus.get(camera).is_some_and(|focus| *focus < FOCUS)) {
            let message = format!(
                "the {name} images are out of focus or enlarged: disparities will be coarse. Focus \
                 the lens, or give --scale 0.5"
            );
            findings.push(finding(Fault::Focus, false, message));
        }
    }
    let matches: Vec<&PatchMatch> = pairs.iter().flat_map(|pair| &pair.matches).collect();
    let (count, width_px) = (matches.len(), pairs.first().map_or(0.0, |pair| pair.width_px));
    if count >= FEWEST_MATCHES {
        findings.extend(check_matches(&matches, width_px));
    } else if !pairs.is_empty() {
        findings.push(unknown(&format!("{count} matches")));
    }
    findings
}

/// The doubt where matches give no verdict.
fn unknown(found: &str) -> Finding {
    let message = format!(
        "whether the images are rectified could not be examined: {found}. Check with `dynvox \
         calibration FILE --images DIR` that the same point lies in the same row of both images"
    );
    finding(Fault::Unknown, false, message)
}

fn check_matches(matches: &[&PatchMatch], width_px: f64) -> Vec<Finding> {
    let mut findings = Vec::new();
    let share = |holds: &dyn Fn(&PatchMatch) -> bool| {
        matches.iter().filter(|one| holds(one)).count() as f64 / matches.len() as f64
    };
    if share(&|one| one.disparity_px < -1.0) > 0.6 {
        let message = "left and right are exchanged: what is near lies further left in the left \
                       images. Exchange the two folders or files, or give --swap=images";
        findings.push(finding(Fault::Exchanged, true, message.to_owned()));
    }
    findings.extend(check_rows(&RowError::of(matches, width_px), matches.len(), width_px));
    let exposure = median(matches.iter().map(|one| one.brightness).collect());
    if !(1.0 / EXPOSURE..=EXPOSURE).contains(&exposure) {
        let message = format!(
            "the left images are {exposure:.2} times as bright as the right ones. Let both cameras \
             expose alike"
        );
        findings.push(finding(Fault::Exposure, false, message));
    }
    findings
}

/// The verdict on rows.
fn check_rows(rows: &RowError, matches: usize, width_px: f64) -> Option<Finding> {
    let &RowError { shift_px, roll_deg, shift_sigma_px, rest_px, .. } = rows;
    if shift_sigma_px.is_nan() || shift_sigma_px >= UNKNOWN_ROWS_PX {
        return Some(unknown(&format!("{matches} matches contradict each other")));
    }
    let certain_px = rows.certain_px(width_px);
    let apart = certain_px > ROWS_PX
        || rows.certain_shift_px() > ROWS_PX
        || rows.certain_roll_deg() > ROLL_DEG
        || rest_px > BENT_ROWS_PX;
    apart.then(|| {
        let message = format!(
            "these images are not rectified: rows lie {:.1} px apart in the middle, sigma \
             {shift_sigma_px:.1} ({matches} matches). Right images are {:.1} px too {} there and \
             rotated by {roll_deg:+.2} degrees (clockwise); {rest_px:.1} px are left besides. \
             {GIVE_RAW}",
            shift_px.abs(),
            shift_px.abs(),
            if shift_px > 0.0 { "low" } else { "high" }
        );
        let refused = certain_px.max(rest_px) > REFUSED_ROWS_PX;
        finding(Fault::NotRectified, refused, message)
    })
}
