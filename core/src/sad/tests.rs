//! Kernels against plain twins.

use super::*;
use crate::random::Random;

/// Kernels and their twins on one input.
struct Equal {
    a: Eight<Descriptor>,
    b: Eight<Descriptor>,
    /// The greatest key to begin with.
    most: u32,
}

impl Equal {
    /// The least keys of two candidates.
    fn least(&self, base: u32, kernels: &impl Kernels) -> Eight<u32> {
        let halved = self.a.map(|Descriptor(bytes)| Descriptor(bytes.map(|byte| byte / 2)));
        let best = kernels.least([self.most; LANES], [&self.a, &self.b], base);
        kernels.ordered(kernels.least(best, [&self.b, &halved], base + 1))
    }
}

impl Comparison for Equal {
    fn run(self, kernels: &impl Kernels) {
        // The base is in the result's upper bits, and must not disturb the comparison.
        for base in [0, 7, 65_280 << 8 | 255] {
            assert_eq!(self.least(base, kernels), self.least(base, &PLAIN));
        }
        let Self { a, b, most } = self;
        assert_eq!(kernels.sums(&a, &b), PLAIN.sums(&a, &b));
        assert_eq!(kernels.sums_of(&a, b.each_ref()), PLAIN.sums(&a, &b));
        // Each lane with operands of its own, so that a swapped lane shows.
        let twos = [
            [b[3], a[1]],
            [a[0], b[6]],
            [b[1], b[2]],
            [a[7], a[6]],
            [b[0], a[4]],
            [a[2], b[5]],
            [b[7], b[4]],
            [a[3], a[5]],
        ];
        let two = kernels.sums_of_two(&a, twos.each_ref());
        assert_eq!(two, PLAIN.sums_of_two(&a, twos.each_ref()));
        assert_eq!(two, [0, 1].map(|step| PLAIN.sums(&a, &twos.map(|two| two[step]))));
        // The largest of both signs, small ones, and one from the random bits.
        let dividends = [126_480, -126_480, 0, 31, -31, 30, -1, most as i32 >> 7];
        let divisors = [4_080, 4_080, 1, 31, 32, 7, 1, 1 + (most as i32 >> 19)];
        let quotients = kernels.quotients(dividends, divisors);
        assert_eq!(quotients, PLAIN.quotients(dividends, divisors));
        assert!((0..LANES).all(|lane| quotients[lane] == dividends[lane] / divisors[lane]));
        let (sought, others) = ([a[5], b[2]], bytemuck::cast([a, b]));
        // On the borders of the spans below, just beyond them, and at the ends of 16 bits.
        for (at, offset) in [
            [[7u16, 9]; LANES],
            [[8, 65_535], [9, 0], [8, 0], [65_535, 65_535], [0, 0], [7, 9], [107, 9], [108, 12]],
        ]
        .iter()
        .zip([0, 1_000])
        {
            for (low, span) in [
                ([0, 0], [65_535, 65_535]),
                ([8, 0], [99, 9]),
                ([7, 9], [100, 3]),
                ([0, 65_535], [65_535, 0]),
            ] {
                let inside = Inside { at, low, span, offset, end: 1_005 };
                let best = [NO_FEATURE.min(most); LANES];
                assert_eq!(
                    kernels.least_inside(best, &sought, &others, &inside),
                    PLAIN.least_inside(best, &sought, &others, &inside)
                );
            }
        }
        let (point, columns) =
            ([a[0], a[3], b[5], b[7]], [&[a, b, b][..], &[b, a, a], &[b, b, a], &[a, b]]);
        let [mut costs, mut twin] = [[[-1; LANES]; 3]; 2];
        kernels.costs(&point, columns, &mut costs);
        PLAIN.costs(&point, columns, &mut twin);
        assert_eq!(costs, twin);
        // The fourth column has two entries, and the shortest decides.
        assert_eq!(costs[2], [-1; LANES], "one of the four has two");
    }
}

#[test]
fn every_level_gives_the_sums_of_ordinary_code() {
    let mut random = Random::new(8);
    for vectors in Vectors::available() {
        for bound in [2, 16, 256].repeat(50) {
            let [a, b] = [(); 2].map(|()| {
                [(); LANES].map(|()| {
                    Descriptor([(); 16].map(|()| (random.below(bound) * 255 / (bound - 1)) as u8))
                })
            });
            compare(vectors, Equal { a, b, most: random.below(1 << 30) });
        }
        let extremes = [[0; 16], [255; 16]].map(Descriptor);
        compare(vectors, Equal { a: [extremes[0]; LANES], b: [extremes[1]; LANES], most: 1 << 30 });
    }
}
