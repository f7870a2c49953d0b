use super::*;
use crate::request::{Bounds, Memory, Reference, Request};
use serde_json::json;
use std::collections::BTreeSet;
use tempfile::TempDir;

fn request(kinds: &[Kind]) -> SweepRequest {
    let street: Data = "street".parse().unwrap();
    let kitti: Data = "some/where:06".parse().unwrap();
    SweepRequest {
        data: vec![(street, Some(Reference::Exact)), (kitti, Some(Reference::Lidar))],
        kinds: kinds.to_vec(),
        weights: vec![0, 1, 2],
        rates: vec![1, 4],
        scales: vec![100, 50],
        depths: ["elas", "exact"].map(|name| (name.to_owned(), name.parse().unwrap())).to_vec(),
        prune_lag: 20,
        evaluation_delay: 40,
        common: Request {
            bounds: Bounds {
                memory: Memory::Profile("small".to_owned()),
                planning: None,
                keyframes: 0,
            },
            ..Request::default()
        },
    }
}

const ALL: [Kind; 6] =
    [Kind::PruneWeight, Kind::FrameRate, Kind::Scale, Kind::Depth, Kind::Dynamic, Kind::Methods];

fn planned(kinds: &[Kind]) -> Plan {
    Plan::new(&request(kinds)).unwrap()
}

fn result(request: &Request, digest: &str, accuracy: f64) -> RunResult {
    // One share for the input and the map.
    let share = json!({"accuracy": accuracy, "completeness": 0.9, "f1": 0.85});
    RunResult {
        request: request.clone(),
        summary: json!({
            "digest": digest, "frames": 3, "map": {"bytes": 1000, "blocks": 3},
            "lidar": {"source": "exact", "frames": 2, "delay_frames": 0, "static": {"input": share, "fused": share}},
            "egomotion": {"status": "tracking failure", "tracking_failures": 2, "ate_m": 0.5},
        }),
        outcomes: Vec::new(),
        samples: [accuracy - 0.01, accuracy, accuracy + 0.01]
            .map(|accuracy| FrameSample {
                frame: 1,
                accuracy: [Some(accuracy); 2],
                completeness: [Some(0.9), None],
            })
            .to_vec(),
        blocks: vec![10, 20, 30],
        blocks_every: 1,
    }
}

fn results(plan: &Plan) -> Results {
    plan.runs.iter().map(|(key, request)| (key.clone(), result(request, key, 0.92))).collect()
}

#[test]
fn data_is_the_street_a_path_or_a_path_and_a_sequence() {
    let data = |text: &str| text.parse::<Data>().unwrap();
    for world in ["street", "room", "yard", "town"] {
        assert_eq!(data(world).label(), world);
        assert!(data(world).path().is_none());
    }
    assert_eq!(
        data("a/kitti:06"),
        Data {
            source: crate::request::Source::Recording("a/kitti".into()),
            sequence: Some("06".to_owned())
        }
    );
    assert_eq!(
        (data("a/kitti:06").label(), data("a/rig").label()),
        ("06".to_owned(), "rig".to_owned())
    );
    assert_eq!(data(r"C:\rig").sequence, None);
    assert!("".parse::<Data>().is_err());
}

#[test]
fn points_that_mean_the_same_run_share_it() {
    let plan = planned(&ALL);
    let run = |kind: Kind, value: &str| {
        plan.of(kind, "street").find(|point| point.value == value).map(|point| point.run.clone())
    };
    assert_ne!(
        run(Kind::PruneWeight, "1"),
        run(Kind::FrameRate, "1"),
        "weights are swept by the paper's rule, which is not the default"
    );
    assert_eq!(run(Kind::Scale, "100"), run(Kind::Dynamic, "on"));
    assert_eq!(run(Kind::Depth, "elas"), run(Kind::Methods, "stereo egomotion, separate objects"));
    assert_ne!(run(Kind::FrameRate, "1"), run(Kind::Scale, "100"), "the one is looked at late");
    assert!(
        run(Kind::Depth, "exact").is_some() && plan.of(Kind::Depth, "06").count() == 1,
        "only the street has exact depth"
    );
    // By hand: 3 weights and 1 rate late; default, 50 %, off, tracker, motion; on the street exact
    // depth as well. None of the weights is the rate's default.
    assert_eq!(plan.runs.len(), 2 * 10 + 1);
    let paths = plan.runs.values().any(|run| run.words().contains("where"));
    assert!(!paths, "a plan is the same wherever the data lie");
}

#[test]
fn every_run_is_listed_once() {
    let plan = planned(&ALL);
    let keys = plan.keys();
    let distinct: BTreeSet<&str> = keys.iter().copied().collect();
    assert_eq!((keys.len(), distinct.len()), (plan.runs.len(), plan.runs.len()));
}

#[test]
fn a_folder_keeps_to_its_plan_and_to_its_results_requests() {
    let root = TempDir::new().unwrap();
    let plan = planned(&[Kind::Scale]);
    let folder = SweepFolder::open(root.path(), &plan).unwrap();
    let (key, request) = plan.runs.iter().next().unwrap();
    // The result of a run is of the request that the plan has.
    let made = result(request, "aa", 0.9);
    made.write(&folder.result(key)).unwrap();
    let again = SweepFolder::open(root.path(), &plan).unwrap();
    assert_eq!(again.results(&plan).unwrap(), Results::from([(key.clone(), made.clone())]));
    let other = SweepFolder::open(root.path(), &planned(&[Kind::Dynamic]));
    assert!(other.unwrap_err().to_string().contains("belongs to another sweep"));
    // Under the name of one run the result of another.
    result(&Request::default(), "aa", 0.9).write(&folder.result(key)).unwrap();
    assert!(again.results(&plan).unwrap_err().to_string().contains("it is of another request"));
    // As a full disk leaves a file.
    std::fs::write(folder.result(key), "{\"arg").unwrap();
    assert!(again.results(&plan).unwrap_err().to_string().contains("is not a file of a sweep"));
}

#[test]
fn parts_are_put_together_unless_they_disagree() {
    let [a, b, c] = [(); 3].map(|()| TempDir::new().unwrap());
    let plan = planned(&[Kind::Scale]);
    let all = results(&plan);
    // Each part has made every second run.
    for (part, root) in [&a, &b].into_iter().enumerate() {
        let folder = SweepFolder::open(root.path(), &plan).unwrap();
        plan.keys()
            .iter()
            .skip(part)
            .step_by(2)
            .for_each(|key| all[*key].write(&folder.result(key)).unwrap());
    }
    let parts = [a.path().to_path_buf(), b.path().to_path_buf()];
    let (merged, folder, found) = merge(&parts, c.path()).unwrap();
    assert_eq!((&merged, &found), (&plan, &all));
    folder.draw(&merged, &found).unwrap();
    assert!(c.path().join("report.html").is_file() && c.path().join("scale.csv").is_file());
    let (key, request) = plan.runs.iter().next().unwrap();
    // One run with two digests: the parts contradict each other.
    for (root, digest) in [(&a, "one"), (&b, "two")] {
        result(request, digest, 0.9)
            .write(&SweepFolder::open(root.path(), &plan).unwrap().result(key))
            .unwrap();
    }
    let message = merge(&parts, c.path()).unwrap_err().to_string();
    assert!(
        message.contains("but one in an earlier folder") && message.contains(key.as_str()),
        "{message}"
    );
}

#[test]
fn tables_and_page_have_every_point_made_or_not() {
    let plan = planned(&ALL);
    let mut found = results(&plan);
    // A run that several tables show, beside others that were made.
    let whole = plan.of(Kind::Scale, "street").find(|point| point.value == "100");
    let missing = whole.unwrap().run.clone();
    found.remove(&missing).unwrap();
    for kind in ALL {
        let csv = String::from_utf8(table::csv(&plan, kind, &found).unwrap()).unwrap();
        let rows: Vec<csv::StringRecord> =
            csv::Reader::from_reader(csv.as_bytes()).records().collect::<Result<_, _>>().unwrap();
        let points: Vec<&str> = plan
            .points
            .iter()
            .filter(|point| point.kind == kind)
            .map(|point| point.value.as_str())
            .collect();
        assert_eq!(rows.iter().map(|row| &row[1]).collect::<Vec<_>>(), points, "{csv}");
    }
    let page = page::html(&plan, &found).into_string();
    assert_eq!(
        page.matches("not run yet").count(),
        plan.points.iter().filter(|point| point.run == missing).count()
    );
    assert!(page.contains("<b>tracking failure</b> in 2 of 3 frames") && page.contains("0.920"));
    // The original's numbers stand beside ours.
    for theirs in ["0.961", "0.9238", "0.878 / 0.923 / 0.955", "(original)"] {
        assert!(page.contains(theirs), "{theirs}");
    }
    assert!(!page.contains("http") && !page.contains("<script") && !page.contains("NaN"));
}
