//! Materials: the nearest of those that pbrt-v4 has.

use super::Exporter;
use super::text::Parameters;
use super::textures::{Exported, Taken};
use super::values::{Input, boolean, numbers};
use crate::description::{Entity, EntityId};

/// A material of pbrt-v4, and what shapes with it need besides.
#[derive(Clone, Debug, Default)]
pub struct Finish {
    /// The name of the material.
    pub name: String,
    /// The medium in it.
    pub medium: Option<String>,
    /// The material whose colour is a radiance.
    pub unlit: Option<EntityId>,
}

/// The layers of a material.
struct Layers<'d> {
    base: &'d Entity,
    coat: Option<&'d Entity>,
    normals: Option<&'d Entity>,
    has_sheen: bool,
}

/// The widths of highlights.
#[derive(Clone)]
enum Widths {
    Constant([f64; 2]),
    Texture(String),
}

/// Highlights of this width are not seen as such, and layers with wider ones lose light in pbrt-v4.
const DULL_WIDTH: f64 = 0.5;

/// A coat with less is none.
const LEAST_COAT: f64 = 0.5;

/// The name of no material.
const NO_NAME: &str = "material";

impl<'d> Exporter<'d, '_> {
    /// Writes a material at its first use.
    pub fn finish_of(&mut self, material: EntityId) -> Finish {
        if let Some(finish) = self.finishes.get(&material) {
            return finish.clone();
        }
        let finish = self.new_finish(material);
        self.finishes.insert(material, finish.clone());
        finish
    }

    fn new_finish(&mut self, material: EntityId) -> Finish {
        let layers = self.layers(material);
        let title = layers.base.name.clone().unwrap_or_else(|| NO_NAME.to_owned());
        if layers.base.class == "Emissive" {
            let black = Parameters::default().text("type", "diffuse").rgb("reflectance", [0.0; 3]);
            let name = self.named_material(&title, black);
            return Finish { name, medium: None, unlit: Some(material) };
        }
        let normals = layers.normals.and_then(|layer| {
            let texture = self.names.referred(layer, "normals")?;
            self.normal_map(texture, layer.number("scale").unwrap_or(1.0))
        });
        self.say_what_is_lost(&layers, &title);
        let medium = self.medium(layers.base, &title);
        let name = self.pbr(&layers, &title, normals.as_deref());
        Finish { name, medium, unlit: None }
    }

    fn layers(&self, top: EntityId) -> Layers<'d> {
        let description = self.description;
        let mut layers = Layers {
            base: &description.entities[top.0],
            coat: None,
            normals: None,
            has_sheen: false,
        };
        while let Some(below) = self.names.referred(layers.base, "base") {
            match layers.base.class.as_str() {
                "GltfCoat" => layers.coat = Some(layers.base),
                "NormalMap" => layers.normals = Some(layers.base),
                _ => layers.has_sheen = true,
            }
            layers.base = &description.entities[below.0];
        }
        layers
    }

    fn say_what_is_lost(&mut self, layers: &Layers<'_>, title: &str) {
        let Layers { base, coat, has_sheen, .. } = layers;
        if *has_sheen {
            self.lose("sheen", title);
        }
        let is_tinted = self.names.color(base, "specularColor") != Input::Constant([1.0; 3])
            && base.class == "GltfPbr";
        let strength = self.names.number(base, "specular", 1.0);
        for (is_lost, what) in [
            (base.parameter("iridescence").is_some(), "iridescence"),
            (is_tinted, "the colour of specular reflection"),
            (
                ![0.0, 1.0].map(Input::Constant).contains(&strength),
                "the strength of specular reflection",
            ),
            (base.parameter("anisotropyMap").is_some(), "textures of anisotropy"),
        ] {
            if is_lost {
                self.lose(what, title);
            }
        }
        if coat.is_some_and(|coat| self.names.referred(coat, "normals").is_some()) {
            self.lose("normal maps of coats", title);
        }
    }

    /// Writes the medium of a volume that absorbs light.
    fn medium(&mut self, base: &Entity, title: &str) -> Option<String> {
        let distance = base.number("attenuationDistance").filter(|it| *it > 0.0)?;
        let color: [f64; 3] = numbers(base, "attenuationColor")?;
        let absorbed = color.map(|part| {
            let binary = rtsl_math::logarithm_of_two(part.clamp(1e-4, 1.0));
            -std::f64::consts::LN_2 * binary / distance
        });
        let name = self.unique(&format!("{title} medium"));
        let parameters = Parameters::default()
            .text("type", "homogeneous")
            .rgb("sigma_a", absorbed)
            .rgb("sigma_s", [0.0; 3]);
        self.text.directive("MakeNamedMedium", &[&name], parameters);
        Some(name)
    }

    /// Writes a material of the classes of glTF.
    fn pbr(&mut self, layers: &Layers<'_>, title: &str, normals: Option<&str>) -> String {
        let base = layers.base;
        let widths = self.widths(base, title);
        let metallic = self.part(base, "metallic", 2);
        let clear = match self.names.number(base, "transmission", 0.0) {
            Input::Constant(part) => Part::Constant(part),
            Input::Texture(texture) => self.texture_part(texture, Taken::Number(1.0)),
        };
        let with = |parameters: Parameters| match normals {
            Some(file) => parameters.text("normalmap", file),
            None => parameters,
        };
        let metal = (!metallic.is_none()).then(|| {
            let parameters = self.metal(layers, &widths, title);
            self.named_material(&format!("{title} metal"), with(parameters))
        });
        if let (Some(metal), true) = (&metal, metallic.is_all()) {
            return metal.clone();
        }
        let glass = (!clear.is_none()).then(|| {
            let parameters = self.glass(base, &widths, title);
            self.named_material(&format!("{title} clear"), with(parameters))
        });
        let dielectric = match &glass {
            Some(glass) if clear.is_all() => glass.clone(),
            _ => {
                let parameters = self.opaque(layers, &widths, title);
                let opaque = self.named_material(title, with(parameters));
                self.mixed(title, &opaque, glass.as_deref(), &clear)
            }
        };
        self.mixed(title, &dielectric, metal.as_deref(), &metallic)
    }

    /// The mixture of two materials, by the part of the second; the first alone if there is no second.
    fn mixed(&mut self, title: &str, first: &str, second: Option<&str>, part: &Part) -> String {
        let Some(second) = second else { return first.to_owned() };
        let parameters =
            Parameters::default().text("type", "mix").texts("materials", &[first, second]);
        let parameters = match part {
            Part::Constant(part) => parameters.float("amount", *part),
            Part::Texture(name) => parameters.texture("amount", name),
        };
        self.named_material(&format!("{title} mixture"), parameters)
    }

    fn named_material(&mut self, name: &str, parameters: Parameters) -> String {
        let name = self.unique(name);
        self.text.directive("MakeNamedMaterial", &[&name], parameters);
        name
    }

    /// A number of the material, times its channel of the map that has both.
    fn part(&mut self, base: &Entity, name: &str, channel: usize) -> Part {
        let factor = match self.names.number(base, name, 1.0) {
            Input::Texture(texture) => return self.texture_part(texture, Taken::Number(1.0)),
            Input::Constant(factor) => factor,
        };
        match self.names.referred(base, "metallicRoughness") {
            Some(map) if factor > 0.0 => self.texture_part(map, Taken::Channel(channel, factor)),
            _ => Part::Constant(factor),
        }
    }

    fn texture_part(&mut self, texture: EntityId, taken: Taken) -> Part {
        match self.texture(texture, taken) {
            Exported::Constant([part, ..]) => Part::Constant(part),
            Exported::Texture(name) => Part::Texture(name),
        }
    }

    /// The widths of highlights: squares of the roughness.
    fn widths(&mut self, base: &Entity, title: &str) -> Widths {
        let exported = match self.names.number(base, "roughness", 1.0) {
            Input::Texture(texture) => self.texture(texture, Taken::Square),
            Input::Constant(factor) => match self.names.referred(base, "metallicRoughness") {
                Some(map) => self.texture(map, Taken::SquareOf(1, factor)),
                None => Exported::Constant([factor * factor; 3]),
            },
        };
        let strength = base.number("anisotropy").unwrap_or(0.0);
        match exported {
            Exported::Texture(name) => {
                if strength > 0.0 {
                    self.lose("anisotropy beside a texture of roughness", title);
                }
                Widths::Texture(name)
            }
            Exported::Constant([width, ..]) => {
                let along = width + (1.0 - width) * strength * strength;
                let (sine, cosine) = rtsl_math::sine_and_cosine_of_degrees(
                    base.number("anisotropyRotation").unwrap_or(0.0).to_degrees(),
                );
                // The directions of the coordinates are the only ones.
                let is_turned = sine.abs() > cosine.abs();
                if strength > 0.0 && sine.abs().min(cosine.abs()) > 1e-3 {
                    self.lose("the direction of anisotropy", title);
                }
                Widths::Constant(if is_turned { [width, along] } else { [along, width] })
            }
        }
    }

    fn metal(&mut self, layers: &Layers<'_>, widths: &Widths, title: &str) -> Parameters {
        let coat = layers.coat.and_then(|coat| self.coat(coat, title));
        let parameters = match coat {
            Some(width) => {
                let parameters = Parameters::default()
                    .text("type", "coatedconductor")
                    .float("interface.roughness", width)
                    .float("interface.eta", 1.5);
                widths.given(parameters, "conductor.")
            }
            None => widths.given(Parameters::default().text("type", "conductor"), ""),
        };
        self.colored(parameters.boolean("remaproughness", false), layers.base, "reflectance", 1.0)
    }

    /// The width of a coat's highlights; `None` for coats that are left out.
    fn coat(&mut self, coat: &Entity, title: &str) -> Option<f64> {
        let part = self.names.number(coat, "coat", 1.0);
        let roughness = self.names.number(coat, "roughness", 0.0);
        match (part, roughness) {
            (Input::Constant(part), Input::Constant(roughness)) if part >= LEAST_COAT => {
                Some(roughness * roughness)
            }
            (Input::Texture(_), _) | (_, Input::Texture(_)) => {
                self.lose("textures of coats", title);
                Some(0.0)
            }
            (Input::Constant(_), Input::Constant(_)) => {
                self.lose("faint coats", title);
                None
            }
        }
    }

    fn opaque(&mut self, layers: &Layers<'_>, widths: &Widths, title: &str) -> Parameters {
        let base = layers.base;
        let through = match self.names.number(base, "diffuseTransmission", 0.0) {
            Input::Constant(part) => part,
            Input::Texture(_) => {
                self.lose("textures of diffuse transmission", title);
                0.5
            }
        };
        if through > 0.0 {
            let parameters = Parameters::default().text("type", "diffusetransmission");
            let parameters = self.colored(parameters, base, "reflectance", 1.0 - through);
            return match self.names.color(base, "diffuseTransmissionColor") {
                Input::Constant(color) => {
                    parameters.rgb("transmittance", color.map(|part| through * part))
                }
                Input::Texture(texture) => {
                    self.input(parameters, "transmittance", texture, Taken::Color(through))
                }
            };
        }
        let coat = layers.coat.and_then(|coat| self.coat(coat, title));
        let eta = index_of_refraction(base);
        let is_wide = matches!(widths, Widths::Constant([u, v]) if u.min(*v) >= DULL_WIDTH);
        let is_dull = eta == 1.0 || base.number("specular") == Some(0.0) || is_wide;
        if is_dull && coat.is_none() {
            let parameters = Parameters::default().text("type", "diffuse");
            return self.colored(parameters, base, "reflectance", 1.0);
        }
        let parameters = Parameters::default().text("type", "coateddiffuse");
        let parameters = match coat {
            Some(width) => parameters.float("roughness", width).float("eta", 1.5),
            None => widths.given(parameters, "").float("eta", eta),
        };
        self.colored(parameters.boolean("remaproughness", false), base, "reflectance", 1.0)
    }

    fn glass(&mut self, base: &Entity, widths: &Widths, title: &str) -> Parameters {
        let is_white = self.names.color(base, "baseColor") == Input::Constant([1.0; 3]);
        if !is_white {
            self.lose("the colour of clear surfaces", title);
        }
        let eta = index_of_refraction(base);
        if boolean(base, "thin") != Some(false) {
            let is_smooth = matches!(widths, Widths::Constant([u, v]) if u.max(*v) < 0.01);
            if !is_smooth {
                self.lose("the roughness of clear sheets", title);
            }
            return Parameters::default().text("type", "thindielectric").float("eta", eta);
        }
        let parameters = Parameters::default().text("type", "dielectric").float("eta", eta);
        widths.given(parameters, "").boolean("remaproughness", false)
    }

    /// Adds the base colour, scaled.
    fn colored(
        &mut self,
        parameters: Parameters,
        base: &Entity,
        name: &str,
        scale: f64,
    ) -> Parameters {
        match self.names.color(base, "baseColor") {
            Input::Constant(color) => parameters.rgb(name, color.map(|part| scale * part)),
            Input::Texture(texture) => self.input(parameters, name, texture, Taken::Color(scale)),
        }
    }

    /// Adds a colour's texture.
    fn input(
        &mut self,
        parameters: Parameters,
        name: &str,
        texture: EntityId,
        taken: Taken,
    ) -> Parameters {
        match self.texture(texture, taken) {
            Exported::Constant(color) => parameters.rgb(name, color),
            Exported::Texture(texture) => parameters.texture(name, &texture),
        }
    }
}

/// A part of a mixture.
enum Part {
    Constant(f64),
    Texture(String),
}

impl Part {
    fn is_none(&self) -> bool {
        matches!(self, Part::Constant(part) if *part <= 0.0)
    }

    fn is_all(&self) -> bool {
        matches!(self, Part::Constant(part) if *part >= 1.0)
    }
}

impl Widths {
    /// Adds the widths, the names of whose parameters have a prefix.
    fn given(&self, parameters: Parameters, prefix: &str) -> Parameters {
        let name = |rest: &str| format!("{prefix}{rest}");
        match self {
            Widths::Constant([u, v]) if u == v => parameters.float(&name("roughness"), *u),
            Widths::Constant([u, v]) => {
                parameters.float(&name("uroughness"), *u).float(&name("vroughness"), *v)
            }
            Widths::Texture(texture) => parameters.texture(&name("roughness"), texture),
        }
    }
}

/// The index of refraction; an infinite one, of materials whose reflection has a colour, is that of a mean reflectance.
fn index_of_refraction(base: &Entity) -> f64 {
    let ior = base.number("ior").unwrap_or(1.5);
    if ior >= 1.0 {
        return ior;
    }
    let color = numbers::<3>(base, "specularColor").unwrap_or([0.04; 3]);
    let root = (color.iter().sum::<f64>() / 3.0).clamp(0.0, 0.8).sqrt();
    (1.0 + root) / (1.0 - root)
}
