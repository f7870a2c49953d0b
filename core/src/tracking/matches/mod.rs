//! Matches: which instance each match of the scene flow is assigned to, and so which ones an
//! object's motion and the camera's own are estimated from.
//!
//! # Which matches are an object's
//!
//! Those whose current left keypoint lies under the delete mask (and under no other's copy mask)
//! and whose previous one lay in the track's previous mask: the matches refined below the pixel
//! and, where these are fewer than [`MATCHES_ENOUGH`], sparse ones of other features, which are
//! found also where few neighbours move alike, and those of guided matching ([`GuidedMatching`]).
//!
//! # Memory
//!
//! A byte a match; [`MAX_GUIDED_MATCHES`] matches for guided matching.

mod config;
mod egomotion_mask;
mod guided_matching;
mod keypoint;
mod match_owner;
#[cfg(test)]
mod tests;

pub use config::MatchesConfig;
pub(crate) use egomotion_mask::{EgomotionMask, Excluded, MAX_MOVING};
pub(crate) use guided_matching::{GuidedMatching, expected};
pub(super) use guided_matching::{MAX_GUIDED_MATCHES, ObjectMasks, search_by_projection};
pub(super) use keypoint::pixel;
pub(crate) use match_owner::{MatchOwner, OwnerCode};

use super::instances::Instance;
use crate::{
    masks::{MaskStore, PixelBox},
    memory::{Capacity, Carver, region_bytes},
    scene_flow::Match,
};
use keypoint::is_same_keypoint;

/// Half the width of a feature's descriptor, px.
const FEATURE_PX: i32 = 5;
/// Refined matches from which on sparse ones are not used; the original: sparse ones only.
const MATCHES_ENOUGH: usize = 60;

/// The matches of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FrameMatches<'m> {
    /// Refined below the pixel.
    pub refined: &'m [Match],
    /// Matches of other features, at whole pixels.
    pub sparse: &'m [Match],
}

/// Instances of a frame, as matches are assigned to them.
#[derive(Clone, Copy)]
pub(super) struct InstanceMasks<'a, 's> {
    pub instances: &'a [Instance],
    pub masks: &'a MaskStore<'s>,
    /// A bit for each instance that makes matches at its rim ambiguous.
    pub distinct: u64,
}

/// The matches of one instance.
pub(super) struct OwnMatches<'m, M> {
    pub matches: M,
    /// True if no further matches are needed.
    pub enough: bool,
    /// Buffer for those that guided matching finds.
    pub found: &'m mut [Match],
}

/// Owners of a frame's matches.
#[derive(Debug)]
pub(super) struct AssignedMatches<'s> {
    config: MatchesConfig,
    /// Owner of each refined match, and of each sparse one.
    refined_owner: &'s mut [OwnerCode],
    sparse_owner: &'s mut [OwnerCode],
    /// Matches found by guided matching on one object.
    found: &'s mut [Match],
}

impl<'s> AssignedMatches<'s> {
    pub const fn bytes(capacity: &Capacity) -> usize {
        2 * region_bytes::<OwnerCode>(capacity.matches) + region_bytes::<Match>(MAX_GUIDED_MATCHES)
    }

    pub fn new_in(capacity: &Capacity, config: &MatchesConfig, carver: &mut Carver<'s>) -> Self {
        Self {
            config: *config,
            refined_owner: carver.alloc("tracking.owner", capacity.matches),
            sparse_owner: carver.alloc("tracking.sparse_owner", capacity.matches),
            found: carver.alloc("tracking.guided_matches", MAX_GUIDED_MATCHES),
        }
    }

    pub fn config(&self) -> &MatchesConfig {
        &self.config
    }

    /// Owners of the refined matches, and of the sparse ones.
    pub fn match_owners(&self) -> [&[OwnerCode]; 2] {
        [self.refined_owner, self.sparse_owner]
    }

    /// Assigns each match to the instance whose copy mask it lies under or else to the best one
    /// whose delete mask it lies under.
    pub fn assign(&mut self, matches: &FrameMatches<'_>, to: &InstanceMasks<'_, '_>) {
        let tables = [&mut *self.refined_owner, &mut *self.sparse_owner];
        for (codes, matches) in tables.into_iter().zip([matches.refined, matches.sparse]) {
            codes.iter_mut().zip(matches).for_each(|(code, _)| *code = OwnerCode::default());
        }
        self.assign_from(0, matches, to);
    }

    /// Assigns the matches without an instance to those from position `first` on.
    pub fn assign_from(
        &mut self,
        first: usize,
        matches: &FrameMatches<'_>,
        to: &InstanceMasks<'_, '_>,
    ) {
        let &InstanceMasks { instances, masks, .. } = to;
        let refined = self.refined_owner.iter_mut().zip(matches.refined);
        for (code, m) in refined.chain(self.sparse_owner.iter_mut().zip(matches.sparse)) {
            if code.get() != MatchOwner::None {
                continue;
            }
            let (u, v) = pixel(m.current_left);
            let best = |mut under: &mut dyn FnMut(&Instance) -> bool| {
                instances.iter().skip(first).position(&mut under)
            };
            let copy = best(&mut |instance| masks.contains(&instance.mask, u, v));
            let found = copy
                .or_else(|| best(&mut |instance| instance.delete_mask(masks).contains(u, v)))
                .map(|at| at + first);
            *code = OwnerCode::from(match found {
                Some(at) if to.is_between(at, u, v) => MatchOwner::Ambiguous,
                Some(at) => MatchOwner::Instance(at),
                None => MatchOwner::None,
            });
        }
    }

    /// Returns the matches of the instance at `at` that its last mask contained. Sparse matches
    /// that say nothing new lose their owner.
    pub fn own<'m>(
        &'m mut self,
        matches: FrameMatches<'m>,
        at: usize,
        was_under_mask: impl Fn(&Match) -> bool + Copy + 'm,
    ) -> OwnMatches<'m, impl Iterator<Item = &'m Match> + Clone> {
        let Self { refined_owner, sparse_owner, found, config: _ } = self;
        let FrameMatches { refined, sparse } = matches;
        // Few matches belong to one track: the owner code, which costs less, is compared first.
        let is_own =
            move |&(m, code): &(&Match, &OwnerCode)| code.is_instance(at) && was_under_mask(m);
        let own = refined.iter().zip(&**refined_owner).filter(is_own).map(|(m, _)| m);
        let enough = own.clone().count() >= MATCHES_ENOUGH;
        // Sparse matches of the same features say nothing new.
        let on_instance =
            sparse.iter().zip(sparse_owner.iter_mut()).filter(|(_, code)| code.is_instance(at));
        for (m, code) in on_instance {
            if enough
                || own.clone().any(|other| is_same_keypoint(m.current_left, other.current_left))
            {
                *code = MatchOwner::None.into();
            }
        }
        let sparse = sparse.iter().zip(&**sparse_owner).filter(is_own).map(|(m, _)| m);
        OwnMatches { matches: own.chain(sparse), enough, found }
    }

    /// The matches that the camera's own motion may be estimated from. `previous` are the masks of
    /// the frame before.
    pub fn egomotion_mask<'t>(
        &'t self,
        refined: &'t [Match],
        previous: &'t MaskStore<'s>,
        excluded: Excluded,
    ) -> EgomotionMask<'t, 's> {
        EgomotionMask { owner_codes: self.refined_owner, refined, previous, excluded }
    }
}

impl InstanceMasks<'_, '_> {
    /// Returns true if a pixel of instance `at` lies next to the copy mask of another: the pixel
    /// may belong to either, because a feature is several pixels wide, and the silhouette of an
    /// object in front moves with that object. Only others that are distinct count.
    fn is_between(&self, at: usize, u: i32, v: i32) -> bool {
        let around = PixelBox {
            left: u - FEATURE_PX,
            top: v - FEATURE_PX,
            width: 2 * FEATURE_PX + 1,
            height: 2 * FEATURE_PX + 1,
        };
        let rim = [-FEATURE_PX, 0, FEATURE_PX];
        let is_other = |other: usize| other != at && self.distinct >> other & 1 == 1;
        self.instances.iter().enumerate().filter(|&(other, _)| is_other(other)).any(
            |(_, Instance { mask, .. })| {
                around.intersection(&mask.pixels).area() > 0
                    && rim
                        .iter()
                        .any(|dv| rim.iter().any(|du| self.masks.contains(mask, u + du, v + dv)))
            },
        )
    }
}
