//! Resident memory of this process. Linux reports it in `/proc`; elsewhere it is unknown.

/// Resident bytes now and at most, if the system reports them.
pub fn resident_bytes() -> Option<(u64, u64)> {
    parse(&std::fs::read_to_string("/proc/self/status").ok()?)
}

fn parse(status: &str) -> Option<(u64, u64)> {
    let kib = |key: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(key))?;
        line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()
    };
    Some((kib("VmRSS:")? * 1024, kib("VmHWM:")? * 1024))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_the_two_lines_it_needs() {
        assert_eq!(
            parse("VmPeak:\t 9 kB\nVmHWM:\t  20 kB\nVmRSS:\t  12 kB\n"),
            Some((12 * 1024, 20 * 1024))
        );
        assert_eq!(parse("nothing"), None);
    }
}
