//! Run lengths as COCO writes them: counts of alternating pixels, 0 first, down the columns, each
//! count in characters of 5 bits, the lowest first, bit 5 saying that more follow, the last one's
//! bit 4 being the sign; from the fourth count on the difference to the last but one is written.
//! (Format: the COCO data set's mask interface.)

/// The runs of 1: first pixel and length, counted down the columns. The counts must fill the image
/// exactly.
///
/// # Errors
/// What is wrong, as the rest of a sentence.
pub fn runs(text: &str, width: usize, height: usize) -> Result<Vec<(usize, usize)>, String> {
    runs_of_counts(&counts(text)?, width, height)
}

/// Decodes runs from counts that are not in characters.
///
/// # Errors
/// What is wrong, as the rest of a sentence.
pub fn runs_of_counts(
    counts: &[i64],
    width: usize,
    height: usize,
) -> Result<Vec<(usize, usize)>, String> {
    let pixels = width * height;
    let (mut runs, mut at) = (Vec::new(), 0usize);
    for (number, &count) in counts.iter().enumerate() {
        let count = usize::try_from(count)
            .map_err(|_| format!("run {} has a length below 0", number + 1))?;
        if count > pixels - at {
            return Err(format!(
                "its runs hold more than the {pixels} pixels of {width} x {height}"
            ));
        }
        if number % 2 == 1 && count > 0 {
            runs.push((at, count));
        }
        at += count;
    }
    if at == pixels {
        Ok(runs)
    } else {
        Err(format!("its runs hold {at} of the {pixels} pixels of {width} x {height}"))
    }
}

fn counts(text: &str) -> Result<Vec<i64>, String> {
    let mut counts: Vec<i64> = Vec::new();
    let mut bytes = text.bytes();
    while let Some(first) = bytes.next() {
        let (mut value, mut shift, mut byte) = (0i64, 0u32, first);
        loop {
            let bits = byte
                .checked_sub(48)
                .filter(|bits| *bits < 64)
                .ok_or_else(|| format!("`{}` is no run length", char::from(byte)))?;
            if shift > 30 {
                return Err("a run length has more than 35 bits".to_owned());
            }
            value |= i64::from(bits & 31) << shift;
            shift += 5;
            if bits & 32 == 0 {
                if bits & 16 != 0 {
                    value |= -1 << shift;
                }
                break;
            }
            byte = bytes.next().ok_or("its last run length is cut off")?;
        }
        let before = if counts.len() > 2 { counts[counts.len() - 2] } else { 0 };
        counts.push(value + before);
    }
    Ok(counts)
}

/// Writes run lengths, for tests: the slow obvious way.
#[cfg(test)]
pub fn encoded(mask: impl Fn(usize, usize) -> bool, width: usize, height: usize) -> String {
    let mut counts: Vec<i64> = vec![0];
    let mut value = false;
    for (u, v) in (0..width).flat_map(|u| (0..height).map(move |v| (u, v))) {
        if mask(u, v) != value {
            value = !value;
            counts.push(0);
        }
        *counts.last_mut().unwrap() += 1;
    }
    let mut text = String::new();
    for (at, &count) in counts.iter().enumerate() {
        let mut rest = if at > 2 { count - counts[at - 2] } else { count };
        loop {
            let bits = (rest & 31) as u8;
            rest >>= 5;
            let more = if bits & 16 != 0 { rest != -1 } else { rest != 0 };
            text.push(char::from(48 + bits + if more { 32 } else { 0 }));
            if !more {
                break;
            }
        }
    }
    text
}
