//! Scenes of earlier versions.

use rtsl::{Diagnostic, diagnostic_codes as codes};

use super::Interpreter;
use crate::reader::files::resolve;
use crate::reader::parser::Command;
use crate::reader::upgrade::Upgrader;

impl Interpreter<'_> {
    /// Upgrades the commands from here on; the first time with a warning.
    pub fn upgrade_from_here(&mut self) {
        if self.upgrader.is_old() {
            return;
        }
        self.upgrader.set_old();
        let scene = self.main_file.display();
        let message = format!(
            "`{scene}` is in the format of an earlier version of pbrt: it is read as `pbrt --upgrade` would convert it"
        );
        let help =
            format!("`rtsl scene convert {scene} -o NEW.pbrt` writes it in the format of pbrt-v4");
        self.diagnostics.push(Diagnostic::new(codes::OLD_SCENE, message).help(help));
    }

    /// Upgrades from a command on whose name only earlier versions have, unless that may be the name of a class.
    pub fn note_age(&mut self, command: &Command) {
        if self.upgrader.is_old() || command.is_broken || !Upgrader::is_old_name(command) {
            return;
        }
        let is_without_shaders = *self.is_without_shaders.get_or_insert_with(|| {
            let folder = resolve(self.main_file, "");
            let is_shader =
                |path: &std::path::PathBuf| path.extension().is_some_and(|it| it == "rtsl");
            !self.files.list(&folder).is_ok_and(|files| files.iter().any(is_shader))
        });
        if is_without_shaders {
            self.upgrade_from_here();
        }
    }
}
