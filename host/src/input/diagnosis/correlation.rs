//! Normalised cross-correlation of small patches over a wide window, in whole numbers and a row of
//! shifts at a time.

use crate::formats::Image;
use std::ops::RangeInclusive;

/// Half side of the patches, px.
pub const HALF: usize = 3;
const SIDE: usize = 2 * HALF + 1;
const AREA: i32 = (SIDE * SIDE) as i32;

/// Similarity of a patch to the one that lies so many columns and rows away.
#[derive(Clone, Copy, Debug)]
pub struct Score {
    /// Cosine of the two patches less their means; 0 where one is flat.
    pub similarity: f64,
    /// Columns further right.
    pub du: i32,
    /// Rows further down.
    pub dv: i32,
}

/// An image in which patches are looked for.
pub struct SearchedImage<'i> {
    image: &'i Image<u8>,
    /// Sums of the patches by their first pixels, in rows as wide as the image.
    sums: Vec<i32>,
    /// One over their lengths, less their means; 0 of flat ones.
    inverse_lengths: Vec<f64>,
}

impl<'i> SearchedImage<'i> {
    /// Sums up every patch; none fits into an image smaller than a patch.
    pub fn new(image: &'i Image<u8>) -> Self {
        let (mut sums, mut squares) =
            (vec![0; image.pixels().len()], vec![0; image.pixels().len()]);
        for first in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| y * image.width() + x)) {
            let shifted = image.pixels().get(first..).unwrap_or_default();
            for ((sum, square), &grey) in sums.iter_mut().zip(&mut squares).zip(shifted) {
                *sum += i32::from(grey);
                *square += i32::from(grey) * i32::from(grey);
            }
        }
        let inverse_lengths =
            sums.iter().zip(squares).map(|(&sum, squares)| inverse_length(sum, squares)).collect();
        Self { image, sums, inverse_lengths }
    }

    /// Scores the patch of another image about a pixel against those within reach, columns and rows
    /// to either side. None where a patch would leave its image.
    pub fn scores(&self, other: &Image<u8>, center: [usize; 2], reach: [usize; 2]) -> Vec<Score> {
        let [u, v] = center;
        let (Some(patch), Some(columns), Some(rows)) = (
            patch(other, u, v),
            centers(u, reach[0], self.image.width()),
            centers(v, reach[1], self.image.height()),
        ) else {
            return Vec::new();
        };
        let sum: i32 = patch.iter().flatten().sum();
        let inverse = inverse_length(sum, patch.iter().flatten().map(|grey| grey * grey).sum());
        let count = columns.end() + 1 - columns.start();
        let mut scores = Vec::with_capacity(count * (rows.end() + 1 - rows.start()));
        let mut products = vec![0; count];
        for row in rows {
            products.fill(0);
            let first = (row - HALF) * self.image.width() + columns.start() - HALF;
            for (y, greys) in patch.iter().enumerate() {
                for (x, &grey) in greys.iter().enumerate() {
                    let searched = self
                        .image
                        .pixels()
                        .get(first + y * self.image.width() + x..)
                        .unwrap_or_default();
                    products
                        .iter_mut()
                        .zip(searched)
                        .for_each(|(product, &other)| *product += grey * i32::from(other));
                }
            }
            let patches = self.sums.iter().zip(&self.inverse_lengths).skip(first);
            scores.extend(products.iter().zip(patches).zip(columns.clone()).map(
                |((product, (other, other_inverse)), column)| Score {
                    similarity: f64::from(AREA * product - sum * other) * (inverse * other_inverse),
                    du: column as i32 - u as i32,
                    dv: row as i32 - v as i32,
                },
            ));
        }
        scores
    }
}

/// One over the length of a patch less its mean, times the square root of its area; 0 of a flat
/// one.
fn inverse_length(sum: i32, squares: i32) -> f64 {
    let spread = AREA * squares - sum * sum;
    if spread > AREA { 1.0 / f64::from(spread).sqrt() } else { 0.0 }
}

/// Returns the possible centres of patches within reach of one; `None` where a patch would leave
/// its image.
fn centers(at: usize, reach: usize, side: usize) -> Option<RangeInclusive<usize>> {
    let range = at.saturating_sub(reach).max(HALF)..=(at + reach).min(side.checked_sub(HALF + 1)?);
    (!range.is_empty()).then_some(range)
}

/// The patch about a pixel; `None` where it is not within the image.
fn patch(image: &Image<u8>, u: usize, v: usize) -> Option<[[i32; SIDE]; SIDE]> {
    let (left, top) = (u.checked_sub(HALF)?, v.checked_sub(HALF)?);
    let mut patch = [[0; SIDE]; SIDE];
    for (y, row) in patch.iter_mut().enumerate() {
        for (x, grey) in row.iter_mut().enumerate() {
            *grey = i32::from(image.get(left + x, top + y)?);
        }
    }
    Some(patch)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_are_the_cosines_of_patches_less_their_means() {
        let mut seed = 7u32;
        let pixels = (0..40 * 30).map(|_| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 24) as u8
        });
        let image = Image::new(40, 30, pixels.collect()).unwrap();
        let searched = SearchedImage::new(&image);
        let scores = searched.scores(&image, [20, 5], [8, 4]);
        assert_eq!(scores.len(), 17 * 7, "rows 3 to 9: those above have no whole patch");
        for score in scores {
            let less_mean = |u: i32, v: i32| {
                let patch = patch(&image, u as usize, v as usize).unwrap();
                let mean = patch.iter().flatten().sum::<i32>() as f64 / f64::from(AREA);
                patch
                    .as_flattened()
                    .iter()
                    .map(|&grey| f64::from(grey) - mean)
                    .collect::<Vec<f64>>()
            };
            let (a, b) = (less_mean(20, 5), less_mean(20 + score.du, 5 + score.dv));
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let cosine = dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt();
            assert!((score.similarity - cosine).abs() < 1e-9);
        }
        assert!(
            searched.scores(&image, [2, 5], [8, 4]).is_empty(),
            "the patch is not within the image"
        );
        let flat = Image::new(40, 30, vec![90; 1_200]).unwrap();
        assert!(
            SearchedImage::new(&flat)
                .scores(&image, [20, 15], [8, 4])
                .iter()
                .all(|score| score.similarity == 0.0)
        );
    }
}
