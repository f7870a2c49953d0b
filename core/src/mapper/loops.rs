//! Loops and fixes: what holds the map together beyond the camera's own motion.

use super::Mapper;
use crate::{
    geometry::Transform,
    places::{CorrectedKeyframe, HeldLoop, LoopCounts, PoseFix},
    volume::is_within_map,
};
use core::fmt;

/// Reason that a pose of the caller's is not taken. Nothing changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FixError {
    /// The pose is no rigid motion in finite numbers, or lies beyond the map.
    Pose,
    /// The covariance is not positive definite: each direction needs an error.
    Covariance,
    /// No way leads from the map's beginning to the camera: there is no keyframe yet, the camera
    /// was lost since the last one, or it is in another segment; or the last keyframe has a fix.
    Nowhere,
}

impl fmt::Display for FixError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pose => "the pose is no rigid motion within the map",
            Self::Covariance => "the covariance leaves a direction without an error",
            Self::Nowhere => {
                "no keyframe without a fix leads from the map's beginning to the camera"
            }
        })
    }
}

impl core::error::Error for FixError {}

impl Mapper<'_> {
    /// Keyframes of this run after all loops and fixes so far, oldest first. Where there was none
    /// they are where the camera was.
    ///
    /// ```
    /// use dynvox_core::{Capacity, Config, Mapper, geometry::StereoRig, memory::SLAB_ALIGN};
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
    /// let mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut slab)?;
    /// assert_eq!(mapper.corrected_keyframes().count(), 0);
    /// # Ok::<(), dynvox_core::NewError>(())
    /// ```
    pub fn corrected_keyframes(&self) -> impl Iterator<Item = CorrectedKeyframe> {
        self.localization.places.corrected()
    }

    /// Counts of the loops closed so far.
    ///
    /// ```
    /// use dynvox_core::{Capacity, Config, Mapper, geometry::StereoRig, memory::SLAB_ALIGN};
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
    /// let mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut slab)?;
    /// assert_eq!(mapper.loops().closures, 0);
    /// # Ok::<(), dynvox_core::NewError>(())
    /// ```
    pub fn loops(&self) -> LoopCounts {
        self.localization.places.loops()
    }

    /// Loops that hold the keyframes where [`Mapper::corrected_keyframes`] has them: all that were
    /// closed so far but those that others contradicted, thinned out where they were too many.
    ///
    /// ```
    /// use dynvox_core::{Capacity, Config, Mapper, geometry::StereoRig, memory::SLAB_ALIGN};
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
    /// let mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut slab)?;
    /// assert_eq!(mapper.held_loops().count(), 0);
    /// # Ok::<(), dynvox_core::NewError>(())
    /// ```
    pub fn held_loops(&self) -> impl Iterator<Item = HeldLoop> {
        self.localization.places.held_loops()
    }

    /// Change from the world as it is driven to the one after all loops and fixes, at the camera:
    /// ROS's transform from `map` to `odom`. Reports, planning maps and objects are in the world as
    /// driven, which never jumps; this changes in frames of [`Report::world_moved`] and as
    /// keyframes are taken.
    ///
    /// ```
    /// use dynvox_core::{
    ///     Capacity, Config, Mapper,
    ///     geometry::{StereoRig, Transform},
    ///     memory::SLAB_ALIGN,
    /// };
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
    /// let mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut slab)?;
    /// assert_eq!(mapper.t_closed_driven(), Transform::IDENTITY);
    /// # Ok::<(), dynvox_core::NewError>(())
    /// ```
    ///
    /// [`Report::world_moved`]: crate::Report::world_moved
    pub fn t_closed_driven(&self) -> Transform {
        self.localization.places.newest_closing(self.segment())
    }

    /// Takes a pose of the camera in the last frame that something else measured: a surveyed mark,
    /// a satellite receiver whose axes are those of the first camera. Like a loop it moves the
    /// keyframes, ten frames later, by its covariance and theirs; one that all else contradicts is
    /// taken out. The camera goes on in the world as driven.
    ///
    /// # Errors
    /// See [`FixError`].
    ///
    /// ```
    /// use dynvox_core::{
    ///     Capacity, Config, FixError, Mapper,
    ///     geometry::{StereoRig, Transform},
    ///     memory::SLAB_ALIGN,
    ///     places::PoseFix,
    /// };
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let capacity = Capacity { keyframes: 10, ..Capacity::TINY };
    /// let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    /// let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
    /// let fix = PoseFix::of_position([0.0; 3], [0.02; 3], &Transform::IDENTITY);
    /// assert_eq!(mapper.add_fix(&fix), Err(FixError::Nowhere), "it has seen nothing");
    /// # Ok::<(), dynvox_core::NewError>(())
    /// ```
    pub fn add_fix(&mut self, fix: &PoseFix) -> Result<(), FixError> {
        let pose = &fix.t_world_camera;
        if !(pose.is_finite()
            && pose.is_rotation()
            && is_within_map(pose, self.config.volume.voxel_size_m))
        {
            return Err(FixError::Pose);
        }
        if !fix.has_errors() {
            return Err(FixError::Covariance);
        }
        if self.localization.places.fix(fix) { Ok(()) } else { Err(FixError::Nowhere) }
    }

    /// Takes a position of the camera in the last frame, with its standard deviations along the
    /// world's axes, m, as [`Mapper::add_fix`] takes a pose.
    ///
    /// # Errors
    /// See [`FixError`].
    ///
    /// ```
    /// use dynvox_core::{
    ///     Capacity, Config, FixError, Mapper, geometry::StereoRig, memory::SLAB_ALIGN,
    /// };
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
    /// let mut mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut slab)?;
    /// let fix = mapper.add_position([0.0; 3], [0.02; 3]);
    /// assert_eq!(fix, Err(FixError::Nowhere), "profile `tiny` has no keyframes");
    /// # Ok::<(), dynvox_core::NewError>(())
    /// ```
    pub fn add_position(
        &mut self,
        position_m: [f64; 3],
        sigma_m: [f64; 3],
    ) -> Result<(), FixError> {
        self.add_fix(&PoseFix::of_position(position_m, sigma_m, &self.t_closed_camera()))
    }

    /// Takes the direction that is up in the last frame, in the camera's axes and in those of the
    /// first camera, with the standard deviation of its angle, rad, as [`Mapper::add_fix`] takes a
    /// pose. It holds roll and pitch, and with them the height of a long way.
    ///
    /// # Errors
    /// See [`FixError`]; [`FixError::Pose`] for a direction of length 0.
    ///
    /// ```
    /// use dynvox_core::{
    ///     Capacity, Config, FixError, Mapper, geometry::StereoRig, memory::SLAB_ALIGN,
    /// };
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let capacity = Capacity { keyframes: 10, ..Capacity::TINY };
    /// let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    /// let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
    /// let up = [0.0, -1.0, 0.0];
    /// assert_eq!(mapper.add_vertical(up, up, 0.005), Err(FixError::Nowhere), "nothing was seen");
    /// assert_eq!(mapper.add_vertical([0.0; 3], up, 0.005), Err(FixError::Pose));
    /// # Ok::<(), dynvox_core::NewError>(())
    /// ```
    pub fn add_vertical(
        &mut self,
        up_camera: [f64; 3],
        up_world: [f64; 3],
        sigma_rad: f64,
    ) -> Result<(), FixError> {
        self.add_fix(&PoseFix::of_vertical(up_camera, up_world, sigma_rad, &self.t_closed_camera()))
    }

    /// The camera of the last frame in the closed world.
    fn t_closed_camera(&self) -> Transform {
        (self.t_closed_driven() * *self.t_world_camera()).normalized()
    }
}
