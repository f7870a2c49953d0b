//! Messages of the core, which programs that embed it show.

use dynvox_core::{
    BudgetError, CapacityProblem, NewError, Problem, RestoreError, SetError, StepError,
    geometry::RigProblem,
    memory::SlabError,
    rectify::{LensProblem, RectifierError, RectifyProblem},
    view::RaycastError,
};
use std::fmt::Display;

/// Errors of the core, which programs that embed it show.
pub(super) fn all() -> Vec<(&'static str, Vec<String>)> {
    fn all(errors: &[&dyn Display]) -> Vec<String> {
        errors.iter().map(ToString::to_string).collect()
    }
    let too_large = RectifierError::RectifiedTooLarge { width: 640, height: 480 };
    vec![
        (
            "A mapper cannot be made",
            all(&[
                &SlabError::TooSmall { missing: 72 },
                &SlabError::RegionTooSmall,
                &SlabError::TooManyRegions,
                &NewError::Config(Problem::new("volume.far_m", "must be above volume.near_m")),
                &RectifierError::RawTooLarge { width: 0, height: 0 },
                &RectifierError::RawTooLarge { width: 752, height: 480 },
                &too_large,
            ]),
        ),
        (
            "A frame is refused",
            all(&[
                &StepError::SizesDiffer,
                &StepError::TooLarge { width: 640, height: 480 },
                &StepError::TooSmall { width: 64, height: 32 },
                &StepError::SizeChanged,
                &StepError::RawSizeDiffers { width: 752, height: 480 },
                &StepError::PackedNotRectified,
                &StepError::PackedTooShort { row_bytes: 800 },
                &StepError::PoseNotFinite,
                &StepError::PoseNotRotation,
                &StepError::PoseBeyondMap,
                &StepError::TimeNotLater,
            ]),
        ),
        (
            "A snapshot cannot be restored",
            all(&[
                &RestoreError::Source("the disk is gone"),
                &RestoreError::<&str>::Foreign,
                &RestoreError::<&str>::Version(1),
                &RestoreError::<&str>::Capacity,
                &RestoreError::<&str>::Config,
                &RestoreError::<&str>::Damaged,
            ]),
        ),
        (
            "A capacity or a setting cannot be used",
            all(&[
                &BudgetError::TooSmall { least: 31_000_000 },
                &BudgetError::Image,
                &BudgetError::Objects,
                &BudgetError::VoxelSize,
                &CapacityProblem { bound: "blocks", rule: "must be above 0" },
                &SetError::Key,
                &SetError::Value,
            ]),
        ),
        (
            "A calibration cannot be used",
            all(&[
                &RigProblem::Focal,
                &RigProblem::Center,
                &RigProblem::Baseline,
                &LensProblem::Focal,
                &LensProblem::Center,
                &LensProblem::DistortionNotFinite,
                &LensProblem::DistortionOutOfRange,
                &RectifyProblem::NotARotation,
                &RectifyProblem::NoBaseline,
                &RectifyProblem::Exchanged,
                &RectifyProblem::NotSideBySide,
                &RectifyProblem::Diverging,
                &RectifyProblem::NoCommonView,
                &RectifyProblem::RectifiedSize,
            ]),
        ),
        (
            "A picture of the map cannot be drawn",
            all(&[&RaycastError::ImageSize, &RaycastError::Viewpoint, &RaycastError::Object]),
        ),
    ]
}
