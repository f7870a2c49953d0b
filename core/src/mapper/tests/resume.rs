//! A stopped and resumed run equals the uninterrupted run; anything but a complete snapshot of this
//! mapper is refused.

use super::*;
use crate::mapper::snapshot;
use std::println;

const FRAMES: usize = 10;
/// So few blocks that some must leave.
const CROWDED: Capacity = Capacity { blocks: 330, ..CAPACITY };

pub(super) fn saved(mapper: &mut Mapper<'_>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut sink = |piece: &[u8]| -> Result<(), ()> {
        bytes.extend_from_slice(piece);
        Ok(())
    };
    mapper.save(&mut sink).unwrap();
    bytes
}

/// Error of a source that has no more bytes.
#[derive(Debug, PartialEq)]
pub(super) struct Ended;

/// Restores a mapper and hands it to `go_on`; a slab full of another's leavings serves as well as a
/// new one.
pub(super) fn restored<R>(
    capacity: &Capacity,
    config: &Config,
    bytes: &[u8],
    go_on: impl FnOnce(&mut Mapper<'_>) -> R,
) -> Result<R, RestoreError<Ended>> {
    // Not zeros: a restored mapper must not rely on a fresh slab.
    let mut slab = vec![0xA5u8; capacity.bytes() + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut rest = bytes;
    let mut source =
        |piece: &mut [u8]| crate::state::in_memory::take(&mut rest, piece).ok_or(Ended);
    let mut mapper = Mapper::restore(capacity, config, &mut slab[start..], &mut source)?;
    assert!(rest.is_empty(), "all of it is read");
    Ok(go_on(&mut mapper))
}

fn uninterrupted(
    walk: &Walk,
    capacity: &Capacity,
    stop: impl Fn(usize) -> bool,
) -> (Vec<Report>, Vec<(usize, Vec<u8>)>) {
    let mut slab = vec![0u8; capacity.bytes() + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut mapper = Mapper::new(capacity, &Walk::config(), &mut slab[start..]).unwrap();
    let (mut reports, mut snapshots) = (Vec::new(), Vec::new());
    for at in 0..FRAMES {
        if stop(at) {
            snapshots.push((at, saved(&mut mapper)));
        }
        reports.push(walk.step(at, &mut mapper));
    }
    (reports, snapshots)
}

#[test]
fn a_run_resumed_anywhere_has_the_digests_of_one_that_never_stopped() {
    let walk = Walk::new(FRAMES);
    for capacity in [CAPACITY, CROWDED] {
        let (reports, snapshots) = uninterrupted(&walk, &capacity, |_| true);
        let last = reports.last().unwrap();
        assert!(last.objects.objects == 1 && last.prune.visited > 0, "{last:?}");
        // Blocks that left the map or were never made.
        let left: u32 = reports
            .iter()
            .map(|report| report.allocate.eviction.lost + report.allocate.refused)
            .sum();
        assert_eq!(
            left > 0,
            capacity.blocks == CROWDED.blocks,
            "the pool is too small where it should be: {:?}",
            last.blocks
        );
        // Each frame is a place to stop.
        for (at, bytes) in &snapshots {
            let went_on: Vec<Report> = restored(&capacity, &Walk::config(), bytes, |mapper| {
                (*at..FRAMES).map(|at| walk.step(at, mapper)).collect()
            })
            .unwrap();
            for (report, expected) in went_on.iter().zip(&reports[*at..]) {
                assert_eq!(
                    report.digests.first_difference(&expected.digests),
                    None,
                    "frame {} after stopping before {at}",
                    report.frame
                );
                assert_eq!(
                    (report.digest, report.frame, report.blocks),
                    (expected.digest, expected.frame, expected.blocks)
                );
                assert_eq!((report.allocate, report.prune), (expected.allocate, expected.prune));
            }
        }
    }
}

#[test]
fn a_small_track_stays_small_when_resumed_and_missed() {
    // The car is seen three times, and missed twice.
    const SEEN: usize = 3;
    let walk = Walk::new(SEEN + 2);
    // Too small to be reconstructed: it is tracked only.
    let small = Detection {
        left: 250,
        top: 60,
        width: 10,
        height: 10,
        mask: &[1; 100],
        ..walk.detection()
    };
    let step = |at: usize, mapper: &mut Mapper<'_>| {
        let detections: &[Detection<'_>] = if at < SEEN { &[small] } else { &[] };
        walk.with_frame(at, |frame| {
            mapper.step(&StereoFrame { detections, ..*frame }, &Serial).unwrap()
        })
    };
    let mut slab = vec![0u8; CAPACITY.bytes() + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut mapper = Mapper::new(&CAPACITY, &Walk::config(), &mut slab[start..]).unwrap();
    let seen: Vec<Report> = (0..SEEN).map(|at| step(at, &mut mapper)).collect();
    assert_eq!(seen[SEEN - 1].tracking.detections.tracked_only, 1);
    let bytes = saved(&mut mapper);
    let missed = |mapper: &mut Mapper<'_>| -> Vec<Report> {
        (SEEN..SEEN + 2).map(|at| step(at, mapper)).collect()
    };
    let (went_on, resumed) =
        (missed(&mut mapper), restored(&CAPACITY, &Walk::config(), &bytes, missed).unwrap());
    for (report, expected) in resumed.iter().zip(&went_on) {
        assert_eq!(
            report.tracking.pixels_masked, expected.tracking.pixels_masked,
            "frame {}",
            report.frame
        );
        assert_eq!(
            report.digests.first_difference(&expected.digests),
            None,
            "frame {}",
            report.frame
        );
    }
}

#[test]
fn a_restored_mapper_saves_the_same_bytes_and_saving_changes_nothing() {
    let walk = Walk::new(FRAMES);
    let (reports, snapshots) = uninterrupted(&walk, &CAPACITY, |at| at == 6);
    let (never, _) = uninterrupted(&walk, &CAPACITY, |_| false);
    assert!(reports.iter().zip(&never).all(|(a, b)| a.digest == b.digest));
    let again = restored(&CAPACITY, &Walk::config(), &snapshots[0].1, saved).unwrap();
    assert!(again == snapshots[0].1);
}

#[test]
fn the_end_of_a_resumed_drive_prunes_and_hands_over_the_same() {
    let walk = Walk::new(FRAMES);
    let (_, snapshots) = uninterrupted(&walk, &CAPACITY, |at| at == 8);
    let finish = |mapper: &mut Mapper<'_>| {
        (mapper.finish(), mapper.static_map().digest(), mapper.static_map().pool().len())
    };
    let resumed = restored(&CAPACITY, &Walk::config(), &snapshots[0].1, finish).unwrap();
    assert_eq!(with_mapper(&walk, 8, |mapper, _| finish(mapper)), resumed);
    assert!(resumed.0.visited > 0);
}

#[test]
fn frames_of_another_size_are_refused_after_resuming_as_before() {
    let walk = Walk::new(2);
    let bytes = with_mapper(&walk, 2, |mapper, _| saved(mapper));
    let small = vec![0u8; 64 * 64];
    let refused = restored(&CAPACITY, &Walk::config(), &bytes, |mapper| {
        let view = View::new(&small, 64, 64).unwrap();
        walk.with_frame(0, |frame| {
            mapper
                .step(&StereoFrame { left: view, right: view, ..*frame }, &Serial)
                .map(|report| report.frame)
        })
    });
    assert_eq!(refused.unwrap(), Err(StepError::SizeChanged));
}

#[test]
fn a_size_that_no_frame_can_have_is_refused_with_its_checksum_right() {
    let walk = Walk::new(2);
    let [width, height] = [WIDTH, HEIGHT];
    let of = |size| {
        let forge = |mapper: &mut Mapper<'_>, _: &[Report]| {
            mapper.size = size;
            saved(mapper)
        };
        restored(&CAPACITY, &Walk::config(), &with_mapper(&walk, 2, forge), |_| ())
    };
    for size in [[0, height], [width, 0], [MIN_WIDTH - 1, height], [width, MIN_HEIGHT - 1]] {
        assert_eq!(of(Some(size)), Err(RestoreError::Damaged), "{size:?}");
    }
    // Other frames may be what comes next.
    for size in [Some([MIN_WIDTH, MIN_HEIGHT]), Some([width, height]), None] {
        assert_eq!(of(size), Ok(()), "{size:?}");
    }
}

#[test]
fn what_is_no_snapshot_of_this_mapper_is_refused_by_name() {
    let walk = Walk::new(3);
    let bytes = with_mapper(&walk, 3, |mapper, _| saved(mapper));
    let refusal = |capacity: &Capacity, config: &Config, bytes: &[u8]| {
        restored(capacity, config, bytes, |_| ()).unwrap_err()
    };
    // The magic begins at byte 0, the version at byte 8.
    let with = |at: usize, byte: u8| {
        let mut changed = bytes.clone();
        changed[at] = byte;
        refusal(&CAPACITY, &Walk::config(), &changed)
    };
    assert_eq!(with(0, b'x'), RestoreError::Foreign);
    // Snapshots of the version before cannot be read.
    let previous = snapshot::VERSION - 1;
    assert_eq!(with(8, previous as u8), RestoreError::Version(previous));
    assert_eq!(
        refusal(&Capacity { tracks: 15, ..CAPACITY }, &Walk::config(), &bytes),
        RestoreError::Capacity
    );
    let mut other = Walk::config();
    // Digests of settings are of their bits.
    other.egomotion.confidence = f64::from_bits(other.egomotion.confidence.to_bits() + 1);
    assert_eq!(
        refusal(&CAPACITY, &other, &bytes),
        RestoreError::Config,
        "one last bit of one setting"
    );
    assert_eq!(refusal(&CAPACITY, &Walk::config(), &[]), RestoreError::Source(Ended));
    // Within the head, the settings and the state.
    for len in [7, 20, 40, bytes.len() / 2, bytes.len() - 1] {
        assert_eq!(
            refusal(&CAPACITY, &Walk::config(), &bytes[..len]),
            RestoreError::Source(Ended),
            "cut to {len} bytes"
        );
    }
    let mut invalid = Walk::config();
    invalid.volume.voxel_size_m = -1.0;
    assert!(matches!(refusal(&CAPACITY, &invalid, &bytes), RestoreError::New(NewError::Config(_))));
}

/// A window of the walk's images, so that a snapshot is small enough to try all of it; the camera
/// is told where it is.
struct Window;

impl Window {
    const AT: [usize; 2] = [200, 48];
    const SIZE: [usize; 2] = [128, 64];
    const CAR: [u32; 4] = [44, 12, 48, 40];
    const CAPACITY: Capacity = Capacity {
        image_width: Self::SIZE[0],
        image_height: Self::SIZE[1],
        blocks: 12,
        visible_blocks: 12,
        object_blocks: 4,
        objects: 1,
        tracks: 2,
        detections: 1,
        mask_words: 128,
        history_frames: 4,
        crop_pixels: 4_000,
        ..CAPACITY
    };

    fn config() -> Config {
        let mut config = Walk::config();
        config.rig.center_u_px -= Self::AT[0] as f64;
        config.rig.center_v_px -= Self::AT[1] as f64;
        config
    }

    /// The snapshot behind so many frames, and what came of the last.
    fn snapshot(frames: usize) -> (Vec<u8>, Report) {
        let (walk, [width, height]) = (Walk::new(frames), Self::SIZE);
        // A part of the walk's pictures, so that the snapshot stays small.
        let of = |pixels: &[u8]| -> Vec<u8> {
            let rows = pixels.chunks(WIDTH).skip(Self::AT[1]).take(height);
            rows.flat_map(|row| &row[Self::AT[0]..Self::AT[0] + width]).copied().collect()
        };
        let [left, top, mask_width, mask_height] = Self::CAR;
        let mask = vec![1; (mask_width * mask_height) as usize];
        let seen = Detection {
            left: left as i32,
            top: top as i32,
            width: mask_width,
            height: mask_height,
            mask: &mask,
            ..walk.detection()
        };
        let mut slab = vec![0u8; Self::CAPACITY.bytes() + SLAB_ALIGN];
        let start = slab.as_ptr().align_offset(SLAB_ALIGN);
        let mut mapper = Mapper::new(&Self::CAPACITY, &Self::config(), &mut slab[start..]).unwrap();
        let mut step = |at: usize| {
            let [left, right] = walk.pairs[at].each_ref().map(|pixels| of(pixels));
            let [left, right] =
                [&left, &right].map(|pixels| View::new(pixels, width, height).unwrap());
            // Given poses: the part is too small to estimate any.
            let pose = Transform::new(
                Vector3::new(0.0, 0.01 * at as f64, 0.0),
                Vector3::new(0.02, 0.0, 0.15) * at as f64,
            );
            let given = walk.with_frame(at, |frame| {
                mapper.step(
                    &StereoFrame {
                        left,
                        right,
                        t_world_camera: Some(pose),
                        detections: &[seen],
                        ..*frame
                    },
                    &Serial,
                )
            });
            given.unwrap()
        };
        let report = (0..frames).map(&mut step).last().unwrap();
        (saved(&mut mapper), report)
    }
}

#[test]
fn a_flip_of_any_byte_is_refused_by_name() {
    let (mut bytes, last) = Window::snapshot(9);
    assert!(
        last.objects.blocks > 0 && last.blocks.used > 0 && last.prune.visited > 0,
        "it holds something of everything: {last:?}"
    );
    let (len, config) = (bytes.len(), Window::config());
    let mut slab = vec![0u8; Window::CAPACITY.bytes() + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut refusal = |bytes: &[u8]| {
        let mut rest = bytes;
        let mut source = |piece: &mut [u8]| -> Result<(), Ended> {
            crate::state::in_memory::take(&mut rest, piece).ok_or(Ended)
        };
        Mapper::restore(&Window::CAPACITY, &config, &mut slab[start..], &mut source).err()
    };
    for (at, bit) in (0..len).zip((0..8).cycle()) {
        bytes[at] ^= 1 << bit;
        let refused = refusal(&bytes);
        let named = match at {
            0..8 => refused == Some(RestoreError::Foreign),
            8..12 => matches!(refused, Some(RestoreError::Version(_))),
            12..20 => refused == Some(RestoreError::Capacity),
            20..28 => refused == Some(RestoreError::Config),
            // A count that grew wants more than there is.
            _ => matches!(refused, Some(RestoreError::Damaged | RestoreError::Source(Ended))),
        };
        assert!(named, "byte {at} of {len}, bit {bit}: {refused:?}");
        bytes[at] ^= 1 << bit;
    }
    assert_eq!(refusal(&bytes), None, "the complete snapshot is accepted");
    println!("{len} bytes of a snapshot, a bit of each flipped");
}

#[test]
fn the_error_of_a_failing_sink_is_returned() {
    let walk = Walk::new(2);
    with_mapper(&walk, 2, |mapper, _| {
        let mut space = 1_000;
        let full = mapper.save(&mut |piece: &[u8]| {
            space -= piece.len().min(space);
            if space > 0 { Ok(()) } else { Err("full") }
        });
        assert_eq!(full, Err("full"));
    });
}
