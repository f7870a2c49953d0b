//! P2: the same frames give the same digests, however the work is spread.

use dynvox::harness::Threads;
use dynvox_core::{Capacity, Executor, Serial};
use dynvox_tests::Clip;

fn digests(clip: &Clip, executor: &impl Executor) -> Vec<(u64, u64)> {
    clip.with_mapper(&Capacity::SMALL, |mapper| {
        clip.stereo()
            .map(|frame| mapper.step(&frame, executor).map(|report| (report.input_digest, report.digest)).expect("a good frame"))
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
