//! Work and span of the core's stages: what they cost on one thread, and what bounds them on more.
//!
//! Everything runs on one thread, and its CPU time is taken apart at every `join`: so a loaded
//! machine, or one with fewer processors, gives the same answer as an idle one. What threads
//! themselves cost (waking, moving memory from cache to cache) is not in it.

use cpu_time::ThreadTime;
use dynvox_core::{Executor, Stage, parallel::Vectors};
use std::cell::Cell;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Cost of a piece of work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// CPU time of all of it.
    pub work: Duration,
    /// CPU time of the longest chain in it that must run one after the other: what it takes on ever
    /// so many threads.
    pub span: Duration,
    /// Least time on two threads: if two branches may run at once, half of their work or the span
    /// of either, whichever is most.
    pub two_threads: Duration,
}

impl Cost {
    /// Cost of work on one thread.
    fn serial(work: Duration) -> Self {
        Self { work, span: work, two_threads: work }
    }

    /// Cost of one piece of work after the other.
    fn then(self, next: Self) -> Self {
        Self {
            work: self.work + next.work,
            span: self.span + next.span,
            two_threads: self.two_threads + next.two_threads,
        }
    }

    /// Cost of two tasks at once.
    fn beside(self, other: Self) -> Self {
        let (work, span) = (self.work + other.work, self.span.max(other.span));
        Self { work, span, two_threads: span.max(work / 2) }
    }
}

/// Runs the core's work on one thread and takes its costs.
pub struct Spans {
    state: Mutex<State>,
    vectors: Vectors,
}

#[derive(Default)]
struct State {
    /// Cost since the last fork.
    cost: Cost,
    stages: [Cost; Stage::ALL.len()],
}

thread_local! {
    /// The thread's clock when the state last changed. All work runs on the thread that measures.
    static SINCE: Cell<ThreadTime> = Cell::new(ThreadTime::now());
}

impl State {
    /// Charges the time since the last call, and gives what was charged since the last fork; what
    /// follows begins at nothing.
    fn take(&mut self) -> Cost {
        let since = SINCE.get();
        let now = ThreadTime::now();
        SINCE.set(now);
        let elapsed = now.duration_since(since);
        std::mem::take(&mut self.cost).then(Cost::serial(elapsed))
    }
}

impl Spans {
    /// For kernels of these vector instructions.
    pub fn new(vectors: Vectors) -> Self {
        Self { state: Mutex::default(), vectors }
    }

    /// The cost of `work`, and of its stages in the order of [`Stage::ALL`].
    pub fn measure<R>(&self, work: impl FnOnce() -> R) -> (R, Cost, [Cost; Stage::ALL.len()]) {
        self.state().stages = Default::default();
        let (result, cost) = self.apart(work);
        let stages = self.state().stages;
        (result, cost, stages)
    }

    /// Does `work` and takes what it costs out of what is charged.
    fn apart<R>(&self, work: impl FnOnce() -> R) -> (R, Cost) {
        let before = self.state().take();
        let result = work();
        let cost = self.state().take();
        self.state().cost = before;
        (result, cost)
    }

    /// No work panics while the state is locked.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Executor for Spans {
    fn join<A, B, RA, RB>(&self, a: A, b: B) -> (RA, RB)
    where
        A: FnOnce() -> RA + Send,
        B: FnOnce() -> RB + Send,
        RA: Send,
        RB: Send,
    {
        let (a, cost_a) = self.apart(a);
        let (b, cost_b) = self.apart(b);
        let mut state = self.state();
        state.cost = state.cost.then(cost_a.beside(cost_b));
        (a, b)
    }

    fn stage<R>(&self, stage: Stage, work: impl FnOnce() -> R) -> R {
        let (result, cost) = self.apart(work);
        let mut state = self.state();
        state.cost = state.cost.then(cost);
        if let Some(sum) = state.stages.get_mut(stage as usize) {
            *sum = sum.then(cost);
        }
        result
    }

    fn vectors(&self) -> Vectors {
        self.vectors
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::threads::burn;

    #[test]
    fn branches_add_up_to_work_and_the_longer_one_to_the_span() {
        let spans = Spans::new(Vectors::BASELINE);
        let fork = || {
            let first = burn(4);
            let ends = spans.join(
                || burn(10),
                || spans.stage(Stage::SceneFlow, || spans.join(|| burn(6), || burn(2))),
            );
            (first, ends)
        };
        let ((first, (long, (six, two))), cost, stages) =
            spans.measure(|| spans.stage(Stage::Stereo, fork));
        let near = |duration: Duration, burnt: Duration| {
            let more = duration.as_secs_f64() * 1e3 - burnt.as_secs_f64() * 1e3;
            assert!((-0.001..2.0).contains(&more), "{duration:?} for {burnt:?}")
        };
        let (flow, short) = (six + two, six.max(two));
        near(cost.work, first + long + flow);
        near(cost.span, first + long.max(short));
        near(cost.two_threads, first + long.max(short).max((long + flow) / 2));
        let stage = stages[Stage::SceneFlow as usize];
        near(stage.work, flow);
        near(stage.span, short);
        assert_eq!(stages[Stage::Fuse as usize], Cost::default());
        let ((a, (b, c)), again, _) =
            spans.measure(|| spans.join(|| burn(5), || spans.join(|| burn(5), || burn(4))));
        near(again.span, a.max(b).max(c));
        near(again.two_threads, a.max(b).max(c).max((a + b + c) / 2));
    }
}
