//! A network in the runtime: its input, and running it.

use super::picture::{Fit, Picture};
use super::settings::Settings;
use rten::{DataType, Dimension, NodeId, RunOptions, ThreadPool, Value, ValueType};
use rten_tensor::prelude::*;
use std::path::Path;
use std::sync::Arc;

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

/// An output of a network.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    pub shape: Vec<usize>,
    pub values: Vec<f32>,
    /// True if the values are whole numbers.
    pub integers: bool,
}

/// A network that was loaded.
pub struct Model {
    model: rten::Model,
    input_id: NodeId,
    input: Input,
    /// One thread: with two the results have other bits.
    options: RunOptions,
}

impl Model {
    /// Loads a network.
    ///
    /// # Errors
    /// The runtime refuses it, or it does not have one picture as input.
    pub fn open(path: &Path, settings: &Settings) -> Result<Self, String> {
        let model = rten::Model::load_file(path)
            .map_err(|error| format!("the runtime does not take it ({error})"))?;
        let [input_id] = model.input_ids() else {
            return Err(format!(
                "it has {} inputs, and one picture is given. Export it with one",
                model.input_ids().len()
            ));
        };
        let info = model.node_info(*input_id);
        let bytes =
            info.as_ref().and_then(|info| info.dtype()) == Some(ValueType::Tensor(DataType::UInt8));
        let shape = info.and_then(|info| info.shape()).unwrap_or_default();
        let input = Input::of(&shape, bytes, settings)?;
        let options =
            RunOptions::default().with_thread_pool(Some(Arc::new(ThreadPool::with_num_threads(1))));
        Ok(Self { input_id: *input_id, input, options, model })
    }

    /// The input.
    pub fn input(&self) -> Input {
        self.input
    }

    /// Runs it on a part of a picture, whose values become as `values` says.
    ///
    /// # Errors
    /// The runtime fails, or an output is no array of numbers.
    pub fn run(
        &self,
        picture: &Picture<'_>,
        fit: &Fit,
        values: &InputValues,
    ) -> Result<Vec<Output>, String> {
        let failed = |error: &dyn std::fmt::Display| format!("it fails in the runtime ({error})");
        let input = self.input.value(picture, fit, values).map_err(|error| failed(&error))?;
        let inputs = vec![(self.input_id, input.into())];
        let values = self
            .model
            .run(inputs, self.model.output_ids(), Some(self.options.clone()))
            .map_err(|error| failed(&error))?;
        values
            .iter()
            .map(|value| {
                output(value).ok_or_else(|| {
                    "an output is no array of numbers. Export it with arrays alone".to_owned()
                })
            })
            .collect()
    }
}

/// An output's numbers.
fn output(value: &Value) -> Option<Output> {
    if let Some(view) = value.as_tensor_view::<f32>() {
        return Some(Output {
            shape: view.shape().to_vec(),
            values: view.to_vec(),
            integers: false,
        });
    }
    if let Some(view) = value.as_tensor_view::<i32>() {
        return Some(Output {
            shape: view.shape().to_vec(),
            values: view.iter().map(|value| *value as f32).collect(),
            integers: true,
        });
    }
    let view = value.as_tensor_view::<u8>()?;
    Some(Output {
        shape: view.shape().to_vec(),
        values: view.iter().map(|value| f32::from(*value)).collect(),
        integers: true,
    })
}

impl Input {
    /// Told from a shape; sizes that it leaves open are those of the settings.
    fn of(shape: &[Dimension], bytes: bool, settings: &Settings) -> Result<Self, String> {
        let sides: Vec<Option<usize>> = shape
            .iter()
            .map(|side| if let Dimension::Fixed(side) = side { Some(*side) } else { None })
            .collect();
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
            (Some(width), Some(height)) if width.min(height) >= 32 => {
                Ok(Self { size: (width, height), channels_last, bytes })
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
    fn value(&self, picture: &Picture<'_>, fit: &Fit, kind: &InputValues) -> Result<Value, String> {
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
        if self.bytes {
            let bytes: Vec<u8> =
                values.iter().map(|value| value.round().clamp(0.0, 255.0) as u8).collect();
            return Value::from_shape(shape, bytes).map_err(|error| error.to_string());
        }
        Value::from_shape(shape, values).map_err(|error| error.to_string())
    }
}
