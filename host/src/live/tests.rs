//! The page's answers as a browser gets them, and who gets none.

use super::*;
use crate::slab::HostSlab;
use crate::volume_copy::VolumeCopy;
use dynvox_core::geometry::{StereoRig, Transform};
use dynvox_core::image::View;
use dynvox_core::memory::Carver;
use dynvox_core::view::{MeshConfig, Triangle};
use dynvox_core::volume::{DepthImage, NoStore, Observation, Viewpoint, Volume, VolumeConfig};
use dynvox_core::{Capacity, Serial};
use serde_json::Value;
use std::collections::HashSet;
use std::io::{Read, Write};
use std::net::TcpStream;

/// Status and body of an answer.
type Answered = (u16, Vec<u8>);

/// Sends a request to a live view's port.
fn ask(live: &LiveView, method: &str, path: &str, host: Option<&str>) -> Answered {
    let authority = live.url().split('/').nth(2).unwrap();
    let mut stream = TcpStream::connect(authority).unwrap();
    let host = host.unwrap_or(authority);
    write!(stream, "{method} {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n")
        .unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    let end = answer.windows(4).position(|four| four == b"\r\n\r\n").unwrap();
    let head = String::from_utf8_lossy(&answer[..end]).into_owned();
    let status = head.split(' ').nth(1).unwrap().parse().unwrap();
    (status, answer[end + 4..].to_vec())
}

/// The path of something below the token.
fn below(live: &LiveView, name: &str) -> String {
    format!("/{}/{name}", live.url().split('/').nth(3).unwrap())
}

fn news(live: &LiveView, version: u64, positions: usize) -> Value {
    let path = below(live, &format!("news?since={version}&path={positions}"));
    let (status, body) = ask(live, "GET", &path, None);
    assert_eq!(status, 200);
    serde_json::from_slice(&body).unwrap()
}

/// A wall that crosses the border between regions, in a volume.
fn with_wall(test: impl FnOnce(&Volume<'_>)) {
    const WIDTH: usize = 96;
    const HEIGHT: usize = 64;
    let capacity = Capacity { blocks: 2_000, ..Capacity::TINY };
    let config = VolumeConfig { truncation_m: 0.2, ..VolumeConfig::default() };
    let bytes = Volume::bytes(&capacity);
    let mut slab = HostSlab::map(bytes).unwrap();
    let mut volume =
        Volume::new_in(&capacity, &config, &mut Carver::new(slab.bytes_mut(), bytes).unwrap());
    let rig = StereoRig { focal_px: 80.0, center_u_px: 48.0, center_v_px: 32.0, baseline_m: 0.5 };
    let view = Viewpoint { rig, width: WIDTH, height: HEIGHT, t_world_camera: Transform::IDENTITY };
    let (grey, depth_m) = (vec![90; WIDTH * HEIGHT], vec![4.0; WIDTH * HEIGHT]);
    let depth_m = View::new(&depth_m, WIDTH, HEIGHT).unwrap();
    let seen = Observation {
        depth: DepthImage::Plain(depth_m),
        grey: View::new(&grey, WIDTH, HEIGHT).unwrap(),
        colour: None,
        class: None,
    };
    volume.allocate(&view, depth_m, &mut NoStore, &Serial);
    volume.fuse(&view, seen, &Serial);
    test(&volume);
}

#[test]
fn only_who_knows_the_address_gets_the_page() {
    let live = LiveView::begin().unwrap();
    let (status, page) = ask(&live, "GET", &below(&live, ""), None);
    let page = String::from_utf8(page).unwrap();
    assert!(status == 200 && page.contains("class LivePage") && page.contains("class Renderer"));
    assert_eq!(ask(&live, "GET", "/", None).0, 404);
    assert_eq!(ask(&live, "GET", "/0123456789abcdef0123456789abcdef/", None).0, 404);
    // A name that somebody lets resolve to this machine.
    assert_eq!(ask(&live, "GET", &below(&live, ""), Some("evil.example")).0, 403);
    assert_eq!(ask(&live, "POST", &below(&live, ""), None).0, 405);
    let another = LiveView::begin().unwrap();
    assert_ne!(below(&live, ""), below(&another, ""));
}

#[test]
fn news_tell_what_is_new() {
    let live = LiveView::begin().unwrap();
    assert!(!live.is_watched());
    for frame in 0..3 {
        let pose = [f64::from(frame), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        live.add_frame(LiveFigures {
            frame: 7,
            frames: 3,
            severity: "info",
            pose,
            ..Default::default()
        });
    }
    let first = news(&live, 0, 0);
    assert!(live.is_watched());
    assert_eq!(first["path"].as_array().unwrap().len(), 3);
    assert_eq!(first["figures"]["frames"], 3);
    let version = first["version"].as_u64().unwrap();
    assert!(news(&live, version, 3)["path"].as_array().unwrap().is_empty());
    assert_eq!(ask(&live, "GET", &below(&live, "left?version=1"), None).0, 404);
    live.show(LivePictures { left: vec![1, 2, 3], ..LivePictures::default() });
    assert_eq!(ask(&live, "GET", &below(&live, "left?version=1"), None), (200, vec![1, 2, 3]));
    assert_eq!(ask(&live, "GET", &below(&live, "masks?version=1"), None).0, 404);
}

#[test]
fn regions_together_are_the_whole_mesh() {
    with_wall(|volume| {
        let mesh = MeshConfig { min_weight: 1 };
        let whole = volume.triangles(&mesh, &mut |_: Triangle| ());
        let keys = || volume.pool().live().filter_map(|slot| volume.blocks().key(slot));
        let regions: HashSet<_> = keys().map(MapRegion::new).collect();
        assert!(regions.len() > 2 && whole > 100, "{} regions", regions.len());
        let live = LiveView::begin().unwrap();
        // Region by region, each with no more blocks than it needs.
        for region in regions {
            let blocks = VolumeCopy::of_blocks(volume, |key| {
                MapRegion::touched_by(key).any(|touched| touched == region)
            });
            while !live.can_draw() {
                thread::sleep(Duration::from_millis(1));
            }
            assert!(live.draw(MapUpdate { regions: vec![region], blocks, mesh }));
        }
        while !live.can_draw() {
            thread::sleep(Duration::from_millis(1));
        }
        let answer = news(&live, 0, 0);
        assert_eq!(answer["triangles"].as_u64(), Some(whole));
        let id = answer["regions"][0].as_u64().unwrap();
        let (status, bytes) = ask(&live, "GET", &below(&live, &format!("region?id={id}")), None);
        let size = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
        let heads: Value = serde_json::from_slice(&bytes[4..4 + size]).unwrap();
        let tiles: u64 =
            heads.as_array().unwrap().iter().map(|head| head["bytes"].as_u64().unwrap()).sum();
        assert!(status == 200 && 4 + size + tiles as usize == bytes.len());
        let version = answer["version"].as_u64().unwrap();
        assert!(news(&live, version, 0)["regions"].as_array().unwrap().is_empty());
    });
}
