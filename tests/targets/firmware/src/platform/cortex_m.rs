//! A bare Cortex-M under semihosting: text and the exit code go to the debugger or QEMU.

use core::arch::asm;

const SYS_WRITE0: usize = 0x04;
const SYS_EXIT_EXTENDED: usize = 0x20;
const APPLICATION_EXIT: usize = 0x2_0026;

/// One call to the watcher.
///
/// # Safety
/// `argument` must point to what `operation` reads.
unsafe fn semihost(operation: usize, argument: *const usize) {
    // SAFETY: the breakpoint hands over to the watcher, which reads the argument and changes r0
    // alone.
    unsafe { asm!("bkpt 0xab", inout("r0") operation => _, in("r1") argument, options(nostack)) }
}

/// Writes text that ends in a zero byte.
pub fn put(text: &crate::line::Line) {
    // SAFETY: a line ends in a zero byte.
    unsafe { semihost(SYS_WRITE0, text.with_zero().as_ptr().cast()) }
}

/// The clock of the MPS2 board's first timer, at 25 MHz: with QEMU's `-icount shift=0` a tick is
/// forty instructions.
#[cfg(feature = "instructions")]
pub fn ticks() -> u32 {
    /// The timer's control, value and reload registers (Arm, *Cortex-M System Design Kit*, APB
    /// timer).
    const TIMER: *mut u32 = 0x4000_0000 as *mut u32;
    // SAFETY: they are the board's registers, of 32 bits each; nothing else uses them. Enabling a
    // running timer changes nothing.
    unsafe {
        if TIMER.read_volatile() == 0 {
            TIMER.add(2).write_volatile(u32::MAX);
            TIMER.add(1).write_volatile(u32::MAX);
            TIMER.write_volatile(1);
        }
        u32::MAX - TIMER.add(1).read_volatile()
    }
}

/// Ends the program.
pub fn exit(code: u8) -> ! {
    let block = [APPLICATION_EXIT, usize::from(code)];
    loop {
        // SAFETY: the block is the operation's two words.
        unsafe { semihost(SYS_EXIT_EXTENDED, block.as_ptr()) }
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    exit(crate::run())
}
