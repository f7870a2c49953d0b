//! A sweep as CSV.

use super::{Kind, Plan, Results};
use serde_json::Value;
use std::fmt::Write;

/// One row a point; empty cells where a value is not known, all of them where the run is still to be made.
pub fn csv(plan: &Plan, kind: Kind, results: &Results) -> String {
    let mut out = "data,value,run,frames,reference,evaluated".to_owned();
    for layer in ["static", "dynamic"] {
        for source in ["input", "fused"] {
            for name in ["accuracy", "completeness", "f1"] {
                let _ = write!(out, ",{layer}_{source}_{name}");
            }
        }
    }
    out += ",map_blocks,map_bytes,triangles,swept_triangles,t_err_percent,ate_m,held_frames,tracking_failures,tracking,digest\n";
    for point in plan.points.iter().filter(|point| point.kind == kind) {
        let result = results.get(&point.run);
        let at = |path: &[&str]| -> String {
            let value = result.map(|result| path.iter().fold(&result.summary, |value, key| &value[*key]));
            match value {
                Some(Value::String(text)) => text.clone(),
                Some(Value::Number(number)) => number.to_string(),
                _ => String::new(),
            }
        };
        // Values are words and numbers of our own, without commas but for those of a method's name.
        let _ = write!(out, "{},{},{},{}", point.data, point.value.replace(',', ""), point.run, at(&["frames"]));
        let _ = write!(out, ",{},{}", at(&["lidar", "source"]), at(&["lidar", "frames"]));
        for layer in ["static", "dynamic"] {
            for source in ["input", "fused"] {
                for name in ["accuracy", "completeness", "f1"] {
                    let _ = write!(out, ",{}", at(&["lidar", layer, source, name]));
                }
            }
        }
        for path in [
            ["map", "blocks"],
            ["map", "bytes"],
            ["map", "triangles"],
            ["map", "swept_triangles"],
            ["egomotion", "t_err_percent"],
            ["egomotion", "ate_m"],
            ["egomotion", "held_frames"],
            ["egomotion", "tracking_failures"],
            ["egomotion", "status"],
        ] {
            let _ = write!(out, ",{}", at(&path));
        }
        let _ = writeln!(out, ",{}", at(&["digest"]));
    }
    out
}
