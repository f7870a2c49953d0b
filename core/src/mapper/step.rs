//! One frame: the loop of the paper (Section III), a line or two per stage; each stage returns what
//! the next one takes.

use super::{
    BlockCount, Config, Mapper, ObjectDigest, ObjectDigests, PoseOrigin, Report, StageDigests,
    StepError, StereoFrame,
    localization::{Localization, Located},
    static_map::StaticMap,
};
use crate::{
    Executor, Stage,
    digest::Digest,
    egomotion::MotionEstimate,
    image::InvalidPair,
    invariants::Invariants,
    objects::{InstancesReport, NoSink, ObjectFrame, ObjectSink, Picture},
    rectify::{Pair, self_calibration::SelfCalibration},
    scene_flow::{FlowMatcher, FlowReport, Match},
    state::Hasher,
    stereo::{RectifiedPair, StereoMatcher, StereoReport},
    tracking::{FrameMatches, GuidedMatching, TrackingReport},
    volume::{AllocationReport, BlockStore, NoStore, PruneReport},
};

/// What a frame's stages return, for its report.
struct Outcome {
    stereo: StereoReport,
    scene_flow: FlowReport,
    located: Located,
    tracking: TrackingReport,
    fused: bool,
    allocation: AllocationReport,
    prune: PruneReport,
}

impl Mapper<'_> {
    /// Takes one frame: depth, motion, map. Never allocates, never panics; what could not be done
    /// is counted in the report. Blocks that must leave a full pool are lost, and counted.
    pub fn step<E: Executor>(
        &mut self,
        frame: &StereoFrame<'_>,
        executor: &E,
    ) -> Result<Report, StepError> {
        self.step_with(frame, executor, &mut NoStore, &mut NoSink)
    }

    /// As [`Mapper::step`], with a store for blocks that are evicted and loaded again when they are
    /// visible, and a sink for objects that retire.
    // Never inlined, so that a step's stack can be told from its caller's.
    #[inline(never)]
    pub fn step_with<E: Executor, S: BlockStore, O: ObjectSink>(
        &mut self,
        frame: &StereoFrame<'_>,
        executor: &E,
        store: &mut S,
        sink: &mut O,
    ) -> Result<Report, StepError> {
        let size = self.validate(frame)?;
        let input = frame.digest();
        // The rectified images are lent out for the step, so that the stages may read them while
        // they change the mapper.
        let mut images = core::mem::take(&mut self.rectified);
        let raw = Pair { left: frame.left, right: frame.right, colour: frame.colour };
        let rectified =
            executor.stage(Stage::Rectify, || self.rectifier.rectify(&raw, &mut images, executor));
        let Pair { left, right, colour } = rectified.unwrap_or(raw);
        let rectification = self.rectifier.report(&Pair { left, right, colour });
        let mut aligned = core::mem::take(&mut self.aligned);
        let moved = self.self_calibration.row_shift(&self.config.rig).and_then(|shift| {
            executor.stage(Stage::Rectify, || aligned.align(right, &shift, executor))
        });
        let frame = StereoFrame { left, right: moved.unwrap_or(right), colour, ..*frame };
        let report = self.step_rectified(&frame, size, executor, store, sink);
        (self.rectified, self.aligned) = (images, aligned);
        Ok(report.with_input(input, rectification))
    }

    /// Takes a rectified frame that was validated.
    fn step_rectified<E: Executor, S: BlockStore, O: ObjectSink>(
        &mut self,
        frame: &StereoFrame<'_>,
        size: [usize; 2],
        executor: &E,
        store: &mut S,
        sink: &mut O,
    ) -> Report {
        let (config, rig) = (&self.config, self.config.scaled_rig());
        let invalid = self.rectifier.invalid();
        // (A) Depth from the pair, and (C.1) sparse scene flow over this pair and the last.
        let (stereo, scene_flow) = match_images(
            config,
            &mut self.stereo,
            &mut self.scene_flow,
            frame,
            invalid.as_ref(),
            executor,
        );
        calibrate(
            config,
            &mut self.self_calibration,
            &mut self.stereo,
            &mut self.scene_flow,
            executor,
        );
        let disparity_q8 = self.stereo.disparity_q8();
        // Objects are followed from frame to frame: matches with an earlier one say nothing of
        // theirs.
        let with_last = self.camera.since_reference() == 0;
        let matches =
            if with_last { frame_matches(&self.scene_flow) } else { FrameMatches::default() };
        // (B) Detections, associated with tracks, and the matches assigned to them.
        let interval_s = self.clock.advance(frame.time_ns, config.tracking.frame_interval_s);
        self.tracker.set_frame_interval_s(interval_s);
        let assigned = executor.stage(Stage::Instances, || {
            self.tracker.detect(self.frame, frame.detections, size, matches).assign_matches()
        });
        // (C.2) The camera's own motion, from what does not move. The first frame's camera is the
        // world.
        let mut localization = Localization {
            config,
            frame: self.frame,
            interval_s,
            disparity_q8,
            scene_flow: &self.scene_flow,
            background: &self.background,
            camera: &mut self.camera,
            self_calibration: &mut self.self_calibration,
            estimator: &mut self.estimator,
            raycaster: &mut self.raycaster,
            depth_m: self.depth_m,
        };
        let mask = assigned.egomotion_mask();
        let located = executor.stage(Stage::Egomotion, || {
            localization.locate(frame, scene_flow.status, &mask, executor)
        });
        // (B) Moving objects that no detector found, and (D) the objects' motions.
        let search =
            with_last.then_some(GuidedMatching { matcher: &self.scene_flow, disparity_q8 });
        let segment_motion =
            || assigned.segment_motion(&rig, &located.camera, disparity_q8, search);
        let assigned = executor.stage(Stage::Segmentation, segment_motion);
        let estimate_motions =
            || assigned.estimate_motions(&rig, &located.camera, search, &mut self.estimator);
        let mut tracked = executor.stage(Stage::Instances, estimate_motions);
        // (E) The static map, without what moves or may move, and the objects' maps; unless the
        // pose is extrapolated.
        let fused = located.found.origin != PoseOrigin::Held
            && self.frame.is_multiple_of(config.mapper.fuse_every.max(1));
        let mut map = StaticMap {
            config,
            disparity_q8,
            background: &mut self.background,
            depth_m: self.depth_m,
        };
        let voxels_erased =
            executor.stage(Stage::Prune, || map.erase_trails(&located.camera, &mut tracked));
        let allocation = if fused {
            map.fuse(frame, &located.camera, &mut tracked, executor, store)
        } else {
            AllocationReport::default()
        };
        let picture = Picture { grey: frame.left, colour: frame.colour };
        let shown = ObjectFrame {
            rig: &rig,
            t_world_camera: &located.camera.t_world_camera,
            picture,
            disparity_q8,
        };
        let tracking = executor.stage(Stage::Instances, || {
            self.objects.reconstruct(&tracked, fused.then_some(&shown), executor, sink);
            tracked.commit()
        });
        // (F) Noise last observed a fixed lag ago is removed.
        let prune = if fused {
            executor.stage(Stage::Prune, || self.background.prune())
        } else {
            PruneReport::default()
        };
        let prune = PruneReport { voxels_erased, ..prune };
        self.finish_frame(Outcome {
            stereo,
            scene_flow,
            located,
            tracking,
            fused,
            allocation,
            prune,
        })
    }

    /// Reports the frame and counts it.
    fn finish_frame(&mut self, outcome: Outcome) -> Report {
        let Outcome {
            stereo,
            scene_flow,
            located: Located { camera, found },
            tracking,
            fused,
            allocation,
            prune,
        } = outcome;
        if self.camera.since_reference() > 0 {
            self.scene_flow.keep_previous();
        }
        if fused {
            self.observe_free_space(&camera.t_world_camera);
        }
        let digests = self.digests(found.egomotion.as_ref());
        let report = Report {
            frame: self.frame,
            t_world_camera: camera.t_world_camera,
            rectification: None,
            stereo,
            scene_flow,
            pose: found.origin,
            segment: self.camera.segment(),
            egomotion: found.egomotion,
            icp: found.icp,
            self_calibration: self.self_calibration.report(),
            instances: InstancesReport::of(
                &tracking,
                self.objects.report(),
                found.matches_excluded,
            ),
            fused,
            allocation,
            prune,
            blocks: self.block_count(),
            internal_faults: self.check_invariants(),
            digests,
            digest: digests.whole(self.frame),
        };
        self.frame += 1;
        report
    }

    /// How much of what must hold after a frame does not.
    fn check_invariants(&self) -> u32 {
        let mut invariants = Invariants::default();
        invariants.require(self.camera.t_world_camera().is_finite(), "the camera's pose is finite");
        self.scene_flow.check_invariants(&mut invariants);
        self.tracker.check_invariants(&mut invariants);
        self.objects.check_invariants(&mut invariants);
        self.background.check_invariants(&mut invariants);
        invariants.faults()
    }

    fn block_count(&self) -> BlockCount {
        let pool = self.background.pool();
        BlockCount {
            used: pool.len() as u32,
            peak: pool.peak() as u32,
            capacity: pool.capacity() as u32,
            visible: self.background.visible().slots().len() as u32,
        }
    }

    /// Digests of what each stage made of a frame.
    pub(super) fn digests(&mut self, egomotion: Option<&MotionEstimate>) -> StageDigests {
        StageDigests {
            input: 0,
            disparity: self.stereo.digest(),
            matches: self.scene_flow.digest(),
            egomotion: self.egomotion_digest(egomotion),
            tracks: self.tracks_digest(),
            background: self.background.digest(),
            objects: ObjectDigests::of(
                self.objects.digests().map(|(id, digest)| ObjectDigest { id, digest }),
            ),
        }
    }

    /// Digest of the camera's motion and of what it says about the rig.
    fn egomotion_digest(&mut self, estimate: Option<&MotionEstimate>) -> u64 {
        let mut digest = Digest::default();
        digest.u64(self.camera.digest(estimate));
        digest.u64(Hasher::digest(|hasher| self.self_calibration.visit(hasher)));
        digest.finish()
    }

    /// Digest of the tracks by age, their masks, and the crops that wait to be fused.
    fn tracks_digest(&mut self) -> u64 {
        Hasher::digest(|hasher| {
            self.tracker.visit(hasher);
            self.objects.visit_crops(hasher);
        })
    }
}

/// The matches of a frame.
fn frame_matches<'m>(scene_flow: &'m FlowMatcher<'_>) -> FrameMatches<'m> {
    FrameMatches { refined: scene_flow.refined(), sparse: scene_flow.sparse() }
}

/// Depth from the pair, unless it is given, and matches over this pair and the last: neither needs
/// the other.
fn match_images<E: Executor>(
    config: &Config,
    stereo: &mut StereoMatcher<'_>,
    scene_flow: &mut FlowMatcher<'_>,
    frame: &StereoFrame<'_>,
    invalid: Option<&InvalidPair<'_>>,
    executor: &E,
) -> (StereoReport, FlowReport) {
    let compute_disparity = || match frame.disparity_q8 {
        Some(given) => stereo.take(given),
        None => {
            let pair = RectifiedPair { left: frame.left, right: frame.right, invalid };
            stereo.compute_within(&config.stereo, &pair, executor)
        }
    };
    let match_features =
        || scene_flow.push_within(&config.scene_flow, frame.left, frame.right, invalid, executor);
    executor.join(
        || executor.stage(Stage::Stereo, compute_disparity),
        || executor.stage(Stage::SceneFlow, match_features),
    )
}

/// Learns from the matches which rows agree, and takes the disparity error found so far out of them
/// and of the disparity image.
fn calibrate<E: Executor>(
    config: &Config,
    self_calibration: &mut SelfCalibration,
    stereo: &mut StereoMatcher<'_>,
    scene_flow: &mut FlowMatcher<'_>,
    executor: &E,
) {
    let correction = self_calibration.pixel_correction(&config.rig);
    self_calibration.update_rows(&config.rig, scene_flow.bucketed().map(Match::row_difference));
    if let Some(correction) = correction {
        executor.stage(Stage::Stereo, || stereo.correct(correction, executor));
        executor.stage(Stage::SceneFlow, || scene_flow.correct(correction));
    }
}
