//! Rows that do not agree: how far below the right image's row the left one sees the same point.
//!
//! A calibration that leaves a pixel there costs a matcher that compares along rows both estimates
//! and precision, most where the error is largest, in the corners. Every match shows it, moving or
//! not, so that one frame tells: a polynomial of second degree over the image is fitted to the
//! differences of rows, by weighted least squares whose weights narrow from pass to pass.

use super::{
    APPLY_ABOVE_PX, APPLY_UNTIL_PX,
    information::{FrameInformation, Information, Prior},
};
use crate::{
    geometry::{RowCorrection, Shares, StereoRig},
    state::Visitor,
};

const TERMS: usize = RowCorrection::TERMS;
/// Noise of a difference of two rows, px.
const NOISE_PX: f64 = 0.15;
/// Error at which a match weighs a quarter, px, from pass to pass.
const PASSES_PX: [f64; 3] = [1.0, 0.5, 0.25];
/// Matches a frame must have to say something.
const MATCHES_MIN: usize = 100;
/// Frames that must have said something before rows are moved.
const FRAMES_MIN: u32 = 2;
/// Least change of what rows are moved by, px: a smaller one is worth less than images of a camera
/// that hangs being equal.
const CHANGE_MIN_PX: f64 = 0.05;
/// Before the first frame, every term is what it begins with within this, px.
const SIGMA_PX: f64 = 2.0;

/// Finds the error of the rows, and says what of it is to be taken out.
#[derive(Clone, Debug)]
pub(super) struct RowCalibration {
    /// Correction at which the search began.
    start: RowCorrection,
    information: Information<TERMS>,
    applied: RowCorrection,
    frames: u32,
}

impl RowCalibration {
    /// Before the first frame.
    pub(super) fn new(start: RowCorrection) -> Self {
        Self { start, information: Information::NONE, applied: start, frames: 0 }
    }

    /// Returns the correction that is applied to the next frame's rows.
    pub(super) fn applied(&self) -> &RowCorrection {
        &self.applied
    }

    /// Returns the correction that is known; `None` while there is too little information.
    pub(super) fn known(&self) -> Option<RowCorrection> {
        let (terms, _) = self.information.estimate(&self.prior())?;
        (self.frames >= FRAMES_MIN).then(|| RowCorrection::of_terms(terms))
    }

    fn prior(&self) -> Prior<TERMS> {
        Prior { mean: self.start.terms(), sigma: [SIGMA_PX; TERMS], frame_sigma: [0.0; TERMS] }
    }

    /// Learns from a frame's matches: where the right camera sees each, and how far below that the
    /// left one does, after what is
    /// [`RowCalibration::applied`] was taken out.
    // Never inlined: its matrices must not stay in the frame of a step.
    #[inline(never)]
    pub(super) fn update(
        &mut self,
        rig: &StereoRig,
        matches: impl Iterator<Item = ([f64; 2], f64)> + Clone,
    ) {
        let [across, down] = Shares::per_px(rig);
        let shares =
            |[u, v]: [f64; 2]| [(u - rig.center_u_px) * across, (v - rig.center_v_px) * down];
        // Robust passes: each weighs matches by the fit before it.
        let (prior, mut found) = (self.prior(), self.information);
        for scale_px in PASSES_PX {
            let Some((terms, _)) = found.estimate(&prior) else { return };
            let expected = RowCorrection::of_terms(terms);
            let mut frame = FrameInformation::ZERO;
            let mut count = 0;
            for (at, difference_px) in matches.clone() {
                let at = shares(at);
                let error = difference_px + self.applied.at(at) - expected.at(at);
                // Geman-McClure: a match far off has hardly any weight.
                let share = 1.0 / (1.0 + error * error / (scale_px * scale_px));
                frame.add(
                    &RowCorrection::powers(at),
                    -error,
                    share * share / (NOISE_PX * NOISE_PX),
                );
                count += 1;
            }
            // Each pass adds to what was known before this frame, so that the frame counts once.
            found = self.information;
            if count < MATCHES_MIN || found.take_exact(&frame, terms).is_none() {
                return;
            }
        }
        // Only a frame that passed all checks is taken.
        self.information = found;
        self.frames = self.frames.saturating_add(1);
    }

    /// Moves what is taken out to what is known, where it is worth it.
    pub(super) fn apply(&mut self) {
        let Some(known) = self.known() else { return };
        let least_px =
            if self.applied.largest_px() > 0.0 { APPLY_UNTIL_PX } else { APPLY_ABOVE_PX };
        let target = if known.largest_px() > least_px { known } else { RowCorrection::default() };
        if target.largest_from_px(&self.applied) > CHANGE_MIN_PX {
            self.applied = target;
        }
    }

    /// Visits every field but the one the configuration gives.
    pub(super) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { start: _, information, applied, frames } = self;
        information.visit(visitor);
        let mut terms = applied.terms();
        visitor.f64s(&mut terms);
        *applied = RowCorrection::of_terms(terms);
        visitor.u32(frames);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::vec::Vec;

    const RIG: StereoRig =
        StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: 0.5 };
    /// Correction of KITTI's grey cameras: 1.5 px in the corners, of opposite sign in neighbouring
    /// corners.
    const KITTI: RowCorrection = RowCorrection {
        constant_px: 0.2,
        column_px: 0.05,
        row_px: 0.1,
        column_quadratic_px: 0.2,
        product_px: -1.4,
        row_quadratic_px: 0.1,
    };

    /// Matches all over the image, a tenth of them wrong, as both cameras of a rig with these
    /// errors see them after the right image was moved by what is applied.
    fn matches(
        error: &RowCorrection,
        applied: &RowCorrection,
        count: usize,
        random: &mut Random,
    ) -> Vec<([f64; 2], f64)> {
        let mut uniform = move || f64::from(random.next_u32()) / f64::from(u32::MAX);
        (0..count)
            .map(|at| {
                // Shares of the image's half width and height, from -1 to 1.
                let shares = [uniform() * 2.0 - 1.0, uniform() * 2.0 - 1.0];
                let noise = if at % 10 == 0 {
                    uniform() * 4.0 - 2.0
                } else {
                    // A triangle of 0.3 px to either side; and outliers of up to 2 px.
                    (uniform() + uniform() - 1.0) * 0.3
                };
                let pixel =
                    [RIG.center_u_px * (1.0 + shares[0]), RIG.center_v_px * (1.0 + shares[1])];
                // What remains after what is applied.
                (pixel, error.at(shares) - applied.at(shares) + noise)
            })
            .collect()
    }

    fn driven(error: &RowCorrection, count: usize, frames: usize) -> RowCalibration {
        let (mut random, mut rows) =
            (Random::new(3), RowCalibration::new(RowCorrection::default()));
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
            assert!(rows.applied().largest_from_px(&KITTI) < 0.1, "{frames}: {:?}", rows.applied());
        }
        let [second, last] = [3, 60].map(|frames| *driven(&KITTI, 800, frames).applied());
        assert!(second.largest_from_px(&last) < 0.1, "what is applied stays");
    }

    #[test]
    fn rows_that_agree_are_left_alone_and_few_matches_say_nothing() {
        let sound = driven(&RowCorrection::default(), 800, 40);
        assert_eq!(*sound.applied(), RowCorrection::default());
        assert!(sound.known().unwrap().largest_px() < 0.06, "{:?}", sound.known());
        let few = driven(&KITTI, MATCHES_MIN - 1, 40);
        assert!(few.known().is_none() && few.applied().largest_px() == 0.0);
    }

    #[test]
    fn a_search_that_begins_with_the_error_moves_the_first_image_and_stays() {
        // 20 further updates must not walk away by their noise.
        let (mut random, mut rows) = (Random::new(3), RowCalibration::new(KITTI));
        assert_eq!(*rows.applied(), KITTI);
        for _ in 0..20 {
            rows.update(&RIG, matches(&KITTI, &KITTI, 800, &mut random).into_iter());
            rows.apply();
            assert!(rows.applied().largest_from_px(&KITTI) < 0.06, "{:?}", rows.applied());
        }
        let mut wrong = RowCalibration::new(RowCorrection { constant_px: 3.0, ..KITTI });
        for _ in 0..2 {
            let applied = *wrong.applied();
            wrong.update(&RIG, matches(&KITTI, &applied, 800, &mut random).into_iter());
            wrong.apply();
        }
        assert!(wrong.applied().largest_from_px(&KITTI) < 0.1, "{:?}", wrong.applied());
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
}
