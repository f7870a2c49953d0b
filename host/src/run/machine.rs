//! The machine that figures come from, as its reader needs to know it.

use serde::Serialize;
use std::fs;
use std::path::Path;

/// A machine. What the operating system does not tell is `None`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// Board or product, by its device tree or firmware.
    pub board: Option<String>,
    /// Name of the first processor.
    pub processor: Option<String>,
    /// Instruction set: `x86_64`, `aarch64`.
    pub architecture: &'static str,
    /// Operating system and release of its kernel.
    pub system: String,
    /// Processors that this process may use.
    pub processors: usize,
    /// Memory, bytes.
    pub memory_bytes: Option<u64>,
    /// Highest clock of the first processor, MHz.
    pub max_mhz: Option<u64>,
    /// Rule by which its clock is chosen: `performance`, `ondemand`.
    pub governor: Option<String>,
}

impl Machine {
    /// This machine.
    pub fn detect() -> Self {
        Self::from_root(Path::new("/"))
    }

    /// A machine by the files of Linux below a root.
    fn from_root(root: &Path) -> Self {
        let text = |path: &str| {
            // A device tree ends its texts with a zero byte.
            let bytes = fs::read(root.join(path)).ok()?;
            let text = String::from_utf8_lossy(&bytes).trim_matches(['\0', '\n', ' ']).to_owned();
            (!text.is_empty()).then_some(text)
        };
        // Virtual machines have no such files.
        let clock = |file: &str| text(&format!("sys/devices/system/cpu/cpu0/cpufreq/{file}"));
        let kernel = text("proc/sys/kernel/osrelease").map(|release| format!(" {release}"));
        Self {
            board: text("proc/device-tree/model").or_else(|| text("sys/class/dmi/id/product_name")),
            processor: text("proc/cpuinfo").and_then(|info| processor(&info)),
            architecture: std::env::consts::ARCH,
            system: std::env::consts::OS.to_owned() + &kernel.unwrap_or_default(),
            processors: std::thread::available_parallelism().map_or(1, usize::from),
            memory_bytes: text("proc/meminfo")
                .and_then(|info| field(&info, "MemTotal")?.split(' ').next()?.parse().ok())
                .map(|kib: u64| kib * 1024),
            max_mhz: clock("cpuinfo_max_freq")
                .and_then(|khz| Some(khz.parse::<u64>().ok()? / 1000)),
            governor: clock("scaling_governor"),
        }
    }
}

/// Value of the first line `name : value`.
fn field<'t>(info: &'t str, name: &str) -> Option<&'t str> {
    let mut fields = info.lines().filter_map(|line| line.split_once(':'));
    fields.find(|(key, _)| key.trim() == name).map(|(_, value)| value.trim())
}

/// Name of the first processor; on Arm, where Linux has no name, that of its part number.
fn processor(info: &str) -> Option<String> {
    if let Some(name) = field(info, "model name") {
        return Some(name.to_owned());
    }
    // Processors of other makers number their parts anew.
    let (implementer, part) = (field(info, "CPU implementer")?, field(info, "CPU part")?);
    let name = ARM_PARTS.iter().find(|(number, _)| implementer == "0x41" && part == *number);
    Some(name.map_or_else(
        || format!("implementer {implementer}, part {part}"),
        |(_, name)| format!("Arm {name}"),
    ))
}

/// Part numbers of Arm's own processors (Arm, *Main ID Register* of each reference manual).
const ARM_PARTS: [(&str, &str); 14] = [
    ("0xc07", "Cortex-A7"),
    ("0xc09", "Cortex-A9"),
    ("0xd03", "Cortex-A53"),
    ("0xd04", "Cortex-A35"),
    ("0xd05", "Cortex-A55"),
    ("0xd07", "Cortex-A57"),
    ("0xd08", "Cortex-A72"),
    ("0xd09", "Cortex-A73"),
    ("0xd0a", "Cortex-A75"),
    ("0xd0b", "Cortex-A76"),
    ("0xd0c", "Neoverse-N1"),
    ("0xd40", "Neoverse-V1"),
    ("0xd41", "Cortex-A78"),
    ("0xd42", "Cortex-A78AE"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_is_named_by_its_device_tree_and_its_part_number() {
        let root = tempfile::tempdir().unwrap();
        let write = |path: &str, text: &str| {
            let path = root.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        };
        write("proc/device-tree/model", "Raspberry Pi 5 Model B Rev 1.0\0");
        write(
            "proc/cpuinfo",
            "processor\t: 0\nBogoMIPS\t: 108.00\nCPU implementer\t: 0x41\nCPU part\t: 0xd0b\n",
        );
        write("proc/meminfo", "MemTotal:        8255952 kB\nMemFree:  1 kB\n");
        write("sys/devices/system/cpu/cpu0/cpufreq/cpuinfo_max_freq", "2400000\n");
        write("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "ondemand\n");
        let machine = Machine::from_root(root.path());
        assert_eq!(machine.board.as_deref(), Some("Raspberry Pi 5 Model B Rev 1.0"));
        assert_eq!(machine.processor.as_deref(), Some("Arm Cortex-A76"));
        assert_eq!(machine.memory_bytes, Some(8_255_952 * 1024));
        assert_eq!((machine.max_mhz, machine.governor.as_deref()), (Some(2_400), Some("ondemand")));
    }

    #[test]
    fn an_unknown_part_is_told_by_its_numbers_and_a_name_is_taken_as_it_is() {
        let part = processor("CPU implementer : 0x51\nCPU part : 0x804\n");
        assert_eq!(part.as_deref(), Some("implementer 0x51, part 0x804"));
        assert_eq!(processor("model name : A CPU @ 3 GHz\n").as_deref(), Some("A CPU @ 3 GHz"));
        assert_eq!(processor("nothing"), None);
    }

    #[test]
    fn a_system_without_such_files_leaves_gaps() {
        let machine = Machine::from_root(Path::new("/nonexistent"));
        assert_eq!((machine.board, machine.memory_bytes), (None, None));
        assert!(machine.processors >= 1 && !machine.system.is_empty());
    }
}
