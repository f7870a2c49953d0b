use super::*;
use crate::fleet::tile_file::Lattice;
use crate::fleet::{Camera, CameraPose, Given, keep};
use crate::request::Request;
use crate::run::store::BlockFile;
use dynvox_core::geometry::{MapSegment, StereoRig};
use dynvox_core::volume::{BLOCK_VOXELS, BlockCoord, BlockKey, BlockStore, EvictedBlock};

const LATTICE: Lattice = Lattice { voxel_size_m: 0.2, truncation_m: 0.8, colour: false };
const UNCERTAINTY: Uncertainty = Uncertainty { position_m: 0.3, rotation_rad: 0.026 };

/// Distance from a street: ground below, walls to both sides, and pillars of several sizes
/// before them.
fn street([x, y, z]: [f64; 3]) -> f64 {
    let pillar = |nth: i32| {
        let (side, along) = (if nth % 2 == 0 { 4.5 } else { -4.0 }, 3.7 * f64::from(nth));
        let half = 0.4 + 0.15 * f64::from(nth.rem_euclid(4));
        ((x - side).abs() - half).max((z - along).abs() - half)
    };
    let walls = (6.0 - x).min(6.5 + x);
    (-8..25).map(pillar).fold((1.6 - y).min(walls), f64::min)
}

/// Writes the map of a plane 20 m ahead of a recording's pose.
fn record(job: &Job, folder: &Path, t_world_camera: &Transform) {
    record_with(job, folder, t_world_camera, Vec::new());
}

/// Writes that map, of a camera that has been at some poses of it.
fn record_with(job: &Job, folder: &Path, t_world_camera: &Transform, poses: Vec<CameraPose>) {
    let path = folder.join(format!("{}.blocks", job.id));
    let (mut store, _) =
        BlockFile::open(&path, LATTICE.voxel_size_m, LATTICE.truncation_m).unwrap();
    // 10 x 4 x 16 blocks of 1.6 m.
    for block in 0..10 * 4 * 16 {
        let coord = BlockCoord { x: block % 10 - 5, y: block / 10 % 4 - 2, z: block / 40 - 2 };
        let (mut sdf, mut weight) = ([0; BLOCK_VOXELS], [0; BLOCK_VOXELS]);
        for voxel in 0..BLOCK_VOXELS {
            let offset = [voxel % 8, voxel / 8 % 8, voxel / 64].map(|side| side as f64);
            let at = std::array::from_fn(|axis| {
                (f64::from([coord.x, coord.y, coord.z][axis]) * 8.0 + offset[axis]) * 0.2
            });
            // In shares of the truncation.
            let share = street(t_world_camera.transform_point(at)) / 0.8;
            if share > -1.0 {
                (sdf[voxel], weight[voxel]) = ((share.min(1.0) * 32_767.0) as i16, 9);
            }
        }
        let key = BlockKey::in_first(coord);
        assert!(store.store(EvictedBlock { key, sdf: &sdf, weight: &weight, colour: None }));
    }
    let rig = StereoRig { focal_px: 100.0, center_u_px: 50.0, center_v_px: 20.0, baseline_m: 0.5 };
    keep(&mut store, &LATTICE, &Camera { rig, size: (100, 40), poses }, &job.submap(folder))
        .unwrap();
}

fn job(nth: usize, given: &Transform) -> Job {
    Job {
        name: format!("part {nth}"),
        id: format!("{nth:016x}"),
        request: Request::default(),
        given: Given::TWorldCamera(rows_of(given)),
        epoch: 0,
        bytes: 0,
    }
}

#[test]
fn recordings_two_tenths_of_a_metre_and_a_degree_off_are_aligned() {
    let root = tempfile::TempDir::new().unwrap();
    std::fs::create_dir_all(root.path().join("submaps")).unwrap();
    // Three that see one street, twelve metres apart, and one far away.
    let truth = [
        Transform::IDENTITY,
        Transform::new([0.0, 0.05, 0.0], [0.3, 0.0, 12.0]),
        Transform::new([0.0, -0.08, 0.01], [-0.4, 0.1, 24.0]),
        Transform::from_translation([400.0, 0.0, 5.0]),
    ];
    // The position is off in the world's axes, the direction about the pose itself.
    let off = |at: usize, turn: [f64; 3], shift: [f64; 3]| {
        let moved = std::array::from_fn(|axis| truth[at].translation_m[axis] + shift[axis]);
        let turned =
            Transform::new(turn, [0.0; 3]) * Transform { translation_m: [0.0; 3], ..truth[at] };
        Transform { translation_m: moved, ..turned }
    };
    let degree = 1f64.to_radians();
    let given = [
        truth[0],
        off(1, [0.0, degree, 0.0], [0.12, -0.1, 0.12]),
        off(2, [0.6 * degree, -0.8 * degree, 0.0], [-0.15, 0.05, -0.12]),
        off(3, [0.0, degree, 0.0], [0.2, 0.0, 0.0]),
    ];
    let manifest = Manifest {
        program: String::new(),
        jobs: given.iter().enumerate().map(|(nth, given)| job(nth, given)).collect(),
    };
    manifest.jobs.iter().zip(&truth).for_each(|(job, truth)| record(job, root.path(), truth));
    // The uncertainty of given poses bounds how far they may be moved.
    let alignment = Alignment::find(&manifest, root.path(), &UNCERTAINTY).unwrap();
    alignment.write(root.path()).unwrap();
    let found: Vec<Transform> =
        poses(&manifest, root.path()).unwrap().into_iter().map(Result::unwrap).collect();
    for at in 0..3 {
        let error = truth[at].inverse() * found[at];
        assert!(error.distance_m() < 0.03, "{at}: {} m, {alignment:?}", error.distance_m());
        assert!(
            error.angle_rad().to_degrees() < 0.1,
            "{at}: {} degrees",
            error.angle_rad().to_degrees()
        );
    }
    assert!((found[3].inverse() * given[3]).distance_m() < 1e-9, "without overlap it stays");
    // Each registration fits better than before.
    assert!(
        alignment
            .pairs
            .iter()
            .all(|pair| pair.fit.refused.is_none() && pair.fit.rms_m < pair.fit.rms_before_m),
        "{alignment:?}"
    );
    // The same each time, to the bit.
    assert_eq!(alignment, Alignment::find(&manifest, root.path(), &UNCERTAINTY).unwrap());
    let mut others = manifest;
    let moved = Transform::from_translation([0.1, 0.0, 0.0]) * given[1];
    others.jobs[1].given = Given::TWorldCamera(rows_of(&moved));
    assert!(poses(&others, root.path()).unwrap_err().to_string().contains("is not of these jobs"));
}

#[test]
fn a_pose_farther_off_than_it_may_be_is_refused_by_name() {
    let root = tempfile::TempDir::new().unwrap();
    std::fs::create_dir_all(root.path().join("submaps")).unwrap();
    let given = [Transform::IDENTITY, Transform::from_translation([0.4, 0.0, 12.0])];
    let manifest = Manifest {
        program: String::new(),
        jobs: given.iter().enumerate().map(|(nth, given)| job(nth, given)).collect(),
    };
    record(&manifest.jobs[0], root.path(), &given[0]);
    record(&manifest.jobs[1], root.path(), &Transform::from_translation([0.0, 0.0, 12.0]));
    // A twentieth of what the pose is off.
    let sure = Uncertainty { position_m: 0.05, rotation_rad: 0.001 };
    let alignment = Alignment::find(&manifest, root.path(), &sure).unwrap();
    let why = alignment.pairs[0].fit.refused.clone().unwrap();
    assert!(why.contains("more than the given poses may be off"), "{why}");
    // A refused registration moves nothing.
    assert!(alignment.recordings.iter().all(|of| of.moved_m < 1e-6), "{alignment:?}");
}

/// Three parts along a street, which turn by an angle between them that their camera does not
/// notice, and a recording at the end of the way whose pose is exact. Returns how far the parts are
/// off as given, and after alignment, m.
fn parts_off_m(unnoticed_rad: f64) -> [[f64; 3]; 2] {
    let root = tempfile::TempDir::new().unwrap();
    std::fs::create_dir_all(root.path().join("submaps")).unwrap();
    let ahead = |way_m: f64| Transform::from_translation([0.0, 0.0, way_m]);
    let on = ahead(12.0) * Transform::new([0.0, unnoticed_rad, 0.0], [0.0; 3]);
    let (truth, exact) = ([Transform::IDENTITY, on, on * on], ahead(26.0));
    let mut jobs: Vec<Job> = (0..3).map(|nth| job(nth, &Transform::IDENTITY)).collect();
    for part in 1..3 {
        jobs[part].given = Given::Follows(jobs[part - 1].id.clone());
    }
    jobs.push(job(3, &exact));
    let manifest = Manifest { program: String::new(), jobs };
    let camera = |frame: usize, t_map_camera: Transform| CameraPose {
        frame,
        time_s: None,
        segment: MapSegment::FIRST,
        t_map_camera,
    };
    for (part, truth) in truth.iter().enumerate() {
        // The last frame of a part is the first of the next.
        let poses = vec![camera(part, Transform::IDENTITY), camera(part + 1, ahead(12.0))];
        record_with(&manifest.jobs[part], root.path(), truth, poses);
    }
    record(&manifest.jobs[3], root.path(), &exact);
    let off_m = || {
        let found = poses(&manifest, root.path()).unwrap();
        std::array::from_fn(|at| (truth[at].inverse() * *found[at].as_ref().unwrap()).distance_m())
    };
    let given_m = off_m();
    Alignment::find(&manifest, root.path(), &UNCERTAINTY).unwrap().write(root.path()).unwrap();
    [given_m, off_m()]
}

#[test]
fn parts_that_fit_are_registered() {
    let [given_m, found_m] = parts_off_m(0.007);
    assert!(given_m[2] > 0.08 && found_m.iter().all(|m| *m < 0.03), "{given_m:?}, {found_m:?}");
}

#[test]
fn parts_that_do_not_fit_bend_where_they_share_frames() {
    let [given_m, found_m] = parts_off_m(0.0175);
    assert!(given_m[2] > 0.2 && found_m[2] < 0.08, "{given_m:?}, {found_m:?}");
}
