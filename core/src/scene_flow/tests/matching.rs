//! Which features are matched, which matches have support, and which are selected.

use super::*;
use crate::scene_flow::features::Sought;

fn features_for<'s>(carver: &mut Carver<'s>, count: usize) -> Features<'s> {
    let start = carver.alloc("cell", table(&CAPACITY));
    Features::new(carver.alloc("position", count), carver.alloc("descriptor", count), start)
}

/// Features with random descriptors.
fn scatter<'s>(
    carver: &mut Carver<'s>,
    random: &mut Random,
    count: usize,
) -> (Features<'s>, Vec<Candidate>) {
    let mut features = features_for(carver, count);
    // Random gradients, so that descriptors are hardly ever alike.
    let gradient: Vec<u16> = (0..WIDTH * HEIGHT).map(|_| random.next_u32() as u16).collect();
    let position = |random: &mut Random| Candidate {
        u: 8 + random.below(WIDTH as u32 - 16) as u16,
        v: 8 + random.below(HEIGHT as u32 - 16) as u16,
        class: random.below(CLASSES as u32) as u8,
        ..Candidate::default()
    };
    let candidates: Vec<Candidate> = (0..count).map(|_| position(random)).collect();
    assert_eq!(features.fill(candidates.iter().copied(), &gradient, WIDTH, HEIGHT), 0);
    (features, candidates)
}

/// Check that the search for a feature of a class in a window finds the one expected.
struct Finds<'f, 's>(&'f Features<'s>, usize, Window, [Descriptor; 2], Option<usize>);

impl Comparison for Finds<'_, '_> {
    fn run(self, kernels: &impl Kernels) {
        let Self(features, class, window, sought, expected) = self;
        assert_eq!(
            features.nearest(Sought { class, window, descriptor: &sought }, kernels, &mut 0),
            expected
        );
    }
}

#[test]
fn the_nearest_feature_in_a_window_is_the_one_a_full_search_finds() {
    let mut slab = slab();
    let mut carver = Carver::new(&mut slab.0, BYTES).unwrap();
    let mut random = Random::new(8);
    let (features, candidates) = scatter(&mut carver, &mut random, 500);
    for class in 0..CLASSES {
        let members = candidates.iter().filter(|c| usize::from(c.class) == class).count();
        assert_eq!((0..features.len()).filter(|&i| features.class(i) == class).count(), members);
        for _ in 0..100 {
            let [u, v] = [random.below(500) as i32 - 50, random.below(250) as i32 - 50];
            let [u_max, v_max] = [u + random.below(90) as i32, v + random.below(60) as i32];
            // Windows reach beyond the image on all sides.
            let window = Window { u_min: u, u_max, v_min: v, v_max };
            let sought =
                [(); 2].map(|()| Descriptor(std::array::from_fn(|_| random.next_u32() as u8)));
            let inside = |i: &usize| {
                let [u, v] = features.at(*i).unwrap().map(i32::from);
                features.class(*i) == class
                    && (window.u_min..=window.u_max).contains(&u)
                    && (window.v_min..=window.v_max).contains(&v)
            };
            let sad = |i: &usize| -> u32 {
                sought
                    .iter()
                    .zip(features.descriptor(*i).unwrap())
                    .map(|(a, b)| distance(a, b))
                    .sum()
            };
            let expected = (0..features.len()).filter(inside).min_by_key(|i| (sad(i), *i));
            // All kernels, each against the full search.
            for vectors in Vectors::available() {
                compare(vectors, Finds(&features, class, window, sought, expected));
            }
        }
    }
}

#[test]
fn only_circles_that_return_to_their_beginning_close() {
    let mut slab = slab();
    let mut carver = Carver::new(&mut slab.0, BYTES).unwrap();
    let gradient: Vec<u16> = (0..WIDTH * HEIGHT).map(|i| (i as u16).wrapping_mul(40_503)).collect();
    let mut position = |u: u16, v: u16, twin: bool| {
        let mut features = features_for(&mut carver, 4);
        let candidates = [
            Candidate { u, v, class: 2, ..Candidate::default() },
            Candidate { u: u + 1, v, class: 2, ..Candidate::default() },
        ];
        features.fill(candidates.into_iter().take(1 + usize::from(twin)), &gradient, WIDTH, HEIGHT);
        features
    };
    // Four positions that make a circle, with a twin of the first.
    let images = [
        position(200, 60, true),
        position(190, 60, false),
        position(196, 64, false),
        position(210, 64, false),
    ];
    let [previous_left, previous_right, current_right, current_left] = &images;
    let corners = Corners { previous_left, previous_right, current_right, current_left };
    let mut traced = [[0; 3]; 4];
    let config = SceneFlowConfig::default();
    corners.trace(|_| Reach::widest(&config), u64::MAX, &mut traced, &Serial);
    let mut matches = [Match::default(); 4];
    // Both features of the first image lead to the same partners, which lead back to one of them.
    assert_eq!(corners.gather(&traced, &mut matches), 1);
    assert_eq!(matches[0].current_left, [210.0, 64.0]);
    // The same circle with the right camera's features to the right of the left one's: behind the
    // camera.
    let corners = Corners {
        previous_left: previous_right,
        previous_right: previous_left,
        current_right,
        current_left,
    };
    corners.trace(|_| Reach::widest(&config), u64::MAX, &mut traced, &Serial);
    assert_eq!(corners.gather(&traced, &mut matches), 0);
}

#[test]
fn a_search_too_wide_follows_fewer_features_to_equal_partners() {
    let mut slab = slab();
    let mut carver = Carver::new(&mut slab.0, BYTES).unwrap();
    let mut random = Random::new(4);
    let images: [_; 4] = core::array::from_fn(|_| scatter(&mut carver, &mut random, 300).0);
    let [previous_left, previous_right, current_right, current_left] = &images;
    let corners = Corners { previous_left, previous_right, current_right, current_left };
    let config = SceneFlowConfig::default();
    let trace = |most: u64| {
        let mut traced = [[0; 3]; 300];
        let compared = corners.trace(|_| Reach::widest(&config), most, &mut traced, &Serial);
        (compared, traced)
    };
    let ((all, partners), (few, thinned)) = (trace(u64::MAX), trace(8));
    assert!(few < all / 3 && few > 0, "{few} of {all} descriptors");
    for (partner, thinned) in partners.iter().zip(&thinned) {
        assert!(thinned == partner || *thinned == [u32::MAX; 3], "{thinned:?}, {partner:?}");
    }
    assert_eq!(trace(all), (all, partners), "an average that suffices changes nothing");
}

/// Matches on a grid that all move alike.
fn crowd() -> Vec<Match> {
    let at = |i: usize| [40.0 + 12.0 * (i % 12) as f32, 40.0 + 12.0 * (i / 12) as f32];
    (0..60)
        .map(|i| {
            let [u, v] = at(i);
            Match {
                previous_left: [u, v],
                previous_right: [u - 9.0, v],
                current_left: [u + 3.0, v + 1.0],
                current_right: [u - 7.0, v + 1.0],
            }
        })
        .collect()
}

#[test]
fn a_match_that_moves_unlike_its_neighbours_loses_their_support() {
    let mut slab = slab();
    let mut cells = Cells::new_in(&CAPACITY, &mut Carver::new(&mut slab.0, BYTES).unwrap());
    let turn = TurnFlow::default();
    let rule = SupportRule { support_min: SceneFlowConfig::default().support_min, turn: &turn };
    let mut matches = crowd();
    matches[17].current_left[0] += 6.0;
    matches[31].previous_right[0] -= 6.0;
    matches.push(Match {
        previous_left: [380.0, 150.0],
        previous_right: [371.0, 150.0],
        ..matches[0]
    });
    let mut supported = vec![9; matches.len()];
    support(
        &matches,
        Shape::new(WIDTH, HEIGHT, 16),
        &rule,
        SortedMotions { cells: &mut cells, motion: &mut [[0.0; 4]; 100] },
        &mut supported,
    );
    let lost: Vec<usize> = (0..matches.len()).filter(|&i| supported[i] == 0).collect();
    assert_eq!(lost, [17, 31, 60], "the two that disagree and the one that is alone");
    let all = SupportRule { support_min: 0, ..rule };
    support(
        &matches,
        Shape::new(WIDTH, HEIGHT, 16),
        // A least support of 0 takes all of them, also the lone one.
        &all,
        SortedMotions { cells: &mut cells, motion: &mut [[0.0; 4]; 100] },
        &mut supported,
    );
    assert!(supported.iter().all(|&supported| supported == 1));
}

#[test]
fn each_cell_gives_its_best_few() {
    let mut slab = slab();
    let mut cells = Cells::new_in(&CAPACITY, &mut Carver::new(&mut slab.0, BYTES).unwrap());
    let matches = crowd();
    // A permutation of the scores, since 37 and 60 have no common factor.
    let score: Vec<f32> = (0..matches.len()).map(|i| (i * 37 % 60) as f32).collect();
    let shape = Shape::new(WIDTH, HEIGHT, 50);
    let mut selection = [0; 100];
    // Two for each cell, by search over all.
    let selected =
        select(Scored { matches: &matches, score: &score }, shape, 2, &mut cells, &mut selection);
    let mut expected = Vec::new();
    for row in 0..shape.rows {
        for column in 0..shape.columns {
            let mut members: Vec<usize> =
                (0..matches.len()).filter(|&i| shape.cell(&matches[i]) == [column, row]).collect();
            members.sort_by(|&a, &b| score[b].total_cmp(&score[a]));
            expected.extend(members.into_iter().take(2).map(|i| i as u32));
        }
    }
    assert_eq!(&selection[..selected], expected);
}
