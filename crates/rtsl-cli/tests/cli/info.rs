//! `rtsl info --source`: the texts of classes.

use expect_test::expect;

use crate::command::{DONE, Folder, WRONG_USAGE};

#[test]
fn sources_of_the_library_have_their_paths() {
    let folder = Folder::new("library-source");
    let text = folder.run(&["info", "--source", "Checker"]).exits(DONE).output();
    let (first, rest) = text.split_once('\n').unwrap();
    assert!(first.starts_with("// shaders/textures/") && first.contains(".rtsl:"), "{first}");
    assert!(rest.starts_with("///") && rest.contains("class Checker : rt_Texture"), "{rest}");
    folder.run(&["info", "--source", "Cheker"]).fails_with("E0507");
    folder.run(&["info", "--source"]).exits(WRONG_USAGE);
}

#[test]
fn sources_of_files_are_split_at_their_classes() {
    let folder = Folder::new("file-source");
    folder.write("helper.rtsl", "// A helper.\nclass Included : rt_Texture { };\n");
    folder.write(
        "several.rtsl",
        "#include \"helper.rtsl\"
float unrelated() { return 1.0; }

/// The first.
class First : rt_Texture;
public float a = 1.0; // of First
void lookup() { }

/* No documentation. */ class Second : rt_Texture {
    void lookup() { if (true) { } } // {
    // }
};
float late() { return 2.0; }
// Two lines
// of comments.
class Third : First { };
",
    );
    folder.run(&["info", "--source", "several.rtsl"]).exits(DONE).prints(expect![[r#"
        // helper.rtsl:1
        // A helper.
        class Included : rt_Texture { };

        // several.rtsl:4
        /// The first.
        class First : rt_Texture;
        public float a = 1.0; // of First
        void lookup() { }

        // several.rtsl:9
        /* No documentation. */ class Second : rt_Texture {
            void lookup() { if (true) { } } // {
            // }
        };

        // several.rtsl:14
        // Two lines
        // of comments.
        class Third : First { };
    "#]]);
    folder.write("none.rtsl", "float f() { return 1.0; }\n");
    let errors = folder.run(&["info", "--source", "none.rtsl"]).exits(WRONG_USAGE).errors();
    assert!(errors.contains("`none.rtsl` has no class"), "{errors}");
    folder.run(&["info", "--source", "missing.rtsl"]).fails_with("E0601");
}
