//! Where work runs. The core splits work at fixed boundaries and asks for two things to be done; whether one after the other or at once
//! is the caller's business and can never change a result.

/// A stage of the pipeline, as a name for measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Disparity from the stereo pair.
    Stereo,
    /// Features and matches over four images.
    SceneFlow,
    /// Camera motion from the matches.
    Egomotion,
    /// What moves or could: detections, tracks, motions, volumes of objects.
    Instances,
    /// Blocks made and marked visible.
    Allocate,
    /// Depth and colour averaged into voxels.
    Fuse,
    /// Noise taken out of blocks that leave the window.
    Prune,
    /// The map seen from a pose.
    Raycast,
}

impl Stage {
    /// All stages, in pipeline order.
    pub const ALL: [Self; 8] =
        [Self::Stereo, Self::SceneFlow, Self::Egomotion, Self::Instances, Self::Allocate, Self::Fuse, Self::Prune, Self::Raycast];

    /// Name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stereo => "stereo",
            Self::SceneFlow => "scene_flow",
            Self::Egomotion => "egomotion",
            Self::Instances => "instances",
            Self::Allocate => "allocate",
            Self::Fuse => "fuse",
            Self::Prune => "prune",
            Self::Raycast => "raycast",
        }
    }
}

/// Runs work for the core.
pub trait Executor: Sync {
    /// Does both and returns both results, in any order or at once; one after the other unless an executor knows better.
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
}

/// One thing after the other, on the caller's thread.
#[derive(Clone, Copy, Debug, Default)]
pub struct Serial;

impl Executor for Serial {}

/// Does four things; executors with more than two threads spread them.
pub fn join4<E: Executor>(
    executor: &E,
    a: impl FnOnce() + Send,
    b: impl FnOnce() + Send,
    c: impl FnOnce() + Send,
    d: impl FnOnce() + Send,
) {
    executor.join(|| executor.join(a, b), || executor.join(c, d));
}

/// Really at once, to show that it makes no difference.
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
