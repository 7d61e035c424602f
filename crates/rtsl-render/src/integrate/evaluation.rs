//! Evaluation of an integrator for given rays, outside of a render.

use std::sync::Arc;

use rtsl::{CallArguments, CallStatus, Engine, Instance, Instances, LaneBlock, Messages};
use rtsl_math::sampling::hash;
use rtsl_scene::Scene;

use super::following::follow;
use super::host::{RayOfCall, SceneHost};
use super::integrator_memory::IntegratorMemory;
use super::path_tracer::PathTracer;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::variables::variables;

/// A scene in which an integrator is evaluated for given rays.
pub struct Evaluation {
    scene: RenderScene,
}

impl Evaluation {
    /// Prepares a scene for an integrator, which takes the place of the scene's own. Warnings go to `messages`.
    ///
    /// # Errors
    /// As for [`RenderScene::new`].
    pub fn new(
        scene: &Scene,
        integrator: &Arc<Instance>,
        engine: &Engine,
        messages: &mut Messages,
    ) -> Result<Evaluation, Messages> {
        let scene = Scene { integrator: Some(integrator.clone()), ..scene.clone() };
        Ok(Evaluation { scene: RenderScene::new(&scene, engine, &[], messages, &|_| {})? })
    }

    /// Calls `radiance` for the first `count` lanes, on the interpreter. The colour includes contributions. Each lane has
    /// random numbers of its own, those of the first sample.
    ///
    /// # Panics
    /// If the blocks have fewer lanes.
    pub fn radiance(
        &self,
        state: &mut LaneBlock,
        scratch: &mut LaneBlock,
        count: usize,
    ) -> CallStatus {
        let integrator = &self.scene.integrator;
        let v = variables();
        let ray = |lane: usize| {
            let key = hash(lane as u32, 0);
            let time = state.floats(v.time_seed)[lane];
            RayOfCall::new(key, 0, time)
        };
        let mut rays: Vec<RayOfCall> = (0..count).map(ray).collect();
        let errors = RuntimeErrors::default();
        let groups = self.scene.full_groups();
        let tracer = PathTracer { groups, ..PathTracer::new(&self.scene, &errors) };
        let mut memory = IntegratorMemory::new(&self.scene);
        let mut host = SceneHost {
            tracer,
            rays: &mut rays,
            slots: None,
            queries: &mut memory.queries,
            free: &Default::default(),
            depth: 0,
            notes_suspects: false,
            is_of_stages: false,
        };
        let (mask, accepted) = (None, None);
        let instances = Instances::One(&integrator.block);
        let host = &mut host;
        let status = integrator.kernel.call(CallArguments {
            state,
            scratch,
            count,
            mask,
            accepted,
            instances,
            host,
        });
        host.add_contributions();
        for (lane, ray) in rays.iter().enumerate() {
            for (channel, light) in ray.lit.iter().enumerate() {
                state.floats_mut(v.sample_color + channel)[lane] += light;
            }
        }
        follow(&tracer, &mut memory, count, &mut |lanes, radiance| {
            for (channel, column) in radiance.iter().enumerate() {
                let colors = state.floats_mut(v.sample_color + channel);
                let all = lanes.iter().zip(column);
                all.for_each(|(lane, light)| colors[*lane as usize] += light);
            }
        });
        status
    }
}
