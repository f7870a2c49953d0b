//! A snapshot's bytes, and what comes of a mapper made of them, to be compared from machine to
//! machine. Not in every build: a snapshot names its configuration by a text, and `core::fmt`,
//! which writes it, brings panics along.

use crate::fixture::{CAPACITY, CONFIG};
use dynvox_clip::{Clip, Frame};
use dynvox_core::{Mapper, Serial, digest::Digest};
use static_cell::ConstStaticCell;

/// Frames before the snapshot: tracks, an object, a full pruning window and blocks that left are in
/// it.
const FRAMES: usize = 14;
/// Space for a snapshot of a map whose pool is full.
const MAX_BYTES: usize = 6 << 20;

static BYTES: ConstStaticCell<[u8; MAX_BYTES]> = ConstStaticCell::new([0; MAX_BYTES]);

/// Digest of the snapshot's bytes and of the frames after it; 0 where one of both cannot be had.
#[inline(never)]
pub fn digest(clip: &Clip<'_>, slab: &mut [u8]) -> u64 {
    let Some(bytes) = BYTES.try_take() else { return 0 };
    let Some(len) = saved(clip, slab, bytes) else { return 0 };
    let mut digest = Digest::default();
    digest.bytes(bytes.get(..len).unwrap_or_default());
    let mut from = 0;
    let mut source = |piece: &mut [u8]| {
        let front = bytes.get(from..len).and_then(|rest| rest.get(..piece.len())).ok_or(())?;
        piece.copy_from_slice(front);
        from += front.len();
        Ok::<(), ()>(())
    };
    let mut made = Mapper::restore(&CAPACITY, &CONFIG, slab, &mut source);
    let Ok(mapper) = made.as_mut() else { return 0 };
    for frame in clip.frames().skip(FRAMES) {
        let Frame::Pair(pair) = frame else { return 0 };
        let Ok(report) = mapper.step(&pair.stereo(), &Serial) else { return 0 };
        digest.u64(report.digest);
    }
    digest.finish()
}

/// Maps the first frames and saves; how many bytes that took.
#[inline(never)]
fn saved(clip: &Clip<'_>, slab: &mut [u8], bytes: &mut [u8]) -> Option<usize> {
    let mut made = Mapper::new(&CAPACITY, &CONFIG, slab);
    let mapper = made.as_mut().ok()?;
    for frame in clip.frames().take(FRAMES) {
        let Frame::Pair(pair) = frame else { return None };
        mapper.step(&pair.stereo(), &Serial).ok()?;
    }
    let mut len = 0;
    let mut sink = |piece: &[u8]| {
        let target = bytes.get_mut(len..).and_then(|rest| rest.get_mut(..piece.len())).ok_or(())?;
        target.copy_from_slice(piece);
        len += piece.len();
        Ok::<(), ()>(())
    };
    mapper.save(&mut sink).ok()?;
    Some(len)
}
