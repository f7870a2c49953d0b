//! Input and map against a reference depth, LiDAR or exact: regions are fixed while a frame is
//! there, the map is viewed when the frame is due.

use super::{Finished, FrameContext, ObserveError, ObservedRun, Observer, pictures, spread};
use crate::evaluate::reference::{
    DepthErrors, EvaluatedFrame, Field, PendingFrame, PendingFrames, PointOutcomes, ProjectedScan,
    ReferenceFigures, Region, Sample, SurfaceErrors, project_scan, sample_exact_depth,
};
use crate::formats::Image;
use crate::formats::shown_pose;
use crate::input::InstanceMask;
use crate::input::{FrameSource, StereoImages};
use crate::request::{Plan, Reference};
use dynvox_core::Mapper;
use dynvox_core::geometry::StereoRig;
use dynvox_core::image::{DISPARITY_ONE_PX, View};
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::{InstanceAt, MotionState, Treatment};
use dynvox_core::view::NORMAL_ONE;
use serde::{Deserialize, Serialize};

/// Frames whose errors are drawn at most.
const PICTURES: usize = 4;
/// Frames evaluated against exact depth, where it is there and no evaluation was asked for.
const SAMPLED_FRAMES: usize = 24;

/// Reference and the frames in which the map is evaluated.
#[derive(Clone, Debug)]
pub struct ReferencePlan {
    reference: Reference,
    /// Frames after which the map is evaluated.
    delay: usize,
    /// Positions of the frames evaluated, ascending.
    positions: Vec<usize>,
    /// Numbers of the frames whose errors are drawn.
    drawn: Vec<usize>,
}

impl ReferencePlan {
    /// The reference that a run asks for; without one, some frames of exact depth.
    pub fn of_run(run: &Plan) -> Option<Self> {
        let (dataset, listed) = (run.dataset.as_ref(), run.frames.listed());
        let asked = &run.request.evaluation;
        match asked.reference {
            Some(reference) => Self::all(dataset, listed, reference, asked.delay),
            None => Self::sampled(dataset, listed),
        }
    }

    /// All frames that have the reference, each evaluated `delay` frames later; `None` when no
    /// frame has it in time.
    fn all(
        dataset: &dyn FrameSource,
        indices: &[usize],
        reference: Reference,
        delay: usize,
    ) -> Option<Self> {
        Self::new(reference, delay, reference.positions(dataset, indices, delay))
    }

    /// Some frames against exact depth, at once; `None` where there is no exact depth.
    fn sampled(dataset: &dyn FrameSource, indices: &[usize]) -> Option<Self> {
        let chosen = spread(indices.len(), SAMPLED_FRAMES);
        let positions = if dataset.has_exact_depth() {
            (0..indices.len()).filter(|&at| chosen(at)).collect()
        } else {
            Vec::new()
        };
        Self::new(Reference::Exact, 0, positions)
    }

    fn new(reference: Reference, delay: usize, positions: Vec<usize>) -> Option<Self> {
        let count = PICTURES.min(positions.len());
        let drawn = (1..=count)
            .filter_map(|at| positions.get(at * positions.len() / count - 1).copied())
            .collect();
        (!positions.is_empty()).then_some(Self { reference, delay, positions, drawn })
    }
}

/// Pictures of one frame's errors, as JPEG files.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ErrorPictures {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// The input against the reference.
    pub input_jpeg: Vec<u8>,
    /// The map against the reference.
    pub map_jpeg: Vec<u8>,
}

/// A finished evaluation.
#[derive(Clone, Debug)]
pub struct ReferenceSection {
    /// Figures over all; `None` when the run ended before a frame was due.
    pub figures: Option<ReferenceFigures>,
    /// Frame by frame.
    pub frames: Vec<EvaluatedFrame>,
    /// Outcomes of the points of the static map.
    pub outcomes: Vec<PointOutcomes>,
    /// Errors of the static map by place.
    pub surface_errors: SurfaceErrors,
    /// Pictures of some.
    pub pictures: Vec<ErrorPictures>,
}

/// An evaluation under way.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct ReferenceObserver {
    frames: Vec<EvaluatedFrame>,
    depth_errors: DepthErrors,
    #[serde(default)]
    outcomes: Vec<PointOutcomes>,
    surface_errors: SurfaceErrors,
    pictures: Vec<ErrorPictures>,
    /// Empty after every frame unless there is a delay, and a run with a delay has no checkpoints.
    #[serde(skip)]
    pending: PendingFrames,
}

impl Observer for ReferenceObserver {
    type Section = Option<ReferenceSection>;

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        let Some(plan) = &run.reference else { return Ok(()) };
        let pending = if plan.positions.binary_search(&frame.position).is_ok() {
            pending(run, plan, frame)?
        } else {
            None
        };
        // With a delay the map is compared when pruning is through with the frame.
        let Some(due) = self.pending.step(plan.delay, pending) else { return Ok(()) };
        // Object poses of past frames are not kept: later the background is viewed alone.
        let seen = match plan.delay {
            0 => frame.view.raycast_with_objects(due.view),
            _ => frame.view.raycast(due.view),
        };
        if let Some((depth_m, normal)) =
            seen.and_then(|seen| Some((seen.depth_m()?, seen.normal()?)))
        {
            self.compare(run, &due, &depth_m, &normal);
        }
        Ok(())
    }

    fn finish(self, run: &ObservedRun<'_>, _: &Finished) -> Result<Self::Section, ObserveError> {
        Ok(run.reference.as_ref().map(|plan| ReferenceSection {
            figures: ReferenceFigures::from_frames(
                plan.reference.name(),
                plan.delay,
                &self.frames,
                self.depth_errors.figures(),
            ),
            frames: self.frames,
            outcomes: self.outcomes,
            surface_errors: self.surface_errors,
            pictures: self.pictures,
        }))
    }
}

impl ReferenceObserver {
    /// Compares a frame that is due with a view of the map from its pose.
    fn compare(
        &mut self,
        run: &ObservedRun<'_>,
        due: &PendingFrame,
        map_depth_m: &View<'_, f32>,
        normal: &View<'_, [i8; 3]>,
    ) {
        let rig = &run.plan.config.rig;
        let focal_baseline_px_m = rig.focal_baseline_px_m();
        let (size, full_size) = (run.plan.dataset.size(), run.plan.dataset.full_size());
        // Scaled images have fewer pixels: errors count at full size.
        let enlarged = (full_size.0 as f64 / size.0 as f64) as f32;
        let (evaluated, shown_px) = due.compare(map_depth_m, focal_baseline_px_m, enlarged);
        self.frames.push(evaluated);
        self.outcomes.push(PointOutcomes::from_frame(due, &shown_px, enlarged));
        // Depth errors count where the static map shows a surface, at the points of static
        // surfaces.
        let t_shown_camera =
            shown_pose(due.view.segment.unwrap_or_default(), &due.view.t_world_camera);
        let depth_m = |px: f32| focal_baseline_px_m / f64::from(px);
        for (sample, &shown_px) in
            due.samples.iter().zip(&shown_px).filter(|(sample, _)| sample.region == Region::Static)
        {
            if shown_px > 0.0 {
                let (shown_m, true_m) = (depth_m(shown_px), depth_m(sample.point.disparity_px));
                let (ray, along_normal) = (ray(rig, sample), along_normal(rig, normal, sample));
                self.depth_errors.add(shown_m, true_m, along_normal);
                if let Some(along_normal) = along_normal {
                    let at = t_shown_camera.transform_point(ray.map(|part| part * shown_m));
                    self.surface_errors.add(at, ((shown_m - true_m) * along_normal).abs());
                }
            }
        }
        if let Some(picture) = due.picture.as_ref().and_then(|picture| picture.view()) {
            let samples = || due.samples.iter();
            self.pictures.push(ErrorPictures {
                frame: due.frame,
                input_jpeg: pictures::errors(
                    &picture,
                    samples().map(|sample| (sample, sample.input_px)),
                ),
                map_jpeg: pictures::errors(&picture, samples().zip(shown_px.iter().copied())),
            });
        }
    }
}

/// Length of a sample's ray of depth 1 along the normal that the map shows there; `None` where it
/// shows none.
fn along_normal(rig: &StereoRig, normal: &View<'_, [i8; 3]>, sample: &Sample) -> Option<f64> {
    let [x, y, z] = normal
        .get(sample.point.u.into(), sample.point.v.into())?
        .map(|n| f64::from(n) / f64::from(NORMAL_ONE));
    let ray = ray(rig, sample);
    ([x, y, z] != [0.0; 3]).then(|| x * ray[0] + y * ray[1] + z)
}

/// A sample's ray of depth 1, in the camera's axes.
fn ray(rig: &StereoRig, sample: &Sample) -> [f64; 3] {
    let across = |px: u16, center_px: f64| (f64::from(px) - center_px) / rig.focal_px;
    [across(sample.point.u, rig.center_u_px), across(sample.point.v, rig.center_v_px), 1.0]
}

/// The points of a frame, with their regions and what the input measured there; `None` without a
/// reference.
fn pending(
    run: &ObservedRun<'_>,
    plan: &ReferencePlan,
    frame: &FrameContext<'_, '_>,
) -> Result<Option<PendingFrame>, ObserveError> {
    let (rig, images, mapper) = (&run.plan.config.rig, frame.images, frame.view.mapper());
    let (width, height) = run.plan.dataset.size();
    let (near_m, far_m) =
        (run.plan.config.volume.near_m.into(), run.plan.config.volume.far_m.into());
    let field = Field { width, height, near_m, far_m };
    let scan: Option<ProjectedScan> = match plan.reference {
        Reference::Lidar => {
            run.plan.dataset.lidar(frame.row.frame)?.map(|scan| project_scan(&scan, &field))
        }
        Reference::Exact => {
            images.exact.as_ref().map(|exact| sample_exact_depth(&exact.depth_m, rig, &field))
        }
    };
    let disparity = mapper.disparity_q8();
    // The map's metres are those of the scaled baseline: a disparity is compared as the calibrated
    // rig would have it at that depth.
    let baseline_scale = run.plan.config.rig_settings.baseline_scale as f32;
    let input_px = |u: usize, v: usize| {
        let px = f32::from(disparity.get(u, v).unwrap_or_default())
            / f32::from(DISPARITY_ONE_PX)
            / baseline_scale;
        let depth_m = rig.focal_baseline_px_m() / f64::from(px);
        // Only what is fused is the map's input. Infinite where there is no disparity.
        if depth_m >= near_m && depth_m <= far_m { px } else { 0.0 }
    };
    let region = |u: i32, v: i32| region(run, mapper, images, u, v);
    Ok(scan.map(|scan| {
        let mut pending =
            PendingFrame::new(frame.row.frame, frame.row.view(), &scan, input_px, region);
        let rectified = mapper.rectified_pair().map(|[left, _]| Image::from_view(&left));
        // Pictures are taken of a few frames only.
        pending.picture = plan
            .drawn
            .contains(&frame.position)
            .then(|| rectified.unwrap_or_else(|| images.left.clone()));
        pending
    }))
}

/// The region of a pixel. Without object tracking every masked object counts as one of unknown
/// motion, so that maps with and without it are evaluated at the same points of the background.
fn region(
    run: &ObservedRun<'_>,
    mapper: &Mapper<'_>,
    images: &StereoImages,
    u: i32,
    v: i32,
) -> Region {
    let tracking = &run.plan.config.tracking;
    if tracking.dynamic {
        return Region::from_instance(mapper.instance_at(u, v).as_ref());
    }
    let (width, height) = run.plan.dataset.size();
    let image = PixelBox { left: 0, top: 0, width: width as i32, height: height as i32 };
    // The same rules by which the tracker would have accepted the mask.
    let taken = |one: &&InstanceMask| {
        one.contains(u, v)
            && one.class.treatment() != Treatment::Ignore
            && one.score >= tracking.instances.score_min
            && tracking.instances.is_reconstructable(one.pixels.intersection(&image).area(), width)
    };
    let object = images.masks.instances.iter().find(taken);
    Region::from_instance(
        object
            .map(|one| InstanceAt { class: one.class, track: None, state: MotionState::Uncertain })
            .as_ref(),
    )
}
