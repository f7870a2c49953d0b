//! A file of blocks that is written after the step that evicts them, on a thread of its own.
//!
//! Within a step a block that leaves is copied, nothing else: it is compressed and written once the
//! step is over, while the next frame is read. Records, their order and so the file's bytes are
//! those of a file that is written at once. A reader that needs the file does what the thread
//! has not done yet, so that nothing waits for a wake-up, and a machine without a thread to spare
//! loses time only.
//!
//! Near the file's size limit blocks are written at once, so that the step can say which are lost.
//! A disk that fails is noticed a frame late: blocks that it was to take count as lost in the next
//! frame.
//!
//! Memory: at most twice [`MAX_QUEUED`] blocks of 3 KiB.

use super::BlockFile;
use super::record::{HEADER, LONGEST};
use dynvox_core::volume::{BLOCK_VOXELS, BlockKey, BlockStore, EvictedBlock, LoadedBlock};
use hashbrown::HashMap;
use std::io::{Read, Seek, Write};
use std::mem;
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

/// Most blocks that wait for the end of a step. Further ones are written at once.
const MAX_QUEUED: usize = 1_024;
/// Bytes that a record takes at most.
const RECORD_MAX: u64 = (HEADER + LONGEST) as u64;

/// A copy of an evicted block.
#[derive(Debug)]
struct QueuedBlock {
    key: BlockKey,
    sdf: [i16; BLOCK_VOXELS],
    weight: [u8; BLOCK_VOXELS],
    colour: Option<[[u8; BLOCK_VOXELS]; 3]>,
}

impl QueuedBlock {
    fn copy_of(block: &EvictedBlock<'_>) -> Self {
        let EvictedBlock { key, sdf, weight, colour } = *block;
        Self { key, sdf: *sdf, weight: *weight, colour: colour.copied() }
    }

    fn evicted(&self) -> EvictedBlock<'_> {
        let Self { key, sdf, weight, colour } = self;
        EvictedBlock { key: *key, sdf, weight, colour: colour.as_ref() }
    }

    fn fill(&self, block: LoadedBlock<'_>) {
        (*block.sdf, *block.weight) = (self.sdf, self.weight);
        if let (Some(to), Some(from)) = (block.colour, &self.colour) {
            *to = *from;
        }
    }
}

/// The file, and blocks that were handed over to be written.
#[derive(Debug)]
struct Shared<F> {
    file: BlockFile<F>,
    handed: Vec<QueuedBlock>,
    /// Blocks that could not be written since this was last taken.
    lost: u32,
}

impl<F: Read + Write + Seek> Shared<F> {
    /// Writes what was handed over.
    fn write(&mut self) {
        for block in self.handed.drain(..) {
            self.lost += u32::from(!self.file.store(block.evicted()));
        }
    }
}

/// A file of blocks, and those on their way into it.
#[derive(Debug)]
pub struct BehindFile<F> {
    shared: Arc<Mutex<Shared<F>>>,
    /// Blocks evicted in this step, and the index of each.
    queue: Vec<QueuedBlock>,
    queued: HashMap<BlockKey, usize>,
    /// Bytes that the file may grow by, if no block in the queue can be compressed.
    free_bytes: u64,
    /// Channel that wakes the thread, and the thread; `None` where it could not be started.
    writer: Option<(Sender<()>, JoinHandle<()>)>,
}

impl<F: Read + Write + Seek + Send + 'static> BehindFile<F> {
    /// Writes to `file` from now on.
    pub fn new(file: BlockFile<F>) -> Self {
        let shared = Arc::new(Mutex::new(Shared { file, handed: Vec::new(), lost: 0 }));
        let (wake, woken) = channel();
        let writing = Arc::clone(&shared);
        let write = move || woken.iter().for_each(|()| drop(settled(&writing)));
        let thread = thread::Builder::new().name("blocks".to_owned()).spawn(write);
        Self {
            shared,
            queue: Vec::new(),
            queued: HashMap::new(),
            free_bytes: 0,
            writer: thread.ok().map(|thread| (wake, thread)),
        }
    }

    /// Hands the blocks of a step to the thread. Returns how many of those handed over before could
    /// not be written.
    pub fn hand_over(&mut self) -> u32 {
        self.queued.clear();
        let mut shared = settled(&self.shared);
        mem::swap(&mut shared.handed, &mut self.queue);
        let (lost, is_empty) = (mem::take(&mut shared.lost), shared.handed.is_empty());
        drop(shared);
        // The next step asks the file again how much it may grow.
        self.free_bytes = 0;
        if let Some((wake, _)) = self.writer.as_ref().filter(|_| !is_empty) {
            // A thread that is gone leaves its work to the next reader of the file.
            let _ = wake.send(());
        }
        lost
    }

    /// Reads something of the file, once all blocks handed over are in it.
    pub fn with_file<R>(&self, read: impl FnOnce(&BlockFile<F>) -> R) -> R {
        read(&settled(&self.shared).file)
    }

    /// Ends the thread and returns the file, with every block in it; `None` if the thread still has
    /// a share of it, which it gives back by ending.
    pub fn into_file(mut self) -> Option<BlockFile<F>> {
        self.hand_over();
        if let Some((wake, thread)) = self.writer.take() {
            drop(wake);
            // A thread that panicked has given its share back as well.
            let _ = thread.join();
        }
        let mut shared =
            Arc::into_inner(self.shared)?.into_inner().unwrap_or_else(PoisonError::into_inner);
        shared.write();
        Some(shared.file)
    }
}

impl<F: Read + Write + Seek> BehindFile<F> {
    /// Writes the queue, so that the file's answer for another block is exact.
    fn written(&mut self) -> MutexGuard<'_, Shared<F>> {
        self.queued.clear();
        let mut shared = settled(&self.shared);
        mem::swap(&mut shared.handed, &mut self.queue);
        shared.write();
        shared
    }
}

impl<F: Read + Write + Seek> BlockStore for BehindFile<F> {
    fn store(&mut self, block: EvictedBlock<'_>) -> bool {
        if self.free_bytes < RECORD_MAX {
            let free_bytes = self.written().file.free_bytes();
            self.free_bytes = free_bytes;
        }
        if self.free_bytes < RECORD_MAX || self.queue.len() >= MAX_QUEUED {
            self.free_bytes = 0;
            return self.written().file.store(block);
        }
        self.free_bytes -= RECORD_MAX;
        // A block stored again in this step has the later index.
        self.queued.insert(block.key, self.queue.len());
        self.queue.push(QueuedBlock::copy_of(&block));
        true
    }

    fn load(&mut self, block: LoadedBlock<'_>) -> bool {
        let queued = self.queued.get(&block.key).and_then(|&index| self.queue.get(index));
        match queued {
            Some(queued) => {
                queued.fill(block);
                true
            }
            None => settled(&self.shared).file.load(block),
        }
    }
}

/// Returns the file with all that was handed over in it.
fn settled<F: Read + Write + Seek>(shared: &Mutex<Shared<F>>) -> MutexGuard<'_, Shared<F>> {
    let mut shared = shared.lock().unwrap_or_else(PoisonError::into_inner);
    shared.write();
    shared
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynvox_core::geometry::MapSegment;
    use dynvox_core::volume::BlockCoord;
    use std::io::Cursor;

    fn key(x: i16) -> BlockKey {
        BlockKey { segment: MapSegment::FIRST, coord: BlockCoord { x, y: 0, z: 0 } }
    }

    /// Stores the block of a number: its weights are the number, its distances a pattern.
    fn store(store: &mut impl BlockStore, number: u16) -> bool {
        let sdf = std::array::from_fn(|at| (at as i16).wrapping_mul(number as i16 + 1));
        let weight = [number as u8; BLOCK_VOXELS];
        store.store(EvictedBlock {
            key: key(number as i16),
            sdf: &sdf,
            weight: &weight,
            colour: None,
        })
    }

    /// Weight of the block of a number, if it can be loaded.
    fn loaded(store: &mut impl BlockStore, number: u16) -> Option<u8> {
        let (mut sdf, mut weight) = ([0; BLOCK_VOXELS], [0; BLOCK_VOXELS]);
        let block = LoadedBlock {
            key: key(number as i16),
            sdf: &mut sdf,
            weight: &mut weight,
            colour: None,
        };
        store.load(block).then_some(weight[0])
    }

    fn file() -> BlockFile<Cursor<Vec<u8>>> {
        BlockFile::over(Cursor::new(Vec::new()))
    }

    #[test]
    fn a_file_written_behind_has_the_bytes_of_one_written_at_once() {
        let (mut behind, mut at_once) = (BehindFile::new(file()), file());
        for step in 0..20u16 {
            for number in 10 * step..10 * step + 30 {
                assert!(store(&mut behind, number) && store(&mut at_once, number));
                // From the queue, from what is being written, and from the file.
                for asked in [number, number.saturating_sub(25), number / 2] {
                    assert_eq!(loaded(&mut behind, asked), loaded(&mut at_once, asked), "{asked}");
                }
            }
            assert_eq!(behind.hand_over(), 0);
        }
        let behind = behind.into_file().expect("the thread has ended");
        assert_eq!(behind.into_inner().into_inner(), at_once.into_inner().into_inner());
    }

    #[test]
    fn a_step_that_evicts_more_than_the_queue_holds_loses_nothing() {
        let (mut behind, mut at_once) = (BehindFile::new(file()), file());
        for number in 0..2 * MAX_QUEUED as u16 + 7 {
            assert!(store(&mut behind, number) && store(&mut at_once, number));
            assert!(behind.queue.len() <= MAX_QUEUED);
        }
        let behind = behind.into_file().expect("the thread has ended");
        assert_eq!(behind.into_inner().into_inner(), at_once.into_inner().into_inner());
    }

    #[test]
    fn a_size_limit_refuses_the_same_blocks_in_the_same_step() {
        let most = 20_000;
        let (mut at_once, mut limited) = (file(), file());
        at_once.limit(most);
        limited.limit(most);
        let mut behind = BehindFile::new(limited);
        let mut refused = 0;
        for number in 0..200u16 {
            let is_stored = store(&mut behind, number);
            assert_eq!(is_stored, store(&mut at_once, number), "block {number}");
            refused += u32::from(!is_stored);
            if number % 16 == 0 {
                assert_eq!(behind.hand_over(), 0, "what was taken is written");
            }
        }
        assert!(refused > 0 && refused < 200, "{refused} refused");
        assert!(behind.with_file(|file| file.failure().is_some()));
    }

    /// A disk that takes so many bytes and then fails.
    struct Failing(Cursor<Vec<u8>>, usize);

    impl Read for Failing {
        fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
            self.0.read(bytes)
        }
    }

    impl Seek for Failing {
        fn seek(&mut self, to: std::io::SeekFrom) -> std::io::Result<u64> {
            self.0.seek(to)
        }
    }

    impl Write for Failing {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            if self.0.get_ref().len() + bytes.len() > self.1 {
                return Err(std::io::ErrorKind::StorageFull.into());
            }
            self.0.write(bytes)
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn blocks_that_a_failing_disk_did_not_take_are_counted_a_step_later() {
        let disk = Failing(Cursor::new(Vec::new()), 8_000);
        let mut behind = BehindFile::new(BlockFile::over(disk));
        let taken = (0..40).filter(|&number| store(&mut behind, number)).count();
        assert_eq!((taken, behind.hand_over()), (40, 0), "the disk was not asked yet");
        let written = behind.with_file(BlockFile::records) as u32;
        assert!(written > 0 && written < 40, "{written} written");
        assert_eq!(behind.hand_over(), 40 - written);
        assert!(!store(&mut behind, 40), "and no further one is taken");
    }
}
