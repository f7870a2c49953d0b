//! Remapping of raw images whose samples are packed.

use super::{
    RawCamera,
    map::{NONE, Packing, Sample},
};
use crate::image::{SampleLayout, View};

/// Fills a rectified image from a packed raw one, as [`super::map::remap`] does from bytes: the
/// same result as from an image of the upper eight bits.
pub(super) fn remap_packed(
    map: &[u32],
    camera: &RawCamera,
    raw: &View<'_, u8>,
    layout: SampleLayout,
    out: &mut [u8],
) {
    if [raw.width(), raw.height()] != [camera.width as usize, camera.height as usize] {
        return;
    }
    let packing = Packing::new(camera);
    let (data, stride) = raw.strided();
    let two = |row: usize, [left, right]: [usize; 2]| {
        Some([*data.get(row * stride + left)?, *data.get(row * stride + right)?])
    };
    for (out, &entry) in out.iter_mut().zip(map) {
        let ([u, v], weights) = packing.unpack(entry);
        // A neighbour may lie beyond the byte of a group's lower bits.
        let columns = [u, u + 1].map(|column| layout.position(column));
        *out = match (two(v, columns), two(v + 1, columns)) {
            (Some(upper), Some(lower)) if entry != NONE => {
                u8::between(&upper, &lower, weights, &packing)
            }
            _ => u8::NONE,
        };
    }
}
