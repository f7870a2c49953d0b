use super::*;
use crate::input::faults::Faults;
use std::collections::HashSet;

#[test]
fn every_row_is_read_and_names_a_world_and_a_fault_that_exist() {
    let rows = Trial::listed(20);
    assert_eq!(rows.len(), ROWS.lines().count() - 1, "a row is not understood");
    assert!(rows.len() >= 150, "{}", rows.len());
    for row in &rows {
        assert!(["street", "room", "yard"].contains(&row.world.as_str()), "{row:?}");
        assert!(row.fault.is_empty() || row.fault.parse::<Faults>().is_ok(), "{row:?}");
        assert!(!row.fault.contains(['{', '}']), "{row:?}");
    }
    let names: HashSet<_> = rows.iter().map(|row| row.name() + &row.fault).collect();
    assert_eq!(names.len(), rows.len(), "two rows are alike");
    assert!(rows.iter().filter(|row| row.is_short()).count() <= 10);
}

#[test]
fn frames_of_a_fault_are_counted_from_the_first_with_it() {
    assert_eq!(placed("black@{0},drop@{1}", 8), "black@8,drop@9");
    assert_eq!(placed("drop@{0}..{5}", 20), "drop@20..25");
    assert_eq!(placed("zoom=2@0..", 20), "zoom=2@0..");
}

#[test]
fn a_seed_is_that_of_the_world() {
    let of = |world: &str| {
        let rows = Trial::listed(20);
        rows.into_iter().find(|row| row.world == world).unwrap().arguments(Some(7)).join(" ")
    };
    assert_eq!(of("street"), "--set street.seed=7");
    assert_eq!(
        of("yard"),
        "--world yard --set room.width=320 --set room.height=200 --set room.seed=7"
    );
}
