//! Measures how soon an interactive session shows a change:
//!
//! ```text
//! cargo run --release -p rtsl-bench --example session_latency -- SCENE [--integrator NAME] [--threads N]
//!     [--picture FILE.png] [--set NAME.PARAMETER=A,B] [--edit FILE.rtsl=OLD=NEW]
//! ```
//!
//! The scene is opened, its camera moves, a parameter takes two values in turn, and so does a text in a shader beside
//! the scene. Each line has the median times until a frame is shown, at the resolution that is told, and the time until
//! every pixel of the full resolution has a sample, after the last change.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Parser;
use rtsl_image::write_pixels;
use rtsl_math::Transform;
use rtsl_render::LoadOptions;
use rtsl_render::session::{Session, SessionOptions};

/// Measures the time until an interactive session shows a change.
#[derive(Parser)]
struct Arguments {
    scene: PathBuf,
    /// The integrator; that of the viewer if not given.
    #[arg(long)]
    integrator: Option<String>,
    /// The number of threads; that of all processors if not given.
    #[arg(long)]
    threads: Option<usize>,
    /// A file for the picture of the last frame while the camera moves.
    #[arg(long, value_name = "FILE.png")]
    picture: Option<PathBuf>,
    /// A parameter, as the name of a part of the scene and its own, and two values that it has in turn.
    #[arg(long, value_name = "NAME.PARAMETER=A,B")]
    set: Option<String>,
    /// A shader beside the scene, a text in it, and another one that replaces it in turn.
    #[arg(long, value_name = "FILE=OLD=NEW")]
    edit: Option<String>,
}

/// The number of times that each change is made.
const CHANGES: usize = 9;

/// The times until a change is shown.
struct Latency {
    /// The time of the change itself: loading and compiling.
    change: Duration,
    /// The time until a frame is shown.
    frame: Duration,
    /// The time until every pixel has a sample of its own, if that was waited for.
    full: Option<Duration>,
    /// The reduction of the frame's resolution.
    reduction: usize,
}

fn main() -> Result<(), String> {
    let arguments = Arguments::parse();
    let options = SessionOptions {
        load: LoadOptions { integrator: arguments.integrator.clone(), ..LoadOptions::default() },
        threads: arguments.threads,
        ..SessionOptions::default()
    };
    println!("{:<12}{:>10}{:>10}{:>10}{:>8}", "ms", "change", "frame", "full", "at");
    let start = Instant::now();
    let opened = Session::open(&arguments.scene, options);
    let (mut session, _) = opened.map_err(|messages| messages.to_text(false))?;
    print("open", &[until_shown(&mut session, start, true)]);
    let home = session.camera();
    let moves: Vec<Latency> = (1..=4 * CHANGES)
        .map(|step| {
            let start = Instant::now();
            let by = Transform::translate([0.002 * step as f64, 0.0, 0.0]);
            session.set_camera(home.after(by));
            until_shown(&mut session, start, step == 4 * CHANGES)
        })
        .collect();
    if let Some(picture) = &arguments.picture {
        session.set_camera(home);
        session.advance(SLICE);
        let (width, height) = session.film().size();
        let mut pixels = vec![0; width * height];
        session.film().copy_to(&mut pixels, width);
        write_pixels(&pixels, width, picture).map_err(|error| error.to_string())?;
    }
    // The first moves find out how fast frames are.
    print("camera", &moves[CHANGES..]);
    if let Some(set) = &arguments.set {
        print("parameter", &set_parameter(&mut session, set)?);
    }
    if let Some(edit) = &arguments.edit {
        let folder = arguments.scene.parent().ok_or("the scene has a folder")?;
        print("shader", &edit_shader(&mut session, folder.join("x"), edit)?);
    }
    Ok(())
}

fn set_parameter(session: &mut Session, set: &str) -> Result<Vec<Latency>, String> {
    let usage = "NAME.PARAMETER=A,B";
    let (place, values) = set.split_once('=').ok_or(usage)?;
    let (title, name) = place.split_once('.').ok_or(usage)?;
    let values: Result<Vec<f64>, _> = values.split(',').map(str::parse).collect();
    let values = values.map_err(|error| error.to_string())?;
    let things = session.things();
    let is_meant = |title_of: &str, class: &str| title_of == title || class == title;
    let thing = things.iter().find(|thing| is_meant(&thing.title, &thing.class));
    let entity = thing.ok_or_else(|| format!("there is no {title}: {things:?}"))?.entity;
    let components = |name: &str| {
        let controls = session.controls(entity);
        controls.into_iter().find(|it| it.name == name).map_or(1, |it| it.values.len())
    };
    let count = components(name);
    (0..CHANGES)
        .map(|change| {
            let numbers = vec![values[change % values.len()]; count];
            let start = Instant::now();
            let set = session.set_control(entity, name, &numbers);
            set.map_err(|messages| messages.to_text(false))?;
            Ok(until_shown(session, start, change + 1 == CHANGES))
        })
        .collect()
}

fn edit_shader(session: &mut Session, beside: PathBuf, edit: &str) -> Result<Vec<Latency>, String> {
    let parts: Vec<&str> = edit.splitn(3, '=').collect();
    let [file, old, new] = parts[..] else { return Err("FILE=OLD=NEW".to_owned()) };
    let path = beside.with_file_name(file);
    let text = std::fs::read_to_string(&path).map_err(|error| error.to_string())?;
    let edited = text.replace(old, new);
    let latencies = (0..CHANGES).map(|change| {
        // Every text is a new one, since machine code of recent ones is kept.
        let number = format!("{}", change + 1);
        let text = edited.replace("NUMBER", &number);
        std::fs::write(&path, text).map_err(|error| error.to_string())?;
        let start = Instant::now();
        let reloaded = session.reload().map_err(|messages| messages.to_text(false))?;
        assert!(reloaded.changed, "the text is another");
        Ok(until_shown(session, start, change + 1 == CHANGES))
    });
    let latencies = latencies.collect();
    std::fs::write(&path, text).map_err(|error| error.to_string())?;
    latencies
}

/// Advances the session as the viewer does until a frame is shown, or every pixel has a sample.
fn until_shown(session: &mut Session, start: Instant, is_followed: bool) -> Latency {
    let change = start.elapsed();
    session.advance(SLICE);
    let (frame, reduction) = (start.elapsed(), session.status().reduction);
    let is_full = |session: &Session| {
        let film = session.film();
        (0..film.tiles().len()).all(|tile| film.taken(tile) > 0)
    };
    while is_followed && !is_full(session) && session.advance(SLICE) {}
    let full = is_followed.then(|| start.elapsed());
    Latency { change, frame, full, reduction }
}

/// The slice of time of the viewer.
const SLICE: Duration = Duration::from_millis(15);

fn print(what: &str, latencies: &[Latency]) {
    let median = |of: fn(&Latency) -> Option<Duration>| {
        let mut times: Vec<Duration> = latencies.iter().filter_map(of).collect();
        times.sort_unstable();
        times[times.len() / 2].as_secs_f64() * 1e3
    };
    let [change, frame, full] =
        [median(|it| Some(it.change)), median(|it| Some(it.frame)), median(|it| it.full)];
    let reduction = latencies.last().map_or(1, |it| it.reduction);
    println!("{what:<12}{change:>10.1}{frame:>10.1}{full:>10.1}{:>8}", format!("1/{reduction}"));
}
