//! Non-maximum suppression: what of the filters' responses is a feature.
//!
//! A pixel is a peak when it reaches the threshold and no pixel within `radius` rows and columns is
//! stronger, nor as strong and earlier in scan order. Found four rows at a time: the strongest of
//! each 7 x 7 px, first down the columns and then along the rows (each four rows share those that
//! lie around all of them, as in van Herk's running maximum), leaves few pixels that are as strong
//! as their surroundings; these are looked at one by one. Peaks of the wider radius are peaks of
//! the narrower one, so the sparse pass only asks the dense one's features again.
//!
//! Time: some ten instructions of vectors of eight pixels, for each four rows, filter and sign.

use bytemuck::{Pod, Zeroable};

/// Radius of the dense pass, px.
pub(super) const DENSE_RADIUS: usize = 3;
/// Radius of the sparse pass, px.
pub(super) const SPARSE_RADIUS: usize = 9;
/// Distance features keep from the image's border, px: space for a descriptor and for refinement.
pub(super) const FEATURE_MARGIN: usize = 8;
/// Classes of features: blob maximum, blob minimum, corner maximum, corner minimum. Only equals are
/// compared.
pub(super) const CLASSES: usize = 4;
/// Rows and columns of a block: of its pixels no two are farther apart than the radius.
const BLOCK: usize = DENSE_RADIUS + 1;
/// Rows of working memory: a block's strongest and weakest responses, and flags.
pub(super) const SCRATCH_ROWS: usize = 2 * BLOCK + 1;

/// A feature without its descriptor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Candidate {
    /// Column, px.
    pub u: u16,
    /// Row, px.
    pub v: u16,
    /// Magnitude of the filter's response.
    pub response: u16,
    /// 0..[`CLASSES`].
    pub class: u8,
    /// 1 when it is a peak within [`SPARSE_RADIUS`] as well.
    pub sparse: u8,
}

/// A filter's responses.
#[derive(Clone, Copy)]
pub(super) struct Field<'a> {
    /// Row by row.
    pub response: &'a [i16],
    /// Columns.
    pub width: usize,
}

/// Finds the features of both filters and hands them to `emit`: four rows by four rows, there by
/// filter, there by four columns from left to right, maxima first; no 4 x 4 px hold two peaks of a
/// class. `scratch` holds [`SCRATCH_ROWS`] rows.
#[inline(always)]
pub(super) fn suppress(
    blob: Field<'_>,
    corner: Field<'_>,
    response_min: i16,
    scratch: &mut [i16],
    mut emit: impl FnMut(Candidate),
) {
    let width = blob.width;
    if width <= 2 * FEATURE_MARGIN {
        return;
    }
    let end = (blob.response.len() / width).saturating_sub(FEATURE_MARGIN);
    let inner = width - 2 * FEATURE_MARGIN;
    // Two strips of maxima and minima, and a flag for each column, share the scratch.
    let Some((high, rest)) = scratch.split_at_mut_checked(BLOCK * width) else { return };
    let Some((low, flags)) = rest.split_at_mut_checked(BLOCK * width) else { return };
    let Some(flags) =
        bytemuck::cast_slice_mut::<i16, u8>(flags).get_mut(..inner.next_multiple_of(BLOCK))
    else {
        return;
    };
    // At most one maximum and one minimum of each block can be the strongest around it.
    for top in (FEATURE_MARGIN..end).step_by(BLOCK) {
        let rows = if end - top < BLOCK { end - top } else { BLOCK };
        for (class, field) in [(0, blob), (2, corner)] {
            flags.fill(0);
            flag_strongest::<1>(field, [top, rows], response_min, high, flags);
            flag_strongest::<-1>(field, [top, rows], response_min, low, flags);
            for (left, &flagged) in
                (FEATURE_MARGIN..).step_by(BLOCK).zip(flags.as_chunks::<BLOCK>().0)
            {
                // Most blocks have no response above the threshold and are passed over.
                let flagged = u32::from_le_bytes(flagged);
                if flagged != 0 {
                    let maxima = Block::<1> { field, strongest: high, left, top, flagged }.peak();
                    let minima =
                        Block::<-1> { field, strongest: low, left, top, flagged: flagged >> BLOCK }
                            .peak();
                    maxima.into_iter().for_each(|found| emit(Candidate { class, ..found }));
                    minima
                        .into_iter()
                        .for_each(|found| emit(Candidate { class: class + 1, ..found }));
                }
            }
        }
    }
}

/// The stronger of two responses.
#[inline(always)]
fn stronger<const SIGN: i16>(a: i16, b: i16) -> i16 {
    if SIGN > 0 { a.max(b) } else { a.min(b) }
}

/// Flags the pixels of rows `top..top + rows` that reach the threshold and that nothing within
/// [`DENSE_RADIUS`] is stronger than: a bit a row, maxima below minima, for each column from
/// [`FEATURE_MARGIN`] on.
#[inline(always)]
fn flag_strongest<const SIGN: i16>(
    field: Field<'_>,
    [top, rows]: [usize; 2],
    response_min: i16,
    strongest: &mut [i16],
    flags: &mut [u8],
) {
    let width = field.width.max(1);
    down_columns::<SIGN>(field, top, strongest);
    let here = field.response.chunks_exact(width).skip(top).take(rows);
    let first = if SIGN > 0 { 0 } else { BLOCK };
    for ((row, strongest), bit) in here.zip(strongest.chunks_exact(width)).zip(first..) {
        along_row::<SIGN>(row, strongest, response_min, 1 << bit, flags);
    }
}

/// The strongest of each column within [`DENSE_RADIUS`] of each of the rows `top..top + 4`, a row
/// each. Nothing where rows are missing.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "all slices are cut to the same length first")]
fn down_columns<const SIGN: i16>(
    field: Field<'_>,
    top: usize,
    strongest: &mut [i16],
) -> Option<()> {
    let width = field.width;
    let row = |y: usize| field.response.get(y * width..)?.get(..width);
    let first = top.checked_sub(DENSE_RADIUS)?;
    let [a, b, c] = [row(first)?, row(first + 1)?, row(first + 2)?];
    let [d, e, f, g] = [row(top)?, row(top + 1)?, row(top + 2)?, row(top + 3)?];
    let [h, i, j] = [row(top + 4)?, row(top + 5)?, row(top + 6)?];
    let (one, rest) = strongest.split_at_mut_checked(width)?;
    let (two, rest) = rest.split_at_mut_checked(width)?;
    let (three, rest) = rest.split_at_mut_checked(width)?;
    let four = rest.get_mut(..width)?;
    for u in 0..width {
        // Around all four rows lie these; above and below they differ.
        let all = stronger::<SIGN>(stronger::<SIGN>(d[u], e[u]), stronger::<SIGN>(f[u], g[u]));
        let above = stronger::<SIGN>(c[u], b[u]);
        let below = stronger::<SIGN>(h[u], i[u]);
        one[u] = stronger::<SIGN>(all, stronger::<SIGN>(above, a[u]));
        two[u] = stronger::<SIGN>(all, stronger::<SIGN>(above, h[u]));
        three[u] = stronger::<SIGN>(all, stronger::<SIGN>(below, c[u]));
        four[u] = stronger::<SIGN>(all, stronger::<SIGN>(below, j[u]));
    }
    Some(())
}

/// Flags what of a row is as strong as the strongest of the columns about it. Nothing where a row
/// is too short.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "all slices are cut to the same length first")]
fn along_row<const SIGN: i16>(
    row: &[i16],
    strongest: &[i16],
    response_min: i16,
    flag: u8,
    flags: &mut [u8],
) -> Option<()> {
    let n = row.len().checked_sub(2 * FEATURE_MARGIN)?;
    let from = |shift: usize| strongest.get(FEATURE_MARGIN - DENSE_RADIUS + shift..)?.get(..n);
    let [a, b, c, d, e, f, g] =
        [from(0)?, from(1)?, from(2)?, from(3)?, from(4)?, from(5)?, from(6)?];
    let (row, flags) = (row.get(FEATURE_MARGIN..)?.get(..n)?, flags.get_mut(..n)?);
    for u in 0..n {
        let beside = stronger::<SIGN>(stronger::<SIGN>(a[u], b[u]), stronger::<SIGN>(f[u], g[u]));
        let about = stronger::<SIGN>(stronger::<SIGN>(c[u], d[u]), stronger::<SIGN>(beside, e[u]));
        // Equal pixels are all flagged here; `is_first` breaks the tie.
        let is_strongest = (row[u] == about) & (SIGN * about >= response_min);
        flags[u] |= if is_strongest { flag } else { 0 };
    }
    Some(())
}

/// Four rows and columns with flagged pixels.
struct Block<'a, const SIGN: i16> {
    field: Field<'a>,
    /// The strongest of each column about each of the rows.
    strongest: &'a [i16],
    left: usize,
    top: usize,
    /// A byte a column, in it a bit a row.
    flagged: u32,
}

impl<const SIGN: i16> Block<'_, SIGN> {
    /// The peak, if there is one: all flagged pixels are as strong, so that the first in scan order
    /// alone may be one.
    #[inline(always)]
    fn peak(&self) -> Option<Candidate> {
        let row = (0..BLOCK).find(|row| self.columns(*row) != 0)?;
        self.peak_at(self.left + self.columns(row).trailing_zeros() as usize / 8, row)
    }

    /// Returns the columns in which a row has flags, a byte each.
    #[inline(always)]
    fn columns(&self, row: usize) -> u32 {
        self.flagged >> row & 0x0101_0101
    }

    /// Returns true if no pixel within [`DENSE_RADIUS`] that is as strong comes earlier in scan
    /// order.
    #[inline(always)]
    fn is_first(&self, u: usize, v: usize, response: i16) -> Option<bool> {
        // Eight columns of a row are one vector; those that are later, or too far, count as
        // different.
        const { assert!(DENSE_RADIUS == 3) }
        const EARLIER: [i16; 8] = [0, 0, 0, -1, -1, -1, -1, -1];
        const ABOVE: [i16; 8] = [0, 0, 0, 0, 0, 0, 0, -1];
        let equal_in = |y: usize, ignored: [i16; 8]| {
            let row = self
                .field
                .response
                .get(y * self.field.width + u - DENSE_RADIUS..)?
                .first_chunk::<8>()?;
            Some(
                row.iter()
                    .zip(ignored)
                    .fold(false, |found, (x, ignored)| found | ((x ^ response) | ignored == 0)),
            )
        };
        let above = equal_in(v - 3, ABOVE)? | equal_in(v - 2, ABOVE)? | equal_in(v - 1, ABOVE)?;
        Some(!(above | equal_in(v, EARLIER)?))
    }

    #[inline(always)]
    fn peak_at(&self, u: usize, row: usize) -> Option<Candidate> {
        let (width, v) = (self.field.width, self.top + row);
        let response = *self.field.response.get(v * width + u)?;
        if !self.is_first(u, v, response)? {
            return None;
        }
        // Most are weaker than a pixel of the seven rows about them.
        let about = Surroundings::new(u, width);
        let beaten = about.any(self.strongest, row, |x| x * SIGN > SIGN * response)?;
        // A sparse feature is also the peak of the wider neighbourhood.
        let sparse = !beaten && is_peak::<SIGN>(self.field, u, v, SIGN * response);
        Some(Candidate {
            u: u as u16,
            v: v as u16,
            response: response.unsigned_abs(),
            class: 0,
            sparse: u8::from(sparse),
        })
    }
}

/// The columns within [`SPARSE_RADIUS`] of a pixel: more than a vector of 16 has, and fewer than
/// two.
#[derive(Clone, Copy)]
struct Surroundings {
    left: usize,
    columns: usize,
    width: usize,
}

impl Surroundings {
    #[inline(always)]
    fn new(u: usize, width: usize) -> Self {
        // At the margin as well.
        const { assert!(FEATURE_MARGIN + SPARSE_RADIUS >= 16 && 2 * SPARSE_RADIUS < 32) }
        let left = u.saturating_sub(SPARSE_RADIUS);
        let end = if u + SPARSE_RADIUS < width { u + SPARSE_RADIUS + 1 } else { width };
        Self { left, columns: end - left, width }
    }

    /// Returns true if any response of a row meets a condition. `None` if there is no such row.
    #[inline(always)]
    fn any(&self, rows: &[i16], row: usize, is_so: impl Fn(i16) -> bool) -> Option<bool> {
        let row = rows.get(row * self.width + self.left..)?.get(..self.columns)?;
        let (first, last) = (row.first_chunk::<16>()?, row.last_chunk::<16>()?);
        Some(first.iter().zip(last).fold(false, |any, (&a, &b)| any | is_so(a) | is_so(b)))
    }
}

/// Returns true if no response within [`SPARSE_RADIUS`] of (u, v) is stronger, nor as strong and
/// earlier.
#[inline(always)]
fn is_peak<const SIGN: i16>(field: Field<'_>, u: usize, v: usize, strongest: i16) -> bool {
    let about = Surroundings::new(u, field.width);
    for y in v.saturating_sub(SPARSE_RADIUS)..=v + SPARSE_RADIUS {
        // As strong is too strong before (u, v) in scan order, and allowed from there on.
        let bound = if y < v { strongest } else { strongest + 1 };
        match about.any(field.response, y, |x| x * SIGN >= bound) {
            Some(true) => return false,
            Some(false) => {}
            None => break,
        }
    }
    let before = field.response.get(v * field.width + about.left..).unwrap_or_default();
    !before.iter().take(u - about.left).any(|&x| x * SIGN == strongest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::vec::Vec;

    /// The definition, pixel by pixel.
    fn peaks(
        Field { response, width }: Field<'_>,
        class: u8,
        sign: i16,
        radius: usize,
        response_min: i16,
    ) -> Vec<(u16, u16, u8)> {
        let height = response.len() / width;
        let mut found = Vec::new();
        for v in FEATURE_MARGIN..height - FEATURE_MARGIN {
            for u in FEATURE_MARGIN..width - FEATURE_MARGIN {
                // Minima are maxima of the negated response.
                let here = sign * response[v * width + u];
                let mut peak = here >= response_min;
                for y in v.saturating_sub(radius)..=(v + radius).min(height - 1) {
                    for x in u.saturating_sub(radius)..=(u + radius).min(width - 1) {
                        let there = sign * response[y * width + x];
                        // Of equal ones the first in scan order is the peak.
                        peak &= there < here || (there == here && (y, x) >= (v, u));
                    }
                }
                if peak {
                    found.push((u as u16, v as u16, class));
                }
            }
        }
        found
    }

    #[test]
    fn finds_exactly_the_peaks_of_the_definition_ties_included() {
        let (width, height) = (67, 51);
        for seed in 0..4 {
            // Few distinct values: ties everywhere.
            let mut random = Random::new(seed);
            let mut noise = || -> Vec<i16> {
                (0..width * height).map(|_| random.below(240) as i16 - 120).collect()
            };
            let (blob, corner) = (noise(), noise());
            let mut found = Vec::new();
            let fields = (Field { response: &blob, width }, Field { response: &corner, width });
            suppress(fields.0, fields.1, 5, &mut [0; SCRATCH_ROWS * 67], |candidate| {
                found.push(candidate)
            });
            for sparse in [false, true] {
                let radius = if sparse { SPARSE_RADIUS } else { DENSE_RADIUS };
                let mut expected = Vec::new();
                for (class, field, sign) in
                    [(0, &blob, 1), (1, &blob, -1), (2, &corner, 1), (3, &corner, -1)]
                {
                    let field = Field { response: field, width };
                    expected.extend(peaks(field, class, sign, radius, 5));
                }
                let accepted = found.iter().filter(|c| !sparse || c.sparse == 1);
                let mut accepted: Vec<_> = accepted.map(|c| (c.u, c.v, c.class)).collect();
                accepted.sort_unstable();
                expected.sort_unstable();
                assert!(!expected.is_empty());
                assert_eq!(accepted, expected);
            }
        }
    }
}
