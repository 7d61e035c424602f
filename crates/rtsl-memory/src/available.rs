//! The memory that the process may still allocate, as far as the system reports it: Linux does, in files below `/proc`.

use std::fmt;
use std::path::{Path, PathBuf};

use super::Amount;

/// Available memory, and the limit that bounds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Available {
    /// The amount that is left.
    pub left: Amount,
    /// The limit.
    pub limit: Limit,
}

/// A limit of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// The address space of the process, as `ulimit -v` limits it.
    AddressSpace,
    /// The control group in which a container or a batch system runs the process.
    ControlGroup,
    /// The free memory of the machine, including swap.
    Machine,
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Limit::AddressSpace => "the process's address space (`ulimit -v`)",
            Limit::ControlGroup => "the memory of the process's control group",
            Limit::Machine => "the free memory of the machine",
        })
    }
}

impl Available {
    /// Returns all limits that are known at present.
    pub fn now() -> Vec<Available> {
        let text = |path: &Path| std::fs::read_to_string(path).ok();
        let file = |path: &str| text(Path::new(path)).unwrap_or_default();
        let known = [
            (
                address_space(&file("/proc/self/limits"), &file("/proc/self/status")),
                Limit::AddressSpace,
            ),
            (control_groups(&file("/proc/self/cgroup"), text), Limit::ControlGroup),
            (machine(&file("/proc/meminfo")), Limit::Machine),
        ];
        known
            .into_iter()
            .filter_map(|(left, limit)| Some(Available { left: left?, limit }))
            .collect()
    }

    /// Returns the least of all limits that are known at present.
    pub fn least() -> Option<Available> {
        Available::now().into_iter().min_by_key(|available| available.left)
    }
}

/// The limit in `/proc/self/limits` minus the use in `/proc/self/status`.
fn address_space(limits: &str, status: &str) -> Option<Amount> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let limit = Amount(line.split_ascii_whitespace().next()?.parse().ok()?);
    Some(limit.without(kibibytes(status, "VmSize:")?))
}

/// The free memory in `/proc/meminfo`, including caches, which the system can evict.
fn machine(meminfo: &str) -> Option<Amount> {
    let swap = kibibytes(meminfo, "SwapFree:").unwrap_or_default();
    Some(kibibytes(meminfo, "MemAvailable:")? + swap)
}

/// The number in a line `name: 123 kB`.
fn kibibytes(text: &str, name: &str) -> Option<Amount> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let number = line.split_ascii_whitespace().next()?.parse().ok()?;
    Some(Amount(1 << 10).times(number))
}

/// The memory left in the groups named by `/proc/self/cgroup` and in their ancestors, whose limits apply too. `text`
/// returns the contents of files.
fn control_groups(groups: &str, text: impl Fn(&Path) -> Option<String>) -> Option<Amount> {
    let left = groups.lines().filter_map(|line| {
        let mut parts = line.splitn(3, ':');
        let (_, controllers, path) = (parts.next()?, parts.next()?, parts.next()?);
        // Version 2 has one hierarchy, without the name of a controller; version 1 has one for each controller.
        let version = match controllers {
            "" => &VERSION_2,
            _ if controllers.split(',').any(|name| name == "memory") => &VERSION_1,
            _ => return None,
        };
        let group = Path::new(path.trim_start_matches('/'));
        group.ancestors().filter_map(|group| version.left(group, &text)).min()
    });
    left.min()
}

/// The files in which a version of control groups reports memory.
struct ControlGroupVersion {
    root: &'static str,
    limit: &'static str,
    used: &'static str,
    /// The line of `memory.stat` for inactive file caches, which the system can evict.
    cached: &'static str,
}

const VERSION_1: ControlGroupVersion = ControlGroupVersion {
    root: "/sys/fs/cgroup/memory",
    limit: "memory.limit_in_bytes",
    used: "memory.usage_in_bytes",
    cached: "total_inactive_file",
};

const VERSION_2: ControlGroupVersion = ControlGroupVersion {
    root: "/sys/fs/cgroup",
    limit: "memory.max",
    used: "memory.current",
    cached: "inactive_file",
};

impl ControlGroupVersion {
    fn left(&self, group: &Path, text: &impl Fn(&Path) -> Option<String>) -> Option<Amount> {
        let folder = PathBuf::from(self.root).join(group);
        let number = |name: &str| text(&folder.join(name))?.trim().parse().ok().map(Amount);
        let statistics = text(&folder.join("memory.stat")).unwrap_or_default();
        let cached = statistics.lines().find_map(|line| {
            let (name, number) = line.split_once(' ')?;
            (name == self.cached).then(|| number.trim().parse().ok().map(Amount)).flatten()
        });
        let used = number(self.used)?.without(cached.unwrap_or_default());
        Some(number(self.limit)?.without(used))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: &str = "Limit                     Soft Limit           Hard Limit           Units     \n\
        Max cpu time              unlimited            unlimited            seconds   \n\
        Max address space         8192000000           unlimited            bytes     \n";
    const STATUS: &str = "Name:\trtsl\nVmPeak:\t  300000 kB\nVmSize:\t  200000 kB\n";

    #[test]
    fn what_the_process_has_is_no_longer_left() {
        assert_eq!(address_space(LIMITS, STATUS), Some(Amount(8_192_000_000 - 204_800_000)));
        let small = LIMITS.replace("8192000000", "1024000   ");
        assert_eq!(address_space(&small, STATUS), Some(Amount(0)));
        let unlimited = LIMITS.replace("8192000000", "unlimited ");
        assert_eq!(address_space(&unlimited, STATUS), None);
        assert_eq!(address_space("", ""), None);
    }

    #[test]
    fn caches_and_swap_can_be_had() {
        let text = "MemTotal: 4000 kB\nMemFree: 100 kB\nMemAvailable: 900 kB\nSwapFree: 100 kB\n";
        assert_eq!(machine(text), Some(Amount(1_024_000)));
        assert_eq!(machine("MemTotal: 4000 kB\n"), None);
    }

    #[test]
    fn the_narrowest_group_counts() {
        let files = |files: &'static [(&str, &str)]| {
            move |path: &Path| {
                let found = files.iter().find(|(name, _)| Path::new(name) == path);
                found.map(|(_, text)| (*text).to_owned())
            }
        };
        let second = files(&[
            ("/sys/fs/cgroup/memory.max", "max\n"),
            ("/sys/fs/cgroup/memory.current", "9000\n"),
            ("/sys/fs/cgroup/a/memory.max", "5000\n"),
            ("/sys/fs/cgroup/a/memory.current", "4500\n"),
            ("/sys/fs/cgroup/a/memory.stat", "anon 100\ninactive_file 1500\n"),
            ("/sys/fs/cgroup/a/b/memory.max", "8000\n"),
            ("/sys/fs/cgroup/a/b/memory.current", "1000\n"),
        ]);
        assert_eq!(control_groups("0::/a/b\n", second), Some(Amount(2000)));
        assert_eq!(control_groups("0::/\n", second), None);
        let first = files(&[
            ("/sys/fs/cgroup/memory/c/memory.limit_in_bytes", "3000"),
            ("/sys/fs/cgroup/memory/c/memory.usage_in_bytes", "1000"),
        ]);
        assert_eq!(
            control_groups("5:cpu:/c\n4:hugetlb,memory:/c\n0::/c\n", first),
            Some(Amount(2000))
        );
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn this_machine_has_some() {
        assert!(Available::least().is_some_and(|available| available.left > Amount(1 << 20)));
    }
}
