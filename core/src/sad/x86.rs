//! Kernels for x86-64.
//!
//! A sum of absolute differences of 16 bytes comes in two halves of 64 bits. Packing those of four
//! pairs twice leaves 16 bits a half, and adding neighbours leaves 32 bits a sum.

use super::{
    Comparison, Descriptor, Eight, Functions, Inside, KEY_SCALE_BITS, Kernels, NO_FEATURE,
    OFFSET_BITS,
};
use bytemuck::cast;
use core::arch::x86_64::{
    __m128i, __m256i, _mm_add_epi32, _mm_and_si128, _mm_andnot_si128, _mm_cmpeq_epi32,
    _mm_cmplt_epi32, _mm_cvtepi32_ps, _mm_cvttps_epi32, _mm_div_ps, _mm_madd_epi16, _mm_or_si128,
    _mm_packs_epi32, _mm_sad_epu8, _mm_set1_epi16, _mm_set1_epi32, _mm_setr_epi32,
    _mm_setzero_si128, _mm_slli_epi32, _mm_sub_epi16, _mm_subs_epu16, _mm256_add_epi32,
    _mm256_and_si256, _mm256_andnot_si256, _mm256_broadcastsi128_si256, _mm256_castsi256_si128,
    _mm256_cmpeq_epi32, _mm256_cmpgt_epi32, _mm256_cvtepi32_ps, _mm256_cvttps_epi32, _mm256_div_ps,
    _mm256_extracti128_si256, _mm256_madd_epi16, _mm256_min_epi32, _mm256_or_si256,
    _mm256_packs_epi32, _mm256_permute2x128_si256, _mm256_permutevar8x32_epi32, _mm256_sad_epu8,
    _mm256_set1_epi16, _mm256_set1_epi32, _mm256_setr_epi32, _mm256_setzero_si256,
    _mm256_slli_epi32, _mm256_sub_epi16, _mm256_subs_epu16,
};

/// The sums' place in a key, as a factor: the addition of halves multiplies by it for nothing.
const KEY_SCALE: i16 = 1 << KEY_SCALE_BITS;

/// Runs work with 128 bits.
#[target_feature(enable = "sse2")]
pub fn with_sse2(work: impl Comparison) {
    // A SAD instruction leaves two sums of eight bytes each, 64 bits apart. Two packs bring the
    // halves together, and the multiply-add joins and scales them.
    let scaled = |[a, b, c, d]: [__m128i; 4], scale: i16| {
        let halves = _mm_packs_epi32(_mm_packs_epi32(a, b), _mm_packs_epi32(c, d));
        _mm_madd_epi16(halves, _mm_set1_epi16(scale))
    };
    let whole = |halves: [__m128i; 4]| scaled(halves, 1);
    let sums = |a: &Eight<Descriptor>, b: &Eight<Descriptor>, scale: i16| {
        let ([a, b, c, d, e, f, g, h], [i, j, k, l, m, n, o, p]): (Eight<__m128i>, Eight<__m128i>) =
            (cast(*a), cast(*b));
        let low = scaled(
            [_mm_sad_epu8(a, i), _mm_sad_epu8(b, j), _mm_sad_epu8(c, k), _mm_sad_epu8(d, l)],
            scale,
        );
        let high = scaled(
            [_mm_sad_epu8(e, m), _mm_sad_epu8(f, n), _mm_sad_epu8(g, o), _mm_sad_epu8(h, p)],
            scale,
        );
        [low, high]
    };
    let least = |best: Eight<u32>, [a, b]: [&Eight<Descriptor>; 2], base: u32| {
        let key = |sums: __m128i| _mm_add_epi32(sums, _mm_set1_epi32(base as i32));
        let ([low, high], [best_low, best_high]) = (sums(a, b, KEY_SCALE), cast(best));
        cast([lesser(key(low), best_low), lesser(key(high), best_high)])
    };
    let costs = |point: &[Descriptor; 4], [a, b, c, d]: [&Eight<Descriptor>; 4]| {
        let [p, q, r, s]: [__m128i; 4] = cast(*point);
        let (a, b, c, d): (Eight<__m128i>, Eight<__m128i>, Eight<__m128i>, Eight<__m128i>) =
            (cast(*a), cast(*b), cast(*c), cast(*d));
        let cost = |a: __m128i, b: __m128i, c: __m128i, d: __m128i| {
            let (above, below) = (
                _mm_add_epi32(_mm_sad_epu8(p, a), _mm_sad_epu8(q, b)),
                _mm_add_epi32(_mm_sad_epu8(r, c), _mm_sad_epu8(s, d)),
            );
            _mm_add_epi32(above, below)
        };
        let low = whole([
            cost(a[0], b[0], c[0], d[0]),
            cost(a[1], b[1], c[1], d[1]),
            cost(a[2], b[2], c[2], d[2]),
            cost(a[3], b[3], c[3], d[3]),
        ]);
        let high = whole([
            cost(a[4], b[4], c[4], d[4]),
            cost(a[5], b[5], c[5], d[5]),
            cost(a[6], b[6], c[6], d[6]),
            cost(a[7], b[7], c[7], d[7]),
        ]);
        // At most 4 x 4,080: the saturating pack changes nothing.
        cast(_mm_packs_epi32(low, high))
    };
    run(
        work,
        &Functions {
            sums: |a: &Eight<Descriptor>, b: &Eight<Descriptor>| cast(sums(a, b, 1)),
            sums_of: |a: &Eight<Descriptor>, [b, c, d, e, f, g, h, i]: Eight<&Descriptor>| {
                cast(sums(a, &[*b, *c, *d, *e, *f, *g, *h, *i], 1))
            },
            sums_of_two:
                |a: &Eight<Descriptor>, [b, c, d, e, f, g, h, i]: Eight<&[Descriptor; 2]>| {
                    let first = cast(sums(a, &[b[0], c[0], d[0], e[0], f[0], g[0], h[0], i[0]], 1));
                    [first, cast(sums(a, &[b[1], c[1], d[1], e[1], f[1], g[1], h[1], i[1]], 1))]
                },
            quotients: |dividends: Eight<i32>, divisors: Eight<i32>| {
                quotients_sse2(dividends, divisors)
            },
            least_inside: |best: Eight<u32>,
                           [first, second]: &[Descriptor; 2],
                           others: &Eight<[Descriptor; 2]>,
                           inside: &Inside<'_>| {
                let (first, second): (__m128i, __m128i) = (cast(*first), cast(*second));
                let others: [[__m128i; 2]; 8] = cast(*others);
                let sad = |[a, b]: [__m128i; 2]| {
                    _mm_add_epi32(_mm_sad_epu8(first, a), _mm_sad_epu8(second, b))
                };
                let low = whole([sad(others[0]), sad(others[1]), sad(others[2]), sad(others[3])]);
                let high = whole([sad(others[4]), sad(others[5]), sad(others[6]), sad(others[7])]);
                inside_sse2(best, [low, high], inside)
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
    // Packs work within 128 bits, which leaves the lanes out of order.
    let ordered = |sums: __m256i| {
        _mm256_permutevar8x32_epi32(sums, _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7))
    };
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
        let (a, b, c, d): ([__m256i; 4], [__m256i; 4], [__m256i; 4], [__m256i; 4]) =
            (cast(*a), cast(*b), cast(*c), cast(*d));
        let cost = |a: __m256i, b: __m256i, c: __m256i, d: __m256i| {
            let above = _mm256_add_epi32(_mm256_sad_epu8(p, a), _mm256_sad_epu8(q, b));
            _mm256_add_epi32(above, _mm256_add_epi32(_mm256_sad_epu8(r, c), _mm256_sad_epu8(s, d)))
        };
        let costs = whole([
            cost(a[0], b[0], c[0], d[0]),
            cost(a[1], b[1], c[1], d[1]),
            cost(a[2], b[2], c[2], d[2]),
            cost(a[3], b[3], c[3], d[3]),
        ]);
        cast(_mm_packs_epi32(_mm256_castsi256_si128(costs), _mm256_extracti128_si256(costs, 1)))
    };
    run(
        work,
        &Functions {
            sums: |a: &Eight<Descriptor>, b: &Eight<Descriptor>| cast(whole(sads(a, b))),
            sums_of: |a: &Eight<Descriptor>, b: Eight<&Descriptor>| sums_of_avx2(a, b),
            sums_of_two:
                |a: &Eight<Descriptor>, [b, c, d, e, f, g, h, i]: Eight<&[Descriptor; 2]>| {
                    let sad = |a: Descriptor, b: &[Descriptor; 2]| {
                        _mm256_sad_epu8(_mm256_broadcastsi128_si256(cast(a)), cast(*b))
                    };
                    // The sums of the first descriptors below those of the second.
                    let low = scaled([sad(a[0], b), sad(a[1], c), sad(a[2], d), sad(a[3], e)], 1);
                    let high = scaled([sad(a[4], f), sad(a[5], g), sad(a[6], h), sad(a[7], i)], 1);
                    cast([
                        _mm256_permute2x128_si256(low, high, 0x20),
                        _mm256_permute2x128_si256(low, high, 0x31),
                    ])
                },
            quotients: |dividends: Eight<i32>, divisors: Eight<i32>| {
                quotients_avx2(dividends, divisors)
            },
            least_inside: |best: Eight<u32>,
                           sought: &[Descriptor; 2],
                           others: &Eight<[Descriptor; 2]>,
                           inside: &Inside<'_>| {
                let (sought, others): (__m256i, Eight<__m256i>) = (cast(*sought), cast(*others));
                let sad = |other: __m256i| _mm256_sad_epu8(sought, other);
                // Sums of the first descriptors below those of the second.
                let low =
                    scaled([sad(others[0]), sad(others[1]), sad(others[2]), sad(others[3])], 1);
                let high =
                    scaled([sad(others[4]), sad(others[5]), sad(others[6]), sad(others[7])], 1);
                let sums = _mm256_add_epi32(
                    _mm256_permute2x128_si256(low, high, 0x20),
                    _mm256_permute2x128_si256(low, high, 0x31),
                );
                inside_avx2(best, sums, inside)
            },
            least,
            ordered: |keys: Eight<u32>| cast(ordered(cast(keys))),
            costs,
        },
    );
}

/// Sums of descriptors from anywhere: two from two places are not worth a register.
#[inline]
#[target_feature(enable = "avx2")]
fn sums_of_avx2(a: &Eight<Descriptor>, [b, c, d, e, f, g, h, i]: Eight<&Descriptor>) -> Eight<u32> {
    let a: Eight<__m128i> = cast(*a);
    let sad = |a: __m128i, b: &Descriptor| _mm_sad_epu8(a, cast(*b));
    let half = |[a, b, c, d]: [__m128i; 4]| {
        _mm_madd_epi16(
            _mm_packs_epi32(_mm_packs_epi32(a, b), _mm_packs_epi32(c, d)),
            _mm_set1_epi16(1),
        )
    };
    let low = half([sad(a[0], b), sad(a[1], c), sad(a[2], d), sad(a[3], e)]);
    let high = half([sad(a[4], f), sad(a[5], g), sad(a[6], h), sad(a[7], i)]);
    cast([low, high])
}

/// Quotients whose fraction is cut off.
#[inline]
#[target_feature(enable = "sse2")]
fn quotients_sse2(dividends: Eight<i32>, divisors: Eight<i32>) -> Eight<i32> {
    let ([a, b], [c, d]): ([__m128i; 2], [__m128i; 2]) = (cast(dividends), cast(divisors));
    let quotient = |a, b| _mm_cvttps_epi32(_mm_div_ps(_mm_cvtepi32_ps(a), _mm_cvtepi32_ps(b)));
    cast([quotient(a, c), quotient(b, d)])
}

/// Divides with AVX2.
#[inline]
#[target_feature(enable = "avx2")]
fn quotients_avx2(dividends: Eight<i32>, divisors: Eight<i32>) -> Eight<i32> {
    let (a, b): (__m256i, __m256i) = (cast(dividends), cast(divisors));
    cast(_mm256_cvttps_epi32(_mm256_div_ps(_mm256_cvtepi32_ps(a), _mm256_cvtepi32_ps(b))))
}

/// The lesser of each two.
#[inline]
#[target_feature(enable = "sse2")]
fn lesser(key: __m128i, best: __m128i) -> __m128i {
    let is_less = _mm_cmplt_epi32(key, best);
    _mm_or_si128(_mm_and_si128(is_less, key), _mm_andnot_si128(is_less, best))
}

/// Lowers keys to those of the features that count, by their sums.
#[inline]
#[target_feature(enable = "sse2")]
fn inside_sse2(best: Eight<u32>, [low, high]: [__m128i; 2], inside: &Inside<'_>) -> Eight<u32> {
    let key = |sums: __m128i, at: __m128i, offset: __m128i| {
        // Saturating subtraction leaves zero only if both coordinates are inside the window.
        let beyond = _mm_subs_epu16(
            _mm_sub_epi16(at, _mm_set1_epi32(both(inside.low))),
            _mm_set1_epi32(both(inside.span)),
        );
        let is_inside = _mm_and_si128(
            _mm_cmpeq_epi32(beyond, _mm_setzero_si128()),
            _mm_cmplt_epi32(offset, _mm_set1_epi32(inside.end as i32)),
        );
        let key = _mm_or_si128(_mm_slli_epi32(sums, OFFSET_BITS as i32), offset);
        _mm_or_si128(key, _mm_andnot_si128(is_inside, _mm_set1_epi32(NO_FEATURE as i32)))
    };
    let offset = _mm_add_epi32(_mm_set1_epi32(inside.offset as i32), _mm_setr_epi32(0, 1, 2, 3));
    let next = _mm_add_epi32(offset, _mm_set1_epi32(4));
    let ([at_low, at_high], [best_low, best_high]): ([__m128i; 2], [__m128i; 2]) =
        (cast(*inside.at), cast(best));
    cast([lesser(key(low, at_low, offset), best_low), lesser(key(high, at_high, next), best_high)])
}

/// Takes the least keys with AVX2.
#[inline]
#[target_feature(enable = "avx2")]
fn inside_avx2(best: Eight<u32>, sums: __m256i, inside: &Inside<'_>) -> Eight<u32> {
    // Eight neighbours at once, a lane each.
    let offset = _mm256_add_epi32(
        _mm256_set1_epi32(inside.offset as i32),
        _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7),
    );
    // Two coordinates in a lane: within the window where neither exceeds its span.
    let at = _mm256_sub_epi16(cast(*inside.at), _mm256_set1_epi32(both(inside.low)));
    let beyond = _mm256_subs_epu16(at, _mm256_set1_epi32(both(inside.span)));
    let is_within = _mm256_cmpgt_epi32(_mm256_set1_epi32(inside.end as i32), offset);
    let is_inside = _mm256_and_si256(_mm256_cmpeq_epi32(beyond, _mm256_setzero_si256()), is_within);
    // The sum above, the position below: the least key is the best, and the first of equal ones.
    let key = _mm256_or_si256(_mm256_slli_epi32(sums, OFFSET_BITS as i32), offset);
    let key =
        // Lanes beyond the window or the list become keys that never win.
        _mm256_or_si256(key, _mm256_andnot_si256(is_inside, _mm256_set1_epi32(NO_FEATURE as i32)));
    cast(_mm256_min_epi32(cast(best), key))
}

/// A column and a row as they lie in a position.
fn both([column, row]: [u16; 2]) -> i32 {
    i32::from(row) << 16 | i32::from(column)
}

/// Closures compiled for a level are known to compilers by the traits they implement.
#[inline(always)]
fn run(work: impl Comparison, kernels: &impl Kernels) {
    work.run(kernels);
}
