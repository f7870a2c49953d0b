//! Messages of the commands that compare, evaluate and merge results.

use super::{io, path, text};
use crate::{
    evaluate::{stereo::StereoSetError, trajectory::TrajectoryError},
    fixtures::FixtureError,
    fleet::{FleetError, Lattice},
    report::compare::CompareError,
    sweep::SweepError,
};
use dynvox_clip::{ClipError, ReplayError};
use dynvox_core::StepError;
use std::io::ErrorKind;

/// Errors of the commands that compare, evaluate and merge runs.
pub(super) fn all() -> Vec<(&'static str, Vec<String>)> {
    vec![
        (
            "Runs cannot be compared",
            sentences!(CompareError; hands_on [];
                CompareError::NoRun { .. } => CompareError::NoRun {
                    path: path("run"), file: "frames.csv", source: io(ErrorKind::NotFound)
                },
                CompareError::Column { .. } => CompareError::Column {
                    path: path("run/frames.csv"), column: text("objects_digest")
                },
                CompareError::Damaged { .. } => CompareError::Damaged {
                    path: path("run/summary.json"), reason: text("it ends early")
                },
                CompareError::NothingShared { .. } => CompareError::NothingShared {
                    a: text("0 to 9"), b: text("20 to 29")
                },
            ),
        ),
        (
            "A trajectory cannot be evaluated",
            sentences!(TrajectoryError; hands_on [TrajectoryError::Format(_)];
                TrajectoryError::Lengths { .. } => TrajectoryError::Lengths {
                    first: 40, second: 39
                },
                TrajectoryError::Frames { .. } => TrajectoryError::Frames {
                    path: path("run/frames.csv"), reason: text("it ends early")
                },
                TrajectoryError::NoRow { .. } => TrajectoryError::NoRow { frame: 40, rows: 40 },
                TrajectoryError::Standing { .. } => TrajectoryError::Standing { length_m: 0.0 },
                TrajectoryError::Few { .. } => TrajectoryError::Few { pairs: 1 },
            ),
        ),
        (
            "A stereo benchmark cannot be evaluated",
            sentences!(StereoSetError; hands_on [];
                StereoSetError::Absent { .. } => StereoSetError::Absent { path: path("kitti") },
                StereoSetError::Layout { .. } => StereoSetError::Layout { path: path("kitti") },
                StereoSetError::NoTruth { .. } => StereoSetError::NoTruth {
                    path: path("kitti/testing"), truth: "disp_noc"
                },
            ),
        ),
        ("A fixture cannot be used", of_fixtures()),
        (
            "A sweep cannot be continued",
            sentences!(SweepError; hands_on [SweepError::Write(_)];
                SweepError::Read { .. } => SweepError::Read {
                    path: path("sweep/plan.json"), source: io(ErrorKind::NotFound)
                },
                SweepError::Foreign { .. } => SweepError::Foreign {
                    path: path("sweep/plan.json"), reason: text("it ends early")
                },
                SweepError::Other { .. } => SweepError::Other { path: path("sweep/plan.json") },
                SweepError::Differs { .. } => SweepError::Differs {
                    path: path("part2"),
                    run: text("street-00ff"),
                    ours: text("0123456789abcdef"),
                    theirs: text("fedcba9876543210"),
                },
            ),
        ),
        (
            "Maps cannot be merged",
            sentences!(FleetError; hands_on [FleetError::Format(_), FleetError::Store(_)];
                FleetError::Io { .. } => FleetError::Io {
                    path: path("map/0_0_0.tile"), source: io(ErrorKind::PermissionDenied)
                },
                FleetError::Content { .. } => FleetError::Content {
                    path: path("map"), reason: text("has no tile: nothing was mapped")
                },
                FleetError::OtherLattice { .. } => FleetError::OtherLattice {
                    path: path("map/0_0_0.tile"),
                    found: Lattice { voxel_size_m: 0.1, truncation_m: 0.4, colour: false },
                    expected: Lattice { voxel_size_m: 0.05, truncation_m: 0.2, colour: true },
                },
                FleetError::Exists { .. } => FleetError::Exists { path: path("merged") },
            ),
        ),
    ]
}

fn of_fixtures() -> Vec<String> {
    sentences!(FixtureError; hands_on [FixtureError::Write(_), FixtureError::Dataset(_)];
        FixtureError::Absent { .. } => FixtureError::Absent { path: path("fixtures") },
        FixtureError::Read { .. } => FixtureError::Read {
            path: path("rig/digests.txt"), source: io(ErrorKind::NotFound)
        },
        FixtureError::Content { .. } => FixtureError::Content {
            path: path("rig/fixture.toml"), reason: text("the size is that of the images")
        },
        FixtureError::Clip { .. } => FixtureError::Clip {
            path: path("rig"), error: ClipError::Truncated { frame: 7 }
        },
        FixtureError::Replay { .. } => FixtureError::Replay {
            path: path("rig"),
            error: ReplayError::Step { frame: 7, error: StepError::SizesDiffer },
        },
        FixtureError::Exists { .. } => FixtureError::Exists { path: path("rig") },
        FixtureError::New { .. } => FixtureError::New {
            path: path("rig/left"), reason: text("permission denied")
        },
        FixtureError::NoMemory { .. } => FixtureError::NoMemory { bytes: 268_435_456 },
        FixtureError::NoReason => FixtureError::NoReason,
    )
}
