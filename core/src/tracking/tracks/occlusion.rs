//! Which instance continues a track whose object something passes in front of.
//!
//! Then the mask is cut to what is seen of the object, on one side in one frame and on the other in
//! the next: the two need not overlap. So a track remembers how far its object reached when it was
//! last seen whole, its *extent*, and moves that with its velocity in the image. A detection of
//! agreeing class within it, with the same top or bottom, is the object again.

use super::{
    TracksConfig,
    track::{Track, is_cut},
};
use crate::{masks::PixelBox, tracking::instances::Instance};

/// Share of a detection's box that must lie within the extent, 1/10.
const WITHIN_TENTHS: i64 = 8;
/// Most by which the tops, or the bottoms, may differ, as a part of the extent's height.
const EDGE_PART: i32 = 6;

/// Returns the affinity by extent of an instance to a track that was cut, or is cut now: the
/// overlap of both; 0 if it does not continue it.
pub(super) fn extent_affinity(
    config: &TracksConfig,
    frame: u32,
    instance: &Instance,
    track: &Track,
) -> f32 {
    let (seen, extent) = (instance.mask.pixels, track.expected_extent());
    let gap = frame.wrapping_sub(track.last_frame);
    let was_cut = gap > 1 || track.extent != track.mask.pixels;
    let edge = extent.height / EDGE_PART;
    let has_edge = (seen.top - extent.top).abs() <= edge
        || (seen.top + seen.height - extent.top - extent.height).abs() <= edge;
    let continues = gap <= u32::from(config.extent_frames)
        && (was_cut || is_cut(&seen, &extent))
        && has_edge
        && is_within(&seen, &extent)
        && instance.class().agrees_with(track.class());
    if continues { seen.overlap(&extent) } else { 0.0 }
}

/// The extent of a track after a frame of images of that size, in which its object was seen in the
/// box `seen` or not at all.
pub(super) fn next_extent(
    track: &Track,
    seen: Option<PixelBox>,
    [width, height]: [usize; 2],
) -> PixelBox {
    let expected = track.expected_extent();
    let image = PixelBox { left: 0, top: 0, width: width as i32, height: height as i32 };
    match seen {
        Some(seen)
            if is_cut(&seen, &expected.intersection(&image)) && is_within(&seen, &expected) =>
        {
            expected
        }
        Some(seen) => seen,
        None => expected,
    }
}

fn is_within(seen: &PixelBox, extent: &PixelBox) -> bool {
    10 * seen.intersection(extent).area() >= WITHIN_TENTHS * seen.area()
}
