//! The colour at a point of a cell.

/// Red, green and blue, 20 bits each, so that sums of them are one: counts of 256 in all make each below 2^16. All 0 is no colour.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Colour(u64);

impl Colour {
    #[inline(always)]
    pub fn new([red, green, blue]: [u8; 3]) -> Self {
        Self(u64::from(red) | u64::from(green) << 20 | u64::from(blue) << 40)
    }
}

/// What each corner of a cell counts at a point in it, in 256ths.
#[inline(always)]
fn counts(point: [f32; 3]) -> [u32; 8] {
    let [x, y, z] = [(point[0] * 256.0) as i32 as u32, (point[1] * 256.0) as i32 as u32, (point[2] * 256.0) as i32 as u32];
    let (nx, ny, nz) = (256 - x, 256 - y, 256 - z);
    let (a, b, c, d) = (nx * ny, x * ny, nx * y, x * y);
    let count = |area: u32, height: u32| (area * height) >> 16;
    [count(a, nz), count(b, nz), count(c, nz), count(d, nz), count(a, z), count(b, z), count(c, z), count(d, z)]
}

/// The mean of the coloured corners of a cell at a point in it, by nearness in 256ths.
#[inline(always)]
pub(super) fn mean(colours: &[Colour; 8], point: [f32; 3]) -> [u8; 3] {
    let (mut sum, mut total) = (0, 0);
    for (&Colour(colour), count) in colours.iter().zip(counts(point)) {
        sum += colour * u64::from(count);
        total += if colour == 0 { 0 } else { count };
    }
    // Sums are so small that a float's division rounds as an integer's.
    let scale = if total > 0 { 1.0 / total as f32 } else { 0.0 };
    let channel = |shift: u32| ((sum >> shift & 0xF_FFFF) as i32 as f32 * scale + 0.5) as i32 as u8;
    [channel(0), channel(20), channel(40)]
}
