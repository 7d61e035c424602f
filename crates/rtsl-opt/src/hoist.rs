//! Loop-invariant motion: what gives the same value in every round is computed before the loop.
//!
//! Moved are operations without effects and regions whose operands all come from outside the
//! loop, from as many loops as that holds for. They are taken from the body of the loop and from
//! the `if`s that stand directly in it, since a `for` becomes a loop whose body is an `if`;
//! not from `if`s inside those, which more often are rare cases. All operations are defined
//! for all operands, so that computing one too many changes nothing.

use rtsl_ir::{Effect, Function, Op, OpKind, Place, Region};

/// Operations are taken from this many `if`s inside the body of a loop.
const MAX_IFS: u32 = 1;

/// Moves what it can in all of `function`.
pub fn run(function: &mut Function) {
    let mut body = std::mem::take(&mut function.body);
    let homes = vec![0; function.values.len()];
    let mut motion = Motion { places: &function.places, homes };
    motion.region(&mut body, Position { loops: 0, ifs: 0 }, &mut Vec::new());
    function.body = body;
}

/// Where a region is.
#[derive(Clone, Copy)]
struct Position {
    /// Inside so many loops.
    loops: u32,
    /// Inside so many `if`s within the innermost of them.
    ifs: u32,
}

struct Motion<'a> {
    places: &'a [Place],
    /// For each value in how many loops it is defined.
    homes: Vec<u32>,
}

impl Motion<'_> {
    /// Goes through a region; what leaves the innermost loop around it goes to `hoisted`.
    fn region(&mut self, region: &mut Region, at: Position, hoisted: &mut Vec<Op>) {
        for param in &region.params {
            self.homes[param.0 as usize] = at.loops;
        }
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            match &mut op.kind {
                OpKind::Loop { body, .. } => {
                    let mut from_body = Vec::new();
                    let inside = Position { loops: at.loops + 1, ifs: 0 };
                    self.region(body, inside, &mut from_body);
                    for op in from_body {
                        self.place(op, at, hoisted, &mut ops);
                    }
                    self.set_home(&op, at.loops);
                    ops.push(op);
                }
                OpKind::If { then, otherwise, .. } => {
                    let inside = Position { ifs: at.ifs + 1, ..at };
                    self.region(then, inside, hoisted);
                    self.region(otherwise, inside, hoisted);
                    self.set_home(&op, at.loops);
                    ops.push(op);
                }
                _ => self.place(op, at, hoisted, &mut ops),
            }
        }
        region.ops = ops;
    }

    /// Puts an operation without regions before the innermost loop, or where it is.
    fn place(&mut self, op: Op, at: Position, hoisted: &mut Vec<Op>, ops: &mut Vec<Op>) {
        if at.loops > 0 && at.ifs <= MAX_IFS && self.is_invariant(&op, at.loops) {
            self.set_home(&op, at.loops - 1);
            hoisted.push(op);
        } else {
            self.set_home(&op, at.loops);
            ops.push(op);
        }
    }

    fn is_invariant(&self, op: &Op, loops: u32) -> bool {
        let mut invariant = op.kind.effect(self.places) == Effect::None;
        op.kind.for_each_operand(|value| invariant &= self.homes[value.0 as usize] < loops);
        invariant
    }

    fn set_home(&mut self, op: &Op, loops: u32) {
        for value in op.results.iter() {
            self.homes[value.0 as usize] = loops;
        }
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::{check_preserves, transformed};

    #[test]
    fn invariants_leave_all_their_loops() {
        let text = "
            %x: f32 = load scratch:f@0 %c: bool = load scratch:b@0
            %r: f32 = loop (%p: f32 = %x) {
                %a: f32 = sqrt %x
                %s: f32 = loop (%q: f32 = %p) {
                    %b: f32 = add %a, %x
                    %d: f32 = add %p, %b
                    %e: f32 = add %q, %d
                    repeat %c, %e
                }
                repeat %c, %s
            }
            return scratch:f@0 = %r";
        expect![[r#"
            %2: f32 = sqrt %0
            %3: f32 = add %2, %0
            %4: f32 = loop (%5: f32 = %0) {
              %6: f32 = add %5, %3
              %7: f32 = loop (%8: f32 = %5) {
                %9: f32 = add %8, %6
                repeat %1, %9
              }
              repeat %1, %7
            }
            return scratch:f@0 = %4
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn the_guard_of_a_for_is_no_obstacle_and_a_rare_case_is() {
        let text = "
            %x: f32 = load scratch:f@0 %c: bool = load scratch:b@0
            loop () {
                %a: f32 = if %c {
                    %m: f32 = load member:m@0
                    store slot:s@0, %m
                    %b: f32 = if %c { %n: f32 = sqrt %x yield %n } else { yield %x }
                    yield %b
                } else { %r: f32 = load slot:s@0 yield %r }
                store slot:s@1, %a
                repeat %c
            }
            return";
        expect![[r#"
            %2: f32 = load member:m@0
            loop () {
              %3: f32 = if %1 {
                store slot:s@0, %2
                %4: f32 = if %1 {
                  %5: f32 = sqrt %0
                  yield %5
                } else {
                  yield %0
                }
                yield %4
              } else {
                %6: f32 = load slot:s@0
                yield %6
              }
              store slot:s@1, %3
              repeat %1
            }
            return
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn keeps_results() {
        check_preserves(super::run);
    }
}
