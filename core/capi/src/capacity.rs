//! The bounds of a mapper.

use crate::{
    DynvoxStatus,
    given::{output, read},
    handle::HEAD_BYTES,
};
use dynvox_core::{BudgetError, BudgetOptions, Capacity};

/// A capacity by name. Numbers as in dynvox's own table of profiles.
pub type DynvoxProfile = u32;
/// Below 8 MiB, images up to 320 x 96, no colour.
pub const DYNVOX_PROFILE_TINY: DynvoxProfile = 0;
/// Below 64 MiB, images up to 640 x 192, no colour.
pub const DYNVOX_PROFILE_SMALL: DynvoxProfile = 1;
/// Below 256 MiB, images up to 1280 x 384, colour.
pub const DYNVOX_PROFILE_ONBOARD: DynvoxProfile = 2;
/// Below 2 GiB, images up to 1920 x 1088, colour.
pub const DYNVOX_PROFILE_DESKTOP: DynvoxProfile = 3;

/// Every bound of a mapper. Bytes follow from them alone. dynvox_capacity_of_profile and
/// dynvox_capacity_for_budget fill it.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxCapacity {
    /// Widest image, px.
    pub image_width: usize,
    /// Highest image, px.
    pub image_height: usize,
    /// Widest raw image that is rectified, px, at most 4,096; 0 where pairs come rectified.
    pub raw_width: usize,
    /// Highest raw image, px.
    pub raw_height: usize,
    /// Features kept for each image.
    pub features: usize,
    /// Matches kept for each frame.
    pub matches: usize,
    /// Voxel blocks of the static map.
    pub blocks: usize,
    /// Blocks visible in one frame.
    pub visible_blocks: usize,
    /// Frames the pruning window can span.
    pub history_frames: usize,
    /// Detections in one frame, at most 64.
    pub detections: usize,
    /// Words of 64 pixels for the masks of one frame.
    pub mask_words: usize,
    /// Tracks.
    pub tracks: usize,
    /// Objects reconstructed at once.
    pub objects: usize,
    /// Voxel blocks of one object.
    pub object_blocks: usize,
    /// Pixels of crops that wait for their object's motion.
    pub crop_pixels: usize,
    /// Keyframes by which places are recognised, at most 65,536; 0 makes none, and then it costs no
    /// byte.
    pub keyframes: usize,
    /// Width of the planner's window, cells, at most 1,024; 0 makes none, and then it costs no
    /// byte.
    pub planning_width: usize,
    /// Length of the planner's window, cells.
    pub planning_length: usize,
    /// Height of the planner's window, cells.
    pub planning_height: usize,
    /// 1 if distances are kept for every cell of the window, 0 if for a slice only.
    pub planning_distance_3d: u8,
    /// 1 if voxels have colour, else 0.
    pub colour: u8,
}

impl From<&Capacity> for DynvoxCapacity {
    fn from(of: &Capacity) -> Self {
        Self {
            image_width: of.image_width,
            image_height: of.image_height,
            raw_width: of.raw_width,
            raw_height: of.raw_height,
            features: of.features,
            matches: of.matches,
            blocks: of.blocks,
            visible_blocks: of.visible_blocks,
            history_frames: of.history_frames,
            detections: of.detections,
            mask_words: of.mask_words,
            tracks: of.tracks,
            objects: of.objects,
            object_blocks: of.object_blocks,
            crop_pixels: of.crop_pixels,
            keyframes: of.keyframes,
            planning_width: of.planning_width,
            planning_length: of.planning_length,
            planning_height: of.planning_height,
            planning_distance_3d: u8::from(of.planning_distance_3d),
            colour: u8::from(of.colour),
        }
    }
}

impl DynvoxCapacity {
    /// Converts the bounds to the core's; refused if a mapper cannot work with one of them.
    pub(crate) fn checked(&self) -> Result<Capacity, DynvoxStatus> {
        // All fields are named: a new bound does not compile until it has a field here.
        let capacity = Capacity {
            image_width: self.image_width,
            image_height: self.image_height,
            raw_width: self.raw_width,
            raw_height: self.raw_height,
            features: self.features,
            matches: self.matches,
            blocks: self.blocks,
            visible_blocks: self.visible_blocks,
            history_frames: self.history_frames,
            detections: self.detections,
            mask_words: self.mask_words,
            tracks: self.tracks,
            objects: self.objects,
            object_blocks: self.object_blocks,
            crop_pixels: self.crop_pixels,
            keyframes: self.keyframes,
            planning_width: self.planning_width,
            planning_length: self.planning_length,
            planning_height: self.planning_height,
            planning_distance_3d: self.planning_distance_3d != 0,
            colour: self.colour != 0,
        };
        capacity.validate().map(|()| capacity).map_err(|_| DynvoxStatus::Capacity)
    }
}

/// Writes the bounds of a profile.
///
/// # Safety
/// `capacity` is null or points to a capacity.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_capacity_of_profile(
    profile: DynvoxProfile,
    capacity: *mut DynvoxCapacity,
) -> DynvoxStatus {
    let Some((_, of)) = Capacity::PROFILES.get(profile as usize) else {
        return DynvoxStatus::Unknown;
    };
    // SAFETY: only looked at.
    match unsafe { output(capacity) } {
        Ok(capacity) => {
            // SAFETY: checked; of the right type by the caller's promise.
            unsafe { capacity.write(of.into()) };
            DynvoxStatus::Ok
        }
        Err(status) => status,
    }
}

/// A number of bytes and what they are to hold. In `colour` and `objects` 0 leaves the answer to
/// the rules: colour where 20,000 blocks with colour fit, objects in a fifth of what the image
/// leaves.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxBudget {
    /// Bytes of the buffer.
    pub bytes: usize,
    /// Widest image, px.
    pub width: usize,
    /// Highest image, px.
    pub height: usize,
    /// Widest raw image that is rectified, px; 0 where pairs come rectified.
    pub raw_width: usize,
    /// Highest raw image, px.
    pub raw_height: usize,
    /// Side of a voxel, m, as in the configuration; 0 is the default.
    pub voxel_size_m: f32,
    /// Above 0: with colour; below 0: without.
    pub colour: i32,
    /// Above 0: objects reconstructed at once; below 0: none.
    pub objects: i32,
}

impl DynvoxBudget {
    fn options(&self) -> BudgetOptions {
        BudgetOptions {
            colour: (self.colour != 0).then_some(self.colour > 0),
            objects: (self.objects != 0).then(|| usize::try_from(self.objects).unwrap_or(0)),
            voxel_size_m: (self.voxel_size_m != 0.0).then_some(self.voxel_size_m),
            raw_image: [self.raw_width, self.raw_height],
        }
    }
}

/// Divides a buffer between the stages: writes the largest capacity for which dynvox_bytes is at
/// most `budget->bytes`. Of too few bytes DYNVOX_STATUS_TOO_SMALL, and the least that works is
/// written to `least`, which may be null.
///
/// # Safety
/// `budget` is null or points to a budget, `capacity` is null or points to a capacity, `least` is
/// null or points to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_capacity_for_budget(
    budget: *const DynvoxBudget,
    capacity: *mut DynvoxCapacity,
    least: *mut usize,
) -> DynvoxStatus {
    // SAFETY: only looked at.
    let (budget, capacity) = match unsafe { (read(budget), output(capacity)) } {
        (Ok(budget), Ok(capacity)) => (budget, capacity),
        (Err(status), _) | (_, Err(status)) => return status,
    };
    match Capacity::for_budget(
        // The handle's header lies before the mapper in the same buffer.
        budget.bytes.saturating_sub(HEAD_BYTES),
        budget.width,
        budget.height,
        &budget.options(),
    ) {
        Ok(solved) => {
            // SAFETY: checked; of the right type by the caller's promise.
            unsafe { capacity.write((&solved).into()) };
            DynvoxStatus::Ok
        }
        Err(BudgetError::TooSmall { least: needed }) => {
            if !least.is_null() && least.is_aligned() {
                // SAFETY: checked; of the right type by the caller's promise.
                unsafe { least.write(needed.saturating_add(HEAD_BYTES)) };
            }
            DynvoxStatus::TooSmall
        }
        Err(_) => DynvoxStatus::Capacity,
    }
}

/// Reads a caller's capacity.
///
/// # Safety
/// `capacity` is null, misaligned or points to a capacity.
pub(crate) unsafe fn given(capacity: *const DynvoxCapacity) -> Result<Capacity, DynvoxStatus> {
    // SAFETY: the caller's promise.
    unsafe { read(capacity) }?.checked()
}
