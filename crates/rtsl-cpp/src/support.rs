//! Support code for the classes: arithmetic that C++ leaves undefined or defines differently, and directives that
//! prevent compilers from changing results.

use std::collections::BTreeSet;

/// A function or type that generated code may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Helper {
    Rounded,
    Fused,
    Minimum,
    Maximum,
    WrappingAdd,
    WrappingSubtract,
    WrappingMultiply,
    WrappingNegate,
    WrappingAbs,
    Quotient,
    Modulo,
    ShiftLeft,
    ShiftRight,
    MultiplyHigh,
    ToInt,
    ToUint,
    BitsOf,
    FloatOf,
    ClampedIndex,
    Buffer,
}

impl Helper {
    const ALL: [Helper; 20] = [
        Helper::Rounded,
        Helper::Fused,
        Helper::Minimum,
        Helper::Maximum,
        Helper::WrappingAdd,
        Helper::WrappingSubtract,
        Helper::WrappingMultiply,
        Helper::WrappingNegate,
        Helper::WrappingAbs,
        Helper::Quotient,
        Helper::Modulo,
        Helper::ShiftLeft,
        Helper::ShiftRight,
        Helper::MultiplyHigh,
        Helper::ToInt,
        Helper::ToUint,
        Helper::BitsOf,
        Helper::FloatOf,
        Helper::ClampedIndex,
        Helper::Buffer,
    ];

    /// Returns the names of the helpers.
    pub fn names() -> impl Iterator<Item = &'static str> {
        Helper::ALL.into_iter().map(Helper::name)
    }

    pub const fn name(self) -> &'static str {
        match self {
            Helper::Rounded => "rounded",
            Helper::Fused => "fused",
            Helper::Minimum => "minimum",
            Helper::Maximum => "maximum",
            Helper::WrappingAdd => "wrapping_add",
            Helper::WrappingSubtract => "wrapping_subtract",
            Helper::WrappingMultiply => "wrapping_multiply",
            Helper::WrappingNegate => "wrapping_negate",
            Helper::WrappingAbs => "wrapping_abs",
            Helper::Quotient => "quotient",
            Helper::Modulo => "modulo",
            Helper::ShiftLeft => "shift_left",
            Helper::ShiftRight => "shift_right",
            Helper::MultiplyHigh => "multiply_high",
            Helper::ToInt => "to_int",
            Helper::ToUint => "to_uint",
            Helper::BitsOf => "bits_of",
            Helper::FloatOf => "float_of",
            Helper::ClampedIndex => "clamped_index",
            Helper::Buffer => "Buffer",
        }
    }

    const fn text(self) -> &'static str {
        match self {
            Helper::Rounded => ROUNDED,
            Helper::Fused => FUSED,
            Helper::Minimum => MINIMUM,
            Helper::Maximum => MAXIMUM,
            Helper::WrappingAdd => WRAPPING_ADD,
            Helper::WrappingSubtract => WRAPPING_SUBTRACT,
            Helper::WrappingMultiply => WRAPPING_MULTIPLY,
            Helper::WrappingNegate => WRAPPING_NEGATE,
            Helper::WrappingAbs => WRAPPING_ABS,
            Helper::Quotient => QUOTIENT,
            Helper::Modulo => MODULO,
            Helper::ShiftLeft => SHIFT_LEFT,
            Helper::ShiftRight => SHIFT_RIGHT,
            Helper::MultiplyHigh => MULTIPLY_HIGH,
            Helper::ToInt => TO_INT,
            Helper::ToUint => TO_UINT,
            Helper::BitsOf => BITS_OF,
            Helper::FloatOf => FLOAT_OF,
            Helper::ClampedIndex => CLAMPED_INDEX,
            Helper::Buffer => BUFFER,
        }
    }
}

/// The start of the text.
pub(crate) const PREAMBLE: &str = r#"
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include <cmath>

// Results are the same bits on every machine, as long as the compiler does what is written here.
#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "compile without -ffast-math and its parts: they change results"
#endif
static_assert(FLT_EVAL_METHOD == 0 || FLT_EVAL_METHOD == 16,
              "floats must be computed as floats: on x86 with -mfpmath=sse");
static_assert(sizeof(void *) == 8, "addresses must have 64 bits");

// No product may be joined with a sum to a fused operation, which rounds once: where that is meant,
// std::fma says so.
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off")
#elif defined(_MSC_VER)
#pragma fp_contract(off)
#endif
"#;

/// The end of the text.
pub(crate) const END: &str = r#"
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif
"#;

const ROUNDED: &str = r#"
/// A product that goes into a sum, rounded before. For clang, which with -ffp-contract=fast listens to
/// no pragma.
inline float rounded(float product) {
#if defined(__clang__) && defined(__x86_64__)
    __asm__("" : "+x"(product));
#elif defined(__clang__) && defined(__aarch64__)
    __asm__("" : "+w"(product));
#endif
    return product;
}
"#;

const FUSED: &str = r#"
/// A fused product and sum that is negated. For GCC, which joins both to an instruction whose zero has
/// the other sign.
inline float fused(float sum) {
#if defined(__GNUC__) && !defined(__clang__)
#if defined(__x86_64__)
    __asm__("" : "+x"(sum));
#elif defined(__aarch64__)
    __asm__("" : "+w"(sum));
#else
    __asm__("" : "+m"(sum));
#endif
#endif
    return sum;
}
"#;

const MINIMUM: &str = r#"
/// The lesser; the first where either is NaN, and where both are zero.
template <typename T>
inline T minimum(T a, T b) {
    return b < a ? b : a;
}
"#;

const MAXIMUM: &str = r#"
/// The greater; the first where either is NaN, and where both are zero.
template <typename T>
inline T maximum(T a, T b) {
    return a < b ? b : a;
}
"#;

const WRAPPING_ADD: &str = r#"
inline int32_t wrapping_add(int32_t a, int32_t b) {
    return int32_t(uint32_t(a) + uint32_t(b));
}
"#;

const WRAPPING_SUBTRACT: &str = r#"
inline int32_t wrapping_subtract(int32_t a, int32_t b) {
    return int32_t(uint32_t(a) - uint32_t(b));
}
"#;

const WRAPPING_MULTIPLY: &str = r#"
inline int32_t wrapping_multiply(int32_t a, int32_t b) {
    return int32_t(uint32_t(a) * uint32_t(b));
}
"#;

const WRAPPING_NEGATE: &str = r#"
inline int32_t wrapping_negate(int32_t a) {
    return int32_t(0u - uint32_t(a));
}
"#;

const WRAPPING_ABS: &str = r#"
inline int32_t wrapping_abs(int32_t a) {
    return a < 0 ? int32_t(0u - uint32_t(a)) : a;
}
"#;

const QUOTIENT: &str = r#"
/// Towards zero; by zero it is zero, and the least number by -1 is itself.
inline int32_t quotient(int32_t a, int32_t b) {
    return b == 0 ? 0 : b == -1 ? int32_t(0u - uint32_t(a)) : a / b;
}

inline uint32_t quotient(uint32_t a, uint32_t b) {
    return b == 0 ? 0 : a / b;
}
"#;

const MODULO: &str = r#"
/// The remainder of a division, with the sign of `a`; zero for a division by zero.
inline int32_t modulo(int32_t a, int32_t b) {
    return b == 0 || b == -1 ? 0 : a % b;
}

inline uint32_t modulo(uint32_t a, uint32_t b) {
    return b == 0 ? 0 : a % b;
}
"#;

const SHIFT_LEFT: &str = r#"
/// By the low five bits of `b`.
template <typename T>
inline T shift_left(T a, T b) {
    return T(uint32_t(a) << (uint32_t(b) & 31u));
}
"#;

const SHIFT_RIGHT: &str = r#"
/// By the low five bits of `b`; the sign comes in from the left.
template <typename T>
inline T shift_right(T a, T b) {
    return a >> (uint32_t(b) & 31u);
}
"#;

const MULTIPLY_HIGH: &str = r#"
/// The upper half of the product.
inline int32_t multiply_high(int32_t a, int32_t b) {
    return int32_t(uint32_t(uint64_t(int64_t(a) * int64_t(b)) >> 32));
}

inline uint32_t multiply_high(uint32_t a, uint32_t b) {
    return uint32_t((uint64_t(a) * uint64_t(b)) >> 32);
}
"#;

const TO_INT: &str = r#"
/// Towards zero, to the nearest end of the range beyond it; 0 for NaN.
inline int32_t to_int(float a) {
    return a >= 2147483648.0f ? INT32_MAX : a >= -2147483648.0f ? int32_t(a) : a != a ? 0 : INT32_MIN;
}
"#;

const TO_UINT: &str = r#"
/// Towards zero, to the nearest end of the range beyond it; 0 for NaN.
inline uint32_t to_uint(float a) {
    return a >= 4294967296.0f ? UINT32_MAX : a > -1.0f ? uint32_t(a) : 0u;
}
"#;

const BITS_OF: &str = r#"
/// The bits of a float, the same for every NaN.
inline uint32_t bits_of(float a) {
    uint32_t bits;
    memcpy(&bits, &a, sizeof bits);
    return a != a ? 0x7fc00000u : bits;
}
"#;

const FLOAT_OF: &str = r#"
/// The float that has these bits.
inline float float_of(uint32_t bits) {
    float a;
    memcpy(&a, &bits, sizeof a);
    return a;
}
"#;

const CLAMPED_INDEX: &str = r#"
/// The index, or the nearest that an array of this length has.
inline int32_t clamped_index(int32_t index, int32_t length) {
    return index < 0 ? 0 : index < length ? index : length - 1;
}
"#;

const BUFFER: &str = r#"
/// An array of the host's: its address, and the number of its elements of `Scalars` scalars each.
template <typename T, uint32_t Scalars>
struct Buffer {
    const T *elements;
    uint32_t count;
    uint32_t unused;

    /// A scalar, counted over all elements: the nearest that there is, 0 where there is none.
    T operator[](int32_t index) const {
        const uint64_t scalars = uint64_t(count) * Scalars;
        if (scalars == 0 || index < 0) return scalars == 0 ? T(0) : elements[0];
        return elements[uint64_t(index) < scalars ? uint64_t(index) : scalars - 1];
    }

    int32_t length() const {
        return count < uint32_t(INT32_MAX) ? int32_t(count) : INT32_MAX;
    }
};
"#;

/// Appends the texts of these helpers.
pub(crate) fn write_helpers(used: &BTreeSet<Helper>, text: &mut String) {
    for helper in used {
        text.push_str(helper.text());
    }
}
