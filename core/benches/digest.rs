//! Cost of digests: of a block and of an image, to compare with a frame's time.

use criterion::{Criterion, criterion_group, criterion_main};
use dynvox_core::digest::Digest;
use std::hint::black_box;

fn digests(c: &mut Criterion) {
    // Opaque to the compiler, which would otherwise hash at compile time.
    let (sdf, plane) = (black_box([7i16; 512]), black_box([9u8; 512]));
    let block = |planes: usize| {
        let mut digest = Digest::default();
        digest.u64(black_box(1 << 48 | 2 << 32 | 3 << 16));
        digest.i16s(black_box(&sdf));
        (0..1 + planes).for_each(|_| digest.bytes(black_box(&plane)));
        digest.finish()
    };
    c.bench_function("digest of a grey block", |b| b.iter(|| block(0)));
    c.bench_function("digest of a coloured block", |b| b.iter(|| block(3)));
    // An image of KITTI's size, row by row as the mapper hashes it.
    let (grey, disparity) = (vec![7u8; 1242 * 375], vec![7u16; 1242 * 375]);
    c.bench_function("digest of a grey image, 1242 x 375", |b| {
        b.iter(|| {
            let mut digest = Digest::default();
            grey.chunks(1242).for_each(|row| digest.bytes(row));
            digest.finish()
        });
    });
    c.bench_function("digest of a disparity image, 1242 x 375", |b| {
        b.iter(|| {
            let mut digest = Digest::default();
            disparity.chunks(1242).for_each(|row| digest.u16s(row));
            digest.finish()
        });
    });
}

criterion_group!(benches, digests);
criterion_main!(benches);
