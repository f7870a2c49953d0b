//! Errors as sentences.

/// An error with its causes as one sentence. A cause that is a part of the text already is not
/// repeated.
pub fn sentence(error: &anyhow::Error) -> String {
    error.chain().skip(1).map(ToString::to_string).fold(error.to_string(), |text, cause| {
        if text.contains(&cause) { text } else { format!("{text}: {cause}") }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("x cannot be written: {0}")]
    struct Unwritten(#[source] std::io::Error);

    #[test]
    fn a_cause_is_printed_once() {
        let cause = || std::io::Error::other("no space");
        let error = anyhow::Error::new(Unwritten(cause()));
        assert_eq!(sentence(&error).matches("no space").count(), 1);
        let error = anyhow::Error::new(cause()).context("the map cannot be written");
        assert_eq!(sentence(&error), "the map cannot be written: no space");
    }
}
