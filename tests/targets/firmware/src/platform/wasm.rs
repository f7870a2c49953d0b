//! WebAssembly: one import to write with, one export that runs and returns the exit code.

#[link(wasm_import_module = "dynvox")]
unsafe extern "C" {
    fn put_bytes(start: *const u8, len: usize);
}

/// Hands text to the embedder.
pub fn put(text: &crate::line::Line) {
    let text = text.text();
    // SAFETY: the bytes live for the length of the call.
    unsafe { put_bytes(text.as_ptr(), text.len()) }
}

#[unsafe(no_mangle)]
extern "C" fn run() -> u32 {
    u32::from(crate::run())
}
