//! Misuse of the C interface comes back as a status.
#![allow(missing_docs, clippy::unwrap_used, clippy::indexing_slicing)]
#![expect(
    clippy::undocumented_unsafe_blocks,
    reason = "each call keeps the header's promises, but for the one it breaks on purpose"
)]

mod support;

use dynvox_capi::*;
use std::{ffi::c_void, ptr};
use support::*;

#[test]
fn buffers_too_small_null_or_misaligned_are_refused() {
    let mut buffer = Buffer::new();
    let (config, len, mut mapper) = (config(), buffer.len, ptr::null_mut());
    // A capacity without blocks can hold no map.
    let (tiny, none) = (capacity(), DynvoxCapacity { blocks: 0, ..capacity() });
    let mut make = |capacity: *const _, config: *const _, start, len| unsafe {
        dynvox_create(capacity, config, start, len, &raw mut mapper)
    };
    let (good, config) = (&raw const tiny, &raw const config);
    // Each refusal by itself, and the good call last: none of them may have left a mapper behind.
    assert_eq!(make(good, config, buffer.at(0), len - 1), DynvoxStatus::TooSmall);
    assert_eq!(make(good, config, buffer.at(8), len), DynvoxStatus::Misaligned);
    assert_eq!(make(good, config, ptr::null_mut(), len), DynvoxStatus::Null);
    assert_eq!(make(good, ptr::null(), buffer.at(0), len), DynvoxStatus::Null);
    assert_eq!(make(ptr::null(), config, buffer.at(0), len), DynvoxStatus::Null);
    assert_eq!(make(&raw const none, config, buffer.at(0), len), DynvoxStatus::Capacity);
    assert_eq!(make(good, config, buffer.at(0), len), DynvoxStatus::Ok);
    assert_eq!(unsafe { dynvox_bytes(good, ptr::null_mut()) }, DynvoxStatus::Null);
    assert_eq!(unsafe { dynvox_capacity_of_profile(9, ptr::null_mut()) }, DynvoxStatus::Unknown);
}

#[test]
fn a_calibration_that_is_not_a_number_is_refused_with_its_name() {
    let mut buffer = Buffer::new();
    for value in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
        // Values that an uninitialised struct may well have.
        let mut config = config();
        config.rig.focal_px = value;
        assert_eq!(create(&mut buffer, &config), Err(DynvoxStatus::Config));
        let mut text = [1i8; 16];
        assert_eq!(
            unsafe { dynvox_config_problem(&raw const config, text.as_mut_ptr().cast(), 16) },
            DynvoxStatus::Ok
        );
        // Fifteen characters and the zero fit.
        let text: String =
            text.iter().take_while(|&&byte| byte != 0).map(|&byte| byte as u8 as char).collect();
        assert_eq!(text, "rig.focal_px mu", "cut off to fit");
    }
}

#[test]
fn frames_that_are_not_what_they_should_be_are_refused_and_change_nothing() {
    let mut buffer = Buffer::new();
    let mapper = create(&mut buffer, &config()).unwrap();
    let pixels = pixels();
    // A frame that would be taken; each case below changes one field.
    let good = frame(&pixels);
    assert_eq!(
        unsafe { dynvox_step(mapper, ptr::null(), ptr::null(), ptr::null_mut()) },
        DynvoxStatus::Null
    );
    let image = |pixels, stride| DynvoxImage { pixels, stride };
    assert_eq!(
        step(mapper, &DynvoxFrame { left: image(ptr::null(), WIDTH), ..good }),
        DynvoxStatus::Null
    );
    // A stride below the width, and one whose product with the height overflows.
    assert_eq!(
        step(mapper, &DynvoxFrame { left: image(pixels.as_ptr(), WIDTH - 1), ..good }),
        DynvoxStatus::Size
    );
    assert_eq!(
        step(mapper, &DynvoxFrame { left: image(pixels.as_ptr(), usize::MAX), ..good }),
        DynvoxStatus::Size
    );
    assert_eq!(step(mapper, &DynvoxFrame { width: 16, ..good }), DynvoxStatus::Size);
    assert_eq!(step(mapper, &DynvoxFrame { height: 0, ..good }), DynvoxStatus::Size);
    // In the mapper's own buffer, which a step writes to.
    let inside = buffer.at(4_096);
    assert_eq!(
        step(mapper, &DynvoxFrame { right: image(inside, WIDTH), ..good }),
        DynvoxStatus::Overlap
    );
    let pose = DynvoxPose { rotation: [1.0, 0.0, 0.0, 0.0], translation_m: [0.0, f64::NAN, 0.0] };
    assert_eq!(
        step(mapper, &DynvoxFrame { t_world_camera: &raw const pose, ..good }),
        DynvoxStatus::Pose
    );
    let pose = DynvoxPose { rotation: [2.0, 0.0, 0.0, 0.0], ..pose };
    assert_eq!(
        step(mapper, &DynvoxFrame { t_world_camera: &raw const pose, ..good }),
        DynvoxStatus::Pose
    );
    // A class code that is none, with a mask; then a class without a mask, and too many.
    let seen = DynvoxDetection {
        class_code: 99,
        score: 1.0,
        left: 0,
        top: 0,
        width: 4,
        height: 4,
        mask: pixels.as_ptr(),
    };
    let detected = |seen: &[DynvoxDetection]| DynvoxFrame {
        detections: seen.as_ptr(),
        detection_count: seen.len(),
        ..good
    };
    assert_eq!(step(mapper, &detected(&[seen])), DynvoxStatus::Unknown);
    assert_eq!(
        step(mapper, &detected(&[DynvoxDetection { class_code: 1, mask: ptr::null(), ..seen }])),
        DynvoxStatus::Null
    );
    assert_eq!(
        step(mapper, &detected(&[DynvoxDetection { class_code: 1, ..seen }; 65])),
        DynvoxStatus::TooMany
    );
    // The good frame is the mapper's first.
    let mut report: DynvoxReport = unsafe { std::mem::zeroed() };
    assert_eq!(
        unsafe { dynvox_step(mapper, &raw const good, ptr::null(), &raw mut report) },
        DynvoxStatus::Ok
    );
    assert_eq!(report.frame, 0, "none of the above was taken");
    // A bad score refuses the detection, not the frame.
    assert_eq!(
        step(mapper, &detected(&[DynvoxDetection { class_code: 1, score: f32::NAN, ..seen }])),
        DynvoxStatus::Ok
    );
    // The size is that of the first frame that was taken.
    let other = DynvoxFrame { height: HEIGHT - 1, ..good };
    assert_eq!(step(mapper, &other), DynvoxStatus::SizeChanged);
}

#[test]
fn handles_of_nothing_are_told_from_mappers() {
    let mut buffer = Buffer::new();
    let mapper = create(&mut buffer, &config()).unwrap();
    let mut pose = DynvoxPose::default();
    let mut picture: DynvoxPicture = unsafe { std::mem::zeroed() };
    // Before the first step there is a pose, but nothing to show.
    assert_eq!(unsafe { dynvox_pose(mapper, &raw mut pose) }, DynvoxStatus::Ok);
    assert_eq!(
        unsafe { dynvox_raycast(mapper, &raw const pose, &raw mut picture) },
        DynvoxStatus::NoFrame
    );
    assert_eq!(step(mapper, &frame(&pixels())), DynvoxStatus::Ok);
    // The picture's capacity is 0 pixels.
    assert_eq!(
        unsafe { dynvox_raycast(mapper, &raw const pose, &raw mut picture) },
        DynvoxStatus::TooSmall
    );
    assert_eq!(
        unsafe { dynvox_triangles(mapper, None, ptr::null_mut(), ptr::null_mut()) },
        DynvoxStatus::Null
    );
    assert_eq!(
        unsafe { dynvox_stream_out(mapper, ptr::null(), ptr::null_mut(), ptr::null_mut()) },
        DynvoxStatus::Null
    );
    // Null, destroyed, and destroyed twice.
    assert_eq!(unsafe { dynvox_pose(ptr::null_mut(), &raw mut pose) }, DynvoxStatus::Null);
    assert_eq!(unsafe { dynvox_destroy(mapper) }, DynvoxStatus::Ok);
    assert_eq!(unsafe { dynvox_destroy(mapper) }, DynvoxStatus::NoMapper);
    assert_eq!(step(mapper, &frame(&pixels())), DynvoxStatus::NoMapper);
}

extern "C" fn call_back(context: *mut c_void, _: *const DynvoxTriangle) {
    let calls = context.cast::<(*mut DynvoxMapper, u32)>();
    let mut pose = DynvoxPose::default();
    // SAFETY: the context is the test's pair, the handle its mapper's.
    unsafe {
        (*calls).1 += 1;
        assert_eq!(dynvox_pose((*calls).0, &raw mut pose), DynvoxStatus::Busy);
        assert_eq!(dynvox_destroy((*calls).0), DynvoxStatus::Busy);
    }
}

#[test]
fn a_callback_cannot_call_its_own_mapper() {
    let mut buffer = Buffer::new();
    let mapper = create(&mut buffer, &config()).unwrap();
    // Shifted by 8 px: a wall, so that there are triangles to hand out.
    let (left, mut right) = (pixels(), pixels());
    right.rotate_left(8);
    let mut frame = frame(&left);
    frame.right.pixels = right.as_ptr();
    assert_eq!(step(mapper, &frame), DynvoxStatus::Ok);
    assert_eq!(step(mapper, &frame), DynvoxStatus::Ok);
    // The callback counts its calls, and asserts that its own are refused.
    let (mut context, mut count) = ((mapper, 0u32), 0);
    let status = unsafe {
        dynvox_triangles(mapper, Some(call_back), (&raw mut context).cast(), &raw mut count)
    };
    assert_eq!((status, u64::from(context.1)), (DynvoxStatus::Ok, count));
    assert!(count > 0, "the callback was called");
}

#[test]
fn every_setting_has_a_key_and_a_wrong_one_changes_nothing() {
    let mut config = config();
    // A key in a nested section, and a choice by name.
    assert_eq!(set(&mut config, c"tracking.motion.samples", c"77"), DynvoxStatus::Ok);
    assert_eq!(set(&mut config, c"mapper.egomotion", c"icp"), DynvoxStatus::Ok);
    let before = config.settings_len;
    assert_eq!(set(&mut config, c"volume.voxels", c"1"), DynvoxStatus::Unknown);
    assert_eq!(set(&mut config, c"volume.far_m", c"wide"), DynvoxStatus::Value);
    assert_eq!(set(&mut config, c"volume.far_m", c"1\n"), DynvoxStatus::Value);
    assert_eq!(
        unsafe { dynvox_config_set(&raw mut config, ptr::null(), c"1".as_ptr()) },
        DynvoxStatus::Null
    );
    assert_eq!(config.settings_len, before);
    // Until the buffer of settings is full.
    while set(&mut config, c"volume.far_m", c"20") == DynvoxStatus::Ok {}
    assert_eq!(
        set(&mut config, c"volume.far_m", c"20"),
        DynvoxStatus::TooSmall,
        "no space is left"
    );
    // A length that cannot be: as from memory that was not initialised.
    config.settings_len = usize::MAX;
    assert_eq!(set(&mut config, c"volume.far_m", c"20"), DynvoxStatus::Config);
    assert_eq!(create(&mut Buffer::new(), &config), Err(DynvoxStatus::Config));
}

#[test]
fn a_budget_is_a_bound_on_the_buffer_and_a_refusal_names_the_least() {
    let (mut capacity, mut least, mut bytes) = (capacity(), 0, 0);
    let for_752 =
        |bytes| DynvoxBudget { bytes, width: 752, height: 480, ..unsafe { std::mem::zeroed() } };
    let solve_for = |budget: &DynvoxBudget, capacity: &mut _, least: &mut _| unsafe {
        dynvox_capacity_for_budget(budget, capacity, least)
    };
    let solve =
        |bytes, capacity: &mut _, least: &mut _| solve_for(&for_752(bytes), capacity, least);
    assert_eq!(solve(48 << 20, &mut capacity, &mut least), DynvoxStatus::Ok);
    assert_eq!(unsafe { dynvox_bytes(&raw const capacity, &raw mut bytes) }, DynvoxStatus::Ok);
    assert!(bytes <= 48 << 20 && bytes > 46 << 20, "{bytes}");
    // What is named as the least works, and one byte less does not.
    assert_eq!(solve(1 << 20, &mut capacity, &mut least), DynvoxStatus::TooSmall);
    assert_eq!(
        solve(least, &mut capacity, &mut bytes),
        DynvoxStatus::Ok,
        "{least} bytes are enough"
    );
    assert_eq!(solve(least - 1, &mut capacity, &mut bytes), DynvoxStatus::TooSmall);
    // -1 asks for no objects, 0 leaves the choice.
    let raw = DynvoxBudget {
        raw_width: 800,
        raw_height: 500,
        objects: -1,
        colour: 1,
        ..for_752(48 << 20)
    };
    assert_eq!(solve_for(&raw, &mut capacity, &mut least), DynvoxStatus::Ok);
    assert_eq!(
        (capacity.raw_width, capacity.raw_height, capacity.objects, capacity.colour),
        (800, 500, 0, 1)
    );
    assert_eq!(unsafe { dynvox_bytes(&raw const capacity, &raw mut bytes) }, DynvoxStatus::Ok);
    assert!(bytes <= 48 << 20 && bytes > 46 << 20, "{bytes}");
    assert_eq!(
        solve_for(&DynvoxBudget { objects: 1_000, ..raw }, &mut capacity, &mut least),
        DynvoxStatus::Capacity
    );
    assert_eq!(
        unsafe { dynvox_capacity_for_budget(ptr::null(), &raw mut capacity, ptr::null_mut()) },
        DynvoxStatus::Null
    );
}

#[test]
fn a_restored_mapper_continues_and_a_damaged_snapshot_makes_none() {
    let (mut buffer, mut other) = (Buffer::new(), Buffer::new());
    let (pixels, config, capacity) = (pixels(), config(), capacity());
    let mapper = create(&mut buffer, &config).unwrap();
    let (mut frame, times_ns) = (frame(&pixels), [5u64, 6]);
    // Times must increase: the second frame at 5 ns is refused.
    frame.time_ns = &raw const times_ns[0];
    assert_eq!(step(mapper, &frame), DynvoxStatus::Ok);
    assert_eq!(step(mapper, &frame), DynvoxStatus::Time);
    frame.time_ns = &raw const times_ns[1];
    let mut bytes = Vec::new();
    assert_eq!(
        unsafe { dynvox_save(mapper, Some(write), (&raw mut bytes).cast()) },
        DynvoxStatus::Ok
    );
    let mut restore = |bytes: &[u8]| {
        let (len, mut rest, mut restored) = (other.len, bytes, ptr::null_mut());
        let context = (&raw mut rest).cast();
        let status = unsafe {
            dynvox_restore(
                &raw const capacity,
                &raw const config,
                other.at(0),
                len,
                Some(read),
                context,
                &raw mut restored,
            )
        };
        (status, restored)
    };
    // The reader ends early; then one bit in the middle differs.
    assert_eq!(restore(&bytes[..bytes.len() - 1]).0, DynvoxStatus::Callback);
    let mut damaged = bytes.clone();
    damaged[bytes.len() / 2] ^= 1;
    assert_eq!(restore(&damaged).0, DynvoxStatus::Snapshot);
    let (status, restored) = restore(&bytes);
    assert_eq!(status, DynvoxStatus::Ok);
    // Both take the same next frame.
    let mut reports: [DynvoxReport; 2] = unsafe { std::mem::zeroed() };
    for (mapper, report) in [mapper, restored].into_iter().zip(&mut reports) {
        assert_eq!(
            unsafe { dynvox_step(mapper, &raw const frame, ptr::null(), report) },
            DynvoxStatus::Ok
        );
    }
    assert_eq!((reports[0].frame, reports[0].digest), (1, reports[1].digest));
    // 9 is no number of tracks: the call must write it.
    let (mut tracks, mut count): ([DynvoxTrack; 2], usize) = (unsafe { std::mem::zeroed() }, 9);
    assert_eq!(
        unsafe { dynvox_tracks(restored, tracks.as_mut_ptr(), 2, &raw mut count) },
        DynvoxStatus::Ok
    );
    assert_eq!(count, 0);
    assert_eq!(
        unsafe {
            dynvox_object_triangles(restored, 1, Some(call_back), ptr::null_mut(), ptr::null_mut())
        },
        DynvoxStatus::Unknown
    );
}
