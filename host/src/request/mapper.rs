//! A mapper without a data set, for cameras that other programs read.

use super::resolve::file_of;
use super::{Evaluation, Exports, Storage};
use super::{Frames, Input, Limits, Masks, Poses, Request, RequestError, Worlds, check_bounds};
use crate::formats::calibration::FittedGeometry;
use crate::input::depth::DepthChoice;
use dynvox_core::{Capacity, Config};

/// Bounds and settings of a mapper without a data set.
#[derive(Clone, Debug)]
pub struct MapperPlan {
    /// Name of the bounds.
    pub profile: String,
    /// The bounds.
    pub capacity: Capacity,
    /// The configuration.
    pub config: Config,
    /// The settings as a file.
    pub config_toml: String,
    /// Threads at work.
    pub threads: usize,
}

impl Request {
    /// Works out what bounds, settings and threads make of cameras, without a data set.
    /// `interval_s` is the time between two frames.
    ///
    /// # Errors
    /// The sentences of [`Request::resolve`].
    pub fn mapper(
        &self,
        cameras: &FittedGeometry,
        interval_s: Option<f64>,
    ) -> Result<MapperPlan, RequestError> {
        let threads = self.check_mapper()?;
        let scaled = self.scaled_settings(&cameras.rig, cameras.size.0)?;
        let (profile, capacity) = self.bounds.resolve(
            cameras.size,
            cameras.rectification.as_ref(),
            scaled.street_voxel_size_m,
        )?;
        let settings = self.fitted_settings(scaled.settings, &capacity, interval_s);
        // Without a data set no file of poses can be read row by row.
        if matches!(self.poses, Poses::File(_)) {
            return Err(RequestError::invalid(
                "--egomotion file:POSES needs a data set. Give each frame its pose",
            ));
        }
        let config = settings.config(cameras.rig, cameras.rectification.as_ref());
        check_bounds(cameras.size, (&profile, &capacity), &config)?;
        let config_toml = file_of(&settings, Worlds::NONE)?;
        Ok(MapperPlan { profile, capacity, config, config_toml, threads })
    }

    /// Checks what can be checked of a mapper's request before the pictures' size is known, and
    /// returns its threads.
    ///
    /// # Errors
    /// The sentences of [`Request::resolve`].
    pub fn check_mapper(&self) -> Result<usize, RequestError> {
        // What a mapper alone can use; a request that asks for more differs from it.
        let mapper = Self {
            input: Input::default(),
            frames: Frames::default(),
            depth: DepthChoice::default(),
            masks: Masks { source: self.masks.source.clone(), ..Masks::default() },
            ..self.frames_only()
        };
        self.require(&mapper, "a mapper alone")?;
        if !self.masks.need_no_recording() {
            return Err(RequestError::invalid(
                "masks from files and networks need a data set. Give each frame its detections",
            ));
        }
        self.threads()
    }

    /// Checks that nothing is asked for that is only known of a run to its end: a program that
    /// takes the frames one by one has no results to write.
    ///
    /// # Errors
    /// The first part that is asked for.
    pub fn check_frames_only(&self) -> Result<(), RequestError> {
        self.require(&self.frames_only(), "a data set read frame by frame")
    }

    /// The request without what belongs to a run to its end.
    fn frames_only(&self) -> Self {
        Self {
            fixes: None,
            storage: Storage::default(),
            evaluation: Evaluation::default(),
            exports: Exports::default(),
            limits: Limits { threads: self.limits.threads, ..Limits::default() },
            ..self.clone()
        }
    }

    /// Refuses what `self` asks for and `allowed` does not.
    fn require(&self, allowed: &Self, what: &str) -> Result<(), RequestError> {
        let others = self.differences(allowed);
        match others.keys().next() {
            None => Ok(()),
            Some(_) => {
                let names = others.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
                Err(RequestError::Invalid(format!("{what} has no {names}. Leave it out")))
            }
        }
    }
}
