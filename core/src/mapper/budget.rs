//! A capacity for a given number of bytes and a given image: what the profiles are for four cases,
//! for all others.
//!
//! The rules, in order. What the image needs comes first and follows from its pixels alone (see
//! [`Capacity::for_budget`]). At most a fifth of the rest goes to volumes of objects, in steps; all
//! that remains is blocks of the static map, since they decide how far a run gets before blocks
//! leave the pool. The result never exceeds the budget, and one block more would.

use super::{MIN_HEIGHT, MIN_WIDTH};
use crate::memory::Capacity;
use crate::objects::MAX_OBJECTS;
use crate::places::MAX_KEYFRAMES;
use crate::planning::MAX_SIDE_CELLS;
use crate::scene_flow::MAX_FEATURES;
use crate::tracking::MAX_DETECTIONS;
use core::fmt;

/// Largest image side, px: positions of features are 16-bit.
pub const MAX_SIDE: usize = 8_192;
/// Most of anything that a mapper counts, so that the sum of bytes fits 64 bits.
const MAX_COUNT: usize = 1 << 28;
/// Most frames of a visible history, where a frame has a bit for every block.
const MAX_HISTORY_FRAMES: usize = 1 << 16;
/// Largest side of an image that is rectified, px.
const MAX_RAW_SIDE: usize = 4_096;
/// Most pixels of an image.
const MAX_PIXELS: usize = 1 << 24;
/// Fewest blocks of a static map worth making: half of what one frame of 320 x 96 px sees.
const MIN_BLOCKS: usize = 1_024;
/// Colour is kept where at least so many blocks can have it, unless it is asked for or declined.
const COLOUR_BLOCKS: usize = 20_000;
/// Steps of objects reconstructed at once, and blocks of each; the first that fits its share is
/// taken.
const OBJECTS: [(usize, usize); 6] =
    [(16, 4_000), (8, 1_200), (4, 700), (2, 300), (2, 150), (0, 0)];
/// Volumes of objects may take one part in so many of what the image leaves.
const OBJECTS_SHARE: usize = 5;
/// Share of the blocks for objects if their number is asked for, as a divisor.
const ASKED_OBJECTS_SHARE: usize = 2;
/// Waiting crops may take one part in so many of what the image leaves.
const CROPS_SHARE: usize = 16;
/// Voxel size the numbers of visible blocks are for, m.
const VOXEL_SIZE_M: f32 = 0.05;

/// Wishes for a budget besides bytes and image size. The default leaves all to the rules.
///
/// ```
/// use dynvox_core::{BudgetOptions, Capacity};
///
/// let grey = BudgetOptions { colour: Some(false), objects: Some(0), ..Default::default() };
/// let capacity = Capacity::for_budget(32 << 20, 640, 480, &grey)?;
/// assert!(!capacity.colour && capacity.objects == 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BudgetOptions {
    /// True if voxels have colour; if absent, they have it where 20,000 blocks with colour fit.
    pub colour: Option<bool>,
    /// Objects reconstructed at once, at most [`MAX_OBJECTS`]; as many as a fifth of the budget
    /// allows where it is not said.
    pub objects: Option<usize>,
    /// Side of a voxel of the static map, m: larger voxels need fewer blocks at once. `None` is
    /// 0.05 m.
    pub voxel_size_m: Option<f32>,
    /// Largest unrectified image, width and height, px; 0 where images come rectified.
    pub raw_image: [usize; 2],
}

/// Reason why there is no capacity for a budget.
///
/// ```
/// use dynvox_core::{BudgetError, BudgetOptions, Capacity};
///
/// let options = BudgetOptions::default();
/// let Err(BudgetError::TooSmall { least }) = Capacity::for_budget(1_000, 640, 480, &options)
/// else {
///     panic!("a kilobyte is not enough");
/// };
/// assert!(Capacity::for_budget(least, 640, 480, &options).is_ok());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BudgetError {
    /// The budget is too small for this image and these options.
    TooSmall {
        /// Bytes of the least capacity that works.
        least: usize,
    },
    /// The image is too small or too large.
    Image,
    /// More objects are asked for than the core supports.
    Objects,
    /// The voxel size is not a positive number.
    VoxelSize,
}

impl fmt::Display for BudgetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooSmall { least } => write!(
                f,
                "the budget is too small: the least that works for this image is {least} bytes"
            ),
            Self::Image => {
                write!(
                    f,
                    "images must be from {MIN_WIDTH} x {MIN_HEIGHT} px to {MAX_SIDE} px a side \
                     ({MAX_RAW_SIDE} where they are rectified)"
                )
            }
            Self::Objects => {
                write!(f, "at most {MAX_OBJECTS} objects can be reconstructed at once")
            }
            Self::VoxelSize => write!(f, "the voxel size must be a positive number of metres"),
        }
    }
}

impl core::error::Error for BudgetError {}

/// A bound that cannot be.
///
/// ```
/// use dynvox_core::Capacity;
///
/// let problem = Capacity { blocks: 0, ..Capacity::TINY }.validate().unwrap_err();
/// assert_eq!((problem.bound, problem.rule), ("blocks", "must be above 0"));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CapacityProblem {
    /// The bound: `visible_blocks`.
    pub bound: &'static str,
    /// Rule that the bound breaks: "must be above 0".
    pub rule: &'static str,
}

impl fmt::Display for CapacityProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.bound, self.rule)
    }
}

impl core::error::Error for CapacityProblem {}

/// Frames of the pruning window where the budget is small.
const SHORT_HISTORY_FRAMES: usize = 64;

impl Capacity {
    /// The largest capacity of at most `bytes` for images of `width` x `height` px:
    /// `capacity.bytes() <= bytes`, always.
    ///
    /// One pixel in 16 may be a feature and one in 40 a match, at most 20,000 of either; masks may
    /// cover 8 images of pixels; 64 detections and tracks. The pruning window is 200 frames where
    /// `bytes` is 96 MiB or more, else 64. Objects and blocks share the rest as the module says.
    ///
    /// ```
    /// use dynvox_core::{BudgetOptions, Capacity};
    ///
    /// let capacity = Capacity::for_budget(48 << 20, 752, 480, &BudgetOptions::default())?;
    /// assert!(capacity.bytes() <= 48 << 20 && capacity.blocks > 2_000);
    /// # Ok::<(), dynvox_core::BudgetError>(())
    /// ```
    ///
    /// # Errors
    /// The budget is too small, which names the least that works, or the image or an option cannot
    /// be.
    pub fn for_budget(
        bytes: usize,
        width: usize,
        height: usize,
        options: &BudgetOptions,
    ) -> Result<Self, BudgetError> {
        let question = Question::new(bytes, width, height, options)?;
        let least = question.least();
        if least.bytes() > question.bytes {
            return Err(BudgetError::TooSmall { least: least.bytes() });
        }
        // Colour doubles a block's bytes: unasked, it is given only where enough blocks remain.
        let solved = match options.colour {
            Some(colour) => question.solved(colour),
            None => {
                let coloured = question.solved(true);
                if coloured.blocks >= COLOUR_BLOCKS { coloured } else { question.solved(false) }
            }
        };
        // What the steps leave may be less than the least that works: then that is the answer,
        // grown by what fits.
        Ok(if solved.blocks >= MIN_BLOCKS { solved } else { question.filled(least) })
    }

    /// Checks that a mapper can work with every bound.
    ///
    /// # Errors
    /// The first bound that is not.
    pub fn validate(&self) -> Result<(), CapacityProblem> {
        let above_0 = "must be above 0";
        let countable = "must be at most 268,435,456";
        // One table, first broken rule first: the message names a bound that the caller can change.
        let rules = [
            (self.image_width >= MIN_WIDTH, "image_width", "must be at least 64 px"),
            (self.image_height >= MIN_HEIGHT, "image_height", "must be at least 32 px"),
            (
                self.image_width.max(self.image_height) <= MAX_SIDE,
                "image_width",
                "and image_height must be at most 8,192 px",
            ),
            (
                self.raw_width.max(self.raw_height) <= MAX_RAW_SIDE,
                "raw_width",
                "and raw_height must be at most 4,096 px",
            ),
            (self.features > 0, "features", above_0),
            (self.matches > 0, "matches", above_0),
            (self.blocks > 0, "blocks", above_0),
            (self.visible_blocks > 0, "visible_blocks", above_0),
            (self.visible_blocks <= self.blocks, "visible_blocks", "must be at most `blocks`"),
            (self.history_frames > 0, "history_frames", above_0),
            (self.history_frames <= MAX_HISTORY_FRAMES, "history_frames", "must be at most 65,536"),
            (self.features <= MAX_COUNT, "features", countable),
            (self.matches <= MAX_COUNT, "matches", countable),
            (self.blocks <= MAX_COUNT, "blocks", countable),
            (self.mask_words <= MAX_COUNT, "mask_words", countable),
            (self.tracks <= MAX_COUNT, "tracks", countable),
            (self.object_blocks <= MAX_COUNT, "object_blocks", countable),
            (self.crop_pixels <= MAX_COUNT, "crop_pixels", countable),
            (self.detections <= MAX_DETECTIONS, "detections", "must be at most 64"),
            (self.objects <= MAX_OBJECTS, "objects", "must be at most 16"),
            (self.keyframes <= MAX_KEYFRAMES, "keyframes", "must be at most 65,536"),
            (
                self.planning_width.max(self.planning_length) <= MAX_SIDE_CELLS,
                "planning_width",
                "and planning_length must be at most 1,024",
            ),
            (self.planning_height <= MAX_SIDE_CELLS, "planning_height", "must be at most 1,024"),
            (
                self.objects == 0 || self.object_blocks > 0,
                "object_blocks",
                "must be above 0 where there are objects",
            ),
            (
                self.is_countable(usize::MAX as u64),
                "blocks",
                "and all other bounds need more bytes than this machine has addresses",
            ),
        ];
        match rules.iter().find(|(holds, ..)| !holds) {
            Some((_, bound, rule)) => Err(CapacityProblem { bound, rule }),
            None => Ok(()),
        }
    }
}

/// One question: bytes, image, options.
struct Question<'o> {
    bytes: usize,
    width: usize,
    height: usize,
    options: &'o BudgetOptions,
    /// Blocks visible in one frame at most, were there no bound on blocks.
    visible: usize,
}

impl<'o> Question<'o> {
    fn new(
        bytes: usize,
        width: usize,
        height: usize,
        options: &'o BudgetOptions,
    ) -> Result<Self, BudgetError> {
        let fits = |width: usize, height: usize| {
            width <= MAX_SIDE && height <= MAX_SIDE && width * height <= MAX_PIXELS
        };
        let [raw_width, raw_height] = options.raw_image;
        let raw_fits = raw_width <= MAX_RAW_SIDE && raw_height <= MAX_RAW_SIDE;
        if width < MIN_WIDTH || height < MIN_HEIGHT || !fits(width, height) || !raw_fits {
            return Err(BudgetError::Image);
        }
        if options.objects.is_some_and(|objects| objects > MAX_OBJECTS) {
            return Err(BudgetError::Objects);
        }
        let voxel_size_m = options.voxel_size_m.unwrap_or(VOXEL_SIZE_M);
        if !(voxel_size_m.is_finite() && voxel_size_m > 0.0) {
            return Err(BudgetError::VoxelSize);
        }
        // Surfaces of the same extent take fewer blocks of larger voxels, by the square of their
        // side.
        // The default voxel's side compared with the one asked for.
        let finer = f64::from(VOXEL_SIZE_M) / f64::from(voxel_size_m);
        let pixels = width * height;
        let at_default = if pixels / 20 > 12_000 { pixels / 20 } else { 12_000 };
        let visible = (at_default as f64 * finer * finer) as usize;
        let visible = if visible < MIN_BLOCKS { MIN_BLOCKS } else { visible };
        // A slice cannot be longer than this.
        let bytes = if bytes > isize::MAX as usize { isize::MAX as usize } else { bytes };
        Ok(Self { bytes, width, height, options, visible })
    }

    /// Returns the bounds that follow from the image only: no block, no object.
    fn image_only(&self, colour: bool) -> Capacity {
        let pixels = self.width * self.height;
        let [raw_width, raw_height] = self.options.raw_image;
        Capacity {
            image_width: self.width,
            image_height: self.height,
            raw_width,
            raw_height,
            features: (pixels / 16).clamp(2_000, MAX_FEATURES),
            // A match begins with a feature.
            matches: (pixels / 40).clamp(1_000, MAX_FEATURES),
            blocks: 0,
            visible_blocks: 0,
            history_frames: if self.bytes >= 96 << 20 { 200 } else { SHORT_HISTORY_FRAMES },
            detections: MAX_DETECTIONS,
            mask_words: pixels / 8 + 1,
            tracks: 64,
            objects: 0,
            object_blocks: 0,
            crop_pixels: 0,
            keyframes: 0,
            planning_width: 0,
            planning_length: 0,
            planning_height: 0,
            planning_distance_3d: false,
            colour,
        }
    }

    /// The least capacity that works with the options.
    fn least(&self) -> Capacity {
        let base = self.image_only(self.options.colour.unwrap_or(false));
        let objects = self.options.objects.unwrap_or(0);
        let (object_blocks, crop_pixels) =
            if objects > 0 { (150, self.width * self.height / 2) } else { (0, 0) };
        // The short window at every budget: the least that is named must be enough when it is asked
        // for.
        let history_frames = SHORT_HISTORY_FRAMES;
        self.with_blocks(
            &Capacity { objects, object_blocks, crop_pixels, history_frames, ..base },
            MIN_BLOCKS,
        )
    }

    /// The image, objects in their share, and as many blocks as fit; no block where nothing is left
    /// for them.
    fn solved(&self, colour: bool) -> Capacity {
        let base = self.image_only(colour);
        let rest = self.bytes.saturating_sub(base.bytes());
        let with_objects = |(objects, object_blocks): (usize, usize), crop_pixels: usize| {
            let crop_pixels = if objects > 0 { crop_pixels } else { 0 };
            Capacity { objects, object_blocks, crop_pixels, ..base }
        };
        // Objects are paid from what the image leaves over.
        let cost = |capacity: &Capacity| capacity.bytes() - base.bytes();
        let pixels = self.width * self.height;
        // Crops as large as 1.6 images, or as half an image where that costs more than its share.
        let crops = Capacity { crop_pixels: pixels * 8 / 5, ..base };
        let crop_pixels =
            if cost(&crops) <= rest / CROPS_SHARE { crops.crop_pixels } else { pixels / 2 };
        let share = if self.options.objects.is_some() {
            rest / ASKED_OBJECTS_SHARE
        } else {
            rest / OBJECTS_SHARE
        };
        // From the most objects to none; a number that was asked for stays, with fewer blocks each.
        let steps = OBJECTS.into_iter().map(|(objects, blocks)| match self.options.objects {
            Some(0) => (0, 0),
            Some(asked) => (asked, blocks.max(150)),
            None => (objects, blocks),
        });
        let fits = |step: &(usize, usize)| cost(&with_objects(*step, crop_pixels)) <= share;
        let step =
            // Where no step fits its share, the last and smallest one is taken.
            steps.clone().find(fits).or_else(|| steps.clone().next_back()).unwrap_or_default();
        self.filled(with_objects(step, crop_pixels))
    }

    /// With as many blocks as fit, and as can be counted.
    fn filled(&self, capacity: Capacity) -> Capacity {
        let fits = |blocks: usize| self.with_blocks(&capacity, blocks).bytes() <= self.bytes;
        // Halved until the two meet: bytes grow with blocks.
        let (mut fitting, mut too_many) = (0, self.too_many_blocks(&capacity));
        while fitting + 1 < too_many {
            let middle = fitting + (too_many - fitting) / 2;
            if fits(middle) {
                fitting = middle;
            } else {
                too_many = middle;
            }
        }
        self.with_blocks(&capacity, fitting)
    }

    /// So many blocks that they cannot fit or be counted; few enough that their bytes can be, in 32
    /// bits as well.
    fn too_many_blocks(&self, capacity: &Capacity) -> usize {
        // A block has at least 512 voxels of 3 bytes.
        let block_bytes = 512 * if capacity.colour { 6 } else { 3 };
        let most = self.bytes.saturating_sub(self.with_blocks(capacity, 0).bytes()) / block_bytes;
        if most < MAX_COUNT { most + 1 } else { MAX_COUNT + 1 }
    }

    /// Returns the capacity with so many blocks; at most four in five of them are visible at once.
    fn with_blocks(&self, capacity: &Capacity, blocks: usize) -> Capacity {
        let most = blocks - blocks / 5;
        Capacity {
            blocks,
            visible_blocks: if most < self.visible { most } else { self.visible },
            ..*capacity
        }
    }
}

#[cfg(test)]
mod tests;
