//! The command line of `rtsl bench`.

use std::path::PathBuf;

use clap::Args;
use rtsl::CallMode;
use serde_json::Value as JsonValue;

use crate::arguments::{
    CodeArguments, InputArguments, SearchPath, VariantArguments, parse_call_mode, parse_width,
};
use crate::commands::render::{parse_size, parse_threads};
use crate::eval::parse_setting;
use crate::outcome::Failure;
use crate::report::Reporter;

/// The command line of `rtsl bench`.
#[derive(Clone, Debug, Args)]
pub struct BenchArguments {
    /// The shader, or a scene whose name ends in .pbrt
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// The method; all methods if not given.
    pub method: Option<String>,
    /// For an integrator: the scene that it renders, whose name ends in .pbrt
    #[arg(long = "scene", value_name = "SCENE")]
    pub in_scene: Option<PathBuf>,
    /// The class, if the file has several.
    #[arg(long)]
    pub class: Option<String>,
    /// A parameter of the instance; may be repeated.
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = parse_setting)]
    pub params: Vec<(String, JsonValue)>,
    /// A state variable of all rays; may be repeated. Besides the values of `rtsl eval`, it accepts `{"lanes": [...]}`,
    /// which rays get in turn, and `{"from": VALUE, "to": VALUE}`, for random values between the two. Other variables
    /// are random, as a renderer would set them.
    #[arg(long = "state", value_name = "NAME=VALUE", value_parser = parse_setting)]
    pub state: Vec<(String, JsonValue)>,
    /// The number of rays of a call. The default keeps their data in the first-level cache.
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub lanes: u32,
    /// A call mode to measure; may be repeated; all call modes if not given.
    #[arg(long = "call-mode", alias = "shape", value_name = "MODE", value_parser = parse_call_mode)]
    pub modes: Vec<CallMode>,
    /// A width to measure; may be repeated; all widths if not given.
    #[arg(long = "width", value_parser = parse_width)]
    pub widths: Vec<u32>,
    #[command(flatten)]
    pub variant: VariantArguments,
    /// The seed of random numbers.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// The time to measure each kernel, in milliseconds, 50 if not given; for a scene, each kind of ray, and
    /// each width of an integrator, 1000 if not given.
    #[arg(long, value_name = "MILLISECONDS")]
    pub time: Option<u32>,
    #[command(flatten)]
    pub code: CodeArguments,
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Print the estimated cost of each line of the text, its share of active lanes, and where rays diverge: of the first
    /// call mode and width that are asked for, or of packets of 8 rays. No LLVM is needed.
    #[arg(long, conflicts_with_all = ["in_scene", "time"])]
    pub lines: bool,
    /// Print one JSON object per line for each kernel.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub search_path: SearchPath,
}

impl BenchArguments {
    /// Returns the arguments with the folders of the project files beside the shader and the scene.
    ///
    /// # Errors
    /// If one of them is wrong, which is reported.
    pub fn with_project_files(&self, reporter: &Reporter) -> Result<BenchArguments, Failure> {
        let mut search_path = self.search_path.beside(&self.file, reporter)?;
        if let Some(scene) = self.in_scene.as_ref().filter(|it| it.parent() != self.file.parent()) {
            search_path = search_path.beside(scene, reporter)?;
        }
        Ok(BenchArguments { search_path, ..self.clone() })
    }
}

/// The arguments for scenes, and for integrators in scenes.
#[derive(Clone, Debug, Args)]
pub struct SceneArguments {
    /// For a scene: columns and rows, overriding its own.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<(usize, usize)>,
    /// For a scene: the number of threads; that of all processors if not given.
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// For a scene: the number of repetitions for each kind of ray, if `--time` permits.
    #[arg(long, value_name = "N", default_value_t = 25, value_parser = clap::value_parser!(u32).range(1..))]
    pub repetitions: u32,
    /// For a scene: set a parameter, as for `rtsl render`; may be repeated.
    #[arg(short = 'D', long = "define", value_name = "NAME.PARAMETER=VALUE")]
    pub defines: Vec<String>,
    #[command(flatten)]
    pub input: InputArguments,
}
