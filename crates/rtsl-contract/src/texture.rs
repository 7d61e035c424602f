//! Contracts of textures: a valid value everywhere, for any filter width.

use glam::Vec3;
use rtsl::{Method, Role};

use crate::contract::Contract;
use crate::rays::Rays;
use crate::report::Finding;
use crate::statistics::{Mean, normal_quantile, significance};
use crate::stop::Stop;
use crate::subject::Subject;
use crate::tally::Tally;

const LOOKUPS: u64 = 4096;
/// Widths of filters in texture coordinates.
const WIDTHS: [f32; 5] = [0.0, 1e-6, 0.01, 1.0, 1e6];
/// The width that counts as wide, and the sides of the squares over which means are taken.
const WIDE: f32 = 4.0;
const SIDES: [f32; 2] = [16.0, 1.0];

/// Checks a texture.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(subject: &Subject<'_>) -> Result<Vec<Finding>, Stop> {
    let mut values = Tally::new(Contract::TextureValues);
    let mut filter = Tally::new(Contract::TextureFilter);
    let mut reason = "the class has no lookup";
    if subject.has(Method::Lookup) {
        for width in WIDTHS {
            check_values(subject, width, &mut values)?;
        }
        reason = "the texture does not filter: wide lookups are as narrow ones";
        check_filter(subject, &mut filter)?;
    }
    Ok(vec![values.finish(reason), filter.finish(reason)])
}

fn check_values(subject: &Subject<'_>, width: f32, tally: &mut Tally) -> Result<(), Stop> {
    /// Scales of texture coordinates, near and far, including integers.
    const SCALES: [f32; 4] = [1.0, 20.0, 1e5, 0.0];
    let stream = subject.stream(Contract::TextureValues);
    let mut rays = subject.rays(Role::Texture, stream, 0..LOOKUPS);
    let place = |item: u64| {
        let scaled = SCALES[(item % 4) as usize] * (2.0 * stream.vector(item) - 1.0);
        if item.is_multiple_of(5) { scaled.round() } else { scaled }
    };
    rays.set_vectors("rt_TextureUVW", (0..LOOKUPS).map(place));
    rays.set_vectors("rt_HitPoint", (0..LOOKUPS).map(place));
    rays.set_pairs("rt_TextureUV", (0..LOOKUPS).map(|item| place(item).truncate()));
    set_filter(&mut rays, width);
    subject.call(Method::Lookup, &mut rays)?;
    let colors = rays.vectors("rt_TextureColor");
    for (ray, color) in colors.into_iter().enumerate() {
        let value = rays.floats("rt_FloatTextureValue")[ray];
        let message = || format!("lookup gives colour {color} and value {value}");
        if tally.test(color.is_finite() && value.is_finite(), message) {
            tally.set_inputs(subject.inputs(Method::Lookup, &rays, ray)?);
        }
    }
    Ok(())
}

/// Checks that wide lookups have the mean of narrow ones and vary less: over a large square or, for images that do not
/// repeat, over the square of one image.
fn check_filter(subject: &Subject<'_>, tally: &mut Tally) -> Result<(), Stop> {
    let mut found = Vec::new();
    for side in SIDES {
        let (narrow, wide) = (lookups(subject, side, 0.0)?, lookups(subject, side, WIDE)?);
        if narrow != wide {
            found.push(Filtered { side, narrow: mean(&narrow), wide: mean(&wide) });
        }
    }
    if let [first, ..] = &found[..] {
        let holds = found.iter().any(Filtered::tends_to_the_mean);
        tally.test(holds, || first.to_string());
    }
    Ok(())
}

/// Lookups in a square, with narrow filters and with wide ones.
struct Filtered {
    side: f32,
    narrow: Mean,
    wide: Mean,
}

impl Filtered {
    fn tends_to_the_mean(&self) -> bool {
        let Filtered { narrow, wide, .. } = self;
        let chance = normal_quantile(significance(1)) * (narrow.deviation() + wide.deviation());
        let range = narrow.mean().abs().max(wide.mean().abs());
        let is_mean = (narrow.mean() - wide.mean()).abs() <= chance + 0.02 * range + 1e-3;
        is_mean && wide.deviation() <= 1.1 * narrow.deviation() + 1e-6
    }
}

impl std::fmt::Display for Filtered {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Filtered { side, narrow, wide } = self;
        let spread = |mean: &Mean| mean.deviation() * (LOOKUPS as f64).sqrt();
        write!(
            f,
            "lookups between 0 and {side} have the mean {:.4} and differ by {:.4} from it; with filters {WIDE} wide these are {:.4} and {:.4}",
            narrow.mean(),
            spread(narrow),
            wide.mean(),
            spread(wide)
        )
    }
}

fn mean(colors: &[Vec3]) -> Mean {
    let mut mean = Mean::default();
    colors.iter().for_each(|it| mean.add(f64::from(it.element_sum()) / 3.0));
    mean
}

fn lookups(subject: &Subject<'_>, side: f32, width: f32) -> Result<Vec<Vec3>, Stop> {
    let stream = subject.stream(Contract::TextureFilter);
    let mut rays = subject.rays(Role::Texture, stream, 0..LOOKUPS);
    let place = |item| side * stream.vector(item);
    rays.set_vectors("rt_TextureUVW", (0..LOOKUPS).map(place));
    rays.set_vectors("rt_HitPoint", (0..LOOKUPS).map(place));
    rays.set_pairs("rt_TextureUV", (0..LOOKUPS).map(|item| place(item).truncate()));
    set_filter(&mut rays, width);
    subject.call(Method::Lookup, &mut rays)?;
    Ok(rays.vectors("rt_TextureColor"))
}

/// Surface parameters are equal to texture coordinates here.
fn set_filter(rays: &mut Rays, width: f32) {
    rays.fill("rt_du", width);
    rays.fill("rt_dv", width);
    for (variable, value) in
        [("rt_dsdu", 1.0), ("rt_dtdv", 1.0), ("rt_dsdv", 0.0), ("rt_dtdu", 0.0)]
    {
        rays.fill(variable, value);
    }
}
