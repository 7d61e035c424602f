//! Signals that tell the program to end.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, LazyLock};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag::{register, register_conditional_shutdown};

use crate::outcome::INPUT_AT_FAULT;

/// Signals that tell a program to end: that of Ctrl-C; those of batch systems, containers and `timeout`; and that of a
/// terminal that is closed.
#[cfg(unix)]
const SIGNALS: [i32; 3] = [SIGINT, SIGTERM, signal_hook::consts::SIGHUP];
#[cfg(not(unix))]
const SIGNALS: [i32; 2] = [SIGINT, SIGTERM];

/// Returns a flag that becomes true when the program is told to end. A Ctrl-C after that ends it at once; other signals
/// do not, because `timeout` and batch systems send theirs twice.
pub fn told_to_end() -> &'static AtomicBool {
    static TOLD: LazyLock<Arc<AtomicBool>> = LazyLock::new(|| {
        let told = Arc::new(AtomicBool::new(false));
        for signal in SIGNALS.into_iter().filter(|signal| !is_ignored(*signal)) {
            // A signal that cannot be heard ends the program as by default.
            if signal == SIGINT {
                let _ = register_conditional_shutdown(signal, INPUT_AT_FAULT.into(), told.clone());
            }
            let _ = register(signal, told.clone());
        }
        told
    });
    &TOLD
}

/// True if whoever started the program had it ignore a signal, as `nohup` does.
#[cfg(target_os = "linux")]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|digits| u64::from_str_radix(digits.trim(), 16).ok());
    mask.unwrap_or(0) >> (signal - 1) & 1 == 1
}

/// The same where no file tells: the signal of a closed terminal may be ignored, so it keeps its effect.
#[cfg(not(target_os = "linux"))]
fn is_ignored(signal: i32) -> bool {
    signal != SIGINT && signal != SIGTERM
}
