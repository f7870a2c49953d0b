//! Arrays of numbers that go into a network and come out of it.

/// Values of an input.
#[derive(Clone, Debug, PartialEq)]
pub enum Numbers {
    Bytes(Vec<u8>),
    Floats(Vec<f32>),
}

/// A picture as a network takes it: four axes and their values.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    pub shape: [usize; 4],
    pub numbers: Numbers,
}

/// Lengths of the input's axes, `None` where they are open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputShape {
    pub sides: Vec<Option<usize>>,
    /// True if the input takes bytes.
    pub bytes: bool,
}

/// An output of a network.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    pub shape: Vec<usize>,
    pub values: Vec<f32>,
    /// True if the values are whole numbers.
    pub integers: bool,
}
