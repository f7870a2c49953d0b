//! Rows that do not agree: how far below the right image's row the left one sees the same point.
//!
//! A calibration that leaves a pixel there costs a matcher that compares along rows both estimates and precision, most where the
//! error is largest, in the corners. Every match shows it, moving or not, so that one frame tells: a polynomial of second
//! degree over the image is fitted to the differences of rows, by weighted least squares whose weights narrow from pass to pass.

use super::{
    APPLY_ABOVE_PX, APPLY_UNTIL_PX,
    information::{FrameInformation, Information, Prior},
};
use crate::{
    geometry::{Shares, StereoRig},
    state::Visitor,
};

/// Terms: constant, column, row, their squares and their product.
const TERMS: usize = 6;
/// Noise of a difference of two rows, px.
const NOISE_PX: f64 = 0.15;
/// Error at which a match weighs a quarter, px, from pass to pass.
const PASSES_PX: [f64; 3] = [1.0, 0.5, 0.25];
/// Matches a frame must have to say something.
const MATCHES_MIN: usize = 100;
/// Frames that must have said something before rows are moved.
const FRAMES_MIN: u32 = 2;
/// Least change of what rows are moved by, px: a smaller one is worth less than images of a camera that hangs being equal.
const CHANGE_MIN_PX: f64 = 0.05;
/// Before the first frame, every term is 0 within this, px.
const PRIOR: Prior<TERMS> = Prior { mean: [0.0; TERMS], sigma: [2.0; TERMS], frame_sigma: [0.0; TERMS] };

/// Differences of rows over the image, px: a polynomial in the shares of the way from the principal point to side and first row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RowError(pub(in crate::rectify) [f64; TERMS]);

/// Powers of a pixel's shares, in the order of the terms.
fn basis([s, t]: [f64; 2]) -> [f64; TERMS] {
    [1.0, s, t, s * s, s * t, t * t]
}

impl RowError {
    /// The difference at shares of the way from the principal point to side and first row.
    fn at(&self, shares: [f64; 2]) -> f64 {
        self.0.iter().zip(basis(shares)).fold(0.0, |sum, (term, power)| sum + term * power)
    }

    /// The largest difference, of this error and another one, at corners, middles of the borders and the principal point.
    fn largest_from(&self, other: &Self) -> f64 {
        let mut largest = 0.0;
        for shares in [-1.0, 0.0, 1.0].map(|s| [-1.0, 0.0, 1.0].map(|t| [s, t])).as_flattened() {
            let difference = libm::fabs(self.at(*shares) - other.at(*shares));
            largest = if difference > largest { difference } else { largest };
        }
        largest
    }

    /// The largest difference.
    pub(crate) fn largest_px(&self) -> f64 {
        self.largest_from(&Self::default())
    }

    /// The angle by which the right camera is turned, which is what grows with the column, rad.
    pub(crate) fn roll_rad(&self, rig: &StereoRig) -> f64 {
        let ([_, column_px, ..], [across, _]) = (self.0, Shares::per_px(rig));
        column_px * across
    }

    /// Prepares it for the images of a rig.
    pub(crate) fn for_rig(&self, rig: &StereoRig) -> RowShift {
        RowShift { terms_px: self.0.map(|term| term as f32), shares: Shares::of(rig) }
    }
}

/// A [`RowError`] for the images of a rig, in single precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RowShift {
    terms_px: [f32; TERMS],
    shares: Shares,
}

impl RowShift {
    /// How far below row `v` of the right image the left one sees what is in column `u` there, px.
    #[inline(always)]
    pub(crate) fn at(&self, [u_px, v_px]: [f32; 2]) -> f32 {
        let (s, t) = (self.shares.across(u_px), self.shares.down(v_px));
        let [constant, column, row, column_2, both, row_2] = self.terms_px;
        (constant + t * (row + t * row_2)) + s * ((column + t * both) + s * column_2)
    }
}

/// Finds the error of the rows, and says what of it is to be taken out.
#[derive(Clone, Debug)]
pub(super) struct RowCalibration {
    information: Information<TERMS>,
    applied: RowError,
    frames: u32,
}

impl RowCalibration {
    /// Before the first frame.
    pub(super) const NONE: Self = Self { information: Information::NONE, applied: RowError([0.0; TERMS]), frames: 0 };

    /// What is taken out of the next frame's rows.
    pub(super) fn applied(&self) -> &RowError {
        &self.applied
    }

    /// What is known; `None` while that is too little.
    pub(super) fn known(&self) -> Option<RowError> {
        let (terms, _) = self.information.estimate(&PRIOR)?;
        (self.frames >= FRAMES_MIN).then_some(RowError(terms))
    }

    /// Learns from a frame's matches: where the right camera sees each, and how far below that the left one does, after what is
    /// [`RowCalibration::applied`] was taken out.
    // Never inlined: its matrices must not stay in the frame of a step.
    #[inline(never)]
    pub(super) fn update(&mut self, rig: &StereoRig, matches: impl Iterator<Item = ([f64; 2], f64)> + Clone) {
        let [across, down] = Shares::per_px(rig);
        let shares = |[u, v]: [f64; 2]| [(u - rig.center_u_px) * across, (v - rig.center_v_px) * down];
        let mut found = self.information;
        for scale_px in PASSES_PX {
            let Some((terms, _)) = found.estimate(&PRIOR) else { return };
            let mut frame = FrameInformation::ZERO;
            let mut count = 0;
            for (at, difference_px) in matches.clone() {
                let at = shares(at);
                let error = difference_px + self.applied.at(at) - RowError(terms).at(at);
                let share = 1.0 / (1.0 + error * error / (scale_px * scale_px));
                frame.add(&basis(at), -error, share * share / (NOISE_PX * NOISE_PX));
                count += 1;
            }
            found = self.information;
            if count < MATCHES_MIN || found.take_exact(&frame, terms).is_none() {
                return;
            }
        }
        self.information = found;
        self.frames = self.frames.saturating_add(1);
    }

    /// Moves what is taken out to what is known, where it is worth it.
    pub(super) fn apply(&mut self) {
        let Some(known) = self.known() else { return };
        let least_px = if self.applied.largest_px() > 0.0 { APPLY_UNTIL_PX } else { APPLY_ABOVE_PX };
        let target = if known.largest_px() > least_px { known } else { RowError::default() };
        if target.largest_from(&self.applied) > CHANGE_MIN_PX {
            self.applied = target;
        }
    }

    /// Visits every field.
    pub(super) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { information, applied, frames } = self;
        information.visit(visitor);
        visitor.f64s(&mut applied.0);
        visitor.u32(frames);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::vec::Vec;

    const RIG: StereoRig = StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: 0.5 };
    /// As KITTI's grey cameras have it: 1.5 px in the corners, and the other way in the ones beside them.
    const KITTI: RowError = RowError([0.2, 0.05, 0.1, 0.2, -1.4, 0.1]);

    /// Matches all over the image, a tenth of them wrong, as both cameras of a rig with these errors see them after the right image was
    /// moved by what is applied.
    fn matches(error: &RowError, applied: &RowError, count: usize, random: &mut Random) -> Vec<([f64; 2], f64)> {
        let mut uniform = move || f64::from(random.next_u32()) / f64::from(u32::MAX);
        (0..count)
            .map(|at| {
                let shares = [uniform() * 2.0 - 1.0, uniform() * 2.0 - 1.0];
                let noise = if at % 10 == 0 { uniform() * 4.0 - 2.0 } else { (uniform() + uniform() - 1.0) * 0.3 };
                let pixel = [RIG.center_u_px * (1.0 + shares[0]), RIG.center_v_px * (1.0 + shares[1])];
                (pixel, error.at(shares) - applied.at(shares) + noise)
            })
            .collect()
    }

    fn driven(error: &RowError, count: usize, frames: usize) -> RowCalibration {
        let (mut random, mut rows) = (Random::new(3), RowCalibration::NONE);
        for _ in 0..frames {
            let applied = *rows.applied();
            rows.update(&RIG, matches(error, &applied, count, &mut random).into_iter());
            rows.apply();
        }
        rows
    }

    #[test]
    fn rows_that_differ_are_found_in_two_frames_and_kept() {
        for frames in [2, 3, 60] {
            let rows = driven(&KITTI, 800, frames);
            assert!(rows.applied().largest_from(&KITTI) < 0.1, "{frames}: {:?}", rows.applied());
        }
        let [second, last] = [3, 60].map(|frames| *driven(&KITTI, 800, frames).applied());
        assert!(second.largest_from(&last) < 0.1, "what is applied stays");
    }

    #[test]
    fn rows_that_agree_are_left_alone_and_few_matches_say_nothing() {
        let sound = driven(&RowError::default(), 800, 40);
        assert_eq!(*sound.applied(), RowError::default());
        assert!(sound.known().unwrap().largest_px() < 0.06, "{:?}", sound.known());
        let few = driven(&KITTI, MATCHES_MIN - 1, 40);
        assert!(few.known().is_none() && few.applied().largest_px() == 0.0);
    }

    #[test]
    fn matches_without_a_number_change_nothing() {
        let mut rows = driven(&KITTI, 800, 5);
        let before = rows.clone();
        rows.update(&RIG, (0..200).map(|at| ([f64::from(at), 5.0], f64::NAN)));
        assert_eq!(rows.information, before.information);
        rows.apply();
        assert_eq!(rows.applied(), before.applied());
    }

    #[test]
    fn the_shift_of_a_rig_is_the_error_at_its_pixels() {
        let shift = KITTI.for_rig(&RIG);
        for shares in [[0.0, 0.0], [1.0, -1.0], [-1.0, 0.5], [0.3, 1.0]] {
            let pixel = [600.0 * (1.0 + shares[0]), 180.0 * (1.0 + shares[1])].map(|px| px as f32);
            assert!((f64::from(shift.at(pixel)) - KITTI.at(shares)).abs() < 1e-5);
        }
    }
}
