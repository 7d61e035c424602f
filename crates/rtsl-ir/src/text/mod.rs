//! The text form, for tests and debugging: [`print`](Function)ing a function writes it and [`parse`] reads it.
//!
//! ```text
//! function Sphere.intersect
//! state rt_RayOrigin: f32[3]
//! member radius: f32[1]
//! local table: i32[4]
//! {
//!   %0: f32 = load state:rt_RayOrigin@1
//!   %1: f32 = constant -0.5
//!   %2: bool = less %0, %1
//!   %3: f32 = if %2 {
//!     %4: f32 = precise add %0, %1
//!     yield %4
//!   } else {
//!     yield %1
//!   }
//!   %5: i32 = loop (%6: i32 = %start) {
//!     store local:table@%6, %6
//!     repeat %again, %6
//!   }
//!   return state:rt_HitDistance@0 = %3
//! }
//! ```
//!
//! The name and the variables come first, then the body. Each definition gives the types of its results.
//! `kind:name@index` is one scalar of a variable. `//` starts a comment that ends with the line. Values may have any
//! names. The parser numbers them in the order of the text, so that parsing the printed form of a function restores it
//! up to the numbers of values.

mod lexer;
mod parser;
mod printer;

pub(crate) use lexer::is_word_character;
pub use parser::{ParseError, parse};
pub(crate) use printer::op_line;

use crate::Function;

impl std::str::FromStr for Function {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Self, ParseError> {
        parse(text)
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use super::parse;

    /// A function with every operation.
    const EVERYTHING: &str = "\
function Class.method
state rt_RayOrigin: f32[3]
member layers[2].scale: f32[3]
buffer table: f32[1]
local stack: i32[8]
accepted accepted: bool[1]
{
  %0: f32 = constant 1.5
  %1: f32 = constant -inf
  %2: f32 = constant 0x7fc00001
  %3: f32 = constant -0.0
  %4: i32 = constant -3
  %5: u32 = constant 4000000000
  %6: bool = constant true
  %7: f32 = load state:rt_RayOrigin@2
  %8: f32 = load member:layers[2].scale@%4
  %9: i32 = length buffer:table
  store local:stack@7, %4
  store local:stack@%4, %9
  %10: f32 = precise round_even %7
  %11: f32 = precise multiply %7, %8
  %12: u32 = shift_right %5, %5
  %13: bool = greater_equal %7, %8
  %14: f32 = select %13, %7, %8
  %15: f32 = fma %7, %8, %14
  %16: i32 = convert %15
  %17: u32 = bitcast %15
  %18: f32, %19: i32 = if %13 {
    %20: f32 = add %7, %8
    if %6 {
      yield
    } else {
      report_budget
      yield
    }
    yield %20, %16
  } else {
    yield %7, %4
  }
  %21: i32, %22: f32 = loop (%23: i32 = %4, %24: f32 = %18) {
    %25: bool = less %23, %9
    repeat %25, %23, %24
  }
  loop () {
    repeat %6
  }
  %26: f32, %27: f32, %28: f32 = trace %0, %0, %0, %1, %1, %1, %3, %0
  %29: bool = occluded %0, %0, %0, %1, %1, %1, %3
  %30: i32 = light_count
  %31: bool, %32: f32, %33: f32, %34: f32, %35: f32, %36: f32, %37: f32, %38: f32, %39: f32 = \
light_sample %4, %0, %0, %0, %1, %1, %1, %2
  %40: f32, %41: f32, %42: f32 = ambient
  %43: f32 = rand
  %44: f32 = call texture.lookup of kd@%4 (rt_TextureUV@0 = %0, rt_TextureUV@1 = %1) gives \
(rt_FloatTextureValue@0)
  %45: bool = is_set kd
  %46: bool, %47: i32, %48: i32, %49: i32, %50: f32 = query nearest_hit %0, %0, %0, %1, %1, %1, %3, %2
  %51: i32 = query sky_count
  return accepted:accepted@0 = %45, state:rt_RayOrigin@0 = %44
}
";

    #[test]
    fn printing_is_the_inverse_of_parsing() {
        let function = parse(EVERYTHING).unwrap();
        crate::verify::verify(&function).unwrap();
        assert_eq!(function.to_string(), EVERYTHING);
    }

    #[test]
    fn renumbering_follows_the_text() {
        let mut function = parse(EVERYTHING).unwrap();
        function.renumber();
        assert_eq!(function.to_string(), EVERYTHING);
    }

    #[test]
    fn names_of_values_are_free_and_comments_skipped() {
        let text = "function f // name\n{ %one: i32 = constant 1 // a\n return }";
        expect![[r#"
            function f
            {
              %0: i32 = constant 1
              return
            }
        "#]]
        .assert_eq(&parse(text).unwrap().to_string());
    }

    #[test]
    fn errors_have_a_position_and_a_message() {
        let table = [
            ("", "1:1: expected `function`, found the end of the text"),
            ("function f {\n %a: i32 = constant x }", "2:21: `x` is not a constant of type i32"),
            ("function f { %a: i32 = add %b, %b }", "1:28: value %b is not defined above"),
            ("function f { %a: i32 = frob }", "1:24: `frob` is not an operation"),
            ("function f { query nothing }", "1:20: `nothing` is not a query"),
            ("function f { store local:s@0, %a }", "1:20: local `s` is not declared"),
            ("function f { %a: x = rand }", "1:18: `x` is not a type"),
            (
                "function f local s: f32 { }",
                "1:21: `f32` is not a type of a variable like `f32[3]`",
            ),
            ("function f { ä }", "1:14: expected an operation, found `ä`"),
            ("function f { return } x", "1:23: expected the end of the text, found `x`"),
        ];
        for (text, expected) in table {
            assert_eq!(parse(text).unwrap_err().to_string(), expected, "{text}");
        }
    }

    #[test]
    fn deep_nesting_is_an_error() {
        let text = format!("function f {{ %c: bool = constant true {}", "if %c { ".repeat(100_000));
        let error = parse(&text).unwrap_err();
        assert_eq!(error.message, "regions are nested deeper than 256");
    }
}
