//! Evidence for a disparity offset: the worth of a frame, and a witness against the filter.
//!
//! Noise of matches averages out over frames. Three disturbances do not, and a filter that counts
//! frames believes them the more the longer they last:
//!
//! - *Objects that move with the camera*, such as a truck ahead or the car's own bonnet, pull the
//!   offset in the same direction in all frames, because they are no outliers of any single match.
//!   A witness weighs what the motion does not explain by zero. A frame in which both disagree is
//!   left out, and what they still differ by over all frames is part of the deviation.
//! - *A camera that hardly moves* sees the same pixels again. A frame is worth the share of the
//!   baseline that the camera moved, so that evidence grows with the way and not with the rate.
//! - *A place* with an error of its own. Stretches of the way are summed in two halves by turns;
//!   what the halves differ by beyond their noise is part of the deviation.
//!
//! Each frame is also compared, before it is taken in, with the correction that is applied: if
//! frames are better off without it, it is taken back.
//!
//! **Memory.** 96 bytes. **Time.** A sum of eight columns for each match.

use super::information::{FrameInformation, Information, Prior};
use crate::{
    geometry::{StereoRig, Transform},
    state::Visitor,
};

/// Difference between witness and filter in one frame that leaves it out: a constant part, px, and
/// a part in deviations of the frame.
const PULL_MAX_PX: f64 = 0.1;
const PULL_MAX_SIGMAS: f64 = 0.5;
/// Difference between witness and filter over all frames that leaves a term out, px: offset, which
/// has its own rules, slope, fourth power and quadratic.
const TERM_PULL_MAX_PX: [f64; 4] = [0.1, 0.1, 0.3, 0.1];
/// A term is known when its deviation is this share of what it was before the first frame.
const CONSTRAINED: f64 = 0.5;
/// Independent frames of a stretch of the way.
const STRETCH_FRAMES: f64 = 4.0;
/// Half the squared sigmas by which frames must be better off without a correction to take it back.
const LOSS_MAX: f64 = 12.0;
/// Share of the gain that a frame leaves.
const GAIN_MEMORY: f64 = 0.95;
/// Information about the offset below which a half is not compared, 1/px².
const HALF_MIN: f64 = 200.0;

/// Returns the terms that are known: those of the filter that matches constrain and in which the
/// witness agrees, in this order; the others are what the search began with.
#[inline(never)]
pub(super) fn supported(prior: &Prior<4>, [filter, witness]: [&Information<4>; 2]) -> [f64; 4] {
    let (Some((terms, _)), Some((seen, _))) = (filter.estimate(prior), witness.estimate(prior))
    else {
        return prior.mean;
    };
    let mut known = prior.mean;
    for (i, (known, (term, seen))) in known.iter_mut().zip(terms.into_iter().zip(seen)).enumerate()
    {
        let [Some(max_px), Some(start_px)] =
            [TERM_PULL_MAX_PX.get(i), prior.sigma.get(i)].map(|px| px.copied())
        else {
            continue;
        };
        let sigma_px = filter.sigma_px(prior, i).unwrap_or(start_px);
        let agrees = libm::fabs(term - seen) <= max_px + PULL_MAX_SIGMAS * sigma_px;
        if agrees && (sigma_px < CONSTRAINED * start_px || start_px < max_px) {
            *known = term;
        }
    }
    known
}

/// Sums of a frame for the offset: those of the filter, and those of the witness.
pub(super) struct FrameEvidence {
    pub filter: FrameInformation<1>,
    pub witness: FrameInformation<1>,
    /// Offset at which errors were linearised, px.
    pub at_px: f64,
    /// Worth of the frame, from 0 to 1.
    pub share: f64,
    /// Way of the camera in this frame, m.
    pub way_m: f64,
}

impl FrameEvidence {
    /// Returns way and worth of a frame: the share of the baseline that the camera moved by.
    pub(super) fn worth(rig: &StereoRig, t_current_previous: &Transform) -> [f64; 2] {
        let way_m = t_current_previous.distance_m();
        let share = way_m / rig.baseline_m;
        [way_m, if share < 1.0 { share } else { 1.0 }]
    }

    /// Returns true if objects that move otherwise pull the frame's offset.
    pub(super) fn is_disturbed(&self) -> bool {
        let [Some(filter), Some(witness)] =
            [&self.filter, &self.witness].map(|frame| frame.offset_from(self.at_px))
        else {
            return true;
        };
        let sigma_px = 1.0 / libm::sqrt(filter.information);
        let bound_px = PULL_MAX_PX + PULL_MAX_SIGMAS * sigma_px;
        // NaN is a disturbance as well.
        let agree = libm::fabs(filter.px - witness.px) <= bound_px;
        !agree
    }
}

/// Evidence over frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OffsetEvidence {
    /// Frames of the witness: all, and by stretches in turns.
    witness: Information<1>,
    halves: [Information<1>; 2],
    /// Gain of the applied correction over none, in squared sigmas; loss below 0.
    gain: f64,
    pub frames_independent: f64,
    pub frames_disturbed: u32,
    pub way_m: f64,
}

impl OffsetEvidence {
    pub(super) const NONE: Self = Self {
        witness: Information::NONE,
        halves: [Information::NONE; 2],
        gain: 0.0,
        frames_independent: 0.0,
        frames_disturbed: 0,
        way_m: 0.0,
    };

    /// Takes an undisturbed frame in. Returns false if the correction that is applied,
    /// `applied_px`, must be taken back.
    pub(super) fn take(
        &mut self,
        prior: &Prior<1>,
        frame: &FrameEvidence,
        applied_px: f64,
    ) -> bool {
        self.gain *= GAIN_MEMORY;
        if let Some(alone) = frame.witness.offset_from(frame.at_px) {
            // As wide as the filter counts it: its noise, and what a frame may be off by.
            let [frame_sigma] = prior.frame_sigma;
            let weight = frame.share / (1.0 / alone.information + frame_sigma * frame_sigma);
            let without = alone.px;
            let with = alone.px - applied_px;
            self.gain += weight * (without * without - with * with);
        }
        let at = [frame.at_px];
        let turn = libm::floor(self.frames_independent / STRETCH_FRAMES);
        let is_second = turn - 2.0 * libm::floor(0.5 * turn) > 0.5;
        let [first, second] = &mut self.halves;
        let half = if is_second { second } else { first };
        let _ = self.witness.take(prior, &frame.witness, at, frame.share);
        let _ = half.take(prior, &frame.witness, at, frame.share);
        self.frames_independent += frame.share;
        self.way_m += frame.way_m;
        self.gain > -LOSS_MAX
    }

    /// Returns the deviation of an offset whose noise alone gives `sigma_px`.
    pub(super) fn sigma_px(&self, prior: &Prior<1>, offset_px: f64, sigma_px: f64) -> f64 {
        let mut variance = sigma_px * sigma_px;
        if let Some(([witness_px], _)) = self.witness.estimate(prior) {
            let pull_px = witness_px - offset_px;
            variance += pull_px * pull_px;
        }
        if let [Some(first), Some(second)] = self.halves.each_ref().map(Information::first_alone)
            && first.information > HALF_MIN
            && second.information > HALF_MIN
        {
            let apart_px = first.px - second.px;
            let noise = 1.0 / first.information + 1.0 / second.information;
            let excess = apart_px * apart_px - noise;
            // Half the difference of two halves is the deviation of their mean.
            variance += if excess > 0.0 { 0.25 * excess } else { 0.0 };
        }
        libm::sqrt(variance)
    }

    /// Visits every field.
    pub(super) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { witness, halves, gain, frames_independent, frames_disturbed, way_m } = self;
        witness.visit(visitor);
        halves.iter_mut().for_each(|half| half.visit(visitor));
        visitor.f64s([gain, frames_independent, way_m]);
        visitor.u32(frames_disturbed);
    }
}
