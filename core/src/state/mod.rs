//! State as one description per struct.
//!
//! What lives from frame to frame says once what it holds: a `visit` method hands every field to a
//! [`Visitor`], in a stated order, by a pattern without `..`, so that a field added does not compile
//! until it is visited. Three visitors make three uses of it: [`Writer`] writes the fields,
//! [`Reader`] reads them back, [`Hasher`] hashes them. A snapshot and a digest can thus not differ
//! in what they know of.
//!
//! All numbers are little-endian and of a stated width, so the bytes are the same on every machine.
//! What can be rebuilt is not visited: a `rebuild` method follows a reading.
//!
//! A visit that failed continues without effect; the caller checks for failure at the end.

mod checksum;
mod hash;
#[cfg(test)]
pub(crate) mod in_memory;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub(crate) use hash::Hasher;
pub(crate) use read::{ReadError, Reader};
pub(crate) use write::Writer;

use crate::geometry::Transform;

/// Takes the fields of a struct, one after the other: writes, reads or hashes them.
pub(crate) trait Visitor {
    /// Writes or hashes the bytes, or replaces them by those that were written.
    fn bytes(&mut self, bytes: &mut [u8]);

    /// Notes that what was read cannot be.
    fn refuse(&mut self) {}

    /// Visits values whose digest is kept up to date: a hash takes the digest and does not visit
    /// them.
    fn content(&mut self, _digest: u64, visit: impl FnOnce(&mut Self)) {
        visit(self);
    }

    fn u8(&mut self, value: &mut u8) {
        let mut bytes = [*value];
        self.bytes(&mut bytes);
        [*value] = bytes;
    }

    fn u32(&mut self, value: &mut u32) {
        let mut bytes = value.to_le_bytes();
        self.bytes(&mut bytes);
        *value = u32::from_le_bytes(bytes);
    }

    fn u64(&mut self, value: &mut u64) {
        let mut bytes = value.to_le_bytes();
        self.bytes(&mut bytes);
        *value = u64::from_le_bytes(bytes);
    }

    fn i32(&mut self, value: &mut i32) {
        let mut bits = *value as u32;
        self.u32(&mut bits);
        *value = bits as i32;
    }

    fn f32(&mut self, value: &mut f32) {
        let mut bits = value.to_bits();
        self.u32(&mut bits);
        *value = f32::from_bits(bits);
    }

    fn f64(&mut self, value: &mut f64) {
        let mut bits = value.to_bits();
        self.u64(&mut bits);
        *value = f64::from_bits(bits);
    }

    fn u32s<'v>(&mut self, values: impl IntoIterator<Item = &'v mut u32>) {
        values.into_iter().for_each(|value| self.u32(value));
    }

    fn i32s<'v>(&mut self, values: impl IntoIterator<Item = &'v mut i32>) {
        values.into_iter().for_each(|value| self.i32(value));
    }

    fn u64s<'v>(&mut self, values: impl IntoIterator<Item = &'v mut u64>) {
        values.into_iter().for_each(|value| self.u64(value));
    }

    fn f64s<'v>(&mut self, values: impl IntoIterator<Item = &'v mut f64>) {
        values.into_iter().for_each(|value| self.f64(value));
    }

    fn i16s(&mut self, values: &mut [i16]) {
        let mut bytes = [0; 128];
        for values in values.chunks_mut(64) {
            let Some(bytes) = bytes.get_mut(..2 * values.len()) else { return };
            for (pair, value) in bytes.chunks_exact_mut(2).zip(values.iter()) {
                pair.copy_from_slice(&value.to_le_bytes());
            }
            self.bytes(bytes);
            for (pair, value) in bytes.as_chunks::<2>().0.iter().zip(values.iter_mut()) {
                *value = i16::from_le_bytes(*pair);
            }
        }
    }

    fn u16s(&mut self, values: &mut [u16]) {
        // The same size and alignment: it cannot fail.
        self.i16s(bytemuck::try_cast_slice_mut(values).unwrap_or(&mut []));
    }

    /// A count of at most `most`; a larger one is refused and becomes 0.
    fn count(&mut self, value: &mut usize, most: usize) {
        let mut bits = *value as u32;
        self.u32(&mut bits);
        *value = bits as usize;
        if *value > most {
            self.refuse();
            *value = 0;
        }
    }

    /// A value that goes by a number.
    fn code<T: Copy>(
        &mut self,
        value: &mut T,
        code_of: impl Fn(T) -> u32,
        of_code: impl Fn(u32) -> T,
    ) {
        let mut code = code_of(*value);
        self.u32(&mut code);
        *value = of_code(code);
    }

    /// A value that may be absent; `blank` is filled in where one is read that was absent here.
    fn option<T>(
        &mut self,
        value: &mut Option<T>,
        blank: impl FnOnce() -> T,
        visit: impl FnOnce(&mut Self, &mut T),
    ) {
        let mut present = u8::from(value.is_some());
        self.u8(&mut present);
        match present {
            0 => *value = None,
            1 => visit(self, value.get_or_insert_with(blank)),
            // Neither 0 nor 1 can have been written.
            _ => self.refuse(),
        }
    }

    /// A transform: the quaternion's x, y, z, w, then the translation.
    fn transform(&mut self, transform: &mut Transform) {
        let Transform { rotation, translation_m } = transform;
        self.f64s(rotation);
        self.f64s(translation_m);
    }
}
