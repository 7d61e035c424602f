// From RTSL's colours to pbrt's spectra and back.

#ifndef PBRT_RTSL_COLOR_H
#define PBRT_RTSL_COLOR_H

#include <pbrt/pbrt.h>

#include <pbrt/paramdict.h>
#include <pbrt/util/color.h>
#include <pbrt/util/spectrum.h>

#include <pbrt/base/texture.h>

namespace pbrt::rtsl {

/// Three reflectances, of red, green and blue, at the wavelengths of a path. All other colours are sums of them, so that
/// converting is linear: it does not matter in what steps a shader computes a colour. Their sum is 1 at every wavelength, and
/// under the standard illuminant each has the colour that it stands for.
class ColorBasis {
  public:
    ColorBasis() = default;
    ColorBasis(const SampledWavelengths &lambda);

    SampledSpectrum operator()(RGB color) const;

  private:
    SampledSpectrum red, green, blue;
};

/// Radiance of a colour, as pbrt's own lights have it: (1, 1, 1) has luminance 1.
SampledSpectrum Radiance(RGB color, const SampledWavelengths &lambda);

/// The largest value of that at any wavelength.
Float GreatestRadiance(RGB color);

/// The colour of a spectrum that a scene gives. That of a light has luminance 1.
RGB ColorOf(Spectrum spectrum, SpectrumType type);

/// A colour of another colour space.
RGB ColorOf(RGB color, const RGBColorSpace &space);

/// The colour of a texture of pbrt's: of reflectances, under the standard illuminant.
RGB ColorOf(SpectrumTexture texture, const TextureEvalContext &context);

}  // namespace pbrt::rtsl

#endif  // PBRT_RTSL_COLOR_H
