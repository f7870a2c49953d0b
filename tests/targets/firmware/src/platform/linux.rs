//! Linux without a C library: two system calls and a first instruction. Any machine the linker
//! knows, under qemu-user.

use core::arch::asm;
#[cfg(not(target_arch = "powerpc64"))]
use core::arch::global_asm;

/// A system call of three arguments; what it returns is not used.
///
/// # Safety
/// The arguments must be what the call of that number reads.
#[cfg_attr(target_arch = "s390x", allow(unused_assignments))]
unsafe fn call(number: usize, a: usize, b: usize, c: usize) {
    // SAFETY: each names the registers its kernel reads and those it changes.
    #[cfg(target_arch = "aarch64")]
    unsafe {
        asm!("svc 0", in("x8") number, inout("x0") a => _, in("x1") b, in("x2") c, options(nostack))
    }
    #[cfg(target_arch = "riscv64")]
    unsafe {
        asm!("ecall", in("a7") number, inout("a0") a => _, in("a1") b, in("a2") c, options(nostack))
    }
    #[cfg(target_arch = "s390x")]
    unsafe {
        asm!("svc 0", in("r1") number, inout("r2") a => _, in("r3") b, in("r4") c, options(nostack))
    }
    #[cfg(target_arch = "powerpc64")]
    unsafe {
        asm!("sc", inout("r0") number => _, inout("r3") a => _, inout("r4") b => _, inout("r5") c => _,
            out("r6") _, out("r7") _, out("r8") _, out("r9") _, out("r10") _, out("r11") _, out("r12") _, out("cr0") _, options(nostack))
    }
}

/// Numbers of `write` and `exit`.
const WRITE_EXIT: [usize; 2] =
    if cfg!(any(target_arch = "powerpc64", target_arch = "s390x")) { [4, 1] } else { [64, 93] };

/// Writes text to standard output.
pub fn put(text: &crate::line::Line) {
    let text = text.text();
    // SAFETY: the bytes live for the length of the call.
    unsafe { call(WRITE_EXIT[0], 1, text.as_ptr() as usize, text.len()) }
}

/// Ends the program.
pub fn exit(code: u8) -> ! {
    loop {
        // SAFETY: takes a number.
        unsafe { call(WRITE_EXIT[1], usize::from(code), 0, 0) }
    }
}

// The kernel hands a PowerPC program its own address where a function expects it (ELFv2), so that
// it can begin with one.
#[cfg_attr(target_arch = "powerpc64", unsafe(export_name = "_start"))]
#[cfg_attr(not(target_arch = "powerpc64"), unsafe(no_mangle))]
extern "C" fn dynvox_start() -> ! {
    exit(crate::run())
}

// The kernel starts a process with an aligned stack pointer and nothing else a function could want.
#[cfg(target_arch = "aarch64")]
global_asm!(".globl _start", "_start:", "b dynvox_start");
#[cfg(target_arch = "riscv64")]
global_asm!(
    ".globl _start",
    "_start:",
    ".option push",
    ".option norelax",
    "tail dynvox_start",
    ".option pop"
);
#[cfg(target_arch = "s390x")]
global_asm!(".globl _start", "_start:", "aghi %r15, -160", "brasl %r14, dynvox_start");
