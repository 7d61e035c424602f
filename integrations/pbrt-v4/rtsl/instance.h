// Instances of RTSL classes, with the parameters that a scene gives.

#ifndef PBRT_RTSL_INSTANCE_H
#define PBRT_RTSL_INSTANCE_H

#include <pbrt/pbrt.h>

#include <pbrt/base/texture.h>
#include <pbrt/paramdict.h>
#include <pbrt/util/error.h>

#include <pbrt/rtsl/library.h>

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace pbrt::rtsl {

/// Words of the largest block that textures may change from hit to hit.
constexpr uint32_t MaxTexturedWords = 64;

/// A class's parameters as a scene gives them, and the instance that is made of them.
class Instance {
  public:
    /// What a scene says of an instance.
    struct Source {
        const ParameterDictionary &parameters;
        /// Where textures are found; null where parameters take none.
        const TextureParameterDictionary *textures;
        /// What colours are.
        SpectrumType colors;
        /// Parameters that are pbrt's own.
        std::initializer_list<std::string_view> reserved;
        const FileLoc *loc;
        Allocator alloc;
    };

    /// Ends with an error that names the place where a parameter is unknown, missing, of the wrong type or out of range.
    Instance(const RtslClass &cls, const Source &source);

    Instance(const Instance &) = delete;
    Instance &operator=(const Instance &) = delete;

    const RtslClass &Class() const { return cls; }

    /// The instance, where no texture takes part.
    const uint32_t *Block() const { return block.data(); }

    /// Whether any parameter is a texture's.
    bool IsTextured() const { return !bindings.empty(); }

    /// Makes the instance for a place: `words` has MaxTexturedWords.
    void MakeBlock(const TextureEvalContext &context, uint32_t *words) const;

    /// How many objects it stands for, such as the triangles of a mesh; 1 where the class counts none.
    uint32_t ElementCount() const;

    /// Makes the block of one of these objects.
    std::vector<uint32_t> ElementBlock(uint32_t element) const;

  private:
    /// A parameter that textures set.
    struct Binding {
        const RtslParameter *parameter;
        FloatTexture number;
        SpectrumTexture color;
    };

    void SetAll(const Source &source);
    void Set(const RtslParameter &parameter, const ParsedParameter &given, const Source &source);
    void SetNumbers(const RtslParameter &parameter, const ParsedParameter &given,
                    const Source &source);
    void SetSpectrum(const RtslParameter &parameter, const ParsedParameter &given,
                     const Source &source);
    void Bind(const RtslParameter &parameter, const ParsedParameter &given, const Source &source);
    void SetWords(const RtslParameter &parameter, const std::vector<uint32_t> &words,
                  const ParsedParameter &given);
    void CheckRange(const RtslParameter &parameter, const ParsedParameter &given, Float value) const;
    void Construct(std::vector<uint32_t> *words) const;
    [[noreturn]] void Refuse(const RtslParameter &parameter, const ParsedParameter &given,
                             const std::string &problem) const;

    const RtslClass &cls;
    /// What the constructor starts from.
    std::vector<uint32_t> values;
    std::vector<uint32_t> block;
    std::vector<Binding> bindings;
    std::vector<std::unique_ptr<std::vector<uint32_t>>> buffers;
};

}  // namespace pbrt::rtsl

#endif  // PBRT_RTSL_INSTANCE_H
