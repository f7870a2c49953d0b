//! Kernels for x86-64.
//!
//! A sum of absolute differences of 16 bytes comes in two halves of 64 bits. Packing those of four pairs twice leaves 16 bits a half, and
//! adding neighbours leaves 32 bits a sum.

use super::{Comparison, Descriptor, Eight, Functions, Kernels};
use bytemuck::cast;
use core::arch::x86_64::{
    __m128i, __m256i, _mm_add_epi32, _mm_and_si128, _mm_andnot_si128, _mm_cmplt_epi32, _mm_madd_epi16, _mm_or_si128, _mm_packs_epi32,
    _mm_sad_epu8, _mm_set1_epi16, _mm_set1_epi32, _mm256_add_epi32, _mm256_broadcastsi128_si256, _mm256_castsi256_si128,
    _mm256_extracti128_si256, _mm256_madd_epi16, _mm256_min_epi32, _mm256_packs_epi32, _mm256_permutevar8x32_epi32, _mm256_sad_epu8,
    _mm256_set1_epi16, _mm256_set1_epi32, _mm256_setr_epi32,
};

/// The sums' place in a key, as a factor: the addition of halves multiplies by it for nothing.
const KEY_SCALE: i16 = 1 << 12;

/// Runs work with 128 bits.
#[target_feature(enable = "sse2")]
pub fn with_sse2(work: impl Comparison) {
    let scaled = |[a, b, c, d]: [__m128i; 4], scale: i16| {
        let halves = _mm_packs_epi32(_mm_packs_epi32(a, b), _mm_packs_epi32(c, d));
        _mm_madd_epi16(halves, _mm_set1_epi16(scale))
    };
    let whole = |halves: [__m128i; 4]| scaled(halves, 1);
    let sums = |a: &Eight<Descriptor>, b: &Eight<Descriptor>, scale: i16| {
        let ([a, b, c, d, e, f, g, h], [i, j, k, l, m, n, o, p]): (Eight<__m128i>, Eight<__m128i>) = (cast(*a), cast(*b));
        let low = scaled([_mm_sad_epu8(a, i), _mm_sad_epu8(b, j), _mm_sad_epu8(c, k), _mm_sad_epu8(d, l)], scale);
        let high = scaled([_mm_sad_epu8(e, m), _mm_sad_epu8(f, n), _mm_sad_epu8(g, o), _mm_sad_epu8(h, p)], scale);
        [low, high]
    };
    let least = |best: Eight<u32>, [a, b]: [&Eight<Descriptor>; 2], base: u32| {
        let lesser = |sums: __m128i, best: __m128i| {
            let key = _mm_add_epi32(sums, _mm_set1_epi32(base as i32));
            let is_less = _mm_cmplt_epi32(key, best);
            _mm_or_si128(_mm_and_si128(is_less, key), _mm_andnot_si128(is_less, best))
        };
        let ([low, high], [best_low, best_high]) = (sums(a, b, KEY_SCALE), cast(best));
        cast([lesser(low, best_low), lesser(high, best_high)])
    };
    let costs = |point: &[Descriptor; 4], [a, b, c, d]: [&Eight<Descriptor>; 4]| {
        let [p, q, r, s]: [__m128i; 4] = cast(*point);
        let (a, b, c, d): (Eight<__m128i>, Eight<__m128i>, Eight<__m128i>, Eight<__m128i>) = (cast(*a), cast(*b), cast(*c), cast(*d));
        let cost = |a: __m128i, b: __m128i, c: __m128i, d: __m128i| {
            let (above, below) =
                (_mm_add_epi32(_mm_sad_epu8(p, a), _mm_sad_epu8(q, b)), _mm_add_epi32(_mm_sad_epu8(r, c), _mm_sad_epu8(s, d)));
            _mm_add_epi32(above, below)
        };
        let low =
            whole([cost(a[0], b[0], c[0], d[0]), cost(a[1], b[1], c[1], d[1]), cost(a[2], b[2], c[2], d[2]), cost(a[3], b[3], c[3], d[3])]);
        let high =
            whole([cost(a[4], b[4], c[4], d[4]), cost(a[5], b[5], c[5], d[5]), cost(a[6], b[6], c[6], d[6]), cost(a[7], b[7], c[7], d[7])]);
        cast(_mm_packs_epi32(low, high))
    };
    run(
        work,
        &Functions {
            sums: |a: &Eight<Descriptor>, b: &Eight<Descriptor>| cast(sums(a, b, 1)),
            sums_of: |a: &Eight<Descriptor>, [b, c, d, e, f, g, h, i]: Eight<&Descriptor>| {
                cast(sums(a, &[*b, *c, *d, *e, *f, *g, *h, *i], 1))
            },
            least,
            ordered: |keys: Eight<u32>| keys,
            costs,
        },
    );
}

/// Runs work with 256 bits: two descriptors in a register.
#[target_feature(enable = "avx2")]
pub fn with_avx2(work: impl Comparison) {
    // The even sums before the odd ones.
    let scaled = |[a, b, c, d]: [__m256i; 4], scale: i16| {
        let halves = _mm256_packs_epi32(_mm256_packs_epi32(a, b), _mm256_packs_epi32(c, d));
        _mm256_madd_epi16(halves, _mm256_set1_epi16(scale))
    };
    let ordered = |sums: __m256i| _mm256_permutevar8x32_epi32(sums, _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7));
    let whole = |halves: [__m256i; 4]| ordered(scaled(halves, 1));
    let sads = |a: &Eight<Descriptor>, b: &Eight<Descriptor>| {
        let ([a, b, c, d], [e, f, g, h]): ([__m256i; 4], [__m256i; 4]) = (cast(*a), cast(*b));
        [_mm256_sad_epu8(a, e), _mm256_sad_epu8(b, f), _mm256_sad_epu8(c, g), _mm256_sad_epu8(d, h)]
    };
    let least = |best: Eight<u32>, [a, b]: [&Eight<Descriptor>; 2], base: u32| {
        let key = _mm256_add_epi32(scaled(sads(a, b), KEY_SCALE), _mm256_set1_epi32(base as i32));
        cast(_mm256_min_epi32(cast(best), key))
    };
    let costs = |point: &[Descriptor; 4], [a, b, c, d]: [&Eight<Descriptor>; 4]| {
        // Not by `map`, which compilers leave as a call.
        let twice = |corner: Descriptor| _mm256_broadcastsi128_si256(cast(corner));
        let (p, q, r, s) = (twice(point[0]), twice(point[1]), twice(point[2]), twice(point[3]));
        let (a, b, c, d): ([__m256i; 4], [__m256i; 4], [__m256i; 4], [__m256i; 4]) = (cast(*a), cast(*b), cast(*c), cast(*d));
        let cost = |a: __m256i, b: __m256i, c: __m256i, d: __m256i| {
            let above = _mm256_add_epi32(_mm256_sad_epu8(p, a), _mm256_sad_epu8(q, b));
            _mm256_add_epi32(above, _mm256_add_epi32(_mm256_sad_epu8(r, c), _mm256_sad_epu8(s, d)))
        };
        let costs =
            whole([cost(a[0], b[0], c[0], d[0]), cost(a[1], b[1], c[1], d[1]), cost(a[2], b[2], c[2], d[2]), cost(a[3], b[3], c[3], d[3])]);
        cast(_mm_packs_epi32(_mm256_castsi256_si128(costs), _mm256_extracti128_si256(costs, 1)))
    };
    run(
        work,
        &Functions {
            sums: |a: &Eight<Descriptor>, b: &Eight<Descriptor>| cast(whole(sads(a, b))),
            // Two descriptors from two places are not worth a register.
            sums_of: |a: &Eight<Descriptor>, [b, c, d, e, f, g, h, i]: Eight<&Descriptor>| {
                let a: Eight<__m128i> = cast(*a);
                let sad = |a: __m128i, b: &Descriptor| _mm_sad_epu8(a, cast(*b));
                let half = |[a, b, c, d]: [__m128i; 4]| {
                    _mm_madd_epi16(_mm_packs_epi32(_mm_packs_epi32(a, b), _mm_packs_epi32(c, d)), _mm_set1_epi16(1))
                };
                let low = half([sad(a[0], b), sad(a[1], c), sad(a[2], d), sad(a[3], e)]);
                let high = half([sad(a[4], f), sad(a[5], g), sad(a[6], h), sad(a[7], i)]);
                cast([low, high])
            },
            least,
            ordered: |keys: Eight<u32>| cast(ordered(cast(keys))),
            costs,
        },
    );
}

/// Closures compiled for a level are known to compilers by the traits they implement.
#[inline(always)]
fn run(work: impl Comparison, kernels: &impl Kernels) {
    work.run(kernels);
}
