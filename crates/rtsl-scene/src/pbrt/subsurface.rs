//! Materials whose light passes through a medium, as values of the class `Subsurface`: coefficients of media by name,
//! and the part of light that a half-space of a medium returns.

use std::f64::consts::{LN_2, PI};

use rtsl::{Diagnostic, Numbers, Scalar, Value, diagnostic_codes as codes};
use rtsl_math::{exponential, logarithm_of_two};

use super::images::Images;
use super::translation::Translation;
use crate::description::Entity;
use crate::reader::{Parameter, SceneFiles, Values};
use crate::spectrum::Wavelengths;

/// The parameters of the format that are read here. The mean free path and the scale of coefficients only determine how
/// far light gets before it leaves, which the class leaves out.
pub const PARAMETERS: &[&str] = &["name", "g", "scale", "mfp"];

/// The places of the table of albedos, and the samples of depths and of distances for each.
const PLACES: usize = 33;
const DEPTHS: usize = 64;
const FIRST_DISTANCE: f64 = 2.5e-3;
const DISTANCE_RATIO: f64 = 1.1;
const LAST_DISTANCE: f64 = 200.0;

/// The values of the class.
pub fn values(
    entity: &Entity,
    _: SceneFiles<'_>,
    _: &mut Images,
) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
    let mut values = Vec::new();
    let mut mean_cosine = entity.number("g").unwrap_or(0.0);
    let mut coefficients = constants(entity);
    if let Some((name, parameter)) = medium(entity) {
        let Some((_, scattering, absorption)) = MEDIA.iter().find(|(other, ..)| *other == name)
        else {
            return Err(unknown(name, parameter));
        };
        coefficients = Some([scattering, absorption].map(|it| it.map(f64::from)));
        // These are reduced coefficients.
        mean_cosine = 0.0;
    }
    let eta = entity.number("eta").unwrap_or(1.33).clamp(1.0, 10.0);
    let table = albedos(mean_cosine.clamp(-0.999, 0.999), eta);
    if let Some(coefficients) = coefficients {
        let parts = effective_parts(coefficients, &table);
        let color =
            |parts: [f64; 3]| Value::List(parts.map(|part| Value::Float(part as f32)).to_vec());
        values.push(("sigmaS".to_owned(), color(parts)));
        values.push(("sigmaA".to_owned(), color(parts.map(|part| 1.0 - part))));
    }
    let words: Vec<u32> = table.into_iter().map(|albedo| (albedo as f32).to_bits()).collect();
    values.push(("albedos".to_owned(), Value::Numbers(Numbers::from_words(Scalar::F32, words))));
    Ok(values)
}

/// Keeps of the descriptions of a medium the one that counts: its name, its coefficients, or its reflectance. Media are
/// at least as dense as what surrounds them.
pub fn choose_medium(material: &mut Translation<'_>) {
    if material.number("eta", 1.33) < 1.0 {
        material.replace("eta", vec![1.0]);
    }
    let has_coefficients = ["sigmaA", "sigmaS"].iter().any(|name| material.find(name).is_some());
    if medium(material.entity()).is_some() || constants(material.entity()).is_some() {
        for name in ["sigmaA", "sigmaS", "reflectance"] {
            material.take(name);
        }
    } else if has_coefficients {
        material.take("reflectance");
    }
}

fn medium(entity: &Entity) -> Option<(&str, &Parameter)> {
    entity.text("name").filter(|(name, _)| !name.is_empty())
}

/// The scattering and absorption of a medium, if they are colours; those of milk if nothing is given.
fn constants(entity: &Entity) -> Option<[[f64; 3]; 2]> {
    let is_given = |name: &&str| entity.parameter(name).is_some();
    if !["sigma_s", "sigma_a", "reflectance", "name"].iter().any(is_given) {
        return Some([[2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014]]);
    }
    let color = |name: &str| match &entity.parameter(name)?.values {
        Values::Numbers(numbers) => numbers.as_slice().try_into().ok(),
        Values::Booleans(_) | Values::Texts(_) | Values::Buffer(_) => None,
    };
    Some([color("sigma_s")?, color("sigma_a")?])
}

/// Returns the parts of scattering in extinction by which a half-space of a medium has its colour, which is not that of
/// the coefficients' own red, green and blue: what little is absorbed of red light is next to orange, of which more is.
/// The parts are computed at all wavelengths, for smooth spectra of the coefficients.
fn effective_parts(coefficients: [[f64; 3]; 2], table: &[f64]) -> [f64; 3] {
    let wavelengths = Wavelengths::default();
    let [scattering, absorption] = coefficients.map(|color| wavelengths.spectrum_of(color));
    let albedo = |wavelength: f64| {
        let scattered = scattering.at(wavelength);
        let extinction = scattered + absorption.at(wavelength);
        albedo_of(table, if extinction > 0.0 { scattered / extinction } else { 0.0 })
    };
    wavelengths.surface_color(albedo).map(|albedo| part_of(table, albedo))
}

/// The part of extinction that is scattering at the end of the table's places.
fn whole() -> f64 {
    1.0 - exponential(-8.0)
}

/// The albedo of a part of scattering, between those of the table, as the class computes it.
fn albedo_of(table: &[f64], part: f64) -> f64 {
    let last = table.len() - 1;
    let place =
        -0.125 * LN_2 * logarithm_of_two(1.0 - part.clamp(0.0, 1.0) * whole()) * last as f64;
    let below = (place.max(0.0) as usize).min(last - 1);
    table[below] + (table[below + 1] - table[below]) * (place - below as f64).clamp(0.0, 1.0)
}

/// The part of scattering that has an albedo; the nearest if none has it.
fn part_of(table: &[f64], albedo: f64) -> f64 {
    let last = table.len() - 1;
    let below = table.partition_point(|it| *it < albedo).clamp(1, last) - 1;
    let rise = table[below + 1] - table[below];
    let between = if rise > 0.0 { ((albedo - table[below]) / rise).clamp(0.0, 1.0) } else { 0.0 };
    (1.0 - exponential(-8.0 * (below as f64 + between) / last as f64)) / whole()
}

fn unknown(name: &str, parameter: &Parameter) -> Box<Diagnostic> {
    let message = format!("`name` is `{name}`, which is no medium");
    let names: Vec<&str> = MEDIA.iter().map(|(name, ..)| *name).collect();
    let diagnostic = Diagnostic::new(codes::WRONG_VALUE, message);
    let help = format!("expected one of {}, as they are written here", names.join(", "));
    Box::new(diagnostic.at(parameter.values_span, "").help(help))
}

/// The parts of light that enters a half-space of a medium and leaves it again, for parts of scattering in extinction
/// that approach 1 exponentially.
fn albedos(mean_cosine: f64, eta: f64) -> Vec<f64> {
    let interface = Interface::new(eta);
    let albedo = |place: usize| {
        let part = (1.0 - exponential(-8.0 * place as f64 / (PLACES - 1) as f64)) / whole();
        Medium { scattering: part, absorption: 1.0 - part, mean_cosine }.albedo(&interface)
    };
    (0..PLACES).map(albedo).collect()
}

/// A polished interface of a medium.
struct Interface {
    eta: f64,
    /// Integrals of what it reflects inside, times the cosine and times its square.
    moments: [f64; 2],
}

impl Interface {
    fn new(eta: f64) -> Self {
        const STEPS: usize = 1000;
        let mut interface = Interface { eta, moments: [0.0; 2] };
        for step in 0..STEPS {
            let cosine = (step as f64 + 0.5) / STEPS as f64;
            let reflected = interface.reflected_inside(cosine) / STEPS as f64;
            interface.moments[0] += reflected * cosine;
            interface.moments[1] += reflected * cosine * cosine;
        }
        interface
    }

    /// The part that it reflects of light that meets it from inside at a cosine.
    fn reflected_inside(&self, cosine: f64) -> f64 {
        let sine2 = (1.0 - cosine * cosine) * self.eta * self.eta;
        if sine2 >= 1.0 {
            return 1.0;
        }
        let beyond = (1.0 - sine2).sqrt();
        let across = (self.eta * cosine - beyond) / (self.eta * cosine + beyond);
        let along = (cosine - self.eta * beyond) / (cosine + self.eta * beyond);
        0.5 * (across * across + along * along)
    }
}

/// A medium with an extinction of 1.
struct Medium {
    scattering: f64,
    absorption: f64,
    mean_cosine: f64,
}

impl Medium {
    /// The integral over the plane of the light that leaves at a distance from where it enters.
    fn albedo(&self, interface: &Interface) -> f64 {
        let depths: [f64; DEPTHS] = std::array::from_fn(|index| {
            -LN_2 * logarithm_of_two(1.0 - (index as f64 + 0.5) / DEPTHS as f64)
        });
        let ring = |distance: f64| {
            let leaving = self.scattered_often(interface, &depths, distance)
                + self.scattered_once(interface, &depths, distance);
            2.0 * PI * distance * leaving
        };
        let (mut sum, mut distance, mut before) = (0.0, 0.0, 0.0);
        let mut next = FIRST_DISTANCE;
        while distance < LAST_DISTANCE {
            let after = ring(next);
            sum += 0.5 * (before + after) * (next - distance);
            (distance, before, next) = (next, after, next * DISTANCE_RATIO);
        }
        sum.clamp(0.0, 1.0)
    }

    /// Light from the beam below the interface that is scattered several times: by diffusion, whose sources are the
    /// beam and its image above the interface (Habel, Christensen and Jarosz 2013).
    fn scattered_often(&self, interface: &Interface, depths: &[f64], distance: f64) -> f64 {
        let scattering = self.scattering * (1.0 - self.mean_cosine);
        let extinction = self.absorption + scattering;
        let albedo = scattering / extinction;
        let diffusion = (2.0 * self.absorption + scattering) / (3.0 * extinction * extinction);
        let transport = (self.absorption / diffusion).sqrt();
        let [first, second] = interface.moments;
        let extrapolated = 2.0 * diffusion * (1.0 + 3.0 * second) / (1.0 - 2.0 * first).max(1e-9);
        let [of_fluence, of_flux] = [0.25 * (1.0 - 2.0 * first), 0.5 * (1.0 - 3.0 * second)];
        let source = |depth: f64| {
            let image = -depth - 2.0 * extrapolated;
            let [to_source, to_image] =
                [depth, image].map(|height| (distance * distance + height * height).sqrt());
            let fading = [to_source, to_image].map(|length| exponential(-transport * length));
            let fluence = (fading[0] / to_source - fading[1] / to_image) / (4.0 * PI * diffusion);
            let flux_of = |height: f64, length: f64, fading: f64| {
                height * (1.0 + transport * length) * fading / (length * length * length)
            };
            let flux = (flux_of(depth, to_source, fading[0]) - flux_of(image, to_image, fading[1]))
                / (4.0 * PI);
            // Grosjean's correction of light that leaves near where it enters.
            let kept = 1.0 - exponential(-2.0 * extinction * (to_source + depth));
            kept * albedo * albedo * (fluence * of_fluence + flux * of_flux)
        };
        depths.iter().map(|depth| source(depth / extinction)).sum::<f64>() / depths.len() as f64
    }

    /// Light that is scattered once, below the depth above which it cannot leave.
    fn scattered_once(&self, interface: &Interface, depths: &[f64], distance: f64) -> f64 {
        let least = distance * (interface.eta * interface.eta - 1.0).max(0.0).sqrt();
        let g = self.mean_cosine;
        let event = |depth: f64| {
            let depth = least + depth;
            let length = (distance * distance + depth * depth).sqrt();
            let cosine = depth / length;
            let root = 1.0 + g * g + 2.0 * g * cosine;
            let phase = (1.0 - g * g) / (4.0 * PI * root * root.sqrt());
            let leaving = 1.0 - interface.reflected_inside(cosine);
            exponential(-(length + least)) / (length * length) * phase * leaving * cosine
        };
        let sum: f64 = depths.iter().map(|depth| event(*depth)).sum();
        self.scattering * sum / depths.len() as f64
    }
}

/// Media: their names, reduced scattering and absorption per millimetre, red, green and blue. Up to `Wholemilk` they
/// are from Jensen, Marschner, Levoy and Hanrahan, "A Practical Model for Subsurface Light Transport" (SIGGRAPH 2001);
/// the others from Narasimhan et al., "Acquiring Scattering Properties of Participating Media by Dilution" (SIGGRAPH
/// 2006).
#[rustfmt::skip]
const MEDIA: &[(&str, [f32; 3], [f32; 3])] = &[
    ("Apple", [2.29, 2.39, 1.97], [0.003, 0.0034, 0.046]),
    ("Chicken1", [0.15, 0.21, 0.38], [0.015, 0.077, 0.19]),
    ("Chicken2", [0.19, 0.25, 0.32], [0.018, 0.088, 0.2]),
    ("Cream", [7.38, 5.47, 3.15], [0.0002, 0.0028, 0.0163]),
    ("Ketchup", [0.18, 0.07, 0.03], [0.061, 0.97, 1.45]),
    ("Marble", [2.19, 2.62, 3.0], [0.0021, 0.0041, 0.0071]),
    ("Potato", [0.68, 0.7, 0.55], [0.0024, 0.009, 0.12]),
    ("Skimmilk", [0.7, 1.22, 1.9], [0.0014, 0.0025, 0.0142]),
    ("Skin1", [0.74, 0.88, 1.01], [0.032, 0.17, 0.48]),
    ("Skin2", [1.09, 1.59, 1.79], [0.013, 0.07, 0.145]),
    ("Spectralon", [11.6, 20.4, 14.9], [0.0, 0.0, 0.0]),
    ("Wholemilk", [2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014]),
    ("Lowfat Milk", [0.89187, 1.5136, 2.532], [0.002875, 0.00575, 0.0115]),
    ("Reduced Milk", [2.4858, 3.1669, 4.5214], [0.0025556, 0.0051111, 0.012778]),
    ("Regular Milk", [4.5513, 5.8294, 7.136], [0.0015333, 0.0046, 0.019933]),
    ("Espresso", [0.72378, 0.84557, 1.0247], [4.7984, 6.5751, 8.8493]),
    ("Mint Mocha Coffee", [0.31602, 0.38538, 0.48131], [3.772, 5.8228, 7.82]),
    ("Lowfat Soy Milk", [0.30576, 0.34233, 0.61664], [0.0014375, 0.0071875, 0.035937]),
    ("Regular Soy Milk", [0.59223, 0.73866, 1.4693], [0.0019167, 0.0095833, 0.065167]),
    ("Lowfat Chocolate Milk", [0.64925, 0.83916, 1.1057], [0.0115, 0.0368, 0.1564]),
    ("Regular Chocolate Milk", [1.4585, 2.1289, 2.9527], [0.010063, 0.043125, 0.14375]),
    ("Coke", [8.9053e-05, 8.372e-05, 0.0], [0.10014, 0.16503, 0.2468]),
    ("Pepsi", [6.1697e-05, 4.2564e-05, 0.0], [0.091641, 0.14158, 0.20729]),
    ("Sprite", [6.0306e-06, 6.4139e-06, 6.5504e-06], [0.001886, 0.0018308, 0.0020025]),
    ("Gatorade", [0.0024574, 0.003007, 0.0037325], [0.024794, 0.019289, 0.008878]),
    ("Chardonnay", [1.7982e-05, 1.3758e-05, 1.2023e-05], [0.010782, 0.011855, 0.023997]),
    ("White Zinfandel", [1.7501e-05, 1.9069e-05, 1.288e-05], [0.012072, 0.016184, 0.019843]),
    ("Merlot", [2.1129e-05, 0.0, 0.0], [0.11632, 0.25191, 0.29434]),
    ("Budweiser Beer", [2.4356e-05, 2.4079e-05, 1.0564e-05], [0.011492, 0.024911, 0.057786]),
    ("Coors Light Beer", [5.0922e-05, 4.301e-05, 0.0], [0.006164, 0.013984, 0.034983]),
    ("Clorox", [0.0024035, 0.0031373, 0.003991], [0.0033542, 0.014892, 0.026297]),
    ("Apple Juice", [0.00013612, 0.00015836, 0.000227], [0.012957, 0.023741, 0.052184]),
    ("Cranberry Juice", [0.00010402, 0.00011646, 7.8139e-05], [0.039437, 0.094223, 0.12426]),
    ("Grape Juice", [5.382e-05, 0.0, 0.0], [0.10404, 0.23958, 0.29325]),
    ("Ruby Grapefruit Juice", [0.011002, 0.010927, 0.011036], [0.085867, 0.18314, 0.25262]),
    ("White Grapefruit Juice", [0.22826, 0.23998, 0.32748], [0.0138, 0.018831, 0.056781]),
    ("Shampoo", [0.0007176, 0.0008303, 0.0009016], [0.014107, 0.045693, 0.061717]),
    ("Strawberry Shampoo", [0.00015671, 0.00015947, 1.518e-05], [0.01449, 0.05796, 0.075823]),
    ("Head & Shoulders Shampoo", [0.023805, 0.028804, 0.034306], [0.084621, 0.15688, 0.20365]),
    ("Lemon Tea Powder", [0.040224, 0.045264, 0.051081], [2.4288, 4.5757, 7.2127]),
    ("Orange Powder", [0.00015617, 0.00017482, 0.0001762], [0.001449, 0.003441, 0.007863]),
    ("Pink Lemonade Powder", [0.00012103, 0.00013073, 0.00012528], [0.001165, 0.002366, 0.003195]),
    ("Cappuccino Powder", [1.8436, 2.5851, 2.1662], [35.844, 49.547, 61.084]),
    ("Salt Powder", [0.027333, 0.032451, 0.031979], [0.28415, 0.3257, 0.34148]),
    ("Sugar Powder", [0.00022272, 0.00025513, 0.000271], [0.012638, 0.031051, 0.050124]),
    ("Suisse Mocha Powder", [2.7979, 3.5452, 4.3365], [17.502, 27.004, 35.433]),
    ("Pacific Ocean Surface Water", [0.0001764, 0.00032095, 0.00019617], [0.031845, 0.031324, 0.030147]),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn media_return_more_the_less_they_absorb() {
        for (mean_cosine, eta) in [(0.0, 1.33), (0.8, 1.5), (-0.2, 1.6)] {
            let table = albedos(mean_cosine, eta);
            assert!(table[0].abs() < 1e-12, "{table:?}");
            assert!(table.windows(2).all(|two| two[0] < two[1] || two[1] == 1.0), "{table:?}");
            let last = table[PLACES - 1];
            // Diffusion is an approximation.
            assert!((0.8..=1.0).contains(&last), "{last}");
        }
    }

    /// Parts and albedos are each other's.
    #[test]
    fn parts_have_their_albedos() {
        let table = albedos(0.0, 1.33);
        for part in [0.0, 0.1, 0.5, 0.9, 0.99, 0.999] {
            let found = part_of(&table, albedo_of(&table, part));
            assert!((found - part).abs() < 1e-9, "{part} {found}");
        }
    }

    /// A plane of skin with these albedos agrees with pbrt's picture of it within 0.3 %. The albedo for red of the
    /// coefficients' own red is a fifth greater.
    #[test]
    fn skin_has_the_colour_of_its_spectrum() {
        let table = albedos(0.0, 1.33);
        let (_, scattering, absorption) = MEDIA.iter().find(|(name, ..)| *name == "Skin1").unwrap();
        let parts = effective_parts([scattering, absorption].map(|it| it.map(f64::from)), &table);
        let found = parts.map(|part| albedo_of(&table, part));
        for (found, expected) in found.into_iter().zip([0.3612, 0.2153, 0.1132]) {
            assert!((found - expected).abs() < 1e-3, "{found} {expected}");
        }
        assert!(albedo_of(&table, 0.74 / 0.772) > 1.2 * found[0]);
    }

    /// The sums of pbrt's profiles for media of these albedos, on its own distances.
    #[test]
    fn media_return_what_pbrt_says() {
        let interface = Interface::new(1.33);
        for (part, expected) in [(0.5, 0.0665), (0.9, 0.2972), (0.99, 0.6765), (0.999, 0.9029)] {
            let medium = Medium { scattering: part, absorption: 1.0 - part, mean_cosine: 0.0 };
            let found = medium.albedo(&interface);
            assert!((found - expected).abs() < 0.015 * expected, "{part}: {found}");
        }
    }

    /// Light that is never scattered back by a forward scatterer stays longer and is absorbed.
    #[test]
    fn media_that_scatter_forwards_return_less() {
        let [even, forwards] = [0.0, 0.8].map(|g| albedos(g, 1.33));
        assert!((1..PLACES - 1).all(|place| forwards[place] < even[place]));
    }
}
