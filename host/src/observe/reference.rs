//! The evaluation against LiDAR beside a run: points are settled while their frame is there, the map is looked at when the frame is due.

use super::pictures;
use crate::evaluate::lidar::{Aim, Awaited, Delay, EvaluatedFrame, Field, Layer, LidarFigures, aim, aim_at_exact};
use crate::input::InstanceMask;
use crate::input::{FrameSource, InputError, StereoImages};
use dynvox_core::geometry::{StereoRig, Transform};
use dynvox_core::image::{DISPARITY_ONE_PX, View};
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::{InstancesConfig, State, ThingAt, Treatment};
use dynvox_core::{Config, Mapper};

/// Frames whose errors are drawn at most.
const PICTURES: usize = 4;

/// What the map is held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Reference {
    /// LiDAR scans, of the frames that have one: `velodyne/` beside the images, or the synthetic street's.
    Lidar,
    /// The synthetic street's exact depth.
    Exact,
}

impl Reference {
    /// Name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Lidar => "lidar",
            Self::Exact => "exact",
        }
    }
}

/// Pictures of one frame's errors, as PNG files.
#[derive(Clone, Debug)]
pub struct ErrorPictures {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// The input against the reference.
    pub input_png: Vec<u8>,
    /// The map against the reference.
    pub map_png: Vec<u8>,
}

/// A finished evaluation.
#[derive(Clone, Debug)]
pub struct LidarRecord {
    /// Figures over all; `None` when no frame came to be evaluated.
    pub figures: Option<LidarFigures>,
    /// Frame by frame.
    pub frames: Vec<EvaluatedFrame>,
    /// Pictures of some.
    pub pictures: Vec<ErrorPictures>,
}

/// An evaluation under way.
#[derive(Debug)]
pub struct LidarAtWork {
    reference: Reference,
    delay_frames: usize,
    field: Field,
    rig: StereoRig,
    /// Px of the images as they are stored in one px of those mapped.
    enlarged: f32,
    /// Whether what moves is kept apart; where it is not, masks are taken as they are given.
    instances: InstancesConfig,
    delay: Delay,
    /// Positions of the frames to be drawn, ascending.
    drawn: Vec<usize>,
    frames: Vec<EvaluatedFrame>,
    pictures: Vec<ErrorPictures>,
}

/// Positions among `indices` whose frames can be evaluated within the run.
pub fn evaluable(dataset: &dyn FrameSource, indices: &[usize], reference: Reference, delay: usize) -> Vec<usize> {
    let in_time = indices.len().saturating_sub(delay);
    let has = |&at: &usize| match reference {
        Reference::Lidar => indices.get(at).is_some_and(|&index| dataset.has_lidar(index)),
        Reference::Exact => dataset.has_exact_depth(),
    };
    (0..in_time).filter(has).collect()
}

impl LidarAtWork {
    /// Begins; `evaluable` are the positions of the frames that have a reference.
    pub fn new(
        reference: Reference,
        delay_frames: usize,
        config: &Config,
        (size, enlarged): ((usize, usize), f32),
        evaluable: &[usize],
    ) -> Self {
        let count = PICTURES.min(evaluable.len());
        let field = Field {
            width: size.0,
            height: size.1,
            near_m: config.volume.near_m.into(),
            far_m: config.volume.far_m.into(),
        };
        Self {
            reference,
            delay_frames,
            field,
            rig: config.rig,
            enlarged,
            instances: config.instances,
            delay: Delay::new(delay_frames),
            drawn: (1..=count).filter_map(|at| evaluable.get(at * evaluable.len() / count - 1).copied()).collect(),
            frames: Vec::new(),
            pictures: Vec::new(),
        }
    }

    /// Takes in the frame at position `at` after its step, and gives back the one that is due.
    pub fn due(
        &mut self,
        at: usize,
        index: usize,
        images: &StereoImages,
        mapper: &Mapper<'_>,
        (dataset, t_world_camera): (&dyn FrameSource, &Transform),
    ) -> Result<Option<Awaited>, InputError> {
        let aim = match self.reference {
            Reference::Lidar => dataset.lidar(index)?.map(|scan| aim(&scan, &self.field)),
            Reference::Exact => images.exact.as_ref().map(|exact| aim_at_exact(&exact.depth_m, &self.rig, &self.field)),
        };
        let awaited = aim.map(|aim| self.settle(index, images, mapper, t_world_camera, &aim)).map(|mut awaited| {
            awaited.picture = self.drawn.contains(&at).then(|| images.left.clone());
            awaited
        });
        Ok(self.delay.step(awaited))
    }

    fn settle(&self, index: usize, images: &StereoImages, mapper: &Mapper<'_>, t_world_camera: &Transform, aim: &Aim) -> Awaited {
        let disparity = mapper.disparity_q8();
        let input_px = |u: usize, v: usize| {
            let px = f32::from(disparity.get(u, v).unwrap_or_default()) / f32::from(DISPARITY_ONE_PX);
            let depth_m = self.rig.focal_baseline_px_m() / f64::from(px);
            // Only what is fused is the map's input. Infinite where there is no disparity.
            if depth_m >= self.field.near_m && depth_m <= self.field.far_m { px } else { 0.0 }
        };
        let layer = |u: i32, v: i32| {
            let thing = if self.instances.dynamic { mapper.thing_at(u, v) } else { self.masked(&images.masks.instances, u, v) };
            Layer::of(thing.as_ref())
        };
        Awaited::settle(index, *t_world_camera, aim, input_px, layer)
    }

    /// What a pixel shows where nothing is tracked: what could move is then of unknown motion, so that maps with and without it are held against
    /// the same points of the street.
    fn masked(&self, sightings: &[InstanceMask], u: i32, v: i32) -> Option<ThingAt> {
        let image = PixelBox {
            left: 0,
            top: 0,
            width: self.field.width as i32,
            height: self.field.height as i32,
        };
        let taken = |one: &&InstanceMask| {
            one.contains(u, v)
                && one.class.treatment() != Treatment::Ignore
                && one.score >= self.instances.score_min
                && self.instances.large_enough(one.pixels.intersection(&image).area(), self.field.width)
        };
        sightings.iter().find(taken).map(|one| ThingAt { class: one.class, track: None, state: State::Uncertain })
    }

    /// Compares a frame that is due with a view of the map from its pose.
    pub fn compare(&mut self, awaited: &Awaited, map_depth_m: &View<'_, f32>) {
        let (evaluated, shown_px) = awaited.compare(map_depth_m, self.rig.focal_baseline_px_m(), self.enlarged);
        self.frames.push(evaluated);
        if let Some(picture) = awaited.picture.as_ref().and_then(|picture| picture.view()) {
            let errors = |seen_px: &dyn Fn(usize) -> f32| {
                let samples = awaited.samples.iter().enumerate();
                pictures::errors(&picture, samples.map(|(at, sample)| (sample, seen_px(at))))
            };
            self.pictures.push(ErrorPictures {
                frame: awaited.frame,
                input_png: errors(&|at| awaited.samples.get(at).map_or(0.0, |sample| sample.input_px)),
                map_png: errors(&|at| shown_px.get(at).copied().unwrap_or_default()),
            });
        }
    }

    /// Ends it.
    pub fn finish(self) -> LidarRecord {
        LidarRecord {
            figures: LidarFigures::of(self.reference.name(), self.delay_frames, &self.frames),
            frames: self.frames,
            pictures: self.pictures,
        }
    }
}
