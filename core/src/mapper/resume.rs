//! Stopping a drive and going on later.

use super::Mapper;
use crate::{
    Capacity, Config,
    snapshot::{Archive, MAGIC, Reader, RestoreError, VERSION, Writer, fingerprint},
};

impl<'s> Mapper<'s> {
    /// Writes all that later frames depend on to `sink`, piece by piece. A mapper restored from it goes on bit for bit as this one does. Nothing
    /// changes; `&mut` only because one walk over the state both writes and reads it.
    ///
    /// What a [`crate::volume::BlockStore`] or an [`crate::objects::ObjectSink`] holds is the caller's, and not in it.
    ///
    /// # Errors
    /// The sink's first one; what it took until then is no snapshot.
    pub fn save<E>(&mut self, sink: &mut impl FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
        let mut writer = Writer::new(sink);
        let (mut magic, mut version) = (MAGIC, VERSION);
        let mut prints = [fingerprint(&self.capacity), fingerprint(&self.config)];
        writer.raw(&mut magic);
        writer.u32(&mut version);
        writer.u64s(&mut prints);
        self.archive(&mut writer);
        writer.finish()
    }

    /// Cuts a mapper out of `slab` as [`Mapper::new`] does, and brings it to where [`Mapper::save`] was called. `source` fills the bytes it is handed
    /// with those that come next.
    ///
    /// # Errors
    /// See [`RestoreError`]. There is no mapper then: nothing half restored can be used.
    pub fn restore<E>(
        capacity: &Capacity,
        config: &Config,
        slab: &'s mut [u8],
        source: &mut impl FnMut(&mut [u8]) -> Result<(), E>,
    ) -> Result<Self, RestoreError<E>> {
        let mut mapper = Self::new(capacity, config, slab).map_err(RestoreError::New)?;
        let mut reader = Reader::new(source);
        let (mut magic, mut version, mut prints) = ([0; 8], 0, [0; 2]);
        reader.raw(&mut magic);
        reader.require(magic == MAGIC, RestoreError::Foreign)?;
        reader.u32(&mut version);
        reader.require(version == VERSION, RestoreError::Version(version))?;
        reader.u64s(&mut prints);
        reader.require(prints[0] == fingerprint(capacity), RestoreError::Capacity)?;
        reader.require(prints[1] == fingerprint(config), RestoreError::Config)?;
        mapper.archive(&mut reader);
        reader.finish()?;
        if mapper.remake() { Ok(mapper) } else { Err(RestoreError::Damaged) }
    }

    fn archive(&mut self, archive: &mut impl Archive) {
        let [mut width, mut height] = self.size.unwrap_or_default();
        archive.u32(&mut self.frame);
        archive.count(&mut width, self.capacity.image_width);
        archive.count(&mut height, self.capacity.image_height);
        self.size = (width * height > 0).then_some([width, height]);
        self.scene_flow.archive(archive);
        self.camera.archive(archive);
        self.tracker.archive(archive);
        self.objects.archive(archive);
        self.background.archive(archive);
    }

    /// Makes anew what is not in a snapshot. Whether what was read can be.
    fn remake(&mut self) -> bool {
        self.scene_flow.remake(&self.config.scene_flow);
        self.objects.remake() && self.background.remake()
    }
}
