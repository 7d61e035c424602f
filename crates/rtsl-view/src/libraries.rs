//! A check for system libraries without which the window library panics.

/// Returns a library that the display needs and that cannot be loaded; `None` if none is missing.
#[cfg(target_os = "linux")]
pub fn missing() -> Option<&'static str> {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let is_wayland = is_set("WAYLAND_DISPLAY") || is_set("WAYLAND_SOCKET");
    let is_x11 = !is_wayland && is_set("DISPLAY");
    if (is_wayland || is_x11) && xkbcommon_dl::xkbcommon_option().is_none() {
        Some("libxkbcommon")
    } else if is_x11 && xkbcommon_dl::x11::xkbcommon_x11_option().is_none() {
        Some("libxkbcommon-x11")
    } else {
        None
    }
}

/// On other systems no library is loaded at run time.
#[cfg(not(target_os = "linux"))]
pub fn missing() -> Option<&'static str> {
    None
}
