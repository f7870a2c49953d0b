//! The loop of the paper (Section III), one line per stage.

mod accumulated;
mod addresses;
mod budget;
mod clock;
mod config;
mod digests;
mod error;
mod frame;
mod ignored;
mod localization;
mod loops;
mod matched;
mod places;
mod plan;
mod raycast;
mod relocalization;
mod report;
mod scale;
mod search;
mod segmentation;
mod set;
mod settings;
pub mod snapshot;
mod static_map;
mod step;
#[cfg(test)]
mod tests;
mod two_slabs;
mod within;
mod work;

pub use accumulated::PosePrecision;
pub use budget::{BudgetError, BudgetOptions, CapacityProblem, MAX_SIDE};
pub use config::Config;
pub use digests::{Digested, ObjectDigest, ObjectDigests, StageDigests};
pub use error::{MIN_HEIGHT, MIN_WIDTH, NewError, StepError};
pub use frame::StereoFrame;
pub use loops::FixError;
pub use places::{LoadPlacesError, SAVED_PLACES_HEADER_BYTES, saved_keyframes};
pub use report::{BlockCount, PoseOrigin, Report, Severity};
pub use scale::{SCALED_SETTINGS, Scale};
pub use set::SetError;
pub use settings::{MapperConfig, MotionSource};
pub use snapshot::RestoreError;
pub use work::{DeferredWork, WorkUnits};

use clock::Clock;
use ignored::IgnoredPixels;
use localization::Localization;
use static_map::StaticMap;

use crate::{
    Capacity, Footprint,
    attached::AttachedCells,
    geometry::{StereoRig, Transform},
    image::View,
    inertial::InertialPrior,
    memory::{Carver, SlabError, Slabs, TwoSlabs},
    objects::{NoSink, Object, ObjectSink, ObjectSummary, Objects},
    planning::Planning,
    rectify::{AlignedImage, RawCamera, Rectification, RectifiedImages, Rectifier},
    scene_flow::FlowMatcher,
    segmentation::MotionSegmenter,
    stereo::StereoMatcher,
    tracking::{InstanceAt, TrackReport, Tracker},
    view::Triangle,
    volume::{BlockStore, EvictionReport, PruneReport, Volume, is_within_map},
};

/// A stereo mapper in a slab.
///
/// ```
/// use dynvox_core::{
///     Capacity, Config, Mapper, Serial, StereoFrame, geometry::StereoRig, image::View,
///     memory::SLAB_ALIGN,
/// };
///
/// let rig = StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
/// let mut mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut slab)?;
/// let image = [90; 320 * 96];
/// let view = View::new(&image, 320, 96).unwrap();
/// let report = mapper.step(&StereoFrame::pair(view, view), &Serial)?;
/// assert_eq!((report.frame, mapper.triangles(&mut |_| ())), (0, 0)); // a grey image shows nothing
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Mapper<'s> {
    config: Config,
    capacity: Capacity,
    rectifier: Rectifier<'s>,
    rectified: RectifiedImages<'s>,
    aligned: AlignedImage<'s>,
    ignored: IgnoredPixels<'s>,
    attached: AttachedCells<'s>,
    stereo: StereoMatcher<'s>,
    scene_flow: FlowMatcher<'s>,
    localization: Localization<'s>,
    tracker: Tracker<'s>,
    segmenter: MotionSegmenter<'s>,
    objects: Objects<'s>,
    static_map: StaticMap<'s>,
    planning: Planning<'s>,
    /// Width and height of the frames, known from the first one on.
    size: Option<[usize; 2]>,
    frame: u32,
    clock: Clock,
}

impl Capacity {
    /// Bytes of slab a mapper of this capacity needs, for a capacity that [`Capacity::validate`]
    /// takes: beyond, they may be more than can be counted.
    ///
    /// ```
    /// use dynvox_core::{Capacity, Slab};
    ///
    /// const CAPACITY: Capacity = Capacity { image_width: 128, image_height: 64, blocks: 500, ..Capacity::TINY };
    /// static SLAB: Slab<{ CAPACITY.bytes() }> = Slab::ZERO; // a constant: known when the program is compiled
    /// assert_eq!(SLAB.len(), CAPACITY.bytes());
    /// ```
    pub const fn bytes(&self) -> usize {
        StereoMatcher::bytes(self)
            + FlowMatcher::bytes(self)
            + Localization::bytes(self)
            + Tracker::bytes(self)
            + MotionSegmenter::bytes(self)
            + Objects::bytes(self)
            + StaticMap::bytes(self)
            + Planning::bytes(self)
            + Rectifier::bytes(self)
            + RectifiedImages::bytes(self)
            + AlignedImage::bytes(self)
            + IgnoredPixels::bytes(self)
            + AttachedCells::bytes(self)
    }

    /// Every region a mapper of this capacity cuts out of its slab.
    ///
    /// ```
    /// use dynvox_core::Capacity;
    ///
    /// let footprint = Capacity::SMALL.footprint();
    /// let largest = footprint.regions().iter().max_by_key(|region| region.bytes).unwrap();
    /// assert!(largest.name.starts_with("volume.") && footprint.bytes() == Capacity::SMALL.bytes());
    /// ```
    pub fn footprint(&self) -> Footprint {
        let mut carver = Carver::without_slab();
        // Regions depend on the capacity alone: any rig will do.
        let rig = StereoRig { focal_px: 1.0, center_u_px: 0.0, center_v_px: 0.0, baseline_m: 1.0 };
        let config = Config::for_rig(rig);
        Mapper::new_in(self, &config, &mut carver).alloc_inertial(&config, &mut carver);
        carver.into_footprint()
    }
}

const MIB: usize = 1 << 20;
const _: () = assert!(Capacity::TINY.bytes() < 8 * MIB);
const _: () = assert!(Capacity::SMALL.bytes() < 64 * MIB);
const _: () = assert!(Capacity::ONBOARD.bytes() < 256 * MIB);
// A 32-bit machine cannot even name 2 GiB.
#[cfg(target_pointer_width = "64")]
const _: () = assert!(Capacity::DESKTOP.bytes() < 2048 * MIB);

impl<'s> Mapper<'s> {
    /// Makes a mapper in `slab`, which must hold at least `capacity.bytes()` from its first byte at
    /// a multiple of [`SLAB_ALIGN`](crate::memory::SLAB_ALIGN) on: `capacity.bytes() + SLAB_ALIGN`
    /// bytes are enough anywhere.
    ///
    /// # Errors
    /// The slab is too small, or the configuration is not usable.
    // Never inlined: what it needs of the stack must not stay in its caller's frame.
    #[inline(never)]
    pub fn new(capacity: &Capacity, config: &Config, slab: &'s mut [u8]) -> Result<Self, NewError> {
        Self::check(capacity, config, slab)?;
        // By reference: a carver lists all regions, and would lie on the stack twice.
        match &mut Carver::new(slab, capacity.bytes()) {
            Ok(carver) => Self::prepared_in(capacity, config, carver),
            Err(error) => Err(NewError::Slab(*error)),
        }
    }

    /// Makes a mapper where its caller wants it: one place is written and returned, so that none is
    /// moved over the stack.
    #[inline(never)]
    pub(super) fn prepared_in(
        capacity: &Capacity,
        config: &Config,
        carver: &mut Carver<'s>,
    ) -> Result<Self, NewError> {
        let mut made = Ok(Self::new_in(capacity, config, carver));
        let prepared = match &mut made {
            Ok(mapper) => mapper.prepare(config, carver),
            Err(_) => Ok(()),
        };
        if let Err(error) = prepared {
            made = Err(error);
        }
        made
    }

    /// Makes a mapper like [`Mapper::new`] or [`Mapper::new_in_two`], in `slot`: what it holds is
    /// dropped first, and it is empty after an error. For callers that keep a mapper in memory of
    /// their own and have little stack.
    ///
    /// # Errors
    /// Returns the errors of [`Mapper::new`].
    #[inline(never)]
    pub fn new_into(
        slot: &mut Option<Self>,
        capacity: &Capacity,
        config: &Config,
        slabs: Slabs<'s>,
    ) -> Result<(), NewError> {
        *slot = None;
        // Before anything is taken from the slabs.
        Self::check_slabs(capacity, config, &slabs)?;
        // By reference, as above.
        let mut carver = match slabs {
            Slabs::One(slab) => Carver::new(slab, capacity.bytes()),
            Slabs::Two(slabs) => {
                Carver::new_in_two(slabs, [capacity.hot_bytes(), capacity.cold_bytes()])
            }
        };
        let carver = carver.as_mut().map_err(|error| NewError::Slab(*error))?;
        let mapper = slot.insert(Self::new_in(capacity, config, carver));
        let prepared = mapper.prepare(config, carver);
        // `slot` must not hold a mapper that cannot rectify.
        if prepared.is_err() {
            *slot = None;
        }
        prepared
    }

    /// Fills what a new mapper needs, once all its regions were cut.
    fn prepare(&mut self, config: &Config, carver: &mut Carver<'s>) -> Result<(), NewError> {
        self.alloc_inertial(config, carver);
        carver.check()?;
        let rectification = config.rectification.as_ref();
        rectification
            .map_or(Ok(()), |raw| self.rectifier.prepare(raw, &config.rig))
            .map_err(NewError::Rectification)
    }

    /// Takes the region of the inertial unit, after all others: made with the mapper, its value
    /// would lie on the stack beside it.
    fn alloc_inertial(&mut self, config: &Config, carver: &mut Carver<'s>) {
        self.localization.inertial = InertialPrior::new_in(config.inertial.as_ref(), carver);
    }

    /// Checks all that [`Mapper::new`] needs, without a write to the slab: for callers that keep
    /// something in it until a mapper is made there.
    ///
    /// # Errors
    /// Returns the errors of [`Mapper::new`].
    ///
    /// ```
    /// use dynvox_core::{Capacity, Config, Mapper, geometry::StereoRig, memory::SLAB_ALIGN};
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let (capacity, config) = (Capacity::TINY, Config::for_rig(rig));
    /// assert!(Mapper::check(&capacity, &config, &vec![7; capacity.bytes() + SLAB_ALIGN]).is_ok());
    /// assert!(Mapper::check(&capacity, &config, &[7; 100]).is_err());
    /// ```
    #[inline(never)]
    pub fn check(capacity: &Capacity, config: &Config, slab: &[u8]) -> Result<(), NewError> {
        Self::check_bounds(capacity, config)?;
        Ok(Carver::check_fit(slab, capacity.bytes()).map(|_| ())?)
    }

    /// Checks like [`Mapper::check`] what [`Mapper::new_into`] needs.
    ///
    /// # Errors
    /// Returns the errors of [`Mapper::new`]; of two slabs that are too small it names what the hot
    /// one lacks.
    #[inline(never)]
    pub fn check_slabs(
        capacity: &Capacity,
        config: &Config,
        slabs: &Slabs<'_>,
    ) -> Result<(), NewError> {
        match slabs {
            Slabs::One(slab) => Self::check(capacity, config, slab),
            Slabs::Two(TwoSlabs { hot, cold }) => {
                Self::check_bounds(capacity, config)?;
                Carver::check_fit(hot, capacity.hot_bytes())?;
                Ok(Carver::check_fit(cold, capacity.cold_bytes()).map(|_| ())?)
            }
        }
    }

    /// Checks configuration and capacity by themselves.
    fn check_bounds(capacity: &Capacity, config: &Config) -> Result<(), NewError> {
        if let Some(problem) = config.validate().first() {
            return Err(NewError::Config(*problem));
        }
        // Checked before bytes are summed up: the sum could wrap on a small machine.
        if !capacity.is_countable(usize::MAX as u64) {
            return Err(NewError::Slab(SlabError::TooSmall { missing: usize::MAX }));
        }
        let rectification = config.rectification.as_ref();
        rectification.map_or(Ok(()), |raw| raw.check_fit(capacity)).map_err(NewError::Rectification)
    }

    fn new_in(capacity: &Capacity, config: &Config, carver: &mut Carver<'s>) -> Self {
        Self {
            config: *config,
            capacity: *capacity,
            // Regions are taken in this order; `Capacity::bytes` adds up the same ones.
            stereo: StereoMatcher::new_in(capacity, carver),
            scene_flow: FlowMatcher::new_in(capacity, carver),
            localization: Localization::new_in(capacity, config, carver),
            tracker: Tracker::new_in(capacity, &config.tracking, carver),
            segmenter: carver
                .group("tracking.segmentation", |carver| MotionSegmenter::new_in(capacity, carver)),
            objects: Objects::new_in(capacity, &config.objects, carver),
            static_map: StaticMap::new_in(capacity, config, carver),
            planning: Planning::new_in(
                capacity,
                &config.planning,
                config.volume.voxel_size_m,
                carver,
            ),
            rectifier: Rectifier::new_in(capacity, carver),
            rectified: RectifiedImages::new_in(capacity, carver),
            aligned: AlignedImage::new_in(capacity, carver),
            ignored: IgnoredPixels::new_in(capacity, carver),
            attached: AttachedCells::new_in(capacity, carver),
            size: None,
            frame: 0,
            clock: Clock::new(config.tracking.frame_interval_s),
        }
    }

    /// Checks a frame against the capacity and the frames before, and keeps the size of the
    /// rectified images.
    fn validate(&mut self, frame: &StereoFrame<'_>) -> Result<(), StepError> {
        let given = [frame.left.width(), frame.left.height()];
        // Sizes of the left image, of the right one, and of the rectified ones.
        let [left, right, size] = match self.rectifier.rectification() {
            None => [given; 3],
            Some(raw) => {
                let of = |camera: &RawCamera| [camera.width as usize, camera.height as usize];
                [of(&raw.left.raw), of(&raw.right.raw), [raw.width as usize, raw.height as usize]]
            }
        };
        if given != left {
            return Err(StepError::RawSizeDiffers { width: left[0], height: left[1] });
        }
        frame.check_layout(self.rectifier.rectification().is_some())?;
        let same = |width: usize, height: usize| size == [width, height];
        // Colour and left image come from one camera; the images of classes, disparities and
        // ignored pixels are rectified.
        let right = right == [frame.right.width(), frame.right.height()];
        let colour = frame.colour.is_none_or(|image| left == [image.width(), image.height()]);
        let class = frame.class.is_none_or(|image| same(image.width(), image.height()));
        let disparity = frame.disparity_q8.is_none_or(|image| same(image.width(), image.height()));
        let ignored = frame.ignored.is_none_or(|image| same(image.width(), image.height()));
        if !(right && colour && class && disparity && ignored) {
            return Err(StepError::SizesDiffer);
        }
        // Buffers have the capacity's size; the matchers need a margin around each pixel.
        if size[0] > self.capacity.image_width || size[1] > self.capacity.image_height {
            return Err(StepError::TooLarge {
                width: self.capacity.image_width,
                height: self.capacity.image_height,
            });
        }
        if size[0] < MIN_WIDTH || size[1] < MIN_HEIGHT {
            return Err(StepError::TooSmall { width: MIN_WIDTH, height: MIN_HEIGHT });
        }
        if !frame.t_world_camera.is_none_or(|pose| pose.is_finite()) {
            return Err(StepError::PoseNotFinite);
        }
        if !frame.t_world_camera.is_none_or(|pose| pose.is_rotation()) {
            return Err(StepError::PoseNotRotation);
        }
        // A camera out there would see nothing that could be fused, in every frame.
        let voxel_size_m = self.config.volume.voxel_size_m;
        if !frame.t_world_camera.is_none_or(|pose| is_within_map(&pose, voxel_size_m)) {
            return Err(StepError::PoseBeyondMap);
        }
        // Motions are divided by time: a clock that stands or runs back is refused.
        if !self.clock.may_follow(frame.time_ns) {
            return Err(StepError::TimeNotLater);
        }
        // History, masks and maps of rectification belong to one size.
        if self.size.is_some_and(|known| known != size) {
            return Err(StepError::SizeChanged);
        }
        self.size = Some(size);
        Ok(())
    }

    /// Returns true for a size that rectified images may have, within the capacity.
    fn takes_size(&self, [width, height]: [usize; 2]) -> bool {
        let is_theirs = |raw: &Rectification| {
            [raw.width, raw.height].map(|side| side as usize) == [width, height]
        };
        width >= MIN_WIDTH
            && height >= MIN_HEIGHT
            && self.rectifier.rectification().is_none_or(is_theirs)
    }

    /// Ends a run: prunes what is still in the window. Objects are lost; see
    /// [`Mapper::finish_with`].
    pub fn finish(&mut self) -> PruneReport {
        self.finish_with(&mut NoSink)
    }

    /// Finishes like [`Mapper::finish`], with a sink for the remaining objects.
    pub fn finish_with<O: ObjectSink>(&mut self, objects: &mut O) -> PruneReport {
        self.objects.finish(objects);
        self.static_map.volume.finish()
    }

    /// Pose of the left camera in the last frame: camera to world; the identity before the first.
    pub fn t_world_camera(&self) -> &Transform {
        self.localization.camera.t_world_camera()
    }

    /// The settings it was made with.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Tracks, as they stand after the last frame, by age.
    pub fn tracks(&self) -> impl Iterator<Item = TrackReport> + '_ {
        self.objects.tracks(&self.tracker)
    }

    /// The instance a pixel of the last frame shows; `None` for the static map.
    pub fn instance_at(&self, u: i32, v: i32) -> Option<InstanceAt> {
        self.tracker.instance_at(u, v)
    }

    /// The objects reconstructed now, each with its own map.
    pub fn objects(&self) -> impl Iterator<Item = (&ObjectSummary, &Object<'s>)> {
        self.objects.objects()
    }

    /// Lets every block of the static map leave into `store`, so that the store holds the whole
    /// map.
    pub fn stream_out<S: BlockStore>(&mut self, store: &mut S) -> EvictionReport {
        self.static_map.volume.stream_out(store)
    }

    /// The static map's triangles in the camera's segment, one after the other, in its world
    /// coordinates. How many there were.
    pub fn triangles(&self, sink: &mut impl FnMut(Triangle)) -> u64 {
        self.static_map.volume.triangles(&self.config.mesh, sink)
    }

    /// The static map.
    pub fn static_map(&self) -> &Volume<'s> {
        &self.static_map.volume
    }

    /// Left and right grey image of the last frame as they were rectified; `None` where pairs come
    /// rectified.
    pub fn rectified_pair(&self) -> Option<[View<'_, u8>; 2]> {
        self.rectifier.grey(&self.rectified)
    }

    /// Disparity of the last frame, 1/256 px, 0 none. An odd value was filled in between measured
    /// ones if the core matched the pair ([`crate::image::DisparityQ8::is_filled`]); the number can
    /// be used as it is, since the mark is 1/256 px.
    pub fn disparity_q8(&self) -> View<'_, u16> {
        self.stereo.disparity_q8()
    }

    /// Confidences of the last frame's disparities, as they were matched: 0 without a disparity,
    /// else one more than the number of measured pixels in the 16 x 16 about each, at most 255.
    /// `None` unless `stereo.min_confidence` is above 0 and the core matched the pair.
    pub fn confidence(&self) -> Option<View<'_, u8>> {
        self.stereo.confidence()
    }

    /// Every region of the slab, with its use now and at most.
    pub fn footprint(&self) -> Footprint {
        let mut footprint = self.capacity.footprint();
        self.static_map.volume.note_use(&mut footprint);
        self.tracker.note_use(&mut footprint);
        self.objects.note_use(&mut footprint);
        self.static_map.raycaster.note_use(&mut footprint);
        footprint
    }
}
