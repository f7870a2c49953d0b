//! Points of a frame with their descriptors, and the scores of keyframes: points they share.

use super::{
    descriptor::Descriptor,
    index::Index,
    keypoint::Keypoint,
    table::{KEYFRAME_POINTS, Table},
};
use crate::{
    egomotion::MotionCovariance,
    image::View,
    memory::{Carver, region_bytes},
    scene_flow::Match,
};
use bytemuck::{Pod, Zeroable};

/// Points of a frame that are described.
const QUERY_POINTS: usize = 1_024;
/// Bits in which descriptors of one point may differ to score for its keyframe.
const SCORE_BITS: u32 = 48;
/// Bits in which they may differ to be matched.
const MATCH_BITS: u32 = 72;
/// A match has at most so many tenths of the next best one's bits.
const RATIO_TENTHS: u32 = 8;
/// Fewest scores of a keyframe that is compared.
const SCORE_MIN: u16 = 6;

/// Score for a keyframe.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Score {
    count: u16,
    /// Number, from 1, of the point that scored last: each scores once.
    last: u16,
}

/// Scratch memory of a query.
#[derive(Debug)]
pub(super) struct Query<'s> {
    points: &'s mut [Keypoint],
    descriptors: &'s mut [Descriptor],
    /// Bits that differ between each point and the keyframe's point it is matched with.
    claimed: &'s mut [u32],
    scores: &'s mut [Score],
    matches: &'s mut [Match],
    /// One entry, because the stack is small: covariance of the motion from the best keyframe.
    covariance: &'s mut [MotionCovariance],
    has_covariance: bool,
    len: usize,
    match_len: usize,
}

impl<'s> Query<'s> {
    pub(super) const fn bytes(keyframes: usize) -> usize {
        region_bytes::<Keypoint>(QUERY_POINTS)
            + region_bytes::<Descriptor>(QUERY_POINTS)
            + region_bytes::<u32>(QUERY_POINTS)
            + region_bytes::<Score>(keyframes)
            + region_bytes::<Match>(KEYFRAME_POINTS)
            + region_bytes::<MotionCovariance>(1)
    }

    pub(super) fn new_in(keyframes: usize, carver: &mut Carver<'s>) -> Self {
        Self {
            points: carver.alloc("places.query_point", QUERY_POINTS),
            descriptors: carver.alloc("places.query_descriptor", QUERY_POINTS),
            claimed: carver.alloc("places.claimed", QUERY_POINTS),
            scores: carver.alloc("places.scores", keyframes),
            matches: carver.alloc("places.match", KEYFRAME_POINTS),
            covariance: carver.alloc("places.covariance", 1),
            has_covariance: false,
            len: 0,
            match_len: 0,
        }
    }

    /// Describes at most `most` of the matches' points, spread evenly over their order.
    pub(super) fn describe<'m>(
        &mut self,
        image: View<'_, u8>,
        matches: impl Iterator<Item = &'m Match> + Clone,
        most: usize,
    ) {
        self.len = 0;
        let points = matches.filter_map(Keypoint::from_match);
        let count = points.clone().count();
        let most = most.min(self.points.len());
        let mut due = 0;
        for point in points {
            // Bresenham's steps: the remainder decides which ones are left out.
            due += most;
            if due < count {
                continue;
            }
            due -= count;
            let Some(descriptor) = Descriptor::new(image, &point) else { continue };
            let to = self.points.get_mut(self.len).zip(self.descriptors.get_mut(self.len));
            let Some((to, described)) = to else { break };
            (*to, *described) = (point, descriptor);
            self.len += 1;
        }
    }

    /// The points with their descriptors.
    pub(super) fn points(&self) -> impl Iterator<Item = (&Keypoint, &Descriptor)> {
        self.points.iter().zip(&*self.descriptors).take(self.len)
    }

    /// Mean disparity of the points, px; `None` without points.
    pub(super) fn mean_disparity_px(&self) -> Option<f64> {
        let sum: u64 = self.points().map(|(point, _)| u64::from(point.disparity_q8)).sum();
        (self.len > 0).then(|| sum as f64 / 256.0 / self.len as f64)
    }

    /// Keeps the covariance of the motion from the best keyframe.
    pub(super) fn keep_covariance(&mut self, covariance: Option<&MotionCovariance>) {
        self.has_covariance = covariance.is_some();
        if let Some((to, covariance)) = self.covariance.first_mut().zip(covariance) {
            *to = *covariance;
        }
    }

    /// Covariance of the motion from the best keyframe, where there is one.
    pub(super) fn covariance(&self) -> Option<&MotionCovariance> {
        self.covariance.first().filter(|_| self.has_covariance)
    }

    /// Counts the scores for the keyframes that `may` takes.
    pub(super) fn score(
        &mut self,
        table: &Table<'_>,
        index: &mut Index<'_>,
        may: impl Fn(usize) -> bool,
    ) {
        let Self { descriptors, scores, len, .. } = self;
        scores.fill(Score { count: 0, last: 0 });
        for (number, descriptor) in (1..).zip(descriptors.iter().take(*len)) {
            index.candidates(descriptor, |candidate| {
                let Some((slot, other)) = table.described(candidate) else { return };
                let Some(scores) = scores.get_mut(slot) else { return };
                if scores.last != number && descriptor.distance(other) <= SCORE_BITS && may(slot) {
                    *scores = Score { count: scores.count.saturating_add(1), last: number };
                }
            });
        }
    }

    /// Takes the keyframe with most scores left, the first of equals; `None` where the most are too
    /// few.
    pub(super) fn take_best(&mut self) -> Option<usize> {
        let mut best: Option<(u16, usize)> = None;
        for (slot, scores) in self.scores.iter().enumerate() {
            if scores.count >= SCORE_MIN && best.is_none_or(|(most, _)| scores.count > most) {
                best = Some((scores.count, slot));
            }
        }
        let (_, slot) = best?;
        if let Some(scores) = self.scores.get_mut(slot) {
            scores.count = 0;
        }
        Some(slot)
    }

    /// Matches a keyframe's points with the frame's: the nearest descriptor, clearly nearer than
    /// any elsewhere in the image, and no point twice.
    pub(super) fn match_points(&mut self, table: &Table<'_>, slot: usize) -> &[Match] {
        let Self { points, descriptors, claimed, matches, len, match_len, .. } = self;
        claimed.fill(u32::MAX);
        // Twice the same search: first each point's least distance, then those that have it.
        let nearest = |described: &Descriptor| {
            let mut best = [(u32::MAX, 0usize); 2];
            for (at, other) in descriptors.iter().take(*len).enumerate() {
                let bits = described.distance(other);
                let is_near = || {
                    let pair = points.get(at).zip(points.get(best[0].1));
                    pair.is_some_and(|(a, b)| a.is_near(b))
                };
                if bits < best[0].0 {
                    // The one beaten is the next best, unless both show the same spot.
                    let beaten = if is_near() { best[1] } else { best[0] };
                    best = [(bits, at), beaten];
                } else if bits < best[1].0 && !is_near() {
                    best[1] = (bits, at);
                }
            }
            let [(bits, at), (next, _)] = best;
            let is_clear = 10 * u64::from(bits) <= u64::from(RATIO_TENTHS) * u64::from(next);
            (bits <= MATCH_BITS && is_clear).then_some((bits, at))
        };
        let mut count = 0;
        for (before, described) in table.points(slot) {
            let Some((bits, at)) = nearest(described) else { continue };
            let Some((claimed, now)) = claimed.get_mut(at).zip(points.get(at)) else { continue };
            // A later, better claim of one point would leave two matches: the first one stays.
            if *claimed <= bits {
                continue;
            }
            *claimed = bits;
            if let Some(to) = matches.get_mut(count) {
                *to = Match {
                    previous_left: before.left(),
                    previous_right: before.right(),
                    current_left: now.left(),
                    current_right: now.right(),
                };
                count += 1;
            }
        }
        *match_len = count;
        self.matches.get(..self.match_len).unwrap_or_default()
    }
}
