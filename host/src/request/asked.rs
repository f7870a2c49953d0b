//! From options to a request.

use super::options::{Egomotion, Options};
use super::{
    Bounds, Evaluation, Exports, Frames, Input, Limits, Masks, Memory, PlanningWindow, Poses,
    Request, RequestError, Settings, Source, Storage,
};
use crate::formats::calibration::RectifiedSize;
use crate::input::Stacking;
use std::path::Path;

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
            masks: self.masks(),
            poses: self.poses(),
            bounds: self.bounds()?,
            settings: self.settings()?,
            storage: Storage {
                lose_evicted: self.no_stream,
                most_mib: self.stream_mib,
                keep_blocks: self.keep_blocks,
                snapshot_every: None,
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
                map_disparity: self.save_map_disparity.clone(),
            },
            limits: Limits { strict: self.strict, ..Limits::default() },
        };
        request.absolute().map_err(|error| {
            RequestError::Invalid(format!("the current folder is unknown: {error}. Enter another"))
        })
    }

    fn input(&self) -> Result<Input, RequestError> {
        if self.bits.is_some_and(|bits| !(8..=16).contains(&bits)) {
            return Err(RequestError::invalid("--bits must be 8 to 16. Give another number"));
        }
        Ok(Input {
            source: match &self.path {
                None => Source::Street,
                Some(path) if path == Path::new("-") => Source::Stream,
                Some(path) => Source::Recording(path.clone()),
            },
            layout: self.dataset,
            sequence: self.sequence.clone(),
            cameras: self.images.unwrap_or_default(),
            bits: self.bits,
            topics: self.topics.clone(),
            stacking: match (self.side_by_side, self.top_bottom) {
                (true, _) => Some(Stacking::SideBySide),
                (_, true) => Some(Stacking::TopBottom),
                _ => None,
            },
            rate_hz: self.rate,
            when_late: self.when_late,
            calibration: self.calibration.clone(),
            faults: self.faults.clone(),
        })
    }

    fn frames(&self) -> Frames {
        let default = Frames::default();
        Frames {
            start: self.start.unwrap_or(default.start),
            most: self.frames,
            stride: self.stride.unwrap_or(default.stride),
            scale: self.scale.unwrap_or(default.scale),
            skip_bad: self.skip_bad_frames,
            force: self.force,
        }
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
        Ok(Bounds { memory, planning })
    }

    /// The file's settings, those given one by one, and those that have an option of their own.
    fn settings(&self) -> Result<Settings, RequestError> {
        let mut settings = Settings::resolve(self.config.as_deref(), &self.set)
            .map_err(|error| RequestError::Invalid(format!("{error:#}")))?;
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
