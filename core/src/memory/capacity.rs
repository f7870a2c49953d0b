//! Every bound of the mapper, in one table.

/// All bounds. Bytes follow from them alone, at compile time.
///
/// ```
/// use dynvox_core::Capacity;
///
/// let larger = Capacity { blocks: 5_000, ..Capacity::TINY };
/// assert!(Capacity::TINY.bytes() < 8 << 20 && larger.bytes() > Capacity::TINY.bytes());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacity {
    /// Widest image, px. A wider frame is refused.
    pub image_width: usize,
    /// Highest image, px. A higher frame is refused.
    pub image_height: usize,
    /// Widest raw image that is rectified, px, at most 4,096; 0 where images come rectified, and
    /// then rectification costs no byte.
    pub raw_width: usize,
    /// Highest raw image, px; as the width.
    pub raw_height: usize,
    /// Features kept per image and pass: the strongest. Further ones are dropped and counted.
    pub features: usize,
    /// Matches kept per pass. Further ones are dropped and counted.
    pub matches: usize,
    /// Voxel blocks of the static map. Further ones are refused and counted.
    pub blocks: usize,
    /// Blocks visible in one frame. Further ones are not fused in that frame, and counted.
    pub visible_blocks: usize,
    /// Frames the visible history spans. A longer `prune_lag` is shortened to this, and each frame
    /// pruned early is counted.
    pub history_frames: usize,
    /// Detections accepted in one frame, at most [`crate::tracking::MAX_DETECTIONS`]. Beyond, the
    /// lowest scores are refused and counted.
    pub detections: usize,
    /// Words of 64 pixels for the masks of one frame. Further masks are refused and counted.
    pub mask_words: usize,
    /// Tracks. When all are in use the one unseen for longest is dropped, unless it was seen
    /// lately: then the new one is refused and counted.
    pub tracks: usize,
    /// Objects reconstructed at once, at most [`crate::objects::MAX_OBJECTS`]. The one fused
    /// longest ago is handed over for another.
    pub objects: usize,
    /// Voxel blocks of one object. Further ones are refused and counted.
    pub object_blocks: usize,
    /// Pixels of crops that wait for their object's motion. The oldest crops go first, and are
    /// counted.
    pub crop_pixels: usize,
    /// Keyframes by which places are recognised, at most 65,536; 0 makes none, and then it costs no
    /// byte. A full table thins out. See [`crate::places`].
    pub keyframes: usize,
    /// Width of the planner's window, cells, at most [`crate::planning::MAX_SIDE_CELLS`]; 0 makes
    /// none, and then it costs no byte. See
    /// [`crate::planning`].
    pub planning_width: usize,
    /// Length of the planner's window, cells; as the width.
    pub planning_length: usize,
    /// Height of the planner's window, cells; as the width.
    pub planning_height: usize,
    /// True if distances are kept for every cell of the window, false for a slice only.
    pub planning_distance_3d: bool,
    /// True if voxels have colour: 3,072 bytes a block with, 1,536 without.
    pub colour: bool,
}

impl Capacity {
    /// Below 8 MiB: a microcontroller with external memory.
    pub const TINY: Self = Self {
        image_width: 320,
        image_height: 96,
        raw_width: 0,
        raw_height: 0,
        features: 2_000,
        matches: 1_000,
        blocks: 2_500,
        visible_blocks: 2_000,
        history_frames: 64,
        detections: 16,
        mask_words: 4_096,
        tracks: 16,
        objects: 2,
        object_blocks: 150,
        crop_pixels: 30_000,
        keyframes: 0,
        planning_width: 0,
        planning_length: 0,
        planning_height: 0,
        planning_distance_3d: false,
        colour: false,
    };
    /// Below 64 MiB: KITTI at half size.
    pub const SMALL: Self = Self {
        image_width: 640,
        image_height: 192,
        raw_width: 0,
        raw_height: 0,
        features: 6_000,
        matches: 4_000,
        blocks: 30_000,
        visible_blocks: 12_000,
        history_frames: 64,
        detections: 32,
        mask_words: 16_384,
        tracks: 32,
        objects: 4,
        object_blocks: 700,
        crop_pixels: 150_000,
        keyframes: 0,
        planning_width: 0,
        planning_length: 0,
        planning_height: 0,
        planning_distance_3d: false,
        colour: false,
    };
    /// Below 256 MiB: KITTI at full size, in colour.
    pub const ONBOARD: Self = Self {
        image_width: 1_280,
        image_height: 384,
        raw_width: 0,
        raw_height: 0,
        features: 20_000,
        matches: 10_000,
        blocks: 53_000,
        visible_blocks: 24_000,
        history_frames: 200,
        detections: 64,
        mask_words: 65_536,
        tracks: 64,
        objects: 8,
        object_blocks: 1_200,
        crop_pixels: 800_000,
        keyframes: 0,
        planning_width: 0,
        planning_length: 0,
        planning_height: 0,
        planning_distance_3d: false,
        colour: true,
    };
    /// Below 2 GiB: some hundred metres of road at full size, in colour.
    pub const DESKTOP: Self = Self {
        image_width: 1_920,
        image_height: 1_088,
        raw_width: 0,
        raw_height: 0,
        features: 20_000,
        matches: 10_000,
        blocks: 550_000,
        visible_blocks: 60_000,
        history_frames: 200,
        detections: 64,
        mask_words: 262_144,
        tracks: 64,
        objects: 16,
        object_blocks: 4_000,
        crop_pixels: 4_000_000,
        keyframes: 0,
        planning_width: 0,
        planning_length: 0,
        planning_height: 0,
        planning_distance_3d: false,
        colour: true,
    };

    /// The profiles by name.
    pub const PROFILES: [(&'static str, Self); 4] = [
        ("tiny", Self::TINY),
        ("small", Self::SMALL),
        ("onboard", Self::ONBOARD),
        ("desktop", Self::DESKTOP),
    ];

    /// Pixels of the largest image.
    ///
    /// ```
    /// use dynvox_core::Capacity;
    ///
    /// let capacity = Capacity { image_width: 640, image_height: 480, ..Capacity::SMALL };
    /// assert_eq!(capacity.pixels(), 640 * 480);
    /// ```
    pub const fn pixels(&self) -> usize {
        self.image_width * self.image_height
    }
}
