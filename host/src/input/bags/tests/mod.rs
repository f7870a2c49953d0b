//! Messages that are cut short or of another kind are refused, and pictures are what was in them.

mod recordings;

use super::container::Topic;
use super::images;
use super::messages::{CameraInfo, Encoding, RawImage, inertial_reading, stamp_ns};
use crate::formats::Picture;

/// The picture in a raw image of ROS 2.
fn picture(message: &[u8]) -> Result<Picture, String> {
    let kind = "sensor_msgs/Image".to_owned();
    let topic = Topic { name: "/left".to_owned(), kind, encoding: Encoding::Cdr };
    images::picture(message, &topic)
}

/// CDR text.
fn text(bytes: &mut Vec<u8>, text: &str) {
    align(bytes, 4);
    bytes.extend((text.len() as u32 + 1).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes.push(0);
}

fn align(bytes: &mut Vec<u8>, to: usize) {
    while !(bytes.len() - 4).is_multiple_of(to) {
        bytes.push(0);
    }
}

fn image(width: u32, height: u32, encoding: &str, step: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend([7u32, 5, 0].iter().take(2).flat_map(|number| number.to_le_bytes()));
    text(&mut bytes, "cam");
    align(&mut bytes, 4);
    bytes.extend([height, width].iter().flat_map(|number| number.to_le_bytes()));
    text(&mut bytes, encoding);
    bytes.push(0);
    align(&mut bytes, 4);
    bytes.extend(step.to_le_bytes());
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(data);
    bytes
}

#[test]
fn pictures_of_every_encoding_are_what_was_in_them() {
    let grey = |encoding: &str, step: u32, data: &[u8]| {
        picture(&image(2, 2, encoding, step, data)).unwrap().to_8_bit(Some(16))
    };
    assert_eq!(
        grey("mono8", 3, &[1, 2, 9, 3, 4, 9]).grey.pixels(),
        [1, 2, 3, 4],
        "rows may be padded"
    );
    assert_eq!(grey("mono16", 4, &[0, 1, 0, 2, 0, 3, 0, 4]).grey.pixels(), [1, 2, 3, 4]);
    let pixels = [10, 20, 30, 40, 50, 60, 1, 2, 3, 4, 5, 6];
    assert_eq!(grey("rgb8", 6, &pixels).colour.unwrap().pixels()[1], [40, 50, 60]);
    assert_eq!(grey("bgr8", 6, &pixels).colour.unwrap().pixels()[1], [60, 50, 40]);
    for (encoding, data) in [
        ("rggb", [200, 100, 100, 50]),
        ("bggr", [50, 100, 100, 200]),
        ("grbg", [100, 200, 50, 100]),
        ("gbrg", [100, 50, 200, 100]),
    ] {
        let colour = grey(&format!("bayer_{encoding}8"), 2, &data).colour.unwrap();
        assert!(
            colour.pixels().iter().all(|rgb| *rgb == [200, 100, 50]),
            "{encoding}: {:?}",
            colour.pixels()
        );
    }
    let refused = |message: &[u8]| picture(message).unwrap_err();
    assert!(refused(&image(2, 2, "yuv422", 4, &[0; 8])).contains("its encoding is yuv422"));
    assert!(refused(&image(2, 2, "mono8", 2, &[0; 3])).contains("fewer bytes than 2 x 2 pixels"));
}

#[test]
fn messages_of_ros_1_hold_what_those_of_ros_2_do() {
    let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
    // A running number, the time, the frame; then the fields without gaps.
    let header = [&[9u32, 7, 5].map(u32::to_le_bytes).concat()[..], &text("camera")].concat();
    let sides = [2u32, 3].map(u32::to_le_bytes).concat();
    let rows = [3u32, 6].map(u32::to_le_bytes).concat();
    let message = [&header[..], &sides, &text("mono8"), &[0], &rows, &[1, 2, 3, 4, 5, 6]].concat();
    assert_eq!(stamp_ns(&message, Encoding::Ros1), Some(7_000_000_005));
    let kind = "sensor_msgs/Image".to_owned();
    let topic = Topic { name: "/left".to_owned(), kind, encoding: Encoding::Ros1 };
    let read = |message: &[u8]| images::picture(message, &topic);
    let grey = read(&message).unwrap().to_8_bit(None).grey;
    assert_eq!((grey.width(), grey.pixels()), (3, &[1, 2, 3, 4, 5, 6][..]));
    assert!((0..message.len()).all(|len| read(&message[..len]).is_err()));
    // D, K, R and P behind the lens' name.
    let numbers: Vec<u8> = (0..35).flat_map(|at| f64::from(at).to_le_bytes()).collect();
    let count = 5u32.to_le_bytes();
    let info = [&header[..], &sides, &text("plumb_bob"), &count, &numbers].concat();
    let info = CameraInfo::read(&info, Encoding::Ros1).unwrap();
    assert_eq!(info.projection[..2], [23.0, 24.0]);
}

#[test]
fn messages_cut_at_any_byte_are_refused_without_a_panic() {
    let whole = image(4, 3, "mono8", 4, &[5; 12]);
    assert_eq!(stamp_ns(&whole, Encoding::Cdr), Some(7_000_000_005));
    assert_eq!(RawImage::read(&whole, Encoding::Cdr).unwrap().data.len(), 12);
    for len in 0..whole.len() {
        assert!(picture(&whole[..len]).is_err(), "{len}");
        let _ = CameraInfo::read(&whole[..len], Encoding::Cdr);
    }
}

#[test]
fn sizes_that_the_data_does_not_hold_are_refused_before_any_row() {
    let refused = |message: &[u8]| picture(message).unwrap_err();
    // Rows that are 0 bytes apart are all there in one byte.
    let rows = refused(&image(1, 4_000_000_000, "mono8", 0, &[7]));
    assert_eq!(rows, "it is 1 x 4000000000 px; at most 8,192 px a side are read");
    let columns = refused(&image(u32::MAX, 2, "mono8", 2, &[0; 4]));
    assert!(columns.contains("at most 8,192 px a side"), "{columns}");
    let step = refused(&image(1, 8_000, "mono8", 0, &[7]));
    assert_eq!(step, "its rows are 0 bytes apart (step), but 1 px take 1");
    let narrow = refused(&image(4, 2, "rgb8", 11, &[0; 24]));
    assert_eq!(narrow, "its rows are 11 bytes apart (step), but 4 px take 12");
    let far = refused(&image(2, 2, "mono8", u32::MAX, &[0; 4]));
    assert!(far.contains("fewer bytes than 2 x 2 pixels"), "{far}");
    let deep = refused(&image(8_192, 8_192, "mono16", 16_384, &[0; 4]));
    assert!(deep.contains("fewer bytes"), "{deep}");
    // The last row needs no padding.
    let last = picture(&image(2, 2, "mono8", 3, &[1, 2, 9, 3, 4])).unwrap();
    assert_eq!(last.to_8_bit(None).grey.pixels(), [1, 2, 3, 4]);
    assert!(refused(&image(0, 2, "mono8", 0, &[])).contains("no pixels"));
}

#[test]
fn inertial_messages_hold_turn_rates_and_accelerations_in_both_encodings() {
    let numbers: Vec<u8> = (0..37).flat_map(|at| f64::from(at).to_le_bytes()).collect();
    let mut ros2 = vec![0, 1, 0, 0, 7, 0, 0, 0, 5, 0, 0, 0];
    text(&mut ros2, "imu");
    align(&mut ros2, 8);
    ros2.extend(&numbers);
    let header = [9u32, 7, 5, 3].map(u32::to_le_bytes).concat();
    let ros1 = [&header[..], b"imu", &numbers].concat();
    for (message, encoding) in [(ros2, Encoding::Cdr), (ros1, Encoding::Ros1)] {
        let reading = inertial_reading(&message, encoding).unwrap();
        assert_eq!(reading.time_ns, 7_000_000_005);
        assert_eq!(reading.turn_rate, [13.0, 14.0, 15.0]);
        assert_eq!(reading.force, [25.0, 26.0, 27.0]);
        // The last nine numbers are not needed.
        let needed = message.len() - 72;
        assert!((0..needed).all(|len| inertial_reading(&message[..len], encoding).is_none()));
    }
}
