//! Settings, cameras, lights, shapes and instances.

use rtsl_math::Transform;

use super::Exporter;
use super::materials::Finish;
use super::meshes::MeshArrays;
use super::text::Parameters;
use super::textures::{Exported, Taken};
use super::values::{Input, boolean, numbers};
use crate::description::{Entity, EntityId, ShapeUse};
use crate::settings::Settings;

/// The samples of a pixel that the text gives.
const SAMPLES: i64 = 64;

/// The greatest number of triangles of a shape whose light has an image: pbrt-v4 reads the image for each of them.
const MAX_GLOWING: usize = 256;

impl Exporter<'_, '_> {
    /// Writes the scene.
    pub fn scene(&mut self) {
        let source = self.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        self.text.comment(&format!("converted from {source} by rtsl"));
        self.settings();
        self.text.gap();
        self.text.plain("WorldBegin");
        self.text.gap();
        let description = self.description;
        for light in &description.lights {
            self.light(&description.entities[light.0]);
        }
        for object in &description.objects {
            let shapes = self.prepared(&object.shapes);
            let name = if object.name.is_empty() { "object" } else { &object.name };
            let name = self.unique(name);
            self.text.open("ObjectBegin", Some(&name));
            shapes.iter().for_each(|shape| self.shape(shape, true));
            self.text.close("ObjectEnd");
            self.objects.push(name);
        }
        for shape in &description.shapes {
            let prepared = self.prepared(std::slice::from_ref(shape));
            prepared.iter().for_each(|shape| self.shape(shape, false));
        }
        for instance in &description.instances {
            self.text.open("AttributeBegin", None);
            self.text.transform(instance.transform.into());
            let name = self.objects[instance.object as usize].clone();
            self.text.directive("ObjectInstance", &[&name], Parameters::default());
            self.text.close("AttributeEnd");
        }
    }

    fn settings(&mut self) {
        let settings = Settings::read(self.description, &mut rtsl::Diagnostics::new());
        let depth = Parameters::default().integer("maxdepth", i64::from(settings.max_depth));
        self.text.directive("Integrator", &["volpath"], depth);
        let samples = Parameters::default().integer("pixelsamples", SAMPLES);
        self.text.directive("Sampler", &["zsobol"], samples);
        let (width, height) = (settings.width as i64, settings.height as i64);
        let mut film = Parameters::default()
            .integer("xresolution", width)
            .integer("yresolution", height)
            .text("filename", &format!("{}.exr", self.folder.trim_end_matches("_files")));
        if settings.exposure != 0.0 {
            let factor = rtsl_math::power_of_two(f64::from(settings.exposure));
            film = film.float("iso", 100.0 * factor);
        }
        self.text.directive("Film", &["rgb"], film);
        let camera = self.description.camera.map(|it| &self.description.entities[it.0]);
        if let Some(camera) = camera {
            self.camera(camera, width as f64 / height as f64);
        }
    }

    fn camera(&mut self, camera: &Entity, aspect: f64) {
        self.text.transform(camera.transform);
        if camera.class == "Orthographic" {
            let scale = camera.number("scale").unwrap_or(1.0);
            let (x, y) =
                if aspect > 1.0 { (scale * aspect, scale) } else { (scale, scale / aspect) };
            let window = Parameters::default().floats("screenwindow", &[-x, x, -y, y]);
            self.text.directive("Camera", &["orthographic"], window);
        } else {
            let fov = Parameters::default().float("fov", camera.number("fov").unwrap_or(90.0));
            self.text.directive("Camera", &["perspective"], fov);
        }
    }

    fn light(&mut self, light: &Entity) {
        let point = |name: &str| numbers::<3>(light, name).unwrap_or_default();
        let color = |name: &str| numbers::<3>(light, name).unwrap_or([1.0; 3]);
        let strength = light.number("strength").unwrap_or(1.0);
        let parameters = Parameters::default();
        let (class, parameters) = match light.class.as_str() {
            "DirectionalLight" => {
                let from = point("direction").map(|part| -part);
                let parameters = parameters.point("from", from).point("to", [0.0; 3]);
                ("distant", parameters.rgb("L", color("irradiance")).float("scale", strength))
            }
            "SpotLight" => {
                let parameters =
                    parameters.point("from", point("position")).point("to", point("target"));
                let angle = |name: &str| light.number(name).unwrap_or(0.0);
                let parameters = parameters
                    .float("coneangle", angle("coneAngle"))
                    .float("conedeltaangle", angle("softness"));
                ("spot", parameters.rgb("I", color("intensity")).float("scale", strength))
            }
            "PointLight" => {
                let parameters = parameters.point("from", point("position"));
                ("point", parameters.rgb("I", color("intensity")).float("scale", strength))
            }
            _ => {
                let name = self.unique_file("studio", "pfm");
                let file = self.write(&name, &crate::studio::octahedral_studio());
                let scale = light.number("scale").unwrap_or(1.0);
                ("infinite", parameters.text("filename", &file).float("scale", scale))
            }
        };
        self.text.directive("LightSource", &[class], parameters);
        self.text.gap();
    }

    /// Writes the materials, textures and meshes of shapes, before the blocks that use them.
    fn prepared(&mut self, shapes: &[ShapeUse]) -> Vec<Prepared> {
        shapes.iter().filter_map(|shape| self.prepare(shape)).collect()
    }

    fn prepare(&mut self, use_: &ShapeUse) -> Option<Prepared> {
        let description = self.description;
        let shape = &description.entities[use_.shape.0];
        let arrays = MeshArrays::of(shape)?;
        let finish = use_.material.map(|it| self.finish_of(it)).unwrap_or_default();
        let mesh = match self.meshes.get(&arrays.key()) {
            Some(known) => known.clone(),
            None => {
                let name = self.unique_file("mesh", "ply");
                let file = self.write(&name, &arrays.ply());
                self.meshes.insert(arrays.key(), file.clone());
                file
            }
        };
        let mut parameters = Parameters::default().text("filename", &mesh);
        match self.names.number(shape, "alpha", 1.0) {
            Input::Constant(alpha) if alpha < 1.0 => parameters = parameters.float("alpha", alpha),
            Input::Constant(_) => {}
            Input::Texture(texture) => match self.texture(texture, Taken::Number(1.0)) {
                Exported::Constant([alpha, ..]) if alpha < 1.0 => {
                    parameters = parameters.float("alpha", alpha);
                }
                Exported::Constant(_) => {}
                Exported::Texture(name) => parameters = parameters.texture("alpha", &name),
            },
        }
        let glow = use_.area_light.or(finish.unlit);
        let glow = glow.and_then(|light| self.glow_of(light, arrays.triangles()));
        Some(Prepared { transform: shape.transform, finish, glow, parameters })
    }

    /// The parameters of an area light.
    fn glow_of(&mut self, light: EntityId, triangles: usize) -> Option<Parameters> {
        let entity = &self.description.entities[light.0];
        let parameters =
            Parameters::default().boolean("twosided", boolean(entity, "twoSided") == Some(true));
        let Some(texture) = self.names.referred(entity, "image") else {
            return Some(parameters.rgb("L", numbers(entity, "radiance").unwrap_or([1.0; 3])));
        };
        if triangles <= MAX_GLOWING {
            let (file, scale) = self.glow(texture)?;
            return Some(parameters.text("filename", &file).float("scale", scale));
        }
        let title = entity.name.clone().unwrap_or_default();
        self.lose("images of light from large meshes, whose mean takes their place", &title);
        Some(parameters.rgb("L", self.mean(texture)))
    }

    fn shape(&mut self, shape: &Prepared, is_in_object: bool) {
        let Prepared { transform, finish, glow, parameters } = shape;
        self.text.open("AttributeBegin", None);
        self.text.transform(*transform);
        if let Some(glow) = glow {
            if is_in_object {
                self.lose("light from objects with instances", &finish.name);
            } else {
                self.text.directive("AreaLightSource", &["diffuse"], glow.clone());
            }
        }
        if !finish.name.is_empty() {
            self.text.directive("NamedMaterial", &[&finish.name], Parameters::default());
        }
        if let Some(medium) = &finish.medium {
            self.text.directive("MediumInterface", &[medium, ""], Parameters::default());
        }
        self.text.directive("Shape", &["plymesh"], parameters.clone());
        self.text.close("AttributeEnd");
    }
}

/// A shape, whose files, textures and material are written.
struct Prepared {
    transform: Transform,
    finish: Finish,
    glow: Option<Parameters>,
    parameters: Parameters,
}
