//! Errors as exceptions, with the sentences of the command line.

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

create_exception!(
    dynvox,
    Error,
    PyException,
    "What is wrong, and what to do about it, in the sentences of the command line."
);

/// An exception with this sentence.
pub fn refuse(sentence: impl Into<String>) -> PyErr {
    Error::new_err(sentence.into())
}

/// Any error of the host as an exception.
pub fn raise(error: impl Into<anyhow::Error>) -> PyErr {
    refuse(dynvox::sentence(&error.into()))
}
