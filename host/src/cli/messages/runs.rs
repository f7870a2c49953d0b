//! Messages of a run and of its folder.

use super::{io, path, text};
use crate::{
    observe::ObserveError,
    owned::{NotOwned, check_overlap},
    run::{FolderError, ResumeError, RunError, store::StoreError},
};
use dynvox_core::{LoadPlacesError, StepError, memory::SlabError};
use std::io::{Error, ErrorKind};

/// Errors while a run goes on, and of its folder.
pub(super) fn all() -> Vec<(&'static str, Vec<String>)> {
    vec![
        (
            "A run ends early",
            sentences!(RunError; hands_on [RunError::Dataset(_), RunError::Folder(_),
                RunError::Request(_), RunError::Reopen(_), RunError::Resume(_),
                RunError::Overlap(_),
                RunError::Observe(_), RunError::Threads { .. }];
                RunError::SavedExists { .. } => RunError::SavedExists {
                    path: path("masks"), option: "--save-instances"
                },
                RunError::Places { .. } => RunError::Places {
                    path: path("map.places"), reason: LoadPlacesError::<Error>::Rig.to_string()
                },
                RunError::OldBlocks { .. } => RunError::OldBlocks {
                    path: path("map.blocks"), reason: io(ErrorKind::NotFound).to_string()
                },
                RunError::NoMemory { .. } => RunError::NoMemory {
                    bytes: 268_435_456, profile: text("onboard")
                },
                RunError::Slab { .. } => RunError::Slab {
                    profile: text("onboard"), reason: SlabError::RegionTooSmall.to_string()
                },
                RunError::Step { .. } => RunError::Step {
                    frame: 7, reason: StepError::TimeNotLater.to_string()
                },
                RunError::Store(_) => RunError::Store(StoreError::Io {
                    path: path("map.blocks"), source: io(ErrorKind::StorageFull)
                }),
                RunError::Strict { .. } => RunError::Strict {
                    frame: 7, cause: text("12 block requests refused, the pool is full")
                },
                RunError::Signal { .. } => RunError::Signal { signal: 2, frames: 7 },
                RunError::Resident { .. } => RunError::Resident {
                    frame: 7, rss_bytes: 900_000_000, limit_bytes: 800_000_000
                },
                RunError::AddressSpace { .. } => RunError::AddressSpace {
                    frame: 7, used_bytes: 3_900_000_000, limit_bytes: 4_000_000_000
                },
            ),
        ),
        ("A run folder cannot be used", of_folders()),
        ("A folder is left alone", of_owned()),
        ("A run cannot be resumed", of_resuming()),
        ("Evicted blocks cannot be used", of_stores()),
        (
            "Results cannot be written",
            sentences!(ObserveError; hands_on [ObserveError::Dataset(_)];
                ObserveError::Write { .. } => ObserveError::Write {
                    path: path("run.partial/frames.csv"), source: io(ErrorKind::StorageFull)
                },
                ObserveError::Changed { .. } => ObserveError::Changed {
                    path: path("run.partial/frames.csv"), reason: text("it is missing")
                },
            ),
        ),
    ]
}

fn of_folders() -> Vec<String> {
    sentences!(FolderError; hands_on [];
        FolderError::Exists { .. } => FolderError::Exists { path: path("run") },
        FolderError::Foreign { .. } => FolderError::Foreign { path: path("run") },
        FolderError::ForeignFile { .. } => FolderError::ForeignFile {
            path: path("run"), file: path("run/notes.txt")
        },
        FolderError::Link { .. } => FolderError::Link { path: path("run") },
        FolderError::InTheWay { .. } => FolderError::InTheWay {
            partial: path("run.partial"),
            path: path("run"),
            reason: "it has no marker of dynvox",
        },
        FolderError::Unmoved { .. } => FolderError::Unmoved {
            partial: path("run.partial"), path: path("run")
        },
        FolderError::NoReserve { .. } => FolderError::NoReserve {
            path: path("run.partial"), source: io(ErrorKind::StorageFull)
        },
        FolderError::Interrupted { .. } => FolderError::Interrupted { path: path("run") },
        FolderError::NothingToResume { .. } => FolderError::NothingToResume {
            path: path("run"), reason: "there is no such run. Give the --out of the \
            interrupted run"
        },
        FolderError::InUse { .. } => FolderError::InUse { path: path("run") },
        FolderError::Current { .. } => FolderError::Current { path: path("run") },
        FolderError::Fixed { .. } => FolderError::Fixed {
            path: path("run"), source: io(ErrorKind::PermissionDenied)
        },
        FolderError::NotMoved { .. } => FolderError::NotMoved {
            partial: path("run.partial"), path: path("run"), reason: text("permission denied")
        },
        FolderError::Write { .. } => FolderError::Write {
            path: path("run/map.ply"), source: io(ErrorKind::StorageFull)
        },
    )
}

fn of_owned() -> Vec<String> {
    let mut sentences = sentences!(NotOwned; hands_on [];
        NotOwned::Foreign { .. } => NotOwned::Foreign {
            path: path("fleet"), reason: "it is not of the folder's ledger"
        },
        NotOwned::InUse { .. } => NotOwned::InUse { path: path("fleet") },
        NotOwned::Io { .. } => NotOwned::Io {
            path: path("fleet"), source: io(ErrorKind::PermissionDenied)
        },
    );
    let overlap = check_overlap(&path("drive"), &[path("drive/image_0")]).unwrap_err();
    sentences.push(overlap.to_string());
    sentences
}

fn of_resuming() -> Vec<String> {
    sentences!(ResumeError; hands_on [];
        ResumeError::Read { .. } => ResumeError::Read {
            path: path("run.partial/snapshot"), source: io(ErrorKind::PermissionDenied)
        },
        ResumeError::Foreign { .. } => ResumeError::Foreign {
            path: path("run.partial/snapshot")
        },
        ResumeError::Version { .. } => ResumeError::Version {
            path: path("run.partial/snapshot"), found: 1, taken: 2
        },
        ResumeError::Otherwise { .. } => ResumeError::Otherwise {
            path: path("run.partial/snapshot"), reason: text("dynvox 0.0.9")
        },
        ResumeError::Damaged { .. } => ResumeError::Damaged {
            path: path("run.partial/snapshot")
        },
        ResumeError::Different { .. } => ResumeError::Different {
            differences: text("volume.voxel_size_m")
        },
        ResumeError::NotStorable { .. } => ResumeError::NotStorable {
            reason: text("the path of the masks is not Unicode")
        },
    )
}

fn of_stores() -> Vec<String> {
    sentences!(StoreError; hands_on [];
        StoreError::Io { .. } => StoreError::Io {
            path: path("map.blocks"), source: io(ErrorKind::StorageFull)
        },
        StoreError::Foreign { .. } => StoreError::Foreign { path: path("map.blocks") },
        StoreError::OtherVersion { .. } => StoreError::OtherVersion {
            path: path("map.blocks"), found: '1', reads: '2'
        },
        StoreError::Missing { .. } => StoreError::Missing { path: path("map.blocks") },
        StoreError::Changed { .. } => StoreError::Changed {
            path: path("map.blocks"), bytes: 4_096
        },
        StoreError::OtherVoxels { .. } => StoreError::OtherVoxels {
            path: path("map.blocks"),
            found_voxel_m: 0.1,
            found_truncation_m: 0.4,
            voxel_m: 0.05,
            truncation_m: 0.2,
        },
    )
}
