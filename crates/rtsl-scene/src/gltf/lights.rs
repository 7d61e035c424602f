//! Lights of `KHR_lights_punctual`. A candela is a watt per steradian here and a lux a watt per square metre, so that a
//! lux on a white surface gives a radiance of 1 / pi, as in viewers of glTF.

use rtsl_math::Transform;

use super::builder::Builder;
use super::extension::{Extension, extension};
use super::hierarchy::Hierarchy;
use super::outline::Kind;
use crate::description::EntityKind;

pub const PUNCTUAL: &str = "KHR_lights_punctual";

/// Extensions with lights that are left out.
pub const OTHERS: [&str; 2] = ["EXT_lights_ies", "EXT_lights_image_based"];

impl Builder<'_> {
    /// Adds the lights of visible nodes.
    pub fn add_lights(&mut self, hierarchy: &Hierarchy) {
        for name in OTHERS {
            if self.file.root.extensions_used.iter().any(|it| it == name) {
                let message = format!("`{name}` is not supported: its lights are left out");
                self.warn(message, self.outline.whole());
            }
        }
        let root = self.file.root.extensions.clone();
        let Some(punctual) = root.as_ref().and_then(|it| it.others.get(PUNCTUAL)) else { return };
        let lights: Vec<Extension<'_>> = Extension(punctual).list("lights").collect();
        for node_index in &hierarchy.visible {
            let node = &self.file.root.nodes[*node_index];
            let Some(light) = extension!(node, PUNCTUAL).and_then(|it| it.index("light")) else {
                continue;
            };
            let node_name = node.name.clone();
            match lights.get(light) {
                Some(definition) => {
                    let placement = Placement::of(hierarchy.world(*node_index));
                    self.add_light(*definition, light, node_name.as_deref(), placement);
                }
                None => {
                    let message = format!("light {light} does not exist: it is left out");
                    self.warn(message, self.outline.span(Kind::Node, *node_index));
                }
            }
        }
    }

    fn add_light(
        &mut self,
        light: Extension<'_>,
        index: usize,
        node: Option<&str>,
        Placement { position, direction }: Placement,
    ) {
        let color = light.numbers("color").unwrap_or([1.0; 3]);
        let strength = light.number("intensity", 1.0).max(0.0);
        let parameters = self.parameters(Kind::Light, index).numbers("strength", &[strength]);
        let (class, parameters) = match light.text("type") {
            Some("directional") => {
                let parameters = parameters.numbers("direction", &direction);
                ("DirectionalLight", parameters.numbers("irradiance", &color))
            }
            Some("spot") => {
                let cone = light.object("spot");
                let angle = |name: &str, default: f64| {
                    cone.map_or(default, |it| it.number(name, default))
                        .clamp(0.0, std::f64::consts::PI)
                };
                let outer = angle("outerConeAngle", std::f64::consts::FRAC_PI_4);
                let inner = angle("innerConeAngle", 0.0).min(outer);
                let target =
                    std::array::from_fn::<f64, 3, _>(|axis| position[axis] + direction[axis]);
                let parameters = parameters
                    .numbers("position", &position)
                    .numbers("target", &target)
                    .numbers("coneAngle", &[outer.to_degrees()])
                    .numbers("softness", &[(outer - inner).to_degrees()]);
                ("SpotLight", parameters.numbers("intensity", &color))
            }
            Some("point") => {
                let parameters = parameters.numbers("position", &position);
                ("PointLight", parameters.numbers("intensity", &color))
            }
            _ => {
                let message = format!("light {index} is of no known type: it is left out");
                self.warn(message, self.outline.span(Kind::Light, index));
                return;
            }
        };
        let name = light.text("name").filter(|it| !it.is_empty()).or(node);
        let name = name.map_or_else(|| format!("light {index}"), str::to_owned);
        let transform = Transform::IDENTITY;
        let id = self.add(EntityKind::Light, class, Some(&name), parameters, transform);
        self.description.lights.push(id);
    }
}

/// The place of a light, whose size does not count.
struct Placement {
    position: [f64; 3],
    /// A unit vector.
    direction: [f64; 3],
}

impl Placement {
    fn of(world: Transform) -> Self {
        let position = world.point([0.0; 3]);
        let ahead = world.point([0.0, 0.0, -1.0]);
        let way: [f64; 3] = std::array::from_fn(|axis| ahead[axis] - position[axis]);
        let length = way.iter().map(|part| part * part).sum::<f64>().sqrt();
        let direction = if length > 0.0 { way.map(|part| part / length) } else { [0.0, 0.0, -1.0] };
        Placement { position, direction }
    }
}
