//! `rtsl dap`, driven as editors do: messages of the Debug Adapter Protocol to a process, and from it.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::process::{Child, Stdio};
use std::sync::mpsc::Receiver;
use std::time::Duration;

use expect_test::expect;
use serde_json::{Value as Json, json};

use crate::command::{DONE, Folder, WRONG_USAGE, rtsl};
use crate::framing::{received, send};

/// The time after which the adapter is taken to be stuck.
const PATIENCE: Duration = Duration::from_secs(120);

const STRIPES: &str = "class Stripes : rt_Texture;
public float frequency = 12.0;

float wave(float u) {
    float phase = 6.2831853 * frequency * u;
    return sin(phase);
}

void lookup() {
    float brightness = sqrt(wave(rt_TextureUV.x));
    print(\"brightness {}\", brightness);
    vec3 rgb = vec3(brightness, 0.2, 0.1);
    rt_TextureColor = color(rgb);
}
";

const BALL: &str = "LookAt 0 0 -4  0 0 0  0 1 0
Camera \"Pinhole\" \"float fov\" 40
Film \"rgb\" \"integer xresolution\" 32 \"integer yresolution\" 24
Sampler \"stratified\" \"integer pixelsamples\" 4
WorldBegin
LightSource \"DirectionalLight\" \"vector3 direction\" [1 -1 2]
Texture \"stripes\" \"spectrum\" \"Stripes\"
Material \"Lambertian\" \"texture kd\" \"stripes\"
Shape \"Sphere\"
";

fn folder() -> Folder {
    let folder = Folder::new("dap");
    folder.write("stripes.rtsl", STRIPES);
    folder.write("ball.pbrt", BALL);
    folder
}

fn path(folder: &Folder, name: &str) -> String {
    std::fs::canonicalize(folder.0.path()).unwrap().join(name).display().to_string()
}

/// An editor.
struct Client {
    child: Child,
    input: Box<dyn Write>,
    messages: Receiver<Json>,
    seq: i64,
    events: Vec<Json>,
}

fn adapter(folder: &Folder, arguments: &[&str]) -> Child {
    rtsl()
        .arg("dap")
        .args(arguments)
        .current_dir(&folder.0)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

impl Client {
    fn new(folder: &Folder) -> Client {
        let mut child = adapter(folder, &[]);
        let input = Box::new(child.stdin.take().unwrap());
        let messages = received(child.stdout.take().unwrap());
        Client { child, input, messages, seq: 0, events: Vec::new() }
    }

    /// A client that has launched a method or a scene, up to the configuration.
    fn launched(folder: &Folder, arguments: Json) -> Client {
        let mut client = Client::new(folder);
        client.done("initialize", json!({ "adapterID": "rtsl" }));
        client.done("launch", arguments);
        client.event("initialized");
        client
    }

    fn send_text(&mut self, text: &str) {
        send(&mut self.input, text);
    }

    fn receive(&mut self) -> Json {
        self.messages.recv_timeout(PATIENCE).expect("the adapter answers")
    }

    /// Returns the response to a request.
    fn request(&mut self, command: &str, arguments: Json) -> Json {
        self.seq += 1;
        let request = json!({ "seq": self.seq, "type": "request", "command": command, "arguments": arguments });
        self.send_text(&request.to_string());
        loop {
            let message = self.receive();
            if message["type"] == "response" {
                assert_eq!(message["request_seq"], self.seq);
                assert_eq!(message["command"], command);
                return message;
            }
            self.events.push(message);
        }
    }

    /// Returns the body of the response to a request that succeeds.
    fn done(&mut self, command: &str, arguments: Json) -> Json {
        let response = self.request(command, arguments);
        assert_eq!(response["success"], true, "{response}");
        response["body"].clone()
    }

    /// Returns the message of the response to a request that fails.
    fn refused(&mut self, command: &str, arguments: Json) -> String {
        let response = self.request(command, arguments);
        assert_eq!(response["success"], false, "{response}");
        response["message"].as_str().unwrap().to_owned()
    }

    /// Returns the body of the next event of a kind.
    fn event(&mut self, name: &str) -> Json {
        loop {
            let known = self.events.iter().position(|event| event["event"] == name);
            if let Some(index) = known {
                return self.events.remove(index)["body"].clone();
            }
            let message = self.receive();
            self.events.push(message);
        }
    }

    /// Makes a movement; returns the reason of its end with the innermost call.
    fn moves(&mut self, command: &str, arguments: Json) -> String {
        self.done(command, arguments);
        self.stop()
    }

    fn stop(&mut self) -> String {
        let stopped = self.event("stopped");
        let reason = stopped["reason"].as_str().unwrap().to_owned();
        let text = stopped["text"].as_str().map_or(String::new(), |text| format!(" ({text})"));
        format!("{reason}{text}: {}", self.calls()[0])
    }

    /// The calls, with file and line.
    fn calls(&mut self) -> Vec<String> {
        let stack = self.done("stackTrace", json!({ "threadId": 1 }));
        let frames = stack["stackFrames"].as_array().unwrap().iter().map(|frame| {
            let (name, source) = (frame["name"].as_str().unwrap(), &frame["source"]["name"]);
            format!("{name} {}:{}", source.as_str().unwrap_or("?"), frame["line"])
        });
        frames.collect()
    }

    /// The variables of all scopes of a call.
    fn variables(&mut self, frame: i64) -> Vec<String> {
        let scopes = self.done("scopes", json!({ "frameId": frame }));
        let mut shown = Vec::new();
        for scope in scopes["scopes"].as_array().unwrap() {
            let name = scope["name"].as_str().unwrap();
            shown.extend(self.list(name, &scope["variablesReference"]));
        }
        shown
    }

    fn list(&mut self, of: &str, reference: &Json) -> Vec<String> {
        let listed = self.done("variables", json!({ "variablesReference": reference }));
        let mut shown = Vec::new();
        for variable in listed["variables"].as_array().unwrap() {
            let (name, value) =
                (variable["name"].as_str().unwrap(), variable["value"].as_str().unwrap());
            let ty = variable["type"].as_str().map_or(String::new(), |ty| format!(": {ty}"));
            shown.push(format!("{of}/{name}{ty} = {value}"));
            if variable["variablesReference"] != 0 {
                shown.extend(self.list(&format!("{of}/{name}"), &variable["variablesReference"]));
            }
        }
        shown
    }

    fn evaluate(&mut self, expression: &str) -> String {
        let response =
            self.request("evaluate", json!({ "expression": expression, "context": "watch" }));
        let text = if response["success"] == true {
            &response["body"]["result"]
        } else {
            &response["message"]
        };
        text.as_str().unwrap().to_owned()
    }

    fn outputs(&mut self) -> Vec<String> {
        let is_output = |event: &&Json| event["event"] == "output";
        let outputs = self.events.iter().filter(is_output);
        outputs
            .map(|event| event["body"]["output"].as_str().unwrap().trim_end().to_owned())
            .collect()
    }

    fn disconnect(mut self) {
        self.done("disconnect", json!({}));
        assert!(self.child.wait().unwrap().success());
    }
}

fn method(folder: &Folder) -> Json {
    json!({
        "file": path(folder, "stripes.rtsl"),
        "class": "Stripes",
        "method": "lookup",
        "state": { "rt_TextureUV": [0.03, 0.5] },
        "stopOnEntry": true,
    })
}

#[test]
fn a_method_in_both_directions() {
    let folder = folder();
    let mut client = Client::new(&folder);
    let capabilities = client.done("initialize", json!({ "adapterID": "rtsl" }));
    for able in ["supportsStepBack", "supportsConditionalBreakpoints", "supportsEvaluateForHovers"]
    {
        assert_eq!(capabilities[able], true, "{able}");
    }
    let filters = capabilities["exceptionBreakpointFilters"].as_array().unwrap();
    let filters: Vec<&str> = filters.iter().map(|it| it["filter"].as_str().unwrap()).collect();
    assert_eq!(filters, ["notFinite", "print"]);
    client.done("launch", method(&folder));
    client.event("initialized");
    let source = json!({ "path": path(&folder, "stripes.rtsl") });
    let set = client.done(
        "setBreakpoints",
        json!({ "source": source, "breakpoints": [{ "line": 3 }, { "line": 12 }, { "line": 99 }] }),
    );
    expect![[r#"{"breakpoints":[{"id":1,"line":5,"verified":true},{"id":2,"line":12,"verified":true},{"line":99,"message":"`FOLDER/stripes.rtsl` has no statement from line 99 on","verified":false}]}"#]].assert_eq(&set.to_string().replace(&path(&folder, ""), "FOLDER/"));
    client.done("setExceptionBreakpoints", json!({ "filters": [] }));
    client.done("configurationDone", json!({}));
    let threads = client.done("threads", json!({}));
    assert_eq!(threads["threads"][0]["name"], "lookup");
    let mut stops = vec![client.stop()];
    for command in [
        "stepIn",
        "next",
        "next",
        "stepOut",
        "stepBack",
        "continue",
        "continue",
        "reverseContinue",
        "reverseContinue",
        "reverseContinue",
    ] {
        let stop = client.moves(command, json!({ "threadId": 1 }));
        stops.push(format!("{command} -> {stop}"));
    }
    expect![[r#"
        entry: Stripes.lookup stripes.rtsl:10
        stepIn -> breakpoint: wave stripes.rtsl:5
        next -> step: wave stripes.rtsl:6
        next -> step: wave stripes.rtsl:7
        stepOut -> step: Stripes.lookup stripes.rtsl:11
        stepBack -> breakpoint: wave stripes.rtsl:5
        continue -> breakpoint: Stripes.lookup stripes.rtsl:12
        continue -> step (the end of the recording): Stripes.lookup stripes.rtsl:14
        reverseContinue -> breakpoint: Stripes.lookup stripes.rtsl:12
        reverseContinue -> breakpoint: wave stripes.rtsl:5
        reverseContinue -> step (the start of the recording): Stripes.lookup stripes.rtsl:10"#]]
    .assert_eq(&stops.join("\n"));
    let outputs = client.outputs();
    assert!(outputs[0].ends_with("stripes.rtsl:11: Stripes.lookup: brightness 0.87778884"));
    assert_eq!(
        outputs[1],
        "rt_FloatTextureValue = 0.3368779\nrt_TextureColor = [0.87778884,0.2,0.1]"
    );
    client.disconnect();
}

#[test]
fn calls_scopes_and_values() {
    let folder = folder();
    let mut client = Client::launched(&folder, method(&folder));
    let source = json!({ "path": path(&folder, "stripes.rtsl") });
    let breakpoints =
        json!([{ "line": 6, "condition": "phase > 2.0 && u < frequency" }, { "line": 13 }]);
    client.done("setBreakpoints", json!({ "source": source, "breakpoints": breakpoints }));
    client.done("configurationDone", json!({}));
    client.stop();
    assert_eq!(client.moves("continue", json!({})), "breakpoint: wave stripes.rtsl:6");
    assert_eq!(client.calls(), ["wave stripes.rtsl:6", "Stripes.lookup stripes.rtsl:10"]);
    let stack = client.done("stackTrace", json!({ "threadId": 1, "startFrame": 0, "levels": 1 }));
    assert_eq!(stack["totalFrames"], 2);
    let frame = &stack["stackFrames"][0];
    assert_eq!(frame["source"]["path"], path(&folder, "stripes.rtsl"));
    let of = ["line", "column", "endLine", "endColumn"].map(|key| frame[key].as_i64().unwrap());
    assert_eq!(of, [6, 5, 6, 23]);
    expect![[r#"
        Locals/u: float = 0.03
        Locals/phase: float = 2.2619467
        Members/frequency: float = 12.0
        State read/rt_TextureUV: vec2 = (0.03, 0.5)
        State read/rt_TextureUV/x: float = 0.03
        State read/rt_TextureUV/y: float = 0.5
        Path/recording = lookup
        Path/statement = 2 of 8"#]]
    .assert_eq(&client.variables(1).join("\n"));
    expect![[r#"
        Members/frequency: float = 12.0
        State read/rt_TextureUV: vec2 = (0.03, 0.5)
        State read/rt_TextureUV/x: float = 0.03
        State read/rt_TextureUV/y: float = 0.5
        Path/recording = lookup
        Path/statement = 2 of 8"#]]
    .assert_eq(&client.variables(2).join("\n"));
    assert_eq!(client.moves("continue", json!({})), "breakpoint: Stripes.lookup stripes.rtsl:13");
    expect![[r#"
        Locals/brightness: float = 0.87778884
        Locals/rgb: vec3 = (0.87778884, 0.2, 0.1)
        Locals/rgb/x: float = 0.87778884
        Locals/rgb/y: float = 0.2
        Locals/rgb/z: float = 0.1
        Members/frequency: float = 12.0
        State read/rt_TextureUV: vec2 = (0.03, 0.5)
        State read/rt_TextureUV/x: float = 0.03
        State read/rt_TextureUV/y: float = 0.5
        Path/recording = lookup
        Path/statement = 6 of 8"#]]
    .assert_eq(&client.variables(1).join("\n"));
    assert_eq!(client.evaluate("rgb.x"), "0.87778884");
    assert_eq!(client.evaluate("dot(rgb, vec3(1.0)) > 1.0"), "true");
    assert_eq!(client.evaluate("rt_TextureUV"), "(0.03, 0.5)");
    assert_eq!(
        client.evaluate("nothing"),
        "`nothing` can't be evaluated: there is no `nothing` here"
    );
    let vector = client.done("evaluate", json!({ "expression": "2.0 * rgb", "frameId": 1 }));
    assert_eq!(vector["type"], "vec3");
    let parts = client.list("2.0 * rgb", &vector["variablesReference"]);
    assert_eq!(parts[1], "2.0 * rgb/y: float = 0.4");
    // What a client asks for of an earlier statement is gone.
    client.moves("stepBack", json!({}));
    let stale = client.refused("variables", json!({ "variablesReference": 1 }));
    assert_eq!(stale, "these variables are of an earlier statement");
    assert_eq!(client.refused("scopes", json!({ "frameId": 7 })), "there is no such call");
    client.disconnect();
}

#[test]
fn a_pixel_from_its_end_to_the_nan() {
    let folder = folder();
    let launch = json!({ "scene": path(&folder, "ball.pbrt"), "pixel": [21, 12], "sample": 0 });
    let mut client = Client::launched(&folder, launch);
    client.done("configurationDone", json!({}));
    let end = client.stop();
    assert!(
        end.starts_with("step (the end of the recording): Sphere.intersect sphere.rtsl:"),
        "{end}"
    );
    let threads = client.done("threads", json!({}));
    assert_eq!(threads["threads"][0]["name"], "pixel 21,12, sample 0");
    client.done("setExceptionBreakpoints", json!({ "filters": ["notFinite"] }));
    let found = client.moves("reverseContinue", json!({}));
    expect!["exception (this statement makes NaN of finite numbers: sqrt(wave(rt_TextureUV.x))): Stripes.lookup of kd stripes.rtsl:10"].assert_eq(&found);
    let exception = client.done("exceptionInfo", json!({ "threadId": 1 }));
    assert_eq!(exception["exceptionId"], "notFinite");
    expect![[r#"
        Stripes.lookup of kd stripes.rtsl:10
        BSDF lambertian.rtsl:12
        Lambertian.sampleBSDF ?:0
        Path.radiance path.rtsl:79"#]]
    .assert_eq(&client.calls().join("\n"));
    assert_eq!(
        client.evaluate("wave(rt_TextureUV.x)").split(": ").last(),
        Some("there is no function `wave`")
    );
    assert_eq!(client.moves("stepIn", json!({})), "step: wave stripes.rtsl:5");
    client.disconnect();
}

/// Steps are statements, as the protocol has it, unless the client asks for lines.
#[test]
fn sizes_of_steps() {
    let folder = folder();
    folder.write("stripes.rtsl", STRIPES.replace("float phase", "float one = 1.0; float phase"));
    let mut client = Client::launched(&folder, method(&folder));
    client.done("configurationDone", json!({}));
    client.stop();
    assert_eq!(client.moves("stepIn", json!({})), "step: wave stripes.rtsl:5");
    assert_eq!(client.moves("next", json!({})), "step: wave stripes.rtsl:5");
    assert_eq!(client.moves("stepBack", json!({})), "step: wave stripes.rtsl:5");
    let line = json!({ "granularity": "line" });
    assert_eq!(client.moves("next", line.clone()), "step: wave stripes.rtsl:6");
    assert_eq!(client.moves("stepBack", line), "step: wave stripes.rtsl:5");
    client.moves("stepOut", json!({}));
    // Calls are stepped over in both directions.
    let statement = json!({ "granularity": "statement" });
    assert_eq!(client.moves("stepBack", statement.clone()), "step: Stripes.lookup stripes.rtsl:10");
    assert_eq!(client.moves("next", statement), "step: Stripes.lookup stripes.rtsl:11");
    client.disconnect();
}

/// Texts of the standard library have no file; their breakpoints are set by the number of the text.
#[test]
fn texts_that_are_built_in() {
    let folder = folder();
    let launch = json!({ "scene": "ball.pbrt", "pixel": ["21", "12"], "cwd": path(&folder, "") });
    let mut client = Client::launched(&folder, launch);
    let loaded = client.done("loadedSources", json!({}));
    let sources = loaded["sources"].as_array().unwrap();
    let sphere = sources.iter().find(|it| it["name"] == "sphere.rtsl").unwrap();
    assert!(sphere["path"].as_str().unwrap().ends_with("shaders/primitives/sphere.rtsl"));
    let reference = &sphere["sourceReference"];
    let text = client.done("source", json!({ "source": sphere, "sourceReference": reference }));
    let text = text["content"].as_str().unwrap();
    let line = 1 + text.lines().position(|line| line.contains("void intersect()")).unwrap();
    let lines = json!({ "source": sphere, "line": line, "endLine": line + 3 });
    let locations = client.done("breakpointLocations", lines);
    assert!(!locations["breakpoints"].as_array().unwrap().is_empty());
    let set = client
        .done("setBreakpoints", json!({ "source": sphere, "breakpoints": [{ "line": line }] }));
    assert_eq!(set["breakpoints"][0]["verified"], true);
    client.done("configurationDone", json!({}));
    let stop = client.stop();
    assert!(stop.starts_with("breakpoint: Sphere.intersect sphere.rtsl:"), "{stop}");
    let unknown = client.refused("source", json!({ "sourceReference": 99 }));
    assert_eq!(unknown, "there is no such text");
    let missing = client.done(
        "setBreakpoints",
        json!({ "source": { "path": "/nowhere.rtsl" }, "breakpoints": [{ "line": 1 }] }),
    );
    assert_eq!(
        missing["breakpoints"][0],
        json!({
            "verified": false,
            "line": 1,
            "message": "no statement of this file takes part in the recording",
        })
    );
    client.disconnect();
}

#[test]
fn prints_and_functions() {
    let folder = folder();
    let mut client = Client::launched(&folder, method(&folder));
    let names = json!({ "breakpoints": [{ "name": "wave" }, { "name": "Stripes.missing" }] });
    let set = client.done("setFunctionBreakpoints", names);
    assert_eq!(set["breakpoints"][0]["verified"], true);
    assert_eq!(set["breakpoints"][1]["verified"], false);
    client.done("setExceptionBreakpoints", json!({ "filters": ["print"] }));
    client.done("configurationDone", json!({}));
    client.stop();
    assert_eq!(client.moves("continue", json!({})), "breakpoint: wave stripes.rtsl:5");
    assert_eq!(
        client.moves("continue", json!({})),
        "exception (this statement prints: brightness 0.87778884): Stripes.lookup stripes.rtsl:11"
    );
    client.done("terminate", json!({}));
    client.event("terminated");
    client.disconnect();
}

/// A restart records the text as it is then, and keeps the breakpoints.
#[test]
fn restarts_read_changed_texts() {
    let folder = folder();
    let mut client = Client::launched(&folder, method(&folder));
    let source = json!({ "path": path(&folder, "stripes.rtsl") });
    client.done("setBreakpoints", json!({ "source": source, "breakpoints": [{ "line": 11 }] }));
    client.done("configurationDone", json!({}));
    client.stop();
    client.moves("continue", json!({}));
    assert_eq!(client.evaluate("brightness"), "0.87778884");
    folder.write("stripes.rtsl", STRIPES.replace("sqrt(wave", "abs(wave"));
    client.done("restart", json!({}));
    assert_eq!(client.stop(), "entry: Stripes.lookup stripes.rtsl:10");
    assert_eq!(client.moves("continue", json!({})), "breakpoint: Stripes.lookup stripes.rtsl:11");
    assert_eq!(client.evaluate("brightness"), "0.77051324");
    assert_eq!(
        client.moves("restartFrame", json!({ "frameId": 1 })),
        "step: Stripes.lookup stripes.rtsl:10"
    );
    // A text with an error keeps the recording that there is.
    folder.write("stripes.rtsl", STRIPES.replace("sqrt(", "sqrrt("));
    let error = client.refused("restart", json!({}));
    assert!(error.contains("stripes.rtsl:10") && error.contains("sqrrt"), "{error}");
    assert_eq!(client.moves("next", json!({})), "breakpoint: Stripes.lookup stripes.rtsl:11");
    client.disconnect();
}

#[test]
fn recordings_that_are_cut_tell_it() {
    let folder = folder();
    let mut launch = method(&folder);
    launch["keep"] = json!(12);
    launch["stopOnEntry"] = json!(false);
    let mut client = Client::launched(&folder, launch);
    client.done("configurationDone", json!({}));
    let stop = client.stop();
    assert!(stop.starts_with("step (the end of the recording, which lacks "), "{stop}");
    assert!(client.outputs()[0].contains("the recording is cut"), "{:?}", client.outputs());
    client.disconnect();
}

#[test]
fn progress_is_for_clients_that_show_it() {
    let folder = folder();
    let mut client = Client::new(&folder);
    client.done("initialize", json!({ "supportsProgressReporting": true, "linesStartAt1": false }));
    client.done("launch", method(&folder));
    assert_eq!(client.event("progressStart")["title"], "Recording");
    client.event("progressEnd");
    client.event("initialized");
    client.done("configurationDone", json!({}));
    // This client counts lines from 0.
    assert_eq!(client.stop(), "entry: Stripes.lookup stripes.rtsl:9");
    client.disconnect();
}

#[test]
fn launches_that_are_wrong() {
    let folder = folder();
    let mut refusals = Vec::new();
    folder.write("broken.rtsl", "class Broken : rt_Texture; void lookup() { nonsense(); }");
    for arguments in [
        json!({}),
        json!({ "scene": "ball.pbrt" }),
        json!({ "scene": "ball.pbrt", "pixel": [99, 0] }),
        json!({ "scene": "ball.pbrt", "pixel": [0, 0], "sample": 9 }),
        json!({ "scene": "missing.pbrt", "pixel": [0, 0] }),
        json!({ "scene": "ball.pbrt", "pixel": "middle" }),
        json!({ "scene": "ball.pbrt", "pixel": [0, 0], "renderer": "magic" }),
        json!({ "file": "stripes.rtsl" }),
        json!({ "file": "stripes.rtsl", "method": "look" }),
        json!({ "file": "stripes.rtsl", "method": "lookup", "state": { "rt_TextureUV": "x" } }),
        json!({ "file": "stripes.rtsl", "method": "lookup", "keep": 0 }),
        json!({ "file": "broken.rtsl", "method": "lookup" }),
        json!({ "file": "missing.rtsl", "method": "lookup" }),
    ] {
        let mut client = Client::new(&folder);
        client.done("initialize", json!({}));
        let refusal = client.refused("launch", arguments.clone());
        refusals.push(format!("{arguments}\n  {}", refusal.lines().next().unwrap_or_default()));
        assert_eq!(client.refused("next", json!({})), "nothing is launched");
        client.disconnect();
    }
    expect![[r#"
        {}
          `launch` needs `scene` and `pixel`, or `file` and `method`
        {"scene":"ball.pbrt"}
          `scene` needs `pixel`: a column and a row, such as [320, 240]
        {"pixel":[99,0],"scene":"ball.pbrt"}
          error[E0627]: there is no pixel 99,0 in a picture of 32 by 24 pixels
        {"pixel":[0,0],"sample":9,"scene":"ball.pbrt"}
          error[E0627]: there is no sample 9: a pixel has 4
        {"pixel":[0,0],"scene":"missing.pbrt"}
          error[E0601]: cannot read `missing.pbrt`: No such file or directory (os error 2)
        {"pixel":"middle","scene":"ball.pbrt"}
          `launch`: invalid type: string "middle", expected an array of length 2
        {"pixel":[0,0],"renderer":"magic","scene":"ball.pbrt"}
          there is no renderer `magic`: batch, interactive
        {"file":"stripes.rtsl"}
          `file` needs `method`: a method or another function of it
        {"file":"stripes.rtsl","method":"look"}
          error: there is no method or function `look`
        {"file":"stripes.rtsl","method":"lookup","state":{"rt_TextureUV":"x"}}
          error: `rt_TextureUV`: "x" is no float or list of floats
        {"file":"stripes.rtsl","keep":0,"method":"lookup"}
          `keep` is a number from 1 to 16777216
        {"file":"broken.rtsl","method":"lookup"}
          error[E0201]: there is no function `nonsense`
        {"file":"missing.rtsl","method":"lookup"}
          error[E0601]: `missing.rtsl` can't be read: there is no such file"#]]
    .assert_eq(&refusals.join("\n"));
}

#[test]
fn messages_that_are_wrong() {
    let folder = folder();
    let mut client = Client::launched(&folder, method(&folder));
    client.send_text("nonsense");
    assert!(client.event("output")["output"].as_str().unwrap().starts_with("no request: "));
    assert_eq!(client.refused("fly", json!({})), "the debugger has no `fly`");
    // Lines that no text has.
    let source = json!({ "path": path(&folder, "stripes.rtsl") });
    let lines = json!([{ "line": i64::MIN }, { "line": i64::MAX }]);
    let set = client.done("setBreakpoints", json!({ "source": source, "breakpoints": lines }));
    assert_eq!(set["breakpoints"].as_array().unwrap().len(), 2);
    let error = client.refused("setBreakpoints", json!({ "source": 7 }));
    assert!(error.starts_with("`setBreakpoints`: "), "{error}");
    client.disconnect();
    for (input, expected) in [
        ("hello\n", "a message begins with `Content-Length: N`"),
        ("Other: 1\r\n\r\n{}", "a message has no `Content-Length`"),
        ("Content-Length: 99999999999\r\n\r\n{}", "a message has more than 16777216 bytes"),
    ] {
        let ran = folder.run_with(&["dap"], input);
        assert_ne!(ran.code(), DONE);
        assert!(ran.errors().contains(expected), "{}", ran.errors());
    }
    // The end of the input is that of the client.
    folder.run_with(&["dap"], "").exits(DONE);
}

/// Starts an adapter that waits on a port; returns it, its address, and further lines that it prints.
fn listening(folder: &Folder, arguments: &[&str], lines: usize) -> (Child, String, Vec<String>) {
    let mut child = adapter(folder, &[&["--port", "0"], arguments].concat());
    let printed = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut printed = printed.take(1 + lines).map(Result::unwrap);
    let address = printed.next().unwrap();
    let address = address.strip_prefix("listening on ").unwrap().to_owned();
    (child, address, printed.collect())
}

fn connected(child: Child, address: &str) -> Client {
    let stream = TcpStream::connect(address).unwrap();
    let messages = received(stream.try_clone().unwrap());
    Client { child, input: Box::new(stream), messages, seq: 0, events: Vec::new() }
}

fn with_token(mut arguments: Json, token: &str) -> Json {
    arguments["token"] = json!(token);
    arguments
}

#[test]
fn a_port_of_this_machine_serves_whoever_has_the_token() {
    let folder = folder();
    let (child, address, printed) = listening(&folder, &[], 1);
    let token = printed[0].strip_prefix("token ").unwrap();
    assert!(token.len() == 32 && token != "0".repeat(32));
    let mut client = connected(child, &address);
    for token in ["", "0123"] {
        client.done("initialize", json!({}));
        let error = client.refused("launch", with_token(method(&folder), token));
        assert!(error.starts_with("the argument `token` of `launch` is not"), "{error}");
        client = connected(client.child, &address);
    }
    let error = client.refused("evaluate", json!({ "expression": "1" }));
    assert!(error.starts_with("the argument `token`"), "{error}");
    client = connected(client.child, &address);
    client.input.write_all(b"GET / HTTP/1.1\r\n\r\n").unwrap();
    client = connected(client.child, &address);
    client.done("initialize", json!({}));
    client.done("launch", with_token(method(&folder), token));
    client.done("configurationDone", json!({}));
    assert_eq!(client.stop(), "entry: Stripes.lookup stripes.rtsl:10");
    client.disconnect();
}

#[test]
fn a_token_of_the_users_choice() {
    let folder = folder();
    let (child, address, _) = listening(&folder, &["--token", "mine"], 0);
    let mut client = connected(child, &address);
    client.done("initialize", json!({}));
    client.done("launch", with_token(method(&folder), "mine"));
    client.disconnect();
    folder.run(&["dap", "--token", "mine"]).exits(WRONG_USAGE);
}
