//! The block index against a plain table: linear probes and deletion by shifting back, at no more
//! bytes. The churn of a moving camera: blocks ahead are entered, those behind removed, and around
//! each there are lookups. Besides the mean it prints how long single insertions take: cleaning in
//! home must not become a spike.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    missing_docs,
    reason = "a bench may stop at what it does not expect"
)]

use criterion::{Criterion, criterion_group, criterion_main};
use dynvox_core::{
    memory::Carver,
    volume::{BlockCoord, BlockKey, HashedIndex, PlainIndex, Slot},
};
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Blocks of the `onboard` profile.
const BLOCKS: usize = 53_000;
/// Blocks across the street: a slice of it is inserted while another is removed.
const SLICE: usize = 1_000;

/// Operations that an index of blocks needs.
trait Table {
    fn find(&self, coords: &[BlockKey], coord: BlockKey) -> Option<Slot>;
    fn insert(&mut self, coords: &[BlockKey], coord: BlockKey, slot: Slot);
    fn remove(&mut self, coords: &[BlockKey], coord: BlockKey);
}

macro_rules! is_a_table {
    ($index:ident) => {
        impl Table for $index<'_> {
            fn find(&self, coords: &[BlockKey], coord: BlockKey) -> Option<Slot> {
                self.find(coord, |slot| Some(coords[slot.index()]))
            }

            fn insert(&mut self, coords: &[BlockKey], coord: BlockKey, slot: Slot) {
                self.insert(coord, slot, |slot| Some(coords[slot.index()])).unwrap();
            }

            fn remove(&mut self, coords: &[BlockKey], coord: BlockKey) {
                assert!(self.remove(coord, |slot| Some(coords[slot.index()])));
            }
        }
    };
}

is_a_table!(HashedIndex);
is_a_table!(PlainIndex);

/// The `number`th block of the street: 25 across, 8 high, 5 deep a slice.
fn block(number: usize) -> BlockKey {
    let (slice, within) = (number / SLICE, number % SLICE);
    let coord = BlockCoord::new(
        (within % 25) as i32 - 12,
        (within / 25 % 8) as i32 - 4,
        (slice * 5 + within / 200) as i32 % 30_000,
    );
    BlockKey::in_first(coord.unwrap())
}

struct Drive<T> {
    table: T,
    coords: Vec<BlockKey>,
    /// Blocks entered so far; the oldest of those in the table is `BLOCKS` behind.
    entered: usize,
    insertions_ns: Vec<u32>,
}

impl<T: Table> Drive<T> {
    fn new(table: T) -> Self {
        let mut churn = Self {
            table,
            coords: vec![BlockKey::default(); BLOCKS],
            entered: 0,
            insertions_ns: Vec::new(),
        };
        for _ in 0..40 * BLOCKS / SLICE {
            churn.slice();
        }
        churn.insertions_ns.clear();
        churn
    }

    /// One slice ahead: removes the oldest blocks, inserts new ones, looks each up four times.
    fn slice(&mut self) -> Duration {
        let begin = Instant::now();
        for number in self.entered..self.entered + SLICE {
            // A ring of blocks: the one that is replaced leaves the index first.
            let slot = number % BLOCKS;
            if number >= BLOCKS {
                self.table.remove(&self.coords, block(number - BLOCKS));
            }
            self.coords[slot] = block(number);
            let one = Instant::now();
            self.table.insert(&self.coords, block(number), Slot::new(slot as u32));
            self.insertions_ns.push(one.elapsed().as_nanos() as u32);
            // Blocks of different ages, as a camera that turns would ask for.
            for back in 0..4 {
                let number = number - (number % BLOCKS).min(back * 777);
                black_box(self.table.find(&self.coords, block(number)));
            }
        }
        self.entered += SLICE;
        begin.elapsed()
    }

    fn bench(mut self, criterion: &mut Criterion, name: &str) {
        criterion.bench_function(&format!("index_1000_in_and_out/{name}"), |bencher| {
            bencher.iter_custom(|iterations| (0..iterations).map(|_| self.slice()).sum());
        });
        // A mean hides the rare insertion that rehashes: percentiles show it.
        self.insertions_ns.sort_unstable();
        let share = |share: f64| {
            self.insertions_ns[(share * (self.insertions_ns.len() - 1) as f64) as usize]
        };
        println!(
            "{name}: {} insertions, ns: median {}, p99.9 {}, p99.999 {}, worst {}",
            self.insertions_ns.len(),
            share(0.5),
            share(0.999),
            share(0.999_99),
            share(1.0)
        );
    }
}

/// Memory for the index of either table, which begins where a slab's regions do.
fn slab(bytes: usize) -> &'static mut [u8] {
    let slab = vec![0u8; bytes + 64].leak();
    let start = slab.as_ptr().align_offset(64);
    &mut slab[start..start + bytes]
}

fn bench(criterion: &mut Criterion) {
    let [hashed, plain] = [HashedIndex::bytes(BLOCKS), PlainIndex::bytes(BLOCKS)];
    assert!(plain <= hashed, "the plain table has no more bytes");
    let index = HashedIndex::new_in(BLOCKS, &mut Carver::new(slab(hashed), hashed).unwrap());
    Drive::new(index).bench(criterion, "hashbrown");
    let index = PlainIndex::new_in(BLOCKS, &mut Carver::new(slab(plain), plain).unwrap());
    Drive::new(index).bench(criterion, "plain");
}

criterion_group! { name = benches; config = Criterion::default().sample_size(50); targets = bench }
criterion_main!(benches);
