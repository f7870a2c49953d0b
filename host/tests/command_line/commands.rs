//! Commands other than `run`: inspect, budget, evaluate.

use super::binary::{dynvox, output_text, rig};
use image::{GrayImage, Luma};
use std::fs;
use tempfile::TempDir;

#[test]
fn inspect_reports_what_a_data_set_holds_and_how_to_map_it() {
    let root = TempDir::new().unwrap();
    rig(root.path(), 2);
    let printed = dynvox(root.path(), &["inspect", "rig"]);
    let text = String::from_utf8_lossy(&printed.stdout).into_owned();
    assert!(printed.status.success());
    for words in [
        "rig: folder",
        "2 stereo pairs of 160 x 64 px",
        "baseline 0.5000 m",
        "no times of the images",
        "at least --memory",
        "dynvox run rig",
    ] {
        assert!(text.contains(words), "{words} in {text}");
    }
    assert!(text.contains("no LiDAR scans") && text.contains("no masks"), "{text}");
    // Paths within a data set lead to its root.
    for (path, words) in [
        ("rig/left", "is a part of the data set rig"),
        ("rig/left/000.png", "is a file"),
        ("nothing", "there is no data set at"),
    ] {
        let printed = dynvox(root.path(), &["inspect", path]);
        assert!(
            !printed.status.success() && output_text(&printed).contains(words),
            "{path}: {}",
            output_text(&printed)
        );
    }
    // The same as JSON.
    let json = |path: &str| -> serde_json::Value {
        serde_json::from_slice(&dynvox(root.path(), &["inspect", path, "--json"]).stdout).unwrap()
    };
    let found = json("rig");
    let described = &found["sequences"][0]["dataset"];
    assert_eq!(
        (&found["layout"], &described["pairs"], &described["width"]),
        (&"folder".into(), &2.into(), &160.into()),
        "{found}"
    );
    assert_eq!(
        (&described["rig"]["baseline_m"], &described["command"]),
        (&0.5.into(), &"dynvox run rig".into()),
        "{found}"
    );
    assert!(
        described["least_bytes"].as_u64().unwrap() > 1 << 20 && described["masks"] == "none",
        "{found}"
    );
    // The folder of a run is recognised, too.
    fs::create_dir_all(root.path().join("run")).unwrap();
    fs::write(root.path().join("run/summary.json"), "{}").unwrap();
    assert_eq!(
        (&json("run")["layout"], json("run")["commands"].as_array().unwrap().len()),
        (&"run".into(), 2)
    );
    let printed = String::from_utf8(dynvox(root.path(), &["inspect", "run"]).stdout).unwrap();
    assert!(
        printed.contains("the results of a run")
            && printed.contains("dynvox evaluate trajectory run TRUTH"),
        "{printed}"
    );
    // Without a calibration inspect still says what is there.
    fs::remove_file(root.path().join("rig/calib.txt")).unwrap();
    let printed = dynvox(root.path(), &["inspect", "rig"]);
    assert!(
        !printed.status.success()
            && String::from_utf8_lossy(&printed.stdout).contains("calib.txt is missing")
    );
    assert!(
        json("rig")["sequences"][0]["error"].as_str().unwrap().contains("calib.txt is missing")
    );
}

#[test]
fn budget_shows_every_profile_and_the_regions_sum_to_the_slab() {
    let root = TempDir::new().unwrap();
    let all = String::from_utf8(dynvox(root.path(), &["budget"]).stdout).unwrap();
    assert!(["tiny", "small", "onboard", "desktop"].iter().all(|name| all.contains(name)));
    let tiny =
        String::from_utf8(dynvox(root.path(), &["budget", "--profile", "tiny"]).stdout).unwrap();
    let bytes = |line: &str| -> u64 {
        let number = line.split_whitespace().find(|word| word.contains(','));
        number.or(line.split_whitespace().nth(1)).unwrap().replace(',', "").parse().unwrap()
    };
    let lines: Vec<&str> = tiny.lines().skip(1).collect();
    // The slab, and how much of it belongs into fast and how much into large memory.
    let (regions, [slab, fast, large]) = lines.split_last_chunk().unwrap();
    assert_eq!(regions.iter().map(|line| bytes(line)).sum::<u64>(), bytes(slab));
    assert_eq!(bytes(fast) + bytes(large), bytes(slab));
    assert_eq!(bytes(slab), dynvox_core::Capacity::TINY.bytes() as u64);
}

#[test]
fn a_budget_is_printed_for_every_language_and_summed_up_for_a_target() {
    let root = TempDir::new().unwrap();
    let asked = ["budget", "--memory", "48MiB", "--image", "752x480", "--raw", "800x500"];
    let text = String::from_utf8(dynvox(root.path(), &asked).stdout).unwrap();
    for line in [
        // TOML, Rust and C name one bound each in their own way.
        "raw_width = 800",
        "    raw_width: 800,",
        "  .raw_width = 800,",
        "  .colour = 0,\n",
        "pruning window: 64 frames",
    ] {
        assert!(text.contains(line), "{line} in {text}");
    }
    let json = |more: &[&str]| -> serde_json::Value {
        serde_json::from_slice(
            &dynvox(root.path(), &[&asked[..], more, &["--json"]].concat()).stdout,
        )
        .unwrap()
    };
    // With the stack and the code it is what a target needs in all.
    let (solved, summed) = (json(&[]), json(&["--stack"]));
    let number = |value: &serde_json::Value| value.as_u64().unwrap();
    let part = |key: &str| number(&summed[0][key]);
    assert_eq!(part("slab_bytes"), number(&solved["bytes"]));
    assert!(part("slab_bytes") > 46 << 20 && part("slab_bytes") <= 48 << 20, "{summed}");
    assert_eq!(part("sum_bytes"), part("slab_bytes") + part("stack_bytes") + part("code_bytes"));
    // A worker's stack is larger than 32 KiB.
    assert!(part("stack_bytes") >= 32 << 10 && part("code_bytes") > 0, "{summed}");
}

#[test]
fn files_are_evaluated_without_a_run() {
    let root = TempDir::new().unwrap();
    rig(root.path(), 1);
    let json = |args: &[&str]| {
        let printed = dynvox(root.path(), args);
        assert!(printed.status.success(), "{}", output_text(&printed));
        serde_json::from_slice::<serde_json::Value>(&printed.stdout).unwrap()
    };
    // The plane as a pair of KITTI 2015: its left half is an object with a true disparity 5 px from
    // the visible one.
    let file_in = |folder: &str| {
        fs::create_dir_all(root.path().join("set/training").join(folder)).unwrap();
        root.path().join("set/training").join(folder).join("000000_10.png")
    };
    fs::copy(root.path().join("rig/left/000.png"), file_in("image_2")).unwrap();
    fs::copy(root.path().join("rig/right/000.png"), file_in("image_3")).unwrap();
    let truth = |u: u32, _: u32| Luma([if u < 80 { 15 * 256u16 } else { 10 * 256 }]);
    image::ImageBuffer::from_fn(160, 64, truth).save(file_in("disp_noc_0")).unwrap();
    GrayImage::from_fn(160, 64, |u, _| Luma([u8::from(u < 80)])).save(file_in("obj_map")).unwrap();
    // The background is right, the object wrong by its 5 px.
    let found = json(&["evaluate", "stereo", "set", "--json"]);
    let regions = &found["regions"];
    assert_eq!(
        (&found["benchmark"], &regions["noc"]["pixels"]),
        (&"kitti-2015".into(), &10_240.into())
    );
    assert!(
        regions["noc_background"]["coverage"].as_f64().unwrap() > 0.6
            && regions["noc_background"]["d1"].as_f64().unwrap() < 0.01,
        "{found}"
    );
    let foreground = &regions["noc_foreground"];
    assert!(
        foreground["d1"].as_f64().unwrap() > 0.99
            && (foreground["mean_signed_error_px"].as_f64().unwrap() + 5.0).abs() < 0.1,
        "{found}"
    );
    assert!(regions["occ"].is_null());
    // The truth itself as an estimate has no error.
    let given =
        json(&["evaluate", "stereo", "set", "--disparity", "set/training/disp_noc_0", "--json"]);
    assert_eq!(
        (&given["regions"]["noc"]["d1_filled"], &given["regions"]["noc"]["coverage"]),
        (&0.0.into(), &1.0.into())
    );
    let printed = String::from_utf8(dynvox(root.path(), &["inspect", "set"]).stdout).unwrap();
    assert!(
        printed.contains("kitti-2015, 1 pairs") && printed.contains("dynvox evaluate stereo set"),
        "{printed}"
    );
    // A folder that is no benchmark.
    let refused = dynvox(root.path(), &["evaluate", "stereo", "rig"]);
    assert!(
        !refused.status.success() && output_text(&refused).contains("is not a stereo benchmark"),
        "{}",
        output_text(&refused)
    );
    // A run's folder against its own poses in the other format.
    let small =
        ["--set", "street.width=160", "--set", "street.height=64", "--set", "street.frames=3"];
    json(&[&["run", "--profile", "tiny", "--out", "run", "--json"], &small[..]].concat());
    let same = json(&["evaluate", "trajectory", "run", "run/trajectory_kitti.txt", "--json"]);
    assert!(
        same["ate_m"].as_f64().unwrap() < 1e-9 && same["rpe_r_deg"].as_f64().unwrap() < 1e-6,
        "{same}"
    );
    let refused = dynvox(root.path(), &["evaluate", "trajectory", "run", "rig/calib.txt"]);
    assert!(
        !refused.status.success() && output_text(&refused).contains("line 1 is not a pose"),
        "{}",
        output_text(&refused)
    );
}

#[test]
fn a_run_of_some_frames_is_evaluated_against_the_true_poses_of_all() {
    let root = TempDir::new().unwrap();
    let street =
        ["street.width=160", "street.height=64", "street.frames=14", "volume.voxel_size_m=0.2"]
            .map(|set| ["--set", set])
            .concat();
    let run = |more: &[&str]| {
        let done = dynvox(
            root.path(),
            &[&["run", "--profile", "tiny", "--quiet"], &street[..], more].concat(),
        );
        assert!(done.status.success(), "{}", output_text(&done));
    };
    // All frames, and four of them.
    run(&["--out", "all"]);
    run(&["--out", "some", "--start", "3", "--stride", "2", "--frames", "4"]);
    let evaluate = |folder: &str, truth: &str| {
        dynvox(root.path(), &["evaluate", "trajectory", folder, truth, "--json"])
    };
    let ate_m = |printed: &std::process::Output| -> f64 {
        assert!(printed.status.success(), "{}", output_text(printed));
        serde_json::from_slice::<serde_json::Value>(&printed.stdout).unwrap()["ate_m"]
            .as_f64()
            .unwrap()
    };
    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(root.path().join("some/summary.json")).unwrap()).unwrap();
    // The same by the rows of the frames as by the run's own truth.
    let by_rows = ate_m(&evaluate("some", "all/trajectory_truth_kitti.txt"));
    assert!((by_rows - ate_m(&evaluate("some", "some/trajectory_truth_kitti.txt"))).abs() < 1e-6);
    assert!((by_rows - summary["egomotion"]["ate_m"].as_f64().unwrap()).abs() < 1e-4, "{by_rows}");
    // A truth that ends too early names the frame it lacks.
    let text = fs::read_to_string(root.path().join("all/trajectory_truth_kitti.txt")).unwrap();
    fs::write(root.path().join("short.txt"), text.lines().take(8).collect::<Vec<_>>().join("\n"))
        .unwrap();
    let refused = evaluate("some", "short.txt");
    assert!(
        output_text(&refused).contains("the run mapped frame 9, and the true poses have 8 rows"),
        "{}",
        output_text(&refused)
    );
}

#[test]
fn a_budget_of_work_follows_the_profile_and_the_settings() {
    let root = TempDir::new().unwrap();
    let most = |more: &[&str]| -> Vec<(String, u64)> {
        let args = [&["budget", "--work", "--json"], more].concat();
        let table: serde_json::Value =
            serde_json::from_slice(&dynvox(root.path(), &args).stdout).unwrap();
        let unit = |row: &serde_json::Value| {
            (row["unit"].as_str().unwrap().to_owned(), row["most"].as_u64().unwrap())
        };
        table["work"].as_array().unwrap().iter().map(unit).collect()
    };
    let of = |name: &str, rows: &[(String, u64)]| {
        rows.iter().find(|(unit, _)| unit == name).map(|(_, most)| *most).unwrap()
    };
    let tiny = most(&["--profile", "tiny"]);
    assert_eq!(of("stereo_pixels", &tiny), 320 * 96);
    assert!(most(&[]).iter().zip(&tiny).all(|((_, onboard), (_, tiny))| onboard >= tiny));
    let fewer = most(&["--profile", "tiny", "--set", "volume.prune_blocks_per_frame=100"]);
    assert_eq!(of("pruned_voxels", &fewer), 100 * 512);
    // Another capacity, found for a number of bytes.
    let solved = most(&["--memory", "48MiB", "--image", "752x480"]);
    assert_eq!(of("stereo_pixels", &solved), 752 * 240, "every second row");
    let refused = dynvox(root.path(), &["budget", "--work", "--set", "volume.nothing=1"]);
    assert!(!refused.status.success());
}
