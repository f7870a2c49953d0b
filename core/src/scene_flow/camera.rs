//! State of one camera: two frames, the previous and the current one, swapped by index.

use super::{
    SceneFlowConfig,
    exposure::{Gain, brightness, multiply},
    features::{Features, table},
    filter::{COLUMN_SUMS, Responses, filter},
    strongest::{CandidateSlot, Strongest, lists},
    suppression::{Field, SCRATCH_ROWS, suppress},
};
use crate::{
    image::{InvalidPixels, View},
    memory::{Capacity, Carver, region_bytes},
    parallel::{Vectors, Work},
    sad::Descriptor,
    state::Visitor,
};

/// Counts of one image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FeatureCount {
    /// Features of the dense pass kept.
    pub dense: u32,
    /// Features of the sparse pass kept.
    pub sparse: u32,
    /// Features wanted beyond `capacity.features` (dense) or a quarter of it (sparse), and dropped.
    pub dropped: u32,
}

/// One image and its features.
#[derive(Debug)]
pub(super) struct Frame<'s> {
    pub pixels: &'s mut [u8],
    pub dense: Features<'s>,
    pub sparse: Features<'s>,
}

/// An image that comes in.
pub(super) struct Incoming<'a> {
    pub image: View<'a, u8>,
    /// True if it can be matched with the one before.
    pub follows: bool,
}

/// One camera.
#[derive(Debug)]
pub(super) struct Camera<'s> {
    frames: [Frame<'s>; 2],
    /// Index of the current one of the two.
    current: bool,
    gradient: &'s mut [u16],
    blob: &'s mut [i16],
    corner: &'s mut [i16],
    sums: &'s mut [i16],
    candidates: &'s mut [CandidateSlot],
    lists: &'s mut [u32],
}

/// Names of one camera's regions.
pub(super) struct Names {
    pub pixels: &'static str,
    pub position: &'static str,
    pub descriptor: &'static str,
    pub cell: &'static str,
    pub gradient: &'static str,
    pub blob: &'static str,
    pub corner: &'static str,
    pub sums: &'static str,
    pub candidate: &'static str,
    pub list: &'static str,
}

/// Rows that the filters work on, and then suppression.
const WORKING_ROWS: usize = if COLUMN_SUMS > SCRATCH_ROWS { COLUMN_SUMS } else { SCRATCH_ROWS };

/// The most features of an image, of the dense pass and of the sparse one: its peaks are at most a
/// sixth as dense.
pub(crate) const fn most_features(capacity: &Capacity) -> [usize; 2] {
    [capacity.features, capacity.features / 4]
}

/// Cuts the first `count` items off `rest`, which has as many by construction.
fn part<'s, T>(rest: &mut &'s mut [T], count: usize) -> &'s mut [T] {
    rest.split_off_mut(..count).unwrap_or_default()
}

impl<'s> Camera<'s> {
    pub(super) const fn bytes(capacity: &Capacity) -> usize {
        let pixels = capacity.pixels();
        let [dense, sparse] = most_features(capacity);
        let features = 2 * (dense + sparse);
        region_bytes::<u8>(2 * pixels)
            + region_bytes::<[u16; 2]>(features)
            + region_bytes::<[Descriptor; 2]>(features)
            + region_bytes::<u32>(4 * table(capacity))
            + region_bytes::<u16>(pixels)
            + 2 * region_bytes::<i16>(pixels)
            + region_bytes::<i16>(WORKING_ROWS * capacity.image_width)
            + region_bytes::<CandidateSlot>(capacity.features)
            + region_bytes::<u32>(lists(capacity))
    }

    pub(super) fn new_in(capacity: &Capacity, carver: &mut Carver<'s>, names: &Names) -> Self {
        let pixels = capacity.pixels();
        let sets = most_features(capacity);
        // Two frames, the current and the previous one, with a dense and a sparse set each.
        let features = 2 * (sets[0] + sets[1]);
        let mut image = carver.alloc(names.pixels, 2 * pixels);
        let mut position = carver.alloc(names.position, features);
        let mut descriptor = carver.alloc(names.descriptor, features);
        let mut cell = carver.alloc(names.cell, 4 * table(capacity));
        let mut frame = || {
            let [dense, sparse] = sets.map(|count| {
                Features::new(
                    part(&mut position, count),
                    part(&mut descriptor, count),
                    part(&mut cell, table(capacity)),
                )
            });
            Frame { pixels: part(&mut image, pixels), dense, sparse }
        };
        Self {
            frames: [frame(), frame()],
            current: false,
            gradient: carver.alloc(names.gradient, pixels),
            blob: carver.alloc(names.blob, pixels),
            corner: carver.alloc(names.corner, pixels),
            sums: carver.alloc(names.sums, WORKING_ROWS * capacity.image_width),
            candidates: carver.alloc(names.candidate, capacity.features),
            lists: carver.alloc(names.list, lists(capacity)),
        }
    }

    /// The previous and the current frame.
    pub(super) fn frames(&self) -> (&Frame<'s>, &Frame<'s>) {
        let [a, b] = &self.frames;
        if self.current { (a, b) } else { (b, a) }
    }

    /// Makes the current frame the previous one and takes in an image no larger than the capacity.
    /// If an image of that size came before, both are brought to one brightness.
    pub(super) fn take(
        &mut self,
        Incoming { image, follows }: Incoming<'_>,
        invalid: Option<&InvalidPixels<'_>>,
        config: &SceneFlowConfig,
        vectors: Vectors,
    ) -> FeatureCount {
        // Two frames in turns: what was current becomes the previous one without a copy.
        self.current = !self.current;
        let [a, b] = &mut self.frames;
        let frame = if self.current { b } else { a };
        let (width, height) = (image.width(), image.height());
        for (copied, row) in frame.pixels.chunks_exact_mut(width.max(1)).zip(image.rows()) {
            copied.iter_mut().zip(row).for_each(|(to, from)| *to = *from);
        }
        let gain = if follows { self.multiply_darker([width, height]) } else { Gain::None };
        if matches!(gain, Gain::Previous(_)) {
            // What is found in the image before changed with it.
            self.current = !self.current;
            self.describe([width, height], invalid, config, vectors);
            self.current = !self.current;
        }
        self.describe([width, height], invalid, config, vectors)
    }

    /// Brings the darker of both images to the brightness of the other.
    fn multiply_darker(&mut self, [width, height]: [usize; 2]) -> Gain {
        let pixels = width * height;
        let [a, b] = &mut self.frames;
        let (previous, current) = if self.current { (a, b) } else { (b, a) };
        let [before, now] = [&*previous, &*current]
            .map(|frame| View::new(frame.pixels, width, height).map_or(0, brightness));
        let gain = Gain::from_brightness(before, now, pixels);
        let (frame, gain_q8) = match gain {
            Gain::None => return gain,
            Gain::Previous(gain_q8) => (previous, gain_q8),
            Gain::Current(gain_q8) => (current, gain_q8),
        };
        multiply(frame.pixels.get_mut(..pixels).unwrap_or_default(), gain_q8);
        gain
    }

    /// Returns true if the current image has more than twice the features of the previous one.
    pub(super) fn is_much_richer(&self) -> bool {
        let (previous, current) = self.frames();
        current.dense.len() > 2 * previous.dense.len()
    }

    /// Makes the previous frame the current one again: the next image overwrites the last one.
    pub(super) fn forget_current(&mut self) {
        self.current = !self.current;
    }

    /// Returns true if the current image equals the previous one, bit for bit.
    pub(super) fn is_repeated(&self, [width, height]: [usize; 2]) -> bool {
        let ((previous, current), pixels) = (self.frames(), width * height);
        previous.pixels.get(..pixels) == current.pixels.get(..pixels)
    }

    /// Visits the pixels of the current frame; [`Camera::describe`] finds the rest. The frame
    /// before is not looked at again.
    pub(super) fn visit(&mut self, [width, height]: [usize; 2], visitor: &mut impl Visitor) {
        // All fields by name: a new one must be placed here to compile.
        let Self {
            frames: [a, b],
            current,
            gradient: _,
            blob: _,
            corner: _,
            sums: _,
            candidates: _,
            lists: _,
        } = self;
        let Frame { pixels, dense: _, sparse: _ } = if *current { b } else { a };
        pixels.chunks_mut(width.max(1)).take(height).for_each(|row| visitor.bytes(row));
    }

    /// Finds the features of the current frame, none on pixels that are not to be used.
    pub(super) fn describe(
        &mut self,
        size: [usize; 2],
        invalid: Option<&InvalidPixels<'_>>,
        config: &SceneFlowConfig,
        vectors: Vectors,
    ) -> FeatureCount {
        vectors.run(FindFeatures { camera: self, size, invalid, config })
    }
}

/// Finds the features of a camera's current frame.
struct FindFeatures<'a, 's> {
    camera: &'a mut Camera<'s>,
    size: [usize; 2],
    invalid: Option<&'a InvalidPixels<'a>>,
    config: &'a SceneFlowConfig,
}

impl Work for FindFeatures<'_, '_> {
    type Output = FeatureCount;

    #[inline(always)]
    fn run(self) -> FeatureCount {
        let Self { camera, size: [width, height], invalid, config } = self;
        // The other frame is the previous one, and stays.
        let [a, b] = &mut camera.frames;
        let frame = if camera.current { b } else { a };
        let pixels = width * height;
        // A size beyond the capacity leaves the frame without features.
        let (Some(gradient), Some(blob), Some(corner)) = (
            camera.gradient.get_mut(..pixels),
            camera.blob.get_mut(..pixels),
            camera.corner.get_mut(..pixels),
        ) else {
            frame.dense.clear();
            frame.sparse.clear();
            return FeatureCount::default();
        };
        let Some(image) = View::new(frame.pixels, width, height) else {
            return FeatureCount::default();
        };
        // Invalid pixels respond with nothing, so that no feature is found on a border.
        filter(image, Responses { gradient, blob, corner }, camera.sums);
        if let Some(invalid) = invalid {
            silence(invalid, width, blob);
            silence(invalid, width, corner);
        }
        // The strongest of each part of the image are kept, bounded by the capacity.
        let wanted = config.features_max as usize;
        let mut strongest =
            Strongest::new(camera.candidates, camera.lists, [width, height], wanted);
        // Responses are signed 16-bit numbers; a larger threshold could never be reached.
        let response_min = config.response_min.min(i16::MAX as u16) as i16;
        let (blob, corner) = (Field { response: blob, width }, Field { response: corner, width });
        suppress(blob, corner, response_min, camera.sums, |candidate| strongest.add(candidate));
        // Sparse features are the dense ones that are also peaks of a wide neighbourhood.
        let (mut dropped, kept) = strongest.finish();
        let candidates = kept.iter().map(|held| held.candidate);
        dropped += frame.dense.fill(candidates.clone(), gradient, width, height);
        dropped += frame.sparse.fill(
            candidates.filter(|candidate| candidate.sparse == 1),
            gradient,
            width,
            height,
        );
        FeatureCount {
            dense: frame.dense.len() as u32,
            sparse: frame.sparse.len() as u32,
            dropped: dropped as u32,
        }
    }
}

/// Takes away the filter's response at pixels that are not to be used.
fn silence(invalid: &InvalidPixels<'_>, width: usize, response: &mut [i16]) {
    for (v, row) in response.chunks_exact_mut(width.max(1)).enumerate() {
        for u in invalid.in_row(v) {
            if let Some(response) = row.get_mut(u) {
                *response = 0;
            }
        }
    }
}
