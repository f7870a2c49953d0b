//! A network: its input, and running it on parts of pictures.

pub use super::arrays::Output;
use super::arrays::{InputShape, Numbers, Request};
use super::picture::{Fit, Picture};
use super::runtime::Runtime;
use super::settings::Settings;
use super::worker::{self, Worker};
use crate::formats::bounds::{MAX_NETWORK_INPUT_PX, thousands};
use crate::input::source::StopRequest;
use std::path::Path;
use std::sync::Mutex;

/// Grey value of the input outside the picture.
const GREY: f32 = 114.0;

/// The input of a network: one picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// Width and height, px.
    pub size: (usize, usize),
    /// True if channels come last: `[1, H, W, 3]`.
    channels_last: bool,
    /// True if the input takes bytes.
    pub bytes: bool,
}

/// Form of an input's values: `(value - mean) * scale` of values from 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InputValues {
    pub blue_first: bool,
    pub mean: [f32; 3],
    pub scale: [f32; 3],
}

/// A network that was loaded.
pub struct Model {
    runner: Runner,
    input: Input,
}

/// Place where a network runs.
enum Runner {
    /// In this process.
    Here(Box<Runtime>),
    /// In a process of its own, one picture at a time.
    Apart(Mutex<Worker>),
}

impl Model {
    /// Loads a network, in a process of its own where the program can be one.
    ///
    /// # Errors
    /// The runtime refuses it, it does not have one picture as input, or the picture is too large.
    pub fn open(path: &Path, settings: &Settings, stop: &StopRequest) -> Result<Self, String> {
        let (runner, shape) = match worker::program() {
            Some(program) => {
                let (worker, shape) = Worker::start(program, path, stop.clone())?;
                (Runner::Apart(Mutex::new(worker)), shape)
            }
            None => {
                let (runtime, shape) = Runtime::open(path)?;
                (Runner::Here(Box::new(runtime)), shape)
            }
        };
        let input = Input::of(&shape, settings)?;
        Ok(Self { runner, input })
    }

    /// The input.
    pub fn input(&self) -> Input {
        self.input
    }

    /// Runs it on a part of a picture, whose values become as `values` says.
    ///
    /// # Errors
    /// The runtime fails, an output is no array of numbers, or a bound is met.
    pub fn run(
        &self,
        picture: &Picture<'_>,
        fit: &Fit,
        values: &InputValues,
    ) -> Result<Vec<Output>, String> {
        let request = self.input.request(picture, fit, values);
        match &self.runner {
            Runner::Here(runtime) => runtime.run(request),
            Runner::Apart(worker) => match worker.lock() {
                Ok(mut worker) => worker.run(&request),
                Err(_) => Err("its process was left while it computed".to_owned()),
            },
        }
    }
}

impl Input {
    /// Told from a shape; sizes that it leaves open are those of the settings.
    fn of(InputShape { sides, bytes }: &InputShape, settings: &Settings) -> Result<Self, String> {
        let shown: Vec<String> = sides
            .iter()
            .map(|side| side.map_or_else(|| "?".to_owned(), |side| side.to_string()))
            .collect();
        let (channels_last, height, width) = match sides[..] {
            [None | Some(1), Some(3), height, width] => (false, height, width),
            [None | Some(1), height, width, Some(3)] => (true, height, width),
            _ => {
                return Err(format!(
                    "its input has the shape [{}], not that of a picture, [1, 3, H, W] or [1, H, \
                     W, 3]",
                    shown.join(", ")
                ));
            }
        };
        let differs = |fixed: Option<usize>, given: Option<usize>| {
            fixed.zip(given).is_some_and(|(fixed, given)| fixed != given)
        };
        if differs(width, settings.width) || differs(height, settings.height) {
            return Err(format!(
                "its input has the shape [{}]: leave width and height out of its settings",
                shown.join(", ")
            ));
        }
        match (width.or(settings.width), height.or(settings.height)) {
            (Some(width), Some(height))
                if width.checked_mul(height).is_none_or(|pixels| pixels > MAX_NETWORK_INPUT_PX) =>
            {
                Err(format!(
                    "its input has {width} x {height} px; at most {} px are given to a network. \
                     Export it smaller",
                    thousands(MAX_NETWORK_INPUT_PX)
                ))
            }
            (Some(width), Some(height)) if width.min(height) >= 32 => {
                Ok(Self { size: (width, height), channels_last, bytes: *bytes })
            }
            (Some(width), Some(height)) => {
                Err(format!("its input of {width} x {height} px is too small for a picture"))
            }
            _ => Err(format!(
                "its input has the shape [{}], which leaves the size open. Write it to the file of \
                 its settings: width = 640 and height = 640",
                shown.join(", ")
            )),
        }
    }

    /// The part of a picture as the network takes it.
    fn request(&self, picture: &Picture<'_>, fit: &Fit, kind: &InputValues) -> Request {
        let (width, height) = self.size;
        let mut values = vec![0.0f32; 3 * width * height];
        for at in 0..width * height {
            let point = [(at % width) as f64 + 0.5, (at / width) as f64 + 0.5];
            let mut colour = [GREY; 3];
            if fit.is_filled(point) {
                let [x, y] = fit.picture_point(point);
                colour = picture.sample(x, y);
            }
            if kind.blue_first {
                colour.reverse();
            }
            for (channel, value) in colour.into_iter().enumerate() {
                let to = if self.channels_last {
                    3 * at + channel
                } else {
                    channel * width * height + at
                };
                values[to] = (value - kind.mean[channel]) * kind.scale[channel];
            }
        }
        let shape = if self.channels_last { [1, height, width, 3] } else { [1, 3, height, width] };
        let byte = |value: &f32| value.round().clamp(0.0, 255.0) as u8;
        let numbers = if self.bytes {
            Numbers::Bytes(values.iter().map(byte).collect())
        } else {
            Numbers::Floats(values)
        };
        Request { shape, numbers }
    }
}
