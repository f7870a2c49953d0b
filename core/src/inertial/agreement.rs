//! Trust in a unit: earned by turns that agree with those that images show, lost by those that do
//! not.
//!
//! A frame's turn is compared where images measured one. Within five sigmas the score rises by 1
//! up to 20; beyond, it falls by 6 (by 1 where few matches vouch for the measured turn). A unit is
//! trusted from a score of 8 on and once the camera turned by ten sigmas in all, and no longer
//! below 5. So at most three measured turns in a row are refused before the unit is, not the
//! images. Readings that repeat or lie at the end of their range end the trust at once.

use super::{InertialSample, InertialUnit};
use crate::{egomotion::AGREE_SIGMAS, state::Visitor};
use nalgebra::Vector3;

const SCORE_MAX: u32 = 20;
const SCORE_TRUSTED: u32 = 8;
const SCORE_KEPT: u32 = 5;
const LOSS_STRONG: u32 = 6;
/// Turned angle over its sigma, squared and summed up, that makes a unit's axes known.
const TURNED2_TRUSTED: f64 = 100.0;
/// Most of that sum from one frame: one turn may agree by chance.
const TURNED2_FRAME: f64 = 16.0;
/// Contradictions, less agreements, from which on a unit that is not trusted is doubted.
const CONTRADICTIONS_DOUBTED: u32 = 3;
/// Equal samples in a row from which on a sensor is stuck.
const REPEATS_STUCK: u32 = 10;
/// Samples at the end of the range in a row from which on they are saturated.
const SATURATED_SAMPLES: u32 = 2;
/// Turn rate over the sensor's range from which on no sensor of it showed it, in rad/s.
const BEYOND_RANGE: f64 = 1.05;
/// Part of the sums over turns that stays from frame to frame.
const MEMORY: f64 = 0.95;

/// Reason not to use a unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
#[non_exhaustive]
pub enum InertialDoubt {
    /// Turns contradict those of the images, for no reason that was found.
    #[default]
    Contradicts,
    /// Turns are as large as those of the images, about other axes.
    WrongAxes,
    /// Turn rates seem to be in degrees per second.
    Degrees,
    /// Samples repeat.
    Stuck,
    /// Samples lie at the end of the sensor's range.
    Saturated,
    /// Samples lie more than a second from the frames, or the clocks differ by more than can be
    /// corrected.
    ClocksApart,
}

impl InertialDoubt {
    /// Name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Contradicts => "contradicts",
            Self::WrongAxes => "wrong axes",
            Self::Degrees => "degrees",
            Self::Stuck => "stuck",
            Self::Saturated => "saturated",
            Self::ClocksApart => "clocks apart",
        }
    }

    fn from_code(code: u32) -> Self {
        match code {
            1 => Self::WrongAxes,
            2 => Self::Degrees,
            3 => Self::Stuck,
            4 => Self::Saturated,
            5 => Self::ClocksApart,
            _ => Self::Contradicts,
        }
    }
}

/// Two turns of one time, in the unit's axes, rad.
#[derive(Clone, Copy, Debug)]
pub(super) struct TurnPair {
    pub measured: Vector3<f64>,
    pub predicted: Vector3<f64>,
    /// Predicted turn without any correction; `None` over several frames.
    pub raw: Option<Vector3<f64>>,
    /// Standard deviation of their difference, rad.
    pub sigma_rad: f64,
    /// Half of the matches and more agree with the measured one.
    pub strong: bool,
}

/// Score of a unit, and sums over turns that tell why it contradicts.
#[derive(Clone, Debug, Default)]
pub(super) struct Agreement {
    score: u32,
    contradictions: u32,
    turned2: f64,
    trusted: u32,
    doubt: Option<InertialDoubt>,
    /// Squares of measured and of predicted turns, and their products.
    measured2: f64,
    predicted2: f64,
    product: f64,
    repeats: u32,
    saturated: u32,
    last: [f64; 6],
}

impl Agreement {
    /// True if the unit may be used.
    pub fn is_trusted(&self) -> bool {
        self.trusted != 0
    }

    pub fn doubt(&self) -> Option<InertialDoubt> {
        self.doubt
    }

    /// Checks a sample by itself.
    pub fn note_sample(&mut self, unit: &InertialUnit, sample: &InertialSample) {
        let ([a, b, c], [d, e, f]) = (sample.turn_rate, sample.force);
        let now = [a, b, c, d, e, f];
        self.repeats = if now == self.last { self.repeats.saturating_add(1) } else { 0 };
        self.last = now;
        let beyond = |values: [f64; 3], range: f64| {
            values.iter().any(|value| libm::fabs(*value) >= 0.999 * range)
        };
        let is_saturated =
            beyond(sample.turn_rate, unit.turn_range) || beyond(sample.force, unit.force_range);
        self.saturated = if is_saturated { self.saturated.saturating_add(1) } else { 0 };
        if self.repeats >= REPEATS_STUCK {
            self.lose_trust(InertialDoubt::Stuck);
        } else if beyond(sample.turn_rate, BEYOND_RANGE * unit.turn_range) {
            self.lose_trust(InertialDoubt::Degrees);
        } else if self.saturated >= SATURATED_SAMPLES {
            self.lose_trust(InertialDoubt::Saturated);
        }
    }

    /// Ends the trust, which must be earned again.
    pub fn lose_trust(&mut self, doubt: InertialDoubt) {
        (self.trusted, self.score, self.turned2) = (0, 0, 0.0);
        self.doubt = Some(doubt);
    }

    /// Compares the turns of a frame. Returns true if the unit lost the trust by it.
    pub fn compare(&mut self, pair: &TurnPair) -> bool {
        let sigma2 = pair.sigma_rad * pair.sigma_rad;
        // Of readings as they are: a bias may have been learned from what is no bias.
        if let Some(raw) = &pair.raw {
            let remember = |sum: f64, more: f64| sum * MEMORY + more;
            self.measured2 = remember(self.measured2, pair.measured.norm_squared());
            self.predicted2 = remember(self.predicted2, raw.norm_squared());
            self.product = remember(self.product, pair.measured.dot(raw));
        }
        let error2 = (pair.measured - pair.predicted).norm_squared();
        let (had_trust, had_doubt) = (self.is_trusted(), self.doubt.is_some());
        if error2 <= AGREE_SIGMAS * AGREE_SIGMAS * sigma2 {
            self.score = if self.score < SCORE_MAX { self.score + 1 } else { SCORE_MAX };
            // Only turns can tell axes apart.
            let turned2 = pair.measured.norm_squared() / sigma2;
            self.turned2 += if turned2 < TURNED2_FRAME { turned2 } else { TURNED2_FRAME };
            if turned2 > AGREE_SIGMAS * AGREE_SIGMAS || !had_doubt {
                self.contradictions = self.contradictions.saturating_sub(1);
            }
        } else {
            self.score = self.score.saturating_sub(if pair.strong { LOSS_STRONG } else { 1 });
            if pair.strong {
                self.contradictions = self.contradictions.saturating_add(1);
                self.contradictions = self.contradictions.min(2 * CONTRADICTIONS_DOUBTED);
            }
        }
        if self.score >= SCORE_TRUSTED && self.turned2 >= TURNED2_TRUSTED {
            (self.trusted, self.doubt, self.contradictions) = (1, None, 0);
        } else if had_trust && self.score < SCORE_KEPT
            || !had_trust && self.contradictions >= CONTRADICTIONS_DOUBTED
        {
            self.lose_trust(self.reason_kept());
            return true;
        }
        false
    }

    /// Ends the trust because only a clock offset beyond what is corrected would explain the turns,
    /// unless they are explained by something else.
    pub fn lose_trust_in_clock(&mut self) {
        let reason = match self.reason_kept() {
            InertialDoubt::Contradicts => InertialDoubt::ClocksApart,
            other => other,
        };
        self.lose_trust(reason);
    }

    /// Reason for turns that contradict: what the readings themselves showed, as long as the unit
    /// is doubted for it.
    fn reason_kept(&self) -> InertialDoubt {
        use InertialDoubt::{Saturated, Stuck};
        match self.doubt {
            Some(shown @ (Stuck | Saturated)) => shown,
            _ => self.reason(),
        }
    }

    /// Reason for turns that contradict, from the sums over the last ones.
    fn reason(&self) -> InertialDoubt {
        let size = libm::sqrt(self.measured2 * self.predicted2);
        if size <= 0.0 {
            return InertialDoubt::Contradicts;
        }
        // Cosine between the two, over all turns that are remembered.
        let alike = self.product / size;
        let larger = libm::sqrt(self.predicted2 / self.measured2);
        if (20.0..120.0).contains(&larger) && alike > 0.7 {
            InertialDoubt::Degrees
        } else if (0.5..2.0).contains(&larger) && alike < 0.6 {
            InertialDoubt::WrongAxes
        } else {
            InertialDoubt::Contradicts
        }
    }

    /// Visits every field.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            score,
            contradictions,
            turned2,
            trusted,
            doubt,
            measured2,
            predicted2,
            product,
            repeats,
            saturated,
            last,
        } = self;
        visitor.u32s([score, contradictions, trusted, repeats, saturated]);
        visitor.f64s([turned2, measured2, predicted2, product]);
        visitor.f64s(last);
        visitor.option(doubt, InertialDoubt::default, |visitor, doubt| {
            visitor.code(doubt, |doubt| doubt as u32, InertialDoubt::from_code);
        });
    }
}
