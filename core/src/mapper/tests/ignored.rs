//! Pixels that the caller ignores: the car's own bonnet.

use super::resume::{restored, saved};
use super::*;

/// A mask of the lower third.
fn bonnet() -> Vec<u8> {
    (0..WIDTH * HEIGHT).map(|at| u8::from(is_bonnet(at / WIDTH))).collect()
}

fn is_bonnet(v: usize) -> bool {
    v >= 2 * HEIGHT / 3
}

/// Steps with the mask.
fn step(walk: &Walk, at: usize, mapper: &mut Mapper<'_>) -> Report {
    let mask = bonnet();
    walk.with_frame(at, |frame| {
        let ignored = View::new(&mask, WIDTH, HEIGHT);
        mapper.step(&StereoFrame { ignored, ..*frame }, &Serial).unwrap()
    })
}

#[test]
fn ignored_pixels_have_neither_match_nor_depth() {
    let walk = Walk::new(3);
    with_mapper(&walk, 0, |mapper, _| {
        for at in 0..3 {
            let report = step(&walk, at, mapper);
            let ignored = (0..HEIGHT).filter(|&v| is_bonnet(v)).count() * WIDTH;
            assert_eq!(report.ignored_pixels as usize, ignored);
            let rows = mapper.disparity_q8();
            let shown = |v: &usize| rows.row(*v).iter().any(|&disparity| disparity != 0);
            assert!((0..HEIGHT).filter(|&v| is_bonnet(v)).all(|v| !shown(&v)), "frame {at}");
            assert!((0..HEIGHT).filter(shown).count() > HEIGHT / 3);
            let matched = mapper.scene_flow.refined().iter().chain(mapper.scene_flow.sparse());
            assert!(matched.clone().all(|m| !is_bonnet(m.current_left[1] as usize)));
            assert!(at == 0 || matched.count() > 50);
        }
    });
}

#[test]
fn a_given_disparity_is_not_taken_at_ignored_pixels() {
    let (walk, given, mask) = (Walk::new(1), vec![10 << 8; WIDTH * HEIGHT], bonnet());
    with_mapper(&walk, 0, |mapper, _| {
        walk.with_frame(0, |frame| {
            let disparity_q8 = View::new(&given, WIDTH, HEIGHT);
            let ignored = View::new(&mask, WIDTH, HEIGHT);
            let frame = StereoFrame { disparity_q8, ignored, ..*frame };
            let report = mapper.step(&frame, &Serial).unwrap();
            let used = (WIDTH * HEIGHT) as u32 - report.ignored_pixels;
            assert_eq!(report.stereo.valid, used);
            // A mask of another size says nothing about these pixels.
            let ignored = View::new(&mask, WIDTH / 2, HEIGHT);
            let refused = mapper.step(&StereoFrame { ignored, ..frame }, &Serial);
            assert_eq!(refused.unwrap_err(), StepError::SizesDiffer);
        });
    });
}

#[test]
fn a_mapper_with_ignored_pixels_goes_on_from_its_snapshot() {
    let walk = Walk::new(4);
    let (bytes, next) = with_mapper(&walk, 0, |mapper, _| {
        for at in 0..3 {
            step(&walk, at, mapper);
        }
        (saved(mapper), step(&walk, 3, mapper))
    });
    let again = restored(&CAPACITY, &Walk::config(), &bytes, |mapper| step(&walk, 3, mapper));
    assert_eq!(again.unwrap().digest, next.digest);
}
