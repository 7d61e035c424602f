//! Materials: the layers of classes that give a material of glTF its look.

use gltf::json::material::{AlphaMode, Material};
use gltf::json::validation::Checked;
use rtsl_math::Transform;

use super::builder::{Builder, Parameters};
use super::extension::{Extension, extension};
use super::outline::Kind;
use super::surface::Wanted;
use super::textures::{Sample, TextureUse};
use crate::description::{EntityId, EntityKind};
use crate::reader::ReferenceKind;

/// A material, and the attributes of vertices that it is used with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct FinishKey {
    /// The material; `None` for the default one.
    pub material: Option<usize>,
    /// True if vertices have colours.
    pub has_colors: bool,
}

/// The entities of a material.
#[derive(Clone, Debug)]
pub struct Finish {
    pub material: EntityId,
    /// Its emission, if it glows.
    pub glow: Option<EntityId>,
    pub alpha: Alpha,
    pub wanted: Wanted,
    /// True if it has textures.
    pub is_textured: bool,
}

/// The opacity of a shape.
#[derive(Clone, Debug)]
pub enum Alpha {
    Opaque,
    Number(f64),
    Texture(String),
}

/// A parameter of a layer that may have a texture.
struct Input {
    name: &'static str,
    kind: InputKind,
    texture: Option<TextureUse>,
}

enum InputKind {
    /// Scaled linear colours.
    Color([f64; 3]),
    /// A factor of a channel, and what is added.
    Number { factor: f64, channel: u32, base: f64 },
    /// The values of a map, which has no effect without texture.
    Map,
}

/// The layers of a material, read but not yet made.
struct Layers {
    base: Vec<Input>,
    base_numbers: Vec<(&'static str, Vec<f64>)>,
    is_thin: bool,
    sheen: Option<Vec<Input>>,
    normal: Option<(TextureUse, f64)>,
    coat: Option<(Vec<Input>, f64)>,
    emission: Option<([f64; 3], Option<TextureUse>)>,
    is_unlit: bool,
    color: ([f64; 4], Option<TextureUse>),
    needs_tangents: bool,
}

impl Builder<'_> {
    /// Makes the entities of a material at its first use.
    pub fn finish(&mut self, key: FinishKey) -> Finish {
        if let Some(finish) = self.finishes.get(&key) {
            return finish.clone();
        }
        let finish = self.new_finish(key);
        self.finishes.insert(key, finish.clone());
        finish
    }

    fn new_finish(&mut self, key: FinishKey) -> Finish {
        let index = key.material.filter(|it| *it < self.file.root.materials.len());
        let material = match index {
            Some(index) => self.file.root.materials[index].clone(),
            None => Material::default(),
        };
        let mut layers = Layers::read(&material);
        let place = index.unwrap_or(usize::MAX);
        let dropped = layers.limit();
        if !dropped.is_empty() {
            let message = format!(
                "a material has too many layers and textures: it is without those of `{}`",
                dropped.join("`, `")
            );
            self.warn(message, self.outline.span(Kind::Material, place));
        }
        self.warn_of_unsupported(&material, place);
        let sets = self.sets(&layers, place);
        let wanted = Wanted { sets, tangents: layers.needs_tangents };
        let name = match (&material.name, index) {
            (Some(name), _) if !name.is_empty() => name.clone(),
            (_, Some(index)) => format!("material {index}"),
            (_, None) => "default material".to_owned(),
        };
        let colors = match (key.has_colors, sets[1]) {
            (false, _) => 0,
            (true, None) => 1,
            (true, Some(_)) => 2,
        };
        let mut layering = Layering { builder: self, place, name, sets, colors };
        let alpha = layering.alpha(&material, &layers);
        let glow = layering.glow(&layers, material.double_sided);
        let material = layering.material(layers);
        let is_textured = sets[0].is_some();
        Finish { material, glow, alpha, wanted, is_textured }
    }

    /// The sets of coordinates that textures use, that of the normals first: tangents follow it.
    fn sets(&mut self, layers: &Layers, place: usize) -> [Option<u32>; 2] {
        let mut sets = [None; 2];
        let mut dropped = None;
        for set in layers.textures().map(|use_| use_.set) {
            if sets.contains(&Some(set)) {
                continue;
            }
            match sets.iter_mut().find(|slot| slot.is_none()) {
                Some(slot) => *slot = Some(set),
                None => dropped = Some(set),
            }
        }
        if let Some(set) = dropped {
            let span = self.outline.span(Kind::Material, place);
            let message = format!(
                "a material with three sets of texture coordinates: textures of set {set} use the first instead"
            );
            self.warn(message, span);
        }
        sets
    }

    fn warn_of_unsupported(&mut self, material: &Material, place: usize) {
        let span = self.outline.span(Kind::Material, place);
        let Some(extensions) = &material.extensions else { return };
        let unknown: Vec<String> = extensions
            .others
            .keys()
            .filter(|name| !SUPPORTED.contains(&name.as_str()))
            .cloned()
            .collect();
        for name in unknown {
            self.warn(format!("`{name}` is not supported: materials are as without it"), span);
        }
    }
}

/// Operations of a texture's lookup, of `GltfPbr` and of its thin film, and how many of the 65,536 that a kernel may
/// have are planned with. The numbers are estimates: with them, the kernels of a material with every layer and texture
/// stay below the limit.
const OF_LOOKUP: usize = 3_600;
const OF_BASE: usize = 5_000;
const OF_FILM: usize = 12_000;
const MAX_OPERATIONS: usize = 60_000;

/// The parameter of the film, with which the names of its others begin.
const FILM: &str = "iridescence";

/// The parameters whose textures are left out first.
const LESSER: [&str; 14] = [
    "iridescenceThickness",
    "iridescence",
    "specular",
    "anisotropyMap",
    "diffuseTransmissionColor",
    "specularColor",
    "diffuseTransmission",
    "normals",
    "roughness",
    "coat",
    "sheen",
    "transmission",
    "metallicRoughness",
    "metallic",
];

/// The extensions of materials that are read.
pub const SUPPORTED: [&str; 13] = [
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
];

impl Layers {
    fn read(material: &Material) -> Self {
        let pbr = &material.pbr_metallic_roughness;
        let color = (
            pbr.base_color_factor.0.map(f64::from),
            pbr.base_color_texture.as_ref().map(TextureUse::of),
        );
        let mut layers = Layers {
            base: Vec::new(),
            base_numbers: Vec::new(),
            is_thin: true,
            sheen: None,
            normal: None,
            coat: None,
            emission: emission(material),
            is_unlit: extension!(material, "KHR_materials_unlit").is_some(),
            color,
            needs_tangents: false,
        };
        if layers.is_unlit {
            layers.emission = None;
            return layers;
        }
        if let Some(normal) = &material.normal_texture {
            let transform = extension!(normal, "KHR_texture_transform");
            let use_ = TextureUse::new(normal.index.value(), normal.tex_coord, transform);
            layers.normal = Some((use_, normal.scale.into()));
            layers.needs_tangents = true;
        }
        match extension!(material, "KHR_materials_pbrSpecularGlossiness") {
            Some(glossy) => layers.read_glossy(glossy),
            None => {
                let map = pbr.metallic_roughness_texture.as_ref().map(TextureUse::of);
                layers.number("metallic", pbr.metallic_factor.0.into(), None, 0);
                layers.number("roughness", pbr.roughness_factor.0.into(), None, 0);
                let kind = InputKind::Map;
                layers.base.push(Input { name: "metallicRoughness", kind, texture: map });
                layers.read_dielectric(material);
            }
        }
        layers.read_transmission(material);
        layers.read_fine_structure(material);
        layers.read_covers(material);
        layers
    }

    /// Specular and glossy: a dielectric of infinite index, all of whose reflection is coloured.
    fn read_glossy(&mut self, glossy: Extension<'_>) {
        let factor = glossy.numbers("diffuseFactor").unwrap_or([1.0; 4]);
        self.color = (factor, TextureUse::member(glossy, "diffuseTexture"));
        let map = TextureUse::member(glossy, "specularGlossinessTexture");
        self.number("metallic", 0.0, None, 0);
        self.base_numbers.push(("ior", vec![0.0]));
        let specular = glossy.numbers("specularFactor").unwrap_or([1.0; 3]);
        let kind = InputKind::Color(specular);
        self.base.push(Input { name: "specularColor", kind, texture: map });
        let gloss = glossy.number("glossinessFactor", 1.0);
        let kind = InputKind::Number { factor: -gloss, channel: 3, base: 1.0 };
        self.base.push(Input { name: "roughness", kind, texture: map });
    }

    fn read_dielectric(&mut self, material: &Material) {
        if let Some(ior) = extension!(material, "KHR_materials_ior") {
            self.base_numbers.push(("ior", vec![ior.number("ior", 1.5).max(0.0)]));
        }
        if let Some(specular) = extension!(material, "KHR_materials_specular") {
            let map = TextureUse::member(specular, "specularTexture");
            self.number("specular", specular.number("specularFactor", 1.0), map, 3);
            let factor = specular.numbers("specularColorFactor").unwrap_or([1.0; 3]);
            let texture = TextureUse::member(specular, "specularColorTexture");
            let kind = InputKind::Color(factor);
            self.base.push(Input { name: "specularColor", kind, texture });
        }
    }

    fn read_transmission(&mut self, material: &Material) {
        if let Some(clear) = extension!(material, "KHR_materials_transmission") {
            let map = TextureUse::member(clear, "transmissionTexture");
            self.number("transmission", clear.number("transmissionFactor", 0.0), map, 0);
        }
        let volume = extension!(material, "KHR_materials_volume");
        if let Some(volume) = volume.filter(|it| it.number("thicknessFactor", 0.0) > 0.0) {
            self.is_thin = false;
            let color = volume.numbers::<3>("attenuationColor").unwrap_or([1.0; 3]);
            let distance = volume.number("attenuationDistance", 0.0).max(0.0);
            if color != [1.0; 3] && distance > 0.0 {
                self.base_numbers.push(("attenuationColor", color.to_vec()));
                self.base_numbers.push(("attenuationDistance", vec![distance]));
            }
        }
        if let Some(diffuse) = extension!(material, "KHR_materials_diffuse_transmission") {
            let map = TextureUse::member(diffuse, "diffuseTransmissionTexture");
            let factor = diffuse.number("diffuseTransmissionFactor", 0.0);
            self.number("diffuseTransmission", factor, map, 3);
            let factor = diffuse.numbers("diffuseTransmissionColorFactor").unwrap_or([1.0; 3]);
            let texture = TextureUse::member(diffuse, "diffuseTransmissionColorTexture");
            let kind = InputKind::Color(factor);
            self.base.push(Input { name: "diffuseTransmissionColor", kind, texture });
        }
    }

    fn read_fine_structure(&mut self, material: &Material) {
        let anisotropic = extension!(material, "KHR_materials_anisotropy");
        if let Some(it) = anisotropic.filter(|it| it.number("anisotropyStrength", 0.0) > 0.0) {
            let strength = it.number("anisotropyStrength", 0.0).min(1.0);
            self.base_numbers.push(("anisotropy", vec![strength]));
            self.base_numbers
                .push(("anisotropyRotation", vec![it.number("anisotropyRotation", 0.0)]));
            let texture = TextureUse::member(it, "anisotropyTexture");
            self.base.push(Input { name: "anisotropyMap", kind: InputKind::Map, texture });
            self.needs_tangents = true;
        }
        let iridescent = extension!(material, "KHR_materials_iridescence");
        if let Some(it) = iridescent.filter(|it| it.number("iridescenceFactor", 0.0) > 0.0) {
            let map = TextureUse::member(it, "iridescenceTexture");
            self.number("iridescence", it.number("iridescenceFactor", 0.0), map, 0);
            self.base_numbers
                .push(("iridescenceIor", vec![it.number("iridescenceIor", 1.3).clamp(1.0, 4.0)]));
            let least = it.number("iridescenceThicknessMinimum", 100.0);
            let most = it.number("iridescenceThicknessMaximum", 400.0);
            match TextureUse::member(it, "iridescenceThicknessTexture") {
                Some(texture) => {
                    let kind = InputKind::Number { factor: most - least, channel: 1, base: least };
                    let texture = Some(texture);
                    self.base.push(Input { name: "iridescenceThickness", kind, texture });
                }
                None => self.number("iridescenceThickness", most, None, 1),
            }
        }
    }

    fn read_covers(&mut self, material: &Material) {
        if let Some(sheen) = extension!(material, "KHR_materials_sheen") {
            let color = sheen.numbers("sheenColorFactor").unwrap_or([0.0; 3]);
            if color != [0.0; 3] {
                let texture = TextureUse::member(sheen, "sheenColorTexture");
                let map = TextureUse::member(sheen, "sheenRoughnessTexture");
                let factor = sheen.number("sheenRoughnessFactor", 0.0);
                self.sheen = Some(vec![
                    Input { name: "sheen", kind: InputKind::Color(color), texture },
                    number_input("roughness", factor, map, 3),
                ]);
            }
        }
        let coat = extension!(material, "KHR_materials_clearcoat");
        if let Some(coat) = coat.filter(|it| it.number("clearcoatFactor", 0.0) > 0.0) {
            let map = TextureUse::member(coat, "clearcoatTexture");
            let rough = TextureUse::member(coat, "clearcoatRoughnessTexture");
            let normals = TextureUse::member(coat, "clearcoatNormalTexture");
            let scale =
                coat.object("clearcoatNormalTexture").map_or(1.0, |it| it.number("scale", 1.0));
            self.needs_tangents |= normals.is_some();
            let inputs = vec![
                number_input("coat", coat.number("clearcoatFactor", 0.0), map, 0),
                number_input("roughness", coat.number("clearcoatRoughnessFactor", 0.0), rough, 1),
                Input { name: "normals", kind: InputKind::Map, texture: normals },
            ];
            self.coat = Some((inputs, scale));
        }
    }

    fn number(
        &mut self,
        name: &'static str,
        factor: f64,
        texture: Option<TextureUse>,
        channel: u32,
    ) {
        self.base.push(number_input(name, factor, texture, channel));
    }

    /// An estimate of the operations of the greatest method: a cover that takes a sample also evaluates its base and
    /// the density of its base.
    fn operations(&self) -> usize {
        let count = |inputs: &[Input]| inputs.iter().filter(|it| it.texture.is_some()).count();
        let base = count(&self.base) + usize::from(self.color.1.is_some());
        let sheen = self.sheen.as_deref().map(count);
        let coat = self.coat.as_ref().map(|(inputs, _)| count(inputs));
        let times = match (sheen, coat) {
            (None, None) => 1,
            (Some(_), None) | (None, Some(_)) => 3,
            (Some(_), Some(_)) => 5,
        };
        let of_sheen = sheen.map_or(0, |count| if coat.is_some() { 3 * count } else { count });
        let of_normal = usize::from(self.normal.is_some()) * if coat.is_some() { 3 } else { 1 };
        let lookups = times * base + of_sheen + of_normal + coat.unwrap_or(0);
        let of_film = if self.has_film() { OF_FILM } else { 0 };
        times * (OF_BASE + of_film) + lookups * OF_LOOKUP
    }

    fn has_film(&self) -> bool {
        self.base.iter().any(|it| it.name == FILM)
    }

    /// Leaves out what matters least until the methods fit the limits of kernels: a film under a cover, then textures.
    /// Returns their parameters.
    fn limit(&mut self) -> Vec<&'static str> {
        let mut dropped = Vec::new();
        let has_cover = self.sheen.is_some() || self.coat.is_some();
        if has_cover && self.has_film() && self.operations() > MAX_OPERATIONS {
            self.base.retain(|it| !it.name.starts_with(FILM));
            dropped.push(FILM);
        }
        for name in LESSER {
            if self.operations() <= MAX_OPERATIONS {
                break;
            }
            let sheen = self.sheen.iter_mut().flatten();
            let coat = self.coat.iter_mut().flat_map(|(inputs, _)| inputs);
            let inputs = self.base.iter_mut().chain(sheen).chain(coat);
            for input in inputs.filter(|it| it.name == name && it.texture.is_some()) {
                input.texture = None;
                dropped.push(name);
            }
        }
        dropped
    }

    /// All textures, that of the normals first.
    fn textures(&self) -> impl Iterator<Item = TextureUse> {
        let normal = self.normal.iter().map(|(use_, _)| *use_);
        let inputs = self
            .base
            .iter()
            .chain(self.sheen.iter().flatten())
            .chain(self.coat.iter().flat_map(|(inputs, _)| inputs));
        let emission = self.emission.iter().filter_map(|(_, use_)| *use_);
        normal.chain(self.color.1).chain(inputs.filter_map(|it| it.texture)).chain(emission)
    }
}

fn number_input(
    name: &'static str,
    factor: f64,
    texture: Option<TextureUse>,
    channel: u32,
) -> Input {
    Input { name, kind: InputKind::Number { factor, channel, base: 0.0 }, texture }
}

/// The radiance that a material gives off, and its texture; `None` if it is black.
fn emission(material: &Material) -> Option<([f64; 3], Option<TextureUse>)> {
    let strength = extension!(material, "KHR_materials_emissive_strength")
        .map_or(1.0, |it| it.number("emissiveStrength", 1.0));
    let factor = material.emissive_factor.0.map(|part| f64::from(part) * strength);
    let texture = material.emissive_texture.as_ref().map(TextureUse::of);
    factor.iter().any(|part| *part > 0.0).then_some((factor, texture))
}

/// Makes the entities of a material's layers.
struct Layering<'b, 'a> {
    builder: &'b mut Builder<'a>,
    /// The index of the material.
    place: usize,
    name: String,
    sets: [Option<u32>; 2],
    /// The packing of vertices' colours; 0 for none.
    colors: u32,
}

impl Layering<'_, '_> {
    fn parameters(&self) -> Parameters {
        self.builder.parameters(Kind::Material, self.place)
    }

    /// The entity of a texture; `None` if only the factor counts.
    fn texture(&mut self, use_: Option<TextureUse>, sample: Sample, what: &str) -> Option<String> {
        let place = |use_: &TextureUse| usize::from(self.sets[1] == Some(use_.set));
        let use_ = use_.map(|use_| (use_, place(&use_)));
        let name = format!("{} {what}", self.name);
        let parameters = self.parameters();
        self.builder.texture(use_, sample, parameters, &name)
    }

    fn input(&mut self, parameters: Parameters, input: &Input) -> Parameters {
        let (sample, constant) = match input.kind {
            InputKind::Color([red, green, blue]) => {
                let factor = [red, green, blue, 1.0];
                (
                    Sample { is_color: true, factor, channel: 0, ..Sample::PLAIN },
                    vec![red, green, blue],
                )
            }
            InputKind::Number { factor, channel, base } => {
                let sample = Sample { factor: [factor; 4], channel, base, ..Sample::PLAIN };
                (sample, vec![base + factor])
            }
            InputKind::Map => (Sample { channel: 0, ..Sample::PLAIN }, Vec::new()),
        };
        let texture = if input.texture.is_some() {
            self.texture(input.texture, sample, input.name)
        } else {
            None
        };
        match texture {
            Some(texture) => parameters.reference(ReferenceKind::Texture, input.name, &texture),
            None if constant.is_empty() => parameters,
            None => parameters.numbers(input.name, &constant),
        }
    }

    /// The base colour, which the colours of vertices scale.
    fn color(&mut self, layers: &Layers, parameters: Parameters, name: &str) -> Parameters {
        let (factor, texture) = layers.color;
        let colors = self.colors;
        let sample = Sample { is_color: true, factor, channel: 0, colors, ..Sample::PLAIN };
        match self.texture(texture, sample, "baseColor") {
            Some(texture) => parameters.reference(ReferenceKind::Texture, name, &texture),
            None if layers.is_unlit => parameters.numbers("radiance", &factor[..3]),
            None => parameters.numbers(name, &factor[..3]),
        }
    }

    fn material(&mut self, layers: Layers) -> EntityId {
        let name = self.name.clone();
        if layers.is_unlit {
            let parameters = self.parameters().boolean("twoSided", true);
            let parameters = self.color(&layers, parameters, "image");
            return self.layer("Emissive", &name, parameters);
        }
        let parameters = self.parameters();
        let mut parameters = self.color(&layers, parameters, "baseColor");
        for input in &layers.base {
            parameters = self.input(parameters, input);
        }
        for (name, values) in &layers.base_numbers {
            parameters = parameters.numbers(name, values);
        }
        if !layers.is_thin {
            parameters = parameters.boolean("thin", false);
        }
        let mut top = self.layer("GltfPbr", &name, parameters);
        if let Some(sheen) = &layers.sheen {
            let mut parameters = self.over(top);
            for input in sheen {
                parameters = self.input(parameters, input);
            }
            top = self.layer("GltfSheen", &format!("{name} sheen"), parameters);
        }
        if let Some((use_, scale)) = layers.normal
            && let Some(texture) =
                self.texture(Some(use_), Sample { channel: 0, ..Sample::PLAIN }, "normals")
        {
            let parameters = self
                .over(top)
                .reference(ReferenceKind::Texture, "normals", &texture)
                .numbers("scale", &[scale])
                .boolean("alongV", true);
            top = self.layer("NormalMap", &format!("{name} normals"), parameters);
        }
        if let Some((coat, scale)) = &layers.coat {
            let mut parameters = self.over(top).numbers("scale", &[*scale]);
            for input in coat {
                parameters = self.input(parameters, input);
            }
            top = self.layer("GltfCoat", &format!("{name} coat"), parameters);
        }
        top
    }

    /// The parameters of a layer over a material.
    fn over(&self, base: EntityId) -> Parameters {
        let name = self.builder.name_of(base);
        self.parameters().reference(ReferenceKind::Material, "base", &name)
    }

    fn layer(&mut self, class: &str, name: &str, parameters: Parameters) -> EntityId {
        let transform = Transform::IDENTITY;
        self.builder.add(EntityKind::Material, class, Some(name), parameters, transform)
    }

    /// The emission of shapes with the material.
    fn glow(&mut self, layers: &Layers, is_two_sided: bool) -> Option<EntityId> {
        let (radiance, texture) = layers.emission?;
        self.builder.has_lamps |= radiance.iter().any(|part| *part > 1.0);
        let [red, green, blue] = radiance;
        let factor = [red, green, blue, 1.0];
        let sample = Sample { is_color: true, factor, channel: 0, ..Sample::PLAIN };
        let image =
            if texture.is_some() { self.texture(texture, sample, "emission") } else { None };
        let parameters = self.parameters().boolean("twoSided", is_two_sided);
        let parameters = match image {
            Some(image) => parameters.reference(ReferenceKind::Texture, "image", &image),
            None => parameters.numbers("radiance", &radiance),
        };
        let name = format!("{} light", self.name);
        let transform = Transform::IDENTITY;
        Some(self.builder.add(
            EntityKind::AreaLight,
            "Emissive",
            Some(&name),
            parameters,
            transform,
        ))
    }

    fn alpha(&mut self, material: &Material, layers: &Layers) -> Alpha {
        let cutoff = match material.alpha_mode {
            Checked::Valid(AlphaMode::Opaque) | Checked::Invalid => return Alpha::Opaque,
            Checked::Valid(AlphaMode::Mask) => {
                Some(material.alpha_cutoff.map_or(0.5, |cutoff| f64::from(cutoff.0)))
            }
            Checked::Valid(AlphaMode::Blend) => None,
        };
        let (factor, texture) = layers.color;
        let colors = self.colors;
        // Images have opacity without the encoding of their colours.
        let sample = Sample { factor, cutoff, colors, ..Sample::PLAIN };
        match self.texture(texture, sample, "alpha") {
            Some(texture) => Alpha::Texture(texture),
            None => Alpha::Number(match cutoff {
                Some(cutoff) if factor[3] < cutoff => 0.0,
                Some(_) => 1.0,
                None => factor[3].clamp(0.0, 1.0),
            }),
        }
    }
}
