//! Replays a fixture on a machine of any kind. Prints a line per frame: the digests as they stand
//! in the fixture's file, then the blocks in use and, where the stack can be painted, the bytes a
//! step took of it. The exit code is 0 when every line is the one on file.
#![cfg_attr(not(feature = "hosted"), no_std, no_main)]

#[cfg(any(feature = "faults", feature = "forbidden_panic_fault"))]
mod faults;
mod fixture;
#[cfg(not(feature = "hosted"))]
mod forbidden;
#[cfg(feature = "instructions")]
mod instructions;
mod line;
mod onboard;
#[cfg(feature = "plain")]
mod plain;
#[cfg_attr(all(target_arch = "arm", target_os = "none"), path = "platform/cortex_m.rs")]
#[cfg_attr(all(target_os = "linux", not(feature = "hosted")), path = "platform/linux.rs")]
#[cfg_attr(target_arch = "wasm32", path = "platform/wasm.rs")]
#[cfg_attr(feature = "hosted", path = "platform/hosted.rs")]
mod platform;
mod reach;
#[cfg(feature = "snapshots")]
mod snapshots;
#[cfg_attr(not(all(target_arch = "arm", target_os = "none")), path = "stack/unknown.rs")]
#[cfg_attr(all(target_arch = "arm", target_os = "none"), path = "stack/painted.rs")]
mod stack;

use dynvox_clip::{Bounds, Clip, FrameDigests, replay_with};
#[cfg(not(any(feature = "instructions", feature = "plain")))]
use dynvox_core::Serial;
use dynvox_core::memory::Slab;
use fixture::{CAPACITY, CONFIG};
use line::Line;
use stack::Paint;
use static_cell::ConstStaticCell;

#[cfg_attr(all(target_arch = "arm", target_os = "none"), unsafe(link_section = ".psram"))]
static SLAB: ConstStaticCell<Slab<{ reach::SLAB_BYTES }>> = ConstStaticCell::new(Slab::ZERO);

/// Most that everything may take of the stack, making the mapper included, bytes.
const STACK: u32 = 32 * 1024;

/// Prints a digest. Never inlined: lines must not lie below what is digested.
#[inline(never)]
fn put_digest(name: &str, digest: u64) {
    platform::put(&Line::new().str(name).hex(digest).str("\n"));
}

/// Prints how much was taken of the stack, bytes. Never inlined, for the same reason.
#[inline(never)]
fn put_stack(step: u32, most: u32) {
    platform::put(
        &Line::new()
            .str("stack of a step ")
            .decimal(step)
            .str(", of everything ")
            .decimal(most)
            .str("\n"),
    );
}

/// Replays; returns the exit code: 0, or what of a digest (1), the fixture (2), the stack (3) was
/// wrong.
fn run() -> u8 {
    let (Some(slab), Ok(clip)) = (SLAB.try_take(), Clip::new(fixture::CLIP)) else { return 2 };
    let mut expected =
        Lines(fixture::DIGESTS.as_bytes()).filter(|line| line.first() != Some(&b'#'));
    let mut paint = Paint::below();
    let (mut wrong, mut most, mut step) = (0u32, 0, 0);
    #[cfg(not(any(feature = "instructions", feature = "plain")))]
    let executor = Serial;
    #[cfg(feature = "plain")]
    let executor = plain::Plain;
    #[cfg(feature = "instructions")]
    let executor = instructions::Counting::new();
    let mut bounds = Bounds { capacity: &CAPACITY, config: &CONFIG, slab: &mut slab.0 };
    let done = replay_with(&clip, &mut bounds, &executor, |frame| {
        let bytes = paint.used_below();
        most = paint.used_in_all().max(most);
        // What the first frame shows is mostly the making of the mapper.
        step = if frame.frame == 0 { 0 } else { bytes.max(step) };
        let digests = written(frame);
        let same = expected.next().is_some_and(|line| line == digests.text());
        wrong += u32::from(!same);
        platform::put(
            &digests
                .str(if same { " blocks " } else { " WRONG, blocks " })
                .decimal(frame.blocks)
                .str(" stack ")
                .decimal(bytes)
                .str("\n"),
        );
        #[cfg(feature = "instructions")]
        executor.put();
        paint = Paint::below();
    });
    let missing = expected.count() as u32;
    put_digest("elsewhere ", reach::digest(&clip, &mut slab.0));
    #[cfg(feature = "snapshots")]
    {
        let snapshot = snapshots::digest(&clip, &mut slab.0);
        put_digest("snapshot ", snapshot);
        wrong += u32::from(snapshot == 0);
    }
    put_stack(step, most);
    #[cfg(any(feature = "faults", feature = "forbidden_panic_fault"))]
    platform::put(&Line::new().hex(faults::all(fixture::CLIP.len())).str("\n"));
    match (done, wrong + missing) {
        (Err(_), _) => 2,
        (Ok(()), 1..) => 1,
        // Counting takes stack of its own.
        (Ok(()), 0) if most > STACK && !cfg!(feature = "instructions") => 3,
        (Ok(()), 0) => 0,
    }
}

/// Lines of a text: those of `str` can panic, or so the compiler thinks.
struct Lines<'t>(&'t [u8]);

impl<'t> Iterator for Lines<'t> {
    type Item = &'t [u8];

    fn next(&mut self) -> Option<&'t [u8]> {
        let end = self.0.iter().position(|&byte| byte == b'\n')?;
        let line = self.0.get(..end)?;
        self.0 = self.0.get(end + 1..)?;
        Some(line)
    }
}

/// A frame's digests as they stand in the fixture's file.
fn written(frame: &FrameDigests) -> Line {
    let stages = &frame.stages;
    let mut line = Line::new().decimal(frame.frame).str(" ").hex(frame.digest).str(" ");
    for stage in [
        stages.input,
        stages.stereo,
        stages.scene_flow,
        stages.egomotion,
        stages.tracking,
        stages.static_map,
    ] {
        line = line.hex(stage).str(" ");
    }
    let mut between = "";
    for object in stages.objects.iter() {
        line = line.str(between).decimal(object.id).str(":").hex(object.digest);
        between = ";";
    }
    if between.is_empty() { line.str("-") } else { line }
}

#[cfg(feature = "hosted")]
fn main() -> std::process::ExitCode {
    run().into()
}
