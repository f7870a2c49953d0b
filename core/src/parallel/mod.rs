//! Division of work: how it is split and where it runs. No other module knows.
//!
//! The core splits work into four bands at boundaries that depend on its amount alone, and asks an
//! [`Executor`] to do them. Whether they run one after the other or at once is the caller's business
//! and can never change a result: no band reads what another one writes.

use crate::Stage;

mod bands;
mod vectors;

pub use bands::each;
pub(crate) use bands::{BANDS, Bands, zip2, zip3};
pub use vectors::Vectors;
pub(crate) use vectors::{Level, Work};

/// Runs work for the core.
///
/// ```
/// use dynvox_core::{Executor, Stage};
///
/// /// Runs halves on two threads.
/// struct TwoThreads;
///
/// impl Executor for TwoThreads {
///     fn join<A, B, RA, RB>(&self, a: A, b: B) -> (RA, RB)
///     where
///         A: FnOnce() -> RA + Send,
///         B: FnOnce() -> RB + Send,
///         RA: Send,
///         RB: Send,
///     {
///         std::thread::scope(|scope| {
///             let b = scope.spawn(b);
///             (a(), b.join().unwrap())
///         })
///     }
/// }
///
/// assert_eq!(TwoThreads.join(|| 1, || 2), (1, 2));
/// assert_eq!(TwoThreads.stage(Stage::Fuse, || 3), 3);
/// ```
pub trait Executor: Sync {
    /// Does both and returns both results, in any order or at once; one after the other unless an
    /// executor knows better.
    fn join<A, B, RA, RB>(&self, a: A, b: B) -> (RA, RB)
    where
        A: FnOnce() -> RA + Send,
        B: FnOnce() -> RB + Send,
        RA: Send,
        RB: Send,
    {
        (a(), b())
    }

    /// Runs one stage. A host overrides this to take its time; no clock enters the core.
    fn stage<R>(&self, _stage: Stage, work: impl FnOnce() -> R) -> R {
        work()
    }

    /// Vector instructions that kernels may use. A host that asked its processor for more than the
    /// target's machines all have overrides this; no bit depends on it.
    fn vectors(&self) -> Vectors {
        Vectors::BASELINE
    }
}

/// Runs jobs one after the other, on the caller's thread.
///
/// ```
/// use dynvox_core::{Executor, Serial};
///
/// assert_eq!(Serial.join(|| "first", || "second"), ("first", "second"));
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct Serial;

impl Executor for Serial {}

/// Two threads, to show that they make no difference.
#[cfg(test)]
pub(crate) struct TwoThreads;

#[cfg(test)]
impl Executor for TwoThreads {
    fn join<A, B, RA, RB>(&self, a: A, b: B) -> (RA, RB)
    where
        A: FnOnce() -> RA + Send,
        B: FnOnce() -> RB + Send,
        RA: Send,
        RB: Send,
    {
        std::thread::scope(|scope| {
            let b = scope.spawn(b);
            (a(), b.join().unwrap())
        })
    }
}
