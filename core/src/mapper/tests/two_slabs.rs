//! A mapper in two slabs: the regions lie where they belong, and no bit depends on it.

use super::*;
use crate::memory::{Placement, TwoSlabs};

/// Capacities with every optional stage on and off.
fn capacities() -> Vec<Capacity> {
    let all = Capacity {
        colour: true,
        keyframes: 50,
        planning_width: 40,
        planning_length: 40,
        planning_height: 10,
        planning_distance_3d: true,
        raw_width: 400,
        raw_height: 120,
        ..CAPACITY
    };
    let mut capacities = vec![CAPACITY, all, Capacity { objects: 0, ..all }];
    capacities.extend(Capacity::PROFILES.map(|(_, capacity)| capacity));
    capacities
}

#[test]
fn bytes_of_each_kind_are_those_of_its_regions() {
    for capacity in capacities() {
        let footprint = capacity.footprint();
        let sum = |placement| -> usize {
            let regions = footprint.regions().iter();
            regions.filter(|r| r.placement() == placement).map(|r| r.bytes).sum()
        };
        assert_eq!(sum(Placement::Hot), capacity.hot_bytes(), "{capacity:?}");
        assert_eq!(sum(Placement::Cold), capacity.cold_bytes(), "{capacity:?}");
    }
}

#[test]
fn steps_in_two_slabs_are_those_in_one() {
    let walk = Walk::new(6);
    let digests = |mapper: &mut Mapper<'_>| -> Vec<u64> {
        let step = |at| walk.with_frame(at, |frame| mapper.step(frame, &Serial).unwrap().digest);
        (0..6).map(step).collect()
    };
    let config = Walk::config();
    let mut slab = vec![0u8; CAPACITY.bytes() + SLAB_ALIGN];
    let one = digests(&mut Mapper::new(&CAPACITY, &config, &mut slab).unwrap());
    let mut hot = vec![7u8; CAPACITY.hot_bytes() + SLAB_ALIGN];
    let mut cold = vec![7u8; CAPACITY.cold_bytes() + SLAB_ALIGN];
    let slabs = TwoSlabs { hot: &mut hot, cold: &mut cold };
    let mut mapper = Mapper::new_in_two(&CAPACITY, &config, slabs).unwrap();
    assert_eq!(digests(&mut mapper), one);
    assert_eq!(mapper.footprint().bytes(), CAPACITY.bytes());
}

#[test]
fn each_slab_that_is_too_small_is_refused() {
    let config = Walk::config();
    let needed = [CAPACITY.hot_bytes(), CAPACITY.cold_bytes()].map(|bytes| bytes + SLAB_ALIGN);
    for short in [0, 1] {
        let mut slabs = needed.map(|bytes| vec![0u8; bytes]);
        slabs[short].truncate(needed[short] / 2);
        let [hot, cold] = &mut slabs;
        let made = Mapper::new_in_two(&CAPACITY, &config, TwoSlabs { hot, cold });
        assert!(matches!(made, Err(NewError::Slab(SlabError::TooSmall { .. }))));
    }
}
