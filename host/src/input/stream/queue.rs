//! A bounded queue between the thread that reads a stream and the mapper.

use super::Pair;
use crate::input::source::{InputError, StopRequest};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Interval at which a waiting mapper checks whether it is asked to stop.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Treatment of frames that come while the mapper is busy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum WhenLate {
    /// The stream waits, and nothing is lost.
    #[default]
    Wait,
    /// The oldest waiting frame is dropped and counted, so that the mapper keeps up with a camera.
    Drop,
}

/// A pair as it came.
pub struct Arrived {
    /// Number of the frame among all that came.
    pub number: u64,
    /// The pair, or why it is missing.
    pub pair: Result<Pair, InputError>,
}

/// Pairs that wait.
pub struct Queue {
    state: Mutex<State>,
    changed: Condvar,
    most: usize,
    when_late: WhenLate,
}

#[derive(Default)]
struct State {
    waiting: VecDeque<Arrived>,
    arrived: u64,
    dropped: u64,
    closed: bool,
    abandoned: bool,
}

impl Queue {
    /// An empty queue of at most `most` pairs.
    pub fn new(most: usize, when_late: WhenLate) -> Self {
        Self { state: Mutex::default(), changed: Condvar::new(), most, when_late }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // A panic elsewhere leaves nothing half-done here.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a pair, or waits until there is space for it; an error is added in any case. Returns
    /// whether a next one is wanted.
    pub fn push(&self, pair: Result<Pair, InputError>) -> bool {
        let mut state = self.lock();
        while self.when_late == WhenLate::Wait
            && state.waiting.len() >= self.most
            && !state.abandoned
        {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        if state.waiting.len() >= self.most && pair.is_ok() {
            state.waiting.pop_front();
            state.dropped += 1;
        }
        let number = state.arrived;
        state.arrived += 1;
        state.waiting.push_back(Arrived { number, pair });
        self.changed.notify_all();
        !state.abandoned
    }

    /// No pair will come.
    pub fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    /// No pair is wanted.
    pub fn abandon(&self) {
        self.lock().abandoned = true;
        self.changed.notify_all();
    }

    /// The oldest pair, waited for; `None` at the end, or when a stop is requested.
    pub fn pop(&self, stop: &StopRequest) -> Option<Arrived> {
        let mut state = self.lock();
        loop {
            if stop.signal().is_some() {
                return None;
            }
            if let Some(pair) = state.waiting.pop_front() {
                self.changed.notify_all();
                return Some(pair);
            }
            if state.closed {
                return None;
            }
            state = self
                .changed
                .wait_timeout(state, LOOK_EVERY)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
    }

    /// Pairs dropped.
    pub fn dropped(&self) -> u64 {
        self.lock().dropped
    }
}
