//! The integrator.

use rtsl::Diagnostics;

use super::Settings;
use super::parameters::{ParameterReader, unknown_setting};
use crate::description::Entity;
use crate::renderer::Renderer;

/// The greatest depth: each level of `trace` takes a level of the host's stack.
const MAX_DEPTH: f64 = 64.0;

impl Settings {
    pub(super) fn read_integrator(&mut self, entity: &Entity, diagnostics: &mut Diagnostics) {
        const KNOWN: [&str; 15] = [
            "interactive",
            "whitted",
            "batch",
            "path",
            "volpath",
            "simplepath",
            "direct",
            "directlighting",
            "randomwalk",
            "bdpt",
            "ambientocclusion",
            "lightpath",
            "mlt",
            "sppm",
            "function",
        ];
        // Indirect light requires the path renderer.
        self.renderer = Some(match entity.class.as_str() {
            "interactive" | "whitted" | "direct" | "directlighting" | "ambientocclusion" => {
                Renderer::Interactive
            }
            _ => Renderer::Batch,
        });
        let mut reader = ParameterReader::new(entity, diagnostics);
        if let Some(depth) = reader.whole("maxdepth", 0.0, MAX_DEPTH) {
            self.max_depth = depth as u32;
        }
        if let Some(cutoff) = reader.number_between("cutoff", 0.0, 1.0) {
            self.cutoff = cutoff as f32;
        }
        if let Some(threshold) = reader.number_between("rrthreshold", 0.0, 1.0) {
            self.roulette_threshold = threshold as f32;
        }
        if let Some(epsilon) = reader.number("epsilon") {
            self.epsilon = Some(epsilon as f32);
        }
        if let Some(budget) = reader.whole("budget", 1.0, f64::from(u32::MAX)) {
            self.loop_budget = budget as u32;
        }
        reader.ignore(&["regularize", "lightsampler", "samplelights", "samplebsdf"]);
        reader.finish();
        if !KNOWN.contains(&entity.class.as_str()) {
            diagnostics.push(unknown_setting(entity, &KNOWN));
        }
    }
}
