//! Sentences of the errors: each error has its own, with the figures it was given.

use super::*;
use crate::{
    BudgetError, SetError,
    geometry::RigProblem,
    mapper::{CapacityProblem, Digested},
    memory::SlabError,
    rectify::{LensProblem, RectifierError, RectifyProblem},
    settings::Problem,
    view::RaycastError,
    volume::Full,
};
use core::{error::Error, fmt::Display};
use std::string::ToString;

/// Returns the texts, after checking that each is a part of a sentence without a full stop, and
/// that no two are alike.
fn all_differ<E: Error>(errors: &[E]) -> Vec<std::string::String> {
    let texts: Vec<_> = errors.iter().map(ToString::to_string).collect();
    for (at, text) in texts.iter().enumerate() {
        assert!(text.len() > 15 && !text.ends_with('.') && !texts[..at].contains(text), "{text}");
    }
    texts
}

#[test]
fn a_refused_frame_is_told_what_is_wrong_with_it() {
    // A text for each variant, none of them twice.
    let texts = all_differ(&[
        StepError::SizesDiffer,
        StepError::TooLarge { width: 641, height: 193 },
        StepError::TooSmall { width: 64, height: 32 },
        StepError::SizeChanged,
        StepError::RawSizeDiffers { width: 752, height: 480 },
        StepError::PoseNotFinite,
        StepError::PoseNotRotation,
        StepError::PoseBeyondMap,
        StepError::TimeNotLater,
        StepError::PackedNotRectified,
        StepError::PackedTooShort { row_bytes: 800 },
    ]);
    assert!(
        texts[1].contains("at most 641 x 193 px")
            && texts[2].contains("at least 64 x 32 px")
            && texts[4].contains("752 x 480 px")
    );
    assert!(
        texts[5].contains("finite")
            && texts[6].contains("length 1")
            && texts[7].contains("beyond the map")
            && texts[8].contains("time")
            && texts[9].contains("rectifies")
            && texts[10].contains("800 bytes a row")
    );
}

#[test]
fn a_snapshot_that_is_refused_says_why() {
    // What the slab says is handed on word for word.
    let slab = SlabError::TooSmall { missing: 72 };
    let texts = all_differ(&[
        RestoreError::New(NewError::Slab(slab)),
        RestoreError::Source("the disk is gone"),
        RestoreError::Foreign,
        RestoreError::Version(1_234),
        RestoreError::Capacity,
        RestoreError::Config,
        RestoreError::Damaged,
    ]);
    assert_eq!(texts[0], slab.to_string());
    assert_eq!(texts[1], "the snapshot cannot be read: the disk is gone");
    let versions = std::format!(
        "version 1234, this mapper reads version {}",
        crate::mapper::snapshot::VERSION
    );
    assert!(texts[3].contains(&versions), "{}", texts[3]);
    assert!(
        texts[4].contains("capacity")
            && texts[5].contains("configuration")
            && texts[6].contains("damaged")
    );
}

#[test]
fn a_mapper_that_cannot_be_made_hands_on_the_reason() {
    let problem = Problem::new("volume.far_m", "must be above volume.near_m");
    let rectification = RectifierError::RawTooLarge { width: 752, height: 480 };
    let texts = all_differ(&[
        NewError::from(SlabError::RegionTooSmall),
        NewError::Slab(SlabError::TooManyRegions),
        NewError::Config(problem),
        NewError::Rectification(rectification),
    ]);
    assert!(texts[0].contains("a bug of dynvox-core") && texts[1].contains("a bug of dynvox-core"));
    assert_eq!(
        texts[2],
        "the configuration cannot be used: volume.far_m must be above volume.near_m"
    );
    assert_eq!(texts[3], rectification.to_string());
}

#[test]
fn calibrations_and_lenses_that_cannot_be_used_say_why() {
    all_differ(&[
        RectifyProblem::NotARotation,
        RectifyProblem::NoBaseline,
        RectifyProblem::Exchanged,
        RectifyProblem::NotSideBySide,
        RectifyProblem::Diverging,
        RectifyProblem::NoCommonView,
        RectifyProblem::RawSize,
        RectifyProblem::RectifiedSize,
    ]);
    all_differ(&[
        LensProblem::Focal,
        LensProblem::Center,
        LensProblem::DistortionNotFinite,
        LensProblem::DistortionOutOfRange,
    ]);
    all_differ(&[RigProblem::Focal, RigProblem::Center, RigProblem::Baseline]);
    let texts = all_differ(&[
        RectifierError::RawTooLarge { width: 0, height: 0 },
        RectifierError::RawTooLarge { width: 752, height: 480 },
        RectifierError::RectifiedTooLarge { width: 640, height: 400 },
    ]);
    assert!(
        texts[0].contains("raw_width")
            && texts[1].contains("752 x 480 px")
            && texts[2].contains("640 x 400 px")
    );
}

#[test]
fn bounds_views_and_settings_say_what_they_miss() {
    let texts = all_differ(&[
        BudgetError::TooSmall { least: 12_345 },
        BudgetError::Image,
        BudgetError::Objects,
        BudgetError::VoxelSize,
    ]);
    assert!(
        texts[0].contains("12345 bytes")
            && texts[1].contains("64 x 32 px")
            && texts[2].contains("16 objects")
    );
    let problem = Capacity { tracks: 1 << 29, ..Capacity::TINY }.validate().unwrap_err();
    assert_eq!(problem, CapacityProblem { bound: "tracks", rule: "must be at most 268,435,456" });
    assert_eq!(problem.to_string(), "tracks must be at most 268,435,456");
    all_differ(&[RaycastError::ImageSize, RaycastError::Viewpoint, RaycastError::Object]);
    all_differ(&[SetError::Key, SetError::Value]);
    assert_eq!(Full.to_string(), "every slot is taken");
}

#[test]
fn what_was_digested_goes_by_its_name() {
    let names: Vec<_> = [
        Digested::Input,
        Digested::Stereo,
        Digested::SceneFlow,
        Digested::Egomotion,
        Digested::Tracking,
        Digested::StaticMap,
        Digested::Object(17),
    ]
    .iter()
    .map(|digested: &Digested| (digested as &dyn Display).to_string())
    .collect();
    assert_eq!(
        names,
        ["input", "stereo", "scene_flow", "egomotion", "tracking", "static_map", "object 17"]
    );
}
