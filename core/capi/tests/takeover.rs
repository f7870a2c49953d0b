//! A buffer holds one mapper at most, and a handle reaches no other, when another is made,
//! restored or refused in the buffer of a mapper that lives.
#![allow(missing_docs, clippy::unwrap_used, clippy::indexing_slicing)]
#![expect(
    clippy::undocumented_unsafe_blocks,
    reason = "each call keeps the header's promises, but for the buffer that is not free"
)]

mod support;

use dynvox_capi::*;
use std::{ffi::c_void, ptr};
use support::*;

/// A value that no call writes: a test's marker.
const UNTOUCHED: *mut DynvoxMapper = ptr::without_provenance_mut(7 * 64);

/// A mapper that has taken two frames, and its snapshot.
struct Living {
    buffer: Buffer,
    mapper: *mut DynvoxMapper,
    pixels: Vec<u8>,
    snapshot: Vec<u8>,
}

impl Living {
    fn new() -> Self {
        let (mut buffer, pixels) = (Buffer::new(), pixels());
        let mapper = create(&mut buffer, &config()).unwrap();
        let mut living = Self { buffer, mapper, pixels, snapshot: Vec::new() };
        assert_eq!([living.step().0, living.step().0], [DynvoxStatus::Ok; 2]);
        let context = (&raw mut living.snapshot).cast();
        assert_eq!(unsafe { dynvox_save(mapper, Some(write), context) }, DynvoxStatus::Ok);
        living
    }

    fn step(&self) -> (DynvoxStatus, u64) {
        let (frame, mut report) = (frame(&self.pixels), unsafe { std::mem::zeroed() });
        let status =
            unsafe { dynvox_step(self.mapper, &raw const frame, ptr::null(), &raw mut report) };
        (status, report.digest)
    }

    /// Restores `snapshot` over the mapper; the status, and what became of the handle's place.
    fn restore(
        &mut self,
        capacity: &DynvoxCapacity,
        config: &DynvoxConfig,
        snapshot: &[u8],
    ) -> (DynvoxStatus, *mut DynvoxMapper) {
        let (len, mut rest, mut restored) = (self.buffer.len, snapshot, UNTOUCHED);
        let (start, context) = (self.buffer.at(0), (&raw mut rest).cast());
        let status = unsafe {
            dynvox_restore(capacity, config, start, len, Some(read), context, &raw mut restored)
        };
        (status, restored)
    }

    /// Every function that takes a handle says that there is no mapper.
    fn assert_ended(&self, story: &str) {
        let (mut pose, mut count) = (DynvoxPose::default(), 0);
        let statuses = unsafe {
            [
                self.step().0,
                dynvox_pose(self.mapper, &raw mut pose),
                dynvox_triangles(self.mapper, Some(ignore), ptr::null_mut(), ptr::null_mut()),
                dynvox_save(self.mapper, Some(write), ptr::null_mut()),
                dynvox_tracks(self.mapper, ptr::null_mut(), 0, &raw mut count),
                dynvox_finish(self.mapper),
                dynvox_destroy(self.mapper),
            ]
        };
        assert_eq!(statuses, [DynvoxStatus::NoMapper; 7], "{story}");
    }
}

extern "C" fn ignore(_: *mut c_void, _: *const DynvoxTriangle) {}

#[test]
fn a_restore_that_fails_ends_the_mapper_that_lived_there() {
    let (capacity, config) = (capacity(), config());
    let mut other = config;
    assert_eq!(set(&mut other, c"volume.far_m", c"17"), DynvoxStatus::Ok);
    // Fewer blocks fit the buffer, but not the snapshot.
    let fewer = DynvoxCapacity { blocks: capacity.blocks - 64, ..capacity };
    type Story = (&'static str, fn(&mut Vec<u8>), DynvoxStatus);
    let stories: [Story; 5] = [
        ("a flipped bit", |bytes| *bytes.last_mut().unwrap() ^= 1, DynvoxStatus::Snapshot),
        (
            "a flipped bit in the middle",
            |bytes| {
                let middle = bytes.len() / 2;
                bytes[middle] ^= 1;
            },
            DynvoxStatus::Snapshot,
        ),
        ("a shorter snapshot", |bytes| bytes.truncate(bytes.len() - 9), DynvoxStatus::Callback),
        ("no snapshot", Vec::clear, DynvoxStatus::Callback),
        ("another file", |bytes| bytes.fill(b'x'), DynvoxStatus::Snapshot),
    ];
    for (story, damage, expected) in stories {
        let mut living = Living::new();
        let mut bytes = living.snapshot.clone();
        damage(&mut bytes);
        assert_eq!(living.restore(&capacity, &config, &bytes), (expected, UNTOUCHED), "{story}");
        // The mapper that lived there is gone in each case.
        living.assert_ended(story);
    }
    for (story, bounds, settings) in
        [("another capacity", &fewer, &config), ("another configuration", &capacity, &other)]
    {
        let mut living = Living::new();
        let bytes = living.snapshot.clone();
        assert_eq!(
            living.restore(bounds, settings, &bytes),
            (DynvoxStatus::Snapshot, UNTOUCHED),
            "{story}"
        );
        living.assert_ended(story);
    }
}

#[test]
fn what_is_refused_before_a_byte_is_written_leaves_the_mapper_alone() {
    // The twin is stepped alike and asked nothing.
    let (mut living, twin) = (Living::new(), Living::new());
    let (capacity, config, bytes) = (capacity(), config(), living.snapshot.clone());
    let mut broken = config;
    broken.rig.focal_px = f64::NAN;
    let huge = DynvoxCapacity { blocks: 1 << 20, ..capacity };
    let (len, start) = (living.buffer.len, living.buffer.at(0));
    let mut made = UNTOUCHED;
    let mut create = |bounds: &DynvoxCapacity, settings: &DynvoxConfig, len| unsafe {
        dynvox_create(bounds, settings, start, len, &raw mut made)
    };
    assert_eq!(create(&capacity, &broken, len), DynvoxStatus::Config);
    assert_eq!(create(&huge, &config, len), DynvoxStatus::TooSmall);
    assert_eq!(create(&capacity, &config, len - 1), DynvoxStatus::TooSmall);
    assert_eq!(made, UNTOUCHED);
    assert_eq!(living.restore(&capacity, &broken, &bytes), (DynvoxStatus::Config, UNTOUCHED));
    assert_eq!(living.restore(&huge, &config, &bytes), (DynvoxStatus::TooSmall, UNTOUCHED));
    let unread = unsafe {
        let (capacity, config) = (&raw const capacity, &raw const config);
        dynvox_restore(capacity, config, start, len, None, ptr::null_mut(), &raw mut made)
    };
    assert_eq!((unread, made), (DynvoxStatus::Null, UNTOUCHED));
    assert_eq!(living.step(), twin.step(), "the third frame, as if nothing had been asked");
}

#[test]
fn raw_lenses_beyond_the_capacity_leave_the_mapper_alone() {
    let (mut living, twin) = (Living::new(), Living::new());
    let camera = DynvoxRawCamera {
        width: 320,
        height: 240,
        focal_px: [200.0; 2],
        center_px: [159.5, 119.5],
        model: DYNVOX_LENS_RADIAL_TANGENTIAL,
        parameters: [0.0; 15],
    };
    let rig = DynvoxRawRig {
        left: camera,
        right: camera,
        r_right_left: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        t_right_left_m: [-0.2, 0.0, 0.0],
        width: 160,
        height: 96,
        focal_px: 0.0,
    };
    let (capacity, mut raw) = (capacity(), config());
    assert_eq!(unsafe { dynvox_config_raw(&raw const rig, &raw mut raw) }, DynvoxStatus::Ok);
    let (len, start, mut made) = (living.buffer.len, living.buffer.at(0), UNTOUCHED);
    let status =
        unsafe { dynvox_create(&raw const capacity, &raw const raw, start, len, &raw mut made) };
    assert_eq!((status, made), (DynvoxStatus::Config, UNTOUCHED), "no raw images in this capacity");
    assert_eq!(living.step(), twin.step());
}

#[test]
fn a_mapper_made_where_one_lives_takes_its_handle_over() {
    let mut living = Living::new();
    // Fewer blocks, so that the report tells which mapper answered.
    let smaller = DynvoxCapacity { blocks: 200, visible_blocks: 200, ..capacity() };
    let (config, len, start) = (config(), living.buffer.len, living.buffer.at(0));
    let mut made = UNTOUCHED;
    let status =
        unsafe { dynvox_create(&raw const smaller, &raw const config, start, len, &raw mut made) };
    assert_eq!((status, made), (DynvoxStatus::Ok, living.mapper), "two handles, one mapper");
    let frame = frame(&living.pixels);
    let mut report: DynvoxReport = unsafe { std::mem::zeroed() };
    let step =
        unsafe { dynvox_step(living.mapper, &raw const frame, ptr::null(), &raw mut report) };
    assert_eq!(
        (step, report.frame, report.blocks_capacity),
        (DynvoxStatus::Ok, 0, 200),
        "the new mapper's first frame"
    );
    assert_eq!(unsafe { dynvox_destroy(made) }, DynvoxStatus::Ok);
    living.assert_ended("destroyed through the other handle");
}

#[test]
fn a_snapshot_restored_where_its_mapper_lives_continues_it() {
    let (mut living, twin) = (Living::new(), Living::new());
    let bytes = living.snapshot.clone();
    assert_eq!(living.step().0, DynvoxStatus::Ok, "a frame that the snapshot does not have");
    let (status, restored) = living.restore(&capacity(), &config(), &bytes);
    assert_eq!((status, restored), (DynvoxStatus::Ok, living.mapper));
    assert_eq!(living.step(), twin.step());
}

/// Context of [`step_while_reading`].
struct Reading {
    rest: &'static [u8],
    mapper: *mut DynvoxMapper,
    pixels: &'static [u8],
    statuses: Vec<DynvoxStatus>,
}

extern "C" fn step_while_reading(context: *mut c_void, bytes: *mut u8, len: usize) -> bool {
    let reading = unsafe { &mut *context.cast::<Reading>() };
    reading.statuses.push(step(reading.mapper, &frame(reading.pixels)));
    reading.statuses.push(unsafe { dynvox_destroy(reading.mapper) });
    read((&raw mut reading.rest).cast(), bytes, len)
}

#[test]
fn a_read_callback_cannot_reach_the_mapper_it_replaces() {
    let (mut living, twin) = (Living::new(), Living::new());
    // The callback steps the mapper on each call, and notes what came of it.
    let mut reading = Reading {
        rest: Vec::leak(living.snapshot.clone()),
        mapper: living.mapper,
        pixels: Vec::leak(living.pixels.clone()),
        statuses: Vec::new(),
    };
    let (capacity, config, mut restored) = (capacity(), config(), UNTOUCHED);
    let (len, start, context) = (living.buffer.len, living.buffer.at(0), (&raw mut reading).cast());
    let (bounds, settings) = (&raw const capacity, &raw const config);
    let read = Some(step_while_reading as extern "C" fn(_, _, _) -> _);
    let status =
        unsafe { dynvox_restore(bounds, settings, start, len, read, context, &raw mut restored) };
    assert_eq!(status, DynvoxStatus::Ok);
    // A snapshot is read in many parts.
    assert!(reading.statuses.len() > 100);
    assert!(reading.statuses.iter().all(|&status| status == DynvoxStatus::NoMapper));
    assert_eq!(living.step(), twin.step());
}

#[test]
fn a_copy_of_a_buffer_is_no_mapper() {
    let mut living = Living::new();
    let mut copy = Buffer::new();
    let (from, to) = (living.buffer.at(0), copy.at(0));
    unsafe { to.copy_from_nonoverlapping(from, living.buffer.len) };
    assert_eq!(step(to.cast(), &frame(&living.pixels)), DynvoxStatus::NoMapper);
    assert_eq!(unsafe { dynvox_destroy(to.cast()) }, DynvoxStatus::NoMapper);
    assert_eq!(living.step().0, DynvoxStatus::Ok, "the mapper itself lives");
}

#[test]
fn poses_that_are_none_are_refused_wherever_one_is_given() {
    let living = Living::new();
    let good = DynvoxPose { rotation: [1.0, 0.0, 0.0, 0.0], translation_m: [0.0; 3] };
    let at = |x| DynvoxPose { translation_m: [x, 0.0, 0.0], ..good };
    let turned = |w| DynvoxPose { rotation: [w, 0.0, 0.0, 0.0], ..good };
    // Not finite, beyond the 16 bits of blocks, and quaternions of another length.
    let wrong = [
        at(f64::NAN),
        at(f64::INFINITY),
        at(1e300),
        at(-1e300),
        at(1e18),
        at(3e4),
        turned(f64::NAN),
        turned(0.0),
        turned(1.01),
        turned(-1.01),
        turned(1e200),
    ];
    let mut picture: DynvoxPicture = unsafe { std::mem::zeroed() };
    picture.capacity = WIDTH * HEIGHT;
    for pose in wrong {
        let given = DynvoxFrame { t_world_camera: &raw const pose, ..frame(&living.pixels) };
        assert_eq!(step(living.mapper, &given), DynvoxStatus::Pose, "{pose:?}");
        let seen = unsafe { dynvox_raycast(living.mapper, &raw const pose, &raw mut picture) };
        assert_eq!(seen, DynvoxStatus::Pose, "{pose:?}");
    }
    let twin = Living::new();
    assert_eq!(living.step(), twin.step(), "none of them was taken");
    let given = DynvoxFrame { t_world_camera: &raw const good, ..frame(&living.pixels) };
    assert_eq!(step(living.mapper, &given), DynvoxStatus::Ok);
}
