//! A request in the words of a person: options of `dynvox run`, keywords in Python.

use super::poses::Egomotion;
use super::{
    Bounds, Bytes, Evaluation, Exports, Frames, ImageSize, Input, Limits, MapObjects, Masks,
    Memory, PlanningWindow, Poses, Reference, Request, RequestError, ScaleWord, SceneExport,
    SceneScale, Settings, Source, Storage, SyntheticWorld, UdpAddress, WindowSize, words,
};
use crate::formats::calibration::{CalibrationHints, LengthUnit, LensFamily, RectifiedSize, Swap};
use crate::formats::{Axes, BayerPattern};
use crate::input::Topics;
use crate::input::depth::{DepthChoice, DepthScale};
use crate::input::faults::Faults;
use crate::input::masks::MaskChoice;
use crate::input::stream::WhenLate;
use crate::input::{CameraPair, InertialChoice, Layout, Stacking};
use serde::Deserialize;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Options of a run, as the command line and Python name them. What is absent is as the request's
/// default has it.
///
/// ```
/// use dynvox::request::{Options, Request};
///
/// let options: Options = serde_json::from_value(serde_json::json!({
///     "memory": "48MiB",
///     "frames": 10,
///     "set": { "volume.voxel_size_m": 0.1 },
/// }))?;
/// let request = options.request()?;
/// assert_eq!((request.frames.most, request.settings.volume.voxel_size_m), (Some(10), 0.1));
/// assert_eq!(Options::default().request()?, Request::default());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, Deserialize, clap::Args)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Data set to map; - for a stream of PGM or PPM images from standard input, left and right in
    /// turn; the synthetic street without one
    pub path: Option<PathBuf>,
    /// Synthetic world to map instead of a data set [default: street]
    #[arg(long, value_enum, conflicts_with = "path", help_heading = "Input")]
    pub world: Option<SyntheticWorld>,
    /// Sequence within the data set: 06, 0003
    #[arg(long, value_name = "NAME", help_heading = "Input")]
    pub sequence: Option<String>,
    /// Layout of the data set; guessed from the path unless given
    #[arg(long, value_enum, help_heading = "Input")]
    pub dataset: Option<Layout>,
    /// Camera pair of KITTI odometry [default: auto]
    #[arg(long, value_enum, help_heading = "Input")]
    pub images: Option<CameraPair>,
    /// Significant bits of 16-bit images, 8 to 16; told from the largest value of some of them
    /// otherwise
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(8..=16), help_heading = "Input")]
    pub bits: Option<u32>,
    /// Colour filters of images that are mosaics: the first two pixels of the first two rows
    #[arg(long, value_enum, value_name = "PATTERN", help_heading = "Input")]
    pub bayer: Option<BayerPattern>,
    /// Topics of both cameras in a recording of ROS [default: told by their names]
    #[arg(long, value_name = "LEFT,RIGHT", help_heading = "Input")]
    #[serde(deserialize_with = "words::parsed")]
    pub topics: Option<Topics>,
    /// Both images of a pair lie in one, the left one left [default: told from the calibration]
    #[arg(long, help_heading = "Input")]
    pub side_by_side: bool,
    /// Both images of a pair lie in one, the left one above
    #[arg(long, conflicts_with = "side_by_side", help_heading = "Input")]
    pub top_bottom: bool,
    /// Frames a second of a stream
    #[arg(long, value_name = "HZ", value_parser = words::rate_hz, help_heading = "Input")]
    pub rate: Option<f64>,
    /// Frames of a stream that come while the mapper is busy: wait lets the stream wait, drop drops
    /// the oldest and counts it [default: wait]
    #[arg(long, value_enum, value_name = "HOW", help_heading = "Input")]
    pub when_late: Option<WhenLate>,
    /// Calibration instead of the recording's own: of raw images in any format
    /// `dynvox calibration` reads (give it twice where each camera has a file), of rectified ones
    /// KITTI's P0 and P1 lines, or focal_px, center_u_px, center_v_px, baseline_m
    #[arg(long, value_name = "FILE", help_heading = "Input")]
    #[serde(deserialize_with = "words::paths")]
    pub calibration: Vec<PathBuf>,
    /// Unit of the calibration's translations: m, cm, mm, inch, or the side of the board's squares
    /// in metres (0.025) [default: the format's own]
    #[arg(long, value_name = "UNIT", help_heading = "Input")]
    #[serde(deserialize_with = "words::parsed")]
    pub calibration_unit: Option<LengthUnit>,
    /// Lenses that four coefficients without a name are of [default: told from the images, and
    /// said]
    #[arg(long, value_enum, value_name = "KIND", help_heading = "Input")]
    pub lens_model: Option<LensFamily>,
    /// Exchange the cameras: in the calibration and the images (both, also without a word), or in
    /// one of them
    #[arg(
        long,
        value_enum,
        value_name = "WHAT",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "both",
        help_heading = "Input"
    )]
    pub swap: Option<Swap>,
    /// Cameras stand one above the other: turn rectified images by a quarter
    #[arg(long, help_heading = "Input")]
    pub vertical: bool,
    /// Samples of an inertial unit: a table with the columns time,wx,wy,wz,ax,ay,az, EuRoC's
    /// imu0/data.csv, KITTI raw's oxts; none for no unit [default: the recording's own]
    #[arg(long, value_name = "FILE|none", help_heading = "Input")]
    #[serde(deserialize_with = "words::parsed")]
    pub inertial: Option<InertialChoice>,
    /// Mounting of that unit on the left camera: Kalibr's camchain with T_cam_imu (and imu.yaml,
    /// given twice), EuRoC's imu0/sensor.yaml and cam0/sensor.yaml, or the 12 numbers of a matrix
    #[arg(long, value_name = "FILE", help_heading = "Input")]
    #[serde(deserialize_with = "words::paths")]
    pub inertial_calibration: Vec<PathBuf>,
    /// Size raw pairs are rectified to
    /// [default: the calibration's own, else all that both cameras see, at most 1920x1088]
    #[arg(long, value_name = "WxH", help_heading = "Input")]
    #[serde(deserialize_with = "words::parsed")]
    pub rectified: Option<ImageSize>,
    /// Focal length raw pairs are rectified to, px
    /// [default: the least that leaves no pixel without image]
    #[arg(long, value_name = "PX", requires = "rectified", help_heading = "Input")]
    pub rectified_focal: Option<f64>,
    /// Picture of what no stage shall use, white, of the size of the left images: the car's own
    /// bonnet, a dirty lens
    #[arg(long, value_name = "FILE", help_heading = "Input")]
    pub ignore_mask: Option<PathBuf>,
    /// Bounds by name: tiny, small, onboard or desktop
    #[arg(long, value_name = "NAME", conflicts_with_all = ["memory", "capacity"], help_heading = "Limits")]
    pub profile: Option<String>,
    /// Bytes of memory the map and all stages may take, divided for the images that come: 48MiB,
    /// 1GiB [default: 256MiB]
    #[arg(long, value_name = "BYTES", conflicts_with = "capacity", help_heading = "Limits")]
    #[serde(deserialize_with = "words::parsed")]
    pub memory: Option<Bytes>,
    /// Bounds from a file, as `dynvox budget --memory 48MiB --image 752x480` prints them
    #[arg(long, value_name = "FILE", help_heading = "Limits")]
    pub capacity: Option<PathBuf>,
    /// Recognise places by so many keyframes, of 11.8 KiB each: a camera that was lost goes on in
    /// the map where it comes back to it, and loops are closed: trajectory_closed_tum.txt,
    /// map_closed.ply
    /// [default: none]
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=65_536),
        help_heading = "Limits"
    )]
    pub keyframes: Option<u32>,
    /// Make a map for planners around the camera and write it to planning/: cells to the sides,
    /// ahead and behind, and upwards, of planning.cell_voxels voxels each: 200x200x20 is 40 x 40 x
    /// 4 m
    #[arg(long, value_name = "CELLS", help_heading = "Results")]
    #[serde(deserialize_with = "words::parsed")]
    pub planning: Option<WindowSize>,
    /// Keep distances to obstacles for every cell of that window, not only for its slice
    #[arg(long, requires = "planning", help_heading = "Results")]
    pub planning_3d: bool,
    /// First frame [default: 0]
    #[arg(long, value_name = "N", help_heading = "Frames")]
    pub start: Option<usize>,
    /// Frames to map at most
    #[arg(long, value_name = "N", help_heading = "Frames")]
    pub frames: Option<usize>,
    /// Take every N-th frame [default: 1]
    #[arg(long, value_name = "N", help_heading = "Frames")]
    pub stride: Option<usize>,
    /// Lengths of the map by the scene: desk, room, street or field [default: by the cameras'
    /// baseline and focal length]; or a factor up to 1 that shrinks the images. May be given twice
    #[arg(long, value_name = "SCENE|FACTOR", help_heading = "Frames")]
    #[serde(deserialize_with = "words::list")]
    pub scale: Vec<ScaleWord>,
    /// Source of depth: elas (stereo matching), files:DIR (PNG, PFM or OpenCV XML named as the
    /// images; depth where DIR's name says depth and not disparity), disparity:DIR, depth:DIR, or
    /// exact (the synthetic street) [default: elas]
    #[arg(long, value_name = "SOURCE", help_heading = "Mapping")]
    #[serde(deserialize_with = "words::parsed")]
    pub depth: Option<DepthChoice>,
    /// Unit of the numbers in files of depth: m (of disparities px) for each unit, such as 0.001 or
    /// 1/5000, or a name: m, cm, mm, tum (1/5000), kitti (1/256), sgbm (1/16 px), negative (-1 px)
    /// [default: PNG mm or 1/256 px, PFM m or px, XML mm]
    #[arg(long, value_name = "UNIT", allow_hyphen_values = true, help_heading = "Mapping")]
    #[serde(deserialize_with = "words::parsed")]
    pub depth_scale: Option<DepthScale>,
    /// Source of instance masks
    #[arg(
        long,
        value_name = "SOURCE",
        help_heading = "Mapping",
        help = format!("{} [default: auto]", MaskChoice::help())
    )]
    #[serde(deserialize_with = "words::parsed")]
    pub instances: Option<MaskChoice>,
    /// Take masks in every K-th frame of the data set alone, as of a slow network; tracks carry on
    /// in between [default: 1]
    #[arg(long, value_name = "K", help_heading = "Mapping")]
    pub instances_every: Option<NonZeroUsize>,
    /// Save every frame's instance masks to a new folder, for --instances files:DIR; those found by
    /// motion go to DIR/motion
    #[arg(long, value_name = "DIR", help_heading = "Mapping")]
    pub save_instances: Option<PathBuf>,
    /// Mask objects out of the static map and reconstruct them separately; off fuses everything
    /// into one map [default: on]
    #[arg(long, value_name = "on|off", value_parser = words::on_or_off, help_heading = "Mapping")]
    pub dynamic: Option<bool>,
    /// Source of the camera's motion: stereo (matches over two pairs), icp (depth against the map,
    /// the baseline of hand-held mappers: expected to fail at driving speed), or file:POSES (KITTI
    /// or TUM) [default: stereo]
    #[arg(long, value_name = "SOURCE", help_heading = "Mapping")]
    #[serde(deserialize_with = "words::parsed")]
    pub egomotion: Option<Egomotion>,
    /// Positions of the camera that something else measured, in the first camera's axes: rows of
    /// time (s), x, y, z (m) and one standard deviation or three. They move the closed path and map
    /// as loops do; needs --keyframes
    #[arg(long, value_name = "FILE", requires = "keyframes", help_heading = "Mapping")]
    pub fixes: Option<PathBuf>,
    /// Fuse every K-th frame; the camera is tracked in all [default: 1]
    #[arg(long, value_name = "K", help_heading = "Mapping")]
    pub fuse_every: Option<u32>,
    /// Settings from a file; config.toml of an earlier run is one
    #[arg(long, value_name = "FILE", help_heading = "Mapping")]
    pub config: Option<PathBuf>,
    /// One setting, over those of the file; may be repeated
    #[arg(long, value_name = "KEY=VALUE", help_heading = "Mapping")]
    #[serde(deserialize_with = "words::settings")]
    pub set: Vec<String>,
    /// Lose blocks evicted from the full pool; otherwise they are stored in map.blocks, loaded back
    /// when seen again, and included in map.ply
    #[arg(long, help_heading = "Limits")]
    pub no_stream: bool,
    /// Limit map.blocks to so many MiB [default: the disk's space]
    #[arg(long, value_name = "MIB", conflicts_with = "no_stream", help_heading = "Limits")]
    pub stream_mib: Option<u64>,
    /// Keep map.blocks in the run folder after the mesh is written
    #[arg(long, conflicts_with = "no_stream", help_heading = "Results")]
    pub keep_blocks: bool,
    /// Evaluate input and map, static and of objects, against LiDAR scans or the synthetic street's
    /// exact depth
    #[arg(long, value_enum, value_name = "REFERENCE", help_heading = "Evaluation")]
    pub evaluate: Option<Reference>,
    /// Evaluate the map at a frame's pose N frames later, after pruning [default: 0]
    #[arg(long, value_name = "N", requires = "evaluate", help_heading = "Evaluation")]
    pub evaluation_delay: Option<usize>,
    /// Save every frame's disparity to a new folder: 16-bit PNG named as the images, 1/256 px, 0
    /// none; its confidence to DIR/confidence, with --set stereo.min_confidence=1
    #[arg(long, value_name = "DIR", help_heading = "Results")]
    pub save_disparity: Option<PathBuf>,
    /// Save what the finished map shows at every frame's pose to a new folder: 16-bit PNG named as
    /// the images, disparity in 1/256 px, 0 none
    #[arg(long, value_name = "DIR", help_heading = "Evaluation")]
    pub save_map_disparity: Option<PathBuf>,
    /// Export the run for COLMAP or nerfstudio to a new folder: images, masks of what moves, camera,
    /// poses, points of the map
    #[arg(long, value_names = ["FORMAT", "DIR"], num_args = 2, help_heading = "Results")]
    #[serde(deserialize_with = "words::settings")]
    pub export: Vec<String>,
    /// End at the first frame that affects the map: an extrapolated pose, anything refused or lost
    #[arg(long, help_heading = "Limits")]
    pub strict: bool,
    /// Leave out frames that cannot be read or mapped, and count them; otherwise the run ends
    /// before the first of them
    #[arg(long, help_heading = "Frames")]
    pub skip_bad_frames: bool,
    /// Inject faults, to see what becomes of them:
    /// `NAME[:left|:right][=AMOUNT][@FIRST[..[END]]][%PERCENT]`, separated by commas; drop,
    /// duplicate, swap, jump=FRAMES, exchange, freeze, delay, black, noise=GREY_LEVELS,
    /// occlude=SHARE, brightness=FACTOR, masks, truck=METRES, walker=METRES, bus=METRES_A_FRAME,
    /// bonnet=SHARE, reflection=SHARE, dirt=SHARE, tunnel=SHARE, pattern=GREY_LEVELS,
    /// rain=STREAKS, wind=PX, drift=PX_A_FRAME, zoom=FACTOR, jpeg=QUALITY, flicker=SHARE; seed=N
    #[arg(long, value_name = "SPEC")]
    #[serde(deserialize_with = "words::parsed")]
    pub faults: Option<Faults>,
    /// Map images that are refused as exchanged, unrectified, out of order, black or the same in
    /// both cameras
    #[arg(long, help_heading = "Frames")]
    pub force: bool,
    /// Objects in map.ply next to the static map: none, last (each where it was last seen), all (at
    /// every pose it was seen in) [default: last]
    #[arg(long, value_enum, value_name = "WHICH", help_heading = "Results")]
    pub map_objects: Option<MapObjects>,
    /// Axes of map.ply: camera (x right, y down, z forward) or enu (x right, y forward, z up)
    /// [default: camera]
    #[arg(long, value_enum, value_name = "AXES", help_heading = "Results")]
    pub axes: Option<Axes>,
    /// Record the run as run.mcap for Foxglove and rerun: images, disparity, poses, objects, points
    /// of the map, figures
    #[arg(long, help_heading = "Results")]
    pub mcap: bool,
    /// Send obstacle distances to an autopilot after every frame, as MAVLink: udp:127.0.0.1:14550
    #[arg(long, value_name = "udp:HOST:PORT", requires = "planning", help_heading = "Results")]
    #[serde(deserialize_with = "words::parsed")]
    pub mavlink: Option<UdpAddress>,
    /// With --mavlink, send the nearest obstacle of each direction as a point as well
    /// (OBSTACLE_DISTANCE_3D)
    #[arg(long, requires = "mavlink", help_heading = "Results")]
    pub mavlink_points: bool,
}

impl Options {
    /// The request of these options. Files of settings and bounds are read, and paths become
    /// absolute, so that it means the same elsewhere.
    ///
    /// # Errors
    /// A file cannot be read, or a setting or a bound is none.
    pub fn request(&self) -> Result<Request, RequestError> {
        let request = Request {
            input: self.input()?,
            frames: self.frames(),
            depth: self.depth.clone().unwrap_or_default(),
            depth_scale: self.depth_scale.clone(),
            masks: self.masks(),
            poses: self.poses(),
            fixes: self.fixes.clone(),
            bounds: self.bounds()?,
            settings: self.settings()?,
            scale: self.scene_scale(),
            storage: Storage {
                lose_evicted: self.no_stream,
                most_mib: self.stream_mib,
                keep_blocks: self.keep_blocks,
                snapshot_every: None,
                continues: None,
            },
            evaluation: Evaluation {
                reference: self.evaluate,
                delay: self.evaluation_delay.unwrap_or_default(),
            },
            exports: Exports {
                objects: self.map_objects.unwrap_or_default(),
                axes: self.axes.unwrap_or_default(),
                record: self.mcap,
                instances: self.save_instances.clone(),
                disparity: self.save_disparity.clone(),
                map_disparity: self.save_map_disparity.clone(),
                mavlink: self.mavlink,
                mavlink_points: self.mavlink_points,
                scene: SceneExport::from_words(&self.export).map_err(RequestError::Invalid)?,
            },
            limits: Limits { strict: self.strict, ..Limits::default() },
        };
        // A relative path would mean another file on another day.
        request.absolute().map_err(|error| {
            RequestError::Invalid(format!("the current folder is unknown: {error}. Enter another"))
        })
    }

    fn input(&self) -> Result<Input, RequestError> {
        if self.bits.is_some_and(|bits| !(8..=16).contains(&bits)) {
            return Err(RequestError::invalid("--bits must be 8 to 16. Give another number"));
        }
        if let (Some(path), Some(_)) = (&self.path, self.world) {
            return Err(RequestError::Invalid(format!(
                "--world is rendered, and {} is a recording. Leave one of them out",
                path.display()
            )));
        }
        // A path of `-` is standard input, as with other tools.
        Ok(Input {
            source: match &self.path {
                None => self.world.map_or(Source::Street, SyntheticWorld::source),
                Some(path) if path == Path::new("-") => Source::Stream,
                Some(path) => Source::Recording(path.clone()),
            },
            layout: self.dataset,
            sequence: self.sequence.clone(),
            cameras: self.images.unwrap_or_default(),
            bits: self.bits,
            bayer: self.bayer,
            topics: self.topics.clone(),
            stacking: match (self.side_by_side, self.top_bottom) {
                (true, _) => Some(Stacking::SideBySide),
                (_, true) => Some(Stacking::TopBottom),
                _ => None,
            },
            rate_hz: self.rate,
            when_late: self.when_late,
            calibration: self.calibration.clone(),
            hints: CalibrationHints {
                unit: self.calibration_unit,
                lens_model: self.lens_model,
                swap: self.swap,
                vertical: self.vertical,
                colour: false,
            },
            ignore_mask: self.ignore_mask.clone(),
            inertial: self.inertial.clone().unwrap_or_default(),
            inertial_calibration: self.inertial_calibration.clone(),
            faults: self.faults.clone(),
        })
    }

    fn frames(&self) -> Frames {
        let default = Frames::default();
        Frames {
            start: self.start.unwrap_or(default.start),
            most: self.frames,
            stride: self.stride.unwrap_or(default.stride),
            scale: self.images_scale().unwrap_or(default.scale),
            skip_bad: self.skip_bad_frames,
            force: self.force,
        }
    }

    /// Factor on the images' sides; the last one given counts.
    fn images_scale(&self) -> Option<f64> {
        self.scale.iter().rev().find_map(|word| match word {
            ScaleWord::Images(factor) => Some(*factor),
            ScaleWord::Scene(_) => None,
        })
    }

    /// Scale of the map; the last one given counts.
    fn scene_scale(&self) -> SceneScale {
        let found = self.scale.iter().rev().find_map(|word| match word {
            ScaleWord::Scene(scene) => Some(*scene),
            ScaleWord::Images(_) => None,
        });
        found.unwrap_or_default()
    }

    fn masks(&self) -> Masks {
        let default = Masks::default();
        Masks {
            source: self.instances.clone().unwrap_or(default.source),
            every: self.instances_every.unwrap_or(default.every),
        }
    }

    fn poses(&self) -> Poses {
        match &self.egomotion {
            Some(Egomotion::File(path)) => Poses::File(path.clone()),
            Some(Egomotion::Source(_)) | None => Poses::Estimated,
        }
    }

    fn bounds(&self) -> Result<Bounds, RequestError> {
        let memory = match (&self.profile, self.memory, &self.capacity) {
            (None, None, None) => Memory::default(),
            (Some(name), None, None) => Memory::Profile(name.clone()),
            (None, Some(bytes), None) => Memory::Budget(bytes),
            (None, None, Some(path)) => Memory::read(path)?,
            _ => {
                return Err(RequestError::invalid(
                    "--profile, --memory and --capacity exclude each other. Give one of them",
                ));
            }
        };
        let planning = self
            .planning
            .map(|window| PlanningWindow { cells: window.0, distance_3d: self.planning_3d });
        Ok(Bounds { memory, planning, keyframes: self.keyframes.unwrap_or(0) as usize })
    }

    /// The file's settings, those given one by one, and those that have an option of their own.
    fn settings(&self) -> Result<Settings, RequestError> {
        let mut settings = Settings::resolve(self.config.as_deref(), &self.set)
            .map_err(|error| RequestError::Invalid(format!("{error:#}")))?;
        // Options of their own come last and win over --set.
        if let Some(size) = self.rectified {
            let side = |side: usize| Some(u32::try_from(side).unwrap_or(u32::MAX));
            settings.rectify = RectifiedSize {
                width_px: side(size.0),
                height_px: side(size.1),
                focal_px: self.rectified_focal.or(settings.rectify.focal_px),
            };
        }
        if let Some(dynamic) = self.dynamic {
            settings.tracking.dynamic = dynamic;
        }
        if let Some(frames) = self.fuse_every {
            settings.mapper.fuse_every = frames;
        }
        if let Some(Egomotion::Source(source)) = self.egomotion {
            settings.mapper.egomotion = source;
        }
        Ok(settings)
    }
}
