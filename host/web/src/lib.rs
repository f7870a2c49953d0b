//! The mapper for a page: numbers and pointers in, numbers and pointers out.
//!
//! The page makes an instance for each recording. It reserves memory ([`reserve`]), begins with a
//! clip ([`begin_clip`]) or with pairs of its own ([`begin_pairs`]), and calls [`step`] for each
//! frame. [`NUMBERS`] names what stands in the table after a step.
#![no_std]

mod memory;
mod state;

use dynvox_clip::Clip;
use dynvox_core::{BudgetOptions, Capacity, Config, geometry::StereoRig};
use state::{Source, State};

/// Numbers that [`numbers`] points to.
pub const NUMBERS: usize = 18;
/// Numbers that [`begin_pairs`] takes.
const PAIR_SETTINGS: usize = 7;

/// Address of so many bytes, at a multiple of 64; 0 where the browser gives no more.
#[unsafe(no_mangle)]
pub extern "C" fn reserve(bytes: usize) -> usize {
    memory::reserve(bytes)
}

/// Begins with a clip that lies at an address. True if it can be replayed.
#[unsafe(no_mangle)]
pub extern "C" fn begin_clip(start: usize, len: usize) -> bool {
    let Ok(clip) = Clip::new(memory::bytes(start, len)) else { return false };
    let (config, size) = (dynvox_clip::config(&clip), clip.size());
    state::begin(|| State::new(&dynvox_clip::CAPACITY, &config, Source::clip(clip), size))
}

/// Begins with pairs that the page writes before each step. At the address lie seven `f64`: width
/// and height, px; focal length and principal point, px; baseline, m; bytes of memory. True if
/// they can be mapped.
#[unsafe(no_mangle)]
pub extern "C" fn begin_pairs(settings: usize) -> bool {
    let mut given = [0.0; PAIR_SETTINGS];
    for (number, bytes) in
        given.iter_mut().zip(memory::bytes(settings, 8 * PAIR_SETTINGS).chunks_exact(8))
    {
        *number = bytes.try_into().map_or(0.0, f64::from_le_bytes);
    }
    let [width, height, focal_px, center_u_px, center_v_px, baseline_m, budget] = given;
    let (width, height, budget) = (width as usize, height as usize, budget as usize);
    let rig = StereoRig { focal_px, center_u_px, center_v_px, baseline_m };
    let Ok(capacity) = Capacity::for_budget(budget, width, height, &BudgetOptions::default())
    else {
        return false;
    };
    let config = Config::for_rig(rig);
    state::begin(|| State::new(&capacity, &config, Source::pairs(width * height), [width, height]))
}

/// Maps the next frame. 1: a frame was mapped; 0: the clip is over; 2: the frame was refused.
#[unsafe(no_mangle)]
pub extern "C" fn step() -> u32 {
    state::with(State::step).unwrap_or(2)
}

/// Address of the numbers of the last step, `f64` each: 0 and 1 width and height, px; 2 frames
/// mapped; 3 bytes of the slab; 4 blocks in use; 5 and 6 upper and lower half of the digest; 7
/// severity (0 nothing to report, 1 to see, 2 the map is affected); 8 to 14 pose (place in m,
/// quaternion x, y, z, w); 15, 16, 17 addresses of left image, right image and disparity (`u16`,
/// 1/256 px).
#[unsafe(no_mangle)]
pub extern "C" fn numbers() -> usize {
    state::with(|state| state.numbers.as_ptr() as usize).unwrap_or(0)
}

/// Writes the map's triangles to an address, at most so many, three vertices of 16 bytes each:
/// place as `f32`, m, and red, green, blue, observations as bytes. Returns how many there are.
#[unsafe(no_mangle)]
pub extern "C" fn triangles(start: usize, most: usize) -> u32 {
    let mut out = memory::bytes_mut(start, 48 * most).chunks_exact_mut(16);
    state::with(|state| state.triangles(&mut out)).unwrap_or(0)
}

#[cfg(target_arch = "wasm32")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    core::arch::wasm32::unreachable()
}
