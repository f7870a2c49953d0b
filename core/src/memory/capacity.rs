//! Every bound of the mapper, in one table.

/// All bounds. Bytes follow from them alone, at compile time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacity {
    /// Widest image, px. A wider frame is refused.
    pub image_width: usize,
    /// Highest image, px. A higher frame is refused.
    pub image_height: usize,
    /// Features kept per image and pass. Further ones are dropped in scan order and counted.
    pub features: usize,
    /// Matches kept per pass. Further ones are dropped and counted.
    pub matches: usize,
    /// Voxel blocks of the static map. Further ones are refused and counted.
    pub blocks: usize,
    /// Blocks visible in one frame. Further ones are not fused in that frame, and counted.
    pub visible_blocks: usize,
    /// Frames the visible history spans. A longer `prune_lag` is cut to this, and each frame pruned early is counted.
    pub history_frames: usize,
    /// Whether voxels have colour: 3,072 bytes a block with, 1,536 without.
    pub colour: bool,
}

impl Capacity {
    /// Below 8 MiB: a microcontroller with external memory.
    pub const TINY: Self = Self {
        image_width: 320,
        image_height: 96,
        features: 2_000,
        matches: 1_000,
        blocks: 2_500,
        visible_blocks: 2_000,
        history_frames: 64,
        colour: false,
    };
    /// Below 64 MiB: KITTI at half size.
    pub const SMALL: Self = Self {
        image_width: 640,
        image_height: 192,
        features: 6_000,
        matches: 4_000,
        blocks: 30_000,
        visible_blocks: 12_000,
        history_frames: 64,
        colour: false,
    };
    /// Below 256 MiB: KITTI at full size, in colour.
    pub const ONBOARD: Self = Self {
        image_width: 1_280,
        image_height: 384,
        features: 24_000,
        matches: 10_000,
        blocks: 68_000,
        visible_blocks: 24_000,
        history_frames: 200,
        colour: true,
    };
    /// Below 2 GiB: a drive of some hundred metres at full size, in colour.
    pub const DESKTOP: Self = Self {
        image_width: 1_920,
        image_height: 1_088,
        features: 32_000,
        matches: 20_000,
        blocks: 550_000,
        visible_blocks: 60_000,
        history_frames: 200,
        colour: true,
    };

    /// The profiles by name.
    pub const PROFILES: [(&'static str, Self); 4] =
        [("tiny", Self::TINY), ("small", Self::SMALL), ("onboard", Self::ONBOARD), ("desktop", Self::DESKTOP)];

    /// Pixels of the largest image.
    pub const fn pixels(&self) -> usize {
        self.image_width * self.image_height
    }
}
