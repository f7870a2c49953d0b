//! Streams end where they end, lose nothing unless that is asked for, and say where they break.

use super::netpbm::NetpbmPairs;
use super::*;
use crate::formats::{BayerPattern, Image};
use crate::input::Stacking;
use dynvox_core::geometry::StereoRig;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

fn pgm(width: usize, height: usize, grey: u8) -> Vec<u8> {
    [format!("P5\n# a comment\n{width} {height}\n255\n").into_bytes(), vec![grey; width * height]]
        .concat()
}

fn greys(pairs: NetpbmPairs<&[u8]>) -> Vec<Result<[u8; 2], String>> {
    pairs
        .map(|pair| {
            pair.map(|pair| pair.map(|image| image.grey.pixels()[0]))
                .map_err(|error| error.to_string())
        })
        .collect()
}

#[test]
fn images_come_as_pairs_and_the_stream_ends_between_two() {
    let bytes: Vec<u8> = (1..=4).flat_map(|grey| pgm(6, 4, grey)).collect();
    assert_eq!(greys(NetpbmPairs::new(&bytes, None, None)), [Ok([1, 2]), Ok([3, 4])]);
    assert_eq!(greys(NetpbmPairs::new(&[], None, None)), []);
    let halves = [&b"P5 4 1 255\n"[..], &[7, 7, 9, 9]].concat();
    assert_eq!(greys(NetpbmPairs::new(&halves, Some(Stacking::SideBySide), None)), [Ok([7, 9])]);
    let deep = [&b"P5 2 1 65535\n"[..], &1_600u16.to_be_bytes(), &4_000u16.to_be_bytes()].concat();
    assert_eq!(
        greys(NetpbmPairs::new(&deep, Some(Stacking::SideBySide), None)),
        [Ok([100, 250])],
        "12 bits are significant"
    );
    let colour = [&b"P6 1 2 255\n"[..], &[10, 10, 10, 20, 20, 20]].concat();
    let pair =
        NetpbmPairs::new(&colour[..], Some(Stacking::TopBottom), None).next().unwrap().unwrap();
    assert_eq!(pair[1].colour.as_ref().unwrap().pixels(), [[20, 20, 20]]);
}

/// Images of 16 bit with the same value in each pixel.
fn deep(maximum: u16, values: &[u16]) -> Vec<u8> {
    let image = |value: &u16| {
        [format!("P5 2 2 {maximum}\n").into_bytes(), value.to_be_bytes().repeat(4)].concat()
    };
    values.iter().flat_map(image).collect()
}

#[test]
fn bits_are_those_of_the_header_or_of_several_images() {
    // A dim first pair says nothing of the others.
    let values = [160, 160, 1_600, 1_600, 4_000, 4_000];
    let of_12_bits = [Ok([10, 10]), Ok([100, 100]), Ok([250, 250])];
    for maximum in [4_095, 65_535] {
        let stream = deep(maximum, &values);
        assert_eq!(greys(NetpbmPairs::new(&stream, None, None)), of_12_bits, "{maximum}");
    }
    // A mosaic is one in a stream, too.
    let mosaic = [&b"P5 2 2 255\n"[..], &[200, 100, 100, 20]].concat().repeat(2);
    let mut pairs = NetpbmPairs::new(&mosaic[..], None, None).with_bayer(Some(BayerPattern::Rggb));
    let [left, _] = pairs.next().unwrap().unwrap();
    assert_eq!(left.colour.unwrap().pixels(), [[200, 100, 20]; 4]);
    // A stream that breaks while the first images are compared loses none of them.
    let cut = deep(65_535, &values);
    let read = greys(NetpbmPairs::new(&cut[..cut.len() - 1], None, None));
    assert_eq!(read[..2], of_12_bits[..2]);
    assert!(read[2].as_ref().unwrap_err().contains("stopped inside it"), "{read:?}");
}

#[test]
fn a_stream_that_breaks_says_where_and_ends_there() {
    let good: Vec<u8> = [pgm(6, 4, 1), pgm(6, 4, 2)].concat();
    for (more, sentence) in [
        (&pgm(6, 4, 3)[..20], "image 2 of the stream cannot be used: the stream stopped inside it"),
        (b"P5 6 ", "the stream stopped inside it"),
        (&pgm(6, 4, 3), "the stream ended after the left image of a pair"),
        (b"P4 6 4 ", "binary PGM (P5) and PPM (P6) are read"),
        (b"P5 0 4 255\n", "its header says 0 x 4 px"),
        (b"P5 20000 4 255\n", "it is 20000 x 4 px; at most 8,192 px a side are read"),
        (b"P5 6 x", "its header is not that of a PGM or PPM"),
    ] {
        let bytes = [&good, more].concat();
        let read = greys(NetpbmPairs::new(&bytes, None, None));
        assert!(read.len() == 2 && read[0] == Ok([1, 2]), "{read:?}");
        assert!(read[1].as_ref().unwrap_err().contains(sentence), "{read:?}");
    }
    let endless = [&b"P5 #"[..], &[b'x'; 10_000]].concat();
    assert!(
        greys(NetpbmPairs::new(&endless, None, None))[0]
            .as_ref()
            .unwrap_err()
            .contains("does not end")
    );
}

fn pair(grey: u8) -> Pair {
    [0, 1].map(|_| Decoded { grey: Image::new(40, 40, vec![grey; 1_600]).unwrap(), colour: None })
}

fn options(when_late: WhenLate) -> StreamOptions {
    let rig = StereoRig { focal_px: 50.0, center_u_px: 20.0, center_v_px: 20.0, baseline_m: 0.5 };
    StreamOptions {
        name: "stream".into(),
        cameras: CameraGeometry::Rectified(rig),
        rectified: RectifiedSize::default(),
        rate_hz: None,
        when_late,
    }
}

fn grey(stream: &Stream, index: usize) -> u8 {
    stream.frame(index).unwrap().left.pixels()[0]
}

/// Pairs from a channel, as a camera delivers them.
fn pairs(receiver: Receiver<u8>) -> impl Iterator<Item = Result<Pair, InputError>> + Send {
    std::iter::from_fn(move || receiver.recv().ok()).map(|grey| Ok(pair(grey)))
}

#[test]
fn any_iterator_is_a_source_of_frames_and_its_length_is_not_needed() {
    let stream = Stream::begin(
        options(WhenLate::Wait),
        StopRequest::default(),
        (0..9).map(|grey| Ok(pair(grey))),
    )
    .unwrap();
    assert_eq!(
        (stream.len(), stream.is_empty(), stream.size(), stream.stamp_ns(0)),
        (0, false, (40, 40), None)
    );
    assert_eq!((grey(&stream, 0), grey(&stream, 0)), (0, 0), "the first may be looked at before");
    assert_eq!((grey(&stream, 1), grey(&stream, 4), stream.time_s(4)), (1, 4, 0.4));
    std::thread::sleep(Duration::from_millis(50));
    assert_eq!(
        (5..9).map(|index| grey(&stream, index)).collect::<Vec<_>>(),
        [5, 6, 7, 8],
        "nothing is lost"
    );
    assert!(matches!(stream.frame(9), Err(InputError::PastEnd { frames: 9 })));
    assert_eq!(stream.stream(), Some(StreamState { dropped: 0 }));
    let empty = Stream::begin(options(WhenLate::Wait), StopRequest::default(), std::iter::empty());
    assert!(matches!(empty.err(), Some(InputError::PastEnd { frames: 0 })));
}

#[test]
fn late_frames_are_dropped_oldest_first_counted_and_known_by_their_time() {
    let (camera, receiver) = channel();
    camera.send(0).unwrap();
    let stream =
        Stream::begin(options(WhenLate::Drop), StopRequest::default(), pairs(receiver)).unwrap();
    assert_eq!(grey(&stream, 0), 0);
    (1..=7).for_each(|grey| camera.send(grey).unwrap());
    while stream.stream().unwrap().dropped < 5 {
        std::thread::yield_now();
    }
    assert_eq!(
        (grey(&stream, 1), stream.stamp_ns(1)),
        (6, Some(600_000_000)),
        "frame 1 of the run is the seventh that came"
    );
    assert_eq!((grey(&stream, 2), stream.stamp_ns(2)), (7, Some(700_000_000)));
    drop(camera);
    assert!(matches!(stream.frame(3), Err(InputError::PastEnd { frames: 3 })));
}

#[test]
fn a_stop_ends_the_waiting_for_a_camera_that_is_silent() {
    let (camera, receiver) = channel();
    camera.send(1).unwrap();
    let stop = StopRequest::default();
    let stream = Stream::begin(options(WhenLate::Wait), stop.clone(), pairs(receiver)).unwrap();
    assert_eq!(grey(&stream, 0), 1);
    let asked = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(20));
        stop.word().store(2, std::sync::atomic::Ordering::Relaxed);
    });
    assert!(matches!(stream.frame(1), Err(InputError::PastEnd { frames: 1 })));
    asked.join().unwrap();
    drop(camera);
}
