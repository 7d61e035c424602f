#include <pbrt/rtsl/instance.h>

#include <pbrt/textures.h>
#include <pbrt/util/colorspace.h>
#include <pbrt/util/print.h>

#include <pbrt/rtsl/color.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace pbrt::rtsl {

namespace {

uint32_t WordOf(float value) {
    uint32_t word;
    std::memcpy(&word, &value, sizeof(word));
    return word;
}

std::array<uint32_t, 3> ColorWords(RGB color) {
    return {WordOf(color.r), WordOf(color.g), WordOf(color.b)};
}

/// Whether what a scene calls `name` is this parameter. Where a class refers to a texture, libraries have one of a single
/// colour, whose parameter is `kd.value`; scenes call it `kd`.
bool IsCalled(const RtslParameter &parameter, const std::string &name) {
    return name == parameter.name || name + ".value" == parameter.name;
}

const RtslParameter *FindParameter(const RtslClass &cls, const std::string &name) {
    for (uint32_t i = 0; i < cls.parameter_count; ++i)
        if (IsCalled(cls.parameters[i], name))
            return &cls.parameters[i];
    return nullptr;
}

std::string ParameterNames(const RtslClass &cls) {
    std::string text;
    for (uint32_t i = 0; i < cls.parameter_count; ++i)
        text += (i ? ", " : "") +
                StringPrintf("%s (%s)", cls.parameters[i].name, cls.parameters[i].type);
    return text.empty() ? "none" : text;
}

bool IsReserved(const std::string &name, const Instance::Source &source) {
    if (name == "library" || name == "class")
        return true;
    return std::find(source.reserved.begin(), source.reserved.end(), name) != source.reserved.end();
}

bool IsSpectrum(const ParsedParameter &given) {
    return given.type == "spectrum" || given.type == "blackbody";
}

}  // namespace

Instance::Instance(const RtslClass &cls, const Source &source)
    : cls(cls), values(cls.initial, cls.initial + cls.construct_words) {
    SetAll(source);
    block = values;
    Construct(&block);
    if (IsTextured() && cls.construct_words > MaxTexturedWords)
        ErrorExit(source.loc, "Class %s takes %d words for an instance; with textures, at most %d can "
                  "be made anew for each hit.",
                  cls.name, int(cls.construct_words), int(MaxTexturedWords));
}

void Instance::SetAll(const Source &source) {
    std::vector<const RtslParameter *> given;
    for (const ParsedParameter *parsed : source.parameters.GetParameterVector()) {
        const RtslParameter *parameter = FindParameter(cls, parsed->name);
        if (parameter) {
            Set(*parameter, *parsed, source);
            parsed->lookedUp = true;
            given.push_back(parameter);
        } else if (!IsReserved(parsed->name, source) && !parsed->mayBeUnused)
            ErrorExit(&parsed->loc, "Class %s has no parameter \"%s\". Its parameters: %s.", cls.name,
                      parsed->name, ParameterNames(cls));
    }
    for (uint32_t i = 0; i < cls.parameter_count; ++i) {
        const RtslParameter &parameter = cls.parameters[i];
        bool isGiven = std::find(given.begin(), given.end(), &parameter) != given.end();
        // Buffers may be left empty, but not the one that says how many objects there are.
        bool mayBeLeft = (parameter.flags & RTSL_IS_BUFFER) && i != cls.element_buffer;
        if ((parameter.flags & RTSL_REQUIRED) && !isGiven && !mayBeLeft)
            ErrorExit(source.loc, "Class %s needs the parameter \"%s\" (%s).", cls.name,
                      parameter.name, parameter.type);
    }
}

void Instance::Set(const RtslParameter &parameter, const ParsedParameter &given,
                   const Source &source) {
    if (given.type == "texture")
        Bind(parameter, given, source);
    else if (IsSpectrum(given))
        SetSpectrum(parameter, given, source);
    else
        SetNumbers(parameter, given, source);
}

static std::vector<uint32_t> WordsOf(const RtslParameter &parameter, const ParsedParameter &given) {
    std::vector<uint32_t> words;
    switch (parameter.scalar) {
    case RTSL_FLOAT:
        for (Float value : given.floats)
            words.push_back(WordOf(value));
        for (int value : given.ints)
            words.push_back(WordOf(float(value)));
        break;
    case RTSL_INT:
    case RTSL_UINT:
        words.assign(given.ints.begin(), given.ints.end());
        break;
    default:
        words.assign(given.bools.begin(), given.bools.end());
    }
    return words;
}

void Instance::SetNumbers(const RtslParameter &parameter, const ParsedParameter &given,
                          const Source &source) {
    std::vector<uint32_t> words = WordsOf(parameter, given);
    if (words.empty())
        Refuse(parameter, given, "it is given as " + given.type);
    for (Float value : given.floats)
        CheckRange(parameter, given, value);
    for (int value : given.ints)
        CheckRange(parameter, given, value);
    bool isColor = (parameter.flags & RTSL_IS_COLOR) && !(parameter.flags & RTSL_IS_BUFFER);
    if (isColor && words.size() == 1)
        words.assign(parameter.count, words[0]);
    if (isColor && given.type == "rgb" && given.floats.size() == 3) {
        const RGBColorSpace *space =
            given.colorSpace ? given.colorSpace : source.parameters.ColorSpace();
        RGB color(given.floats[0], given.floats[1], given.floats[2]);
        std::array<uint32_t, 3> converted = ColorWords(ColorOf(color, *space));
        words.assign(converted.begin(), converted.end());
    }
    SetWords(parameter, words, given);
}

void Instance::SetSpectrum(const RtslParameter &parameter, const ParsedParameter &given,
                           const Source &source) {
    if (!(parameter.flags & RTSL_IS_COLOR))
        Refuse(parameter, given, "it is given as " + given.type);
    Spectrum spectrum =
        source.parameters.GetOneSpectrum(given.name, nullptr, source.colors, source.alloc);
    if (!spectrum)
        Refuse(parameter, given, "it is given no values");
    std::array<uint32_t, 3> color = ColorWords(ColorOf(spectrum, source.colors));
    SetWords(parameter, {color.begin(), color.end()}, given);
}

void Instance::Bind(const RtslParameter &parameter, const ParsedParameter &given,
                    const Source &source) {
    bool isColor = parameter.flags & RTSL_IS_COLOR;
    bool isNumber = parameter.scalar == RTSL_FLOAT && parameter.count == 1;
    if (!source.textures || (parameter.flags & RTSL_IS_BUFFER) || !(isColor || isNumber))
        Refuse(parameter, given,
               "it is given as a texture, which only numbers and colours of materials can be");
    Binding binding{&parameter, nullptr, nullptr};
    if (isColor)
        binding.color =
            source.textures->GetSpectrumTextureOrNull(given.name, source.colors, source.alloc);
    else
        binding.number = source.textures->GetFloatTextureOrNull(given.name, source.alloc);
    bindings.push_back(binding);
}

void Instance::SetWords(const RtslParameter &parameter, const std::vector<uint32_t> &words,
                        const ParsedParameter &given) {
    if (!(parameter.flags & RTSL_IS_BUFFER)) {
        if (words.size() != parameter.count)
            Refuse(parameter, given,
                   StringPrintf("it takes %d of the scene's numbers and is given %d", int(parameter.count),
                                int(words.size())));
        std::copy(words.begin(), words.end(), values.begin() + parameter.offset);
        return;
    }
    if (words.size() % parameter.count != 0)
        Refuse(parameter, given,
               StringPrintf("each element takes %d of the scene's numbers and it is given %d",
                            int(parameter.count), int(words.size())));
    buffers.push_back(std::make_unique<std::vector<uint32_t>>(words));
    RtslBuffer buffer = {buffers.back()->data(), uint32_t(words.size() / parameter.count), 0};
    std::memcpy(&values[parameter.offset], &buffer, sizeof(buffer));
}

void Instance::CheckRange(const RtslParameter &parameter, const ParsedParameter &given,
                          Float value) const {
    if (value < parameter.minimum)
        Refuse(parameter, given, StringPrintf("%f is less than %f", value, parameter.minimum));
    if (value > parameter.maximum)
        Refuse(parameter, given, StringPrintf("%f is greater than %f", value, parameter.maximum));
}

void Instance::Refuse(const RtslParameter &parameter, const ParsedParameter &given,
                      const std::string &problem) const {
    ErrorExit(&given.loc, "Parameter \"%s\" of class %s is a %s: %s.", given.name, cls.name,
              parameter.type, problem);
}

void Instance::Construct(std::vector<uint32_t> *words) const {
    rtsl_end_instance(&cls, words->data());
}

void Instance::MakeBlock(const TextureEvalContext &context, uint32_t *words) const {
    std::copy(values.begin(), values.end(), words);
    for (const Binding &binding : bindings) {
        uint32_t *to = words + binding.parameter->offset;
        if (binding.color) {
            std::array<uint32_t, 3> color = ColorWords(ColorOf(binding.color, context));
            std::copy(color.begin(), color.end(), to);
        } else
            *to = WordOf(UniversalTextureEvaluator()(binding.number, context));
    }
    rtsl_end_instance(&cls, words);
}

uint32_t Instance::ElementCount() const {
    if (cls.element_parameter == RTSL_NONE)
        return 1;
    RtslBuffer buffer;
    std::memcpy(&buffer, &values[cls.parameters[cls.element_buffer].offset], sizeof(buffer));
    return buffer.count / cls.element_stride;
}

std::vector<uint32_t> Instance::ElementBlock(uint32_t element) const {
    std::vector<uint32_t> words = values;
    if (cls.element_parameter != RTSL_NONE)
        words[cls.parameters[cls.element_parameter].offset] = element;
    Construct(&words);
    words.resize(cls.block_words);
    return words;
}

}  // namespace pbrt::rtsl
