//! Emulation of fused multiply-add for machines without the instruction.

use crate::operand::LlvmType;

/// Returns the name and the text of a function that computes `a * b + c` with one rounding.
///
/// The product is exact in f64, and the sum is rounded to odd there (towards the neighbour whose last bit is 1, unless
/// exact): f64 has more than two bits more than f32, so the second rounding, to f32, gives the correctly rounded
/// result. Infinities and NaNs have no error term and are passed through.
pub fn emulation(ty: LlvmType) -> (String, String) {
    let name = format!("@rtsl.fma.{}", ty.suffix());
    let (double, long, bit) = (ty.of("double"), ty.of("i64"), ty.of("i1"));
    let constant = |value: i64| {
        if !ty.is_vector() {
            return value.to_string();
        }
        let lanes = vec![format!("i64 {value}"); ty.count as usize];
        format!("<{}>", lanes.join(", "))
    };
    let zero = if ty.is_vector() { "zeroinitializer" } else { "0.0" };
    let long_zero = constant(0);
    let (one, minus_one) = (constant(1), constant(-1));
    let text = format!(
        "define internal {ty} {name}({ty} %a, {ty} %b, {ty} %c) #0 {{
  %x = fpext {ty} %a to {double}
  %y = fpext {ty} %b to {double}
  %z = fpext {ty} %c to {double}
  %product = fmul {double} %x, %y
  %sum = fadd {double} %product, %z
  %z1 = fsub {double} %sum, %product
  %p1 = fsub {double} %sum, %z1
  %ez = fsub {double} %z, %z1
  %ep = fsub {double} %product, %p1
  %error = fadd {double} %ez, %ep
  %inexact = fcmp one {double} %error, {zero}
  %bits = bitcast {double} %sum to {long}
  %last = and {long} %bits, {one}
  %even = icmp eq {long} %last, {long_zero}
  %below = fcmp olt {double} %sum, {zero}
  %low = fcmp olt {double} %error, {zero}
  %inward = xor {bit} %below, %low
  %step = select {bit} %inward, {long} {minus_one}, {long} {one}
  %moved = add {long} %bits, %step
  %move = and {bit} %inexact, %even
  %odd = select {bit} %move, {long} %moved, {long} %bits
  %wide = bitcast {long} %odd to {double}
  %result = fptrunc {double} %wide to {ty}
  ret {ty} %result
}}

"
    );
    (name, text)
}
