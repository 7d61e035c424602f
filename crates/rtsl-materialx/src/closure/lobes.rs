//! Lobes of scattered light: the calls that make them.

use super::Lobe;
use crate::document::Fault;
use crate::special::At;
use crate::statements::Value;
use crate::types::Type;

/// Stands for whether the surface has an inside, which is known when all of its lobes are.
pub const IS_CLEAR: &str = "$isClear";

/// Returns the lobes of a node, each over the next; `None` if the node is no closure that is supported.
///
/// # Errors
/// If an input cannot be computed.
pub fn lobes(at: &mut At<'_, '_>, tag: &str, is_sheet: bool) -> Result<Option<Vec<Lobe>>, Fault> {
    const GREY: [f64; 3] = [0.18; 3];
    let lobes = match tag {
        "oren_nayar_diffuse_bsdf" | "burley_diffuse_bsdf" => {
            let color = at.input_or("color", Type::Color3, &GREY)?;
            let roughness = at.input("roughness", Type::Float, 0.0)?;
            vec![at.lobe("matte", &[&color, &roughness])?]
        }
        "subsurface_bsdf" => {
            let color = at.input_or("color", Type::Color3, &GREY)?;
            let smooth = Value::constant(Type::Float, vec![0.0]);
            vec![at.lobe("matte", &[&color, &smooth])?]
        }
        "translucent_bsdf" => {
            let color = at.input("color", Type::Color3, 1.0)?;
            vec![at.lobe("translucent", &[&color])?]
        }
        "sheen_bsdf" => {
            let color = at.input("color", Type::Color3, 1.0)?;
            let roughness = at.input("roughness", Type::Float, 0.3)?;
            vec![at.lobe("sheen", &[&color, &roughness])?]
        }
        "dielectric_bsdf" => {
            let tint = at.input("tint", Type::Color3, 1.0)?;
            let ior = at.input("ior", Type::Float, 1.5)?;
            let alpha = at.input("roughness", Type::Vector2, 0.05)?;
            let clear = Value::new(Type::Boolean, IS_CLEAR);
            let reflecting = at.lobe("dielectric", &[&tint, &ior, &alpha, &clear])?;
            at.with_mode(reflecting, &tint, &ior, &alpha, is_sheet)?
        }
        "conductor_bsdf" => {
            let ior = at.input_or("ior", Type::Color3, &[0.183, 0.421, 1.373])?;
            let extinction = at.input_or("extinction", Type::Color3, &[3.424, 2.346, 1.770])?;
            let alpha = at.input("roughness", Type::Vector2, 0.05)?;
            vec![at.lobe("conductor", &[&ior, &extinction, &alpha])?]
        }
        "generalized_schlick_bsdf" => {
            let straight = at.input("color0", Type::Color3, 1.0)?;
            let edge = at.input("color90", Type::Color3, 1.0)?;
            let exponent = at.input("exponent", Type::Float, 5.0)?;
            let alpha = at.input("roughness", Type::Vector2, 0.05)?;
            let reflecting = at.lobe("schlick", &[&straight, &edge, &exponent, &alpha])?;
            let white = Value::constant(Type::Color3, vec![1.0; 3]);
            let mean = format!("mxColor.iorOf(dot({}, vec3(1.0 / 3.0)))", straight.text);
            let ior = at.add(Type::Float, mean);
            at.with_mode(reflecting, &white, &ior, &alpha, is_sheet)?
        }
        _ => return Ok(None),
    };
    at.warn_of_ignored(tag)?;
    Ok(Some(lobes))
}

impl At<'_, '_> {
    /// The call that makes a lobe: weight, its own arguments, and its frame.
    fn lobe(&mut self, function: &str, arguments: &[&Value]) -> Result<Lobe, Fault> {
        let weight = self.input("weight", Type::Float, 1.0)?;
        let normal =
            self.given("normal")?.filter(|_| self.graph.port(self.node, "normal").is_some());
        let own = "rt_ShadingNormal".to_owned();
        let normal = normal.map(|it| {
            format!("mxPlacement.usableNormal({}, rt_ShadingNormal, rt_GeometricNormal)", it.text)
        });
        let is_turned = normal.is_some();
        let tangent = self.given("tangent")?.map_or("rt_dPdu".to_owned(), |it| it.text);
        let arguments: Vec<&str> = arguments.iter().map(|it| it.text.as_str()).collect();
        let expression = format!(
            "mxClosures.{function}({}, {}, {}, {tangent}, rt_RayDirection)",
            weight.text,
            arguments.join(", "),
            normal.unwrap_or(own)
        );
        Ok(Lobe { expression, is_turned })
    }

    /// The lobes of a boundary that reflects, lets pass, or both.
    fn with_mode(
        &mut self,
        reflecting: Lobe,
        tint: &Value,
        ior: &Value,
        alpha: &Value,
        is_sheet: bool,
    ) -> Result<Vec<Lobe>, Fault> {
        let mode = self.text("scatter_mode")?;
        if !matches!(mode.as_deref(), Some("T" | "RT")) {
            return Ok(vec![reflecting]);
        }
        let sheet = Value::constant(Type::Boolean, vec![f64::from(u8::from(is_sheet))]);
        let passing = self.lobe("bending", &[tint, ior, alpha, &sheet])?;
        Ok(match mode.as_deref() {
            Some("T") => vec![passing],
            _ => vec![reflecting, passing],
        })
    }

    fn warn_of_ignored(&mut self, tag: &str) -> Result<(), Fault> {
        for (name, without) in [("thinfilm_thickness", 0.0), ("retroreflective", 0.0)] {
            let Some(port) = self.graph.port(self.node, name) else { continue };
            let value = self.given(name)?;
            let known = value.and_then(|it| it.constant);
            if known.is_none_or(|numbers| numbers[0] != without) {
                let message = format!("the input `{name}` of `{tag}` has no effect");
                self.graph.warn(message, port);
            }
        }
        Ok(())
    }
}
