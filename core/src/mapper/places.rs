//! Places of a map, saved for later runs, and a camera that is placed among them.

use super::Mapper;
use crate::{
    geometry::{MapSegment, StereoRig},
    state::{ReadError, Reader, Visitor, Writer},
};
use core::fmt;

/// First bytes of saved places.
const MAGIC: [u8; 8] = *b"dynvoxpl";
/// Version of the layout.
const VERSION: u32 = 1;
/// Share by which the rig may differ from that of the keyframes: positions of points are pixels.
const RIG_SHARE: f64 = 0.002;

/// Bytes of saved places before their keyframes.
pub const SAVED_PLACES_HEADER_BYTES: usize = 8 + 4 + 4 * 8 + 4;

/// Number of keyframes of saved places, by their first bytes; `None` where these are of something
/// else or of another version.
///
/// ```
/// use dynvox_core::{SAVED_PLACES_HEADER_BYTES, saved_keyframes};
///
/// assert_eq!(saved_keyframes(&[0; SAVED_PLACES_HEADER_BYTES]), None);
/// ```
pub fn saved_keyframes(header: &[u8; SAVED_PLACES_HEADER_BYTES]) -> Option<u32> {
    let rest = header.strip_prefix(&MAGIC)?.strip_prefix(&VERSION.to_le_bytes())?;
    rest.last_chunk().map(|count| u32::from_le_bytes(*count))
}

/// Reason that places cannot be loaded. The mapper then has none.
///
/// ```
/// use dynvox_core::{
///     Capacity, Config, LoadPlacesError, Mapper, geometry::StereoRig, memory::SLAB_ALIGN,
/// };
///
/// let rig =
///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// let capacity = Capacity { keyframes: 10, ..Capacity::TINY };
/// let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
/// let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
/// let mut zeros = |bytes: &mut [u8]| {
///     bytes.fill(0);
///     Ok::<(), ()>(())
/// };
/// assert_eq!(mapper.load_places(&mut zeros), Err(LoadPlacesError::Foreign));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LoadPlacesError<E> {
    /// The mapper has taken frames already.
    Started,
    /// The source ended too early or failed.
    Source(E),
    /// The bytes are not saved places.
    Foreign,
    /// The places are of another version of the layout.
    Version(u32),
    /// The places were seen by another camera.
    Rig,
    /// There are more keyframes than the mapper's capacity has.
    Capacity {
        /// Keyframes of the file.
        keyframes: u32,
    },
    /// The bytes are not those that were written.
    Damaged,
}

impl<E> From<ReadError<E>> for LoadPlacesError<E> {
    fn from(error: ReadError<E>) -> Self {
        match error {
            ReadError::Source(error) => Self::Source(error),
            ReadError::Damaged => Self::Damaged,
        }
    }
}

impl<E: fmt::Display> fmt::Display for LoadPlacesError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Started => f.write_str("places are loaded before the first frame"),
            Self::Source(error) => write!(f, "the places cannot be read: {error}"),
            Self::Foreign => f.write_str("the bytes are not places of a map"),
            Self::Version(found) => write!(
                f,
                "the places are of version {found}, this mapper reads version {VERSION}: map the \
                 old recording anew"
            ),
            Self::Rig => f.write_str(
                "the places were seen by another camera: focal length, principal point and \
                 baseline must be the same",
            ),
            Self::Capacity { keyframes } => {
                write!(f, "there are {keyframes} keyframes, more than the capacity has")
            }
            Self::Damaged => {
                f.write_str("the places are damaged: their bytes are not those that were written")
            }
        }
    }
}

impl<E: fmt::Debug + fmt::Display> core::error::Error for LoadPlacesError<E> {}

impl Mapper<'_> {
    /// Segment of the map that the camera is in.
    ///
    /// ```
    /// use dynvox_core::{
    ///     Capacity, Config, Mapper, geometry::{MapSegment, StereoRig}, memory::SLAB_ALIGN,
    /// };
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
    /// let mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut slab)?;
    /// assert_eq!(mapper.segment(), MapSegment::FIRST);
    /// # Ok::<(), dynvox_core::NewError>(())
    /// ```
    pub fn segment(&self) -> MapSegment {
        self.localization.camera.segment()
    }

    /// Number of keyframes by which places are recognised.
    ///
    /// ```
    /// use dynvox_core::{Capacity, Config, Mapper, geometry::StereoRig, memory::SLAB_ALIGN};
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
    /// let mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut slab)?;
    /// assert_eq!(mapper.keyframes(), 0);
    /// # Ok::<(), dynvox_core::NewError>(())
    /// ```
    pub fn keyframes(&self) -> u32 {
        self.localization.places.len() as u32
    }

    /// Writes the keyframes to `sink`, piece by piece, with the rig that saw them and a checksum.
    /// Nothing changes; `&mut` only because one description of the state serves writing and
    /// reading.
    ///
    /// # Errors
    /// The sink's first one.
    pub fn save_places<E>(
        &mut self,
        sink: &mut impl FnMut(&[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut writer = Writer::new(sink);
        let (mut magic, mut version) = (MAGIC, VERSION);
        let mut rig = rig_values(&self.config.rig);
        let mut keyframes = self.keyframes();
        writer.bytes(&mut magic);
        writer.u32(&mut version);
        writer.f64s(&mut rig);
        // Before the keyframes, so that a reader can refuse too many by their number.
        writer.u32(&mut keyframes);
        self.localization.places.visit_keyframes(&mut writer);
        writer.finish()
    }

    /// Loads the places of an old map into a mapper that has taken no frame. The camera begins
    /// lost, in a segment of its own after those of the old map. Where frames recognise a place, it
    /// goes on in the old map's segment, and is placed there again and again, so that it does not
    /// drift; no keyframe is taken. Returns the number of keyframes.
    ///
    /// # Errors
    /// See [`LoadPlacesError`]. The mapper has no places then, and can be used.
    ///
    /// ```
    /// use dynvox_core::{Capacity, Config, Mapper, geometry::StereoRig, memory::SLAB_ALIGN};
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let (capacity, config) =
    ///     (Capacity { keyframes: 10, ..Capacity::TINY }, Config::for_rig(rig));
    /// let [mut first, mut second] = [0, 1].map(|_| vec![0; capacity.bytes() + SLAB_ALIGN]);
    /// let mut bytes = Vec::new();
    /// Mapper::new(&capacity, &config, &mut first)?.save_places(&mut |piece: &[u8]| {
    ///     bytes.extend_from_slice(piece);
    ///     Ok::<(), std::io::Error>(())
    /// })?;
    /// let mut file = &bytes[..];
    /// let mut mapper = Mapper::new(&capacity, &config, &mut second)?;
    /// let keyframes = mapper.load_places(&mut |piece: &mut [u8]| {
    ///     std::io::Read::read_exact(&mut file, piece)
    /// })?;
    /// assert_eq!(keyframes, 0, "it has seen nothing");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn load_places<E>(
        &mut self,
        source: &mut impl FnMut(&mut [u8]) -> Result<(), E>,
    ) -> Result<u32, LoadPlacesError<E>> {
        self.take_up_places(source, true)
    }

    /// Loads the places of an old map, as [`Mapper::load_places`] does, into a mapper that goes on
    /// with that map: where frames recognise a place, the camera goes on in the old map's segment
    /// by its own motion, and keyframes are taken. The old map's blocks come from the store of
    /// [`Mapper::step_with`]. Returns the number of keyframes loaded.
    ///
    /// # Errors
    /// See [`LoadPlacesError`]. The mapper has no places then, and can be used.
    ///
    /// ```
    /// use dynvox_core::{Capacity, Config, Mapper, geometry::StereoRig, memory::SLAB_ALIGN};
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let (capacity, config) =
    ///     (Capacity { keyframes: 10, ..Capacity::TINY }, Config::for_rig(rig));
    /// let [mut first, mut second] = [0, 1].map(|_| vec![0; capacity.bytes() + SLAB_ALIGN]);
    /// let mut bytes = Vec::new();
    /// Mapper::new(&capacity, &config, &mut first)?.save_places(&mut |piece: &[u8]| {
    ///     bytes.extend_from_slice(piece);
    ///     Ok::<(), std::io::Error>(())
    /// })?;
    /// let mut file = &bytes[..];
    /// let mut mapper = Mapper::new(&capacity, &config, &mut second)?;
    /// let keyframes = mapper.continue_places(&mut |piece: &mut [u8]| {
    ///     std::io::Read::read_exact(&mut file, piece)
    /// })?;
    /// assert_eq!(keyframes, 0, "the old map has seen nothing");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn continue_places<E>(
        &mut self,
        source: &mut impl FnMut(&mut [u8]) -> Result<(), E>,
    ) -> Result<u32, LoadPlacesError<E>> {
        self.take_up_places(source, false)
    }

    fn take_up_places<E>(
        &mut self,
        source: &mut impl FnMut(&mut [u8]) -> Result<(), E>,
        is_fixed: bool,
    ) -> Result<u32, LoadPlacesError<E>> {
        if self.frame > 0 {
            return Err(LoadPlacesError::Started);
        }
        let read = self.read_places(source, is_fixed);
        if read.is_err() {
            // Half a table must not place anyone.
            self.localization.places.clear();
        }
        read
    }

    fn read_places<E>(
        &mut self,
        source: &mut impl FnMut(&mut [u8]) -> Result<(), E>,
        is_fixed: bool,
    ) -> Result<u32, LoadPlacesError<E>> {
        let mut reader = Reader::new(source);
        let (mut magic, mut version, mut rig, mut keyframes) = ([0; 8], 0, [0.0; 4], 0);
        reader.bytes(&mut magic);
        reader.check()?;
        // Checked one by one, so that each error says what is different.
        if magic != MAGIC {
            return Err(LoadPlacesError::Foreign);
        }
        reader.u32(&mut version);
        reader.check()?;
        if version != VERSION {
            return Err(LoadPlacesError::Version(version));
        }
        reader.f64s(&mut rig);
        reader.u32(&mut keyframes);
        reader.check()?;
        let same = |(a, b): (&f64, f64)| libm::fabs(a - b) <= RIG_SHARE * libm::fabs(b);
        if !rig.iter().zip(rig_values(&self.config.rig)).all(same) {
            return Err(LoadPlacesError::Rig);
        }
        if keyframes as usize > self.capacity.keyframes {
            return Err(LoadPlacesError::Capacity { keyframes });
        }
        let places = &mut self.localization.places;
        places.clear();
        places.visit_keyframes(&mut reader);
        reader.finish()?;
        // The camera's own segment must not be one of theirs.
        let last = places.take_up(is_fixed);
        if last.is_some_and(|last| !self.localization.camera.begin_after(last)) {
            return Err(LoadPlacesError::Damaged);
        }
        let volume = &mut self.static_map.volume;
        volume.enter_segment(self.localization.camera.segment());
        volume.without_submaps();
        Ok(keyframes)
    }
}

/// Numbers of a rig.
fn rig_values(rig: &StereoRig) -> [f64; 4] {
    [rig.focal_px, rig.center_u_px, rig.center_v_px, rig.baseline_m]
}
