//! A 3 x 3 median, for pixels whose eight neighbours all have a disparity; the others stay. What
//! was filled in stays marked so.

use crate::slices::clipped;

use super::dense::{FILLED, NONE};

/// Filters `from`, whose row `first` is the first one of `to`.
pub(super) fn median(from: &[i16], width: usize, first: usize, to: &mut [i16]) {
    let width = width.max(1);
    for (v, to) in (first..).zip(to.chunks_exact_mut(width)) {
        to.iter_mut().zip(clipped(from, v * width..)).for_each(|(to, from)| *to = *from);
        median_row(from, width, v, to);
    }
}

/// Filters row `v`. Nothing where it is the first or the last.
fn median_row(from: &[i16], width: usize, v: usize, to: &mut [i16]) -> Option<()> {
    let n = width.checked_sub(2)?;
    // Nine slices of one length, shifted by a pixel each, so that the loop needs no checks.
    let mut taps: [&[i16]; 9] = [&[]; 9];
    for (k, tap) in taps.iter_mut().enumerate() {
        *tap = from.get((v + k / 3).checked_sub(1)? * width + k % 3..)?.get(..n)?;
    }
    let [a, b, c, d, e, f, g, h, i] = taps;
    let rows = (a.iter().zip(b).zip(c)).zip(d.iter().zip(e).zip(f)).zip(g.iter().zip(h).zip(i));
    for (((((&a, &b), &c), ((&d, &e), &f)), ((&g, &h), &i)), to) in rows.zip(to.get_mut(1..)?) {
        let window = [a, b, c, d, e, f, g, h, i];
        let least = window.iter().fold(i16::MAX, |a, &b| a.min(b));
        let middle = middle_of_nine(window.map(|disparity| disparity & !FILLED));
        // A window with a hole leaves the pixel as it is; the flag stays that of the middle pixel.
        *to = if least == NONE { *to } else { middle | e & FILLED };
    }
    Some(())
}

/// The median of nine by exchanges (Smith 1996): columns sorted, then the middle of (largest low,
/// middle middle, smallest high).
#[inline(always)]
fn middle_of_nine([a, b, c, d, e, f, g, h, i]: [i16; 9]) -> i16 {
    let ([a, b, c], [d, e, f], [g, h, i]) = (sorted(a, b, c), sorted(d, e, f), sorted(g, h, i));
    let low = a.max(d).max(g);
    let [_, middle, _] = sorted(b, e, h);
    let high = c.min(f).min(i);
    let [_, median, _] = sorted(low, middle, high);
    median
}

#[inline(always)]
fn sorted(a: i16, b: i16, c: i16) -> [i16; 3] {
    let (low, high) = (a.min(b), a.max(b));
    let (middle, top) = (high.min(c), high.max(c));
    [low.min(middle), low.max(middle), top]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn equals_sorting_nine_pixels() {
        let mut random = Random::new(3);
        let (width, height) = (23, 11);
        let from: std::vec::Vec<i16> = (0..width * height)
            .map(|_| if random.below(20) == 0 { NONE } else { random.below(400) as i16 })
            .collect();
        let mut to = std::vec![0; from.len()];
        median(&from, width, 0, &mut to);
        for (i, &got) in to.iter().enumerate() {
            let (u, v) = (i % width, i / width);
            // The outermost pixels have no full window and stay.
            let inside = u > 0 && v > 0 && u + 1 < width && v + 1 < height;
            let mut window: std::vec::Vec<i16> = if inside {
                (0..9).map(|k| from[(v + k / 3 - 1) * width + u + k % 3 - 1]).collect()
            } else {
                std::vec![NONE]
            };
            window.sort_unstable();
            assert_eq!(got, if window[0] == NONE { from[i] } else { window[4] });
        }
    }
}
