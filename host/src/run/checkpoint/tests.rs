//! The host's part of a checkpoint, with one byte changed.

use super::*;
use crate::slab::HostSlab;
use dynvox_core::geometry::StereoRig;
use dynvox_core::{Capacity, Config};
use std::collections::BTreeMap;
use std::io::{Seek, SeekFrom};

const RIG: StereoRig = StereoRig { focal_px: 90.0, center_u_px: 79.5, center_v_px: 31.5, baseline_m: 0.5 };

fn manifest() -> RunManifest {
    ciborium::Value::serialized(&BTreeMap::from([("arguments", vec!["--frames", "3"])]))
        .and_then(|mut value| {
            let more = [("working_dir", ciborium::Value::from("/")), ("fingerprint", ciborium::Value::Map(Vec::new()))];
            value.as_map_mut().unwrap().extend(more.map(|(key, value)| (key.into(), value)));
            value.deserialized()
        })
        .unwrap()
}

#[test]
fn every_flipped_byte_of_the_host_s_part_is_refused_by_name() {
    let root = tempfile::TempDir::new().unwrap();
    let folder = RunFolder::begin(&root.path().join("run"), false).unwrap();
    let mut slab = HostSlab::map(Capacity::TINY.bytes()).unwrap();
    let mut mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(RIG), slab.bytes_mut()).unwrap();
    write(&folder, &manifest(), None, &RunState::default(), &mut mapper).unwrap();
    let read = Checkpoint::read(&folder).unwrap();
    assert_eq!((read.manifest(), read.frames()), (&manifest(), 0));
    let mut file = File::options().read(true).write(true).open(folder.snapshot()).unwrap();
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).unwrap();
    let part = HEAD + 4 + u64::from_le_bytes(bytes[12..HEAD].try_into().unwrap()) as usize;
    assert!(part > 100 && part < bytes.len());
    let mut put = |at: usize, byte: u8| file.seek(SeekFrom::Start(at as u64)).and_then(|_| file.write_all(&[byte])).unwrap();
    for (at, &byte) in bytes.iter().enumerate().take(part) {
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
