//! Finds bitcasts whose NaN payload is unobservable, so canonicalisation can be skipped.
//!
//! A bitcast of an f32 to an integer gives every NaN the same bits, which takes a comparison and a select. Most such
//! integers only have their sign changed and become an f32 again: a NaN remains some NaN whatever its bits, so they
//! need not be canonical. The others are analysed by [`Shadow`].

use rtsl_ir::{BinaryOp, Function, OpKind, Region, Scalar, Value};

use super::nan_shadow::Shadow;
use super::sign_bit::{SIGN, constant, is_sign};

/// For each value of `function`, true if it is a bitcast of an f32 whose bits are unobservable for a NaN.
pub fn hidden_bitcasts(function: &Function) -> Vec<bool> {
    let mut uses = Uses {
        function,
        definitions: vec![None; function.values.len()],
        all: vec![0; function.values.len()],
        hiding: vec![0; function.values.len()],
    };
    function.body.for_each_use(&mut |value| uses.all[value.0 as usize] += 1);
    uses.define(&function.body);
    function.body.for_each_op(&mut |op| {
        if let OpKind::Bitcast(Scalar::F32, a) = op.kind {
            uses.hiding[a.0 as usize] += 1;
        }
    });
    function.body.for_each_op(&mut |op| {
        if let OpKind::Binary(binary, a, b) = op.kind
            && uses.is_hidden(op.results.get(0))
        {
            uses.count_sign_change(binary, a, b);
            uses.count_sign_change(binary, b, a);
        }
    });
    let mut shadow = Shadow::new(function, &uses.definitions);
    let mut hides = |bitcast| uses.source(bitcast).is_some_and(|source| shadow.hides(source));
    (0..function.values.len() as u32)
        .map(|index| uses.is_hidden_bitcast(Value(index)) || hides(Value(index)))
        .collect()
}

/// The uses of values.
struct Uses<'a> {
    function: &'a Function,
    definitions: Vec<Option<&'a OpKind>>,
    all: Vec<u32>,
    /// The number of uses after which the value is only an f32, and a NaN if it was one.
    hiding: Vec<u32>,
}

impl<'a> Uses<'a> {
    fn define(&mut self, body: &'a Region) {
        body.for_each_op(&mut |op| {
            if op.results.count == 1 {
                self.definitions[op.results.first as usize] = Some(&op.kind);
            }
        });
    }

    fn is_hidden(&self, value: Value) -> bool {
        self.all[value.0 as usize] == self.hiding[value.0 as usize]
    }

    fn is_hidden_bitcast(&self, value: Value) -> bool {
        self.source(value).is_some() && self.is_hidden(value)
    }

    /// Returns the f32 whose bits `value` is.
    fn source(&self, value: Value) -> Option<Value> {
        match self.definitions[value.0 as usize] {
            Some(OpKind::Bitcast(Scalar::I32 | Scalar::U32, source)) => {
                (self.function.scalar(*source) == Scalar::F32).then_some(*source)
            }
            _ => None,
        }
    }

    /// Counts the use of `bits` in `op` with `other`, if that preserves NaNs.
    fn count_sign_change(&mut self, op: BinaryOp, bits: Value, other: Value) {
        let keeps_nan = match op {
            BinaryOp::Xor | BinaryOp::Or => is_sign(&self.definitions, other),
            BinaryOp::And => constant(&self.definitions, other) == Some(!SIGN),
            _ => false,
        };
        if keeps_nan {
            self.hiding[bits.0 as usize] += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hidden(body: &str) -> usize {
        let text = format!("function f scratch a: f32[1] scratch n: u32[2] {{ {body} }}");
        let function: Function = text.parse().unwrap();
        rtsl_ir::verify::verify(&function).unwrap();
        hidden_bitcasts(&function).into_iter().filter(|hidden| *hidden).count()
    }

    const START: &str = "%a: f32 = load scratch:a@0 %n: u32 = load scratch:n@0
        %sign: u32 = constant 0x80000000 %rest: u32 = constant 0x7fffffff
        %31: u32 = constant 31 %b: u32 = bitcast %a ";

    #[test]
    fn bits_are_hidden_where_only_the_sign_changes() {
        for change in [
            "%s: u32 = and %n, %sign %c: u32 = xor %b, %s",
            "%s: u32 = shift_left %n, %31 %c: u32 = xor %s, %b",
            "%c: u32 = or %b, %sign",
            "%c: u32 = and %rest, %b",
        ] {
            let text = format!("{START} {change} %f: f32 = bitcast %c return scratch:a@0 = %f");
            assert_eq!(hidden(&text), 1, "{change}");
        }
    }

    #[test]
    fn bits_that_show_are_not_hidden() {
        for (change, output) in [
            ("%c: u32 = xor %b, %n", "scratch:a@0 = %f"),
            ("%c: u32 = and %b, %sign", "scratch:a@0 = %f"),
            ("%c: u32 = xor %b, %sign", "scratch:a@0 = %f, scratch:n@0 = %b"),
            ("%c: u32 = xor %b, %sign", "scratch:a@0 = %f, scratch:n@0 = %c"),
            ("%c: u32 = xor %b, %b", "scratch:a@0 = %f"),
            ("%c: u32 = add %b, %sign", "scratch:a@0 = %f"),
        ] {
            let text = format!("{START} {change} %f: f32 = bitcast %c return {output}");
            assert_eq!(hidden(&text), 0, "{change} {output}");
        }
    }
}
