//! Kernels for 64-bit Arm.
//!
//! A difference of 16 bytes becomes eight sums of two neighbours. Adding neighbours of two
//! registers three times over leaves the sums of eight pairs in the order of the pairs.

use super::{
    Comparison, Descriptor, Eight, Functions, Inside, KEY_SCALE_BITS, Kernels, NO_FEATURE,
    OFFSET_BITS,
};
use bytemuck::cast;
use core::arch::aarch64::{
    int32x4_t, uint8x16_t, uint16x8_t, uint32x4_t, vabdq_u8, vaddq_u32, vandq_u32, vbslq_u32,
    vceqzq_u32, vcltq_u32, vcvtq_f32_s32, vcvtq_s32_f32, vdivq_f32, vdupq_n_u32, vget_low_u16,
    vminq_u32, vmovl_high_u16, vmovl_u16, vorrq_u32, vpadalq_u8, vpaddlq_u8, vpaddq_u16,
    vqsubq_u16, vreinterpretq_u16_u32, vreinterpretq_u32_u16, vshlq_n_u32, vsubq_u16,
};

/// Runs work with 128 bits.
#[target_feature(enable = "neon")]
pub fn with_neon(work: impl Comparison) {
    // Adds neighbours until each descriptor has one total, in the order of the descriptors.
    let whole = |[a, b, c, d, e, f, g, h]: Eight<uint16x8_t>| {
        let (fours, others) =
            ([vpaddq_u16(a, b), vpaddq_u16(c, d)], [vpaddq_u16(e, f), vpaddq_u16(g, h)]);
        vpaddq_u16(vpaddq_u16(fours[0], fours[1]), vpaddq_u16(others[0], others[1]))
    };
    let wide = |sums: uint16x8_t| [vmovl_u16(vget_low_u16(sums)), vmovl_high_u16(sums)];
    let twos = |a: uint8x16_t, b: uint8x16_t| vpaddlq_u8(vabdq_u8(a, b));
    let sums = |[a, b, c, d, e, f, g, h]: Eight<uint8x16_t>,
                [i, j, k, l, m, n, o, p]: Eight<uint8x16_t>| {
        wide(whole([
            twos(a, i),
            twos(b, j),
            twos(c, k),
            twos(d, l),
            twos(e, m),
            twos(f, n),
            twos(g, o),
            twos(h, p),
        ]))
    };
    let least = |best: Eight<u32>, [a, b]: [&Eight<Descriptor>; 2], base: u32| {
        let key =
            |sums: uint32x4_t| vaddq_u32(vshlq_n_u32::<KEY_SCALE_BITS>(sums), vdupq_n_u32(base));
        let ([low, high], [best_low, best_high]) = (sums(cast(*a), cast(*b)), cast(best));
        cast([vminq_u32(key(low), best_low), vminq_u32(key(high), best_high)])
    };
    let least_inside = |best: Eight<u32>,
                        [first, second]: &[Descriptor; 2],
                        others: &Eight<[Descriptor; 2]>,
                        inside: &Inside<'_>| {
        let (first, second): (uint8x16_t, uint8x16_t) = (cast(*first), cast(*second));
        let o: Eight<[uint8x16_t; 2]> = cast(*others);
        let four = |[a, b]: [uint8x16_t; 2]| vpadalq_u8(twos(first, a), vabdq_u8(second, b));
        let [low, high] = wide(whole([
            four(o[0]),
            four(o[1]),
            four(o[2]),
            four(o[3]),
            four(o[4]),
            four(o[5]),
            four(o[6]),
            four(o[7]),
        ]));
        let key = |sums: uint32x4_t, at: uint16x8_t, offset: uint32x4_t| {
            let both = |[column, row]: [u16; 2]| {
                vreinterpretq_u16_u32(vdupq_n_u32(u32::from(row) << 16 | u32::from(column)))
            };
            // Saturating subtraction leaves zero only if both coordinates are inside the window.
            let beyond = vqsubq_u16(vsubq_u16(at, both(inside.low)), both(inside.span));
            let is_inside = vandq_u32(
                vceqzq_u32(vreinterpretq_u32_u16(beyond)),
                vcltq_u32(offset, vdupq_n_u32(inside.end)),
            );
            vbslq_u32(
                is_inside,
                vorrq_u32(vshlq_n_u32::<{ OFFSET_BITS as i32 }>(sums), offset),
                vdupq_n_u32(NO_FEATURE),
            )
        };
        let ([at_low, at_high], [best_low, best_high]) = (cast(*inside.at), cast(best));
        let offset = vaddq_u32(vdupq_n_u32(inside.offset), cast([0u32, 1, 2, 3]));
        let next = vaddq_u32(offset, vdupq_n_u32(4));
        cast([
            vminq_u32(key(low, at_low, offset), best_low),
            vminq_u32(key(high, at_high, next), best_high),
        ])
    };
    let costs = |point: &[Descriptor; 4], [a, b, c, d]: [&Eight<Descriptor>; 4]| {
        let [p, q, r, s]: [uint8x16_t; 4] = cast(*point);
        let (a, b, c, d): (
            Eight<uint8x16_t>,
            Eight<uint8x16_t>,
            Eight<uint8x16_t>,
            Eight<uint8x16_t>,
        ) = (cast(*a), cast(*b), cast(*c), cast(*d));
        let cost = |i: usize| {
            let above = vpadalq_u8(twos(p, a[i & 7]), vabdq_u8(q, b[i & 7]));
            vpadalq_u8(vpadalq_u8(above, vabdq_u8(r, c[i & 7])), vabdq_u8(s, d[i & 7]))
        };
        cast(whole([cost(0), cost(1), cost(2), cost(3), cost(4), cost(5), cost(6), cost(7)]))
    };
    let kernels = Functions {
        sums: |a: &Eight<Descriptor>, b: &Eight<Descriptor>| cast(sums(cast(*a), cast(*b))),
        sums_of: |a: &Eight<Descriptor>, [b, c, d, e, f, g, h, i]: Eight<&Descriptor>| {
            cast(sums(cast(*a), cast([*b, *c, *d, *e, *f, *g, *h, *i])))
        },
        sums_of_two: |a: &Eight<Descriptor>, [b, c, d, e, f, g, h, i]: Eight<&[Descriptor; 2]>| {
            let first =
                cast(sums(cast(*a), cast([b[0], c[0], d[0], e[0], f[0], g[0], h[0], i[0]])));
            [first, cast(sums(cast(*a), cast([b[1], c[1], d[1], e[1], f[1], g[1], h[1], i[1]])))]
        },
        quotients: |dividends: Eight<i32>, divisors: Eight<i32>| quotients(dividends, divisors),
        least_inside,
        least,
        ordered: |keys: Eight<u32>| keys,
        costs,
    };
    run(work, &kernels);
}

/// Quotients whose fraction is cut off.
#[inline]
#[target_feature(enable = "neon")]
fn quotients(dividends: Eight<i32>, divisors: Eight<i32>) -> Eight<i32> {
    let ([a, b], [c, d]): ([int32x4_t; 2], [int32x4_t; 2]) = (cast(dividends), cast(divisors));
    let quotient = |a, b| vcvtq_s32_f32(vdivq_f32(vcvtq_f32_s32(a), vcvtq_f32_s32(b)));
    cast([quotient(a, c), quotient(b, d)])
}

/// Closures compiled for a level are known to compilers by the traits they implement.
#[inline(always)]
fn run(work: impl Comparison, kernels: &impl Kernels) {
    work.run(kernels);
}
