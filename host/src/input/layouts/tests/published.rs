//! Rendered data sets, as their archives unpack.

use super::*;

/// Files of a recording's folder.
fn write(path: PathBuf, text: &str) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

/// Frames 0 to 3 as both cameras see them.
fn save_frames(path: impl Fn(u32, usize) -> PathBuf) {
    for at in 0..4 {
        pair(at).iter().enumerate().for_each(|(camera, image)| save(image, path(at, camera)));
    }
}

fn vkitti(variation: &Path) {
    save_frames(|at, camera| variation.join(format!("frames/rgb/Camera_{camera}/rgb_{at:05}.png")));
    write(
        variation.join("intrinsic.txt"),
        "frame cameraID K[0,0] K[1,1] K[0,2] K[1,2]\n0 0 50.5 50.5 20 16\n0 1 50.5 50.5 20 16\n",
    );
    // The camera drives forward: the world comes nearer.
    let row = |at: u32, camera: u32| format!("{at} {camera} 1 0 0 0 0 1 0 0 0 0 1 -{at} 0 0 0 1\n");
    let rows: String = (0..4).flat_map(|at| [row(at, 0), row(at, 1)]).collect();
    write(variation.join("extrinsic.txt"), &format!("frame cameraID r1,1 r1,2\n{rows}"));
}

#[test]
fn virtual_kitti_is_read_from_its_root_a_scene_and_a_variation() {
    let root = TempDir::new().unwrap();
    for variation in ["Scene01/clone", "Scene01/fog", "Scene20/clone"] {
        vkitti(&root.path().join(variation));
    }
    let opened = |path: &str, sequence: Option<&str>| {
        let sequence = sequence.map(str::to_owned);
        open(&root.path().join(path), &OpenOptions { sequence, ..OpenOptions::default() })
    };
    for (path, sequence) in [("", Some("Scene01/fog")), ("Scene01", Some("fog")), ("Scene20", None)]
    {
        let dataset = opened(path, sequence).unwrap();
        assert_eq!((dataset.len(), dataset.size()), (4, (40, 32)));
        let rig = dataset.rig();
        assert_eq!((rig.focal_px, rig.baseline_m), (50.5, 0.532_725), "{path}");
        assert_eq!(dataset.truth().unwrap()[3].translation_m, [0.0, 0.0, 3.0]);
    }
    let choice = opened("", None).err().unwrap().to_string();
    assert!(choice.contains("Scene01/clone, Scene01/fog, Scene20/clone"), "{choice}");
    // What is missing or wrong is named.
    let folder = root.path().join("Scene20/clone");
    write(folder.join("extrinsic.txt"), "0 0 2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1\n");
    let scaled = opened("Scene20", None).err().unwrap().to_string();
    assert!(scaled.contains("extrinsic.txt") && scaled.contains("no rotation"), "{scaled}");
    vkitti(&folder);
    fs::remove_file(folder.join("intrinsic.txt")).unwrap();
    let missing = opened("Scene20", None).err().unwrap().to_string();
    assert!(missing.contains("vkitti_2.0.3_textgt"), "{missing}");
}

#[test]
fn spring_has_a_camera_for_each_scene() {
    let root = TempDir::new().unwrap();
    for scene in ["0001", "0002"] {
        let scene = root.path().join(scene);
        let side = |camera: usize| ["left", "right"][camera];
        save_frames(|at, camera| {
            let side = side(camera);
            scene.join(format!("frame_{side}/frame_{side}_{:04}.png", at + 1))
        });
        write(scene.join("cam_data/intrinsics.txt"), "60.5 60.5 20 16\n61 61 20 16\n");
    }
    let sequence = Some("0002".to_owned());
    let options = OpenOptions { sequence, ..OpenOptions::default() };
    let dataset = open(root.path(), &options).unwrap();
    assert_eq!((dataset.len(), dataset.rig().focal_px, dataset.rig().baseline_m), (4, 60.5, 0.065));
    let scene = root.path().join("0001");
    assert_eq!(open(&scene, &OpenOptions::default()).unwrap().len(), 4);
    fs::write(scene.join("cam_data/intrinsics.txt"), "60.5 60.5\n").unwrap();
    let refused = refusal(&scene, None);
    assert!(refused.contains("intrinsics.txt") && refused.contains("--calibration"), "{refused}");
}
