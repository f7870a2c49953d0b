//! Patches of a left image matched to the right one, also across rows: first at half size over a
//! wide window, then at full size about it, and below the pixel by a parabola. Similarity is
//! normalised, so that exposure does not matter.

use super::correlation::{HALF, Score, SearchedImage};
use crate::formats::Image;

/// Pixels from one patch to the next, with so many pairs or more.
const STEP_PX: usize = 28;
const MANY_PAIRS: usize = 10;
/// Fewest pixels from one patch to the next: nearer ones show the same.
const STEP_LEAST_PX: usize = 11;
/// Half side of patches at full size, px; at half size they are smaller.
const FINE: i32 = 5;
const COARSE: i32 = HALF as i32;
/// Pixels of a patch at full size.
const FINE_AREA: usize = ((2 * FINE + 1) * (2 * FINE + 1)) as usize;
/// Reach of the search for a match to either side, as a share of the width, and in pixels where
/// that is more: as far as stereo searches.
const REACH: f64 = 0.12;
const REACH_PX: usize = 255;
/// Reach as a share of the width at most: of what is nearer both cameras see too little.
const REACH_MOST: f64 = 0.4;
/// Pixels at half size by which the way back from a match may miss its patch.
const BACK_PX: i32 = 1;
/// Reach of the search above and below, px: first the near one, then the wide one where that finds
/// fewer matches than a pair should have.
const REACH_ROWS_PX: usize = 10;
const WIDE_ROWS_PX: usize = 40;
const FEW_MATCHES: usize = 24;
/// Least similarity of a match.
const SIMILAR: f64 = 0.9;
/// Margin by which a match must be better than the second best position.
const CLEAR: f64 = 0.05;
/// Least contrast of a patch along rows and columns, grey levels squared.
const TEXTURE: f64 = 60.0;

/// A patch that was found again.
pub struct PatchMatch {
    /// Column in the left image, px.
    pub u_px: f64,
    /// Distance by which the match lies further left in the right image, px.
    pub disparity_px: f64,
    /// Distance by which the match lies lower in the right image, px.
    pub rows_px: f64,
    /// Brightness in the left image over that in the right one.
    pub brightness: f64,
}

/// The image at half size: means of four pixels.
fn half(image: &Image<u8>) -> Option<Image<u8>> {
    let (width, height) = (image.width() / 2, image.height() / 2);
    let mean = |u: usize, v: usize| {
        let at = |du: usize, dv: usize| u16::from(image.get(2 * u + du, 2 * v + dv).unwrap_or(0));
        ((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) + 2) / 4) as u8
    };
    Image::new(
        width,
        height,
        (0..height)
            .flat_map(|v| (0..width).map(move |u| (u, v)))
            .map(|(u, v)| mean(u, v))
            .collect(),
    )
}

/// A patch less its mean, and its length.
struct Patch {
    values: [f32; FINE_AREA],
    length: f32,
    mean: f32,
}

/// The patch about a pixel; `None` where it is not within the image.
fn patch(image: &Image<u8>, u: i32, v: i32) -> Option<Patch> {
    let within = |at: i32, side: usize| at >= FINE && at + FINE < side as i32;
    if !(within(u, image.width()) && within(v, image.height())) {
        return None;
    }
    let side = (2 * FINE + 1) as usize;
    let from_first =
        image.pixels().get((v - FINE) as usize * image.width() + (u - FINE) as usize..)?;
    let mut values = [0.0; FINE_AREA];
    for (values, row) in values.chunks_exact_mut(side).zip(from_first.chunks(image.width())) {
        values.iter_mut().zip(row).for_each(|(value, &grey)| *value = f32::from(grey));
    }
    let mean = values.iter().sum::<f32>() / FINE_AREA as f32;
    values.iter_mut().for_each(|value| *value -= mean);
    let length = values.iter().map(|value| value * value).sum::<f32>().sqrt();
    Some(Patch { values, length, mean })
}

/// Cosine of two patches; -1 where one is flat or outside.
fn similarity(a: &Patch, b: Option<&Patch>) -> f64 {
    let Some(b) = b.filter(|b| a.length > 1.0 && b.length > 1.0) else { return -1.0 };
    f64::from(
        a.values.iter().zip(&b.values).map(|(a, b)| a * b).sum::<f32>() / (a.length * b.length),
    )
}

/// Returns true if a patch has edges along rows and along columns.
fn has_corners(image: &Image<u8>, u: i32, v: i32) -> bool {
    let at =
        |du: i32, dv: i32| f64::from(image.get((u + du) as usize, (v + dv) as usize).unwrap_or(0));
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (du, dv) in (-COARSE..=COARSE).flat_map(|du| (-COARSE..=COARSE).map(move |dv| (du, dv))) {
        let (x, y) = (at(du + 1, dv) - at(du - 1, dv), at(du, dv + 1) - at(du, dv - 1));
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
    }
    let count = f64::from((2 * COARSE + 1) * (2 * COARSE + 1));
    let smaller = 0.5 * (xx + yy - ((xx - yy) * (xx - yy) + 4.0 * xy * xy).sqrt());
    smaller / count > TEXTURE
}

/// Pixels from one patch to the next: few pairs are looked at more densely.
pub fn step_px(pairs: usize) -> usize {
    let share = (pairs.max(1) as f64 / MANY_PAIRS as f64).sqrt().min(1.0);
    ((STEP_PX as f64 * share) as usize).max(STEP_LEAST_PX)
}

/// The matches of a pair, of patches `step_px` apart. Each is found from the left image and again
/// from the right one.
pub fn matches(left: &Image<u8>, right: &Image<u8>, step_px: usize) -> Vec<PatchMatch> {
    let (Some(small_left), Some(small_right)) = (half(left), half(right)) else {
        return Vec::new();
    };
    let search = Search {
        from: [left, right],
        small: [&small_left, &small_right],
        searched: [&small_left, &small_right].map(SearchedImage::new),
    };
    let within = |rows_px: usize| -> Vec<PatchMatch> {
        let centers = (step_px..left.height())
            .step_by(step_px)
            .flat_map(|v| (step_px..left.width()).step_by(step_px).map(move |u| (u, v)));
        centers.filter_map(|(u, v)| search.find([u, v], rows_px)).collect()
    };
    let near = within(REACH_ROWS_PX);
    if near.len() >= FEW_MATCHES {
        return near;
    }
    // By chance a wide search finds some more; rows that are far apart, many.
    let wide = within(WIDE_ROWS_PX);
    if wide.len() > 2 * near.len() { wide } else { near }
}

/// A pair at both sizes.
struct Search<'i> {
    from: [&'i Image<u8>; 2],
    small: [&'i Image<u8>; 2],
    searched: [SearchedImage<'i>; 2],
}

impl Search<'_> {
    fn find(&self, [u, v]: [usize; 2], rows_px: usize) -> Option<PatchMatch> {
        let ([small_left, small_right], [left, right]) = (self.small, &self.searched);
        let (small_u, small_v) = (u / 2, v / 2);
        if small_u < 5 || small_v < 5 || !has_corners(small_left, small_u as i32, small_v as i32) {
            return None;
        }
        let there = clear_best(right, small_left, [small_u, small_v], rows_px)?;
        // A match that is not found again from the other side is a repeated pattern, or hidden.
        let moved = |at: usize, by: i32| usize::try_from(at as i32 + by).ok();
        let back_from = [moved(small_u, there.du)?, moved(small_v, there.dv)?];
        let back = clear_best(left, small_right, back_from, rows_px)?;
        if (there.du + back.du).abs() > BACK_PX || (there.dv + back.dv).abs() > BACK_PX {
            return None;
        }
        refined(
            self.from,
            [u, v].map(|at| at as i32),
            [u as i32 + 2 * there.du, v as i32 + 2 * there.dv],
        )
    }
}

/// The best place of a patch; `None` where it is not much better than all others, or at the end of
/// the search.
fn clear_best(
    searched: &SearchedImage<'_>,
    image: &Image<u8>,
    at: [usize; 2],
    rows_px: usize,
) -> Option<Score> {
    let width = image.width() as f64;
    let columns = (REACH * width).max((REACH_PX / 2) as f64).min(REACH_MOST * width) as usize;
    let reach = [columns, rows_px / 2];
    let scores = searched.scores(image, at, reach);
    let &best = scores.iter().max_by(|a, b| a.similarity.total_cmp(&b.similarity))?;
    let apart = |other: &&Score| (other.du - best.du).abs() > 2 || (other.dv - best.dv).abs() > 2;
    let second = scores.iter().filter(apart).map(|score| score.similarity).fold(-1.0, f64::max);
    let at_the_end =
        best.du.unsigned_abs() as usize == reach[0] || best.dv.unsigned_abs() as usize == reach[1];
    let clear = best.similarity >= SIMILAR && best.similarity - second >= CLEAR && !at_the_end;
    clear.then_some(best)
}

/// The place at full size, below the pixel.
fn refined(
    [left, right]: [&Image<u8>; 2],
    [u, v]: [i32; 2],
    [near_u, near_v]: [i32; 2],
) -> Option<PatchMatch> {
    let sought = patch(left, u, v)?;
    let score =
        |du: i32, dv: i32| similarity(&sought, patch(right, near_u + du, near_v + dv).as_ref());
    let around = (-3..=3).flat_map(|du| (-3..=3).map(move |dv| (du, dv)));
    let (best, du, dv) =
        around.map(|(du, dv)| (score(du, dv), du, dv)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    if best < SIMILAR || du.abs() == 3 || dv.abs() == 3 {
        return None;
    }
    let vertex = |before: f64, after: f64| {
        let bend = before + after - 2.0 * best;
        if bend < -1e-9 { 0.5 * (before - after) / bend } else { 0.0 }
    };
    let sub_u = vertex(score(du - 1, dv), score(du + 1, dv));
    let sub_v = vertex(score(du, dv - 1), score(du, dv + 1));
    let found = patch(right, near_u + du, near_v + dv)?;
    Some(PatchMatch {
        u_px: f64::from(u),
        disparity_px: f64::from(u - near_u - du) - sub_u,
        rows_px: f64::from(near_v + dv - v) + sub_v,
        brightness: f64::from((sought.mean + 1.0) / (found.mean + 1.0)),
    })
}
