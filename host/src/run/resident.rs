//! Resident memory of this process. Linux reports it in `/proc`; elsewhere it is unknown.

/// Resident bytes now and at most, if the system reports them.
pub fn resident_bytes() -> Option<(u64, u64)> {
    parse(&std::fs::read_to_string("/proc/self/status").ok()?)
}

/// Bytes of address space in use, and the limit on them (`ulimit -v`), if there is one.
pub fn address_space() -> Option<(u64, u64)> {
    let limit = limit_of(&std::fs::read_to_string("/proc/self/limits").ok()?)?;
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    Some((kib(&status, "VmSize:")? * 1024, limit))
}

/// The soft limit on the address space, bytes; `None` without a limit.
fn limit_of(limits: &str) -> Option<u64> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// A figure of `/proc/self/status`, KiB.
fn kib(status: &str, key: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix(key))?;
    line.trim().strip_suffix("kB")?.trim().parse().ok()
}

fn parse(status: &str) -> Option<(u64, u64)> {
    Some((kib(status, "VmRSS:")? * 1024, kib(status, "VmHWM:")? * 1024))
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
        let limits = |limit: &str| format!("Limit\nMax address space         {limit}  bytes\n");
        assert_eq!(limit_of(&limits("1000 unlimited")), Some(1000));
        assert_eq!(limit_of(&limits("unlimited unlimited")), None);
    }
}
