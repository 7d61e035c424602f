//! The numbers of texels: those of pictures are finite, and those that are light at least 0.

use exr::prelude::f16;

use super::picture::{Picture, Samples};

/// The greatest number: means of several such are finite.
const GREATEST: f32 = (1_u128 << 124) as f32;

/// The greatest number of half floats. What was greater is infinite in files of them.
const GREATEST_HALF: f32 = 65504.0;

/// Numbers of a picture that are no light: how many there were of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoLight {
    /// Numbers less than 0.
    pub negative: usize,
    /// Infinite numbers, and those of 2^124 and more.
    pub infinite: usize,
    /// Those that are not a number.
    pub nan: usize,
    /// The number that takes the place of infinite ones, a whole one.
    pub greatest: u128,
}

impl NoLight {
    /// True if all numbers were light.
    pub fn is_none(&self) -> bool {
        [self.negative, self.infinite, self.nan] == [0; 3]
    }
}

impl Picture {
    /// Replaces numbers that are not finite by 0.
    pub(crate) fn make_finite(&mut self) {
        match &mut self.samples {
            Samples::Bytes(_) => {}
            Samples::Halves(halves) => {
                halves.iter_mut().filter(|it| !it.is_finite()).for_each(|it| *it = f16::ZERO);
            }
            Samples::Floats(floats) => {
                floats.iter_mut().filter(|it| !it.is_finite()).for_each(|it| *it = 0.0);
            }
        }
    }

    /// Makes all colours light: numbers that are at least 0 and finite. Negative ones and NaN become 0, and infinite ones
    /// the greatest finite number of the picture, but 65504 at least, the greatest of half floats.
    pub fn limit_to_light(&mut self) -> NoLight {
        let channels = self.channels;
        let found = match &mut self.samples {
            // Codes of numbers from 0 to 1.
            Samples::Bytes(_) => NoLight::default(),
            Samples::Halves(halves) => limit(halves, channels, f16::to_f32, f16::from_f32),
            Samples::Floats(floats) => limit(floats, channels, |it| it, |it| it),
        };
        // What is left is opacity.
        self.make_finite();
        found
    }
}

/// Limits the colours of texels, whose numbers are stored in another form.
fn limit<N: Copy>(
    numbers: &mut [N],
    channels: usize,
    load: impl Fn(N) -> f32,
    store: impl Fn(f32) -> N,
) -> NoLight {
    let colors = if channels == 4 { 3 } else { channels };
    let own = numbers.chunks_exact(channels).flat_map(|texel| &texel[..colors]);
    let finite = own.map(|number| load(*number)).filter(|value| *value < GREATEST);
    let greatest = finite.fold(GREATEST_HALF, f32::max);
    let mut found = NoLight { greatest: greatest as u128, ..NoLight::default() };
    for number in numbers.chunks_exact_mut(channels).flat_map(|texel| &mut texel[..colors]) {
        let value = load(*number);
        let (count, light) = match value {
            GREATEST.. => (&mut found.infinite, greatest),
            0.0.. => continue,
            _ if value.is_nan() => (&mut found.nan, 0.0),
            _ => (&mut found.negative, 0.0),
        };
        *count += 1;
        *number = store(light);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::encoding::Encoding;
    use super::*;

    fn limited(channels: usize, samples: Samples) -> (NoLight, Samples) {
        let width = match &samples {
            Samples::Bytes(it) => it.len(),
            Samples::Halves(it) => it.len(),
            Samples::Floats(it) => it.len(),
        } / channels;
        let encoding = Encoding::Linear;
        let mut picture = Picture { width, height: 1, channels, samples, encoding };
        let found = picture.limit_to_light();
        (found, picture.samples)
    }

    const BAD: [f32; 6] = [-5.0, f32::NAN, 2.0, f32::INFINITY, f32::NEG_INFINITY, 3.0];

    #[test]
    fn numbers_that_are_no_light_become_the_nearest_that_are() {
        let (found, samples) = limited(3, Samples::Floats(BAD.to_vec()));
        let right = [0.0, 0.0, 2.0, GREATEST_HALF, 0.0, 3.0];
        assert_eq!(samples, Samples::Floats(right.to_vec()));
        assert_eq!(found, NoLight { negative: 2, infinite: 1, nan: 1, greatest: 65504 });
        let halves = |numbers: &[f32]| {
            Samples::Halves(numbers.iter().map(|it| f16::from_f32(*it)).collect())
        };
        assert_eq!(limited(1, halves(&BAD)), (found, halves(&right)));
        // A sun that is brighter than half floats can tell is as bright as the brightest of its texels.
        let (found, samples) = limited(1, Samples::Floats(vec![1e6, f32::MAX, f32::INFINITY]));
        assert_eq!((found.infinite, samples), (2, Samples::Floats(vec![1e6; 3])));
    }

    #[test]
    fn opacity_and_what_is_light_stay() {
        let texels = vec![1.0, 0.0, -0.0, -1.0, 2.0, 3.0, 4.0, f32::INFINITY];
        let (found, samples) = limited(4, Samples::Floats(texels.clone()));
        let right = [&texels[..7], &[0.0]].concat();
        assert!(found.is_none() && samples == Samples::Floats(right), "{found:?} {samples:?}");
        assert!(limited(3, Samples::Bytes(vec![0, 1, 255])).0.is_none());
    }
}
