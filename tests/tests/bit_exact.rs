//! P2: the same frames give the same digests, however the work is spread.

use dynvox::fixtures::{self, FixtureError, Verdict};
use dynvox::harness::Threads;
use dynvox_core::{Capacity, Executor, Serial};
use dynvox_tests::Clip;
use std::path::Path;

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
fn the_fixtures_give_the_digests_on_file_on_one_two_and_eight_threads() {
    for fixture in fixtures::all(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures"))).expect("there are fixtures") {
        let verify = |executor: &dyn Fn() -> Result<Verdict, FixtureError>| {
            let verdict = executor().expect("the fixture is whole");
            assert_eq!(verdict.difference, None, "bits have changed: fixtures/README.md says what to do when that is meant");
        };
        verify(&|| fixtures::verify(&fixture, &Serial));
        for threads in [1, 2, 8] {
            verify(&|| fixtures::verify(&fixture, &Threads::new(threads).expect("a pool")));
        }
    }
}
