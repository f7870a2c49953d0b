//! State in memory, for tests.

/// Fills `piece` from the front of `rest`; `None` where there are not as many bytes.
pub(crate) fn take(rest: &mut &[u8], piece: &mut [u8]) -> Option<()> {
    let (taken, behind) = rest.split_at_checked(piece.len())?;
    piece.copy_from_slice(taken);
    *rest = behind;
    Some(())
}
