//! Loop unrolling: replaces a loop with a small, known trip count by copies of its body.
//!
//! The trip count is found by running the loop on its constant part: carried values that start as constants, and values
//! computed from them. A loop is unrolled if its condition is known in each iteration and there are at most
//! [`MAX_TRIPS`] iterations of at most [`MAX_OPS`] operations in all, inner loops first. Indices that count the
//! iterations become constants, so that [`mem2reg`](crate::mem2reg) can promote locals afterwards.

use rtsl_ir::{Constant, Function, IndexVec, Op, OpKind, Region, Value, Values, evaluate};

use crate::substitution::Substitution;

/// The greatest trip count of an unrolled loop.
pub const MAX_TRIPS: u32 = 16;

/// The greatest number of operations in the copies of a loop's body.
pub const MAX_OPS: u32 = 256;

/// The greatest number of operations in all copies in a function.
pub const MAX_TOTAL_OPS: u32 = 16_384;

/// Unrolls the loops of `function` within these limits.
pub fn run(function: &mut Function) {
    let mut known = IndexVec::filled(function.values.len(), None);
    function.body.for_each_op(&mut |op| {
        if let OpKind::Constant(constant) = op.kind {
            known[op.results.get(0)] = Some(constant);
        }
    });
    let mut body = std::mem::take(&mut function.body);
    let mut unrolling = Unrolling {
        function,
        known,
        substitution: Substitution::default(),
        names: Substitution::default(),
        left: MAX_TOTAL_OPS,
    };
    unrolling.region(&mut body);
    unrolling.substitution.keep_names(&mut unrolling.function.names);
    function.body = body;
}

struct Unrolling<'a> {
    function: &'a mut Function,
    /// The constants, by value; during a trial run also the values constant in the iteration.
    known: IndexVec<Value, Option<Constant>>,
    substitution: Substitution,
    /// The latest copies of the values defined in copied regions.
    names: Substitution,
    /// The number of operations that may still be added.
    left: u32,
}

impl Unrolling<'_> {
    fn region(&mut self, region: &mut Region) {
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            self.substitution.apply_to_operands(&mut op.kind);
            for region in op.kind.regions_mut() {
                self.region(region);
            }
            match &op.kind {
                OpKind::Loop { initial, body } => match self.trips(initial, body) {
                    Some(trips) => self.unroll(op.results, initial, body, trips, &mut ops),
                    None => ops.push(op),
                },
                _ => ops.push(op),
            }
        }
        region.ops = ops;
        self.substitution.apply_to_yields(region);
    }

    /// Returns the trip count if it is known and within the limits.
    fn trips(&mut self, initial: &[Value], body: &Region) -> Option<u32> {
        let size = count_ops(body);
        let limit = MAX_TRIPS.min(MAX_OPS.min(self.left).checked_div(size).unwrap_or(MAX_TRIPS));
        let mut carried: Vec<Option<Constant>> =
            initial.iter().map(|value| self.known(*value)).collect();
        let mut trips = None;
        for trip in 1..=limit {
            for (param, constant) in body.params.iter().zip(&carried) {
                self.set_known(*param, *constant);
            }
            self.follow(body);
            match self.known(body.yields[0]) {
                Some(again) if again.bits() == 0 => trips = Some(trip),
                Some(_) => {
                    carried = body.yields[1..].iter().map(|value| self.known(*value)).collect();
                    continue;
                }
                None => {}
            }
            break;
        }
        self.forget(body);
        trips
    }

    /// Finds the constants in a region from the known parameters.
    fn follow(&mut self, region: &Region) {
        for op in &region.ops {
            match &op.kind {
                OpKind::If { condition, then, otherwise } => {
                    let chosen = self.known(*condition).map(|known| match known.bits() {
                        0 => otherwise,
                        _ => then,
                    });
                    if let Some(region) = chosen {
                        self.follow(region);
                    }
                    for (index, result) in op.results.iter().enumerate() {
                        let constant = chosen.and_then(|region| self.known(region.yields[index]));
                        self.set_known(result, constant);
                    }
                }
                kind => {
                    let constant = evaluate::fold(kind, |value| self.known(value));
                    op.results.iter().for_each(|result| self.set_known(result, constant));
                }
            }
        }
    }

    /// Removes the constants of a trial run that do not hold in every iteration.
    fn forget(&mut self, body: &Region) {
        body.params.iter().for_each(|param| self.set_known(*param, None));
        body.for_each_op(&mut |op| {
            for result in op.results.iter() {
                let constant = match op.kind {
                    OpKind::Constant(constant) => Some(constant),
                    _ => None,
                };
                self.set_known(result, constant);
            }
        });
    }

    fn known(&self, value: Value) -> Option<Constant> {
        self.known.get(value).copied().flatten()
    }

    fn set_known(&mut self, value: Value, constant: Option<Constant>) {
        self.known.insert(value, constant, None);
    }

    fn unroll(
        &mut self,
        results: Values,
        initial: &[Value],
        body: &Region,
        trips: u32,
        ops: &mut Vec<Op>,
    ) {
        let mut carried = initial.to_vec();
        for _ in 0..trips {
            for (param, value) in body.params.iter().zip(&carried) {
                self.names.set(*param, *value);
            }
            ops.extend(self.copies(&body.ops));
            carried = body.yields[1..].iter().map(|value| self.names.get(*value)).collect();
        }
        self.left -= self.left.min(trips * count_ops(body));
        self.substitution.set_all(results, carried);
    }

    /// Copies operations, with new values.
    fn copies(&mut self, ops: &[Op]) -> Vec<Op> {
        ops.iter().map(|op| self.copy(op)).collect()
    }

    fn copy(&mut self, op: &Op) -> Op {
        let kind = match &op.kind {
            OpKind::If { condition, then, otherwise } => OpKind::If {
                condition: self.names.get(*condition),
                then: self.copy_region(then),
                otherwise: self.copy_region(otherwise),
            },
            OpKind::Loop { initial, body } => OpKind::Loop {
                initial: initial.iter().map(|value| self.names.get(*value)).collect(),
                body: self.copy_region(body),
            },
            kind => {
                let mut kind = kind.clone();
                self.names.apply_to_operands(&mut kind);
                kind
            }
        };
        let results = self.renamed(op.results.iter());
        self.names.set_all(op.results, results.iter());
        if let OpKind::Constant(constant) = kind {
            self.set_known(results.get(0), Some(constant));
        }
        Op { results, precise: op.precise, kind }
    }

    fn copy_region(&mut self, region: &Region) -> Region {
        let params = self.renamed(region.params.iter().copied());
        for (old, new) in region.params.iter().zip(params.iter()) {
            self.names.set(*old, new);
        }
        let ops = self.copies(&region.ops);
        let yields = region.yields.iter().map(|value| self.names.get(*value)).collect();
        Region { params: params.iter().collect(), ops, yields }
    }

    fn renamed(&mut self, values: impl Iterator<Item = Value>) -> Values {
        let values: Vec<Value> = values.collect();
        let scalars: Vec<_> = values.iter().map(|value| self.function.scalar(*value)).collect();
        let new = self.function.new_values(&scalars);
        for (old, new) in values.into_iter().zip(new.iter()) {
            self.function.names.keep(old, new);
        }
        new
    }
}

fn count_ops(region: &Region) -> u32 {
    let mut count = 0;
    region.for_each_op(&mut |_| count += 1);
    count
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::{check_preserves, transformed};

    #[test]
    fn a_for_with_constant_bounds() {
        let text = "
            %0: i32 = constant 0 %1: i32 = constant 1 %2: i32 = constant 2
            %x: f32 = load scratch:f@0
            %i: i32, %s: f32 = loop (%j: i32 = %0, %acc: f32 = %x) {
                %c: bool = less %j, %2
                %j2: i32, %acc2: f32 = if %c {
                    %e: f32 = load member:m@%j
                    %sum: f32 = add %acc, %e
                    %next: i32 = add %j, %1
                    yield %next, %sum
                } else { yield %j, %acc }
                repeat %c, %j2, %acc2
            }
            return scratch:f@0 = %s, scratch:i@0 = %i";
        let unrolled = transformed(text, |function| {
            super::run(function);
            crate::simplify::run(function);
            crate::dce::run(function);
        });
        expect![[r#"
            %1: f32 = load member:m@0
            %2: f32 = add %0, %1
            %3: f32 = load member:m@1
            %4: f32 = add %2, %3
            %5: i32 = constant 2
            return scratch:f@0 = %4, scratch:i@0 = %5
        "#]]
        .assert_eq(&unrolled);
    }

    #[test]
    fn long_loops_and_unknown_ones_stay() {
        let text = "
            %0: i32 = constant 0 %1: i32 = constant 1 %17: i32 = constant 17
            %n: i32 = load scratch:i@0
            %a: i32 = loop (%i: i32 = %0) {
                %i2: i32 = add %i, %1 %c: bool = less %i2, %17 repeat %c, %i2
            }
            %b: i32 = loop (%j: i32 = %0) {
                %j2: i32 = add %j, %1 %d: bool = less %j2, %n repeat %d, %j2
            }
            return scratch:i@0 = %a, scratch:i@1 = %b";
        let unchanged = transformed(text, |_| ());
        assert_eq!(transformed(text, super::run), unchanged);
    }

    #[test]
    fn keeps_results() {
        check_preserves(super::run);
    }
}
