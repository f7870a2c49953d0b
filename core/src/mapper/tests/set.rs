//! Every setting by its key: the keys are read off the configuration's own `Debug` text, so none
//! can be forgotten.

use super::*;
use crate::{SetError, settings::MAX_PROBLEMS, volume::CLASS_COUNT};
use std::{
    format,
    string::{String, ToString},
};

/// A field of the configuration: its key, its value as text, and the line it stands in.
struct Field {
    key: String,
    value: String,
    line: usize,
}

/// All fields that have keys; the calibration has none.
fn fields(config: &Config) -> Vec<Field> {
    let (mut path, mut found) = (Vec::<String>::new(), Vec::new());
    // From the printed fields, so that none can be forgotten here.
    for (line, text) in format!("{config:#?}").lines().enumerate() {
        let text = text.trim().trim_end_matches(',');
        if let Some(struct_name) = text.strip_suffix(" {") {
            path.push(struct_name.split(':').next().unwrap().to_string());
        } else if text == "}" {
            path.pop();
        } else if let Some((name, value)) = text.split_once(": ")
            && path.len() > 1
            && path[1] != "rig"
        {
            let section = path[1..].join(".").replace("rig_settings", "rig");
            found.push(Field { key: format!("{section}.{name}"), value: value.to_string(), line });
        }
    }
    found
}

/// Numbers of the lines in which two configurations differ.
fn differences(one: &Config, other: &Config) -> Vec<usize> {
    let [one, other] = [one, other].map(|config| format!("{config:#?}"));
    assert_eq!(one.lines().count(), other.lines().count());
    one.lines()
        .zip(other.lines())
        .enumerate()
        .filter(|(_, (one, other))| one != other)
        .map(|(line, _)| line)
        .collect()
}

/// Names of all choices.
const CHOICES: [&str; 18] = [
    "stereo", "icp", "mask", "box", "surface", "farther", "ray", "normal", "one", "depth", "band",
    "evict", "refuse", "weight", "support", "apply", "report", "off",
];

#[test]
fn every_setting_is_set_by_its_key_and_nothing_else_is() {
    let base = Walk::config();
    let fields = fields(&base);
    let weights = (1..=CLASS_COUNT).map(|weight| weight.to_string()).collect::<Vec<_>>().join(" ,");
    assert!(fields.len() > 120, "{} fields", fields.len());
    for Field { key, value, line } in fields {
        // Another value than the present one, of the same kind.
        let texts: Vec<&str> = match value.as_str() {
            "true" => vec![" false "],
            "false" => vec!["true"],
            "[" => vec![weights.as_str()],
            number if number.parse::<f64>().is_ok() => {
                vec![if number.parse() == Ok(7.0) { "9" } else { "7" }]
            }
            _ => CHOICES.to_vec(),
        };
        let changed: Vec<Vec<usize>> = texts
            .iter()
            .filter_map(|text| {
                let mut config = base;
                config.set(&key, text).ok().map(|()| differences(&base, &config))
            })
            .filter(|lines| !lines.is_empty())
            .collect();
        assert!(!changed.is_empty(), "{key} = {value} was not changed by {texts:?}");
        // Only the setting's own line of the debug text may change.
        for lines in changed {
            // An array's numbers stand in the lines behind its name.
            let own = if value == "[" { line + 1..line + 1 + CLASS_COUNT } else { line..line + 1 };
            assert!(
                lines.iter().all(|line| own.contains(line)),
                "{key} changed the lines {lines:?}, not {line}"
            );
        }
    }
}

#[test]
fn a_choice_takes_each_of_its_names_and_no_other() {
    let accepted = |key: &str| -> Vec<&str> {
        CHOICES.into_iter().filter(|name| Walk::config().set(key, name).is_ok()).collect()
    };
    for (key, names) in [
        ("mapper.egomotion", &["stereo", "icp"][..]),
        ("tracking.tracks.overlap", &["mask", "box"]),
        ("stereo.gap_ends", &["surface", "farther"]),
        ("volume.distance", &["ray", "normal"]),
        ("volume.observation_weight", &["one", "depth", "band"]),
        ("objects.observation_weight", &["one", "depth", "band"]),
        ("volume.when_full", &["evict", "refuse"]),
        ("volume.prune_rule", &["weight", "support"]),
        ("rig.self_calibration", &["apply", "report", "off"]),
    ] {
        assert_eq!(accepted(key), names, "{key}");
        let of = |name: &str| {
            let mut config = Walk::config();
            config.set(key, name).unwrap();
            format!("{config:?}")
        };
        assert!(names.windows(2).all(|pair| of(pair[0]) != of(pair[1])), "{key}: each is another");
    }
}

#[test]
fn what_is_no_key_or_no_value_changes_nothing() {
    let base = Walk::config();
    // The configuration must be the same after a refusal, in every field.
    let refusal = |key: &str, value: &str| {
        let mut config = base;
        let refused = config.set(key, value).unwrap_err();
        assert!(differences(&base, &config).is_empty(), "{key} = {value}");
        refused
    };
    for key in [
        "",
        "volume",
        "volume.",
        ".far_m",
        "volume.far",
        "volume.far_m.x",
        "maps.far_m",
        "tracking.motion",
        "tracking.motion.x",
        "rig.focal_px",
    ] {
        assert_eq!(refusal(key, "1"), SetError::Key, "{key}");
    }
    // Values that suit no kind of setting.
    for Field { key, value, .. } in fields(&base) {
        for text in ["", "x", "1 2", "1,"] {
            assert_eq!(refusal(&key, text), SetError::Value, "{key} = {text} (now {value})");
        }
    }
    // Too few, too many, too large, too small, and none.
    for (count, last) in [
        (2, "1"),
        (CLASS_COUNT - 1, "1"),
        (CLASS_COUNT + 1, "1"),
        (CLASS_COUNT, "256"),
        (CLASS_COUNT, "-1"),
        (CLASS_COUNT, ""),
    ] {
        let numbers = "1,".repeat(count - 1) + last;
        assert_eq!(refusal("volume.class_weight", &numbers), SetError::Value, "{numbers}");
    }
}

#[test]
fn no_setting_may_be_less_than_nothing_or_no_number() {
    let base = Walk::config();
    assert!(base.validate().is_empty());
    let mut checked = 0;
    for Field { key, value, .. } in
        fields(&base).into_iter().filter(|field| field.value.parse::<f64>().is_ok())
    {
        let mut config = base;
        // Settings that take a number which is none must be found by validation.
        if config.set(&key, "NaN").is_ok() {
            checked += 1;
            let problems = config.validate();
            assert!(!problems.is_empty(), "{key} = {value} may be NaN");
            let section = key.split('.').next().unwrap();
            assert!(
                problems.iter().all(|problem| problem.key.starts_with(section)),
                "{key}: {problems:?}"
            );
        }
    }
    assert!(checked > 60, "{checked} settings");
}

#[test]
fn problems_beyond_the_list_are_dropped_and_the_first_ones_kept() {
    let (mut config, base) = (Walk::config(), Walk::config());
    for Field { key, .. } in fields(&base) {
        let _ = config.set(&key, "NaN");
        // NaN where that is a problem, else 0.
        if config.validate().len() < MAX_PROBLEMS {
            let _ = config.set(&key, "0");
        }
    }
    let problems = config.validate();
    assert_eq!(problems.len(), MAX_PROBLEMS);
    assert!(
        problems
            .iter()
            .all(|problem| problem.to_string() == format!("{} {}", problem.key, problem.rule))
    );
}
