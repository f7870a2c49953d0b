//! What is written can be read.

use super::*;
use dynvox_core::geometry::Transform;
use dynvox_core::view::Vertex;
use nalgebra::Vector3;
use std::fs;
use tempfile::TempDir;

fn poses() -> Vec<dynvox_core::geometry::Transform> {
    (0..5)
        .map(|i| {
            Transform::new(
                Vector3::new(0.01, 0.3, -0.02) * f64::from(i),
                Vector3::new(1.0 / 3.0, -1e-9, 1_234.567_891_234_5) * f64::from(i),
            )
        })
        .collect()
}

#[test]
fn kitti_trajectories_are_read_back_as_they_were() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("t.txt");
    fs::write(&path, poses().iter().map(kitti_line).collect::<String>()).unwrap();
    for (read, written) in read_poses(&path).unwrap().poses.iter().zip(poses()) {
        assert_eq!(read.translation_m, written.translation_m, "to the last bit");
        assert!((read.inverse() * written).angle_rad() < 1e-7);
    }
}

#[test]
fn tum_trajectories_keep_every_digit_of_time_and_pose() {
    let times_ns = [
        0,
        103_730_000,
        1_317_354_879_123_456_000,
        1_317_354_879_123_457_001,
        2_000_000_000_000_000_000,
    ];
    let text: String =
        times_ns.iter().zip(poses()).map(|(time_ns, pose)| tum_line(*time_ns, &pose)).collect();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .map(|line| line.split(' ').map(|word| word.parse().unwrap()).collect())
        .collect();
    for ((row, time_ns), pose) in rows.iter().zip(times_ns).zip(poses()) {
        let ([x, y, z], [i, j, k, w]) = (pose.translation_m, pose.rotation);
        assert_eq!(*row, [time_ns as f64 / 1e9, x, y, z, i, j, k, w]);
    }
}

#[test]
fn a_mesh_shares_recent_vertices_and_its_header_counts_are_true() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("map.ply");
    let mut ply = PlyWriter::begin(&path).unwrap();
    let corner = |x: f32, y: f32| Vertex {
        position_m: [x, y, 2.0],
        colour: [10, 20, 30],
        weight: 40 + x as u8,
    };
    ply.triangle([corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)]);
    ply.triangle([corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)]);
    assert_eq!(ply.finish().unwrap(), Mesh { vertices: 4, triangles: 2, object_triangles: 0 });
    let bytes = fs::read(&path).unwrap();
    let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    assert!(
        header.contains("element vertex 0000000004\n")
            && header.contains("element face 0000000002\n"),
        "{header}"
    );
    let body = &bytes[end..];
    assert_eq!(body.len(), 4 * 32 + 2 * 13);
    let face = |at: usize| {
        let face = &body[4 * 32 + 13 * at..][..13];
        (
            face[0],
            [1, 5, 9].map(|from| u32::from_le_bytes(face[from..from + 4].try_into().unwrap())),
        )
    };
    assert_eq!((face(0), face(1)), ((3, [0, 1, 2]), (3, [1, 3, 2])));
    let number = |at: usize| f32::from_le_bytes(body[at..at + 4].try_into().unwrap());
    assert_eq!(
        [32, 12, 16, 20].map(number),
        [1.0, 0.0, 0.0, 1.0],
        "the second vertex and the first one's normal"
    );
    assert_eq!(
        (&body[24..28], &body[56..60]),
        (&[10, 20, 30, 40][..], &[10, 20, 30, 41][..]),
        "colours and weights"
    );
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "the file of faces is gone");
}

#[test]
fn a_mesh_without_colours_has_no_properties_of_colour() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("map.ply");
    let mut ply = PlyWriter::begin_with(&path, "a test", Axes::Camera, false).unwrap();
    ply.begin_object(7);
    let corner =
        |x: f32, y: f32| Vertex { position_m: [x, y, 2.0], colour: [0; 3], weight: 40 + x as u8 };
    ply.triangle([corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)]);
    ply.finish().unwrap();
    let bytes = fs::read(&path).unwrap();
    let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    assert!(!header.contains("red") && header.contains("uchar weight"), "{header}");
    assert_eq!(bytes.len() - end, 3 * 29 + 13);
    let mut corners = Vec::new();
    PlyMesh::open(&path).unwrap().triangles(|triangle| corners.extend(triangle)).unwrap();
    let [_, second, _] = corners[..] else { panic!("{corners:?}") };
    assert_eq!((second.object, second.vertex), (7, corner(1.0, 0.0)));
}
