//! The host of dynvox.
