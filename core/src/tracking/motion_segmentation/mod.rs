//! Moving objects without a detector: matches that contradict a static world, grouped and grown to masks.
//!
//! The statistics are those of Zhou, Frémont, Quost, Dai, Li, *Moving object detection and segmentation in urban environments from a
//! moving platform* (IVC 68, 2017), on sparse matches over two stereo pairs in place of dense flow:
//!
//! 1. matches whose residual against the camera's motion is too large for its covariance are *candidates* (`residual`);
//! 2. candidates that lie together and move alike form groups; a group must have enough members and motion, and nearly all matches
//!    within its box must be candidates (`groups`): of wrong matches and of poorly known depth that is not so;
//! 3. where candidates are few, and where an object of the frame before must be, patches are searched for by projection (`patches`);
//! 4. a group that agrees with one of the frames before is an object, and is predicted over frames without one (`hypotheses`);
//! 5. its mask grows from its extent over the disparity image, above the ground (`lattice`, `ground`).
//!
//! Matches assigned to an instance of the detector are left out: an object is not found twice.
//!
//! Memory: 44 bytes for each of 1,024 candidates, a byte a match, 5 bytes for each 4 x 4 px of the image, 88 bytes for each of 64
//! hypotheses, 72 for each of 32 supposed objects. Time: a triangulation and projection a match, a comparison for each pair of candidates,
//! the cells of each mask, and at most 384 patches a frame.
//!
//! # What can go wrong
//!
//! Objects with fewer matches than a group needs are not found, nor are those that move less than depth errs by. What moves along the line
//! of sight in the camera's own direction and speed has no residual in the image, but in disparity. A wrong camera motion makes
//! everything a candidate: groups are then too large, and refused.

mod config;
mod ground;
mod groups;
mod hypotheses;
mod lattice;
mod patches;
mod residual;
#[cfg(test)]
mod tests;

pub use config::SegmentationConfig;
pub use ground::Ground;

use super::{
    CameraMotion, Class, FrameMatches, GuidedMatching, Tracker,
    match_assignment::{MatchOwner, OwnerCode},
};
use crate::{
    geometry::StereoRig,
    image::View,
    masks::PixelBox,
    memory::{Capacity, Carver, region_bytes},
    scene_flow::Match,
    state::Visitor,
};
use groups::{CANDIDATES_MAX, Candidate, GROUPS_MAX, Group};
use hypotheses::{HYPOTHESES_MAX, Hypotheses, Hypothesis};
use lattice::{CELL_PX, Lattice};
use patches::{PATCHES_MAX, PatchMemory, PatchSearch, SEEDS_MAX, Seed};
use residual::StaticModel;

/// Score of an instance found by its motion.
const SCORE: f32 = 0.9;

/// Variance of a sparse match, at whole pixels, against that of a refined one.
const SPARSE_VARIANCE: f64 = 4.0;

/// What motion segmentation found in a frame.
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
pub(super) struct MotionSegmenter<'s> {
    candidates: &'s mut [Candidate],
    is_candidate: &'s mut [u8],
    values: &'s mut [f32],
    cells: &'s mut [u8],
    queue: &'s mut [u32],
    seeds: &'s mut [Seed],
    seed_count: usize,
    patches: &'s mut [Candidate],
    hypotheses: Hypotheses<'s>,
}

/// Cells of the largest image.
const fn cells(capacity: &Capacity) -> usize {
    capacity.image_width.div_ceil(CELL_PX) * capacity.image_height.div_ceil(CELL_PX)
}

impl<'s> MotionSegmenter<'s> {
    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<Candidate>(CANDIDATES_MAX)
            + region_bytes::<u8>(capacity.matches)
            + region_bytes::<f32>(CANDIDATES_MAX)
            + region_bytes::<u8>(cells(capacity))
            + region_bytes::<u32>(cells(capacity))
            + region_bytes::<Seed>(SEEDS_MAX)
            + region_bytes::<Candidate>(PATCHES_MAX)
            + region_bytes::<Hypothesis>(HYPOTHESES_MAX)
    }

    /// Allocates its regions.
    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self {
            candidates: carver.alloc("segmentation.candidate", CANDIDATES_MAX),
            is_candidate: carver.alloc("segmentation.is_candidate", capacity.matches),
            values: carver.alloc("segmentation.value", CANDIDATES_MAX),
            cells: carver.alloc("segmentation.cell", cells(capacity)),
            queue: carver.alloc("segmentation.queue", cells(capacity)),
            seeds: carver.alloc("segmentation.seed", SEEDS_MAX),
            seed_count: 0,
            patches: carver.alloc("segmentation.patch", PATCHES_MAX),
            hypotheses: Hypotheses::new(carver.alloc("segmentation.hypothesis", HYPOTHESES_MAX)),
        }
    }

    /// Visits what outlives a frame.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            candidates: _,
            is_candidate: _,
            values: _,
            cells: _,
            queue: _,
            seeds: _,
            seed_count: _,
            patches: _,
            hypotheses,
        } = self;
        hypotheses.visit(visitor);
    }

    /// Groups what contradicts the static model and continues the hypotheses. With `search`, the places that have too few matches are searched
    /// for more. `match_owners` are those of the refined and of the sparse matches.
    fn observe(
        &mut self,
        model: &StaticModel<'_>,
        camera: &CameraMotion,
        matches: &FrameMatches<'_>,
        match_owners: [&[OwnerCode]; 2],
        search: Option<PatchSearch<'_, '_>>,
    ) -> SegmentationReport {
        let mut report = SegmentationReport::default();
        let [match_owner, sparse_owner] = match_owners;
        let len = self.collect(model, matches.refined, match_owner, 1.0, &mut report);
        let Some(candidates) = self.candidates.get_mut(..len) else { return report };
        groups::join(candidates, model.rig.focal_px);
        let free = matches.refined.iter().zip(match_owner).zip(&*self.is_candidate).filter(|((_, match_owner), _)| is_free(**match_owner));
        let marked = free.map(|((m, _), mark)| (m, *mark > 0));
        let mut groups = groups::select(model, candidates, marked, self.values, &mut report.refused);
        if let Some(search) = search {
            self.seed_count = 0;
            self.seed_predicted(camera);
            self.seed_small_groups(model.config, len);
            let len = self.collect(model, matches.sparse, sparse_owner, SPARSE_VARIANCE, &mut SegmentationReport::default());
            groups::join(self.candidates.get_mut(..len).unwrap_or_default(), model.rig.focal_px);
            self.seed_small_groups(model.config, len);
            self.verify(model, search, &mut groups, &mut report);
        }
        report.groups = groups.len() as u32;
        report.refused += self.hypotheses.update(model.config, &groups, &camera.t_world_camera);
        report
    }

    /// Collects the candidates among matches whose variance is `variance` times that of refined ones; how many they are.
    fn collect(
        &mut self,
        model: &StaticModel<'_>,
        matches: &[Match],
        match_owner: &[OwnerCode],
        variance: f64,
        report: &mut SegmentationReport,
    ) -> usize {
        let (mut len, mut stride, mut count) = (0, 1, 0usize);
        let (least, far_m) = (variance * f64::from(model.config.candidate_chi_square), f64::from(model.config.far_m));
        for ((m, match_owner), mark) in matches.iter().zip(match_owner).zip(self.is_candidate.iter_mut()) {
            *mark = 0;
            let residual = if is_free(*match_owner) { model.residual(m) } else { None };
            report.matches += u32::from(is_free(*match_owner));
            let Some(residual) = residual.filter(|found| found.chi_square > least && found.point_m.z < far_m) else { continue };
            *mark = 1;
            count += 1;
            if !(count - 1).is_multiple_of(stride) {
                continue;
            }
            if len == self.candidates.len() {
                // Every second one stays.
                len = thin(self.candidates);
                stride *= 2;
                if !(count - 1).is_multiple_of(stride) {
                    continue;
                }
            }
            if let Some(slot) = self.candidates.get_mut(len) {
                *slot = Candidate::new(m, &residual, len);
                len += 1;
            }
        }
        report.candidates = count as u32;
        len
    }

    /// Supposes an object; one beyond the bound is not searched for.
    fn seed(&mut self, seed: Seed) {
        if let Some(slot) = self.seeds.get_mut(self.seed_count) {
            *slot = seed;
            self.seed_count += 1;
        }
    }

    /// Supposes each followed group where its motion takes it.
    fn seed_predicted(&mut self, camera: &CameraMotion) {
        for index in 0..self.hypotheses.all().len() {
            let Some(hypothesis) = self.hypotheses.all().get(index).copied() else { break };
            let (extent, motion_m) = hypothesis.predicted(&camera.t_world_camera);
            self.seed(Seed::new(&extent, motion_m));
        }
    }

    /// Supposes an object at each group of three candidates or more that moves.
    fn seed_small_groups(&mut self, config: &SegmentationConfig, len: usize) {
        for first in 0..len {
            let Some(candidates) = self.candidates.get(..len) else { return };
            if candidates.get(first).is_none_or(|candidate| !candidate.is_first(first)) {
                continue;
            }
            let group = groups::measure(candidates, first as u32, self.values).filter(|group| group.is_plausible(config));
            if let Some(group) = group {
                self.seed(Seed::new(&group.extent, group.motion_m));
            }
        }
    }

    /// Adds the groups of supposed objects that are there, where none was found.
    fn verify(
        &mut self,
        model: &StaticModel<'_>,
        mut search: PatchSearch<'_, '_>,
        groups: &mut heapless::Vec<Group, GROUPS_MAX>,
        report: &mut SegmentationReport,
    ) {
        let Self { seeds, seed_count, cells, queue, patches, values, .. } = self;
        let mut memory = PatchMemory { cells, queue, members: patches, values };
        for seed in seeds.iter().take(*seed_count) {
            if groups.iter().any(|group| seed.is_at(group)) {
                continue;
            }
            if let Some(group) = search.verify(model, seed, &mut memory) {
                report.refused += u32::from(groups.push(group).is_err());
            }
        }
    }

    /// Grows the mask of the confirmed hypothesis at that position; the pixels it lies in.
    fn grow(&mut self, index: usize, lattice: &Lattice<'_>, ground: Option<&Ground>, camera: &CameraMotion) -> Option<PixelBox> {
        let hypothesis = self.hypotheses.all().get(index).filter(|hypothesis| hypothesis.is_confirmed())?;
        lattice.grow(&hypothesis.extent(&camera.t_world_camera), ground, self.cells, self.queue)
    }
}

/// Whether a match belongs to no instance.
fn is_free(match_owner: OwnerCode) -> bool {
    match_owner.get() == MatchOwner::None
}

/// Keeps every second candidate; how many those are.
fn thin(candidates: &mut [Candidate]) -> usize {
    let len = candidates.len().div_ceil(2);
    for index in 0..len {
        let kept = candidates.get(2 * index).copied();
        if let Some((slot, kept)) = candidates.get_mut(index).zip(kept) {
            *slot = kept.at(index);
        }
    }
    len
}

impl Tracker<'_> {
    /// Adds instances of class [`Class::MovingObject`] for what moves in this frame, associates them with tracks and assigns their
    /// matches to them.
    pub(super) fn segment_motion(
        &mut self,
        rig: &StereoRig,
        camera: &CameraMotion,
        matches: &FrameMatches<'_>,
        disparity_q8: View<'_, u16>,
        search: Option<GuidedMatching<'_, '_>>,
    ) {
        let config = self.config;
        let Some(t_current_previous) = camera.t_current_previous.filter(|_| config.dynamic && config.segmentation.enabled) else { return };
        let bias_px = [config.motion.bias_px, config.motion.lens_px].map(f64::from);
        let model = StaticModel::new(&config.segmentation, rig, &t_current_previous, bias_px);
        let lattice = Lattice::new(rig, disparity_q8);
        let ground = Ground::find(&lattice);
        let search = search.map(|search| PatchSearch::new(search, &t_current_previous, &lattice, ground.as_ref()));
        let match_owners = [&*self.refined_owner, &*self.sparse_owner];
        let mut report = self.segmenter.observe(&model, camera, matches, match_owners, search);
        let first = self.instances.all().len();
        let mut index = 0;
        while index < self.segmenter.hypotheses.all().len() {
            let grown = self.segmenter.grow(index, &lattice, ground.as_ref(), camera);
            let added = grown.map(|pixels| self.add_moving_object(&lattice, pixels));
            match added {
                Some(Added::Covered) => {
                    // A detector's instance has taken over.
                    self.segmenter.hypotheses.remove(index);
                    continue;
                }
                Some(Added::Yes) => report.instances += 1,
                Some(Added::Full) => report.refused += 1,
                None => {}
            }
            index += 1;
        }
        self.report.segmentation = report;
        if self.instances.all().len() > first {
            let masks = &self.masks;
            self.tracks.associate_from(first, &config, self.frame, self.instances.all_mut(), masks, &mut self.report.tracks);
            self.assign_from(first, matches);
        }
    }

    /// Adds the marked cells as an instance.
    fn add_moving_object(&mut self, lattice: &Lattice<'_>, pixels: PixelBox) -> Added {
        let masks = self.masks.current_mut();
        let Some(mask) = masks.alloc(pixels) else { return Added::Full };
        let cells = &*self.segmenter.cells;
        masks.fill(&mask, |u, v| lattice.is_marked(cells, u, v));
        let whole = masks.area(&mask);
        self.instances.all().iter().for_each(|instance| masks.subtract(&mask, &instance.mask));
        if 3 * masks.area(&mask) <= 2 * whole {
            masks.free_last(mask);
            return Added::Covered;
        }
        if self.instances.add(&self.config, mask, Class::MovingObject, SCORE, self.size[0]) {
            Added::Yes
        } else {
            masks.free_last(mask);
            Added::Full
        }
    }
}

/// What became of a moving object.
enum Added {
    Yes,
    /// Other instances have a third of its pixels or more.
    Covered,
    /// There was no space for it.
    Full,
}
