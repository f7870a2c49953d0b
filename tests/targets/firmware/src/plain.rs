//! Executor that leaves out the kernels for the vectors of the target.

use dynvox_core::{Executor, parallel::Vectors};

/// Runs everything on one thread, without kernels for vectors.
pub struct Plain;

impl Executor for Plain {
    fn vectors(&self) -> Vectors {
        Vectors::PLAIN
    }
}
