use super::*;
use crate::{
    random::Random,
    volume::{
        VolumeConfig,
        tests::analytic::{LatticeSample, cuboid, empty, fill},
    },
};
use std::{collections::BTreeMap, vec::Vec};

const VOXEL_M: f32 = 0.05;

fn mesh(volume: &Volume<'_>) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    let count = volume.triangles(&MeshConfig::default(), &mut |triangle| triangles.push(triangle));
    assert_eq!(count, triangles.len() as u64);
    triangles
}

fn filled(
    low: [i32; 3],
    high: [i32; 3],
    sample_at: impl Fn([i32; 3]) -> LatticeSample,
) -> Volume<'static> {
    let mut volume = empty(&VolumeConfig::default(), cuboid(low, high).count());
    fill(&mut volume, cuboid(low, high), sample_at);
    volume
}

fn ball(center: [f32; 3], radius: f32) -> impl Fn([i32; 3]) -> LatticeSample {
    move |point| {
        let off: [f32; 3] = core::array::from_fn(|axis| point[axis] as f32 - center[axis]);
        let distance = libm::sqrtf(off.iter().map(|c| c * c).sum()) - radius;
        Some((distance * VOXEL_M, 1, [100, 150, 200]))
    }
}

type Key = [u32; 3];

fn key(vertex: &Vertex) -> Key {
    vertex.position_m.map(|c| (c + 0.0).to_bits())
}

/// Counts how often each directed side is drawn.
fn sides(triangles: &[Triangle]) -> BTreeMap<(Key, Key), usize> {
    let mut sides = BTreeMap::new();
    for triangle in triangles {
        for i in 0..3 {
            *sides
                .entry((key(&triangle.vertices[i]), key(&triangle.vertices[(i + 1) % 3])))
                .or_default() += 1;
        }
    }
    sides
}

fn assert_closed(triangles: &[Triangle]) {
    let sides = sides(triangles);
    for (&(a, b), count) in &sides {
        assert_eq!(sides.get(&(b, a)), Some(count), "a crack");
    }
}

/// Closed, and at each side exactly two triangles meet.
fn assert_manifold(triangles: &[Triangle]) {
    assert_closed(triangles);
    assert!(
        sides(triangles).values().all(|&count| count == 1),
        "more than two triangles at a side"
    );
}

fn euler(triangles: &[Triangle]) -> i64 {
    let mut vertices: Vec<Key> =
        triangles.iter().flat_map(|t| t.vertices.iter().map(key)).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices.len() as i64 - sides(triangles).len() as i64 / 2 + triangles.len() as i64
}

#[test]
fn a_ball_across_many_blocks_becomes_a_closed_sphere_of_its_radius() {
    // Not at lattice points, and with a radius of two blocks.
    let center = [3.3, -1.7, 5.9];
    let triangles = mesh(&filled([-3; 3], [3; 3], ball(center, 15.2)));
    assert_manifold(&triangles);
    // A sphere: vertices less edges plus faces are 2.
    assert_eq!(euler(&triangles), 2);
    let mut sum = 0.0;
    for triangle in &triangles {
        let corners = triangle.vertices.map(|v| {
            nalgebra::Vector3::from(v.position_m) / VOXEL_M - nalgebra::Vector3::from(center)
        });
        for corner in corners {
            // In voxels: linear interpolation of a curved surface is off by a little.
            assert!((corner.norm() - 15.2).abs() < 0.03, "{}", corner.norm());
            sum += corner.norm() - 15.2;
        }
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        assert!(normal.dot(&corners[0]) > 0.0, "counter-clockwise seen from free space");
        assert!(triangle.vertices.iter().all(|v| v.colour == [100, 150, 200]));
    }
    assert!((sum / triangles.len() as f32 / 3.0).abs() < 0.01);
}

#[test]
fn every_place_of_a_small_ball_across_a_block_corner_is_closed() {
    let mut random = Random::new(3);
    for _ in 0..40 {
        let center = [(); 3].map(|()| random.below(8_000) as f32 / 1_000.0 - 4.0);
        let triangles = mesh(&filled([-1; 3], [0; 3], ball(center, 2.6)));
        assert_manifold(&triangles);
        assert_eq!(euler(&triangles), 2);
    }
}

/// A field of random distances closed off by free space; `zeros` percent of them are exactly 0.
fn noise(seed: u64, zeros: u32) -> Volume<'static> {
    let mut random = Random::new(seed);
    let values: Vec<f32> = (0..16 * 16 * 16)
        .map(|_| {
            let size = (1 + random.below(1_000)) as f32 * 0.75 / 1_000.0;
            if random.below(100) < zeros { 0.0 } else { [size, -size][random.below(2) as usize] }
        })
        .collect();
    filled([-1; 3], [0; 3], |p| {
        let rim = p.iter().any(|&c| c == -8 || c == 7);
        let value = values[((p[0] + 8) + 16 * (p[1] + 8) + 256 * (p[2] + 8)) as usize];
        Some((if rim { 0.75 } else { value }, 1, [0; 3]))
    })
}

#[test]
fn a_field_of_random_signs_is_watertight() {
    for seed in 0..20 {
        let triangles = mesh(&noise(seed, 0));
        assert!(triangles.len() > 3_000);
        assert_manifold(&triangles);
    }
}

#[test]
fn distances_of_exactly_zero_open_no_cracks() {
    for seed in 0..20 {
        let triangles = mesh(&noise(seed, 30));
        assert!(triangles.len() > 3_000);
        assert_closed(&triangles);
    }
    // A plane through lattice points.
    let triangles =
        mesh(&filled([0; 3], [1, 1, 0], |p| Some(((p[2] - 4) as f32 * VOXEL_M, 1, [0; 3]))));
    assert_eq!(triangles.len(), 2 * 15 * 15);
    assert!(triangles.iter().flat_map(|t| t.vertices).all(|v| v.position_m[2] == 4.0 * VOXEL_M));
}

#[test]
fn an_unseen_lattice_point_leaves_a_hole_of_the_cells_around_it() {
    let plane = |p: [i32; 3]| ((p[2] as f32 - 3.6) * VOXEL_M, 5, [9; 3]);
    let complete = mesh(&filled([0; 3], [1, 1, 0], |p| Some(plane(p))));
    let holed = mesh(&filled([0; 3], [1, 1, 0], |p| (p != [8, 8, 3]).then(|| plane(p))));
    assert_eq!(complete.len() - holed.len(), 2 * 4);
    // Beyond the last blocks nothing was seen either: 15 cells a side of 16 points.
    assert_eq!(complete.len(), 2 * 15 * 15);
}

#[test]
fn a_minimum_weight_cuts_away_what_was_seen_less_often() {
    let volume = filled([0; 3], [0; 3], |p| {
        Some(((p[2] as f32 - 3.6) * VOXEL_M, if p[0] < 4 { 2 } else { 3 }, [9; 3]))
    });
    let count = |min_weight| volume.triangles(&MeshConfig { min_weight }, &mut |_| ());
    assert_eq!([1, 2, 3, 4].map(count), [2 * 7 * 7, 2 * 7 * 7, 2 * 3 * 7, 0]);
}

#[test]
fn colour_runs_along_the_edge_and_falls_back_to_the_coloured_end() {
    let volume = filled([0; 3], [0; 3], |p| {
        // On the far half of x the near points have no colour.
        let colour = if p[2] <= 3 { [100, 0, 20] } else { [200, 0, 40] };
        Some((
            (p[2] as f32 - 3.25) * VOXEL_M,
            1,
            if p[0] > 3 && p[2] <= 3 { [0; 3] } else { colour },
        ))
    });
    for vertex in mesh(&volume).iter().flat_map(|t| t.vertices) {
        assert_eq!(
            vertex.colour,
            if vertex.position_m[0] > 3.5 * VOXEL_M { [200, 0, 40] } else { [125, 0, 25] }
        );
    }
}

#[test]
fn order_follows_slots_and_two_blocks_agree_on_their_border() {
    let sample_at = ball([8.0, 4.1, 4.2], 2.7);
    let mut there = empty(&VolumeConfig::default(), 2);
    fill(&mut there, cuboid([0; 3], [1, 0, 0]), &sample_at);
    // Two volumes of the same blocks, made in the other order.
    let mut back = empty(&VolumeConfig::default(), 2);
    fill(&mut back, cuboid([1, 0, 0], [1, 0, 0]).chain(cuboid([0; 3], [0; 3])), &sample_at);
    let (there, back) = (mesh(&there), mesh(&back));
    assert_manifold(&there);
    let first = there
        .iter()
        .filter(|t| t.vertices.iter().all(|v| v.position_m[0] <= 8.0 * VOXEL_M))
        .count();
    assert_eq!(
        [&there[first..], &there[..first]].concat(),
        back,
        "the same triangles, the second block's first"
    );
}

/// Keeps the vertices in the order of their names.
#[derive(Default)]
struct Named {
    vertices: Vec<(Vertex, bool)>,
    triangles: Vec<(Triangle, [usize; 3])>,
}

impl MeshSink for Named {
    type Name = usize;

    fn vertex(&mut self, vertex: &Vertex, may_recur: bool) -> usize {
        self.vertices.push((*vertex, may_recur));
        self.vertices.len() - 1
    }

    fn triangle(&mut self, triangle: &Triangle, names: [usize; 3]) {
        self.triangles.push((*triangle, names));
    }
}

#[test]
fn vertices_come_once_in_a_block_and_again_only_where_it_is_said() {
    // With and without distances of exactly 0, where vertices fall together.
    for (seed, zeros) in (0..10).flat_map(|seed| [(seed, 0), (seed, 30)]) {
        let (volume, mut named) = (noise(seed, zeros), Named::default());
        let count = volume.mesh(&MeshConfig::default(), |_| true, &mut named);
        let Named { vertices, triangles } = named;
        let own: Vec<Triangle> = triangles.iter().map(|(triangle, _)| *triangle).collect();
        assert!(own == mesh(&volume) && count == own.len() as u64);
        for (triangle, names) in &triangles {
            assert_eq!(triangle.vertices, names.map(|name| vertices[name].0));
        }
        // In the order of first use.
        let first_uses: Vec<usize> = triangles.iter().flat_map(|(_, names)| names).copied().fold(
            Vec::new(),
            |mut first, name| {
                first.extend((name == first.len()).then_some(name));
                first
            },
        );
        assert_eq!(
            first_uses.len(),
            vertices.len(),
            "each is named by the first triangle that has it"
        );
        let mut times: BTreeMap<Key, usize> = BTreeMap::new();
        vertices.iter().for_each(|(vertex, _)| *times.entry(key(vertex)).or_default() += 1);
        assert!(vertices.iter().all(|(vertex, may_recur)| *may_recur || times[&key(vertex)] == 1));
        let within = vertices.iter().filter(|(_, may_recur)| !may_recur).count();
        assert!(3 * within > vertices.len(), "{within} of {} are within a block", vertices.len());
    }
}

#[test]
fn a_vertex_has_the_weight_of_the_nearer_point() {
    let weight = |p: [i32; 3]| if p[2] <= 3 { 10 } else { 20 };
    // A quarter of the way to the next point, and three quarters.
    for (depth, expected) in [(3.25, 10), (3.75, 20)] {
        let volume = filled([0; 3], [1, 1, 0], |p| {
            Some(((p[2] as f32 - depth) * VOXEL_M, weight(p), [9; 3]))
        });
        let triangles = mesh(&volume);
        assert!(
            triangles.len() > 100
                && triangles
                    .iter()
                    .flat_map(|t| t.vertices)
                    .all(|vertex| vertex.weight == expected)
        );
    }
}
