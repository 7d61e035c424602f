//! Materials with holes: the alpha of shapes by the `presence` of their materials.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    CallArguments, CallMode, Class, Engine, Instance, Instances, Method, Role, Value, lookup_state,
    new_state,
};

use crate::scene::{Scene, SceneObject};

/// The class of alpha textures of shapes whose material has holes.
pub const PRESENCE_CLASS: &str = "Presence";
/// Its text.
pub const PRESENCE_TEXT: &str = "
class Presence : rt_Texture;
public rt_Material material;
public rt_Texture alpha;
void lookup() {
    float part = material.presence();
    if (isSet(alpha)) part *= alpha.lookupFloat();
    rt_FloatTextureValue = part;
}";

/// The alpha textures of materials, made once for each alpha of shapes.
#[derive(Clone, Debug, Default)]
pub struct Presences {
    /// By the addresses of the material and of the alpha texture, 0 for none.
    made: BTreeMap<[usize; 2], Made>,
    /// The interpreter, which links each class once, however many materials there are.
    engine: Option<Engine>,
}

#[derive(Clone, Debug)]
struct Made {
    presence: Option<Arc<Instance>>,
    /// Instances that live have addresses of their own.
    _of: (Arc<Instance>, Option<Arc<Instance>>),
}

impl Presences {
    /// True if materials of a scene may have holes.
    pub fn are_in(scene: &Scene) -> bool {
        scene.materials.iter().any(|it| has_presence(it))
    }

    /// Gives shapes the alpha that their materials have. Materials that are shapes themselves have none. `class` is that
    /// of [`PRESENCE_TEXT`].
    pub fn add_to(&mut self, scene: &mut Scene, class: &Arc<Class>) {
        self.retain(&scene.materials);
        let is_shape =
            |object: &SceneObject| object.primitive.class().roles.contains(&Role::Material);
        for object in scene.objects.iter_mut().filter(|object| !is_shape(object)) {
            let material = &scene.materials[object.material as usize];
            if has_presence(material) {
                object.alpha = self.alpha_of(class, material, object.alpha.as_ref());
            }
        }
    }

    /// Returns the alpha of shapes that have this material and this alpha of their own; `None` if all of them is there.
    fn alpha_of(
        &mut self,
        class: &Arc<Class>,
        material: &Arc<Instance>,
        alpha: Option<&Arc<Instance>>,
    ) -> Option<Arc<Instance>> {
        let address = |instance: &Arc<Instance>| Arc::as_ptr(instance).addr();
        let key = [address(material), alpha.map_or(0, address)];
        let engine = &mut self.engine;
        let made = self.made.entry(key).or_insert_with(|| Made {
            presence: presence_of(engine, class, material, alpha),
            _of: (material.clone(), alpha.cloned()),
        });
        made.presence.clone()
    }

    /// Forgets the materials that are not among these.
    fn retain(&mut self, materials: &[Arc<Instance>]) {
        let there: BTreeSet<usize> = materials.iter().map(|it| Arc::as_ptr(it).addr()).collect();
        self.made.retain(|[material, _], _| there.contains(material));
    }
}

fn has_presence(material: &Instance) -> bool {
    material.class().methods.contains_key(&Method::Presence)
}

fn presence_of(
    engine: &mut Option<Engine>,
    class: &Arc<Class>,
    material: &Arc<Instance>,
    alpha: Option<&Arc<Instance>>,
) -> Option<Arc<Instance>> {
    let alpha = alpha.map(|alpha| ("alpha", Value::from(alpha.clone())));
    let arguments = [("material", Value::from(material.clone()))].into_iter().chain(alpha);
    // A material that cannot be linked is in error where it is used.
    let presence = Instance::new(class, arguments).ok()?;
    let is_whole = constant_value(engine, &presence).is_some_and(|value| value >= 1.0);
    (!is_whole).then_some(presence)
}

/// Returns the value of a texture if it is the same for all hits. Most materials have no holes, and shapes without
/// alpha are searched faster.
fn constant_value(engine: &mut Option<Engine>, texture: &Arc<Instance>) -> Option<f32> {
    let program = engine.get_or_insert_with(Engine::interpreter).program(texture);
    let linked = program.method(Method::Lookup).ok()?;
    if !linked.reads.is_empty() || linked.reads_scratch || linked.draws_numbers() {
        return None;
    }
    let kernel = program.kernel(Method::Lookup, CallMode::Packet).ok()?;
    let mut state = new_state(1);
    let status = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut program.new_scratch(1),
        count: 1,
        mask: None,
        accepted: None,
        instances: Instances::One(&program.block(texture)),
        host: &mut NoHost,
    });
    let value = lookup_state("rt_FloatTextureValue")?.first_component;
    (!status.budget_exhausted).then(|| state.floats(value as usize)[0])
}
