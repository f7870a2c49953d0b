//! Many recordings, one map.

use super::binary::{dynvox, names, output_text};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Three recordings of small streets; the last stands elsewhere in the world, and is turned.
const RECORDINGS: &str = r#"
arguments = [
  "--profile", "tiny", "--instances", "none",
  "--set", "street.width=160", "--set", "street.height=64", "--set", "volume.voxel_size_m=0.1",
]

[[recording]]
name = "first"
arguments = ["--set", "street.frames=4"]

[[recording]]
name = "second"
arguments = ["--set", "street.frames=3", "--set", "street.seed=5"]

[[recording]]
name = "third"
arguments = ["--set", "street.frames=3", "--set", "street.seed=9"]
t_world_camera = [0.8, 0, 0.6, 12.5, 0, 1, 0, 0.03, -0.6, 0, 0.8, -3.7]
"#;

fn done(root: &Path, args: &[&str]) -> String {
    let run = dynvox(root, args);
    assert!(run.status.success(), "{args:?}: {}", output_text(&run));
    String::from_utf8(run.stdout).unwrap()
}

fn planned() -> TempDir {
    let root = TempDir::new().unwrap();
    fs::write(root.path().join("recordings.toml"), RECORDINGS).unwrap();
    assert!(
        done(root.path(), &["fleet", "plan", "recordings.toml", "--out", "jobs"])
            .contains("3 jobs in jobs")
    );
    root
}

fn digest(text: &str) -> &str {
    text.trim().rsplit_once("digest ").unwrap().1
}

#[test]
fn jobs_done_in_shares_are_merged_in_any_order_to_one_map() {
    let root = planned();
    let root = root.path();
    // One share of two; the rest stays open.
    assert!(done(root, &["fleet", "run", "jobs", "--shard", "1/2"]).contains("second is done"));
    let status: serde_json::Value =
        serde_json::from_str(&done(root, &["fleet", "status", "jobs", "--json"])).unwrap();
    let states: Vec<_> =
        status.as_array().unwrap().iter().map(|job| job["state"].as_str().unwrap()).collect();
    assert_eq!(states, ["open", "done", "open"]);
    assert!(status[0]["bytes"].as_u64().unwrap() > 8 << 20);
    // A merge needs all jobs.
    let early = dynvox(root, &["fleet", "merge", "jobs", "--out", "early"]);
    assert!(
        output_text(&early).contains("first, third of jobs are not done")
            && !root.join("early").exists()
    );
    // Only what is open is run.
    let rest = done(root, &["fleet", "run", "jobs"]);
    assert!(
        rest.contains("first is done")
            && rest.contains("third is done")
            && !rest.contains("second"),
        "{rest}"
    );
    assert_eq!(done(root, &["fleet", "run", "jobs"]), "", "all is done");

    let unplaced = dynvox(root, &["fleet", "merge", "jobs", "--out", "whole"]);
    assert!(
        output_text(&unplaced).contains("Carry them there with: dynvox fleet resample jobs"),
        "{}",
        output_text(&unplaced)
    );
    // Sums of the world's lattice, again in shares.
    done(root, &["fleet", "resample", "jobs", "--shard", "0/2"]);
    assert!(
        done(root, &["fleet", "resample", "jobs"]).starts_with("second: "),
        "the others are there"
    );
    let whole = done(root, &["fleet", "merge", "jobs", "--out", "whole"]);
    let maps: Vec<String> =
        names(&root.join("jobs/sums")).iter().map(|id| format!("jobs/sums/{id}")).collect();
    // In another order and in two steps: the same map.
    done(root, &["fleet", "merge", &maps[2], &maps[0], "--out", "two"]);
    let tree = done(root, &["fleet", "merge", &maps[1], "two", "--out", "tree"]);
    assert_eq!(digest(&whole), digest(&tree));
    assert_eq!(names(&root.join("whole")), names(&root.join("tree")));
    let meshed = done(root, &["fleet", "mesh", "whole", "--out", "world.ply"]);
    assert!(
        meshed.contains(" triangles of ")
            && fs::metadata(root.join("world.ply")).unwrap().len() > 10_000,
        "{meshed}"
    );
    // An existing map is not replaced.
    let again = dynvox(root, &["fleet", "merge", "jobs", "--out", "whole"]);
    assert!(output_text(&again).contains("whole exists"), "{}", output_text(&again));
    assert_eq!(
        names(root),
        ["jobs", "recordings.toml", "tree", "two", "whole", "world.ply"],
        "nothing half-written"
    );
}

#[test]
fn the_sums_of_one_map_show_its_own_surface() {
    let root = TempDir::new().unwrap();
    let root = root.path();
    // One recording of the list.
    let first = RECORDINGS.split("[[recording]]\nname = \"second\"").next().unwrap();
    fs::write(root.join("recordings.toml"), first).unwrap();
    done(root, &["fleet", "plan", "recordings.toml", "--out", "jobs"]);
    done(root, &["fleet", "run", "jobs"]);
    done(root, &["fleet", "resample", "jobs"]);
    done(root, &["fleet", "merge", "jobs", "--out", "map"]);
    let meshed = done(root, &["fleet", "mesh", "map", "--out", "map.ply"]);
    let run = root.join("jobs/runs").join(&names(&root.join("jobs/runs"))[0]);
    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(run.join("summary.json")).unwrap()).unwrap();
    // The command prints "map.ply: N triangles".
    let triangles: u64 = meshed
        .split(": ")
        .nth(1)
        .unwrap()
        .split(' ')
        .next()
        .unwrap()
        .replace(',', "")
        .parse()
        .unwrap();
    assert_eq!(Some(triangles), summary["map"]["triangles"].as_u64());
    assert!(!run.join("map.blocks").exists(), "the map is kept in its stead");
}

#[test]
fn what_fails_is_named_and_can_be_repeated_alone() {
    let root = TempDir::new().unwrap();
    let root = root.path();
    super::binary::rig(root, 4);
    let list = "[[recording]]\nname = \"rig\"\narguments = [\"rig\", \"--profile\", \"tiny\"]\n";
    fs::write(root.join("recordings.toml"), list).unwrap();
    done(root, &["fleet", "plan", "recordings.toml", "--out", "jobs"]);
    // An image changes after planning: its job must notice.
    let image = root.join("rig/left/003.png");
    let whole = fs::read(&image).unwrap();
    let mut pixels = image::open(&image).unwrap().into_luma8();
    pixels.get_pixel_mut(80, 40).0[0] ^= 1;
    pixels.save(&image).unwrap();
    let changed = dynvox(root, &["fleet", "run", "jobs"]);
    assert!(
        !changed.status.success()
            && output_text(&changed)
                .contains("rig: its settings or images are not those of the plan"),
        "{}",
        output_text(&changed)
    );
    // With the image of the plan the job runs.
    fs::write(&image, whole).unwrap();
    done(root, &["fleet", "run", "jobs"]);
    let refused = dynvox(root, &["fleet", "plan", "rig/calib.txt", "--out", "other"]);
    assert!(
        output_text(&refused).contains("is no list of recordings")
            && output_text(&refused).contains("[[recording]]"),
        "{}",
        output_text(&refused)
    );
}

#[dynvox_needs::long]
#[test]
fn recordings_are_aligned_carried_into_the_world_and_reported() {
    let root = TempDir::new().unwrap();
    let root = root.path();
    let parts = ["0", "4"].map(|start| {
        format!(
            "[[recording]]\nname = \"from-{start}\"\nepoch = {start}\narguments = \
                 [\"--start\", \"{start}\", \"--frames\", \"6\"]\n"
        )
    });
    let shared = RECORDINGS
        .split("[[recording]]")
        .next()
        .unwrap()
        .replace("\"--profile\"", "\"--set\", \"street.frames=12\", \"--profile\"");
    fs::write(root.join("recordings.toml"), shared + &parts.concat()).unwrap();
    done(root, &["fleet", "plan", "recordings.toml", "--out", "jobs"]);
    // Alignment needs the maps of all jobs.
    let early = dynvox(root, &["fleet", "align", "jobs"]);
    assert!(
        output_text(&early).contains("from-0, from-4 of jobs are not done"),
        "{}",
        output_text(&early)
    );
    done(root, &["fleet", "run", "jobs"]);
    done(root, &["fleet", "resample", "jobs"]);
    let table = done(root, &["fleet", "align", "jobs"]);
    assert!(table.contains("from-4, from-0"), "{table}");
    // The same jobs give the same alignment.
    let file = root.join("jobs/alignment.json");
    let first = fs::read(&file).unwrap();
    done(root, &["fleet", "align", "jobs"]);
    assert_eq!(fs::read(&file).unwrap(), first, "the same bits");
    let alignment: serde_json::Value = serde_json::from_slice(&first).unwrap();
    let along = |at: usize| alignment["recordings"][at]["t_world_camera"][11].as_f64().unwrap();
    assert!(along(0).abs() < 1e-7 && alignment["pairs"][0]["refused"].is_null(), "{alignment}");
    // Four frames of 0.8 m lie between the two; nothing was given, so the limit of what poses may
    // be off does not let it find more.
    // Recordings that moved are resampled again; the others are not.
    let resampled = done(root, &["fleet", "resample", "jobs"]);
    assert!(resampled.contains("from-4: "), "it lies elsewhere now: {resampled}");
    done(root, &["fleet", "merge", "jobs", "--out", "map"]);
    let report = done(root, &["fleet", "report", "jobs", "map", "--out", "report"]);
    assert!(
        report.contains("blocks seen by 2 recordings") && report.contains("between epochs"),
        "{report}"
    );
    assert_eq!(names(&root.join("report")), ["changes.csv", "map.png", "report.json"]);
    let figures: serde_json::Value =
        serde_json::from_slice(&fs::read(root.join("report/report.json")).unwrap()).unwrap();
    assert_eq!(figures["recordings"][1]["frames"], 6);
    assert!(image::open(root.join("report/map.png")).unwrap().width() > 100);
    // An alignment of other jobs is not applied.
    fs::write(&file, String::from_utf8(first).unwrap().replace("\"id\": \"", "\"id\": \"0"))
        .unwrap();
    let other = dynvox(root, &["fleet", "resample", "jobs"]);
    assert!(
        output_text(&other).contains("is not of these jobs. Align again"),
        "{}",
        output_text(&other)
    );
}

/// A list of two recordings: one lies along its fixes, the other's poses are those in the world.
fn georeferenced(root: &Path) {
    let shared = RECORDINGS
        .split("[[recording]]")
        .next()
        .unwrap()
        .replace("\"--profile\"", "\"--set\", \"street.frames=14\", \"--profile\"");
    // On the equator, from 50 m north of the world's origin on, 0.88 m a frame; the first two
    // frames have no fix.
    let fix = |frame: u32| {
        format!(
            "{:.12} 8 90 0 0 {}\n",
            (50.0 + 0.88 * f64::from(frame)) / 110_574.389,
            std::f64::consts::FRAC_PI_2
        )
    };
    let fixes = "-\n-\n".to_owned() + &(2..14).map(fix).collect::<String>();
    fs::write(root.join("fixes.txt"), fixes).unwrap();
    let poses: String = (0..14)
        .map(|frame| format!("1 0 0 60 0 1 0 0 0 0 1 {}\n", 0.8 * f64::from(frame)))
        .collect();
    fs::write(root.join("poses.txt"), poses).unwrap();
    let list = "[[recording]]\nname = \"fixed\"\narguments = []\ngnss = \
        \"fixes.txt\"\n\n[[recording]]\nname = \"posed\"\nposes_in_world = true\n\
                arguments = [\"--start\", \"5\", \"--frames\", \"3\", \"--egomotion\", \
                \"file:poses.txt\"]\n";
    fs::write(root.join("recordings.toml"), format!("origin = [0, 8, 92]\n{shared}{list}"))
        .unwrap();
}

#[test]
fn a_plan_knows_where_fixes_and_poses_place_a_recording() {
    let root = TempDir::new().unwrap();
    let root = root.path();
    georeferenced(root);
    done(root, &["fleet", "plan", "recordings.toml", "--out", "jobs"]);
    let jobs: serde_json::Value =
        serde_json::from_slice(&fs::read(root.join("jobs/jobs.json")).unwrap()).unwrap();
    assert_eq!(
        // The origin is that of the first fix; the pose is that of the poses' file.
        (&jobs["jobs"][0]["gnss"]["origin"][2], &jobs["jobs"][1]["t_world_camera"][11]),
        (&92.0.into(), &4.0.into()),
        "{jobs}"
    );
    let open: serde_json::Value =
        serde_json::from_str(&done(root, &["fleet", "status", "jobs", "--json"])).unwrap();
    // Where fixes place a recording, its pose is not known before its run.
    assert!(open[0]["sums"].is_null() && open[1]["sums"].is_string(), "{open}");
}

#[dynvox_needs::long]
#[test]
fn a_recording_lies_where_its_fixes_or_its_poses_say() {
    let root = TempDir::new().unwrap();
    let root = root.path();
    georeferenced(root);
    done(root, &["fleet", "plan", "recordings.toml", "--out", "jobs"]);
    let ran = done(root, &["fleet", "run", "jobs"]);
    assert!(ran.contains("fixed lies along its fixes, with standard deviations of 0."), "{ran}");
    done(root, &["fleet", "align", "jobs"]);
    let alignment: serde_json::Value =
        serde_json::from_slice(&fs::read(root.join("jobs/alignment.json")).unwrap()).unwrap();
    let at = |axis: usize| alignment["recordings"][0]["given"][4 * axis + 3].as_f64().unwrap();
    assert!(
        at(0).abs() < 0.2 && (at(1) - 2.0).abs() < 0.2 && (at(2) - 50.0).abs() < 0.2,
        "{alignment}"
    );
    // Fixes that never move: the direction is not known any more.
    fs::write(root.join("fixes.txt"), "0 8 90\n".repeat(14)).unwrap();
    let standing = dynvox(root, &["fleet", "resample", "jobs"]);
    assert!(output_text(&standing).contains("is not of these jobs"), "{}", output_text(&standing));
    fs::remove_file(root.join("jobs/alignment.json")).unwrap();
    let standing = dynvox(root, &["fleet", "resample", "jobs"]);
    assert!(
        output_text(&standing).contains("does not say where fixed lies")
            && output_text(&standing).contains("fixed failed")
    );
}
