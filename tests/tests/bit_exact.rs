//! P2: the same frames give the same digests, however the work is spread.

use dynvox::harness::Threads;
use dynvox_core::{Capacity, Executor, Serial};
use dynvox_tests::Clip;
use std::{fs, path::Path};

fn digests(clip: &Clip, executor: &impl Executor) -> Vec<(u64, u64)> {
    clip.with_mapper(&Capacity::SMALL, |mapper| {
        clip.stereo()
            .map(|frame| mapper.step(&frame, executor).map(|report| (report.digests.input, report.digest)).expect("a good frame"))
            .collect()
    })
}

#[test]
fn one_two_and_eight_threads_give_the_same_digests_in_every_frame() {
    let clip = Clip::street(416, 128, 15);
    let serial = digests(&clip, &Serial);
    for threads in [1, 2, 8] {
        assert_eq!(serial, digests(&clip, &Threads::new(threads).expect("a pool")), "{threads} threads");
    }
    assert!(serial.windows(2).all(|pair| pair[0].1 != pair[1].1));
}

#[test]
fn one_pixel_changes_the_digest() {
    let clip = Clip::street(416, 128, 3);
    let clean = digests(&clip, &Serial);
    let mut dirty = Clip::street(416, 128, 3);
    dirty.flip_a_bit(1, 200 + 416 * 90);
    let dirty = digests(&dirty, &Serial);
    assert_eq!(clean[0], dirty[0]);
    assert_ne!(clean[1].0, dirty[1].0);
}

#[test]
fn the_street_gives_the_digests_on_file() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/street-320x96.digests");
    let clip = Clip::street(320, 96, 8);
    let digests = clip.with_mapper(&Capacity::TINY, |mapper| {
        let steps = clip.stereo().map(|frame| mapper.step(&frame, &Serial).expect("a good frame"));
        steps.map(|report| format!("{} {:016x} {:016x}\n", report.frame, report.digests.input, report.digest)).collect::<String>()
    });
    if std::env::var_os("DYNVOX_BLESS").is_some() {
        fs::write(&path, &digests).expect("fixtures can be written");
    }
    let golden = fs::read_to_string(&path).expect("the fixture is there");
    assert_eq!(digests, golden, "bits have changed: fixtures/README.md says what to do when that is meant");
}
