//! Shared ground of the integration tests: a slab for a mapper, and small clips of the synthetic street.
