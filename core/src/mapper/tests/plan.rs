//! Maps for planners in a mapper: they change nothing else, and a resumed run plans as one that
//! never stopped.

use super::{
    resume::{restored, saved},
    *,
};

const FRAMES: usize = 8;
const WITH_WINDOW: Capacity = Capacity {
    planning_width: 64,
    planning_length: 64,
    planning_height: 16,
    planning_distance_3d: true,
    ..CAPACITY
};

fn mapped<R>(
    capacity: &Capacity,
    walk: &Walk,
    test: impl FnOnce(&mut Mapper<'_>, &[Report]) -> R,
) -> R {
    let mut slab = vec![0u8; capacity.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(capacity, &Walk::config(), &mut slab).unwrap();
    let reports: Vec<Report> = (0..FRAMES).map(|at| walk.step(at, &mut mapper)).collect();
    test(&mut mapper, &reports)
}

#[test]
fn a_window_changes_no_digest_and_without_one_nothing_is_planned() {
    let walk = Walk::new(FRAMES);
    let digests =
        |reports: &[Report]| reports.iter().map(|report| report.digest).collect::<Vec<_>>();
    // A window is planned from the map, and the map must not know.
    let with = mapped(&WITH_WINDOW, &walk, |mapper, reports| {
        let report = mapper.update_planning_maps(0.0);
        assert!(report.occupied > 50 && report.free > 50, "{report:?}");
        digests(reports)
    });
    let without = mapped(&CAPACITY, &walk, |mapper, reports| {
        assert_eq!(mapper.update_planning_maps(0.0), crate::planning::PlanningReport::default());
        assert!(mapper.planning().is_empty() && mapper.planning().slice_distance([0; 3]).is_none());
        digests(reports)
    });
    assert_eq!(with, without);
}

#[test]
fn a_resumed_run_plans_as_the_one_that_never_stopped() {
    let walk = Walk::new(FRAMES + 2);
    let went_on = |mapper: &mut Mapper<'_>| {
        for at in FRAMES..FRAMES + 2 {
            walk.step(at, mapper);
        }
        let reports = [mapper.update_planning_maps(0.0), mapper.plan_ahead(1.5)];
        (reports, mapper.planning().digest())
    };
    let (bytes, expected) =
        mapped(&WITH_WINDOW, &walk, |mapper, _| (saved(mapper), went_on(mapper)));
    assert_eq!(restored(&WITH_WINDOW, &Walk::config(), &bytes, went_on).unwrap(), expected);
}

#[test]
fn asking_for_a_plan_changes_no_later_frame() {
    let walk = Walk::new(FRAMES + 1);
    let asked = mapped(&WITH_WINDOW, &walk, |mapper, _| {
        mapper.update_planning_maps(0.0);
        // A plan for three seconds ahead leaves predicted boxes behind in the window.
        mapper.plan_ahead(3.0);
        let report = walk.step(FRAMES, mapper);
        mapper.update_planning_maps(0.0);
        (report.digest, mapper.planning().digest())
    });
    let not_asked = mapped(&WITH_WINDOW, &walk, |mapper, _| {
        let report = walk.step(FRAMES, mapper);
        mapper.update_planning_maps(0.0);
        (report.digest, mapper.planning().digest())
    });
    assert_eq!(asked, not_asked);
}
