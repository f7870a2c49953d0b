//! Threads and time for the core: a pool of N threads, the CPU time of all threads, and per stage
//! the wall time and that CPU time.
//!
//! CPU time is the threads' own clock, so it counts work, not waiting, and does not grow when
//! others use the machine. Each thread knows the stage it works for; whenever that changes (a stage
//! begins or ends, a piece of work is taken over from another thread) the time since the last
//! change is charged to the stage before. So work that runs elsewhere is charged once, to the right
//! stage.

use crate::observe::{STAGES, StageTime, StepTimes};
use cpu_time::ThreadTime;
use dynvox_core::{Executor, Stage, parallel::Vectors};
use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Index under which work of no stage is counted.
const OUTSIDE: usize = STAGES;

/// Runs the core's work on a number of threads and takes the time.
pub struct Threads {
    pool: Option<rayon::ThreadPool>,
    count: usize,
    vectors: Vectors,
    wall_ns: [AtomicU64; STAGES],
    cpu_ns: [AtomicU64; STAGES + 1],
}

thread_local! {
    /// The stage this thread works for and the thread's clock at the last change.
    static WORKING_FOR: Cell<Option<(usize, ThreadTime)>> = const { Cell::new(None) };
}

impl Threads {
    /// A pool of `count` threads; one thread needs none and works where it is called.
    pub fn new(count: usize) -> Result<Self, rayon::ThreadPoolBuildError> {
        let build = || {
            rayon::ThreadPoolBuilder::new()
                .num_threads(count)
                .thread_name(|at| format!("dynvox-{at}"))
                .build()
        };
        let pool = if count > 1 { Some(build()?) } else { None };
        Ok(Self {
            pool,
            count: count.max(1),
            vectors: Vectors::detect(),
            wall_ns: Default::default(),
            cpu_ns: Default::default(),
        })
    }

    /// Threads at work.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Runs `work` within the pool, so that what it joins is spread over it.
    pub fn run<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        let work = || self.charged(Some(OUTSIDE), work);
        match &self.pool {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }

    /// The times since the last call, and begins anew.
    pub fn take_times(&self) -> StepTimes {
        let taken = |ns: &AtomicU64| ns.swap(0, Ordering::Relaxed) as f64 * 1e-6;
        let mut times = StepTimes { cpu_ms: taken(&self.cpu_ns[OUTSIDE]), ..StepTimes::default() };
        for ((time, wall), cpu) in times.stages.iter_mut().zip(&self.wall_ns).zip(&self.cpu_ns) {
            *time = StageTime { wall_ms: taken(wall), cpu_ms: taken(cpu) };
            times.cpu_ms += time.cpu_ms;
        }
        times
    }

    /// Works for `stage` from here on; what was done before is charged to the stage before, which
    /// is returned.
    fn switch(&self, stage: Option<usize>) -> Option<usize> {
        let now = ThreadTime::now();
        let before = WORKING_FOR.replace(stage.map(|stage| (stage, now)));
        let (before, since) = before?;
        if let Some(ns) = self.cpu_ns.get(before) {
            ns.fetch_add(nanoseconds(now.duration_since(since)), Ordering::Relaxed);
        }
        Some(before)
    }

    fn charged<R>(&self, stage: Option<usize>, work: impl FnOnce() -> R) -> R {
        let current = WORKING_FOR.get().map(|(stage, _)| stage);
        if current == stage {
            return work();
        }
        let before = self.switch(stage);
        let result = work();
        self.switch(before);
        result
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

impl Executor for Threads {
    fn join<A, B, RA, RB>(&self, a: A, b: B) -> (RA, RB)
    where
        A: FnOnce() -> RA + Send,
        B: FnOnce() -> RB + Send,
        RA: Send,
        RB: Send,
    {
        if self.pool.is_none() {
            return (a(), b());
        }
        let stage = WORKING_FOR.get().map(|(stage, _)| stage);
        // Either may run on another thread, or on this one while it waits within another stage's
        // work.
        rayon::join(|| self.charged(stage, a), || self.charged(stage, b))
    }

    fn stage<R>(&self, stage: Stage, work: impl FnOnce() -> R) -> R {
        let at = Stage::ALL.iter().position(|one| *one == stage);
        let begin = Instant::now();
        let result = self.charged(at, work);
        if let Some(ns) = at.and_then(|at| self.wall_ns.get(at)) {
            ns.fetch_add(nanoseconds(begin.elapsed()), Ordering::Relaxed);
        }
        result
    }

    fn vectors(&self) -> Vectors {
        self.vectors
    }
}

/// Burns CPU time on this thread, at least `ms`: a machine that is shared may take it off its
/// processor and charge that to it. What was burnt is returned.
#[cfg(test)]
pub(super) fn burn(ms: u64) -> Duration {
    let begin = ThreadTime::now();
    let mut sum = 0u64;
    loop {
        sum = std::hint::black_box(sum.wrapping_mul(31).wrapping_add(7));
        let burnt = begin.elapsed();
        if burnt >= Duration::from_millis(ms) {
            return burnt;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_of_all_threads_is_charged_once_to_the_stage_it_belongs_to() {
        for count in [1, 2, 3] {
            let threads = Threads::new(count).unwrap();
            let (outside, (stereo, (left, right))) = threads.run(|| {
                let outside = burn(5);
                let four = || dynvox_core::parallel::each(&threads, [10; 4], burn);
                let two = || threads.join(|| burn(15), || burn(15));
                let stages = threads.join(
                    || threads.stage(Stage::Stereo, four),
                    || threads.stage(Stage::SceneFlow, two),
                );
                (outside, stages)
            });
            let times = threads.take_times();
            let charged = |stage: Stage, burnt: Duration| {
                let more = times.stages[stage as usize].cpu_ms - burnt.as_secs_f64() * 1e3;
                // Less than any work that could be charged to another stage, or twice.
                assert!((0.0..5.0).contains(&more), "{count} threads, {stage:?}: {more} ms more");
            };
            let stereo = stereo.iter().sum();
            charged(Stage::Stereo, stereo);
            charged(Stage::SceneFlow, left + right);
            assert_eq!(times.stages[Stage::Fuse as usize].cpu_ms, 0.0);
            let more = times.cpu_ms - (outside + stereo + left + right).as_secs_f64() * 1e3;
            assert!((0.0..5.0).contains(&more), "{count} threads in all: {more} ms more");
            assert_eq!(threads.take_times(), StepTimes::default(), "taken times are gone");
        }
    }
}
