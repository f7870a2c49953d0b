//! The ring of frames by itself: what it covers, what is due, what it says it uses, and what a
//! snapshot keeps of it.

use super::*;
use crate::{
    memory::Slab,
    state::{Reader, Writer},
};
use std::boxed::Box;

/// Three words of slots, three frames.
const CAPACITY: Capacity =
    Capacity { blocks: 150, visible_blocks: 150, history_frames: 3, ..super::CAPACITY };
const BYTES: usize = VisibleHistory::bytes(&CAPACITY);

fn with_history(test: impl FnOnce(&mut VisibleHistory<'_>)) {
    let mut slab = Box::new(Slab([0; BYTES]));
    let mut carver = Carver::new(&mut slab.0, BYTES).unwrap();
    let mut history = VisibleHistory::new_in(&CAPACITY, &mut carver);
    assert_eq!((carver.check(), carver.footprint().bytes()), (Ok(()), BYTES));
    test(&mut history);
}

fn slots<const N: usize>(positions: [u32; N]) -> [Slot; N] {
    positions.map(Slot::new)
}

fn all_due(history: &mut VisibleHistory<'_>) -> Vec<u32> {
    core::iter::from_fn(|| history.take_due(0)).map(Slot::get).collect()
}

#[test]
fn takes_three_words_a_frame_three_for_what_is_due_and_four_bytes_a_block() {
    // Each region is rounded up to 64 bytes.
    assert_eq!(BYTES, 128 + 64 + 640);
    assert_eq!(
        VisibleHistory::bytes(&Capacity { blocks: 64, history_frames: 16, ..CAPACITY }),
        128 + 64 + 256
    );
}

#[test]
fn covers_the_frames_between_the_oldest_and_the_last() {
    with_history(|history| {
        assert_eq!(
            (history.capacity(), history.len(), history.is_empty(), history.oldest()),
            (3, 0, true, None)
        );
        assert_eq!(
            (history.covers(7), history.expire(), history.words_in_use()),
            (false, None, [0, 0])
        );
        for frame in 7..10 {
            history.push(frame, &slots([frame]));
        }
        assert_eq!((history.len(), history.is_empty(), history.oldest()), (3, false, Some(7)));
        assert_eq!(
            [6, 7, 8, 9, 10].map(|frame| history.covers(frame)),
            [false, true, true, true, false]
        );
        assert_eq!(history.words_in_use(), [9, 9]);
        assert_eq!(history.expire(), Some(7));
        assert_eq!((history.len(), history.oldest(), history.words_in_use()), (2, Some(8), [6, 9]));
        assert_eq!([7, 8, 9, 10].map(|frame| history.covers(frame)), [false, true, true, false]);
        history.push(10, &slots([10]));
        assert_eq!(
            [history.expire(), history.expire(), history.expire(), history.expire()],
            [Some(8), Some(9), Some(10), None]
        );
        assert_eq!(all_due(history), [7, 8, 9, 10], "each frame had its own set");
        // An empty ring begins anew wherever the next frame is.
        history.push(100, &[]);
        assert_eq!(
            (history.oldest(), history.covers(100), history.words_in_use()),
            (Some(100), true, [3, 9])
        );
    });
}

#[test]
fn what_is_due_is_taken_once_from_a_slot_on_in_ascending_order() {
    with_history(|history| {
        let seen = slots([149, 0, 63, 64, 65, 127, 130]);
        history.push(1, &seen);
        assert_eq!(history.due(), 0, "not before it leaves the ring");
        history.expire();
        assert_eq!(history.due(), 7);
        assert_eq!(history.take_due(64), Some(Slot::new(64)));
        assert_eq!(history.take_due(64), Some(Slot::new(65)));
        assert_eq!((history.take_due(128), history.due()), (Some(Slot::new(130)), 4));
        assert_eq!(
            (history.take_due(150), history.take_due(1_000), history.due()),
            (None, None, 4)
        );
        assert_eq!(all_due(history), [0, 63, 127, 149]);
        assert_eq!(history.due(), 0);
    });
}

#[test]
fn a_freed_block_is_not_due_nor_one_made_later_in_its_slot() {
    with_history(|history| {
        let seen = slots([3, 70, 71, 135]);
        seen.iter().for_each(|&slot| history.allocated_at(slot, 5));
        history.push(5, &seen);
        history.push(6, &seen);
        history.expire();
        history.on_free(seen[1]);
        assert_eq!(all_due(history), [3, 71, 135], "freed after its frame had left");
        history.on_free(seen[3]);
        history.allocated_at(seen[3], 7);
        history.expire();
        assert_eq!(
            all_due(history),
            [3, 71],
            "freed before its frame left, and given out again since"
        );
    });
}

#[test]
fn a_snapshot_keeps_the_ring_what_is_due_and_when_blocks_were_made() {
    let mut bytes = Vec::new();
    let (seen, made) = (slots([1, 66, 100, 140]), [2u32, 9, 3, 10]);
    let fill = |history: &mut VisibleHistory<'_>| {
        seen.iter().zip(made).for_each(|(&slot, frame)| history.allocated_at(slot, frame));
        history.push(6, &slots([5, 6, 149]));
        (7..9).for_each(|frame| history.push(frame, &seen));
        history.expire();
        // The ring's fourth frame, where its first was.
        history.push(9, &slots([1, 66, 120]));
    };
    with_history(|history| {
        fill(history);
        let mut sink = |piece: &[u8]| -> Result<(), ()> {
            bytes.extend_from_slice(piece);
            Ok(())
        };
        let mut writer = Writer::new(&mut sink);
        history.visit(141, &mut writer);
        writer.finish().unwrap();
    });
    // Oldest, length and peak, three frames and what is due of three words each, 141 births, the
    // checksum.
    assert_eq!(bytes.len(), 3 * 4 + 4 * 3 * 8 + 141 * 4 + 8);
    with_history(|history| {
        let mut rest = &bytes[..];
        let mut source = |piece: &mut [u8]| -> Result<(), ()> {
            crate::state::in_memory::take(&mut rest, piece).ok_or(())
        };
        let mut reader = Reader::new(&mut source);
        history.visit(141, &mut reader);
        reader.finish().unwrap();
        assert_eq!((history.len(), history.oldest(), history.words_in_use()), (3, Some(7), [9, 9]));
        assert_eq!(all_due(history), [5, 6, 149]);
        let frames: Vec<Vec<u32>> = (0..3)
            .map(|_| {
                history.expire().unwrap();
                all_due(history)
            })
            .collect();
        assert_eq!(
            frames,
            [vec![1, 100], vec![1, 100], vec![1, 66, 120]],
            "of each frame the blocks that are as old"
        );
    });
}
