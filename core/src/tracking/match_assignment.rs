//! Which instance each match of the scene flow is assigned to.

use super::{Tracker, instances::Instance, track::Track};
use crate::{
    geometry::scalar::floor_i32,
    masks::{MaskStore, PixelBox},
    scene_flow::Match,
};
use bytemuck::{Pod, Zeroable};

/// Half the width of a feature's descriptor, px.
const FEATURE_PX: i32 = 5;

/// Owner of a match.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MatchOwner {
    /// The background.
    None,
    /// The instance at that position.
    Instance(usize),
    /// It may lie on either of two instances.
    Ambiguous,
}

/// A [`MatchOwner`] in a byte.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct OwnerCode(u8);

impl OwnerCode {
    const AMBIGUOUS: u8 = u8::MAX;

    pub fn get(self) -> MatchOwner {
        match self.0 {
            0 => MatchOwner::None,
            Self::AMBIGUOUS => MatchOwner::Ambiguous,
            code => MatchOwner::Instance(usize::from(code) - 1),
        }
    }

    /// Returns true if the owner is that instance.
    pub fn is_instance(self, index: usize) -> bool {
        usize::from(self.0) == index + 1
    }
}

impl From<MatchOwner> for OwnerCode {
    fn from(match_owner: MatchOwner) -> Self {
        Self(match match_owner {
            MatchOwner::None => 0,
            MatchOwner::Instance(index) => {
                debug_assert!(index < super::MAX_DETECTIONS);
                index as u8 + 1
            }
            MatchOwner::Ambiguous => Self::AMBIGUOUS,
        })
    }
}

/// The matches of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FrameMatches<'m> {
    /// Refined below the pixel.
    pub refined: &'m [Match],
    /// Matches of other features, at whole pixels.
    pub sparse: &'m [Match],
}

impl Tracker<'_> {
    /// Assigns each match to the instance whose copy mask it lies under or else to the best one
    /// whose delete mask it lies under.
    pub(super) fn assign_matches(&mut self, matches: &FrameMatches<'_>) {
        let tables = [&mut *self.refined_owner, &mut *self.sparse_owner];
        for (codes, matches) in tables.into_iter().zip([matches.refined, matches.sparse]) {
            codes.iter_mut().zip(matches).for_each(|(code, _)| *code = OwnerCode::default());
        }
        self.assign_from(0, matches);
    }

    /// Assigns the matches without an instance to those from position `first` on.
    pub(super) fn assign_from(&mut self, first: usize, matches: &FrameMatches<'_>) {
        let masks = self.masks.current();
        let (instances, tracks) = (self.instances.all(), self.tracks.all());
        // Two cars parked one behind the other in the distance keep their matches.
        let distinct = |other: &Instance| {
            let moves =
                || other.track.get().and_then(|at| tracks.get(at)).is_some_and(Track::moves);
            !other.tracked_only.get() || moves()
        };
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
                Some(at) if is_between(instances, distinct, masks, at, u, v) => {
                    MatchOwner::Ambiguous
                }
                Some(at) => MatchOwner::Instance(at),
                None => MatchOwner::None,
            });
        }
    }
}

/// Returns true if a pixel of instance `at` lies next to the copy mask of another: the pixel may
/// belong to either, because a feature is several pixels wide, and the silhouette of an object in
/// front moves with that object. Only others that are `distinct` count.
fn is_between(
    instances: &[Instance],
    distinct: impl Fn(&Instance) -> bool,
    masks: &MaskStore<'_>,
    at: usize,
    u: i32,
    v: i32,
) -> bool {
    let around = PixelBox {
        left: u - FEATURE_PX,
        top: v - FEATURE_PX,
        width: 2 * FEATURE_PX + 1,
        height: 2 * FEATURE_PX + 1,
    };
    let rim = [-FEATURE_PX, 0, FEATURE_PX];
    instances.iter().enumerate().filter(|&(other, instance)| other != at && distinct(instance)).any(
        |(_, other)| {
            around.intersection(&other.mask.pixels).area() > 0
                && rim
                    .iter()
                    .any(|dv| rim.iter().any(|du| masks.contains(&other.mask, u + du, v + dv)))
        },
    )
}

/// Returns true if two keypoints are one.
pub(super) fn is_same_keypoint(a: [f32; 2], b: [f32; 2]) -> bool {
    let [u, v] = [a[0] - b[0], a[1] - b[1]];
    u * u + v * v < 2.0
}

/// The pixel a keypoint lies in; one outside every image for what is not a number.
pub(super) fn pixel([u, v]: [f32; 2]) -> (i32, i32) {
    if !(u.is_finite() && v.is_finite()) {
        return (-1, -1);
    }
    (floor_i32(u + 0.5), floor_i32(v + 0.5))
}
