//! The materials of area lights, each of which may depend on the shape that it is on.

use std::f64::consts::PI;
use std::sync::Arc;

use rtsl::{Instance, Value};
use rtsl_math::Transform;

use super::{EntityId, Loader, SceneParts};
use crate::area::face_area;
use crate::pbrt::given_power;

/// The parameter of the class that scales the radiance to the power.
const GAIN: &str = "gain";

impl Loader<'_, '_> {
    /// Returns the index of the material of an area light on a shape among those of the scene. Lights with a power have
    /// a material for each shape.
    pub(super) fn emitter(
        &mut self,
        light: EntityId,
        shape: Option<&Instance>,
        to_world: Transform,
        parts: &mut SceneParts,
    ) -> Option<u32> {
        let description = self.description;
        let entity = &description.entities[light.0];
        let shared = self.material(Some(light), parts)?;
        let power = self.pbrt_name(entity).and_then(|_| given_power(entity));
        let (Some(power), Some(shape)) = (power, shape) else { return Some(shared) };
        let Some(area) = face_area(shape, to_world) else {
            let message = format!(
                "`power` of area light `{}` has no effect: the area of `{}` is not known",
                entity.class,
                shape.class().name
            );
            self.say_once(message, entity.class_span);
            return Some(shared);
        };
        let gain = (power / (PI * area * self.images.mean_glow(entity, self.files))) as f32;
        if !gain.is_finite() {
            return Some(shared);
        }
        let class = self.class(entity)?;
        let mut arguments = self.arguments(entity, &class)?;
        arguments.values.push((GAIN.to_owned(), Value::Float(gain)));
        let given = arguments.values.iter().map(|(name, value)| (name.as_str(), value.clone()));
        let material: Arc<Instance> = match Instance::new(&class, given) {
            Ok(material) => material,
            Err(problems) => {
                self.diagnostics.extend(problems.into_vec());
                return None;
            }
        };
        parts.materials.push(material);
        parts.material_origins.push(Some(light));
        Some(parts.materials.len() as u32 - 1)
    }
}
