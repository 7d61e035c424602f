//! Nodes that read images.

use crate::color_space::{ColorSpace, Encoding};
use crate::document::Fault;
use crate::graph::unknown_space;
use crate::special::{At, converted};
use crate::statements::Value;
use crate::translation::{ImageUse, TileNumbers};
use crate::types::Type;
use crate::{literal, places};

/// Returns the value of a node that reads images; `None` for others.
///
/// # Errors
/// If an input cannot be computed.
pub fn value(at: &mut At<'_, '_>, tag: &str, output: Option<&str>) -> Result<Option<Value>, Fault> {
    let value = match tag {
        "image" => {
            let uv = at.input_or_property("texcoord", Type::Vector2, "UV0")?;
            let modes = at.modes("uaddressmode", "vaddressmode")?;
            at.image("file", &uv, modes)?
        }
        "tiledimage" => at.tiled_image()?,
        "latlongimage" => at.panorama()?,
        "triplanarprojection" => at.projection()?,
        "hextiledimage" => at.hex_tiled_image()?,
        "hextilednormalmap" => at.hex_tiled_normals()?,
        "UsdUVTexture" => at.usd_texture(output)?,
        _ => return at.gltf(tag, output),
    };
    Ok(Some(value))
}

/// The continuation of an image beyond its edges, as the library's functions count them.
type Modes = [u8; 2];

const PERIODIC: Modes = [0; 2];
const MIRROR: u8 = 2;
const CONSTANT: u8 = 3;

/// An image that a node reads.
struct Image {
    /// The name of the member.
    member: String,
    /// True if it is several, by the unit squares of coordinates.
    is_tiled: bool,
    space: ColorSpace,
    /// The value where there is none.
    default: Value,
}

impl At<'_, '_> {
    fn modes(&mut self, u: &str, v: &str) -> Result<Modes, Fault> {
        let mut modes = PERIODIC;
        for (mode, name) in modes.iter_mut().zip([u, v]) {
            let text = self.text(name)?;
            *mode = match text.as_deref() {
                Some("clamp") => 1,
                Some("mirror") => MIRROR,
                Some("constant" | "black") => CONSTANT,
                _ => 0,
            };
        }
        Ok(modes)
    }

    /// The image of an input with the name of a file.
    fn open(&mut self, name: &str, ty: Type, modes: Modes) -> Result<Option<Image>, Fault> {
        let default = self.input("default", ty, 0.0)?;
        let Some(file) = self.text(name)?.filter(|it| !it.is_empty()) else { return Ok(None) };
        let port = self.graph.port(self.node, name);
        let source = match port {
            Some(port) => self.graph.source(self.scope, port)?,
            None => None,
        };
        let element = match source {
            Some(crate::graph::Source::Constant(element)) => element,
            _ => port.unwrap_or(self.node),
        };
        let document = self.graph.document;
        let space = document.inherited(element, "colorspace").unwrap_or_default();
        let known = ColorSpace::named(space);
        if known.is_none() && ty.is_color() {
            self.graph.warn(unknown_space(space), element);
        }
        let linear = ColorSpace { encoding: Encoding::Linear, matrix: None };
        let space = known.filter(|_| ty.is_color()).unwrap_or(linear);
        let prefix = document.inherited(element, "fileprefix").unwrap_or_default();
        let path = path_of(prefix, &file);
        let (path, tiles) = with_tiles(path);
        let filter = self.text("filtertype")?;
        let wanted = ImageUse {
            member: String::new(),
            file: path,
            tiles,
            is_srgb: space.encoding == Encoding::Srgb,
            is_repeated: modes == PERIODIC,
            is_nearest: filter.as_deref() == Some("closest"),
            has_opacity: ty.count() == 4,
            span: document.get(element).span,
        };
        let member = self.graph.image_member(wanted);
        Ok(Some(Image { member, is_tiled: tiles.is_some(), space, default }))
    }

    /// The value of an image at coordinates.
    fn image(&mut self, name: &str, uv: &Value, modes: Modes) -> Result<Value, Fault> {
        let ty = self.ty();
        self.image_of_type(name, uv, modes, ty)
    }

    fn image_of_type(
        &mut self,
        name: &str,
        uv: &Value,
        modes: Modes,
        ty: Type,
    ) -> Result<Value, Fault> {
        match self.open(name, ty, modes)? {
            Some(image) => self.looked_up(&image, uv, modes, ty),
            None => self.input("default", ty, 0.0),
        }
    }

    fn looked_up(
        &mut self,
        image: &Image,
        uv: &Value,
        modes: Modes,
        ty: Type,
    ) -> Result<Value, Fault> {
        let Image { member, default, is_tiled, .. } = image;
        let mut place = uv.text.clone();
        if modes != PERIODIC && !is_tiled {
            let call = format!("mxPlacement.wrapped({place}, ivec2({}, {}))", modes[0], modes[1]);
            place = self.graph.statements.add("vec2", call);
        }
        let lookup = match &uv.footprint {
            Some(footprint) => {
                let widths = self.graph.statements.add("vec2", footprint.clone());
                format!("{member}.lookup({place}, {widths}.x, {widths}.y)")
            }
            None => format!("{member}.lookup({place}, 0.0, 0.0)"),
        };
        let rgb = format!("isSet({member}) ? rgb({lookup}) : {}", rgb_of(default));
        let mut color = self.graph.statements.add("vec3", rgb);
        if let Encoding::Gamma(gamma) = image.space.encoding {
            let call = format!("mxColor.linearOfGamma({color}, {})", literal::float(gamma));
            color = self.graph.statements.add("vec3", call);
        }
        if let Some(rows) = image.space.matrix {
            let parts: Vec<String> = rows
                .iter()
                .map(|row| format!("dot({color}, {})", literal::rtsl(row, Type::Vector3)))
                .collect();
            color = self.graph.statements.add("vec3", format!("vec3({})", parts.join(", ")));
        }
        let value = match ty.count() {
            1 => self.add(Type::Float, format!("{color}.x")),
            2 => self.add(ty, format!("{color}.xy")),
            3 => Value::new(ty, color),
            _ => {
                let number = lookup.replace(".lookup(", ".lookupFloat(");
                let alpha = format!(
                    "isSet({member}) ? ({member}HasOpacity ? {number} : 1.0) : {}.w",
                    default.text
                );
                let alpha = self.graph.statements.add("float", alpha);
                self.add(ty, format!("vec4({color}, {alpha})"))
            }
        };
        if !modes.contains(&CONSTANT) || *is_tiled {
            return Ok(value);
        }
        let beyond = format!(
            "mxPlacement.isBeyond({}, ivec2({}, {})) ? {} : {}",
            uv.text, modes[0], modes[1], default.text, value.text
        );
        Ok(self.add(ty, beyond))
    }

    fn tiled_image(&mut self) -> Result<Value, Fault> {
        let uv = self.input_or_property("texcoord", Type::Vector2, "UV0")?;
        let tiling = self.input("uvtiling", Type::Vector2, 1.0)?;
        let offset = self.input("uvoffset", Type::Vector2, 0.0)?;
        let size = self.input("realworldimagesize", Type::Vector2, 1.0)?;
        let tile = self.input("realworldtilesize", Type::Vector2, 1.0)?;
        let ratio = |at: &mut Self| match (&size.constant, &tile.constant) {
            (Some(size), Some(tile)) if size == tile => None,
            _ => Some(at.add(Type::Vector2, format!("{} / {}", tile.text, size.text)).text),
        };
        let scale = ratio(self).map_or(String::new(), |it| format!(" * {it}"));
        let place = format!("({} * {} - {}){scale}", uv.text, tiling.text, offset.text);
        let footprint = uv.footprint.map(|it| format!("{it} * abs({}{scale})", tiling.text));
        let place = self.add(Type::Vector2, place).with_footprint(footprint);
        self.image("file", &place, PERIODIC)
    }

    fn panorama(&mut self) -> Result<Value, Fault> {
        let view = self.input_or("viewdir", Type::Vector3, &[0.0, 0.0, 1.0])?;
        let rotation = self.input("rotation", Type::Float, 0.0)?;
        let call = format!("mxPlacement.ofSphere({}, {})", view.text, rotation.text);
        let uv = self.add(Type::Vector2, call);
        self.image("file", &uv, [0, MIRROR])
    }

    fn projection(&mut self) -> Result<Value, Fault> {
        let ty = self.ty();
        let point = self.input_or_property("position", Type::Vector3, "Pobject")?;
        let normal = self.input_or_property("normal", Type::Vector3, "Nobject")?;
        let axis = self.input("upaxis", Type::Integer, 2.0)?;
        let blend = self.input("blend", Type::Float, 1.0)?;
        let weights = format!("mxPlacement.axisWeights({}, {})", normal.text, blend.text);
        let weights = self.graph.statements.add("vec3", weights);
        let mut terms = Vec::new();
        for (letter, component) in [("X", "x"), ("Y", "y"), ("Z", "z")] {
            let call = format!("mxPlacement.along{letter}({}, {})", point.text, axis.text);
            let uv = self.add(Type::Vector2, call);
            let value = self.image_of_type(&format!("file{component}"), &uv, PERIODIC, ty)?;
            terms.push(format!("{} * {weights}.{component}", value.text));
        }
        Ok(self.add(ty, terms.join(" + ")))
    }

    /// The tiles of coordinates, and those coordinates.
    fn hex_tiles(&mut self) -> Result<(String, Option<String>), Fault> {
        let uv = self.input_or_property("texcoord", Type::Vector2, "UV0")?;
        let tiling = self.input("tiling", Type::Vector2, 1.0)?;
        let rotation = self.input("rotation", Type::Float, 1.0)?;
        let rotations = self.input_or("rotationrange", Type::Vector2, &[0.0, 360.0])?;
        let scale = self.input("scale", Type::Float, 1.0)?;
        let scales = self.input_or("scalerange", Type::Vector2, &[0.5, 2.0])?;
        let offset = self.input("offset", Type::Float, 1.0)?;
        let offsets = self.input_or("offsetrange", Type::Vector2, &[0.0, 1.0])?;
        let place = self.add(Type::Vector2, format!("{} * {}", uv.text, tiling.text));
        let call = format!(
            "mxPlacement.hexTiles({}, {}, {}, {}, {}, {}, {})",
            place.text,
            rotation.text,
            rotations.text,
            scale.text,
            scales.text,
            offset.text,
            offsets.text
        );
        let footprint = uv.footprint.map(|it| format!("{it} * abs({})", tiling.text));
        Ok((self.graph.statements.add("mxPlacement.HexTiles", call), footprint))
    }

    /// The values of an image in the three tiles.
    fn hex_values(
        &mut self,
        tiles: &str,
        footprint: Option<String>,
        ty: Type,
    ) -> Result<Vec<Value>, Fault> {
        let mut values = Vec::new();
        for (tile, component) in [("first", "x"), ("second", "y"), ("third", "z")] {
            let widths = footprint.clone().map(|it| format!("{it} / {tiles}.scales.{component}"));
            let uv = self.add(Type::Vector2, format!("{tiles}.{tile}")).with_footprint(widths);
            values.push(self.image_of_type("file", &uv, PERIODIC, ty)?);
        }
        Ok(values)
    }

    fn hex_tiled_image(&mut self) -> Result<Value, Fault> {
        let ty = self.ty();
        let (tiles, footprint) = self.hex_tiles()?;
        let values = self.hex_values(&tiles, footprint, ty)?;
        let falloff = self.input("falloff", Type::Float, 0.5)?;
        let contrast = self.input("falloffcontrast", Type::Float, 0.5)?;
        let weights = [0.272_228_7, 0.674_081_8, 0.053_689_5];
        let luminances = self.input_or("lumacoeffs", Type::Color3, &weights)?;
        let dots: Vec<String> = values
            .iter()
            .map(|value| format!("dot({}.xyz, {})", value.text, luminances.text))
            .collect();
        let luminances = format!("mix(vec3(1.0), vec3({}), {})", dots.join(", "), contrast.text);
        let luminances = self.graph.statements.add("vec3", luminances);
        let weights =
            format!("mxPlacement.hexWeights({luminances}, {tiles}.weights, {})", falloff.text);
        let weights = self.graph.statements.add("vec3", weights);
        let [first, second, third] = &values[..] else { unreachable!("there are three tiles") };
        let sum = format!(
            "{} * {weights}.x + {} * {weights}.y + {} * {weights}.z",
            first.text, second.text, third.text
        );
        Ok(self.add(ty, sum))
    }

    fn hex_tiled_normals(&mut self) -> Result<Value, Fault> {
        let (tiles, footprint) = self.hex_tiles()?;
        let values = self.hex_values(&tiles, footprint, Type::Vector3)?;
        let falloff = self.input("falloff", Type::Float, 0.5)?;
        let strength = self.input("strength", Type::Float, 1.0)?;
        let flipped = self.input("flip_g", Type::Boolean, 0.0)?;
        let normal = self.input_or_property("normal", Type::Vector3, "Nworld")?;
        let tangent = self.input_or_property("tangent", Type::Vector3, "Tworld")?;
        let bitangent = self.input_or_property("bitangent", Type::Vector3, "Bworld")?;
        let weights =
            format!("mxPlacement.hexWeights(vec3(1.0), {tiles}.weights, {})", falloff.text);
        let weights = self.graph.statements.add("vec3", weights);
        let mut slopes = Vec::new();
        for (value, component) in values.iter().zip(["x", "y", "z"]) {
            let value = &value.text;
            let map =
                format!("{} ? vec3({value}.x, 1.0 - {value}.y, {value}.z) : {value}", flipped.text);
            let map = self.graph.statements.add("vec3", map);
            let turned = format!(
                "mxPlacement.hexNormal({map}, {tiles}.angles.{component}, {}, {}, {}, {})",
                strength.text, normal.text, tangent.text, bitangent.text
            );
            let turned = self.graph.statements.add("vec3", turned);
            slopes.push(format!(
                "{weights}.{component} * mxPlacement.slopeOfNormal({}, {turned})",
                normal.text
            ));
        }
        let sum = format!("normalize({} - ({}))", normal.text, slopes.join(" + "));
        Ok(self.add(Type::Vector3, sum))
    }

    fn usd_texture(&mut self, output: Option<&str>) -> Result<Value, Fault> {
        let uv = self.input_or_property("st", Type::Vector2, "UV0")?;
        let modes = self.modes("wrapS", "wrapT")?;
        let fallback = self.input_or("fallback", Type::Color4, &[0.0, 0.0, 0.0, 1.0])?;
        let scale = self.input("scale", Type::Color4, 1.0)?;
        let bias = self.input("bias", Type::Color4, 0.0)?;
        let texel = match self.open("file", Type::Color4, modes)? {
            Some(image) => {
                self.looked_up(&Image { default: fallback, ..image }, &uv, modes, Type::Color4)?
            }
            None => fallback,
        };
        let value =
            self.add(Type::Color4, format!("{} * {} + {}", texel.text, scale.text, bias.text));
        let (channels, ty) = match output {
            Some("r") => ("x", Type::Float),
            Some("g") => ("y", Type::Float),
            Some("b") => ("z", Type::Float),
            Some("a") => ("w", Type::Float),
            Some("rgba") => return Ok(value),
            _ => ("xyz", Type::Color3),
        };
        let part = self.add(ty, format!("{}.{channels}", value.text));
        let own = self.ty();
        match output {
            None if own.count() < 4 => converted(self.graph, &part, own, self.node),
            _ => Ok(part),
        }
    }

    /// The coordinates of an image by the inputs of glTF's nodes.
    fn gltf_place(&mut self, order: f64) -> Result<Value, Fault> {
        let uv = self.input_or_property("texcoord", Type::Vector2, "UV0")?;
        let names = ["pivot", "scale", "rotate", "offset"];
        if names.iter().all(|name| self.graph.port(self.node, name).is_none()) {
            return Ok(uv);
        }
        let pivot = self.input_or("pivot", Type::Vector2, &[0.0, 1.0])?;
        let scale = self.input("scale", Type::Vector2, 1.0)?;
        let rotation = self.input("rotate", Type::Float, 0.0)?;
        let offset = self.input("offset", Type::Vector2, 0.0)?;
        let order = self.input("operationorder", Type::Integer, order)?;
        let call = format!(
            "mxPlacement.placedOfGltf({}, {}, {}, {}, {}, {})",
            uv.text, pivot.text, scale.text, rotation.text, offset.text, order.text
        );
        let footprint = uv.footprint.map(|it| format!("{it} * abs({})", scale.text));
        Ok(self.add(Type::Vector2, call).with_footprint(footprint))
    }

    fn gltf(&mut self, tag: &str, output: Option<&str>) -> Result<Option<Value>, Fault> {
        let is_four = self.ty().count() == 4 || tag == "gltf_colorimage";
        let ty = match tag {
            "gltf_image" => self.ty(),
            "gltf_colorimage" => Type::Color4,
            "gltf_normalmap" | "gltf_iridescence_thickness" | "gltf_anisotropy_image" => {
                Type::Vector3
            }
            _ => return Ok(None),
        };
        let uv = self.gltf_place(if is_four { 1.0 } else { 0.0 })?;
        let modes = self.modes("uaddressmode", "vaddressmode")?;
        let value = self.image_of_type("file", &uv, modes, ty)?;
        let value = match tag {
            "gltf_image" if ty != Type::Vector3 => {
                let factor = self.input("factor", ty, 1.0)?;
                self.add(ty, format!("{} * {}", factor.text, value.text))
            }
            "gltf_colorimage" => self.gltf_color(&value, output)?,
            "gltf_normalmap" => {
                let [normal, tangent, bitangent] = ["Nworld", "Tworld", "Bworld"]
                    .map(|name| places::property(self.graph, name, self.node));
                let call = format!(
                    "mxPlacement.mappedNormal({}, vec2(1.0), {}, {}, {})",
                    value.text, normal?.text, tangent?.text, bitangent?.text
                );
                self.add(Type::Vector3, call)
            }
            "gltf_iridescence_thickness" => {
                let least = self.input("thicknessMin", Type::Float, 100.0)?;
                let most = self.input("thicknessMax", Type::Float, 400.0)?;
                let mixed = format!("mix({}, {}, {}.y)", most.text, least.text, value.text);
                self.add(Type::Float, mixed)
            }
            "gltf_anisotropy_image" => self.gltf_anisotropy(&value, output)?,
            _ => value,
        };
        Ok(Some(value))
    }

    fn gltf_color(&mut self, value: &Value, output: Option<&str>) -> Result<Value, Fault> {
        let color = self.input("color", Type::Color4, 1.0)?;
        let vertices = self.input("geomcolor", Type::Color4, 1.0)?;
        let product = format!("{} * {} * {}", color.text, value.text, vertices.text);
        let product = self.graph.statements.add("vec4", product);
        Ok(match output {
            Some("outa") => self.add(Type::Float, format!("{product}.w")),
            _ => self.add(Type::Color3, format!("{product}.xyz")),
        })
    }

    fn gltf_anisotropy(&mut self, value: &Value, output: Option<&str>) -> Result<Value, Fault> {
        let strength = self.input("anisotropy_strength", Type::Float, 1.0)?;
        let rotation = self.input("anisotropy_rotation", Type::Float, 0.0)?;
        let text = &value.text;
        let expression = match output {
            Some("anisotropy_rotation_out") => {
                format!("{} + atan(2.0 * {text}.y - 1.0, 2.0 * {text}.x - 1.0)", rotation.text)
            }
            _ => format!("{} * {text}.z", strength.text),
        };
        Ok(self.add(Type::Float, expression))
    }
}

/// The path of a file, whose prefix counts unless it is absolute. Documents of Windows have `\\` between folders.
fn path_of(prefix: &str, file: &str) -> String {
    let is_absolute = file.starts_with(['/', '\\']) || file.chars().nth(1) == Some(':');
    let path = if is_absolute { file.to_owned() } else { format!("{prefix}{file}") };
    path.replace('\\', "/")
}

/// The path with the mark of numbers as documents should write it, and the form of the numbers. The reader has `[` in
/// place of `<`.
fn with_tiles(path: String) -> (String, Option<TileNumbers>) {
    let marks = [
        ("[UDIM>", TileNumbers::Udim),
        ("<udim>", TileNumbers::Udim),
        ("[udim>", TileNumbers::Udim),
        ("%(UDIM)d", TileNumbers::Udim),
        ("<UDIM>", TileNumbers::Udim),
        ("[UVTILE>", TileNumbers::UvTile),
        ("<UVTILE>", TileNumbers::UvTile),
    ];
    match marks.into_iter().find(|(mark, _)| path.contains(mark)) {
        Some((mark, tiles)) => (path.replacen(mark, tiles.mark(), 1), Some(tiles)),
        None => (path, None),
    }
}

/// The red, green and blue of a value.
fn rgb_of(value: &Value) -> String {
    match value.ty.count() {
        1 => format!("vec3({})", value.text),
        2 => format!("vec3({}, 0.0)", value.text),
        3 => value.text.clone(),
        _ => format!("{}.xyz", value.text),
    }
}
