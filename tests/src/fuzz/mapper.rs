//! The core, handed any bytes: a clip, a snapshot, settings as text.

use dynvox_clip::{Clip, replay};
use dynvox_core::geometry::StereoRig;
use dynvox_core::image::View;
use dynvox_core::{Capacity, Config, Mapper, Report, Serial, StepError, StereoFrame};

use crate::HeapSlab;

/// Bounds small enough for thousands of mappers a second.
pub const CAPACITY: Capacity = Capacity {
    image_width: 64,
    image_height: 48,
    features: 100,
    matches: 60,
    blocks: 60,
    visible_blocks: 60,
    history_frames: 4,
    mask_words: 64,
    tracks: 4,
    objects: 1,
    object_blocks: 8,
    crop_pixels: 500,
    ..Capacity::TINY
};
const RIG: StereoRig =
    StereoRig { focal_px: 40.0, center_u_px: 32.0, center_v_px: 24.0, baseline_m: 0.5 };
/// Frames a mapper has seen before its snapshot.
const FRAMES: usize = 3;

/// A pair with texture, another one for each frame.
fn pair(frame: usize) -> [Vec<u8>; 2] {
    let image = |shift: usize| {
        (0..64 * 48)
            .map(|at| ((at % 64 + shift + frame) * 29 % 97 + at / 64 * 31 % 89) as u8)
            .collect()
    };
    [image(0), image(4)]
}

fn step(mapper: &mut Mapper<'_>, frame: usize) {
    let report = stepped(mapper, frame).expect("the pair is sound");
    assert_eq!(report.internal_faults, 0, "frame {frame}");
}

fn stepped(mapper: &mut Mapper<'_>, frame: usize) -> Result<Report, StepError> {
    let images = pair(frame);
    let [left, right] =
        [0, 1].map(|side| View::new(&images[side], 64, 48).expect("as many pixels as that"));
    mapper.step(&StereoFrame::pair(left, right), &Serial)
}

pub fn clip(bytes: &[u8]) -> bool {
    let Ok(clip) = Clip::new(bytes) else { return false };
    let mut slab = HeapSlab::of(&dynvox_clip::CAPACITY);
    replay(&clip, slab.bytes(), &Serial, |_| {}).is_ok()
}

pub fn snapshots() -> Vec<Vec<u8>> {
    let mut slab = HeapSlab::of(&CAPACITY);
    let mut mapper =
        Mapper::new(&CAPACITY, &Config::for_rig(RIG), slab.bytes()).expect("the bounds are sound");
    let save = |mapper: &mut Mapper<'_>| {
        let mut bytes = Vec::new();
        let written: Result<(), std::convert::Infallible> = mapper.save(&mut |piece: &[u8]| {
            bytes.extend_from_slice(piece);
            Ok(())
        });
        written.map(|()| bytes).unwrap_or_default()
    };
    let first = save(&mut mapper);
    (0..FRAMES).for_each(|frame| step(&mut mapper, frame));
    vec![first, save(&mut mapper)]
}

pub fn snapshot(bytes: &[u8]) -> bool {
    let mut slab = HeapSlab::of(&CAPACITY);
    let mut rest = bytes;
    let mut read = |piece: &mut [u8]| {
        let (next, after) = rest.split_at_checked(piece.len()).ok_or(())?;
        piece.copy_from_slice(next);
        rest = after;
        Ok::<(), ()>(())
    };
    let Ok(mut mapper) = Mapper::restore(&CAPACITY, &Config::for_rig(RIG), slab.bytes(), &mut read)
    else {
        return false;
    };
    step(&mut mapper, FRAMES);
    true
}

/// The checksum at the end of a snapshot, as `core/src/state/checksum.rs` makes it.
struct Checksum(u64);

impl Checksum {
    const MULTIPLIER: u64 = 0x9E37_79B9_7F4A_7C15;

    fn take(&mut self, piece: &[u8]) {
        for word in piece.chunks(8) {
            let word = word.iter().rev().fold(0, |word, &byte| word << 8 | u64::from(byte));
            self.0 = (self.0 ^ word).wrapping_mul(Self::MULTIPLIER).rotate_left(29);
        }
    }
}

/// A snapshot whose checksum is right, with any other bytes: contradictions in the state must be
/// found without it.
pub fn sealed_snapshot(bytes: &[u8]) -> bool {
    let mut slab = HeapSlab::of(&CAPACITY);
    let (mut rest, mut checksum) = (bytes, Checksum(Checksum::MULTIPLIER));
    let mut read = |piece: &mut [u8]| {
        let (next, after) = rest.split_at_checked(piece.len()).ok_or(())?;
        if after.is_empty() && piece.len() == 8 {
            piece.copy_from_slice(&checksum.0.to_le_bytes());
        } else {
            piece.copy_from_slice(next);
        }
        checksum.take(piece);
        rest = after;
        Ok::<(), ()>(())
    };
    let Ok(mut mapper) = Mapper::restore(&CAPACITY, &Config::for_rig(RIG), slab.bytes(), &mut read)
    else {
        return false;
    };
    // A state that no run has may count as a fault, and one that was told another size of its
    // frames refuses this one. Neither may panic.
    match stepped(&mut mapper, FRAMES) {
        Ok(_) => true,
        Err(StepError::SizeChanged) => false,
        Err(error) => panic!("a sound pair is refused: {error}"),
    }
}

/// Settings as lines of `key=value`; a mapper with what they make, where it is usable.
pub fn settings(bytes: &[u8]) -> bool {
    let mut config = Config::for_rig(RIG);
    let mut set = 0;
    for line in String::from_utf8_lossy(bytes).lines() {
        let (key, value) = line.split_once('=').unwrap_or((line, ""));
        set += usize::from(config.set(key, value).is_ok());
    }
    let mut slab = HeapSlab::of(&CAPACITY);
    let Ok(mut mapper) = Mapper::new(&CAPACITY, &config, slab.bytes()) else { return false };
    (0..FRAMES).for_each(|frame| step(&mut mapper, frame));
    set > 0
}
