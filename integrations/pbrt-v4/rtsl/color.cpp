#include <pbrt/rtsl/color.h>

#include <pbrt/textures.h>
#include <pbrt/util/colorspace.h>
#include <pbrt/util/sampling.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace pbrt::rtsl {

// RTSL's colours are linear, with the primaries of Rec. 709, which sRGB shares.
static const RGBColorSpace &ColorSpace() {
    return *RGBColorSpace::sRGB;
}

/// What of the light of a wavelength arrives in each of red, green and blue, where white light is (1, 1, 1) in all.
static RGB ResponseToReflected(Float lambda) {
    Float illuminant = ColorSpace().illuminant(lambda);
    XYZ xyz(Spectra::X()(lambda), Spectra::Y()(lambda), Spectra::Z()(lambda));
    return illuminant * ColorSpace().ToRGB(xyz);
}

namespace {

/// The basis at every nanometre.
class BasisTable {
  public:
    static const BasisTable &Get() {
        static const BasisTable table;
        return table;
    }

    RGB At(Float lambda) const {
        int index = std::lround(lambda) - int(Lambda_min);
        return rows[Clamp(index, 0, Size - 1)];
    }

  private:
    static constexpr int Size = int(Lambda_max) - int(Lambda_min) + 1;

    BasisTable() {
        SetShares();
        SquareMatrix<3> mix = Mix();
        for (RGB &row : rows)
            row = Mul<RGB>(mix, row);
    }

    // pbrt's smooth spectra of the primaries, as shares of their sum.
    void SetShares() {
        RGBAlbedoSpectrum red(ColorSpace(), RGB(1, 0, 0));
        RGBAlbedoSpectrum green(ColorSpace(), RGB(0, 1, 0));
        RGBAlbedoSpectrum blue(ColorSpace(), RGB(0, 0, 1));
        for (int i = 0; i < Size; ++i) {
            Float lambda = Lambda_min + i;
            RGB row(red(lambda), green(lambda), blue(lambda));
            rows[i] = row / (row.r + row.g + row.b);
        }
    }

    // How the shares are mixed so that each has its colour. The sum stays 1, since white has the right colour already.
    SquareMatrix<3> Mix() const {
        Float colors[3][3] = {};
        RGB white(0, 0, 0);
        for (int i = 0; i < Size; ++i) {
            RGB response = ResponseToReflected(Lambda_min + i);
            white += response;
            for (int channel = 0; channel < 3; ++channel)
                for (int share = 0; share < 3; ++share)
                    colors[channel][share] += response[channel] * rows[i][share];
        }
        for (int channel = 0; channel < 3; ++channel)
            for (int share = 0; share < 3; ++share)
                colors[channel][share] /= white[channel];
        return Transpose(InvertOrExit(SquareMatrix<3>(colors)));
    }

    std::array<RGB, Size> rows;
};

/// Wavelengths at which textures are asked for their colours, and what each counts.
class ColorProbes {
  public:
    static constexpr int Count = 8;

    static const ColorProbes &Get() {
        static const ColorProbes probes;
        return probes;
    }

    template <typename F>
    RGB Measure(F spectrumAt) const {
        RGB sum(0, 0, 0);
        for (const Probe &probe : probes) {
            SampledSpectrum values = spectrumAt(probe.lambda);
            for (int i = 0; i < NSpectrumSamples; ++i)
                sum += values[i] * probe.weights[i];
        }
        return sum;
    }

  private:
    struct Probe {
        SampledWavelengths lambda;
        std::array<RGB, NSpectrumSamples> weights;
    };

    ColorProbes() {
        RGB white(0, 0, 0);
        for (int i = 0; i < Count; ++i) {
            Probe &probe = probes[i];
            probe.lambda = SampledWavelengths::SampleVisible((i + 0.5f) / Count / NSpectrumSamples);
            SampledSpectrum density = probe.lambda.PDF();
            for (int j = 0; j < NSpectrumSamples; ++j) {
                probe.weights[j] = ResponseToReflected(probe.lambda[j]) / density[j];
                white += probe.weights[j];
            }
        }
        for (Probe &probe : probes)
            for (RGB &weight : probe.weights)
                for (int channel = 0; channel < 3; ++channel)
                    weight[channel] /= white[channel];
    }

    std::array<Probe, Count> probes;
};

}  // namespace

ColorBasis::ColorBasis(const SampledWavelengths &lambda) {
    const BasisTable &table = BasisTable::Get();
    for (int i = 0; i < NSpectrumSamples; ++i) {
        RGB row = table.At(lambda[i]);
        red[i] = row.r;
        green[i] = row.g;
        blue[i] = row.b;
    }
}

SampledSpectrum ColorBasis::operator()(RGB color) const {
    SampledSpectrum sum = color.r * red + color.g * green + color.b * blue;
    // Of saturated colours there may be a little less than nothing at some wavelengths.
    for (int i = 0; i < NSpectrumSamples; ++i)
        sum[i] = std::max<Float>(sum[i], 0);
    return sum;
}

/// What pbrt scales spectra of lights by, so that white of 1 has luminance 1.
static Float RadianceScale() {
    static const Float scale = 1 / SpectrumToPhotometric(&ColorSpace().illuminant);
    return scale;
}

SampledSpectrum Radiance(RGB color, const SampledWavelengths &lambda) {
    RGBIlluminantSpectrum spectrum(ColorSpace(), ClampZero(color));
    return RadianceScale() * spectrum.Sample(lambda);
}

Float GreatestRadiance(RGB color) {
    return RadianceScale() * RGBIlluminantSpectrum(ColorSpace(), ClampZero(color)).MaxValue();
}

RGB ColorOf(RGB color, const RGBColorSpace &space) {
    if (space == ColorSpace())
        return color;
    return Mul<RGB>(ConvertRGBColorSpace(space, ColorSpace()), color);
}

RGB ColorOf(Spectrum spectrum, SpectrumType type) {
    RGB sum(0, 0, 0), white(0, 0, 0);
    Float luminance = 0;
    for (Float lambda = Lambda_min; lambda <= Lambda_max; ++lambda) {
        Float value = spectrum(lambda);
        RGB response = ResponseToReflected(lambda);
        if (type == SpectrumType::Illuminant)
            response /= ColorSpace().illuminant(lambda);
        sum += value * response;
        white += response;
        luminance += value * Spectra::Y()(lambda);
    }
    if (type == SpectrumType::Illuminant) {
        RGB weights = ColorSpace().LuminanceVector();
        Float sumLuminance = sum.r * weights.r + sum.g * weights.g + sum.b * weights.b;
        return sumLuminance > 0 ? sum / sumLuminance : sum;
    }
    return RGB(sum.r / white.r, sum.g / white.g, sum.b / white.b);
}

RGB ColorOf(SpectrumTexture texture, const TextureEvalContext &context) {
    if (const RtslSpectrumTexture *own = texture.CastOrNullptr<RtslSpectrumTexture>())
        return own->Color(context);
    return ColorProbes::Get().Measure([&](const SampledWavelengths &lambda) {
        return UniversalTextureEvaluator()(texture, context, lambda);
    });
}

}  // namespace pbrt::rtsl
