//! Filling holes as the benchmarks do before they rank: along each row by the farther of the two
//! neighbours.

use crate::formats::Image;

/// Fills every hole of a disparity image (0 is none): each run of holes in a row by the smaller of
/// the disparities at its ends, at the image's sides by the one there is; rows without any by the
/// nearest row above that has some, else below. An image without disparity stays empty.
pub fn filled(disparity: &Image<u16>) -> Image<u16> {
    let (width, height) = (disparity.width(), disparity.height());
    let mut pixels = disparity.pixels().to_vec();
    for row in pixels.chunks_exact_mut(width) {
        // Zero at the row's ends stands for no neighbour.
        let mut left = 0u16;
        let mut at = 0;
        while at < width {
            let run = row.iter().skip(at).take_while(|&&pixel| pixel == 0).count();
            let right = row.get(at + run).copied().unwrap_or_default();
            // The smaller disparity is the background, which is what most holes show.
            let filling = match (left, right) {
                (0, only) | (only, 0) => only,
                (left, right) => left.min(right),
            };
            row.iter_mut().skip(at).take(run).for_each(|pixel| *pixel = filling);
            left = right;
            at += run + 1;
        }
    }
    // A row without any disparity takes that of the nearest row with one.
    let empty = |pixels: &[u16], v: usize| {
        pixels[v * width..(v + 1) * width].iter().all(|&pixel| pixel == 0)
    };
    let rows: Vec<bool> = (0..height).map(|v| empty(&pixels, v)).collect();
    for v in (0..height).filter(|&v| rows[v]) {
        let from = (0..v)
            .rev()
            .find(|&other| !rows[other])
            .or_else(|| (v..height).find(|&other| !rows[other]));
        if let Some(from) = from {
            pixels.copy_within(from * width..(from + 1) * width, v * width);
        }
    }
    Image::new(width, height, pixels).unwrap_or_else(|| disparity.clone())
}
