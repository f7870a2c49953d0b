//! A mapper in two buffers: the results of one in one, and what is refused of them.
#![allow(missing_docs, clippy::unwrap_used, clippy::indexing_slicing)]
#![expect(
    clippy::undocumented_unsafe_blocks,
    reason = "each call keeps the header's promises, but for the one it breaks on purpose"
)]

mod support;

use dynvox_capi::*;
use std::ptr;
use support::*;

/// Two buffers of a mapper's own, one behind the other in memory.
struct TwoBuffers {
    bytes: Vec<u8>,
    start: usize,
    needed: [usize; 2],
}

impl TwoBuffers {
    fn new() -> Self {
        let (capacity, mut needed) = (capacity(), [0; 2]);
        let [hot, cold] = &mut needed;
        let status = unsafe { dynvox_bytes_in_two(&raw const capacity, hot, cold) };
        assert_eq!(status, DynvoxStatus::Ok);
        let bytes = vec![0xAA; needed.iter().sum::<usize>() + 3 * dynvox_alignment()];
        let start = bytes.as_ptr().align_offset(dynvox_alignment());
        Self { bytes, start, needed }
    }

    fn given(&mut self) -> DynvoxTwoBuffers {
        let [hot_len, cold_len] = self.needed;
        let hot = self.bytes[self.start..].as_mut_ptr();
        let behind = hot_len.next_multiple_of(dynvox_alignment());
        DynvoxTwoBuffers { hot, hot_len, cold: hot.wrapping_add(behind), cold_len }
    }
}

fn created(buffers: &DynvoxTwoBuffers) -> Result<*mut DynvoxMapper, DynvoxStatus> {
    let (capacity, config, mut mapper) = (capacity(), config(), ptr::null_mut());
    let status = unsafe {
        dynvox_create_in_two(&raw const capacity, &raw const config, buffers, &raw mut mapper)
    };
    if status == DynvoxStatus::Ok { Ok(mapper) } else { Err(status) }
}

fn digest(mapper: *mut DynvoxMapper, pixels: &[u8]) -> u64 {
    let (frame, mut report): (_, DynvoxReport) = (frame(pixels), unsafe { std::mem::zeroed() });
    let status = unsafe { dynvox_step(mapper, &raw const frame, ptr::null(), &raw mut report) };
    assert_eq!(status, DynvoxStatus::Ok);
    report.digest
}

#[test]
fn two_buffers_give_the_bits_of_one_and_snapshots_fit_both() {
    let (mut one, mut two, pixels) = (Buffer::new(), TwoBuffers::new(), pixels());
    let whole = create(&mut one, &config()).unwrap();
    let divided = created(&two.given()).unwrap();
    for _ in 0..3 {
        assert_eq!(digest(whole, &pixels), digest(divided, &pixels));
    }
    let mut saved: Vec<u8> = Vec::new();
    let context = (&raw mut saved).cast();
    assert_eq!(unsafe { dynvox_save(whole, Some(write), context) }, DynvoxStatus::Ok);
    // Over the mapper that lives there.
    let (mut rest, mut restored) = (&saved[..], ptr::null_mut());
    let (capacity, config, buffers) = (capacity(), config(), two.given());
    let status = unsafe {
        dynvox_restore_in_two(
            &raw const capacity,
            &raw const config,
            &raw const buffers,
            Some(read),
            (&raw mut rest).cast(),
            &raw mut restored,
        )
    };
    assert_eq!(status, DynvoxStatus::Ok);
    assert_eq!(digest(whole, &pixels), digest(restored, &pixels), "it goes on there");
    assert_eq!(unsafe { dynvox_destroy(restored) }, DynvoxStatus::Ok);
    assert_eq!(unsafe { dynvox_destroy(divided) }, DynvoxStatus::NoMapper, "it was replaced");
}

#[test]
fn two_buffers_that_are_small_null_misaligned_or_overlap_are_refused() {
    let mut two = TwoBuffers::new();
    let good = two.given();
    let refused = |change: &dyn Fn(&mut DynvoxTwoBuffers)| {
        let mut buffers = good;
        change(&mut buffers);
        created(&buffers).err()
    };
    assert_eq!(refused(&|two| two.hot_len -= 1), Some(DynvoxStatus::TooSmall));
    assert_eq!(refused(&|two| two.cold_len -= 1), Some(DynvoxStatus::TooSmall));
    assert_eq!(refused(&|two| two.hot = ptr::null_mut()), Some(DynvoxStatus::Null));
    assert_eq!(refused(&|two| two.cold = ptr::null_mut()), Some(DynvoxStatus::Null));
    let inside = |two: &mut DynvoxTwoBuffers| two.cold = two.hot.wrapping_add(64);
    assert_eq!(refused(&inside), Some(DynvoxStatus::Overlap));
    let odd = |two: &mut DynvoxTwoBuffers| two.cold = two.cold.wrapping_add(1);
    assert_eq!(refused(&odd), Some(DynvoxStatus::Misaligned));
    assert_eq!(
        unsafe { dynvox_create_in_two(ptr::null(), ptr::null(), ptr::null(), ptr::null_mut()) },
        DynvoxStatus::Null
    );
    // A frame must lie in neither of them.
    let mapper = created(&good).unwrap();
    for within in [good.hot, good.cold] {
        let image = DynvoxImage { pixels: within, stride: WIDTH };
        let pixels = pixels();
        assert_eq!(
            step(mapper, &DynvoxFrame { left: image, ..frame(&pixels) }),
            DynvoxStatus::Overlap
        );
    }
    assert_eq!(unsafe { dynvox_destroy(mapper) }, DynvoxStatus::Ok);
}
