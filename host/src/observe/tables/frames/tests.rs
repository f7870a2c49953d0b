//! The table of columns, its documentation and its names.

use super::*;
use std::path::Path;

/// The table of columns as `docs/run_folder.md` has it.
fn documentation() -> String {
    let stages: Vec<String> =
        Stage::ALL.iter().map(|stage| format!("`{}`", stage.name())).collect();
    let digests: Vec<String> = digested().map(|of| format!("`{}`", of.name())).collect();
    let mut text = String::from("| column | unit | meaning |\n|---|---|---|\n");
    for column in columns::TABLES.iter().copied().flatten() {
        text += &format!("| `{}` | {} | {} |\n", column.name, column.unit, column.doc);
    }
    text += &format!(
        "| `STAGE_ms`, `STAGE_cpu_ms` | ms | wall time and CPU time of each stage: {} |\n",
        stages.join(", ")
    );
    text += &format!(
        "| `STAGE_digest` | | hash of what each stage made, of the input, and of each object \
         (`id:hash;...`): {} |\n",
        digests.join(", ")
    );
    text
}

const BEGIN: &str = "<!-- columns of frames.csv, from host/src/observe/tables/frames -->\n";
const END: &str = "<!-- end of the columns -->";

/// `DYNVOX_BLESS=1 cargo test -p dynvox --lib observe::tables::frames` writes the table anew.
#[test]
fn the_page_of_the_run_folder_has_the_table_of_columns() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/run_folder.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once(BEGIN).unwrap();
    let (table, after) = rest.split_once(END).unwrap();
    if std::env::var_os("DYNVOX_BLESS").is_some() {
        std::fs::write(&path, [before, BEGIN, &documentation(), END, after].concat()).unwrap();
    } else {
        assert_eq!(table, documentation(), "DYNVOX_BLESS=1 writes it anew");
    }
}

#[test]
fn each_column_has_a_name_of_its_own_and_ends_in_its_unit() {
    let columns = frame_columns();
    for (at, column) in columns.iter().enumerate() {
        assert!(columns[..at].iter().all(|other| other.name != column.name), "{}", column.name);
        let end = format!("_{}", column.unit);
        assert!(column.unit.is_empty() || column.name.ends_with(&end), "{}", column.name);
    }
}

#[test]
fn a_row_has_a_cell_for_each_column_and_empty_ones_for_what_is_unknown() {
    let row = FrameRow { frame: 7, step_ms: 12.0, ..FrameRow::default() };
    let text = String::from_utf8(frame_row(&row, true).unwrap()).unwrap();
    let [header, cells] = [0, 1].map(|at| text.lines().nth(at).unwrap().split(','));
    let cells: Vec<(&str, &str)> = header.zip(cells).collect();
    assert_eq!(cells.len(), frame_columns().len());
    let of = |name: &str| cells.iter().find(|(column, _)| *column == name).unwrap().1;
    assert_eq!(["frame", "step_ms", "rss_bytes"].map(of), ["7", "12.0", ""]);
    assert_eq!(["severity", "objects_digest"].map(of), ["info", "-"]);
    assert_eq!(of("input_digest"), "0000000000000000");
    assert_eq!(frame_row(&row, false).unwrap().iter().filter(|byte| **byte == b'\n').count(), 1);
}
