//! Each promise of the header has a test by name: a sentence that says what is always or never so
//! stands in a table beside the test that holds it, and one without a row fails.
#![allow(missing_docs, clippy::unwrap_used, clippy::indexing_slicing)]
#![expect(
    clippy::undocumented_unsafe_blocks,
    reason = "each call keeps the header's promises, but for the one it breaks on purpose"
)]

mod support;

use dynvox_capi::*;
use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    ffi::c_void,
    fs,
    path::Path,
    ptr,
};
use support::*;

/// Words that make a sentence a promise.
const WORDS: [&str; 8] =
    ["return", "never", "at most", "must", "nothing", "less than", "no mapper", "may be null"];

/// A promise of the caller's, which the library cannot check.
const CALLER: &str = "";

/// Beginnings of the header's promises, and the test that holds each.
const PROMISES: &[(&str, &str)] = &[
    ("Ownership: the buffer is the mapper's from", CALLER),
    ("Nothing is ever allocated", "no_call_allocates_and_a_mapper_moves_between_threads"),
    ("Callbacks run on the calling thread", "a_callback_cannot_call_its_own_mapper"),
    ("Errors: every function returns", "every_status_has_a_sentence_of_its_own"),
    (
        "A call that does not return",
        "what_is_refused_before_a_byte_is_written_leaves_the_mapper_alone",
    ),
    ("A pointer that must not be null is.", "handles_of_nothing_are_told_from_mappers"),
    ("The handle is not that of a mapper", "a_copy_of_a_buffer_is_no_mapper"),
    ("Cell that was never observed", "a_ray_into_the_unseen_ends_at_an_unknown_cell"),
    ("Columns of its images, px, at most", "bounds_beyond_their_limits_are_refused"),
    ("Rows of its images, px, at most", "bounds_beyond_their_limits_are_refused"),
    ("Widest raw image that is rectified, px, at most", "bounds_beyond_their_limits_are_refused"),
    ("Detections in one frame, at most 64", "bounds_beyond_their_limits_are_refused"),
    ("Keyframes by which places are recognised, at most", "bounds_beyond_their_limits_are_refused"),
    ("Width of the planner's window, cells, at most", "bounds_beyond_their_limits_are_refused"),
    ("In a zeroed struct `t_camera_unit`", "a_unit_that_cannot_be_used_is_refused"),
    (
        "Samples of the configuration's inertial unit",
        "samples_of_a_frame_are_read_up_to_their_bound_and_tell_which_way_is_up",
    ),
    ("Nothing to say.", "a_frame_without_events_has_the_severity_info"),
    ("The upper left pixel; `stride` times", CALLER),
    ("Called on the thread of the step", "a_store_cannot_call_its_own_mapper"),
    (
        "A rendered view of the map: buffers of the caller, any may",
        "outputs_that_may_be_null_are_left_out",
    ),
    (
        "Id of the track, from 1, never used again",
        "tracks_are_written_up_to_the_capacity_and_counted",
    ),
    (
        "The planner's window from above: buffers of the caller",
        "outputs_that_may_be_null_are_left_out",
    ),
    (
        "1 if cells that were never observed end the path",
        "a_ray_into_the_unseen_ends_at_an_unknown_cell",
    ),
    ("Must not call the same mapper", "a_store_cannot_call_its_own_mapper"),
    (
        "Divides a buffer between the stages",
        "a_budget_is_a_bound_on_the_buffer_and_a_refusal_names_the_least",
    ),
    ("Of too few bytes", "a_budget_is_a_bound_on_the_buffer_and_a_refusal_names_the_least"),
    ("The buffer is the mapper's until dynvox_destroy", CALLER),
    ("Takes less than 40 KiB of stack", "every_call_takes_less_than_40_kib_of_stack"),
    ("What was refused is counted in `report`", "outputs_that_may_be_null_are_left_out"),
    ("Steps like dynvox_step", "outputs_that_may_be_null_are_left_out"),
    ("Hands every triangle of the static map", "a_callback_cannot_call_its_own_mapper"),
    ("Writes the number of stored blocks", "a_store_cannot_call_its_own_mapper"),
    ("Finishes like dynvox_finish", "outputs_that_may_be_null_are_left_out"),
    (
        "Writes the tracks of the last frame, at most",
        "tracks_are_written_up_to_the_capacity_and_counted",
    ),
    (
        "Hands every triangle of a reconstructed object",
        "a_restored_mapper_continues_and_a_damaged_snapshot_makes_none",
    ),
    ("A disparity image: buffers of the caller", "a_disparity_is_handed_out_with_its_confidence"),
    ("Reports, planning maps and objects are in", "a_position_moves_the_closed_world_alone"),
    ("Writes the moving objects of the last", "outputs_that_may_be_null_are_left_out"),
    ("Follows a ray of the world", "a_ray_into_the_unseen_ends_at_an_unknown_cell"),
    ("Hands every triangle of an object that leaves", "outputs_that_may_be_null_are_left_out"),
    (
        "Creates a mapper like dynvox_create, in the state",
        "a_restore_that_fails_ends_the_mapper_that_lived_there",
    ),
    ("From a damaged or foreign snapshot", "a_restore_that_fails_ends_the_mapper_that_lived_there"),
];

/// Sentences of the header's comments, without its program and the safety sections, which are the
/// caller's promises.
fn sentences(header: &str) -> Vec<String> {
    let mut paragraphs = vec![String::new()];
    for line in header.lines() {
        match line.trim_start().strip_prefix("//") {
            Some(text) if !text.starts_with("  ") && !text.trim().is_empty() => {
                let paragraph = paragraphs.last_mut().unwrap();
                paragraph.push_str(text.trim());
                paragraph.push(' ');
            }
            _ => paragraphs.push(String::new()),
        }
    }
    paragraphs.retain(|paragraph| !paragraph.starts_with("# Safety"));
    let mut found = Vec::new();
    for paragraph in paragraphs {
        let mut rest = paragraph.trim();
        while let Some(end) = rest.find(". ").map(|at| at + 1) {
            found.push(rest[..end].to_owned());
            rest = rest[end..].trim_start();
        }
        found.push(rest.to_owned());
    }
    found
}

/// Names of the tests in the folder of this one.
fn tests() -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let sources = files.filter(|path| path.extension().is_some_and(|end| end == "rs"));
    sources.map(|path| fs::read_to_string(path).unwrap()).collect()
}

#[test]
fn every_promise_of_the_header_has_a_test_by_name() {
    let header = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/dynvox.h");
    let sentences = sentences(&fs::read_to_string(header).unwrap());
    let promises: Vec<&String> = sentences
        .iter()
        .filter(|sentence| WORDS.iter().any(|word| sentence.to_lowercase().contains(word)))
        .collect();
    assert!(promises.len() > 30, "the header is read");
    for promise in promises {
        let held = PROMISES.iter().any(|(beginning, _)| promise.starts_with(beginning));
        assert!(held, "no test is named for: {promise}");
    }
    let tests = tests();
    for (beginning, test) in PROMISES {
        let stands = sentences.iter().any(|sentence| sentence.starts_with(beginning));
        assert!(stands, "no sentence begins: {beginning}");
        let exists = *test == CALLER || tests.contains(&format!("#[test]\nfn {test}()"));
        assert!(exists, "no test {test} for: {beginning}");
    }
}

/// Counts what a thread allocates.
struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) };
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

extern "C" fn discard(_: *mut c_void, _: *const u8, _: usize) -> bool {
    true
}

extern "C" fn ignore(_: *mut c_void, _: *const DynvoxTriangle) {}

#[test]
fn no_call_allocates_and_a_mapper_moves_between_threads() {
    let mut buffers = [Buffer::new(), Buffer::new()];
    let (config, capacity, pixels) = (config(), capacity(), pixels());
    // A raw pointer may not move by itself; its address may.
    let starts = buffers.each_mut().map(|buffer| buffer.at(0).addr());
    let (len, frame) = (buffers[0].len, frame(&pixels));
    let made = starts.map(|start| {
        let (buffer, mut mapper) = (ptr::with_exposed_provenance_mut(start), ptr::null_mut());
        let before = ALLOCATIONS.get();
        let status = unsafe {
            dynvox_create(&raw const capacity, &raw const config, buffer, len, &raw mut mapper)
        };
        assert_eq!((status, ALLOCATIONS.get() - before), (DynvoxStatus::Ok, 0));
        mapper
    });
    let take = |mapper: *mut DynvoxMapper, frame: &DynvoxFrame| {
        let mut report: DynvoxReport = unsafe { std::mem::zeroed() };
        let before = ALLOCATIONS.get();
        let statuses = unsafe {
            [
                dynvox_step(mapper, frame, ptr::null(), &raw mut report),
                dynvox_triangles(mapper, Some(ignore), ptr::null_mut(), ptr::null_mut()),
                dynvox_save(mapper, Some(discard), ptr::null_mut()),
            ]
        };
        assert_eq!((statuses, ALLOCATIONS.get() - before), ([DynvoxStatus::Ok; 3], 0));
        report.digest
    };
    for _ in 0..3 {
        let here = take(made[0], &frame);
        let (address, pixels) = (made[1].expose_provenance(), pixels.clone());
        let there = std::thread::spawn(move || {
            take(ptr::with_exposed_provenance_mut(address), &support::frame(&pixels))
        });
        assert_eq!(here, there.join().unwrap(), "another thread for each step");
    }
    for mapper in made {
        assert_eq!(unsafe { dynvox_destroy(mapper) }, DynvoxStatus::Ok);
    }
}

#[test]
fn every_status_has_a_sentence_of_its_own() {
    let text =
        |status| unsafe { std::ffi::CStr::from_ptr(dynvox_status_text(status)) }.to_str().unwrap();
    let texts: Vec<&str> = (0..=DynvoxStatus::Fix as u32).map(text).collect();
    for (at, sentence) in texts.iter().enumerate() {
        assert!(!texts[..at].contains(sentence) && *sentence != "no such status", "{sentence}");
    }
    assert_eq!([text(DynvoxStatus::Fix as u32 + 1), text(u32::MAX)], ["no such status"; 2]);
}

#[test]
fn bounds_beyond_their_limits_are_refused() {
    let change: [fn(&mut DynvoxCapacity); 6] = [
        |of| of.raw_width = 4_097,
        |of| of.raw_height = 4_097,
        |of| of.detections = 65,
        |of| of.keyframes = 65_537,
        |of| of.planning_width = 1_025,
        |of| of.blocks = 0,
    ];
    for (at, change) in change.iter().enumerate() {
        let (mut bounds, mut bytes) = (capacity(), 0);
        change(&mut bounds);
        let status = unsafe { dynvox_bytes(&raw const bounds, &raw mut bytes) };
        assert_eq!((status, bytes), (DynvoxStatus::Capacity, 0), "bound {at}");
    }
}

/// A mapper that has taken two frames with disparity.
fn stepped(buffer: &mut Buffer) -> (*mut DynvoxMapper, Vec<u8>, Vec<u8>) {
    let mapper = create(buffer, &config()).unwrap();
    let (left, mut right) = (pixels(), pixels());
    right.rotate_left(8);
    let mut given = frame(&left);
    given.right.pixels = right.as_ptr();
    assert_eq!([step(mapper, &given), step(mapper, &given)], [DynvoxStatus::Ok; 2]);
    (mapper, left, right)
}

#[test]
fn outputs_that_may_be_null_are_left_out() {
    let mut buffer = Buffer::new();
    let (mapper, left, _) = stepped(&mut buffer);
    let mut picture: DynvoxPicture = unsafe { std::mem::zeroed() };
    let mut window: DynvoxWindow = unsafe { std::mem::zeroed() };
    let mut pose = DynvoxPose::default();
    let (frame, mut boxes) = (frame(&left), 7);
    picture.capacity = WIDTH * HEIGHT;
    let statuses = unsafe {
        let store = DynvoxStore { context: ptr::null_mut(), store: None, load: None };
        [
            dynvox_step_with(mapper, &raw const frame, ptr::null(), ptr::null(), ptr::null_mut()),
            dynvox_pose(mapper, &raw mut pose),
            dynvox_raycast(mapper, &raw const pose, &raw mut picture),
            dynvox_update_planning_maps(mapper, 0.0, &raw mut window),
            dynvox_moving_boxes(mapper, ptr::null_mut(), 0, &raw mut boxes),
            dynvox_finish_with(mapper, ptr::null()),
            dynvox_stream_out(mapper, &raw const store, ptr::null_mut(), ptr::null_mut()),
        ]
    };
    assert_eq!(statuses, [DynvoxStatus::Ok; 7]);
    assert_eq!((picture.width, picture.height, window.size, boxes), (WIDTH, HEIGHT, [0; 3], 0));
    let mut report: DynvoxReport = unsafe { std::mem::zeroed() };
    let given = unsafe { dynvox_step(mapper, &raw const frame, ptr::null(), &raw mut report) };
    assert_eq!((given, report.frame), (DynvoxStatus::Ok, 3), "all of them were taken");
}

#[test]
fn tracks_are_written_up_to_the_capacity_and_counted() {
    let mut buffer = Buffer::new();
    let mapper = create(&mut buffer, &config()).unwrap();
    let (left, mut right) = (pixels(), pixels());
    right.rotate_left(8);
    let mask = vec![1u8; 40 * 24];
    let seen = DynvoxDetection {
        class_code: 1,
        score: 0.9,
        left: 60,
        top: 20,
        width: 40,
        height: 24,
        mask: mask.as_ptr(),
    };
    let mut given = frame(&left);
    given.right.pixels = right.as_ptr();
    (given.detections, given.detection_count) = (&raw const seen, 1);
    assert_eq!([step(mapper, &given), step(mapper, &given)], [DynvoxStatus::Ok; 2]);
    let mut tracks: [DynvoxTrack; 2] = unsafe { std::mem::zeroed() };
    let mut write = |capacity| {
        let mut count = 9;
        let status =
            unsafe { dynvox_tracks(mapper, tracks.as_mut_ptr(), capacity, &raw mut count) };
        (status, count, tracks[0].id)
    };
    assert_eq!(write(0), (DynvoxStatus::Ok, 1, 0), "counted, and not written");
    assert_eq!(write(2), (DynvoxStatus::Ok, 1, 1), "numbers begin at 1");
}

/// Context of [`store_and_call`]: the mapper, and the calls.
type Calls = (*mut DynvoxMapper, u32);

extern "C" fn store_and_call(context: *mut c_void, _: *const DynvoxBlock) -> bool {
    let calls = unsafe { &mut *context.cast::<Calls>() };
    let mut pose = DynvoxPose::default();
    calls.1 += 1;
    assert_eq!(unsafe { dynvox_pose(calls.0, &raw mut pose) }, DynvoxStatus::Busy);
    assert_eq!(unsafe { dynvox_destroy(calls.0) }, DynvoxStatus::Busy);
    calls.1.is_multiple_of(2)
}

#[test]
fn a_store_cannot_call_its_own_mapper() {
    let mut buffer = Buffer::new();
    let (mapper, ..) = stepped(&mut buffer);
    let mut calls: Calls = (mapper, 0);
    let context = (&raw mut calls).cast();
    let store = DynvoxStore { context, store: Some(store_and_call), load: None };
    let (mut stored, mut lost) = (0, 0);
    let status =
        unsafe { dynvox_stream_out(mapper, &raw const store, &raw mut stored, &raw mut lost) };
    assert_eq!(status, DynvoxStatus::Ok);
    assert!(calls.1 > 1, "blocks left");
    assert_eq!((stored, lost), (calls.1 / 2, calls.1.div_ceil(2)), "half of them refused");
}

#[test]
fn a_ray_into_the_unseen_ends_at_an_unknown_cell() {
    let mut bounds = capacity();
    (bounds.planning_width, bounds.planning_length, bounds.planning_height) = (32, 32, 8);
    let mut buffer = Buffer::holding(&bounds);
    let (config, len, mut mapper) = (config(), buffer.len, ptr::null_mut());
    let start = buffer.at(0);
    let made =
        unsafe { dynvox_create(&raw const bounds, &raw const config, start, len, &raw mut mapper) };
    assert_eq!((made, step(mapper, &frame(&pixels()))), (DynvoxStatus::Ok, DynvoxStatus::Ok));
    let mut path: DynvoxFreePath = unsafe { std::mem::zeroed() };
    // Straight up, where no camera has looked.
    let (origin_m, direction) = ([0.0f64; 3], [0.0f64, -1.0, 0.0]);
    let status =
        unsafe { dynvox_ray(mapper, origin_m.as_ptr(), direction.as_ptr(), 3.0, &raw mut path) };
    assert_eq!((status, path.end), (DynvoxStatus::Ok, DynvoxPathEnd::Unknown));
    assert!(path.free_m <= 3.0);
}

#[test]
fn a_frame_without_events_has_the_severity_info() {
    let mut buffer = Buffer::new();
    let (mapper, left, right) = stepped(&mut buffer);
    let mut given = frame(&left);
    given.right.pixels = right.as_ptr();
    let mut report: DynvoxReport = unsafe { std::mem::zeroed() };
    let status = unsafe { dynvox_step(mapper, &raw const given, ptr::null(), &raw mut report) };
    assert_eq!((status, report.severity), (DynvoxStatus::Ok, DynvoxSeverity::Info));
    assert!(report.fused && report.blocks > 0);
    // Nothing can be matched in the dark, so nothing is fused, wherever the camera is.
    let black = vec![0; WIDTH * HEIGHT];
    let pose = DynvoxPose { rotation: [1.0, 0.0, 0.0, 0.0], translation_m: [0.0; 3] };
    let dark = DynvoxFrame { t_world_camera: &raw const pose, ..frame(&black) };
    let status = unsafe { dynvox_step(mapper, &raw const dark, ptr::null(), &raw mut report) };
    assert_eq!((status, report.fused), (DynvoxStatus::Ok, false));
}
