//! The disparity image of the last frame, and how far to trust it.

use crate::{DynvoxMapper, DynvoxStatus, given::read, handle::with, map::fill};

/// A disparity image: buffers of the caller, either may be null. It has the size of the frames; its
/// rows follow each other without padding.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxDisparity {
    /// Pixels that each buffer holds, unless it is null.
    pub capacity: usize,
    /// Disparity in 1/256 px; 0 where it is unknown. Odd values of a pair that the mapper matched
    /// itself were filled in between measured ones, which are even.
    pub disparity_q8: *mut u16,
    /// Confidence, 1 to 255: one more than the number of measured pixels in the 16 x 16 about it; 0
    /// where there is no disparity.
    pub confidence: *mut u8,
    /// Written: columns.
    pub width: usize,
    /// Written: rows.
    pub height: usize,
    /// Written: true if there is a confidence. It needs the setting stereo.min_confidence above 0,
    /// and pairs that the mapper matched itself.
    pub has_confidence: bool,
}

/// Copies the disparity of the last frame and its confidence.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `disparity` is null or points to an image whose buffers are as large as it says and
/// overlap nothing.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_disparity(
    mapper: *mut DynvoxMapper,
    disparity: *mut DynvoxDisparity,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, buffer| {
            let mut to = read(disparity.cast_const())?;
            let (seen, confidence) = (mapper.disparity_q8(), mapper.confidence());
            // One pixel stands for the image before the first frame.
            if seen.width() <= 1 {
                return Err(DynvoxStatus::NoFrame);
            }
            (to.width, to.height) = (seen.width(), seen.height());
            if to.capacity < to.width * to.height {
                return Err(DynvoxStatus::TooSmall);
            }
            to.has_confidence = confidence.is_some();
            fill(Some(seen), to.disparity_q8, buffer)?;
            fill(confidence, to.confidence, buffer)?;
            disparity.write(to);
            Ok(())
        })
    }
}
