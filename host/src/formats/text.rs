//! Text files as people and programs save them: UTF-8 with or without a byte order mark, UTF-16 as
//! Windows writes it, any line ends.

/// Byte order mark of UTF-8.
const UTF8_MARK: &[u8] = &[0xef, 0xbb, 0xbf];
/// Bytes looked at to tell UTF-16 without a mark: every other one is 0 in text of Latin letters.
const LOOKED_AT: usize = 512;

/// Byte order of UTF-16.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Order {
    Little,
    Big,
}

/// Decodes the bytes of a text file; its lines end in `\n` or `\r\n` then.
///
/// # Errors
/// They are no text. The reason completes a sentence that begins with the file.
pub(super) fn decoded(bytes: Vec<u8>) -> Result<String, String> {
    let text = match utf16_order(&bytes) {
        Some(order) => {
            let (units, rest) = bytes.as_chunks::<2>();
            let unit = |&pair: &[u8; 2]| match order {
                Order::Little => u16::from_le_bytes(pair),
                Order::Big => u16::from_be_bytes(pair),
            };
            let units: Vec<u16> = units.iter().map(unit).collect();
            let text = String::from_utf16(&units).ok().filter(|_| rest.is_empty());
            text.ok_or("it begins as text in UTF-16 and is damaged further on")?
        }
        None => String::from_utf8(bytes).map_err(|error| {
            let at = error.utf8_error().valid_up_to();
            format!("byte {at} is not text in UTF-8: it is in another encoding, or not text at all")
        })?,
    };
    let text = match text.strip_prefix('\u{feff}') {
        Some(rest) => rest.to_owned(),
        None => text,
    };
    // Line ends of old Macs.
    let only_returns = text.contains('\r') && !text.contains('\n');
    Ok(if only_returns { text.replace('\r', "\n") } else { text })
}

/// The byte order of text in UTF-16, by its mark or by the zeros between Latin letters; `None` of
/// other bytes.
fn utf16_order(bytes: &[u8]) -> Option<Order> {
    match bytes {
        [0xff, 0xfe, ..] => return Some(Order::Little),
        [0xfe, 0xff, ..] => return Some(Order::Big),
        _ if bytes.starts_with(UTF8_MARK) => return None,
        _ => {}
    }
    let (pairs, _) = bytes.get(..bytes.len().min(LOOKED_AT))?.as_chunks::<2>();
    let zeros = |side: usize| pairs.iter().filter(|pair| pair[side] == 0).count();
    match [zeros(0), zeros(1)] {
        [0, second] if 2 * second > pairs.len() => Some(Order::Little),
        [first, 0] if 2 * first > pairs.len() => Some(Order::Big),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn utf16(text: &str, order: Order) -> Vec<u8> {
        let unit = |unit: u16| match order {
            Order::Little => unit.to_le_bytes(),
            Order::Big => unit.to_be_bytes(),
        };
        text.encode_utf16().flat_map(unit).collect()
    }

    #[test]
    fn text_is_the_same_in_every_encoding_and_with_every_line_end() {
        let text = "0.0 1 2\n0.1 3 4\n";
        let marked = format!("\u{feff}{text}");
        for bytes in [
            text.as_bytes().to_vec(),
            marked.as_bytes().to_vec(),
            utf16(&marked, Order::Little),
            utf16(&marked, Order::Big),
            utf16(text, Order::Little),
            utf16(text, Order::Big),
            text.replace('\n', "\r").into_bytes(),
        ] {
            assert_eq!(decoded(bytes.clone()).as_deref(), Ok(text), "{bytes:?}");
        }
        assert_eq!(decoded(Vec::new()).as_deref(), Ok(""));
    }

    #[test]
    fn other_bytes_are_named() {
        let latin = decoded(b"caf\xe9 1 2".to_vec()).unwrap_err();
        assert!(latin.contains("byte 3 is not text in UTF-8"), "{latin}");
        let cut = decoded(vec![0xff, 0xfe, b'1', 0, b'2']).unwrap_err();
        assert!(cut.contains("UTF-16"), "{cut}");
    }
}
