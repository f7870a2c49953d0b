//! Removal of small segments. A segment is what hangs together by neighbours (left, right, above, below) of similar disparity.
//!
//! Runs of similar pixels along a row are united with those of the row above that they touch: a union-find over runs, whose roots hold
//! the sizes. A second walk meets the same runs in the same order and blanks the small ones. Memory: four bytes a pixel (in the worst
//! case each is a run) and two rows. Time: two walks over the image.

use super::dense::NONE;

/// A root's size is kept as its negative; others point at a run nearer to the root.
struct Runs<'a>(&'a mut [i32]);

#[expect(clippy::indexing_slicing, reason = "runs are numbered below the number of pixels, and as many entries there are")]
impl Runs<'_> {
    fn root(&mut self, mut run: usize) -> usize {
        while let Ok(parent) = usize::try_from(self.0[run]) {
            // Halve the path, so that no chain gets long.
            if self.0[parent] >= 0 {
                self.0[run] = self.0[parent];
            }
            run = parent;
        }
        run
    }

    /// The earlier root wins: no rank is needed, and the result does not depend on order.
    fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        if a != b {
            let (keep, drop) = (a.min(b), a.max(b));
            self.0[keep] += self.0[drop];
            self.0[drop] = keep as i32;
        }
    }
}

/// Blanks segments of fewer than `smallest` pixels in an image `width` wide; neighbours differ by at most `similarity` (in the unit of
/// the pixels). `runs` has an entry a pixel, `labels` two rows. Returns the pixels blanked.
pub(super) fn remove_speckles(
    disparity: &mut [i16],
    width: usize,
    similarity: i16,
    smallest: u32,
    runs: &mut [i32],
    labels: &mut [u32],
) -> u32 {
    if smallest <= 1 || runs.len() < disparity.len() || labels.len() < 2 * width {
        return 0;
    }
    let mut runs = Runs(runs);
    find_segments(disparity, width, similarity, &mut runs, labels);
    let (mut next, mut blanked) = (0, 0);
    for row in disparity.chunks_exact_mut(width) {
        for run in row.chunk_by_mut(|&a, &b| alike(a, b, similarity)) {
            if run.first().is_none_or(|&d| d == NONE) {
                continue;
            }
            let root = runs.root(next);
            next += 1;
            if runs.0.get(root).is_some_and(|&size| size.unsigned_abs() < smallest) {
                run.fill(NONE);
                blanked += run.len() as u32;
            }
        }
    }
    blanked
}

/// Two pixels without disparity count as alike, so that they form runs too; those have no number.
fn alike(a: i16, b: i16, similarity: i16) -> bool {
    a.abs_diff(b) <= similarity as u16
}

#[expect(clippy::indexing_slicing, reason = "labels has two rows of width; runs are numbered below the number of pixels")]
fn find_segments(disparity: &[i16], width: usize, similarity: i16, runs: &mut Runs<'_>, labels: &mut [u32]) {
    let (mut above_labels, mut here_labels) = labels.split_at_mut(width);
    let mut above: &[i16] = &[];
    let mut next = 0;
    for row in disparity.chunks_exact(width) {
        let mut start = 0;
        for run in row.chunk_by(|&a, &b| alike(a, b, similarity)) {
            let (from, to) = (start, start + run.len());
            start = to;
            if run[0] == NONE {
                continue;
            }
            runs.0[next] = -(run.len() as i32);
            here_labels[from..to].fill(next as u32);
            let mut united = u32::MAX;
            if let Some(above) = above.get(from..to) {
                for ((&up, &here), &label) in above.iter().zip(run).zip(&above_labels[from..to]) {
                    if label != united && up != NONE && alike(up, here, similarity) {
                        runs.unite(label as usize, next);
                        united = label;
                    }
                }
            }
            next += 1;
        }
        core::mem::swap(&mut above_labels, &mut here_labels);
        above = row;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::{vec, vec::Vec};

    /// The twin: flood fill from each pixel.
    fn plain(disparity: &[i16], width: usize, similarity: i16, smallest: usize) -> Vec<i16> {
        let mut out = disparity.to_vec();
        let mut seen = vec![false; out.len()];
        for start in 0..out.len() {
            if seen[start] || disparity[start] == NONE {
                continue;
            }
            let (mut segment, mut next) = (vec![start], 0);
            seen[start] = true;
            while let Some(&i) = segment.get(next) {
                next += 1;
                let u = i % width;
                let beside = [(u > 0).then(|| i - 1), (u + 1 < width).then_some(i + 1), i.checked_sub(width), Some(i + width)];
                for j in beside.into_iter().flatten().filter(|&j| j < disparity.len()) {
                    if !seen[j] && disparity[j] != NONE && disparity[i].abs_diff(disparity[j]) <= similarity as u16 {
                        seen[j] = true;
                        segment.push(j);
                    }
                }
            }
            if segment.len() < smallest {
                segment.into_iter().for_each(|i| out[i] = NONE);
            }
        }
        out
    }

    #[test]
    fn equals_a_flood_fill_on_noise_of_every_roughness() {
        let mut random = Random::new(21);
        for (width, height, levels, smallest) in [(31, 17, 3, 5), (40, 30, 6, 12), (64, 9, 2, 30), (1, 50, 3, 4), (50, 1, 3, 4)].repeat(8) {
            let pixel = |random: &mut Random| if random.below(6) == 0 { NONE } else { random.below(levels) as i16 * 64 };
            let image: Vec<i16> = (0..width * height).map(|_| pixel(&mut random)).collect();
            let mut fast = image.clone();
            let blanked = remove_speckles(&mut fast, width, 64, smallest, &mut vec![0; image.len()], &mut vec![0; 2 * width]);
            assert!(fast == plain(&image, width, 64, smallest as usize));
            let gone = image.iter().zip(&fast).filter(|(a, b)| a != b).count();
            assert_eq!(blanked as usize, gone);
        }
    }
}
