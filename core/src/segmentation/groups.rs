//! Candidates that lie together and move alike.

use super::{candidate::Candidate, extent::Extent, residual::StaticModel};
use crate::{geometry::scalar::max_f64, scene_flow::Match};
use heapless::Vec;
use nalgebra::Vector3;

/// Fewest members of a group.
pub(super) const MEMBERS_MIN: u16 = 8;
/// Fewest members of a group beyond [`SPARSE_FROM_M`].
const FAR_MEMBERS_MIN: u16 = 5;
/// Depth from which on groups are smaller, m.
const SPARSE_FROM_M: f32 = 25.0;
/// Least share of candidates among all matches within a group's box.
pub(super) const CANDIDATE_SHARE_MIN: f32 = 0.85;
/// Least motion of a group in a frame, m; 0.0008 m for each square metre of squared depth comes on
/// top.
const MOTION_MIN_M: f32 = 0.1;
/// Most candidates of a frame.
pub(super) const MAX_CANDIDATES: usize = 1024;
/// Most groups of a frame.
pub(super) const MAX_GROUPS: usize = 16;

/// Distance in the image at which two candidates may be neighbours, m, and at least, px.
const NEIGHBOUR_M: f64 = 0.9;
const NEIGHBOUR_MIN_PX: f64 = 12.0;
/// A group's motion beyond the least one, m for each m^2 of squared depth.
const MOTION_PER_SQUARED_DEPTH: f64 = 0.0008;
/// Up to this depth groups are small as well, m: what passes the camera is blurred, cut by the
/// image's border, and fast.
const SPARSE_UP_TO_M: f64 = 10.0;
/// Minimum width or length of such a group, m; in a row of bollards one is matched to the next.
const WIDTH_MIN_M: f64 = 0.5;
/// Largest extent of a group, m: width, height, length.
const EXTENT_MAX_M: [f64; 3] = [8.0, 5.0, 12.0];
/// Motions of groups on one object differ by at most this, m, and lie at most that far apart, m.
const MERGE_MOTION_M: f64 = 0.2;
const MERGE_DISTANCE_M: f64 = 4.0;

/// Candidates that lie together and move alike, after the gates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    /// From the 5th to the 95th percentile of its members.
    pub extent: Extent,
    /// Median depth of its members, m.
    pub depth_m: f64,
    /// Median against the static prediction, in the current camera's axes, m.
    pub motion_m: Vector3<f64>,
    pub members: u32,
    /// Position of its first member.
    pub first: u32,
    /// Error of one member's motion along the depth, one sigma, m.
    pub depth_sigma_m: f64,
}

impl Group {
    /// Returns true if the group moves, and is not too large for an object.
    pub fn is_plausible(&self) -> bool {
        let Extent { low, high } = &self.extent;
        let is_small =
            low.iter().zip(high).zip(EXTENT_MAX_M).all(|((low, high), most)| high - low <= most);
        is_small
            && self.motion_m.norm()
                > f64::from(MOTION_MIN_M) + MOTION_PER_SQUARED_DEPTH * self.depth_m * self.depth_m
    }

    /// Returns true if another group is on the same object: of one motion and close by.
    fn is_same(&self, other: &Self) -> bool {
        (other.motion_m - self.motion_m).norm() < MERGE_MOTION_M
            && other.extent.gap(&self.extent) < MERGE_DISTANCE_M
    }

    /// Returns true if the group is plausible and has enough members.
    pub fn passes(&self) -> bool {
        let Extent { low: [left, _, near], high: [right, _, far] } = self.extent;
        let is_wide = max_f64(right - left, far - near) > WIDTH_MIN_M;
        let is_sparse =
            self.depth_m > f64::from(SPARSE_FROM_M) || self.depth_m < SPARSE_UP_TO_M && is_wide;
        let least = if is_sparse { FAR_MEMBERS_MIN } else { MEMBERS_MIN };
        self.members >= u32::from(least) && self.is_plausible()
    }
}

/// Joins neighbours: afterwards `parent` of each candidate names the first member of its group.
pub(super) fn join(candidates: &mut [Candidate], focal_px: f64) {
    for later in 1..candidates.len() {
        let Some((earlier, rest)) = candidates.split_at_mut_checked(later) else { return };
        let Some(candidate) = rest.first().copied() else { return };
        // A distance in the world, in pixels at the candidate's depth; far away a floor in pixels.
        let reach_px =
            max_f64(NEIGHBOUR_M * focal_px / f64::from(candidate.point_m[2]), NEIGHBOUR_MIN_PX);
        for index in 0..earlier.len() {
            let is_neighbour =
                earlier.get(index).is_some_and(|other| candidate.is_neighbour(other, reach_px));
            if is_neighbour {
                // Union-find: the smaller root wins, so that a group is named by its first member.
                let (a, b) = (root(earlier, rest, later as u32), root(earlier, rest, index as u32));
                let (first, second) = if a < b { (a, b) } else { (b, a) };
                let slot = if (second as usize) < later {
                    earlier.get_mut(second as usize)
                } else {
                    rest.first_mut()
                };
                slot.into_iter().for_each(|slot| slot.parent = first);
            }
        }
    }
    // Flattened, so that members of a group compare by one number.
    for index in 0..candidates.len() {
        let first = root(candidates, &[], index as u32);
        candidates.get_mut(index).into_iter().for_each(|candidate| candidate.parent = first);
    }
}

/// The first member of a candidate's group: parents have lower positions.
fn root(earlier: &[Candidate], rest: &[Candidate], mut at: u32) -> u32 {
    loop {
        let index = at as usize;
        // The candidates are in two halves here, numbered through.
        let parent = earlier
            .get(index)
            .or_else(|| rest.get(index.checked_sub(earlier.len())?))
            .map_or(at, |candidate| candidate.parent);
        // A group's first member is its own parent.
        if parent >= at {
            return at;
        }
        at = parent;
    }
}

/// Sets `groups` to those that pass the gates; those on one object are merged. Returns
/// how many groups lay beyond [`MAX_GROUPS`].
pub(super) fn select<'m>(
    model: &StaticModel<'_>,
    candidates: &[Candidate],
    matches: impl Iterator<Item = (&'m Match, bool)> + Clone,
    values: &mut [f32],
    groups: &mut Vec<Group, MAX_GROUPS>,
) -> u32 {
    groups.clear();
    let mut refused = 0;
    for (first, candidate) in (0u32..).zip(candidates) {
        if candidate.parent != first {
            continue;
        }
        // Gates first: few groups are left to count matches in.
        let Some(group) = measure(candidates, first, values).filter(|group| group.passes()) else {
            continue;
        };
        refused += u32::from(groups.push(group).is_err());
    }
    // Within the extent of a moving group, enough of the matches must move.
    let mut counts = [[0u32; 2]; MAX_GROUPS];
    for (m, is_candidate) in matches {
        let Some(point) = model.current_point(m) else { continue };
        for (group, [all, own]) in groups.iter().zip(&mut counts) {
            if group.extent.contains(&point) {
                *all += 1;
                *own += u32::from(is_candidate);
            }
        }
    }
    let share = f64::from(CANDIDATE_SHARE_MIN);
    let mut index = 0;
    groups.retain(|_| {
        let [all, own] = counts.get(index).copied().unwrap_or_default();
        index += 1;
        f64::from(own) >= share * f64::from(all)
    });
    merge(groups);
    refused
}

/// The candidates of one group, and memory for one number of each.
struct Members<'m> {
    candidates: &'m [Candidate],
    first: u32,
    count: usize,
    values: &'m mut [f32],
}

impl Members<'_> {
    /// The value that so many of a thousand members do not exceed, in the order of
    /// `f32::total_cmp`. Selected bit by bit: sorting would recurse.
    fn percentile(&mut self, permille: usize, of: impl Fn(&Candidate) -> f32) -> Option<f64> {
        let values = self.values.get_mut(..self.count)?;
        let members = self.candidates.iter().filter(|candidate| candidate.parent == self.first);
        values.iter_mut().zip(members).for_each(|(value, member)| *value = of(member));
        let rank = (self.count.saturating_sub(1)) * permille / 1000;
        let mut selected = 0u32;
        // The bits from the highest: one is set where at most `rank` values lie below.
        for bit in (0..u32::BITS).rev() {
            let candidate = selected | 1 << bit;
            if values.iter().filter(|value| ordered(**value) < candidate).count() <= rank {
                selected = candidate;
            }
        }
        Some(f64::from(from_ordered(selected)))
    }
}

/// The bits of a float, changed so that their order is that of `f32::total_cmp`.
fn ordered(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
}

/// Undoes [`ordered`].
fn from_ordered(bits: u32) -> f32 {
    f32::from_bits(if bits >> 31 == 1 { bits & !(1 << 31) } else { !bits })
}

/// The median motion and the extent of a group that `first` is the first member of, if it has three
/// members.
pub(super) fn measure(candidates: &[Candidate], first: u32, values: &mut [f32]) -> Option<Group> {
    let count = candidates.iter().filter(|candidate| candidate.parent == first).count();
    // A median of two is one of the two.
    if count < 3 {
        return None;
    }
    let mut members = Members { candidates, first, count, values };
    let depth_m = members.percentile(500, |member| member.point_m[2])?;
    let motion_m = Vector3::new(
        members.percentile(500, |member| member.motion_m[0])?,
        members.percentile(500, |member| member.motion_m[1])?,
        members.percentile(500, |member| member.motion_m[2])?,
    );
    let depth_sigma_m = members.percentile(500, |member| member.depth_sigma_m)?;
    // From the 5th to the 95th percentile: a single wrong match does not stretch the object.
    let mut extent = Extent::default();
    for (axis, (low, high)) in extent.low.iter_mut().zip(&mut extent.high).enumerate() {
        let of = |member: &Candidate| member.point_m.get(axis).copied().unwrap_or(0.0);
        (*low, *high) = (members.percentile(50, of)?, members.percentile(950, of)?);
    }
    Some(Group { extent, depth_m, motion_m, members: count as u32, first, depth_sigma_m })
}

/// Merges groups of one motion that lie close together: a near car has several.
fn merge(groups: &mut Vec<Group, MAX_GROUPS>) {
    // The largest first, by a key that no two groups share; in place, for the stack.
    let key = |group: &Group| (u32::MAX - group.members, group.first);
    for at in 0..groups.len() {
        let next = groups
            .iter()
            .enumerate()
            .skip(at)
            .min_by_key(|(_, group)| key(group))
            .map(|(index, _)| index);
        if let Some(Ok([slot, next])) = next.map(|next| groups.get_disjoint_mut([at, next])) {
            core::mem::swap(slot, next);
        }
    }
    let mut merged = 0;
    for at in 0..groups.len() {
        // A group joins the largest of its motion before it; others keep their slots in order.
        let Some(group) = groups.get(at).copied() else { break };
        if let Some(other) = groups.iter_mut().take(merged).find(|other| other.is_same(&group)) {
            other.extent = other.extent.union(&group.extent);
            other.members += group.members;
        } else if let Some(slot) = groups.get_mut(merged) {
            *slot = group;
            merged += 1;
        }
    }
    groups.truncate(merged);
}

/// Adds the groups of sparse matches: each widens the one on the same object, or is a new one where
/// none lies, if it has `members_min` members. Returns how many there is no space for.
pub(super) fn add(groups: &mut Vec<Group, MAX_GROUPS>, more: &[Group], members_min: u16) -> u32 {
    let mut refused = 0;
    for group in more {
        if let Some(known) = groups.iter_mut().find(|known| known.is_same(group)) {
            known.extent = known.extent.union(&group.extent);
        } else if group.members >= u32::from(members_min)
            && groups.iter().all(|known| known.extent.gap(&group.extent) > 0.0)
        {
            refused += u32::from(groups.push(*group).is_err());
        }
    }
    refused
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(x: f64, width_m: f64, depth_m: f64, members: u32) -> Group {
        let half = 0.5 * width_m;
        let extent = Extent { low: [x - half, 0.0, depth_m], high: [x + half, 1.0, depth_m] };
        Group {
            extent,
            depth_m,
            motion_m: Vector3::new(0.0, 0.0, 1.0),
            members,
            first: 0,
            depth_sigma_m: 0.1,
        }
    }

    #[test]
    fn a_near_group_may_be_small_if_wider_than_a_bollard() {
        assert!(group(0.0, 0.6, 5.0, 5).passes() && !group(0.0, 0.4, 5.0, 5).passes());
        assert!(group(0.0, 0.4, 5.0, 8).passes() && !group(0.0, 0.6, 15.0, 5).passes());
    }

    #[test]
    fn sparse_matches_widen_a_group_and_many_make_a_new_one() {
        let mut groups = Vec::<Group, MAX_GROUPS>::new();
        assert!(groups.push(group(0.0, 1.0, 8.0, 10)).is_ok());
        assert_eq!(add(&mut groups, &[group(1.5, 1.0, 8.0, 4), group(20.0, 1.0, 8.0, 7)], 8), 0);
        assert_eq!((groups.len(), groups.first().unwrap().extent.high[0]), (1, 2.0));
        assert_eq!((add(&mut groups, &[group(20.0, 1.0, 8.0, 8)], 8), groups.len()), (0, 2));
    }
}
