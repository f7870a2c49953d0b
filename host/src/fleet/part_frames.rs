//! Frames of the parts of a recording that bends.

/// Frames that a part shares with the one before it.
pub const SHARED_FRAMES: usize = 10;
/// Least frames of a part: half of them are its own.
pub const MIN_FRAMES: usize = 2 * SHARED_FRAMES;

/// First frame and number of frames of each part: so many frames each, the last one at most half as
/// many more.
pub fn frames_of_parts(frames: usize, part_frames: usize) -> Vec<[usize; 2]> {
    let step = part_frames.max(MIN_FRAMES) - SHARED_FRAMES;
    let own = frames.saturating_sub(SHARED_FRAMES).max(1);
    // A short rest belongs to the last part.
    let parts = ((own + step / 2) / step).max(1);
    (0..parts)
        .map(|part| {
            let first = part * step;
            let until = if part + 1 == parts { frames } else { first + step + SHARED_FRAMES };
            [first, until - first]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_share_frames_and_reach_the_end() {
        assert_eq!(frames_of_parts(100, 40), [[0, 40], [30, 40], [60, 40]]);
        // A rest of less than half a part belongs to the last.
        assert_eq!(frames_of_parts(110, 40), [[0, 40], [30, 40], [60, 50]]);
        assert_eq!(frames_of_parts(120, 40), [[0, 40], [30, 40], [60, 40], [90, 30]]);
        assert_eq!(frames_of_parts(7, 40), [[0, 7]]);
        // Too few are as many as there may be.
        assert_eq!(frames_of_parts(40, 3), [[0, 20], [10, 20], [20, 20]]);
    }
}
