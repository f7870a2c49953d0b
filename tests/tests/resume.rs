//! A sequence with traffic that is saved at a frame and restored in another slab gives the digests
//! on file.

use dynvox::fixtures::pack;
use dynvox_clip::{CAPACITY, Clip, Frame, FrameDigests, Pair, config};
use dynvox_core::{Mapper, Report, Serial};
use dynvox_tests::HeapSlab;
use std::path::Path;

/// Every third frame, the first excepted: before and after the pruning window is full, tracks are
/// known, blocks leave and objects begin.
const STOPS: [usize; 8] = [1, 4, 7, 10, 13, 16, 19, 22];

fn step(mapper: &mut Mapper<'_>, pair: &Pair<'_>) -> Report {
    mapper.step(&pair.stereo(), &Serial).expect("a good frame")
}

/// The line of a frame as it stands on file.
fn line(report: &Report) -> String {
    FrameDigests { frame: report.frame, digest: report.digest, stages: report.digests, blocks: 0 }
        .to_string()
}

#[test]
fn the_street_stopped_at_any_frame_and_resumed_gives_the_digests_on_file() {
    let fixture = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/street-320x96"));
    let (bytes, golden) = (
        pack(fixture).expect("a whole fixture"),
        std::fs::read_to_string(fixture.join("digests.txt")).expect("digests"),
    );
    let golden: Vec<&str> = golden.lines().filter(|line| !line.starts_with('#')).collect();
    let clip = Clip::new(&bytes).expect("a clip");
    let pairs: Vec<Pair<'_>> = clip
        .frames()
        .filter_map(|frame| if let Frame::Pair(pair) = frame { Some(pair) } else { None })
        .collect();
    assert_eq!(pairs.len(), golden.len());
    let (mut snapshots, mut slab) = (Vec::new(), HeapSlab::of(&CAPACITY));
    let mut mapper = Mapper::new(&CAPACITY, &config(&clip), slab.bytes()).expect("a mapper");
    let (mut tracks, mut objects, mut waiting) = (0, 0, 0);
    for (at, pair) in pairs.iter().enumerate() {
        // Snapshots are taken on the way, with tracks and history in flight.
        if STOPS.contains(&at) {
            let mut bytes = Vec::new();
            let mut sink = |piece: &[u8]| -> Result<(), ()> {
                bytes.extend_from_slice(piece);
                Ok(())
            };
            mapper.save(&mut sink).expect("a vector takes all");
            snapshots.push((at, bytes));
            tracks = tracks.max(mapper.tracks().count());
            objects = objects.max(mapper.objects().count());
            waiting = waiting.max(mapper.static_map().history().len());
        }
        assert_eq!(line(&step(&mut mapper, pair)), golden[at]);
    }
    assert!(
        tracks >= 5 && objects >= 2 && waiting >= 8,
        "{tracks} tracks, {objects} objects, {waiting} frames of history are in flight"
    );
    for (stop, bytes) in &snapshots {
        let (mut slab, mut rest) = (HeapSlab::of(&CAPACITY), &bytes[..]);
        // Rubbish in the slab must not reach the restored mapper.
        slab.bytes().fill(0xA5);
        let mut source = |piece: &mut [u8]| -> Result<(), ()> {
            let (front, behind) = rest.split_at_checked(piece.len()).ok_or(())?;
            piece.copy_from_slice(front);
            rest = behind;
            Ok(())
        };
        let mut mapper = Mapper::restore(&CAPACITY, &config(&clip), slab.bytes(), &mut source)
            .expect("a whole snapshot");
        // All bytes of the snapshot belong to it.
        assert!(rest.is_empty());
        for (at, pair) in pairs.iter().enumerate().skip(*stop) {
            assert_eq!(
                line(&step(&mut mapper, pair)),
                golden[at],
                "frame {at} after stopping before frame {stop}"
            );
        }
    }
}
