//! Messages between the program and the process of a network: arrays of numbers, each with its
//! shape, in the machine's byte order.

use super::arrays::{InputShape, Numbers, Output, Request};
use crate::formats::bounds::{MAX_NETWORK_INPUT_PX, MAX_NETWORK_OUTPUTS, check_output};
use bytemuck::{cast_slice, cast_slice_mut};
use std::io::{self, Read, Write};

/// Axes of an array.
const MAX_AXES: usize = 8;
/// Bytes of a refusal.
const MAX_REFUSAL: u64 = 4_096;
/// Mark of an axis whose length a network leaves open.
const OPEN: u64 = u64::MAX;

/// Answer of a network, or its refusal.
pub type Answer<T> = Result<T, String>;

fn invalid() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "a message that is none")
}

fn put(to: &mut impl Write, number: u64) -> io::Result<()> {
    to.write_all(&number.to_ne_bytes())
}

fn get(from: &mut impl Read) -> io::Result<u64> {
    let mut bytes = [0; 8];
    from.read_exact(&mut bytes)?;
    Ok(u64::from_ne_bytes(bytes))
}

/// A number that may not exceed `most`.
fn get_within(from: &mut impl Read, most: usize) -> io::Result<usize> {
    usize::try_from(get(from)?).ok().filter(|number| *number <= most).ok_or_else(invalid)
}

impl Request {
    /// Writes the request.
    pub fn write(&self, to: &mut impl Write) -> io::Result<()> {
        for side in self.shape {
            put(to, side as u64)?;
        }
        match &self.numbers {
            Numbers::Bytes(values) => {
                put(to, 1)?;
                to.write_all(values)?;
            }
            Numbers::Floats(values) => {
                put(to, 4)?;
                to.write_all(cast_slice(values))?;
            }
        }
        to.flush()
    }

    /// Reads a request; `None` where none follows.
    pub fn read(from: &mut impl Read) -> io::Result<Option<Self>> {
        let mut shape = [0; 4];
        for (axis, side) in shape.iter_mut().enumerate() {
            *side = match get(from) {
                Err(error) if axis == 0 && error.kind() == io::ErrorKind::UnexpectedEof => {
                    return Ok(None);
                }
                side => side? as usize,
            };
        }
        let count = shape.iter().try_fold(1usize, |count, side| count.checked_mul(*side));
        let count = count.filter(|count| *count <= 3 * MAX_NETWORK_INPUT_PX).ok_or_else(invalid)?;
        let numbers = if get(from)? == 1 {
            let mut values = vec![0; count];
            from.read_exact(&mut values)?;
            Numbers::Bytes(values)
        } else {
            let mut values = vec![0.0f32; count];
            from.read_exact(cast_slice_mut(&mut values))?;
            Numbers::Floats(values)
        };
        Ok(Some(Self { shape, numbers }))
    }
}

/// Writes an answer, its content by `content`.
fn write_answer<T>(
    answer: &Answer<T>,
    to: &mut impl Write,
    content: impl FnOnce(&T, &mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    match answer {
        Ok(value) => {
            put(to, 1)?;
            content(value, to)?;
        }
        Err(reason) => {
            put(to, 0)?;
            let end = reason.floor_char_boundary(MAX_REFUSAL as usize);
            put(to, end as u64)?;
            to.write_all(&reason.as_bytes()[..end])?;
        }
    }
    to.flush()
}

/// Reads an answer, its content by `content`.
fn read_answer<T, R: Read>(
    from: &mut R,
    content: impl FnOnce(&mut R) -> io::Result<T>,
) -> io::Result<Answer<T>> {
    if get(from)? == 1 {
        return content(from).map(Ok);
    }
    let mut reason = vec![0; get_within(from, MAX_REFUSAL as usize)?];
    from.read_exact(&mut reason)?;
    Ok(Err(String::from_utf8_lossy(&reason).into_owned()))
}

/// Writes the shape of the input.
pub fn write_input(answer: &Answer<InputShape>, to: &mut impl Write) -> io::Result<()> {
    write_answer(answer, to, |shape, mut to| {
        put(&mut to, u64::from(shape.bytes))?;
        put(&mut to, shape.sides.len() as u64)?;
        shape.sides.iter().try_for_each(|side| put(&mut to, side.map_or(OPEN, |side| side as u64)))
    })
}

/// Reads the shape of the input.
pub fn read_input(from: &mut impl Read) -> io::Result<Answer<InputShape>> {
    read_answer(from, |from| {
        let bytes = get(from)? == 1;
        let axes = get_within(from, MAX_AXES)?;
        let side = |from: &mut _| get(from).map(|side| (side != OPEN).then_some(side as usize));
        let sides = (0..axes).map(|_| side(from)).collect::<io::Result<_>>()?;
        Ok(InputShape { sides, bytes })
    })
}

/// Writes the outputs.
pub fn write_outputs(answer: &Answer<Vec<Output>>, to: &mut impl Write) -> io::Result<()> {
    write_answer(answer, to, |outputs, mut to| {
        put(&mut to, outputs.len() as u64)?;
        for output in outputs {
            put(&mut to, u64::from(output.integers))?;
            put(&mut to, output.shape.len() as u64)?;
            output.shape.iter().try_for_each(|side| put(&mut to, *side as u64))?;
            to.write_all(cast_slice(&output.values))?;
        }
        Ok(())
    })
}

/// Reads the outputs.
pub fn read_outputs(from: &mut impl Read) -> io::Result<Answer<Vec<Output>>> {
    read_answer(from, |from| {
        let count = get_within(from, MAX_NETWORK_OUTPUTS)?;
        (0..count).map(|_| read_output(from)).collect()
    })
}

fn read_output(from: &mut impl Read) -> io::Result<Output> {
    let integers = get(from)? == 1;
    let axes = get_within(from, MAX_AXES)?;
    let shape: Vec<usize> =
        (0..axes).map(|_| get(from).map(|side| side as usize)).collect::<io::Result<_>>()?;
    let count = check_output(&shape).map_err(|_| invalid())?;
    let mut values = vec![0.0f32; count];
    from.read_exact(cast_slice_mut(&mut values))?;
    Ok(Output { shape, values, integers })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_come_back_and_lengths_beyond_the_bounds_are_refused() {
        let request = Request { shape: [1, 3, 2, 1], numbers: Numbers::Floats(vec![0.5; 6]) };
        let mut bytes = Vec::new();
        request.write(&mut bytes).unwrap();
        assert_eq!(Request::read(&mut &bytes[..]).unwrap(), Some(request));
        assert_eq!(Request::read(&mut &[][..]).unwrap(), None);
        assert!(Request::read(&mut &bytes[..bytes.len() - 1]).is_err());
        bytes[..8].copy_from_slice(&u64::MAX.to_ne_bytes());
        assert!(Request::read(&mut &bytes[..]).is_err());

        let output = Output { shape: vec![1, 2], values: vec![1.0, f32::NAN], integers: true };
        let mut bytes = Vec::new();
        write_outputs(&Ok(vec![output]), &mut bytes).unwrap();
        let read = read_outputs(&mut &bytes[..]).unwrap().unwrap();
        assert!(read[0].integers && read[0].shape == [1, 2] && read[0].values[1].is_nan());
        let refused: Answer<Vec<Output>> = Err("no".to_owned());
        let mut bytes = Vec::new();
        write_outputs(&refused, &mut bytes).unwrap();
        assert_eq!(read_outputs(&mut &bytes[..]).unwrap(), refused);

        let shape = Ok(InputShape { sides: vec![None, Some(3)], bytes: true });
        let mut bytes = Vec::new();
        write_input(&shape, &mut bytes).unwrap();
        assert_eq!(read_input(&mut &bytes[..]).unwrap(), shape);
    }
}
