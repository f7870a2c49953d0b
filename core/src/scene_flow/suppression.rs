//! Non-maximum suppression: what of the filters' responses is a feature.
//!
//! A pixel is a peak when it reaches the threshold and no pixel within `radius` rows and columns is stronger, nor as strong and
//! earlier in scan order. Found block by block (Neubeck & Van Gool, *Efficient Non-Maximum Suppression*, ICPR 2006): a block of
//! radius + 1 pixels squared holds one peak at most, the first of its strongest pixels, and only that one is compared with its
//! surroundings. Peaks of the wider radius are peaks of the narrower one, so the sparse pass only asks the dense one's features again.

use bytemuck::{Pod, Zeroable};

/// Radius of the dense pass, px.
pub(super) const DENSE_RADIUS: usize = 3;
/// Radius of the sparse pass, px.
pub(super) const SPARSE_RADIUS: usize = 9;
/// Distance features keep from the image's border, px: space for a descriptor and for refinement.
pub(super) const FEATURE_MARGIN: usize = 8;
/// Classes of features: blob maximum, blob minimum, corner maximum, corner minimum. Only equals are compared.
pub(super) const CLASSES: usize = 4;
const BLOCK: usize = DENSE_RADIUS + 1;

/// A feature without its descriptor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Candidate {
    /// Column, px.
    pub u: u16,
    /// Row, px.
    pub v: u16,
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

/// Finds the features of both filters and hands them to `emit`: block row by block row, there by filter, there from left to right.
/// `extremes` holds two rows.
pub(super) fn suppress(blob: Field<'_>, corner: Field<'_>, response_min: i16, extremes: &mut [i16], mut emit: impl FnMut(Candidate)) {
    let width = blob.width;
    if width <= 2 * FEATURE_MARGIN {
        return;
    }
    let end = (blob.response.len() / width).saturating_sub(FEATURE_MARGIN);
    let Some((low, high)) = extremes.split_at_mut_checked(width) else { return };
    let Some(high) = high.get_mut(..width) else { return };
    for top in (FEATURE_MARGIN..end).step_by(BLOCK) {
        let rows = if end - top < BLOCK { end - top } else { BLOCK };
        for (class, field) in [(0, blob), (2, corner)] {
            column_extremes(field, top, rows, low, high);
            for left in (FEATURE_MARGIN..width - FEATURE_MARGIN).step_by(BLOCK) {
                let columns = if width - FEATURE_MARGIN - left < BLOCK { width - FEATURE_MARGIN - left } else { BLOCK };
                let block = Block { left, columns, top, rows };
                let (low, high) = (around(low, left), around(high, left));
                if let Some(strongest) = strongest::<1>(high, columns, response_min)
                    && let Some(found) = peak_of_block::<1>(field, block, high, strongest)
                {
                    emit(Candidate { class, ..found });
                }
                if let Some(strongest) = strongest::<-1>(low, columns, response_min)
                    && let Some(found) = peak_of_block::<-1>(field, block, low, strongest)
                {
                    emit(Candidate { class: class + 1, ..found });
                }
            }
        }
    }
}

#[derive(Clone, Copy)]
struct Block {
    left: usize,
    columns: usize,
    top: usize,
    rows: usize,
}

/// Columns of a block and [`DENSE_RADIUS`] on each side.
const AROUND: usize = BLOCK + 2 * DENSE_RADIUS;

/// The columns' extremes in and beside the block that begins at `left`.
fn around(row: &[i16], left: usize) -> &[i16; AROUND] {
    const NONE: &[i16; AROUND] = &[0; AROUND];
    row.get(left - DENSE_RADIUS..).and_then(|row| row.first_chunk()).unwrap_or(NONE)
}

/// The strongest of the block's columns, if it reaches the threshold.
fn strongest<const SIGN: i16>(extremes: &[i16; AROUND], columns: usize, response_min: i16) -> Option<i16> {
    let columns = extremes.iter().skip(DENSE_RADIUS).take(columns);
    let strongest = columns.fold(i16::MIN, |best, &x| if x * SIGN > best { x * SIGN } else { best });
    (strongest >= response_min).then_some(strongest)
}

/// Smallest and largest response of each column over the rows of a block row.
fn column_extremes(field: Field<'_>, top: usize, rows: usize, low: &mut [i16], high: &mut [i16]) {
    low.fill(i16::MAX);
    high.fill(i16::MIN);
    for row in field.response.chunks_exact(field.width.max(1)).skip(top).take(rows) {
        for ((low, high), &x) in low.iter_mut().zip(high.iter_mut()).zip(row) {
            *low = if x < *low { x } else { *low };
            *high = if x > *high { x } else { *high };
        }
    }
}

/// The first pixel of the block whose `SIGN` times response is `strongest`, if it is a peak. `extremes` are those of the columns around.
fn peak_of_block<const SIGN: i16>(field: Field<'_>, block: Block, extremes: &[i16; AROUND], strongest: i16) -> Option<Candidate> {
    for v in block.top..block.top + block.rows {
        let row = field.response.get(v * field.width + block.left..)?.get(..block.columns)?;
        if let Some(column) = row.iter().position(|&x| x * SIGN == strongest) {
            // Most candidates fall to a stronger column beside them, before any pixel is read.
            let beside = extremes.get(column..=column + 2 * DENSE_RADIUS)?;
            if beside.iter().fold(false, |beaten, &x| beaten | (x * SIGN > strongest)) {
                return None;
            }
            let u = block.left + column;
            let peak = is_peak::<SIGN, DENSE_RADIUS>(field, u, v, strongest);
            let sparse = peak && is_peak::<SIGN, SPARSE_RADIUS>(field, u, v, strongest);
            return peak.then_some(Candidate { u: u as u16, v: v as u16, class: 0, sparse: u8::from(sparse) });
        }
    }
    None
}

/// Whether no response around (u, v) is stronger, nor as strong and earlier.
fn is_peak<const SIGN: i16, const RADIUS: usize>(field: Field<'_>, u: usize, v: usize, strongest: i16) -> bool {
    let (left, top) = (u.saturating_sub(RADIUS), v.saturating_sub(RADIUS));
    let columns = if u + RADIUS < field.width { u + RADIUS + 1 - left } else { field.width - left };
    for y in top..=v + RADIUS {
        let Some(row) = field.response.get(y * field.width + left..).and_then(|rest| rest.get(..columns)) else { break };
        // As strong is too strong before (u, v) in scan order, and allowed from there on.
        let bound = if y < v { strongest } else { strongest + 1 };
        let beaten = row.iter().fold(false, |beaten, &x| beaten | (x * SIGN >= bound));
        if beaten || (y == v && row.iter().take(u - left).any(|&x| x * SIGN == strongest)) {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::vec::Vec;

    /// The definition, pixel by pixel.
    fn peaks(response: &[i16], width: usize, class: u8, sign: i16, radius: usize, response_min: i16) -> Vec<(u16, u16, u8)> {
        let height = response.len() / width;
        let mut found = Vec::new();
        for v in FEATURE_MARGIN..height - FEATURE_MARGIN {
            for u in FEATURE_MARGIN..width - FEATURE_MARGIN {
                let here = sign * response[v * width + u];
                let mut peak = here >= response_min;
                for y in v.saturating_sub(radius)..=(v + radius).min(height - 1) {
                    for x in u.saturating_sub(radius)..=(u + radius).min(width - 1) {
                        let there = sign * response[y * width + x];
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
            let mut noise = || -> Vec<i16> { (0..width * height).map(|_| random.below(240) as i16 - 120).collect() };
            let (blob, corner) = (noise(), noise());
            let mut found = Vec::new();
            let fields = (Field { response: &blob, width }, Field { response: &corner, width });
            suppress(fields.0, fields.1, 5, &mut [0; 2 * 67], |candidate| found.push(candidate));
            for sparse in [false, true] {
                let radius = if sparse { SPARSE_RADIUS } else { DENSE_RADIUS };
                let mut expected = Vec::new();
                for (class, field, sign) in [(0, &blob, 1), (1, &blob, -1), (2, &corner, 1), (3, &corner, -1)] {
                    expected.extend(peaks(field, width, class, sign, radius, 5));
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
