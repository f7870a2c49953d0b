//! A mapper's state as bytes: all that a resumed run needs to give the results of an uninterrupted
//! one.
//!
//! Each struct describes its state once (the module `state`); the description that is hashed into
//! each step's digests is the one that is written here and read back. What can be rebuilt is not
//! stored: features of the last pair, the block index. What only one frame needs is not stored
//! either, so
//! [`Mapper::disparity_q8`] has nothing to show before the next frame.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | `DVXSTATE` |
//! | 4 | [`VERSION`] |
//! | 8, 8 | fingerprint of the capacity, of the configuration: a digest of their `Debug` text |
//! | 4 | frames taken |
//! | 4, 8, 4 | whether the last frame had a time, that time, ns, and the time since the frame before, s |
//! | 4, 4 | ignored pixels, attached ones, and their bits if there are any |
//! | 4, 4, 4 | columns, rows and number of attached cells, and the score of each cell |
//! | 4, 4 | image width and height, px (0 before the first frame) |
//! | | pair, camera, anchor, self-calibration, tracks, masks, objects, static map, planner's map |
//! | 8 | checksum of everything before: a flipped bit anywhere is found |
//!
//! Memory: none but the mapper's. Bytes: about those of the blocks in use, and of what waits to be
//! pruned.

use super::{Mapper, NewError};
use crate::{
    Capacity, Config,
    digest::Digest,
    invariants::Invariants,
    memory::{Carver, Slabs},
    state::{ReadError, Reader, Visitor, Writer},
};
use core::fmt::{self, Write};

/// First bytes of a snapshot.
pub const MAGIC: [u8; 8] = *b"DVXSTATE";
/// Version of the layout. Another one is refused: there is no conversion.
pub const VERSION: u32 = 13;

/// Reason that a mapper cannot be restored. There is no mapper then; the slab may be used again.
///
/// ```
/// use dynvox_core::{
///     Capacity, Config, Mapper, RestoreError, geometry::StereoRig, memory::SLAB_ALIGN,
/// };
///
/// let rig =
///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
/// let mut zeros = |bytes: &mut [u8]| {
///     bytes.fill(0);
///     Ok::<(), ()>(())
/// };
/// let restored =
///     Mapper::restore(&Capacity::TINY, &Config::for_rig(rig), &mut slab, &mut zeros);
/// assert!(matches!(restored, Err(RestoreError::Foreign)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RestoreError<E> {
    /// The slab or the configuration.
    New(NewError),
    /// The source ended too early or failed.
    Source(E),
    /// The bytes are not a snapshot.
    Foreign,
    /// The snapshot is of another version of the layout.
    Version(u32),
    /// The snapshot is of a mapper with other bounds.
    Capacity,
    /// The snapshot is of a mapper with another configuration.
    Config,
    /// The bytes are not those that were written.
    Damaged,
}

impl<E> From<ReadError<E>> for RestoreError<E> {
    fn from(error: ReadError<E>) -> Self {
        match error {
            ReadError::Source(error) => Self::Source(error),
            ReadError::Damaged => Self::Damaged,
        }
    }
}

impl<E: fmt::Display> fmt::Display for RestoreError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::New(error) => error.fmt(f),
            Self::Source(error) => write!(f, "the snapshot cannot be read: {error}"),
            Self::Foreign => f.write_str("the bytes are not a snapshot of a mapper"),
            Self::Version(found) => {
                write!(
                    f,
                    "the snapshot is of version {found}, this mapper reads version {VERSION}: go \
                     on with the release that wrote it, or map the frames anew"
                )
            }
            Self::Capacity => f.write_str("the snapshot is of a mapper with another capacity"),
            Self::Config => f.write_str("the snapshot is of a mapper with another configuration"),
            Self::Damaged => {
                f.write_str("the snapshot is damaged: its bytes are not those that were written")
            }
        }
    }
}

impl<E: fmt::Debug + fmt::Display> core::error::Error for RestoreError<E> {}

impl<'s> Mapper<'s> {
    /// Writes all that later frames depend on to `sink`, piece by piece. A mapper restored from it
    /// goes on bit for bit as this one does. Nothing changes; `&mut` only because one description
    /// of the state serves writing and reading.
    ///
    /// Blocks in a [`crate::volume::BlockStore`] and objects in an [`crate::objects::ObjectSink`]
    /// are the caller's, and not in the snapshot.
    ///
    /// # Errors
    /// The sink's first one; what it took until then is not a snapshot.
    ///
    /// ```
    /// use dynvox_core::{Capacity, Config, Mapper, geometry::StereoRig, memory::SLAB_ALIGN};
    /// use std::io::{Error, Read};
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let (capacity, config) = (Capacity::TINY, Config::for_rig(rig));
    /// let [mut first, mut second] = [0, 1].map(|_| vec![0; capacity.bytes() + SLAB_ALIGN]);
    /// let mut bytes = Vec::new();
    /// Mapper::new(&capacity, &config, &mut first)?.save(&mut |piece: &[u8]| {
    ///     bytes.extend_from_slice(piece);
    ///     Ok::<(), Error>(())
    /// })?;
    /// let mut file = &bytes[..];
    /// let restored = Mapper::restore(&capacity, &config, &mut second, &mut |piece: &mut [u8]| file.read_exact(piece))?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn save<E>(&mut self, sink: &mut impl FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
        let mut writer = Writer::new(sink);
        let (mut magic, mut version) = (MAGIC, VERSION);
        // Fingerprints of bounds and settings, before anything that depends on them.
        let mut prints = [fingerprint(&self.capacity), fingerprint(&self.config)];
        writer.bytes(&mut magic);
        writer.u32(&mut version);
        writer.u64s(&mut prints);
        self.visit(&mut writer);
        writer.finish()
    }

    /// Cuts a mapper out of `slab` as [`Mapper::new`] does, and brings it to where [`Mapper::save`]
    /// was called. `source` fills the bytes it is handed with those that come next.
    ///
    /// # Errors
    /// See [`RestoreError`]. There is no mapper then: nothing half restored can be used.
    ///
    /// ```
    /// # use dynvox_core::{
    /// #     Capacity, Config, Mapper, Serial, StereoFrame, geometry::{StereoRig, Transform},
    /// #     image::View, memory::SLAB_ALIGN,
    /// # };
    /// # let rig =
    /// #     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// # let capacity = Capacity {
    /// #     planning_width: 40, planning_length: 40, planning_height: 10, ..Capacity::TINY
    /// # };
    /// # let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    /// # let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
    /// # let (grey, wall) = ([90; 320 * 96], [10 << 8; 320 * 96]);
    /// # let view = View::new(&grey, 320, 96).unwrap();
    /// # let frame = StereoFrame {
    /// #     disparity_q8: View::new(&wall, 320, 96),
    /// #     t_world_camera: Some(Transform::IDENTITY),
    /// #     ..StereoFrame::pair(view, view)
    /// # };
    /// # for _ in 0..3 {
    /// #     mapper.step(&frame, &Serial)?;
    /// # }
    /// let mut bytes = Vec::new();
    /// mapper.save(&mut |piece: &[u8]| {
    ///     bytes.extend_from_slice(piece);
    ///     Ok::<(), std::io::Error>(())
    /// })?;
    /// let mut second_slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    /// let mut file = &bytes[..];
    /// let mut restored = Mapper::restore(
    ///     &capacity, &Config::for_rig(rig), &mut second_slab,
    ///     &mut |piece: &mut [u8]| std::io::Read::read_exact(&mut file, piece),
    /// )?;
    /// let next = [mapper.step(&frame, &Serial)?, restored.step(&frame, &Serial)?];
    /// assert_eq!(next[0].digest, next[1].digest, "the same bits from here on");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn restore<E>(
        capacity: &Capacity,
        config: &Config,
        slab: &'s mut [u8],
        source: &mut impl FnMut(&mut [u8]) -> Result<(), E>,
    ) -> Result<Self, RestoreError<E>> {
        // The steps of `Mapper::new`, not a call of it: a mapper is some kilobytes, and each move
        // takes as much stack again.
        Self::check(capacity, config, slab).map_err(RestoreError::New)?;
        let carver = Carver::new(slab, capacity.bytes());
        let mut carver = carver.map_err(|error| RestoreError::New(error.into()))?;
        let mut mapper = Self::new_in(capacity, config, &mut carver);
        mapper.prepare(config, &mut carver).map_err(RestoreError::New)?;
        mapper.read(source)?;
        Ok(mapper)
    }

    /// Restores like [`Mapper::restore`], into `slot`: what it holds is dropped first, and it is
    /// empty after an error. For callers that keep a mapper in memory of their own and have little
    /// stack.
    ///
    /// # Errors
    /// Returns the errors of [`Mapper::restore`].
    pub fn restore_into<E>(
        slot: &mut Option<Self>,
        capacity: &Capacity,
        config: &Config,
        slabs: Slabs<'s>,
        source: &mut impl FnMut(&mut [u8]) -> Result<(), E>,
    ) -> Result<(), RestoreError<E>> {
        // The capacity and configuration are the caller's; `read` refuses a snapshot of others.
        Self::new_into(slot, capacity, config, slabs).map_err(RestoreError::New)?;
        let read = slot.as_mut().map_or(Ok(()), |mapper| mapper.read(source));
        // Half of the regions may be overwritten: such a mapper must not be used.
        if read.is_err() {
            *slot = None;
        }
        read
    }

    /// Reads what [`Mapper::save`] wrote into a new mapper.
    #[inline(never)]
    fn read<E>(
        &mut self,
        source: &mut impl FnMut(&mut [u8]) -> Result<(), E>,
    ) -> Result<(), RestoreError<E>> {
        let mut reader = Reader::new(source);
        let (mut magic, mut version, mut prints) = ([0; 8], 0, [0; 2]);
        reader.bytes(&mut magic);
        reader.check()?;
        // Checked one by one, so that each error says what is different.
        if magic != MAGIC {
            return Err(RestoreError::Foreign);
        }
        reader.u32(&mut version);
        reader.check()?;
        if version != VERSION {
            return Err(RestoreError::Version(version));
        }
        reader.u64s(&mut prints);
        reader.check()?;
        if prints[0] != fingerprint(&self.capacity) {
            return Err(RestoreError::Capacity);
        }
        if prints[1] != fingerprint(&self.config) {
            return Err(RestoreError::Config);
        }
        // One description reads, writes and hashes the state.
        self.visit(&mut reader);
        reader.finish()?;
        // Indices and lists follow from what was read; contradictions end here.
        if self.rebuild() { Ok(()) } else { Err(RestoreError::Damaged) }
    }

    /// Visits what lives from frame to frame; [`Mapper::rebuild`] must follow a reading.
    pub(super) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            scene_flow,
            localization,
            tracker,
            segmenter,
            objects,
            static_map,
            planning,
            size,
            frame,
            clock,
            ignored,
            attached,
            // Told by the caller; a fingerprint stands for them.
            config,
            capacity,
            // Belong to one frame.
            stereo: _,
            rectifier: _,
            rectified: _,
            aligned: _,
        } = self;
        // An absent size is written as zero.
        let [mut width, mut height] = size.unwrap_or_default();
        visitor.u32(frame);
        clock.visit(visitor);
        visitor.count(&mut width, capacity.image_width);
        visitor.count(&mut height, capacity.image_height);
        *size = (width + height > 0).then_some([width, height]);
        ignored.visit([width, height], visitor);
        attached.visit(visitor);
        scene_flow.visit(visitor);
        localization.visit(visitor);
        tracker.visit(visitor);
        // Without it the state is what it was before there was any.
        if config.segmentation.enabled {
            segmenter.visit(visitor);
        }
        objects.visit(visitor);
        static_map.visit(visitor);
        planning.visit(visitor);
    }

    /// Rebuilds what is not in a snapshot. Whether what was read can be.
    fn rebuild(&mut self) -> bool {
        // No frame could follow one of a size that steps refuse.
        if !self.size.is_none_or(|size| self.takes_size(size)) {
            return false;
        }
        self.static_map.volume.enter_segment(self.localization.camera.segment());
        self.tracker.set_frame_interval_s(self.clock.interval_s());
        let unused = self.ignored.pair(self.size.unwrap_or_default(), self.rectifier.invalid());
        let flow = self.config.scene_flow_within(&self.capacity);
        self.scene_flow.rebuild(&flow, unused.as_ref());
        let is_rebuilt = self.objects.rebuild() && self.static_map.volume.rebuild();
        let mut invariants = Invariants::of_foreign();
        self.check_kept(&mut invariants);
        is_rebuilt && self.tracker.can_be(self.frame) && invariants.faults() == 0
    }
}

/// A digest of a value's `Debug` text: no field can be forgotten, and floats are written to the
/// last bit.
fn fingerprint(value: &impl fmt::Debug) -> u64 {
    struct Text(Digest);
    impl Write for Text {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            // Byte by byte: how a formatter cuts its text must not matter.
            text.bytes().for_each(|byte| self.0.u64(u64::from(byte)));
            Ok(())
        }
    }
    let mut text = Text(Digest::default());
    // Writing into a digest cannot fail.
    let _ = write!(text, "{value:?}");
    text.0.finish()
}
