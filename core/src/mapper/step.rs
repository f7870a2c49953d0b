//! One frame: the loop of the paper (Section III), a line or two per stage; each stage returns what
//! the next one takes.

use super::{
    BlockCount, DeferredWork, Mapper, ObjectDigest, ObjectDigests, PoseOrigin, Report,
    StageDigests, StepError, StereoFrame, WorkUnits,
    localization::{Localization, Located, NoWitness},
    matched::MatchedFrame,
    search::Search,
    segmentation::Segmentation,
};
use crate::{
    Executor, Stage,
    digest::Digest,
    egomotion::MotionEstimate,
    geometry::GroundPlane,
    image::MaskedPair,
    inertial::InertialPrior,
    invariants::Invariants,
    objects::{NoSink, ObjectSink},
    planning::Watched,
    rectify::Pair,
    scene_flow::{FlowReport, FlowStatus, Match},
    segmentation::SegmentationReport,
    state::Hasher,
    stereo::StereoReport,
    tracking::TrackingReport,
    volume::{AllocationReport, BlockStore, NoStore, PruneReport},
};

/// Results of a frame's stages, for its report.
struct Outcome {
    stereo: StereoReport,
    scene_flow: FlowReport,
    located: Located,
    ground: Option<GroundPlane>,
    segmentation: SegmentationReport,
    tracking: TrackingReport,
    /// The pose is good enough to fuse at, and the frame's turn has come.
    fused: bool,
    /// There was depth to fuse.
    shows_depth: bool,
    allocation: AllocationReport,
    prune: PruneReport,
}

impl Mapper<'_> {
    /// Takes one frame: depth, motion, map. Never allocates, never panics; what could not be done
    /// is counted in the report. Blocks that must leave a full pool are lost, and counted.
    ///
    /// ```
    /// # use dynvox_core::{
    /// #     Capacity, Config, Mapper, Serial, StereoFrame, geometry::{StereoRig, Transform},
    /// #     image::View, memory::SLAB_ALIGN,
    /// # };
    /// # let rig =
    /// #     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// # let capacity = Capacity {
    /// #     planning_width: 40, planning_length: 40, planning_height: 10, ..Capacity::TINY
    /// # };
    /// # let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    /// # let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
    /// # let (grey, wall) = ([90; 320 * 96], [10 << 8; 320 * 96]);
    /// # let view = View::new(&grey, 320, 96).unwrap();
    /// # let frame = StereoFrame {
    /// #     disparity_q8: View::new(&wall, 320, 96),
    /// #     t_world_camera: Some(Transform::IDENTITY),
    /// #     ..StereoFrame::pair(view, view)
    /// # };
    /// let report = mapper.step(&frame, &Serial)?;
    /// assert!(report.fused && report.blocks.used > 0 && report.internal_faults == 0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn step<E: Executor>(
        &mut self,
        frame: &StereoFrame<'_>,
        executor: &E,
    ) -> Result<Report, StepError> {
        self.step_with(frame, executor, &mut NoStore, &mut NoSink)
    }

    /// Steps like [`Mapper::step`], with a store for blocks that are evicted and loaded again when
    /// they are visible, and a sink for objects that retire.
    ///
    /// ```
    /// use dynvox_core::{objects::NoSink, volume::NoStore};
    /// # use dynvox_core::{
    /// #     Capacity, Config, Mapper, Serial, StereoFrame, geometry::{StereoRig, Transform},
    /// #     image::View, memory::SLAB_ALIGN,
    /// # };
    /// # let rig =
    /// #     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// # let capacity = Capacity {
    /// #     planning_width: 40, planning_length: 40, planning_height: 10, ..Capacity::TINY
    /// # };
    /// # let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    /// # let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
    /// # let (grey, wall) = ([90; 320 * 96], [10 << 8; 320 * 96]);
    /// # let view = View::new(&grey, 320, 96).unwrap();
    /// # let frame = StereoFrame {
    /// #     disparity_q8: View::new(&wall, 320, 96),
    /// #     t_world_camera: Some(Transform::IDENTITY),
    /// #     ..StereoFrame::pair(view, view)
    /// # };
    /// // A store and a sink of the caller's would take evicted blocks and retired objects.
    /// let report = mapper.step_with(&frame, &Serial, &mut NoStore, &mut NoSink)?;
    /// assert_eq!(report.allocate.eviction.stored, 0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    // Never inlined, so that a step's stack can be told from its caller's.
    #[inline(never)]
    pub fn step_with<E: Executor, S: BlockStore, O: ObjectSink>(
        &mut self,
        frame: &StereoFrame<'_>,
        executor: &E,
        store: &mut S,
        sink: &mut O,
    ) -> Result<Report, StepError> {
        self.validate(frame)?;
        // Of the input as it came, before rectification.
        let input = frame.digest();
        // The rectified images are lent out for the step, so that the stages may read them while
        // they change the mapper.
        let mut images = core::mem::take(&mut self.rectified);
        let raw = Pair { left: frame.left, right: frame.right, colour: frame.colour };
        let rectified = executor.stage(Stage::Rectify, || {
            self.rectifier.rectify_from(frame.layout, &raw, &mut images, executor)
        });
        let Pair { left, right, colour } = rectified.unwrap_or(raw);
        let rectification = self.rectifier.report(&Pair { left, right, colour });
        // The self-calibration may ask for shifted rows of the right image.
        let mut aligned = core::mem::take(&mut self.aligned);
        let moved =
            self.localization.self_calibration.row_shift(&self.config.rig).and_then(|shift| {
                executor.stage(Stage::Rectify, || aligned.align(right, &shift, executor))
            });
        let frame = StereoFrame { left, right: moved.unwrap_or(right), colour, ..*frame };
        let report = self.step_rectified(&frame, executor, store, sink);
        // The images go back after every step: the next one needs their memory.
        (self.rectified, self.aligned) = (images, aligned);
        Ok(report.with_input(input, rectification))
    }

    /// Takes a rectified frame that was validated.
    fn step_rectified<E: Executor, S: BlockStore, O: ObjectSink>(
        &mut self,
        frame: &StereoFrame<'_>,
        executor: &E,
        store: &mut S,
        sink: &mut O,
    ) -> Report {
        self.localization.expect_turn(frame, &self.config.rig, &mut self.scene_flow);
        // (A) Depth from the pair, and (C.1) sparse scene flow over this pair and the last.
        let (stereo, scene_flow) = self.match_images(frame, executor);
        let seen = MatchedFrame {
            config: &self.config,
            number: self.frame,
            interval_s: self.clock.advance(frame.time_ns, self.config.tracking.frame_interval_s),
            frame,
            disparity_q8: self.stereo.disparity_q8(),
            scene_flow: &self.scene_flow,
            flow_status: scene_flow.status,
            with_last: self.localization.camera.since_reference() == 0,
        };
        let Self { tracker, segmenter, localization, static_map, objects, planning, .. } = self;
        let attached = &mut self.attached;
        // (B) Detections, associated with tracks, and the matches assigned to them.
        tracker.set_frame_interval_s(seen.interval_s);
        let (detections, matches) = (frame.detections, seen.matches());
        let mut assigned = executor.stage(Stage::Tracking, || {
            tracker.detect(seen.number, detections, seen.size(), matches).assign_matches()
        });
        // (C.2) The camera's own motion, from what does not move; the first camera is the world.
        let mask = assigned.egomotion_mask();
        let no_witness = NoWitness { mask: &mask, attached };
        let locate = || localization.locate(&seen, &no_witness, static_map, executor);
        let located = executor.stage(Stage::Egomotion, locate);
        seen.observe_attached(attached, located.estimated_motion(), &assigned);
        // Another segment has its own frame of reference: what was known in the one before is not.
        static_map.volume.enter_segment(localization.camera.segment());
        if located.enters_segment {
            assigned.restart_motions();
            segmenter.forget();
            objects.restart(sink);
            planning.forget();
        }
        // (B) Moving objects that no detector found, and (D) the objects' motions.
        let (rig, camera) = (seen.config.scaled_rig(), located.camera);
        let fused = located.found.origin != PoseOrigin::Extrapolated && seen.is_due();
        let plans = fused && planning.seeks_ground();
        let segmentation = Segmentation { segmenter, map: &static_map.volume, plans };
        let (ground, segmentation) =
            executor.stage(Stage::Segmentation, || segmentation.run(&seen, &camera, &mut assigned));
        let estimator = &mut localization.estimator;
        let estimate_motions =
            || assigned.estimate_motions(&rig, &camera, seen.search(), estimator);
        let mut tracked = executor.stage(Stage::Tracking, estimate_motions);
        // (E) The static map without what may move, and objects' maps; not at a pose extrapolated.
        let erase_trails = || static_map.erase_trails(&camera, segmenter);
        let voxels_erased = executor.stage(Stage::Prune, erase_trails);
        static_map.close_loops(&localization.places);
        let (mut allocation, mut shows_depth) = (AllocationReport::default(), false);
        if fused {
            // A pose that the caller gives does not drift: what is seen again belongs to one map.
            if located.found.origin != PoseOrigin::Given {
                static_map.advance_submaps(&seen, &camera, &localization.places);
            }
            static_map.take_depth(&seen, &mut tracked, executor);
            let (pose, ground) = (&camera.t_world_camera, ground.as_ref());
            let remove_come = || static_map.remove_come(&seen, pose, ground, segmenter);
            tracked.add_masked(executor.stage(Stage::Segmentation, remove_come));
            shows_depth = static_map.has_depth(frame.left.width() * frame.left.height());
            allocation =
                static_map.fuse(&seen, &camera, executor, &mut Watched { planning, store });
        }
        let shown = seen.of_objects(&rig, &camera.t_world_camera);
        executor.stage(Stage::Objects, || {
            objects.reconstruct(&tracked, fused.then_some(&shown), executor, sink);
        });
        let tracking = executor.stage(Stage::Tracking, || tracked.commit());
        // (F) Noise last observed a fixed lag ago is removed.
        let prune = || executor.stage(Stage::Prune, || static_map.prune(seen.config));
        let prune = fused.then(prune).unwrap_or_default();
        let prune = PruneReport { voxels_erased, ..prune };
        let outcome = Outcome {
            stereo,
            scene_flow,
            located,
            ground,
            segmentation,
            tracking,
            fused,
            shows_depth,
            allocation,
            prune,
        };
        let report = self.finish_frame(outcome);
        report.with_work(&self.static_map.take_work())
    }

    /// Depth from the pair, unless it is given, and matches over this pair and the last: neither
    /// needs the other. Both are corrected by the disparity error found so far.
    fn match_images<E: Executor>(
        &mut self,
        frame: &StereoFrame<'_>,
        executor: &E,
    ) -> (StereoReport, FlowReport) {
        let Self { capacity, config, rectifier, ignored, attached, .. } = self;
        let Self { stereo, scene_flow, localization, .. } = self;
        // Pixels that no raw pixel covers take no part, nor do those the caller ignores, nor the
        // camera's own parts.
        let covered = rectifier.invalid();
        ignored.update(frame, attached, covered);
        let invalid = ignored.pair([frame.left.width(), frame.left.height()], covered);
        let pair = MaskedPair {
            left: frame.left,
            right: frame.right,
            invalid: invalid.as_ref(),
            right_moved: localization.rows_moved,
        };
        let (most, flow) = (config.stereo_budget(capacity), config.scene_flow_within(capacity));
        let compute_disparity = || match frame.disparity_q8 {
            Some(given) => stereo.take(given, invalid.as_ref().filter(|_| ignored.is_used())),
            None => stereo.compute_within(&config.stereo, &pair, most, executor),
        };
        let match_features = || scene_flow.push_within(&flow, &pair, executor);
        let reports = executor.join(
            || executor.stage(Stage::Stereo, compute_disparity),
            || executor.stage(Stage::SceneFlow, match_features),
        );
        self.correct_matches(executor);
        reports
    }

    /// Learns from the matches which rows agree, and takes the disparity error found so far out of
    /// them and of the disparity image.
    fn correct_matches<E: Executor>(&mut self, executor: &E) {
        let Self { config, localization, stereo, scene_flow, .. } = self;
        let self_calibration = &mut localization.self_calibration;
        let correction = self_calibration.pixel_correction(&config.rig);
        // Matches must know when the rows of the right image move between two frames.
        let rows_before = self_calibration.row_shift(&config.rig);
        self_calibration.update_rows(&config.rig, scene_flow.bucketed().map(Match::row_difference));
        localization.rows_moved = self_calibration.row_shift(&config.rig) != rows_before;
        if let Some(correction) = correction {
            executor.stage(Stage::Stereo, || stereo.correct(correction, executor));
            executor.stage(Stage::SceneFlow, || scene_flow.correct(correction));
        }
    }

    /// Reports the frame and counts it.
    fn finish_frame(&mut self, outcome: Outcome) -> Report {
        let Outcome {
            stereo,
            scene_flow,
            located: Located { camera, found, .. },
            ground,
            segmentation,
            tracking,
            fused,
            shows_depth,
            allocation,
            prune,
        } = outcome;
        self.choose_reference(&scene_flow);
        // Free space seen from a guessed pose would free the wrong cells.
        if fused {
            self.observe_free_space(&camera.t_world_camera, ground);
        }
        let digests = self.digests(found.egomotion.as_ref());
        let report = Report {
            frame: self.frame,
            t_world_camera: camera.t_world_camera,
            rectify: None,
            ignored_pixels: self.ignored.count(),
            attached_pixels: self.ignored.attached(),
            stereo,
            scene_flow,
            pose: found.origin,
            segment: self.localization.camera.segment(),
            egomotion: found.egomotion,
            precision: self.localization.precision(&found, &self.config),
            icp: found.icp,
            self_calibration: self.localization.self_calibration.report(),
            inertial: self.localization.inertial.as_deref().map(InertialPrior::report),
            tracking: TrackingReport { matches_excluded: found.matches_excluded, ..tracking },
            segmentation,
            objects: self.objects.report(),
            world_moved: self.localization.places.has_moved(),
            fused: fused && shows_depth,
            allocate: allocation,
            prune,
            blocks: self.block_count(),
            work: WorkUnits::default(),
            deferred: DeferredWork::default(),
            internal_faults: self.check_invariants(),
            digests,
            digest: digests.whole(self.frame),
        };
        self.frame = self.frame.saturating_add(1);
        report
    }

    /// Chooses the frame that the next one is matched with: the last one, unless its pose is a
    /// guess. A reference that shows little, such as a first image taken in the dark, gives way to
    /// a frame that shows more.
    fn choose_reference(&mut self, scene_flow: &FlowReport) {
        let camera = &mut self.localization.camera;
        if camera.since_reference() == 0 {
            return;
        }
        let is_matched = scene_flow.status == FlowStatus::Matched;
        if is_matched && !camera.has_moved() && self.scene_flow.is_much_richer() {
            camera.refer_to_last();
        } else {
            self.scene_flow.keep_previous();
        }
    }

    /// Number of conditions that must hold after a frame and do not.
    fn check_invariants(&self) -> u32 {
        let mut invariants = Invariants::default();
        self.scene_flow.check_invariants(&mut invariants);
        self.tracker.check_invariants(&mut invariants);
        self.check_kept(&mut invariants);
        invariants.faults()
    }

    /// Says what must hold of what a snapshot keeps.
    pub(super) fn check_kept(&self, invariants: &mut Invariants) {
        invariants.require(
            self.localization.camera.t_world_camera().is_finite(),
            "the camera's pose is finite",
        );
        self.objects.check_invariants(invariants);
        self.static_map.volume.check_invariants(invariants);
    }

    fn block_count(&self) -> BlockCount {
        let pool = self.static_map.volume.pool();
        BlockCount {
            used: pool.len() as u32,
            peak: pool.peak() as u32,
            capacity: pool.capacity() as u32,
            visible: self.static_map.volume.visible().slots().len() as u32,
        }
    }

    /// Digests of what each stage made of a frame.
    pub(super) fn digests(&mut self, egomotion: Option<&MotionEstimate>) -> StageDigests {
        StageDigests {
            input: 0,
            stereo: self.stereo.digest(),
            scene_flow: self.scene_flow.digest(),
            egomotion: self.egomotion_digest(egomotion),
            tracking: self.tracking_digest(),
            static_map: self.static_map.volume.digest(),
            objects: ObjectDigests::from_objects(
                self.objects.digests().map(|(id, digest)| ObjectDigest { id, digest }),
            ),
        }
    }

    /// Digest of the camera's motion and of what it says about the rig.
    fn egomotion_digest(&mut self, estimate: Option<&MotionEstimate>) -> u64 {
        let Localization { camera, self_calibration, anchor, search, inertial, .. } =
            &mut self.localization;
        let mut digest = Digest::default();
        digest.u64(camera.digest(estimate));
        digest.u64(self_calibration.digest());
        // Without one the digest is what it was before there was any.
        if !anchor.is_empty() {
            digest.u64(anchor.digest());
        }
        if *search != Search::Off {
            digest.u64(*search as u64);
        }
        if let Some(inertial) = inertial {
            digest.u64(inertial.digest());
        }
        digest.finish()
    }

    /// Digest of the tracks by age, their masks, and the crops that wait to be fused.
    fn tracking_digest(&mut self) -> u64 {
        Hasher::digest(|hasher| {
            self.tracker.visit(hasher);
            if self.config.segmentation.enabled {
                self.segmenter.visit(hasher);
            }
            self.objects.visit_crops(hasher);
        })
    }
}
