//! The folders of a scene. Of files elsewhere, which a scene of a stranger may name too, messages show no line, and do
//! not tell whether they are there.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use rtsl::{
    Diagnostic, Diagnostics, Label, Severity, SourceMap, Span, diagnostic_codes as codes,
    lies_within,
};

use super::files::{FileSource, resolve};

/// The folder of a scene's file, and the folders that the user named.
pub struct Fence<'a> {
    main: &'a Path,
    files: &'a dyn FileSource,
    folders: Vec<PathBuf>,
    /// The way to see more of what lies outside.
    remedy: Remedy,
}

/// A way for users to see more of files outside.
#[derive(Clone, Copy)]
enum Remedy {
    /// An option that names further folders.
    Option,
    /// The files have to lie elsewhere: the command has no such option.
    Copy,
}

impl<'a> Fence<'a> {
    /// The fence of the scene in the file `main`.
    pub fn new(main: &'a Path, files: &'a dyn FileSource, named: &[PathBuf]) -> Self {
        let folder = main.parent().unwrap_or(Path::new("")).to_owned();
        let folders = [folder].into_iter().chain(named.iter().cloned()).collect();
        Fence { main, files, folders, remedy: Remedy::Option }
    }

    /// The fence of the scene in the file `main`, of a command that takes no further folders.
    pub fn alone(main: &'a Path, files: &'a dyn FileSource) -> Self {
        Fence { remedy: Remedy::Copy, ..Fence::new(main, files, &[]) }
    }

    /// Returns the folders.
    pub fn folders(&self) -> &[PathBuf] {
        &self.folders
    }

    /// True if a path leads into one of the folders.
    pub fn contains(&self, path: &Path) -> bool {
        path == self.main || lies_within(path, &self.folders, |path| self.files.real_path(path))
    }

    /// Returns diagnostics without what they tell of files outside. `included` has the places at which the scene names
    /// further texts.
    pub fn redacted(
        &self,
        diagnostics: Diagnostics,
        map: &SourceMap,
        included: &BTreeMap<PathBuf, Span>,
    ) -> Diagnostics {
        let outside: BTreeSet<_> = map
            .files()
            .filter(|(_, file)| included.contains_key(Path::new(&file.name)))
            .filter(|(_, file)| !self.contains(Path::new(&file.name)))
            .map(|(id, _)| id)
            .collect();
        let is_outside = |label: &Label| outside.contains(&label.span.file);
        let (mut said, mut is_changed) = (BTreeSet::new(), false);
        let mut redacted = Diagnostics::new();
        for mut diagnostic in diagnostics.iter().cloned() {
            let at = diagnostic.primary.as_ref();
            let replaced = match at.filter(|at| is_outside(at)) {
                Some(at) => {
                    let name = &map.file(at.span.file).name;
                    let place = included.get(Path::new(name)).copied();
                    let place = place.filter(|place| !outside.contains(&place.file));
                    Some(self.withheld(diagnostic.severity, name, place))
                }
                None if diagnostic.severity == Severity::Error => {
                    let place = at.map(|at| at.span);
                    let name = self.outside_name(&diagnostic, map);
                    name.map(|name| self.withheld(Severity::Error, &name, place))
                }
                None => None,
            };
            match replaced {
                Some(replaced) => {
                    is_changed = true;
                    if said.insert(replaced.message.clone()) {
                        redacted.push(replaced);
                    }
                }
                None => {
                    is_changed |= diagnostic.labels.iter().any(is_outside);
                    diagnostic.labels.retain(|label| !is_outside(label));
                    redacted.push(diagnostic);
                }
            }
        }
        if is_changed { redacted } else { diagnostics }
    }

    /// The path of a file outside that a diagnostic is about: it is in the message, or the text has it at the place.
    fn outside_name(&self, diagnostic: &Diagnostic, map: &SourceMap) -> Option<String> {
        let between = |text: &str, quote: char| -> Vec<String> {
            text.split(quote).skip(1).step_by(2).map(str::to_owned).collect()
        };
        let in_text = diagnostic.primary.as_ref().map_or_else(Vec::new, |at| {
            let text = &map.file(at.span.file).text;
            let range = at.span.start as usize..at.span.end as usize;
            between(text.get(range).unwrap_or_default(), '"')
        });
        let named = in_text.into_iter().chain(between(&diagnostic.message, '`'));
        let mut paths = named.map(|name| resolve(self.main, &name));
        let path = paths.find(|path| path.file_name().is_some() && !self.contains(path))?;
        Some(path.display().to_string())
    }

    /// Returns the message about a file outside: the same whether it is missing or has faults.
    fn withheld(&self, severity: Severity, name: &str, place: Option<Span>) -> Diagnostic {
        let folder = Path::new(name).parent().unwrap_or(Path::new("")).display();
        let (code, message) = match severity {
            Severity::Error => (codes::UNREADABLE_FILE, format!("cannot read `{name}`")),
            Severity::Warning => {
                (codes::IGNORED_SETTING, format!("`{name}` has parts without effect"))
            }
        };
        let remedy = match self.remedy {
            Remedy::Option => format!("`-I {folder}` allows that"),
            Remedy::Copy => "a copy of it beside the scene shows what is wrong".to_owned(),
        };
        let diagnostic = Diagnostic::new(code, message).help(format!(
            "it lies outside the folder of the scene, so no more is told of it; {remedy}"
        ));
        match place {
            Some(place) => diagnostic.at(place, "named here"),
            None => diagnostic,
        }
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;
    use rtsl::Messages;

    use crate::reader::MemoryFiles;
    use crate::{LoadOptions, load_scene};

    const SECRET: &str = "root:x:0:0:a line of a secret\n\"Shape\" 1 2 [ 3\n";

    /// The messages about a scene, if a file outside has this text.
    fn messages(part: &str, outside: Option<&str>, named: &[&str]) -> String {
        let text = format!("Camera \"Pinhole\"\nWorldBegin\nShape \"Sphere\"\n{part}\n");
        let files = MemoryFiles::<String>::default().with("scenes/a.pbrt", text);
        let files = match outside {
            Some(text) => files.with("elsewhere/secret", text),
            None => files,
        };
        let search_path = named.iter().map(Into::into).collect();
        let options = LoadOptions { search_path, ..LoadOptions::default() };
        let loaded = load_scene("scenes/a.pbrt".as_ref(), &files, &options);
        let messages = loaded.map_or_else(|messages| messages, |loaded| loaded.warnings);
        Messages::to_text(&messages, false)
    }

    #[test]
    fn nobody_learns_what_is_outside() {
        for part in [
            "Include \"../elsewhere/secret\"",
            "Import \"../elsewhere/secret\"",
            "Material \"materialx\" \"string file\" \"../elsewhere/secret\"",
            "Shape \"plymesh\" \"string filename\" \"../elsewhere/secret\"",
            "LightSource \"infinite\" \"string filename\" \"../elsewhere/secret\"",
            "LightSource \"goniometric\" \"string filename\" \"../elsewhere/secret\"",
            "Material \"measured\" \"string filename\" \"../elsewhere/secret\" Shape \"sphere\"",
            "Material \"conductor\" \"spectrum eta\" \"../elsewhere/secret\"",
            "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"../elsewhere/secret\" \
             Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\"",
        ] {
            let absent = messages(part, None, &[]);
            assert!(absent.contains("error[E0601]: cannot read `elsewhere/secret`"), "{absent}");
            for text in [SECRET, "", "\u{0}"] {
                let there = messages(part, Some(text), &[]);
                // An empty text is one that can be included.
                assert!(there == absent || text.is_empty(), "{part}\n{there}\n{absent}");
                assert!(!there.contains("a line of a secret"), "{there}");
            }
        }
    }

    #[test]
    fn the_user_may_name_the_folder() {
        let part = "Include \"../elsewhere/secret\"";
        expect![[r#"
            error[E0601]: cannot read `elsewhere/secret`
              ┌─ scenes/a.pbrt:4:9
              │
            4 │ Include "../elsewhere/secret"
              │         ^^^^^^^^^^^^^^^^^^^^^ named here
              │
              = help: it lies outside the folder of the scene, so no more is told of it; `-I elsewhere` allows that

        "#]]
        .assert_eq(&messages(part, Some(SECRET), &[]));
        assert!(messages(part, Some(SECRET), &["elsewhere"]).contains("a line of a secret"));
        assert!(messages(part, None, &["elsewhere"]).contains("entity not found"));
    }
}
