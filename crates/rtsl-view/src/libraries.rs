//! Libraries of the system without which the window's library panics.

/// One that the display at hand needs and that can't be loaded; `None` if all is well.
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

/// Elsewhere nothing is loaded that may be missing.
#[cfg(not(target_os = "linux"))]
pub fn missing() -> Option<&'static str> {
    None
}
