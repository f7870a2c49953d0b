//! State between calls: the mapper and the source of its pairs.

use crate::{NUMBERS, memory};
use core::cell::UnsafeCell;
use dynvox_clip::{Clip, Frame};
use dynvox_core::image::View;
use dynvox_core::memory::SLAB_ALIGN;
use dynvox_core::view::Triangle;
use dynvox_core::{Capacity, Config, Mapper, Report, Serial, Severity, StepError, StereoFrame};

/// Source of the pairs.
pub enum Source {
    /// A clip in memory.
    Clip(Clip<'static>),
    /// Left and right grey image, which the page writes.
    Pairs([&'static [u8]; 2]),
}

impl Source {
    /// Pairs of a clip.
    pub fn clip(clip: Clip<'static>) -> Self {
        Self::Clip(clip)
    }

    /// Pairs of so many pixels each, in memory of their own.
    pub fn pairs(pixels: usize) -> Self {
        Self::Pairs([(); 2].map(|()| memory::bytes(memory::reserve(pixels), pixels)))
    }
}

/// The mapper of this instance.
pub struct State {
    mapper: Mapper<'static>,
    source: Source,
    size: [usize; 2],
    frames: usize,
    /// Numbers of the last step.
    pub numbers: [f64; NUMBERS],
}

impl State {
    /// A mapper in a slab of its own; `None` if the settings are refused or memory is short.
    pub fn new(
        capacity: &Capacity,
        config: &Config,
        source: Source,
        size: [usize; 2],
    ) -> Option<Self> {
        let bytes = capacity.bytes() + SLAB_ALIGN;
        let slab = memory::bytes_mut(memory::reserve(bytes), bytes);
        let mapper = Mapper::new(capacity, config, slab).ok()?;
        let mut numbers = [0.0; NUMBERS];
        [numbers[0], numbers[1], numbers[3]] =
            [size[0], size[1], capacity.bytes()].map(|of| of as f64);
        if let Source::Pairs([left, right]) = &source {
            [numbers[15], numbers[16]] = [left, right].map(|image| image.as_ptr() as usize as f64);
        }
        Some(Self { mapper, source, size, frames: 0, numbers })
    }

    /// Maps the next frame; see [`crate::step`].
    pub fn step(&mut self) -> u32 {
        let [width, height] = self.size;
        let stepped = match &self.source {
            Source::Clip(clip) => {
                let Some(Frame::Pair(pair)) = clip.frames().nth(self.frames) else { return 0 };
                let frame = pair.stereo();
                let images = [frame.left, frame.right].map(|image| image.row(0).as_ptr());
                [self.numbers[15], self.numbers[16]] = images.map(|start| start as usize as f64);
                self.mapper.step(&frame, &Serial)
            }
            Source::Pairs([left, right]) => {
                let [left, right] = [left, right].map(|image| View::new(image, width, height));
                let (Some(left), Some(right)) = (left, right) else { return 2 };
                self.mapper.step(&StereoFrame::pair(left, right), &Serial)
            }
        };
        self.note(stepped)
    }

    /// Notes the numbers of a step.
    fn note(&mut self, stepped: Result<Report, StepError>) -> u32 {
        let Ok(report) = stepped else { return 2 };
        self.frames += 1;
        let numbers = &mut self.numbers;
        numbers[2] = self.frames as f64;
        numbers[4] = f64::from(report.blocks.used);
        numbers[5] = f64::from((report.digest >> 32) as u32);
        numbers[6] = f64::from(report.digest as u32);
        numbers[7] = match report.severity() {
            Severity::Info => 0.0,
            Severity::Recovered => 1.0,
            _ => 2.0,
        };
        let pose = &report.t_world_camera;
        numbers[8..11].copy_from_slice(&pose.translation_m);
        numbers[11..15].copy_from_slice(&pose.rotation);
        numbers[17] = self.mapper.disparity_q8().row(0).as_ptr() as usize as f64;
        1
    }

    /// Writes triangles; see [`crate::triangles`].
    pub fn triangles(&self, out: &mut impl Iterator<Item = &'static mut [u8]>) -> u32 {
        let count = self.mapper.triangles(&mut |triangle: Triangle| {
            for (vertex, bytes) in triangle.vertices.iter().zip(&mut *out) {
                for (coordinate, at) in vertex.position_m.iter().zip(bytes.chunks_exact_mut(4)) {
                    at.copy_from_slice(&coordinate.to_le_bytes());
                }
                let [red, green, blue] = vertex.colour;
                bytes[12..].copy_from_slice(&[red, green, blue, vertex.weight]);
            }
        });
        count as u32
    }
}

/// The one state of an instance.
struct Instance(UnsafeCell<Option<State>>);

// SAFETY: an instance has one thread.
unsafe impl Sync for Instance {}

static STATE: Instance = Instance(UnsafeCell::new(None));

/// Makes the state. False if it cannot be made.
pub fn begin(make: impl FnOnce() -> Option<State>) -> bool {
    // SAFETY: one thread, and no other reference lives while an export runs.
    let state = unsafe { &mut *STATE.0.get() };
    *state = make();
    state.is_some()
}

/// Uses the state where there is one.
pub fn with<T>(use_it: impl FnOnce(&mut State) -> T) -> Option<T> {
    // SAFETY: as above.
    unsafe { &mut *STATE.0.get() }.as_mut().map(use_it)
}
