//! The colour at a point of a cell.

use crate::geometry::scalar::floored_i32;

/// The colours at the corners of a cell: two words each, red and blue, green and whether there is a
/// colour. Sixteen bits apart, so that sums of what 256 counts in all make of them stay apart too.
/// All 0 is no colour.
pub(super) type Colours = [u32; 16];

/// One corner's words.
#[inline(always)]
pub(super) fn words([red, green, blue]: [u8; 3]) -> [u32; 2] {
    let is_coloured = u32::from((red | green | blue) != 0);
    [u32::from(red) | u32::from(blue) << 16, u32::from(green) | is_coloured << 16]
}

/// Returns the weights of a cell's corners at a point in it, in 256ths.
#[inline(always)]
fn counts([x, y, z]: [f32; 3]) -> [u32; 8] {
    // Fixed point, so that the mean of colours is the same on every machine.
    let [x, y, z] = [
        floored_i32(x * 256.0) as u32,
        floored_i32(y * 256.0) as u32,
        floored_i32(z * 256.0) as u32,
    ];
    let (nx, ny, nz) = (256 - x, 256 - y, 256 - z);
    let (a, b, c, d) = (nx * ny, x * ny, nx * y, x * y);
    // Products of three shares in 2^24ths, brought down to 256ths.
    let count = |area: u32, height: u32| (area * height) >> 16;
    [
        count(a, nz),
        count(b, nz),
        count(c, nz),
        count(d, nz),
        count(a, z),
        count(b, z),
        count(c, z),
        count(d, z),
    ]
}

/// The mean of the coloured corners of a cell at a point in it, by nearness in 256ths.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "corners are below 8")]
pub(super) fn mean(colours: &Colours, point: [f32; 3]) -> [i32; 3] {
    let counts = counts(point);
    let (mut red_blue, mut green_total) = (0, 0);
    for corner in 0..8 {
        red_blue += colours[2 * corner] * counts[corner];
        green_total += colours[2 * corner + 1] * counts[corner];
    }
    let total = (green_total >> 16) as i32;
    // Sums are so small that a float's division rounds as an integer's.
    let scale = if total > 0 { 1.0 / total as f32 } else { 0.0 };
    let channel = |sum: u32| floored_i32(sum as i32 as f32 * scale + 0.5);
    [channel(red_blue & 0xFFFF), channel(green_total & 0xFFFF), channel(red_blue >> 16)]
}
