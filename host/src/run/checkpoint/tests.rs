//! The host's part of a checkpoint, with one byte changed.

use super::*;
use crate::request::Request;
use crate::slab::HostSlab;
use dynvox_core::geometry::StereoRig;
use dynvox_core::{Capacity, Config};
use std::collections::BTreeMap;

const RIG: StereoRig =
    StereoRig { focal_px: 90.0, center_u_px: 79.5, center_v_px: 31.5, baseline_m: 0.5 };

fn manifest() -> RunManifest {
    ciborium::Value::serialized(&BTreeMap::from([("request", Request::default())]))
        .and_then(|mut value| {
            let more = [
                ("overwrites", ciborium::Value::from(false)),
                ("fingerprint", ciborium::Value::Map(Vec::new())),
            ];
            value.as_map_mut().unwrap().extend(more.map(|(key, value)| (key.into(), value)));
            value.deserialized()
        })
        .unwrap()
}

/// A folder with two checkpoints.
fn written(root: &tempfile::TempDir) -> RunFolder {
    let folder = RunFolder::begin(&root.path().join("run"), false).unwrap();
    let mut slab = HostSlab::map(Capacity::TINY.bytes()).unwrap();
    let mut mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(RIG), slab.bytes_mut()).unwrap();
    for taken in 1..=2 {
        write(&folder, &manifest(), None, &RunState { taken, ..RunState::default() }, &mut mapper)
            .unwrap();
    }
    folder
}

#[test]
fn every_flipped_byte_is_refused_by_name() {
    let root = tempfile::TempDir::new().unwrap();
    let folder = written(&root);
    std::fs::remove_file(folder.file(PREVIOUS_SNAPSHOT_FILE)).unwrap();
    let (read, damage) = Checkpoint::read(&folder).unwrap();
    assert_eq!(
        (read.manifest(), read.frames(), read.state.taken, damage.is_none()),
        (&manifest(), 0, 2, true)
    );
    let mut file = File::options().read(true).write(true).open(folder.snapshot()).unwrap();
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).unwrap();
    let part = HEAD + u64::from_le_bytes(bytes[12..HEAD].try_into().unwrap()) as usize;
    assert!(part > 100 && part < bytes.len());
    let mut put = |at: usize, byte: u8| {
        file.seek(SeekFrom::Start(at as u64)).and_then(|_| file.write_all(&[byte])).unwrap()
    };
    // All of the host's part and every 1,009th byte of the mapper's.
    for (at, &byte) in bytes
        .iter()
        .enumerate()
        .filter(|(at, _)| *at < part || at % 1_009 == 0 || at + 5 > bytes.len())
    {
        put(at, byte ^ 1 << (at % 8));
        let refused = Checkpoint::read(&folder).err();
        let named = match at {
            0..8 => matches!(refused, Some(ResumeError::Foreign { .. })),
            8..12 => matches!(refused, Some(ResumeError::Version { .. })),
            _ => matches!(refused, Some(ResumeError::Damaged { .. })),
        };
        assert!(named, "byte {at} of {part}: {refused:?}");
        put(at, byte);
    }
    assert!(Checkpoint::read(&folder).is_ok(), "and whole it is taken");
}

#[test]
fn the_checkpoint_before_a_damaged_or_missing_one_is_taken() {
    let root = tempfile::TempDir::new().unwrap();
    let folder = written(&root);
    let last = std::fs::read(folder.snapshot()).unwrap();
    std::fs::write(folder.snapshot(), &last[..last.len() / 2]).unwrap();
    let (read, damage) = Checkpoint::read(&folder).unwrap();
    assert!(
        read.state.taken == 1
            && matches!(damage, Some(ResumeError::Damaged { path }) if path == folder.snapshot())
    );
    std::fs::remove_file(folder.snapshot()).unwrap();
    assert!(folder.has_snapshot());
    let (read, damage) = Checkpoint::read(&folder).unwrap();
    assert!(read.state.taken == 1 && matches!(damage, Some(ResumeError::Read { .. })));
    std::fs::write(folder.file(PREVIOUS_SNAPSHOT_FILE), "").unwrap();
    assert!(
        matches!(Checkpoint::read(&folder), Err(ResumeError::Read { path, .. }) if path == folder.snapshot())
    );
}
