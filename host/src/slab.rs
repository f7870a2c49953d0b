//! The slab as the host owns it: mapped by the allocator, aligned, all zero. It never touches the
//! stack.

use bytemuck::{Pod, Zeroable};
use dynvox_core::memory::SLAB_ALIGN;

/// One cache line; a vector of them is aligned as the core asks.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
struct Line([u8; SLAB_ALIGN]);

/// An aligned slab of bytes.
pub struct HostSlab(Box<[Line]>);

impl HostSlab {
    /// Maps at least `bytes` bytes of zeros; `None` when the machine has not so many.
    pub fn map(bytes: usize) -> Option<Self> {
        bytemuck::allocation::try_zeroed_slice_box(bytes.div_ceil(SLAB_ALIGN)).ok().map(Self)
    }

    /// The bytes.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        bytemuck::cast_slice_mut(&mut self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_aligned_zeroed_and_long_enough_and_refuses_what_no_machine_has() {
        let mut slab = HostSlab::map(1_000).unwrap();
        let bytes = slab.bytes_mut();
        assert!(
            bytes.len() >= 1_000
                && (bytes.as_ptr() as usize).is_multiple_of(SLAB_ALIGN)
                && bytes.iter().all(|&byte| byte == 0)
        );
        assert!(HostSlab::map(usize::MAX / 2).is_none());
    }
}
