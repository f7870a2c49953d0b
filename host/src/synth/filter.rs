//! The kernel through which a pixel sees: its own area and a lens of half a pixel's blur.
//!
//! The kernel is a quadratic B-spline with a deviation of 0.58 px: that of a square pixel behind a
//! lens whose blur has one of 0.5 px. Its response vanishes at 0.87 cycles a pixel and is a
//! fiftieth at 0.7, so that what moves by a tenth of a pixel moves in the picture. Edges between
//! surfaces are weighed by it, sample by sample, over a pixel and its eight neighbours; paint
//! within a surface is filtered by [`super::paint`] and [`super::texture`] for footprints wider by
//! [`SPREAD`].

use super::raster::{Band, PHASES, SAMPLES, SKY, Setup, offset_px};

/// Width of the kernel over that of a B-spline on whole pixels, whose deviation is half a pixel.
pub const SPREAD: f64 = 1.155;
/// Pixels on each side of the picture that the kernel reaches.
pub const MARGIN_PX: usize = 1;
/// Surfaces told apart in one pixel; further ones count as the last.
const COVERS: usize = 12;
/// Pixels a kernel covers.
const NEIGHBOURS: usize = 9;
/// Group of the sky.
const SKY_GROUP: u64 = u64::MAX;
/// Group of a pixel whose samples see several.
const MIXED: u64 = u64::MAX - 1;

/// Weights of all samples of a pixel and its neighbours, for each phase of the rows.
pub struct Kernel {
    weights: [[[f32; SAMPLES]; NEIGHBOURS]; PHASES],
    offsets_px: [[[[f32; 2]; SAMPLES]; NEIGHBOURS]; PHASES],
    /// Sums over a pixel's samples: weight, and weighted positions, px.
    pixels: [[[f32; 3]; NEIGHBOURS]; PHASES],
}

/// One surface's part of a pixel.
#[derive(Clone, Copy)]
pub struct Cover {
    group: u64,
    /// Share of the pixel's light.
    pub weight: f32,
    /// Sum of its samples' positions by their weights, px from the pixel's centre.
    moment_px: [f32; 2],
    /// Setup at the sample of the greatest weight.
    pub seen: u32,
    greatest: f32,
    greatest_px: [f32; 2],
}

impl Cover {
    const NONE: Self = Self {
        group: MIXED,
        weight: 0.0,
        moment_px: [0.0; 2],
        seen: SKY,
        greatest: 0.0,
        greatest_px: [0.0; 2],
    };

    /// Position of the middle of the surface's part, px from the pixel's centre.
    pub fn middle_px(&self) -> [f32; 2] {
        self.moment_px.map(|moment| moment / self.weight)
    }

    /// Position of a sample that surely lies on `seen`, px from the pixel's centre.
    pub fn sure_px(&self) -> [f32; 2] {
        self.greatest_px
    }
}

/// Addition of one sample, or of a pixel of them, to a surface's part.
struct Part {
    seen: u32,
    weight: f32,
    offset_px: [f32; 2],
}

/// Surfaces of one pixel, in the order in which they are met.
pub struct Covers {
    covers: [Cover; COVERS],
    count: usize,
    /// Number of the surface met last, which the next sample most likely sees, too.
    last: usize,
}

impl Covers {
    fn add(&mut self, group: u64, part: &Part, moment_px: [f32; 2]) {
        if self.covers[self.last].group != group {
            let found = self.covers[..self.count].iter().position(|cover| cover.group == group);
            self.last = found.unwrap_or(self.count.min(COVERS - 1));
            if found.is_none() && self.count < COVERS {
                self.count += 1;
                self.covers[self.last].group = group;
            }
        }
        let cover = &mut self.covers[self.last];
        cover.weight += part.weight;
        cover.moment_px[0] += moment_px[0];
        cover.moment_px[1] += moment_px[1];
        if part.weight > cover.greatest {
            (cover.seen, cover.greatest, cover.greatest_px) =
                (part.seen, part.weight, part.offset_px);
        }
    }

    /// Surfaces that give more than a two-hundredth of the light: what is less is not worth a
    /// look.
    pub fn seen(&self) -> impl Iterator<Item = &Cover> {
        self.covers[..self.count].iter().filter(|cover| cover.weight > 0.005)
    }
}

/// The kernel at a distance along one axis, px, up to a factor.
fn spline(distance_px: f64) -> f64 {
    let distance = distance_px.abs() / SPREAD;
    if distance < 0.5 {
        0.75 - distance * distance
    } else if distance < 1.5 {
        0.5 * (1.5 - distance) * (1.5 - distance)
    } else {
        0.0
    }
}

impl Kernel {
    /// Weighs the samples; the weights of a phase add up to 1.
    pub fn new() -> Self {
        let mut kernel = Self {
            weights: [[[0.0; SAMPLES]; NEIGHBOURS]; PHASES],
            offsets_px: [[[[0.0; 2]; SAMPLES]; NEIGHBOURS]; PHASES],
            pixels: [[[0.0; 3]; NEIGHBOURS]; PHASES],
        };
        for phase in 0..PHASES {
            let mut raw = [[0.0; SAMPLES]; NEIGHBOURS];
            let mut sum = 0.0;
            for (neighbour, pixel) in raw.iter_mut().enumerate() {
                let (right, down) = (neighbour % 3, neighbour / 3);
                // The row of the neighbour decides how its samples are shifted.
                let row = phase + PHASES + down - 1;
                for (sample, weight) in pixel.iter_mut().enumerate() {
                    let (x, y) = offset_px(sample, row);
                    let (x, y) = (x + right as f64 - 1.0, y + down as f64 - 1.0);
                    *weight = spline(x) * spline(y);
                    sum += *weight;
                    kernel.offsets_px[phase][neighbour][sample] = [x as f32, y as f32];
                }
            }
            kernel.weights[phase] = raw.map(|pixel| pixel.map(|weight| (weight / sum) as f32));
            for neighbour in 0..NEIGHBOURS {
                let weights = kernel.weights[phase][neighbour].iter();
                for (weight, [x, y]) in weights.zip(kernel.offsets_px[phase][neighbour]) {
                    let sums = &mut kernel.pixels[phase][neighbour];
                    *sums = [sums[0] + weight, sums[1] + weight * x, sums[2] + weight * y];
                }
            }
        }
        kernel
    }
}

/// A band's samples with the groups they belong to.
pub struct Groups<'a> {
    band: &'a Band,
    setups: &'a [Setup],
    kernel: &'a Kernel,
    width: usize,
    /// Group that all samples of a pixel see, or `MIXED`.
    pixels: Vec<u64>,
}

impl<'a> Groups<'a> {
    /// Finds the pixels that see one group.
    pub fn new(band: &'a Band, setups: &'a [Setup], kernel: &'a Kernel, width: usize) -> Self {
        let mut groups =
            Self { band, setups, kernel, width, pixels: Vec::with_capacity(band.rows * width) };
        for row in 0..band.rows {
            let samples: [&[u32]; SAMPLES] = core::array::from_fn(|sample| band.row(sample, row));
            for column in 0..width {
                let first = samples[0][column];
                // Most pixels see one triangle, which needs no look at its group.
                let one = samples.iter().all(|seen| {
                    seen[column] == first || groups.group(seen[column]) == groups.group(first)
                });
                groups.pixels.push(if one { groups.group(first) } else { MIXED });
            }
        }
        groups
    }

    fn group(&self, seen: u32) -> u64 {
        if seen == SKY { SKY_GROUP } else { self.setups[seen as usize].group }
    }

    /// Returns true if a pixel and all around it see one group; `row` and `column` are at least 1
    /// from the band's border.
    pub fn is_plain(&self, row: usize, column: usize) -> bool {
        let start = row * self.width + column;
        let centre = self.pixels[start];
        centre != MIXED
            && [start - self.width, start, start + self.width]
                .iter()
                .all(|&at| self.pixels[at - 1..=at + 1].iter().all(|&group| group == centre))
    }

    /// The surfaces of a pixel, with their shares, in the order in which they are met.
    pub fn covers(&self, row: usize, column: usize) -> Covers {
        let mut list = Covers { covers: [Cover::NONE; COVERS], count: 0, last: 0 };
        let phase = (self.band.first_row + row) % PHASES;
        for neighbour in 0..NEIGHBOURS {
            let (v, u) = (row + neighbour / 3 - 1, column + neighbour % 3 - 1);
            let known = self.pixels[v * self.width + u];
            if known != MIXED {
                // All of such a pixel at once.
                let [weight, right, down] = self.kernel.pixels[phase][neighbour];
                let offset_px = [(neighbour % 3) as f32 - 1.0, (neighbour / 3) as f32 - 1.0];
                let part = Part { seen: self.band.row(0, v)[u], weight, offset_px };
                list.add(known, &part, [right, down]);
                continue;
            }
            for sample in 0..SAMPLES {
                let seen = self.band.row(sample, v)[u];
                let weight = self.kernel.weights[phase][neighbour][sample];
                let offset_px = self.kernel.offsets_px[phase][neighbour][sample];
                let moment_px = offset_px.map(|offset| weight * offset);
                list.add(self.group(seen), &Part { seen, weight, offset_px }, moment_px);
            }
        }
        list
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_each_phase_are_centred_and_as_wide_as_pixel_and_lens() {
        let kernel = Kernel::new();
        for phase in 0..PHASES {
            let (mut sum, mut mean, mut square) = (0.0, [0.0; 2], [0.0; 2]);
            for neighbour in 0..NEIGHBOURS {
                for sample in 0..SAMPLES {
                    let weight = f64::from(kernel.weights[phase][neighbour][sample]);
                    sum += weight;
                    for axis in 0..2 {
                        let at = f64::from(kernel.offsets_px[phase][neighbour][sample][axis]);
                        mean[axis] += weight * at;
                        square[axis] += weight * at * at;
                    }
                }
            }
            assert!((sum - 1.0).abs() < 1e-5);
            for axis in 0..2 {
                assert!(mean[axis].abs() < 0.01, "phase {phase} is off by {} px", mean[axis]);
                let deviation = libm::sqrt(square[axis]);
                assert!((deviation - 0.57).abs() < 0.02, "a deviation of {deviation} px");
            }
        }
    }
}
