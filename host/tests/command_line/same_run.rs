//! Two runs compared file by file, timings excepted.

use super::binary::{dynvox, names};
use std::fs;
use std::path::Path;

/// Returns true if a column of frames.csv depends on the machine rather than on the run.
fn of_the_machine(column: &str) -> bool {
    column.ends_with("_ms") || column == "rss_bytes" || column == "probes_most"
}

/// Rows of frames.csv without times.
pub fn rows(folder: &Path) -> Vec<String> {
    let text = fs::read_to_string(folder.join("frames.csv")).unwrap();
    let columns: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let kept = |line: &str| {
        let cells = line.split(',').zip(&columns).filter(|(_, column)| !of_the_machine(column));
        cells.map(|(cell, _)| cell).collect::<Vec<_>>().join(",")
    };
    text.lines().map(kept).collect()
}

/// The summary without times.
pub fn summary(folder: &Path) -> serde_json::Value {
    let mut summary: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.join("summary.json")).unwrap()).unwrap();
    for key in ["seconds", "fps", "stages", "rss_peak_bytes"] {
        assert!(!summary[key].is_null());
        summary[key] = serde_json::Value::Null;
    }
    summary["health"]["probes_most"] = serde_json::Value::Null;
    summary
}

/// Fails where the two runs differ in anything but times.
pub fn assert_same(root: &Path, whole: &str, resumed: &str) {
    let diff = dynvox(root, &["diff", whole, resumed]);
    assert!(diff.status.success(), "{}", String::from_utf8_lossy(&diff.stdout));
    let [a, b] = [whole, resumed].map(|name| root.join(name));
    assert_eq!(rows(&a), rows(&b));
    assert_eq!(summary(&a), summary(&b));
    // These have times, memory and the machine; what else they say was compared above.
    let of_the_machine = ["frames.csv", "summary.json", "report.html"];
    let same_files = |a: &Path, b: &Path| {
        assert_eq!(names(a), names(b));
        for name in names(a)
            .iter()
            .filter(|name| !of_the_machine.contains(&name.as_str()) && a.join(name).is_file())
        {
            assert!(fs::read(a.join(name)).unwrap() == fs::read(b.join(name)).unwrap(), "{name}");
        }
    };
    same_files(&a, &b);
    for folder in ["objects", "pictures"].into_iter().filter(|folder| a.join(folder).is_dir()) {
        same_files(&a.join(folder), &b.join(folder));
    }
}
