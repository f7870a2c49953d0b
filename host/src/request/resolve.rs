//! From a request to a plan.

use super::examine::{Examined, examine};
use super::opening;
use super::resident_limit_bytes;
use super::{FrameNumbers, Plan, Poses, Request, RequestError, Settings, Worlds, input};
use crate::input::{InertialUnitData, StopRequest, read_given_poses, read_position_fixes};
use dynvox_core::geometry::StereoRig;
use dynvox_core::{Capacity, Config, Scale};

const MIB: u64 = 1 << 20;
/// Threads at most.
const MAX_THREADS: usize = 256;

/// Settings whose lengths follow from a rig.
pub(super) struct Scaled {
    /// The settings.
    pub settings: Settings,
    /// Voxel size of a map of a street with as many blocks in view, m.
    pub street_voxel_size_m: f32,
}

impl Request {
    /// Opens the data set and works out frames, bounds and settings.
    ///
    /// # Errors
    /// A sentence of the part that cannot be used, with the next action.
    pub fn resolve(&self) -> Result<Plan, RequestError> {
        self.resolve_with(&StopRequest::default())
    }

    /// Opens the data set and works out frames, bounds and settings of a run that `stop` can end.
    ///
    /// # Errors
    /// The errors of [`Request::resolve`].
    pub fn resolve_with(&self, stop: &StopRequest) -> Result<Plan, RequestError> {
        self.check_parts()?;
        let threads = self.threads()?;
        let recorded = input::open(self, stop)?;
        // Before networks, which would run on every image that is examined.
        let Examined { mut warnings, interval_s } = examine(self, recorded.as_ref())?;
        // Of a stream nothing is listed: it cannot be seen twice.
        let listed = FrameNumbers::new(recorded.as_ref(), &self.frames)?;
        let offset = opening::find(self, &self.settings, recorded.as_ref(), listed.listed());
        if let Some(found) = &offset {
            warnings.extend(opening::warning(found, &self.settings.rig));
        }
        let dataset = input::dress(self, recorded, stop)?;
        let scaled = self.scaled_settings(&dataset.rig(), dataset.size().0)?;
        let (profile, capacity) = self.bounds.resolve(
            dataset.size(),
            dataset.rectification(),
            scaled.street_voxel_size_m,
        )?;
        // Settings that depend on the rate need the recording's own.
        let mut settings = self.fitted_settings(scaled.settings, &capacity, interval_s);
        if let Some(found) = &offset {
            opening::begin_with(found, &mut settings.rig);
        }
        let frames = FrameNumbers::new(dataset.as_ref(), &self.frames)?;
        let poses = match &self.poses {
            Poses::Estimated => None,
            Poses::File(path) => Some(read_given_poses(path, dataset.as_ref(), frames.listed())?),
        };
        let fixes = match &self.fixes {
            None => Vec::new(),
            Some(path) => read_position_fixes(path, dataset.as_ref(), frames.listed())?,
        };
        let unit = dataset.info().inertial.as_deref();
        Ok(Plan {
            request: self.clone(),
            config: Config {
                inertial: unit.map(InertialUnitData::config),
                ..settings.config(dataset.rig(), dataset.rectification())
            },
            config_toml: file_of(&settings, self.input.source.worlds())?,
            rss_limit_bytes: match self.limits.rss_mib {
                Some(mib) => mib.saturating_mul(MIB),
                None => resident_limit_bytes(&capacity, dataset.size()),
            },
            frames,
            poses,
            fixes,
            profile,
            capacity,
            threads,
            warnings,
            stop: stop.clone(),
            progress: false,
            live: None,
            dataset,
        })
    }

    /// The settings with the lengths that follow from the rig.
    pub(super) fn scaled_settings(
        &self,
        rig: &StereoRig,
        width_px: usize,
    ) -> Result<Scaled, RequestError> {
        let scale = self.scale.lengths(rig, width_px);
        let mut settings = self.settings.clone();
        settings.adapt(&scale).map_err(|error| RequestError::Invalid(format!("{error:#}")))?;
        let shrunk = scale.far_m() / Scale::STREET.far_m();
        let street_voxel_size_m = settings.volume.voxel_size_m / shrunk;
        Ok(Scaled { settings, street_voxel_size_m })
    }

    /// The settings with what depends on bounds and data set.
    pub(super) fn fitted_settings(
        &self,
        mut settings: Settings,
        bounds: &Capacity,
        interval_s: Option<f64>,
    ) -> Settings {
        // First what depends on the bounds, then what the user's choice of masks implies.
        settings.fit(bounds);
        if let Some(finds_motion) = self.masks.source.finds_motion() {
            settings.segmentation.enabled = finds_motion;
        }
        if let Some(interval_s) = interval_s {
            settings.tracking.frame_interval_s = interval_s as f32;
        }
        settings
    }

    /// Threads to work with.
    pub(super) fn threads(&self) -> Result<usize, RequestError> {
        let threads = self
            .limits
            .threads
            .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from).min(4));
        if threads > MAX_THREADS {
            return Err(RequestError::Invalid(format!(
                "--threads {threads} is more than {MAX_THREADS}. Give at most the number of \
                 processors"
            )));
        }
        if threads == 0 || self.frames.stride == 0 || self.frames.most == Some(0) {
            return Err(RequestError::invalid(
                "--threads, --stride and --frames must be at least 1. Give a larger number",
            ));
        }
        Ok(threads)
    }

    /// Checks that no part contradicts another.
    fn check_parts(&self) -> Result<(), RequestError> {
        let Self { frames, storage, evaluation, exports, .. } = self;
        // None of these can be continued from a snapshot.
        let snapshots = storage.snapshot_every.is_some();
        if exports.mavlink.is_some() && self.bounds.planning.is_none() {
            return Err(RequestError::invalid(
                "--mavlink needs a planner's window. Add --planning 200x200x20",
            ));
        }
        let whole = [
            ("an evaluation", evaluation.reference.is_some()),
            ("a recording as MCAP", exports.record),
            ("saved instances", exports.instances.is_some()),
            ("saved disparities", exports.disparity.is_some()),
            ("saved disparities of the map", exports.map_disparity.is_some()),
            ("an exported scene", exports.scene.is_some()),
        ];
        if let Some((what, _)) = whole.iter().find(|(_, asked)| snapshots && *asked) {
            return Err(RequestError::Invalid(format!(
                "a run with snapshots cannot have {what}. Leave out one of them"
            )));
        }
        if storage.snapshot_every == Some(0) {
            return Err(RequestError::invalid(
                "--snapshot-every must be at least 1. Give a larger number",
            ));
        }
        if exports.instances.is_some() && frames.scale != 1.0 {
            return Err(RequestError::invalid(
                "instances are saved at full size. Leave out --save-instances or --scale",
            ));
        }
        Ok(())
    }
}

/// The settings as a file.
pub(super) fn file_of(settings: &Settings, worlds: Worlds) -> Result<String, RequestError> {
    settings.to_toml(worlds).map_err(|error| RequestError::Invalid(format!("{error:#}")))
}
