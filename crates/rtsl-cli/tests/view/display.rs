//! A virtual display, and windows on it, by the X protocol.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::rc::Rc;
use std::time::Duration;

use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    BUTTON_PRESS_EVENT, BUTTON_RELEASE_EVENT, ConfigureWindowAux, ConnectionExt, ImageFormat,
    InputFocus, KEY_PRESS_EVENT, KEY_RELEASE_EVENT, MOTION_NOTIFY_EVENT, MapState,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

/// The key "Home", by its number in the protocol.
pub const HOME: u32 = 0xff50;
/// The key "Tab".
pub const TAB: u32 = 0xff09;

/// The time between two events of one gesture, long enough for toolkits to see them as two.
const PACE: Duration = Duration::from_millis(20);

/// The duration of a drag, which has seven events.
pub const DRAG: Duration = Duration::from_millis(140);

/// A display of its own, ended when it is dropped.
pub struct Display {
    server: Child,
    name: String,
    connection: Rc<RustConnection>,
    root: u32,
}

impl Display {
    /// Starts one; `None` where there is no Xvfb.
    pub fn start() -> Option<Display> {
        let mut command = Command::new("Xvfb");
        command.args(["-displayfd", "1", "-screen", "0", "800x600x24", "-nolisten", "tcp"]);
        let mut server = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().ok()?;
        // The server tells the number that it found free once it is ready.
        let mut number = String::new();
        let output = server.stdout.take().expect("it is piped");
        BufReader::new(output).read_line(&mut number).expect("Xvfb tells its number");
        let name = format!(":{}", number.trim());
        let (connection, screen) = RustConnection::connect(Some(&name)).expect("Xvfb answers");
        let root = connection.setup().roots[screen].root;
        Some(Display { server, name, connection: Rc::new(connection), root })
    }

    /// The value of `DISPLAY` for programs that use this display.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The window of this size, once it shows.
    pub fn window(&self, (width, height): (u16, u16)) -> Option<Window> {
        let children = self.connection.query_tree(self.root).ok()?.reply().ok()?.children;
        let id = children.into_iter().find(|child| {
            let size = self.connection.get_geometry(*child).ok().and_then(|it| it.reply().ok());
            let state = self.connection.get_window_attributes(*child).ok();
            let state = state.and_then(|it| it.reply().ok()).map(|it| it.map_state);
            size.is_some_and(|it| (it.width, it.height) == (width, height))
                && state == Some(MapState::VIEWABLE)
        })?;
        Some(Window { connection: self.connection.clone(), root: self.root, id })
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// A window.
pub struct Window {
    connection: Rc<RustConnection>,
    root: u32,
    id: u32,
}

impl Window {
    /// Hands it the keyboard.
    pub fn focus(&self) {
        self.connection.set_input_focus(InputFocus::PARENT, self.id, x11rb::CURRENT_TIME).unwrap();
        self.connection.sync_all();
    }

    /// The window's pixels; `None` if the window is closed.
    pub fn pixels(&self) -> Option<Pixels> {
        let size = self.connection.get_geometry(self.id).ok()?.reply().ok()?;
        let (width, height) = (size.width, size.height);
        let format = ImageFormat::Z_PIXMAP;
        let image = self.connection.get_image(format, self.id, 0, 0, width, height, u32::MAX);
        let data = image.ok()?.reply().ok()?.data;
        let pixel = |bytes: &[u8]| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], 0]);
        Some(Pixels { width, height, colors: data.chunks_exact(4).map(pixel).collect() })
    }

    /// Makes it larger or smaller.
    pub fn resize(&self, (width, height): (u16, u16)) {
        let size = ConfigureWindowAux::new().width(u32::from(width)).height(u32::from(height));
        self.connection.configure_window(self.id, &size).unwrap();
        self.connection.sync_all();
    }

    /// Presses and releases the key of a letter.
    pub fn press_key(&self, letter: char) {
        self.press_named(u32::from(letter));
    }

    /// Holds the key of a letter for some time.
    pub fn hold_key(&self, letter: char, time: Duration) {
        let code = self.key_code(u32::from(letter));
        self.fake(KEY_PRESS_EVENT, code, (0, 0));
        std::thread::sleep(time);
        self.fake(KEY_RELEASE_EVENT, code, (0, 0));
    }

    /// Presses and releases a key by its number in the protocol.
    pub fn press_named(&self, symbol: u32) {
        let code = self.key_code(symbol);
        self.fake(KEY_PRESS_EVENT, code, (0, 0));
        self.fake(KEY_RELEASE_EVENT, code, (0, 0));
    }

    /// Clicks with a button; 4 turns the wheel away from the user.
    pub fn click(&self, button: u8, at: (i16, i16)) {
        self.drag(button, at, at);
    }

    /// Drags from one place to another, over some in between.
    pub fn drag(&self, button: u8, from: (i16, i16), to: (i16, i16)) {
        self.fake(MOTION_NOTIFY_EVENT, 0, from);
        self.fake(BUTTON_PRESS_EVENT, button, from);
        for step in 1..=4 {
            let between = |from: i16, to: i16| from + (to - from) * step / 4;
            self.fake(MOTION_NOTIFY_EVENT, 0, (between(from.0, to.0), between(from.1, to.1)));
        }
        self.fake(BUTTON_RELEASE_EVENT, button, to);
    }

    fn fake(&self, kind: u8, detail: u8, (x, y): (i16, i16)) {
        let connection = &self.connection;
        let faked =
            connection.xtest_fake_input(kind, detail, x11rb::CURRENT_TIME, self.root, x, y, 0);
        faked.unwrap();
        connection.sync_all();
        std::thread::sleep(PACE);
    }

    fn key_code(&self, symbol: u32) -> u8 {
        let setup = self.connection.setup();
        let (first, last) = (setup.min_keycode, setup.max_keycode);
        let mapping = self.connection.get_keyboard_mapping(first, last - first + 1).unwrap();
        let mapping = mapping.reply().unwrap();
        let per_code = usize::from(mapping.keysyms_per_keycode);
        let mut codes = (first..).zip(mapping.keysyms.chunks(per_code));
        let found = codes.find(|(_, symbols)| symbols.contains(&symbol));
        found.expect("the keyboard has the key").0
    }
}

trait SyncAll {
    /// Waits until the server has done all that was asked for.
    fn sync_all(&self);
}

impl SyncAll for RustConnection {
    fn sync_all(&self) {
        self.get_input_focus().unwrap().reply().unwrap();
    }
}

/// The pixels of a window: `0x00RRGGBB`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pixels {
    width: u16,
    height: u16,
    colors: Vec<u32>,
}

impl Pixels {
    /// Columns and rows.
    pub fn size(&self) -> (u16, u16) {
        (self.width, self.height)
    }

    /// The rows from this one on.
    pub fn below(&self, row: u16) -> &[u32] {
        &self.colors[usize::from(row) * usize::from(self.width)..]
    }

    /// The colour at a place.
    pub fn at(&self, (x, y): (i16, i16)) -> u32 {
        let index = y.unsigned_abs() as usize * usize::from(self.width) + x.unsigned_abs() as usize;
        self.colors.get(index).copied().unwrap_or(0)
    }
}
