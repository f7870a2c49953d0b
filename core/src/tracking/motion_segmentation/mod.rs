//! Moving objects without a detector: matches that contradict a static world, grouped and grown to masks.
//!
//! The statistics are those of Zhou, Frémont, Quost, Dai, Li, *Moving object detection and segmentation in urban environments from a
//! moving platform* (IVC 68, 2017), on sparse matches over two stereo pairs in place of dense flow:
//!
//! 1. matches whose residual against the camera's motion is too large for its covariance are *candidates* (`residual`);
//! 2. candidates that lie together and move alike form groups; a group must have enough members and motion, and nearly all matches
//!    within its box must be candidates (`groups`): of wrong matches and of poorly known depth that is not so;
//! 3. a group that agrees with one of the frames before is an object, and is predicted over frames without one (`hypotheses`);
//! 4. its mask grows from its extent over the disparity image, above the ground (`lattice`, `ground`).
//!
//! Matches assigned to an instance of the detector are left out: an object is not found twice.
//!
//! Memory: 44 bytes for each of 1,024 candidates, a byte a match, 5 bytes for each 4 x 4 px of the image, 88 bytes for each of 64
//! hypotheses. Time: a triangulation and projection a match, a comparison for each pair of candidates, and the cells of each mask.
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
mod residual;
#[cfg(test)]
mod tests;

pub use config::SegmentationConfig;

use super::{
    CameraMotion, Class, FrameMatches, Tracker,
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
use ground::Ground;
use groups::{CANDIDATES_MAX, Candidate};
use hypotheses::{HYPOTHESES_MAX, Hypotheses, Hypothesis};
use lattice::{CELL_PX, Lattice};
use residual::StaticModel;

/// Score of an instance found by its motion.
const SCORE: f32 = 0.9;

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
            hypotheses: Hypotheses::new(carver.alloc("segmentation.hypothesis", HYPOTHESES_MAX)),
        }
    }

    /// Visits what outlives a frame.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { candidates: _, is_candidate: _, values: _, cells: _, queue: _, hypotheses } = self;
        hypotheses.visit(visitor);
    }

    /// Groups what contradicts the static model and continues the hypotheses.
    fn observe(&mut self, model: &StaticModel<'_>, camera: &CameraMotion, matches: &[Match], codes: &[OwnerCode]) -> SegmentationReport {
        let mut report = SegmentationReport::default();
        let free = || matches.iter().zip(codes).map(|(m, code)| (m, code.get() == MatchOwner::None));
        let (mut len, mut stride, mut count) = (0, 1, 0usize);
        for ((m, is_free), mark) in free().zip(self.is_candidate.iter_mut()) {
            *mark = 0;
            let residual = if is_free { model.residual(m) } else { None };
            report.matches += u32::from(is_free);
            let far_m = f64::from(model.config.far_m);
            let contradicts = |found: &residual::Residual| found.chi_square > f64::from(model.config.candidate_chi_square);
            let Some(residual) = residual.filter(|found| contradicts(found) && found.point_m.z < far_m) else { continue };
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
        let Some(candidates) = self.candidates.get_mut(..len) else { return report };
        groups::join(candidates, model.rig.focal_px);
        let marked = free().zip(&*self.is_candidate).filter(|((_, is_free), _)| *is_free).map(|((m, _), mark)| (m, *mark > 0));
        let groups = groups::select(model, candidates, marked, self.values, &mut report.refused);
        report.groups = groups.len() as u32;
        report.refused += self.hypotheses.update(model.config, &groups, &camera.t_world_camera);
        report
    }

    /// Grows the mask of the confirmed hypothesis at that position; the pixels it lies in.
    fn grow(&mut self, index: usize, lattice: &Lattice<'_>, ground: Option<&Ground>, camera: &CameraMotion) -> Option<PixelBox> {
        let hypothesis = self.hypotheses.all().get(index).filter(|hypothesis| hypothesis.is_confirmed())?;
        lattice.grow(&hypothesis.extent(&camera.t_world_camera), ground, self.cells, self.queue)
    }
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
    ) {
        let config = self.config;
        let Some(t_current_previous) = camera.t_current_previous.filter(|_| config.dynamic && config.segmentation.enabled) else { return };
        let bias_px = [config.motion.bias_px, config.motion.lens_px].map(f64::from);
        let model = StaticModel::new(&config.segmentation, rig, &t_current_previous, bias_px);
        let mut report = self.segmenter.observe(&model, camera, matches.refined, self.refined_owner);
        let lattice = Lattice::new(rig, disparity_q8);
        let ground = Ground::find(&lattice);
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
