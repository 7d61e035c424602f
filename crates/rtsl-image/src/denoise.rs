//! Denoising by Open Image Denoise, if it is installed.
//!
//! A denoised picture is biased, and its bits depend on the library: this is the only output that may differ between
//! machines.

use rtsl_source::{Diagnostic, diagnostic_codes as codes};

use super::{Aov, AovImage, Image};
use crate::denoiser::{Denoiser, DenoiserError, DenoiserInput};

/// AOVs that help the denoiser to preserve edges and textures.
pub const DENOISER_AOVS: [Aov; 2] = [Aov::Albedo, Aov::Normal];

/// Returns the denoised picture. Of `aovs`, those in [`DENOISER_AOVS`] are used if they have three channels.
///
/// # Errors
/// If the library reports an error.
pub fn denoised(
    denoiser: &Denoiser,
    image: &Image,
    aovs: &[AovImage],
) -> Result<Image, DenoiserError> {
    let find = |aov: Aov| aovs.iter().find(|image| image.aov == aov)?.triples();
    let pixels = denoiser.denoise(&DenoiserInput {
        width: image.width,
        height: image.height,
        color: &image.pixels,
        albedo: find(Aov::Albedo),
        normal: find(Aov::Normal),
    })?;
    Ok(Image { pixels, ..*image })
}

/// The diagnostic of an error.
pub fn denoiser_diagnostic(error: &DenoiserError) -> Diagnostic {
    let diagnostic = Diagnostic::new(codes::NO_DENOISER, error.to_string());
    match error {
        DenoiserError::Missing | DenoiserError::Unusable { .. } => diagnostic.help(
            "install Open Image Denoise, or set `RTSL_OIDN` to its library or to the folder that contains it",
        ),
        DenoiserError::Size { .. } | DenoiserError::Failed(_) => diagnostic,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_has_a_remedy() {
        let text = |error: DenoiserError| {
            let messages = rtsl_source::Messages::one(denoiser_diagnostic(&error));
            messages.to_text(false)
        };
        expect_test::expect![[r#"
            error[E0704]: Open Image Denoise is not installed
             = help: install Open Image Denoise, or set `RTSL_OIDN` to its library or to the folder that contains it

        "#]].assert_eq(&text(DenoiserError::Missing));
        let failed = text(DenoiserError::Failed("out of memory".to_owned()));
        expect_test::expect![[r#"
            error[E0704]: Open Image Denoise: out of memory

        "#]]
        .assert_eq(&failed);
    }
}
