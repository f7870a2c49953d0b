use super::*;
use crate::random::Random;
use std::{collections::HashSet, vec::Vec};

fn of(fill: impl Fn(&mut Digest)) -> u64 {
    let mut digest = Digest::default();
    fill(&mut digest);
    digest.finish()
}

fn of_bytes(bytes: &[u8]) -> u64 {
    of(|digest| digest.bytes(bytes))
}

/// Contents of a plane of a block: empty, full, even, counted up, noise.
fn planes() -> [[u8; 512]; 5] {
    let mut random = Random::new(7);
    let counted = core::array::from_fn(|at| at as u8);
    let noise = core::array::from_fn(|_| random.below(256) as u8);
    [[0; 512], [255; 512], [3; 512], counted, noise]
}

/// Asserts that no two digests are equal, and returns their number.
fn all_different(mut digests: Vec<u64>) -> usize {
    let count = digests.len();
    digests.sort_unstable();
    assert!(digests.windows(2).all(|pair| pair[0] != pair[1]), "two of {count} are the same");
    // Nor are halves of them the same more often than by chance, three times over.
    for half in [0, 32] {
        let mut halves: Vec<u32> = digests.iter().map(|digest| (digest >> half) as u32).collect();
        halves.sort_unstable();
        let same = halves.windows(2).filter(|pair| pair[0] == pair[1]).count() as f64;
        let by_chance = (count as f64).powi(2) / 2.0 / 2f64.powi(32);
        assert!(
            same <= 10.0 + 3.0 * by_chance,
            "{same} halves of {count} are the same, {by_chance} by chance"
        );
    }
    count
}

/// The definition, a word at a time, in numbers wide enough.
fn plain(bytes: &[u8]) -> u64 {
    let mut whole = Vec::from(bytes);
    whole.resize(bytes.len().next_multiple_of(64), 0);
    let mut lanes = KEYS;
    for (at, word) in whole.chunks(8).enumerate() {
        let word = word.iter().rev().fold(0, |word, &byte| word << 8 | u64::from(byte));
        lanes[at % 8] = plainly_mixed(lanes[at % 8] ^ word);
    }
    let state = plainly_mixed(0x2545_F491_4F6C_DD1D ^ !(bytes.len() as u64));
    let sum = (0..8).fold(u128::from(state), |sum, at| {
        let lane = lanes[at] ^ lanes[at] >> 32;
        (sum + u128::from(lane) * u128::from(KEYS[at])) % (1 << 64)
    });
    finished(sum as u64)
}

fn plainly_mixed(x: u64) -> u64 {
    let (low, high) = (u128::from(x) % (1 << 32), u128::from(x) >> 32);
    (low * high + (low << 32) + high) as u64
}

#[test]
fn equals_the_definition_at_every_length() {
    let noise = planes()[4];
    for len in 0..=512 {
        assert_eq!(of_bytes(&noise[..len]), plain(&noise[..len]), "{len} bytes");
    }
    for len in 0..=256 {
        let values: Vec<i16> =
            noise[..2 * len].as_chunks().0.iter().map(|&pair| i16::from_le_bytes(pair)).collect();
        let unsigned: Vec<u16> = values.iter().map(|&value| value as u16).collect();
        assert_eq!(of(|digest| digest.i16s(&values)), plain(&noise[..2 * len]), "{len} integers");
        assert_eq!(of(|digest| digest.u16s(&unsigned)), plain(&noise[..2 * len]), "{len} integers");
    }
}

#[test]
fn notices_every_single_bit_of_a_block() {
    for mut bytes in planes() {
        let mut seen = Vec::from([of_bytes(&bytes)]);
        for bit in 0..512 * 8 {
            // One bit flipped and flipped back.
            bytes[bit / 8] ^= 1 << (bit % 8);
            seen.push(of_bytes(&bytes));
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        // Of 4,096 bits each gives a digest of its own, and so do the bytes as they were.
        assert_eq!(all_different(seen), 4097);
    }
    let mut values = [0i16; 512];
    let mut seen = Vec::from([of(|d| d.i16s(&values))]);
    for bit in 0..512 * 16 {
        values[bit / 16] ^= 1 << (bit % 16);
        seen.push(of(|d| d.i16s(&values)));
        values[bit / 16] ^= 1 << (bit % 16);
    }
    assert_eq!(all_different(seen), 8193);
}

#[test]
fn notices_every_two_bits_of_a_run() {
    for plane in planes() {
        let mut bytes: [u8; 192] = core::array::from_fn(|at| plane[at]);
        let mut seen = Vec::new();
        for one in 0..192 * 8 {
            bytes[one / 8] ^= 1 << (one % 8);
            for other in 0..one {
                bytes[other / 8] ^= 1 << (other % 8);
                seen.push(of_bytes(&bytes));
                bytes[other / 8] ^= 1 << (other % 8);
            }
            bytes[one / 8] ^= 1 << (one % 8);
        }
        // 1,536 bits by pairs.
        assert_eq!(all_different(seen), 1_178_880);
    }
}

#[test]
fn notices_the_same_change_at_two_places() {
    for plane in planes() {
        let mut values: [i16; 256] =
            core::array::from_fn(|at| i16::from_le_bytes([plane[2 * at], plane[2 * at + 1]]));
        let mut seen = Vec::new();
        for change in [1, -1, 2, 256, i16::MIN] {
            for one in 0..256 {
                values[one] = values[one].wrapping_add(change);
                for other in 0..one {
                    // The same, and what would undo it in a sum.
                    for sign in [1, -1] {
                        values[other] = values[other].wrapping_add(change.wrapping_mul(sign));
                        seen.push(of(|digest| digest.i16s(&values)));
                        values[other] = values[other].wrapping_sub(change.wrapping_mul(sign));
                    }
                }
                values[one] = values[one].wrapping_sub(change);
            }
        }
        // The smallest number is its own negative: both signs change the same.
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(all_different(seen), 9 * 256 * 255 / 2);
    }
}

#[test]
fn notices_any_two_elements_swapped() {
    let mut bytes: [u8; 256] = core::array::from_fn(|at| at as u8);
    let mut seen = Vec::new();
    for one in 0..256 {
        for other in 0..one {
            bytes.swap(one, other);
            seen.push(of_bytes(&bytes));
            bytes.swap(one, other);
        }
    }
    // Whole words and stripes as well.
    for size in [2, 4, 8, 16, 32, 64] {
        for (one, other) in (0..256 / size).flat_map(|one| (0..one).map(move |other| (one, other)))
        {
            let mut swapped = bytes;
            swapped[one * size..][..size].copy_from_slice(&bytes[other * size..][..size]);
            swapped[other * size..][..size].copy_from_slice(&bytes[one * size..][..size]);
            seen.push(of_bytes(&swapped));
        }
    }
    assert!(all_different(seen) > 32_640);
}

#[test]
fn millions_of_small_edits_meet_nowhere() {
    let (mut random, mut edits) = (Random::new(99), 0);
    for plane in planes() {
        let (mut known, mut seen) = (HashSet::new(), Vec::new());
        for _ in 0..500_000 {
            let mut bytes = plane;
            // Two to five bytes, each by one at most: as noise changes voxels.
            for _ in 0..2 + random.below(4) {
                let at = random.below(512) as usize;
                bytes[at] = bytes[at].wrapping_add(random.below(3) as u8).wrapping_sub(1);
            }
            // Edits that come to the same bytes count once.
            let edit: Vec<(usize, u8)> =
                (0..512).filter(|&at| bytes[at] != plane[at]).map(|at| (at, bytes[at])).collect();
            if known.insert(edit) {
                seen.push(of_bytes(&bytes));
            }
        }
        edits += all_different(seen);
    }
    assert!(edits > 1_700_000, "{edits} edits");
}

#[test]
fn every_bit_moves_half_of_the_bits() {
    let mut random = Random::new(3);
    let mut bytes = [0u8; 192];
    for bit in (0..192 * 8).step_by(7).chain(191 * 8..192 * 8) {
        let mut moved = [0u32; 64];
        for _ in 0..1000 {
            bytes.fill_with(|| random.below(256) as u8);
            let before = of_bytes(&bytes);
            bytes[bit / 8] ^= 1 << (bit % 8);
            let difference = before ^ of_bytes(&bytes);
            moved
                .iter_mut()
                .enumerate()
                .for_each(|(at, count)| *count += (difference >> at & 1) as u32);
        }
        // Six standard deviations.
        assert!(moved.iter().all(|count| (405..=595).contains(count)), "bit {bit}: {moved:?}");
    }
}

#[test]
fn a_long_run_of_one_value_keeps_what_came_before_it() {
    let mut seen = Vec::new();
    for value in [0, 255, 128] {
        let mut bytes = [value; 64 * 1024];
        seen.push(of_bytes(&bytes));
        for bit in 0..512 {
            bytes[bit / 8] ^= 1 << (bit % 8);
            seen.push(of_bytes(&bytes));
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
    }
    assert_eq!(all_different(seen), 3 * 513);
}

#[test]
fn single_values_are_told_apart_to_the_bit_and_by_their_place() {
    let mut seen = Vec::from([of(|d| [0; 4].iter().for_each(|&value| d.u64(value)))]);
    for one in 0..256 {
        for other in 0..=one {
            let mut values = [0u64; 4];
            values[one / 64] ^= 1 << (one % 64);
            values[other / 64] |= 1 << (other % 64);
            seen.push(of(|d| values.iter().for_each(|&value| d.u64(value))));
        }
    }
    assert_eq!(all_different(seen), 1 + 256 * 257 / 2);
}

#[test]
fn tells_lengths_and_orders_apart_and_makes_nan_one() {
    assert_ne!(of_bytes(&[1, 2, 3]), of_bytes(&[1, 2, 3, 0]));
    assert_ne!(of_bytes(&[1, 2, 3]), of_bytes(&[3, 2, 1]));
    assert_ne!(of(|d| d.bytes(&[0; 64])), of(|d| d.u64(64)));
    // Runs among values, and where one ends and the next begins.
    let run: fn(&mut Digest) = |d| d.bytes(&[5; 64]);
    let value: fn(&mut Digest) = |d| d.u64(64);
    let orders = [[run, run, value], [run, value, run], [value, run, run]];
    all_different(
        orders.iter().map(|order| of(|d| order.iter().for_each(|append| append(d)))).collect(),
    );
    let splits = (0..=128)
        .map(|at| of(|d| [&[5; 128][..at], &[5; 128][at..]].iter().for_each(|part| d.bytes(part))));
    all_different(splits.collect());
    assert_eq!(of(|d| d.f64(f64::NAN)), of(|d| d.f64(-f64::NAN)));
    assert_eq!(of(|d| d.f32s([f32::NAN, 1.0])), of(|d| d.f32s([-f32::NAN, 1.0])));
    assert_ne!(of(|d| d.f64(0.0)), of(|d| d.f64(-0.0)));
}

#[test]
fn digests_are_those_that_files_hold() {
    // Written down once, from another program after the same description: results of other versions
    // and machines are compared by these.
    let keys: [u64; LANES] = [
        0xE220_A839_7B1D_CDAF,
        0x6E78_9E6A_A1B9_65F5,
        0x06C4_5D18_8009_454F,
        0xF88B_B8A8_724C_81ED,
        0x1B39_896A_51A8_749B,
        0x53CB_9F0C_747E_A2EB,
        0x2C82_9ABE_1F45_32E1,
        0xC584_133A_C916_AB3D,
    ];
    assert_eq!(KEYS, keys);
    let digests = [
        (of(|_| ()), 0xB4C3_8494_5E67_376E),
        (of(|d| d.u64(1)), 0x70EA_A146_1E1E_3A23),
        (of(|d| d.u64(u64::MAX)), 0xBB3F_DD80_E761_09F2),
        (of(|d| d.f64(f64::NAN)), 0xF43C_2178_569F_8FAD),
        (of(|d| d.f64(-1.5)), 0x9EA4_D3C5_22B8_5D35),
        (of(|d| d.f32s([1.0, f32::NAN])), 0x2E20_C754_A7CE_E2CF),
        (of(|d| d.bytes(&[1, 2, 3])), 0x15C7_8AA8_936E_25AC),
        (of(|d| d.i16s(&[-1; 40])), 0x90B4_2A19_B910_A0E1),
    ];
    for (at, (found, expected)) in digests.into_iter().enumerate() {
        assert_eq!(found, expected, "digest {at}");
    }
}

#[test]
fn whole_stripes_are_runs_like_any_other() {
    let bytes: [u8; 128] = core::array::from_fn(|i| (i * 37) as u8);
    let values: [i16; 64] = core::array::from_fn(|i| (i * 977) as i16);
    let [mut whole, mut run] = [Digest::default(); 2];
    whole.whole_bytes(&bytes);
    run.bytes(&bytes);
    assert_eq!(whole, run);
    whole.whole_i16s(&values);
    run.i16s(&values);
    assert_eq!(whole, run);
}
