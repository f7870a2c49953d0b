//! Parts that the integration tests share: a slab for a mapper, clips of the synthetic street, and
//! the repository's own source.
//!
//! The Rust blocks of the README and of the book are compiled and run with the doc tests of this
//! package.
#![cfg_attr(doctest, doc = include_str!("../../README.md"))]

#[cfg(doctest)]
#[doc = include_str!("../../docs/rust.md")]
pub mod rust_page {}
#[cfg(doctest)]
#[doc = include_str!("../../docs/pin_your_rig.md")]
pub mod pin_your_rig_page {}
#[cfg(doctest)]
#[doc = include_str!("../../docs/boards.md")]
pub mod boards_page {}

pub mod fuzz;
pub mod source;

use dynvox::input::InstanceMask;
use dynvox::synth::{Street, StreetConfig, SynthFrame};
use dynvox_core::{
    Capacity, Config, Mapper, StereoFrame, image::View, masks::PixelBox, memory::SLAB_ALIGN,
    tracking::Class,
};

/// A slab on the heap.
pub struct HeapSlab(Vec<u8>);

impl HeapSlab {
    /// A zeroed slab of the capacity's size.
    pub fn of(capacity: &Capacity) -> Self {
        Self(vec![0; capacity.bytes() + SLAB_ALIGN])
    }

    /// Returns the bytes of the slab.
    pub fn bytes(&mut self) -> &mut [u8] {
        &mut self.0
    }
}

/// The synthetic street at a size, in memory.
pub struct Clip {
    street: Street,
    frames: Vec<SynthFrame>,
}

impl Clip {
    /// The first `frames` frames at `width` x `height`, with default traffic.
    pub fn street(width: u32, height: u32, frames: u32) -> Self {
        let street = Street::new(StreetConfig { width, height, frames, ..StreetConfig::default() })
            .expect("the default street is sound");
        let frames = (0..frames).map(|i| street.frame(i)).collect();
        Self { street, frames }
    }

    /// Returns the default configuration for the street.
    pub fn config(&self) -> Config {
        Config::for_rig(self.street.rig())
    }

    /// Returns the frames as the core takes them.
    pub fn stereo(&self) -> impl Iterator<Item = StereoFrame<'_>> {
        let (width, height) =
            (self.street.config().width as usize, self.street.config().height as usize);
        self.frames.iter().map(move |frame| {
            let view = |pixels| View::new(pixels, width, height).expect("a image image");
            StereoFrame::pair(view(&frame.left_grey), view(&frame.right_grey))
        })
    }

    /// Returns the masks that a detector without faults would give in each frame.
    pub fn sightings(&self) -> Vec<Vec<InstanceMask>> {
        let of = |frame: &SynthFrame| {
            let image = PixelBox {
                left: 0,
                top: 0,
                width: frame.width as i32,
                height: frame.height as i32,
            };
            let holds = |car: usize, u: i32, v: i32| {
                usize::from(frame.instances[v as usize * frame.width + u as usize]) == car + 1
            };
            let cars = frame.objects.iter().enumerate();
            cars.filter_map(|(car, _)| {
                InstanceMask::from_predicate(Class::Car, 0.9, image, |u, v| holds(car, u, v))
            })
            .collect()
        };
        self.frames.iter().map(of).collect()
    }

    /// Flips the lowest bit of a left pixel.
    pub fn flip_a_bit(&mut self, frame: usize, pixel: usize) {
        self.frames[frame].left_grey[pixel] ^= 1;
    }

    /// Runs `run` with a mapper of that capacity.
    pub fn with_mapper<R>(&self, capacity: &Capacity, run: impl FnOnce(&mut Mapper<'_>) -> R) -> R {
        let mut slab = HeapSlab::of(capacity);
        run(&mut Mapper::new(capacity, &self.config(), slab.bytes())
            .expect("the slab fits the capacity"))
    }
}
