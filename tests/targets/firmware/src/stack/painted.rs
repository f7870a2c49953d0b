//! Depth of the stack, measured by painting what lies below.

use core::ptr::addr_of_mut;

/// Depth below the caller that is painted, bytes.
const PAINTED: usize = 256 * 1024;
/// Not painted: what the painter itself stands on.
const MARGIN: usize = 64;
const PAINT: u32 = 0xC5C5_C5C5;

unsafe extern "C" {
    // The stack's first word, from the linker script of cortex-m-rt.
    static mut _stack_start: u32;
}

/// Paint below the place where it was put on.
pub struct Paint {
    top: usize,
}

impl Paint {
    /// Paints.
    #[inline(never)]
    pub fn below() -> Self {
        let top: usize;
        // SAFETY: reads a register.
        unsafe { core::arch::asm!("mov {}, sp", out(reg) top, options(nomem, nostack)) };
        let mut word = (top - PAINTED) as *mut u32;
        while (word as usize) < top - MARGIN {
            // SAFETY: between the statics at the foot of 4 MiB of memory and the stack pointer near
            // its head there is nothing.
            unsafe {
                word.write_volatile(PAINT);
                word = word.add(1);
            }
        }
        Self { top }
    }

    /// Bytes from where it was put on to the deepest word that is no longer painted.
    pub fn used_below(&self) -> u32 {
        (self.top - self.deepest()) as u32
    }

    /// Bytes from the very top of the stack to that word.
    pub fn used_in_all(&self) -> u32 {
        (addr_of_mut!(_stack_start) as usize - self.deepest()) as u32
    }

    #[inline(never)]
    fn deepest(&self) -> usize {
        let mut word = (self.top - PAINTED) as *const u32;
        // SAFETY: painted above, in whole words.
        unsafe {
            while (word as usize) < self.top && word.read_volatile() == PAINT {
                word = word.add(1);
            }
        }
        word as usize
    }
}
