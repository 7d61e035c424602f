//! `rtsl lsp` runs the program itself for costs of lines and values of pixels.

use std::process::Stdio;
use std::time::Duration;

use serde_json::{Value as Json, json};

use crate::command::{Folder, rtsl};
use crate::framing::{received, send};

/// The time after which the server is taken to be stuck.
const PATIENCE: Duration = Duration::from_secs(120);

/// A texture that is NaN on the lower half of a ball.
pub const WAVE: &str = "class Wave : rt_Texture;

void lookup() {
    float x = rt_TextureUV.y - 0.5;
    if (x < 0.0) print(\"x = {}\", x);
    rt_FloatTextureValue = sqrt(x);
}
";

/// A ball with this texture.
pub const BALL: &str = "LookAt 0 0 -4  0 0 0  0 1 0
Camera \"Pinhole\" \"float fov\" 40
Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8
Sampler \"stratified\" \"integer pixelsamples\" 1
WorldBegin
LightSource \"DirectionalLight\" \"vector3 direction\" [1 -1 2]
Texture \"wave\" \"float\" \"Wave\"
Material \"Lambertian\" \"texture kd\" \"wave\"
Shape \"Sphere\"
";

#[test]
fn costs_and_pixels_come_from_the_program() {
    let folder = Folder::new("lsp");
    folder.write("wave.rtsl", WAVE);
    folder.write("ball.pbrt", BALL);
    let root = std::fs::canonicalize(folder.0.path()).unwrap();
    let uri = format!("file://{}", root.join("wave.rtsl").display());
    let mut server = rtsl()
        .arg("lsp")
        .env("XDG_CACHE_HOME", root.join("cache"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = server.stdin.take().unwrap();
    let messages = received(server.stdout.take().unwrap());
    let mut tell = |message: Json| send(&mut input, &message.to_string());
    let answer = |id: i32| loop {
        let message = messages.recv_timeout(PATIENCE).expect("the server answers");
        if message["id"] == json!(id) && message.get("method").is_none() {
            assert!(message.get("error").is_none(), "{message}");
            return message["result"].clone();
        }
    };
    let request = |id: i32, method: &str, parameters: Json| json!({"jsonrpc": "2.0", "id": id, "method": method, "params": parameters});
    let folders = json!([{"uri": format!("file://{}", root.display()), "name": "test"}]);
    tell(request(1, "initialize", json!({"capabilities": {}, "workspaceFolders": folders})));
    answer(1);
    tell(json!({"jsonrpc": "2.0", "method": "initialized", "params": {}}));
    let command = |name: &str, argument: Json| json!({"command": name, "arguments": [argument]});

    let scene = json!({"scene": "ball.pbrt"});
    tell(request(2, "workspace/executeCommand", command("rtsl.lineCosts", scene)));
    let costs = answer(2);
    let files = costs["files"].as_array().expect("a list");
    let wave = files.iter().find(|file| file["uri"] == json!(uri)).expect("the texture's file");
    let lines = wave["lines"].as_array().expect("a list");
    assert!(lines.iter().any(|line| line["line"] == 5 && line["cost"].as_f64() > Some(0.0)));
    let of_library = |file: &&Json| file["uri"].as_str().unwrap().contains("/cache/rtsl/library/");
    assert!(files.iter().any(|file| of_library(&file)), "{costs}");

    let method = json!({"uri": uri, "class": "Wave", "method": "lookup"});
    tell(request(3, "workspace/executeCommand", command("rtsl.lineCosts", method)));
    assert_eq!(answer(3)["files"][0]["uri"], json!(uri));

    // Pixels of one half are NaN, and those of the other are not.
    let mut faults = Vec::new();
    for y in 2..6 {
        let pixel = json!({"scene": "ball.pbrt", "x": 4, "y": y});
        tell(request(4 + y, "workspace/executeCommand", command("rtsl.pixel", pixel)));
        let pixel = answer(4 + y);
        let is_faulty = pixel["notFinite"].as_array().is_some_and(|it| !it.is_empty());
        assert_eq!(is_faulty, pixel["samples"][0]["color"][0] == "NaN", "{pixel}");
        assert!(!is_faulty || pixel["prints"][0]["text"].as_str().unwrap().starts_with("x = -"));
        faults.push(is_faulty);
    }
    assert_eq!(faults, [false, false, true, true]);

    tell(request(20, "shutdown", json!(null)));
    answer(20);
    tell(json!({"jsonrpc": "2.0", "method": "exit"}));
    assert!(server.wait().unwrap().success());
}
