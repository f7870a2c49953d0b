use super::*;
use crate::random::Random;

const MIB: usize = 1 << 20;
const IMAGES: [(usize, usize); 6] =
    [(320, 96), (640, 480), (752, 480), (1_280, 384), (1_280, 720), (1_920, 1_080)];

fn solve(
    bytes: usize,
    size: (usize, usize),
    options: &BudgetOptions,
) -> Result<Capacity, BudgetError> {
    let (width, height) = size;
    Capacity::for_budget(bytes, width, height, options)
}

/// One block more, and one more in sight where blocks bound what is in sight.
fn grown(capacity: &Capacity) -> Capacity {
    let blocks = capacity.blocks + 1;
    let bounded = capacity.visible_blocks == capacity.blocks - capacity.blocks / 5;
    let visible_blocks = if bounded { blocks - blocks / 5 } else { capacity.visible_blocks };
    Capacity { blocks, visible_blocks, ..*capacity }
}

#[test]
fn budgets_are_filled_and_never_exceeded_or_the_least_is_named() {
    let mut solved = 0;
    for mib in [8, 16, 32, 48, 64, 100, 256, 1_024] {
        for (image, voxel_size_m) in
            IMAGES.into_iter().flat_map(|image| [(image, 0.05), (image, 0.1)])
        {
            let options =
                BudgetOptions { voxel_size_m: Some(voxel_size_m), ..BudgetOptions::default() };
            let bytes = mib * MIB;
            match solve(bytes, image, &options) {
                Ok(capacity) => {
                    assert!(
                        // No more than the budget, and at most 3 % left unused.
                        capacity.bytes() <= bytes && capacity.bytes() * 100 >= bytes * 97,
                        "{mib} MiB, {image:?}: {}",
                        capacity.bytes()
                    );
                    assert_eq!(capacity.validate(), Ok(()), "{mib} MiB, {image:?}");
                    assert_eq!((capacity.image_width, capacity.image_height), image);
                    solved += 1;
                }
                Err(BudgetError::TooSmall { least }) => {
                    assert!(least > bytes && mib < 256, "{mib} MiB, {image:?}");
                    // The least works, and one byte less does not.
                    assert!(
                        solve(least, image, &options).is_ok()
                            && solve(least - 1, image, &options).is_err()
                    );
                }
                Err(other) => panic!("{mib} MiB, {image:?}: {other}"),
            }
        }
    }
    assert!(solved >= 60, "{solved} of 96");
}

#[test]
fn any_budget_is_kept_or_refused_with_the_least_that_works() {
    let mut random = Random::new(5);
    let mut answered = 0;
    for at in 0..10_000 {
        // From 1 MiB to 2 GiB, as likely in each power of two.
        let exponent = 20 + random.below(11);
        let bytes = (1usize << exponent) + random.below(1 << exponent) as usize;
        let image = (64 + random.below(2_000) as usize, 32 + random.below(1_200) as usize);
        let options = BudgetOptions {
            colour: [None, Some(false), Some(true)]
                .get(random.below(3) as usize)
                .copied()
                .flatten(),
            objects: (random.below(2) == 0).then(|| random.below(17) as usize),
            voxel_size_m: (random.below(2) == 0).then(|| 0.01 + random.below(50) as f32 / 100.0),
            raw_image: if random.below(4) == 0 { [image.0 + 100, image.1 + 50] } else { [0, 0] },
        };
        match solve(bytes, image, &options) {
            Ok(capacity) => {
                assert!(capacity.bytes() <= bytes, "question {at}: {options:?}");
                assert!(
                    grown(&capacity).bytes() > bytes,
                    "question {at}: one block more would fit"
                );
                assert_eq!(capacity.validate(), Ok(()), "question {at}: {options:?}");
                assert!(
                    capacity.blocks >= MIN_BLOCKS
                        && options.colour.is_none_or(|colour| colour == capacity.colour)
                );
                assert!(
                    options.objects.is_none_or(|objects| objects == capacity.objects),
                    "question {at}: {options:?}"
                );
                answered += 1;
            }
            Err(BudgetError::TooSmall { least }) => {
                assert!(least > bytes, "question {at}");
                assert!(
                    solve(least, image, &options).is_ok(),
                    "question {at}: the least named works"
                );
                assert!(
                    solve(least - 1, image, &options).is_err(),
                    "question {at}: a byte less does not"
                );
            }
            Err(other) => panic!("question {at}: {other}"),
        }
    }
    assert!(answered > 3_000, "{answered}");
}

#[test]
fn a_larger_budget_maps_at_least_as_far() {
    let capacity_of = |mib: usize| {
        solve(
            mib * MIB,
            (640, 480),
            &BudgetOptions { colour: Some(false), objects: Some(2), ..BudgetOptions::default() },
        )
    };
    let blocks: std::vec::Vec<usize> =
        (50..300).step_by(10).map(|mib| capacity_of(mib).unwrap().blocks).collect();
    assert!(blocks.is_sorted(), "{blocks:?}");
}

#[test]
fn the_profiles_are_valid_and_what_cannot_be_is_named() {
    for (name, capacity) in Capacity::PROFILES {
        assert_eq!(capacity.validate(), Ok(()), "{name}");
    }
    let problem = |capacity: Capacity| capacity.validate().unwrap_err().bound;
    assert_eq!(problem(Capacity { blocks: 0, ..Capacity::TINY }), "blocks");
    assert_eq!(problem(Capacity { visible_blocks: 9_999, ..Capacity::TINY }), "visible_blocks");
    assert_eq!(problem(Capacity { objects: 17, ..Capacity::TINY }), "objects");
    let plain = BudgetOptions::default();
    assert_eq!(solve(MIB, (10, 10), &plain), Err(BudgetError::Image));
    assert_eq!(solve(MIB, (640, usize::MAX), &plain), Err(BudgetError::Image));
    assert_eq!(
        solve(MIB, (640, 480), &BudgetOptions { objects: Some(99), ..plain }),
        Err(BudgetError::Objects)
    );
    assert_eq!(
        solve(MIB, (640, 480), &BudgetOptions { voxel_size_m: Some(f32::NAN), ..plain }),
        Err(BudgetError::VoxelSize)
    );
    assert!(matches!(solve(0, (640, 480), &plain), Err(BudgetError::TooSmall { .. })));
    // A budget without limit still gives a capacity within its own limits.
    assert!(
        solve(usize::MAX, (640, 480), &plain).is_ok_and(|capacity| capacity.validate().is_ok())
    );
}

/// A bound of a capacity.
type Field = fn(&mut Capacity) -> &mut usize;

#[test]
fn the_bytes_of_every_valid_capacity_can_be_summed_up() {
    let profile = Capacity {
        raw_width: 4_096,
        raw_height: 4_096,
        planning_width: 1_024,
        planning_length: 1_024,
        planning_height: 1_024,
        ..Capacity::DESKTOP
    };
    let fields: [(&str, Field); 11] = [
        ("raw_width", |of| &mut of.raw_width),
        ("features", |of| &mut of.features),
        ("matches", |of| &mut of.matches),
        ("blocks", |of| &mut of.blocks),
        ("visible_blocks", |of| &mut of.visible_blocks),
        ("history_frames", |of| &mut of.history_frames),
        ("mask_words", |of| &mut of.mask_words),
        ("tracks", |of| &mut of.tracks),
        ("objects", |of| &mut of.objects),
        ("object_blocks", |of| &mut of.object_blocks),
        ("crop_pixels", |of| &mut of.crop_pixels),
    ];
    let mut largest = Capacity { planning_distance_3d: true, ..profile };
    for (name, field) in fields {
        for shift in 0..64 {
            let mut capacity = largest;
            *field(&mut capacity) = 1 << shift;
            match capacity.validate() {
                Ok(()) => assert!(capacity.bytes() <= isize::MAX as usize, "{name} 2^{shift}"),
                Err(problem) => assert!(
                    [name, "visible_blocks"].contains(&problem.bound),
                    "{name} 2^{shift}: {problem:?}"
                ),
            }
        }
        // The next field beside the largest of this one.
        let most = (0..64).map(|shift| 1usize << shift).filter(|value| {
            let mut capacity = largest;
            *field(&mut capacity) = *value;
            capacity.validate().is_ok()
        });
        *field(&mut largest) = most.max().unwrap();
    }
    assert_eq!((largest.blocks, largest.history_frames), (1 << 28, 1 << 16));
}

#[test]
fn capacities_tried_for_2_gib_have_bytes_within_32_bits() {
    let (mut random, mut largest) = (Random::new(8), 0);
    for at in 0..20_000 {
        // Small and large images; the largest first.
        let shift = random.below(7);
        let image = if at < 100 {
            (4_096, 4_096)
        } else {
            (64 + random.below(8_128 >> shift) as usize, 32 + random.below(8_160 >> shift) as usize)
        };
        let options = BudgetOptions {
            colour: [None, Some(false), Some(true)]
                .get(random.below(3) as usize)
                .copied()
                .flatten(),
            objects: (random.below(2) == 0).then(|| random.below(17) as usize),
            voxel_size_m: (random.below(2) == 0).then(|| 0.001 + random.below(50) as f32 / 100.0),
            raw_image: if random.below(2) == 0 { [4_096, 4_096] } else { [0, 0] },
        };
        // What a slice can hold on a machine of 32 bits.
        let Ok(question) = Question::new(i32::MAX as usize, image.0, image.1, &options) else {
            continue;
        };
        let least = question.least();
        let mut considered =
            std::vec![least, question.with_blocks(&least, question.too_many_blocks(&least))];
        for colour in [false, true] {
            let base = question.image_only(colour);
            considered.push(Capacity { crop_pixels: base.pixels() * 8 / 5, ..base });
            for (objects, object_blocks) in
                [(16, 4_000), (8, 1_200), (4, 700), (2, 300), (2, 150), (0, 0)]
            {
                let objects = options.objects.unwrap_or(objects);
                let with_objects =
                    Capacity { objects, object_blocks, crop_pixels: base.pixels() * 8 / 5, ..base };
                considered.push(
                    question.with_blocks(&with_objects, question.too_many_blocks(&with_objects)),
                );
            }
        }
        let most = considered.iter().map(Capacity::bytes).max().unwrap();
        assert!(most < 1 << 32, "{most} bytes for {image:?}, {options:?}");
        largest = if most > largest { most } else { largest };
    }
    assert!(largest > 1 << 31, "the largest are considered: {largest}");
}
