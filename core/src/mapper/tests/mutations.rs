//! One bit of the state changes: the digest changes, and the first difference names the stage that
//! the bit belongs to.

use super::*;
use crate::mapper::Digested;

/// Frames after which the car has a volume.
const FRAMES: usize = 7;

/// Applies `change` after the last frame and returns the stage that the digests name.
fn named(change: impl Fn(&mut Mapper<'_>)) -> Option<Digested> {
    let walk = Walk::new(FRAMES);
    with_mapper(&walk, FRAMES, |mapper, reports| named_by(&walk, mapper, reports, change))
}

fn named_by(
    walk: &Walk,
    mapper: &mut Mapper<'_>,
    reports: &[Report],
    change: impl Fn(&mut Mapper<'_>),
) -> Option<Digested> {
    let last = reports.last().unwrap();
    let digests = |mapper: &mut Mapper<'_>| {
        walk.with_frame(FRAMES - 1, |frame| StageDigests {
            input: frame.digest(),
            ..mapper.digests(last.egomotion.as_ref())
        })
    };
    // Digests are computed from the state, so that a change in it shows without a step.
    assert_eq!(digests(mapper), last.digests, "nothing changes by itself");
    change(mapper);
    let after = digests(mapper);
    let named = last.digests.first_difference(&after);
    // The whole digest differs where a stage does, but for the input.
    if named != Some(Digested::Input) {
        assert_eq!(named.is_some(), last.digests.whole(last.frame) != after.whole(last.frame));
    }
    named
}

#[test]
fn a_bit_of_a_voxel_of_the_background() {
    let walk = Walk::new(FRAMES);
    with_mapper(&walk, FRAMES, |mapper, reports| {
        let slot = mapper.static_map.volume.visible().slots()[0];
        // 16 bits of the distance and 8 of the weight; the first voxel, the last, and one between.
        for bit in 0..24 {
            for voxel in [0, 77, 511] {
                let flip =
                    |mapper: &mut Mapper<'_>| mapper.static_map.volume.flip(slot, voxel, bit);
                assert_eq!(
                    named_by(&walk, mapper, reports, flip),
                    Some(Digested::StaticMap),
                    "voxel {voxel}, bit {bit}"
                );
                // The same flip undoes itself.
                flip(mapper);
            }
        }
    });
}

#[test]
fn a_bit_of_a_voxel_of_an_object() {
    assert_eq!(
        named(|mapper| assert_eq!(mapper.objects.flip_voxel(100, 3), Some(1))),
        Some(Digested::Object(1))
    );
}

#[test]
fn a_bit_of_a_match() {
    let walk = Walk::new(FRAMES);
    with_mapper(&walk, FRAMES, |mapper, reports| {
        let last = mapper.scene_flow.refined().len() - 1;
        for (at, coordinate, bit) in
            (0..8).flat_map(|coordinate| [(0, coordinate, 0), (last, coordinate, 12)])
        {
            let flip = |mapper: &mut Mapper<'_>| mapper.scene_flow.flip(at, coordinate, bit);
            assert_eq!(
                named_by(&walk, mapper, reports, flip),
                Some(Digested::SceneFlow),
                "match {at}, coordinate {coordinate}"
            );
            flip(mapper);
        }
    });
}

#[test]
fn a_bit_of_a_component_of_the_pose() {
    for component in 0..7 {
        assert_eq!(
            named(|mapper| mapper.localization.camera.flip(component, 0)),
            Some(Digested::Egomotion),
            "component {component}"
        );
    }
}

#[test]
fn a_bit_of_a_disparity_and_of_a_track() {
    assert_eq!(named(|mapper| mapper.stereo.flip(WIDTH * 80 + 133, 0)), Some(Digested::Stereo));
    assert_eq!(named(|mapper| mapper.tracker.flip_track(0)), Some(Digested::Tracking));
}

#[test]
fn a_bit_of_a_pixel_is_seen_as_input_and_a_detection_as_well() {
    let walk = Walk::new(2);
    let clean = with_mapper(&walk, 2, |_, reports| reports[1]);
    for camera in 0..2 {
        let mut dirty = Walk::new(2);
        dirty.pairs[1][camera][WIDTH * 90 + 200] ^= 1;
        let report = with_mapper(&dirty, 2, |_, reports| reports[1]);
        assert_eq!(clean.digests.first_difference(&report.digests), Some(Digested::Input));
    }
    let mut dirty = Walk::new(2);
    dirty.mask[100] = 0;
    let report = with_mapper(&dirty, 2, |_, reports| reports[1]);
    assert_eq!(clean.digests.first_difference(&report.digests), Some(Digested::Input));
}

#[test]
fn what_changes_in_memory_between_two_frames_is_named_in_the_next_one() {
    let walk = Walk::new(FRAMES + 1);
    let next = |change: &dyn Fn(&mut Mapper<'_>)| {
        with_mapper(&walk, FRAMES, |mapper, _| {
            change(mapper);
            walk.step(FRAMES, mapper).digests
        })
    };
    let clean = next(&|_| {});
    let named = |change: &dyn Fn(&mut Mapper<'_>)| clean.first_difference(&next(change));
    assert_eq!(named(&|_| {}), None);
    assert_eq!(named(&|mapper| mapper.localization.camera.flip(6, 30)), Some(Digested::Egomotion));
    let raw = |mapper: &mut Mapper<'_>| {
        // One that the next frame fuses as well.
        let visible = mapper.static_map.volume.visible().slots();
        let slot = visible[visible.len() / 2];
        mapper.static_map.volume.flip_behind_its_back(slot, 200, 23);
    };
    assert_eq!(named(&raw), Some(Digested::StaticMap));
    assert_eq!(named(&|mapper| mapper.tracker.flip_track(0)), Some(Digested::Tracking));
}
