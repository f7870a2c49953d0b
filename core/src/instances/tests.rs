//! Stories of instances.
