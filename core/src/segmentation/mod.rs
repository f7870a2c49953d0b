//! Moving objects without a detector: matches that contradict a static world, grouped and grown to
//! masks. The paper has no such stage; it runs beside tracking, on the matches that tracking
//! assigned to no instance, and hands its masks to tracking as instances of class
//! [`Class::MovingObject`](crate::tracking::Class::MovingObject).
//!
//! The statistics are those of Zhou, Frémont, Quost, Dai, Li, *Moving object detection and
//! segmentation in urban environments from a moving platform* (IVC 68, 2017), on sparse matches
//! over two stereo pairs instead of dense flow:
//!
//! 1. matches whose residual against the camera's motion is too large for its covariance are
//!    *candidates* (`residual`);
//! 2. so are far matches that contradict it only together with their neighbours (`joint`): what
//!    keeps its distance to the camera;
//! 3. candidates that lie together and move alike form groups; a group must have enough members and
//!    motion, and nearly all matches within its box must be candidates (`groups`): of wrong matches
//!    and of poorly known depth that is not so;
//! 4. where candidates are few, and where an object of the frames before must be, patches are
//!    searched for by projection; a near group whose patches are found as well where static points
//!    would be is one of a row of posts or the like, and no moving object (`patches`);
//! 5. a group that agrees with one of the frames before is an object, and is predicted over frames
//!    without one (`hypotheses`);
//! 6. what it left in the static map before that is erased (`trail`);
//! 7. its mask grows from its extent over the disparity image, above the ground, but not over
//!    matches that do not move (`lattice`), nor over surfaces that the map held before (`known`);
//!    the ground plane is lent by the mapper.
//!
//! What has no motion of its own, such as a person's limbs, is kept out of the static map where
//! earlier frames saw through (`seen_through`).
//!
//! Matches assigned to an instance of the detector are left out: an object is not found twice.
//!
//! Memory: 44 bytes for each of 1,024 candidates, 48 for each of 1,024 far matches, a byte a match,
//! 6 bytes for each 4 x 4 px of the image, 96 bytes for each of 64 hypotheses, 80 for each of 32
//! supposed objects, 2 bytes for each 8 x 8 px of the image. Time: a triangulation and projection
//! a match, a comparison for each pair of candidates and of far matches, the cells of each mask,
//! and at most 384 patches a frame.
//!
//! # What can go wrong
//!
//! Objects with fewer matches than a group needs are not found, nor are those that move less than
//! depth errs by. What moves along the line of sight in the camera's own direction and speed has no
//! residual in the image, but in disparity. A wrong camera motion makes everything a candidate:
//! groups are then too large, and refused.

mod candidate;
mod collect;
mod config;
mod extent;
mod groups;
mod hypotheses;
mod hypothesis;
mod joint;
mod known;
mod lattice;
mod observe;
mod patches;
mod residual;
mod seed;
mod seen_through;
mod settings;
#[cfg(test)]
mod tests;
mod trail;

pub use config::SegmentationConfig;
pub(crate) use seen_through::Present;
pub(crate) use trail::Trail;

use crate::{
    geometry::{GroundPlane, StereoRig, Transform},
    image::{View, ViewMut},
    memory::{Capacity, Carver, region_bytes},
    state::Visitor,
    tracking::{Added, Assigned, CameraMotion, GuidedMatching},
    volume::Volume,
};
use candidate::Candidate;
use collect::{Owned, SPARSE_VARIANCE};
use groups::MAX_CANDIDATES;
use hypotheses::{Hypotheses, MAX_HYPOTHESES};
use hypothesis::Hypothesis;
use joint::{FarMatch, MAX_JOINT};
use known::KnownSurfaces;
use lattice::{CELL_PX, Lattice};
use observe::Contradictions;
use patches::{MAX_PATCHES, PatchSearch};
use residual::StaticModel;
use seed::{MAX_SEEDS, Seed};
use seen_through::{Scratch, SeenThrough};

/// Score of an instance found by its motion.
const SCORE: f32 = 0.9;

/// Images, matches and camera motion by which a frame is segmented.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SegmentationInput<'a, 's> {
    /// The cameras.
    pub rig: &'a StereoRig,
    /// The camera's own motion.
    pub camera: &'a CameraMotion,
    /// Disparity of the left image, 1/256 px, 0 none.
    pub disparity_q8: View<'a, u16>,
    /// The ground plane of the disparity image; `None` where it shows too little ground.
    pub ground: Option<GroundPlane>,
    /// The static map of the frames before: an object's mask does not grow over what stood there
    /// already. `None` without a map.
    pub map: Option<&'a Volume<'a>>,
    /// Images in which more matches are searched for on objects that have few.
    pub search: Option<GuidedMatching<'a, 's>>,
    /// Largest error that all disparities have in common, px: everywhere, and at the left and right
    /// edge of the picture, where the lens adds to it.
    pub bias_px: [f64; 2],
}

/// Counts of a frame's motion segmentation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct SegmentationReport {
    /// Matches that were not assigned to an instance of the detector.
    pub matches: u32,
    /// Candidates among them.
    pub candidates: u32,
    /// Groups that passed the gates.
    pub groups: u32,
    /// Instances made of them, or predicted.
    pub instances: u32,
    /// Groups and instances beyond a bound.
    pub refused: u32,
}

/// Motion segmentation, with what it remembers from frame to frame.
#[derive(Debug)]
pub(crate) struct MotionSegmenter<'s> {
    candidates: &'s mut [Candidate],
    is_candidate: &'s mut [u8],
    far: &'s mut [FarMatch],
    values: &'s mut [f32],
    cells: &'s mut [u8],
    blocked: &'s mut [u8],
    queue: &'s mut [u32],
    seeds: &'s mut [Seed],
    seed_count: usize,
    patches: &'s mut [Candidate],
    hypotheses: Hypotheses<'s>,
    seen_through: SeenThrough<'s>,
}

/// Cells of the largest image.
const fn cells(capacity: &Capacity) -> usize {
    capacity.image_width.div_ceil(CELL_PX) * capacity.image_height.div_ceil(CELL_PX)
}

impl<'s> MotionSegmenter<'s> {
    /// Bytes of the slab.
    pub(crate) const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<Candidate>(MAX_CANDIDATES)
            + region_bytes::<u8>(capacity.matches)
            + region_bytes::<FarMatch>(MAX_JOINT)
            + region_bytes::<f32>(MAX_CANDIDATES)
            + 2 * region_bytes::<u8>(cells(capacity))
            + region_bytes::<u32>(cells(capacity))
            + region_bytes::<Seed>(MAX_SEEDS)
            + region_bytes::<Candidate>(MAX_PATCHES)
            + region_bytes::<Hypothesis>(MAX_HYPOTHESES)
            + SeenThrough::bytes(capacity)
    }

    /// Allocates its regions.
    pub(crate) fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self {
            candidates: carver.alloc("segmentation.candidate", MAX_CANDIDATES),
            is_candidate: carver.alloc("segmentation.is_candidate", capacity.matches),
            far: carver.alloc("segmentation.far", MAX_JOINT),
            values: carver.alloc("segmentation.value", MAX_CANDIDATES),
            cells: carver.alloc("segmentation.cell", cells(capacity)),
            blocked: carver.alloc("segmentation.blocked", cells(capacity)),
            queue: carver.alloc("segmentation.queue", cells(capacity)),
            seeds: carver.alloc("segmentation.seed", MAX_SEEDS),
            seed_count: 0,
            patches: carver.alloc("segmentation.patch", MAX_PATCHES),
            hypotheses: Hypotheses::new(carver.alloc("segmentation.hypothesis", MAX_HYPOTHESES)),
            seen_through: SeenThrough::new_in(capacity, carver),
        }
    }

    /// Visits what outlives a frame.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        // Without `..`: a new field must be placed here to compile.
        let Self {
            candidates: _,
            is_candidate: _,
            far: _,
            values: _,
            cells: _,
            blocked: _,
            queue: _,
            seeds: _,
            seed_count: _,
            patches: _,
            hypotheses,
            seen_through,
        } = self;
        hypotheses.visit(visitor);
        seen_through.visit(visitor);
    }

    /// Forgets all groups, whose positions lie in a frame of reference that the camera has left.
    pub(crate) fn forget(&mut self) {
        self.hypotheses.clear();
        self.seen_through.forget();
    }

    /// Sets the depth of what stands where earlier frames saw through to 0. Returns how many pixels
    /// that are.
    pub(crate) fn remove_come(
        &mut self,
        present: &Present<'_>,
        depth_m: &mut ViewMut<'_, f32>,
    ) -> u32 {
        // What masks grow in is free by then.
        let scratch = Scratch { marks: self.cells, queue: self.queue };
        self.seen_through.remove(present, scratch, depth_m)
    }

    /// Visits where objects were before they were known to move.
    pub(crate) fn take_trails(&mut self, t_world_camera: &Transform, visit: impl FnMut(&Trail)) {
        self.hypotheses.take_trails(t_world_camera, visit);
    }

    /// Adds instances of class [`Class::MovingObject`](crate::tracking::Class::MovingObject) for
    /// what moves in this frame to `assigned`. Nothing where the camera's motion is not known.
    pub(crate) fn segment(
        &mut self,
        config: &SegmentationConfig,
        input: &SegmentationInput<'_, '_>,
        assigned: &mut Assigned<'_, '_, '_>,
    ) -> SegmentationReport {
        let camera = input.camera;
        let Some(t_current_previous) = camera.t_current_previous else {
            return SegmentationReport::default();
        };
        let model = StaticModel::new(config, input.rig, &t_current_previous, input.bias_px);
        let known = input
            .map
            .map(|volume| KnownSurfaces { volume, t_world_camera: &camera.t_world_camera });
        let lattice = Lattice::new(input.rig, input.disparity_q8, input.ground).with_known(known);
        let search =
            input.search.map(|search| PatchSearch::new(search, &t_current_previous, &lattice));
        let (matches, [refined, sparse]) = (assigned.matches(), assigned.match_owners());
        let contradictions = Contradictions {
            model: &model,
            t_world_camera: &camera.t_world_camera,
            refined: Owned { matches: matches.refined, codes: refined, variance: 1.0 },
            sparse: Owned { matches: matches.sparse, codes: sparse, variance: SPARSE_VARIANCE },
            lattice: &lattice,
        };
        let mut report = self.observe(&contradictions, search);
        let first = assigned.instances().len();
        let mut index = 0;
        while index < self.hypotheses.all().len() {
            let grown = self.grow(index, &lattice, &camera.t_world_camera);
            let is_own = |u: i32, v: i32| lattice.is_own(self.cells, u, v);
            let added = grown.map(|pixels| assigned.add_moving_object(pixels, SCORE, is_own));
            match added {
                Some(Added::Covered) => {
                    // A detector's instance has taken over.
                    self.hypotheses.remove(index);
                    continue;
                }
                Some(Added::Yes) => report.instances += 1,
                Some(Added::Full) => report.refused += 1,
                None => {}
            }
            let shown = matches!(added, Some(Added::Yes));
            self.hypotheses.note_shown(config, index, shown);
            index += 1;
        }
        assigned.associate_from(first);
        report
    }
}
