//! The meaning of AOVs for an integrator's class.

use std::sync::Arc;

use rtsl::{
    Class, Diagnostic, ParameterType, Scalar, diagnostic_codes as codes, most_similar, type_name,
};
use rtsl_image::{Aov, AovType, DENOISER_AOVS};

use super::features::Features;

/// Another name of the distance, where the class has no output of this name.
const DEPTH: &str = "depth";

/// The AOVs of a render.
#[derive(Clone, Debug, Default)]
pub struct AovPlan {
    /// The AOVs in the order of the request, each once, with the types of their values. Those that are outputs of the
    /// integrator are told apart from images of the renderer.
    pub aovs: Vec<(Aov, AovType)>,
    /// The features from which they are computed.
    pub features: Features,
}

impl AovPlan {
    /// Resolves the names of AOVs for a class: outputs have precedence over images of the renderer. `depth` is another
    /// name of `distance` where the class has no output of this name.
    ///
    /// # Errors
    /// If there is no such image.
    pub fn new(asked: &[Aov], class: &Class) -> Result<AovPlan, Diagnostic> {
        let mut aovs: Vec<(Aov, AovType)> = Vec::new();
        for aov in asked {
            let (aov, ty) = resolved(aov, class)?;
            if aovs.iter().all(|(other, _)| *other != aov) {
                aovs.push((aov, ty));
            }
        }
        Ok(AovPlan::of(aovs))
    }

    /// Adds the AOVs that help a denoiser, as far as the class has them with three components.
    #[must_use]
    pub fn with_denoiser(self, class: &Class) -> AovPlan {
        let mut aovs = self.aovs.clone();
        let is_new = |aov: &Aov| self.aovs.iter().all(|(other, _)| other != aov);
        let new = DENOISER_AOVS.into_iter().filter(is_new);
        let typed = new.filter_map(|aov| Some((output_type(class, aov.name())??, aov)));
        aovs.extend(typed.filter(|(ty, _)| is_triple(*ty)).map(|(ty, aov)| (aov, ty)));
        AovPlan::of(aovs)
    }

    fn of(aovs: Vec<(Aov, AovType)>) -> AovPlan {
        let is_output = |aov: &Aov| aov.renderer_type().is_none();
        let outputs = aovs.iter().filter(|(aov, _)| is_output(aov));
        let outputs: Vec<(Arc<str>, AovType)> =
            outputs.map(|(aov, ty)| (aov.name().into(), *ty)).collect();
        let first_hits =
            aovs.iter().any(|(aov, _)| matches!(aov, Aov::Distance | Aov::Object | Aov::Class));
        AovPlan { features: Features::new(first_hits, outputs), aovs }
    }

    /// The AOVs without their types.
    pub fn names(&self) -> Vec<Aov> {
        self.aovs.iter().map(|(aov, _)| aov.clone()).collect()
    }

    /// The number of channels of all images.
    pub fn channels(&self) -> usize {
        self.aovs.iter().map(|(_, ty)| ty.channels()).sum()
    }

    /// The number of images that a denoiser reads.
    pub fn denoiser_aovs(&self) -> usize {
        let is_read = |(aov, ty): &&(Aov, AovType)| DENOISER_AOVS.contains(aov) && is_triple(*ty);
        self.aovs.iter().filter(is_read).count()
    }

    /// True if the work of rays is counted.
    pub fn counts_work(&self) -> bool {
        self.aovs.iter().any(|(aov, _)| matches!(aov, Aov::Nodes | Aov::Lanes))
    }
}

/// Returns the AOVs of a class's outputs, as far as images can have their values.
pub fn outputs_of(class: &Class) -> Vec<Aov> {
    let outputs = class.outputs.iter().filter(|(_, ty)| image_type(ty).is_some());
    outputs.map(|(name, _)| Aov::of_output(name)).collect()
}

/// Returns an AOV, with the type of its values.
fn resolved(aov: &Aov, class: &Class) -> Result<(Aov, AovType), Diagnostic> {
    let name = aov.name();
    if let Some(ty) = output_type(class, name) {
        let ty = ty.ok_or_else(|| no_image_of_type(class, name))?;
        return Ok((Aov::of_output(name), ty));
    }
    if name == DEPTH {
        return resolved(&Aov::Distance, class);
    }
    let image = Aov::from_name(name);
    let ty = image.renderer_type().ok_or_else(|| no_such_image(class, name))?;
    Ok((image, ty))
}

/// Returns the type of the image of a class's output; `Some(None)` if no image can have it.
fn output_type(class: &Class, name: &str) -> Option<Option<AovType>> {
    let (_, ty) = class.outputs.iter().find(|(output, _)| output == name)?;
    Some(image_type(ty))
}

/// Returns the type of an image of values; `None` if no image has such values.
fn image_type(ty: &ParameterType) -> Option<AovType> {
    match ty {
        ParameterType::Scalar(Scalar::F32) => Some(AovType::Float),
        ParameterType::Scalar(Scalar::I32 | Scalar::U32) => Some(AovType::Integer),
        ParameterType::Scalar(Scalar::Bool) => Some(AovType::Bool),
        ParameterType::Color => Some(AovType::Color),
        ParameterType::Vector(Scalar::F32, count) => Some(AovType::Vector(*count)),
        ParameterType::Vector(_, count) => Some(AovType::IntegerVector(*count)),
        ParameterType::Matrix(..)
        | ParameterType::Struct(..)
        | ParameterType::Array(..)
        | ParameterType::Buffer(_)
        | ParameterType::Reference(_)
        | ParameterType::Textured(_) => None,
    }
}

/// True for types of images that a denoiser reads.
fn is_triple(ty: AovType) -> bool {
    matches!(ty, AovType::Color | AovType::Vector(3))
}

fn no_such_image(class: &Class, name: &str) -> Diagnostic {
    let own = || {
        let outputs = class.outputs.iter().filter(|(_, ty)| image_type(ty).is_some());
        outputs.map(|(name, _)| name.as_str())
    };
    let of_renderer: Vec<Aov> =
        Aov::ALL.into_iter().filter(|aov| aov.renderer_type().is_some()).collect();
    let of_renderer: Vec<&str> = of_renderer.iter().map(Aov::name).collect();
    let class_name = &class.name;
    let message = format!(
        "`{class_name}` has no output `{name}`, and the renderer makes no image of this name"
    );
    let mut diagnostic = Diagnostic::new(codes::NO_SUCH_IMAGE, message);
    let known = own().chain(of_renderer.iter().copied()).chain([DEPTH]);
    if let Some(near) = most_similar(name, known) {
        diagnostic = diagnostic.help(format!("did you mean `{near}`?"));
    }
    let own: Vec<&str> = own().collect();
    let own = if own.is_empty() { "none".to_owned() } else { own.join(", ") };
    diagnostic
        .help(format!("outputs of `{class_name}`: {own}"))
        .help(format!("images of the renderer: {}", of_renderer.join(", ")))
}

fn no_image_of_type(class: &Class, name: &str) -> Diagnostic {
    let outputs = class.outputs.iter().find(|(output, _)| output == name);
    let ty = outputs.map_or(String::new(), |(_, ty)| type_name(ty));
    let message =
        format!("the output `{name}` of `{}` is of type `{ty}`, which no image has", class.name);
    Diagnostic::new(codes::NO_SUCH_IMAGE, message).help(
        "images show numbers, truth values, colours and vectors: declare an output for each part",
    )
}
