//! Programs of calls of the C interface, made of bytes: sizes, settings, poses and pointers of any
//! kind, but for what C itself forbids (memory that is not as long as its caller says). Nothing is
//! written outside the buffer and the outputs.
#![allow(unsafe_code)]

use dynvox_capi::*;
use std::ffi::{CString, c_void};
use std::ptr;

/// Calls of one program at most.
const CALLS: usize = 12;
/// Largest buffer, bytes: larger mappers are left out.
const MAX_BUFFER: usize = 8 << 20;
/// Bytes before and behind the buffer that no call may touch.
const GUARD: usize = 64;
const GUARDED: u8 = 0xA5;
/// Pixels that an image may point to, and outputs of a picture or a window.
const PIXELS: usize = 64 * 48;

/// The bytes of a program, read from the front; zeros when they end.
struct Program<'a>(&'a [u8]);

impl Program<'_> {
    fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        first
    }

    fn word(&mut self) -> u64 {
        u64::from_le_bytes(std::array::from_fn(|_| self.byte()))
    }

    /// A size: mostly a small one.
    fn size(&mut self) -> usize {
        match self.byte() {
            255 => self.word() as usize,
            small => usize::from(small),
        }
    }

    /// A number: a small one, or any bits.
    fn number(&mut self) -> f64 {
        match self.byte() {
            255 => f64::from_bits(self.word()),
            small => f64::from(small as i8) / 8.0,
        }
    }

    fn text(&mut self) -> CString {
        let len = usize::from(self.byte() % 48).min(self.0.len());
        let (text, rest) = self.0.split_at(len);
        self.0 = rest;
        CString::new(text.iter().copied().filter(|&byte| byte != 0).collect::<Vec<_>>())
            .unwrap_or_default()
    }

    fn pose(&mut self) -> DynvoxPose {
        DynvoxPose {
            rotation: std::array::from_fn(|at| if at == 0 { 1.0 } else { 0.0 } + self.number()),
            translation_m: std::array::from_fn(|_| self.number()),
        }
    }
}

/// Memory of a caller: the mapper's between guards, and the outputs.
struct Caller {
    memory: Vec<u8>,
    start: usize,
    len: usize,
    pixels: Vec<u8>,
    depth_m: Vec<f32>,
    saved: Vec<u8>,
}

impl Caller {
    fn new(len: usize) -> Self {
        let mut memory = vec![GUARDED; len + 2 * GUARD + dynvox_alignment()];
        let start = GUARD + memory[GUARD..].as_ptr().align_offset(dynvox_alignment());
        memory[start..start + len].fill(0);
        let pixels = (0..PIXELS).map(|at| (at % 64 * 29 % 97 + at / 64 * 31 % 89) as u8).collect();
        Self { memory, start, len, pixels, depth_m: vec![0.0; PIXELS], saved: Vec::new() }
    }

    fn buffer(&mut self) -> *mut u8 {
        self.memory[self.start..].as_mut_ptr()
    }

    fn assert_guarded(&self) {
        let outside = self.memory[..self.start].iter().chain(&self.memory[self.start + self.len..]);
        assert!(
            outside.into_iter().all(|&byte| byte == GUARDED),
            "a call wrote outside its buffer"
        );
    }

    /// An image: of the caller's pixels, nowhere, or in the mapper's own buffer. Its stride keeps
    /// it within the pixels, or overflows.
    fn image(
        &mut self,
        program: &mut Program<'_>,
        (width, height): (usize, usize),
    ) -> Option<DynvoxImage> {
        let (kind, stride) =
            (program.byte(), if program.byte() == 0 { width } else { program.size() });
        let needed = height
            .checked_sub(1)
            .and_then(|rows| rows.checked_mul(stride))
            .and_then(|pixels| pixels.checked_add(width));
        let pixels = match kind % 16 {
            0 => ptr::null(),
            1 => self.buffer().cast_const(),
            _ => self.pixels.as_ptr(),
        };
        (needed.is_none_or(|needed| needed <= PIXELS.min(self.len)))
            .then_some(DynvoxImage { pixels, stride })
    }
}

fn capacity(program: &mut Program<'_>) -> DynvoxCapacity {
    let mut of = super::mapper::CAPACITY;
    for _ in 0..program.byte() % 4 {
        let (field, size) = (program.byte(), program.size());
        let sizes = super::sizes(&mut of);
        let at = usize::from(field) % sizes.len();
        *sizes[at] = size;
    }
    DynvoxCapacity::from(&of)
}

fn config(program: &mut Program<'_>) -> Option<DynvoxConfig> {
    let mut numbers = [40.0, 32.0, 24.0, 0.5];
    if program.byte() % 4 == 3 {
        numbers[usize::from(program.byte() % 4)] = program.number();
    }
    let [focal_px, center_u_px, center_v_px, baseline_m] = numbers;
    let rig = DynvoxRig { focal_px, center_u_px, center_v_px, baseline_m };
    let mut config = std::mem::MaybeUninit::uninit();
    // SAFETY: both point to values of this function's own, and the second is written when the call
    // succeeds.
    let mut config = unsafe {
        let made = dynvox_config_default(&raw const rig, config.as_mut_ptr());
        (made == DynvoxStatus::Ok).then(|| config.assume_init())
    }?;
    for _ in 0..program.byte() % 3 {
        let (key, value) = (program.text(), program.text());
        // SAFETY: a configuration, and two strings that end.
        unsafe { dynvox_config_set(&raw mut config, key.as_ptr(), value.as_ptr()) };
    }
    Some(config)
}

fn step(program: &mut Program<'_>, caller: &mut Caller, mapper: *mut DynvoxMapper) -> DynvoxStatus {
    // Most images have one size, so that steps succeed now and then.
    let size = if program.byte() % 4 < 3 { (64, 48) } else { (program.size(), program.size()) };
    let [Some(left), Some(right)] = [0, 1].map(|_| caller.image(program, size)) else {
        return DynvoxStatus::Size;
    };
    let (pose, time_ns) = (program.pose(), program.word());
    // Bits decide which optional parts the frame has.
    let given = program.byte();
    let detection = DynvoxDetection {
        class_code: program.byte(),
        score: program.number() as f32,
        left: program.size() as i32,
        top: program.size() as i32,
        width: u32::from(program.byte()) % 64,
        height: u32::from(program.byte()) % 48,
        mask: caller.pixels.as_ptr(),
    };
    let frame = DynvoxFrame {
        width: size.0,
        height: size.1,
        left,
        right,
        colour: DynvoxImage { pixels: ptr::null(), stride: 0 },
        detections: &raw const detection,
        detection_count: usize::from(given & 1),
        t_world_camera: if given & 2 == 0 { ptr::null() } else { &raw const pose },
        time_ns: if given & 4 == 0 { ptr::null() } else { &raw const time_ns },
        disparity_q8: ptr::null(),
        inertial: ptr::null(),
        inertial_count: 0,
        layout: DYNVOX_SAMPLES_BYTES,
        ignored: DynvoxImage { pixels: ptr::null(), stride: 0 },
    };
    let mut report = std::mem::MaybeUninit::<DynvoxReport>::uninit();
    // SAFETY: images are as long as they say, or are refused before they are read; the report is
    // written when the call succeeds.
    unsafe {
        let status = dynvox_step(mapper, &raw const frame, ptr::null(), report.as_mut_ptr());
        if status == DynvoxStatus::Ok {
            let pose = report.assume_init().t_world_camera;
            assert!(
                pose.translation_m.iter().chain(&pose.rotation).all(|number| number.is_finite()),
                "{pose:?}"
            );
        }
        status
    }
}

extern "C" fn write(context: *mut c_void, bytes: *const u8, len: usize) -> bool {
    // SAFETY: the context is the vector that was given, and the bytes are the mapper's.
    unsafe {
        (*context.cast::<Vec<u8>>()).extend_from_slice(std::slice::from_raw_parts(bytes, len))
    };
    true
}

extern "C" fn read(context: *mut c_void, bytes: *mut u8, len: usize) -> bool {
    // SAFETY: the context is the slice that was given, and the bytes are the mapper's.
    unsafe {
        let rest = &mut *context.cast::<&[u8]>();
        let Some((next, after)) = rest.split_at_checked(len) else { return false };
        ptr::copy_nonoverlapping(next.as_ptr(), bytes, len);
        *rest = after;
    }
    true
}

extern "C" fn ignore(_: *mut c_void, _: *const DynvoxTriangle) {}

/// Calls everything that reads the mapper and leaves it unchanged.
fn observe(program: &mut Program<'_>, caller: &mut Caller, mapper: *mut DynvoxMapper) {
    let (pose, mut count, mut triangles) = (program.pose(), 0, 0);
    let mut picture = DynvoxPicture {
        capacity: program.size().min(PIXELS),
        depth_m: caller.depth_m.as_mut_ptr(),
        normal: ptr::null_mut(),
        colour: ptr::null_mut(),
        weight: ptr::null_mut(),
        width: 0,
        height: 0,
    };
    let (origin_m, direction) =
        ([0; 3].map(|_| program.number()), [0; 3].map(|_| program.number()));
    let mut way = std::mem::MaybeUninit::uninit();
    // SAFETY: outputs are as long as they say; no track is asked for, so that their array may be
    // null.
    unsafe {
        match program.byte() % 6 {
            0 => dynvox_raycast(mapper, &raw const pose, &raw mut picture),
            1 => dynvox_tracks(mapper, ptr::null_mut(), 0, &raw mut count),
            2 => dynvox_triangles(mapper, Some(ignore), ptr::null_mut(), &raw mut triangles),
            3 => dynvox_object_triangles(
                mapper,
                u32::from(program.byte()),
                Some(ignore),
                ptr::null_mut(),
                &raw mut triangles,
            ),
            4 => dynvox_ray(
                mapper,
                origin_m.as_ptr(),
                direction.as_ptr(),
                program.number(),
                way.as_mut_ptr(),
            ),
            _ => dynvox_moving_boxes(mapper, ptr::null_mut(), 0, &raw mut count),
        };
    }
}

/// A snapshot, some of it changed, restored in the same buffer.
fn restored(
    program: &mut Program<'_>,
    caller: &mut Caller,
    (capacity, config): (&DynvoxCapacity, &DynvoxConfig),
    mapper: *mut DynvoxMapper,
) -> *mut DynvoxMapper {
    let mut saved = std::mem::take(&mut caller.saved);
    saved.clear();
    let (changed, to, len, mut again) =
        (program.size(), program.byte(), caller.len, ptr::null_mut());
    // SAFETY: the callbacks' contexts outlive the calls; the old mapper is destroyed before its
    // buffer is used again.
    unsafe {
        dynvox_save(mapper, Some(write), (&raw mut saved).cast());
        if let Some(byte) = saved.get_mut(changed) {
            *byte = to;
        }
        dynvox_destroy(mapper);
        let mut rest = saved.as_slice();
        dynvox_restore(
            capacity,
            config,
            caller.buffer(),
            len,
            Some(read),
            (&raw mut rest).cast(),
            &raw mut again,
        );
    }
    caller.saved = saved;
    again
}

/// Runs a program. Whether a frame was mapped.
pub fn calls(bytes: &[u8]) -> bool {
    let mut program = Program(bytes);
    let capacity = capacity(&mut program);
    let Some(config) = config(&mut program) else { return false };
    let mut len = 0;
    // SAFETY: both point to values of this function's own.
    let known = unsafe { dynvox_bytes(&raw const capacity, &raw mut len) };
    if known != DynvoxStatus::Ok || len > MAX_BUFFER {
        return false;
    }
    let mut caller = Caller::new(len);
    let (less, mut mapper, mut mapped) = (usize::from(program.byte() == 1), ptr::null_mut(), false);
    // SAFETY: the buffer is aligned and at least as long as it says.
    let made = unsafe {
        dynvox_create(
            &raw const capacity,
            &raw const config,
            caller.buffer(),
            len - less,
            &raw mut mapper,
        )
    };
    assert_eq!(made == DynvoxStatus::Ok, !mapper.is_null(), "{made:?}");
    for _ in 0..CALLS {
        if mapper.is_null() || program.0.is_empty() {
            break;
        }
        match program.byte() % 8 {
            0..=3 => mapped |= step(&mut program, &mut caller, mapper) == DynvoxStatus::Ok,
            4 | 5 => observe(&mut program, &mut caller, mapper),
            6 => mapper = restored(&mut program, &mut caller, (&capacity, &config), mapper),
            // SAFETY: the mapper lives, or was destroyed and its buffer is still there.
            _ => unsafe {
                dynvox_finish(mapper);
                if program.byte() == 0 {
                    dynvox_destroy(mapper);
                }
            },
        }
        caller.assert_guarded();
    }
    mapped
}

/// Programs that map: two frames and three views; a frame, a snapshot and another frame.
pub fn programs() -> Vec<Vec<u8>> {
    let begin: &[u8] = &[0, 0, 0, 0];
    // Images, a pose of 7 numbers and a time that are not given, a detection that is not.
    let frame: &[u8] = &[&[0, 0, 2, 0, 2, 0][..], &[0; 7], &[0; 8], &[0; 7]].concat();
    let view = |what: u8| {
        [&[4][..], &[0; 7], &[255, 0, 12, 0, 0, 0, 0, 0, 0], &[0; 6], &[what, 0]].concat()
    };
    let restore: &[u8] = &[6, 255, 255, 255, 255, 0, 0, 0, 0, 0, 0];
    vec![
        [begin, frame, frame, &view(0), &view(2), &view(4)].concat(),
        [begin, frame, restore, frame, &view(1), &[7, 0]].concat(),
    ]
}
