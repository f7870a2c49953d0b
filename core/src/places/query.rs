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
/// Bits beyond those of the most similar descriptor in which others may differ to score as well.
const SCORE_MARGIN_BITS: u32 = 6;
/// Scores that a point has to give: keyframes that look like it share them.
const POINT_SCORES: u16 = 64;
/// Fewest scores of a keyframe that is compared.
const SCORE_MIN: u16 = 6;

/// Score for a keyframe.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Score {
    count: u16,
    /// Number, from 1, of the point that is about to score: each scores once.
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

    /// Counts the scores for the keyframes that `may` takes. What looks like a point in many
    /// keyframes, as windows and kerbs of a street do, says little about any of them.
    pub(super) fn score(
        &mut self,
        table: &Table<'_>,
        index: &mut Index<'_>,
        may: impl Fn(usize) -> bool,
    ) {
        let Self { descriptors, scores, len, .. } = self;
        scores.fill(Score { count: 0, last: 0 });
        for (number, descriptor) in (1..).zip(descriptors.iter().take(*len)) {
            // Three passes over at most 64 entries: a list of them would be as long as the stack
            // of a small machine is short.
            let bits_of = |candidate| {
                let (slot, other) = table.described(candidate)?;
                may(slot).then(|| (slot, descriptor.distance(other)))
            };
            let mut least_bits = SCORE_BITS;
            index.candidates(descriptor, |candidate| {
                if let Some((_, bits)) = bits_of(candidate) {
                    least_bits = least_bits.min(bits);
                }
            });
            let most_bits = (least_bits + SCORE_MARGIN_BITS).min(SCORE_BITS);
            let mut keyframes = 0;
            let similar = |candidate| {
                bits_of(candidate).filter(|(_, bits)| *bits <= most_bits).map(|(slot, _)| slot)
            };
            index.candidates(descriptor, |candidate| {
                let score = similar(candidate).and_then(|slot| scores.get_mut(slot));
                if let Some(score) = score.filter(|score| score.last != number) {
                    score.last = number;
                    keyframes += 1;
                }
            });
            let share = POINT_SCORES / keyframes.max(1);
            index.candidates(descriptor, |candidate| {
                let score = similar(candidate).and_then(|slot| scores.get_mut(slot));
                if let Some(score) = score.filter(|score| score.last == number) {
                    *score = Score { count: score.count.saturating_add(share), last: 0 };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Transform;
    use crate::memory::SLAB_ALIGN;
    use crate::places::SegmentPose;
    use crate::random::Random;
    use std::{vec, vec::Vec};

    const KEYFRAMES: usize = 10;

    fn random_descriptor(random: &mut Random) -> Descriptor {
        Descriptor(core::array::from_fn(|_| {
            u64::from(random.next_u32()) << 32 | u64::from(random.next_u32())
        }))
    }

    fn noisy(descriptor: &Descriptor, bits: u32, random: &mut Random) -> Descriptor {
        let mut words = descriptor.0;
        (0..bits).for_each(|_| {
            let bit = random.below(256) as usize;
            words[bit / 64] ^= 1 << (bit % 64);
        });
        Descriptor(words)
    }

    #[test]
    fn windows_of_a_whole_street_do_not_outvote_a_place() {
        let bytes = Table::bytes(KEYFRAMES)
            + Index::bytes(KEYFRAMES * KEYFRAME_POINTS)
            + Query::bytes(KEYFRAMES);
        let mut slab = vec![0; bytes + SLAB_ALIGN];
        let mut carver = Carver::new(&mut slab, bytes).unwrap();
        let mut table = Table::new_in(KEYFRAMES, &mut carver);
        let mut index = Index::new_in(KEYFRAMES * KEYFRAME_POINTS, &mut carver);
        let mut query = Query::new_in(KEYFRAMES, &mut carver);
        let mut random = Random::new(4);
        let many = |count: usize, random: &mut Random| -> Vec<Descriptor> {
            (0..count).map(|_| random_descriptor(random)).collect()
        };
        let (windows, own) = (many(60, &mut random), many(12, &mut random));
        let pose = SegmentPose { segment: Default::default(), t_world_camera: Transform::IDENTITY };
        for slot in 0..KEYFRAMES {
            // All but one show the windows well; that one shows points of its own, and them badly.
            let is_place = slot + 1 == KEYFRAMES;
            let seen: Vec<Descriptor> = if is_place {
                own.clone()
            } else {
                windows.iter().map(|window| noisy(window, 12, &mut random)).collect()
            };
            let point = Keypoint::default();
            table.insert(slot, &pose, seen.iter().map(|descriptor| (&point, descriptor)));
            for (at, descriptor) in seen.iter().enumerate() {
                index.insert(descriptor, Table::number(slot, at));
            }
        }
        let frame =
            windows.iter().map(|window| (window, 12)).chain(own.iter().map(|own| (own, 25)));
        for (descriptor, bits) in frame {
            query.descriptors[query.len] = noisy(descriptor, bits, &mut random);
            query.len += 1;
        }
        query.score(&table, &mut index, |_| true);
        assert_eq!(query.take_best(), Some(KEYFRAMES - 1), "{:?}", query.scores);
        // Keyframes that may not be found take no scores from others.
        query.score(&table, &mut index, |slot| slot < 2);
        assert!(query.take_best().is_some_and(|slot| slot < 2));
    }
}
