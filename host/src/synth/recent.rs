//! Parts of a world that were built last: a bounded cache of what is costly to build and the same
//! each time.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Values by key. The oldest one leaves when there are too many.
pub struct Recent<K, V> {
    most: usize,
    values: Mutex<VecDeque<(K, Arc<V>)>>,
}

impl<K: Copy + PartialEq, V> Recent<K, V> {
    /// Keeps at most `most` values.
    pub fn new(most: usize) -> Self {
        Self { most, values: Mutex::new(VecDeque::new()) }
    }

    /// Returns the value of a key, or makes it.
    pub fn get(&self, key: K, make: impl FnOnce() -> V) -> Arc<V> {
        let lock = || self.values.lock().unwrap_or_else(PoisonError::into_inner);
        let known = lock().iter().find(|(known, _)| *known == key).map(|(_, v)| Arc::clone(v));
        if let Some(known) = known {
            return known;
        }
        // Outside the lock: another thread may make the same one meanwhile, which is equal.
        let made = Arc::new(make());
        let mut values = lock();
        if values.len() >= self.most {
            values.pop_front();
        }
        values.push_back((key, Arc::clone(&made)));
        made
    }
}
