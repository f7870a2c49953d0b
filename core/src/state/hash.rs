//! Hashing state.

use super::Visitor;
use crate::digest::Digest;

/// Hashes what it visits. Nothing it visits changes.
#[derive(Default)]
pub(crate) struct Hasher(pub Digest);

impl Hasher {
    /// The digest of what `visit` visits.
    pub fn digest(visit: impl FnOnce(&mut Self)) -> u64 {
        let mut hasher = Self::default();
        visit(&mut hasher);
        hasher.0.finish()
    }
}

impl Visitor for Hasher {
    fn bytes(&mut self, bytes: &mut [u8]) {
        self.0.bytes(bytes);
    }

    fn content(&mut self, digest: u64, _visit: impl FnOnce(&mut Self)) {
        self.0.u64(digest);
    }

    fn u8(&mut self, value: &mut u8) {
        self.0.u64(u64::from(*value));
    }

    fn u32(&mut self, value: &mut u32) {
        self.0.u64(u64::from(*value));
    }

    fn u64(&mut self, value: &mut u64) {
        self.0.u64(*value);
    }

    fn f32(&mut self, value: &mut f32) {
        self.0.f64(f64::from(*value));
    }

    fn f64(&mut self, value: &mut f64) {
        self.0.f64(*value);
    }

    fn i16s(&mut self, values: &mut [i16]) {
        self.0.i16s(values);
    }
}
