//! A fixture of one's own: made, verified, one pixel changed and found, blessed.

use super::binary::{dynvox, names, output_text};
use std::fs;
use std::path::Path;
use std::process::Output;
use tempfile::TempDir;

/// A street, and a fixture of six of its frames.
fn pinned() -> TempDir {
    let root = TempDir::new().unwrap();
    // As small as a profile allows, since fixtures are packed into firmware.
    let size = ["--set", "street.width=320", "--set", "street.height=96"];
    assert!(
        dynvox(root.path(), &[&["synth", "--out", "street", "--frames", "8"], &size[..]].concat())
            .status
            .success()
    );
    let made = dynvox(
        root.path(),
        &[
            "fixtures",
            "new",
            "pinned",
            "--from",
            "street",
            "--frames",
            "6",
            "--start",
            "1",
            "--memory",
            "24MiB",
            "--set",
            "volume.voxel_size_m=0.1",
        ],
    );
    assert!(made.status.success(), "{}", output_text(&made));
    assert!(printed(&made).contains("pinned: 6 frames, replayed in "), "{}", printed(&made));
    root
}

fn printed(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn change_a_pixel(path: &Path) {
    let mut picture = image::open(path).unwrap().into_luma8();
    picture.get_pixel_mut(200, 60).0[0] ^= 0x40;
    picture.save(path).unwrap();
}

#[test]
fn a_fixture_is_made_verified_found_changed_and_blessed() {
    let root = pinned();
    let root = root.path();
    assert_eq!(
        names(&root.join("pinned")),
        [
            "blessings.txt",
            "calib.txt",
            "digests.txt",
            "fixture.toml",
            "instances",
            "left",
            "right",
            "settings.toml"
        ]
    );
    assert_eq!(
        (names(&root.join("pinned/left")).len(), names(root)),
        (6, vec!["pinned".to_owned(), "street".to_owned()])
    );
    let verified = dynvox(root, &["fixtures", "verify", "pinned", "--junit", "report.xml"]);
    assert!(
        verified.status.success()
            && printed(&verified).contains("pinned: 6 frames, all digests equal"),
        "{}",
        output_text(&verified)
    );
    assert!(
        fs::read_to_string(root.join("report.xml")).unwrap().contains("tests=\"6\" failures=\"0\"")
    );

    // One grey level of one pixel.
    change_a_pixel(&root.join("pinned/right/000003.png"));
    let golden = fs::read(root.join("pinned/digests.txt")).unwrap();
    let verified =
        dynvox(root, &["fixtures", "verify", "pinned", "--json", "--junit", "report.xml"]);
    assert_eq!(verified.status.code(), Some(1));
    assert!(
        output_text(&verified).contains("dynvox fixtures bless pinned --reason"),
        "{}",
        output_text(&verified)
    );
    let verdicts: serde_json::Value = serde_json::from_slice(&verified.stdout).unwrap();
    let differences = &verdicts[0]["differences"];
    assert_eq!(
        (&differences[0]["frame"], &differences[0]["columns"][0]),
        (&3.into(), &"input".into()),
        "{verdicts}"
    );
    let report = fs::read_to_string(root.join("report.xml")).unwrap();
    assert!(
        report.contains("name=\"frame 3\"><failure message=\"digests differ: input"),
        "{report}"
    );
    // A dry run says what a blessing would change, and writes nothing.
    let dry = dynvox(root, &["fixtures", "bless", "pinned", "--dry-run", "--json"]);
    let dry: serde_json::Value = serde_json::from_slice(&dry.stdout).unwrap();
    assert!(!dry[0]["differences"].as_array().unwrap().is_empty(), "{dry}");
    let dry = dynvox(root, &["fixtures", "bless", "pinned", "--dry-run"]);
    assert!(
        dry.status.success() && printed(&dry).contains("first divergence: frame 3, input"),
        "{}",
        printed(&dry)
    );
    assert!(fs::read(root.join("pinned/digests.txt")).unwrap() == golden, "nothing is written");
    let blessed = dynvox(root, &["fixtures", "bless", "pinned", "--reason", "another sensor"]);
    assert!(blessed.status.success(), "{}", output_text(&blessed));
    assert!(dynvox(root, &["fixtures", "verify", "pinned"]).status.success());
    // The log keeps what the fixture was made of, and why it changed.
    let log = fs::read_to_string(root.join("pinned/blessings.txt")).unwrap();
    assert!(
        log.lines().next().unwrap().ends_with("Made of kitti-odometry-00, frames 1 to 6")
            && log.ends_with(" another sensor\n"),
        "{log}"
    );
}

#[test]
fn bounds_and_settings_are_packed_as_rust_beside_the_clip() {
    let root = pinned();
    let packed = dynvox(
        root.path(),
        &["fixtures", "pack", "pinned", "--out", "clip.bin", "--rust", "clip.rs"],
    );
    assert!(packed.status.success(), "{}", output_text(&packed));
    let text = fs::read_to_string(root.path().join("clip.rs")).unwrap();
    // The bounds and settings as Rust constants, for builds without a file system.
    for line in [
        "image_width: 320,",
        "image_height: 96,",
        "voxel_size_m: 0.1,",
        "pub const CAPACITY: Capacity = Capacity {",
    ] {
        assert!(text.contains(line), "{line} in {text}");
    }
    let clip = fs::read(root.path().join("clip.bin")).unwrap();
    assert_eq!(dynvox_clip::Clip::new(&clip).unwrap().len(), 6);
}

#[test]
fn settings_and_bounds_belong_to_the_fixture_and_bad_ones_are_named() {
    let root = pinned();
    let root = root.path();
    let settings = root.join("pinned/settings.toml");
    let text = fs::read_to_string(&settings).unwrap();
    let verify = |sentence: &str| {
        let verified = dynvox(root, &["fixtures", "verify", "pinned"]);
        let all = output_text(&verified) + &printed(&verified);
        assert!(!verified.status.success() && all.contains(sentence), "{sentence}: {all}");
    };
    // Settings and bounds of the fixture decide, not the program's defaults.
    fs::write(&settings, text.replace("voxel_size_m = 0.1", "voxel_size_m = 0.11")).unwrap();
    verify("first divergence: frame 0, static_map");
    fs::write(&settings, text.replace("voxel_size_m", "voxel_sise_m")).unwrap();
    verify("objects.voxel_sise_m = 0.05: there is no such setting");
    fs::write(&settings, &text).unwrap();
    let bounds = fs::read_to_string(root.join("pinned/fixture.toml")).unwrap();
    fs::write(
        root.join("pinned/fixture.toml"),
        bounds.replace("image_height = 96", "image_height = 64"),
    )
    .unwrap();
    verify("its bounds do not hold images of 320 x 96 px");
    // An existing folder is not replaced.
    let again = dynvox(root, &["fixtures", "new", "pinned", "--from", "street"]);
    assert!(output_text(&again).contains("pinned exists"), "{}", output_text(&again));
    let refused =
        dynvox(root, &["fixtures", "new", "other", "--from", "street", "--memory", "1MiB"]);
    assert!(
        output_text(&refused).contains("the least that works is") && !root.join("other").exists(),
        "{}",
        output_text(&refused)
    );
}
