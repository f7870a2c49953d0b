//! One accepted detection.

use super::{
    Class,
    index::{Flag, OptionalIndex},
};
use crate::masks::{MaskHandle, MaskStore, ScaledMask};
use bytemuck::{Pod, Zeroable};

/// A detection that was accepted.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Instance {
    /// Copy mask: the pixels that show the instance.
    pub mask: MaskHandle,
    pub score: f32,
    pub class: u32,
    /// Scale of the delete mask, in 1/1000.
    pub delete_permille: u32,
    /// Position of its track.
    pub track: OptionalIndex,
    /// Set if the instance is tracked, but too small to be reconstructed.
    pub tracked_only: Flag,
}

impl Instance {
    pub fn class(&self) -> Class {
        Class::from_code(self.class)
    }

    /// The mask under which nothing enters the static map.
    pub fn delete_mask<'m, 's>(&self, store: &'m MaskStore<'s>) -> ScaledMask<'m, 's> {
        ScaledMask::new(store, self.mask, self.delete_permille)
    }
}
