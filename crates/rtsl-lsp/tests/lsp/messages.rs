//! Each request of the protocol.

use expect_test::{Expect, expect};
use serde_json::{Value, json};

use crate::client::{Client, position_of};

const WAVE: &str = "import lib.scale;

/// Waves along one direction.
class Wave : rt_Texture;

[[min 0]] public float height = 1.0;

float profile(float x) { return scale.twice(height) * sin(x); }

void lookup() {
    float x = 6.28 * rt_TextureUV.x;
    rt_FloatTextureValue = profile(x) + 1;
}
";
const SCALE: &str = "// Twice as much.\nfloat twice(float x) { return 2.0 * x; }\n";
const OTHER: &str = "import lib.scale;\nclass Other : rt_Texture;\nvoid lookup() { rt_FloatTextureValue = scale.twice(0.5); }\n";

fn files() -> [(&'static str, &'static str); 3] {
    [("wave.rtsl", WAVE), ("lib/scale.rtsl", SCALE), ("other.rtsl", OTHER)]
}

fn opened() -> Client {
    let mut client = Client::new(&files());
    assert_eq!(client.open("wave.rtsl", WAVE), json!([]));
    client
}

fn check(client: &Client, found: &Value, expected: Expect) {
    expected.assert_eq(&client.without_folder(found));
}

#[test]
fn requests_that_the_server_does_not_have_are_refused() {
    let mut client = Client::new(&[]);
    let found = client.ask("textDocument/nothing", json!({}));
    check(
        &client,
        &found,
        expect![[r#"
        {
          "error": "the server has no `textDocument/nothing`"
        }"#]],
    );
}

#[test]
fn diagnostics_follow_the_text() {
    let mut client = Client::new(&files());
    let broken = WAVE.replace("6.28 *", "6.28 * * ").replace("profile(x)", "profle(x)");
    let found = client.open("wave.rtsl", &broken);
    check(
        &client,
        &found,
        expect![[r#"
            [
              {
                "code": "E0101",
                "message": "expected an expression, found `*`\nhelp: there are no pointers: an `inout` parameter changes a variable of the caller",
                "range": {
                  "end": {
                    "character": 22,
                    "line": 10
                  },
                  "start": {
                    "character": 21,
                    "line": 10
                  }
                },
                "severity": 1,
                "source": "rtsl"
              },
              {
                "code": "E0201",
                "message": "there is no function `profle`\nunknown function\nhelp: did you mean: `profile`",
                "range": {
                  "end": {
                    "character": 33,
                    "line": 11
                  },
                  "start": {
                    "character": 27,
                    "line": 11
                  }
                },
                "severity": 1,
                "source": "rtsl"
              }
            ]"#]],
    );
    let start = position_of(&broken, "profle");
    let end = json!({"line": start["line"], "character": start["character"].as_u64().unwrap() + 6});
    let found = client.change("wave.rtsl", json!({"start": start, "end": end}), "profile");
    assert_eq!(found.as_array().map(Vec::len), Some(1), "{found}");
    assert_eq!(client.change("wave.rtsl", json!(null), WAVE), json!([]));
}

#[test]
fn errors_of_modules_stand_at_their_imports() {
    let mut client = opened();
    client.open("lib/scale.rtsl", SCALE);
    let broken = SCALE.replace("2.0 * x", "2.0 * y");
    client.change("lib/scale.rtsl", json!(null), &broken);
    let found = client.diagnostics("wave.rtsl");
    check(
        &client,
        &found,
        expect![[r#"
        [
          {
            "code": "E0201",
            "message": "in `FOLDER/lib/scale.rtsl`: there is no `y` here\nunknown name\nhelp: did you mean: `x`",
            "range": {
              "end": {
                "character": 16,
                "line": 0
              },
              "start": {
                "character": 7,
                "line": 0
              }
            },
            "relatedInformation": [
              {
                "location": {
                  "range": {
                    "end": {
                      "character": 37,
                      "line": 1
                    },
                    "start": {
                      "character": 36,
                      "line": 1
                    }
                  },
                  "uri": "file://FOLDER/lib/scale.rtsl"
                },
                "message": "unknown name"
              }
            ],
            "severity": 1,
            "source": "rtsl"
          }
        ]"#]],
    );
    // The file on the disk counts again.
    client.tell(
        "textDocument/didClose",
        json!({"textDocument": {"uri": client.uri("lib/scale.rtsl")}}),
    );
    assert_eq!(client.diagnostics("wave.rtsl"), json!([]));
}

#[test]
fn hover_and_definition() {
    let mut client = opened();
    let found = client.ask_at("textDocument/hover", "wave.rtsl", WAVE, "twice|(height)");
    check(
        &client,
        &found,
        expect![[r#"
        {
          "contents": {
            "kind": "markdown",
            "value": "```rtsl\nfloat twice(float x)\n```\n\nTwice as much."
          },
          "range": {
            "end": {
              "character": 43,
              "line": 7
            },
            "start": {
              "character": 38,
              "line": 7
            }
          }
        }"#]],
    );
    let found = client.ask_at("textDocument/definition", "wave.rtsl", WAVE, "twi|ce(height)");
    check(
        &client,
        &found,
        expect![[r#"
        {
          "range": {
            "end": {
              "character": 11,
              "line": 1
            },
            "start": {
              "character": 6,
              "line": 1
            }
          },
          "uri": "file://FOLDER/lib/scale.rtsl"
        }"#]],
    );
    // The prelude is written to the library's folder.
    let found = client.ask_at("textDocument/definition", "wave.rtsl", WAVE, "si|n(x)");
    let uri = found["uri"].as_str().expect("a place");
    assert!(uri.contains("/.cache/") && uri.ends_with(".rtsl"), "{uri}");
    let path = uri.strip_prefix("file://").expect("a file");
    assert!(std::fs::read_to_string(path).expect("it is written").contains("float sin(float"));
    assert_eq!(
        client.ask_at("textDocument/hover", "wave.rtsl", WAVE, "| rt_TextureUV.x"),
        json!(null)
    );
}

#[test]
fn references_and_renaming_reach_all_files() {
    let mut client = opened();
    let position = position_of(WAVE, "twi|ce");
    let document = json!({"uri": client.uri("wave.rtsl")});
    let asked = json!({"textDocument": document, "position": position, "context": {"includeDeclaration": true}});
    let found = client.ask("textDocument/references", asked);
    let places: Vec<String> = found
        .as_array()
        .expect("a list")
        .iter()
        .map(|it| {
            let name = it["uri"]
                .as_str()
                .unwrap_or_default()
                .rsplit('/')
                .next()
                .unwrap_or_default()
                .to_owned();
            format!("{name}:{}:{}", it["range"]["start"]["line"], it["range"]["start"]["character"])
        })
        .collect();
    expect![[r#"
        wave.rtsl:7:38
        scale.rtsl:1:6
        other.rtsl:2:45"#]]
    .assert_eq(&places.join("\n"));
    let asked = json!({"textDocument": document, "position": position, "newName": "doubled"});
    let found = client.ask("textDocument/rename", asked);
    let count = |name: &str| found["changes"][client.uri(name)].as_array().map(Vec::len);
    assert_eq!(
        (count("wave.rtsl"), count("other.rtsl"), count("lib/scale.rtsl")),
        (Some(1), Some(1), Some(1))
    );
    let asked = json!({"textDocument": document, "position": position, "newName": "2x"});
    let found = client.ask("textDocument/rename", asked);
    check(
        &client,
        &found,
        expect![[r#"
        {
          "error": "`2x` is no name"
        }"#]],
    );
    let found = client.ask_at("textDocument/prepareRename", "wave.rtsl", WAVE, "loo|kup");
    check(
        &client,
        &found,
        expect![[r#"
        {
          "error": "renderers call this method by its name"
        }"#]],
    );
    let found = client.ask_at("textDocument/prepareRename", "wave.rtsl", WAVE, "hei|ght =");
    check(
        &client,
        &found,
        expect![[r#"
        {
          "end": {
            "character": 29,
            "line": 5
          },
          "start": {
            "character": 23,
            "line": 5
          }
        }"#]],
    );
    let found = client.ask_at("textDocument/documentHighlight", "wave.rtsl", WAVE, "float x| =");
    assert_eq!(found.as_array().map(Vec::len), Some(2), "{found}");
}

#[test]
fn completion_and_signatures() {
    let mut client = opened();
    let text = WAVE.replace("profile(x) + 1;", "pro");
    client.change("wave.rtsl", json!(null), &text);
    let found = client.ask_at("textDocument/completion", "wave.rtsl", &text, "= pro|");
    let items = found.as_array().expect("a list");
    let profile = items.iter().find(|item| item["label"] == "profile").expect("it is offered");
    check(
        &client,
        profile,
        expect![[r#"
        {
          "detail": "float profile(float x)",
          "filterText": "profile",
          "insertTextFormat": 2,
          "kind": 3,
          "label": "profile",
          "sortText": "1profile",
          "textEdit": {
            "newText": "profile($0)",
            "range": {
              "end": {
                "character": 30,
                "line": 11
              },
              "start": {
                "character": 27,
                "line": 11
              }
            }
          }
        }"#]],
    );
    let text = WAVE.replace("profile(x) + 1;", "profile(");
    client.change("wave.rtsl", json!(null), &text);
    let found = client.ask_at("textDocument/signatureHelp", "wave.rtsl", &text, "= profile(|");
    check(
        &client,
        &found,
        expect![[r#"
        {
          "activeParameter": 0,
          "activeSignature": 0,
          "signatures": [
            {
              "label": "float profile(float x)",
              "parameters": [
                {
                  "label": [
                    14,
                    21
                  ]
                }
              ]
            }
          ]
        }"#]],
    );
}

#[test]
fn overviews_of_a_text() {
    let mut client = opened();
    let document = json!({"textDocument": {"uri": client.uri("wave.rtsl")}});
    let found = client.ask("textDocument/documentSymbol", document.clone());
    assert_eq!(found[1]["name"], "Wave");
    assert_eq!(found[1]["children"].as_array().map(Vec::len), Some(3), "{found}");
    let found = client.ask("textDocument/foldingRange", document.clone());
    check(
        &client,
        &found,
        expect![[r#"
        [
          {
            "endLine": 11,
            "startLine": 9
          }
        ]"#]],
    );
    let found = client.ask("textDocument/semanticTokens/full", document.clone());
    let data = found["data"].as_array().expect("numbers");
    assert!(data.len().is_multiple_of(5) && data.len() > 100, "{}", data.len());
    let found = client.ask("textDocument/codeLens", document.clone());
    check(
        &client,
        &found,
        expect![[r#"
        [
          {
            "command": {
              "arguments": [
                "file://FOLDER/wave.rtsl",
                "Wave"
              ],
              "command": "rtsl.test",
              "title": "Test"
            },
            "range": {
              "end": {
                "character": 10,
                "line": 3
              },
              "start": {
                "character": 6,
                "line": 3
              }
            }
          },
          {
            "command": {
              "arguments": [
                "file://FOLDER/wave.rtsl",
                "Wave",
                "lookup"
              ],
              "command": "rtsl.bench",
              "title": "Measure"
            },
            "range": {
              "end": {
                "character": 11,
                "line": 9
              },
              "start": {
                "character": 5,
                "line": 9
              }
            }
          }
        ]"#]],
    );
    let whole = json!({"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}});
    let asked = json!({"textDocument": document["textDocument"], "range": whole});
    let found = client.ask("textDocument/inlayHint", asked);
    let labels: Vec<String> =
        found.as_array().expect("a list").iter().map(|hint| hint["label"].to_string()).collect();
    expect![[r#""fma" "fma""#]].assert_eq(&labels.join(" "));
    let found = client.ask("workspace/symbol", json!({"query": "twi"}));
    assert_eq!(found.as_array().map(Vec::len), Some(1), "{found}");
}

#[test]
fn fixes_and_formatting() {
    let mut client = opened();
    let text = WAVE.replace("profile(x)", "profle( x )");
    client.change("wave.rtsl", json!(null), &text);
    let place = position_of(&text, "profle");
    let asked = json!({
        "textDocument": {"uri": client.uri("wave.rtsl")},
        "range": {"start": place, "end": place},
        "context": {"diagnostics": []},
    });
    let found = client.ask("textDocument/codeAction", asked);
    assert_eq!(found[0]["title"], "did you mean: `profile`");
    check(
        &client,
        &found[0]["edit"],
        expect![[r#"
        {
          "changes": {
            "file://FOLDER/wave.rtsl": [
              {
                "newText": "profile",
                "range": {
                  "end": {
                    "character": 33,
                    "line": 11
                  },
                  "start": {
                    "character": 27,
                    "line": 11
                  }
                }
              }
            ]
          }
        }"#]],
    );
    let options = json!({"tabSize": 4, "insertSpaces": true});
    let asked = json!({"textDocument": {"uri": client.uri("wave.rtsl")}, "options": options});
    let found = client.ask("textDocument/formatting", asked.clone());
    check(
        &client,
        &found,
        expect![[r#"
        [
          {
            "newText": "    rt_FloatTextureValue = profle(x) + 1;\n",
            "range": {
              "end": {
                "character": 0,
                "line": 12
              },
              "start": {
                "character": 0,
                "line": 11
              }
            }
          }
        ]"#]],
    );
    client.change("wave.rtsl", json!(null), WAVE);
    assert_eq!(client.ask("textDocument/formatting", asked.clone()), json!([]));
    client.change("wave.rtsl", json!(null), "class {");
    let found = client.ask("textDocument/formatting", asked);
    check(
        &client,
        &found,
        expect![[r#"
        {
          "error": "`{` without its pair"
        }"#]],
    );
}

#[test]
fn columns_are_those_of_the_editor() {
    let text =
        "// ä\nclass A : rt_Texture; void lookup() { /* 😀ä */ rt_FloatTextureValue = wrong; }\n";
    for (encodings, column) in [(json!(null), 71), (json!(["utf-8", "utf-16"]), 74)] {
        let mut client = Client::with_encoding(&[], encodings);
        let found = client.open("a.rtsl", text);
        assert_eq!(found[0]["range"]["start"], json!({"line": 1, "character": column}));
    }
}

#[test]
fn texts_without_files_are_served() {
    let mut client = Client::new(&[]);
    let uri = "untitled:Untitled-1";
    client.tell(
        "textDocument/didOpen",
        json!({"textDocument": {"uri": uri, "languageId": "rtsl", "version": 0, "text": WAVE}}),
    );
    let asked = json!({"textDocument": {"uri": uri}, "position": position_of(WAVE, "hei|ght")});
    let found = client.ask("textDocument/hover", asked);
    assert!(found["contents"]["value"].as_str().is_some_and(|text| text.contains("float height")));
}
