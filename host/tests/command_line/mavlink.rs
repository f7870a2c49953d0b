//! Obstacle messages of a run, as an autopilot receives them.

use super::binary::{dynvox, output_text};
use std::net::UdpSocket;
use std::time::Duration;
use tempfile::TempDir;

/// Kinds of the messages that arrive, in order, and their sequence numbers.
fn received(socket: &UdpSocket) -> (Vec<u32>, Vec<u8>) {
    let mut bytes = [0; 512];
    let mut messages = (Vec::new(), Vec::new());
    while let Ok(len) = socket.recv(&mut bytes) {
        assert_eq!((bytes[0], len), (0xFD, usize::from(bytes[1]) + 12), "one whole MAVLink 2");
        assert_eq!((bytes[5], bytes[6]), (1, 196), "system and component");
        messages.0.push(u32::from_le_bytes([bytes[7], bytes[8], bytes[9], 0]));
        messages.1.push(bytes[4]);
    }
    messages
}

#[test]
fn a_run_sends_directions_and_points_to_an_autopilot() {
    let root = TempDir::new().unwrap();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
    let address = format!("udp:{}", socket.local_addr().unwrap());
    let run = |more: &[&str]| {
        let args = "run --profile small --frames 4 --out result --overwrite --planning 240x240x16 \
                    --set street.width=320 --set street.height=96 --mavlink";
        let args: Vec<&str> =
            args.split_whitespace().chain([address.as_str()]).chain(more.iter().copied()).collect();
        let run = dynvox(root.path(), &args);
        assert!(run.status.success(), "{}", output_text(&run));
        received(&socket)
    };
    let (kinds, sequence) = run(&[]);
    assert_eq!((kinds, sequence), (vec![330; 4], vec![0, 1, 2, 3]));
    let (kinds, sequence) = run(&["--mavlink-points"]);
    assert_eq!((kinds[0], kinds.iter().filter(|kind| **kind == 330).count()), (330, 4));
    assert!(kinds.iter().filter(|kind| **kind == 11_037).count() >= 4, "houses: {kinds:?}");
    assert!((0..).zip(&sequence).all(|(at, number)| *number == at), "{sequence:?}");
}
