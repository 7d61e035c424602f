//! Promotion of locals to values: applies to locals that are accessed at constant indices only.
//!
//! Each scalar of such a local is tracked as one scalar variable. A load becomes the variable's value at that point;
//! where regions store to it, the `if` gets one more result for it and the loop carries one more value. This is the
//! construction of SSA form on structured control flow, as in Brandis and Mössenböck, "Single-pass generation of static
//! single-assignment form for structured languages" (1994). Unneeded results are left to dead code elimination.

use std::collections::BTreeSet;

use rtsl_ir::{
    Constant, ConstantPool, Function, Index, IndexVec, Name, Op, OpKind, Region, Scalar, Value,
    Values, VariableId, VariableKind,
};

use crate::substitution::Substitution;

/// The greatest length of a promoted local; longer ones are lookup tables.
const MAX_LOCAL_LEN: u32 = 64;

/// The greatest number of promoted scalars in a function, so that regions do not yield hundreds of values.
const MAX_SCALARS: u32 = 512;

/// Promotes the locals of `function` within these limits.
pub fn run(function: &mut Function) {
    let mut is_candidate: IndexVec<VariableId, bool> = function
        .variables
        .iter()
        .map(|variable| variable.kind == VariableKind::Local && variable.len <= MAX_LOCAL_LEN)
        .collect();
    function.body.for_each_op(&mut |op| match op.kind {
        OpKind::Load(variable, Index::Dynamic(_))
        | OpKind::Store(variable, Index::Dynamic(_), _) => {
            is_candidate[variable] = false;
        }
        _ => {}
    });
    let mut scalars = 0;
    let locals = (0..function.variables.len() as u32).map(VariableId).filter(|local| {
        let fits = is_candidate[*local] && scalars + function.variable(*local).len <= MAX_SCALARS;
        scalars += if fits { function.variable(*local).len } else { 0 };
        fits
    });
    let locals: Vec<VariableId> = locals.collect();
    if !locals.is_empty() {
        promote(function, &locals);
    }
}

/// Promotes these locals, which are accessed at constant indices only.
pub(crate) fn promote(function: &mut Function, locals: &[VariableId]) {
    let mut variables = Variables::default();
    variables.first.resize(function.variables.len(), None);
    for local in locals {
        let variable = &function.variables[local.0 as usize];
        let text = function.names.add_text(variable.name.as_str());
        let len = variable.len as u16;
        let names = (0..len).map(|component| Name { text, component, len, rank: Name::DECLARED });
        variables.names.extend(names);
        variables.first[*local] = Some(variables.scalars.len());
        variables.scalars.extend((0..variable.len).map(|_| variable.scalar));
    }
    let mut constants = ConstantPool::of(function);
    let zeros = variables
        .scalars
        .iter()
        .map(|scalar| constants.intern(&mut function.values, Constant::zero(*scalar)));
    let current = zeros.collect();
    let mut stored = Vec::new();
    let mut body = std::mem::take(&mut function.body);
    collect_stored(&variables, &body, &mut stored);
    let stored = stored.into_iter();
    let substitution = Substitution::default();
    let mut promotion = Promotion { function, variables, current, stored, substitution };
    promotion.region(&mut body);
    promotion.substitution.keep_names(&mut promotion.function.names);
    function.body = body;
    constants.define_in(function);
}

/// The scalars of the promoted locals.
#[derive(Default)]
struct Variables {
    /// For each promoted local, the index of its first scalar.
    first: IndexVec<VariableId, Option<usize>>,
    /// The type of each scalar.
    scalars: Vec<Scalar>,
    /// The name of each scalar.
    names: Vec<Name>,
}

impl Variables {
    fn at(&self, variable: VariableId, index: Index) -> Option<usize> {
        let first = self.first[variable]?;
        match index {
            Index::Constant(index) => Some(first + index as usize),
            Index::Dynamic(_) => unreachable!("locals with dynamic indices are not promoted"),
        }
    }
}

/// Appends the scalars that each operation with regions stores to, in the order of the text; returns those of the
/// region.
fn collect_stored(
    variables: &Variables,
    region: &Region,
    stored: &mut Vec<BTreeSet<usize>>,
) -> BTreeSet<usize> {
    let mut all = BTreeSet::new();
    for op in &region.ops {
        match &op.kind {
            OpKind::Store(variable, index, _) => all.extend(variables.at(*variable, *index)),
            OpKind::If { .. } | OpKind::Loop { .. } => {
                let position = stored.len();
                stored.push(BTreeSet::new());
                for region in op.kind.regions() {
                    let inner = collect_stored(variables, region, stored);
                    stored[position].extend(inner);
                }
                all.extend(&stored[position]);
            }
            _ => {}
        }
    }
    all
}

struct Promotion<'a> {
    function: &'a mut Function,
    variables: Variables,
    /// The value of each scalar at the current position.
    current: Vec<Value>,
    /// The result of [`collect_stored`].
    stored: std::vec::IntoIter<BTreeSet<usize>>,
    substitution: Substitution,
}

impl Promotion<'_> {
    fn region(&mut self, region: &mut Region) {
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            self.substitution.apply_to_operands(&mut op.kind);
            if self.op(&mut op) {
                ops.push(op);
            }
        }
        region.ops = ops;
        self.substitution.apply_to_yields(region);
    }

    /// Rewrites an operation; returns false if it is no longer needed.
    fn op(&mut self, op: &mut Op) -> bool {
        match &mut op.kind {
            OpKind::Load(variable, index) => match self.variables.at(*variable, *index) {
                Some(variable) => {
                    self.substitution.set(op.results.get(0), self.current[variable]);
                    return false;
                }
                None => return true,
            },
            OpKind::Store(variable, index, value) => match self.variables.at(*variable, *index) {
                Some(variable) => {
                    self.current[variable] = *value;
                    return false;
                }
                None => return true,
            },
            OpKind::If { then, otherwise, .. } => {
                let stored = self.stored.next().expect("one for each operation with regions");
                let before = self.values_of(&stored);
                self.region(then);
                then.yields.extend(self.values_of(&stored));
                self.set_values(&stored, before);
                self.region(otherwise);
                otherwise.yields.extend(self.values_of(&stored));
                self.extend_results(&mut op.results, &stored);
            }
            OpKind::Loop { initial, body } => {
                let stored = self.stored.next().expect("one for each operation with regions");
                initial.extend(self.values_of(&stored));
                let params = self.new_values(&[], &stored);
                body.params.extend(params.iter());
                self.set_values(&stored, params.iter());
                self.region(body);
                body.yields.extend(self.values_of(&stored));
                self.extend_results(&mut op.results, &stored);
            }
            _ => {}
        }
        true
    }

    fn values_of(&self, variables: &BTreeSet<usize>) -> Vec<Value> {
        variables.iter().map(|variable| self.current[*variable]).collect()
    }

    fn set_values(&mut self, variables: &BTreeSet<usize>, to: impl IntoIterator<Item = Value>) {
        for (variable, value) in variables.iter().zip(to) {
            self.current[*variable] = value;
        }
    }

    /// Allocates new values of these types, then one for each scalar.
    fn new_values(&mut self, scalars: &[Scalar], variables: &BTreeSet<usize>) -> Values {
        let added = variables.iter().map(|variable| self.variables.scalars[*variable]);
        let first = scalars.len();
        let scalars: Vec<Scalar> = scalars.iter().copied().chain(added).collect();
        let new = self.function.new_values(&scalars);
        for (value, variable) in new.iter().skip(first).zip(variables) {
            self.function.names.set(value, self.variables.names[*variable]);
        }
        new
    }

    /// Adds a result for each scalar, which is its value from here on.
    fn extend_results(&mut self, results: &mut Values, variables: &BTreeSet<usize>) {
        if variables.is_empty() {
            return;
        }
        let old = *results;
        let scalars: Vec<Scalar> = old.iter().map(|value| self.function.scalar(value)).collect();
        *results = self.new_values(&scalars, variables);
        self.substitution.set_all(old, results.iter());
        self.set_values(variables, results.iter().skip(old.count as usize));
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::{check_preserves, transformed};

    #[test]
    fn variables_pass_through_regions() {
        let text = "
            %a: f32 = load scratch:f@0 %c: bool = load scratch:b@0
            store local:s@1, %a
            %n: i32 = loop (%i: i32 = %start) {
                if %c {
                    %x: f32 = load local:s@1
                    %y: f32 = add %x, %a
                    store local:s@1, %y
                    yield
                } else { yield }
                repeat %c, %i
            }
            %l: f32 = load local:s@1
            %z: f32 = load local:s@2
            return scratch:f@0 = %l, scratch:f@1 = %z";
        let text = text.replace("%n:", "%start: i32 = constant 5 %n:");
        expect![[r#"
            %0: f32 = constant 0.0
            %1: i32 = constant 0
            %4: i32 = constant 5
            %5: i32, %6: f32 = loop (%7: i32 = %4, %8: f32 = %2) {
              %9: f32 = if %3 {
                %10: f32 = add %8, %2
                yield %10
              } else {
                yield %8
              }
              repeat %3, %7, %9
            }
            return scratch:f@0 = %6, scratch:f@1 = %0
        "#]]
        .assert_eq(&transformed(&text, super::run));
    }

    #[test]
    fn a_dynamic_index_keeps_the_local() {
        let text = "
            %i: i32 = load scratch:i@0
            store local:r@1, %i
            %a: i32 = load local:r@%i
            return scratch:i@0 = %a";
        expect![[r#"
            %0: f32 = constant 0.0
            store local:r@1, %1
            %2: i32 = load local:r@%1
            return scratch:i@0 = %2
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn keeps_results() {
        check_preserves(super::run);
    }
}
