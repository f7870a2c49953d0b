//! Command `settings`: every setting with its unit, range, default and meaning, from the rows that
//! the program itself goes by.

use crate::formats::calibration::RectifiedSize;
use crate::request::{Settings, Worlds, leaves};
use crate::synth::{RoomConfig, StreetConfig, TownConfig};
use anyhow::bail;
use clap::Args;
use dynvox_core::Config;
use dynvox_core::settings::{About, Range, Setting, Tier};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Head of the page `docs/settings.md`.
const HEAD: &str = "\
# Settings

Everything that can be configured besides the rig's calibration. `dynvox run --set KEY=VALUE` \
sets one, `--config FILE` takes a
TOML file with some or all of them; the `config.toml` of a run has all. Unknown keys are refused. \
`dynvox settings KEY` prints one.
C: `dynvox_config_set`; Python: `set={\"KEY\": VALUE}`. Units are in the names. *Published* is \
the value of the original or of the
paper behind a stage, where it differs from the default. A key without a default is unset. \
Settings marked *user* are those that
another camera, scene, machine or robot asks for; the others are for who studies a stage.

`dynvox settings --markdown > docs/settings.md` writes this page.
";
/// Keys of the list that a misspelt one is answered with.
const SUGGESTIONS: usize = 5;

/// Arguments of the command.
#[derive(Debug, Args)]
pub struct SettingsArgs {
    /// A key, or the beginning of keys: `volume.far_m`, `volume`. Without one, all that a user of
    /// another camera, scene or machine may want to set
    #[arg(value_name = "KEY")]
    key: Option<String>,
    /// List the settings for experts as well
    #[arg(long)]
    all: bool,
    /// Print the page docs/settings.md
    #[arg(long, conflicts_with_all = ["key", "all"])]
    markdown: bool,
}

/// A row with its default.
struct Row {
    about: About,
    /// The default as in a file; empty where it is unset.
    default: String,
}

/// Runs the command.
pub fn run(args: &SettingsArgs) -> anyhow::Result<()> {
    let rows = rows()?;
    if args.markdown {
        out!("{}", page(&rows));
        return Ok(());
    }
    let Some(key) = args.key.as_deref() else {
        let shown = |row: &&Row| args.all || row.about.tier == Tier::User;
        out!("{}", list(rows.iter().filter(shown)));
        if !args.all {
            outln!("\n--all lists those for experts as well; `dynvox settings KEY` describes one.");
        }
        return Ok(());
    };
    if let Some(row) = rows.iter().find(|row| row.about.key == key) {
        out!("{}", description(row));
        return Ok(());
    }
    let section = format!("{}.", key.trim_end_matches('.'));
    let within: Vec<_> = rows.iter().filter(|row| row.about.key.starts_with(&section)).collect();
    if within.is_empty() {
        bail!("`{key}` is not a setting. {}", suggestion(key, &rows));
    }
    out!("{}", list(within.into_iter()));
    Ok(())
}

/// All rows in the order of the page.
fn rows() -> anyhow::Result<Vec<Row>> {
    let text = Settings::resolve(None, &[])?.to_toml(Worlds::ALL)?;
    let defaults: BTreeMap<_, _> = leaves("", &text.parse()?).into_iter().collect();
    let (rig, others): (Vec<_>, _) =
        Config::settings().partition(|about| about.key.starts_with("rig."));
    let rectify = RectifiedSize::SETTINGS.iter().map(Setting::about);
    let street = StreetConfig::SETTINGS.iter().map(Setting::about);
    let room = RoomConfig::SETTINGS.iter().map(Setting::about);
    let town = TownConfig::SETTINGS.iter().map(Setting::about);
    let worlds = street.chain(room).chain(town);
    let all = rig.into_iter().chain(rectify).chain(others).chain(worlds);
    Ok(all.map(|about| Row { default: default(defaults.get(about.key)), about }).collect())
}

/// A default as the page shows it.
fn default(value: Option<&toml::Value>) -> String {
    match value {
        None => String::new(),
        Some(toml::Value::String(text)) => text.clone(),
        Some(toml::Value::Array(list)) if list.first().is_some_and(toml::Value::is_table) => {
            "a list".to_owned()
        }
        Some(toml::Value::Array(list)) if list.windows(2).all(|pair| pair[0] == pair[1]) => {
            format!("{} x {}", list.len(), default(list.first()))
        }
        Some(value) => value.to_string(),
    }
}

/// Returns the rule that the value must follow, with its unit.
fn rule(about: &About) -> String {
    let range = match about.range {
        Range::Any => String::new(),
        range => range.to_string().trim_start_matches("must be ").to_owned(),
    };
    let range = if about.names.is_empty() { range } else { about.names.join(", ") };
    let unit = about.unit;
    let own = [range.as_str(), unit].into_iter().filter(|part| !part.is_empty());
    let own = own.collect::<Vec<_>>().join(" ");
    let relation = about.relation.map(|relation| relation.trim_start_matches("must be "));
    let parts = [Some(own.as_str()).filter(|own| !own.is_empty()), relation];
    parts.into_iter().flatten().collect::<Vec<_>>().join("; ")
}

/// The section of a key.
fn section(key: &str) -> &str {
    key.split_once('.').map_or(key, |(section, _)| section)
}

/// The page in Markdown.
fn page(rows: &[Row]) -> String {
    let mut page = HEAD.to_owned();
    for rows in rows.chunk_by(|a, b| section(a.about.key) == section(b.about.key)) {
        let name = rows.first().map_or("", |row| section(row.about.key));
        let head = "| key | default | range | published | for | meaning |";
        let _ = write!(page, "\n## `{name}`\n\n{head}\n|---|---|---|---|---|---|\n");
        for Row { about, default } in rows {
            let tier = tier(about.tier);
            let cells = [default, &rule(about), about.published, tier, about.text];
            let cells = cells.map(|cell| cell.replace('|', "\\|")).join(" | ");
            let _ = writeln!(page, "| `{}` | {cells} |", about.key);
        }
    }
    page
}

fn tier(tier: Tier) -> &'static str {
    match tier {
        Tier::User => "user",
        Tier::Expert => "expert",
    }
}

/// A text without its links, which a terminal does not follow.
fn plain(text: &str) -> String {
    let mut parts = text.split("](");
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        plain.push_str(part.split_once(')').map_or(part, |(_, rest)| rest));
    }
    plain.replace('[', "")
}

/// One line for each row: key, default, unit and the first sentence.
fn list<'r>(rows: impl Iterator<Item = &'r Row>) -> String {
    let mut text = String::new();
    let mut last = None;
    for Row { about, default } in rows {
        let text_shown = plain(about.text);
        if last.replace(section(about.key)).is_some_and(|last| last != section(about.key)) {
            text.push('\n');
        }
        let value = [default, about.unit].join(" ");
        let first = text_shown.split_inclusive(". ").next().unwrap_or_default().trim_end();
        let _ = writeln!(text, "{:<36} {:<14} {first}", about.key, value.trim_end());
    }
    text
}

/// All there is to say about one setting.
fn description(row: &Row) -> String {
    let Row { about, default } = row;
    let set = if default.is_empty() { "unset" } else { default };
    let rule = rule(about);
    let mut text = format!("{}: {}\n\n", about.key, plain(about.text));
    for (name, value) in [
        ("default", set),
        ("range", &rule),
        ("published", about.published),
        ("for", tier(about.tier)),
    ] {
        if !value.is_empty() {
            let _ = writeln!(text, "{name:<10} {value}");
        }
    }
    let shown = if default.is_empty() { "VALUE" } else { default };
    let _ = writeln!(text, "\nSet it with --set {}={shown}, or in a file for --config.", about.key);
    text
}

/// The keys nearest to one that is none.
fn suggestion(key: &str, rows: &[Row]) -> String {
    let mut near: Vec<_> =
        rows.iter().map(|row| (distance(key, row.about.key), row.about.key)).collect();
    near.sort_unstable();
    let keys: Vec<_> = near.iter().take(SUGGESTIONS).map(|(_, key)| format!("`{key}`")).collect();
    format!("Near ones are {}; `dynvox settings --all` lists all", keys.join(", "))
}

/// Letters to insert, delete or replace to turn one key into the other; a name without its section
/// is compared with names.
fn distance(key: &str, other: &str) -> usize {
    let name = other.rsplit('.').next().unwrap_or(other);
    let other = if key.contains('.') { other } else { name };
    let mut row: Vec<usize> = (0..=other.len()).collect();
    for (i, a) in key.bytes().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, b) in other.bytes().enumerate() {
            let replaced = diagonal + usize::from(a != b);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[other.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_of_a_file_has_one_row_whose_range_has_its_default() {
        let (rows, text) = (rows().unwrap(), Settings::resolve(None, &[]).unwrap());
        let table = text.to_toml(Worlds::ALL).unwrap().parse().unwrap();
        for (key, value) in leaves("", &table) {
            // Errors of a room's rig have the street's keys, and one row names them.
            let key = key.replace("room.rig_error.", "street.rig_error.");
            let found = rows.iter().filter(|row| row.about.key == key).count();
            assert_eq!(found, 1, "{key} = {value} has a row");
        }
        for Row { about, default } in &rows {
            assert!(about.text.ends_with(['.', ')']) && about.text.len() > 8, "{}", about.key);
            let in_range = default.parse().is_ok_and(|number| about.range.contains(number));
            assert!(in_range || about.range == Range::Any || default.is_empty(), "{}", about.key);
            let unit = [("_m", "m"), ("_px", "px"), ("_frames", "frames"), ("_m_s", "m/s")];
            if let Some((_, unit)) = unit.into_iter().find(|(end, _)| about.key.ends_with(end)) {
                assert_eq!(about.unit, unit, "{}", about.key);
            }
        }
    }

    #[test]
    fn there_are_at_most_161_settings_but_for_room_and_town_and_60_for_users() {
        // Further synthetic worlds say what they show, and nothing of how it is mapped.
        let rows: Vec<_> = rows().unwrap();
        let of_world = |row: &&Row| ["room", "town"].contains(&section(row.about.key));
        let rows: Vec<_> = rows.iter().filter(|row| !of_world(row)).collect();
        let users = rows.iter().filter(|row| row.about.tier == Tier::User).count();
        assert!(rows.len() <= 161 && (50..=72).contains(&users), "{} and {users}", rows.len());
    }

    #[test]
    fn a_misspelt_key_is_answered_with_near_ones() {
        let rows = rows().unwrap();
        for (misspelt, meant) in [
            ("volume.voxel_sise_m", "`volume.voxel_size_m`"),
            ("voxel_size", "`volume.voxel_size_m`"),
            ("street.sed", "`street.seed`"),
        ] {
            let text = suggestion(misspelt, &rows);
            assert!(text.contains(meant), "{misspelt}: {text}");
        }
        assert_eq!(distance("volume.far_m", "volume.far_m"), 0);
        assert_eq!(distance("far", "volume.near_m"), 4, "n, e, _ and m, and no f");
    }

    #[test]
    fn a_setting_is_described_by_unit_range_default_and_published_value() {
        let rows = rows().unwrap();
        let of = |key: &str| description(rows.iter().find(|row| row.about.key == key).unwrap());
        let text = of("objects.voxel_size_m");
        for part in ["default    0.05\n", "range      from 0.001 to 10 m\n", "published  0.035\n"] {
            assert!(text.contains(part), "{text}");
        }
        assert!(of("stereo.lone_share").contains("keeps all (decision 43)."));
        assert!(of("volume.far_m").contains("above 0 m; above volume.near_m\n"));
        assert!(of("volume.when_full").contains("evict, refuse\n"));
        assert!(of("rectify.width_px").contains("default    unset\n"));
    }
}
