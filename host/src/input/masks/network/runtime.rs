//! The runtime of networks: loading one and running it on numbers.

use super::arrays::{InputShape, Numbers, Output, Request};
use crate::formats::bounds::{
    MAX_NETWORK_FILE_BYTES, MAX_NETWORK_OUTPUTS, check_bytes, check_output,
};
use rten::{DataType, Dimension, NodeId, RunOptions, ThreadPool, Value, ValueType};
use rten_tensor::prelude::*;
use std::path::Path;
use std::sync::Arc;

/// A network that was loaded.
pub struct Runtime {
    model: rten::Model,
    input_id: NodeId,
    /// One thread: with two the results have other bits.
    options: RunOptions,
}

impl Runtime {
    /// Loads a network.
    ///
    /// # Errors
    /// The file is too long, the runtime refuses it, or it does not have one input.
    pub fn open(path: &Path) -> Result<(Self, InputShape), String> {
        let len = path.metadata().map_err(|error| error.to_string())?.len();
        check_bytes("a network", len, MAX_NETWORK_FILE_BYTES)?;
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
        let side = |side: &Dimension| {
            if let Dimension::Fixed(side) = side { Some(*side) } else { None }
        };
        let shape = InputShape { sides: shape.iter().map(side).collect(), bytes };
        let options =
            RunOptions::default().with_thread_pool(Some(Arc::new(ThreadPool::with_num_threads(1))));
        Ok((Self { input_id: *input_id, options, model }, shape))
    }

    /// Runs it on a picture.
    ///
    /// # Errors
    /// The runtime fails, or an output is no array of numbers or has too many.
    pub fn run(&self, request: Request) -> Result<Vec<Output>, String> {
        let failed = |error: &dyn std::fmt::Display| format!("it fails in the runtime ({error})");
        let Request { shape, numbers } = request;
        let input = match numbers {
            Numbers::Bytes(values) => {
                Value::from_shape(shape, values).map_err(|error| failed(&error))?
            }
            Numbers::Floats(values) => {
                Value::from_shape(shape, values).map_err(|error| failed(&error))?
            }
        };
        let inputs = vec![(self.input_id, input.into())];
        let outputs = self.model.output_ids();
        if outputs.len() > MAX_NETWORK_OUTPUTS {
            let (found, most) = (outputs.len(), MAX_NETWORK_OUTPUTS);
            return Err(format!("it has {found} outputs; at most {most} are read"));
        }
        let values = self
            .model
            .run(inputs, outputs, Some(self.options.clone()))
            .map_err(|error| failed(&error))?;
        values.iter().map(output).collect()
    }
}

/// An output's numbers.
fn output(value: &Value) -> Result<Output, String> {
    if let Some(view) = value.as_tensor_view::<f32>() {
        check_output(view.shape())?;
        return Ok(Output { shape: view.shape().to_vec(), values: view.to_vec(), integers: false });
    }
    if let Some(view) = value.as_tensor_view::<i32>() {
        check_output(view.shape())?;
        return Ok(Output {
            shape: view.shape().to_vec(),
            values: view.iter().map(|value| *value as f32).collect(),
            integers: true,
        });
    }
    let view = value.as_tensor_view::<u8>().ok_or_else(|| {
        "an output is no array of numbers. Export it with arrays alone".to_owned()
    })?;
    check_output(view.shape())?;
    Ok(Output {
        shape: view.shape().to_vec(),
        values: view.iter().map(|value| f32::from(*value)).collect(),
        integers: true,
    })
}
