//! The file `rtsl.toml` beside shaders and scenes.

use expect_test::expect;

use crate::command::{DONE, Folder, INPUT_AT_FAULT};

const USER: &str = "#include \"grey.rtsl\"\nimport tones.dark as dark;\nclass Used : rt_Texture;\n\
    void lookup() { rt_FloatTextureValue = grey() * dark.DARK; }\n";

/// A folder with files that includes and imports name, in two folders, and users of them.
fn folder(name: &str, project: &str) -> Folder {
    let folder = Folder::new(name);
    for path in ["work/lib", "work/shaders/tones"] {
        std::fs::create_dir_all(folder.0.path().join(path)).unwrap();
    }
    folder.write("work/lib/grey.rtsl", "float grey() { return 0.5; }\n");
    folder.write("work/shaders/tones/dark.rtsl", "const float DARK = 0.5;\n");
    folder.write("work/used.rtsl", USER);
    let scene = "Camera \"perspective\"\nWorldBegin\nTexture \"t\" \"float\" \"Used\"\n\
        Material \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\"\n";
    folder.write("work/scene.pbrt", scene);
    if !project.is_empty() {
        folder.write("work/rtsl.toml", project);
    }
    folder
}

#[test]
fn folders_of_the_project_are_searched() {
    let project = "# Shaders of all scenes.\nsearch-path = [\"lib\", \"shaders\"]\n";
    let folder = folder("project", project);
    folder.run(&["check", "work/used.rtsl", "work/scene.pbrt"]).exits(DONE);
    let lookup = ["eval", "work/used.rtsl", "lookup"];
    let found = folder.run(&lookup).exits(DONE).output();
    assert!(found.contains("rt_FloatTextureValue = 0.25"), "{found}");
    folder.run(&["info", "work/used.rtsl"]).exits(DONE);
    folder.run(&["build", "work/used.rtsl", "--emit", "ir"]).exits(DONE);
    folder.run(&["scene", "info", "work/scene.pbrt"]).exits(DONE);
    let request = "{\"file\": \"work/used.rtsl\", \"method\": \"lookup\"}";
    let answer = folder.run_with(&["eval", "--stdin"], request).exits(DONE).output();
    assert!(answer.contains("[0.25]"), "{answer}");
    // The folders of the command line come first.
    std::fs::create_dir(folder.0.path().join("mine")).unwrap();
    folder.write("mine/grey.rtsl", "float grey() { return 1.0; }\n");
    let mine = folder.run(&[&lookup[..], &["-I", "mine"]].concat()).exits(DONE).output();
    assert!(mine.contains("rt_FloatTextureValue = 0.5"), "{mine}");
}

#[test]
fn without_the_file_nothing_is_searched() {
    let folder = folder("no-project", "");
    let errors = folder.run(&["check", "work/used.rtsl"]).exits(INPUT_AT_FAULT).errors();
    assert!(errors.contains("grey.rtsl"), "{errors}");
}

#[test]
fn faults_of_the_file_have_their_places() {
    let folder = folder("wrong-project", "");
    let check = |project: &str, expected: &[&str]| {
        folder.write("work/rtsl.toml", project);
        let errors = folder.run(&["check", "work/used.rtsl"]).errors();
        for expected in expected {
            assert!(errors.contains(expected), "{expected}\n{errors}");
        }
    };
    check(
        "\nsearch_path = []\n",
        &[
            "error[E0650]: `rtsl.toml` has no key `search_path`",
            "did you mean `search-path`?",
            "work/rtsl.toml:2:1",
        ],
    );
    check(
        "search-path = \"lib\"\n",
        &[
            "error[E0650]: `search-path` is a string",
            "rtsl.toml:1:15",
            "expected a list of folders",
        ],
    );
    check(
        "search-path = [\"lib\", 3]\n",
        &["a folder of `search-path` is a number", "rtsl.toml:1:23"],
    );
    check("search-path = [\"\"]\n", &["has no name"]);
    check("search-path = [\n", &["error[E0650]: `rtsl.toml` is no TOML", "work/rtsl.toml:"]);
    check(
        "search-path = [\"lib\", \"nowhere\"]\n",
        &["warning[W0650]: there is no folder `work/nowhere`", "rtsl.toml:1:23"],
    );
    // Other commands end with the errors.
    folder.write("work/rtsl.toml", "x = 1\n");
    for arguments in
        [&["eval", "work/used.rtsl", "lookup"][..], &["render", "work/scene.pbrt", "-o", "a.png"]]
    {
        folder.run(arguments).fails_with("E0650");
    }
    let request = "{\"file\": \"work/used.rtsl\", \"method\": \"lookup\"}";
    let answer = folder.run_with(&["eval", "--stdin"], request).exits(DONE).output();
    assert!(answer.contains("E0650"), "{answer}");
    // Classes of the library need no project.
    folder.run(&["info", "Checker"]).exits(DONE);
    std::fs::remove_file(folder.0.path().join("work/rtsl.toml")).unwrap();
    std::fs::create_dir(folder.0.path().join("work/rtsl.toml")).unwrap();
    check_folder(&folder);
}

/// A folder with the name of the file is an error.
fn check_folder(folder: &Folder) {
    let errors = folder.run(&["check", "work/used.rtsl"]).exits(INPUT_AT_FAULT).errors();
    assert!(errors.contains("error[E0601]"), "{errors}");
}

/// A project file of a stranger: its folders may be those of the system, its name a link.
#[cfg(unix)]
#[test]
fn a_project_does_not_leave_its_folder() {
    let folder = Folder::new("stranger");
    let path = |name: &str| folder.0.path().join(name);
    for name in ["work", "outside"] {
        std::fs::create_dir(path(name)).unwrap();
    }
    folder.write("outside/secret", "root:x:0:0:a line of a secret\n");
    folder.write("work/a.rtsl", "#include \"secret\"\nclass A : rt_Texture; void lookup() {}\n");
    std::os::unix::fs::symlink(path("outside"), path("work/link")).unwrap();
    std::os::unix::fs::symlink(path("absent"), path("work/dangling")).unwrap();
    let absolute = path("outside").display().to_string();
    let errors_of = |named: &str| {
        folder.write("work/rtsl.toml", format!("search-path = [\"{named}\"]\n"));
        let errors = folder.run(&["check", "work/a.rtsl"]).exits(INPUT_AT_FAULT).errors();
        assert!(!errors.contains("a line of a secret"), "{errors}");
        assert!(errors.contains("warning[W0632]"), "{errors}");
        errors.replace(named, "FOLDER")
    };
    let expected = errors_of("../outside");
    expect![[r#"
        warning[W0632]: `FOLDER` leaves the folder of `rtsl.toml`
          ┌─ work/rtsl.toml:1:16
          │
        1 │ search-path = ["FOLDER"]
          │                ^^^^^^^^^^^^ not searched
          │
          = help: if you want it to be searched, add `-I work/FOLDER`

    "#]]
    .assert_eq(expected.split("error[").next().unwrap_or_default());
    for named in ["../absent", "link", "dangling", "link/absent"] {
        let carets = |text: &str| text.replace('^', "");
        let errors = errors_of(named);
        assert_eq!(carets(&errors), carets(&expected), "{named}");
    }
    assert!(errors_of(&absolute).contains("add `-I FOLDER`"));
    // The user may name the folder.
    let errors = folder.run(&["check", "work/a.rtsl", "-I", "outside"]).exits(INPUT_AT_FAULT);
    assert!(errors.errors().contains("a line of a secret"));
    std::fs::remove_file(path("work/rtsl.toml")).unwrap();
    for target in ["outside/secret", "outside/absent"] {
        std::os::unix::fs::symlink(path(target), path("work/rtsl.toml")).unwrap();
        let errors = folder.run(&["check", "work/a.rtsl"]).errors();
        assert!(errors.contains("W0632") && !errors.contains("a line of a secret"), "{errors}");
        std::fs::remove_file(path("work/rtsl.toml")).unwrap();
    }
}
