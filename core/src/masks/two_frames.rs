//! A value for the current frame and the one for the frame before.

/// Two values that change roles from frame to frame.
#[derive(Debug)]
pub(crate) struct TwoFrames<T> {
    values: [T; 2],
    second_is_current: bool,
}

impl<T> TwoFrames<T> {
    /// The first value is the current one.
    pub(crate) const fn new(values: [T; 2]) -> Self {
        Self { values, second_is_current: false }
    }

    /// Begins a frame: the current value becomes the previous one, and the other way round.
    pub(crate) fn advance(&mut self) {
        self.second_is_current = !self.second_is_current;
    }

    /// Returns the value of the current frame.
    pub(crate) fn current(&self) -> &T {
        let [first, second] = &self.values;
        if self.second_is_current { second } else { first }
    }

    /// Returns the value of the frame before.
    pub(crate) fn previous(&self) -> &T {
        let [first, second] = &self.values;
        if self.second_is_current { first } else { second }
    }

    /// Returns the value of the current frame, for writing.
    pub(crate) fn current_mut(&mut self) -> &mut T {
        self.split_mut().0
    }

    /// The current one, to change, and the previous one.
    pub(crate) fn split_mut(&mut self) -> (&mut T, &T) {
        let [first, second] = &mut self.values;
        if self.second_is_current { (second, first) } else { (first, second) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_current_in_one_frame_is_previous_in_the_next() {
        let mut values = TwoFrames::new(["a", "b"]);
        assert_eq!((*values.current(), *values.previous()), ("a", "b"));
        values.advance();
        assert_eq!((*values.current(), *values.previous()), ("b", "a"));
        // What was current two frames ago is overwritten.
        *values.current_mut() = "c";
        values.advance();
        let (current, previous) = values.split_mut();
        assert_eq!((*current, *previous), ("a", "c"));
    }
}
