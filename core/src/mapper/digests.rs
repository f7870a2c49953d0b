//! A digest of each stage's outcome: the first that differs names the stage at which two runs
//! diverge.
//!
//! Stages are listed in the order data flows. Every stage before the first difference is equal;
//! every stage after it depends on it. The association of detections with tracks has no digest of
//! its own: it runs before the camera's motion and is part of the tracks' digest, which comes later
//! in the list.
//!
//! Memory: 8 bytes a stage and 16 an object. Time: a multiplication for each 8 bytes of images,
//! disparity, matches and masks; of volumes only blocks that changed are read.

use crate::{digest::Digest, objects::MAX_OBJECTS};
use core::fmt;

/// Outcome with a digest of its own, in the order data flows.
///
/// ```
/// use dynvox_core::Digested;
///
/// assert_eq!(Digested::StaticMap.name(), "static_map");
/// assert_eq!(Digested::Object(7).to_string(), "object 7");
/// assert!(Digested::Input < Digested::Stereo, "in the order in which data flow");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Digested {
    /// The images and detections as they came in.
    Input,
    /// The disparity image.
    Stereo,
    /// The scene flow's matches: sparse, refined, selected.
    SceneFlow,
    /// The camera's motion and pose.
    Egomotion,
    /// The tracks: boxes, masks, motions, states, what waits to be fused.
    Tracking,
    /// The static map.
    StaticMap,
    /// The object of that id: its summary and its map.
    Object(u32),
}

impl Digested {
    /// Name of the digest: a field of [`StageDigests`], and NAME in the column `NAME_digest` of
    /// `frames.csv`. [`crate::Stage::names`] tells which stages change it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Stereo => "stereo",
            Self::SceneFlow => "scene_flow",
            Self::Egomotion => "egomotion",
            Self::Tracking => "tracking",
            Self::StaticMap => "static_map",
            Self::Object(_) => "objects",
        }
    }
}

impl fmt::Display for Digested {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Object(id) => write!(f, "object {id}"),
            stage => f.write_str(stage.name()),
        }
    }
}

/// The digest of an object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ObjectDigest {
    /// Number of its track; 0 where there is no object.
    pub id: u32,
    /// Digest of its summary and its map.
    pub digest: u64,
}

/// The digests of all objects that have a volume, by id.
///
/// ```
/// use dynvox_core::{ObjectDigest, ObjectDigests};
///
/// let one = ObjectDigest { id: 3, digest: 99 };
/// let digests = ObjectDigests::from_objects([one].into_iter());
/// assert_eq!(digests.iter().collect::<Vec<_>>(), [&one]);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ObjectDigests([ObjectDigest; MAX_OBJECTS]);

impl ObjectDigests {
    /// From those there are, in any order.
    pub fn from_objects(objects: impl Iterator<Item = ObjectDigest>) -> Self {
        let mut digests = Self::default();
        digests.0.iter_mut().zip(objects).for_each(|(slot, object)| *slot = object);
        // Those that are none go last.
        digests.0.sort_unstable_by_key(|object| object.id.wrapping_sub(1));
        digests
    }

    /// One by one, by id.
    pub fn iter(&self) -> impl Iterator<Item = &ObjectDigest> + Clone {
        self.0.iter().filter(|object| object.id != 0)
    }
}

/// `3:00112233aabbccdd;7:…` by id, or `-` without objects.
impl fmt::Display for ObjectDigests {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, object) in self.iter().enumerate() {
            write!(f, "{}{}:{:016x}", if at == 0 { "" } else { ";" }, object.id, object.digest)?;
        }
        if self.iter().next().is_none() { f.write_str("-") } else { Ok(()) }
    }
}

/// The digests of one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StageDigests {
    /// See [`Digested::Input`]: a changed decoder is told from a changed core.
    pub input: u64,
    /// See [`Digested::Stereo`].
    pub stereo: u64,
    /// See [`Digested::SceneFlow`].
    pub scene_flow: u64,
    /// See [`Digested::Egomotion`].
    pub egomotion: u64,
    /// See [`Digested::Tracking`].
    pub tracking: u64,
    /// See [`Digested::StaticMap`].
    pub static_map: u64,
    /// See [`Digested::Object`].
    pub objects: ObjectDigests,
}

impl StageDigests {
    /// All digests but those of objects, in the order data flows.
    pub const fn in_order(&self) -> [(Digested, u64); 6] {
        [
            (Digested::Input, self.input),
            (Digested::Stereo, self.stereo),
            (Digested::SceneFlow, self.scene_flow),
            (Digested::Egomotion, self.egomotion),
            (Digested::Tracking, self.tracking),
            (Digested::StaticMap, self.static_map),
        ]
    }

    /// One for all that came out of frame `frame`; the input is not in it.
    ///
    /// ```
    /// use dynvox_core::StageDigests;
    ///
    /// let digests = StageDigests::default();
    /// assert_ne!(digests.whole(0), digests.whole(1), "the frame's number counts");
    /// ```
    pub fn whole(&self, frame: u32) -> u64 {
        let mut digest = Digest::default();
        digest.u64(u64::from(frame));
        // Left out, so that recordings in other formats with equal results have equal digests.
        let outcomes = self.in_order().into_iter().filter(|(of, _)| *of != Digested::Input);
        outcomes.for_each(|(_, outcome)| digest.u64(outcome));
        for object in self.objects.iter() {
            digest.u64(u64::from(object.id));
            digest.u64(object.digest);
        }
        digest.finish()
    }

    /// The first outcome, in the order data flows, whose digest differs from another step's.
    ///
    /// ```
    /// use dynvox_core::{Digested, StageDigests};
    ///
    /// let one = StageDigests { stereo: 1, scene_flow: 2, ..StageDigests::default() };
    /// let other = StageDigests { stereo: 1, scene_flow: 3, ..StageDigests::default() };
    /// assert_eq!(one.first_difference(&other), Some(Digested::SceneFlow));
    /// assert_eq!(one.first_difference(&one), None);
    /// ```
    pub fn first_difference(&self, other: &Self) -> Option<Digested> {
        let mut pairs = self.in_order().into_iter().zip(other.in_order());
        let stage = pairs.find(|(mine, theirs)| mine != theirs).map(|((stage, _), _)| stage);
        // The object of lowest id that differs or that only one step has.
        let alone = |of: &Self, than: Self| {
            of.objects
                .iter()
                .find(|&object| than.objects.iter().all(|known| known != object))
                .map(|o| o.id)
        };
        stage.or_else(|| {
            alone(self, *other).into_iter().chain(alone(other, *self)).min().map(Digested::Object)
        })
    }
}

/// The digests in the order data flows, with a space between two, those of all objects last; 16
/// zeros for a stage that did not run.
impl fmt::Display for StageDigests {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (_, digest) in self.in_order() {
            write!(f, "{digest:016x} ")?;
        }
        self.objects.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;

    fn objects(all: &[(u32, u64)]) -> ObjectDigests {
        ObjectDigests::from_objects(all.iter().map(|&(id, digest)| ObjectDigest { id, digest }))
    }

    #[test]
    fn names_the_first_stage_that_differs_and_the_object_by_its_id() {
        let one = StageDigests {
            input: 1,
            stereo: 2,
            scene_flow: 3,
            egomotion: 4,
            tracking: 5,
            static_map: 6,
            objects: objects(&[(9, 1), (2, 7)]),
        };
        assert_eq!(one.first_difference(&one), None);
        assert_eq!(
            // The order is that of computation: the map differs because egomotion does.
            one.first_difference(&StageDigests { static_map: 0, egomotion: 0, ..one }),
            Some(Digested::Egomotion)
        );
        // Object 9 has another content; in the next case object 5 exists on one side only.
        assert_eq!(
            one.first_difference(&StageDigests { objects: objects(&[(2, 7), (9, 2)]), ..one }),
            Some(Digested::Object(9))
        );
        assert_eq!(
            one.first_difference(&StageDigests {
                objects: objects(&[(2, 7), (5, 0), (9, 1)]),
                ..one
            }),
            Some(Digested::Object(5))
        );
        assert_eq!(
            one.first_difference(&StageDigests { objects: objects(&[(2, 7), (9, 1)]), ..one }),
            None,
            "in any order"
        );
        // Equal outcomes of two frames have two digests.
        assert_ne!(one.whole(0), one.whole(1));
        assert_ne!(one.whole(0), StageDigests { objects: objects(&[(2, 7)]), ..one }.whole(0));
        // Inputs that lead to equal outcomes are no difference.
        assert_eq!(one.whole(0), StageDigests { input: 0, ..one }.whole(0));
        assert_eq!(format!("{}", one.objects), "2:0000000000000007;9:0000000000000001");
        assert_eq!(format!("{}", ObjectDigests::default()), "-");
        assert_eq!(format!("{one}").split(' ').count(), 7);
    }
}
